//! Fills holes with triangles between their vertices.
use glam::DVec3;

use super::{
    Draft, FillMethod, FilledHole, HoleLeft, LeftReason, RepairReport,
    flat::{fill_flat, flat_holes},
    holes::{Hole, holes, unit_normal},
    orient::OneSided,
    triangulate::Loop,
};
use crate::{mesh::Topology, parallel::*};

/// Holes with more edges than this are cut into pieces.
const DYNAMIC: usize = 300;
/// Largest number of edges of a piece.
const PIECE: usize = 100;
/// Largest number of triangles that dynamic programming looks at in all holes together; it takes
/// some ten seconds on a thread. Smaller holes come first, and the rest is filled ear by ear.
const LOOKED_AT: usize = 200_000_000;

/// The triangles of a hole.
struct Filling {
    /// The indices of its loops.
    loops: Vec<usize>,
    triangles: Vec<[u32; 3]>,
    method: FillMethod,
}

/// Fills the holes with at most `max_edges` edges. Returns, for each new face, a face beside it.
pub(super) fn fill(
    draft: &mut Draft,
    one_sided: &OneSided,
    max_edges: u32,
    report: &mut RepairReport,
) -> Vec<u32> {
    let topology = Topology::new(&draft.faces);
    let found = holes(draft, &topology, &one_sided.faces);
    let (holes, larger): (Vec<Hole>, Vec<Hole>) =
        found.into_iter().partition(|hole| hole.vertices.len() <= max_edges as usize);
    let left = |vertices: Vec<u32>, reason| HoleLeft { vertices, reason };
    let one_sided = one_sided.edges.iter().map(|edge| left(edge.to_vec(), LeftReason::OneSided));
    report.holes_left = one_sided
        .chain(larger.into_iter().map(|hole| left(hole.vertices, LeftReason::TooManyEdges)))
        .collect();

    let mut beside = Vec::new();
    for Filling { loops, triangles, method } in fillings(draft, &topology, &holes) {
        let next_to = holes[loops[0]].across[0];
        let first = draft.faces.len() as u32;
        draft.origin.resize(draft.faces.len() + triangles.len(), draft.origin[next_to as usize]);
        beside.resize(beside.len() + triangles.len(), next_to);
        draft.faces.extend(triangles);
        let new = first..draft.faces.len() as u32;
        report.filled_holes.push(FilledHole {
            loops: loops.iter().map(|&hole| holes[hole].vertices.clone()).collect(),
            faces: new.len(),
            area: new.map(|face| area(draft.triangle(face))).sum(),
            method,
        });
    }
    beside
}

pub(super) fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// The triangles of all holes, in the order of the first loops.
fn fillings(draft: &Draft, topology: &Topology, holes: &[Hole]) -> Vec<Filling> {
    let flat = flat_holes(draft, holes);
    let filled = |loops: &Vec<usize>| {
        let named: Vec<&[u32]> = loops.iter().map(|&hole| holes[hole].vertices.as_slice()).collect();
        let triangles = fill_flat(draft, &named)?;
        Some(Filling { loops: loops.clone(), triangles, method: FillMethod::Flat })
    };
    let flat: Vec<Option<Filling>> = flat.par_iter().map(filled).collect();
    let mut fillings: Vec<Filling> = flat.into_iter().flatten().collect();
    let mut is_filled = vec![false; holes.len()];
    fillings.iter().flat_map(|filling| &filling.loops).for_each(|&hole| is_filled[hole] = true);

    let mut rest: Vec<usize> = (0..holes.len()).filter(|&hole| !is_filled[hole]).collect();
    rest.sort_by_key(|&hole| (holes[hole].vertices.len(), hole));
    let mut looked_at = 0;
    let plan: Vec<(usize, FillMethod)> = rest
        .into_iter()
        .map(|hole| {
            let n = holes[hole].vertices.len();
            let whole = n <= DYNAMIC;
            // A piece has at least a quarter of its vertices from the loop that was cut last.
            looked_at += if whole { n.pow(3) / 6 } else { (4 * n / PIECE + 1) * PIECE.pow(3) / 6 };
            let method = match (looked_at <= LOOKED_AT, whole) {
                (true, true) => FillMethod::MinimumWeight,
                (true, false) => FillMethod::Pieces,
                (false, _) => FillMethod::Ears,
            };
            (hole, method)
        })
        .collect();
    let filled = |&(hole, method): &(usize, FillMethod)| {
        let triangles = fill_curved(draft, topology, &holes[hole], method);
        Filling { loops: vec![hole], triangles, method }
    };
    let curved: Vec<Filling> = plan.par_iter().map(filled).collect();
    fillings.extend(curved);
    fillings.sort_by_key(|filling| filling.loops[0]);
    fillings
}

fn fill_curved(draft: &Draft, topology: &Topology, hole: &Hole, method: FillMethod) -> Vec<[u32; 3]> {
    let vertices = &hole.vertices;
    let points: Vec<DVec3> = vertices.iter().map(|&v| draft.vertices[v as usize]).collect();
    let normals: Vec<DVec3> = hole.across.iter().map(|&face| unit_normal(draft.triangle(face))).collect();
    let is_edge = |i: usize, k: usize| {
        let (a, b) = (vertices[i], vertices[k]);
        topology.edge([a.min(b), a.max(b)]).is_some()
    };
    let of = Loop { points: &points, normals: &normals, is_edge: &is_edge };
    let triangles = match method {
        FillMethod::Ears => of.ears(),
        FillMethod::Pieces => of.pieces(PIECE),
        FillMethod::Flat | FillMethod::MinimumWeight => of.minimum_weight(),
    };
    triangles.into_iter().map(|t| t.map(|corner| vertices[corner as usize])).collect()
}
