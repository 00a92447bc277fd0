use crate::parallel::*;
use glam::DVec3;

use crate::collide::bodies::surface::Candidates;
use crate::collide::detect::ordered_pair::OrderedPair;
use crate::collide::detect::tasks;
use crate::collide::options::CollideOptions;
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;

/// A face (or node) of one body within a cell of another body: a problem for the narrow phase.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The body that has the face.
    pub instance_a: InstanceId,
    /// The body that has the cell.
    pub instance_b: InstanceId,
    /// The face of a, 0-based in the encoded mesh. For a node, the lowest face that has it.
    pub face_a: u32,
    /// The cell of b's domain, as [`CellView::id`](crate::asset::CellView::id); `None` outside its
    /// cube, and for a simple shape.
    pub tet_b: Option<u32>,
    /// The part of the face in the cell, in the world: a node, segment or triangle, clipped by the
    /// cell.
    pub polygon: Vec<DVec3>,
}

/// The result of the broad and the middle phase: all (face, cell) pairs in which
/// [`detect`](crate::collide::detect()) looks for a contact, with the part of the face in the cell.
///
/// For debug drawing, counting and analysis. A pair that is missing here is farther apart than the
/// contact distance.
///
/// # Errors
/// As [`detect`](crate::collide::detect()).
pub fn candidates(scene: &Scene, options: &CollideOptions) -> Result<Vec<Candidate>, CollideError> {
    let pairs = OrderedPair::all(scene, options)?;
    Ok(pairs.par_iter().flat_map_iter(of_pair).collect())
}

fn of_pair(pair: &OrderedPair) -> Vec<Candidate> {
    let mut found = Vec::new();
    for candidate in pair.candidates() {
        let (part, face_a, _) = pair.part(candidate);
        pair.search_of([&part]).polygons(&pair.field, &part, &mut |clipped| {
            found.push(Candidate {
                instance_a: pair.a,
                instance_b: pair.b,
                face_a,
                tet_b: clipped.cell,
                polygon: clipped.polygon.points().map(|p| pair.field.to_world(p)).collect(),
            });
        });
    }
    found
}

/// Number of faces or nodes that the broad phase leaves. For the time of the broad phase: the work
/// of [`detect`](crate::collide::detect()) up to there, on the same threads.
///
/// # Errors
/// As [`detect`](crate::collide::detect()).
pub fn count_faces(scene: &Scene, options: &CollideOptions) -> Result<usize, CollideError> {
    let pairs = OrderedPair::all(scene, options)?;
    Ok(broad_phase(&pairs).iter().map(Vec::len).sum())
}

/// Number of [`candidates`], without the polygons. For the time of the broad and the middle phase.
///
/// # Errors
/// As [`detect`](crate::collide::detect()).
pub fn count_polygons(scene: &Scene, options: &CollideOptions) -> Result<usize, CollideError> {
    let pairs = OrderedPair::all(scene, options)?;
    let of_task = |(pair, chunk): &(&OrderedPair, &[u32])| {
        let mut polygons = 0;
        for &candidate in *chunk {
            let (part, ..) = pair.part(candidate);
            pair.search_of([&part]).polygons(&pair.field, &part, &mut |_| polygons += 1);
        }
        polygons
    };
    Ok(tasks(&pairs, &broad_phase(&pairs)).par_iter().map(of_task).sum())
}

fn broad_phase(pairs: &[OrderedPair]) -> Vec<Candidates> {
    pairs.par_iter().map(OrderedPair::candidates).collect()
}
