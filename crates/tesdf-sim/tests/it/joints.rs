//! Joints and motors of the built-in engine against analytic cases.
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use tesdf::collide::{
    CollideError, CollideOptions, Contacts, Instance, Pose, Scene, Shape, ShapeId, Velocity, detect,
};
use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::newton::{Newton, NewtonOptions};
use tesdf_sim::{
    Drive, Dynamics, Joint, JointKind, JointResistance, Mass, MassProperties, Motor, State, System, Wrench,
};

const G: f64 = 9.81;

fn nothing(_: &Scene, _: &CollideOptions) -> Result<Contacts, CollideError> {
    Ok(Contacts::default())
}

fn advance(engine: &mut Newton, steps: usize, h: f64) {
    for _ in 0..steps {
        engine.step(h).unwrap();
    }
}

fn engine(system: System) -> Newton {
    Newton::new(system, nothing, CollideOptions::default(), NewtonOptions::default()).unwrap()
}

struct Links {
    system: System,
    shape: ShapeId,
    mass: MassProperties,
}

/// Bars of 0.2 m along x.
const HALF: DVec3 = DVec3::new(0.1, 0.01, 0.02);

impl Links {
    fn new(gravity: DVec3) -> Self {
        let mut system = System::new(gravity);
        let shape = Shape::Box { half_extents: HALF };
        let mass = MassProperties::of_shape(&shape, 1.0, 1000.0).unwrap();
        let shape = system.add_shape(shape).unwrap();
        Self { system, shape, mass }
    }

    fn bar(&mut self, center: DVec3, turn: f64) -> usize {
        let pose = Pose { translation: center, rotation: DQuat::from_rotation_z(turn) };
        self.system.add("bar", Instance::new(self.shape, pose), Mass::Free(self.mass)).unwrap()
    }

    fn joint(&mut self, kind: JointKind, parent: Option<usize>, child: usize, frame: Pose) -> usize {
        let pose = |body: usize| self.system.states()[body].pose;
        let poses = [parent.map_or(Pose::IDENTITY, pose), pose(child)];
        self.system.add_joint(Joint::new("joint", kind, (parent, child), poses, frame)).unwrap()
    }

    fn hinge(&mut self, parent: Option<usize>, child: usize, at: DVec3) -> usize {
        self.joint(JointKind::Hinge, parent, child, Pose::at(at))
    }
}

fn energy(system: &System) -> f64 {
    system.kinetic_energy() + system.potential_energy()
}

/// The largest distance and angle by which a joint is off.
fn drift(system: &System) -> (f64, f64) {
    let errors = system.joints().iter().map(|joint| joint.error(System::poses_of(joint, system.states())));
    errors.fold((0.0, 0.0), |(a, b), (c, d)| (f64::max(a, c), f64::max(b, d)))
}

/// A bar that swings from the horizontal. Its energy stays within 2 % over ten thousand steps, and its
/// period is that of the elliptic integral.
#[test]
fn a_pendulum_keeps_its_energy_and_period() {
    let mut links = Links::new(DVec3::new(0.0, -G, 0.0));
    let bar = links.bar(DVec3::new(HALF.x, 0.0, 0.0), 0.0);
    links.hinge(None, bar, DVec3::ZERO);
    let swing = links.mass.mass * G * HALF.x;
    let inertia = links.mass.inertia.z_axis.z + links.mass.mass * HALF.x * HALF.x;
    let start = energy(&links.system);
    let mut engine = engine(links.system);
    let (h, steps) = (1e-3, 10_000);
    let (mut turns, mut before, mut worst, mut off) = (Vec::new(), 0.0, 0.0f64, 0.0f64);
    for step in 0..steps {
        let report = engine.step(h).unwrap();
        assert!(report.converged, "step {step}: {report:?}");
        let speed = engine.system().states()[bar].angular.z;
        if before < 0.0 && speed >= 0.0 {
            turns.push(h * (f64::from(step) + speed / (before - speed)));
        }
        before = speed;
        worst = worst.max((energy(engine.system()) - start).abs() / swing);
        off = off.max(drift(engine.system()).0);
    }
    assert!(worst < 0.02, "energy: {worst}");
    assert!(off < 1e-6, "drift: {off}");
    // The period of an amplitude of 90°: 4 K(sin 45°) √(I / m g l), K = 1.854 074 677.
    let expected = 4.0 * 1.854_074_677_3 * (inertia / swing).sqrt();
    let found = (turns[turns.len() - 1] - turns[0]) / (turns.len() - 1) as f64;
    assert!((found / expected - 1.0).abs() < 2e-3, "period {found} instead of {expected}");
}

/// A ball joint: a bar that turns about the vertical, at the angle of a conical pendulum.
#[test]
fn a_conical_pendulum_stays_on_its_cone() {
    let mut links = Links::new(DVec3::new(0.0, 0.0, -G));
    let angle = 0.6f64;
    let center = HALF.x * DVec3::new(angle.sin(), 0.0, -angle.cos());
    let rotation = DQuat::from_rotation_arc(DVec3::X, center.normalize());
    let pose = Pose { translation: center, rotation };
    let bar = links.system.add("bar", Instance::new(links.shape, pose), Mass::Free(links.mass)).unwrap();
    links.joint(JointKind::Ball, None, bar, Pose::IDENTITY);
    // The torque of the weight turns the angular momentum about the pivot: ω × L = r × m g.
    let world = links.mass.inertia_in_world(pose);
    let m = links.mass.mass;
    let about_pivot = |axis: DVec3| world * axis + m * center.cross(axis.cross(center));
    let torque = center.cross(DVec3::new(0.0, 0.0, -m * G)).y;
    let speed = (torque / DVec3::Z.cross(about_pivot(DVec3::Z)).y).sqrt();
    let angular = speed * DVec3::Z;
    links.system.set_state(bar, State { pose, linear: angular.cross(center), angular }).unwrap();
    let start = energy(&links.system);
    let mut engine = engine(links.system);
    for _ in 0..1000 {
        engine.step(1e-3).unwrap();
        let at = engine.system().states()[bar].pose.translation;
        assert!((at.z / center.z - 1.0).abs() < 0.02, "{at}");
    }
    assert!((energy(engine.system()) - start).abs() < 0.02 * m * G * HALF.x);
    assert!(drift(engine.system()).0 < 1e-6);
}

/// Three bars and the world: a parallelogram, whose coupler does not turn. It has one degree of
/// freedom and five redundant rows.
#[test]
fn a_four_bar_linkage_moves_as_a_parallelogram() {
    let mut links = Links::new(DVec3::new(0.0, -G, 0.0));
    let l = 2.0 * HALF.x;
    let left = links.bar(DVec3::new(0.0, 0.5 * l, 0.0), FRAC_PI_2);
    let right = links.bar(DVec3::new(l, 0.5 * l, 0.0), FRAC_PI_2);
    let coupler = links.bar(DVec3::new(0.5 * l, l, 0.0), 0.0);
    links.hinge(None, left, DVec3::ZERO);
    links.hinge(None, right, DVec3::new(l, 0.0, 0.0));
    links.hinge(Some(left), coupler, DVec3::new(0.0, l, 0.0));
    links.hinge(Some(right), coupler, DVec3::new(l, l, 0.0));
    let spin = -1.0 * DVec3::Z;
    for (body, linear) in [(left, 0.5 * l), (right, 0.5 * l), (coupler, l)] {
        let angular = if body == coupler { DVec3::ZERO } else { spin };
        let state = State { linear: linear * DVec3::X, angular, ..links.system.states()[body] };
        links.system.set_state(body, state).unwrap();
    }
    let start = energy(&links.system);
    let scale = links.mass.mass * G * l;
    let mut engine = engine(links.system);
    for step in 0..1000 {
        let report = engine.step(1e-3).unwrap();
        assert!(report.converged, "step {step}: {report:?}");
        let coupler = engine.system().states()[coupler].pose;
        assert!(coupler.rotation.angle_between(DQuat::IDENTITY) < 1e-6, "step {step}");
        let (way, angle) = drift(engine.system());
        assert!(way < 1e-6 && angle < 1e-6, "step {step}: {way:e} m, {angle:e} rad");
    }
    let change = (energy(engine.system()) - start) / scale;
    assert!(change.abs() < 0.05, "{change}");
}

/// Rotation about the middle axis is unstable (Dzhanibekov's wing nut): the axis turns over.
#[test]
fn a_rotation_about_the_middle_axis_turns_over() {
    let mut links = Links::new(DVec3::ZERO);
    let bar = links.bar(DVec3::ZERO, 0.0);
    // The inertia about x is the least, that about y the greatest.
    let angular = DVec3::new(1e-3, 1e-3, 10.0);
    let state = State { angular, ..links.system.states()[bar] };
    links.system.set_state(bar, state).unwrap();
    let mut engine = engine(links.system);
    let mut least = 1.0f64;
    for _ in 0..20_000 {
        engine.step(2e-4).unwrap();
        least = least.min((engine.system().states()[bar].pose.rotation * DVec3::Z).z);
    }
    assert!(least < -0.95, "{least}");
}

#[test]
fn motors_reach_their_targets_within_their_limits() {
    let run = |motor: Motor, kind: JointKind, seconds: f64| {
        let mut links = Links::new(DVec3::ZERO);
        let bar = links.bar(DVec3::ZERO, 0.0);
        let joint = links.joint(kind, None, bar, Pose::IDENTITY);
        links.system.set_motor(joint, Some(motor)).unwrap();
        let mut engine = engine(links.system);
        advance(&mut engine, (seconds / 1e-3) as usize, 1e-3);
        let system = engine.system();
        let joint = &system.joints()[joint];
        let State { linear, angular, .. } = system.states()[bar];
        (joint.coordinate(System::poses_of(joint, system.states())), linear.z, angular.z)
    };
    let mass = Links::new(DVec3::ZERO).mass;
    let inertia = mass.inertia.z_axis.z;
    // Far below the limit, a velocity is reached in one step.
    let (_, _, spin) = run(Motor { drive: Drive::Velocity(2.0), limit: 1e3 }, JointKind::Hinge, 0.1);
    assert!((spin - 2.0).abs() < 1e-9, "{spin}");
    // At the limit, the velocity grows as the torque says, until the target is reached.
    let limit = inertia * 10.0;
    for (seconds, expected) in [(0.1, 1.0), (0.5, 2.0)] {
        let (_, _, spin) = run(Motor { drive: Drive::Velocity(2.0), limit }, JointKind::Hinge, seconds);
        assert!((spin - expected).abs() < 1e-9, "{spin}");
    }
    let (travel, _, _) = run(Motor { drive: Drive::Position(0.05), limit: 1e4 }, JointKind::Slider, 0.1);
    assert!((travel - 0.05).abs() < 1e-9, "{travel}");
    let (_, speed, _) = run(Motor { drive: Drive::Force(-3.0), limit: 2.0 }, JointKind::Slider, 0.1);
    assert!((speed + 2.0 / mass.mass * 0.1).abs() < 1e-9, "{speed}");
    // A spring with the damping at which it does not overshoot.
    let (k, m) = (20.0, mass.mass);
    let drive =
        Drive::Spring { rest: 0.1, stiffness: k, damping: 2.0 * (k * m).sqrt(), velocity: 0.0, force: 0.0 };
    let rate = (k / m).sqrt();
    for seconds in [0.1, 0.3] {
        let (travel, _, _) = run(Motor { drive, limit: f64::INFINITY }, JointKind::Slider, seconds);
        let expected = 0.1 * (1.0 - (1.0 + rate * seconds) * (-rate * seconds).exp());
        assert!((travel - expected).abs() < 1e-3, "{travel} instead of {expected}");
    }
}

/// A bar on a slider or hinge that resists, with a speed at the start and a motor: its coordinate
/// and rate at the end.
fn resisted(
    kind: JointKind,
    resistance: JointResistance,
    speed: f64,
    motor: Option<Motor>,
    steps: usize,
) -> [f64; 2] {
    let mut links = Links::new(DVec3::ZERO);
    let bar = links.bar(DVec3::ZERO, 0.0);
    let poses = [Pose::IDENTITY; 2];
    let joint = Joint::new("joint", kind, (None, bar), poses, Pose::IDENTITY);
    links.system.add_joint(Joint { resistance, motor, ..joint }).unwrap();
    let [linear, angular] = match kind {
        JointKind::Slider => [speed * DVec3::Z, DVec3::ZERO],
        _ => [DVec3::ZERO, speed * DVec3::Z],
    };
    let mut engine = engine(links.system);
    let state = State { linear, angular, ..engine.system().states()[bar] };
    engine.set_state(bar, state).unwrap();
    advance(&mut engine, steps, H);
    [engine.system().coordinates()[0], engine.system().coordinate_rates()[0]]
}

const H: f64 = 1e-3;

#[test]
fn damping_friction_and_armature_resist() {
    let inertia_of = |kind| match kind {
        JointKind::Slider => Links::new(DVec3::ZERO).mass.mass,
        _ => Links::new(DVec3::ZERO).mass.inertia.z_axis.z,
    };
    let none = JointResistance::default();
    for kind in [JointKind::Slider, JointKind::Hinge] {
        let m = inertia_of(kind);
        let motor = |force: f64| Some(Motor { drive: Drive::Force(force), limit: f64::INFINITY });
        // m v̇ = −d v, by the implicit rule of Euler.
        let damped = JointResistance { damping: 2.0 * m, ..none };
        let [_, rate] = resisted(kind, damped, 0.5, None, 300);
        assert!((rate - 0.5 * (1.0 + 2.0 * H).powi(-300)).abs() < 1e-9, "{kind:?}: {rate}");
        // Dry friction takes 1 m/s² from a motion, and holds against less.
        let dry = JointResistance { friction: m, ..none };
        for (speed, force, steps, expected) in
            [(0.5, 0.0, 200, 0.3), (0.5, 0.0, 600, 0.0), (0.0, 3.0, 100, 0.2)]
        {
            let [_, rate] = resisted(kind, dry, speed, motor(m * force), steps);
            assert!((rate - expected).abs() < 1e-9, "{kind:?}, {speed}, {force}: {rate}");
        }
        let [coordinate, _] = resisted(kind, dry, 0.0, motor(0.9 * m), 300);
        assert!(coordinate.abs() < 1e-10, "{kind:?}: it crept by {coordinate:e}");
        // A rotor of three times the inertia.
        let [_, rate] =
            resisted(kind, JointResistance { armature: 3.0 * m, ..none }, 0.0, motor(2.0 * m), 400);
        assert!((rate - 0.2).abs() < 1e-9, "{kind:?}: {rate}");
    }
}

/// A spring with a damper that aims at the speed of the target, and the torque of gravity as
/// feed-forward, follow a target of 1 rad/s.
#[test]
fn a_drive_with_feed_forward_tracks_a_moving_target() {
    let mut links = Links::new(-G * DVec3::Y);
    let bar = links.bar(0.1 * DVec3::X, 0.0);
    let hinge = links.hinge(None, bar, DVec3::ZERO);
    let mass = links.mass;
    let mut engine = engine(links.system);
    for step in 1..=2000 {
        let target = f64::from(step) * H;
        let force = mass.mass * G * 0.1 * target.cos();
        let drive = Drive::Spring { rest: target, stiffness: 20.0, damping: 1.0, velocity: 1.0, force };
        engine.set_motor(hinge, Some(Motor { drive, limit: 50.0 })).unwrap();
        engine.step(H).unwrap();
        let off = engine.system().coordinates()[hinge] - target;
        assert!(step < 500 || off.abs() < 1e-3, "step {step}: off by {off} rad");
    }
}

#[test]
fn limits_stop_hinges_sliders_and_balls() {
    for (kind, axis, limits) in [
        (JointKind::Hinge, DVec3::Z, [-0.3, 0.5]),
        (JointKind::Slider, DVec3::Z, [-0.01, 0.02]),
        (JointKind::Ball, DVec3::Y, [0.0, 0.4]),
    ] {
        for sign in [-1.0, 1.0] {
            let mut links = Links::new(DVec3::ZERO);
            let bar = links.bar(DVec3::ZERO, 0.0);
            let poses = [Pose::IDENTITY; 2];
            let joint = Joint {
                limits: Some(limits),
                ..Joint::new("limited", kind, (None, bar), poses, Pose::IDENTITY)
            };
            links.system.add_joint(joint).unwrap();
            let wrench = Wrench { force: 0.2 * sign * axis, torque: 1e-3 * sign * axis };
            links.system.set_wrench(bar, wrench).unwrap();
            let mut engine = engine(links.system);
            advance(&mut engine, 3000, 1e-3);
            let system = engine.system();
            let joint = &system.joints()[0];
            let found = joint.coordinate(System::poses_of(joint, system.states()));
            let expected = match (kind, sign) {
                (JointKind::Ball, _) => limits[1],
                (_, -1.0) => limits[0],
                _ => limits[1],
            };
            assert!((found - expected).abs() < 1e-6, "{kind:?} {sign}: {found} instead of {expected}");
        }
    }
}

/// A weld carries a load at the end of a chain of bars without giving way.
#[test]
fn welded_bars_are_one_beam() {
    let mut links = Links::new(DVec3::new(0.0, -G, 0.0));
    let mut parent = None;
    for k in 0..10 {
        let bar = links.bar(DVec3::new(HALF.x * (1.0 + 2.0 * f64::from(k)), 0.0, 0.0), 0.0);
        let at = Pose::at(DVec3::new(2.0 * HALF.x * f64::from(k), 0.0, 0.0));
        links.joint(JointKind::Weld, parent, bar, at);
        parent = Some(bar);
    }
    let start = links.system.states().to_vec();
    let mut engine = engine(links.system);
    for step in 0..1000 {
        assert!(engine.step(1e-3).unwrap().converged, "step {step}");
    }
    for (state, start) in engine.system().states().iter().zip(&start) {
        assert!(state.pose.translation.distance(start.pose.translation) < 1e-9, "{state:?}");
        assert!(state.linear.length() < 1e-8, "{state:?}");
    }
}

/// A chain of 100 bars that swings freely: no joint comes apart.
#[test]
fn a_long_chain_holds_together() {
    let mut links = Links::new(DVec3::new(0.0, -G, 0.0));
    let mut parent = None;
    for k in 0..100 {
        let bar = links.bar(DVec3::new(HALF.x * (1.0 + 2.0 * f64::from(k)), 0.0, 0.0), 0.0);
        links.hinge(parent, bar, DVec3::new(2.0 * HALF.x * f64::from(k), 0.0, 0.0));
        parent = Some(bar);
    }
    let mut engine = engine(links.system);
    let start = energy(engine.system());
    for step in 0..200 {
        let report = engine.step(5e-3).unwrap();
        assert!(report.converged, "step {step}: {report:?}");
        let (way, angle) = drift(engine.system());
        assert!(way < 1e-4 && angle < 1e-6, "step {step}: {way:e} m, {angle:e} rad");
        assert!(energy(engine.system()) <= start + 1e-6 * start.abs().max(1.0), "step {step}");
    }
}

/// Ten bars on balls, whose end weighs a hundred times as much as the others, swing for a second. Without
/// geometric stiffness the joints come apart within four steps.
#[test]
fn a_light_chain_swings_with_a_heavy_end() {
    let mut links = Links::new(DVec3::new(0.0, -G, 0.0));
    let (link, mut parent) = (links.mass.mass, None);
    for k in 0..10 {
        if k == 9 {
            links.mass = MassProperties { mass: 900.0 * links.mass.mass, ..links.mass };
        }
        // Along (0.3, −0.954): 17° from the vertical.
        let along = DVec3::new(0.3, -0.91_f64.sqrt(), 0.0);
        let at = |halves: f64| HALF.x * halves * along;
        let bar = links.bar(at(1.0 + 2.0 * f64::from(k)), along.y.atan2(along.x));
        links.joint(JointKind::Ball, parent, bar, Pose::at(at(2.0 * f64::from(k))));
        parent = Some(bar);
    }
    let mut engine = engine(links.system);
    let start = energy(engine.system());
    // What the end gains on its way down.
    let swing = 900.0 * link * G * 1.9 * (1.0 - 0.91_f64.sqrt());
    let mut most = 0.0;
    for step in 0..200 {
        let report = engine.step(5e-3).unwrap();
        assert!(report.converged, "step {step}: {report:?}");
        let (way, _) = drift(engine.system());
        assert!(way < 1e-5, "step {step}: {way:e} m");
        let change = energy(engine.system()) - start;
        assert!(change.abs() < 0.02 * swing, "step {step}: {change} J of {swing} J");
        most = engine.system().kinetic_energy().max(most);
    }
    assert!((0.95..1.05).contains(&(most / swing)), "{most} J of {swing} J");
}

/// A motor pushes a light finger by 2.5 mm in a step, through a plate of 1 mm. Gravity alone moves
/// nothing, so the first detection does not look that far.
#[test]
fn a_motor_does_not_push_a_finger_through_a_plate() {
    let mut system = System::new(DVec3::ZERO);
    let plate = system.add_shape(Shape::Box { half_extents: DVec3::new(0.05, 0.05, 5e-4) }).unwrap();
    system.add("plate", Instance::new(plate, Pose::IDENTITY), Mass::Fixed).unwrap();
    let shape = Shape::Sphere { radius: 1e-3 };
    let mass = MassProperties::of_shape(&shape, 1.0, 1000.0).unwrap().with_mass(0.1).unwrap();
    let finger = system.add_shape(shape).unwrap();
    let start = Pose::at(DVec3::new(0.0, 0.0, 2e-3));
    let finger = system.add("finger", Instance::new(finger, start), Mass::Free(mass)).unwrap();
    let slider = Joint::new("slider", JointKind::Slider, (None, finger), [Pose::IDENTITY, start], start);
    let motor = Some(Motor { drive: Drive::Force(-20.0), limit: 20.0 });
    system.add_joint(Joint { motor, ..slider }).unwrap();
    let collide = CollideOptions { contact_distance: 1e-4, ..CollideOptions::default() };
    let mut engine = Newton::new(system, detect, collide, NewtonOptions::default()).unwrap();
    for step in 0..20 {
        engine.step(5e-3).unwrap();
        let height = engine.system().states()[finger].pose.translation.z;
        assert!(height > 1.5e-3 - 1e-6, "step {step}: {height}");
    }
}

/// A kinematic parent carries its child along, and does not feel it.
#[test]
fn a_kinematic_body_carries_what_is_welded_to_it() {
    let mut links = Links::new(DVec3::new(0.0, -G, 0.0));
    let velocity = Velocity { linear: DVec3::new(0.1, 0.0, 0.0), angular: DVec3::new(0.0, PI, 0.0) };
    let instance = Instance { velocity, ..Instance::new(links.shape, Pose::IDENTITY) };
    let wrist = links.system.add("wrist", instance, Mass::Kinematic).unwrap();
    let bar = links.bar(DVec3::new(3.0 * HALF.x, 0.0, 0.0), 0.0);
    links.joint(JointKind::Weld, Some(wrist), bar, Pose::at(DVec3::new(HALF.x, 0.0, 0.0)));
    let mut engine = engine(links.system);
    advance(&mut engine, 500, 1e-3);
    let [wrist, bar] = [wrist, bar].map(|body| engine.system().states()[body].pose);
    assert!(wrist.translation.distance(DVec3::new(0.05, 0.0, 0.0)) < 1e-12, "{wrist:?}");
    assert!(wrist.rotation.angle_between(DQuat::from_rotation_y(0.25 * TAU)) < 1e-7, "{wrist:?}");
    let expected = wrist.to_world(DVec3::new(3.0 * HALF.x, 0.0, 0.0));
    assert!(bar.translation.distance(expected) < 1e-6, "{bar:?} instead of {expected}");
}

#[test]
fn joints_that_do_not_fit_are_refused() {
    let mut links = Links::new(DVec3::ZERO);
    let bar = links.bar(DVec3::ZERO, 0.0);
    let good = Joint::new("j", JointKind::Hinge, (None, bar), [Pose::IDENTITY; 2], Pose::IDENTITY);
    let motor = Motor { drive: Drive::Velocity(1.0), limit: 1.0 };
    let none = JointResistance::default();
    let bad = [
        (Joint { child: 7, ..good.clone() }, "there is no body 7"),
        (Joint { parent: Some(bar), ..good.clone() }, "joint j: it connects a body to itself"),
        (
            Joint { limits: Some([0.5, -0.5]), ..good.clone() },
            "limits 0.5 to -0.5; expected two finite numbers",
        ),
        (Joint { kind: JointKind::Weld, limits: Some([0.0, 1.0]), ..good.clone() }, "a weld has no limits"),
        (Joint { kind: JointKind::Ball, motor: Some(motor), ..good.clone() }, "only hinges and sliders"),
        (
            Joint { motor: Some(Motor { limit: -1.0, ..motor }), ..good.clone() },
            "the limit of its motor is -1",
        ),
        (
            Joint { motor: Some(Motor { drive: Drive::Position(f64::NAN), ..motor }), ..good.clone() },
            "its motor has position NaN; expected finite numbers",
        ),
        (
            Joint {
                motor: Some(Motor {
                    drive: Drive::Spring {
                        rest: 0.0,
                        stiffness: -2.0,
                        damping: 1.0,
                        velocity: 0.0,
                        force: 0.0,
                    },
                    ..motor
                }),
                ..good.clone()
            },
            "its motor has a spring of rest 0, stiffness -2, damping 1",
        ),
        (
            Joint { kind: JointKind::Ball, limits: Some([0.1, 1.0]), ..good.clone() },
            "limits 0.1 to 1; expected 0 and an angle of at most π",
        ),
        (
            Joint { resistance: JointResistance { friction: -1.0, ..none }, ..good.clone() },
            "friction -1; expected a finite number, 0 or greater",
        ),
        (
            Joint {
                kind: JointKind::Ball,
                resistance: JointResistance { damping: 1.0, ..none },
                ..good.clone()
            },
            "only hinges and sliders have damping; take it out",
        ),
    ];
    for (joint, expected) in bad {
        let message = links.system.add_joint(joint).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}: expected {expected}");
    }
    let fixed = links.system.add("fixed", Instance::new(links.shape, Pose::IDENTITY), Mass::Fixed).unwrap();
    let message = links.system.add_joint(Joint { child: fixed, ..good }).unwrap_err().to_string();
    assert!(message.contains("neither of its bodies is free"), "{message}");
    let message = links.system.set_motor(3, None).unwrap_err().to_string();
    assert_eq!(message, "there is no joint 3; the system has 0, counted from 0");
}
