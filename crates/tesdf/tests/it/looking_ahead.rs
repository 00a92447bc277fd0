//! Compares the distance by which velocities widen the search for contacts with the motion of sampled
//! points, and with the impacts of moving balls.

use std::f64::consts::PI;

use crate::support::meshes::encoded;
use crate::support::parts::Parts;
use crate::support::parts::Turn::Outward;
use crate::support::random::Random;
use tesdf::TeSdf;
use tesdf::base::Inside;
use tesdf::collide::internal::{Ahead, Approach};
use tesdf::collide::{
    CollideOptions, Instance, Mode, Motion, Pose, Reduction, Scene, Shape, Velocity, detect, instance_pairs,
    why,
};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::SolidMesh;

const BOX: Shape = Shape::Box { half_extents: DVec3::new(0.3, 0.5, 0.2) };

/// An instance of any shape at a random place, near the origin or far from it.
fn instance(scene: &mut Scene, shape: Shape, random: &mut Random) -> Instance {
    let shape = scene.add_shape(shape).expect("a shape");
    let rotation = DQuat::from_axis_angle(random.direction(), random.between(0.0, PI));
    let pose = Pose::new(random.power(-1.0, 1.0) * random.direction(), rotation).expect("a pose");
    Instance { scale: random.between(0.5, 2.0), ..Instance::new(shape, pose) }
}

/// A velocity of which any part may be large, small or zero.
fn velocity(random: &mut Random) -> Velocity {
    let mut part = || match random.index(4) {
        0 => DVec3::ZERO,
        _ => random.power(-2.0, 1.0) * random.direction(),
    };
    Velocity { linear: part(), angular: part() }
}

/// A mesh of some 1 in size.
fn wedge() -> TeSdf {
    let solid = Parts::default().cube(DVec3::splat(-0.4), 0.8, Outward).turned().mesh();
    let solid = SolidMesh::with_inside(solid, Inside::default()).expect("a solid");
    encoded(&solid)
}

/// The velocity at another place of the body that moves with `velocity` at `from`.
fn carried(velocity: Velocity, from: DVec3, to: DVec3) -> Velocity {
    Velocity { linear: velocity.linear + velocity.angular.cross(to - from), ..velocity }
}

/// A point of an instance of [`BOX`] in its frame; half of them are corners.
fn point(instance: &Instance, random: &mut Random) -> DVec3 {
    let p = random.in_cube();
    let p = if random.index(2) == 0 { p.signum() } else { p };
    instance.scale * p * DVec3::new(0.3, 0.5, 0.2)
}

/// The place of a point of the instance's frame after `time`.
fn moved(instance: &Instance, p: DVec3, time: f64) -> DVec3 {
    Motion::Linear { velocity: instance.velocity }.pose_at(instance.pose, time).to_world(p)
}

/// The change of the distance of two points within `time`.
fn change([(a, p), (b, q)]: [(&Instance, DVec3); 2], time: f64) -> f64 {
    let distance = |time| moved(a, p, time).distance(moved(b, q, time));
    (distance(time) - distance(0.0)).abs()
}

#[test]
fn no_two_points_come_closer_than_the_bound_says() {
    let mut random = Random(7);
    let (mut widest, mut relative) = (0.0f64, 0);
    for case in 0..4000 {
        let mut scene = Scene::new();
        let mut a = instance(&mut scene, BOX, &mut random);
        let mut b = instance(&mut scene, BOX, &mut random);
        a.velocity = velocity(&mut random);
        b.velocity = match random.index(3) {
            0 => carried(a.velocity, a.pose.translation, b.pose.translation),
            1 => Velocity { angular: a.velocity.angular, ..velocity(&mut random) },
            _ => velocity(&mut random),
        };
        let time = random.power(-2.0, 0.5).abs();
        let [ahead_a, ahead_b] = [&a, &b].map(|i| Ahead::new(i, &BOX, time));
        let bound = ahead_a.closing(&ahead_b);
        assert_eq!(bound, ahead_b.closing(&ahead_a));
        let absolute = ahead_a.motion() + ahead_b.motion();
        assert!(bound <= absolute);
        relative += usize::from(bound < 0.5 * absolute);
        for _ in 0..40 {
            let (p, q) = (point(&a, &mut random), point(&b, &mut random));
            let change = change([(&a, p), (&b, q)], time * random.unit());
            let rounding = 1e-13 * (20.0 + absolute);
            assert!(change <= bound + rounding, "case {case}: {change} is more than {bound}\n{a:?}\n{b:?}");
            if bound > 1e-6 {
                widest = widest.max(change / bound);
            }
        }
    }
    assert!(widest > 0.95, "the bound is never nearly reached: {widest}");
    assert!(relative > 400, "only {relative} cases in which bodies move together");
}

/// The bound of a part holds for the points of the part, and is less than that of the pair for
/// many.
#[test]
fn no_point_of_a_part_comes_closer_than_its_bound_says() {
    let mut random = Random(21);
    let (mut widest, mut less) = (0.0f64, 0);
    for case in 0..4000 {
        let mut scene = Scene::new();
        let mut a = instance(&mut scene, BOX, &mut random);
        let mut b = instance(&mut scene, BOX, &mut random);
        (a.velocity, b.velocity) = (velocity(&mut random), velocity(&mut random));
        if case % 3 == 0 {
            // Two gears: the places where they roll on each other hardly move.
            let way = b.pose.translation - a.pose.translation;
            let place = a.pose.translation + random.unit() * way;
            b.velocity = carried(
                Velocity { angular: -2.0 * a.velocity.angular, ..a.velocity },
                place,
                b.pose.translation,
            );
            a.velocity = carried(a.velocity, place, a.pose.translation);
        }
        let time = random.power(-2.0, -0.5).abs();
        let [ahead_a, ahead_b] = [&a, &b].map(|i| Ahead::new(i, &BOX, time));
        let (approach, whole) = (ahead_a.approach(&ahead_b), ahead_a.closing(&ahead_b));
        for _ in 0..40 {
            let (p, q) = (point(&a, &mut random), point(&b, &mut random));
            let begin = moved(&a, p, 0.0);
            let radius = if random.index(2) == 0 { 0.0 } else { random.power(-2.0, 0.0).abs() };
            let center = begin + radius * random.unit() * random.direction();
            let bound = approach.around(center, radius);
            let change = change([(&a, p), (&b, q)], time * random.unit());
            let rounding = 1e-13 * (20.0 + ahead_a.motion() + ahead_b.motion());
            assert!(change <= bound + rounding, "case {case}: {change} is more than {bound}\n{a:?}\n{b:?}");
            less += usize::from(bound < 0.5 * whole);
            if bound > 1e-6 {
                widest = widest.max(change / bound);
            }
        }
    }
    assert!(widest > 0.95, "the bound is never nearly reached: {widest}");
    assert!(less > 10_000, "only {less} parts look less far than their pair");
}

/// Over a plane that does not turn, only the height counts.
#[test]
fn no_point_comes_lower_over_a_plane_than_its_bound_says() {
    let mut random = Random(24);
    let (mut widest, mut less) = ([0.0f64; 2], 0);
    for case in 0..4000 {
        let mut scene = Scene::new();
        let mut a = instance(&mut scene, BOX, &mut random);
        let mut plane = instance(&mut scene, Shape::Plane, &mut random);
        (a.velocity, plane.velocity) = (velocity(&mut random), velocity(&mut random));
        plane.velocity.angular = DVec3::ZERO;
        let normal = plane.pose.rotation * DVec3::Z;
        if case % 4 == 0 {
            a.velocity.angular = 3.0 * random.unit() * normal;
        }
        let time = random.power(-2.0, -0.5).abs();
        let [ahead, of_plane] = [(&a, &BOX), (&plane, &Shape::Plane)].map(|(i, s)| Ahead::new(i, s, time));
        let (approach, whole) = (ahead.approach(&of_plane), ahead.closing(&of_plane));
        assert_eq!(whole, of_plane.closing(&ahead));
        for _ in 0..40 {
            let p = point(&a, &mut random);
            let height = |time| normal.dot(moved(&a, p, time) - moved(&plane, DVec3::ZERO, time));
            let fall = height(0.0) - height(time * random.unit());
            let radius = if random.index(2) == 0 { 0.0 } else { random.power(-2.0, 0.0).abs() };
            let center = moved(&a, p, 0.0) + radius * random.unit() * random.direction();
            let bounds = [whole, approach.around(center, radius)];
            let rounding = 1e-13 * (20.0 + ahead.motion() + time * plane.velocity.linear.length());
            for (bound, widest) in bounds.into_iter().zip(&mut widest) {
                assert!(
                    fall <= bound + rounding,
                    "case {case}: {fall} is more than {bound}\n{a:?}\n{plane:?}"
                );
                if bound > 1e-6 {
                    *widest = widest.max(fall / bound);
                }
            }
            less += usize::from(bounds[1] < 0.5 * whole);
        }
    }
    assert!(widest.iter().all(|widest| *widest > 0.95), "a bound is never nearly reached: {widest:?}");
    assert!(less > 10_000, "only {less} parts look less far than their pair");
}

/// Where an approach covers another one, no point of the ball needs more than it has looked.
#[test]
fn an_approach_covers_what_is_nowhere_greater() {
    let mut random = Random(22);
    let (mut covered, mut missed) = (0, 0);
    for case in 0..20_000 {
        let mut approach = |like: Option<Approach>| {
            let mut vector = |size: f64| size * random.power(-2.0, 0.0) * random.direction();
            let (way, turn) = (vector(1.0), vector(2.0));
            match like {
                None => {
                    let normal = (case % 2 == 0).then(|| vector(1.0).normalize());
                    Approach { about: vector(1.0), way, turn, normal, rest: 0.01 * way.length() }
                }
                Some(like) => {
                    let share = [0.0, 0.4, 1.0, 1.1][case / 2 % 4];
                    let (way, turn) = (share * like.way + 0.1 * way, share * like.turn + 0.1 * turn);
                    Approach { way, turn, ..like }
                }
            }
        };
        let own = approach(None);
        let other = approach(Some(own));
        let (center, radius, slack) =
            (random.direction(), random.power(-2.0, 0.0).abs(), 0.3 * random.unit() * random.unit());
        let is_covered = own.covers(&other, center, radius, slack);
        let greatest = (0..60)
            .map(|k| match k % 2 {
                0 => center + radius * random.direction(),
                _ => center + radius * random.in_cube().clamp_length_max(1.0),
            })
            .map(|p| other.around(p, 0.0) - own.around(p, 0.0))
            .fold(f64::NEG_INFINITY, f64::max);
        assert!(!is_covered || greatest <= slack + 1e-12, "case {case}: {greatest} is more than {slack}");
        covered += usize::from(is_covered);
        missed += usize::from(!is_covered && greatest <= slack);
    }
    assert!(covered > 4000 && missed < covered, "{covered} covered, {missed} not found to be");
}

/// Parts look as far as their own motion says: of the contacts within the contact distance of their
/// pair, a detection finds those within that of their part.
#[test]
fn each_part_looks_as_far_as_it_moves() {
    let mut random = Random(23);
    let (mut found, mut dropped) = (0, 0);
    for case in 0..60 {
        let mut scene = Scene::new();
        let ids: Vec<_> = (0..3)
            .map(|k| {
                let shape = match k {
                    0 => BOX,
                    1 => Shape::Capsule { half_height: 0.3, radius: 0.1 },
                    _ => Shape::from(wedge()),
                };
                let mut i = instance(&mut scene, shape, &mut random);
                (i.scale, i.pose.translation) = (1.0, 0.8 * random.in_cube());
                i.velocity = Velocity { linear: 0.3 * random.in_cube(), angular: 3.0 * random.in_cube() };
                scene.add(i).expect("an instance")
            })
            .collect();
        let mode = [Mode::Node, Mode::exact()][case % 2];
        let reduction = [Reduction::None, Reduction::PerPair(1000)][case / 2 % 2];
        let options = CollideOptions {
            speculative_time: 0.2,
            contact_distance: 0.01,
            reduction,
            ..CollideOptions::with_mode(mode)
        };
        let all = detect(&scene, &options).expect("contacts");
        for (k, &a) in ids.iter().enumerate() {
            for &b in ids.iter().enumerate().filter(|(l, _)| *l != k).map(|(_, id)| id) {
                let of_pair = instance_pairs(&scene, 0.01, 0.2).expect("pairs");
                let Some(pair) = of_pair.iter().find(|p| (p.first, p.second) == (a.min(b), a.max(b))) else {
                    continue;
                };
                let wide = CollideOptions {
                    speculative_time: 0.0,
                    contact_distance: pair.contact_distance,
                    reduction: Reduction::None,
                    ..options
                };
                let far = why(&scene, &wide, a, b, None).expect("a report");
                for part in &far.parts {
                    let own = &why(&scene, &options, a, b, Some(part.id)).expect("a report").parts[0];
                    assert!(own.contact_distance <= pair.contact_distance + 1e-12);
                    let has =
                        all.iter().any(|c| (c.instance_a, c.instance_b, c.feature.a) == (a, b, part.id));
                    let distance = part.distance();
                    if mode == Mode::Node || distance > own.contact_distance {
                        let expected = distance <= own.contact_distance;
                        assert_eq!(has, expected, "case {case}, part {}: {distance} {own:?}", part.id);
                    }
                    found += usize::from(has);
                    dropped += usize::from(!has && distance <= pair.contact_distance);
                }
            }
        }
    }
    assert!(found > 500 && dropped > 300, "{found} contacts, {dropped} dropped");
}

#[test]
fn bodies_that_move_together_look_no_further() {
    let mut random = Random(3);
    for _ in 0..500 {
        let mut scene = Scene::new();
        let mut a = instance(&mut scene, BOX, &mut random);
        let mut b = instance(&mut scene, BOX, &mut random);
        let linear = 100.0 * random.in_cube();
        (a.velocity.linear, b.velocity.linear) = (linear, linear);
        let closing = |a: &Instance, b: &Instance| {
            let [a, b] = [a, b].map(|i| Ahead::new(i, &BOX, 0.01));
            (a.closing(&b), a.motion() + b.motion())
        };
        assert_eq!(closing(&a, &b).0, 0.0);

        // Bodies of one rigid body: the origin of the other one leaves its circle by the second order.
        a.velocity = Velocity { linear, angular: 10.0 * random.direction() };
        b.velocity = carried(a.velocity, a.pose.translation, b.pose.translation);
        let (bound, absolute) = closing(&a, &b);
        let apart = a.pose.translation.distance(b.pose.translation);
        assert!(bound <= 0.5 * (10.0f64 * 0.01).powi(2) * apart + 1e-14 * absolute, "{bound}, {absolute}");

        // Against a body at rest that is no smaller than the way to it, all motion counts.
        b.velocity = Velocity::default();
        a.velocity.angular = DVec3::ZERO;
        let (bound, absolute) = closing(&a, &b);
        assert!((bound - absolute).abs() <= 1e-15 * absolute, "{bound} instead of {absolute}");
    }
}

#[test]
fn a_plane_that_turns_looks_as_far_as_it_moves_at_the_body() {
    let mut scene = Scene::new();
    let plane = scene.add_shape(Shape::Plane).expect("a shape");
    let ball = scene.add_shape(Shape::Sphere { radius: 0.1 }).expect("a shape");
    let turning = Velocity { linear: DVec3::ZERO, angular: DVec3::new(0.0, -1.0, 0.0) };
    let plane = scene.add(Instance { velocity: turning, ..Instance::new(plane, Pose::IDENTITY) });
    let plane = plane.expect("an instance");
    // The plane rises by 0.5 at the ball.
    let at = Pose::at(DVec3::new(5.0, 0.0, 0.5));
    let ball = scene.add(Instance::new(ball, at)).expect("an instance");
    let options = CollideOptions { speculative_time: 0.1, ..CollideOptions::default() };
    assert!(!detect(&scene, &options).expect("contacts").is_empty());
    let distance = why(&scene, &options, ball, plane, None).expect("a report").contact_distance;
    let pairs = instance_pairs(&scene, 0.0, 0.1).expect("pairs");
    assert_eq!(pairs[0].contact_distance, distance);
    assert!((0.5..0.53).contains(&distance), "{distance}");
}

/// Balls that hit each other within the time are pairs, and their gap is within the contact distance.
#[test]
fn no_impact_is_missed() {
    let mut random = Random(11);
    let (mut impacts, mut dropped) = (0, 0);
    for _ in 0..3000 {
        let mut scene = Scene::new();
        let ball = Shape::Sphere { radius: 0.2 };
        let common = velocity(&mut random);
        let ids: Vec<_> = (0..6)
            .map(|_| {
                let mut i = instance(&mut scene, ball.clone(), &mut random);
                (i.scale, i.pose.translation) = (1.0, random.in_cube());
                let own = velocity(&mut random);
                i.velocity = carried(common, DVec3::ZERO, i.pose.translation);
                i.velocity.linear += 0.5 * own.linear;
                i.velocity.angular += 0.5 * own.angular;
                scene.add(i).expect("an instance")
            })
            .collect();
        let time = random.power(-2.0, -0.5).abs();
        let pairs = instance_pairs(&scene, 0.0, time).expect("pairs");
        dropped += 15 - pairs.len();
        for (k, &a) in ids.iter().enumerate() {
            for &b in &ids[k + 1..] {
                let [x, y] = [a, b].map(|id| *scene.instance(id).expect("it is there"));
                let gap =
                    |time| moved(&x, DVec3::ZERO, time).distance(moved(&y, DVec3::ZERO, time)) - 2.0 * 0.2;
                if (0..=50).any(|k| gap(time * f64::from(k) / 50.0) <= 0.0) {
                    let pair = pairs.iter().find(|p| (p.first, p.second) == (a, b)).expect("a pair");
                    assert!(gap(0.0) <= pair.contact_distance, "{} {pair:?}", gap(0.0));
                    impacts += usize::from(gap(0.0) > 0.0);
                }
            }
        }
    }
    assert!(impacts > 100 && dropped > 1000, "{impacts} impacts, {dropped} pairs dropped");
}
