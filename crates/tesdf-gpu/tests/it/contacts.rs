//! Compares contacts of the device with those of the host: the same parts touch, at the same
//! depths, and each contact agrees with the exact field.

use std::sync::Arc;

use crate::compare::{Compared, device, each_mode, found, hold, least, per_cell};

use crate::support::bodies::{Body, Placed, RELATIONS, Relation, body, rotation, scene};
use crate::support::meshes;
use crate::support::random::Random;
use tesdf::TeSdf;
use tesdf::collide::{
    CollideOptions, Contact, Contacts, ContactsPer, Groups, Instance, InstanceId, Mode, Pose, Scene, Shape,
    Velocity, detect, instance_pairs,
};
use tesdf::encode::{EncodeOptions, Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf_gpu::{Capacities, Detector, DetectorOptions, Exchange, GpuError, Lanes, Memory, Pruning};

#[test]
fn pairs_of_bodies() {
    let mut random = Random(11);
    let mut compared = Compared::default();
    let names =
        [["l_bracket", "cube"], ["torus_quads", "tetra"], ["tetra", "l_bracket"], ["beam", "torus_quads"]];
    let relations = RELATIONS.into_iter().filter(|r| !matches!(r, Relation::Apart | Relation::Far));
    for (k, names) in names.into_iter().enumerate() {
        // Half of the relations: these tests take minutes where a processor stands in for the
        // device.
        for relation in relations.clone().skip(k % 2).step_by(2) {
            let bodies: [Placed; 2] = relation.place(names, &mut random);
            let size = bodies[0].diagonal().max(bodies[1].diagonal());
            for options in each_mode(size) {
                compared.add(hold(&scene(&bodies), &options, size));
            }
        }
    }
    compared.is_good(1500);
}

/// Some meshes of the data in random poses. `TESDF_TEST_PAIRS` sets the number of pairs.
#[test]
fn data_meshes_in_random_poses() {
    let pairs = std::env::var("TESDF_TEST_PAIRS").map_or(2, |n| n.parse().expect("a number of pairs"));
    let solid = |row: &meshes::Row| row.solid().is_ok_and(|s| s.mesh().faces().len() <= 8000);
    let names: Vec<String> = meshes::manifest().into_iter().filter(solid).map(|row| row.name).collect();
    let mut random = Random(41);
    let mut compared = Compared::default();
    for _ in 0..pairs {
        let names = [0, 1].map(|_| names[random.index(names.len())].as_str());
        let relation = [Relation::Touching, Relation::Deep][random.index(2)];
        let bodies: [Placed; 2] = relation.place(names, &mut random);
        let size = bodies[0].diagonal().max(bodies[1].diagonal());
        let [node, _, face, ..] = each_mode(size);
        for options in [node, face] {
            let one = hold(&scene(&bodies), &options, size);
            println!("{names:?} {relation:?} {:?}: {one:?}", options.mode);
            compared.add(one);
        }
    }
    compared.is_good(pairs);
}

#[test]
fn a_nut_on_its_bolt() {
    let mut random = Random(5);
    let bolt = Placed::around("iso_m16_bolt_6k", rotation(&mut random), 1.0, 3.0 * random.direction());
    let nut = Placed { body: body("iso_m16_nut_c25"), at: bolt.at };
    let size = bolt.diagonal();
    for mode in [Mode::Node, Mode::exact()] {
        let options = CollideOptions { contact_distance: 2e-5, ..per_cell(mode.filtered(0.3)) };
        let nut = nut.moved(Pose::at(2e-5 * random.direction()));
        hold(&scene(&[bolt.clone(), nut]), &options, size).is_good(50);
    }
}

#[test]
fn simple_shapes_meet_meshes_and_each_other() {
    let mut random = Random(23);
    let shapes = [
        Shape::Mesh(body("l_bracket").asset.clone()),
        Shape::Mesh(body("torus_quads").asset.clone()),
        Shape::Box { half_extents: DVec3::new(0.05, 0.08, 0.03) },
        Shape::Sphere { radius: 0.05 },
        Shape::Capsule { half_height: 0.06, radius: 0.03 },
        Shape::Cylinder { half_height: 0.04, radius: 0.05 },
        Shape::Plane,
    ];
    let size = shapes[0].diagonal().max(shapes[1].diagonal());
    let mut compared = Compared::default();
    for world in 0..3 {
        let mut scene = Scene::new();
        for shape in &shapes {
            let id = scene.add_shape(shape.clone()).expect("a shape");
            let scale = size / 2.0 / shape.diagonal().min(1e3 * size).max(size / 4.0);
            let scale = if matches!(shape, Shape::Plane) { 1.0 } else { scale };
            let pose = Pose { translation: 0.3 * size * random.in_cube(), rotation: rotation(&mut random) };
            let instance = Instance { scale, world, ..Instance::new(id, pose) };
            scene.add(instance).expect("an instance");
        }
        for options in each_mode(size) {
            compared.add(hold(&scene, &options, 2.0 * size));
        }
    }
    compared.is_good(5000);
}

/// Bodies that fall and turn together by half their size, and move by a hundredth relative to each
/// other, find the same contacts within the distances that their relative motions can close.
#[test]
fn moving_bodies_look_ahead() {
    let mut random = Random(29);
    let shapes = [
        Shape::Mesh(body("l_bracket").asset.clone()),
        Shape::Mesh(body("cube").asset.clone()),
        Shape::Box { half_extents: DVec3::new(0.05, 0.08, 0.03) },
        Shape::Capsule { half_height: 0.06, radius: 0.03 },
        Shape::Plane,
    ];
    let size = shapes[0].diagonal();
    let (fall, turn) = (0.5 * size * random.direction(), 0.5 * random.direction());
    let mut scene = Scene::new();
    for world in 0..2 {
        for (k, shape) in shapes.iter().cycle().take(8).enumerate() {
            let is_plane = matches!(shape, Shape::Plane);
            let id = scene.add_shape(shape.clone()).expect("a shape");
            let scale = if is_plane { 1.0 } else { size / shape.diagonal() };
            // Far from the origin, where `f32` alone would round poses by more than the motion.
            let translation = DVec3::splat(100.0 * size * f64::from(world))
                + if is_plane { -0.6 * size * DVec3::Z } else { 0.6 * size * random.in_cube() };
            let rotation = if is_plane { tesdf::glam::DQuat::IDENTITY } else { rotation(&mut random) };
            let around = translation - DVec3::splat(100.0 * size * f64::from(world));
            let own = 0.01 * size * random.in_cube();
            let velocity = match k {
                5 => Velocity::default(),
                _ if is_plane => Velocity { linear: fall + own, angular: DVec3::ZERO },
                _ => Velocity {
                    linear: fall + turn.cross(around) + own,
                    angular: turn + 0.02 * random.in_cube(),
                },
            };
            let pose = Pose { translation, rotation };
            scene.add(Instance { scale, world, velocity, ..Instance::new(id, pose) }).expect("an instance");
        }
    }
    let mut compared = Compared::default();
    for options in each_mode(size).into_iter().step_by(4) {
        let options = CollideOptions { speculative_time: 0.7, ..options };
        compared.add(hold(&scene, &options, 2.0 * size));
        let (all, _) = found(&scene, &options, DetectorOptions::default());
        let by_host = DetectorOptions { max_pair_tests: 0, ..DetectorOptions::default() };
        assert_eq!(all.as_slice(), found(&scene, &options, by_host).0.as_slice());
    }
    compared.is_good(5000);
    let pairs = instance_pairs(&scene, 0.0, 0.7).expect("pairs");
    let widest = pairs.iter().map(|p| p.contact_distance).fold(0.0, f64::max);
    let narrow = pairs.iter().filter(|p| p.contact_distance < 0.2 * widest).count();
    assert!(narrow > 10 && narrow < pairs.len(), "{narrow} of {}", pairs.len());
}

/// Lists of at most 32 faces: both sides return the distance to the listed faces, which may differ
/// from that to the mesh.
#[test]
fn truncated_lists() {
    let solid = meshes::manifest()
        .into_iter()
        .find(|r| r.name == "torus_quads")
        .expect("a row")
        .solid()
        .expect("solid");
    let options = EncodeOptions { max_entries: Some(8), ..EncodeOptions::preset(Preset::Fast) };
    let asset: TeSdf = Encoder::new().options(options).encode(&solid).expect("encodes");
    let truncated = Arc::new(Body { solid, asset: Arc::new(asset) });
    let mut random = Random(31);
    for _ in 0..3 {
        let mut bodies: [Placed; 2] = Relation::Deep.place(["torus_quads", "cube"], &mut random);
        bodies[0].body = truncated.clone();
        let size = bodies[0].diagonal().max(bodies[1].diagonal());
        let scene = scene(&bodies);
        // Searches over whole faces measure to the surface instead.
        for options in &each_mode(size)[..4] {
            let host = detect(&scene, options).expect("a good scene");
            let (device, _) = found(&scene, options, DetectorOptions::default());
            let (on_host, on_device) = (least(host.as_slice()), least(device.as_slice()));
            let same = on_host.keys().filter(|k| on_device.contains_key(k)).count();
            let all = on_host.len().max(on_device.len());
            assert!(all - same <= 2 + all / 50, "{same} of {all} parts");
            assert!(all > 20);
        }
    }
}

fn worlds(count: u32, random: &mut Random) -> Scene {
    let (bracket, cube) = (body("l_bracket"), body("cube"));
    let mut scene = Scene::new();
    let shapes = [bracket, cube].map(|b| scene.add_shape(Shape::Mesh(b.asset.clone())).expect("a shape"));
    for world in 0..count {
        let bodies: [Placed; 2] = Relation::Deep.place(["l_bracket", "cube"], random);
        for (shape, placed) in shapes.into_iter().zip(bodies) {
            let instance = Instance { world, scale: placed.at.scale, ..Instance::new(shape, placed.at.pose) };
            scene.add(instance).expect("an instance");
        }
    }
    scene
}

#[test]
fn worlds_change_neither_each_other_nor_the_number_of_launches() {
    let mut random = Random(17);
    let scene = worlds(3, &mut random);
    for (mode, contacts_per) in [
        (Mode::Node, ContactsPer::Cell),
        (Mode::face(), ContactsPer::Cell),
        (Mode::exact(), ContactsPer::Face),
    ] {
        let options =
            CollideOptions { contact_distance: 1e-3, ..CollideOptions::with_mode(mode.per(contacts_per)) };
        let (all, mut detector) = found(&scene, &options, DetectorOptions::default());
        let launches = detector.report().launches;
        let again = detector.detect(&scene, &options).expect("detects");
        assert_eq!(all.as_slice(), again.as_slice(), "two runs differ");
        let mut rest = all.as_slice();
        for world in 0..3u32 {
            let mut alone = Scene::new();
            for id in [2 * world, 2 * world + 1] {
                let instance = *scene.instance(InstanceId(id)).expect("it is there");
                let shape = scene.shape(instance.shape).expect("it is there").clone();
                let shape = alone.add_shape(shape).expect("a shape");
                alone.add(Instance { shape, world: 0, ..instance }).expect("an instance");
            }
            let (own, one) = found(&alone, &options, DetectorOptions::default());
            assert_eq!(one.report().launches, launches);
            let (these, others) = rest.split_at(own.len());
            for (x, y) in these.iter().zip(&own) {
                let (a, b) = (y.instance_a.0 + 2 * world, y.instance_b.0 + 2 * world);
                let names = (InstanceId(a), InstanceId(b), y.feature, y.face_a, y.face_b, y.tet_b);
                assert_eq!((x.instance_a, x.instance_b, x.feature, x.face_a, x.face_b, x.tet_b), names);
                // A scene normalizes quaternions, and normalizes them again when the instance is
                // added again.
                assert!(x.point_a.distance(y.point_a) < 1e-7 && (x.distance - y.distance).abs() < 1e-8);
            }
            rest = others;
        }
        assert!(rest.is_empty());
    }
}

#[test]
fn groups_and_exclusions() {
    let mut random = Random(2);
    let mut scene = worlds(1, &mut random);
    let options = CollideOptions::with_mode(Mode::Node);
    let count = |scene: &Scene| found(scene, &options, DetectorOptions::default()).0.len();
    let all = count(&scene);
    assert!(all > 0);
    scene.exclude(InstanceId(0), InstanceId(1)).expect("they are there");
    assert_eq!(count(&scene), 0);
    scene.include(InstanceId(0), InstanceId(1));
    assert_eq!(count(&scene), all);
    let instance = *scene.instance(InstanceId(1)).expect("it is there");
    let groups = Groups { memberships: 2, filter: 2 };
    scene.update(&[(InstanceId(1), Instance { groups, ..instance })]).expect("it is there");
    assert_eq!(count(&scene), all, "the other one is in all groups");
    let instance = *scene.instance(InstanceId(0)).expect("it is there");
    let groups = Groups { memberships: 1, filter: 1 };
    scene.update(&[(InstanceId(0), Instance { groups, ..instance })]).expect("it is there");
    assert_eq!(count(&scene), 0);
}

/// Two instances that are marked as still are no pair, whichever side finds the pairs.
#[test]
fn still_instances_meet_only_moving_ones() {
    let mut scene = Scene::new();
    let block = scene.add_shape(Shape::Box { half_extents: DVec3::splat(0.5) }).expect("a shape");
    let at = |k: u32| Instance::new(block, Pose::at(0.9 * f64::from(k) * DVec3::X));
    let ids: Vec<InstanceId> = (0..4).map(|k| scene.add(at(k)).expect("an instance")).collect();
    let options = CollideOptions::with_mode(Mode::Node);
    for still in [vec![], vec![0, 1], vec![0, 1, 2, 3], vec![1, 3], vec![1, 2, 3]] {
        scene.set_still(still.iter().map(|&k: &usize| ids[k]));
        let pairs = instance_pairs(&scene, options.contact_distance, 0.0).expect("pairs").len();
        for max_pair_tests in [DetectorOptions::default().max_pair_tests, 0] {
            let with = DetectorOptions { max_pair_tests, ..DetectorOptions::default() };
            let (contacts, detector) = found(&scene, &options, with);
            let counts = detector.report().counts;
            assert_eq!(counts.ordered_pairs as usize, 2 * pairs, "{still:?} are still");
            let expected = detect(&scene, &options).expect("detects");
            assert_eq!(contacts.len(), expected.len(), "{still:?} are still");
        }
    }
}

#[test]
fn buffers_grow_or_say_what_they_need() {
    let mut random = Random(4);
    let scene = worlds(6, &mut random);
    let options = CollideOptions { contact_distance: 1e-3, ..per_cell(Mode::face()) };
    let (expected, _) = found(&scene, &options, DetectorOptions::default());
    let capacities =
        Capacities { ordered_pairs: 1, blocks: 1, meshlets: 1, polygons: 1, contacts: 1, kept: 1 };
    let little = DetectorOptions { capacities, ..DetectorOptions::default() };
    let (grown, detector) = found(&scene, &options, little);
    assert_eq!(grown.as_slice(), expected.as_slice());
    assert!(detector.report().passes > 1);
    let capacities = Capacities { contacts: 10, ..Capacities::default() };
    let fixed = DetectorOptions { capacities, memory: Memory::Fixed, ..DetectorOptions::default() };
    let mut detector = Detector::new(&device(), &scene, fixed).expect("fits");
    let error = detector.detect(&scene, &options).expect_err("too little");
    let GpuError::Full { buffer: "contacts", capacity: 10, needed, .. } = error else { panic!("{error}") };
    assert_eq!(needed as usize, expected.len());
}

/// The contacts do not depend on the number of threads, on the way in which they exchange values,
/// on pruning, or on the side that finds the pairs.
#[test]
fn every_variant_of_the_narrow_phase_gives_the_same_contacts() {
    let mut random = Random(6);
    let scene = worlds(3, &mut random);
    let options = CollideOptions { contact_distance: 1e-3, ..per_cell(Mode::face()) };
    let (expected, _) = found(&scene, &options, DetectorOptions::default());
    let usual = DetectorOptions::default();
    for with in [
        DetectorOptions { lanes: Lanes::Single, ..usual },
        DetectorOptions { exchange: Exchange::Shared, ..usual },
        DetectorOptions { pruning: Pruning::Bounds, ..usual },
        DetectorOptions { max_pair_tests: 0, ..usual },
    ] {
        let (other, _) = found(&scene, &options, with);
        let lost = |x: &Contacts, y: &Contacts| {
            let missing = x.iter().filter(|c| !y.as_slice().contains(c));
            missing.copied().collect::<Vec<Contact>>()
        };
        assert_eq!(lost(&expected, &other), [], "{with:?} loses contacts");
        assert_eq!(lost(&other, &expected), [], "only {with:?} finds contacts");
    }
}

#[test]
fn scenes_without_contacts_are_no_errors() {
    let mut random = Random(1);
    let scene = worlds(1, &mut random);
    let mut detector = Detector::new(&device(), &scene, DetectorOptions::default()).expect("fits");
    let contacts = detector.detect(&Scene::new(), &CollideOptions::default()).expect("nothing to do");
    assert!(contacts.is_empty());
    let options = CollideOptions { contact_distance: f64::NAN, ..CollideOptions::default() };
    let error = detector.detect(&scene, &options).expect_err("no distance");
    assert!(error.to_string().starts_with("contact_distance is NaN"), "{error}");
}
