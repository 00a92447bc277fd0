use glam::DVec3;

use super::far_points::is_near;
use super::sign::hinted_side;
use super::{Answer, ON_SURFACE_F32, ON_SURFACE_F64, Precision, Reads};
use crate::TeSdf;
use crate::base::Side;

impl TeSdf {
    /// As [`query`](Self::query), but from the tree over all faces instead of the lists. For
    /// comparison with a good bounding volume hierarchy.
    ///
    /// The distance is equally exact. Among equally near faces another may be named. The closest
    /// feature decides the side where it can (in `f32`); otherwise [`is_inside`](Self::is_inside)
    /// does. On the surface itself the gradient is that of [`query`](Self::query).
    pub fn query_by_tree(&self, point: DVec3) -> Answer {
        self.query_by_tree_with(point, Precision::F64)
    }

    /// As [`query_by_tree`](Self::query_by_tree), in `f32`, with the precision of
    /// [`query_f32`](Self::query_f32).
    pub fn query_by_tree_f32(&self, point: DVec3) -> Answer {
        self.query_by_tree_with(point, Precision::F32)
    }

    /// As [`query_by_tree`](Self::query_by_tree) or [`query_by_tree_f32`](Self::query_by_tree_f32),
    /// chosen at run time.
    pub fn query_by_tree_with(&self, point: DVec3, precision: Precision) -> Answer {
        let local = self.frame.to_local(point);
        match precision {
            _ if !is_near(local) => self.answer_far(point),
            Precision::F32 => self.by_tree_f32(point, local),
            Precision::F64 => {
                self.store_normals_unless_moved();
                self.by_tree_f64(point, local)
            }
        }
    }

    /// Number of faces and nodes that [`query_by_tree`](Self::query_by_tree) reads at `point`, in
    /// `f32`.
    pub fn reads_by_tree(&self, point: DVec3) -> Reads {
        let mut reads = Reads::default();
        let relative = self.frame.to_local(point) - self.cube.middle();
        self.nearest_in_tree_f32(relative.as_vec3(), &mut reads);
        reads
    }

    fn by_tree_f32(&self, point: DVec3, local: DVec3) -> Answer {
        let relative = local - self.cube.middle();
        // Far from the cube, f32 is too coarse relative to the body.
        if relative.abs().max_element() > 2.0 * self.cube.side() {
            return self.by_tree_f64(point, local);
        }
        let found = self.nearest_in_tree_f32(relative.as_vec3(), &mut Reads::default());
        let Some(record) = self.records.get(found.face as usize) else {
            return self.by_tree_f64(point, local);
        };
        let triangle = record.triangle();
        if triangle.normal == glam::DVec3::ZERO {
            return self.by_tree_f64(point, local);
        }
        let closest = match found.part() {
            0 => triangle.closest_in_plane(relative),
            edge => triangle.closest_on_edge(edge as usize - 1, relative),
        };
        let height = triangle.normal.dot(relative - triangle.corners[0]);
        let side =
            hinted_side(record.hints(), closest.feature, height).unwrap_or_else(|| self.side_of(point));
        let on_surface = |d| (d < ON_SURFACE_F32).then(|| self.query_f32(point).gradient);
        self.to_answer(self.finish(relative, closest, side, found.face, self.cube.middle(), on_surface))
    }

    fn by_tree_f64(&self, point: DVec3, local: DVec3) -> Answer {
        let (position, closest) = self.nearest_in_tree_f64(local, &mut |_, _| ());
        let side = if closest.distance > 0.0 { self.side_of(point) } else { Side::Outside };
        let on_surface = |d| (d < ON_SURFACE_F64).then(|| self.query(point).gradient);
        self.to_answer(self.finish(local, closest, side, position, DVec3::ZERO, on_surface))
    }

    fn side_of(&self, point: DVec3) -> Side {
        if self.half_thickness == 0.0 && self.is_inside(point) { Side::Inside } else { Side::Outside }
    }
}
