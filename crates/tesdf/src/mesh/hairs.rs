//! Faces without area that stand out of the surface.
use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::check::has_no_area;
use super::topology::has_repeated_corner;
use super::{Defect, DefectKind, Topology};

/// Faces without area that stand out of the surface of the others, in ascending order. Distances
/// refer to such a face as to a segment or a point.
///
/// A face stands out when it has an edge that is no edge of a face with area. Without these faces,
/// each edge is used as often in each direction as before, so winding numbers stay the same. A face
/// that closes a gap between others is none of them.
pub(crate) fn hairs(vertices: &[DVec3], faces: &[[u32; 3]]) -> Vec<u32> {
    let is_flat = |corners: &[u32; 3]| {
        has_repeated_corner(*corners) || has_no_area(corners.map(|v| vertices[v as usize]))
    };
    let flat: Vec<u32> = (0..).zip(faces).filter(|(_, corners)| is_flat(corners)).map(|(f, _)| f).collect();
    if flat.is_empty() {
        return flat;
    }
    let search = Search { faces, topology: Topology::new(faces), flat: flat.iter().copied().collect() };
    let on_surface: HashSet<u32> = (0..)
        .zip(faces)
        .filter(|(f, _)| !search.flat.contains(f))
        .flat_map(|(_, corners)| *corners)
        .collect();
    let mut hairs = Vec::new();
    let mut seen: HashSet<u32> = HashSet::new();
    for face in flat {
        let corners = faces[face as usize];
        if has_repeated_corner(corners) {
            if search.stands_out(face) || !corners.iter().all(|v| on_surface.contains(v)) {
                hairs.push(face);
            }
        } else if !seen.contains(&face) {
            let group = search.group(face);
            seen.extend(&group);
            if search.is_balanced(&group) && group.iter().any(|&f| search.stands_out(f)) {
                hairs.extend(group);
            }
        }
    }
    hairs.sort_unstable();
    hairs
}

struct Search<'a> {
    faces: &'a [[u32; 3]],
    topology: Topology,
    /// Faces without area.
    flat: HashSet<u32>,
}

impl Search<'_> {
    fn edges(&self, face: u32) -> impl Iterator<Item = [u32; 2]> {
        let corners = self.faces[face as usize];
        (0..3).map(move |k| [corners[k], corners[(k + 1) % 3]]).filter(|[a, b]| a != b)
    }

    /// The faces on an edge, apart from those with two equal corners.
    fn on_edge(&self, [a, b]: [u32; 2]) -> impl Iterator<Item = u32> {
        let edge = self.topology.edge([a.min(b), a.max(b)]);
        edge.into_iter().flat_map(|edge| self.topology.uses(edge)).map(|found| found.face)
    }

    /// Whether an edge of a face without area is no edge of a face with area.
    fn stands_out(&self, face: u32) -> bool {
        self.edges(face).any(|edge| self.on_edge(edge).all(|f| self.flat.contains(&f)))
    }

    /// The faces without area that are connected with this one over their edges.
    fn group(&self, face: u32) -> Vec<u32> {
        let (mut group, mut seen) = (vec![face], HashSet::from([face]));
        let mut next = 0;
        while let Some(&face) = group.get(next) {
            next += 1;
            for other in self.edges(face).flat_map(|edge| self.on_edge(edge)) {
                if self.flat.contains(&other) && seen.insert(other) {
                    group.push(other);
                }
            }
        }
        group
    }

    /// Whether the faces use each edge as often in one direction as in the other.
    fn is_balanced(&self, faces: &[u32]) -> bool {
        let mut uses: HashMap<[u32; 2], i64> = HashMap::new();
        for [a, b] in faces.iter().flat_map(|&face| self.edges(face)) {
            *uses.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
        }
        uses.values().all(|n| *n == 0)
    }
}

/// Adds to the warnings about faces without area what becomes of those that stand out.
pub(crate) fn tell_of_hairs(defects: &mut [Defect], hairs: &[u32], what: &str) {
    for defect in defects {
        let is_flat = matches!(defect.kind, DefectKind::RepeatedCorner | DefectKind::ZeroArea);
        if is_flat && defect.faces.iter().all(|face| hairs.binary_search(face).is_ok()) {
            defect.message.push_str("; it stands out of the surface, ");
            defect.message.push_str(what);
        }
    }
}

/// What becomes of a face that stands out, where all faces are the surface.
pub(crate) const COUNTS: &str = "and distances refer to it, too";

/// What becomes of it where only the boundary is the surface.
pub(crate) const LEFT_OUT: &str = "and is left out of it";

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron, a point far from it, and points on one of its edges.
    fn found(more: &[[u32; 3]]) -> Vec<u32> {
        let far = DVec3::new(0.0, 0.0, 9.0);
        let vertices =
            [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, far, 0.5 * DVec3::X, 2.0 * DVec3::Z, 3.0 * DVec3::Z];
        let solid = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        hairs(&vertices, &[&solid, more].concat())
    }

    #[test]
    fn only_faces_that_stand_out_and_close_nothing_are_hairs() {
        assert!(found(&[]).is_empty());
        // Two equal corners: out of the surface, a point off it, along an edge, at a vertex.
        assert_eq!(found(&[[3, 4, 3], [4, 4, 4], [0, 1, 0], [1, 1, 1]]), [4, 5]);
        // Three corners on a line, there and back. The same along an edge of the surface.
        assert_eq!(found(&[[3, 6, 4], [4, 6, 3]]), [4, 5]);
        assert_eq!(found(&[[0, 5, 1], [1, 5, 0]]), [4, 5], "the middle of the edge is no vertex of it");
        // Without its reverse, such a face is needed to balance the edges of others.
        assert!(found(&[[3, 6, 4]]).is_empty());
        assert_eq!(found(&[[3, 6, 4], [4, 6, 7], [7, 4, 7]]), [6]);
        assert_eq!(found(&[[3, 6, 4], [4, 6, 7], [7, 6, 3], [3, 4, 7]]), [4, 5, 6, 7]);
    }
}
