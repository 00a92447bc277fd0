use serde::{Deserialize, Serialize};

use crate::DynamicsError;

/// How the embedded engine solves a step. Every field is used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NewtonOptions {
    /// κ: stiffness of a contact, in units of what its two bodies' inertia gives within one step. Measured on a pile of 128
    /// shafts: 10 is too soft, 1000 overshoots; a nut on a bolt does not care from 1e2 to 1e6.
    pub stiffness: f64,
    /// β: share of a penetration that one step removes.
    pub correction: f64,
    /// At most this fast, m/s.
    pub correction_speed: f64,
    /// How often contacts are detected again at the predicted pose: 0, 1, or 2 where accuracy matters.
    pub redetections: u32,
    /// No re-detection for bodies that penetrate deeper than this share of the diagonal of the smaller one: linear
    /// predictions of a deep overlap inject energy. The default is 10 µm for a part of 3 cm.
    pub deep: f64,
    /// Contacts are taken ahead of time as far as the motion of this many steps can close. With a fixed distance instead a
    /// peg of 50 µm clearance tunnelled at steps of 5 ms.
    pub speculation: f64,
    /// Islands of up to so many free bodies, at most 256, are solved by dense Cholesky, larger ones by conjugate gradients.
    pub dense_bodies: usize,
    /// A solve ends when the decrease that its next iteration promises is below the square of this, as a share of the energy.
    pub tolerance: f64,
    /// Iterations after which a solve ends anyway, at most 10000.
    pub max_iterations: u32,
}

const MAX_ITERATIONS: u32 = 10_000;
const MAX_DENSE_BODIES: usize = 256;

impl Default for NewtonOptions {
    fn default() -> Self {
        Self {
            stiffness: 100.0,
            correction: 0.5,
            correction_speed: 0.5,
            redetections: 1,
            deep: 3e-4,
            speculation: 1.2,
            dense_bodies: 12,
            tolerance: 1e-8,
            max_iterations: 50,
        }
    }
}

impl NewtonOptions {
    /// Checks that every value makes sense.
    ///
    /// # Errors
    /// Names the option.
    pub fn validate(&self) -> Result<(), DynamicsError> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let share = |x: f64| (0.0..=1.0).contains(&x);
        let checks = [
            ("stiffness", self.stiffness, positive(self.stiffness), "a finite number greater than 0"),
            ("correction", self.correction, share(self.correction), "0 to 1"),
            (
                "correction_speed",
                self.correction_speed,
                self.correction_speed == 0.0 || positive(self.correction_speed),
                "a finite number, 0 or greater",
            ),
            ("redetections", f64::from(self.redetections), self.redetections <= 2, "0, 1 or 2"),
            ("deep", self.deep, self.deep == 0.0 || positive(self.deep), "a finite number, 0 or greater"),
            (
                "speculation",
                self.speculation,
                self.speculation == 0.0 || positive(self.speculation),
                "a finite number, 0 or greater",
            ),
            (
                "tolerance",
                self.tolerance,
                self.tolerance > 0.0 && self.tolerance < 1.0,
                "greater than 0, less than 1",
            ),
            (
                "max_iterations",
                f64::from(self.max_iterations),
                (1..=MAX_ITERATIONS).contains(&self.max_iterations),
                "1 to 10000",
            ),
            (
                "dense_bodies",
                self.dense_bodies as f64,
                self.dense_bodies <= MAX_DENSE_BODIES,
                "at most 256: the matrix grows with the square of their number",
            ),
        ];
        match checks.into_iter().find(|&(_, _, good, _)| !good) {
            Some((option, found, _, expected)) => Err(DynamicsError::Option { option, found, expected }),
            None => Ok(()),
        }
    }
}
