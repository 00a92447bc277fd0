use glam::DVec3;

use super::TriangleMesh;
use crate::geometry::signed_crossing;
pub use crate::geometry::winding::WindingNumber;

impl WindingNumber {
    /// Builds the tree over the faces.
    pub fn new(mesh: &TriangleMesh) -> Self {
        Self::of_triangles((0..mesh.faces().len()).map(|f| mesh.triangle(f)).collect())
    }

    /// The winding number at `x` from all faces, without a tree. Slow; for comparisons. `x` as in
    /// [`at`](Self::at).
    pub fn brute_force(mesh: &TriangleMesh, x: DVec3) -> i32 {
        let far = mesh.bounds().max + DVec3::new(1.0, 2.0, 3.0) * mesh.diagonal();
        (0..mesh.faces().len()).map(|f| signed_crossing(x, far, mesh.triangle(f))).sum()
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
