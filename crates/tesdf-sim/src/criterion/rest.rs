//! Bodies stay where they are.
use serde::{Deserialize, Serialize};
use tesdf::base::elementary;
use tesdf::collide::{CollideError, Pose};

use super::{Criterion, Report, Rows, Tracker};
use crate::{Mass, System};

/// Every free body stays where it is, and the bodies gain no energy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RestCriterion {
    /// Time from which the bodies have to stay, s. They may settle before.
    #[serde(default)]
    pub after: f64,
    /// Maximum distance that a point of a body moves, m.
    pub max_drift: f64,
    /// Maximum energy that the bodies gain, kinetic and potential together, J. Rounding alone gains
    /// some.
    pub max_energy_gain: f64,
}

/// Result of a rest criterion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RestReport {
    /// Name of the body that moved most.
    pub body: String,
    /// Upper bound of the distance that a point of it moved, at any step, m: the way of its centre
    /// of mass, plus its rotation times the diagonal of its bounding box.
    pub drift: f64,
    /// The most energy that the bodies had gained at a step, J; negative when they lost energy at
    /// every step.
    pub energy_gain: f64,
    /// The requirements that the run did not meet; empty when it passed.
    pub failures: Vec<String>,
}

impl Criterion for RestCriterion {
    const NAME: &str = "rest";
    type Tracker = RestTracker;

    /// Checks the values.
    fn check(&self, _: &System) -> Result<Vec<String>, String> {
        let range = |x: f64| x >= 0.0 && x.is_finite();
        let values =
            [("after", self.after), ("max_drift", self.max_drift), ("max_energy_gain", self.max_energy_gain)];
        match values.into_iter().find(|&(_, value)| !range(value)) {
            Some((key, value)) => Err(format!("{key} is {value}; expected a finite number, 0 or greater")),
            None => Ok(Vec::new()),
        }
    }

    fn track(&self, system: &System) -> Result<RestTracker, String> {
        RestTracker::new(self, system)
    }
}

/// Records how far the bodies of a run drift, and the energy that they gain.
#[derive(Clone, Debug)]
pub struct RestTracker {
    criterion: RestCriterion,
    time: f64,
    /// The poses and the energy, J, from which the drift and the gain are counted; `None` before
    /// that time.
    start: Option<(Vec<Pose>, f64)>,
    /// Diagonal of the bounding box of each body, m.
    sizes: Vec<f64>,
    body: String,
    drift: f64,
    energy_gain: f64,
}

impl RestTracker {
    /// A tracker that starts from the current state of `system`.
    ///
    /// # Errors
    /// The same errors as [`RestCriterion::check`].
    pub fn new(criterion: &RestCriterion, system: &System) -> Result<Self, String> {
        criterion.check(system)?;
        let diagonals = system.bodies().iter().map(|body| system.diagonal(body));
        let sizes = diagonals.collect::<Result<_, CollideError>>();
        let sizes = sizes.map_err(|e| e.to_string())?;
        let (criterion, body) = (criterion.clone(), String::new());
        let mut tracker = Self {
            criterion,
            time: 0.0,
            start: None,
            sizes,
            body,
            drift: 0.0,
            energy_gain: f64::NEG_INFINITY,
        };
        tracker.begin(system);
        Ok(tracker)
    }

    /// Takes the current state as the start if its time has come.
    fn begin(&mut self, system: &System) {
        if self.time >= self.criterion.after {
            let poses = system.states().iter().map(|state| state.pose).collect();
            self.start = Some((poses, system.kinetic_energy() + system.potential_energy()));
        }
    }
}

impl Tracker for RestTracker {
    type Report = RestReport;

    fn observe(&mut self, system: &System, time_step: f64) {
        self.time += time_step;
        let Some((poses, energy)) = &self.start else { return self.begin(system) };
        let gain = system.kinetic_energy() + system.potential_energy() - energy;
        self.energy_gain = self.energy_gain.max(gain);
        for (k, body) in system.bodies().iter().enumerate() {
            let Mass::Free(mass) = body.mass else { continue };
            let (from, to) = (poses[k], system.states()[k].pose);
            let way = to.to_world(mass.center).distance(from.to_world(mass.center));
            // The arc sine keeps small angles, which the arc cosine rounds away.
            let turn =
                elementary::asin((to.rotation * from.rotation.inverse()).xyz().length().min(1.0)) * 2.0;
            let drift = way + turn * self.sizes[k];
            if drift > self.drift || self.body.is_empty() {
                (self.drift, self.body) = (drift, body.name.clone());
            }
        }
    }

    fn report(&self, _: &System) -> RestReport {
        let RestCriterion { after, max_drift, max_energy_gain } = self.criterion;
        let mut failures = Vec::new();
        if self.body.is_empty() {
            failures.push(format!("no free body was followed: the run has no step after {after} s"));
        } else {
            if self.drift > max_drift {
                let (body, drift) = (&self.body, self.drift);
                failures.push(format!("{body} drifts by {drift:.3e} m; expected at most {max_drift:.3e} m"));
            }
            if self.energy_gain > max_energy_gain {
                let gain = self.energy_gain;
                failures.push(format!("{gain:.3e} J are gained; expected at most {max_energy_gain:.3e} J"));
            }
        }
        let (body, drift, energy_gain) = (self.body.clone(), self.drift, self.energy_gain);
        RestReport { body, drift, energy_gain, failures }
    }
}

impl Report for RestReport {
    fn failures(&mut self) -> &mut Vec<String> {
        &mut self.failures
    }

    fn rows(&self) -> Rows {
        let nanometres = self.drift * 1e9;
        vec![
            ("rest", format!("{} moves most, by at most {nanometres:.3} nm", self.body)),
            ("energy gain", format!("{:.2e} J", self.energy_gain)),
        ]
    }
}
