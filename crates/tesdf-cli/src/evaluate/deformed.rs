//! A smooth field that bends and twists a body.
use tesdf::TeSdf;
use tesdf::deform::Moved;
use tesdf::domain::ConformingMesh;
use tesdf::geometry::Aabb;
use tesdf::glam::{DQuat, DVec3};

use crate::report::Failure;

/// By how much the far end is bent against the near one, rad.
const BEND: f64 = 0.5;
/// And twisted around the long axis, rad.
const TWIST: f64 = 0.3;

/// Bends a body with these bounds along its longest axis, on a circle, and twists it.
fn bent(bounds: Aabb, p: DVec3) -> DVec3 {
    let extent = bounds.extent();
    let by_length = |a: &usize, b: &usize| extent[*a].total_cmp(&extent[*b]);
    let long = (0..3).max_by(by_length).unwrap_or(0);
    let (side, up) = ((long + 1) % 3, (long + 2) % 3);
    let mut axis = DVec3::ZERO;
    axis[long] = 1.0;
    let share = (p[long] - bounds.min[long]) / extent[long];
    let mut middle = bounds.center();
    middle[long] = p[long];
    let from = DQuat::from_axis_angle(axis, TWIST * share) * (p - middle);
    // The middle line becomes an arc of the same length.
    let (radius, angle) = (extent[long] / BEND, BEND * share);
    let mut q = bounds.center();
    q[long] = bounds.min[long] + (radius + from[side]) * angle.sin();
    q[side] += (radius + from[side]) * angle.cos() - radius;
    q[up] += from[up];
    q
}

/// Moves all vertices of the asset, those of its domain included.
///
/// # Errors
/// A vertex cannot be moved so far.
pub fn bend(asset: &mut TeSdf, domain: &ConformingMesh) -> Result<Moved, Failure> {
    let bounds = asset.bounds();
    let moves: Vec<(u32, DVec3)> =
        (0..).zip(domain.vertices()).map(|(id, &p)| (id, bent(bounds, p))).collect();
    asset.move_vertices(&moves).map_err(Failure::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_near_end_stays_and_the_middle_line_keeps_its_length() {
        let bounds = Aabb { min: DVec3::new(-1.0, 0.0, 2.0), max: DVec3::new(1.0, 10.0, 3.0) };
        for p in [bounds.min, DVec3::new(0.3, 0.0, 2.6)] {
            assert!(bent(bounds, p).distance(p) < 1e-12);
        }
        let line = |k: i32| bent(bounds, DVec3::new(0.0, f64::from(k) * 0.01, 2.5));
        let length: f64 = (0..1000).map(|k| line(k).distance(line(k + 1))).sum();
        assert!((length - 10.0).abs() < 1e-5, "{length}");
        assert!(line(1000).distance(DVec3::new(0.0, 10.0, 2.5)) > 2.0);
    }
}
