//! The roots of the forest: six tetrahedra of a cube, or those of a conforming domain, which a tree of boxes finds.
use cubecl::prelude::*;

use super::assets::{Assets, NONE, TETRAHEDRA, TREE, TREE_BOXES, TREE_NODES, entry};
use super::locate::Lambda;
use super::triangle::normal_of;
use super::vector::{V3, cross, dot, length, minus, pick, plus, scaled, v3};

/// Rows that a tetrahedron takes: corner, then gradients 1, 2, 3 and 0, the first four with the heights 0 to 3.
pub const ROWS: usize = 5;

/// A tetrahedron in the local frame, relative to the middle of the cube.
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
    /// Heights of the corners over the opposite sides; the first one is −1 for a tetrahedron that is flat, which holds no point.
    pub h0: f32,
    pub h1: f32,
    pub h2: f32,
    pub h3: f32,
}

/// Of less height than this (local frame) a tetrahedron is flat: rounding of its corners may have turned it inside out.
const FLAT: f32 = 4e-7;

/// A triangle is thin when its height is less than this share of its longest edge.
const THIN: f32 = 1e-3;

/// A point may be out of a tetrahedron by this (local frame) and still belong to it, when no other holds it: more than rounding takes
/// away between two, also where a flat one is left out.
pub const OUT: f32 = 5e-7;

/// The tetrahedron of four corners, in either orientation.
#[cube]
pub fn tetrahedron_of(a: V3, b: V3, c: V3, d: V3) -> Tetrahedron {
    let n0 = normal_of(b, c, d);
    let n1 = normal_of(a, c, d);
    let n2 = normal_of(a, b, d);
    let n3 = normal_of(a, b, c);
    let h0 = dot(n0, minus(a, b));
    let h1 = dot(n1, minus(b, a));
    let h2 = dot(n2, minus(c, a));
    let h3 = dot(n3, minus(d, a));
    // Without a normal the height is 0.
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

/// Of a coordinate that is 0 in a side and 1 at `height` over it.
#[cube]
fn gradient(normal: V3, height: f32, flat: bool) -> V3 {
    scaled(select(flat, 0.0f32, 1.0f32 / select(flat, 1.0f32, height)), normal)
}

/// Reads a root.
#[cube]
pub fn tetrahedron(assets: &Assets, shape: u32, root: u32) -> Tetrahedron {
    let at = (entry(assets, shape, TETRAHEDRA) + root * comptime!(ROWS as u32)) as usize;
    let (p, q, r, s) = (assets.rows[at], assets.rows[at + 1], assets.rows[at + 2], assets.rows[at + 3]);
    let t = assets.rows[at + 4];
    Tetrahedron {
        corner: v3(p.extract(0usize), p.extract(1usize), p.extract(2usize)),
        g0: v3(t.extract(0usize), t.extract(1usize), t.extract(2usize)),
        g1: v3(q.extract(0usize), q.extract(1usize), q.extract(2usize)),
        g2: v3(r.extract(0usize), r.extract(1usize), r.extract(2usize)),
        g3: v3(s.extract(0usize), s.extract(1usize), s.extract(2usize)),
        h0: p.extract(3usize),
        h1: q.extract(3usize),
        h2: r.extract(3usize),
        h3: s.extract(3usize),
    }
}

/// Whether it holds no point.
#[cube]
pub fn is_flat(t: Tetrahedron) -> bool {
    t.h0 < 0.0f32
}

/// Barycentric coordinates; each is right to what rounding is of its height.
#[cube]
pub fn lambda_in(t: Tetrahedron, p: V3) -> Lambda {
    let from = minus(p, t.corner);
    Lambda { l0: 1.0f32 + dot(t.g0, from), l1: dot(t.g1, from), l2: dot(t.g2, from), l3: dot(t.g3, from) }
}

/// How far a point is inside of the nearest side; negative outside.
#[cube]
fn inside_by(t: Tetrahedron, l: Lambda) -> f32 {
    (l.l0 * t.h0).min(l.l1 * t.h1).min(l.l2 * t.h2).min(l.l3 * t.h3)
}

/// What may lie in a box: a point, or a triangle with its bounds and its plane.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Around {
    pub low: V3,
    pub high: V3,
    /// Unit normal, and how high over the origin; zero without a plane.
    pub normal: V3,
    pub height: f32,
    /// What the normal may be off by: what rounding moves corners by, over the height of the triangle.
    pub slope: f32,
}

/// A triangle, or less.
#[cube]
pub fn around_of(a: V3, b: V3, c: V3) -> Around {
    let across = cross(minus(b, a), minus(c, a));
    let size = length(across);
    let normal = scaled(select(size > 0.0f32, 1.0f32 / size.max(1e-30f32), 0.0f32), across);
    let longest = length(minus(b, a)).max(length(minus(c, a))).max(length(minus(c, b)));
    // Of what has hardly an area the plane says nothing.
    let is_thin = size <= THIN * longest * longest;
    let normal = pick(is_thin, v3(0.0f32, 0.0f32, 0.0f32), normal);
    let slope = longest * (4e-7f32 * longest + OUT) / size.max(1e-30f32);
    part_of(Around { low: a, high: a, normal, height: dot(normal, a), slope }, a, b, c)
}

/// A part of it, with three of its own corners: its plane is that of the whole, which is the surer the larger it is.
#[cube]
pub fn part_of(whole: Around, a: V3, b: V3, c: V3) -> Around {
    Around {
        low: v3(a.x.min(b.x).min(c.x), a.y.min(b.y).min(c.y), a.z.min(b.z).min(c.z)),
        high: v3(a.x.max(b.x).max(c.x), a.y.max(b.y).max(c.y), a.z.max(b.z).max(c.z)),
        normal: whole.normal,
        height: whole.height,
        slope: whole.slope,
    }
}

/// Whether a box may hold some of it.
#[cube]
fn may_hold(low: V3, high: V3, around: Around) -> bool {
    let middle = scaled(0.5f32, plus(low, high));
    let reach = 0.5f32
        * ((high.x - low.x) * around.normal.x.abs()
            + (high.y - low.y) * around.normal.y.abs()
            + (high.z - low.z) * around.normal.z.abs());
    let rough = 2.0f32 * OUT + around.slope.min(1.0f32) * length(minus(middle, around.low));
    around.high.x >= low.x - OUT
        && around.low.x <= high.x + OUT
        && around.high.y >= low.y - OUT
        && around.low.y <= high.y + OUT
        && around.high.z >= low.z - OUT
        && around.low.z <= high.z + OUT
        && (dot(around.normal, middle) - around.height).abs() <= reach + rough
}

/// A step of a walk over the tree of a conforming domain, which visits nodes in order and leaves out what is below boxes elsewhere.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Step {
    /// The node that comes after this one.
    pub next: u32,
    /// The tetrahedron when this is a leaf whose box is near, else [`NONE`].
    pub tetrahedron: u32,
}

/// Visits a node, for what lies in `around`.
#[cube]
pub fn visit(assets: &Assets, shape: u32, node: u32, around: Around) -> Step {
    let row = (entry(assets, shape, TREE_BOXES) + 2u32 * node) as usize;
    let word = (entry(assets, shape, TREE) + 2u32 * node) as usize;
    let (low, high) = (assets.rows[row], assets.rows[row + 1]);
    let near = may_hold(
        v3(low.extract(0usize), low.extract(1usize), low.extract(2usize)),
        v3(high.extract(0usize), high.extract(1usize), high.extract(2usize)),
        around,
    );
    Step {
        next: select(near, node + 1u32, assets.words[word]),
        tetrahedron: select(near, assets.words[word + 1], NONE.runtime()),
    }
}

/// A root, and coordinates in it.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Held {
    /// [`NONE`] when none holds the point.
    pub root: u32,
    pub lambda: Lambda,
}

/// The tetrahedron of a conforming domain that holds a point: the first one found, or the one that the point is least out of.
#[cube]
pub fn root_holding(assets: &Assets, shape: u32, p: V3) -> Held {
    // A point has no plane.
    let around =
        Around { low: p, high: p, normal: v3(0.0f32, 0.0f32, 0.0f32), height: 0.0f32, slope: 0.0f32 };
    let count = entry(assets, shape, TREE_NODES);
    let mut root = NONE.runtime();
    let mut best = comptime!(-OUT).runtime();
    let mut l0 = 0.0f32;
    let mut l1 = 0.0f32;
    let mut l2 = 0.0f32;
    let mut l3 = 0.0f32;
    let mut node = 0u32;
    while node < count {
        let step = visit(assets, shape, node, around);
        node = step.next;
        if step.tetrahedron != NONE {
            let t = tetrahedron(assets, shape, step.tetrahedron);
            let l = lambda_in(t, p);
            let by = inside_by(t, l);
            let better = by > best;
            best = select(better, by, best);
            root = select(better, step.tetrahedron, root);
            l0 = select(better, l.l0, l0);
            l1 = select(better, l.l1, l1);
            l2 = select(better, l.l2, l2);
            l3 = select(better, l.l3, l3);
            node = select(by >= 0.0f32, count, node);
        }
    }
    Held { root, lambda: Lambda { l0, l1, l2, l3 } }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;

    /// Coordinates times heights are the distances from the sides, in and around tetrahedra of any shape and orientation. (The coordinates alone are as
    /// rough as a tetrahedron is thin.)
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
            // The last corner close to the plane of the others.
            let foot = (corners[0] + corners[1] + corners[2]) / 3.0;
            corners[3] = foot + thin * (corners[3] - foot);
            let corners: [Vec3; 4] = corners.map(|p| p.as_vec3());
            let [a, b, c, d] = corners.map(|p| v3(p.x, p.y, p.z));
            let t = tetrahedron_of(a, b, c, d);
            if is_flat(t) {
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
            let l = lambda_in(t, v3(p.x, p.y, p.z));
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
