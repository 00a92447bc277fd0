use std::time::Duration;

use tesdf::collide::{Contact, HiddenOverlap};

use crate::{DynamicsError, Forces, Motor, State, System, Wrench};

/// A physics engine that moves the bodies of a [`System`].
pub trait Dynamics {
    /// The bodies and their current states.
    fn system(&self) -> &System;

    /// Sets the pose and the velocities of a body. The velocity of a fixed body has no effect.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`], or [`DynamicsError::NotFinite`] when a number of the state is not
    /// finite.
    fn set_state(&mut self, body: usize, state: State) -> Result<(), DynamicsError>;

    /// Replaces the motor of a joint.
    ///
    /// # Errors
    /// [`DynamicsError::NoJoint`], or [`DynamicsError::Joint`] when the motor does not fit the
    /// joint.
    fn set_motor(&mut self, joint: usize, motor: Option<Motor>) -> Result<(), DynamicsError>;

    /// Sets the wrench that acts on a body from now on.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`], or [`DynamicsError::NotFinite`].
    fn set_wrench(&mut self, body: usize, wrench: Wrench) -> Result<(), DynamicsError>;

    /// Takes over the states after a step of `time_step` seconds that was made before, without making
    /// it. An engine that remembers more than the states of its bodies follows a run that it continues
    /// this way: first the states at the beginning, without a time step, then those after each step,
    /// with what was set before it. It may ignore them when its steps depend on states alone.
    ///
    /// # Errors
    /// As [`System::set_states`].
    fn recall(&mut self, _states: Vec<State>, _time_step: Option<f64>) -> Result<(), DynamicsError> {
        Ok(())
    }

    /// After a number of steps that is a multiple of this, a step depends on what was
    /// [recalled](Self::recall) alone. Whoever continues a run makes the steps since then again.
    fn remembers(&self) -> u64 {
        1
    }

    /// Advances all bodies by `time_step` seconds.
    ///
    /// # Errors
    /// The time step is not a positive number, the detection refused the scene, or the state of a
    /// body stopped being finite. The states are then unchanged.
    fn step(&mut self, time_step: f64) -> Result<StepReport, DynamicsError>;

    /// The contacts at the beginning of the last step, in the order of the detector. They include
    /// speculative contacts, which the motion of the step could close.
    fn contacts(&self) -> &[Contact];

    /// The pairs of bodies that overlapped at the beginning of the last step without a contact that
    /// shows it.
    fn hidden(&self) -> &[HiddenOverlap];

    /// The forces of contacts and joints in the last step; `None` from an engine that does not tell.
    fn forces(&self) -> Option<&Forces> {
        None
    }
}

/// Statistics of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Number of contacts at the beginning of the step, including speculative contacts.
    pub contacts: usize,
    /// The smallest signed distance of these contacts, m; `None` when there are none.
    pub deepest: Option<f64>,
    /// Number of times that contacts were detected.
    pub detections: u32,
    /// Number of these detections that moved fast bodies to where they are hit.
    pub advances: u32,
    /// Number of islands in the last solve: groups of bodies that are solved independently.
    pub islands: usize,
    /// Number of free bodies that are asleep at the end of the step: nothing is solved for them until
    /// something touches or drives them.
    pub asleep: usize,
    /// Iterations of the slowest island, summed over all solves of the step.
    pub iterations: u32,
    /// Whether every solve reached its tolerance, and no pair is [`unbounded`](Self::unbounded).
    pub converged: bool,
    /// What solves left that did not; zero where all did.
    pub residual: Residual,
    /// Number of parts into which the step was divided, because a body turns far in it, joints
    /// would not hold, or where a fast pair would have passed.
    pub parts: u32,
    /// Number of motions of fast pairs, in parts of the step, that were followed by their time of
    /// impact.
    pub followed: u32,
    /// Number of parts that were solved and then divided because of what this has shown, or because
    /// joints did not hold.
    pub divided: u32,
    /// Number of these motions that were neither shown to be free nor to end at a small depth, when
    /// the part could not be divided any more: bodies may have passed into each other.
    pub unbounded: u32,
    /// Wall time of the detection.
    pub detection: Duration,
    /// Wall time of everything else.
    pub solution: Duration,
}

/// How far motion and forces are from those that the laws of contact, of joints and of momentum ask
/// for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Residual {
    /// The greatest way of a contact, a joint or a point of a body in the step, m.
    pub way: f64,
    /// The greatest force on a body, or by which friction differs from its law, N; of torsional
    /// friction N m.
    pub force: f64,
}

impl Residual {
    /// The greater ones.
    pub(crate) fn max(self, other: Self) -> Self {
        Self { way: self.way.max(other.way), force: self.force.max(other.force) }
    }
}

/// How well solves came out.
#[derive(Clone, Copy)]
pub(crate) struct Verdict {
    converged: bool,
    residual: Residual,
}

impl Verdict {
    /// Before the first solve.
    pub(crate) const GOOD: Self = Self { converged: true, residual: Residual { way: 0.0, force: 0.0 } };
}

impl StepReport {
    /// Before the first solve.
    pub(crate) fn begun() -> Self {
        Self { converged: true, ..Self::default() }
    }

    /// How well the solves so far came out.
    pub(crate) fn verdict(&self) -> Verdict {
        Verdict { converged: self.converged, residual: self.residual }
    }

    /// Takes back what was said of solves since this verdict: they are of no account.
    pub(crate) fn take_back(&mut self, to: Verdict) {
        (self.converged, self.residual) = (to.converged, to.residual);
    }

    /// Adds what a later part of the same step did.
    pub(crate) fn add(&mut self, later: &Self) {
        self.detections += later.detections;
        self.advances += later.advances;
        self.followed += later.followed;
        self.divided += later.divided;
        self.unbounded += later.unbounded;
        self.islands = self.islands.max(later.islands);
        self.iterations += later.iterations;
        self.converged &= later.converged;
        self.residual = self.residual.max(later.residual);
        self.detection += later.detection;
        self.solution += later.solution;
    }
}
