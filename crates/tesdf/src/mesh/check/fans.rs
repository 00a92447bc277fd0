//! Finds pairs of faces that may meet, also where many faces surround one vertex.
//!
//! The box of a long face that is not parallel to an axis is much larger than the face. In a fan of
//! n faces nearly all n² / 2 pairs of boxes overlap. Seen from the vertex of the fan, its faces are
//! arcs, and few boxes of arcs overlap. The directions in which another face is seen show which
//! arcs it can meet.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use glam::DVec3;

use crate::{
    geometry::{Aabb, AabbTree, self_overlaps},
    mesh::TriangleMesh,
};

/// Largest number of items in a leaf of the trees.
const LEAF_SIZE: usize = 4;

/// A vertex with more faces than this makes a large fan.
const LARGE: usize = 128;

/// Calls `pair` once for each two of `faces` (ascending) that may meet, lower face first, until it
/// breaks off. All pairs that meet are among the calls.
///
/// The order of the calls depends on the mesh alone.
pub(super) fn pairs_that_may_meet(
    mesh: &TriangleMesh,
    faces: &[u32],
    mut pair: impl FnMut(u32, u32) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let mut pair = |f: u32, g: u32| pair(f.min(g), f.max(g));
    let (rest, fans) = large_fans(mesh, faces);
    let boxes: Vec<Aabb> = rest.iter().map(|&f| box_of(mesh, f)).collect();
    self_overlaps(&AabbTree::build(&boxes, LEAF_SIZE), &boxes, |i, j| {
        pair(rest[i as usize], rest[j as usize])
    })?;
    let around_fans: Vec<Aabb> = fans.iter().map(|fan| fan.bounds).collect();
    let tree = AabbTree::build(&around_fans, LEAF_SIZE);
    for (number, fan) in fans.iter().enumerate() {
        self_overlaps(&fan.tree, &fan.arcs, |i, j| pair(fan.faces[i as usize], fan.faces[j as usize]))?;
        for &face in &fan.faces {
            in_fans(mesh, face, &tree, &fans[..number])
                .into_iter()
                .try_for_each(|other| pair(face, other))?;
        }
    }
    rest.iter().try_for_each(|&face| {
        in_fans(mesh, face, &tree, &fans).into_iter().try_for_each(|other| pair(face, other))
    })
}

/// The faces in `fans` that may meet `face`, which is in none of them. `tree` holds the bounds of
/// all fans; `fans` are the first of them.
fn in_fans(mesh: &TriangleMesh, face: u32, tree: &AabbTree, fans: &[Fan]) -> Vec<u32> {
    let bounds = box_of(mesh, face);
    let mut found = Vec::new();
    tree.visit(
        |around| around.overlaps(bounds),
        |numbers| {
            let near = numbers.iter().filter_map(|&n| fans.get(n as usize));
            for fan in near.filter(|fan| fan.bounds.overlaps(bounds)) {
                let seen = Seen::from(fan.center, mesh.triangle(face as usize));
                fan.tree.visit(
                    |arcs| seen.may_meet(arcs),
                    |items| {
                        let others = items.iter().map(|&i| fan.faces[i as usize]);
                        found.extend(others.filter(|&f| box_of(mesh, f).overlaps(bounds)));
                    },
                );
            }
        },
    );
    found
}

/// The faces around a vertex with many faces.
struct Fan {
    center: DVec3,
    faces: Vec<u32>,
    /// Bounds of all faces.
    bounds: Aabb,
    /// For each face, a box around the directions in which it is seen from the centre. `tree` holds
    /// these boxes.
    arcs: Vec<Aabb>,
    tree: AabbTree,
}

impl Fan {
    fn new(mesh: &TriangleMesh, vertex: u32, faces: Vec<u32>) -> Self {
        let center = mesh.vertices()[vertex as usize];
        let arc = |&f: &u32| {
            let ends = mesh.faces()[f as usize].into_iter().filter(|&v| v != vertex);
            let mut seen = Aabb::EMPTY;
            let mut width: f64 = 0.0;
            let mut last = None;
            for d in ends.map(|v| direction(center, mesh.vertices()[v as usize])) {
                seen = seen.union(Aabb::of(&[d]));
                width = last.map_or(0.0, |last: DVec3| last.distance_squared(d));
                last = Some(d);
            }
            // The height of an arc over its chord is at most the square of half of the chord.
            seen.grown(0.25 * width + ROUNDING)
        };
        let arcs: Vec<Aabb> = faces.iter().map(arc).collect();
        let bounds = faces.iter().fold(Aabb::EMPTY, |b, &f| b.union(box_of(mesh, f)));
        Self { center, bounds, tree: AabbTree::build(&arcs, LEAF_SIZE), arcs, faces }
    }
}

/// The faces that are in no large fan, and the large fans by vertex. A face with several such
/// vertices belongs to the fan of the first of its corners.
fn large_fans(mesh: &TriangleMesh, faces: &[u32]) -> (Vec<u32>, Vec<Fan>) {
    let mut count = vec![0usize; mesh.vertices().len()];
    faces.iter().flat_map(|&f| mesh.faces()[f as usize]).for_each(|v| count[v as usize] += 1);
    let mut rest = Vec::new();
    let mut fans: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &f in faces {
        match mesh.faces()[f as usize].into_iter().find(|&v| count[v as usize] > LARGE) {
            Some(v) => fans.entry(v).or_default().push(f),
            None => rest.push(f),
        }
    }
    (rest, fans.into_iter().map(|(v, faces)| Fan::new(mesh, v, faces)).collect())
}

/// More than the rounding error of a direction.
const ROUNDING: f64 = 1e-14;

/// Unit vector from one point to another.
fn direction(from: DVec3, to: DVec3) -> DVec3 {
    let d = to - from;
    (d / d.abs().max_element()).normalize_or_zero()
}

/// A triangle seen from a point: the planes through the point and its sides.
struct Seen {
    /// The outward normal of each plane, and a bound of how far a direction of the triangle may lie
    /// beyond the plane. `None` when the triangle spans nearly a half-space or more.
    planes: Option<[(DVec3, f64); 3]>,
}

/// When all cosines between the corners and their sum exceed this value, a unit vector inside is a
/// weighted sum of the corners, with weights that add up to at most 3 / 0.1.
const MIN_COSINE: f64 = 0.1;

impl Seen {
    fn from(center: DVec3, t: [DVec3; 3]) -> Self {
        let corners = t.map(|c| direction(center, c));
        let middle = corners[0] + corners[1] + corners[2];
        if !corners.iter().all(|c| c.dot(middle) > MIN_COSINE) {
            return Self { planes: None };
        }
        let plane = |k: usize| {
            let normal = corners[k].cross(corners[(k + 1) % 3]);
            let normal = if normal.dot(corners[(k + 2) % 3]) > 0.0 { -normal } else { normal };
            let beyond = corners.iter().map(|&c| normal.dot(c)).fold(0.0, f64::max);
            (normal, (beyond + ROUNDING * normal.length()) * 3.0 / MIN_COSINE)
        };
        Self { planes: Some([0, 1, 2].map(plane)) }
    }

    /// Whether the triangle may be seen in a direction of the box.
    fn may_meet(&self, arcs: Aabb) -> bool {
        let beyond = |&(normal, limit): &(DVec3, f64)| {
            let least = DVec3::select(normal.cmpgt(DVec3::ZERO), arcs.min, arcs.max);
            normal.dot(least) > limit
        };
        self.planes.as_ref().is_none_or(|planes| !planes.iter().any(beyond))
    }
}

fn box_of(mesh: &TriangleMesh, face: u32) -> Aabb {
    Aabb::of(&mesh.triangle(face as usize))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;
    use crate::geometry::segment_meets_triangle;

    fn found(mesh: &TriangleMesh) -> BTreeSet<[u32; 2]> {
        let faces: Vec<u32> = (0..mesh.faces().len() as u32).collect();
        let mut pairs = BTreeSet::new();
        let all = pairs_that_may_meet(mesh, &faces, |f, g| {
            assert!(f < g && pairs.insert([f, g]), "{f} and {g} come twice or turned round");
            ControlFlow::Continue(())
        });
        assert!(all.is_continue());
        pairs
    }

    /// A prism over a regular polygon with n sides. Each end is a fan around one of its corners.
    fn prism(n: u32) -> TriangleMesh {
        let at = |k: u32, z: f64| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(n);
            DVec3::new(angle.cos(), angle.sin(), z)
        };
        let vertices = (0..n).map(|k| at(k, 0.0)).chain((0..n).map(|k| at(k, 0.5))).collect();
        let sides = (0..n).flat_map(|k| {
            let next = (k + 1) % n;
            [[k, next, n + next], [k, n + next, n + k]]
        });
        let ends = (1..n - 1).flat_map(|k| [[0, k + 1, k], [n, n + k, n + k + 1]]);
        TriangleMesh::new(vertices, sides.chain(ends).collect()).expect("valid ids")
    }

    #[test]
    fn pairs_of_a_large_fan_grow_with_its_faces() {
        for n in [1000, 4000] {
            let pairs = found(&prism(n)).len();
            assert!(pairs < 40 * n as usize, "{pairs} of the {} pairs of one end", n * n / 2);
        }
    }

    fn meet_beside_a_shared_corner(mesh: &TriangleMesh, f: u32, g: u32) -> bool {
        let at = |v: u32| mesh.vertices()[v as usize];
        let (t, u) = (mesh.faces()[f as usize], mesh.faces()[g as usize]);
        // Tests the sides of one face, except those at the shared corner, against the other face.
        let sides_meet = |t: [u32; 3], u: [u32; 3]| {
            let sides = [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
            let mut apart = sides.into_iter().filter(|side| side.iter().all(|v| !u.contains(v)));
            apart.any(|[p, q]| segment_meets_triangle(at(p), at(q), u.map(at)))
        };
        sides_meet(t, u) || sides_meet(u, t)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// Fans that fold and cross themselves and each other, with faces without area, surrounded
        /// by loose faces.
        #[test]
        fn all_intersecting_faces_are_found(seed in prop::collection::vec(-1.0..1.0_f64, 90), flat in any::<bool>(), shared in any::<bool>()) {
            let mut numbers = seed.iter().copied().cycle().enumerate().map(|(k, x)| (x * (k as f64 + 1.0) * 17.3).fract());
            let mut point = || {
                let mut next = || numbers.next().unwrap_or(0.0);
                DVec3::new(next(), next(), if flat { 0.0 } else { next() })
            };
            // Two fans of 150 faces. The second is around a rim vertex of the first, or separate.
            let mut vertices: Vec<DVec3> = (0..400).map(|_| point()).collect();
            vertices[7] = vertices[8];
            let second = if shared { 5 } else { 200 };
            let mut faces: Vec<[u32; 3]> = (1..151).map(|k| [0, k, k + 1]).collect();
            faces.extend((201..351).map(|k| [second, k, k + 1]));
            faces.extend((0..60).map(|k| [k * 6, k * 6 + 1, k * 6 + 2]));
            let mesh = TriangleMesh::new(vertices, faces).expect("valid ids");
            let found = found(&mesh);
            for f in 0..mesh.faces().len() as u32 {
                for g in f + 1..mesh.faces().len() as u32 {
                    let meet = meet_beside_a_shared_corner(&mesh, f, g);
                    prop_assert!(!meet || found.contains(&[f, g]), "{f} and {g}");
                }
            }
        }
    }
}
