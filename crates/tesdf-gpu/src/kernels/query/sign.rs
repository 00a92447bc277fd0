//! The side of a point in a crossing cell: by the winding number of the listed faces, or by a rule
//! over all faces where these do not tell it.
//!
//! Mirrors `query/sign.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::geometry::triangle::{ROWS as FACE_ROWS, Triangle, read_face};
use crate::kernels::geometry::vector::{V3, centroid, v3};
use crate::kernels::query::face_walk::face_walk;
use crate::kernels::query::winding::crossing;
use crate::kernels::scene::shape::{
    Bounds, CLOSING_COUNT, Field, FieldExpand, NONE, REACH_BEYOND, RECORDS, RULE, SIDE, SIGN_COUNT,
    SIGN_TRIANGLES, TURNED,
};

/// Inside is where the winding number is 1 or more. Cells have it at their centroids, and lists
/// have all faces that count.
pub const BY_CELLS: u32 = 0;
/// Inside is where the winding number of all faces is 1 or more.
pub const WINDING: u32 = 1;
/// Inside is where it is not 0.
pub const NONZERO: u32 = 2;
/// Inside is where it is odd.
pub const ODD: u32 = 3;
/// Inside is where the solid angles of all faces of an open mesh sum up to half of the sphere at
/// least, of either sign (Jacobson et al. 2013). The sum is the winding number of the mesh with
/// closing triangles, less their solid angles.
pub const GENERALIZED: u32 = 4;

/// A face farther off a line than this (local frame) is not crossed by it, whatever is rounded.
const MARGIN: f32 = 1e-5;

/// Lengths (local frame): the points at which the sides of a face are looked up lie this far beside
/// the point, towards the inside of the face, and this far off the face. The processor looks
/// nearer, because it computes in `f64`.
const ASIDE: f32 = 3e-4;
const OFF: f32 = 2e-6;
/// The points aside lie towards points at this share of the way from the corners to the centroid.
const INNER: f32 = 0.1;

#[cube]
impl Field<'_> {
    /// Whether the side changes where there is no face. Then the inside may extend beyond the
    /// faces, and the rule tells the side of points outside of all lists as well.
    pub fn is_open(self) -> bool {
        let mut open = false;
        if comptime!(self.shapes.rules.jumps) {
            open = self.entry(RULE) == GENERALIZED;
        }
        open
    }

    /// Whether faces may have the inside in front of them.
    pub fn has_turned_faces(self) -> bool {
        let mut turned = false;
        if comptime!(self.shapes.rules.turned) {
            turned = self.entry(TURNED) == 1u32;
        }
        turned
    }

    /// Whether a point is inside, by numbers of faces.
    pub fn is_inside(self, p: V3) -> bool {
        let mut inside = false;
        if comptime!(self.shapes.rules.at_points) {
            let rule = self.entry(RULE);
            let number = self.winding_by_rule(p);
            inside = select(rule == BY_CELLS || rule == WINDING, number, number.abs()) >= 0.5f32;
            if rule == ODD {
                inside = number as i32 % 2i32 != 0i32;
            }
        } else {
            inside = self.winding(p) >= 1i32;
        }
        inside
    }

    /// The side of a face that is outside at a point of it: 1 in front, -1 behind, and 0 on both
    /// sides or on none.
    ///
    /// As `facing` of the processor, it is looked up beside the point in three directions. At an
    /// edge of the face its sides would be those of another face.
    pub fn facing(self, face: u32, at: V3) -> f32 {
        let mut side = 1.0f32;
        if self.has_turned_faces() {
            let f = self.face(face);
            let center = centroid(f.corner(0u32), f.corner(1u32), f.corner(2u32));
            let mut in_front = 0u32;
            let mut behind = 0u32;
            let mut above = false;
            // Both sides in each direction. This is a loop, so that the long code of the rule
            // stands here once.
            let mut look = 0u32;
            while look < 6u32 {
                let corner = f.corner(look / 2u32);
                let way = (corner + (center - corner) * INNER) - at;
                let beside = at + way * (ASIDE / way.length().max(ASIDE));
                let is_above = look % 2u32 == 0u32;
                let inside = self.is_inside(beside + f.normal * select(is_above, OFF, -OFF));
                in_front += select(!is_above && inside && !above, 1u32, 0u32);
                behind += select(!is_above && !inside && above, 1u32, 0u32);
                above = inside;
                look += 1u32;
            }
            side = select(in_front == 3u32, 1.0f32, select(behind == 3u32, -1.0f32, 0.0f32));
        }
        side
    }

    /// The winding number that the rule is about.
    ///
    /// By cells it is the number at the centroid of the cell, plus the signed crossings with listed
    /// faces on the way there. Otherwise it is that of all faces and triangles, which are closed:
    /// the crossings on the way along z to a point beyond them. The solid angles of triangles that
    /// close an open mesh are taken away again. [`winding`](Self::winding) is the part by cells
    /// alone, for kernels without rules.
    fn winding_by_rule(self, p: V3) -> f32 {
        let by_cells = self.entry(RULE) == BY_CELLS;
        let mut end = v3(p.x, p.y, p.z + 2.0f32 * self.number(SIDE) + self.number(REACH_BEYOND));
        let mut sum = 0i32;
        let mut at = 0u32;
        let mut is_listed = false;
        if by_cells {
            let held = self.centered(p);
            sum = select(held.cell.is_inside(), 1i32, 0i32);
            if held.cell.is_crossing() {
                sum = self.winding_at_centroid(held.cell);
                end = held.centroid;
                at = held.cell.offset();
                is_listed = true;
            }
        }
        let mut walk = face_walk(self.list(at), by_cells);
        // In other cells no face counts.
        walk.count = select(is_listed, walk.count, 0u32);
        let mut triangles = select(by_cells, 0u32, self.entry(SIGN_COUNT));
        let mut rows = self.entry(RECORDS);
        // Triangles from this one on close the mesh.
        let mut closing = NONE.runtime();
        let mut angle = 0.0f32;
        let mut open = true;
        while open {
            let mut i = 0u32;
            while i < walk.count {
                let number = walk.face(self, i);
                let f = read_face(&self.shapes.rows, rows + number * FACE_ROWS).corners();
                sum += crossing(p, end, f.a, f.b, f.c);
                if comptime!(self.shapes.rules.jumps) {
                    angle += angle_of_closing(p, f, number >= closing);
                }
                i += 1u32;
            }
            walk.count = 0u32;
            if walk.is_open() {
                let node = walk.next();
                if node != NONE {
                    let boxes = self.node_boxes(node);
                    walk.look_into(self, node, is_under(p, boxes.left), is_under(p, boxes.right));
                }
            } else {
                // After the faces, the triangles.
                open = triangles > 0u32;
                rows = self.entry(SIGN_TRIANGLES);
                walk.take(0u32, triangles);
                closing = triangles - self.entry(CLOSING_COUNT);
                triangles = 0u32;
            }
        }
        sum as f32 - angle * comptime!(0.5 / std::f32::consts::PI)
    }
}

/// Whether the way from a point along z can meet a face within a box, up to rounding.
#[cube]
fn is_under(p: V3, bounds: Bounds) -> bool {
    let (low, high) = (bounds.low, bounds.high);
    let along_x = p.x >= low.x - MARGIN && p.x <= high.x + MARGIN;
    let along_y = p.y >= low.y - MARGIN && p.y <= high.y + MARGIN;
    along_x && along_y && p.z <= high.z + MARGIN
}

/// Half of the solid angle of a triangle if it closes a mesh; otherwise 0.
#[cube]
fn angle_of_closing(p: V3, f: Triangle, closes: bool) -> f32 {
    let mut angle = 0.0f32;
    if closes {
        angle = half_solid_angle(p, f);
    }
    angle
}

/// Half of the solid angle of a triangle seen from a point, positive from its back (Van Oosterom
/// and Strackee 1983). The side is that of [`crossing`], so both change at the same point.
#[cube]
fn half_solid_angle(p: V3, f: Triangle) -> f32 {
    let over = (f.b - f.a).cross(f.c - f.a).dot(p - f.a) >= 0.0f32;
    let (a, b, c) = (f.a - p, f.b - p, f.c - p);
    let (x, y, z) = (a.length(), b.length(), c.length());
    let volume = a.dot(b.cross(c)).abs();
    let rest = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
    select(over, -1.0f32, 1.0f32) * volume.atan2(rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::query::winding::tests::cube;

    fn triangle([a, b, c]: [V3; 3]) -> Triangle {
        Triangle { a, b, c }
    }

    /// The solid angles of all faces.
    fn angles(faces: &[[V3; 3]], p: V3) -> f32 {
        faces.iter().map(|f| half_solid_angle(p, triangle(*f))).sum::<f32>() / std::f32::consts::PI
    }

    /// The sides of a cube take a sixth of the sphere each from its middle, and nothing in all from
    /// without.
    #[test]
    fn solid_angles_of_a_cube_sum_up_to_the_sphere_within_it() {
        for (p, expected) in [
            (v3(0.0, 0.0, 0.0), 2.0),
            (v3(0.9, -0.9, 0.3), 2.0),
            (v3(0.999, 0.1, 0.2), 2.0),
            (v3(1.001, 0.1, 0.2), 0.0),
            (v3(3.0, -2.0, 5.0), 0.0),
        ] {
            let found = angles(&cube(), p);
            assert!((found - expected).abs() < 1e-5, "{found} instead of {expected} half spheres");
        }
    }

    /// A cube without two of its faces: crossings with closing triangles, less their angles, are
    /// the angles of the faces.
    #[test]
    fn an_open_cube_is_closed_by_triangles() {
        let open = &cube()[2..];
        let corners = [v3(-1.0, -1.0, -1.0), v3(-1.0, -1.0, 1.0), v3(-1.0, 1.0, 1.0), v3(-1.0, 1.0, -1.0)];
        let apex = v3(-0.7, 0.2, -0.1);
        let closing: Vec<[V3; 3]> = (0..4).map(|k| [corners[k], corners[(k + 1) % 4], apex]).collect();
        let turns = |p: V3| {
            let beyond = v3(p.x, p.y, p.z + 10.0);
            let all = open.iter().chain(&closing);
            let crossings: i32 = all.map(|&[a, b, c]| crossing(p, beyond, a, b, c)).sum();
            crossings as f32 - 0.5 * angles(&closing, p)
        };
        let mut random = fastrand::Rng::with_seed(9);
        for _ in 0..4000 {
            let mut at = || 3.0 * random.f32() - 1.5;
            let p = v3(at(), at(), at());
            let (found, expected) = (turns(p), 0.5 * angles(open, p));
            assert!((found - expected).abs() < 2e-5, "{found} instead of {expected}");
        }
    }
}
