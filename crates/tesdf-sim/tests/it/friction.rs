//! Friction of the built-in engine against analytic cases.
use std::fmt::Write;
use std::sync::Arc;

use tesdf::TeSdf;
use tesdf::collide::{CollideOptions, Instance, Mode, Pose, Shape, Velocity, detect};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{MeshFormat, SolidMesh, read_bytes};
use tesdf_sim::newton::{Newton, NewtonOptions};
use tesdf_sim::{Drive, Dynamics, Joint, JointKind, Mass, MassProperties, Motor, State, System, Wrench};

const G: f64 = 9.81;

fn options() -> CollideOptions {
    CollideOptions { contact_distance: 1e-3, ..CollideOptions::with_mode(Mode::Node) }
}

fn advance(engine: &mut Newton, steps: usize, h: f64) {
    for _ in 0..steps {
        engine.step(h).unwrap();
    }
}

fn engine(system: System) -> Newton {
    Newton::new(system, detect, options(), NewtonOptions::default()).unwrap()
}

/// A plane through the origin with this friction, and boxes on it at these heights of the centre.
fn boxes(gravity: DVec3, friction: f64, half: DVec3, centers: &[DVec3]) -> System {
    let mut system = System::new(gravity);
    let plane = system.add_shape(Shape::Plane).unwrap();
    system.add("floor", Instance::new(plane, Pose::IDENTITY), Mass::Fixed).unwrap();
    let shape = Shape::Box { half_extents: half };
    let mass = Mass::Free(MassProperties::of_shape(&shape, 1.0, 1000.0).unwrap());
    let shape = system.add_shape(shape).unwrap();
    for (k, &center) in centers.iter().enumerate() {
        system.add(format!("box{k}"), Instance::new(shape, Pose::at(center)), mass).unwrap();
    }
    for body in 0..=centers.len() {
        system.set_friction(body, friction).unwrap();
    }
    system
}

/// Gravity, seen from a plane that is inclined about the y axis.
fn inclined(slope: f64) -> DVec3 {
    let angle = slope.atan();
    G * DVec3::new(angle.sin(), 0.0, -angle.cos())
}

const BRICK: DVec3 = DVec3::new(0.1, 0.05, 0.02);

#[test]
fn a_box_on_an_incline_slides_as_coulomb_says() {
    let friction = 0.5;
    for slope in [0.51, 0.6, 0.8] {
        let mut engine = engine(boxes(inclined(slope), friction, BRICK, &[DVec3::new(0.0, 0.0, BRICK.z)]));
        let (h, steps) = (5e-3, 100);
        for _ in 0..steps {
            assert!(engine.step(h).unwrap().converged, "slope {slope}");
        }
        let State { pose, linear, .. } = engine.system().states()[1];
        let angle = f64::atan(slope);
        let expected = G * (angle.sin() - friction * angle.cos());
        let found = linear.x / (h * f64::from(steps));
        assert!((found / expected - 1.0).abs() < 5e-3, "slope {slope}: {found} instead of {expected}");
        // It neither lifts nor turns.
        assert!((pose.translation.z - BRICK.z).abs() < 1e-6, "slope {slope}: {pose:?}");
        assert!(pose.rotation.angle_between(DQuat::IDENTITY) < 1e-6, "slope {slope}: {pose:?}");
    }
}

#[test]
fn a_box_on_an_incline_sticks_below_the_angle_of_friction() {
    for (slope, seconds) in [(0.3, 1.0), (0.49, 10.0)] {
        let start = DVec3::new(0.0, 0.0, BRICK.z);
        let mut engine = engine(boxes(inclined(slope), 0.5, BRICK, &[start]));
        for _ in 0..(seconds / 5e-3) as usize {
            assert!(engine.step(5e-3).unwrap().converged, "slope {slope}");
        }
        let way = engine.system().states()[1].pose.translation - start;
        assert!(way.length() < 1e-7 * seconds, "slope {slope}: {way}");
    }
}

/// The way to rest is v² / 2 μ g, also when the velocity turns relative to the box, and the box
/// stays on the floor: friction must not act across a gap.
#[test]
fn a_sliding_box_comes_to_rest_where_it_must() {
    let (friction, speed) = (0.4, 1.6);
    let mut system = boxes(DVec3::new(0.0, 0.0, -G), friction, BRICK, &[DVec3::new(0.0, 0.0, BRICK.z)]);
    let start = State { linear: speed * DVec3::new(0.6, 0.8, 0.0), ..system.states()[1] };
    system.set_state(1, start).unwrap();
    let mut engine = engine(system);
    let h = 1e-3;
    for _ in 0..600 {
        engine.step(h).unwrap();
        let height = engine.system().states()[1].pose.translation.z - BRICK.z;
        assert!(height.abs() < 1e-5, "{height}");
    }
    let State { pose, linear, angular } = engine.system().states()[1];
    let expected = speed * speed / (2.0 * friction * G);
    let found = (pose.translation - start.pose.translation).truncate().length();
    assert!((found / expected - 1.0).abs() < 1e-2, "{found} instead of {expected}");
    assert!(linear.length() < 1e-7 && angular.length() < 1e-6, "{linear} {angular}");
}

/// A ball that starts without rotation rolls after 2/7 of its velocity is lost.
#[test]
fn a_sliding_ball_begins_to_roll() {
    let mut system = System::new(DVec3::new(0.0, 0.0, -G));
    let plane = system.add_shape(Shape::Plane).unwrap();
    system.add("floor", Instance::new(plane, Pose::IDENTITY), Mass::Fixed).unwrap();
    let (radius, speed) = (0.05, 1.0);
    let shape = Shape::Sphere { radius };
    let mass = Mass::Free(MassProperties::of_shape(&shape, 1.0, 1000.0).unwrap());
    let shape = system.add_shape(shape).unwrap();
    let velocity = Velocity { linear: speed * DVec3::X, angular: DVec3::ZERO };
    let ball = Instance { velocity, ..Instance::new(shape, Pose::at(radius * DVec3::Z)) };
    system.add("ball", ball, mass).unwrap();
    system.set_friction(0, 0.3).unwrap();
    system.set_friction(1, 0.3).unwrap();
    let mut engine = engine(system);
    // It slides for 2 v / 7 μ g = 0.097 s.
    for _ in 0..300 {
        engine.step(1e-3).unwrap();
    }
    let State { linear, angular, .. } = engine.system().states()[1];
    let rolling = 5.0 / 7.0 * speed;
    assert!((linear.x / rolling - 1.0).abs() < 5e-3, "{linear}");
    assert!((angular.y * radius / rolling - 1.0).abs() < 5e-3, "{angular}");
    assert!(linear.truncate().y.abs() < 1e-9 && angular.z.abs() < 1e-6, "{linear} {angular}");
}

/// A pull below the limit moves nothing, and one above it accelerates by the difference.
#[test]
fn a_pull_moves_a_box_above_the_limit_only() {
    let friction = 0.3;
    let weight = 8.0 * BRICK.x * BRICK.y * BRICK.z * 1000.0 * G;
    let run = |share: f64| {
        let mut system = boxes(DVec3::new(0.0, 0.0, -G), friction, BRICK, &[DVec3::new(0.0, 0.0, BRICK.z)]);
        let force = share * friction * weight * DVec3::new(0.8, -0.6, 0.0);
        system.set_wrench(1, Wrench { force, torque: DVec3::ZERO }).unwrap();
        let mut engine = engine(system);
        advance(&mut engine, 200, 5e-3);
        engine.system().states()[1]
    };
    let State { pose, .. } = run(0.95);
    assert!(pose.translation.truncate().length() < 1e-7, "{pose:?}");
    let found = run(1.5).linear.truncate().length();
    let expected = 0.5 * friction * G;
    assert!((found / expected - 1.0).abs() < 5e-3, "{found} instead of {expected}");
}

/// A stack on an incline: every box rests on the one below.
#[test]
fn a_leaning_stack_stays() {
    let half = DVec3::splat(0.05);
    let centers: Vec<_> = (0..5).map(|k| DVec3::new(0.0, 0.0, 0.05 + 0.1 * f64::from(k))).collect();
    let collide = CollideOptions { contact_distance: 1e-3, ..CollideOptions::default() };
    let mut engine =
        Newton::new(boxes(inclined(0.1), 0.5, half, &centers), detect, collide, NewtonOptions::default())
            .unwrap();
    for step in 0..400 {
        let report = engine.step(5e-3).unwrap();
        assert!(report.converged, "step {step}: {report:?}");
    }
    for (state, start) in engine.system().states()[1..].iter().zip(&centers) {
        let way = state.pose.translation - *start;
        assert!(way.length() < 2e-7, "{way}");
    }
}

/// A wedge pushes two blocks apart that stand on the floor. With friction μ at all faces, the force
/// that moves them follows from the balance of forces: the wedge's faces are inclined by α to the
/// vertical, so a push F gives normal forces N with F = 2 N (sin α + μ cos α), and a block of weight W
/// slides when N (cos α − μ sin α) > μ (W + N (sin α + μ cos α)).
#[test]
fn a_wedge_moves_blocks_when_the_balance_says_so() {
    let (friction, half) = (0.2, DVec3::new(0.05, 0.05, 0.05));
    let alpha = 0.3f64;
    let (sin, cos) = alpha.sin_cos();
    let weight = 8.0 * half.x * half.y * half.z * 1000.0 * G;
    let normal = friction * weight / (cos - friction * sin - friction * (sin + friction * cos));
    let limit = 2.0 * normal * (sin + friction * cos);
    for (share, moves) in [(0.97, false), (1.03, true)] {
        let mut system = System::new(DVec3::new(0.0, 0.0, -G));
        let plane = system.add_shape(Shape::Plane).unwrap();
        system.add("floor", Instance::new(plane, Pose::IDENTITY), Mass::Fixed).unwrap();
        let block = Shape::Mesh(block_with_slope(half, alpha));
        let mass =
            Mass::Free(MassProperties::of_shape(&block, 1.0, 1000.0).unwrap().with_mass(weight / G).unwrap());
        let block = system.add_shape(block).unwrap();
        let wedge = Shape::Mesh(wedge(alpha));
        let light = Mass::Free(MassProperties::of_shape(&wedge, 1.0, 1.0).unwrap());
        let wedge = system.add_shape(wedge).unwrap();
        let turned = DQuat::from_rotation_z(std::f64::consts::PI);
        system.add("right", Instance::new(block, Pose::IDENTITY), mass).unwrap();
        system
            .add("left", Instance::new(block, Pose { translation: DVec3::ZERO, rotation: turned }), mass)
            .unwrap();
        system.add("wedge", Instance::new(wedge, Pose::IDENTITY), light).unwrap();
        (0..4).for_each(|body| system.set_friction(body, friction).unwrap());
        let force = share * limit * DVec3::NEG_Z;
        system.set_wrench(3, Wrench { force, torque: DVec3::ZERO }).unwrap();
        let collide = CollideOptions { contact_distance: 1e-3, ..CollideOptions::default() };
        let mut engine = Newton::new(system, detect, collide, NewtonOptions::default()).unwrap();
        advance(&mut engine, 40, 5e-3);
        let way = [1, 2].map(|body| engine.system().states()[body].pose.translation.x);
        match moves {
            true => assert!(way[0] > 1e-4 && way[1] < -1e-4, "{way:?}"),
            false => assert!(way[0].abs() < 1e-7 && way[1].abs() < 1e-7, "{way:?}"),
        }
    }
}

/// Two fingers, each with a motor of 20 N, hold a part that touches them from the start and nothing
/// else. The motors have to push with all their force in the first step, however slow their targets
/// are. Friction then holds 2 μ 20 N.
#[test]
fn motors_that_stall_push_with_all_their_force() {
    let (friction, limit) = (0.5, 20.0);
    for (velocity, share) in
        [(1e-2, 0.97), (1e-4, 0.97), (1e-6, 0.97), (1e-8, 0.97), (1e-6, 1.03), (1e-8, 1.03)]
    {
        let mut system = System::new(DVec3::new(0.0, 0.0, -G));
        let shape = Shape::Box { half_extents: DVec3::splat(0.02) };
        let weight = share * 2.0 * friction * limit;
        let mass = MassProperties::of_shape(&shape, 1.0, 1000.0).unwrap().with_mass(weight / G).unwrap();
        let shape = system.add_shape(shape).unwrap();
        let part = system.add("part", Instance::new(shape, Pose::IDENTITY), Mass::Free(mass)).unwrap();
        system.set_friction(part, friction).unwrap();
        let pad = Shape::Box { half_extents: DVec3::new(0.005, 0.03, 0.03) };
        let mass = MassProperties::of_shape(&pad, 1.0, 2700.0).unwrap();
        let pad = system.add_shape(pad).unwrap();
        for side in [-1.0, 1.0] {
            let pose = Pose::at(side * 0.025 * DVec3::X);
            let finger = system.add(format!("finger {side}"), Instance::new(pad, pose), Mass::Free(mass));
            let finger = finger.unwrap();
            system.set_friction(finger, friction).unwrap();
            let axis = Pose { rotation: DQuat::from_rotation_arc(DVec3::Z, -side * DVec3::X), ..pose };
            let slider =
                Joint::new("slider", JointKind::Slider, (None, finger), [Pose::IDENTITY, pose], axis);
            let motor = Some(Motor { drive: Drive::Velocity(velocity), limit });
            system.add_joint(Joint { motor, ..slider }).unwrap();
        }
        let mut engine = engine(system);
        for step in 0..50 {
            assert!(engine.step(5e-3).unwrap().converged, "target {velocity} m/s, step {step}");
        }
        let State { pose, linear, .. } = engine.system().states()[part];
        if share < 1.0 {
            assert!(pose.translation.z.abs() < 1e-7, "target {velocity} m/s: {pose:?}");
        } else {
            let slides = -G * (1.0 - 1.0 / share) * 0.25;
            assert!((linear.z / slides - 1.0).abs() < 0.05, "target {velocity} m/s: {linear}, {slides}");
        }
    }
}

/// The prism over a convex polygon in the x–z plane, its corners in the order from z to x.
fn prism(corners: &[[f64; 2]], half_width: f64) -> Arc<TeSdf> {
    let mut obj = String::new();
    for y in [-half_width, half_width] {
        corners.iter().for_each(|[x, z]| writeln!(obj, "v {x} {y} {z}").unwrap());
    }
    let n = corners.len();
    for k in 2..n {
        writeln!(obj, "f 1 {} {k}\nf {} {} {}", k + 1, n + 1, n + k, n + k + 1).unwrap();
    }
    for k in 1..=n {
        let l = k % n + 1;
        writeln!(obj, "f {k} {l} {}\nf {k} {} {}", n + l, n + l, n + k).unwrap();
    }
    let solid = SolidMesh::new(read_bytes(obj.as_bytes(), MeshFormat::Obj).unwrap().mesh).unwrap();
    Arc::new(Encoder::new().preset(Preset::Fast).encode(&solid).unwrap())
}

/// A block on the floor to the right of a wedge of half angle `alpha`, whose tip is 2 cm above the
/// floor.
fn block_with_slope(half: DVec3, alpha: f64) -> Arc<TeSdf> {
    let x = |z: f64| (z - 0.02).max(0.0) * alpha.tan() + 0.01;
    let top = 2.0 * half.z;
    prism(
        &[
            [x(0.0), 0.0],
            [x(0.02), 0.02],
            [x(top), top],
            [0.01 + 2.0 * half.x, top],
            [0.01 + 2.0 * half.x, 0.0],
        ],
        half.y,
    )
}

/// The wedge: a cut-off tip of 2 cm of width, 3 cm above the floor.
fn wedge(alpha: f64) -> Arc<TeSdf> {
    let x = |z: f64| (z - 0.02) * alpha.tan() + 0.01;
    prism(&[[-x(0.03), 0.03], [-x(0.09), 0.09], [x(0.09), 0.09], [x(0.03), 0.03]], 0.04)
}
