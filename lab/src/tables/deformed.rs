//! A smooth deformation that bends and twists a body.
use tesdf::TeSdf;
use tesdf::deform::Moved;
use tesdf::domain::ConformingMesh;
use tesdf::geometry::Aabb;
use tesdf::geometry::internal::orientation;
use tesdf::glam::{DQuat, DVec3};

use tesdf_cli::terminal::report::Failure;

/// A bend of the far end relative to the near end, with a twist around the longest axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Bending angle, rad.
    pub bend: f64,
    /// Twisting angle, rad.
    pub twist: f64,
}

/// The first deformation that is tried.
const STRONG: Bend = Bend { bend: 0.5, twist: 0.3 };
/// Factor by which a deformation is weakened while it inverts a tetrahedron.
const WEAKER: f64 = 0.8;

impl Bend {
    /// The strongest deformation of a series that inverts no tetrahedron. Meshers leave flat
    /// tetrahedra at surfaces, which invert early.
    pub fn of(domain: &ConformingMesh) -> Self {
        let bounds = Aabb::of(domain.vertices());
        let mut bend = STRONG;
        for _ in 0..40 {
            let stays = |t: usize| {
                let [a, b, c, d] = domain.corners(t).map(|p| bend.apply(bounds, p));
                orientation(a, b, c, d) < 0
            };
            if (0..domain.tetrahedra().len()).all(stays) {
                break;
            }
            bend = Self { bend: WEAKER * bend.bend, twist: WEAKER * bend.twist };
        }
        bend
    }

    /// The deformed position of a point of a body with these bounds: the longest axis becomes an
    /// arc.
    fn apply(self, bounds: Aabb, p: DVec3) -> DVec3 {
        let extent = bounds.extent();
        let by_length = |a: &usize, b: &usize| extent[*a].total_cmp(&extent[*b]);
        let long = (0..3).max_by(by_length).unwrap_or(0);
        let (side, up) = ((long + 1) % 3, (long + 2) % 3);
        let mut axis = DVec3::ZERO;
        axis[long] = 1.0;
        let share = (p[long] - bounds.min[long]) / extent[long];
        let mut middle = bounds.center();
        middle[long] = p[long];
        let from = DQuat::from_axis_angle(axis, self.twist * share) * (p - middle);
        let (radius, angle) = (extent[long] / self.bend, self.bend * share);
        let mut q = bounds.center();
        q[long] = bounds.min[long] + (radius + from[side]) * angle.sin();
        q[side] += (radius + from[side]) * angle.cos() - radius;
        q[up] += from[up];
        q
    }

    /// Moves all vertices of an asset of this domain.
    ///
    /// # Errors
    /// A vertex cannot be moved that far.
    pub fn move_vertices(self, asset: &mut TeSdf, domain: &ConformingMesh) -> Result<Moved, Failure> {
        let bounds = Aabb::of(domain.vertices());
        let moves: Vec<(u32, DVec3)> =
            (0..).zip(domain.vertices()).map(|(id, &p)| (id, self.apply(bounds, p))).collect();
        asset.move_vertices(&moves).map_err(Failure::new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_near_end_stays_and_the_middle_line_keeps_its_length() {
        let bounds = Aabb { min: DVec3::new(-1.0, 0.0, 2.0), max: DVec3::new(1.0, 10.0, 3.0) };
        for p in [bounds.min, DVec3::new(0.3, 0.0, 2.6)] {
            assert!(STRONG.apply(bounds, p).distance(p) < 1e-12);
        }
        let line = |k: i32| STRONG.apply(bounds, DVec3::new(0.0, f64::from(k) * 0.01, 2.5));
        let length: f64 = (0..1000).map(|k| line(k).distance(line(k + 1))).sum();
        assert!((length - 10.0).abs() < 1e-5, "{length}");
        assert!(line(1000).distance(DVec3::new(0.0, 10.0, 2.5)) > 2.0);
    }
}
