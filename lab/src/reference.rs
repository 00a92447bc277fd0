//! Exact signed distances of a mesh, which assets and peers are compared with.
use rayon::prelude::*;
use tesdf::geometry::internal::AabbTree;
use tesdf::geometry::{Aabb, Triangle};
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
        self.within(p, f64::INFINITY).unwrap_or((f64::INFINITY, 0))
    }

    /// The same, or `None` where no face is nearer than `limit`.
    fn within(&self, p: DVec3, limit: f64) -> Option<(f64, u32)> {
        let squared = |face: u32| self.face(face).closest(p).distance.powi(2);
        let (squared, face) = self.tree.nearest_within(p, limit * limit, squared)?;
        Some((squared.sqrt(), face))
    }

    /// Begins a sequence of points. It is faster where each point is near the point before.
    pub fn walk(&self) -> Walk<'_> {
        Walk { reference: self, last: None }
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

/// Relative rounding error allowed in bounds that come from the distance at a nearby point.
const ROUNDING: f64 = 1e-9;

/// A sequence of points; see [`Reference::walk`].
pub struct Walk<'a> {
    reference: &'a Reference,
    /// The previous point and its signed distance.
    last: Option<(DVec3, f64)>,
}

impl Walk<'_> {
    /// The signed distance at `p`, in the mesh's unit.
    pub fn signed_distance(&mut self, p: DVec3) -> f64 {
        let reference = self.reference;
        let limit = match self.last {
            // The distance changes by at most the length of the segment between the points.
            Some((q, d)) => (d.abs() + q.distance(p)) * (1.0 + ROUNDING),
            None => f64::INFINITY,
        };
        let (distance, _) = reference.within(p, limit).unwrap_or_else(|| reference.distance(p));
        // A segment that is shorter than the distance at one of its ends does not meet the surface.
        let inside = match self.last {
            Some((q, d)) if q.distance(p) * (1.0 + ROUNDING) < distance.max(d.abs()) => d < 0.0,
            _ => reference.is_inside(p),
        };
        let signed = if inside { -distance } else { distance };
        self.last = Some((p, signed));
        signed
    }
}
