//! The peer `parry3d`, in `f32`, with pseudonormals.
use parry3d::math::{Pose as ParryPose, Rotation, Vector};
use parry3d::query::{
    ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher, PointQuery, contact, distance,
    intersection_test,
};
use parry3d::shape::{TriMesh, TriMeshFlags};
use tesdf::collide::Pose;
use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;

use super::Failure;
use tesdf_sim::criterion::measure::relative;

/// Name, version and features.
pub const NAME: &str = if cfg!(feature = "parry-simd8") {
    "parry3d 0.31.1, f32, ORIENTED, feature simd8"
} else {
    "parry3d 0.31.1, f32, ORIENTED"
};

/// A mesh of parry3d.
pub struct Peer(TriMesh);

/// The answer of parry3d to a query, with the same parts as ours.
pub struct PeerAnswer {
    /// Signed distance, negative inside.
    pub signed_distance: f32,
    /// Outward unit vector.
    pub gradient: Vector,
    /// Closest point on the surface.
    pub closest_point: Vector,
}

impl Peer {
    /// Builds parry3d's tree and pseudonormals.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, Failure> {
        let vertices = mesh.vertices().iter().map(|&v| point(v)).collect();
        let built = TriMesh::with_flags(vertices, mesh.faces().to_vec(), TriMeshFlags::ORIENTED);
        built.map(Self).map_err(|e| format!("parry3d does not take the mesh: {e}").into())
    }

    /// Whether the surfaces intersect.
    pub fn meets(&self, other: &Self, poses: &[ParryPose; 2]) -> Result<bool, Failure> {
        Ok(intersection_test(&poses[0], &self.0, &poses[1], &other.0)?.intersecting)
    }

    /// The distance between the surfaces; 0 when they intersect.
    pub fn separation(&self, other: &Self, poses: &[ParryPose; 2]) -> Result<f32, Failure> {
        Ok(distance(&poses[0], &self.0, &poses[1], &other.0)?.distance)
    }

    /// The smallest distance of a contact between two triangles, if it is within the prediction
    /// distance.
    pub fn deepest_contact(
        &self,
        other: &Self,
        poses: &[ParryPose; 2],
        prediction: f32,
    ) -> Result<Option<f32>, Failure> {
        Ok(contact(&poses[0], &self.0, &poses[1], &other.0, prediction)?.map(|c| c.dist))
    }

    /// The distances of all contacts of all pairs of triangles within the prediction distance,
    /// without data of earlier calls.
    pub fn contacts(
        &self,
        other: &Self,
        poses: &[ParryPose; 2],
        prediction: f32,
    ) -> Result<Vec<f32>, Failure> {
        let mut manifolds: Vec<ContactManifold<(), ()>> = Vec::new();
        let between = poses[0].inv_mul(&poses[1]);
        DefaultQueryDispatcher.contact_manifolds(
            &between,
            &self.0,
            &other.0,
            prediction,
            &mut manifolds,
            &mut None,
        )?;
        Ok(manifolds.iter().flat_map(|m| &m.points).map(|p| p.dist).collect())
    }

    /// Projects the point, and derives the signed distance and the gradient.
    #[inline]
    pub fn query(&self, p: Vector) -> PeerAnswer {
        let found = self.0.project_local_point(p, false);
        let offset = p - found.point;
        let distance = offset.length();
        let signed_distance = if found.is_inside { -distance } else { distance };
        PeerAnswer { signed_distance, gradient: offset / signed_distance, closest_point: found.point }
    }
}

/// Converts a point to parry3d's type.
pub fn point(p: DVec3) -> Vector {
    p.as_vec3().to_array().into()
}

/// Converts two poses to parry3d's type, with translations multiplied by `scale`. The pose of the
/// first body in the frame of the second is computed in `f64`.
pub fn pair(poses: [Pose; 2], scale: f64) -> [ParryPose; 2] {
    let first = relative(poses[1], poses[0]);
    let rotation: [f32; 4] = first.rotation.as_quat().to_array();
    [
        ParryPose::from_parts(point(first.translation * scale), Rotation::from_array(rotation)),
        ParryPose::IDENTITY,
    ]
}
