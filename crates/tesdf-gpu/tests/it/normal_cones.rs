//! Normals of contacts are in the normal cones of both bodies: of contacts that are read from the
//! device, and of those that stay there.
use crate::compare::{ROUNDING, device, found, per_cell};
use crate::degenerate::{encoded, solids};
use crate::on_device::{self, are_equal, detector, read, staying};
use crate::support::blocks::{
    Known, edges_are_pushed_along_the_normal_of_the_floor, normals_are_in_the_cones_where_these_meet,
    touching,
};
use crate::support::bodies::{Relation, rotation};
use crate::support::flush::Flush;
use crate::support::random::Random;
use tesdf::collide::{CollideOptions, Contact, ContactsPer, Instance, Mode, Placement, Pose, Scene, Shape};
use tesdf::glam::{DQuat, DVec3};
use tesdf_gpu::DetectorOptions;

/// The faces of vertices are uploaded for the first contacts of faces that stay on the device.
#[test]
fn faces_of_vertices_are_uploaded_when_they_are_needed() {
    let scene = on_device::worlds(1, &mut Random(12));
    let mut detector = detector(&scene);
    let of = |mode| CollideOptions { contact_distance: 0.01, ..per_cell(mode) };
    detector.detect(&scene, &of(Mode::exact())).expect("detects");
    detector.detect_on_device(&scene, None, &of(Mode::Node)).expect("detects");
    let before = detector.bytes();
    assert_eq!(before.shapes.fans, 0);
    detector.detect_on_device(&scene, None, &of(Mode::exact())).expect("detects");
    let after = detector.bytes();
    assert!(after.shapes.fans > 0 && after.with_instances(3) == before.with_instances(3) + after.shapes.fans);
}

/// From the rounding of `f32` on.
const GAPS: [f64; 7] = [0.0, 1e-6, -1e-6, 1e-5, -1e-5, 5e-5, -5e-5];

/// What kernels find, and leave there.
const ON_DEVICE: [(Mode, ContactsPer); 3] = [
    (Mode::exact(), ContactsPer::Cell),
    (Mode::exact(), ContactsPer::Face),
    (Mode::face(), ContactsPer::Cell),
];

/// The diagonal of the floor is 3.
const KNOWN: Known = Known { near: 3.0 * ROUNDING, tolerance: 3.0 * ROUNDING, direction: 1e-6 };

#[test]
fn edges_are_pushed_along_the_normal_of_the_floor_in_each_mode() {
    let detect = |scene: &Scene, options: &CollideOptions| {
        found(scene, options, DetectorOptions::default()).0.into_vec()
    };
    let known = Known { direction: 1e-9, ..KNOWN };
    let kinds = [&ON_DEVICE[..], &[(Mode::exact(), ContactsPer::Minimum)]].concat();
    edges_are_pushed_along_the_normal_of_the_floor(&detect, &kinds, known);
}

#[test]
fn edges_are_pushed_along_the_normal_of_the_floor_on_the_device() {
    edges_are_pushed_along_the_normal_of_the_floor(&staying, &ON_DEVICE, KNOWN);
}

#[test]
fn normals_are_in_the_cones_where_these_meet_in_both_places() {
    let read = |scene: &Scene, options: &CollideOptions| {
        found(scene, options, DetectorOptions::default()).0.into_vec()
    };
    // The smallest of the larger diagonals is 0.7.
    let (gaps, on_side) = ([0.0, 1e-7, -1e-7], 0.5 * ROUNDING);
    normals_are_in_the_cones_where_these_meet(&read, &gaps, on_side);
    normals_are_in_the_cones_where_these_meet(&staying, &gaps, on_side);
}

/// Whether a normal is not the gradient at the point of *a*. Only fields of meshes are asked.
fn is_turned(scene: &Scene, c: &Contact) -> bool {
    let b = scene.instance(c.instance_b).expect("it is there");
    let at = b.placement();
    let p = at.to_shape(c.point_a);
    match scene.shape(b.shape).expect("it is there") {
        Shape::Mesh(asset) => (at.pose.rotation * asset.query_by_tree(p).gradient).distance(c.normal) > 1e-3,
        _ => false,
    }
}

/// Contacts per cell that stay on the device have the normals of those that are read, which the
/// processor turns. At least `turned` of them are no gradients.
fn hold(scene: &Scene, contact_distance: f64, turned: usize) {
    let mut detector = detector(scene);
    let mut seen = 0;
    for mode in [Mode::exact(), Mode::face()] {
        let options =
            CollideOptions { contact_distance, ..CollideOptions::with_mode(mode.per(ContactsPer::Cell)) };
        let expected = detector.detect(scene, &options).expect("detects");
        seen += expected.iter().filter(|c| is_turned(scene, c)).count();
        let staying = detector.detect_on_device(scene, None, &options).expect("detects");
        are_equal(&read(&device(), &staying), expected.as_slice(), 2.0, 1e-6);
    }
    println!("{seen} normals are no gradients");
    assert!(seen >= turned, "{seen} normals are no gradients");
}

/// A scene with a world for each pair of bodies.
fn worlds(pairs: impl IntoIterator<Item = [(Shape, Placement); 2]>) -> Scene {
    let mut scene = Scene::new();
    for (world, pair) in (0..).zip(pairs) {
        for (shape, Placement { pose, scale }) in pair {
            let shape = scene.add_shape(shape).expect("a shape");
            scene.add(Instance { world, scale, ..Instance::new(shape, pose) }).expect("a pose");
        }
    }
    scene
}

#[test]
fn flush_prisms_have_the_normals_of_the_processor() {
    let (scene, _) = Flush::scene(&Flush::pairs(140, &GAPS));
    hold(&scene, 1e-4, 50);
}

#[test]
fn boxes_have_the_normals_of_the_processor() {
    let mut random = Random(0xb10c);
    let pairs = (0..140).map(|k| {
        touching(&mut random, GAPS[k % GAPS.len()])
            .map(|block| (block.shape(), Placement { pose: block.pose, scale: 1.0 }))
    });
    hold(&worlds(pairs), 1e-4, 30);
}

/// A ball or a capsule over an edge of a box, a mesh on a plane, and a box on one.
#[test]
fn built_in_shapes_have_the_normals_of_the_processor() {
    let mut random = Random(0x5af3);
    let mut pairs = Vec::new();
    for k in 0..60 {
        let [block, _] = touching(&mut random, 0.0);
        let gap = GAPS[k % GAPS.len()];
        let rounded =
            [Shape::Sphere { radius: 0.3 }, Shape::Capsule { half_height: 0.2, radius: 0.1 }][k % 2].clone();
        let (sizes, flat) = (block.half, DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
        let radius = if k % 2 == 0 { 0.3 } else { 0.1 };
        let beside = DVec3::new(sizes.x - 1e-6 * random.unit(), 0.0, sizes.z + radius + gap);
        let on_it = Pose { translation: beside, rotation: flat };
        let at = |pose: Pose| Placement { pose, scale: 1.0 };
        pairs.push([(block.shape(), at(block.pose)), (rounded, at(block.pose.after(on_it)))]);
        // A box on a face, an edge or a corner.
        let turn = [DQuat::IDENTITY, DQuat::from_rotation_x(0.3), rotation(&mut random)][k % 3];
        let height = (turn.inverse() * DVec3::Z).abs().dot(sizes) + gap;
        let pose = Pose { translation: DVec3::new(0.1, 0.2, height), rotation: turn };
        let plane = Pose { translation: random.in_cube(), rotation: rotation(&mut random) };
        pairs.push([(Shape::Plane, at(plane)), (block.shape(), at(plane.after(pose)))]);
    }
    hold(&worlds(pairs), 1e-4, 40);
}

/// Convex and concave bodies in each relation.
#[test]
fn bodies_have_the_normals_of_the_processor() {
    let mut random = Random(77);
    let mut pairs = Vec::new();
    for names in [["l_bracket", "cube"], ["cube", "tetra"], ["shaft_keyway", "l_bracket"], ["spoon", "cube"]]
    {
        for relation in [
            Relation::Touching,
            Relation::JustTouching,
            Relation::Deep,
            Relation::Same,
            Relation::Inside,
            Relation::SharedFaces,
        ] {
            let placed = relation.place(names, &mut random);
            let size = placed[0].diagonal().max(placed[1].diagonal());
            pairs.push(placed.map(|placed| {
                let Placement { pose: Pose { translation, rotation }, scale } = placed.at;
                let pose = Pose { translation: translation / size, rotation };
                (Shape::Mesh(placed.body.asset.clone()), Placement { pose, scale: scale / size })
            }));
        }
    }
    hold(&worlds(pairs), 1e-3, 500);
}

/// Needles, and faces whose corners coincide.
#[test]
fn degenerate_bodies_have_the_normals_of_the_processor() {
    let mut random = Random(0xdead);
    let bodies: Vec<Shape> = solids().iter().map(|(_, solid)| Shape::from(encoded(solid))).collect();
    let pairs = bodies.iter().map(|shape| {
        let (scale, center) = (1.0 / shape.diagonal(), shape.bounds().center());
        let rotation = rotation(&mut random);
        let at = |rotation: DQuat, to: DVec3| Placement {
            pose: Pose { translation: to - rotation * (scale * center), rotation },
            scale,
        };
        // Just overlapping, and flush.
        let to = 0.55 * random.direction();
        let turned = [rotation, DQuat::IDENTITY][random.index(2)];
        [(shape.clone(), at(DQuat::IDENTITY, DVec3::ZERO)), (shape.clone(), at(turned, to))]
    });
    hold(&worlds(pairs), 1e-3, 30);
}
