//! Refines all roots within an effort, and refuses meshes for which the effort is not enough.
use crate::base::elementary;
use crate::parallel::*;

use super::effort::Effort;
use super::error::EncodeError;
use super::refine::{ROOT_VOLUME, Refiner, Tree};
use crate::base::Stage;
use crate::domain::Cell;

/// Refines all roots. Returns `None` when the work was cancelled or the effort is exceeded.
pub fn refine(
    refiner: &Refiner,
    cells: &[Cell],
    candidates: impl Fn(&Cell) -> Vec<u32> + Sync,
) -> Option<Vec<Tree>> {
    refiner.progress.begin(Stage::Refine, cells.len() as u64 * ROOT_VOLUME);
    cells.par_iter().map(|cell| refiner.root(*cell, &candidates(cell))).collect()
}

/// Refines the bisection domain with an effort in proportion to the number of faces.
///
/// The more long faces the mesh has, the earlier a cell that lists many of them is left whole.
pub fn refine_within_effort(
    mut refiner: Refiner,
    cells: &[Cell],
    effort_per_face: u64,
) -> Result<Vec<Tree>, EncodeError> {
    let surface = refiner.surface;
    let faces = surface.faces.len() as u32;
    let limit = effort_per_face * (u64::from(faces) + SMALL_MESH);
    if surface.needleness() > NEEDLES {
        refiner.weights.long_faces = elementary::powi(surface.needleness() / WORTH_A_BYTE, 2);
    }
    for _ in 0..ATTEMPTS {
        let effort = Effort::new(limit);
        let attempt = Refiner { weights: refiner.weights.clone(), effort: &effort, ..refiner };
        if let Some(trees) = refine(&attempt, cells, |_| (0..faces).collect()) {
            return Ok(trees);
        }
        if refiner.progress.is_cancelled() {
            return Err(EncodeError::Cancelled);
        }
        refiner.weights.long_faces = (8.0 * refiner.weights.long_faces).max(1.0);
    }
    let (face, slenderness) = surface.most_slender();
    Err(EncodeError::NoShortLists { face, slenderness, compared: limit })
}

/// Faces that refining may hold against cells, for each face of the mesh. A bolt of 25,000 faces
/// takes 1,783, a gear of 20,000 needles takes 4,789.
pub const EFFORT_PER_FACE: u64 = 10_000;
/// Faces that are added to the count, so that a small mesh has enough effort.
const SMALL_MESH: u64 = 1000;
/// From this [`needleness`](Surface::needleness) on, cells with many long faces are held back from
/// the start.
const NEEDLES: f64 = 15.0;
/// The needleness at which such a cell must be worth one byte.
///
/// With this limit, fans of 1,000 to 5,000 faces (needleness 18 to 50) take 2 to 3 times as long
/// per face as a bolt. Without it, the time grows with the cube of the number of faces.
const WORTH_A_BYTE: f64 = 12.0;
/// How often refining begins anew before it gives up. Each time, cells are held back eight times as
/// much.
const ATTEMPTS: u32 = 5;

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::base::Progress;
    use crate::domain::{DomainCube, MAX_DEPTH};
    use crate::encode::refine::Weights;
    use crate::encode::surface::{Surface, Touching};
    use crate::geometry::Aabb;
    use crate::mesh::TriangleMesh;

    /// A cone over a regular polygon. Its bottom is a fan too. Face 0 is as slender as all faces
    /// around the tip.
    fn cone(sides: u32) -> TriangleMesh {
        let at = |k: u32| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(sides);
            0.5 * DVec3::new(angle.cos(), angle.sin(), 0.0)
        };
        let vertices = (0..sides).map(at).chain([DVec3::new(0.0, 0.0, 0.5), DVec3::ZERO]).collect();
        let faces = (0..sides).flat_map(|k| {
            let next = (k + 1) % sides;
            [[k, next, sides], [next, k, sides + 1]]
        });
        TriangleMesh::new(vertices, faces.collect()).expect("valid ids")
    }

    fn refined(mesh: &TriangleMesh, effort_per_face: u64) -> Result<Vec<Tree>, EncodeError> {
        let cube = DomainCube::around(Aabb { min: DVec3::splat(-0.6), max: DVec3::splat(0.6) });
        let surface = Surface::new(mesh, cube.side(), Touching::Kept);
        let (progress, unlimited) = (Progress::default(), Effort::new(u64::MAX));
        let refiner = Refiner {
            surface: &surface,
            weights: Weights {
                byte: 0.25 / surface.faces.len() as f64,
                near: 0.01,
                per_volume: 10.0,
                far_faces: 250.0,
                far_list: 1000,
                far_distance: 0.1,
                floor: 6.0,
                long_faces: 0.0,
                groups: None,
            },
            band: 0.1,
            bounds: mesh.bounds(),
            regions: &[],
            inside: &|_| false,
            max_depth: MAX_DEPTH,
            progress: &progress,
            effort: &unlimited,
        };
        let roots: Vec<Cell> = (0..6).map(|root| cube.root(root)).collect();
        refine_within_effort(refiner, &roots, effort_per_face)
    }

    #[test]
    fn cells_of_many_long_faces_stay_large_before_a_mesh_is_refused() {
        let mesh = cone(400);
        let size = |trees: &[Tree]| {
            fn leaves(tree: &Tree) -> usize {
                match tree {
                    Tree::Leaf(_) => 1,
                    Tree::Split(children) => children.iter().map(leaves).sum(),
                }
            }
            trees.iter().map(leaves).sum::<usize>()
        };
        let all = size(&refined(&mesh, u64::MAX / 10_000).expect("no limit"));
        let some = size(&refined(&mesh, 1000).expect("cells held back are enough"));
        assert!(10 * some < 7 * all, "{some} of {all}");

        let error = refined(&mesh, 2).expect_err("not even the roots");
        let EncodeError::NoShortLists { face, slenderness, .. } = &error else { panic!("{error}") };
        // The sides are 0.71 long with a base of 0.0079. The faces of the bottom are 0.5 long.
        assert!(*face % 2 == 0 && (80.0..100.0).contains(slenderness), "{error}");
        assert!(error.to_string().contains("tesdf check"), "{error}");
    }
}
