use rayon::prelude::*;
use tesdf::geometry::{Aabb, AabbTree, Triangle, WindingNumber};
use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;

/// Signed distances in `f64` that share nothing with an asset but the closest point of one triangle: a tree over the faces as
/// read, and winding numbers.
pub struct Reference {
    triangles: Vec<Triangle>,
    tree: AabbTree,
    winding: WindingNumber,
}

impl Reference {
    /// Builds the trees.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let triangles: Vec<Triangle> =
            (0..mesh.faces().len()).map(|f| Triangle::new(mesh.triangle(f))).collect();
        let boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::of(&t.corners)).collect();
        Self { tree: AabbTree::build(&boxes, 4), winding: WindingNumber::new(mesh), triangles }
    }

    /// Signed distances at the points, in the mesh's unit.
    pub fn signed_distances(&self, points: &[DVec3]) -> Vec<f64> {
        points.par_iter().map(|&p| self.signed_distance(p)).collect()
    }

    fn signed_distance(&self, p: DVec3) -> f64 {
        let squared = |face: u32| self.triangles[face as usize].closest(p).distance.powi(2);
        let distance = self.tree.nearest(p, squared).map_or(f64::INFINITY, |(d, _)| d.sqrt());
        if self.winding.at_perturbed(p) >= 1 { -distance } else { distance }
    }
}
