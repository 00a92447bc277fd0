//! Closed plane curves, counter-clockwise, in metres.
use std::f64::consts::{PI, TAU};

use tesdf::base::elementary;
use tesdf::glam::DVec2;

/// A point at a distance from the origin, in a direction.
pub(crate) fn polar(radius: f64, angle: f64) -> DVec2 {
    radius * elementary::from_angle(angle)
}

/// A circle with its first vertex on +x.
pub(crate) fn circle(radius: f64, segments: usize) -> Vec<DVec2> {
    angles(segments).map(|angle| polar(radius, angle)).collect()
}

/// The directions of the vertices of a circle.
pub(crate) fn angles(segments: usize) -> impl Iterator<Item = f64> {
    (0..segments).map(move |i| TAU * i as f64 / segments as f64)
}

/// Distance of a hexagon's side from its centre, in a direction. Its corners are at 30° + k 60°.
pub(crate) fn hexagon(across_flats: f64, angle: f64) -> f64 {
    let from_flat = (angle + PI / 6.0).rem_euclid(PI / 3.0) - PI / 6.0;
    across_flats / 2.0 / elementary::cos(from_flat)
}
