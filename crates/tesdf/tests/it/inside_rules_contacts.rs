//! Contacts, clearance and time of impact of sheets, of shells inside out and of boundaries of overlaps,
//! against brute force over all faces.

use std::f64::consts::PI;

use crate::support::parts::Turn::{Inward, Outward};
use crate::support::parts::{Parts, bowl};
use crate::support::random::Random;
use crate::support::ruled::{Body, Compared, assert_contacts, assert_faces, random_pose};
use tesdf::base::{Inside, InsideRule, SurfaceFaces};
use tesdf::collide::{
    ClearanceOptions, CollideOptions, ContactsPer, Instance, Mode, Motion, Pose, Scene, Shape,
    TimeOfImpactOptions, Velocity, clearance, detect, time_of_impact,
};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::TriangleMesh;

fn cup() -> TriangleMesh {
    Parts::default().open_cube(DVec3::splat(-0.5), 1.0, Outward).mesh()
}

fn box_of(edge: f64) -> Body {
    let mesh = Parts::default().cube(DVec3::splat(-0.5 * edge), edge, Outward).mesh();
    Body::new(mesh, Inside::default())
}

#[test]
fn sheets_touch_as_solids_of_their_thickness() {
    let bodies = [Body::sheet(cup(), 0.1), Body::sheet(bowl(5, 3).mesh(), 0.2), box_of(0.6)];
    let mut random = Random(4);
    for (i, j) in [(0, 2), (1, 2), (0, 1), (1, 1)] {
        for apart in [0.4, 0.9, 1.3] {
            let poses = [random_pose(&mut random, 0.1), random_pose(&mut random, apart)];
            assert_contacts(&bodies[i], &bodies[j], poses);
        }
    }
}

#[test]
fn shells_inside_out_and_boundaries_touch_as_solids() {
    let inward = Parts::default().cube(DVec3::splat(-0.5), 1.0, Inward).mesh();
    let shifted =
        Parts { vertices: bowl(6, 6).vertices.iter().map(|&v| v + 0.7 * DVec3::X).collect(), ..bowl(6, 6) };
    let spheres = bowl(6, 6).add(&shifted.vertices, &shifted.faces, Outward).mesh();
    let boundary = Inside { rule: InsideRule::Winding, surface: SurfaceFaces::Boundary };
    let bodies = [Body::new(inward, InsideRule::Nonzero.into()), Body::new(spheres, boundary), box_of(0.6)];
    let mut random = Random(6);
    for (i, j) in [(0, 2), (1, 2), (0, 1)] {
        for apart in [0.5, 1.0, 1.6] {
            let poses = [random_pose(&mut random, 0.1), random_pose(&mut random, apart)];
            assert_contacts(&bodies[i], &bodies[j], poses);
        }
    }
}

/// Plates that cross, and a box on both sides of a plate, have no vertex in each other.
#[test]
fn overlaps_of_sheets_that_no_vertex_shows_are_reported() {
    let sheet = Shape::from(Body::sheet(Parts::default().plate(2.0).mesh(), 0.2).asset);
    let mesh = Shape::from(box_of(0.5).asset);
    let half_extents = DVec3::splat(0.25);
    let across = |z: f64| Pose::new(z * DVec3::Z, DQuat::from_rotation_x(0.5 * PI)).expect("a pose");
    for (other, pose, expected) in [
        (sheet.clone(), across(0.0), Some(0.2)),
        (sheet.clone(), across(1.25), None),
        (mesh, Pose::at(DVec3::new(0.3, 0.2, 0.0)), Some(0.35)),
        (Shape::Box { half_extents }, Pose::at(DVec3::new(0.3, 0.2, 0.0)), Some(0.35)),
        (Shape::Box { half_extents }, Pose::at(0.36 * DVec3::Z), None),
    ] {
        let mut scene = Scene::new();
        for (shape, pose) in [(sheet.clone(), Pose::IDENTITY), (other, pose)] {
            let shape = scene.add_shape(shape).expect("a shape");
            scene
                .add(Instance {
                    scale: 2.0,
                    ..Instance::new(shape, Pose { translation: 2.0 * pose.translation, ..pose })
                })
                .expect("added");
        }
        let found = detect(&scene, &CollideOptions::with_mode(Mode::Node)).expect("contacts");
        assert!(found.is_empty(), "{found:?}");
        let depth = found.hidden.first().map(|h| h.depth);
        match expected {
            None => assert_eq!(depth, None),
            Some(expected) => {
                let depth = depth.expect("an overlap");
                assert!((1.48 * expected..2.0 * expected + 1e-9).contains(&depth), "{depth}, {expected}");
            }
        }
    }
}

#[test]
fn a_sheet_and_a_box_have_the_clearance_and_impact_of_formulas() {
    let plate = Body::sheet(Parts::default().plate(2.0).mesh(), 0.2);
    for side in [1.0, -1.0] {
        for shape in [
            Shape::from(box_of(0.5).asset),
            Shape::Box { half_extents: DVec3::splat(0.25) },
            Shape::Sphere { radius: 0.25 },
        ] {
            let mut scene = Scene::new();
            let shapes = [
                scene.add_shape(plate.asset.clone()).expect("a sheet"),
                scene.add_shape(shape).expect("a box"),
            ];
            let a = scene
                .add(Instance { scale: 2.0, ..Instance::new(shapes[0], Pose::IDENTITY) })
                .expect("added");
            let b = scene.add(Instance::new(shapes[1], Pose::at(DVec3::new(0.1, 0.2, side)))).expect("added");
            let found = clearance(&scene, a, b, &ClearanceOptions::default()).expect("a clearance");
            assert!((found.distance - 0.55).abs() < 1e-6, "{found:?}");
            assert!(
                (found.point_a.z - 0.2 * side).abs() < 1e-6 && (found.point_b.z - 0.75 * side).abs() < 1e-6,
                "{found:?}"
            );
            let down = Velocity { linear: -2.0 * side * DVec3::Z, angular: DVec3::ZERO };
            let (still, down) =
                (Motion::Linear { velocity: Velocity::default() }, Motion::Linear { velocity: down });
            let options = TimeOfImpactOptions { end: 1.0, ..TimeOfImpactOptions::default() };
            let impact = *time_of_impact(&scene, a, b, still, down, &options)
                .expect("an answer")
                .impact()
                .expect("an impact");
            assert!((impact.time - 0.275).abs() < 1e-4, "{impact:?}");
            let options = CollideOptions { contact_distance: 0.6, ..CollideOptions::default() };
            let contacts = detect(&scene, &options).expect("contacts");
            assert!(!contacts.is_empty());
            for contact in contacts.iter() {
                // The search for a contact ends within its tolerance, beside the nearest point of a sphere.
                assert!(contact.distance > 0.55 - 1e-5 && contact.distance < 0.6, "{contact:?}");
                let from_sheet = if contact.instance_a == a { -side } else { side };
                assert!(contact.normal.z * from_sheet > 0.99, "{contact:?}");
            }
        }
    }
}

/// Solids of which an odd number overlaps: faces of each have the inside in front of them in one place,
/// and behind them in another.
fn odd_bodies() -> Vec<Body> {
    let third = 1.0 / 3.0;
    let two = Parts::default()
        .cube(DVec3::splat(-0.5), 0.7, Outward)
        .cube(DVec3::new(-0.2, -0.25, -0.3), 0.7, Outward)
        .turned();
    // Edges and corners lie on faces of the other, and sides of both on each other.
    let on_each_other = Parts::default().cube(DVec3::splat(-0.5), 2.0 * third, Outward).cube(
        DVec3::new(-0.5 + third, -0.5, -0.5 + third),
        2.0 * third,
        Outward,
    );
    let nested = Parts::default()
        .cube(DVec3::splat(-0.5), 1.0, Outward)
        .cube(DVec3::splat(-0.3), 0.6, Outward)
        .cube(DVec3::splat(-0.1), 0.4, Outward);
    let spheres = bowl(5, 5);
    let shifted: Vec<DVec3> = spheres.vertices.iter().map(|&v| 0.7 * v + 0.6 * DVec3::X).collect();
    let faces = spheres.faces.clone();
    let spheres = spheres.add(&shifted, &faces, Inward);
    [two, on_each_other, nested, spheres]
        .map(|parts| Body::new(parts.mesh(), InsideRule::Odd.into()))
        .into_iter()
        .collect()
}

#[test]
fn overlaps_that_are_outside_touch_on_both_sides_of_their_faces() {
    let bodies = odd_bodies();
    let small = box_of(0.3);
    let mut random = Random(8);
    let mut compared = Compared::default();
    for body in &bodies {
        for apart in [0.1, 0.5, 0.9] {
            let poses = [random_pose(&mut random, 0.05), random_pose(&mut random, apart)];
            assert_contacts(body, &small, poses);
            for (pair, poses) in
                [([body, &small], [&poses[0], &poses[1]]), ([&small, body], [&poses[1], &poses[0]])]
            {
                assert_faces(pair, poses, 0.05, (24, 1), &mut compared);
            }
        }
    }
    for (i, j) in [(0, 1), (2, 3), (0, 0)] {
        let poses = [random_pose(&mut random, 0.1), random_pose(&mut random, 0.6)];
        assert_contacts(&bodies[i], &bodies[j], poses);
        assert_faces([&bodies[i], &bodies[j]], [&poses[0], &poses[1]], 0.0, (16, 1), &mut compared);
    }
    assert!(compared.deep > 50 && compared.apart > 50, "{} {}", compared.deep, compared.apart);
}

/// The filter of Eq. (10) takes the normal that points outward at the contact.
#[test]
fn the_cosine_filter_knows_the_outside_of_faces_that_have_both() {
    let bodies = odd_bodies();
    let small = box_of(0.3);
    let mut random = Random(10);
    let (mut kept, mut dropped, mut turned) = (0, 0, 0);
    for (k, body) in bodies.iter().enumerate() {
        for _ in 0..6 {
            let apart = random.between(0.2, 0.6);
            let poses = [random_pose(&mut random, 0.05), random_pose(&mut random, apart)];
            let mut scene = Scene::new();
            let shapes = [body, &small].map(|b| scene.add_shape(b.asset.clone()).expect("a shape"));
            let a = scene.add(Instance::new(shapes[0], poses[0])).expect("an instance");
            scene.add(Instance::new(shapes[1], poses[1])).expect("an instance");
            let all = CollideOptions::with_mode(Mode::exact().per(ContactsPer::Cell));
            let cos = 0.3;
            let filtered = CollideOptions { mode: all.mode.filtered(cos), ..all };
            let [all, filtered] = [all, filtered].map(|o| detect(&scene, &o).expect("contacts"));
            for contact in all.iter().filter(|c| c.instance_a == a) {
                let pose = &poses[0];
                let at = pose.rotation.inverse() * (contact.point_a - pose.translation);
                let normals = body.outward(contact.face_a, at);
                let cosines: Vec<f64> =
                    normals.iter().map(|n| contact.normal.dot(pose.rotation * *n)).collect();
                let least = cosines.iter().copied().fold(f64::INFINITY, f64::min);
                if (least + cos).abs() < 1e-6 {
                    continue;
                }
                let is_kept = filtered.iter().any(|c| c == contact);
                assert_eq!(is_kept, least < -cos, "body {k}: {cosines:?} {contact:?}");
                kept += usize::from(is_kept);
                dropped += usize::from(!is_kept);
                let [a, b, c] = body.mesh.triangle(contact.face_a as usize);
                turned += usize::from(normals.len() == 1 && normals[0].dot((b - a).cross(c - a)) < 0.0);
            }
        }
    }
    assert!(kept > 20 && dropped > 20 && turned > 20, "{kept} {dropped} {turned}");
}

/// A box in the overlap of two boxes is outside of both. It touches their walls from there.
#[test]
fn a_box_in_a_void_has_contacts_clearance_and_impact_of_formulas() {
    let mesh = Parts::default()
        .cube(DVec3::new(-2.0, -1.0, -1.0), 3.0, Outward)
        .cube(DVec3::new(-1.0, -1.5, -1.5), 4.0, Outward)
        .mesh();
    // The void is x from -1 to 1, y and z from -1 to 2.
    let body = Body::new(mesh, InsideRule::Odd.into());
    let mut scene = Scene::new();
    let shape = scene.add_shape(body.asset.clone()).expect("faces of both orientations");
    let ball = scene.add_shape(Shape::Sphere { radius: 0.25 }).expect("a ball");
    let cube = scene.add_shape(box_of(0.5).asset).expect("a box");
    let walls = scene.add(Instance::new(shape, Pose::IDENTITY)).expect("added");
    for (shape, is_round) in [(ball, true), (cube, false)] {
        let at = DVec3::new(0.7, 0.5, 0.5);
        let moved = scene.add(Instance::new(shape, Pose::at(at))).expect("added");
        let found = clearance(&scene, moved, walls, &ClearanceOptions::default()).expect("a clearance");
        assert!((found.distance - 0.05).abs() < 1e-6 && !found.overlap, "{found:?}");
        assert!((found.normal + DVec3::X).length() < 1e-6, "{found:?}");
        let right = Motion::Linear { velocity: Velocity { linear: DVec3::X, angular: DVec3::ZERO } };
        let options = TimeOfImpactOptions::default();
        let impact = time_of_impact(&scene, moved, walls, right, Motion::Rest, &options);
        let impact = *impact.expect("an answer").impact().expect("an impact");
        assert!((impact.time - 0.05).abs() < 1e-5, "{impact:?}");
        for mode in [Mode::Node, Mode::face(), Mode::exact()] {
            let options =
                CollideOptions { contact_distance: 0.06, ..CollideOptions::with_mode(mode.filtered(0.5)) };
            let found = detect(&scene, &options).expect("contacts");
            let of_moved: Vec<_> = found.iter().filter(|c| c.instance_a == moved).collect();
            assert!(!of_moved.is_empty(), "{mode:?}");
            for contact in of_moved {
                assert!((contact.distance - 0.05).abs() < 1e-6, "{mode:?}: {contact:?}");
                assert!((contact.normal + DVec3::X).length() < 1e-4, "{mode:?}: {contact:?}");
            }
            // The wall has its outside on the side of the body.
            let of_wall = found.iter().filter(|c| c.instance_a == walls && c.normal.x > 0.9).count();
            assert!(of_wall > 0 || mode != Mode::exact(), "{mode:?}");
        }
        // In the wall, the way out is back into the void.
        let at = DVec3::new(0.95, 0.5, 0.5);
        let deep = scene.add(Instance::new(shape, Pose::at(at))).expect("added");
        let found = clearance(&scene, deep, walls, &ClearanceOptions::default()).expect("a clearance");
        assert!((found.distance + 0.2).abs() < 1e-6 && found.overlap, "{is_round} {found:?}");
        assert!((found.normal + DVec3::X).length() < 1e-6, "{found:?}");
        scene.remove(&[moved, deep]).expect("removed");
    }
}
