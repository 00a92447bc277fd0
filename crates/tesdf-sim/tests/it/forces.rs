//! The forces of contacts and joints that a step tells.
use std::ops::ControlFlow;

use tesdf::collide::{CollideError, CollideOptions, Contacts, Instance, Pose, Scene, Shape};
use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::newton::{Newton, NewtonOptions};
use tesdf_sim::record::RunRecord;
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{
    ContactForce, Drive, Dynamics, Forces, Joint, JointKind, Mass, MassProperties, Motor, State, StepReport,
    System, simulate,
};

use crate::support::bench::{Bench, Body, Kind, STEP, ball};
use crate::support::meshes::{cuboid, tiles};

const G: f64 = 9.81;

const HALF: DVec3 = DVec3::new(0.03, 0.02, 0.01);

/// The forces of each step of a run, and the states at its beginning and end.
fn steps(settings: &str, bodies: &[Body], duration: f64, bench: &Bench) -> (System, Vec<Step>) {
    let loaded = bench.load(settings, bodies, duration);
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let steps = (0..(duration / STEP).round() as usize).map(|_| {
        let before = engine.system().states().to_vec();
        let report = engine.step(STEP).unwrap();
        Step {
            before,
            forces: engine.forces().unwrap().clone(),
            after: engine.system().states().to_vec(),
            report,
        }
    });
    let steps = steps.collect();
    (engine.system().clone(), steps)
}

struct Step {
    before: Vec<State>,
    forces: Forces,
    after: Vec<State>,
    report: StepReport,
}

#[test]
fn the_forces_of_a_stack_are_its_weight() {
    let bench = Bench::new();
    for kind in [Kind::Mesh, Kind::Shape] {
        for sleep in ["", "[solver]\nsleep = 0"] {
            let at = |k: i32| Pose::at(DVec3::Z * HALF.z * f64::from(2 * k + 1));
            let boxes = (0..3).map(|k| Body::free(bench.cuboid(kind, HALF), 1.0 + f64::from(k), at(k)));
            let bodies: Vec<Body> = std::iter::once(Body::plane(0.5)).chain(boxes).collect();
            let (_, steps) = steps(sleep, &bodies, 2.0, &bench);
            let Step { forces, report, .. } = &steps[steps.len() - 1];
            assert_eq!(report.asleep, if sleep.is_empty() { 3 } else { 0 });
            for (body, sum) in forces.on_each(4).into_iter().enumerate() {
                let weight = [6.0, -1.0, -2.0, -3.0][body] * -G;
                assert!((sum - weight * DVec3::Z).length() < 1e-4, "{body}: {sum}");
                assert!(sum.distance(forces.on(body)) < 1e-9, "{body}: {sum} {}", forces.on(body));
            }
            for (below, weight) in [(0, 6.0), (1, 5.0), (2, 3.0)] {
                let between = forces.contacts.iter().filter(|c| c.bodies.contains(&below));
                let between = between.filter(|c| c.bodies.contains(&(below + 1)));
                let up = |c: &ContactForce| if c.bodies[0] == below { -c.force() } else { c.force() };
                let sum: DVec3 = between.map(up).sum();
                let off = sum.distance(weight * G * DVec3::Z) / (weight * G);
                assert!(off < 1e-6, "{kind:?}, {sleep}, on body {below}: {sum}");
            }
            assert!(forces.on(2).distance(2.0 * G * DVec3::Z) < 1e-6 * G, "{}", forces.on(2));
        }
    }
}

/// Momentum and angular momentum of every step change by the impulses of its contacts, and by
/// gravity.
#[test]
fn impulses_are_the_change_of_momentum() {
    let bench = Bench::new();
    let pose =
        Pose { translation: DVec3::Z * 0.15, rotation: DQuat::from_scaled_axis(DVec3::new(0.4, 0.7, 0.2)) };
    for kind in [Kind::Mesh, Kind::Shape] {
        let thrown = Body::free(bench.cuboid(kind, HALF), 0.4, pose).moving(DVec3::new(0.7, 0.2, 0.0));
        let bodies =
            [Body::plane(0.4), thrown, Body::free(ball(0.02), 0.2, Pose::at(DVec3::new(0.1, 0.0, 0.02)))];
        let (system, steps) = steps("", &bodies, 0.6, &bench);
        let mut greatest = 0.0_f64;
        for (k, Step { before, forces, after, report }) in steps.iter().enumerate() {
            for body in [1, 2] {
                let Mass::Free(mass) = system.bodies()[body].mass else { panic!() };
                let spin = |state: &State| mass.inertia_in_world(state.pose) * state.angular;
                let (a, b) = (&before[body], &after[body]);
                let impulse = STEP * (forces.on(body) - mass.mass * G * DVec3::Z);
                let off = (mass.mass * (b.linear - a.linear)).distance(impulse);
                assert!(off < 1e-9, "{kind:?}, step {k}, body {body}: off by {off:e} N s");
                let center = a.pose.to_world(mass.center);
                let torque = |c: &ContactForce| match c.bodies.iter().position(|b| *b == body) {
                    Some(side) => (c.point - center).cross([1.0, -1.0][side] * c.force()),
                    None => DVec3::ZERO,
                };
                let torque: DVec3 = forces.contacts.iter().map(torque).sum();
                let off = (spin(b) - spin(a)).distance(STEP * torque);
                // A contact is where it is found: at most as far from here as the body moves in the step.
                let way = STEP * a.linear.length().max(b.linear.length()) + 0.01 * HALF.length();
                let most = 1e-9 + way * STEP * forces.on(body).length();
                assert!(
                    report.parts > 1 || off < most,
                    "{kind:?}, step {k}, body {body}: off by {off:e} N m s"
                );
                greatest = greatest.max(forces.on(body).length());
            }
        }
        assert!(greatest > 20.0, "nothing was hit: {greatest} N");
    }
}

fn nothing(_: &Scene, _: &CollideOptions) -> Result<Contacts, CollideError> {
    Ok(Contacts::default())
}

/// A bar of 0.2 m along x, of which one end is at the origin, on a joint there.
fn on_a_joint(kind: JointKind, motor: Option<Motor>) -> (Newton, MassProperties) {
    let mut system = System::new(-G * DVec3::Y);
    let shape = Shape::Box { half_extents: DVec3::new(0.1, 0.01, 0.02) };
    let mass = MassProperties::of_shape(&shape, 1.0, 1000.0).unwrap();
    let shape = system.add_shape(shape).unwrap();
    let pose = Pose::at(0.1 * DVec3::X);
    system.add("bar", Instance::new(shape, pose), Mass::Free(mass)).unwrap();
    let joint = Joint::new("joint", kind, (None, 0), [Pose::IDENTITY, pose], Pose::IDENTITY);
    system.add_joint(Joint { motor, ..joint }).unwrap();
    let options = NewtonOptions { sleep: 0.0, ..NewtonOptions::default() };
    (Newton::new(system, nothing, CollideOptions::default(), options).unwrap(), mass)
}

#[test]
fn a_weld_and_a_motor_carry_a_bar() {
    let hold = Motor { drive: Drive::Position(0.0), limit: f64::INFINITY };
    for (kind, motor) in [(JointKind::Weld, None), (JointKind::Hinge, Some(hold))] {
        let (mut engine, mass) = on_a_joint(kind, motor);
        (0..3).for_each(|_| assert!(engine.step(STEP).unwrap().converged));
        let joint = engine.forces().unwrap().joints[0];
        let (weight, torque) = (mass.mass * G, 0.1 * mass.mass * G);
        assert!(joint.force.distance(weight * DVec3::Y) < 1e-6 * weight, "{kind:?}: {joint:?}");
        assert!(joint.torque.distance(torque * DVec3::Z) < 1e-6 * torque, "{kind:?}: {joint:?}");
        let of_motor = if motor.is_some() { torque } else { 0.0 };
        assert!((joint.motor - of_motor).abs() < 1e-6 * torque, "{kind:?}: {joint:?}");
    }
}

/// A pendulum that falls from the horizontal pulls with m g sin φ + m l φ̇² along the bar, and
/// with a quarter of m g cos φ across it, at any angle φ below the horizontal.
#[test]
fn a_pendulum_pulls_at_its_hinge() {
    let (mut engine, mass) = on_a_joint(JointKind::Hinge, None);
    let h = 1e-4;
    for step in 1..3000 {
        let rate = engine.system().coordinate_rates()[0];
        let angle = -engine.system().coordinates()[0];
        engine.step(h).unwrap();
        let joint = engine.forces().unwrap().joints[0];
        let along = DVec3::new(angle.cos(), -angle.sin(), 0.0);
        let across = DVec3::new(angle.sin(), angle.cos(), 0.0);
        // A bar of 0.2 by 0.02 m: l² of the mass at the end of its arm, and its own inertia.
        let (m, l) = (mass.mass, 0.1);
        let share = mass.inertia.z_axis.z / (mass.inertia.z_axis.z + m * l * l);
        let pull = m * G * angle.sin() + m * l * rate * rate;
        let expected = -pull * along + share * m * G * angle.cos() * across;
        let off = joint.force.distance(expected) / (m * G);
        assert!(off < 3e-3, "step {step}: {} N, not {expected}", joint.force);
        assert!(joint.torque.z.abs() < 1e-9 && joint.motor == 0.0, "step {step}: {joint:?}");
    }
}

/// The coordinate of a hinge goes on past half a turn, however far a step turns.
#[test]
fn coordinates_count_turns() {
    for (rate, h) in [(7.0, 0.01), (-40.0, 0.01), (500.0, 0.01)] {
        let drive = Drive::Velocity(rate);
        let (mut engine, _) = on_a_joint(JointKind::Hinge, Some(Motor { drive, limit: f64::INFINITY }));
        (0..200).for_each(|_| assert!(engine.step(h).unwrap().converged));
        let [coordinate] = *engine.system().coordinates() else { panic!() };
        assert!((coordinate / (200.0 * h * rate) - 1.0).abs() < 2e-3, "{rate} rad/s: {coordinate} rad");
        let found = engine.system().coordinate_rates()[0];
        assert!((found / rate - 1.0).abs() < 1e-2, "{rate} rad/s: {found}");
    }
}

/// A box on a floor and a pendulum, with forces in the record of every third step.
const RECORDED: &str = r#"
time_step = 2e-3
duration = 0.02

[record]
forces_every = 3

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "box"
shape = { box = { half_extents = [0.02, 0.02, 0.01] } }
mass = 0.5
translation = [0, 0, 0.01]

[[bodies]]
name = "bob"
shape = { sphere = { radius = 0.01 } }
mass = 0.2
translation = [0.2, 0, 0.1]

[[joints]]
name = "pivot"
kind = "hinge"
child = "bob"
anchor = [0.25, 0, 0.1]
axis = [0, 1, 0]
"#;

#[test]
fn a_record_has_the_forces_of_its_steps() {
    let loaded = LoadedScene::parse(RECORDED.into(), "scene.toml").unwrap();
    let engine = || loaded.newton(loaded.system().unwrap()).unwrap();
    let (record, _) = simulate(&loaded.scene, &mut engine(), |_| ControlFlow::Continue(())).unwrap();
    let read = RunRecord::from_bytes(&record.to_bytes().unwrap()).unwrap();
    assert_eq!((&read, &read.joints[..]), (&record, &["pivot".to_string()][..]));
    let mut again = engine();
    let mut told = Vec::new();
    for step in 0..10 {
        again.step(2e-3).unwrap();
        if step % 3 == 0 {
            told.push((step, again.forces().unwrap().clone()));
        }
    }
    let near = |a: DVec3, b: DVec3| a.distance(b) <= 1e-6 * (a.length() + 1e-3);
    let all: Vec<_> = read.forces().collect();
    assert_eq!(all.len(), told.len());
    for ((step, found), (expected_step, expected)) in all.iter().zip(&told) {
        assert_eq!(step, expected_step);
        assert!(!found.contacts.is_empty() && found.contacts.len() == expected.contacts.len());
        for (a, b) in found.contacts.iter().zip(&expected.contacts) {
            assert_eq!((a.bodies, a.point), (b.bodies, b.point));
            assert!(near(a.force(), b.force()) && near(a.normal, b.normal), "step {step}: {a:?} {b:?}");
        }
        let [a, b] = [found.joints[0], expected.joints[0]];
        assert!(near(a.force, b.force) && near(a.torque, b.torque) && a.force.length() > 0.01, "{a:?}");
    }
    let latest: Vec<u64> = (0..10).map(|step| read.latest_forces(step).unwrap().0).collect();
    assert_eq!(latest, [0, 0, 0, 3, 3, 3, 6, 6, 6, 9]);
}

/// A block whose sides are finely meshed slides and stops as one of twelve faces, on a plane and on a mesh,
/// and its corners alone carry it.
#[test]
fn flat_patches_are_carried_by_their_corners() {
    let bench = Bench::new();
    let half = DVec3::new(0.05, 0.05, 0.01);
    let fine = bench.mesh("fine", &tiles(9, 0.1, 0.02));
    let coarse = bench.mesh("coarse", &cuboid(DVec3::new(-0.05, -0.05, -0.02), DVec3::new(0.05, 0.05, 0.0)));
    let slab = bench.cuboid(Kind::Mesh, DVec3::new(1.0, 1.0, half.z));
    let under = Pose::at(DVec3::Z * -half.z);
    for floor in [Body::plane(0.3), Body { pose: under, friction: 0.3, ..Body::fixed(slab) }] {
        let runs = [&fine, &coarse].map(|block| {
            let block = Body::free(block.clone(), 0.5, Pose::at(DVec3::Z * 0.02));
            let block = Body { friction: 0.3, ..block.moving(DVec3::X * 0.6) };
            steps("[solver]\nsleep = 0", &[floor.clone(), block], 0.5, &bench).1
        });
        let [fine, coarse] = runs;
        for (k, (fine, coarse)) in fine.iter().zip(&coarse).enumerate() {
            let [a, b] = [fine, coarse].map(|step| step.after[1].pose);
            assert!(a.translation.distance(b.translation) < 1e-5, "{k}: {a:?} {b:?}");
            assert!(a.rotation.angle_between(b.rotation) < 1e-4, "{k}: {a:?} {b:?}");
            assert!(fine.report.contacts >= 100, "{k}: {}", fine.report.contacts);
            let carrying = fine.forces.contacts.iter().filter(|c| c.force().length() > 1e-9);
            let carrying: Vec<DVec3> = carrying.map(|c| c.point).collect();
            assert!((3..=4).contains(&carrying.len()), "{k}: {carrying:?}");
        }
        let up = fine[fine.len() - 1].forces.on(1);
        assert!(up.distance(0.5 * G * DVec3::Z) < 1e-6 * G, "{up}");
    }
}
