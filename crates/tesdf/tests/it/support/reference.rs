use tesdf::geometry::internal::{AabbTree, LocalFrame};
use tesdf::geometry::{Aabb, Closest, Triangle};
use tesdf::glam::DVec3;
use tesdf::mesh::{TriangleMesh, WindingNumber};

/// Exact distances from all faces, without code of the encoder.
///
/// It computes in the mesh's local frame. Vertices are mapped there without rounding, which is
/// checked here.
pub struct Reference {
    pub triangles: Vec<Triangle>,
    pub faces: Vec<[u32; 3]>,
    pub frame: LocalFrame,
    /// Diagonal of the mesh, in the mesh's unit.
    pub diagonal: f64,
    /// Largest absolute coordinate of the mesh, in the mesh's unit.
    pub largest: f64,
    tree: AabbTree,
    winding: WindingNumber,
}

impl Reference {
    pub fn new(mesh: &TriangleMesh) -> Self {
        let frame = LocalFrame::of(mesh.bounds());
        for &v in mesh.vertices() {
            assert_eq!(frame.to_world(frame.to_local(v)), v, "the local frame rounds a vertex");
        }
        let corners = |f: usize| mesh.triangle(f).map(|p| frame.to_local(p));
        let triangles: Vec<Triangle> = (0..mesh.faces().len()).map(|f| Triangle::new(corners(f))).collect();
        let boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::of(&t.corners)).collect();
        let bounds = mesh.bounds();
        Self {
            tree: AabbTree::build(&boxes, 4),
            triangles,
            faces: mesh.faces().to_vec(),
            frame,
            diagonal: mesh.diagonal(),
            largest: bounds.min.abs().max(bounds.max.abs()).max_element(),
            winding: WindingNumber::new(mesh),
        }
    }

    /// The diagonal in the local frame.
    pub fn local_diagonal(&self) -> f64 {
        self.diagonal * self.frame.scale
    }

    /// The nearest face and its closest point. `p` is in the local frame.
    pub fn closest_local(&self, p: DVec3) -> (u32, Closest) {
        let nearest = self.tree.nearest(p, |f| self.triangles[f as usize].closest(p).distance.powi(2));
        let face = nearest.expect("a mesh has faces").1;
        (face, self.triangles[face as usize].closest(p))
    }

    /// All faces within a distance of `reach`. `p` is in the local frame.
    pub fn within_local(&self, p: DVec3, reach: f64) -> Vec<(u32, Closest)> {
        let mut found = Vec::new();
        let grown = reach * (1.0 + 1e-12) + 1e-15;
        self.tree.visit(
            |b| b.distance_squared(p) <= grown * grown,
            |leaf| {
                let all = leaf.iter().map(|&f| (f, self.triangles[f as usize].closest(p)));
                found.extend(all.filter(|(_, c)| c.distance <= reach));
            },
        );
        found
    }

    /// Faces whose bounds overlap a box of the local frame.
    pub fn overlapping(&self, reach: Aabb) -> Vec<u32> {
        let mut found = Vec::new();
        self.tree.visit(
            |b| b.overlaps(reach),
            |leaf| {
                found.extend(
                    leaf.iter().filter(|&&f| Aabb::of(&self.triangles[f as usize].corners).overlaps(reach)),
                )
            },
        );
        found
    }

    /// Signed distance, negative inside. In the mesh's unit.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        let distance = self.closest_local(self.frame.to_local(p)).1.distance / self.frame.scale;
        if self.is_inside(p) { -distance } else { distance }
    }

    pub fn is_inside(&self, p: DVec3) -> bool {
        self.winding.at(p) >= 1
    }

    pub fn winding(&self) -> &WindingNumber {
        &self.winding
    }

    /// Bounds of the distance from all faces, without the tree and without trusting
    /// [`Triangle::closest`]. The closest point `c` of a face lies on the face up to rounding. By
    /// convexity, no point of the face is closer to `p` than `sqrt(|p - c|² - 2 max over its
    /// corners v of (p - c)·(v - c))`. In the local frame.
    pub fn certified_bounds(&self, p: DVec3) -> [f64; 2] {
        self.triangles.iter().fold([f64::INFINITY; 2], |[low, high], t| {
            let c = t.closest(p).point;
            let to = p - c;
            let excess = t.corners.iter().map(|&v| to.dot(v - c)).fold(0.0, f64::max);
            let lowest = (to.length_squared() - 2.0 * excess).max(0.0).sqrt();
            [low.min(lowest), high.min(to.length())]
        })
    }

    /// Error bound of the `f64` path: 1e-12 × diagonal plus 4 ulp of the largest coordinate.
    pub fn tolerance_f64(&self, p: DVec3) -> f64 {
        let largest = self.largest.max(p.abs().max_element());
        1e-12 * self.diagonal + 4.0 * (largest.next_up() - largest)
    }

    /// Error bound of `f32` storage. The ulps of the input coordinates come in addition.
    pub fn tolerance_f32(&self, p: DVec3) -> f64 {
        1e-6 * self.diagonal + self.tolerance_f64(p)
    }
}

/// Whether an error exceeds the tolerance. NaN does.
pub fn exceeds(error: f64, tolerance: f64) -> bool {
    error > tolerance || error.is_nan()
}
