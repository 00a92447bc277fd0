//! Strategies of property tests.
use glam::DVec3;
use proptest::prelude::*;

/// Points of the cube [-1, 1)³.
pub(crate) fn point() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}
