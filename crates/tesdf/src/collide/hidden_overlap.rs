use serde::Serialize;

use super::InstanceId;

/// Two bodies that overlap although no contact of theirs shows it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HiddenOverlap {
    /// The instance of the lower id.
    pub instance_a: InstanceId,
    /// The instance of the higher id.
    pub instance_b: InstanceId,
    /// How deep one body is in the other, at least, in the world's unit: how far a point of the one is inside of the other, or the radius
    /// of a ball that is inside of both.
    pub depth: f64,
}

impl HiddenOverlap {
    /// From this depth on, as a share of the lesser of the [inner balls](super::Shape::inner_ball) of the bodies, an overlap is found.
    pub const SURE: f64 = 0.5;
    /// From this depth on it is found where few looks are enough; nothing less deep is told.
    pub const FINE: f64 = 0.05;
    /// Looks at a face for what is less deep than [`SURE`](Self::SURE).
    pub const FINE_LOOKS: u32 = 4;
    /// Looks at the faces of a body after which a search gives up. Plates a thousandth as thick as wide that lie on each other would take a
    /// million.
    pub const MAX_LOOKS: u32 = 1 << 14;
    /// An overlap is hidden when it is more than so many times as deep as the deepest contact.
    pub const SHOWN: f64 = 2.0;
}
