//! Algorithm 1: finds the faces that are closest at the points of a grid. It can miss faces that
//! are closest only between these points, unless the threshold is as wide as the grid
//! ([`Threshold::CoveringRadius`]).
//!
//! A [`SampledCell`] is a cell with the candidates that Lemma 1 leaves. A [`Sampler`] looks at the
//! samples: the [`Processor`] here, or a device of another crate.
use glam::DVec3;

use super::error::EncodeError;
use super::filter::Scratch;
use super::surface::Surface;
use super::{Sampling, Threshold};
use crate::base::Progress;
use crate::base::elementary;
use crate::domain::Cell;
use crate::geometry::AabbTree;
use crate::parallel::*;

/// A cell with the candidates that Lemma 1 leaves. Everything is in the local frame.
#[derive(Clone, Debug)]
pub struct SampledCell {
    /// The cell.
    pub cell: Cell,
    /// Its candidates, ascending.
    pub faces: Vec<u32>,
    /// ε: how much farther than the closest face a face of E_t may be at a sample.
    pub threshold: f64,
    /// By how much its squared distance may be greater, before `threshold` is added to its distance.
    pub squared: f64,
}

impl SampledCell {
    /// Lines 2 to 8 of Alg. 1. `scale` is that of the local frame. The threshold of `sampling` is
    /// in the unit of the mesh.
    pub fn new(surface: &Surface, tree: &AabbTree, cell: Cell, sampling: &Sampling, scale: f64) -> Self {
        let (threshold, squared) = match sampling.threshold {
            Threshold::Absolute(length) => (length * scale, 0.0),
            Threshold::Squared(area) => (0.0, area * scale * scale),
            // The margin covers the rounding of a gap.
            Threshold::CoveringRadius => (2.0 * covering_radius(&cell, sampling) + surface.margin, 0.0),
        };
        Self { cell, faces: lipschitz_candidates(surface, tree, &cell), threshold, squared }
    }
}

/// Lines 9 to 19 of Alg. 1, for many cells.
pub trait Sampler: Sync {
    /// The name, in the certificate, of lists that this sampler made.
    fn name(&self) -> String;

    /// For each cell, and each of its candidates, d_f of Eq. (8) in the local frame. It is infinite
    /// for a face that is not in E_t.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`]; [`EncodeError::Sampler`] when a device refuses the work.
    fn sample(
        &self,
        surface: &Surface,
        cells: &[SampledCell],
        sampling: &Sampling,
        progress: &Progress,
    ) -> Result<Vec<Vec<f64>>, EncodeError>;
}

/// Looks at samples on the processor, in `f64`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Processor;

impl Sampler for Processor {
    fn name(&self) -> String {
        "sampled".into()
    }

    fn sample(
        &self,
        surface: &Surface,
        cells: &[SampledCell],
        sampling: &Sampling,
        progress: &Progress,
    ) -> Result<Vec<Vec<f64>>, EncodeError> {
        let of_cell = |scratch: &mut Scratch, cell: &SampledCell| {
            (!progress.is_cancelled()).then(|| sample(surface, cell, sampling, scratch))
        };
        let found: Option<_> = cells.par_iter().map_init(Scratch::default, of_cell).collect();
        found.ok_or(EncodeError::Cancelled)
    }
}

/// The faces that Lemma 1, Eq. (6), does not drop, ascending. At the centroid of the cell, their
/// gap is below twice the radius of the cell.
pub fn lipschitz_candidates(surface: &Surface, tree: &AabbTree, cell: &Cell) -> Vec<u32> {
    let center = cell.centroid();
    let distance = |face: u32| surface.triangles[face as usize].closest(center).distance;
    let nearest =
        tree.nearest(center, |face| elementary::powi(distance(face), 2)).map_or(0.0, |(d, _)| d.sqrt());
    let limit = nearest + 2.0 * cell.radius();
    let mut faces = Vec::new();
    tree.visit(
        |bounds| bounds.distance_squared(center) <= limit * limit,
        |leaf| faces.extend(leaf.iter().copied().filter(|&face| distance(face) < limit)),
    );
    faces.sort_unstable();
    faces
}

/// The covering radius: no point of the cell is farther than this from a point of the grid
/// (docs/math.md, 3).
pub fn covering_radius(cell: &Cell, sampling: &Sampling) -> f64 {
    let grid = 0.75f64.sqrt() * sampling.shrink * cell.width() / f64::from(sampling.resolution);
    grid + (1.0 - sampling.shrink) * cell.radius()
}

/// d_f of Eq. (8) for each candidate: the least distance at the samples at which the candidate is
/// within the threshold of the closest face.
pub fn sample(
    surface: &Surface,
    SampledCell { cell, faces, threshold, squared }: &SampledCell,
    sampling: &Sampling,
    scratch: &mut Scratch,
) -> Vec<f64> {
    let mut least = vec![f64::INFINITY; faces.len()];
    let mut pool = scratch.pool();
    pool.fill(surface, faces, cell);
    let candidates = pool.candidates();
    for point in grid(cell, sampling) {
        let nearest = candidates.look_from(surface, point, &mut scratch.centroid).distance;
        // Without an area, the distance itself, unrounded.
        let from = if *squared > 0.0 { (nearest * nearest + squared).sqrt() } else { nearest };
        for (least, &distance) in least.iter_mut().zip(&scratch.centroid) {
            if distance - from <= *threshold {
                *least = least.min(distance);
            }
        }
    }
    scratch.give_back(pool);
    least
}

/// The points with the barycentric coordinates i/Q, j/Q, k/Q, l/Q in the cell, which is shrunk
/// towards its centroid before.
fn grid(cell: &Cell, sampling: &Sampling) -> impl Iterator<Item = DVec3> {
    let center = cell.centroid();
    let [a, b, c, d] = cell.corners.map(|p| center + sampling.shrink * (p - center));
    let q = sampling.resolution;
    let step = 1.0 / f64::from(q);
    (0..=q).flat_map(move |i| {
        (0..=q - i).flat_map(move |j| {
            (0..=q - i - j).map(move |k| {
                let at = |n: u32| f64::from(n) * step;
                at(i) * a + at(j) * b + at(k) * c + at(q - i - j - k) * d
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::surface::Touching;
    use crate::geometry::Aabb;
    use crate::mesh::TriangleMesh;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = DVec3> {
        (-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(|(x, y, z)| DVec3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn candidates_equal_those_of_a_loop_over_all_faces(
            vertices in proptest::collection::vec(point(), 12..60),
            corners in [point(), point(), point(), point()],
        ) {
            let faces = (0..vertices.len() as u32 - 2).map(|i| [i, i + 1, i + 2]).collect();
            let surface = Surface::new(&TriangleMesh::new(vertices, faces).unwrap(), 1.0, Touching::Ignored);
            let boxes: Vec<Aabb> = surface.triangles.iter().map(|t| Aabb::of(&t.corners)).collect();
            let cell = Cell { corners: corners.map(|c| 0.2 * c), depth: 0 };
            let center = cell.centroid();
            let distances: Vec<f64> = surface.triangles.iter().map(|t| t.closest(center).distance).collect();
            let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
            let all: Vec<u32> = (0..distances.len() as u32)
                .filter(|&f| distances[f as usize] < nearest + 2.0 * cell.radius())
                .collect();
            prop_assert_eq!(lipschitz_candidates(&surface, &AabbTree::build(&boxes, 4), &cell), all);
        }

        #[test]
        fn squared_distances_may_differ_by_the_area(
            vertices in prop::collection::vec(point(), 3..20),
            corners in [point(), point(), point(), point()],
            area in prop_oneof![Just(0.0), 1e-3..0.3f64],
        ) {
            let faces = (0..vertices.len() as u32 - 2).map(|i| [i, i + 1, i + 2]).collect();
            let surface = Surface::new(&TriangleMesh::new(vertices, faces).unwrap(), 1.0, Touching::Ignored);
            let boxes: Vec<Aabb> = surface.triangles.iter().map(|t| Aabb::of(&t.corners)).collect();
            let (scale, threshold) = (0.5, Threshold::Squared(area));
            let sampling = Sampling { resolution: 3, threshold, ..Sampling::PAPER };
            let cell = Cell { corners, depth: 0 };
            let cell = SampledCell::new(&surface, &AabbTree::build(&boxes, 4), cell, &sampling, scale);
            let found = sample(&surface, &cell, &sampling, &mut Scratch::default());
            for (&f, found) in cell.faces.iter().zip(found) {
                let squared = |f: u32, p| surface.triangles[f as usize].closest(p).distance.powi(2);
                // How much farther the face is than the nearest one, at the sample where it is least so.
                let more = grid(&cell.cell, &sampling).map(|p| {
                    let nearest = cell.faces.iter().map(|&g| squared(g, p)).fold(f64::INFINITY, f64::min);
                    squared(f, p) - nearest
                });
                let least = more.fold(f64::INFINITY, f64::min);
                prop_assert!(found.is_infinite() || least <= scale * scale * area + 1e-12, "{least}");
                prop_assert!(found.is_finite() || least >= scale * scale * area - 1e-12, "{least}");
            }
        }

        #[test]
        fn the_grid_covers_the_cell(
            corners in [point(), point(), point(), point()],
            weights in [0.0..1.0f64, 0.0..1.0, 0.0..1.0, 0.0..1.0],
            resolution in 1u32..7,
            shrink in 0.5..1.0f64,
        ) {
            let cell = Cell { corners, depth: 0 };
            let sampling = Sampling { resolution, shrink, threshold: Threshold::CoveringRadius };
            let sum: f64 = weights.iter().sum::<f64>().max(1e-9);
            let p: DVec3 = (0..4).map(|k| weights[k] / sum * corners[k]).sum();
            let nearest = grid(&cell, &sampling).map(|g| g.distance(p)).fold(f64::INFINITY, f64::min);
            prop_assert!(nearest <= covering_radius(&cell, &sampling));
            let count = grid(&cell, &sampling).count() as u32;
            prop_assert_eq!(count, (resolution + 1) * (resolution + 2) * (resolution + 3) / 6);
        }
    }
}
