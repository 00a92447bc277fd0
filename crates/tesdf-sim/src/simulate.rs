//! Simulates a scene over its duration.
use std::ops::ControlFlow;
use std::sync::OnceLock;
use std::time::Duration;

use serde::Serialize;

use crate::criterion::{CriterionReport, JointDrift, Report, Trackers, by_name};
use crate::scene_file::{LimitError, RecordSection, SceneFile};
use crate::script::Scripts;
use crate::totals::Totals;
use crate::warning::{Warning, Watch, energies};
use crate::{Dynamics, DynamicsError, Forces, HiddenPair, RunRecord, State, StepReport, System};

/// Summary of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Number of steps.
    pub steps: u64,
    /// Simulated time, s.
    pub seconds: f64,
    /// Mean number of contacts per step, including speculative contacts.
    pub mean_contacts: f64,
    /// Largest number of contacts in a step.
    pub most_contacts: usize,
    /// Greatest penetration that the detection found at the beginning of a step, m; 0 when it found
    /// none. For a hidden overlap this uses the lower bound of its depth.
    pub deepest_penetration: f64,
    /// Kinetic energy at the end, J.
    pub kinetic_energy: f64,
    /// Kinetic energy at the beginning plus the potential energy lost during the run, J.
    pub released_energy: f64,
    /// Linear momentum of all free bodies at the end, kg m/s, world frame.
    pub momentum: [f64; 3],
    /// Angular momentum of all free bodies about the world's origin at the end, kg m²/s.
    pub angular_momentum: [f64; 3],
    /// How far joints came apart; `None` when the scene has none.
    pub joint_drift: Option<JointDrift>,
    /// Mean number of solver iterations per step.
    pub mean_iterations: f64,
    /// Number of steps whose solution did not reach the tolerance.
    pub unconverged_steps: u64,
    /// Number of bodies that are asleep at the end.
    pub asleep: usize,
    /// Mean wall time of the detection per step, ms.
    pub detection_ms: f64,
    /// Mean wall time of the rest of a step, ms.
    pub solution_ms: f64,
    /// Pairs of bodies that overlapped without a contact that shows it, so that nothing kept them
    /// apart; sorted by the numbers of the bodies. A run with such pairs meets no criterion.
    pub hidden: Vec<HiddenPair>,
    /// What the run did not do as the scene asks.
    pub warnings: Vec<Warning>,
    /// Results of the scene's criteria. As JSON each is a field of the summary, with the name of the
    /// criterion.
    #[serde(flatten, serialize_with = "by_name")]
    pub criteria: Vec<CriterionReport>,
    /// Whether the criteria hold; `None` when the scene has none.
    pub passed: Option<bool>,
}

impl Summary {
    /// The result of a criterion, such as [`RestReport`](crate::criterion::RestReport); `None` when the
    /// scene does not have this criterion.
    pub fn report<R: Report>(&self) -> Option<&R> {
        self.criteria.iter().find_map(CriterionReport::report)
    }
}

/// The state of a run after a step.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Number of steps so far.
    pub step: u64,
    /// Number of steps of the whole run.
    pub steps: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Statistics of the step.
    pub report: StepReport,
    /// The bodies after the step.
    pub system: &'a System,
    /// The forces of the step; `None` from an engine that does not tell.
    pub forces: Option<&'a Forces>,
    /// The run so far, including this step.
    pub record: &'a RunRecord,
}

/// Why a run ended before its duration.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// A step failed.
    #[error("step {step}: {source}")]
    Step {
        /// Number of the step, from 0.
        step: u64,
        /// The error of the step.
        source: DynamicsError,
    },
    /// The scene exceeds a limit.
    #[error(transparent)]
    Limit(#[from] LimitError),
    /// The criterion does not match the bodies.
    #[error("criterion: {0}")]
    Criterion(String),
    /// A script does not match the bodies and joints.
    #[error("{0}")]
    Script(String),
    /// The scene records forces, but the engine does not tell them.
    #[error(
        "[record] has forces_every, but this engine tells no forces; remove it or use the built-in engine"
    )]
    NoForces,
    /// The caller stopped the run.
    #[error("interrupted after {steps} steps")]
    Interrupted {
        /// Number of steps made.
        steps: u64,
    },
}

/// A run up to some step: either a new run, or an [`InterruptedRun`](crate::InterruptedRun) that
/// was read.
#[derive(Clone, Debug)]
pub struct PartialRun {
    /// All states so far.
    pub record: RunRecord,
    pub(crate) totals: Totals,
}

impl PartialRun {
    /// A new run of `scene` that starts from the current state of `system` at time 0. `folder` is
    /// the folder that the scene's paths are relative to; empty means the current folder of the
    /// reader of the run.
    pub fn new(scene: &SceneFile, system: &System, folder: String) -> Self {
        let mut record = RunRecord::new(system, serde_json::to_value(scene).unwrap_or_default());
        record.folder = folder;
        Self { record, totals: Totals::default() }
    }

    /// Sets the bodies of `system` to the states after the last step.
    ///
    /// # Errors
    /// [`DynamicsError::States`] when the system has another number of bodies.
    pub fn restore(&self, system: &mut System) -> Result<(), DynamicsError> {
        system.set_states(self.record.states(self.record.steps() as usize).unwrap_or_default())
    }
}

/// Runs `engine`, which must be made for `scene`, for the scene's duration. `watch` is called after
/// each step and may stop the run.
///
/// # Errors
/// A step failed, the scene exceeds a limit, the criterion does not match, or `watch` stopped the
/// run.
pub fn simulate(
    scene: &SceneFile,
    engine: &mut dyn Dynamics,
    watch: impl FnMut(&Moment<'_>) -> ControlFlow<()>,
) -> Result<(RunRecord, Summary), SimulateError> {
    let run = PartialRun::new(scene, engine.system(), String::new());
    simulate_from(scene, engine, run, watch)
}

/// As [`simulate`], but continues from the last step of `run`; `engine` must have the states of
/// that step, and nothing else behind it. It [recalls](Dynamics::recall) the steps of `run`, so the
/// record equals that of an uninterrupted run, bit for bit.
///
/// # Errors
/// The same errors as [`simulate`].
pub fn simulate_from(
    scene: &SceneFile,
    engine: &mut dyn Dynamics,
    run: PartialRun,
    mut watch: impl FnMut(&Moment<'_>) -> ControlFlow<()>,
) -> Result<(RunRecord, Summary), SimulateError> {
    let mut run = Run::new(scene, engine.system(), run)?;
    run.recall(engine)?;
    while !run.is_complete() {
        let moment = run.step(engine)?;
        if watch(&moment).is_break() {
            return Err(SimulateError::Interrupted { steps: moment.step });
        }
    }
    let summary = run.summary(engine.system());
    Ok((run.into_record(engine.system()), summary))
}

/// A run that is made step by step. [`simulate_from`] makes all steps.
#[derive(Clone, Debug)]
pub struct Run {
    record: RunRecord,
    totals: Totals,
    /// The trackers after the steps so far.
    trackers: Trackers,
    watch: Watch,
    scripts: Scripts,
    /// Energy at time 0, J.
    energy: f64,
    time_step: f64,
    /// Number of steps of the whole run.
    steps: u64,
    /// What is recorded of which steps.
    recorded: RecordSection,
    /// The first states since the last step whose overlaps were measured, and what they were.
    overlap: OnceLock<(Vec<State>, Option<Warning>)>,
}

impl Run {
    /// Continues `run`, a run of `scene`. `system` is that of the engine that will make the steps,
    /// which must have the states of the last step of `run`.
    ///
    /// # Errors
    /// The scene exceeds a limit, or its criterion or a script does not match.
    pub fn new(scene: &SceneFile, system: &System, run: PartialRun) -> Result<Self, SimulateError> {
        let steps = scene.steps()?;
        let PartialRun { mut record, totals } = run;
        let mut system = system.clone();
        let show = |system: &mut System, step: u64| {
            let states = record.states(step as usize).unwrap_or_default();
            system.set_states(states).map_err(|source| SimulateError::Step { step, source })
        };
        show(&mut system, 0)?;
        let energy = system.kinetic_energy() + system.potential_energy();
        let scripts = Scripts::new(&scene.scripts, &system).map_err(SimulateError::Script)?;
        let mut trackers = Trackers::new(&scene.criterion, &system).map_err(SimulateError::Criterion)?;
        let mut watch = Watch::new(scene, &system);
        for step in 1..=record.steps() {
            let before = energies(&system);
            // Whether something does work decides what is told of the energy.
            let begin = (step - 1) as f64 * scene.time_step;
            scripts
                .load(&mut system, begin, scene.time_step)
                .map_err(|source| SimulateError::Step { step, source })?;
            show(&mut system, step)?;
            trackers.observe(&system, scene.time_step);
            watch.observe(&system, before, step as f64 * scene.time_step);
        }
        record.reserve(steps).map_err(|_| LimitError::memory(steps, record.bodies.len()))?;
        record.plan(Some(steps));
        Ok(Self {
            record,
            totals,
            trackers,
            watch,
            scripts,
            energy,
            time_step: scene.time_step,
            steps,
            recorded: scene.record,
            overlap: OnceLock::new(),
        })
    }

    /// Lets `engine` recall the steps so far, and make the last ones again.
    fn recall(&self, engine: &mut dyn Dynamics) -> Result<(), SimulateError> {
        let (steps, h) = (self.record.steps(), self.time_step);
        let recalled = steps - steps % engine.remembers().max(1);
        for step in 0..=steps {
            let failed = |source| SimulateError::Step { step, source };
            if let Some(before) = step.checked_sub(1) {
                self.scripts.drive(engine, before as f64 * h, h).map_err(failed)?;
            }
            let states = self.record.states(step as usize).unwrap_or_default();
            if step <= recalled {
                engine.recall(states, (step > 0).then_some(h)).map_err(failed)?;
                continue;
            }
            engine.step(h).map_err(failed)?;
            // Another version of the program may have made the record.
            for (body, state) in states.into_iter().enumerate() {
                if engine.system().states().get(body) != Some(&state) {
                    engine.set_state(body, state).map_err(failed)?;
                }
            }
        }
        Ok(())
    }

    /// Makes one step with `engine`. The scene's duration does not limit the number of steps.
    ///
    /// # Errors
    /// [`SimulateError::Step`] or [`SimulateError::NoForces`]; the record then ends before the
    /// step.
    pub fn step<'a>(&'a mut self, engine: &'a mut dyn Dynamics) -> Result<Moment<'a>, SimulateError> {
        let (step, h) = (self.record.steps(), self.time_step);
        let failed = |source| SimulateError::Step { step, source };
        self.scripts.drive(engine, step as f64 * h, h).map_err(failed)?;
        let before = energies(engine.system());
        let report = engine.step(h).map_err(failed)?;
        let is_due = |every: u32| every > 0 && step.is_multiple_of(every.into());
        if is_due(self.recorded.forces_every) {
            self.record.push_forces(step, engine.forces().ok_or(SimulateError::NoForces)?);
        }
        let (system, time) = (engine.system(), (step + 1) as f64 * h);
        self.record.push(time, system);
        if is_due(self.recorded.contacts_every) {
            self.record.push_contacts(step, engine.contacts(), system);
        }
        self.trackers.observe(system, h);
        self.watch.observe(system, before, time);
        self.totals.add(&report);
        self.record.push_hidden(step, engine.hidden(), system);
        self.record.tell(self.watch.so_far(system, &self.totals));
        self.overlap = OnceLock::new();
        let (steps, forces) = (self.steps, engine.forces());
        Ok(Moment { step: step + 1, steps, time, report, system, forces, record: &self.record })
    }

    /// Whether all steps of the scene's duration are made.
    pub fn is_complete(&self) -> bool {
        self.record.steps() >= self.steps
    }

    /// Number of steps of the scene's duration.
    pub fn planned_steps(&self) -> u64 {
        self.steps
    }

    /// All states so far.
    pub fn record(&self) -> &RunRecord {
        &self.record
    }

    /// All states so far, without the rest of the run, and the warnings of
    /// [`summary`](Self::summary). With all steps made, the record is complete. `system` is that of
    /// the engine after the last step.
    pub fn into_record(mut self, system: &System) -> RunRecord {
        let told = self.told(system);
        self.record.tell(told);
        if self.is_complete() {
            self.record.plan(None);
        }
        self.record
    }

    /// The warnings, without those of hidden overlaps.
    fn told(&self, system: &System) -> Vec<Warning> {
        let mut told: Vec<Warning> = self.overlap(system).into_iter().collect();
        told.extend(self.watch.so_far(system, &self.totals));
        told
    }

    /// The warning of overlaps at the end. It is measured once after each step, unless the caller
    /// moves bodies in between.
    fn overlap(&self, system: &System) -> Option<Warning> {
        let time = self.record.steps() as f64 * self.time_step;
        let measure = || (system.states().to_vec(), self.watch.overlap(system, time));
        let (states, overlap) = self.overlap.get_or_init(measure);
        match states == system.states() {
            true => overlap.clone(),
            false => measure().1,
        }
    }

    /// Summary of the steps so far. `system` is that of the engine after the last step.
    pub fn summary(&self, system: &System) -> Summary {
        let hidden = self.record.hidden_pairs();
        let messages: Vec<String> = hidden.iter().map(HiddenPair::message).collect();
        let criteria = self.trackers.report(system, &messages);
        let passed = (!criteria.is_empty()).then(|| criteria.iter().all(|report| report.failures.is_empty()));
        let sums = sums(&self.totals);
        let depths = hidden.iter().map(|pair| pair.depth);
        let (momentum, angular_momentum) = system.momentum();
        let mut warnings = self.record.hidden_warnings(&hidden);
        warnings.extend(self.told(system));
        Summary {
            momentum: momentum.to_array(),
            angular_momentum: angular_momentum.to_array(),
            joint_drift: self.watch.drift(),
            seconds: self.record.steps() as f64 * self.time_step,
            kinetic_energy: system.kinetic_energy(),
            released_energy: self.energy - system.potential_energy(),
            passed,
            criteria,
            warnings,
            deepest_penetration: depths.fold(sums.deepest_penetration, f64::max),
            hidden,
            ..sums
        }
    }
}

/// The part of a summary that follows from the sums.
fn sums(totals: &Totals) -> Summary {
    let n = totals.steps as f64;
    let ms = |d: Duration| d.as_secs_f64() * 1e3 / n;
    Summary {
        steps: totals.steps,
        mean_contacts: totals.contacts as f64 / n,
        most_contacts: totals.most,
        deepest_penetration: totals.deepest,
        mean_iterations: totals.iterations as f64 / n,
        unconverged_steps: totals.unconverged,
        asleep: totals.asleep,
        detection_ms: ms(totals.detection),
        solution_ms: ms(totals.solution),
        ..Summary::default()
    }
}
