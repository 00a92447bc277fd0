use glam::DVec3;

/// A ball inside of the solid, in the local frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct InnerBall {
    /// Its middle.
    pub center: DVec3,
    /// Its radius; 0 when none was found, as of a solid without volume.
    pub radius: f64,
}
