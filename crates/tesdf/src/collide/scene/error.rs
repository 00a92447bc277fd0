use crate::collide::scene::ids::{InstanceId, ShapeId};

/// Why a scene or a detection is refused. The scene is unchanged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CollideError {
    /// The numbers are not a rigid motion.
    #[error("not a pose: {found}; expected {expected}")]
    NotAPose {
        /// The numbers found.
        found: String,
        /// The conditions of a pose.
        expected: &'static str,
    },
    /// An instance has an invalid state.
    #[error("instance {instance}: {reason}")]
    Instance {
        /// The instance, or its index in the list that was to be added.
        instance: u32,
        /// What was found and what was expected.
        reason: String,
    },
    /// The instance was removed or never existed.
    #[error("instance {} is not in the scene; it was removed, or belongs to another scene", .0.0)]
    NoInstance(InstanceId),
    /// The shape was removed or never existed.
    #[error("shape {} is not in the scene; it was removed, or belongs to another scene", .0.0)]
    NoShape(ShapeId),
    /// The shape is still in use.
    #[error("shape {} is used by instance {}; remove its instances first", .shape.0, .instance.0)]
    ShapeInUse {
        /// The shape.
        shape: ShapeId,
        /// The instance with the lowest id that uses it.
        instance: InstanceId,
    },
    /// A shape has an invalid size.
    #[error("{shape}: {found}; expected {expected}")]
    Shape {
        /// Kind of the shape.
        shape: &'static str,
        /// The size found.
        found: String,
        /// The expected size.
        expected: &'static str,
    },
    /// Too many pairs of instances are close to each other.
    #[error(
        "more than {limit} pairs of instances come near each other; expected fewer: spread them out, or keep them apart by worlds, \
         groups or exclusions"
    )]
    TooManyPairs {
        /// Largest accepted number of pairs.
        limit: usize,
    },
    /// Two instances have no clearance.
    #[error("instances {a} and {b} have no clearance: {reason}")]
    NoClearance {
        /// The first instance.
        a: InstanceId,
        /// The second instance.
        b: InstanceId,
        /// The reason and what was expected.
        reason: &'static str,
    },
    /// An option has an invalid value.
    #[error("{option} is {found}; expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// The value found.
        found: String,
        /// The expected value.
        expected: &'static str,
    },
    /// An option that the mode does not use.
    #[error(
        "{option} has no effect in the mode `{mode}`, only in {modes}; leave it out, or choose such a mode"
    )]
    NotOfMode {
        /// Name of the option.
        option: &'static str,
        /// Name of the mode.
        mode: &'static str,
        /// The modes that use the option.
        modes: &'static str,
    },
    /// Another thread asked the detection to stop.
    #[error("the detection was stopped")]
    Stopped,
    /// A detector on another device failed.
    #[error("{0}")]
    Device(String),
}
