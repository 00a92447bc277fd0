use serde::Serialize;

use crate::collide::scene::ids::InstanceId;

/// Two bodies that overlap although none of their contacts shows it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HiddenOverlap {
    /// The instance with the lower id.
    pub instance_a: InstanceId,
    /// The instance with the higher id.
    pub instance_b: InstanceId,
    /// Lower bound of the depth, in the world's unit: how far a point of one body is inside the
    /// other, or the radius of a ball inside both.
    pub depth: f64,
}

impl HiddenOverlap {
    /// Overlaps at least this deep are found. A fraction of the smaller of the bodies' [inner
    /// balls](crate::collide::Shape::inner_ball).
    pub const SURE: f64 = 0.5;
    /// Overlaps at least this deep are found when few evaluations are enough: one for each face,
    /// and [`FINE_LOOKS`](Self::FINE_LOOKS) more. Shallower overlaps are never reported. A fraction
    /// as for [`SURE`](Self::SURE).
    pub const FINE: f64 = 0.05;
    /// Number of evaluations per body, besides one for each face, in the search for depths below
    /// [`SURE`](Self::SURE).
    pub const FINE_LOOKS: u32 = 128;
    /// Number of evaluations per body after which a search gives up. Two plates with a thickness of
    /// a thousandth, lying on each other, would need a million.
    pub const MAX_LOOKS: u32 = 1 << 14;
    /// An overlap is hidden when it is more than this many times as deep as the deepest contact.
    pub const SHOWN: f64 = 2.0;
}
