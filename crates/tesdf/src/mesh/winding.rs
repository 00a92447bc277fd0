use glam::DVec3;

use super::TriangleMesh;
use crate::geometry::{Aabb, AabbTree, Child, signed_crossing};

/// The winding number of a triangle mesh, exact and deterministic.
///
/// It counts how often the surface goes around a point: 1 inside a simple outward surface, 0
/// outside, 2 where two such solids overlap, -1 inside an inverted solid. For a closed surface it
/// is an integer that depends on the surface alone. A surface is closed when every directed edge is
/// used as often as its reverse. For an open surface the results have no meaning.
///
/// The method compares a point with a far point by the crossings of the segment between them
/// ([`signed_crossing`]). The segment runs along an axis, through the nearest side of the bounds.
/// It is therefore a box itself, and finding the boxes of the tree that it meets needs no rounding.
#[derive(Clone, Debug)]
pub struct WindingNumber {
    tree: AabbTree,
    /// Corners of the faces, in tree order.
    triangles: Vec<[DVec3; 3]>,
    bounds: Aabb,
}

const LEAF_SIZE: usize = 4;

impl WindingNumber {
    /// Builds the tree over the faces.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let boxes: Vec<Aabb> = (0..mesh.faces().len()).map(|f| Aabb::of(&mesh.triangle(f))).collect();
        let tree = AabbTree::build(&boxes, LEAF_SIZE);
        let triangles = tree.order().iter().map(|&f| mesh.triangle(f as usize)).collect();
        let bounds = tree.root().0;
        Self { tree, triangles, bounds }
    }

    /// Winding number at `x`, which must not be on the surface. On the surface the result may be
    /// the number on either side or another number. It is 0 for NaN.
    pub fn at(&self, x: DVec3) -> i32 {
        if !self.bounds.contains(x) {
            return 0;
        }
        self.crossings(x, self.far_point(x))
    }

    /// Winding number at `p + (e, e^2, e^3)` with `e > 0` infinitesimal. It is defined for every
    /// `p`, also on the surface. It is 0 for NaN.
    pub fn at_perturbed(&self, p: DVec3) -> i32 {
        let mut sum = 0;
        self.for_each_crossing_to(p, |_, sign| sum += sign);
        sum
    }

    /// `winding(x) - winding(p')` with `p' = p + (e, e^2, e^3)`: the sum of [`signed_crossing`]
    /// over the faces. `x` must not be on the surface.
    pub fn crossings(&self, x: DVec3, p: DVec3) -> i32 {
        let mut sum = 0;
        self.for_each_crossing(x, p, |_, sign| sum += sign);
        sum
    }

    /// The tree over the faces.
    pub(crate) fn tree(&self) -> &AabbTree {
        &self.tree
    }

    /// Calls `crossed` for each face that the segment from the far point to `p + (e, e^2, e^3)`
    /// crosses, with the change of the winding number there. [`at_perturbed`](Self::at_perturbed)
    /// adds up these changes.
    pub(crate) fn for_each_crossing_to(&self, p: DVec3, mut crossed: impl FnMut(u32, i32)) {
        if self.bounds.contains(p) {
            self.for_each_crossing(self.far_point(p), p, |face, sign| crossed(face, -sign));
        }
    }

    fn for_each_crossing(&self, x: DVec3, p: DVec3, mut crossed: impl FnMut(u32, i32)) {
        let segment = Segment::new(x, p);
        let mut stack = vec![self.tree.root()];
        while let Some((bounds, child)) = stack.pop() {
            if !segment.may_meet(bounds) {
                continue;
            }
            match child {
                Child::Node(n) => stack.extend(self.tree.nodes()[n as usize]),
                Child::Leaf { start, end } => {
                    for i in start as usize..end as usize {
                        match signed_crossing(x, p, self.triangles[i]) {
                            0 => {}
                            sign => crossed(self.tree.order()[i], sign),
                        }
                    }
                }
            }
        }
    }

    /// The winding number at `x` from all faces, without a tree. Slow; for comparisons. `x` as in
    /// [`at`](Self::at).
    pub fn brute_force(mesh: &TriangleMesh, x: DVec3) -> i32 {
        let far = mesh.bounds().max + DVec3::new(1.0, 2.0, 3.0) * mesh.diagonal();
        (0..mesh.faces().len()).map(|f| signed_crossing(x, far, mesh.triangle(f))).sum()
    }

    /// A point outside the bounds, from `x` along an axis through the nearest side.
    fn far_point(&self, x: DVec3) -> DVec3 {
        let Aabb { min, max } = self.bounds;
        let step = self.bounds.extent().max_element();
        let mut best = (f64::INFINITY, x);
        for axis in 0..3 {
            // Far from the origin, rounding can swallow the step. The next floating-point number is
            // then outside too.
            let up = (max[axis] + step).max(max[axis].next_up());
            let down = (min[axis] - step).min(min[axis].next_down());
            for (distance, to) in [(max[axis] - x[axis], up), (x[axis] - min[axis], down)] {
                if distance < best.0 {
                    let mut far = x;
                    far[axis] = to;
                    best = (distance, far);
                }
            }
        }
        best.1
    }
}

/// A segment, prepared for tests that it misses a box.
struct Segment {
    bounds: Aabb,
    /// Its middle, half of its direction vector, and the absolute values of that half.
    middle: DVec3,
    half: DVec3,
    half_abs: DVec3,
    /// A bound of the rounding errors of [`may_meet`](Self::may_meet) for boxes that overlap the
    /// segment's bounds.
    margin: f64,
    along_axis: bool,
}

impl Segment {
    fn new(x: DVec3, p: DVec3) -> Self {
        let (middle, half) = (0.5 * (x + p), 0.5 * (p - x));
        let scale = x.abs().max(p.abs()).max_element();
        Self {
            bounds: Aabb::of(&[x, p]),
            middle,
            half,
            half_abs: half.abs(),
            margin: 1e-14 * scale,
            along_axis: half.to_array().into_iter().filter(|&h| h != 0.0).count() <= 1,
        }
    }

    /// False only when the segment misses the closed box. Separating axes: the axes of the box
    /// exactly, their cross products with the segment with a margin.
    fn may_meet(&self, b: Aabb) -> bool {
        if !self.bounds.overlaps(b) {
            return false;
        }
        if self.along_axis {
            return true;
        }
        let size = 0.5 * b.extent();
        let to = self.middle - b.center();
        // Each coordinate of `to`, `size` and `half` has an error of some ulps of the coordinates
        // of the box or the segment.
        let margin = self.margin + 1e-14 * b.min.abs().max(b.max.abs()).max_element();
        let (h, g) = (self.half, self.half_abs);
        let misses = |i: usize, j: usize| {
            let reach = size[i] * g[j] + size[j] * g[i];
            let slack = margin * (g[i] + g[j] + size[i] + size[j] + to[i].abs() + to[j].abs());
            (to[i] * h[j] - to[j] * h[i]).abs() > reach + slack
        };
        !(misses(1, 2) || misses(2, 0) || misses(0, 1))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Sum of the solid angles divided by 4 pi.
    fn by_solid_angle(mesh: &TriangleMesh, x: DVec3) -> f64 {
        let sum: f64 = (0..mesh.faces().len())
            .map(|f| {
                let [a, b, c] = mesh.triangle(f).map(|v| v - x);
                let (la, lb, lc) = (a.length(), b.length(), c.length());
                let cos = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
                2.0 * a.dot(b.cross(c)).atan2(cos)
            })
            .sum();
        sum / (4.0 * std::f64::consts::PI)
    }

    fn on_surface(mesh: &TriangleMesh, x: DVec3) -> bool {
        (0..mesh.faces().len()).any(|f| {
            let [a, b, c] = mesh.triangle(f);
            let edge = |a: DVec3, b: DVec3| {
                let t = ((x - a).dot(b - a) / (b - a).length_squared().max(1e-300)).clamp(0.0, 1.0);
                (a + t * (b - a)).distance(x) < 1e-9
            };
            let n = (b - a).cross(c - a);
            let side = |a: DVec3, b: DVec3| (b - a).cross(x - a).dot(n) > 0.0;
            let over = n.length() > 0.0 && side(a, b) && side(b, c) && side(c, a);
            edge(a, b) || edge(b, c) || edge(c, a) || over && ((x - a).dot(n) / n.length()).abs() < 1e-9
        })
    }

    fn assert_all_ways_agree(mesh: &TriangleMesh, tree: &WindingNumber, x: DVec3) {
        let e = 1.0 / 1024.0;
        let near = by_solid_angle(mesh, x + DVec3::new(e, e * e, e * e * e));
        assert!((near - near.round()).abs() < 1e-3, "{x} {near}");
        assert_eq!(tree.at_perturbed(x), near.round() as i32, "at_perturbed {x}");
        if on_surface(mesh, x) {
            tree.at(x); // must not panic
            return;
        }
        let angle = by_solid_angle(mesh, x);
        assert!((angle - angle.round()).abs() < 1e-6, "{x} {angle}");
        assert_eq!(tree.at(x), angle.round() as i32, "at {x}");
        assert_eq!(WindingNumber::brute_force(mesh, x), angle.round() as i32, "brute force {x}");
        // Between any two points, with the end on the surface or not.
        for p in [DVec3::new(2.0, 2.0, 2.0), DVec3::ZERO, DVec3::new(1.0, -1.0, 5.0)] {
            assert_eq!(tree.crossings(x, p), tree.at(x) - tree.at_perturbed(p), "crossings {x} {p}");
        }
    }

    /// The outward faces of the unit cells of an `n` x `n` x `n` grid that `solid` accepts.
    fn cells(n: i32, solid: impl Fn(i32, i32, i32) -> bool) -> TriangleMesh {
        let mut mesh = (Vec::new(), Vec::new());
        for x in 0..n {
            for y in 0..n {
                for z in 0..n {
                    if solid(x, y, z) {
                        let base = DVec3::new(x.into(), y.into(), z.into());
                        add_box(&mut mesh, base, base + 1.0);
                    }
                }
            }
        }
        TriangleMesh::new(mesh.0, mesh.1).unwrap()
    }

    fn add_box((vertices, faces): &mut (Vec<DVec3>, Vec<[u32; 3]>), min: DVec3, max: DVec3) {
        let first = vertices.len() as u32;
        for k in 0..8 {
            let pick = |bit: u32, axis: usize| if k >> bit & 1 == 1 { max[axis] } else { min[axis] };
            vertices.push(DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2)));
        }
        for [a, b, c, d] in
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        {
            faces.push([first + a, first + b, first + c]);
            faces.push([first + a, first + c, first + d]);
        }
    }

    /// Points at the corners, edges, faces and centres of the cells: a lattice of half units.
    fn lattice(n: i32) -> impl Iterator<Item = DVec3> {
        let r = -1..=2 * n + 1;
        let all = move |x: i32| {
            r.clone().flat_map({
                let r = r.clone();
                move |y| r.clone().map(move |z| 0.5 * DVec3::new(x.into(), y.into(), z.into()))
            })
        };
        (-1..=2 * n + 1).flat_map(all)
    }

    #[test]
    fn winding_numbers_of_touching_cubes() {
        // Cells that touch in faces, edges and corners. Their inner faces are kept twice.
        for solid in
            [|_, _, _| true, |x: i32, y: i32, z: i32| (x + y + z) % 2 == 0, |x, y, z| x == y && y == z]
        {
            let mesh = cells(3, solid);
            let tree = WindingNumber::new(&mesh);
            for x in lattice(3) {
                assert_all_ways_agree(&mesh, &tree, x);
            }
        }
    }

    #[test]
    fn winding_numbers_of_overlaps_cavities_and_inverted_boxes() {
        let mut mesh = (Vec::new(), Vec::new());
        add_box(&mut mesh, DVec3::ZERO, DVec3::splat(4.0));
        add_box(&mut mesh, DVec3::splat(1.0), DVec3::splat(5.0));
        let from = mesh.1.len();
        add_box(&mut mesh, DVec3::splat(1.0), DVec3::new(2.0, 6.0, 3.0));
        mesh.1[from..].iter_mut().for_each(|f| f.swap(1, 2));
        let mesh = TriangleMesh::new(mesh.0, mesh.1).unwrap();
        let tree = WindingNumber::new(&mesh);
        assert_eq!(tree.at(DVec3::new(2.5, 2.5, 3.5)), 2);
        assert_eq!(tree.at(DVec3::new(1.5, 5.5, 2.5)), -1);
        for x in lattice(6) {
            assert_all_ways_agree(&mesh, &tree, x);
        }
    }

    #[test]
    fn winding_numbers_far_from_the_origin_and_of_a_flat_mesh() {
        let mut mesh = (Vec::new(), Vec::new());
        let at = DVec3::new(1e16, -3e15, 7.0);
        add_box(&mut mesh, at, at + 8.0);
        let mesh = TriangleMesh::new(mesh.0, mesh.1).unwrap();
        let tree = WindingNumber::new(&mesh);
        assert_eq!(tree.at(at + 4.0), 1);
        assert_eq!(tree.at(at - 4.0), 0);
        assert_eq!((tree.at_perturbed(at), tree.at_perturbed(at + 8.0)), (1, 0));

        let point = TriangleMesh::new(vec![at; 3], vec![[0, 1, 2]]).unwrap();
        assert_eq!(WindingNumber::new(&point).at(at), 0);
        assert_eq!(WindingNumber::new(&point).at_perturbed(at), 0);
        assert_eq!(tree.at(DVec3::NAN), 0);
        assert_eq!(tree.at_perturbed(DVec3::NAN), 0);
    }

    proptest! {
        /// Boundaries of random tetrahedra on a small lattice: closed, with many ties, overlaps and
        /// flat faces.
        #[test]
        fn random_closed_meshes(
            corners in prop::collection::vec(prop::array::uniform3(0i32..5), 4..12),
            tetrahedra in prop::collection::vec(prop::array::uniform4(0usize..12), 1..8),
            points in prop::collection::vec(prop::array::uniform3(-2i32..12), 40),
        ) {
            let point = |c: &[i32; 3]| DVec3::new(c[0].into(), c[1].into(), c[2].into());
            let n = corners.len();
            let faces = tetrahedra
                .iter()
                .map(|t| t.map(|v| (v % n) as u32))
                .flat_map(|[a, b, c, d]| [[a, c, b], [a, b, d], [b, c, d], [c, a, d]])
                .collect();
            let mesh = TriangleMesh::new(corners.iter().map(point).collect(), faces).unwrap();
            let tree = WindingNumber::new(&mesh);
            for p in &points {
                assert_all_ways_agree(&mesh, &tree, 0.5 * point(p));
            }
        }

        /// A sphere whose points move at random along their radius, and points in general position.
        #[test]
        fn random_spheres(radii in prop::collection::vec(0.3f64..1.7, 50), seeds in prop::array::uniform32(-1.0f64..1.0)) {
            let (rings, around) = (6usize, 8usize);
            let mut vertices = vec![DVec3::new(0.0, 0.0, radii[0]), DVec3::new(0.0, 0.0, -radii[1])];
            for i in 1..=rings {
                for j in 0..around {
                    let (t, u) = (
                        std::f64::consts::PI * i as f64 / (rings + 1) as f64,
                        std::f64::consts::TAU * j as f64 / around as f64,
                    );
                    let direction = DVec3::new(t.sin() * u.cos(), t.sin() * u.sin(), t.cos());
                    vertices.push(direction * radii[2 + (i - 1) * around + j]);
                }
            }
            let id = |i: usize, j: usize| (2 + i * around + j % around) as u32;
            let mut faces = Vec::new();
            for j in 0..around {
                faces.push([0, id(0, j), id(0, j + 1)]);
                faces.push([1, id(rings - 1, j + 1), id(rings - 1, j)]);
                for i in 0..rings - 1 {
                    faces.push([id(i, j), id(i + 1, j), id(i + 1, j + 1)]);
                    faces.push([id(i, j), id(i + 1, j + 1), id(i, j + 1)]);
                }
            }
            let mesh = TriangleMesh::new(vertices, faces).unwrap();
            let tree = WindingNumber::new(&mesh);
            for x in seeds.windows(3).map(|w| DVec3::new(w[0], w[1], w[2]) * 1.5) {
                let angle = by_solid_angle(&mesh, x);
                prop_assume!((angle - angle.round()).abs() < 1e-6);
                prop_assert_eq!(tree.at(x), angle.round() as i32);
                prop_assert_eq!(tree.at_perturbed(x), angle.round() as i32);
                for p in seeds.windows(3).skip(3).step_by(7).map(|w| DVec3::new(w[2], w[0], w[1])) {
                    let end = by_solid_angle(&mesh, p);
                    prop_assert_eq!(tree.crossings(x, p), (angle - end).round() as i32);
                }
            }
        }
    }
}
