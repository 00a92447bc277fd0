//! Edge cases of scenes: invalid input is an error that names it, and valid input is answered.

use std::sync::atomic::AtomicBool;

use crate::support::bodies::body;
use tesdf::Length;
use tesdf::collide::{
    CollideError, CollideOptions, ContactsPer, FaceOptions, Groups, Instance, InstanceId, Mode, Placement,
    Pose, Reduction, Scene, Shape, ShapeId, Velocity, detect, detect_until,
};
use tesdf::glam::{DQuat, DVec3};

fn sphere(scene: &mut Scene, radius: f64) -> ShapeId {
    scene.add_shape(Shape::Sphere { radius }).expect("a sphere")
}

fn at(x: f64) -> Pose {
    Pose::at(DVec3::new(x, 0.0, 0.0))
}

/// Spheres of radius 1 along x.
fn row(places: &[f64]) -> (Scene, Vec<InstanceId>) {
    let mut scene = Scene::new();
    let shape = sphere(&mut scene, 1.0);
    let ids = places.iter().map(|&x| scene.add(Instance::new(shape, at(x))).expect("a pose")).collect();
    (scene, ids)
}

/// Ordered pairs (a, b) that have a contact.
fn touching(scene: &Scene) -> Vec<(u32, u32)> {
    let found = detect(scene, &CollideOptions::default()).expect("a good scene");
    let mut pairs: Vec<_> = found.iter().map(|c| (c.instance_a.0, c.instance_b.0)).collect();
    pairs.dedup();
    pairs
}

#[test]
fn invalid_poses_are_refused() {
    let (mut scene, ids) = row(&[0.0]);
    let shape = scene.instance(ids[0]).expect("it is there").shape;
    let good = Instance::new(shape, Pose::IDENTITY);
    let rotation = |x, y, z, w| Pose { translation: DVec3::ZERO, rotation: DQuat::from_xyzw(x, y, z, w) };
    let nan = f64::NAN;
    let bad = [
        Instance { pose: at(nan), ..good },
        Instance { pose: at(f64::INFINITY), ..good },
        Instance { pose: rotation(nan, 0.0, 0.0, 1.0), ..good },
        Instance { pose: rotation(0.0, 0.0, 0.0, 0.0), ..good },
        Instance { pose: rotation(0.0, 0.0, 0.0, 1.00001), ..good },
        Instance { pose: rotation(1e200, 1e200, 0.0, 0.0), ..good },
        Instance { scale: 0.0, ..good },
        Instance { scale: -1.0, ..good },
        Instance { scale: nan, ..good },
        Instance { velocity: Velocity { linear: DVec3::NAN, angular: DVec3::ZERO }, ..good },
        Instance { shape: ShapeId(77), ..good },
    ];
    for instance in bad {
        // The third of a list: the error names its index in the list, and no instance is added.
        let error = scene.add_many(&[good, good, instance]).expect_err("is refused");
        assert!(matches!(error, CollideError::Instance { instance: 2, .. }), "{error}");
        let error = scene.update(&[(ids[0], instance)]).expect_err("is refused");
        assert!(matches!(error, CollideError::Instance { instance: 0, .. }), "{error}");
        assert!(error.to_string().contains("instance 0"), "{error}");
    }
    assert_eq!(scene.instances().len(), 1);
    assert_eq!(scene.instance(ids[0]).expect("it is there").pose, at(0.0));
    // A rotation within 1e-6 of unit length counts as rounding and is normalised.
    let id = scene.add(Instance { pose: rotation(0.0, 0.0, 0.0, 1.0 + 5e-7), ..good }).expect("is taken");
    assert_eq!(scene.instance(id).expect("it is there").pose.rotation.length(), 1.0);
}

#[test]
fn invalid_shapes_are_refused() {
    let mut scene = Scene::new();
    for shape in [
        Shape::Sphere { radius: 0.0 },
        Shape::Sphere { radius: f64::NAN },
        Shape::Box { half_extents: DVec3::new(1.0, -1.0, 1.0) },
        Shape::Capsule { half_height: 1.0, radius: f64::INFINITY },
        Shape::Capsule { half_height: 0.0, radius: 1.0 },
    ] {
        let error = scene.add_shape(shape).expect_err("is refused");
        assert!(matches!(error, CollideError::Shape { .. }), "{error}");
    }
}

#[test]
fn invalid_options_are_refused() {
    let (scene, _) = row(&[0.0, 1.0]);
    let good = CollideOptions::default();
    for (name, options) in [
        ("contact_distance", CollideOptions { contact_distance: -1e-9, ..good }),
        ("contact_distance", CollideOptions { contact_distance: f64::NAN, ..good }),
        ("speculative_time", CollideOptions { speculative_time: f64::INFINITY, ..good }),
        ("cos_theta", CollideOptions { mode: good.mode.filtered(1.5), ..good }),
        ("cos_theta", CollideOptions { mode: good.mode.filtered(f64::NAN), ..good }),
        ("tolerance", CollideOptions { mode: good.mode.within(Length::OfDiagonal(0.0)), ..good }),
        ("tolerance", CollideOptions { mode: good.mode.within(Length::Absolute(f64::NAN)), ..good }),
        (
            "iterations",
            CollideOptions {
                mode: Mode::Face {
                    iterations: CollideOptions::MAX_ITERATIONS + 1,
                    faces: FaceOptions::default(),
                },
                ..good
            },
        ),
        ("reduction", CollideOptions { reduction: Reduction::PerPair(0), ..good }),
    ] {
        let error = detect(&scene, &options).expect_err("is refused");
        assert!(matches!(error, CollideError::Option { option, .. } if option == name), "{error}");
    }
}

#[test]
fn options_that_a_text_leaves_out_have_their_defaults() {
    let read = |text: &str| serde_json::from_str::<CollideOptions>(text).expect("options");
    assert_eq!(read("{}"), CollideOptions::default());
    let nodes = CollideOptions { mode: Mode::Node, contact_distance: 0.5, ..CollideOptions::default() };
    assert_eq!(read(r#"{ "mode": "node", "contact_distance": 0.5 }"#), nodes);
    let of_faces = [
        Mode::exact().per(ContactsPer::Minimum),
        Mode::PAPER.within(Length::Absolute(1e-3)),
        Mode::Face { iterations: 3, faces: FaceOptions::OF_SIMULATION },
    ];
    for options in of_faces.map(CollideOptions::with_mode).into_iter().chain([nodes]) {
        let written = serde_json::to_string(&options).expect("a text");
        assert_eq!(read(&written), options, "{written}");
    }
}

#[test]
fn a_text_with_an_option_that_the_mode_does_not_use_is_refused() {
    for (text, option, modes) in [
        (r#"{ "mode": "node", "contacts_per": "cell" }"#, "contacts_per", "`face` and `exact`"),
        (r#"{ "mode": "node", "tolerance": { "absolute": 1e-3 } }"#, "tolerance", "`face` and `exact`"),
        (r#"{ "mode": "node", "cos_theta": 0.5 }"#, "cos_theta", "`face` and `exact`"),
        (r#"{ "mode": "exact", "iterations": 16 }"#, "iterations", "`face`"),
        (r#"{ "iterations": 16 }"#, "iterations", "`face`"),
    ] {
        let error = serde_json::from_str::<CollideOptions>(text).expect_err(text).to_string();
        let says = format!("{option} has no effect in the mode");
        assert!(error.starts_with(&says) && error.contains(&format!("only in {modes}")), "{error}");
    }
}

#[test]
fn empty_scenes_single_bodies_and_two_planes_have_no_contacts() {
    let none = detect(&Scene::new(), &CollideOptions::default()).expect("nothing is no error");
    assert_eq!((none.len(), none.statistics.instance_pairs), (0, 0));
    assert_eq!(touching(&row(&[0.0]).0), []);
    // Two planes have no contacts: they are half-spaces, and would touch along a whole line.
    let mut scene = Scene::new();
    let plane = scene.add_shape(Shape::Plane).expect("a plane");
    scene.add_many(&[Instance::new(plane, Pose::IDENTITY); 2]).expect("poses");
    assert_eq!(touching(&scene), []);
}

#[test]
fn contact_distance_of_zero() {
    // Touching spheres have contacts. A tiny gap means none, a tiny overlap means some.
    assert_eq!(touching(&row(&[0.0, 2.0]).0), [(0, 1), (1, 0)]);
    assert_eq!(touching(&row(&[0.0, 2.0 + 1e-12]).0), []);
    assert_eq!(touching(&row(&[0.0, 2.0 - 1e-12]).0), [(0, 1), (1, 0)]);
    // Also for meshes: cubes that share a side.
    let cube = body("cube");
    let edge = cube.solid.mesh().bounds().extent().x;
    let mut scene = Scene::new();
    let shape = scene.add_shape(cube.asset.clone()).expect("a mesh");
    scene.add_many(&[Instance::new(shape, at(0.0)), Instance::new(shape, at(edge))]).expect("poses");
    for mode in [Mode::Node, Mode::face(), Mode::exact()] {
        let found = detect(&scene, &CollideOptions::with_mode(mode)).expect("a good scene");
        let least = found.iter().map(|c| c.distance).fold(0.0, f64::min);
        assert!(found.len() >= 4 && least > -1e-9 * edge, "{mode:?}: {least}");
    }
}

#[test]
fn cubes_that_share_a_side_touch_in_any_pose() {
    // Two cubes that share a side, rotated together, still have contacts at a contact distance of a
    // thousandth of a picometre.
    let cube = body("cube");
    let edge = cube.solid.mesh().bounds().extent().x;
    for k in 0..100 {
        let mut random = crate::support::random::Random(k);
        let motion =
            Pose { translation: random.in_cube(), rotation: crate::support::bodies::rotation(&mut random) };
        let mut scene = Scene::new();
        let shape = scene.add_shape(cube.asset.clone()).expect("a mesh");
        for x in [0.0, edge] {
            scene.add(Instance::new(shape, motion.after(at(x)))).expect("a pose");
        }
        let options = CollideOptions { contact_distance: 1e-15, ..CollideOptions::with_mode(Mode::Node) };
        let found = detect(&scene, &options).expect("a good scene");
        assert!(!found.is_empty(), "seed {k}");
    }
}

#[test]
fn excluded_pairs_have_no_contacts() {
    let places = [0.0, 0.5, 1.0];
    let (mut scene, ids) = row(&places);
    assert_eq!(touching(&scene).len(), 6);
    scene.exclude(ids[2], ids[0]).expect("both are there");
    assert_eq!(touching(&scene), [(0, 1), (1, 0), (1, 2), (2, 1)]);
    scene.include(ids[0], ids[2]);
    assert_eq!(touching(&scene).len(), 6);
    assert_eq!(scene.exclude(ids[0], InstanceId(9)), Err(CollideError::NoInstance(InstanceId(9))));

    let edit = |scene: &mut Scene, id, change: &dyn Fn(&mut Instance)| {
        let mut instance = *scene.instance(id).expect("it is there");
        change(&mut instance);
        scene.update(&[(id, instance)]).expect("a good state");
    };
    // One side of the filter is enough to exclude a pair.
    edit(&mut scene, ids[0], &|i| i.groups = Groups { memberships: 1, filter: !2 });
    edit(&mut scene, ids[1], &|i| i.groups = Groups { memberships: 2, filter: !0 });
    assert_eq!(touching(&scene), [(0, 2), (2, 0), (1, 2), (2, 1)]);
    edit(&mut scene, ids[2], &|i| i.world = 1);
    assert_eq!(touching(&scene), []);
    edit(&mut scene, ids[1], &|i| i.world = 1);
    assert_eq!(touching(&scene), [(1, 2), (2, 1)]);
}

#[test]
fn ids_stay_when_other_instances_are_removed() {
    let (mut scene, ids) = row(&[0.0, 0.5, 1.0, 1.5]);
    scene.remove(&[ids[1]]).expect("it is there");
    assert_eq!(scene.remove(&[ids[0], ids[1]]), Err(CollideError::NoInstance(ids[1])));
    assert_eq!(scene.instances().map(|(id, _)| id.0).collect::<Vec<_>>(), [0, 2, 3]);
    assert_eq!(scene.instance(ids[3]).expect("it is there").pose, at(1.5));
    assert_eq!(touching(&scene), [(0, 2), (2, 0), (0, 3), (3, 0), (2, 3), (3, 2)]);
    let shape = scene.instance(ids[0]).expect("it is there").shape;
    let next = scene.add(Instance::new(shape, at(9.0))).expect("a pose");
    assert_eq!(next, InstanceId(4), "an id is never used again");
    assert_eq!(scene.set_poses(&[(ids[1], at(0.0))]), Err(CollideError::NoInstance(ids[1])));
    scene.set_poses(&[(ids[3], at(8.0))]).expect("it is there");
    assert_eq!(touching(&scene), [(0, 2), (2, 0), (3, 4), (4, 3)]);
}

#[test]
fn shapes_in_use_stay_and_removed_shapes_are_errors() {
    let (mut scene, ids) = row(&[0.0, 0.5]);
    let shape = scene.instance(ids[0]).expect("it is there").shape;
    scene.remove(&[ids[0]]).expect("it is there");
    let error = scene.remove_shape(shape).expect_err("still used");
    assert_eq!(error, CollideError::ShapeInUse { shape, instance: ids[1] });
    assert!(error.to_string().contains("instance 1"), "{error}");
    scene.remove(&[ids[1]]).expect("it is there");
    scene.remove_shape(shape).expect("not used any more");
    assert!(matches!(scene.remove_shape(shape), Err(CollideError::NoShape(_))));
    let error = scene.add(Instance::new(shape, at(0.0))).expect_err("its shape is gone");
    assert!(matches!(error, CollideError::Instance { instance: 0, .. }), "{error}");
    let next = sphere(&mut scene, 1.0);
    assert_ne!(next, shape, "an id is never used again");
}

#[test]
fn many_worlds_have_the_contacts_of_one_world_each() {
    let (one, _) = row(&[0.0, 1.5, 5.0]);
    let mut scene = Scene::new();
    let shape = sphere(&mut scene, 1.0);
    for world in (0..50).rev() {
        for x in [0.0, 1.5, 5.0] {
            scene.add(Instance { world, ..Instance::new(shape, at(x)) }).expect("a pose");
        }
    }
    let options = CollideOptions::default();
    let (of_one, of_all) =
        (detect(&one, &options).expect("a good scene"), detect(&scene, &options).expect("a good scene"));
    assert_eq!(of_all.len(), 50 * of_one.len());
    assert_eq!(of_all.statistics.instance_pairs, 50 * of_one.statistics.instance_pairs);
    let worlds: Vec<u32> =
        of_all.iter().map(|c| scene.instance(c.instance_a).expect("it is there").world).collect();
    assert!(worlds.is_sorted());
}

/// Bodies on a grid. Only one pair in a thousand touches. The example `many_instances` has a
/// million bodies.
#[test]
fn a_hundred_thousand_instances() {
    let count = 100_000usize;
    let mut scene = Scene::new();
    let cube = body("cube");
    let edge = cube.solid.mesh().bounds().extent().x;
    let shapes = [
        scene.add_shape(cube.asset.clone()).expect("a mesh"),
        scene.add_shape(Shape::Box { half_extents: DVec3::splat(0.5 * edge) }).expect("a box"),
        sphere(&mut scene, 0.5 * edge),
    ];
    let place = |k: usize| {
        let to = DVec3::new((k % 50) as f64, (k / 50 % 50) as f64, (k / 2500) as f64) * 2.0 * edge;
        let nudged = if k % 1000 == 1 { 1.5 * edge } else { 0.0 };
        Instance::new(shapes[k / 1000 % 3], Pose::at(to - DVec3::X * nudged))
    };
    let instances: Vec<Instance> = (0..count).map(place).collect();
    scene.add_many(&instances).expect("poses");
    assert!(scene.instance_bytes() < 200 * count, "{} bytes", scene.instance_bytes());
    let found = detect(&scene, &CollideOptions::default()).expect("a good scene");
    let mut pairs: Vec<(u32, u32)> = found.iter().map(|c| (c.instance_a.0, c.instance_b.0)).collect();
    pairs.dedup();
    let expected: Vec<(u32, u32)> =
        (0..count as u32).step_by(1000).flat_map(|k| [(k, k + 1), (k + 1, k)]).collect();
    assert_eq!(pairs, expected);
    // The cost depends on contacts, not on instances.
    assert_eq!(found.statistics.instance_pairs, expected.len());
    assert!(found.statistics.bytes < 100_000 + 1000 * found.len(), "{:?}", found.statistics);
}

#[test]
fn a_scaled_instance_equals_a_scaled_shape() {
    let mut scene = Scene::new();
    let (small, large) = (sphere(&mut scene, 0.5), sphere(&mut scene, 1.5));
    let pairs = [
        [Instance { scale: 3.0, ..Instance::new(small, at(0.0)) }, Instance::new(large, at(2.9))],
        [Instance::new(large, at(0.0)), Instance::new(large, at(2.9))],
    ];
    for (world, pair) in pairs.iter().enumerate() {
        scene.add_many(&pair.map(|i| Instance { world: world as u32, ..i })).expect("poses");
    }
    let found = detect(&scene, &CollideOptions::default()).expect("a good scene").into_vec();
    assert_eq!(found.len(), 4);
    for (x, y) in found[..2].iter().zip(&found[2..]) {
        assert!((x.distance - y.distance).abs() < 1e-15 && x.point_a.distance(y.point_a) < 1e-15);
    }
    let placed = Placement { pose: at(1.0), scale: 2.0 };
    assert_eq!(placed.to_shape(placed.to_world(DVec3::Y)), DVec3::Y);
}

#[test]
fn a_detection_can_be_stopped() {
    let (scene, _) = row(&[0.0, 1.5, 3.0]);
    for reduction in [Reduction::None, Reduction::PerPair(1), Reduction::Spread(1)] {
        let options = CollideOptions { reduction, ..CollideOptions::default() };
        assert_eq!(detect_until(&scene, &options, &AtomicBool::new(false)), detect(&scene, &options));
        let stopped = detect_until(&scene, &options, &AtomicBool::new(true));
        assert_eq!(stopped, Err(CollideError::Stopped));
    }
}
