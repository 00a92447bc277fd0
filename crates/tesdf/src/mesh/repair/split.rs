use std::collections::{BTreeSet, HashMap};

use glam::DVec3;

use super::{Draft, RepairReport, SplitEdge};
use crate::mesh::{
    Topology,
    check::{TJunctions, t_junctions},
    topology::has_repeated_corner,
};

/// Limit on the rounds. Splitting an edge can bring another vertex within reach of one of its
/// parts.
const MAX_ROUNDS: usize = 4;

/// Splits faces at the vertices that lie within `tolerance` of their open edges.
///
/// An edge is split in all of its faces at once. The parts are then used as often in each direction
/// as the edge was, and new edges inside a face are used once in each direction. So balanced edges
/// stay balanced. A face whose third corner lies on the edge leaves only parts with two equal
/// corners, so it vanishes.
///
/// Splits are kept only when they make the open edges shorter in total. They are not tried when
/// there are more than two vertices per open edge on average: then the tolerance is wider than the
/// details of the mesh, and splitting would not end.
pub(super) fn split(draft: &mut Draft, tolerance: f64, report: &mut RepairReport) {
    let mut vanished = BTreeSet::new();
    let mut topology = Topology::new(&draft.faces);
    for _ in 0..MAX_ROUNDS {
        let junctions = t_junctions(&draft.vertices, &topology, tolerance);
        let open = topology.edges().iter().filter(|e| !e.is_balanced()).count();
        let parts: usize = junctions
            .edges
            .iter()
            .map(|(e, on_edge)| on_edge.len() * topology.edges()[*e].face_count() as usize)
            .sum();
        if junctions.edges.is_empty() || parts > 2 * open {
            break;
        }
        let (faces, origin) = split_all(draft, &topology, &junctions);
        let split = Topology::new(&faces);
        let (before, after) =
            (open_lengths(&draft.vertices, &topology), open_lengths(&draft.vertices, &split));
        // The parts of an edge are as long as the edge itself, so a smaller change than this is
        // rounding.
        let shorter = |k: usize| after[k] < before[k] * (1.0 - 1e-9);
        let longer = |k: usize| after[k] > before[k] * (1.0 + 1e-9);
        if !shorter(0) && (longer(0) || !shorter(1)) {
            break;
        }
        record(draft, &topology, &junctions, report);
        let kept: BTreeSet<u32> = origin.iter().copied().collect();
        vanished.extend(draft.origin.iter().filter(|o| !kept.contains(o)));
        (draft.faces, draft.origin) = (faces, origin);
        topology = split;
    }
    report.vanished_faces = vanished.into_iter().collect();
}

/// Two total lengths. The first sums the edges with an odd number of faces, which no orientation of
/// the faces can balance. The second sums all unbalanced edges, each multiplied by its imbalance.
pub(super) fn open_lengths(vertices: &[DVec3], topology: &Topology) -> [f64; 2] {
    topology.edges().iter().filter(|e| !e.is_balanced()).fold([0.0, 0.0], |sum, edge| {
        let [a, b] = edge.vertices.map(|v| vertices[v as usize]);
        let times = [edge.face_count() % 2, edge.forward.abs_diff(edge.backward)].map(f64::from);
        [0, 1].map(|k| sum[k] + times[k] * a.distance(b))
    })
}

/// The faces after splitting, and for each the face of the input mesh that it comes from.
fn split_all(draft: &Draft, topology: &Topology, junctions: &TJunctions) -> (Vec<[u32; 3]>, Vec<u32>) {
    let chains: HashMap<[u32; 2], &[u32]> = junctions
        .edges
        .iter()
        .map(|(e, on_edge)| (topology.edges()[*e].vertices, on_edge.as_slice()))
        .collect();
    let (mut faces, mut origin) = (Vec::with_capacity(draft.faces.len()), Vec::new());
    for (&face, &from) in draft.faces.iter().zip(&draft.origin) {
        let first = faces.len();
        split_face(face, &chains, &mut faces);
        origin.resize(origin.len() + faces.len() - first, from);
    }
    (faces, origin)
}

fn record(draft: &Draft, topology: &Topology, junctions: &TJunctions, report: &mut RepairReport) {
    for (e, at) in &junctions.edges {
        let edge = &topology.edges()[*e];
        let [a, b] = edge.vertices.map(|v| draft.vertices[v as usize]);
        let off = |v: &u32| {
            let p = draft.vertices[*v as usize];
            p.distance(a + (p - a).dot(b - a) / (b - a).length_squared() * (b - a))
        };
        let mut faces: Vec<u32> = topology.uses(edge).iter().map(|u| draft.origin[u.face as usize]).collect();
        faces.dedup();
        report.split_edges.push(SplitEdge {
            edge: edge.vertices,
            at: at.clone(),
            faces,
            distance: at.iter().map(off).fold(0.0, f64::max),
        });
    }
}

/// Appends the parts of one face, except parts with two equal corners.
fn split_face(face: [u32; 3], chains: &HashMap<[u32; 2], &[u32]>, parts: &mut Vec<[u32; 3]>) {
    // Each part with a flag per edge (from corner k to k + 1): whether it is a whole edge of the
    // face, still to be split.
    let mut todo = vec![(face, [true; 3])];
    while let Some((corners, whole)) = todo.pop() {
        let found = (0..3).filter(|&k| whole[k]).find_map(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            Some((k, a, b, *chains.get(&[a.min(b), a.max(b)])?))
        });
        let Some((k, a, b, chain)) = found else {
            if !has_repeated_corner(corners) {
                parts.push(corners);
            }
            continue;
        };
        let opposite = corners[(k + 2) % 3];
        let mut along = vec![a];
        along.extend(chain);
        along.push(b);
        if a > b {
            let inner = along.len() - 1;
            along[1..inner].reverse();
        }
        let last = along.len() - 2;
        for (i, ends) in along.windows(2).enumerate().rev() {
            let inherits = [false, i == last && whole[(k + 1) % 3], i == 0 && whole[(k + 2) % 3]];
            todo.push(([ends[0], ends[1], opposite], inherits));
        }
    }
}
