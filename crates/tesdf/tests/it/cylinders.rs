//! Cylinders: distances against formulas and samples, contacts, times of impact.
use std::f64::consts::{FRAC_PI_2, TAU};
use tesdf::collide::{
    Clearance, ClearanceOptions, CollideOptions, ContactsPer, Instance, InstanceId, Mode, Motion, Pose,
    Scene, Shape, TimeOfImpact, TimeOfImpactOptions, Velocity, clearance, detect, time_of_impact,
};
use tesdf::glam::{DQuat, DVec3};

use crate::clearance::{boxed, random_pose};
use crate::support::random::Random;

const H: f64 = 0.7;
const R: f64 = 0.4;
const CYLINDER: Shape = Shape::Cylinder { half_height: H, radius: R };

fn scene(bodies: [(&Shape, Pose); 2]) -> (Scene, [InstanceId; 2]) {
    let mut scene = Scene::new();
    let ids = bodies.map(|(shape, pose)| {
        let shape = scene.add_shape(shape.clone()).expect("valid sizes");
        scene.add(Instance::new(shape, pose)).expect("a valid pose")
    });
    (scene, ids)
}

fn between(a: (&Shape, Pose), b: (&Shape, Pose)) -> Clearance {
    let (scene, [a, b]) = scene([a, b]);
    clearance(&scene, a, b, &ClearanceOptions::default()).expect("a clearance")
}

fn tilted(angle: f64, at: DVec3) -> Pose {
    Pose { translation: at, rotation: DQuat::from_rotation_z(0.3) * DQuat::from_rotation_x(angle) }
}

fn cube(half: DVec3) -> Shape {
    Shape::from(boxed(half, 3))
}

/// How far a cylinder reaches down from its centre.
fn down(angle: f64) -> f64 {
    H * angle.cos().abs() + R * angle.sin().abs()
}

#[test]
fn the_clearance_over_a_plane_is_the_formula() {
    for (k, angle) in
        [0.0, 1e-9, 0.1, 0.7, 1.5, FRAC_PI_2, FRAC_PI_2 + 1e-7, 3.0, TAU / 2.0].into_iter().enumerate()
    {
        for height in [0.3, 1e-5, -1e-5, -0.1] {
            let at = DVec3::new(0.1, -0.2, down(angle) + height);
            let found = between((&CYLINDER, tilted(angle, at)), (&Shape::Plane, Pose::IDENTITY));
            let error = found.distance - height;
            assert!((-1e-14..1e-8).contains(&error) && found.converged, "{k}: {error} at {height}");
            assert!(found.lower_bound <= height, "{found:?}");
        }
    }
}

#[test]
fn clearances_between_simple_shapes_are_formulas() {
    let lying = |x: f64, y: f64, z: f64| Pose {
        translation: DVec3::new(x, y, z),
        rotation: DQuat::from_rotation_y(FRAC_PI_2),
    };
    let at = |x: f64, y: f64, z: f64| Pose::at(DVec3::new(x, y, z));
    let ball = Shape::Sphere { radius: 0.25 };
    let rod = Shape::Capsule { half_height: 1.0, radius: 0.1 };
    let block = Shape::Box { half_extents: DVec3::new(1.0, 2.0, 0.5) };
    let cases = [
        // Side by side, end to end, ends that overlap by a rim, crossing, and crossing at an angle.
        (&CYLINDER, at(1.0, 0.0, 0.2), 0.2),
        (&CYLINDER, at(0.1, 0.2, 1.5), 0.1),
        (&CYLINDER, at(1.1, 0.0, 1.5), (0.3f64 * 0.3 + 0.1 * 0.1).sqrt()),
        (&CYLINDER, lying(0.1, 1.0, 0.2), 0.2),
        (&CYLINDER, lying(0.0, 0.0, 1.3), 0.2),
        // Over the side, the end and the rim.
        (&ball, at(0.8, 0.0, 0.3), 0.15),
        (&ball, at(0.1, 0.1, 1.2), 0.25),
        (&ball, at(0.7, 0.0, 1.1), 0.25),
        (&ball, at(0.3, 0.0, 0.0), -0.35),
        (&rod, lying(0.0, 0.6, 0.1), 0.1),
        (&rod, at(0.5, 0.0, 0.3), 0.0),
        (&block, at(0.0, 0.0, 1.3), 0.1),
        (&block, at(0.0, 2.5, 0.0), 0.1),
        (&block, at(1.5, 0.0, 1.2), (0.1f64 * 0.1).sqrt()),
    ];
    for (k, (other, pose, expected)) in cases.into_iter().enumerate() {
        for swapped in [false, true] {
            let bodies = [(&CYLINDER, Pose::IDENTITY), (other, pose)];
            let [a, b] = if swapped { [bodies[1], bodies[0]] } else { bodies };
            let found = between(a, b);
            let error = found.distance - expected;
            assert!(error.abs() < 2e-8, "case {k}: {} instead of {expected}", found.distance);
            assert!(found.converged && found.lower_bound <= expected + 1e-14, "case {k}: {found:?}");
            assert!(
                (found.point_a.distance(found.point_b) - expected.abs()).abs() < 1e-7,
                "case {k}: {found:?}"
            );
        }
    }
}

/// The least signed distance over the surface of a cylinder, by samples that get ever denser around
/// the best one.
fn sampled(pose: Pose, field: &Shape, of_field: Pose) -> f64 {
    const N: usize = 24;
    let value = |p: DVec3| field.signed_distance(of_field.to_body(pose.to_world(p)));
    let round = |[u, v]: [f64; 2]| {
        let (sin, cos) = (TAU * u).sin_cos();
        DVec3::new(R * cos, R * sin, H * (2.0 * v - 1.0))
    };
    let end = |sign: f64| {
        move |[u, v]: [f64; 2]| {
            let (sin, cos) = (TAU * u).sin_cos();
            DVec3::new(R * v * cos, R * v * sin, sign * H)
        }
    };
    let mut least = f64::INFINITY;
    let mut look = |at: &dyn Fn([f64; 2]) -> DVec3| {
        let (mut center, mut size, mut best) = ([0.5, 0.5], 1.0, f64::INFINITY);
        for _ in 0..30 {
            let from: [f64; 2] = center.map(|c| c - 0.5 * size);
            for i in 0..=N {
                for j in 0..=N {
                    let [u, v] = [(i, 0), (j, 1)].map(|(i, k)| from[k] + size * i as f64 / N as f64);
                    let v = v.clamp(0.0, 1.0);
                    let distance = value(at([u, v]));
                    if distance < best {
                        (best, center) = (distance, [u, v]);
                    }
                }
            }
            size *= 0.5;
        }
        least = least.min(best);
    };
    look(&round);
    look(&end(-1.0));
    look(&end(1.0));
    least
}

#[test]
fn clearances_are_those_of_samples() {
    let mut random = Random(3);
    let shapes = [
        Shape::Plane,
        Shape::Box { half_extents: DVec3::new(0.5, 0.3, 0.6) },
        CYLINDER,
        cube(DVec3::new(0.5, 0.6, 0.3)),
    ];
    let (mut apart, mut overlaps) = (0, 0);
    for case in 0..24 {
        let other = &shapes[case % 4];
        let [a, b] = [0.2, 0.5].map(|spread| random_pose(&mut random, spread));
        let b = if case % 4 == 0 { Pose { translation: 3.0 * b.translation, ..b } } else { b };
        let found = between((&CYLINDER, a), (other, b));
        assert!(found.converged, "case {case}: {found:?}");
        let mut expected = sampled(a, other, b);
        if case % 4 == 2 {
            expected = expected.min(sampled(b, &CYLINDER, a));
        }
        // Of a box, only the surface of the cylinder is sampled: its own may be deeper.
        let is_all = case % 2 == 0 || found.distance > 0.0;
        assert!(found.lower_bound <= expected + 1e-12, "case {case}: {} {expected}", found.lower_bound);
        assert!(
            !is_all || (found.distance - expected).abs() < 1e-7,
            "case {case}: {} {expected}",
            found.distance
        );
        (apart, overlaps) =
            (apart + usize::from(found.distance > 0.0), overlaps + usize::from(found.distance < 0.0));
    }
    assert!(overlaps > 8, "{apart} apart, {overlaps} overlap");
}

#[test]
fn contacts_are_as_deep_as_the_formula_and_spread() {
    let floors =
        [(Shape::Plane, 0.0), (Shape::Box { half_extents: DVec3::ONE }, -1.0), (cube(DVec3::ONE), -1.0)];
    for (floor, z) in floors {
        for per in [ContactsPer::Face, ContactsPer::Minimum] {
            for (angle, depth) in [(0.0, 1e-6), (FRAC_PI_2, 1e-6), (0.4, 1e-4), (FRAC_PI_2, -1e-3)] {
                let at = DVec3::new(0.05, 0.02, down(angle) - depth);
                let bodies = [(&CYLINDER, tilted(angle, at)), (&floor, Pose::at(DVec3::Z * z))];
                let (scene, _) = scene(bodies);
                let mode = Mode::exact().per(per);
                let options = CollideOptions { mode, contact_distance: 0.01, ..CollideOptions::default() };
                let found = detect(&scene, &options).expect("contacts");
                let least = found.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
                assert!((least + depth).abs() < 1e-7, "{angle} {per:?}: {least}, {depth} deep");
                for contact in &found {
                    let [up, on_cylinder] = match contact.instance_a.0 {
                        0 => [contact.normal, contact.point_a],
                        _ => [-contact.normal, contact.point_b],
                    };
                    assert!(up.distance(DVec3::Z) < 1e-3 || contact.distance > 1e-4, "{angle} {per:?}: {up}");
                    let local = bodies[0].1.to_body(on_cylinder);
                    let off = CYLINDER.signed_distance(local);
                    assert!(off.abs() < 0.005 * R, "{angle} {per:?}: {off} off the cylinder");
                }
                // What holds it up: the ends of the line, or around the rim.
                let deep: Vec<DVec3> =
                    found.iter().filter(|c| c.distance < 1e-5 - depth).map(|c| c.point_a).collect();
                let reach = |direction: DVec3| {
                    deep.iter().map(|p| (*p - at).dot(direction)).fold(f64::NEG_INFINITY, f64::max)
                };
                if angle == 0.0 {
                    for k in 0..16 {
                        let direction = DQuat::from_rotation_z(0.39 * f64::from(k)) * DVec3::X;
                        assert!(reach(direction) > 0.9 * R, "{per:?}, direction {k}: {deep:?}");
                    }
                } else if angle == FRAC_PI_2 {
                    let along = DQuat::from_rotation_z(0.3) * DVec3::Y;
                    assert!(reach(along) > 0.999 * H && reach(-along) > 0.999 * H, "{per:?}: {deep:?}");
                }
            }
        }
    }
}

#[test]
fn times_of_impact_are_formulas() {
    let down_at = |speed: f64| Motion::Linear {
        velocity: Velocity { linear: DVec3::new(0.0, 0.0, -speed), ..Velocity::default() },
    };
    let across = Pose { translation: DVec3::ZERO, rotation: DQuat::from_rotation_x(FRAC_PI_2) };
    let cases = [
        (Shape::Plane, Pose::IDENTITY, 0.3, 3.0 - down(0.3)),
        (Shape::Plane, Pose::IDENTITY, 0.0, 3.0 - down(0.0)),
        (Shape::Plane, Pose::IDENTITY, FRAC_PI_2, 3.0 - down(FRAC_PI_2)),
        (CYLINDER, across, 0.0, 3.0 - H - R),
        (CYLINDER, Pose::IDENTITY, FRAC_PI_2, 3.0 - H - R),
        (Shape::Sphere { radius: 0.5 }, Pose::IDENTITY, 0.0, 3.0 - H - 0.5),
        (cube(DVec3::splat(0.5)), Pose::IDENTITY, 0.3, 3.0 - 0.5 - down(0.3)),
    ];
    for (k, (other, pose, angle, expected)) in cases.into_iter().enumerate() {
        // The rim is over the middle.
        let beside = DQuat::from_rotation_z(0.3) * DVec3::Y * (R * angle.cos() - H * angle.sin());
        let beside = if angle == 0.3 { beside } else { DVec3::ZERO };
        let from = tilted(angle, DVec3::new(0.0, 0.0, 3.0) - beside);
        let (scene, [a, b]) = scene([(&CYLINDER, from), (&other, pose)]);
        let options = TimeOfImpactOptions { end: 5.0, ..TimeOfImpactOptions::default() };
        let found = time_of_impact(&scene, a, b, down_at(1.0), Motion::Rest, &options).expect("a time");
        let TimeOfImpact::Impact(impact) = found else { panic!("case {k}: {found:?}") };
        assert!((impact.time - expected).abs() < 4e-6, "case {k}: {} instead of {expected}", impact.time);
        // Spinning about its axis changes nothing.
        let axis = from.rotation * DVec3::Z;
        let velocity = Velocity { linear: DVec3::new(0.0, 0.0, -1.0), angular: 2.0 * axis };
        let spinning = Motion::Linear { velocity };
        let found = time_of_impact(&scene, a, b, spinning, Motion::Rest, &options).expect("a time");
        assert!((found.free_until() - expected).abs() < 4e-6, "case {k}: {found:?}");
        let free = TimeOfImpactOptions { end: 0.99 * expected, ..options };
        assert!(
            time_of_impact(&scene, a, b, spinning, Motion::Rest, &free).expect("a time").is_free(),
            "case {k}"
        );
    }
}
