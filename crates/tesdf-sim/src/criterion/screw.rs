//! A body moves along a thread; and the analytic screw that it is compared with.
use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use tesdf::base::elementary;
use tesdf::collide::Pose;
use tesdf::glam::DVec3;

use super::measure::{free_body, positive, unit};
use super::{Criterion, Report, Rows, Tracker};
use crate::{MassProperties, System};

/// The body moves along a thread: at every step its travel along the axis differs from its number
/// of turns times the pitch by at most the backlash.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScrewCriterion {
    /// Name of the body.
    pub body: String,
    /// Direction of the expected motion: a unit vector in the world frame.
    pub axis: [f64; 3],
    /// Travel per turn of a right-handed thread, m.
    pub pitch: f64,
    /// Minimum number of turns that the body makes.
    pub min_turns: f64,
    /// Maximum difference between the travel and turns × pitch, m.
    pub backlash: f64,
    /// Minimum acceleration along the axis, as a fraction of the acceleration of an ideal screw.
    #[serde(default)]
    pub min_acceleration: f64,
    /// Maximum kinetic energy at the end of the run, as a fraction of the potential energy lost
    /// since the beginning.
    #[serde(default = "no_gain")]
    pub max_energy: f64,
}

/// Energy must not grow. The extra 0.1 % allows for rounding and for the energy that the springs of
/// the contacts store.
fn no_gain() -> f64 {
    1.001
}

/// Result of a screw criterion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScrewReport {
    /// Travel of the centre of mass along the axis, m.
    pub travel: f64,
    /// Turns about the axis, right-handed.
    pub turns: f64,
    /// Largest difference between the travel and turns × pitch at any step, m.
    pub largest_pitch_error: f64,
    /// Mean acceleration along the axis over the second half of the run, m/s².
    pub acceleration: f64,
    /// Acceleration of an ideal frictionless screw, m/s².
    pub analytic_acceleration: f64,
    /// Travel as a fraction of the travel of the ideal screw.
    pub travel_of_analytic: f64,
    /// Kinetic energy at the end, as a fraction of the potential energy lost since the beginning.
    pub energy: f64,
    /// The requirements that the run did not meet; empty when it passed.
    pub failures: Vec<String>,
}

impl Criterion for ScrewCriterion {
    const NAME: &str = "screw";
    type Tracker = ScrewTracker;

    /// Checks the values, and that the body exists and is free.
    fn check(&self, system: &System) -> Result<Vec<String>, String> {
        unit(self.axis)?;
        positive([
            ("pitch", self.pitch),
            ("min_turns", self.min_turns),
            ("backlash", self.backlash),
            ("max_energy", self.max_energy),
        ])?;
        if !(self.min_acceleration >= 0.0 && self.min_acceleration.is_finite()) {
            let found = self.min_acceleration;
            return Err(format!("min_acceleration is {found}; expected a number, 0 or greater"));
        }
        self.find(system).map(|_| Vec::new())
    }

    fn track(&self, system: &System) -> Result<ScrewTracker, String> {
        ScrewTracker::new(self, system)
    }
}

impl ScrewCriterion {
    fn find(&self, system: &System) -> Result<(usize, MassProperties), String> {
        free_body(system, &self.body, "turn")
    }
}

/// Acceleration, m/s², of an ideal frictionless screw along its axis.
///
/// `along` is the acceleration that acts along the axis, m/s², `gyration` the radius of gyration k,
/// m, and `pitch` the pitch p, m. The result is `along` / (1 + (k / (p / 2π))²): the rest of the
/// work turns the body.
pub fn screw_acceleration(along: f64, gyration: f64, pitch: f64) -> f64 {
    along / (1.0 + elementary::powi(gyration * TAU / pitch, 2))
}

/// Records the travel and the turns of one body during a run.
#[derive(Clone, Debug)]
pub struct ScrewTracker {
    criterion: ScrewCriterion,
    axis: DVec3,
    body: usize,
    mass: MassProperties,
    analytic: f64,
    energy: f64,
    last: Pose,
    turns: f64,
    time: f64,
    largest_pitch_error: f64,
    /// For each step the time at its end, s, and the travel until then, m.
    path: Vec<(f64, f64)>,
}

impl ScrewTracker {
    /// A tracker that starts from the current state of `system`.
    ///
    /// # Errors
    /// The same errors as [`ScrewCriterion::check`].
    pub fn new(criterion: &ScrewCriterion, system: &System) -> Result<Self, String> {
        criterion.check(system)?;
        let (body, mass) = criterion.find(system)?;
        let axis = unit(criterion.axis)?;
        let last = system.states()[body].pose;
        let gyration = mass.radius_of_gyration(last.rotation.inverse() * axis);
        Ok(Self {
            criterion: criterion.clone(),
            axis,
            body,
            mass,
            analytic: screw_acceleration(system.gravity.dot(axis), gyration, criterion.pitch),
            energy: system.kinetic_energy() + system.potential_energy(),
            last,
            turns: 0.0,
            time: 0.0,
            largest_pitch_error: 0.0,
            path: vec![(0.0, 0.0)],
        })
    }

    /// Travel along the axis so far, m.
    pub fn travel(&self) -> f64 {
        self.path.last().map_or(0.0, |(_, travel)| *travel)
    }

    /// Turns about the axis so far.
    pub fn turns(&self) -> f64 {
        self.turns
    }

    /// Slope of the velocity over the second half of the run, by least squares.
    fn acceleration(&self) -> f64 {
        let velocities: Vec<(f64, f64)> = self.path[self.path.len() / 2..]
            .windows(2)
            .map(|w| (0.5 * (w[0].0 + w[1].0), (w[1].1 - w[0].1) / (w[1].0 - w[0].0)))
            .collect();
        let n = velocities.len() as f64;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| velocities.iter().map(f).sum::<f64>() / n;
        let (t, v) = (mean(&|p| p.0), mean(&|p| p.1));
        mean(&|p| (p.0 - t) * (p.1 - v)) / mean(&|p| elementary::powi(p.0 - t, 2))
    }
}

impl Tracker for ScrewTracker {
    type Report = ScrewReport;

    fn observe(&mut self, system: &System, time_step: f64) {
        let pose = system.states()[self.body].pose;
        let turn = elementary::to_scaled_axis(pose.rotation * self.last.rotation.inverse()).dot(self.axis);
        self.turns += turn / TAU;
        let moved = pose.to_world(self.mass.center) - self.last.to_world(self.mass.center);
        let travel = self.travel() + moved.dot(self.axis);
        self.time += time_step;
        self.path.push((self.time, travel));
        self.last = pose;
        let error = (travel - self.turns * self.criterion.pitch).abs();
        self.largest_pitch_error = self.largest_pitch_error.max(error);
    }

    fn report(&self, system: &System) -> ScrewReport {
        let kinetic = system.kinetic_energy();
        let criterion = &self.criterion;
        let mut report = ScrewReport {
            travel: self.travel(),
            turns: self.turns,
            largest_pitch_error: self.largest_pitch_error,
            acceleration: self.acceleration(),
            analytic_acceleration: self.analytic,
            travel_of_analytic: self.travel() / (0.5 * self.analytic * self.time * self.time),
            energy: kinetic / (self.energy - system.potential_energy()),
            failures: Vec::new(),
        };
        let mut demand = |met: bool, text: String| {
            if !met {
                report.failures.push(text);
            }
        };
        let (error, backlash) = (self.largest_pitch_error, criterion.backlash);
        demand(
            self.turns >= criterion.min_turns,
            format!("{:.4} turns; expected at least {}", self.turns, criterion.min_turns),
        );
        demand(
            error <= backlash,
            format!("travel and turns × pitch differ by {error:.3e} m; expected at most {backlash:.3e} m"),
        );
        let share = self.acceleration() / self.analytic;
        demand(
            share >= criterion.min_acceleration,
            format!(
                "{share:.3} of the acceleration of an ideal screw; expected at least {}",
                criterion.min_acceleration
            ),
        );
        let energy = kinetic / (self.energy - system.potential_energy());
        demand(
            energy <= criterion.max_energy,
            format!(
                "the kinetic energy is {energy:.4} of the lost potential energy; expected at most {}",
                criterion.max_energy
            ),
        );
        report
    }
}

impl Report for ScrewReport {
    fn failures(&mut self) -> &mut Vec<String> {
        &mut self.failures
    }

    fn rows(&self) -> Rows {
        vec![
            (
                "screw",
                format!(
                    "{:.4} mm and {:.4} turns, at most {:.1} µm from the pitch",
                    self.travel * 1e3,
                    self.turns,
                    self.largest_pitch_error * 1e6
                ),
            ),
            (
                "acceleration",
                format!(
                    "{:.3e} m/s², ideal screw {:.3e} m/s²; {:.1} % of the ideal travel",
                    self.acceleration,
                    self.analytic_acceleration,
                    100.0 * self.travel_of_analytic
                ),
            ),
        ]
    }
}
