//! Errors of dynamics.
use tesdf::collide::CollideError;

/// Why a step or a state is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DynamicsError {
    /// The system has no body of this number.
    #[error("there is no body {body}; the system has {bodies}, counted from 0")]
    NoBody {
        /// The number that was given.
        body: usize,
        /// Number of bodies in the system.
        bodies: usize,
    },
    /// The system has no joint of this number.
    #[error("there is no joint {joint}; the system has {joints}, counted from 0")]
    NoJoint {
        /// The number that was given.
        joint: usize,
        /// Number of joints in the system.
        joints: usize,
    },
    /// The values of a joint do not fit.
    #[error("joint {name}: {reason}")]
    Joint {
        /// Name of the joint.
        name: String,
        /// What was found and what was expected.
        reason: String,
    },
    /// The engine cannot simulate something that the system has.
    #[error("{engine} does not simulate {what}; use the built-in engine")]
    Unsupported {
        /// Name of the engine.
        engine: &'static str,
        /// What the system has.
        what: &'static str,
    },
    /// A snapshot is of another engine.
    #[error("the snapshot is of another simulation; expected one of this simulation or of a copy of it")]
    OtherEngine,
    /// A body that is not free has no mass.
    #[error("body {body} ({name}) is {kind} and has no mass; only a free body has")]
    NoMass {
        /// Number of the body.
        body: usize,
        /// Its name.
        name: String,
        /// `fixed` or `kinematic`.
        kind: &'static str,
    },
    /// The number of states differs from the number of bodies.
    #[error("{found} states for {expected} bodies")]
    States {
        /// Number of states that were given.
        found: usize,
        /// Number of bodies.
        expected: usize,
    },
    /// A number of a given or computed state is not finite.
    #[error("the state of body {body} ({name}) is not finite: {found}")]
    NotFinite {
        /// Number of the body.
        body: usize,
        /// Its name.
        name: String,
        /// The state, as text.
        found: String,
    },
    /// The value of an option is out of range.
    #[error("{option} is {found}; expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        found: f64,
        /// The expected range.
        expected: &'static str,
    },
    /// An error of the scene or of the detection.
    #[error(transparent)]
    Collide(#[from] CollideError),
}
