use glam::DVec3;

use crate::geometry::Feature;
use crate::query::Found;

/// What a field says at a point, in its frame.
#[derive(Clone, Copy, Debug)]
pub struct FieldValue {
    /// Signed distance.
    pub distance: f64,
    /// Its gradient, unit.
    pub gradient: DVec3,
    /// The nearest point of the surface.
    pub closest_point: DVec3,
    /// The nearest face, by position in the asset; of a simple shape its number.
    pub position: u32,
    /// The part of that face.
    pub feature: Feature,
}

impl From<Found> for FieldValue {
    fn from(found: Found) -> Self {
        let Found { signed_distance: distance, gradient, closest_point, position, feature } = found;
        Self { distance, gradient, closest_point, position, feature }
    }
}
