use super::{InstanceId, ShapeId};

/// Why a scene or a detection is refused. Nothing was changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CollideError {
    /// Numbers that are no rigid motion.
    #[error("not a pose: {found}; expected {expected}")]
    NotAPose {
        /// What was given.
        found: String,
        /// What a pose is.
        expected: &'static str,
    },
    /// An instance has a part that cannot be.
    #[error("instance {instance}: {reason}")]
    Instance {
        /// The instance, or the place in the list that was to be added.
        instance: u32,
        /// What was found, and what was expected.
        reason: String,
    },
    /// An instance that was removed, or never was.
    #[error("instance {} is not in the scene; it was removed, or belongs to another scene", .0.0)]
    NoInstance(InstanceId),
    /// A shape that was removed, or never was.
    #[error("shape {} is not in the scene; it was removed, or belongs to another scene", .0.0)]
    NoShape(ShapeId),
    /// A shape that is still used.
    #[error("shape {} is used by instance {}; remove its instances first", .shape.0, .instance.0)]
    ShapeInUse {
        /// The shape.
        shape: ShapeId,
        /// One of its instances, the one of the lowest id.
        instance: InstanceId,
    },
    /// The sizes of a shape.
    #[error("{shape}: {found}; expected {expected}")]
    Shape {
        /// Which shape.
        shape: &'static str,
        /// What was given.
        found: String,
        /// What was expected.
        expected: &'static str,
    },
    /// More instances on top of each other than can be looked at.
    #[error(
        "more than {limit} pairs of instances come near each other; expected fewer: spread them out, or keep them apart by worlds, \
         groups or exclusions"
    )]
    TooManyPairs {
        /// The most that are looked at.
        limit: usize,
    },
    /// Two instances that have no distance.
    #[error("instances {a} and {b} have no clearance: {reason}")]
    NoClearance {
        /// The one.
        a: InstanceId,
        /// The other.
        b: InstanceId,
        /// Why not, and what was expected.
        reason: &'static str,
    },
    /// An option has a value that makes no sense.
    #[error("{option} is {found}; expected {expected}")]
    Option {
        /// The option's name.
        option: &'static str,
        /// Its value.
        found: String,
        /// What was expected.
        expected: &'static str,
    },
    /// A detector of another device has failed.
    #[error("{0}")]
    Device(String),
}
