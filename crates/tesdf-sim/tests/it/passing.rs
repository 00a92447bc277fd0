//! Fast bodies do not pass into others: at the end of each step they are at most a little deep, and
//! no report says that it could not be shown.
use tesdf::collide::{ClearanceOptions, Instance, Pose, Scene, Shape, Velocity, clearance};
use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::{State, StepReport};

use crate::support::bench::{Bench, Body, Kind, STEP};

/// Largest depth at the end of a step, as part of the diagonal of the smaller body.
const DEPTH: f64 = 5e-4;

/// Largest gain of energy in a step that is divided, as part of that at the start.
const GAIN: f64 = 1e-9;

/// Half extents of the box that is shot, m.
const SHOT: DVec3 = DVec3::new(0.02, 0.01, 0.015);

/// kg.
const MASS: f64 = 0.1;

/// The least clearance of two boxes over a run, m.
fn least_clearance(run: &[Vec<State>], halves: [DVec3; 2]) -> f64 {
    let mut scene = Scene::new();
    let boxes = halves.map(|half_extents| {
        let shape = scene.add_shape(Shape::Box { half_extents }).unwrap();
        scene.add(Instance::new(shape, Pose::IDENTITY)).unwrap()
    });
    let distance = |states: &Vec<State>| {
        scene.set_poses(&[0, 1].map(|k| (boxes[k], states[k].pose))).unwrap();
        clearance(&scene, boxes[0], boxes[1], &ClearanceOptions::default()).unwrap().distance
    };
    run.iter().map(distance).fold(f64::INFINITY, f64::min)
}

/// Energy of the motion of a box, J.
fn energy(state: &State, half: DVec3) -> f64 {
    let square = half * half;
    let inertia = MASS / 3.0 * (DVec3::splat(square.element_sum()) - square);
    let spin = state.pose.rotation.inverse() * state.angular;
    0.5 * (MASS * state.linear.length_squared() + (inertia * spin).dot(spin))
}

/// A rotation, or a vector within a cube.
fn random(random: &mut fastrand::Rng) -> (DQuat, DVec3) {
    let mut sine = || 2.0 * random.f64() - 1.0;
    (DQuat::from_xyzw(sine(), sine(), sine(), sine()).normalize(), DVec3::new(sine(), sine(), sine()))
}

/// Checks that two boxes stay out of each other. Returns how often parts of steps were divided.
fn check_depth(name: &str, (run, reports): &(Vec<Vec<State>>, Vec<StepReport>), halves: [DVec3; 2]) -> u32 {
    let least = least_clearance(run, halves);
    let smaller = 2.0 * halves[0].length().min(halves[1].length());
    assert!(least > -DEPTH * smaller, "{name}: {least} m");
    assert!(reports.iter().all(|report| report.unbounded == 0), "{name}: {reports:?}");
    reports.iter().map(|report| report.divided).sum()
}

/// Boxes in any orientation are shot at a thin plate. Their corners do not dip into it, and no step
/// that is divided adds energy.
#[test]
fn corners_of_a_fast_box_stay_out_of_a_thin_plate() {
    let bench = Bench::new();
    let plate = DVec3::new(0.2, 0.2, 5e-4);
    let source = &mut fastrand::Rng::with_seed(11);
    let dips =
        DQuat::from_xyzw(-0.465932959857117, -0.10758051299051212, -0.5614776616776306, 0.6753338030785256);
    let mut shots = vec![(20.0, dips)];
    for speed in [10.0, 20.0, 35.0, 50.0, 100.0] {
        shots.extend((0..6).map(|_| (speed, random(source).0)));
    }
    let mut divided = 0;
    for (speed, rotation) in shots {
        let name = format!("{speed} m/s, {rotation}");
        let translation = DVec3::new(0.03, 0.02, 0.1 + 1.4 * speed * STEP);
        let shot = Body::free(bench.cuboid(Kind::Mesh, SHOT), MASS, Pose { translation, rotation });
        let bodies = [Body::fixed(bench.cuboid(Kind::Mesh, plate)), shot.moving(-speed * DVec3::Z)];
        let watched = bench.watch("gravity = [0, 0, 0]", &bodies, 0.2 / speed + 8.0 * STEP);
        divided += check_depth(&name, &watched, [plate, SHOT]);
        let energies: Vec<f64> = watched.0.iter().map(|states| energy(&states[1], SHOT)).collect();
        for (pair, report) in energies.windows(2).zip(&watched.1).filter(|(_, report)| report.divided > 0) {
            let gain = (pair[1] - pair[0]) / energies[0];
            assert!(gain < GAIN, "{name}: gains {gain} of its energy, {report:?}");
        }
        // Else the box has not met the plate.
        let last = watched.0[watched.0.len() - 1][1];
        assert!(last.linear.z > -0.5 * speed, "{name}: {last:?}");
    }
    assert!(divided > 0);
}

/// A bar on a hinge meets a post at any speed. It stops, and does not turn into it.
#[test]
fn a_bar_on_a_hinge_stays_out_of_a_post() {
    let bench = Bench::new();
    let (bar, post) = (DVec3::new(0.1, 0.005, 0.005), DVec3::new(0.005, 0.005, 0.05));
    let center = 0.08 * DVec3::new(0.7f64.cos(), 0.7f64.sin(), 0.0);
    let hinge = "joints = [{ name = \"hinge\", kind = \"hinge\", child = \"1\", anchor = [0, 0, 0] }]";
    for kind in [Kind::Mesh, Kind::Shape] {
        for speed in [50.0, 90.0, 110.0, 130.0, 150.0, 170.0, 199.0, 300.0, 700.0, 2000.0] {
            let name = format!("{kind:?}, {speed} rad/s");
            let fixed = Body { pose: Pose::at(center), ..Body::fixed(bench.cuboid(kind, post)) };
            let velocity = Velocity { linear: DVec3::ZERO, angular: speed * DVec3::Z };
            let turning = Body::free(bench.cuboid(kind, bar), MASS, Pose::IDENTITY);
            let watched = bench.watch(hinge, &[fixed, Body { velocity, ..turning }], 10.0 * STEP);
            check_depth(&name, &watched, [post, bar]);
            let end = watched.0[watched.0.len() - 1][1].angular.length();
            assert!(end < 1e-6 * speed, "{name}: turns on with {end} rad/s");
        }
    }
}

/// Two free boxes that spin meet at any place.
#[test]
fn boxes_that_spin_stay_out_of_each_other() {
    let bench = Bench::new();
    let card = DVec3::new(0.03, 0.002, 0.02);
    let mut divided = 0;
    for seed in 0..24 {
        let source = &mut fastrand::Rng::with_seed(seed);
        let kind = if seed % 2 == 0 { Kind::Mesh } else { Kind::Shape };
        let friction = if seed % 4 < 2 { 0.5 } else { 0.0 };
        let speed = 10.0 * 10f64.powf(source.f64());
        let mut body = |half, height: f64, speed: f64| {
            let ((rotation, aside), (_, spin)) = (random(source), random(source));
            let translation = 0.01 * aside.with_z(0.0) + height * DVec3::Z;
            let free = Body::free(bench.cuboid(kind, half), MASS, Pose { translation, rotation });
            let velocity = Velocity { linear: -speed * DVec3::Z, angular: 200.0 * spin };
            Body { friction, velocity, ..free }
        };
        let bodies = [body(card, 0.0, 0.0), body(SHOT, 0.1 + 1.4 * speed * STEP, speed)];
        let watched = bench.watch("gravity = [0, 0, 0]", &bodies, 0.2 / speed + 8.0 * STEP);
        divided += check_depth(&format!("seed {seed}, {speed} m/s"), &watched, [card, SHOT]);
    }
    assert!(divided > 0);
}

/// Bodies that rest or move slowly pay nothing.
#[test]
fn slow_pairs_are_not_followed() {
    let bench = Bench::new();
    let half = DVec3::splat(0.05);
    let cube = |height: f64| {
        let pose = Pose::at((half.z + height) * DVec3::Z);
        Body { friction: 0.3, ..Body::free(bench.cuboid(Kind::Mesh, half), 1.0, pose) }
    };
    let slides = cube(0.1).moving(DVec3::X);
    let (_, reports) = bench.watch("", &[Body::plane(0.3), cube(0.0), slides], 0.1);
    for StepReport { parts, followed, divided, .. } in reports {
        assert_eq!((parts, followed, divided), (1, 0, 0));
    }
}
