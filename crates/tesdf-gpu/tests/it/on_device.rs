//! Contacts that stay on the device, and poses that come from arrays there.

use std::collections::BTreeMap;

use crate::compare::device;
use crate::support::bodies::{Relation, body, rotation};
use crate::support::parts::Parts;
use crate::support::parts::Turn::Outward;
use crate::support::random::Random;
use tesdf::base::InsideRule;
use tesdf::collide::{
    CollideOptions, Contact, ContactsPer, FeatureB, FeatureId, Instance, InstanceId, Mode, Pose, Reduction,
    Scene, Shape, Velocity,
};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3, Vec3};
use tesdf::mesh::SolidMesh;
use tesdf_gpu::{Detector, DetectorOptions, Device, DeviceArray, DeviceContacts, GpuError, PoseArrays};

pub fn detector(scene: &Scene) -> Detector {
    Detector::new(&device(), scene, DetectorOptions::default()).expect("fits")
}

/// A bracket, a cube and a box in each world. The box meets the cube.
pub fn worlds(count: u32, random: &mut Random) -> Scene {
    let mut scene = Scene::new();
    let meshes = ["l_bracket", "cube"]
        .map(|name| scene.add_shape(Shape::Mesh(body(name).asset.clone())).expect("a shape"));
    let slab = scene.add_shape(Shape::Box { half_extents: DVec3::new(0.5, 0.5, 0.1) }).expect("a shape");
    for world in 0..count {
        let [a, b] = Relation::Deep.place(["l_bracket", "cube"], random);
        let slab_at = Pose { translation: b.at.pose.translation, rotation: rotation(random) };
        let placed =
            [(meshes[0], a.at.pose, a.at.scale), (meshes[1], b.at.pose, b.at.scale), (slab, slab_at, 0.5)];
        for (shape, pose, scale) in placed {
            let velocity = Velocity { linear: 0.01 * random.in_cube(), angular: 0.01 * random.in_cube() };
            let instance = Instance { world, scale, velocity, ..Instance::new(shape, pose) };
            scene.add(instance).expect("an instance");
        }
    }
    scene
}

/// A contact: instances, both points, normal, distance.
pub type Row = ((u32, u32), [DVec3; 3], f64);

pub fn read(device: &Device, found: &DeviceContacts) -> Vec<Row> {
    let vectors = |array: &DeviceArray<f32>| -> Vec<DVec3> {
        let numbers = array.read(device).expect("numbers");
        assert_eq!(numbers.len(), 3 * found.count);
        numbers.chunks_exact(3).map(|v| Vec3::from_slice(v).as_dvec3()).collect()
    };
    let (a, b, n) = (vectors(&found.points_a), vectors(&found.points_b), vectors(&found.normals));
    let distances = found.distances.read(device).expect("numbers");
    let ids = found.instances.read(device).expect("numbers");
    assert_eq!((distances.len(), ids.len()), (found.count, 2 * found.count));
    (0..found.count)
        .map(|k| ((ids[2 * k], ids[2 * k + 1]), [a[k], b[k], n[k]], f64::from(distances[k])))
        .collect()
}

/// The contacts of a scene that stay on the device. All of each face, which the device only
/// reduces.
pub fn staying(scene: &Scene, options: &CollideOptions) -> Vec<Contact> {
    let reduction = match options.mode.contacts_per() {
        Some(ContactsPer::Cell) | None => Reduction::None,
        Some(ContactsPer::Face | ContactsPer::Minimum) => Reduction::PerPair(10_000),
    };
    let options = CollideOptions { reduction, ..*options };
    let found = detector(scene).detect_on_device(scene, None, &options).expect("detects");
    let of_row = |((a, b), [point_a, point_b, normal], distance): Row| Contact {
        point_a,
        point_b,
        distance,
        normal,
        face_a: 0,
        face_b: 0,
        tet_b: None,
        instance_a: InstanceId(a),
        instance_b: InstanceId(b),
        feature: FeatureId { a: 0, b: FeatureB::Face(0) },
        converged: true,
    };
    read(&device(), &found).into_iter().map(of_row).collect()
}

fn of_host(c: &Contact) -> Row {
    ((c.instance_a.0, c.instance_b.0), [c.point_a, c.point_b, c.normal], c.distance)
}

/// Normals on the device differ from those of a detection by at most this, the rounding of `f32`.
pub const TURNED: f64 = 2e-5;

/// Largest share of other normals: a place or a direction is as far from a feature as the limit is,
/// up to the rounding of `f32`.
const MOST_OTHERS: f64 = 0.001;

/// Each contact has its partner, and pairs come in the same order. `size` bounds coordinates.
pub fn are_equal(found: &[Row], expected: &[Contact], size: f64, bound: f64) {
    assert_eq!(found.len(), expected.len());
    let expected: Vec<Row> = expected.iter().map(of_host).collect();
    let pairs = |rows: &[Row]| rows.iter().map(|row| row.0).collect::<Vec<_>>();
    assert_eq!(pairs(found), pairs(&expected), "the order of pairs");
    let mut by_pair: BTreeMap<(u32, u32), Vec<&Row>> = BTreeMap::new();
    found.iter().for_each(|row| by_pair.entry(row.0).or_default().push(row));
    let mut others = 0;
    for (pair, [a, b, n], distance) in &expected {
        let rows = by_pair.get_mut(pair).expect("a pair");
        let is_partner = |row: &Row| {
            row.1[0].distance(*a) <= bound * size
                && row.1[1].distance(*b) <= bound * size
                && (row.2 - distance).abs() <= bound * size
        };
        // Several contacts may be at one place.
        let off = |row: &Row| row.1[2].distance(*n);
        let far = |row: &Row| off(row) * size + row.1[0].distance(*a) + row.1[1].distance(*b);
        let all = rows.iter().enumerate().filter(|(_, row)| is_partner(row));
        let partner = all.min_by(|x, y| far(x.1).total_cmp(&far(y.1)));
        let (at, row) = partner.unwrap_or_else(|| panic!("no contact of {pair:?} at {a} with {distance}"));
        assert!((row.1[2].length() - 1.0).abs() < 1e-5, "{row:?}");
        others += usize::from(off(row) > TURNED);
        rows.swap_remove(at);
    }
    println!("{others} of {} normals are others", found.len());
    let most = 2.0 + MOST_OTHERS * found.len() as f64;
    assert!(others as f64 <= most, "{others} of {} normals are others", found.len());
}

/// At most `most` contacts of each pair of instances, each at the place of one of all contacts, and
/// the deepest of them.
pub fn are_among(found: &[Row], all: &[Contact], size: f64, bound: f64, most: usize) {
    let all: Vec<Row> = all.iter().map(of_host).collect();
    let pair = |row: &Row| (row.0.0.min(row.0.1), row.0.0.max(row.0.1));
    let by_pair = |rows: &[Row]| {
        let mut pairs: BTreeMap<(u32, u32), Vec<Row>> = BTreeMap::new();
        rows.iter().for_each(|row| pairs.entry(pair(row)).or_default().push(*row));
        pairs
    };
    let (found, all) = (by_pair(found), by_pair(&all));
    assert!(found.keys().eq(all.keys()), "pairs that touch");
    for (own, all) in found.values().zip(all.values()) {
        assert!(own.len() <= most);
        let is_one = |row: &&Row| {
            let is_same = |other: &Row| {
                row.0 == other.0
                    && (0..2).all(|k| row.1[k].distance(other.1[k]) <= bound * size)
                    && (row.2 - other.2).abs() <= bound * size
            };
            all.iter().any(is_same)
        };
        assert_eq!(own.iter().find(|row| !is_one(row)), None, "a contact that is none");
        let deepest = |rows: &[Row]| rows.iter().map(|row| row.2).fold(f64::INFINITY, f64::min);
        assert!(deepest(own) <= deepest(all) + bound * size);
    }
}

pub fn each_form() -> Vec<CollideOptions> {
    let of = |mode: Mode, contacts_per, reduction| CollideOptions {
        contact_distance: 0.01,
        reduction,
        ..CollideOptions::with_mode(mode.per(contacts_per))
    };
    vec![
        of(Mode::Node, ContactsPer::Face, Reduction::None),
        of(Mode::face(), ContactsPer::Cell, Reduction::None),
        of(Mode::exact(), ContactsPer::Cell, Reduction::None),
        of(Mode::exact(), ContactsPer::Face, Reduction::PerPair(12)),
        of(Mode::Node, ContactsPer::Face, Reduction::Spread(5)),
    ]
}

#[test]
fn contacts_on_the_device_are_those_of_a_detection() {
    let scene = worlds(3, &mut Random(5));
    let mut detector = detector(&scene);
    let device = detector.device().clone();
    for options in each_form() {
        let found = detector.detect_on_device(&scene, None, &options).expect("detects");
        let rows = read(&device, &found);
        assert!(rows.len() > 30, "{} contacts", rows.len());
        match options.reduction {
            // The processor reduces contacts of faces that it reads, with its own normals.
            Reduction::PerPair(most) if options.mode != Mode::Node => {
                let options = CollideOptions { reduction: Reduction::None, ..options };
                let all = detector.detect(&scene, &options).expect("detects");
                are_among(&rows, all.as_slice(), 2.0, 1e-6, most as usize);
            }
            // The same numbers, rounded in the world.
            _ => {
                let expected = detector.detect(&scene, &options).expect("detects");
                are_equal(&rows, expected.as_slice(), 2.0, 1e-6);
            }
        }
        let again = detector.detect_on_device(&scene, None, &options).expect("detects");
        assert_eq!(read(&device, &again), rows, "two runs differ");
    }
}

/// The order is that of the host also within a pair: shapes without a mesh have the order of their
/// faces on both sides.
#[test]
fn contacts_have_the_order_of_a_detection() {
    let mut random = Random(6);
    let mut scene = Scene::new();
    for world in 0..40 {
        for k in 0..2 {
            let half_extents = 0.3 * DVec3::ONE + 0.2 * random.in_cube();
            let shape = scene.add_shape(Shape::Box { half_extents }).expect("a shape");
            let pose =
                Pose { translation: f64::from(k) * 0.2 * random.in_cube(), rotation: rotation(&mut random) };
            // Ids do not have the order of worlds.
            scene.add(Instance { world: 40 - world, ..Instance::new(shape, pose) }).expect("an instance");
        }
    }
    let mut detector = detector(&scene);
    let options = CollideOptions::with_mode(Mode::exact().per(ContactsPer::Cell));
    let expected = detector.detect(&scene, &options).expect("detects");
    let found = detector.detect_on_device(&scene, None, &options).expect("detects");
    let rows = read(detector.device(), &found);
    assert!(rows.len() > 500 && !rows.len().is_power_of_two(), "{} contacts", rows.len());
    assert_eq!(rows.len(), expected.len());
    for (row, contact) in rows.iter().zip(&expected) {
        let (pair, [a, ..], distance) = of_host(contact);
        assert!(row.0 == pair && row.1[0].distance(a) < 1e-6 && (row.2 - distance).abs() < 1e-6);
    }
}

/// Poses and velocities of a scene as arrays, in the order of ids.
fn arrays(device: &Device, scene: &Scene) -> (DeviceArray<f32>, DeviceArray<f32>) {
    let mut poses = Vec::new();
    let mut velocities = Vec::new();
    for (_, instance) in scene.instances() {
        let Pose { translation, rotation } = instance.pose;
        poses.extend(translation.as_vec3().to_array());
        poses.extend(rotation.as_quat().to_array());
        let Velocity { linear, angular } = instance.velocity;
        velocities.extend([linear, angular].iter().flat_map(|v| v.as_vec3().to_array()));
    }
    let upload = |numbers: &[f32]| DeviceArray::upload(device, numbers).expect("fits");
    (upload(&poses), upload(&velocities))
}

/// The scene with all bodies at the origin, and at rest.
fn elsewhere(scene: &Scene) -> Scene {
    let mut moved = scene.clone();
    let updates: Vec<(InstanceId, Instance)> = scene
        .instances()
        .map(|(id, &i)| (id, Instance { pose: Pose::IDENTITY, velocity: Velocity::default(), ..i }))
        .collect();
    moved.update(&updates).expect("poses");
    moved
}

#[test]
fn poses_come_from_arrays() {
    let mut random = Random(7);
    let mut scene = worlds(2, &mut random);
    // Ids that do not have the order of worlds, and one that is missing.
    let plane = scene.add_shape(Shape::Plane).expect("a shape");
    for world in [1, 0] {
        let pose = Pose { translation: DVec3::new(0.0, 0.0, -0.1), rotation: rotation(&mut random) };
        scene.add(Instance { world, ..Instance::new(plane, pose) }).expect("an instance");
    }
    scene.remove(&[InstanceId(0)]).expect("it is there");
    let stale = elsewhere(&scene);
    let mut detector = detector(&scene);
    let device = detector.device().clone();
    let (poses, velocities) = arrays(&device, &scene);
    let given = PoseArrays { poses: &poses, velocities: Some(&velocities) };
    let ahead = |speculative_time| CollideOptions {
        contact_distance: 0.01,
        speculative_time,
        ..CollideOptions::with_mode(Mode::Node)
    };
    let mut counts = Vec::new();
    for options in [ahead(0.0), ahead(2.0)] {
        let expected = detector.detect(&scene, &options).expect("detects");
        let found = detector.detect_on_device(&stale, Some(&given), &options).expect("detects");
        let rows = read(&device, &found);
        // Contacts at the contact distance itself may be on one side only.
        let near = |rows: &[Row]| rows.iter().filter(|row| row.2 < 0.0099).count();
        let expected_rows: Vec<Row> = expected.iter().map(of_host).collect();
        assert_eq!(near(&rows), near(&expected_rows));
        assert!(rows.len().abs_diff(expected.len()) <= 2, "{} and {} contacts", rows.len(), expected.len());
        let deepest = |rows: &[Row]| rows.iter().map(|row| row.2).fold(0.0, f64::min);
        assert!((deepest(&rows) - deepest(&expected_rows)).abs() < 4e-6);
        counts.push(rows.len());
    }
    assert!(counts[0] > 100 && counts[1] > counts[0], "{counts:?}");
    // Without velocities all are at rest.
    let still = PoseArrays { velocities: None, ..given };
    let found = detector.detect_on_device(&stale, Some(&still), &ahead(2.0)).expect("detects");
    assert_eq!(found.count, counts[0]);
}

/// An open mesh and overlapping solids under `odd` in each world, among bodies that kernels detect.
fn worlds_with_rules(random: &mut Random) -> Scene {
    let mut scene = worlds(2, random);
    let middles: Vec<(u32, DVec3)> =
        scene.instances().step_by(3).map(|(_, i)| (i.world, i.pose.translation)).collect();
    let cube = |parts: Parts, at: f64| parts.cube(DVec3::splat(at), 1.0, Outward);
    let open = Parts::default().open_cube(DVec3::splat(-0.5), 1.0, Outward);
    let overlap = cube(cube(Parts::default(), -0.5), -0.1);
    for (parts, rule) in [(open, InsideRule::Generalized), (overlap, InsideRule::Odd)] {
        let solid = SolidMesh::with_inside(parts.turned().mesh(), rule.into()).expect("a solid");
        let asset = Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes");
        let shape = scene.add_shape(asset).expect("a shape");
        for &(world, middle) in &middles {
            let pose = Pose { translation: middle + 0.5 * random.in_cube(), rotation: rotation(random) };
            let velocity = Velocity { linear: 0.01 * random.in_cube(), angular: 0.01 * random.in_cube() };
            let instance = Instance { world, velocity, ..Instance::new(shape, pose) };
            scene.add(instance).expect("an instance");
        }
    }
    scene
}

/// The scene with poses and velocities that `f32` can hold.
fn rounded(scene: &Scene) -> Scene {
    let mut moved = scene.clone();
    let round = |v: DVec3| v.as_vec3().as_dvec3();
    let rounded = |(id, &i): (InstanceId, &Instance)| {
        let rotation = i.pose.rotation.as_quat().as_dquat().normalize();
        let pose = Pose { translation: round(i.pose.translation), rotation };
        let velocity = Velocity { linear: round(i.velocity.linear), angular: round(i.velocity.angular) };
        (id, Instance { pose, velocity, ..i })
    };
    let updates: Vec<(InstanceId, Instance)> = scene.instances().map(rounded).collect();
    moved.update(&updates).expect("poses");
    moved
}

#[test]
fn contacts_of_the_processor_join_those_of_the_device() {
    let scene = rounded(&worlds_with_rules(&mut Random(9)));
    let mut detector = detector(&scene);
    let device = detector.device().clone();
    let (poses, velocities) = arrays(&device, &scene);
    let given = PoseArrays { poses: &poses, velocities: Some(&velocities) };
    let stale = elsewhere(&scene);
    let forms = each_form();
    let ahead = CollideOptions { speculative_time: 2.0, ..forms[0] };
    for options in [forms[0], ahead, forms[2]] {
        let expected = detector.detect(&scene, &options).expect("detects");
        let found = detector.detect_on_device(&scene, None, &options).expect("detects");
        let pairs = detector.report().pairs_on_processor;
        assert!((10..20).contains(&pairs) && expected.len() > 50, "{pairs} pairs, {}", expected.len());
        let rows = read(&device, &found);
        are_equal(&rows, expected.as_slice(), 2.0, 1e-6);
        assert_eq!(found.hidden, expected.hidden);
        let elsewhere = detector.detect_on_device(&stale, Some(&given), &options).expect("detects");
        assert_eq!(read(&device, &elsewhere), rows);
        assert_eq!(elsewhere.hidden, found.hidden);
    }
    let mut bad = poses.read(&device).expect("numbers");
    bad[7 + 6] += 0.1;
    let bad = DeviceArray::upload(&device, &bad).expect("fits");
    let given = PoseArrays { poses: &bad, velocities: None };
    let error = detector.detect_on_device(&stale, Some(&given), &forms[0]).err().expect("no pose");
    assert!(matches!(error, GpuError::Instance { instance: 1, .. }), "{error}");
}

#[test]
fn overlaps_without_a_contact_are_reported() {
    let mut scene = Scene::new();
    let bar = scene.add_shape(Shape::Box { half_extents: DVec3::new(1.0, 0.2, 0.2) }).expect("a shape");
    scene.add(Instance::new(bar, Pose::IDENTITY)).expect("an instance");
    let across = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    scene.add(Instance::new(bar, Pose { translation: DVec3::ZERO, rotation: across })).expect("an instance");
    let mut detector = detector(&scene);
    let options = CollideOptions::with_mode(Mode::Node);
    let expected = detector.detect(&scene, &options).expect("detects");
    let found = detector.detect_on_device(&scene, None, &options).expect("detects");
    assert_eq!((found.count, &found.hidden), (0, &expected.hidden));
    assert!(found.hidden.len() == 1 && found.hidden[0].depth > 0.1);
    let exact = CollideOptions::with_mode(Mode::exact().per(ContactsPer::Cell));
    let found = detector.detect_on_device(&scene, None, &exact).expect("detects");
    assert!(found.count > 0 && found.hidden.is_empty());
}

/// Only counters are read where no thread has found an overlap that contacts need not show.
#[test]
fn contacts_are_not_read() {
    let mut scene = Scene::new();
    let cube = scene.add_shape(Shape::Box { half_extents: DVec3::ONE }).expect("a shape");
    scene.add(Instance::new(cube, Pose::IDENTITY)).expect("an instance");
    scene.add(Instance::new(cube, Pose::at(DVec3::new(0.1, 0.2, 1.99)))).expect("an instance");
    let mut detector = detector(&scene);
    let options = CollideOptions::with_mode(Mode::Node);
    let found = detector.detect_on_device(&scene, None, &options).expect("detects");
    assert!(found.count >= 2 && detector.report().read < 100, "{} bytes", detector.report().read);
    let read = read(detector.device(), &found);
    assert!(read.iter().all(|row| (row.2 + 0.01).abs() < 1e-6), "{read:?}");
    assert_eq!(detector.detect(&scene, &options).expect("detects").len(), found.count);
    assert!(detector.report().read > 100);
}

#[test]
fn what_is_no_pose_is_an_error() {
    let mut scene = Scene::new();
    let ball = scene.add_shape(Shape::Sphere { radius: 1.0 }).expect("a shape");
    for x in [0.0, 1.5] {
        scene.add(Instance::new(ball, Pose::at(DVec3::new(x, 0.0, 0.0)))).expect("an instance");
    }
    let mut detector = detector(&scene);
    let device = detector.device().clone();
    let options = CollideOptions::with_mode(Mode::Node);
    let mut detect = |poses: &[f32], velocities: Option<&[f32]>| {
        let poses = DeviceArray::upload(&device, poses).expect("fits");
        let velocities = velocities.map(|numbers| DeviceArray::upload(&device, numbers).expect("fits"));
        let given = PoseArrays { poses: &poses, velocities: velocities.as_ref() };
        detector.detect_on_device(&scene, Some(&given), &options).map(|found| found.count)
    };
    let at = |x: f32, w: f32| [x, 0.0, 0.0, 0.0, 0.0, 0.0, w];
    let both = |second: [f32; 7]| [at(0.0, 1.0), second].concat();
    assert_eq!(detect(&both(at(1.5, 1.0)), None).expect("poses"), 2);
    assert_eq!(detect(&both(at(1.5, -1.000_001)), Some(&[0.0; 12])).expect("poses"), 2);
    for (second, text) in [
        (at(1.5, 1.1), "1.1] with the velocity []; expected finite numbers, and a quaternion of length 1"),
        (at(f32::NAN, 1.0), "NaN"),
        (at(1.5, f32::INFINITY), "inf"),
    ] {
        let error = detect(&both(second), None).expect_err("no pose");
        assert!(matches!(error, GpuError::Instance { instance: 1, .. }), "{error}");
        assert!(error.to_string().contains(text), "{error}");
    }
    let mut fast = [0.0; 12];
    fast[0] = f32::NAN;
    let error = detect(&both(at(1.5, 1.0)), Some(&fast)).expect_err("no velocity");
    assert!(matches!(error, GpuError::Instance { instance: 0, .. }), "{error}");
    let error = detect(&[0.0; 7], None).expect_err("one row");
    assert_eq!(error.to_string(), "array \"poses\" has 7 elements; expected 14: 7 for each of 2 instances");
    let error = detect(&both(at(1.5, 1.0)), Some(&[0.0; 6])).expect_err("one row");
    assert_eq!(
        error.to_string(),
        "array \"velocities\" has 6 elements; expected 12: 6 for each of 2 instances"
    );
}

#[test]
fn what_only_the_processor_does_is_an_error() {
    let scene = worlds(1, &mut Random(8));
    let mut detector = detector(&scene);
    let of = |mode: Mode, contacts_per, reduction| CollideOptions {
        reduction,
        ..CollideOptions::with_mode(mode.per(contacts_per))
    };
    for (options, text) in [
        (
            of(Mode::exact(), ContactsPer::Face, Reduction::None),
            "leaving one contact of all faces at a vertex there",
        ),
        (of(Mode::exact(), ContactsPer::Minimum, Reduction::None), "leaving contacts per minimum there"),
    ] {
        let error =
            detector.detect_on_device(&scene, None, &options).map(|found| found.count).expect_err("refused");
        assert!(error.to_string().contains(text), "{error}");
    }
    let empty = Scene::new();
    let found =
        detector.detect_on_device(&empty, None, &CollideOptions::with_mode(Mode::Node)).expect("detects");
    assert_eq!(found.count, 0);
    assert!(read(detector.device(), &found).is_empty());
}
