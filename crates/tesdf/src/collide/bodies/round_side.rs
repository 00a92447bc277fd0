//! The round side of a cylinder, in the frame of a field.
use glam::DVec3;

/// All points at a distance from an axis.
#[derive(Clone, Copy, Debug)]
pub struct RoundSide {
    /// A point of the axis.
    pub center: DVec3,
    /// Its direction.
    pub axis: DVec3,
    /// The distance.
    pub radius: f64,
}

impl RoundSide {
    /// The way from the axis to a point, perpendicular to the axis.
    pub fn beside(&self, p: DVec3) -> DVec3 {
        (p - self.center).reject_from_normalized(self.axis)
    }

    /// The nearest point of the round side.
    pub fn nearest(&self, p: DVec3) -> DVec3 {
        let beside = self.beside(p);
        p + (self.radius * beside.normalize_or_zero() - beside)
    }

    /// The distance of two points as seen along the axis.
    pub fn chord(&self, p: DVec3, q: DVec3) -> f64 {
        (q - p).reject_from_normalized(self.axis).length()
    }
}
