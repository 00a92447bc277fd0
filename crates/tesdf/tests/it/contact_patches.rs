//! Contact patches: what they measure, and that they keep their ids while bodies slide and roll.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::support::bodies::{Body, body};
use crate::support::shapes;
use tesdf::collide::{
    CollideError, CollideOptions, ContactPatches, Instance, InstanceId, Mode, PatchOptions, PatchTracker,
    Pose, Scene, Shape, detect,
};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{MeshFormat, SolidMesh, read_bytes};
use tesdf::{Length, TeSdf};

const CONTACT_DISTANCE: f64 = 1e-4;

fn options() -> CollideOptions {
    CollideOptions {
        contact_distance: CONTACT_DISTANCE,
        ..CollideOptions::with_mode(Mode::exact().filtered(0.5))
    }
}

fn block(min: DVec3, max: DVec3, n: u32) -> Arc<TeSdf> {
    Body::new(shapes::Shape::default().add_box(min, max, n).solid()).asset
}

/// A floor of 8 × 8 squares with its top at 0, and a body on it.
fn on_floor(body: Arc<TeSdf>) -> (Scene, InstanceId) {
    let floor = block(DVec3::new(-0.5, -0.5, -0.1), DVec3::new(0.5, 0.5, 0.0), 8);
    let mut scene = Scene::new();
    let ids = [floor, body].map(|asset| {
        let shape = scene.add_shape(Shape::Mesh(asset)).expect("a mesh");
        scene.add(Instance::new(shape, Pose::IDENTITY)).expect("an instance")
    });
    (scene, ids[1])
}

fn found(scene: &Scene, tracker: &mut PatchTracker) -> ContactPatches {
    let contacts = detect(scene, &options()).expect("a good scene");
    tracker.update(scene, contacts.as_slice()).expect("known instances")
}

fn tracker() -> PatchTracker {
    PatchTracker::new(PatchOptions::default()).expect("good options")
}

fn cube() -> Arc<TeSdf> {
    block(DVec3::splat(-0.05), DVec3::splat(0.05), 1)
}

#[test]
fn a_sliding_box_keeps_its_patch_and_its_corners() {
    let (mut scene, sliding) = on_floor(cube());
    let mut tracker = tracker();
    let mut ids = BTreeSet::new();
    for step in 0..60 {
        let step = f64::from(step);
        let center = DVec3::new(-0.3 + 0.0071 * step, 0.05 + 0.0013 * step, 0.05);
        let pose = Pose { translation: center, rotation: DQuat::from_rotation_z(0.02 * step) };
        scene.set_poses(&[(sliding, pose)]).expect("a pose");
        let ContactPatches { patches, ended } = found(&scene, &mut tracker);
        assert_eq!((patches.len(), ended.len()), (1, 0), "step {step}");
        let patch = &patches[0];
        assert_eq!((patch.id, patch.age), (0, step as u64));
        assert!((patch.area - 0.01).abs() < 1e-8, "step {step}: {}", patch.area);
        assert!(patch.center.distance(center.with_z(0.0)) < 1e-7, "step {step}: {}", patch.center);
        // The floor has the lower id, and is pushed down.
        assert!(patch.normal.distance(DVec3::NEG_Z) < 1e-9, "step {step}: {}", patch.normal);
        assert_eq!(patch.points.len(), 4);
        ids.extend(patch.points.iter().map(|point| point.id));
    }
    assert_eq!(ids.into_iter().collect::<Vec<_>>(), [0, 1, 2, 3]);
}

/// A prism of twelve sides of the radius 0.05, with its axis along y.
fn prism() -> Arc<TeSdf> {
    let mut obj = String::new();
    for y in [-0.1, 0.1] {
        for k in 0..12 {
            let angle = std::f64::consts::TAU * f64::from(k) / 12.0;
            obj += &format!("v {} {y} {}\n", 0.05 * angle.sin(), -0.05 * angle.cos());
        }
    }
    for k in 0..12 {
        let (a, b) = (k + 1, (k + 1) % 12 + 1);
        obj += &format!("f {a} {} {b}\nf {a} {} {}\n", b + 12, a + 12, b + 12);
    }
    for k in 1..11 {
        obj += &format!("f 1 {} {}\nf 13 {} {}\n", k + 1, k + 2, k + 14, k + 13);
    }
    let mesh = read_bytes(obj.as_bytes(), MeshFormat::Obj).expect("an OBJ file").mesh;
    let solid = SolidMesh::new(mesh).expect("a solid");
    Arc::new(tesdf::Encoder::new().encode(&solid).expect("a small mesh"))
}

/// The prism rolls over its edges, by 5° a step. Each edge touches with its two ends.
#[test]
fn a_rolling_prism_keeps_its_patch_and_changes_its_points() {
    let (mut scene, rolling) = on_floor(prism());
    let mut tracker = tracker();
    let mut ids = BTreeSet::new();
    let side = 2.0 * 0.05 * (std::f64::consts::PI / 12.0).sin();
    let sides = 7;
    for step in 0..=6 * sides {
        // Around the edge that leads, from the side before it to the side after it.
        let (edge, turned) = (step / 6, step % 6);
        let angle = std::f64::consts::TAU / 12.0 * (f64::from(edge) + f64::from(turned) / 6.0);
        let rotation = DQuat::from_rotation_y(angle - std::f64::consts::PI / 12.0);
        let spoke = rotation
            * DVec3::new(
                0.05 * (std::f64::consts::TAU * f64::from(edge) / 12.0).sin(),
                0.0,
                -0.05 * (std::f64::consts::TAU * f64::from(edge) / 12.0).cos(),
            );
        let translation = DVec3::new(-0.2 + side * f64::from(edge), 0.0, 0.0) - spoke;
        scene.set_poses(&[(rolling, Pose { translation, rotation })]).expect("a pose");
        // So near that no corner of the floor beside the edge touches.
        let options = CollideOptions { contact_distance: 1e-6, ..options() };
        let contacts = detect(&scene, &options).expect("a good scene");
        let found = tracker.update(&scene, contacts.as_slice()).expect("known instances");
        let ContactPatches { patches, ended } = found;
        assert_eq!((patches.len(), ended.len()), (1, 0), "step {step}");
        assert_eq!(patches[0].id, 0);
        let expected = if turned == 0 { 4 } else { 2 };
        assert_eq!(patches[0].points.len(), expected, "step {step}: {:?}", patches[0]);
        ids.extend(patches[0].points.iter().map(|point| point.id));
    }
    // Each of the edges that touched has two ends.
    assert_eq!(ids.len(), 2 * (sides as usize + 2), "{ids:?}");
}

#[test]
fn a_body_that_comes_back_has_a_new_patch() {
    let (mut scene, moving) = on_floor(cube());
    let mut tracker = tracker();
    let mut at = |z: f64| {
        scene.set_poses(&[(moving, Pose::at(DVec3::new(0.0, 0.0, z)))]).expect("a pose");
        found(&scene, &mut tracker)
    };
    assert_eq!(at(0.05).patches[0].id, 0);
    let away = at(0.06);
    assert_eq!((away.patches.len(), away.ended), (0, vec![0]));
    let back = at(0.05);
    assert_eq!((back.patches[0].id, back.patches[0].age, back.ended), (1, 0, vec![]));
    assert!(back.patches[0].points.iter().all(|point| point.id >= 4));
}

/// The pressure falls to 0 from one side of a tilted box to the other, so its centre is at a third.
#[test]
fn the_pressure_centre_is_on_the_deeper_side() {
    let mut scene = Scene::new();
    let plane = scene.add_shape(Shape::Plane).expect("a plane");
    let shape = scene.add_shape(Shape::Mesh(cube())).expect("a mesh");
    let tilt = 5e-4;
    let rotation = DQuat::from_rotation_y(tilt);
    let lowest = rotation * DVec3::new(0.05, 0.0, -0.05);
    scene.add(Instance::new(plane, Pose::IDENTITY)).expect("an instance");
    let pose = Pose { translation: DVec3::new(0.0, 0.0, -lowest.z), rotation };
    scene.add(Instance::new(shape, pose)).expect("an instance");
    let found = found(&scene, &mut tracker());
    let [patch] = &found.patches[..] else { panic!("{found:?}") };
    assert!((patch.area - 0.01).abs() < 1e-6, "{}", patch.area);
    let expected = 0.05 - 0.1 / 3.0;
    assert!((patch.center.x - expected).abs() < 1e-3 && patch.center.y.abs() < 1e-6, "{}", patch.center);
}

#[test]
fn nut_and_bolt_have_few_patches_that_cover_all_contacts() {
    let assets = ["iso_m16_bolt_6k", "iso_m16_nut_c100"].map(|name| body(name).asset.clone());
    let mut scene = Scene::new();
    for asset in assets {
        let shape = scene.add_shape(Shape::Mesh(asset)).expect("a mesh");
        scene.add(Instance::new(shape, Pose::IDENTITY)).expect("an instance");
    }
    let contacts = detect(&scene, &options()).expect("a good scene");
    let mut tracker = tracker();
    let first = tracker.update(&scene, contacts.as_slice()).expect("known instances");
    let mut covered: Vec<usize> = first.patches.iter().flat_map(|patch| patch.contacts.clone()).collect();
    covered.sort_unstable();
    assert_eq!(covered, (0..contacts.len()).collect::<Vec<_>>());
    assert!(first.patches.len() * 10 < contacts.len(), "{} of {}", first.patches.len(), contacts.len());
    // The same contacts again: the same ids.
    let again = tracker.update(&scene, contacts.as_slice()).expect("known instances");
    assert!(again.ended.is_empty());
    for (x, y) in first.patches.iter().zip(&again.patches) {
        assert_eq!((x.id, &x.points, y.age), (y.id, &y.points, 1));
    }
}

#[test]
fn bad_options_and_unknown_instances_are_refused() {
    for bad in [
        PatchOptions { angle: f64::NAN, ..PatchOptions::default() },
        PatchOptions { link: Length::Absolute(0.0), ..PatchOptions::default() },
        PatchOptions { points: 0, ..PatchOptions::default() },
    ] {
        assert!(matches!(PatchTracker::new(bad), Err(CollideError::Option { .. })), "{bad:?}");
    }
    let (mut scene, body) = on_floor(cube());
    let contacts = detect(&scene, &options()).expect("a good scene");
    assert!(!contacts.is_empty());
    scene.remove(&[body]).expect("an instance");
    let error = tracker().update(&scene, contacts.as_slice()).expect_err("an instance is missing");
    assert_eq!(error, CollideError::NoInstance(body));
}
