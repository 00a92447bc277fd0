//! Tests of the built-in engine with simple shapes and hand-made contacts.
use tesdf::collide::{
    CollideError, CollideOptions, Contacts, Instance, Mode, Pose, Scene, Shape, Velocity, detect,
};
use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::newton::{Newton, NewtonOptions};
use tesdf_sim::{Dynamics, DynamicsError, Mass, MassProperties, State, System};

const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

fn nothing(_: &Scene, _: &CollideOptions) -> Result<Contacts, CollideError> {
    Ok(Contacts::default())
}

fn nodes(contact_distance: f64) -> CollideOptions {
    CollideOptions { contact_distance, ..CollideOptions::with_mode(Mode::Node) }
}

/// A free body of density 1000 kg/m³.
fn add_free(system: &mut System, shape: Shape, pose: Pose, velocity: Velocity) -> usize {
    let mass = MassProperties::of_shape(&shape, 1.0, 1000.0).unwrap();
    let shape = system.add_shape(shape).unwrap();
    system.add("free", Instance { velocity, ..Instance::new(shape, pose) }, Mass::Free(mass)).unwrap()
}

fn add_plane(system: &mut System, pose: Pose) {
    let plane = system.add_shape(Shape::Plane).unwrap();
    system.add("floor", Instance::new(plane, pose), Mass::Fixed).unwrap();
}

const BRICK: Shape = Shape::Box { half_extents: DVec3::new(0.01, 0.02, 0.03) };

#[test]
fn free_fall_is_symplectic_euler() {
    let mut system = System::new(GRAVITY);
    let velocity = Velocity { linear: DVec3::new(1.0, 0.0, 2.0), angular: DVec3::ZERO };
    let body = add_free(&mut system, BRICK, Pose::at(DVec3::Z), velocity);
    let mut engine = Newton::new(system, nothing, nodes(0.0), NewtonOptions::default()).unwrap();
    let (h, steps) = (1e-3, 100);
    for _ in 0..steps {
        let report = engine.step(h).unwrap();
        assert_eq!((report.contacts, report.deepest, report.detections), (0, None, 1));
    }
    let State { pose, linear, angular } = engine.system().states()[body];
    let (n, t) = (f64::from(steps), f64::from(steps) * h);
    let expected = DVec3::Z + velocity.linear * t + GRAVITY * (h * h * n * (n + 1.0) / 2.0);
    assert!(pose.translation.distance(expected) < 1e-14);
    assert!(linear.distance(velocity.linear + GRAVITY * t) < 1e-13);
    assert_eq!((pose.rotation, angular), (DQuat::IDENTITY, DVec3::ZERO));
}

/// Without torque, a body keeps its angular momentum exactly and its energy to second order in the
/// time step: half the step gives a quarter of the drift.
#[test]
fn torque_free_rotation_keeps_momentum_and_energy() {
    let drift = |h: f64| {
        let mut system = System::new(DVec3::ZERO);
        let angular = DVec3::new(2.0, 3.0, 1.0);
        let velocity = Velocity { linear: DVec3::ZERO, angular };
        add_free(&mut system, BRICK, Pose::IDENTITY, velocity);
        let (energy, momentum) = (system.kinetic_energy(), system.momentum().1);
        let mut engine = Newton::new(system, nothing, nodes(0.0), NewtonOptions::default()).unwrap();
        for _ in 0..(1.0 / h).round() as usize {
            engine.step(h).unwrap();
        }
        let after = engine.system();
        assert!(after.momentum().1.distance(momentum) < 1e-12 * momentum.length());
        (after.kinetic_energy() - energy).abs() / energy
    };
    // One substep of a rotation each.
    let [coarse, fine] = [drift(4e-3), drift(2e-3)];
    assert!(coarse < 1e-4, "{coarse}");
    assert!((3.8..4.2).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn detections_end_once_a_step_has_settled() {
    // The brick slides, or rests.
    for (speed, settled, expected) in [(0.1, 0.0, 9), (0.1, 1e-6, 2), (0.0, 0.0, 1)] {
        let mut system = System::new(GRAVITY);
        add_plane(&mut system, Pose::IDENTITY);
        let velocity = Velocity { linear: speed * DVec3::X, ..Velocity::default() };
        add_free(&mut system, BRICK, Pose::at(DVec3::new(0.0, 0.0, 0.03)), velocity);
        let options = NewtonOptions { redetections: 8, settled, ..NewtonOptions::default() };
        let mut engine = Newton::new(system, detect, nodes(1e-3), options).unwrap();
        for _ in 0..10 {
            assert_eq!(engine.step(1e-3).unwrap().detections, expected, "{speed} m/s, {settled}");
        }
    }
}

#[test]
fn a_box_comes_to_rest_on_a_plane() {
    let tilt = DQuat::from_scaled_axis(DVec3::new(0.3, 0.2, 0.0));
    for redetections in 0..=2 {
        let mut system = System::new(GRAVITY);
        add_plane(&mut system, Pose::IDENTITY);
        let start = Pose { translation: DVec3::new(0.0, 0.0, 0.045), rotation: tilt };
        let body = add_free(&mut system, BRICK, start, Velocity::default());
        let options = NewtonOptions { redetections, ..NewtonOptions::default() };
        let mut engine = Newton::new(system, detect, nodes(1e-3), options).unwrap();
        let energy = |engine: &Newton| engine.system().kinetic_energy() + engine.system().potential_energy();
        let weight = 0.048 * 9.81;
        let mut before = energy(&engine);
        for step in 0..1500 {
            let report = engine.step(1e-3).unwrap();
            assert!(report.converged, "{report:?}");
            // Removing a penetration lifts the box by its depth. Nothing else may add energy.
            let lift = weight * (-report.deepest.unwrap_or(0.0)).max(0.0);
            let now = energy(&engine);
            assert!(now <= before + 1.001 * lift + 1e-12, "step {step}: {before} J to {now} J, {lift}");
            before = now;
        }
        let State { pose, linear, angular } = engine.system().states()[body];
        // Nothing stops a rotation about the normal.
        let rolling = angular.truncate().length();
        assert!(linear.length() < 1e-4 && rolling < 1e-2, "{linear} {angular}");
        // The box lies on a side: its lowest corner touches the plane, within the sag of 1e-7 m.
        let corners = (0..8).map(|k| {
            let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            pose.to_world(DVec3::new(0.01 * sign(0), 0.02 * sign(1), 0.03 * sign(2))).z
        });
        let lowest = corners.fold(f64::INFINITY, f64::min);
        assert!(lowest.abs() < 2e-6, "{lowest}");
    }
}

/// Contacts at the initial poses conserve linear and angular momentum. Pushing bodies apart moves
/// their centres, and a re-detected contact acts where the bodies were predicted to touch. Both
/// change the angular momentum to first order in the time step.
#[test]
fn a_collision_of_two_bodies_keeps_momentum() {
    let angular_error = |options: NewtonOptions, h: f64| {
        let mut system = System::new(DVec3::ZERO);
        let turned = DQuat::from_scaled_axis(DVec3::new(0.4, 0.5, 0.6));
        let speed = |x: f64| Velocity { linear: DVec3::new(x, 0.1, 0.0), angular: DVec3::new(0.0, 1.0, 3.0) };
        let cube = Shape::Box { half_extents: DVec3::splat(0.02) };
        add_free(&mut system, cube, Pose { translation: DVec3::ZERO, rotation: turned }, speed(0.5));
        let ball = Shape::Sphere { radius: 0.02 };
        add_free(&mut system, ball, Pose::at(DVec3::new(0.08, 0.01, 0.005)), speed(-0.5));
        let (linear, angular) = system.momentum();
        let energy = system.kinetic_energy();
        let mut engine = Newton::new(system, detect, nodes(1e-3), options).unwrap();
        for _ in 0..(0.15 / h).round() as usize {
            engine.step(h).unwrap();
        }
        let system = engine.system();
        let speeds = [0, 1].map(|body| system.states()[body].linear.x);
        assert!(speeds[0] < 0.4 && speeds[1] > -0.4, "no collision: {speeds:?}");
        assert!(system.kinetic_energy() < energy);
        let (linear_after, angular_after) = system.momentum();
        assert!(linear_after.distance(linear) < 1e-14, "{linear} {linear_after}");
        angular_after.distance(angular) / angular.length()
    };
    let plain = NewtonOptions { redetections: 0, correction: 0.0, ..NewtonOptions::default() };
    let exact = angular_error(plain, 5e-4);
    assert!(exact < 1e-12, "{exact:e}");
    let [coarse, fine] = [1e-3, 1.25e-4].map(|h| angular_error(NewtonOptions::default(), h));
    assert!(coarse < 0.05 && fine < coarse / 4.0, "{coarse} {fine}");
}

#[test]
fn a_fast_ball_does_not_pass_a_plane() {
    let mut system = System::new(GRAVITY);
    let tilted = DQuat::from_rotation_x(0.5);
    add_plane(&mut system, Pose { translation: DVec3::ZERO, rotation: tilted });
    let velocity = Velocity { linear: DVec3::new(0.0, 0.0, -50.0), angular: DVec3::ZERO };
    let radius = 0.01;
    let ball = add_free(&mut system, Shape::Sphere { radius }, Pose::at(0.3 * DVec3::Z), velocity);
    let mut engine = Newton::new(system, detect, nodes(1e-4), NewtonOptions::default()).unwrap();
    for _ in 0..30 {
        engine.step(5e-3).unwrap();
        let height = (tilted * DVec3::Z).dot(engine.system().states()[ball].pose.translation);
        // The springs yield by 1 / κ of the motion in a step.
        assert!(height > radius - 50.0 * 5e-3 / 100.0, "{height}");
    }
}

/// Ten bricks that fall on a plane and never meet form ten islands, which are solved in parallel.
#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let run = || {
        let mut system = System::new(GRAVITY);
        add_plane(&mut system, Pose::IDENTITY);
        for k in 0..10 {
            let rotation = DQuat::from_scaled_axis(DVec3::new(0.1, 0.2, 0.3) * f64::from(k));
            let translation = DVec3::new(0.1 * f64::from(k), 0.0, 0.04);
            add_free(&mut system, BRICK, Pose { translation, rotation }, Velocity::default());
        }
        let mut engine = Newton::new(system, detect, nodes(1e-3), NewtonOptions::default()).unwrap();
        let most = (0..100).map(|_| engine.step(1e-3).unwrap().islands).max();
        assert_eq!(most, Some(10));
        engine.system().states().to_vec()
    };
    let on = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run);
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(8));
}

#[test]
fn deep_overlap_is_removed_without_a_kick() {
    let mut system = System::new(DVec3::ZERO);
    add_plane(&mut system, Pose::IDENTITY);
    let body = add_free(&mut system, BRICK, Pose::at(DVec3::new(0.0, 0.0, 0.025)), Velocity::default());
    let mut engine = Newton::new(system, detect, nodes(1e-3), NewtonOptions::default()).unwrap();
    let mut depth = 0.005;
    for _ in 0..200 {
        let report = engine.step(1e-3).unwrap();
        assert!(engine.system().states()[body].linear.length() < 1e-6);
        let now = 0.03 - engine.system().states()[body].pose.translation.z;
        // A solution is off by less than 0.1 nm.
        assert!(now <= depth + 1e-10, "{depth} {now}");
        // A step removes at most half of the depth, and at most 0.5 m/s.
        assert!(depth - now <= (0.5 * depth.max(0.0)).min(0.5e-3) + 1e-10, "{depth} {now}, {report:?}");
        depth = now;
    }
    assert!(depth < 1e-6, "{depth}");
}

#[test]
fn values_out_of_range_are_refused() {
    let system = System::new(GRAVITY);
    let bad = NewtonOptions { redetections: 9, ..NewtonOptions::default() };
    let refused = Newton::new(system.clone(), nothing, nodes(0.0), bad);
    assert!(matches!(refused.err(), Some(DynamicsError::Option { option: "redetections", .. })));
    let mut engine = Newton::new(system, nothing, nodes(0.0), NewtonOptions::default()).unwrap();
    for h in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(engine.step(h), Err(DynamicsError::Option { option: "time step", .. })), "{h}");
    }
    let state = State::at_rest(Pose::IDENTITY);
    assert_eq!(engine.set_state(0, state), Err(DynamicsError::NoBody { body: 0, bodies: 0 }));
}

/// A brick that slides along the edges of its twin has no vertex inside of it, so it falls through.
/// The engine must report the hidden overlap at every step.
#[test]
fn a_hidden_overlap_of_equal_bricks_is_reported() {
    let mut system = System::new(GRAVITY);
    let shape = system.add_shape(BRICK).unwrap();
    system.add("fixed", Instance::new(shape, Pose::IDENTITY), Mass::Fixed).unwrap();
    let falling = add_free(&mut system, BRICK, Pose::at(0.061 * DVec3::Z), Velocity::default());
    let mut engine = Newton::new(system, detect, nodes(1e-5), NewtonOptions::default()).unwrap();
    let mut told = 0;
    for _ in 0..150 {
        let before = engine.system().states()[falling].pose.translation;
        engine.step(1e-3).unwrap();
        // The bricks are 0.06 m high and 0.02 m wide, and overlaps less deep than 0.05 · 0.01 m are
        // not reported.
        let is_deep = before.x.abs().max(before.y.abs()) < 1e-9 && (0.001..0.059).contains(&before.z.abs());
        assert!(!is_deep || engine.hidden().len() == 1, "nothing is told at {before}");
        told += engine.hidden().len();
    }
    let fell = engine.system().states()[falling].pose.translation.z < 0.0;
    assert!(told > 20 || !fell, "{told} steps told");
}

/// The signed distance between two boxes that stand on each other, which do not turn.
fn gaps(engine: &Newton, bodies: &[usize], height: f64) -> Vec<f64> {
    let z = |&body: &usize| engine.system().states()[body].pose.translation.z;
    let below = std::iter::once(-0.5 * height).chain(bodies.iter().map(z));
    bodies.iter().map(z).zip(below).map(|(upper, lower)| upper - lower - height).collect()
}

/// Boxes that fall together have no contacts with each other. When the floor stops the lowest, the
/// others still meet it in the same step.
#[test]
fn boxes_that_fall_together_stop_each_other() {
    let half = DVec3::new(0.02, 0.02, 0.01);
    let height = 2.0 * half.z;
    for gap in [4e-3, 5e-4, 5e-5] {
        let mut system = System::new(GRAVITY);
        add_plane(&mut system, Pose::IDENTITY);
        let velocity = Velocity { linear: DVec3::new(0.0, 0.0, -2.0), angular: DVec3::ZERO };
        let bodies: Vec<usize> = (0..8)
            .map(|k| {
                let z = 0.05 + half.z + f64::from(k) * (height + gap);
                add_free(&mut system, Shape::Box { half_extents: half }, Pose::at(z * DVec3::Z), velocity)
            })
            .collect();
        let mut engine = Newton::new(system, detect, nodes(1e-4), NewtonOptions::default()).unwrap();
        for step in 0..30 {
            let report = engine.step(5e-3).unwrap();
            let gaps = gaps(&engine, &bodies, height);
            assert!(gaps.iter().all(|&gap| gap > -1e-6), "gap {gap}, step {step}: {gaps:?}");
            // The lowest meets the floor in the fifth step.
            if step < 4 && gap > 4e-4 {
                assert_eq!((report.contacts, report.detections), (0, 1), "gap {gap}, step {step}");
            }
        }
        let rest = gaps(&engine, &bodies, height);
        assert!(rest.iter().all(|&gap| gap < 1e-6), "gap {gap}: {rest:?}");
    }
}
