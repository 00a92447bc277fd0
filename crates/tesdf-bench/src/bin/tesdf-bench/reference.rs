use rayon::prelude::*;
use tesdf::geometry::{Aabb, AabbTree, Triangle};
use tesdf::glam::DVec3;
use tesdf::mesh::{TriangleMesh, WindingNumber};

/// Reference signed distances in `f64`, from a tree over the faces of the mesh and from winding
/// numbers. Of the code that an asset uses, it shares only the closest point of a triangle.
pub struct Reference {
    triangles: Vec<Triangle>,
    tree: AabbTree,
    winding: WindingNumber,
}

impl Reference {
    /// Builds the trees of `mesh`.
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

    /// The distance to the nearest face, and this face.
    pub fn distance(&self, p: DVec3) -> (f64, u32) {
        let squared = |face: u32| self.face(face).closest(p).distance.powi(2);
        self.tree.nearest(p, squared).map_or((f64::INFINITY, 0), |(d, face)| (d.sqrt(), face))
    }

    /// Whether the point is inside, by the winding number.
    pub fn is_inside(&self, p: DVec3) -> bool {
        self.winding.at_perturbed(p) >= 1
    }

    /// A face of the mesh, by its index.
    pub fn face(&self, face: u32) -> &Triangle {
        &self.triangles[face as usize]
    }

    /// All faces whose bounding boxes overlap `bounds`, and possibly a few others.
    pub fn faces_meeting(&self, bounds: Aabb) -> Vec<u32> {
        let mut found = Vec::new();
        self.tree.visit(|node| node.overlaps(bounds), |faces| found.extend_from_slice(faces));
        found
    }
}
