//! Assets whose inside is not told by the winding number of their faces: queries and contacts by each
//! rule. Tests in all modes compile large kernels, for which the software Vulkan driver takes ten times as
//! long as a C++ compiler; `./test` runs them on CUDA's replacement alone.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::compare::{Compared, ROUNDING, device, each_mode, field, found, hold, hold_against};
use crate::support::bodies::rotation;
use crate::support::parts::Turn::{Inward, Outward};
use crate::support::parts::{Parts, bowl, soups};
use crate::support::random::Random;
use tesdf::TeSdf;
use tesdf::base::{Inside, InsideRule, SurfaceFaces};
use tesdf::collide::{
    CollideOptions, Contacts, Instance, InstanceId, Mode, Placement, Pose, Scene, Shape, ShapeId, detect,
};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf_gpu::{Detector, DetectorOptions, GpuShapes};

fn encode(mesh: TriangleMesh, inside: Inside) -> TeSdf {
    let solid = SolidMesh::with_inside(mesh, inside).expect("a solid");
    Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes")
}

fn scene(asset: TeSdf) -> Scene {
    let mut scene = Scene::new();
    let shape = scene.add_shape(asset).expect("a shape");
    for pose in [Pose::IDENTITY, Pose::at(DVec3::new(0.1, 0.2, 0.9))] {
        scene.add(Instance::new(shape, pose)).expect("an instance");
    }
    scene
}

/// Adds instances of shapes to a world of their own.
fn add_world(scene: &mut Scene, world: u32, placed: impl IntoIterator<Item = (ShapeId, Pose)>) {
    for (shape, pose) in placed {
        scene.add(Instance { world, ..Instance::new(shape, pose) }).expect("an instance");
    }
}

/// The height of a box over an open cube, and the depths of its faces and of its corners there. No face
/// of the cube is near, and yet the box is inside from the lid on.
const IN_THE_HOLE: [(f64, Option<f64>, Option<f64>); 3] =
    [(0.6, Some(0.5), Some(0.3)), (0.69, Some(0.5), Some(0.3)), (0.71, None, None)];

/// Detects boxes that enter an open cube through its hole, each in a world.
fn boxes_in_the_hole(modes: &[CollideOptions]) {
    let cup = Parts::default().open_cube(DVec3::splat(-0.5), 1.0, Outward).mesh();
    let small = Parts::default().cube(DVec3::splat(-0.2), 0.4, Outward).mesh();
    let mut scene = Scene::new();
    let [cup, small] = [encode(cup, InsideRule::Generalized.into()), encode(small, Inside::default())]
        .map(|asset| scene.add_shape(asset).expect("a shape"));
    for (world, (z, ..)) in (0..).zip(IN_THE_HOLE) {
        add_world(&mut scene, world, [(cup, Pose::IDENTITY), (small, Pose::at(z * DVec3::Z))]);
    }
    let mut detector = Detector::new(&device(), &scene, DetectorOptions::default()).expect("uploads");
    for options in modes {
        let found = detector.detect(&scene, options).expect("contacts");
        for (world, (z, face, corner)) in IN_THE_HOLE.into_iter().enumerate() {
            let of_world = found.iter().filter(|c| c.instance_a.0 / 2 == world as u32);
            assert!(of_world.clone().all(|c| c.converged && c.instance_a.0 % 2 == 1), "{z} {options:?}");
            let deepest = of_world.map(|c| -c.distance).reduce(f64::max);
            let expected = if options.mode == Mode::Node { corner } else { face };
            let is_right = match (deepest, expected) {
                (Some(found), Some(expected)) => (found - expected).abs() < 1e-5,
                (found, expected) => found == expected,
            };
            assert!(is_right, "{z} {options:?}: {deepest:?}, expected {expected:?}");
        }
    }
}

#[test]
fn nodes_in_a_hole_have_the_depth_of_formulas() {
    boxes_in_the_hole(&each_mode(0.0)[..1]);
}

#[test]
#[ignore = "most of a minute, as the test above in its other modes: .ci/release"]
fn boxes_in_a_hole_have_the_depth_of_formulas_in_all_modes() {
    boxes_in_the_hole(&each_mode(0.0)[2..]);
}

/// Three open meshes: a cube without a face, one without a lid whose faces look to the inside, and a bowl;
/// each on the others, on a solid and on simple shapes.
fn open_meshes() -> Scene {
    let mut scene = Scene::new();
    let cube = Parts::default().cube(DVec3::splat(-0.5), 1.0, Outward).mesh();
    let gap = TriangleMesh::new(cube.vertices().to_vec(), cube.faces()[1..].to_vec()).expect("valid ids");
    let cup = Parts::default().open_cube(DVec3::splat(-0.5), 1.0, Inward).turned().mesh();
    let open = [gap, cup, bowl(5, 3).mesh()].map(|mesh| encode(mesh, InsideRule::Generalized.into()));
    let solid = encode(Parts::default().cube(DVec3::splat(-0.2), 0.4, Outward).mesh(), Inside::default());
    let simple = [
        Shape::Box { half_extents: DVec3::new(0.1, 0.2, 0.3) },
        Shape::Sphere { radius: 0.2 },
        Shape::Capsule { half_height: 0.2, radius: 0.1 },
        Shape::Plane,
    ];
    let shapes = open.into_iter().chain([solid]).map(Shape::from).chain(simple);
    let ids: Vec<ShapeId> = shapes.map(|shape| scene.add_shape(shape).expect("a shape")).collect();
    let mut random = Random(12);
    let pairs = ids[..3].iter().flat_map(|first| ids.iter().map(move |second| (*first, *second)));
    let placed = pairs.flat_map(|pair| [0.2, 0.5, 0.8].map(|apart| (pair, apart)));
    for (world, ((first, second), apart)) in (0..).zip(placed) {
        let turned = Pose { translation: DVec3::ZERO, rotation: rotation(&mut random) };
        let at = Pose { translation: apart * random.direction(), rotation: rotation(&mut random) };
        add_world(&mut scene, world, [(first, turned), (second, at)]);
    }
    scene
}

/// Soups of triangles, each on solids.
fn soups_on_solids() -> Scene {
    let solid = encode(Parts::default().cube(DVec3::splat(-0.15), 0.3, Outward).mesh(), Inside::default());
    let mut scene = Scene::new();
    let solid = scene.add_shape(solid).expect("a shape");
    let mut random = Random(5);
    for (world, mesh) in (0..).zip(soups()) {
        let soup = scene.add_shape(encode(mesh, InsideRule::Generalized.into())).expect("a shape");
        let placed = [(soup, 0.05), (solid, 0.2), (solid, 0.4)].map(|(shape, apart)| {
            let at = Pose { translation: apart * random.direction(), rotation: rotation(&mut random) };
            (shape, at)
        });
        add_world(&mut scene, world, placed);
    }
    scene
}

/// A box that ends in the plane of a hole, and bodies in one pose.
fn ties() -> Scene {
    let mut scene = Scene::new();
    let cup = Parts::default().open_cube(DVec3::splat(-0.5), 1.0, Outward).mesh();
    let cup = scene.add_shape(encode(cup, InsideRule::Generalized.into())).expect("a shape");
    let small = scene.add_shape(Shape::Box { half_extents: DVec3::splat(0.2) }).expect("a shape");
    for (world, (shape, z)) in (0..).zip([(small, 0.7), (small, 0.0), (cup, 0.0), (cup, 1.0)]) {
        add_world(&mut scene, world, [(cup, Pose::IDENTITY), (shape, Pose::at(z * DVec3::Z))]);
    }
    scene
}

/// Detects contacts, and checks them against the field.
///
/// A contact at a jump is on either side of it, up to rounding. So only the distance without its sign is
/// compared with the field at the point.
fn contacts_of(scene: &Scene, options: &CollideOptions) -> Contacts {
    let (contacts, _) = found(scene, options, DetectorOptions::default());
    let is_round = |id: InstanceId| {
        let shape = scene.shape(scene.instance(id).expect("it is there").shape).expect("it is there");
        matches!(shape, Shape::Sphere { .. } | Shape::Capsule { .. })
    };
    for c in contacts.iter().filter(|c| !is_round(c.instance_a)) {
        let distance = field(scene, c.instance_b, c.point_a);
        assert!((distance.abs() - c.distance.abs()).abs() < 4.0 * ROUNDING, "{c:?}: {distance}");
    }
    contacts
}

/// Compares the contacts of open meshes in a mode with those of the processor.
fn open_meshes_hold(options: &CollideOptions) -> Compared {
    let mut all = Compared::default();
    for scene in [open_meshes(), soups_on_solids()] {
        all.add(hold_against(&scene, options, 1.0, &contacts_of(&scene, options)));
    }
    // Either side is right.
    assert!(!contacts_of(&ties(), options).is_empty());
    all
}

#[test]
fn nodes_of_open_meshes_touch_as_on_the_processor() {
    open_meshes_hold(&each_mode(1.0)[0]).is_good(250);
}

/// Without the filter by angle: beside a jump, rounding decides which point is the lowest.
#[test]
fn open_meshes_touch_as_on_the_processor_in_all_modes() {
    let mut all = Compared::default();
    for options in &each_mode(1.0)[2..] {
        all.add(open_meshes_hold(options));
    }
    all.is_good(3000);
}

/// Two cubes that overlap.
fn overlap() -> TriangleMesh {
    Parts::default().cube(DVec3::ZERO, 1.0, Outward).cube(DVec3::splat(0.4), 1.0, Outward).turned().mesh()
}

/// Two solids that overlap, and the inside is where only one is: their faces look to the inside in places.
fn overlaps_by_parity(modes: &[CollideOptions]) -> Compared {
    let odd = encode(overlap(), InsideRule::Odd.into());
    let solid =
        encode(Parts::default().cube(DVec3::splat(-0.5), 1.0, Outward).turned().mesh(), Inside::default());
    let small = Shape::Box { half_extents: DVec3::new(0.1, 0.2, 0.3) };
    let mut scene = Scene::new();
    let ids = [Shape::from(odd), solid.into(), small].map(|shape| scene.add_shape(shape).expect("a shape"));
    let mut random = Random(36);
    for (world, shape) in (0..12).zip(ids.into_iter().cycle()) {
        let turned = Pose { translation: DVec3::ZERO, rotation: rotation(&mut random) };
        let at = Pose { translation: 0.7 * random.direction(), rotation: rotation(&mut random) };
        add_world(&mut scene, world, [(ids[0], turned), (shape, at)]);
    }
    let mut all = Compared::default();
    modes.iter().for_each(|options| all.add(hold(&scene, options, 2.0)));
    all
}

#[test]
fn nodes_of_overlaps_by_parity_touch_as_on_the_processor() {
    overlaps_by_parity(&each_mode(2.0)[..1]).is_good(15);
}

#[test]
fn overlaps_by_parity_touch_as_on_the_processor_in_all_modes() {
    overlaps_by_parity(&each_mode(2.0)[1..]).is_good(350);
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

#[test]
fn a_shell_inside_out_touches_as_on_the_processor() {
    let inward = Parts::default().cube(DVec3::ZERO, 1.0, Inward).mesh();
    let scene = scene(encode(inward, InsideRule::Nonzero.into()));
    let mut detector = Detector::new(&device(), &scene, DetectorOptions::default()).expect("uploads");
    let options = CollideOptions::default();
    let deepest = |contacts: &Contacts| contacts.iter().map(|c| c.distance).fold(0.0, f64::min);
    let found = detector.detect(&scene, &options).expect("contacts");
    let expected = detect(&scene, &options).expect("contacts");
    assert!(!found.is_empty() && deepest(&expected) < -0.05, "{expected:?}");
    assert!((deepest(&found) - deepest(&expected)).abs() < 1e-5, "{found:?} {expected:?}");
}
