//! The peer: `parry3d`, in `f32`, with pseudonormals.
use parry3d::math::Vector;
use parry3d::query::PointQuery;
use parry3d::shape::{TriMesh, TriMeshFlags};
use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;

use crate::Failure;

/// Name with version and features.
pub const NAME: &str = if cfg!(feature = "parry-simd8") {
    "parry3d 0.31.1, f32, ORIENTED, feature simd8"
} else {
    "parry3d 0.31.1, f32, ORIENTED"
};

/// A mesh of the peer.
pub struct Peer(TriMesh);

/// What the peer gives: the same things as ours.
pub struct PeerAnswer {
    /// Negative inside.
    pub signed_distance: f32,
    /// Outward unit vector.
    pub gradient: Vector,
    /// On the surface.
    pub closest_point: Vector,
}

impl Peer {
    /// Builds its tree and pseudonormals.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, Failure> {
        let vertices = mesh.vertices().iter().map(|&v| point(v)).collect();
        let built = TriMesh::with_flags(vertices, mesh.faces().to_vec(), TriMeshFlags::ORIENTED);
        built.map(Self).map_err(|e| format!("parry3d does not take the mesh: {e}").into())
    }

    /// Signed projection, and the distance and gradient that follow from it.
    #[inline]
    pub fn query(&self, p: Vector) -> PeerAnswer {
        let found = self.0.project_local_point(p, false);
        let offset = p - found.point;
        let distance = offset.length();
        let signed_distance = if found.is_inside { -distance } else { distance };
        PeerAnswer { signed_distance, gradient: offset / signed_distance, closest_point: found.point }
    }
}

/// As the peer takes it.
pub fn point(p: DVec3) -> Vector {
    p.as_vec3().to_array().into()
}
