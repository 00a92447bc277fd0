//! Meshes with large fans, with needles and with stray vertices: the encoding has a bounded size
//! and is exact.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use crate::support::parts::{Parts, Turn};
use crate::support::shapes::Shape;
use tesdf::TeSdf;
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf::verify::{VerifyOptions, verify};

fn on_circle(k: u32, n: u32, z: f64) -> DVec3 {
    let angle = TAU * f64::from(k) / f64::from(n);
    DVec3::new(angle.cos(), angle.sin(), z)
}

/// Encodes and verifies.
fn encoded(vertices: Vec<DVec3>, faces: Vec<[u32; 3]>) -> TeSdf {
    let solid = SolidMesh::new(TriangleMesh::new(vertices, faces).expect("valid ids")).expect("a solid");
    let asset = Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes");
    let samples = VerifyOptions { samples: 1000, seed: 9 };
    let report = verify(&asset, &samples, |_| ControlFlow::Continue(())).expect("a valid mesh");
    assert!(report.passed, "{report:#?}");
    asset
}

/// The lists of a fan have some hundred entries per face, not one for each pair of faces.
fn assert_small(asset: &TeSdf) {
    let statistics = &asset.about().statistics;
    assert!(statistics.entries < 700 * statistics.faces, "{statistics:?}");
}

#[test]
fn a_cone_over_a_fan() {
    let n = 1500;
    let vertices = (0..n).map(|k| on_circle(k, n, 0.0)).chain([DVec3::Z]).collect();
    let side = (0..n).map(|k| [k, (k + 1) % n, n]);
    let bottom = (1..n - 1).map(|k| [0, k + 1, k]);
    assert_small(&encoded(vertices, side.chain(bottom).collect()));
}

#[test]
fn a_disc_of_two_fans() {
    let n = 1200;
    let rims = (0..n).map(|k| on_circle(k, n, 0.0)).chain((0..n).map(|k| on_circle(k, n, 0.2)));
    let vertices = rims.chain([DVec3::ZERO, 0.2 * DVec3::Z]).collect();
    let faces = (0..n).flat_map(|k| {
        let next = (k + 1) % n;
        [[next, k, 2 * n], [n + k, n + next, 2 * n + 1], [k, next, n + next], [k, n + next, n + k]]
    });
    assert_small(&encoded(vertices, faces.collect()));
}

/// Many needles side by side, none at a vertex with many faces.
#[test]
fn a_long_prism_of_many_sides() {
    let n = 1000;
    let vertices =
        (0..n).map(|k| on_circle(k, n, 0.0)).chain((0..n).map(|k| on_circle(k, n, 30.0))).collect();
    let sides = (0..n).flat_map(|k| {
        let next = (k + 1) % n;
        [[k, next, n + next], [k, n + next, n + k]]
    });
    let ends = (1..n - 1).flat_map(|k| [[0, k + 1, k], [n, n + k, n + k + 1]]);
    assert_small(&encoded(vertices, sides.chain(ends).collect()));
}

#[test]
fn a_cube_with_a_corner_far_away() {
    for far in [DVec3::splat(1e12), DVec3::new(1e7, 1.0, 1.0)] {
        let Parts { mut vertices, faces } = Parts::default().cube(DVec3::ZERO, 1.0, Turn::Outward);
        vertices[7] = far;
        encoded(vertices, faces);
    }
}

#[test]
fn rods() {
    for length in [1e3, 1e6, 1e9, 1e12] {
        let Parts { vertices, faces } = Parts::default().cube(DVec3::ZERO, 1.0, Turn::Outward);
        let long = vertices.into_iter().map(|v| v * DVec3::new(length, 1.0, 1.0));
        encoded(long.collect(), faces);
    }
}

/// The box around the mesh is a million times as wide as the sphere, but needs only a few cells.
#[test]
fn a_sphere_with_a_vertex_far_away() {
    let sphere = Shape::default().add_sphere(DVec3::ZERO, 3, || 1.0).mesh();
    let (mut vertices, faces) = (sphere.vertices().to_vec(), sphere.faces().to_vec());
    for far in [1e3, 1e6, 1e9] {
        let k = vertices.iter().position(|v| v.x > 0.9).expect("there are some in front");
        vertices[k] = DVec3::new(far, 0.0, 0.0);
        assert_small(&encoded(vertices.clone(), faces.clone()));
    }
}
