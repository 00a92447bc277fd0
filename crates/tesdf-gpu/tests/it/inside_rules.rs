//! Assets whose inside is not told by the winding number of their faces: kernels answer queries by
//! each rule, and detect contacts where no field jumps and no face looks inwards. The processor
//! detects the rest.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::compare::{Compared, device, each_mode, hold};
use crate::support::bodies::rotation;
use crate::support::parts::Turn::{Inward, Outward};
use crate::support::parts::{Parts, bowl};
use crate::support::random::Random;
use tesdf::TeSdf;
use tesdf::base::{Inside, InsideRule, SurfaceFaces};
use tesdf::collide::{
    CollideOptions, Contact, Contacts, Instance, InstanceId, Mode, Placement, Pose, Reduction, Scene, Shape,
    ShapeId, detect,
};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf_gpu::{Detector, DetectorOptions, GpuShapes};

fn encode(mesh: TriangleMesh, inside: Inside) -> TeSdf {
    let solid = SolidMesh::with_inside(mesh, inside).expect("a solid");
    Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes")
}

/// Adds instances of shapes to a world of their own.
fn add_world(scene: &mut Scene, world: u32, placed: impl IntoIterator<Item = (ShapeId, Pose)>) {
    for (shape, pose) in placed {
        scene.add(Instance { world, ..Instance::new(shape, pose) }).expect("an instance");
    }
}

/// Instances that kernels detect beside some that they do not: the contacts are those of the two,
/// in the order of all.
#[test]
fn the_processor_detects_fields_that_jump_and_faces_that_look_inwards() {
    let cube = || Parts::default().cube(DVec3::splat(-0.5), 1.0, Outward).turned().mesh();
    let open = Parts::default().open_cube(DVec3::splat(-0.5), 1.0, Outward).mesh();
    let others = [encode(open, InsideRule::Generalized.into()), encode(overlap(), InsideRule::Odd.into())];
    let mut scene = Scene::new();
    let solid = scene.add_shape(encode(cube(), Inside::default())).expect("a shape");
    let mut random = Random(34);
    for other in others {
        let other = scene.add_shape(other).expect("a shape");
        for (world, shapes) in
            [[other, solid, solid], [solid, other, solid], [solid, other, other]].iter().enumerate()
        {
            for (k, shape) in shapes.iter().enumerate() {
                let at = Pose { translation: DVec3::X * (0.8 * k as f64), rotation: rotation(&mut random) };
                let world = world as u32 % 2;
                scene.add(Instance { world, ..Instance::new(*shape, at) }).expect("an instance");
            }
        }
    }
    let mut detector = Detector::new(&device(), &scene, DetectorOptions::default()).expect("uploads");
    for options in [
        CollideOptions::with_mode(Mode::Node),
        CollideOptions::default(),
        CollideOptions { reduction: Reduction::PerPair(4), ..CollideOptions::default() },
    ] {
        let found = detector.detect(&scene, &options).expect("contacts");
        let expected = detect(&scene, &options).expect("contacts");
        let pairs = detector.report().pairs_on_processor;
        let on_processor = |id: InstanceId| {
            let shape = scene.instance(id).expect("an instance").shape;
            shape != solid
        };
        // To the bit where the processor detects.
        let of_processor = |contacts: &Contacts| -> Vec<Contact> {
            let either = |c: &&Contact| on_processor(c.instance_a) || on_processor(c.instance_b);
            contacts.iter().filter(either).copied().collect()
        };
        let (own, others) = (of_processor(&found), of_processor(&expected));
        assert_eq!(own, others);
        assert!(pairs > 5 && own.len() > 20 && found.len() > own.len(), "{pairs} {}", own.len());
        let place = |c: &Contact| {
            let (a, b) = (c.instance_a, c.instance_b);
            (scene.instance(a).expect("an instance").world, a.min(b), a.max(b))
        };
        assert!(found.as_slice().is_sorted_by_key(place));
        let of_pairs = |contacts: &Contacts| -> Vec<[InstanceId; 2]> {
            contacts.reductions.iter().map(|r| [r.instance_a, r.instance_b]).collect()
        };
        assert_eq!(of_pairs(&found), of_pairs(&expected));
    }
}

/// Two cubes that overlap.
fn overlap() -> TriangleMesh {
    Parts::default().cube(DVec3::ZERO, 1.0, Outward).cube(DVec3::splat(0.4), 1.0, Outward).turned().mesh()
}

/// Two solids that overlap, with the boundary of their union as the surface, on others.
#[test]
fn the_boundary_of_overlaps_touches_as_on_the_processor() {
    let boundary = Inside { rule: InsideRule::Winding, surface: SurfaceFaces::Boundary };
    let solid =
        encode(Parts::default().cube(DVec3::splat(-0.5), 1.0, Outward).turned().mesh(), Inside::default());
    let mut scene = Scene::new();
    let ids = [encode(overlap(), boundary), solid].map(|asset| scene.add_shape(asset).expect("a shape"));
    let mut random = Random(33);
    for (world, shape) in (0..4).zip(ids.into_iter().cycle()) {
        let at = Pose { translation: 0.9 * random.direction(), rotation: rotation(&mut random) };
        add_world(&mut scene, world, [(ids[0], Pose::IDENTITY), (shape, at)]);
    }
    // Kernels with rules are compiled for this test alone: the smaller ones.
    let [node, _, _, exact, ..] = each_mode(2.0);
    let mut all = hold(&scene, &node, 2.0);
    all.add(hold(&scene, &exact, 2.0));
    all.is_good(50);
}

/// A bowl and an open cube as sheets, of some 2 in size.
fn sheets() -> [TeSdf; 2] {
    let cube = Parts::default().open_cube(DVec3::splat(-0.6), 1.2, Inward).turned();
    [(bowl(6, 3), 0.1), (cube, 0.04)]
        .map(|(parts, thickness)| encode(parts.mesh(), InsideRule::Sheet { thickness }.into()))
}

/// Sheets on each other, in each other and through each other, and on solids, round shapes and a
/// plane.
#[test]
fn sheets_touch_as_on_the_processor() {
    let [bowl, cube] = sheets().map(Shape::from);
    let solid = Shape::from(encode(
        Parts::default().cube(DVec3::splat(-0.5), 1.0, Outward).turned().mesh(),
        InsideRule::Winding.into(),
    ));
    let others = [
        bowl.clone(),
        cube.clone(),
        solid,
        Shape::Box { half_extents: DVec3::new(0.4, 0.5, 0.6) },
        Shape::Sphere { radius: 0.3 },
        Shape::Capsule { half_height: 0.4, radius: 0.2 },
        Shape::Plane,
    ];
    let mut random = Random(31);
    let (mut scene, mut world) = (Scene::new(), 0);
    for other in others {
        let ids = [&bowl, &cube, &other].map(|shape| scene.add_shape(shape.clone()).expect("a shape"));
        for near in [0.4, 1.03] {
            for sheet in &ids[..2] {
                world += 1;
                let turned = Pose { translation: DVec3::ZERO, rotation: rotation(&mut random) };
                let first = Instance { scale: 1.3, ..Instance::new(*sheet, turned) };
                let at = Pose { translation: near * random.direction(), rotation: rotation(&mut random) };
                for instance in [first, Instance::new(ids[2], at)] {
                    scene.add(Instance { world, ..instance }).expect("an instance");
                }
            }
        }
    }
    let mut all = Compared::default();
    for options in each_mode(2.0) {
        all.add(hold(&scene, &options, 3.0));
    }
    all.is_good(500);
}

/// Sheets that cross each other and a box without a vertex in it.
#[test]
fn hidden_overlaps_of_sheets_are_those_of_the_processor() {
    let plate = encode(Parts::default().plate(2.0).mesh(), InsideRule::Sheet { thickness: 0.2 }.into());
    let mut scene = Scene::new();
    let plate = scene.add_shape(plate).expect("a shape");
    let small = scene.add_shape(Shape::Box { half_extents: DVec3::splat(0.25) }).expect("a shape");
    let across = |z: f64| Pose { translation: z * DVec3::Z, rotation: DQuat::from_rotation_x(0.5 * PI) };
    let others = [(plate, across(0.0)), (small, Pose::at(DVec3::new(0.3, 0.2, 0.0))), (plate, across(1.25))];
    for (world, other) in (0..).zip(others) {
        add_world(&mut scene, world, [(plate, Pose::IDENTITY), other]);
    }
    let options = CollideOptions::with_mode(Mode::Node);
    let mut detector = Detector::new(&device(), &scene, DetectorOptions::default()).expect("uploads");
    let found = detector.detect(&scene, &options).expect("contacts").hidden;
    let expected = detect(&scene, &options).expect("contacts").hidden;
    assert_eq!((found.len(), expected.len()), (2, 2), "{found:?} {expected:?}");
    for (found, greatest) in found.iter().zip([0.2, 0.35]) {
        assert!((0.74 * greatest..greatest + 1e-5).contains(&found.depth), "{found:?} of {greatest}");
    }
}

/// Each rule that is told by more than the cells: closed and open meshes, overlaps and sheets.
#[test]
fn distances_by_each_rule_are_those_of_the_processor() {
    let boundary = |rule| Inside { rule, surface: SurfaceFaces::Boundary };
    let open = Parts::default().open_cube(DVec3::splat(-0.6), 1.2, Outward).turned();
    let mut assets = Vec::from(sheets());
    assets.extend([
        encode(overlap(), boundary(InsideRule::Winding)),
        encode(overlap(), boundary(InsideRule::Nonzero)),
        encode(overlap(), InsideRule::Odd.into()),
        encode(open.mesh(), InsideRule::Generalized.into()),
        encode(bowl(6, 4).turned().mesh(), InsideRule::Generalized.into()),
    ]);
    let assets: Vec<Arc<TeSdf>> = assets.into_iter().map(Arc::new).collect();
    let shapes: Vec<Shape> = assets.iter().map(|asset| Shape::from(Arc::clone(asset))).collect();
    let uploaded = GpuShapes::upload(&device(), &shapes).expect("fits");
    let mut random = Random(32);
    for (asset, id) in assets.iter().zip(uploaded.ids()) {
        let rule = asset.inside();
        let at = Placement { pose: Pose::at(DVec3::new(3.0, -1.0, 2.0)), scale: 1.7 };
        let mut points: Vec<DVec3> = (0..800).map(|_| 1.5 * random.in_cube()).collect();
        points.extend((0..asset.face_count()).flat_map(|k| {
            let corners = asset.face_corners(k);
            [corners[0], corners.iter().sum::<DVec3>() / 3.0]
        }));
        let world: Vec<DVec3> = points.iter().map(|p| at.to_world(*p)).collect();
        let answers = uploaded.signed_distances(&world, &[(id, at)]).expect("answers").remove(0);
        let (mut inside, mut wrong) = (0, 0);
        for (p, answer) in points.iter().zip(&answers) {
            let expected = asset.query_by_tree(*p).signed_distance;
            inside += usize::from(expected < 0.0);
            if (answer.signed_distance - at.scale * expected).abs() > 2e-5 {
                // In the hole of an open mesh, a point may be on either side up to rounding.
                let is_other_side = (answer.signed_distance + at.scale * expected).abs() < 2e-5;
                assert!(
                    rule.rule == InsideRule::Generalized && is_other_side,
                    "{rule}, {p}: {answer:?}, {expected}"
                );
                wrong += 1;
            }
            // In the thickness of a sheet, the point half of it off the nearest face may be in the
            // thickness at another face.
            let on = asset.query_by_tree(at.to_shape(answer.closest_point)).signed_distance;
            assert!(expected < 0.0 || on.abs() < 2e-5, "{rule}, {p}: {answer:?} is {on} off the surface");
        }
        assert!(inside >= 30 && wrong <= 1, "{rule}: {inside} points inside, {wrong} on the other side");
    }
}
