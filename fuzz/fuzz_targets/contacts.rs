//! Detects contacts of two small bodies in arbitrary poses. The distance of each contact must be
//! right, and no vertex may be deeper than the deepest contact.
#![no_main]

mod support;

use std::sync::{Arc, LazyLock};

use glam::{DQuat, DVec3};
use libfuzzer_sys::arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use tesdf::collide::{CollideOptions, Instance, InstanceId, Mode, Pose, Scene, detect};
use tesdf::encode::{Preset, Encoder};
use tesdf::geometry::Triangle;
use tesdf::mesh::{SolidMesh, TriangleMesh, WindingNumber};
use tesdf::TeSdf;

struct Body {
    mesh: TriangleMesh,
    winding: WindingNumber,
    asset: Arc<TeSdf>,
}

/// A box, an octahedron, and a box with a vertex that is pushed in, from fixed bytes.
static BODIES: LazyLock<Vec<Body>> = LazyLock::new(|| {
    let bytes: [&[u8]; 3] = [&[1, 0, 0], &[0, 0, 0], &[1, 1, 7, 2, 4, 200, 4, 200, 4, 200, 0]];
    bytes
        .iter()
        .filter_map(|bytes| {
            let mesh = support::closed(&mut Unstructured::new(bytes)).ok()?;
            let solid = SolidMesh::new(mesh.clone()).ok()?;
            let asset = Encoder::new().preset(Preset::Fast).encode(&solid).ok()?;
            let winding = WindingNumber::new(&mesh);
            Some(Body { mesh, winding, asset: Arc::new(asset) })
        })
        .collect()
});

impl Body {
    fn signed_distance(&self, p: DVec3) -> f64 {
        let faces = 0..self.mesh.faces().len();
        let distances = faces.map(|f| Triangle::new(self.mesh.triangle(f)).closest(p).distance);
        let distance = distances.fold(f64::INFINITY, f64::min);
        if self.winding.at_perturbed(p) >= 1 { -distance } else { distance }
    }
}

fn pose(bytes: &mut Unstructured) -> Result<Pose> {
    let turn = support::point(bytes)?;
    let rotation = DQuat::from_scaled_axis(std::f64::consts::FRAC_PI_2 * turn);
    Ok(Pose::new(0.7 * support::point(bytes)?, rotation).expect("a unit quaternion"))
}

/// Twice the promised error of `f32` queries for bodies of these sizes.
const TOLERANCE: f64 = 8e-6;

fuzz_target!(|data: &[u8]| {
    let mut bytes = Unstructured::new(data);
    let mut pick = || Ok(&BODIES[bytes.int_in_range(0..=BODIES.len() - 1)?]);
    let (Ok(a), Ok(b)): (Result<&Body>, Result<&Body>) = (pick(), pick()) else { return };
    let (Ok(at_a), Ok(at_b)) = (pose(&mut bytes), pose(&mut bytes)) else { return };
    let mut scene = Scene::new();
    for (body, at) in [(a, at_a), (b, at_b)] {
        let shape = scene.add_shape(body.asset.clone()).expect("room");
        scene.add(Instance::new(shape, at)).expect("a valid pose");
    }
    for mode in [Mode::Node, CollideOptions::default().mode] {
        let found =
            detect(&scene, &CollideOptions { mode, ..CollideOptions::default() }).expect("valid options");
        for contact in &found {
            let (body, at) = if contact.instance_b == InstanceId(0) { (a, at_a) } else { (b, at_b) };
            let exact = body.signed_distance(at.rotation.inverse() * (contact.point_a - at.translation));
            assert!((contact.distance - exact).abs() < TOLERANCE, "{mode:?} {exact} {contact:?}");
            assert!((contact.normal.length() - 1.0).abs() < 1e-3, "{contact:?}");
        }
        let deepest = found.iter().map(|c| c.distance).fold(0.0, f64::min);
        for (one, at_one, other, at_other) in [(a, at_a, b, at_b), (b, at_b, a, at_a)] {
            for &v in one.mesh.vertices() {
                let p = at_one.rotation * v + at_one.translation;
                let depth = other.signed_distance(at_other.rotation.inverse() * (p - at_other.translation));
                assert!(deepest <= depth + TOLERANCE, "{mode:?}: {deepest}, but a vertex is at {depth}");
            }
        }
    }
});
