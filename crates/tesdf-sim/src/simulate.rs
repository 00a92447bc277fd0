//! A scene from its beginning to its end.
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

use serde::Serialize;
use tesdf::collide::HiddenOverlap;

use crate::criterion::{ScrewReport, ScrewTracker};
use crate::scene_file::SceneFile;
use crate::{Dynamics, DynamicsError, RunRecord, StepReport, System};

/// Where a run is; given after each step.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Steps made.
    pub step: u64,
    /// Steps in all.
    pub steps: u64,
    /// Simulated time, s.
    pub time: f64,
    /// What the step did.
    pub report: StepReport,
    /// The bodies now.
    pub system: &'a System,
}

/// What a run came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Steps made.
    pub steps: u64,
    /// Simulated time, s.
    pub seconds: f64,
    /// Contacts per step, those ahead of time included.
    pub mean_contacts: f64,
    /// The most.
    pub most_contacts: usize,
    /// Greatest penetration that the detection saw at the beginning of a step, m; 0 when it saw none. Where contacts hide an overlap its
    /// depth is taken, at least.
    pub deepest_penetration: f64,
    /// Kinetic energy at the end, J.
    pub kinetic_energy: f64,
    /// Kinetic energy at the beginning and potential energy lost since, J.
    pub released_energy: f64,
    /// Solver iterations per step.
    pub mean_iterations: f64,
    /// Steps whose solution is not within the tolerance.
    pub unconverged_steps: u64,
    /// Wall time per step for detection, ms.
    pub detection_ms: f64,
    /// Wall time per step for the rest, ms.
    pub solution_ms: f64,
    /// Pairs of bodies that overlapped although no contact showed it, so that nothing kept them apart; sorted by bodies. A run with such
    /// pairs meets no criterion.
    pub hidden: Vec<HiddenPair>,
    /// The screw of the criterion.
    pub screw: Option<ScrewReport>,
    /// Whether the criterion holds; `None` without one.
    pub passed: Option<bool>,
}

/// Two bodies that overlapped although no contact showed it, during a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HiddenPair {
    /// Names of the bodies.
    pub bodies: [String; 2],
    /// The first step at whose beginning they did, from 0.
    pub first_step: u64,
    /// The number of such steps.
    pub steps: u64,
    /// The greatest depth, m, at least.
    pub depth: f64,
}

impl HiddenPair {
    /// A sentence for people.
    pub fn message(&self) -> String {
        let Self { bodies: [a, b], first_step, depth, .. } = self;
        format!("bodies {a} and {b} overlapped by {depth:.3e} m or more, from step {first_step} on, and no contact showed it")
    }
}

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// A step failed.
    #[error("step {step}: {source}")]
    Step {
        /// The step, from 0.
        step: u64,
        /// Why.
        source: DynamicsError,
    },
    /// The criterion does not fit the bodies.
    #[error("criterion: {0}")]
    Criterion(String),
    /// The caller broke off.
    #[error("interrupted after {steps} steps")]
    Interrupted {
        /// Steps made.
        steps: u64,
    },
}

/// Runs `engine`, which was made for `scene`, for the scene's duration. `watch` is called after each step and may break off.
///
/// # Errors
/// A step that failed, or the caller breaking off.
pub fn simulate(
    scene: &SceneFile,
    engine: &mut dyn Dynamics,
    mut watch: impl FnMut(&Moment<'_>) -> ControlFlow<()>,
) -> Result<(RunRecord, Summary), SimulateError> {
    let h = scene.time_step;
    let steps = ((scene.duration / h).round() as u64).max(1);
    let json = serde_json::to_value(scene).unwrap_or_default();
    let mut record = RunRecord::new(engine.system(), json);
    let tracker = scene.criterion.screw.as_ref().map(|screw| ScrewTracker::new(screw, engine.system()));
    let mut tracker = tracker.transpose().map_err(SimulateError::Criterion)?;
    let energy = engine.system().kinetic_energy() + engine.system().potential_energy();
    let mut totals = Totals::default();
    for step in 0..steps {
        let report = engine.step(h).map_err(|source| SimulateError::Step { step, source })?;
        let (system, time) = (engine.system(), (step + 1) as f64 * h);
        record.push(time, system);
        let every = u64::from(scene.record.contacts_every);
        if every > 0 && step % every == 0 {
            record.push_contacts(step, engine.contacts(), system);
        }
        if let Some(tracker) = &mut tracker {
            tracker.observe(system, h);
        }
        totals.add(&report);
        totals.add_hidden(step, engine.hidden(), system);
        let moment = Moment { step: step + 1, steps, time, report, system };
        if watch(&moment).is_break() {
            return Err(SimulateError::Interrupted { steps: step + 1 });
        }
    }
    let system = engine.system();
    let mut screw = tracker.map(|tracker| tracker.report(system));
    if let Some(screw) = &mut screw {
        screw.failures.extend(totals.hidden.values().map(HiddenPair::message));
    }
    let summary = Summary {
        seconds: steps as f64 * h,
        kinetic_energy: system.kinetic_energy(),
        released_energy: energy - system.potential_energy(),
        passed: screw.as_ref().map(|screw| screw.failures.is_empty()),
        screw,
        ..totals.summary()
    };
    Ok((record, summary))
}

#[derive(Default)]
struct Totals {
    steps: u64,
    contacts: usize,
    most: usize,
    deepest: f64,
    iterations: u64,
    unconverged: u64,
    /// By the numbers of the bodies.
    hidden: BTreeMap<[usize; 2], HiddenPair>,
    detection: Duration,
    solution: Duration,
}

impl Totals {
    fn add(&mut self, report: &StepReport) {
        self.steps += 1;
        self.contacts += report.contacts;
        self.most = self.most.max(report.contacts);
        self.deepest = self.deepest.max(-report.deepest.unwrap_or(0.0));
        self.iterations += u64::from(report.iterations);
        self.unconverged += u64::from(!report.converged);
        self.detection += report.detection;
        self.solution += report.solution;
    }

    fn add_hidden(&mut self, step: u64, overlaps: &[HiddenOverlap], system: &System) {
        for &HiddenOverlap { instance_a, instance_b, depth } in overlaps {
            let (Some(a), Some(b)) = (system.body_of(instance_a), system.body_of(instance_b)) else { continue };
            let bodies = [a, b].map(|body| system.bodies()[body].name.clone());
            let first = HiddenPair { bodies, first_step: step, steps: 0, depth };
            let pair = self.hidden.entry([a, b]).or_insert(first);
            pair.steps += 1;
            pair.depth = pair.depth.max(depth);
            self.deepest = self.deepest.max(depth);
        }
    }

    fn summary(self) -> Summary {
        let n = self.steps as f64;
        let ms = |d: Duration| d.as_secs_f64() * 1e3 / n;
        Summary {
            steps: self.steps,
            mean_contacts: self.contacts as f64 / n,
            most_contacts: self.most,
            deepest_penetration: self.deepest,
            mean_iterations: self.iterations as f64 / n,
            unconverged_steps: self.unconverged,
            detection_ms: ms(self.detection),
            solution_ms: ms(self.solution),
            hidden: self.hidden.into_values().collect(),
            ..Summary::default()
        }
    }
}
