use rayon::prelude::*;
use tesdf::geometry::{Aabb, AabbTree, Triangle};
use tesdf::glam::DVec3;
use tesdf::mesh::{TriangleMesh, WindingNumber};

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
        let distance = self.distance(p).0;
        if self.is_inside(p) { -distance } else { distance }
    }

    /// Distance of the nearest face, and the face.
    pub fn distance(&self, p: DVec3) -> (f64, u32) {
        let squared = |face: u32| self.face(face).closest(p).distance.powi(2);
        self.tree.nearest(p, squared).map_or((f64::INFINITY, 0), |(d, face)| (d.sqrt(), face))
    }

    /// By the winding number.
    pub fn is_inside(&self, p: DVec3) -> bool {
        self.winding.at_perturbed(p) >= 1
    }

    /// A face of the mesh.
    pub fn face(&self, face: u32) -> &Triangle {
        &self.triangles[face as usize]
    }

    /// All faces whose boxes meet the bounds, and a few others.
    pub fn faces_meeting(&self, bounds: Aabb) -> Vec<u32> {
        let mut found = Vec::new();
        self.tree.visit(|node| node.overlaps(bounds), |faces| found.extend_from_slice(faces));
        found
    }
}
