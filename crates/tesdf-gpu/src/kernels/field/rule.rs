//! The side of a point in a crossing cell: by the winding number of the listed faces, or by a rule
//! over all faces where these do not tell it.
use cubecl::prelude::*;

use super::super::math::vector::{V3, v3, xyz, zero};
use super::shapes::{FACE_COUNT, Field, FieldExpand, RULE, SIDE, SIGN_COUNT, SIGN_TRIANGLES};
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

/// Three corners of a face that counts.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Counted {
    a: V3,
    b: V3,
    c: V3,
}

#[cube]
impl Field<'_> {
    /// Whether the side of a point outside of all lists is told by the rule. Beyond the faces of a
    /// closed mesh all is outside; the inside of an open one may extend there.
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

    fn counted(self, number: u32) -> Counted {
        let own = self.entry(FACE_COUNT);
        let mut counted = Counted { a: zero(), b: zero(), c: zero() };
        if number < own {
            let f = self.face(number);
            counted = Counted { a: f.corner(0u32), b: f.corner(1u32), c: f.corner(2u32) };
        } else {
            let row = self.entry(SIGN_TRIANGLES) + 3u32 * (number - own);
            counted =
                Counted { a: xyz(self.row(row)), b: xyz(self.row(row + 1u32)), c: xyz(self.row(row + 2u32)) };
        }
        counted
    }

    /// The rule takes every face into account. The winding number of a closed mesh is the sum of
    /// the signed crossings on the way to a point beyond it.
    fn is_inside_by_rule(self, p: V3) -> bool {
        let rule = self.entry(RULE);
        let side = self.number(SIDE);
        let beyond = v3(0.37f32 * side, 0.21f32 * side, 2.0f32 * side);
        let count = self.entry(FACE_COUNT) + self.entry(SIGN_COUNT);
        let mut winding = 0i32;
        let mut angle = 0.0f32;
        let mut i = 0u32;
        while i < count {
            let f = self.counted(i);
            if rule == GENERALIZED {
                angle += half_solid_angle(f.a - p, f.b - p, f.c - p);
            } else {
                winding += crossing(p, beyond, f.a, f.b, f.c);
            }
            i += 1u32;
        }
        let by_angle = rule == GENERALIZED && angle.abs() >= std::f32::consts::PI;
        let by_winding = rule == WINDING && winding >= 1i32;
        let by_other = (rule == NONZERO && winding != 0i32) || (rule == ODD && winding % 2i32 != 0i32);
        by_angle || by_winding || by_other
    }
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
    use super::*;

    /// The sides of a cube take a sixth of the sphere each from its middle, and nothing in all from
    /// without.
    #[test]
    fn solid_angles_of_a_cube_sum_up_to_the_sphere_within_it() {
        let corner = |k: u32| [k & 1, k >> 1 & 1, k >> 2].map(|bit| bit as f32 * 2.0 - 1.0);
        let squares = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let faces = squares.map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).concat();
        let sum = |p: V3| -> f32 {
            let of = |f: &[u32; 3]| f.map(corner).map(|[x, y, z]| v3(x, y, z) - p);
            faces.iter().map(of).map(|[a, b, c]| half_solid_angle(a, b, c)).sum()
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
