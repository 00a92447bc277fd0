use std::collections::{HashMap, HashSet};
use std::ops::ControlFlow;

use super::edges::centroid;
use super::fans::pairs_that_may_meet;
use crate::{
    geometry::{Aabb, normal_signs, orientation, segment_meets_triangle, surely_apart, triangles_meet},
    mesh::{Defect, DefectKind, Severity, TriangleMesh},
};

/// Largest number of pairs that the search returns in a small mesh, and per face in a large mesh.
/// The surface of a solid has far fewer. If all faces meet each other, the number of pairs is
/// quadratic and fits no memory.
const MAX_PAIRS: usize = 1 << 20;
const MAX_PAIRS_PER_FACE: usize = 2;

/// A mesh with at least this number of intersecting pairs is refused.
pub(crate) fn max_pairs(mesh: &TriangleMesh) -> usize {
    MAX_PAIRS.max(MAX_PAIRS_PER_FACE * mesh.faces().len())
}

/// Finds pairs of faces that meet in more than the corners or the edge that they share. Pairs are
/// ascending, with the lower face first. The search ends at [`max_pairs`] pairs.
///
/// The test is exact. It leaves out faces without area (`without_area`, ascending), pairs with the
/// same three corners, and the pairs in `touching`, which meet in a T-junction or along a collinear
/// face.
pub(crate) fn self_intersections(
    mesh: &TriangleMesh,
    without_area: &[u32],
    touching: &HashSet<(u32, u32)>,
) -> Vec<[u32; 2]> {
    let copies = Copies::find(mesh, without_area);
    let (mut pairs, most) = (Vec::new(), max_pairs(mesh));
    // The number of pairs shows whether the search was broken off.
    let _ = pairs_that_may_meet(mesh, &copies.first, |f, g| {
        if meet_beyond_shared(mesh, f, g) {
            let both = copies.of(f).flat_map(|f| copies.of(g).map(move |g| [f.min(g), f.max(g)]));
            let apart = |&[f, g]: &[u32; 2]| !touching.contains(&(f, g)) && !touching.contains(&(g, f));
            pairs.extend(both.filter(apart).take(most - pairs.len()));
        }
        if pairs.len() < most { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    pairs.sort_unstable();
    pairs
}

/// Faces with the same three corners, which meet the same faces. A mesh may have any number of
/// them, and they make no pair with each other.
struct Copies {
    /// The first face with its three corners, ascending.
    first: Vec<u32>,
    /// For a first face, all later ones, ascending.
    later: HashMap<u32, Vec<u32>>,
}

impl Copies {
    fn find(mesh: &TriangleMesh, without_area: &[u32]) -> Self {
        let mut known: HashMap<[u32; 3], u32> = HashMap::with_capacity(mesh.faces().len());
        let mut copies = Self { first: Vec::new(), later: HashMap::new() };
        for (face, &(mut corners)) in (0..).zip(mesh.faces()) {
            if without_area.binary_search(&face).is_err() {
                corners.sort_unstable();
                match *known.entry(corners).or_insert(face) {
                    first if first == face => copies.first.push(face),
                    first => copies.later.entry(first).or_default().push(face),
                }
            }
        }
        copies
    }

    fn of(&self, first: u32) -> impl Iterator<Item = u32> + Clone {
        let later = self.later.get(&first).map_or(&[][..], Vec::as_slice);
        std::iter::once(first).chain(later.iter().copied())
    }
}

/// Whether two faces with area meet in more than the corners or the edge that they share by index.
fn meet_beyond_shared(mesh: &TriangleMesh, f: u32, g: u32) -> bool {
    let (corners, others) = (mesh.faces()[f as usize], mesh.faces()[g as usize]);
    let (t, u) = (mesh.triangle(f as usize), mesh.triangle(g as usize));
    let in_g = corners.map(|v| others.contains(&v));
    let in_f = others.map(|v| corners.contains(&v));
    match in_g.iter().filter(|&&shared| shared).count() {
        0 => !surely_apart(t, u, false) && triangles_meet(t, u),
        1 => {
            let from_shared = |t: [glam::DVec3; 3], shared: [bool; 3]| {
                let k = shared.iter().position(|&s| s).unwrap_or(0);
                [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]
            };
            let (t, u) = (from_shared(t, in_g), from_shared(u, in_f));
            // Any common point besides the shared corner extends to the edge opposite to that
            // corner in one of the two faces.
            !surely_apart(t, u, true)
                && (segment_meets_triangle(u[1], u[2], t) || segment_meets_triangle(t[1], t[2], u))
        }
        2 => {
            // They meet elsewhere only when they are folded flat onto each other.
            let apex =
                |t: [glam::DVec3; 3], shared: [bool; 3]| t[shared.iter().position(|&s| !s).unwrap_or(0)];
            let (c, d) = (apex(t, in_g), apex(u, in_f));
            if orientation(t[0], t[1], t[2], d) != 0 {
                return false;
            }
            let k = in_g.iter().position(|&s| !s).unwrap_or(0);
            let (a, b) = (t[(k + 1) % 3], t[(k + 2) % 3]);
            let (here, there) = (normal_signs(a, b, c), normal_signs(a, b, d));
            (0..3).any(|axis| here[axis] * there[axis] > 0)
        }
        _ => false,
    }
}

pub(super) fn defects(mesh: &TriangleMesh, pairs: &[[u32; 2]], lenient: Severity) -> Vec<Defect> {
    if pairs.len() >= max_pairs(mesh) {
        let [f, g] = pairs[0];
        let message = format!(
            "{} pairs of faces intersect, such as faces {f} and {g}, and perhaps more: too many for the surface of a solid",
            pairs.len()
        );
        let defect = Defect::new(DefectKind::SelfIntersection, Severity::Error, centroid(mesh, f), message);
        return vec![defect.faces([f, g])];
    }
    pairs
        .iter()
        .map(|&[f, g]| {
            let (t, u) = (Aabb::of(&mesh.triangle(f as usize)), Aabb::of(&mesh.triangle(g as usize)));
            let common = Aabb { min: t.min.max(u.min), max: t.max.min(u.max) };
            let place = if common.min.cmple(common.max).all() { common.center() } else { centroid(mesh, f) };
            let message = format!("faces {f} and {g} intersect");
            Defect::new(DefectKind::SelfIntersection, lenient, place, message).faces([f, g])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;

    /// A triangle without a thin strip at the corners `shared`, split into triangles. The
    /// coordinates stay exact.
    fn trimmed(t: [DVec3; 3], shared: [bool; 3]) -> Vec<[DVec3; 3]> {
        let off = |from: DVec3, to: DVec3| from + (to - from) / 1024.0;
        match shared.iter().filter(|&&s| s).count() {
            0 => vec![t],
            1 => {
                let k = shared.iter().position(|&s| s).unwrap();
                let [a, b, c] = [0, 1, 2].map(|i| t[(k + i) % 3]);
                vec![[off(a, b), b, c], [off(a, b), c, off(a, c)]]
            }
            _ => {
                let k = shared.iter().position(|&s| !s).unwrap();
                let [c, a, b] = [0, 1, 2].map(|i| t[(k + i) % 3]);
                vec![[c, off(a, c), off(b, c)]]
            }
        }
    }

    /// It took hours, because all pairs of faces share their boxes.
    #[test]
    fn a_million_faces_that_coincide_take_the_time_of_reading_them() {
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let mut faces = vec![[0, 1, 2]; 1_000_000];
        faces.push([0, 1, 3]);
        let mesh = TriangleMesh::new(vertices, faces).unwrap();
        assert_eq!(self_intersections(&mesh, &[], &HashSet::new()), Vec::<[u32; 2]>::new());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]
        /// Two faces meet beyond what they share exactly when they still meet after thin strips
        /// along the shared part are removed.
        #[test]
        fn intersections_equal_brute_force(faces in prop::collection::vec(prop::array::uniform3(0u32..27), 2..16)) {
            let vertices = (0..27).map(|v| DVec3::new((v % 3).into(), (v / 3 % 3).into(), (v / 9).into())).collect();
            let mesh = TriangleMesh::new(vertices, faces).unwrap();
            let n = mesh.faces().len() as u32;
            let flat = |f: u32| {
                let [a, b, c] = mesh.triangle(f as usize);
                normal_signs(a, b, c) == [0; 3]
            };
            let without_area: Vec<u32> = (0..n).filter(|&f| flat(f)).collect();
            let mut expected = Vec::new();
            for f in 0..n {
                for g in f + 1..n {
                    let (corners, others) = (mesh.faces()[f as usize], mesh.faces()[g as usize]);
                    let (in_g, in_f) = (corners.map(|v| others.contains(&v)), others.map(|v| corners.contains(&v)));
                    if flat(f) || flat(g) || in_g == [true; 3] {
                        continue;
                    }
                    let us = trimmed(mesh.triangle(g as usize), in_f);
                    let ts = trimmed(mesh.triangle(f as usize), in_g);
                    if ts.iter().any(|&t| us.iter().any(|&u| triangles_meet(t, u))) {
                        expected.push([f, g]);
                    }
                }
            }
            prop_assert_eq!(self_intersections(&mesh, &without_area, &HashSet::new()), expected);
        }
    }
}
