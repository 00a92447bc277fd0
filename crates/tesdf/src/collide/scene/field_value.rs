use glam::DVec3;

use crate::geometry::Feature;
use crate::query::LocalAnswer;

/// The value of a field at a point, in the field's frame.
#[derive(Clone, Copy, Debug)]
pub struct FieldValue {
    /// Signed distance.
    pub distance: f64,
    /// Its unit gradient.
    pub gradient: DVec3,
    /// The nearest point of the surface.
    pub closest_point: DVec3,
    /// The nearest face: its index in the asset, or its number in a simple shape.
    pub position: u32,
    /// The feature of that face.
    pub feature: Feature,
}

impl FieldValue {
    /// The same for the distance without its sign.
    pub fn unsigned(self) -> Self {
        if self.distance < 0.0 {
            Self { distance: -self.distance, gradient: -self.gradient, ..self }
        } else {
            self
        }
    }
}

impl From<LocalAnswer> for FieldValue {
    fn from(found: LocalAnswer) -> Self {
        let LocalAnswer { signed_distance: distance, gradient, closest_point, position, feature } = found;
        Self { distance, gradient, closest_point, position, feature }
    }
}
