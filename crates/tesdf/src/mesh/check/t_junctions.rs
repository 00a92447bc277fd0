use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::faces::middle_corner;
use crate::{
    geometry::{Aabb, AabbTree},
    mesh::{Defect, DefectKind, Severity, Topology, TriangleMesh},
};

/// Unbalanced edges with the vertices that lie on them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TJunctions {
    /// Index of an edge of the topology, and the vertices strictly between its ends, ordered from
    /// the lower end to the higher.
    pub edges: Vec<(usize, Vec<u32>)>,
    /// For each collinear face: its middle corner and the opposite edge, lower vertex first.
    collinear: Vec<(u32, [u32; 2])>,
}

/// Finds vertices at most `tolerance` away from an unbalanced edge that does not end there.
///
/// Only ends of other unbalanced edges are tested. Around any other vertex the surface is complete,
/// so splitting the edge at that vertex could not close a gap.
pub(crate) fn t_junctions(vertices: &[DVec3], topology: &Topology, tolerance: f64) -> TJunctions {
    let open: Vec<usize> =
        (0..topology.edges().len()).filter(|&e| !topology.edges()[e].is_balanced()).collect();
    let mut candidates: Vec<u32> = open.iter().flat_map(|&e| topology.edges()[e].vertices).collect();
    candidates.sort_unstable();
    candidates.dedup();
    let boxes: Vec<Aabb> = candidates.iter().map(|&v| Aabb::of(&[vertices[v as usize]])).collect();
    let tree = AabbTree::build(&boxes, 4);
    let mut edges = Vec::new();
    for e in open {
        let ends = topology.edges()[e].vertices;
        let [a, b] = ends.map(|v| vertices[v as usize]);
        let direction = b - a;
        let around = Aabb::of(&[a, b]).grown(tolerance);
        let mut on_edge: Vec<(f64, u32)> = Vec::new();
        tree.visit(
            |bounds| bounds.overlaps(around),
            |items| {
                for v in items.iter().map(|&i| candidates[i as usize]).filter(|v| !ends.contains(v)) {
                    let p = vertices[v as usize];
                    let t = (p - a).dot(direction) / direction.length_squared();
                    if 0.0 < t && t < 1.0 && p.distance(a + t * direction) <= tolerance {
                        on_edge.push((t, v));
                    }
                }
            },
        );
        if !on_edge.is_empty() {
            on_edge.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
            edges.push((e, on_edge.into_iter().map(|(_, v)| v).collect()));
        }
    }
    TJunctions { edges, collinear: Vec::new() }
}

impl TJunctions {
    /// Adds the collinear faces of `mesh`, which touch their neighbours in the same way.
    pub(crate) fn with_collinear(mut self, mesh: &TriangleMesh, zero_area: &[u32]) -> Self {
        for &f in zero_area {
            let corners = mesh.faces()[f as usize];
            let (middle, [a, b]) = middle_corner(corners, mesh.triangle(f as usize));
            self.collinear.push((middle, [a.min(b), a.max(b)]));
        }
        self
    }

    pub(super) fn defects(&self, mesh: &TriangleMesh, topology: &Topology) -> Vec<Defect> {
        let mut defects = Vec::new();
        for (e, on_edge) in &self.edges {
            let edge = &topology.edges()[*e];
            let [a, b] = edge.vertices;
            let faces: Vec<u32> = topology.uses(edge).iter().map(|u| u.face).collect();
            let named = faces.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
            for &v in on_edge {
                let message = format!(
                    "vertex {v} lies on the open edge {a}-{b} of face {named}, which does not use it"
                );
                let place = mesh.vertices()[v as usize];
                let defect = Defect::new(DefectKind::TJunction, Severity::Error, place, message);
                defects.push(defect.faces(faces.clone()).vertices([v, a, b]));
            }
        }
        defects
    }

    /// Pairs of faces that touch because a corner of one face lies on an edge of the other.
    pub(crate) fn touching(&self, mesh: &TriangleMesh, topology: &Topology) -> HashSet<(u32, u32)> {
        let mut on_edges: Vec<(usize, u32)> =
            self.edges.iter().flat_map(|(e, on)| on.iter().map(|&v| (*e, v))).collect();
        for (v, ends) in &self.collinear {
            if let Ok(e) = topology.edges().binary_search_by(|edge| edge.vertices.cmp(ends)) {
                on_edges.push((e, *v));
            }
        }
        if on_edges.is_empty() {
            return HashSet::new();
        }
        let wanted: HashSet<u32> = on_edges.iter().map(|&(_, v)| v).collect();
        let mut around: HashMap<u32, Vec<u32>> = HashMap::new();
        for (f, corners) in mesh.faces().iter().enumerate() {
            for v in corners.iter().filter(|v| wanted.contains(v)) {
                around.entry(*v).or_default().push(f as u32);
            }
        }
        let mut pairs = HashSet::new();
        for (e, v) in on_edges {
            for of_edge in topology.uses(&topology.edges()[e]) {
                for &of_vertex in around.get(&v).into_iter().flatten() {
                    pairs.insert((of_edge.face.min(of_vertex), of_edge.face.max(of_vertex)));
                }
            }
        }
        pairs
    }
}
