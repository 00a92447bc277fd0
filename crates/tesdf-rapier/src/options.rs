use rapier3d_f64::dynamics::{FrictionModel, IntegrationParameters, SpringCoefficients};
use tesdf_sim::DynamicsError;

/// Parameters of Rapier's solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RapierOptions {
    /// Number of solver substeps per step; 4 to 8 for close fits.
    pub substeps: usize,
    /// Natural frequency of a contact, Hz. With Rapier's defaults of 30 and 60 Hz a nut sinks into
    /// its thread.
    pub contact_frequency: f64,
    /// Damping ratio of a contact.
    pub contact_damping: f64,
    /// Rapier's length unit, m: Rapier's tolerances are made for parts of about this size. The
    /// default is 1 cm.
    pub length_unit: f64,
    /// Maximum reach of speculative contacts, m. Up to this distance Rapier considers contacts that
    /// the velocities of the two bodies' centres can close in a step. With 0 it considers only
    /// contacts within the contact distance.
    pub speculative_distance: f64,
}

impl Default for RapierOptions {
    fn default() -> Self {
        Self {
            substeps: 8,
            contact_frequency: 1000.0,
            contact_damping: 10.0,
            length_unit: 0.01,
            speculative_distance: 0.01,
        }
    }
}

impl RapierOptions {
    /// Rapier's parameters for close fits. `time_step` is in s, and contacts reach up to
    /// `contact_distance`, m.
    ///
    /// These values differ from Rapier's defaults, in addition to the fields of this type:
    /// - Contacts are not clustered, because a cluster gives many contacts one normal. They are not
    ///   recycled, because recycled contacts are not exact.
    /// - The prediction distance is the contact distance. With the default of 20 mm the whole
    ///   thread of a nut would be in contact.
    /// - The velocity has no maximum. The default follows from the length unit and would be 4 m/s.
    /// - Friction follows Coulomb's law in each contact, because Rapier's simplified model needs
    ///   manifolds of several points.
    pub fn parameters(&self, time_step: f64, contact_distance: f64) -> IntegrationParameters {
        let softness = SpringCoefficients::new(self.contact_frequency, self.contact_damping);
        IntegrationParameters {
            dt: time_step,
            num_solver_iterations: self.substeps,
            contact_softness: softness,
            static_contact_softness: softness,
            length_unit: self.length_unit,
            normalized_prediction_distance: contact_distance / self.length_unit,
            normalized_max_linear_velocity: f64::MAX,
            contact_clustering: false,
            contact_recycling: false,
            friction_model: FrictionModel::Coulomb,
            ..IntegrationParameters::default()
        }
    }

    /// Checks that every value is in its range.
    ///
    /// # Errors
    /// [`DynamicsError::Option`] names the first option that is out of range.
    pub fn validate(&self) -> Result<(), DynamicsError> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let not_negative = |x: f64| x >= 0.0 && x.is_finite();
        let above = "a finite number greater than 0";
        let from = "a finite number, 0 or greater";
        let checks = [
            ("substeps", self.substeps as f64, self.substeps > 0, "at least 1"),
            ("contact_frequency", self.contact_frequency, positive(self.contact_frequency), above),
            ("contact_damping", self.contact_damping, not_negative(self.contact_damping), from),
            ("length_unit", self.length_unit, positive(self.length_unit), above),
            (
                "speculative_distance",
                self.speculative_distance,
                not_negative(self.speculative_distance),
                from,
            ),
        ];
        match checks.into_iter().find(|&(_, _, good, _)| !good) {
            Some((option, found, _, expected)) => Err(DynamicsError::Option { option, found, expected }),
            None => Ok(()),
        }
    }
}
