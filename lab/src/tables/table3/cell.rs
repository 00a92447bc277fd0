//! One run of Table III, and what it says.
use std::ops::ControlFlow;
use std::time::Instant;

use serde::Serialize;
use tesdf::Length;
use tesdf::collide::{ClearanceOptions, CollideError, InstanceId, clearance};
use tesdf_sim::criterion::{InsertionCriterion, InsertionReport, ScrewCriterion, ScrewReport};
use tesdf_sim::newton::Detect;
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Moment, Summary, System, simulate};

use super::{Features, Scenario};
use tesdf_cli::terminal::report::Failure;

/// Measurements of the exact clearance in a run.
const MEASUREMENTS: u64 = 8;

/// Greatest penetration, as a fraction of the tolerance.
const MAX_PENETRATION: f64 = 0.2;

/// A run, and what it says.
#[derive(Clone, Debug, Serialize)]
pub struct Cell {
    /// Scene.
    pub scenario: &'static str,
    /// Tolerance, µm.
    pub tolerance_um: u32,
    /// Quality settings of the moving and the fixed body; null for encoded meshes.
    pub voxels: Option<[u32; 2]>,
    /// What is tested against the fields.
    pub features: Features,
    /// Time step, ms.
    pub time_step_ms: f64,
    /// Whether the run meets its criterion without deep penetration.
    pub success: bool,
    /// Names of the failures, sorted.
    pub reasons: Vec<&'static str>,
    /// The failures in words.
    pub failures: Vec<String>,
    /// Greatest penetration by the exact clearance, µm.
    pub penetration_um: f64,
    /// Travel along the axis, mm.
    pub travel_mm: f64,
    /// Mean number of contacts in a step.
    pub contacts: f64,
    /// Steps that were made.
    pub steps: u64,
    /// Wall time of a step, ms: detection, and the rest.
    pub step_ms: [f64; 2],
    /// Wall time of the run with its measurements, s.
    pub seconds: f64,
}

/// What a run is made of.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    pub scenario: Scenario,
    pub tolerance: u32,
    pub voxels: Option<[u32; 2]>,
    pub features: Features,
    /// Time step, ms.
    pub time_step: f64,
}

/// Names of failures. They are the words before the colon in an insertion report.
const NAMES: [&str; 6] = ["sticking", "tunnelling", "penetration", "jitter", "energy gain", "hidden overlap"];

impl Setup {
    /// Runs the scene. `progress` receives the completed fraction of the run.
    ///
    /// # Errors
    /// The scene does not fit the detector. A run that breaks down is a failed cell, not an error.
    pub fn run(
        &self,
        loaded: &LoadedScene,
        system: System,
        detector: impl Detect + 'static,
        progress: impl Fn(f64),
    ) -> Result<Cell, Failure> {
        let start = Instant::now();
        let pair = pair(&system, self.scenario.bodies());
        let (mut depth, mut steps) = (0.0_f64, 0);
        let mut unmeasured: Option<CollideError> = None;
        let mut engine = loaded.newton_with(system, detector).map_err(Failure::new)?;
        // The insertion criterion measures the clearance itself.
        let is_measured = loaded.scene.criterion.get::<InsertionCriterion>().is_none();
        let run = simulate(&loaded.scene, &mut engine, |moment: &Moment<'_>| {
            progress(moment.step as f64 / moment.steps as f64);
            steps = moment.step;
            let part = |step: u64| step * MEASUREMENTS / moment.steps;
            if is_measured && part(moment.step) != part(moment.step - 1) {
                match penetration(moment.system, pair, self.tolerance) {
                    Ok(found) => depth = depth.max(found),
                    Err(e) => unmeasured = Some(e),
                }
            }
            ControlFlow::Continue(())
        });
        let mut failures: Vec<(&'static str, String)> = Vec::new();
        let summary = match run {
            Ok((_, summary)) => summary,
            Err(e) => {
                failures.push(("breakdown", e.to_string()));
                Summary::default()
            }
        };
        failures.extend(of_criterion(&summary, loaded));
        let limit = MAX_PENETRATION * f64::from(self.tolerance) * 1e-6;
        if depth > limit {
            let text = format!("{depth:.3e} m by the exact clearance; expected at most {limit:.3e} m");
            failures.push(("penetration", text));
        }
        if let Some(e) = unmeasured {
            failures.push(("breakdown", e.to_string()));
        }
        let mut reasons: Vec<&'static str> = failures.iter().map(|(name, _)| *name).collect();
        reasons.sort_unstable();
        reasons.dedup();
        let insertion = summary.report::<InsertionReport>();
        let travel = summary.report::<ScrewReport>().map(|s| s.travel);
        let travel = travel.or(insertion.map(|i| i.travel)).unwrap_or(f64::NAN);
        Ok(Cell {
            scenario: self.scenario.name(),
            tolerance_um: self.tolerance,
            voxels: self.voxels,
            features: self.features,
            time_step_ms: self.time_step,
            success: failures.is_empty(),
            reasons,
            failures: failures.into_iter().map(|(name, text)| format!("{name}: {text}")).collect(),
            penetration_um: insertion.map_or(depth, |i| i.penetration) * 1e6,
            travel_mm: travel * 1e3,
            contacts: summary.mean_contacts,
            steps,
            step_ms: [summary.detection_ms, summary.solution_ms],
            seconds: start.elapsed().as_secs_f64(),
        })
    }
}

/// The failures of the scene's criterion, with their names.
fn of_criterion(summary: &Summary, loaded: &LoadedScene) -> Vec<(&'static str, String)> {
    let mut failures = Vec::new();
    let criterion = loaded.scene.criterion.get::<ScrewCriterion>();
    if let (Some(screw), Some(criterion)) = (summary.report::<ScrewReport>(), criterion) {
        let ScrewReport { turns, largest_pitch_error: error, .. } = *screw;
        let share = screw.acceleration / screw.analytic_acceleration;
        let mut demand = |met: bool, name: &'static str, text: String| {
            if !met {
                failures.push((name, text));
            }
        };
        demand(
            turns >= criterion.min_turns,
            "sticking",
            format!("{turns:.4} turns; expected at least {:.4}", criterion.min_turns),
        );
        demand(
            error <= criterion.backlash,
            "tunnelling",
            format!(
                "travel and turns × pitch differ by {error:.3e} m; the play is {:.3e} m",
                criterion.backlash
            ),
        );
        demand(
            share >= criterion.min_acceleration,
            "braking",
            format!(
                "{share:.3} of the acceleration of an ideal screw; expected at least {}",
                criterion.min_acceleration
            ),
        );
        demand(
            screw.energy <= criterion.max_energy,
            "energy gain",
            format!("{:.4} of the released energy is kinetic", screw.energy),
        );
    }
    if let Some(insertion) = summary.report::<InsertionReport>() {
        for failure in &insertion.failures {
            // The messages of hidden overlaps have no name.
            let named = failure.split_once(": ").and_then(|(name, text)| {
                Some((*NAMES.iter().find(|known| **known == name)?, text.to_string()))
            });
            failures.extend(named);
        }
    }
    failures.extend(summary.hidden.iter().map(|pair| ("hidden overlap", pair.message())));
    failures
}

/// The instances of the two bodies; `None` when one is missing.
fn pair(system: &System, names: [&str; 2]) -> Option<[InstanceId; 2]> {
    let find = |name| system.bodies().iter().find(|b| b.name == name).map(|b| b.instance);
    Some([find(names[0])?, find(names[1])?])
}

/// Penetration of the two bodies by their exact clearance, m; 0 when they do not overlap.
fn penetration(system: &System, pair: Option<[InstanceId; 2]>, tolerance: u32) -> Result<f64, CollideError> {
    let Some([a, b]) = pair else { return Ok(0.0) };
    let options = ClearanceOptions { tolerance: Length::Absolute(f64::from(tolerance) * 1e-9) };
    // The instances of the system have the poses of the last detection.
    let mut system = system.clone();
    let states = system.states().to_vec();
    Ok((-clearance(system.scene_at(&states)?, a, b, &options)?.distance).max(0.0))
}
