//! Worlds for control and learning: they are set, stepped and begun again, and keep no history.
use std::sync::Arc;

use rayon::prelude::*;

use crate::newton::{Newton, Snapshot};
use crate::record::HiddenPairs;
use crate::scene_file::SceneFile;
use crate::script::Scripts;
use crate::totals::Totals;
use crate::warning::{Watch, energies, of_hidden};
use crate::{Dynamics, DynamicsError, Mass, Motor, Run, SimulateError, State, StepReport, Warning};

/// The bodies of a scene in motion: an engine, the scripts that drive it, and its time. A clone
/// shares meshes and scripts.
#[derive(Clone)]
pub struct World {
    engine: Newton,
    beginning: Arc<Beginning>,
    /// The steps since the beginning.
    made: Made,
}

/// The steps that a world has made since its beginning.
#[derive(Clone, Debug)]
struct Made {
    totals: Totals,
    watch: Watch,
    hidden: HiddenPairs,
}

impl Made {
    /// Notes a step that begins with the energies `before`, J, and ends at `time`, s.
    fn add(&mut self, engine: &dyn Dynamics, report: &StepReport, before: [f64; 2], time: f64) {
        let system = engine.system();
        self.hidden.add(self.totals.steps, engine.hidden(), system);
        self.totals.add(report);
        self.watch.observe(system, before, time);
    }
}

/// How a world begins, and what drives it.
struct Beginning {
    states: Vec<State>,
    masses: Vec<Mass>,
    motors: Vec<Option<Motor>>,
    scripts: Scripts,
    made: Made,
    /// s
    time_step: f64,
}

/// A moment of a [`World`].
#[derive(Clone, Debug)]
pub struct WorldSnapshot {
    engine: Snapshot,
    made: Made,
}

impl World {
    /// A world at its time 0, with `engine` made for `scene`.
    ///
    /// # Errors
    /// [`SimulateError::Script`] when a script does not match the bodies and joints.
    pub fn new(scene: &SceneFile, engine: Newton) -> Result<Self, SimulateError> {
        let system = engine.system();
        let (totals, watch) = (Totals::default(), Watch::new(scene, system));
        let made = Made { totals, watch, hidden: HiddenPairs::default() };
        let beginning = Beginning {
            states: system.states().to_vec(),
            masses: system.bodies().iter().map(|body| body.mass).collect(),
            motors: system.joints().iter().map(|joint| joint.motor).collect(),
            scripts: Scripts::new(&scene.scripts, system).map_err(SimulateError::Script)?,
            made: made.clone(),
            time_step: scene.time_step,
        };
        Ok(Self { engine, beginning: Arc::new(beginning), made })
    }

    /// The engine.
    pub fn engine(&self) -> &Newton {
        &self.engine
    }

    /// The engine, to set states, motors, wrenches, masses, friction and gravity.
    pub fn engine_mut(&mut self) -> &mut Newton {
        &mut self.engine
    }

    /// Number of steps since the beginning.
    pub fn steps(&self) -> u64 {
        self.made.totals.steps
    }

    /// Number of steps since the beginning that did not converge ([`StepReport::converged`]).
    pub fn unconverged_steps(&self) -> u64 {
        self.made.totals.unconverged
    }

    /// What the steps since the beginning did not do as the scene asks, and the overlap of the
    /// present states, which is measured for this.
    pub fn warnings(&self) -> Vec<Warning> {
        let (system, Made { totals, watch, hidden }) = (self.engine.system(), &self.made);
        let time = |step: u64| step as f64 * self.time_step();
        let hidden = hidden.pairs(|body| system.bodies()[body].name.clone());
        let mut warnings: Vec<_> = hidden.iter().map(|pair| of_hidden(pair, time(pair.first_step))).collect();
        warnings.extend(watch.overlap(system, self.time()));
        warnings.extend(watch.so_far(system, totals));
        warnings
    }

    /// Time since the beginning, s.
    pub fn time(&self) -> f64 {
        self.steps() as f64 * self.beginning.time_step
    }

    /// The time step, s.
    pub fn time_step(&self) -> f64 {
        self.beginning.time_step
    }

    /// The states at the beginning.
    pub fn first_states(&self) -> &[State] {
        &self.beginning.states
    }

    /// The masses at the beginning. One that is scaled from these does not depend on those set
    /// before.
    pub fn first_masses(&self) -> &[Mass] {
        &self.beginning.masses
    }

    /// Makes a step.
    ///
    /// # Errors
    /// [`SimulateError::Step`]; the states are then those before the step.
    pub fn step(&mut self) -> Result<StepReport, SimulateError> {
        let Self { engine, beginning, made } = self;
        let (step, h) = (made.totals.steps, beginning.time_step);
        let failed = |source| SimulateError::Step { step, source };
        beginning.scripts.drive(engine, step as f64 * h, h).map_err(failed)?;
        let before = energies(engine.system());
        let report = engine.step(h).map_err(failed)?;
        made.add(engine, &report, before, (step + 1) as f64 * h);
        Ok(report)
    }

    /// Makes a step of `run`, a run of this world's scene and engine, which records it.
    ///
    /// # Errors
    /// As [`Run::step`].
    pub fn step_of(&mut self, run: &mut Run) -> Result<(), SimulateError> {
        let before = energies(self.engine.system());
        let moment = run.step(&mut self.engine)?;
        let (report, time) = (moment.report, moment.time);
        self.made.add(&self.engine, &report, before, time);
        Ok(())
    }

    /// Begins again at time 0 with these states, or those at the [beginning](Self::first_states).
    /// Motors are those of the scene, and wrenches zero. Masses, friction and gravity stay as they
    /// were set. The steps from there on have the same bytes as those of a new world.
    ///
    /// # Errors
    /// As [`Newton::reset`]; nothing changes then.
    pub fn reset(&mut self, states: Option<Vec<State>>) -> Result<(), DynamicsError> {
        let Self { engine, beginning, .. } = self;
        engine.reset(states.unwrap_or_else(|| beginning.states.clone()))?;
        beginning.motors.iter().enumerate().try_for_each(|(joint, motor)| engine.set_motor(joint, *motor))?;
        self.made = self.beginning.made.clone();
        Ok(())
    }

    /// What [`restore`](Self::restore) needs to go back to this moment.
    pub fn snapshot(&self) -> WorldSnapshot {
        WorldSnapshot { engine: self.engine.snapshot(), made: self.made.clone() }
    }

    /// Goes back to a snapshot of this world or of a clone.
    ///
    /// # Errors
    /// As [`Newton::restore`].
    pub fn restore(&mut self, snapshot: &WorldSnapshot) -> Result<(), DynamicsError> {
        self.engine.restore(&snapshot.engine)?;
        self.made = snapshot.made.clone();
        Ok(())
    }
}

/// Worlds of one scene, which do not meet. All threads of the current rayon pool step them, and
/// each world has the same bytes as it has alone.
#[derive(Clone)]
pub struct Worlds(Vec<World>);

/// Why worlds were not all stepped.
#[derive(Debug, thiserror::Error)]
#[error("world {world}: {source}")]
pub struct WorldError {
    /// The first world whose step failed.
    pub world: usize,
    /// Its error.
    pub source: SimulateError,
}

impl Worlds {
    /// `count` clones of a world.
    pub fn new(world: &World, count: usize) -> Self {
        Self(vec![world.clone(); count])
    }

    /// The worlds.
    pub fn as_slice(&self) -> &[World] {
        &self.0
    }

    /// The worlds, to set or reset them.
    pub fn as_mut_slice(&mut self) -> &mut [World] {
        &mut self.0
    }

    /// Makes `count` steps of each world.
    ///
    /// # Errors
    /// [`WorldError`]. The world stays as it was before the failed step; the others make all their
    /// steps.
    pub fn step(&mut self, count: u64) -> Result<(), WorldError> {
        let step = |(world, it): (usize, &mut World)| {
            let made = (0..count).try_for_each(|_| it.step().map(|_| ()));
            made.err().map(|source| WorldError { world, source })
        };
        // Worlds take longer or shorter, so each is a task of its own.
        let failed: Vec<_> = self.0.par_iter_mut().enumerate().with_max_len(1).map(step).collect();
        failed.into_iter().flatten().next().map_or(Ok(()), Err)
    }
}
