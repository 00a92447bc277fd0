//! Contacts, clearance and time of impact of open meshes under the generalised winding number, whose
//! signed distance jumps in their holes, against brute force over all faces.

use std::path::Path;

use crate::support::parts::Parts;
use crate::support::parts::Turn::{Inward, Outward};
use crate::support::parts::{bowl, soups};
use crate::support::random::Random;
use crate::support::rotation::{least, of_the_day};
use crate::support::ruled::{Body, Compared, assert_contacts, assert_faces, assert_nodes, random_pose};
use tesdf::base::{Inside, InsideRule, Length};
use tesdf::collide::{
    ClearanceOptions, CollideOptions, ContactsPer, Instance, InstanceId, Mode, Motion, Pose, Reduction,
    Scene, Shape, TimeOfImpactOptions, Velocity, clearance, detect, time_of_impact,
};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh, read};

fn open(mesh: TriangleMesh) -> Body {
    Body::new(mesh, InsideRule::Generalized.into())
}

/// A cube without its lid at z = 1/2.
fn cup() -> Body {
    open(Parts::default().open_cube(DVec3::splat(-0.5), 1.0, Outward).mesh())
}

fn box_of(edge: f64) -> Body {
    let mesh = Parts::default().cube(DVec3::splat(-0.5 * edge), edge, Outward).mesh();
    Body::new(mesh, Inside::default())
}

/// A cube with all faces but one.
fn with_a_gap() -> Body {
    let mesh = Parts::default().cube(DVec3::splat(-0.5), 1.0, Outward).mesh();
    let faces = mesh.faces()[1..].to_vec();
    open(TriangleMesh::new(mesh.vertices().to_vec(), faces).expect("valid ids"))
}

/// Two bodies in a scene.
fn scene_of(bodies: [&Body; 2], poses: [Pose; 2]) -> (Scene, [InstanceId; 2]) {
    let mut scene = Scene::new();
    let ids = [0, 1].map(|k| {
        let shape = scene.add_shape(bodies[k].asset.clone()).expect("a shape");
        scene.add(Instance::new(shape, poses[k])).expect("an instance")
    });
    (scene, ids)
}

#[test]
fn open_meshes_touch_as_brute_force_says() {
    let inside_out = open(Parts::default().open_cube(DVec3::splat(-0.5), 1.0, Inward).turned().mesh());
    let bodies = [cup(), with_a_gap(), open(bowl(5, 3).mesh()), open(bowl(6, 2).mesh()), inside_out];
    let small = box_of(0.4);
    let mut random = Random(12);
    let mut compared = Compared::default();
    let mut nodes = 0;
    for body in &bodies {
        for apart in [0.2, 0.45, 0.6, 0.9] {
            let poses = [random_pose(&mut random, 0.05), random_pose(&mut random, apart)];
            assert_contacts(body, &small, poses);
            let [from, to] = [&poses[0], &poses[1]];
            assert_faces([body, &small], [from, to], 0.05, (16, 1), &mut compared);
            assert_faces([&small, body], [to, from], 0.05, (24, 1), &mut compared);
            nodes += assert_nodes([body, &small], [from, to], 0.05);
            nodes += assert_nodes([&small, body], [to, from], 0.05);
        }
    }
    for (i, j) in [(0, 1), (2, 3), (0, 4)] {
        let poses = [random_pose(&mut random, 0.1), random_pose(&mut random, 0.6)];
        assert_contacts(&bodies[i], &bodies[j], poses);
        assert_faces([&bodies[i], &bodies[j]], [&poses[0], &poses[1]], 0.02, (16, 1), &mut compared);
    }
    assert!(compared.deep > 100 && compared.apart > 100, "{} {}", compared.deep, compared.apart);
    assert!(nodes > 40, "{nodes}");
}

/// A box that enters through the hole: no face is near, and yet it is inside from the lid on.
#[test]
fn a_box_in_the_hole_has_the_depth_of_formulas() {
    let (cup, small) = (cup(), box_of(0.4));
    for (z, bottom, side) in [(0.6, Some(0.5), Some(0.3)), (0.69, Some(0.5), Some(0.3)), (0.71, None, None)] {
        let at = Pose::at(DVec3::new(0.0, 0.0, z));
        let (scene, [a, b]) = scene_of([&cup, &small], [Pose::IDENTITY, at]);
        for contacts_per in [ContactsPer::Face, ContactsPer::Cell, ContactsPer::Minimum] {
            for mode in [Mode::exact(), Mode::face(), Mode::Node] {
                let options = CollideOptions::with_mode(mode.per(contacts_per));
                let found = detect(&scene, &options).expect("contacts");
                assert!(found.iter().all(|c| c.converged && c.instance_a == b), "{mode:?}");
                let deepest = found.iter().map(|c| -c.distance).fold(f64::NEG_INFINITY, f64::max);
                let expected = match mode {
                    Mode::Exact(_) | Mode::Face { .. } => bottom,
                    Mode::Node => side,
                };
                let is_right = expected.map_or(found.is_empty(), |d| (deepest - d).abs() < 2e-6);
                assert!(is_right, "{z} {mode:?} {contacts_per:?}: {deepest} {expected:?}");
            }
        }
        let spread = CollideOptions { reduction: Reduction::Spread(4), ..CollideOptions::default() };
        let found = detect(&scene, &spread).expect("contacts");
        assert_eq!(found.is_empty(), bottom.is_none(), "{z}");
        let found = clearance(&scene, a, b, &ClearanceOptions::default()).expect("a clearance");
        let expected = bottom.map_or(DVec3::new(0.3, 0.0, z - 0.7).length(), |depth| -depth);
        assert!((found.distance - expected).abs() < 1e-6 && found.converged, "{z}: {found:?}");
        assert_eq!(found.overlap, bottom.is_some());
    }
}

/// The same bytes on any number of threads.
#[test]
fn contacts_of_open_meshes_do_not_depend_on_threads() {
    let (bowl, small) = (open(bowl(6, 3).mesh()), box_of(0.5));
    let poses = [Pose::IDENTITY, random_pose(&mut Random(3), 0.3)];
    let (scene, [a, b]) = scene_of([&bowl, &small], poses);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let contacts = detect(&scene, &CollideOptions::default()).expect("contacts");
            let clearance = clearance(&scene, a, b, &ClearanceOptions::default()).expect("a clearance");
            (contacts.into_vec(), clearance)
        })
    };
    let one = on(1);
    assert!(!one.0.is_empty() && one == on(3));
}

/// Where the box ends in the plane of the lid, the number is 1/2 on a whole face: either side is right.
#[test]
fn ties_at_the_jump_are_either_side() {
    let (cup, small) = (cup(), box_of(0.4));
    for z in [0.7, 0.7 + 1e-15, 0.7 - 1e-13] {
        let (scene, [a, b]) = scene_of([&cup, &small], [Pose::IDENTITY, Pose::at(DVec3::Z * z)]);
        for mode in [Mode::exact(), Mode::face(), Mode::Node] {
            let found = detect(&scene, &CollideOptions::with_mode(mode)).expect("contacts");
            for contact in found.iter() {
                assert!(contact.distance >= -0.5 - 1e-6 && contact.distance <= 0.0, "{contact:?}");
            }
        }
        let found = clearance(&scene, a, b, &ClearanceOptions::default()).expect("a clearance");
        assert!(
            (found.distance.abs() - 0.3).abs() < 1e-6 || (found.distance + 0.5).abs() < 1e-6,
            "{found:?}"
        );
    }
    // Corners on corners, edges on edges: both bodies in one pose.
    for body in [&small, &cup] {
        let (scene, _) = scene_of([&cup, body], [Pose::IDENTITY; 2]);
        for mode in [Mode::exact(), Mode::face(), Mode::Node] {
            detect(&scene, &CollideOptions::with_mode(mode)).expect("contacts");
        }
    }
}

/// Triangles that enclose nothing, needles, repeated faces: every distance is positive, up to faces that
/// lie on each other.
#[test]
fn soups_touch_as_brute_force_says() {
    let small = box_of(0.3);
    let mut random = Random(5);
    let mut compared = Compared::default();
    for mesh in soups() {
        let Ok(_) = SolidMesh::with_inside(mesh.clone(), InsideRule::Generalized.into()) else { continue };
        let body = open(mesh);
        for apart in [0.1, 0.4] {
            let poses = [random_pose(&mut random, 0.05), random_pose(&mut random, apart)];
            assert_contacts(&body, &small, poses);
            let [from, to] = [&poses[0], &poses[1]];
            assert_faces([&body, &small], [from, to], 0.1, (24, 1), &mut compared);
            assert_faces([&small, &body], [to, from], 0.1, (24, 1), &mut compared);
        }
    }
    assert!(compared.touching > 30, "{}", compared.touching);
}

/// The impact is where the surfaces touch. A body passes through a hole.
#[test]
fn an_impact_is_where_surfaces_touch() {
    let (cup, small) = (cup(), box_of(0.4));
    let (scene, [a, b]) = scene_of([&cup, &small], [Pose::IDENTITY, Pose::at(DVec3::Z * 1.2)]);
    let down = Motion::Linear { velocity: Velocity { linear: -2.0 * DVec3::Z, angular: DVec3::ZERO } };
    let options = TimeOfImpactOptions::default();
    for (first, second, motions) in [(a, b, [Motion::Rest, down]), (b, a, [down, Motion::Rest])] {
        let impact = time_of_impact(&scene, first, second, motions[0], motions[1], &options);
        let impact = *impact.expect("an answer").impact().expect("an impact with the bottom");
        assert!((impact.time - 0.75).abs() < 1e-5, "{impact:?}");
    }
    // A body that is inside at the start penetrates.
    let (scene, [a, b]) = scene_of([&cup, &small], [Pose::IDENTITY; 2]);
    let impact = time_of_impact(&scene, a, b, Motion::Rest, down, &options);
    let impact = *impact.expect("an answer").impact().expect("at the start");
    assert!(impact.time == 0.0 && impact.clearance.distance < -0.29, "{impact:?}");
    // A cup sinks into the other, down to the bottom.
    let little = open(Parts::default().open_cube(DVec3::splat(-0.2), 0.4, Outward).mesh());
    let (scene, [a, b]) = scene_of([&cup, &little], [Pose::IDENTITY, Pose::at(DVec3::Z * 1.2)]);
    let impact = time_of_impact(&scene, a, b, Motion::Rest, down, &options);
    let impact = *impact.expect("an answer").impact().expect("an impact with the bottom");
    assert!((impact.time - 0.75).abs() < 1e-5, "{impact:?}");
}

/// Two open meshes are as far apart as their faces, which are measured here as sheets of no
/// notable thickness. They do not touch before the impact.
#[test]
fn open_meshes_meet_where_their_faces_do() {
    const THICKNESS: f64 = 1e-4;
    let mut random = Random(7);
    let mut met = 0;
    for round in 0..40 {
        let meshes = [bowl(5 + round % 3, 3).mesh(), bowl(6, 2 + round % 2).mesh()];
        let [open_a, open_b] = [0, 1].map(|k| open(meshes[k].clone()));
        let [sheet_a, sheet_b] = [0, 1].map(|k| Body::sheet(meshes[k].clone(), THICKNESS));
        let [mut pose_a, pose_b] = [random_pose(&mut random, 0.1), random_pose(&mut random, 0.1)];
        let from = random.direction();
        pose_a.translation += 2.5 * from;
        let aside = 0.7 * random.direction();
        let velocity = Velocity { linear: 4.0 * (aside - from), angular: 3.0 * random.direction() };
        let motion = Motion::Linear { velocity };
        let options = TimeOfImpactOptions { tolerance: Length::Absolute(1e-6), ..Default::default() };
        let (scene, [a, b]) = scene_of([&open_a, &open_b], [pose_a, pose_b]);
        let impact = time_of_impact(&scene, a, b, motion, Motion::Rest, &options).expect("an answer");
        let faces_apart = |time: f64| {
            let poses = [motion.pose_at(pose_a, time), pose_b];
            let (scene, [a, b]) = scene_of([&sheet_a, &sheet_b], poses);
            let options = ClearanceOptions { tolerance: Length::Absolute(1e-9) };
            clearance(&scene, a, b, &options).expect("a clearance").distance + THICKNESS
        };
        let until = impact.free_until();
        assert!((0..50).all(|k| faces_apart(until * f64::from(k) / 50.0) > 0.4e-6), "{round}: {impact:?}");
        assert!(impact.impact().is_some() || impact.is_free(), "{round}: {impact:?}");
        if let Some(impact) = impact.impact() {
            assert!(impact.clearance.distance <= 1e-6, "{round}: {impact:?}");
            assert!(
                (faces_apart(impact.time) - impact.clearance.distance).abs() < 2e-7,
                "{round}: {impact:?}"
            );
            met += 1;
        }
    }
    assert!((10..40).contains(&met), "{met}");
}

#[test]
fn simple_shapes_touch_an_open_mesh() {
    let cup = cup();
    let mut scene = Scene::new();
    let shape = scene.add_shape(cup.asset.clone()).expect("a shape");
    let cup = scene.add(Instance { scale: 2.0, ..Instance::new(shape, Pose::IDENTITY) }).expect("added");
    for (shape, depth) in [
        (Shape::Sphere { radius: 0.25 }, 1.05),
        (Shape::Box { half_extents: DVec3::splat(0.25) }, 1.0),
        (Shape::Capsule { half_height: 0.25, radius: 0.2 }, 0.95),
    ] {
        let shape = scene.add_shape(shape).expect("a shape");
        // The lid is at z = 1; the middle of the body is below it.
        let at = Pose { translation: DVec3::Z * 0.8, rotation: DQuat::IDENTITY };
        let body = scene.add(Instance::new(shape, at)).expect("added");
        let found = detect(&scene, &CollideOptions::default()).expect("contacts");
        let least = found.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
        let found = clearance(&scene, cup, body, &ClearanceOptions::default()).expect("a clearance");
        assert!(least < -0.9 && (least - found.distance).abs() < 1e-5, "{least} {found:?} {depth}");
        scene.remove(&[body]).expect("removed");
    }
    let plane = scene.add_shape(Shape::Plane).expect("a plane");
    let up = Pose { translation: DVec3::Z * -0.9, rotation: DQuat::IDENTITY };
    let plane = scene.add(Instance::new(plane, up)).expect("added");
    let found = clearance(&scene, cup, plane, &ClearanceOptions::default()).expect("a clearance");
    assert!((found.distance + 0.1).abs() < 1e-6, "{found:?}");
    let contacts = detect(&scene, &CollideOptions::default()).expect("contacts");
    assert!(contacts.iter().any(|c| c.instance_a == cup && (c.distance + 0.1).abs() < 1e-5));
    assert!(contacts.iter().any(|c| c.instance_a == plane && c.distance < -0.05));
}

fn wild(name: &str) -> TriangleMesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/wild").join(name);
    let mesh = read(path).expect("reads").mesh;
    // Of one size, around the origin.
    let (middle, scale) = (mesh.bounds().center(), 1.0 / mesh.diagonal());
    let vertices = mesh.vertices().iter().map(|&v| (v - middle) * scale).collect();
    TriangleMesh::new(vertices, mesh.faces().to_vec()).expect("valid ids")
}

/// Ten poses of meshes as users have them, each under the rule that it needs.
#[test]
fn meshes_as_they_come_touch_as_brute_force_says() {
    let generalized = |name| open(wild(name));
    let bodies = [
        generalized("google-deepmind_stovetop_knob_front_right_0.obj"),
        generalized("isaac-sim_door_left_nob.obj"),
        Body::sheet(wild("o2ac_sr305.stl"), 0.02),
        Body::new(wild("google-deepmind_wormseye_mount.stl"), Inside::default()),
        Body::new(wild("yunshengtian_linkbase_vhacd.obj"), InsideRule::Odd.into()),
    ];
    let mut random = Random(14);
    let mut compared = Compared::default();
    let pairs = [(0, 1), (0, 3), (1, 3), (1, 2), (4, 3), (4, 0), (4, 2), (4, 4), (0, 0), (3, 1)];
    for (i, j) in of_the_day(pairs) {
        let poses = [random_pose(&mut random, 0.05), random_pose(&mut random, 0.3)];
        let share = |k: usize| bodies[k].asset.face_count().div_ceil(20);
        let [from, to] = [&poses[0], &poses[1]];
        assert_faces([&bodies[i], &bodies[j]], [from, to], 0.01, (4, share(i)), &mut compared);
        assert_faces([&bodies[j], &bodies[i]], [to, from], 0.01, (4, share(j)), &mut compared);
    }
    assert!(
        compared.deep > least(10, 2) && compared.apart > least(50, 10),
        "{} {}",
        compared.deep,
        compared.apart
    );
}
