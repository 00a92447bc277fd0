//! Compares clearance with brute force over all pairs of faces, with dense samples, and with
//! formulas.

use std::sync::Arc;

use crate::support::meshes::{asset, named};
use crate::support::random::Random;
use crate::support::shapes::Shape as Surface;
use tesdf::collide::{
    Clearance, ClearanceOptions, CollideError, CollideOptions, Instance, InstanceId, Mode, Pose, Scene,
    Shape, clearance, detect,
};
use tesdf::geometry::Triangle;
use tesdf::geometry::internal::polygon_to_triangle;
use tesdf::glam::{DQuat, DVec3};
use tesdf::{Length, TeSdf};

fn bumpy(seed: u64) -> Arc<TeSdf> {
    let mut random = Random(seed);
    asset(&Surface::default().add_sphere(DVec3::ZERO, 2, || random.between(0.7, 1.0)).solid())
}

pub fn boxed(half: DVec3, n: u32) -> Arc<TeSdf> {
    asset(&Surface::default().add_box(-half, half, n).solid())
}

fn placed(shape: impl Into<Shape>, pose: Pose, scale: f64) -> (Shape, Pose, f64) {
    (shape.into(), pose, scale)
}

fn scene(bodies: [(Shape, Pose, f64); 2]) -> (Scene, [InstanceId; 2]) {
    let mut scene = Scene::new();
    let ids = bodies.map(|(shape, pose, scale)| {
        let shape = scene.add_shape(shape).expect("a shape");
        scene.add(Instance { scale, ..Instance::new(shape, pose) }).expect("an instance")
    });
    (scene, ids)
}

/// Measures both orders of the pair.
fn between(a: (Shape, Pose, f64), b: (Shape, Pose, f64)) -> Clearance {
    let (scene, [a, b]) = scene([a, b]);
    let options = ClearanceOptions::default();
    let (found, back) = (clearance(&scene, a, b, &options), clearance(&scene, b, a, &options));
    let (found, back) = (found.expect("a clearance"), back.expect("a clearance"));
    assert!((found.distance - back.distance).abs() <= 4e-8 * found.distance.abs().max(1.0));
    assert!((found.normal.length() - 1.0).abs() < 1e-12);
    assert!(found.converged && found.lower_bound <= found.distance, "{found:?}");
    found
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::at(DVec3::new(x, y, z))
}

pub fn random_pose(random: &mut Random, distance: f64) -> Pose {
    let rotation = DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
    Pose::new(distance * random.direction(), rotation).expect("a pose")
}

fn world_triangles(asset: &TeSdf, pose: Pose, scale: f64) -> Vec<[DVec3; 3]> {
    (0..asset.face_count()).map(|f| asset.face_corners(f).map(|p| pose.to_world(scale * p))).collect()
}

/// The least distance between two sets of triangles.
fn all_pairs(a: &[[DVec3; 3]], b: &[[DVec3; 3]]) -> f64 {
    let b: Vec<Triangle> = b.iter().map(|t| Triangle::new(*t)).collect();
    let normal = |[p, q, r]: [DVec3; 3]| (q - p).cross(r - p).normalize_or_zero();
    a.iter()
        .flat_map(|t| b.iter().map(|s| polygon_to_triangle(t, normal(*t), s, f64::INFINITY)))
        .map(|nearest| nearest.map_or(f64::INFINITY, |(distance, _)| distance))
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn clearance_of_separate_bodies_equals_brute_force() {
    let assets =
        [bumpy(1), bumpy(2), boxed(DVec3::new(0.5, 0.8, 0.3), 4), asset(&named("procedural/tetra.obj"))];
    let mut random = Random(7);
    for round in 0..24 {
        let (a, b) = (&assets[round % 4], &assets[random.index(4)]);
        // Both shapes are scaled to a width of about one unit.
        let size = |asset: &TeSdf| 2.0 / asset.bounds().extent().length();
        let (scale_a, scale_b) = (size(a) * random.between(0.3, 1.5), size(b) * random.between(0.3, 3.0));
        let far = [0.0, 0.05, 0.5, 20.0, 2000.0][round % 5];
        let pose_a = random_pose(&mut random, 1.0);
        let pose_b = {
            let away = random_pose(&mut random, 5.0 + far);
            Pose { translation: pose_a.translation + away.translation, ..away }
        };
        let found = between(placed(a.clone(), pose_a, scale_a), placed(b.clone(), pose_b, scale_b));
        let (faces_a, faces_b) = (world_triangles(a, pose_a, scale_a), world_triangles(b, pose_b, scale_b));
        let brute = all_pairs(&faces_a, &faces_b);
        let bound = 4e-8 + 1e-14 * (5.0 + far);
        assert!((found.distance - brute).abs() <= bound, "{round}: {found:?} {brute}");
        let apart = found.point_a - found.point_b;
        assert!((apart.length() - brute).abs() <= bound);
        assert!((apart.normalize() - found.normal).length() < 1e-6, "{found:?}");
        for (asset, faces, face, point) in
            [(a, &faces_a, found.face_a, found.point_a), (b, &faces_b, found.face_b, found.point_b)]
        {
            let position = position_of(asset, face);
            assert!(Triangle::new(faces[position]).closest(point).distance <= bound, "{found:?}");
        }
    }
}

/// Index, among the asset's faces, of a face of the source mesh.
fn position_of(asset: &TeSdf, face: u32) -> usize {
    let ids: Option<&[u32]> = asset.container().section("mesh.face_ids").expect("of this type");
    ids.expect("a section").iter().position(|id| *id == face).expect("a face")
}

/// The least value of one body's field at a grid of points on the faces of the other body, and the
/// grid's largest step.
fn by_samples(surface: &[[DVec3; 3]], field: &TeSdf, pose: Pose, scale: f64) -> (f64, f64) {
    const N: usize = 24;
    let (mut least, mut step) = (f64::INFINITY, 0.0f64);
    for [a, b, c] in surface {
        step = step.max(a.distance(*b).max(a.distance(*c)).max(b.distance(*c)) / N as f64);
        for i in 0..=N {
            for j in 0..=N - i {
                let (u, v) = (i as f64 / N as f64, j as f64 / N as f64);
                let p = *a + u * (*b - *a) + v * (*c - *a);
                let value = scale * field.signed_distance(pose.to_body(p) / scale);
                least = least.min(value);
            }
        }
    }
    (least, step)
}

#[test]
fn penetration_depth_equals_that_of_dense_samples() {
    let assets = [bumpy(3), boxed(DVec3::new(0.5, 0.8, 0.3), 3), asset(&named("procedural/tetra.obj"))];
    let mut random = Random(11);
    for round in 0..12 {
        let (a, b) = (&assets[round % 3], &assets[random.index(3)]);
        let size = |asset: &TeSdf| 2.0 / asset.bounds().extent().length();
        let (scale_a, scale_b) = (size(a), size(b) * random.between(0.5, 1.5));
        let middle = |asset: &TeSdf, scale: f64| scale * asset.bounds().center();
        let (pose_a, mut pose_b) = (random_pose(&mut random, 0.0), random_pose(&mut random, 0.5));
        pose_b.translation += pose_a.to_world(middle(a, scale_a)) - pose_b.rotation * middle(b, scale_b);
        let found = between(placed(a.clone(), pose_a, scale_a), placed(b.clone(), pose_b, scale_b));
        let (faces_a, faces_b) = (world_triangles(a, pose_a, scale_a), world_triangles(b, pose_b, scale_b));
        let (of_a, step_a) = by_samples(&faces_a, b, pose_b, scale_b);
        let (of_b, step_b) = by_samples(&faces_b, a, pose_a, scale_a);
        let brute = of_a.min(of_b);
        assert!(brute < 0.0, "the poses overlap");
        assert!(found.distance <= brute + 4e-8, "{round}: a deeper point: {found:?} {brute}");
        assert!(found.distance >= brute - step_a.max(step_b), "{round}: {found:?} {brute}");
        // The witness is real: the field has this value at the reported point of the surface.
        let (field, pose, scale, point) = match found.field {
            InstanceId(0) => (a, pose_a, scale_a, found.point_b),
            _ => (b, pose_b, scale_b, found.point_a),
        };
        let value = scale * field.signed_distance(pose.to_body(point) / scale);
        assert!((value - found.distance).abs() < 1e-12, "{found:?} {value}");
        assert!((found.point_a.distance(found.point_b) + found.distance).abs() < 1e-12);
    }
}

/// Two bodies of a similar size, deep in each other.
fn deep(random: &mut Random, [a, b]: [&Arc<TeSdf>; 2]) -> [(Shape, Pose, f64); 2] {
    let mut body = |asset: &Arc<TeSdf>, size: f64, at: DVec3| {
        let scale = size / asset.bounds().extent().length();
        let rotation = DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
        let pose = Pose::new(at - rotation * (scale * asset.bounds().center()), rotation).expect("a pose");
        placed(asset.clone(), pose, scale)
    };
    [body(a, 1.0, DVec3::ZERO), body(b, 0.9, DVec3::new(0.05, 0.1, -0.05))]
}

pub fn meshes() -> Vec<Arc<TeSdf>> {
    let mut meshes: Vec<Arc<TeSdf>> = [
        "procedural/tetra.obj",
        "procedural/beam.obj",
        "procedural/menger_2.obj",
        "public/cube_cup_quad.obj",
    ]
    .iter()
    .map(|name| asset(&named(name)))
    .collect();
    meshes.extend([bumpy(3), boxed(DVec3::new(0.5, 0.8, 0.3), 3)]);
    meshes
}

#[test]
fn the_depth_is_that_of_the_lowest_contact_of_all_faces() {
    let (meshes, mut random) = (meshes(), Random(17));
    for round in 0..18 {
        let pair = [&meshes[round % meshes.len()], &meshes[random.index(meshes.len())]];
        let (scene, [a, b]) = scene(deep(&mut random, pair));
        let found = clearance(&scene, a, b, &ClearanceOptions::default()).expect("a clearance");
        // The exact mode searches each face by itself, cell by cell.
        let options = CollideOptions::with_mode(Mode::exact().within(Length::Absolute(1e-8)));
        let contacts = detect(&scene, &options).expect("contacts");
        let lowest = contacts.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
        assert!(found.converged && lowest < 0.0, "{round}: {found:?}");
        assert!(
            found.distance <= lowest + 1e-8 && found.lower_bound <= lowest,
            "{round}: {found:?} {lowest}"
        );
        let is_exact = contacts.statistics.unconverged == 0;
        assert!(!is_exact || found.distance >= lowest - 1e-8, "{round}: {found:?} {lowest}");
    }
}

#[test]
fn clearance_is_the_same_for_any_number_of_threads() {
    let (meshes, mut random) = (meshes(), Random(29));
    for round in 0..6 {
        let (scene, [a, b]) = scene(deep(&mut random, [&meshes[round], &meshes[(round + 2) % meshes.len()]]));
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let found = pool.install(|| clearance(&scene, a, b, &ClearanceOptions::default()));
            format!("{:?}", found.expect("a clearance"))
        };
        assert_eq!(on(1), on(3), "{round}");
    }
}

#[test]
fn clearance_of_simple_shapes_equals_closed_forms() {
    let sphere = |radius| Shape::Sphere { radius };
    let capsule = Shape::Capsule { half_height: 1.0, radius: 0.25 };
    let cube = Shape::Box { half_extents: DVec3::ONE };
    let turned =
        |angle: f64| Pose::new(DVec3::new(0.0, 0.0, 4.0), DQuat::from_rotation_x(angle)).expect("a pose");
    let diagonal = std::f64::consts::FRAC_PI_4;
    let cases = [
        (placed(sphere(1.0), at(0., 0., 0.), 1.0), placed(sphere(2.0), at(0., 5., 0.), 1.0), 2.0),
        (placed(sphere(1.0), at(0., 0., 0.), 2.0), placed(sphere(2.0), at(0., 3., 0.), 1.0), -1.0),
        (placed(sphere(1.0), at(0., 0., 3.), 1.0), placed(Shape::Plane, at(0., 0., 0.5), 1.0), 1.5),
        (placed(Shape::Plane, at(0., 0., 0.5), 1.0), placed(sphere(1.0), at(0., 0., -3.), 1.0), -4.5),
        (placed(capsule.clone(), turned(0.0), 1.0), placed(Shape::Plane, at(0., 0., 0.), 1.0), 2.75),
        (
            placed(capsule.clone(), turned(2.0 * diagonal), 1.0),
            placed(Shape::Plane, at(0., 0., 0.), 1.0),
            3.75,
        ),
        (placed(cube.clone(), turned(0.0), 1.0), placed(cube.clone(), at(0., 0., 0.), 1.0), 2.0),
        (
            placed(cube.clone(), turned(diagonal), 1.0),
            placed(cube.clone(), at(0., 0., 0.), 1.0),
            3.0 - 2f64.sqrt(),
        ),
        (placed(cube.clone(), at(0.25, 0., 1.5), 1.0), placed(cube.clone(), at(0., 0., 0.), 1.0), -0.5),
        (
            placed(cube.clone(), turned(diagonal), 1.0),
            placed(Shape::Plane, at(0., 0., 0.), 1.0),
            4.0 - 2f64.sqrt(),
        ),
        (placed(capsule.clone(), turned(0.0), 1.0), placed(cube.clone(), at(0., 0., 0.), 1.0), 1.75),
    ];
    for (a, b, expected) in cases {
        let found = between(a.clone(), b.clone());
        assert!((found.distance - expected).abs() < 4e-8, "{a:?} {b:?}: {found:?}, expected {expected}");
        let moved = found.point_a - found.distance * found.normal;
        assert!(moved.distance(found.point_b) < 1e-12, "{found:?}");
    }
}

#[test]
fn a_box_mesh_has_the_clearance_of_a_box() {
    let half = DVec3::new(0.5, 0.25, 1.0);
    let mesh = boxed(half, 2);
    let simple = Shape::Box { half_extents: half };
    let mut random = Random(23);
    let others = [
        Shape::Plane,
        Shape::Box { half_extents: DVec3::new(0.4, 0.4, 0.1) },
        Shape::Sphere { radius: 0.3 },
        Shape::Capsule { half_height: 0.5, radius: 0.1 },
    ];
    for round in 0..24 {
        let other = others[round % 4].clone();
        let (pose, place) = (random_pose(&mut random, 1.0), random_pose(&mut random, 0.8));
        let by_mesh = between(placed(mesh.clone(), pose, 1.5), placed(other.clone(), place, 0.7));
        let by_formula = between(placed(simple.clone(), pose, 1.5), placed(other.clone(), place, 0.7));
        let off = (by_mesh.distance - by_formula.distance).abs();
        assert!(off < 4e-8, "{round} {other:?}: {by_mesh:?} {by_formula:?}");
    }
}

#[test]
fn a_body_inside_another_penetrates_it() {
    let (room, small) = (boxed(DVec3::ONE, 2), boxed(DVec3::splat(0.1), 2));
    // The deepest point of the small box is 0.8 from the nearest wall.
    for found in [
        between(placed(room.clone(), Pose::IDENTITY, 1.0), placed(small.clone(), at(0.3, 0., 0.), 1.0)),
        between(placed(small, at(0.3, 0., 0.), 1.0), placed(room.clone(), Pose::IDENTITY, 1.0)),
    ] {
        assert!((found.distance + 0.8).abs() < 4e-8, "{found:?}");
    }
    // One of two parts is inside; the other is outside and nearer to the surface.
    let two = Surface::default().add_box(DVec3::splat(-0.05), DVec3::splat(0.05), 1).add_box(
        DVec3::new(1.01, -0.1, -0.1),
        DVec3::new(1.3, 0.1, 0.1),
        1,
    );
    let found = between(placed(room, Pose::IDENTITY, 1.0), placed(asset(&two.solid()), Pose::IDENTITY, 1.0));
    assert!((found.distance + 0.95).abs() < 4e-8, "{found:?}");
}

#[test]
fn between_two_walls_the_depth_is_found_to_the_tolerance() {
    // The deepest points of the peg's sides in the plate form a line.
    let (plate, peg) = (boxed(DVec3::new(1.0, 1.0, 0.1), 4), boxed(DVec3::new(0.3, 0.05, 1.0), 2));
    let turn = DQuat::from_rotation_z(0.3);
    let found = between(
        placed(plate, Pose::IDENTITY, 1.0),
        placed(peg, Pose::new(DVec3::new(0.1, 0.0, 0.03), turn).expect("a pose"), 1.0),
    );
    assert!((found.distance + 0.1).abs() < 4e-8, "{found:?}");
}

#[test]
fn equal_bodies_in_one_pose_touch() {
    for asset in [bumpy(5), boxed(DVec3::ONE, 3)] {
        let pose = random_pose(&mut Random(3), 2.0);
        let found = between(placed(asset.clone(), pose, 1.0), placed(asset, pose, 1.0));
        assert!(found.distance.abs() < 4e-8, "{found:?}");
    }
    // Coplanar faces.
    let cube = boxed(DVec3::ONE, 2);
    let found = between(placed(cube.clone(), Pose::IDENTITY, 1.0), placed(cube, at(0.5, 0.25, 2.0), 1.0));
    assert!(found.distance.abs() < 4e-8, "{found:?}");
}

#[test]
fn a_nut_on_its_bolt_has_its_gap() {
    let (bolt, nut) =
        (asset(&named("procedural/iso_m16_bolt_6k.obj")), asset(&named("procedural/iso_m16_nut_c100.obj")));
    // After half a turn, the nut is half a pitch further.
    let unit = bolt.bounds().extent().z / 40.0;
    let height = 5.0 * unit;
    let turn = DQuat::from_rotation_z(std::f64::consts::TAU * 5.0 / 2.0);
    let pose = Pose::new(DVec3::new(0.0, 0.0, height), turn).expect("a pose");
    let found = between(placed(bolt.clone(), Pose::IDENTITY, 1.0), placed(nut.clone(), pose, 1.0));
    // The flanks are 50 micrometres apart. Flat facets bring them a little nearer.
    let gap = found.distance / unit;
    assert!((0.03..0.0525).contains(&gap), "{gap}: {found:?}");
    // Moving the nut by 0.2 mm along the axis exceeds the backlash.
    let pushed = Pose { translation: pose.translation + DVec3::new(0.0, 0.0, 0.2 * unit), ..pose };
    let found = between(placed(bolt, Pose::IDENTITY, 1.0), placed(nut, pushed, 1.0));
    let depth = -found.distance / unit;
    assert!((0.05..0.15).contains(&depth), "{depth}: {found:?}");
}

#[test]
fn pairs_without_a_clearance_are_errors() {
    let (mut scene, [a, b]) =
        scene([placed(Shape::Plane, Pose::IDENTITY, 1.0), placed(Shape::Plane, at(0., 0., 1.), 1.0)]);
    let options = ClearanceOptions::default();
    let refused = |scene: &Scene, a, b, options| clearance(scene, a, b, &options).expect_err("no clearance");
    assert!(refused(&scene, a, b, options).to_string().contains("both are planes"));
    assert!(refused(&scene, a, a, options).to_string().contains("one and the same"));
    let ball = scene.add_shape(Shape::Sphere { radius: 1.0 }).expect("a shape");
    let c = scene.add(Instance::new(ball, Pose::IDENTITY)).expect("an instance");
    for tolerance in [Length::Absolute(0.0), Length::OfDiagonal(f64::NAN), Length::Absolute(-1.0)] {
        let error = refused(&scene, a, c, ClearanceOptions { tolerance });
        assert!(matches!(error, CollideError::Option { option: "tolerance", .. }), "{error}");
    }
    scene.remove(&[c]).expect("it was there");
    assert_eq!(refused(&scene, a, c, options), CollideError::NoInstance(c));
}

/// Boxes of edge 1. Their lowest corners are on the x axis.
fn boxes(at: &[f64]) -> Arc<TeSdf> {
    let add = |shape: Surface, &x: &f64| shape.add_box(x * DVec3::X, x * DVec3::X + DVec3::ONE, 1);
    asset(&at.iter().fold(Surface::default(), add).solid())
}

#[test]
fn touching_faces_overlap_if_both_bodies_are_on_the_same_side() {
    let at = |x: f64| Pose { translation: x * DVec3::X, ..Pose::IDENTITY };
    let overlap = |a: (Shape, Pose, f64), b: (Shape, Pose, f64)| {
        let (found, back) = (between(a.clone(), b.clone()), between(b, a));
        assert_eq!(found.overlap, back.overlap);
        (found.distance, found.overlap)
    };
    let body = |corners: &[f64], x: f64| placed(boxes(corners), at(x), 1.0);
    for (a, b, expected) in [
        (&[0.0][..], &[0.0][..], true),
        // One of two boxes coincides with one of the two other boxes.
        (&[0.0, 10.0], &[10.0, 20.0], true),
        (&[0.0, 10.0], &[11.0, 20.0], false),
        (&[0.0], &[1.0], false),
    ] {
        let (distance, overlap) = overlap(body(a, 0.0), body(b, 0.0));
        assert!(distance.abs() < 1e-6 && overlap == expected, "{a:?} {b:?}: {distance} {overlap}");
    }
    let ball = |x: f64| placed(Shape::Sphere { radius: 1.0 }, at(x), 1.0);
    assert_eq!([ball(0.0), ball(2.0)].map(|b| overlap(ball(0.0), b).1), [true, false]);
    assert!(overlap(body(&[0.0], 0.0), body(&[0.0], 0.5)).1);
    assert_eq!(overlap(body(&[0.0], 0.0), body(&[0.0], 3.0)), (2.0, false));
    let plane = placed(Shape::Plane, Pose::IDENTITY, 1.0);
    let on_plane = [ball(0.0), body(&[0.0], 0.0)].map(|body| overlap(plane.clone(), body).1);
    assert_eq!(on_plane, [true, false]);
}
