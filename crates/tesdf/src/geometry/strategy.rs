//! What property tests draw.
use glam::DVec3;
use proptest::prelude::*;

/// Points of a cube around the origin with sides of 2.
pub(crate) fn point() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}
