//! The side of a point in a crossing cell: by the winding number of the listed faces, or by a rule
//! over all faces where these do not tell it.
use cubecl::prelude::*;

use super::super::math::triangle::Triangle;
use super::super::math::vector::{V3, v3, xyz};
use super::nearest::{TREE_DEPTH, TreeChild};
use super::shapes::{
    Bounds, CHILDREN, FACE_COUNT, Field, FieldExpand, RULE, SIDE, SIGN_COUNT, SIGN_TRIANGLES,
};
use super::winding::crossing;

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
/// least, of either sign (Jacobson et al. 2013).
pub const GENERALIZED: u32 = 4;

/// A face farther off a line than this (local frame) is not crossed by it, whatever is rounded.
const MARGIN: f32 = 1e-5;

#[cube]
impl Field<'_> {
    /// Whether the inside of a mesh may extend beyond its faces, so that the rule tells the side of
    /// points outside of all lists as well.
    pub fn is_open(self) -> bool {
        self.entry(RULE) == GENERALIZED
    }

    /// Whether a point is inside, by numbers of faces.
    pub fn is_inside(self, p: V3) -> bool {
        let mut inside = false;
        if comptime!(self.shapes.has_rules) {
            if self.entry(RULE) == BY_CELLS {
                inside = self.winding(p) >= 1i32;
            } else {
                inside = self.is_inside_by_rule(p);
            }
        } else {
            inside = self.winding(p) >= 1i32;
        }
        inside
    }

    /// Corners of a triangle that counts for the side alone.
    fn sign_triangle(self, number: u32) -> Triangle {
        let row = self.entry(SIGN_TRIANGLES) + 3u32 * number;
        Triangle { a: xyz(self.row(row)), b: xyz(self.row(row + 1u32)), c: xyz(self.row(row + 2u32)) }
    }

    fn is_inside_by_rule(self, p: V3) -> bool {
        let rule = self.entry(RULE);
        let mut inside = false;
        if rule == GENERALIZED {
            inside = self.half_solid_angles(p).abs() >= std::f32::consts::PI;
        } else {
            let winding = self.winding_of_all(p);
            inside = (rule == WINDING && winding >= 1i32)
                || (rule == NONZERO && winding != 0i32)
                || (rule == ODD && winding % 2i32 != 0i32);
        }
        inside
    }

    /// Half of the solid angles of all faces of an open mesh, which has no other triangles.
    fn half_solid_angles(self, p: V3) -> f32 {
        let mut angle = 0.0f32;
        let mut face = 0u32;
        while face < self.entry(FACE_COUNT) {
            let f = self.face(face).corners();
            angle += half_solid_angle(f.a - p, f.b - p, f.c - p);
            face += 1u32;
        }
        angle
    }

    /// The winding number of all faces and triangles, which are closed: the sum of the signed
    /// crossings on the way along z to a point beyond them.
    fn winding_of_all(self, p: V3) -> i32 {
        let beyond = v3(p.x, p.y, p.z + 2.0f32 * self.number(SIDE));
        let children = self.entry(CHILDREN);
        let mut words = Array::<u32>::new(TREE_DEPTH);
        let mut winding = 0i32;
        let mut top = 1u32;
        words[0] = 0u32;
        while top > 0u32 {
            top -= 1u32;
            let child = TreeChild { word: words[top as usize] };
            if child.is_leaf() {
                let mut face = child.start();
                while face < child.start() + child.count() {
                    let f = self.face(face).corners();
                    winding += crossing(p, beyond, f.a, f.b, f.c);
                    face += 1u32;
                }
            } else {
                let boxes = self.node_boxes(child.word);
                if is_under(p, boxes.left) {
                    words[top as usize] = self.word(children + 2u32 * child.word);
                    top += 1u32;
                }
                if is_under(p, boxes.right) {
                    words[top as usize] = self.word(children + 2u32 * child.word + 1u32);
                    top += 1u32;
                }
            }
        }
        let mut k = 0u32;
        while k < self.entry(SIGN_COUNT) {
            let f = self.sign_triangle(k);
            winding += crossing(p, beyond, f.a, f.b, f.c);
            k += 1u32;
        }
        winding
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

/// Half of the solid angle of a triangle seen from the origin, positive from its back (Van Oosterom
/// and Strackee 1983).
#[cube]
pub fn half_solid_angle(a: V3, b: V3, c: V3) -> f32 {
    let (x, y, z) = (a.length(), b.length(), c.length());
    let volume = a.dot(b.cross(c));
    let rest = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
    volume.atan2(rest)
}

#[cfg(test)]
mod tests {
    use super::super::winding::tests::cube;
    use super::*;

    /// The sides of a cube take a sixth of the sphere each from its middle, and nothing in all from
    /// without.
    #[test]
    fn solid_angles_of_a_cube_sum_up_to_the_sphere_within_it() {
        let sum = |p: V3| -> f32 {
            cube().into_iter().map(|[a, b, c]| half_solid_angle(a - p, b - p, c - p)).sum()
        };
        for (p, expected) in [
            (v3(0.0, 0.0, 0.0), 2.0),
            (v3(0.9, -0.9, 0.3), 2.0),
            (v3(0.999, 0.1, 0.2), 2.0),
            (v3(1.001, 0.1, 0.2), 0.0),
            (v3(3.0, -2.0, 5.0), 0.0),
        ] {
            let found = sum(p) / std::f32::consts::PI;
            assert!((found - expected).abs() < 1e-5, "{found} instead of {expected} half spheres");
        }
    }
}
