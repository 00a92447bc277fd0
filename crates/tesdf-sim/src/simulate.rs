//! A scene from its beginning to its end.
use std::ops::ControlFlow;
use std::time::Duration;

use serde::Serialize;

use crate::criterion::{ScrewReport, ScrewTracker};
use crate::scene_file::{LimitError, SceneFile};
use crate::{Dynamics, DynamicsError, HiddenPair, RunRecord, StepReport, System};

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
    /// The run so far, this step included.
    pub record: &'a RunRecord,
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
    /// The scene is too large.
    #[error(transparent)]
    Limit(#[from] LimitError),
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

/// A run up to some step: the beginning of a new run, or a [`CutRun`](crate::CutRun) as it was read.
#[derive(Clone, Debug)]
pub struct PartialRun {
    /// All states so far.
    pub record: RunRecord,
    pub(crate) totals: Totals,
}

impl PartialRun {
    /// The beginning of a run of `scene`: the state of `system` now, at time 0. `folder` is what the scene's paths are relative to; empty: the
    /// folder of whoever reads the run.
    pub fn new(scene: &SceneFile, system: &System, folder: String) -> Self {
        let mut record = RunRecord::new(system, serde_json::to_value(scene).unwrap_or_default());
        record.folder = folder;
        Self { record, totals: Totals::default() }
    }

    /// Puts the bodies of `system` where the last step left them.
    ///
    /// # Errors
    /// The system has other bodies.
    pub fn restore(&self, system: &mut System) -> Result<(), DynamicsError> {
        system.set_states(self.record.states(self.record.steps() as usize).unwrap_or_default())
    }
}

/// Runs `engine`, which was made for `scene`, for the scene's duration. `watch` is called after each step and may break off.
///
/// # Errors
/// A step that failed, or the caller breaking off.
pub fn simulate(
    scene: &SceneFile,
    engine: &mut dyn Dynamics,
    watch: impl FnMut(&Moment<'_>) -> ControlFlow<()>,
) -> Result<(RunRecord, Summary), SimulateError> {
    let run = PartialRun::new(scene, engine.system(), String::new());
    simulate_from(scene, engine, run, watch)
}

/// As [`simulate`], from the last step of `run`, where `engine` is, too. Steps depend on the bodies' states alone, so the record is that of
/// a run that was never cut, bit for bit.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_from(
    scene: &SceneFile,
    engine: &mut dyn Dynamics,
    run: PartialRun,
    mut watch: impl FnMut(&Moment<'_>) -> ControlFlow<()>,
) -> Result<(RunRecord, Summary), SimulateError> {
    let h = scene.time_step;
    let steps = scene.steps()?;
    let (mut tracker, energy) = replay(scene, engine.system(), &run.record)?;
    let PartialRun { mut record, mut totals } = run;
    record.reserve(steps).map_err(|_| LimitError::memory(steps, record.bodies.len()))?;
    record.plan(Some(steps));
    for step in record.steps()..steps {
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
        record.push_hidden(step, engine.hidden(), system);
        let moment = Moment { step: step + 1, steps, time, report, system, record: &record };
        if watch(&moment).is_break() {
            return Err(SimulateError::Interrupted { steps: step + 1 });
        }
    }
    record.plan(None);
    let system = engine.system();
    let mut screw = tracker.map(|tracker| tracker.report(system));
    let hidden = record.hidden_pairs();
    if let Some(screw) = &mut screw {
        screw.failures.extend(hidden.iter().map(HiddenPair::message));
    }
    let sums = totals.summary();
    let depths = hidden.iter().map(|pair| pair.depth);
    let summary = Summary {
        seconds: steps as f64 * h,
        kinetic_energy: system.kinetic_energy(),
        released_energy: energy - system.potential_energy(),
        passed: screw.as_ref().map(|screw| screw.failures.is_empty()),
        screw,
        deepest_penetration: depths.fold(sums.deepest_penetration, f64::max),
        hidden,
        ..sums
    };
    Ok((record, summary))
}

/// Follows the criterion along the steps that are made; with the energy at the beginning.
fn replay(
    scene: &SceneFile,
    system: &System,
    record: &RunRecord,
) -> Result<(Option<ScrewTracker>, f64), SimulateError> {
    let mut system = system.clone();
    let show = |system: &mut System, step: u64| {
        let states = record.states(step as usize).unwrap_or_default();
        system.set_states(states).map_err(|source| SimulateError::Step { step, source })
    };
    show(&mut system, 0)?;
    let energy = system.kinetic_energy() + system.potential_energy();
    let Some(screw) = &scene.criterion.screw else { return Ok((None, energy)) };
    let mut tracker = ScrewTracker::new(screw, &system).map_err(SimulateError::Criterion)?;
    for step in 1..=record.steps() {
        show(&mut system, step)?;
        tracker.observe(&system, scene.time_step);
    }
    Ok((Some(tracker), energy))
}

/// Sums over the steps.
#[derive(Clone, Debug, Default)]
pub(crate) struct Totals {
    steps: u64,
    contacts: usize,
    most: usize,
    deepest: f64,
    iterations: u64,
    unconverged: u64,
    detection: Duration,
    solution: Duration,
}

impl Totals {
    pub(crate) fn add(&mut self, report: &StepReport) {
        self.steps += 1;
        self.contacts += report.contacts;
        self.most = self.most.max(report.contacts);
        self.deepest = self.deepest.max(-report.deepest.unwrap_or(0.0));
        self.iterations += u64::from(report.iterations);
        self.unconverged += u64::from(!report.converged);
        self.detection += report.detection;
        self.solution += report.solution;
    }

    fn summary(&self) -> Summary {
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
            ..Summary::default()
        }
    }
}
