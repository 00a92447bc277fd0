use std::time::Duration;

use tesdf::collide::{CollideError, Contact, HiddenOverlap};

use crate::{State, System};

/// An engine that moves the bodies of a [`System`].
pub trait Dynamics {
    /// The bodies and their states now.
    fn system(&self) -> &System;

    /// Places a body and sets its velocity; the velocity of a fixed body is not used.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`], and [`DynamicsError::NotFinite`] for numbers that are no state.
    fn set_state(&mut self, body: usize, state: State) -> Result<(), DynamicsError>;

    /// Moves all bodies by `time_step` seconds.
    ///
    /// # Errors
    /// The time step is no positive number, the detection refused the scene, or a body's state stopped being finite. The
    /// states are then as they were.
    fn step(&mut self, time_step: f64) -> Result<StepReport, DynamicsError>;

    /// The contacts at the beginning of the last step, those ahead of time included; sorted as the detector sorts.
    fn contacts(&self) -> &[Contact];

    /// The pairs that overlapped at the beginning of the last step although no contact showed it.
    fn hidden(&self) -> &[HiddenOverlap];
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Contacts at the beginning of the step, those ahead of time included.
    pub contacts: usize,
    /// The least signed distance among them; `None` without contacts.
    pub deepest: Option<f64>,
    /// How often contacts were detected.
    pub detections: u32,
    /// Groups of bodies that were solved by themselves, in the last solve.
    pub islands: usize,
    /// Iterations of the slowest island, over all solves of the step.
    pub iterations: u32,
    /// Whether every solve reached its tolerance.
    pub converged: bool,
    /// Time spent on detection.
    pub detection: Duration,
    /// Time spent on everything else.
    pub solution: Duration,
}

/// Why a step, or a state, is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DynamicsError {
    /// No such body.
    #[error("there is no body {body}; the system has {bodies}, counted from 0")]
    NoBody {
        /// The number given.
        body: usize,
        /// How many there are.
        bodies: usize,
    },
    /// Not as many states as bodies.
    #[error("{found} states for {expected} bodies")]
    States {
        /// How many were given.
        found: usize,
        /// How many bodies there are.
        expected: usize,
    },
    /// A number that is not finite, in a state given or computed.
    #[error("the state of body {body} ({name}) is not finite: {found}")]
    NotFinite {
        /// The body.
        body: usize,
        /// Its name.
        name: String,
        /// The state.
        found: String,
    },
    /// An option has a value that makes no sense.
    #[error("{option} is {found}; expected {expected}")]
    Option {
        /// The option's name.
        option: &'static str,
        /// Its value.
        found: f64,
        /// What was expected.
        expected: &'static str,
    },
    /// The scene or the detection.
    #[error(transparent)]
    Collide(#[from] CollideError),
}
