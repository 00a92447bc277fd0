use glam::DVec3;

/// A ball inside of the solid, in the local frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct InnerBall {
    /// Its centre.
    pub center: DVec3,
    /// Its radius. 0 when no ball was found, for example in a solid without volume.
    pub radius: f64,
}
