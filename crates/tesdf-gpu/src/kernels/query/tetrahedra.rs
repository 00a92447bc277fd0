//! The roots of the forest: the six tetrahedra of the cube, or the tetrahedra of a conforming
//! domain with a tree of boxes over them.
use cubecl::prelude::*;

use crate::kernels::geometry::triangle::normal_of;
use crate::kernels::geometry::vector::{LEAST_DIVISOR, Row, V3, last, pick, row_of, xyz, zero};
use crate::kernels::query::locate::{Lambda, no_lambda};
use crate::kernels::scene::shape::{
    Bounds, Field, FieldExpand, NONE, TETRAHEDRA, TREE, TREE_BOXES, TREE_NODES,
};

/// Rows of a tetrahedron: corner 0 and height 0; gradients 1, 2 and 3, each with its height;
/// gradient 0.
pub const ROWS: u32 = 5;

/// A tetrahedron in the local frame, relative to the center of the cube.
#[derive(CubeType, Clone, Copy, Debug)]
#[expand(derive(Clone, Copy))]
pub struct Tetrahedron {
    /// Corner 0.
    pub corner: V3,
    /// Gradients of the barycentric coordinates.
    pub g0: V3,
    pub g1: V3,
    pub g2: V3,
    pub g3: V3,
    /// Heights of the corners over the opposite sides. In a flat tetrahedron, which holds no point,
    /// the first height is −1.
    pub h0: f32,
    pub h1: f32,
    pub h2: f32,
    pub h3: f32,
}

/// A tetrahedron with a smaller height (local frame) is flat, because rounding of its corners may
/// have turned it inside out.
const FLAT: f32 = 4e-7;

/// A triangle is thin when its height is below this fraction of its longest edge.
const THIN: f32 = 1e-3;

/// A point that no tetrahedron holds belongs to a tetrahedron from which it is at most this far
/// (local frame). The gaps that rounding leaves between two tetrahedra are smaller, also where a
/// flat tetrahedron is skipped. The processor compares barycentric coordinates in `f64` and allows
/// 1e-12 (`OUTSIDE` in `tesdf::asset::roots`).
pub const OUT: f32 = 5e-7;

/// The tetrahedron with four corners, in either orientation.
#[cube]
pub fn tetrahedron_of(a: V3, b: V3, c: V3, d: V3) -> Tetrahedron {
    let n0 = normal_of(b, c, d);
    let n1 = normal_of(a, c, d);
    let n2 = normal_of(a, b, d);
    let n3 = normal_of(a, b, c);
    let h0 = n0.dot(a - b);
    let h1 = n1.dot(b - a);
    let h2 = n2.dot(c - a);
    let h3 = n3.dot(d - a);
    // A side without area has a normal of zero, which gives a height of 0.
    let flat = h0.abs().min(h1.abs()).min(h2.abs()).min(h3.abs()) <= FLAT;
    Tetrahedron {
        corner: a,
        g0: gradient(n0, h0, flat),
        g1: gradient(n1, h1, flat),
        g2: gradient(n2, h2, flat),
        g3: gradient(n3, h3, flat),
        h0: select(flat, -1.0f32, h0.abs()),
        h1: h1.abs(),
        h2: h2.abs(),
        h3: h3.abs(),
    }
}

/// The gradient of a barycentric coordinate that is 0 on a side and 1 at `height` above it.
#[cube]
fn gradient(normal: V3, height: f32, flat: bool) -> V3 {
    normal * select(flat, 0.0f32, 1.0f32 / select(flat, 1.0f32, height))
}

#[cube]
impl Tetrahedron {
    /// Whether the tetrahedron is flat and so holds no point.
    pub fn is_flat(self) -> bool {
        self.h0 < 0.0f32
    }

    /// Barycentric coordinates of a point. The error of a coordinate, times its height, is the
    /// rounding error of the point.
    pub fn lambda(self, p: V3) -> Lambda {
        let from = p - self.corner;
        Lambda {
            l0: 1.0f32 + self.g0.dot(from),
            l1: self.g1.dot(from),
            l2: self.g2.dot(from),
            l3: self.g3.dot(from),
        }
    }

    /// Distance from a point inside to the nearest side; negative outside.
    fn inside_by(self, l: Lambda) -> f32 {
        (l.l0 * self.h0).min(l.l1 * self.h1).min(l.l2 * self.h2).min(l.l3 * self.h3)
    }
}

/// Writes a tetrahedron from row `at` on.
#[cube]
pub fn write_tetrahedron(rows: &mut [Row], at: u32, t: Tetrahedron) {
    let at = at as usize;
    rows[at] = row_of(t.corner, t.h0);
    rows[at + 1] = row_of(t.g1, t.h1);
    rows[at + 2] = row_of(t.g2, t.h2);
    rows[at + 3] = row_of(t.g3, t.h3);
    rows[at + 4] = row_of(t.g0, 0.0f32);
}

/// A point or a triangle, with its bounds and its plane, for tests against boxes.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Around {
    pub bounds: Bounds,
    /// Unit normal of the plane, and the plane's height above the origin; zero when there is no
    /// plane.
    pub normal: V3,
    pub height: f32,
    /// Largest error of the normal: the rounding error of the corners, divided by the height of the
    /// triangle.
    pub slope: f32,
}

/// The bounds of three points.
#[cube]
pub fn bounds_of(a: V3, b: V3, c: V3) -> Bounds {
    Bounds { low: a.min(b).min(c), high: a.max(b).max(c) }
}

/// A triangle, which may be flat.
#[cube]
pub fn around_of(a: V3, b: V3, c: V3) -> Around {
    let across = (b - a).cross(c - a);
    let size = across.length();
    let normal = across * select(size > 0.0f32, 1.0f32 / size.max(LEAST_DIVISOR), 0.0f32);
    let longest = (b - a).length().max((c - a).length()).max((c - b).length());
    // The plane of a thin triangle is too inexact to exclude boxes.
    let is_thin = size <= THIN * longest * longest;
    let normal = pick(is_thin, zero(), normal);
    let slope = longest * (4e-7f32 * longest + OUT) / size.max(LEAST_DIVISOR);
    Around { bounds: bounds_of(a, b, c), normal, height: normal.dot(a), slope }
}

#[cube]
impl Around {
    /// A part of the triangle, with its own corners. It takes the plane of the whole triangle,
    /// whose normal is more precise.
    pub fn part(self, a: V3, b: V3, c: V3) -> Around {
        Around { bounds: bounds_of(a, b, c), normal: self.normal, height: self.height, slope: self.slope }
    }

    /// Whether the box may hold a part of the triangle or point.
    fn may_meet(self, low: V3, high: V3) -> bool {
        let middle = (low + high) * 0.5f32;
        let reach = 0.5f32 * (high - low).dot(self.normal.abs());
        let rough = 2.0f32 * OUT + self.slope.min(1.0f32) * (middle - self.bounds.low).length();
        self.bounds.high.x >= low.x - OUT
            && self.bounds.low.x <= high.x + OUT
            && self.bounds.high.y >= low.y - OUT
            && self.bounds.low.y <= high.y + OUT
            && self.bounds.high.z >= low.z - OUT
            && self.bounds.low.z <= high.z + OUT
            && (self.normal.dot(middle) - self.height).abs() <= reach + rough
    }
}

/// A step of a walk over the tree of a conforming domain. The walk visits the nodes in order. It
/// skips the descendants of a node whose box does not meet the search region.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Step {
    /// The node to visit next.
    pub next: u32,
    /// The tetrahedron of a leaf whose box meets the search region; otherwise [`NONE`].
    pub tetrahedron: u32,
}

/// A root, and the coordinates of a point in it.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Held {
    /// [`NONE`] when no root holds the point.
    pub root: u32,
    pub lambda: Lambda,
}

#[cube]
impl Field<'_> {
    /// Reads root `root` of the forest.
    pub fn tetrahedron(self, root: u32) -> Tetrahedron {
        let at = self.entry(TETRAHEDRA) + root * ROWS;
        let (p, q, r, s) = (self.row(at), self.row(at + 1u32), self.row(at + 2u32), self.row(at + 3u32));
        let t = self.row(at + 4u32);
        Tetrahedron {
            corner: xyz(p),
            g0: xyz(t),
            g1: xyz(q),
            g2: xyz(r),
            g3: xyz(s),
            h0: last(p),
            h1: last(q),
            h2: last(r),
            h3: last(s),
        }
    }

    /// Visits a node of the tree over tetrahedra.
    pub fn visit(self, node: u32, around: Around) -> Step {
        let at = self.entry(TREE_BOXES) + 2u32 * node;
        let tree = self.entry(TREE) + 2u32 * node;
        let near = around.may_meet(xyz(self.row(at)), xyz(self.row(at + 1u32)));
        Step {
            next: select(near, node + 1u32, self.word(tree)),
            tetrahedron: select(near, self.word(tree + 1u32), NONE.runtime()),
        }
    }

    /// The tetrahedron of a conforming domain that holds a point: the first one found. When none
    /// holds the point, the nearest one that [`OUT`] allows.
    pub fn root_holding(self, p: V3) -> Held {
        // A point has no plane.
        let around =
            Around { bounds: Bounds { low: p, high: p }, normal: zero(), height: 0.0f32, slope: 0.0f32 };
        let count = self.entry(TREE_NODES);
        let mut held = Held { root: NONE.runtime(), lambda: no_lambda() };
        let mut best = comptime!(-OUT).runtime();
        let mut node = 0u32;
        while node < count {
            let step = self.visit(node, around);
            node = step.next;
            if step.tetrahedron != NONE {
                let t = self.tetrahedron(step.tetrahedron);
                let lambda = t.lambda(p);
                let by = t.inside_by(lambda);
                if by > best {
                    best = by;
                    held = Held { root: step.tetrahedron, lambda };
                }
                node = select(by >= 0.0f32, count, node);
            }
        }
        held
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::kernels::geometry::vector::v3;

    /// Coordinates times heights are the distances from the sides, in and around tetrahedra of any
    /// shape and orientation. The coordinates alone lose precision in thin tetrahedra.
    #[test]
    fn heights_over_the_sides_are_right() {
        let mut random = fastrand::Rng::with_seed(9);
        let mut in_cube = || DVec3::from_array(std::array::from_fn(|_| random.f64() - 0.5));
        let (mut flat, mut greatest) = (0, 0.0f64);
        for k in 0..20_000 {
            let size = 10f64.powf(-f64::from(k % 4));
            let middle = in_cube();
            let thin = 10f64.powf(-f64::from(k / 4 % 5));
            let mut corners = [(); 4].map(|()| middle + size * in_cube());
            // The last corner is close to the plane of the others.
            let foot = (corners[0] + corners[1] + corners[2]) / 3.0;
            corners[3] = foot + thin * (corners[3] - foot);
            let corners: [Vec3; 4] = corners.map(|p| p.as_vec3());
            let [a, b, c, d] = corners.map(|p| v3(p.x, p.y, p.z));
            let t = tetrahedron_of(a, b, c, d);
            if t.is_flat() {
                flat += 1;
                let [a, b, c, d] = corners.map(|p| p.as_dvec3());
                let sides = [(a, b, c), (a, b, d), (a, c, d), (b, c, d)]
                    .map(|(p, q, r)| (q - p).cross(r - p).length());
                let height = (b - a).cross(c - a).dot(d - a).abs() / sides.into_iter().fold(0.0, f64::max);
                assert!(height < 2.0 * f64::from(FLAT), "a tetrahedron of height {height} is flat");
                continue;
            }
            let weights = [(); 4].map(|()| in_cube().x + 0.45);
            let all: f64 = weights.iter().sum::<f64>().max(0.5);
            let from = |(c, w): (&Vec3, f64)| w / all * (c.as_dvec3() - corners[0].as_dvec3());
            let p = (corners[0].as_dvec3() + corners.iter().zip(weights).map(from).sum::<DVec3>()).as_vec3();
            let l = t.lambda(v3(p.x, p.y, p.z));
            let heights = [l.l0 * t.h0, l.l1 * t.h1, l.l2 * t.h2, l.l3 * t.h3].map(f64::from);
            let corners = corners.map(|p| p.as_dvec3());
            for (side, height) in heights.into_iter().enumerate() {
                let [q, r, s] = [1, 2, 3].map(|k| corners[(side + k) % 4]);
                let normal = (r - q).cross(s - q).normalize();
                let expected = normal.dot(p.as_dvec3() - q) * normal.dot(corners[side] - q).signum();
                greatest = greatest.max((height - expected).abs() / size.max(0.1));
            }
        }
        assert!(flat < 4_000, "{flat} are flat");
        assert!(greatest < OUT.into(), "a height is {greatest} off");
    }
}
