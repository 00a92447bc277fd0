//! Worlds for control and learning: they are set, stepped and begun again, and keep no history.
use std::sync::Arc;

use rayon::prelude::*;

use crate::newton::{Newton, Snapshot};
use crate::scene_file::SceneFile;
use crate::script::Scripts;
use crate::{Dynamics, DynamicsError, Mass, Moment, Motor, Run, SimulateError, State, StepReport};

/// The bodies of a scene in motion: an engine, the scripts that drive it, and its time. A clone
/// shares meshes and scripts.
#[derive(Clone)]
pub struct World {
    engine: Newton,
    beginning: Arc<Beginning>,
    /// Number of steps since the beginning.
    steps: u64,
}

/// How a world begins, and what drives it.
struct Beginning {
    states: Vec<State>,
    masses: Vec<Mass>,
    motors: Vec<Option<Motor>>,
    scripts: Scripts,
    /// s
    time_step: f64,
}

/// A moment of a [`World`].
#[derive(Clone, Debug)]
pub struct WorldSnapshot {
    engine: Snapshot,
    steps: u64,
}

impl World {
    /// A world at its time 0, with `engine` made for `scene`.
    ///
    /// # Errors
    /// [`SimulateError::Script`] when a script does not match the bodies and joints.
    pub fn new(scene: &SceneFile, engine: Newton) -> Result<Self, SimulateError> {
        let system = engine.system();
        let beginning = Beginning {
            states: system.states().to_vec(),
            masses: system.bodies().iter().map(|body| body.mass).collect(),
            motors: system.joints().iter().map(|joint| joint.motor).collect(),
            scripts: Scripts::new(&scene.scripts, system).map_err(SimulateError::Script)?,
            time_step: scene.time_step,
        };
        Ok(Self { engine, beginning: Arc::new(beginning), steps: 0 })
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
        self.steps
    }

    /// Time since the beginning, s.
    pub fn time(&self) -> f64 {
        self.steps as f64 * self.beginning.time_step
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
        let Self { engine, beginning, steps } = self;
        let h = beginning.time_step;
        let failed = |source| SimulateError::Step { step: *steps, source };
        beginning.scripts.drive(engine, *steps as f64 * h, h).map_err(failed)?;
        let report = engine.step(h).map_err(failed)?;
        *steps += 1;
        Ok(report)
    }

    /// Makes a step of `run`, a run of this world's scene and engine, which records it.
    ///
    /// # Errors
    /// As [`Run::step`].
    pub fn step_of<'a>(&'a mut self, run: &'a mut Run) -> Result<Moment<'a>, SimulateError> {
        let moment = run.step(&mut self.engine)?;
        self.steps = moment.step;
        Ok(moment)
    }

    /// Begins again at time 0 with these states, or those at the [beginning](Self::first_states).
    /// Motors are those of the scene, and wrenches zero. Masses, friction and gravity stay as they
    /// were set. The steps from there on have the same bytes as those of a new world.
    ///
    /// # Errors
    /// As [`Newton::reset`]; nothing changes then.
    pub fn reset(&mut self, states: Option<Vec<State>>) -> Result<(), DynamicsError> {
        let Self { engine, beginning, steps } = self;
        engine.reset(states.unwrap_or_else(|| beginning.states.clone()))?;
        beginning.motors.iter().enumerate().try_for_each(|(joint, motor)| engine.set_motor(joint, *motor))?;
        *steps = 0;
        Ok(())
    }

    /// What [`restore`](Self::restore) needs to go back to this moment.
    pub fn snapshot(&self) -> WorldSnapshot {
        WorldSnapshot { engine: self.engine.snapshot(), steps: self.steps }
    }

    /// Goes back to a snapshot of this world or of a clone.
    ///
    /// # Errors
    /// As [`Newton::restore`].
    pub fn restore(&mut self, snapshot: &WorldSnapshot) -> Result<(), DynamicsError> {
        self.engine.restore(&snapshot.engine)?;
        self.steps = snapshot.steps;
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
