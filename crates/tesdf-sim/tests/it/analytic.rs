//! Motions of bodies in contact that have a formula, as scene files with the default detector and solver.
//! `docs/dynamics.md` has a table of them.
use tesdf::collide::{ClearanceOptions, Instance, Pose, Scene, Shape, Velocity, clearance};
use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Dynamics, State};

use crate::support::bench::{Bench, Body, Kind, STEP, ball};
use crate::support::meshes::{bowl, tiles};

const G: f64 = 9.81;

/// Maximum way to the side of a body that no force moves to the side, m.
const SIDEWAYS: f64 = 1e-6;

/// Half extents of a thin card that stands on a short side, m.
const CARD: DVec3 = DVec3::new(0.0005, 0.03, 0.045);

/// Rotation of a body whose top leans to the side of x by this angle, rad.
fn leaning(angle: f64) -> DQuat {
    DQuat::from_rotation_y(angle)
}

/// Half of the size of a turned box along the world's axes.
fn extent(half: DVec3, rotation: DQuat) -> DVec3 {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| rotation * (axis * half));
    axes.into_iter().map(DVec3::abs).sum()
}

/// Moments of inertia of a box of 1 kg, kg m².
fn inertia(half: DVec3) -> DVec3 {
    let square = half * half;
    (DVec3::splat(square.element_sum()) - square) / 3.0
}

/// The way that the centre of a body sinks, m.
fn sinks(run: &[Vec<State>], body: usize) -> f64 {
    run[0][body].pose.translation.z - run[run.len() - 1][body].pose.translation.z
}

/// The states of a body, after each step.
fn states(run: &[Vec<State>], body: usize) -> impl Iterator<Item = &State> {
    run[1..].iter().map(move |states| &states[body])
}

/// The maximum of a value over the states of a body.
fn most(run: &[Vec<State>], body: usize, value: impl Fn(&State) -> f64) -> f64 {
    states(run, body).map(value).fold(0.0, f64::max)
}

/// Angle to the vertical of a thin ladder of length `l` between a wall and a floor without friction:
/// θ″ = 3 g sin θ / 2 l, in steps that change first the speed, then the angle, as those of the engine.
fn ladder(start: f64, l: f64, steps: u32) -> f64 {
    let step = |(angle, speed): (f64, f64), _| {
        let speed = speed + STEP * 1.5 * G / l * angle.sin();
        (angle + STEP * speed, speed)
    };
    (0..steps).fold((start, 0.0), step).0
}

/// A plank slides down between a wall and the floor as a ladder does. The steps are those in which its
/// centre sinks by a fifth; it leaves the wall when it has sunk by a third.
#[test]
fn a_plank_on_a_wall_slides_as_a_ladder() {
    /// Part of the way.
    const TOLERANCE: f64 = 0.02;
    let bench = Bench::new();
    let (start, l) = (30f64.to_radians(), 2.0 * CARD.z);
    let way = |steps| 0.5 * l * (start.cos() - ladder(start, l, steps).cos());
    let steps = (1..).take_while(|&steps| way(steps) < 0.2 * 0.5 * l * start.cos()).last().unwrap();
    for kind in [Kind::Mesh, Kind::Shape] {
        let size = extent(CARD, leaning(start));
        let pose = Pose { translation: DVec3::new(-size.x, 0.0, size.z), rotation: leaning(start) };
        let wall = Body::fixed(bench.cuboid(Kind::Shape, DVec3::new(0.05, 0.2, 0.2)));
        let wall = Body { pose: Pose::at(DVec3::new(0.05, 0.0, 0.2)), ..wall };
        let plank = Body::free(bench.cuboid(kind, CARD), 0.002, pose);
        let run = bench.run("", &[Body::plane(0.0), wall, plank], STEP * f64::from(steps));
        let (found, expected) = (sinks(&run, 2), way(steps));
        assert!((found / expected - 1.0).abs() < TOLERANCE, "{kind:?}: sinks by {found} m, not {expected} m");
    }
}

/// Two thin cards that lean on each other at an angle θ to the vertical stand where μ > tan θ / 2: the
/// floor bears the weight m g of each and pushes its foot by m g tan θ / 2.
#[test]
fn cards_that_lean_on_each_other_stand_above_half_the_tangent() {
    /// Maximum way down of cards that stand, m.
    const STANDS: f64 = 1e-6;
    /// Minimum way down of cards that fall, m.
    const FALLS: f64 = 1e-3;
    let bench = Bench::new();
    let angle = 20f64.to_radians();
    let size = extent(CARD, leaning(angle));
    for (kind, friction) in
        [(Kind::Mesh, 0.25), (Kind::Mesh, 0.10), (Kind::Mesh, 0.0), (Kind::Shape, 0.25), (Kind::Shape, 0.10)]
    {
        let card = |side: f64| {
            let translation = DVec3::new(side * size.x, 0.0, size.z);
            let pose = Pose { translation, rotation: leaning(-side * angle) };
            Body { friction, ..Body::free(bench.cuboid(kind, CARD), 0.002, pose) }
        };
        let run = bench.run("", &[Body::plane(friction), card(-1.0), card(1.0)], 0.2);
        let sunk = [sinks(&run, 1), sinks(&run, 2)];
        let is_right = match friction > 0.5 * angle.tan() {
            true => sunk.iter().all(|&way| way.abs() < STANDS),
            false => sunk.iter().all(|&way| way > FALLS),
        };
        assert!(is_right, "{kind:?}, μ {friction}: sinks by {sunk:?}");
    }
}

/// A ball that falls through a medium approaches the speed at which it slows down by what it gains:
/// v = v / (1 + c h) + g h, so v = g (1 + c h) / c.
#[test]
fn a_damped_body_falls_at_its_terminal_speed() {
    const DAMPING: f64 = 40.0;
    const RATE: f64 = 1e-3;
    let scene = format!(
        "time_step = {RATE:?}\nduration = 1\n[[bodies]]\nname = \"ball\"\nmass = 2\n\
         shape = {{ sphere = {{ radius = 0.1 }} }}\nlinear_damping = {DAMPING:?}\n"
    );
    let loaded = LoadedScene::parse(scene, "scene.toml").unwrap();
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    for step in 1..=1000 {
        engine.step(RATE).unwrap();
        let terminal = G * (1.0 + DAMPING * RATE) / DAMPING;
        let expected = terminal * (1.0 - (1.0 + DAMPING * RATE).powi(-step));
        let State { linear, .. } = engine.system().states()[0];
        assert!(linear.distance(-expected * DVec3::Z) < 1e-12, "step {step}: {linear}, expected {expected}");
    }
}

/// No force acts to the side on a body on a floor without friction, so its centre only falls, until the
/// cube lies on its side.
#[test]
fn a_cube_on_its_edge_falls_without_moving_to_the_side() {
    /// Maximum error of the height, m.
    const LIES: f64 = 1e-6;
    let bench = Bench::new();
    let (half, rotation) = (DVec3::splat(0.05), leaning(20f64.to_radians()));
    for kind in [Kind::Mesh, Kind::Shape] {
        let pose = Pose { translation: extent(half, rotation).z * DVec3::Z, rotation };
        let cube = Body::free(bench.cuboid(kind, half), 1.0, pose);
        let run = bench.run("", &[Body::plane(0.0), cube], 0.3);
        let sideways = most(&run, 1, |state| state.pose.translation.truncate().length());
        let height = run[run.len() - 1][1].pose.translation.z;
        assert!(sideways < SIDEWAYS, "{kind:?}: {sideways} m to the side");
        assert!((height - half.z).abs() < LIES, "{kind:?}: the centre is {height} m high");
    }
}

/// A cube on an incline of the angle α slides with g (sin α − μ cos α) where μ < tan α, and stays
/// otherwise. It does not turn.
#[test]
fn a_cube_slides_below_the_tangent_of_the_incline_and_sticks_above() {
    /// Part of the speed.
    const SLIDES: f64 = 1e-3;
    /// Maximum way of a cube that sticks, m.
    const STICKS: f64 = 1e-6;
    /// rad/s.
    const SPIN: f64 = 1e-3;
    let bench = Bench::new();
    let (incline, half, seconds) = (0.3f64, DVec3::splat(0.05), 1.0);
    let gravity = format!("gravity = [{:?}, 0.0, {:?}]", G * incline.sin(), -G * incline.cos());
    for kind in [Kind::Mesh, Kind::Shape] {
        for share in [0.98, 1.02] {
            let friction = share * incline.tan();
            let cube = Body::free(bench.cuboid(kind, half), 1.0, Pose::at(half.z * DVec3::Z));
            let bodies = [Body::plane(friction), Body { friction, ..cube }];
            let run = bench.run(&gravity, &bodies, seconds);
            let State { pose, linear, .. } = run[run.len() - 1][1];
            let spin = most(&run, 1, |state| state.angular.length());
            let expected = seconds * G * (incline.sin() - friction * incline.cos());
            assert!(spin < SPIN, "{kind:?}, {share} of the tangent: {spin} rad/s");
            match share < 1.0 {
                true => {
                    assert!((linear.x / expected - 1.0).abs() < SLIDES, "{kind:?}: {linear}, not {expected}")
                }
                false => assert!(pose.translation.truncate().length() < STICKS, "{kind:?}: {pose:?}"),
            }
        }
    }
}

/// The centre of a ball of radius r that falls into a bowl of inner radius R is never further from the
/// centre of the bowl than R − r, unless the ball leaves over the rim.
#[test]
fn a_ball_stays_within_a_bowl() {
    /// m.
    const TOLERANCE: f64 = 1e-6;
    let bench = Bench::new();
    // Radius of the bowl outside, wall and height of the fall, m.
    for (radius, wall, height) in
        [(0.01, 1e-3, 0.05), (0.01, 1e-3, 0.1), (0.01, 1e-3, 0.35), (0.01, 2e-4, 0.2), (0.1, 0.01, 20.4)]
    {
        let small = 0.1 * radius;
        let shape = bench.mesh(&format!("bowl {radius} {wall}"), &bowl(radius, wall, 12));
        let above = Pose::at(DVec3::new(0.4 * radius, 0.1 * radius, height));
        let bodies = [Body::fixed(shape), Body::free(ball(small), 0.01, above)];
        let run = bench.run("", &bodies, (2.0 * height / G).sqrt() + 0.15);
        let is_below = |state: &&State| {
            let center = state.pose.translation;
            center.z < 0.0 && center.truncate().length() < radius
        };
        let inside: Vec<f64> =
            states(&run, 1).filter(is_below).map(|state| state.pose.translation.length()).collect();
        let farthest = inside.iter().copied().fold(0.0, f64::max);
        // Else the ball has missed the bowl.
        assert!(!inside.is_empty());
        assert!(farthest < radius - wall - small + TOLERANCE, "wall {wall}, from {height} m: {farthest} m");
    }
}

/// No point of a box passes the upper side of a plate, so the centre of a box stays above it by its
/// smallest half extent at least.
#[test]
fn a_fast_box_does_not_pass_a_thin_plate() {
    /// m.
    const TOLERANCE: f64 = 1e-5;
    let bench = Bench::new();
    let (plate, half) = (DVec3::new(0.2, 0.2, 5e-4), DVec3::new(0.02, 0.01, 0.015));
    let turned = |axis: [f64; 3], angle| DQuat::from_axis_angle(DVec3::from(axis).normalize(), angle);
    let (one, other) = (turned([1.0, 2.0, 3.0], 2.4), turned([3.0, -1.0, 1.0], 1.1));
    for (speed, rotation) in [(10.0, one), (20.0, one), (50.0, one), (100.0, one), (20.0, other)] {
        let translation = DVec3::new(0.03, 0.02, 0.1 + 1.4 * speed * STEP);
        let shot = Body::free(bench.cuboid(Kind::Mesh, half), 0.1, Pose { translation, rotation });
        let bodies = [Body::fixed(bench.cuboid(Kind::Mesh, plate)), shot.moving(-speed * DVec3::Z)];
        let run = bench.run("gravity = [0, 0, 0]", &bodies, 0.2 / speed + 8.0 * STEP);
        let heights = states(&run, 1).map(|state| state.pose.translation.z - plate.z - half.min_element());
        let lowest = heights.fold(f64::INFINITY, f64::min);
        let last = run[run.len() - 1][1];
        // Else the box has not met the plate.
        assert!(last.linear.z > -0.5 * speed, "{speed} m/s: {last:?}");
        assert!(lowest > -TOLERANCE, "{speed} m/s: {lowest} m");
    }
}

/// A ball that meets a fixed ball without friction and without bounce keeps the part of its velocity
/// along the common tangent: the sine of the angle between its way and the line of the centres.
#[test]
fn a_ball_that_meets_a_ball_off_centre_keeps_its_tangential_speed() {
    /// Part of the speed.
    const TOLERANCE: f64 = 0.01;
    let bench = Bench::new();
    let (small, big, sine) = (0.01, 0.02, 0.5);
    for speed in [1.0, 5.0, 20.0] {
        let above = DVec3::new(sine * (small + big), 0.0, 0.05 + 2.0 * speed * STEP);
        let flying = Body::free(ball(small), 0.01, Pose::at(above)).moving(-speed * DVec3::Z);
        let run =
            bench.run("gravity = [0, 0, 0]", &[Body::fixed(ball(big)), flying], 0.1 / speed + 6.0 * STEP);
        let after = run[run.len() - 1][1].linear;
        assert!((after.length() - sine * speed).abs() < TOLERANCE * speed, "{speed} m/s: {after}");
    }
}

/// Two boxes that begin deep in each other come apart, and never go back into each other.
#[test]
fn boxes_deep_in_each_other_come_apart() {
    /// Maximum way by which the centres come closer again, m.
    const BACK: f64 = 1e-4;
    /// Maximum depth of boxes that touch, m.
    const OVERLAP: f64 = 1e-6;
    let bench = Bench::new();
    let half = DVec3::splat(0.05);
    for (offset, friction) in [(DVec3::new(0.01, 0.0, 0.02), 0.0), (DVec3::new(0.02, 0.01, 0.03), 0.5)] {
        let at =
            |center| Body { friction, ..Body::free(bench.cuboid(Kind::Shape, half), 1.0, Pose::at(center)) };
        let run = bench.run("gravity = [0, 0, 0]", &[at(DVec3::ZERO), at(offset)], 1.0);
        let mut farthest = 0f64;
        for (step, states) in run.iter().enumerate() {
            let distance = states[0].pose.translation.distance(states[1].pose.translation);
            assert!(distance > farthest - BACK, "step {step}: {farthest} m back to {distance} m");
            farthest = farthest.max(distance);
        }
        let mut scene = Scene::new();
        let shape = scene.add_shape(Shape::Box { half_extents: half }).unwrap();
        let ends = &run[run.len() - 1];
        assert!(ends.iter().all(|state| state.pose.rotation.w > 1.0 - 1e-6), "they turned: {ends:?}");
        let [a, b] = [0, 1].map(|body: usize| scene.add(Instance::new(shape, ends[body].pose)).unwrap());
        let gap = clearance(&scene, a, b, &ClearanceOptions::default()).unwrap().distance;
        assert!(gap > -OVERLAP, "{offset}: {gap} m, {ends:?}");
    }
}

/// Bodies move over a floor of triangles as over a plane: a box loses μ g t of its speed, and a ball
/// that rolls loses nothing. Neither lifts.
#[test]
fn triangles_of_a_floor_are_no_obstacles() {
    /// m.
    const LIFT: f64 = 5e-6;
    /// Part of the speed at the start.
    const SPEED: f64 = 0.02;
    let bench = Bench::new();
    let floor = bench.mesh("tiles", &tiles(12, 1.2, 0.2));
    let half = 0.05;
    let boxed = |kind| bench.cuboid(kind, DVec3::splat(half));
    let rolls =
        |speed| Velocity { linear: DVec3::new(speed, 0.0, 0.0), angular: DVec3::new(0.0, speed / half, 0.0) };
    let slides = |speed| Velocity { linear: DVec3::new(speed, 0.07 * speed, 0.0), angular: DVec3::ZERO };
    for (name, geometry, friction, loss, velocity, seconds) in [
        ("box mesh", boxed(Kind::Mesh), 0.3, 0.3 * G, slides(0.5), 0.25),
        ("box shape", boxed(Kind::Shape), 0.3, 0.3 * G, slides(0.5), 0.25),
        ("box mesh", boxed(Kind::Mesh), 0.0, 0.0, slides(2.0), 0.3),
        ("box shape", boxed(Kind::Shape), 0.0, 0.0, slides(2.0), 0.3),
        ("ball", ball(half), 0.3, 0.0, rolls(0.5), 0.5),
        ("ball", ball(half), 0.3, 0.0, rolls(5.0), 0.15),
    ] {
        let body = Body::free(geometry, 1.0, Pose::at(DVec3::new(-0.413, 0.0371, half)));
        let body = Body { friction, velocity, ..body };
        let run = bench.run("", &[Body { friction, ..Body::fixed(&*floor) }, body], seconds);
        let lift = most(&run, 1, |state| (state.pose.translation.z - half).abs());
        let start = velocity.linear.length();
        let error = |(step, state): (usize, &State)| {
            let expected = (start - loss * STEP * (step + 1) as f64).max(0.0);
            (state.linear.truncate().length() - expected).abs() / start
        };
        let off = states(&run, 1).enumerate().map(error).fold(0.0, f64::max);
        assert!(
            lift < LIFT && off < SPEED,
            "{name}, {start} m/s: lifts by {lift} m, {off} of the speed is wrong"
        );
    }
}

/// A box on a plane keeps its speed, however fast, or loses μ g t. It neither lifts nor turns.
#[test]
fn a_fast_box_glides_on_a_plane() {
    /// m.
    const LIFT: f64 = 1e-5;
    /// Part of the speed.
    const SPEED: f64 = 0.01;
    /// rad/s.
    const SPIN: f64 = 0.01;
    let bench = Bench::new();
    let seconds = 0.3;
    let (cube, slab) = (DVec3::splat(0.01), DVec3::new(0.05, 0.05, 0.02));
    for (speed, half, friction) in [(2.0, cube, 0.0), (10.0, cube, 0.0), (30.0, cube, 0.0), (10.0, slab, 0.3)]
    {
        for kind in [Kind::Mesh, Kind::Shape] {
            let body = Body::free(bench.cuboid(kind, half), 0.1, Pose::at(half.z * DVec3::Z));
            let bodies = [Body::plane(friction), Body { friction, ..body }.moving(speed * DVec3::X)];
            let run = bench.run("", &bodies, seconds);
            let expected = speed - friction * G * seconds;
            let found = run[run.len() - 1][1].linear.x;
            let lift = most(&run, 1, |state| (state.pose.translation.z - half.z).abs());
            let spin = most(&run, 1, |state| state.angular.length());
            assert!((found - expected).abs() < SPEED * speed, "{kind:?}: {found} m/s, not {expected} m/s");
            assert!(
                lift < LIFT && spin < SPIN,
                "{kind:?}, {speed} m/s: lifts by {lift} m, turns by {spin} rad/s"
            );
        }
    }
}

/// A bar on a hinge turns by more than a radian in a step. Its side first touches the post with the
/// post's corner of the smallest angle: at that angle less asin(b / ρ), with half the width b of the
/// bar and the corner's distance ρ from the axis.
#[test]
fn a_fast_bar_on_a_hinge_is_stopped_by_a_post() {
    /// rad.
    const TOLERANCE: f64 = 0.01;
    let bench = Bench::new();
    let (bar, post) = (DVec3::new(0.1, 0.005, 0.005), DVec3::new(0.005, 0.005, 0.05));
    let center = 0.08 * DVec3::new(0.7f64.cos(), 0.7f64.sin(), 0.0);
    let corner = (center + DVec3::new(post.x, -post.y, 0.0)).truncate();
    let expected = corner.y.atan2(corner.x) - (bar.y / corner.length()).asin();
    let hinge = "joints = [{ name = \"hinge\", kind = \"hinge\", child = \"1\", anchor = [0, 0, 0] }]";
    for kind in [Kind::Mesh, Kind::Shape] {
        for speed in [400.0, 2000.0] {
            let post = Body { pose: Pose::at(center), ..Body::fixed(bench.cuboid(kind, post)) };
            let velocity = Velocity { linear: DVec3::ZERO, angular: speed * DVec3::Z };
            let bar = Body::free(bench.cuboid(kind, bar), 0.1, Pose::IDENTITY);
            let run = bench.run(hinge, &[post, Body { velocity, ..bar }], 10.0 * STEP);
            // A bar that passed the post would turn on, or stop after a later step.
            for (step, state) in states(&run, 1).enumerate() {
                let along = state.pose.rotation * DVec3::X;
                let angle = along.y.atan2(along.x);
                assert!(
                    (angle - expected).abs() < TOLERANCE,
                    "{kind:?}, {speed} rad/s, step {step}: {angle} rad"
                );
            }
        }
    }
}

/// A floor without friction pushes a body up alone: it may turn, but its centre only falls.
#[test]
fn bodies_that_fall_on_a_floor_do_not_move_to_the_side() {
    /// Of the lowest corner at the start, m.
    const HEIGHT: f64 = 1e-3;
    let bench = Bench::new();
    let random = &mut fastrand::Rng::with_seed(7);
    let sine = |random: &mut fastrand::Rng| 2.0 * random.f64() - 1.0;
    let wide = DVec3::new(2.0, 2.0, 0.05);
    let below =
        |geometry: String| Body { pose: Pose::at(DVec3::new(0.5, 0.0, -wide.z)), ..Body::fixed(geometry) };
    let floors = [
        Body::plane(0.0),
        below(bench.cuboid(Kind::Shape, wide)),
        below(bench.cuboid(Kind::Mesh, wide)),
        Body::fixed(bench.mesh("tiles", &tiles(9, 6.0, 0.2))),
    ];
    for half in [DVec3::splat(0.05), CARD, DVec3::new(0.1, 0.005, 0.005)] {
        for (kind, floor) in
            [Kind::Mesh, Kind::Shape].into_iter().flat_map(|kind| floors.iter().map(move |f| (kind, f)))
        {
            let geometry = bench.cuboid(kind, half);
            let mut bodies = vec![floor.clone()];
            // Too far from each other to touch.
            for k in 0..3 {
                let rotation =
                    DQuat::from_xyzw(sine(random), sine(random), sine(random), sine(random)).normalize();
                let translation = DVec3::new(0.5 * f64::from(k), 0.0, extent(half, rotation).z + HEIGHT);
                bodies.push(Body::free(geometry.clone(), 0.1, Pose { translation, rotation }));
            }
            let run = bench.run("", &bodies, 0.15);
            for body in 1..bodies.len() {
                let name = format!("{kind:?} {half} on {}, body {body}", floor.geometry);
                let start = run[0][body].pose.translation.truncate();
                let sideways = most(&run, body, |state| state.pose.translation.truncate().distance(start));
                let turned = most(&run, body, |state| state.angular.length());
                // Else it has not met the floor.
                assert!(turned > 0.1, "{name}");
                assert!(sideways < SIDEWAYS, "{name}: {sideways} m");
            }
        }
    }
}

/// A free body keeps its energy and its angular momentum, also where it turns over and over about
/// its middle axis.
#[test]
fn a_box_that_turns_over_keeps_energy_and_angular_momentum() {
    /// Parts of them.
    const ENERGY: f64 = 1e-4;
    const MOMENTUM: f64 = 1e-10;
    let bench = Bench::new();
    let half = DVec3::new(0.05, 0.03, 0.01);
    let inertia = inertia(half);
    for speed in [5.0, 20.0, 100.0] {
        let velocity = Velocity { linear: DVec3::ZERO, angular: speed * DVec3::new(0.01, 1.0, 0.0) };
        let body = Body { velocity, ..Body::free(bench.cuboid(Kind::Shape, half), 1.0, Pose::IDENTITY) };
        let run = bench.run("gravity = [0, 0, 0]", &[body], 5.0);
        let momentum = |state: &State| {
            let rotation = state.pose.rotation;
            rotation * (inertia * (rotation.inverse() * state.angular))
        };
        let energy = |state: &State| 0.5 * momentum(state).dot(state.angular);
        let start = &run[0][0];
        let lost = most(&run, 0, |state| (energy(state) / energy(start) - 1.0).abs());
        let turned = most(&run, 0, |state| momentum(state).distance(momentum(start)));
        let over = most(&run, 0, |state| -(state.pose.rotation.inverse() * state.angular).y);
        assert!(over > 0.9 * speed, "{speed} rad/s: it has not turned over: {over}");
        assert!(lost < ENERGY, "{speed} rad/s: {lost} of the energy");
        let part = turned / momentum(start).length();
        assert!(part < MOMENTUM, "{speed} rad/s: {part} of the angular momentum");
    }
}

/// A heavy top on a ball joint whose tilt θ stays precesses at the rate Ω with
/// (I₁ − I₃) cos θ Ω² − I₃ ω₃ Ω + m g l = 0, where I₁ is about its tip.
#[test]
fn a_top_precesses_at_its_tilt() {
    /// rad.
    const TILT: f64 = 2e-3;
    /// Part of the rate. The top turns by half a radian in a step.
    const RATE: f64 = 0.01;
    let bench = Bench::new();
    let (half, arm, tilt, spin, seconds) = (DVec3::new(0.1, 0.1, 0.01), 0.05, 0.3f64, 100.0, 2.0);
    let DVec3 { x, z: i3, .. } = inertia(half);
    let i1 = x + arm * arm;
    let c = (i1 - i3) * tilt.cos();
    let rate = 2.0 * G * arm / (i3 * spin + ((i3 * spin).powi(2) - 4.0 * c * G * arm).sqrt());
    let rotation = leaning(tilt);
    let up = rotation * DVec3::Z;
    let angular = (spin - rate * tilt.cos()) * up + rate * DVec3::Z;
    let velocity = Velocity { linear: angular.cross(arm * up), angular };
    let top = Body::free(bench.cuboid(Kind::Shape, half), 1.0, Pose { translation: arm * up, rotation });
    let settings = "detector = { mode = \"off\" }\n\
                    joints = [{ name = \"tip\", kind = \"ball\", child = \"0\", anchor = [0, 0, 0] }]";
    let run = bench.run(settings, &[Body { velocity, ..top }], seconds);
    let axes = states(&run, 0).map(|state| state.pose.rotation * DVec3::Z);
    let (mut way, mut before) = (0.0, up);
    for axis in axes {
        assert!((axis.z.acos() - tilt).abs() < TILT, "tilt {}", axis.z.acos());
        way += before.truncate().angle_to(axis.truncate());
        before = axis;
    }
    assert!((way / seconds / rate - 1.0).abs() < RATE, "{} instead of {rate} rad/s", way / seconds);
}

/// A chain of links on joints with a load at its end, that swings down from the horizontal, keeps
/// its energy, and its joints hold: also where the load is 20,000 times as heavy as a link.
#[test]
fn a_chain_with_a_load_swings_and_keeps_its_energy() {
    /// Maximum gain, and maximum loss, as parts of the fall of the chain to the vertical. The
    /// velocities are those of half a step before: m g v h / 2 of the load is 0.7 % of that.
    const ENERGY: [f64; 2] = [0.02, 0.05];
    /// m.
    const APART: f64 = 1e-6;
    let bench = Bench::new();
    let (link, mass) = (0.05, 0.05);
    for (kind, links, load, seconds) in [
        ("hinge", 20, 1.0, 2.7),
        ("hinge", 20, 20.0, 1.2),
        ("hinge", 20, 1000.0, 1.2),
        ("ball", 10, 5.0, 1.5),
    ] {
        let place = |k: usize| (k as f64 + 0.5) * link;
        let half = DVec3::new(0.5, 0.05, 0.05) * link;
        let bar = |k| Body::free(bench.cuboid(Kind::Shape, half), mass, Pose::at(place(k) * DVec3::X));
        let mut bodies: Vec<Body> = (0..links).map(bar).collect();
        bodies.push(Body::free(ball(0.5 * link), load, Pose::at(place(links) * DVec3::X)));
        let joint = |k: usize| {
            let kind = if k == links { "weld" } else { kind };
            let parent = k.checked_sub(1).map_or(String::new(), |k| format!("parent = \"{k}\", "));
            let axis = if kind == "hinge" { ", axis = [0, 1, 0]" } else { "" };
            let anchor = k as f64 * link;
            format!(
                "{{ name = \"{k}\", kind = \"{kind}\", {parent}child = \"{k}\", anchor = [{anchor:?}, 0, 0]{axis} }}"
            )
        };
        let joints: Vec<String> = (0..=links).map(joint).collect();
        let settings = format!("detector = {{ mode = \"off\" }}\njoints = [{}]", joints.join(", "));
        let run = bench.run(&settings, &bodies, seconds);
        let all = |value: &dyn Fn(usize) -> f64| (0..=links).map(value).sum::<f64>();
        let mass = |k: usize| if k == links { load } else { mass };
        let per_mass = |k: usize| match k == links {
            true => DVec3::splat(0.4 * (0.5 * link).powi(2)),
            false => inertia(half),
        };
        let of_body = |k: usize, State { pose, linear, angular }: &State| {
            let angular = pose.rotation.inverse() * *angular;
            let turning = angular.dot(per_mass(k) * angular);
            mass(k) * (0.5 * (linear.length_squared() + turning) + G * pose.translation.z)
        };
        let energy = |states: &[State]| all(&|k| of_body(k, &states[k]));
        let fall = G * all(&|k| mass(k) * place(k));
        let parts: Vec<f64> = run.iter().map(|states| (energy(states) - energy(&run[0])) / fall).collect();
        let [least, most] = [f64::min, f64::max].map(|least| parts.iter().copied().reduce(least).unwrap());
        assert!(most < ENERGY[0] && least > -ENERGY[1], "{kind}, {load} kg: {least} to {most}");
        let end =
            |states: &[State], k: usize, side: f64| states[k].pose.to_world(side * 0.5 * link * DVec3::X);
        let gap = |states: &Vec<State>| {
            let of = |k| end(states, k, 1.0).distance(end(states, k + 1, -1.0));
            (0..links).map(of).fold(end(states, 0, -1.0).length(), f64::max)
        };
        let apart = run.iter().map(gap).fold(0.0, f64::max);
        assert!(apart < APART, "{kind}, {load} kg: {apart} m");
        let low = run.iter().map(|states| states[links].pose.translation.z).fold(0.0, f64::min);
        assert!(low < -0.9 * place(links), "{kind}, {load} kg: the load is at {low} m");
    }
}
