use std::collections::BTreeMap;

use glam::DVec3;

use super::BoundaryLoop;
use crate::mesh::{Defect, DefectKind, Severity, Topology, TriangleMesh};

/// Number of faces that the message of an edge names. Its defect has all of them.
const NAMED: usize = 16;

/// Finds open, non-manifold and inconsistently oriented edges, and non-orientable surfaces.
pub(super) fn edge_defects(mesh: &TriangleMesh, topology: &Topology, lenient: Severity) -> Vec<Defect> {
    let mut defects = Vec::new();
    let middle = |[a, b]: [u32; 2]| 0.5 * (mesh.vertices()[a as usize] + mesh.vertices()[b as usize]);
    for edge in topology.edges().iter().filter(|e| !e.is_manifold()) {
        let [a, b] = edge.vertices;
        let faces: Vec<u32> = topology.uses(edge).iter().map(|u| u.face).collect();
        let mut named = faces.iter().take(NAMED).map(u32::to_string).collect::<Vec<_>>().join(", ");
        if faces.len() > NAMED {
            named += ", …";
        }
        let (kind, severity, message) = match edge.face_count() {
            1 => (
                DefectKind::OpenEdge,
                Severity::Error,
                format!("edge {a}-{b} is open: only face {named} has it"),
            ),
            2 => (
                DefectKind::InconsistentOrientation,
                Severity::Error,
                format!(
                    "faces {named} run along edge {a}-{b} in the same direction: one of them is reversed"
                ),
            ),
            n if edge.is_balanced() => (
                DefectKind::NonManifoldEdge,
                lenient,
                format!("edge {a}-{b} is non-manifold: {n} consistently oriented faces ({named})"),
            ),
            n => (
                DefectKind::NonManifoldEdge,
                Severity::Error,
                format!(
                    "edge {a}-{b} is non-manifold: {n} faces ({named}), {} one way and {} the other",
                    edge.forward, edge.backward
                ),
            ),
        };
        let defect = Defect::new(kind, severity, middle(edge.vertices), message);
        defects.push(defect.faces(faces).vertices(edge.vertices));
    }
    if defects.iter().any(|d| d.kind == DefectKind::InconsistentOrientation) {
        for e in topology.consistent_orientation().1 {
            let edge = &topology.edges()[e];
            let [a, b] = edge.vertices;
            let faces: Vec<u32> = topology.uses(edge).iter().map(|u| u.face).collect();
            let message = format!(
                "the surface around edge {a}-{b} is non-orientable: like a Moebius strip, it has one side"
            );
            let defect =
                Defect::new(DefectKind::NonOrientable, Severity::Error, middle(edge.vertices), message);
            defects.push(defect.faces(faces).vertices(edge.vertices));
        }
    }
    defects
}

/// Finds vertices where more than one fan of faces meet.
pub(super) fn vertex_defects(mesh: &TriangleMesh, topology: &Topology, lenient: Severity) -> Vec<Defect> {
    let fans = topology.fans(mesh.vertices().len());
    let mut faces: BTreeMap<u32, Vec<u32>> =
        fans.iter().enumerate().filter(|(_, n)| **n > 1).map(|(v, _)| (v as u32, Vec::new())).collect();
    if faces.is_empty() {
        return Vec::new();
    }
    for (f, corners) in mesh.faces().iter().enumerate() {
        for v in corners {
            if let Some(list) = faces.get_mut(v) {
                list.push(f as u32);
            }
        }
    }
    let defect = |(v, mut faces): (u32, Vec<u32>)| {
        faces.dedup();
        let message = format!(
            "vertex {v} is non-manifold: {} fans of faces touch only there ({} faces)",
            fans[v as usize],
            faces.len()
        );
        Defect::new(DefectKind::NonManifoldVertex, lenient, mesh.vertices()[v as usize], message)
            .faces(faces)
            .vertices([v])
    };
    faces.into_iter().map(defect).collect()
}

/// Chains the open edges into loops and paths.
pub(super) fn boundary_loops(mesh: &TriangleMesh, topology: &Topology) -> Vec<BoundaryLoop> {
    let open = topology.edges().iter().filter(|e| e.face_count() == 1);
    let directed = open.map(|e| {
        let [a, b] = e.vertices;
        if e.forward == 1 { [a, b] } else { [b, a] }
    });
    let position = |v: u32| mesh.vertices()[v as usize];
    let length = |vertices: &[u32], closed: bool| {
        let inner: f64 = vertices.windows(2).map(|w| position(w[0]).distance(position(w[1]))).sum();
        let ends = [vertices[0], vertices[vertices.len() - 1]].map(position);
        if closed { inner + ends[0].distance(ends[1]) } else { inner }
    };
    directed_loops(directed)
        .into_iter()
        .map(|(vertices, closed)| BoundaryLoop { length: length(&vertices, closed), vertices, closed })
        .collect()
}

/// Chains directed edges end to end. The flag says whether a chain closes. Deterministic: a chain
/// begins at the start of a path if there is one, at the lowest remaining vertex, and always takes
/// the lowest next vertex.
fn directed_loops(edges: impl Iterator<Item = [u32; 2]>) -> Vec<(Vec<u32>, bool)> {
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut balance: BTreeMap<u32, i64> = BTreeMap::new();
    for [a, b] in edges {
        next.entry(a).or_default().push(b);
        *balance.entry(a).or_default() += 1;
        *balance.entry(b).or_default() -= 1;
    }
    next.values_mut().for_each(|ends| ends.sort_unstable_by(|a, b| b.cmp(a)));
    let starts: Vec<u32> = balance
        .iter()
        .flat_map(|(&v, &n)| std::iter::repeat_n(v, n.max(0) as usize))
        .chain(next.iter().flat_map(|(&v, ends)| std::iter::repeat_n(v, ends.len())))
        .collect();
    let mut loops = Vec::new();
    for start in starts {
        let mut chain = vec![start];
        let mut closed = false;
        while let Some(to) = chain.last().and_then(|at| next.get_mut(at)?.pop()) {
            closed = to == start;
            if closed {
                break;
            }
            chain.push(to);
        }
        if chain.len() > 1 {
            loops.push((chain, closed));
        }
    }
    loops
}

/// Centroid of a face.
pub(super) fn centroid(mesh: &TriangleMesh, face: u32) -> DVec3 {
    let [a, b, c] = mesh.triangle(face as usize);
    (a + b + c) / 3.0
}
