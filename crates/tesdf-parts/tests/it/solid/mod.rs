//! What every part must be, and measures of a mesh.
use std::path::Path;
use std::sync::Arc;

use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{WindingNumber, check, read};
use tesdf::{
    ClearanceOptions, Encoder, Instance, Pose, Preset, Scene, SolidMesh, TeSdf, TriangleMesh, clearance,
};
use tesdf_parts::PartError;

/// A part that was made: closed, oriented outwards, without overlap.
pub fn good(part: Result<SolidMesh, PartError>) -> TriangleMesh {
    let mesh = part.unwrap_or_else(|e| panic!("{e}")).into_mesh();
    let report = check(&mesh);
    assert!(report.is_simple(), "{report}");
    assert_eq!(report.winding, Some([0, 1]), "{report}");
    assert_eq!(report.shells, 1);
    assert!(volume(&mesh) > 0.0);
    mesh
}

/// The message of a part that cannot be made.
pub fn message(part: Result<SolidMesh, PartError>) -> String {
    part.expect_err("the part was made").to_string()
}

/// The volume, by the divergence theorem.
pub fn volume(mesh: &TriangleMesh) -> f64 {
    (0..mesh.faces().len())
        .map(|face| {
            let [a, b, c] = mesh.triangle(face);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

/// Number of handles of a mesh of one shell: holes through it.
pub fn holes(mesh: &TriangleMesh) -> usize {
    // Every edge of a closed mesh has two faces: V − E + F = 2 − 2 g.
    let (v, f) = (mesh.vertices().len(), mesh.faces().len());
    (2 + f / 2 - v) / 2
}

/// Distances of the vertices from the axis z, least and greatest, of the vertices between heights.
pub fn radii(mesh: &TriangleMesh, heights: [f64; 2]) -> [f64; 2] {
    let mut found = [f64::INFINITY, 0.0];
    for p in mesh.vertices().iter().filter(|p| (heights[0]..=heights[1]).contains(&p.z)) {
        let radius = p.truncate().length();
        found = [found[0].min(radius), found[1].max(radius)];
    }
    found
}

pub fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found}; expected {expected} within {tolerance}");
}

/// A mesh of the folder `data`.
pub fn data(name: &str) -> TriangleMesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/procedural").join(name);
    read(&path).unwrap().mesh
}

/// The least distance of two bodies, negative where they overlap.
pub fn gap(a: &TriangleMesh, b: &TriangleMesh, pose_b: Pose) -> f64 {
    Pair::new(a, b).gap(pose_b)
}

/// Two bodies, encoded once for many poses.
pub struct Pair {
    a: Arc<TeSdf>,
    b: Arc<TeSdf>,
}

impl Pair {
    pub fn new(a: &TriangleMesh, b: &TriangleMesh) -> Self {
        let encode = |mesh: &TriangleMesh| {
            let solid = SolidMesh::new(mesh.clone()).unwrap();
            Arc::new(Encoder::new().preset(Preset::Fast).encode(&solid).unwrap())
        };
        Self { a: encode(a), b: encode(b) }
    }

    pub fn gap(&self, pose_b: Pose) -> f64 {
        let mut scene = Scene::new();
        let [a, b] = [(&self.a, Pose::IDENTITY), (&self.b, pose_b)].map(|(asset, pose)| {
            let shape = scene.add_shape(Arc::clone(asset)).unwrap();
            scene.add(Instance::new(shape, pose)).unwrap()
        });
        clearance(&scene, a, b, &ClearanceOptions::default()).unwrap().distance
    }
}

/// A pose: turned about z by an angle, then moved.
pub fn turned(angle: f64, by: DVec3) -> Pose {
    Pose::new(by, DQuat::from_rotation_z(angle)).unwrap()
}

pub fn inside(mesh: &TriangleMesh, point: DVec3) -> bool {
    WindingNumber::new(mesh).at(point) > 0
}
