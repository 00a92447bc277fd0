//! Pairs of which one order has all contacts: planes with other bodies, balls with convex bodies.

use std::f64::consts::TAU;

use crate::support::bodies::body;
use crate::support::random::Random;
use tesdf::collide::{
    ClearanceOptions, CollideOptions, Contact, ContactsPer, Instance, Mode, PairVerdict, PolygonVerdict,
    Pose, Scene, Shape, clearance, detect, why,
};
use tesdf::glam::{DQuat, DVec3};

/// Two places are one up to this part of the body's diagonal.
const NEAR: f64 = 1e-6;

/// The lowest height of the body's points over the plane z = 0 at a rotation about its origin.
fn lowest(shape: &Shape, rotation: DQuat) -> f64 {
    let mut scene = Scene::new();
    let shape = scene.add_shape(shape.clone()).expect("a shape");
    let id = scene.add(Instance::new(shape, Pose { rotation, translation: DVec3::ZERO })).expect("a pose");
    let floor = scene.add_shape(Shape::Plane).expect("a plane");
    let far = Pose::at(DVec3::new(0.0, 0.0, -10.0));
    let floor = scene.add(Instance::new(floor, far)).expect("a pose");
    clearance(&scene, id, floor, &ClearanceOptions::default()).expect("a clearance").distance - 10.0
}

/// Bodies that lie on a plane, nearly so, stand on edges and corners, apart by less than the
/// contact distance, or through the plane.
#[test]
fn faces_of_a_body_have_all_contacts_of_a_plane() {
    let mut random = Random(5);
    let shapes = [
        Shape::Box { half_extents: DVec3::new(0.3, 0.2, 0.1) },
        Shape::Sphere { radius: 0.2 },
        Shape::Capsule { half_height: 0.3, radius: 0.1 },
        Shape::Capsule { half_height: 0.003, radius: 0.1 },
        Shape::Mesh(body("l_bracket").asset.clone()),
        Shape::Mesh(body("torus_quads").asset.clone()),
    ];
    let mut of_plane = 0;
    for case in 0..600 {
        let shape = &shapes[case % shapes.len()];
        let size = shape.diagonal();
        let axis = random.direction();
        let lying = [DQuat::IDENTITY, DQuat::from_rotation_x(0.25 * TAU)][case / 6 % 2];
        let tilt = [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 6.0][case / 12 % 7] * random.unit();
        let rotation = DQuat::from_axis_angle(axis, tilt) * lying;
        let gap = [1e-9, 1e-3, 0.02, -1e-9, -1e-6, -1e-3, -0.1][case % 7] * size;
        let height = gap - lowest(shape, rotation);
        // The plane may be tilted in the world, and may be the first or the second instance.
        let world = match case % 4 {
            0 => Pose::IDENTITY,
            _ => Pose {
                rotation: DQuat::from_axis_angle(random.direction(), 1.0),
                translation: random.direction(),
            },
        };
        let mut scene = Scene::new();
        let [of_body, of_floor] =
            [shape.clone(), Shape::Plane].map(|shape| scene.add_shape(shape).expect("a shape"));
        let placed = Pose { rotation, translation: DVec3::new(0.1, 0.2, height) };
        let instances = [Instance::new(of_floor, world), Instance::new(of_body, world.after(placed))];
        let order = if case % 3 == 0 { [1, 0] } else { [0, 1] };
        let ids = order.map(|k| scene.add(instances[k]).expect("a pose"));
        let [floor, body] = if order == [0, 1] { ids } else { [ids[1], ids[0]] };
        let options = CollideOptions {
            contact_distance: 0.01 * size,
            ..CollideOptions::with_mode(Mode::exact().per(ContactsPer::Minimum))
        };
        let contacts = detect(&scene, &options).expect("contacts");
        assert!(contacts.iter().all(|c| c.instance_a == body), "case {case}");
        let wide = detect(&scene, &CollideOptions { contact_distance: size, ..options }).expect("contacts");
        let beyond = wide.iter().filter(|c| c.distance > options.contact_distance);
        let all: Vec<Contact> = contacts.iter().chain(beyond).copied().collect();
        let report = why(&scene, &options, floor, body, None).expect("a report");
        assert_eq!(report.pair, PairVerdict::OfOtherOrder);
        let of_parts = report.parts.iter().flat_map(|part| &part.polygons);
        for found in of_parts.filter(|polygon| polygon.verdict == PolygonVerdict::Contact) {
            let near = NEAR * size;
            // A body may turn by 0.1 rad before another point is nearer.
            let reach = found.distance.abs();
            // Heights over the plane are linear in the place on a rigid body. So a point above the
            // lower hull of its low vertices comes no lower, however the body moves: no slope shows
            // it below all.
            let ahead = |c: &Contact, along: DVec3| along.dot(c.point_b - found.point);
            let is_below_all = |along: DVec3, slope: f64| {
                let slack = near * (1.0 + slope) + (0.005 + 2.0 * slope) * reach;
                let height = |c: &Contact| c.distance - found.distance - slope * ahead(c, along);
                all.iter().all(|c| height(c) > slack)
            };
            let is_above_hull = (0..32).all(|k| {
                let (sin, cos) = (TAU * f64::from(k) / 32.0).sin_cos();
                let along = world.rotation * DVec3::new(cos, sin, 0.0);
                (-8..4).all(|digits| !is_below_all(along, 10f64.powi(digits)))
            });
            // Beside the lowest point of a ball, the plane is hardly farther. Its square has two
            // halves.
            let is_round = matches!(shape, Shape::Sphere { .. } | Shape::Capsule { .. });
            let is_beside =
                is_round && contacts.iter().any(|c| c.point_b.distance(found.point) <= 0.03 * size);
            assert!(is_above_hull || is_beside, "case {case}: {found:?} {contacts:?}");
            of_plane += 1;
        }
    }
    assert!(of_plane > 1000, "{of_plane} contacts of the plane");
}

/// Balls beside sides, edges and corners of boxes and cylinders, and in them up to their centre.
#[test]
fn the_centre_of_a_ball_has_its_contact_with_a_convex_body() {
    let mut random = Random(7);
    let (mut of_faces, mut cases) = (0, 0);
    for case in 0..600 {
        let convex = match case % 2 {
            0 => Shape::Box { half_extents: DVec3::new(0.3, 0.2, 0.1) },
            _ => Shape::Cylinder { half_height: 0.2, radius: 0.3 },
        };
        let radius = random.between(0.02, 0.5);
        let mut scene = Scene::new();
        let center = DVec3::new(0.5, 0.4, 0.4) * random.in_cube();
        let world = Pose {
            rotation: DQuat::from_axis_angle(random.direction(), random.between(0.0, 3.0)),
            translation: random.direction(),
        };
        let [body, ball] = [(convex, world), (Shape::Sphere { radius }, world.after(Pose::at(center)))].map(
            |(shape, pose)| {
                let shape = scene.add_shape(shape).expect("a shape");
                scene.add(Instance::new(shape, pose)).expect("a pose")
            },
        );
        let options = CollideOptions {
            contact_distance: 0.05,
            ..CollideOptions::with_mode(Mode::exact().per(ContactsPer::Minimum))
        };
        let contacts = detect(&scene, &options).expect("contacts");
        let distance =
            clearance(&scene, body, ball, &ClearanceOptions::default()).expect("a clearance").distance;
        assert_eq!(contacts.len(), usize::from(distance <= 0.05), "case {case}");
        let report = why(&scene, &options, body, ball, None).expect("a report");
        assert!(matches!(report.pair, PairVerdict::OfOtherOrder | PairVerdict::BoundsApart));
        let Some(contact) = contacts.iter().next() else { continue };
        assert!((contact.distance - distance).abs() < 1e-7, "case {case}: {contact:?}, clearance {distance}");
        // The faces have it, too, and besides contacts that are higher, or less deep.
        for found in report.parts.iter().flat_map(|part| &part.polygons) {
            assert!(found.distance >= contact.distance - 1e-7, "case {case}: {found:?} {contact:?}");
            of_faces += usize::from(found.verdict == PolygonVerdict::Contact);
        }
        cases += 1;
    }
    assert!(cases > 200 && of_faces > 100, "{cases} contacts, {of_faces} of faces");
}
