//! Compares the time of impact with formulas, and with clearances at many earlier times.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use crate::support::meshes::{asset, named};
use crate::support::random::Random;
use crate::support::shapes::Shape as Surface;
use tesdf::collide::{
    ClearanceOptions, CollideError, Impact, Instance, InstanceId, Motion, Pose, Scene, Shape, TimeOfImpact,
    TimeOfImpactOptions, Velocity, clearance, time_of_impact,
};
use tesdf::glam::{DQuat, DVec3};
use tesdf::{Length, TeSdf};

fn boxed(half: DVec3) -> Arc<TeSdf> {
    asset(&Surface::default().add_box(-half, half, 2).solid())
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::at(DVec3::new(x, y, z))
}

fn linear(linear: [f64; 3], angular: [f64; 3]) -> Motion {
    Motion::Linear { velocity: Velocity { linear: linear.into(), angular: angular.into() } }
}

struct Case {
    scene: Scene,
    ids: [InstanceId; 2],
    poses: [Pose; 2],
    motions: [Motion; 2],
}

impl Case {
    fn new(
        a: impl Into<Shape>,
        pose_a: Pose,
        motion_a: Motion,
        b: impl Into<Shape>,
        pose_b: Pose,
        motion_b: Motion,
    ) -> Self {
        let mut scene = Scene::new();
        let ids = [(a.into(), pose_a), (b.into(), pose_b)].map(|(shape, pose)| {
            let shape = scene.add_shape(shape).expect("a shape");
            scene.add(Instance::new(shape, pose)).expect("an instance")
        });
        Self { scene, ids, poses: [pose_a, pose_b], motions: [motion_a, motion_b] }
    }

    fn verdict(&self, options: &TimeOfImpactOptions) -> TimeOfImpact {
        let ([a, b], [motion_a, motion_b]) = (self.ids, self.motions);
        time_of_impact(&self.scene, a, b, motion_a, motion_b, options).expect("an answer")
    }

    /// The impact, which must be there.
    fn impact(&self, options: &TimeOfImpactOptions) -> Impact {
        let verdict = self.verdict(options);
        *verdict.impact().unwrap_or_else(|| panic!("{verdict:?}"))
    }

    fn clearance(&self, time: f64) -> f64 {
        let mut scene = self.scene.clone();
        for k in 0..2 {
            let pose = self.motions[k].pose_at(self.poses[k], time);
            scene.set_poses(&[(self.ids[k], pose)]).expect("a pose");
        }
        clearance(&scene, self.ids[0], self.ids[1], &ClearanceOptions::default())
            .expect("a clearance")
            .distance
    }

    /// Checks that the bodies are apart at `samples` times before the impact (or the end), and
    /// within the tolerance at the impact. The verdict must not be undecided.
    fn check(&self, options: &TimeOfImpactOptions, samples: u32) -> TimeOfImpact {
        let verdict = self.verdict(options);
        let until = verdict.free_until();
        for k in 0..samples {
            let time = until * f64::from(k) / f64::from(samples);
            assert!(self.clearance(time) > 0.0, "{verdict:?}: touching at {time} already");
        }
        assert!(!matches!(verdict, TimeOfImpact::Undecided(_)), "{verdict:?}");
        if let (Some(impact), Length::Absolute(tolerance)) = (verdict.impact(), options.tolerance) {
            let there = self.clearance(impact.time);
            assert!((there - impact.clearance.distance).abs() < 1e-6, "{impact:?} {there}");
            assert!(there > 0.0 && there <= tolerance, "{impact:?} {there}");
        }
        verdict
    }

    /// As [`check`](Self::check), of bodies that touch.
    fn check_impact(&self, options: &TimeOfImpactOptions, samples: u32) -> Impact {
        let verdict = self.check(options, samples);
        *verdict.impact().unwrap_or_else(|| panic!("{verdict:?}"))
    }
}

const EXACT: TimeOfImpactOptions =
    TimeOfImpactOptions { tolerance: Length::Absolute(1e-6), end: 10.0, iterations: 1000 };

#[test]
fn falling_bodies_meet_the_floor_when_they_should() {
    let floor = at(0.0, 0.0, -1.0);
    let ball = Shape::Sphere { radius: 0.5 };
    let cube = boxed(DVec3::splat(0.5));
    let cases = [
        (ball.clone(), [0.0, 0.0, -2.0], 1.75),
        (ball, [3.0, 4.0, -1.0], 3.5),
        (cube.clone().into(), [0.0, 0.0, -2.0], 1.75),
        (cube.into(), [1.0, 0.0, -0.5], 7.0),
    ];
    for (shape, velocity, expected) in cases {
        let case = Case::new(
            shape,
            at(5.0, 5.0, 3.0),
            linear(velocity, [0.0; 3]),
            Shape::Plane,
            floor,
            Motion::Rest,
        );
        let impact = case.check_impact(&EXACT, 20);
        assert!(impact.time <= expected, "{impact:?}");
        let late = 1e-6 / -velocity[2];
        assert!(impact.time >= expected - late, "{impact:?}, expected {expected}");
        assert!((impact.clearance.normal - DVec3::Z).length() < 1e-9);
    }
}

#[test]
fn bodies_that_move_together_or_apart_never_meet() {
    let ball = Shape::Sphere { radius: 0.5 };
    let cube = boxed(DVec3::splat(0.5));
    let alike = linear([7.0, -2.0, 1.0], [0.0; 3]);
    let still = Motion::Rest;
    let away = linear([1.0, 0.0, 0.0], [0.0; 3]);
    // The end of the interval comes first.
    let slow = linear([-0.05, 0.0, 0.0], [0.0; 3]);
    for [motion_a, motion_b] in [[alike, alike], [still, still], [away, still], [slow, still]] {
        let case =
            Case::new(ball.clone(), at(2.0, 0.0, 0.0), motion_a, cube.clone(), Pose::IDENTITY, motion_b);
        let verdict = case.check(&EXACT, 5);
        assert_eq!(verdict, TimeOfImpact::Free { end: 10.0, iterations: verdict.iterations() });
        assert!(verdict.iterations() < 5, "{verdict:?}");
    }
    // So far away that no part needs a second look.
    let case =
        Case::new(ball, at(2e3, 0.0, 0.0), linear([-1.0, 0.0, 0.0], [3.0; 3]), cube, Pose::IDENTITY, away);
    assert_eq!(case.check(&EXACT, 5), TimeOfImpact::Free { end: 10.0, iterations: 0 });
}

#[test]
fn fast_bodies_do_not_tunnel_through_thin_bodies() {
    // A sheet that passes through a sheet of the same thickness in 2e-10 of the time.
    let sheet = boxed(DVec3::new(1.0, 1.0, 1e-4));
    let fast = linear([0.0, 0.0, -1e6], [0.0; 3]);
    let case = Case::new(sheet.clone(), at(0.3, 0.2, 500.0), fast, sheet, Pose::IDENTITY, Motion::Rest);
    let impact = case.check_impact(&TimeOfImpactOptions { end: 1.0, ..EXACT }, 10);
    assert!((impact.time - (500.0 - 2e-4) / 1e6).abs() < 2e-12, "{impact:?}");
}

#[test]
fn a_rotating_bar_hits_obstacles_in_its_path() {
    // The bar's side is at y = 0.1 in its frame. A ball of radius 0.2 lies on the y axis at y = 2.
    // They meet at the angle where the ball's centre is 0.3 from the bar's axis.
    let bar = boxed(DVec3::new(3.0, 0.1, 0.1));
    let ball = Shape::Sphere { radius: 0.2 };
    let expected = (std::f64::consts::FRAC_PI_2 - (0.3f64 / 2.0).asin()) / 0.5;
    let turn = linear([0.0; 3], [0.0, 0.0, 0.5]);
    let screw = Motion::Screw {
        point: DVec3::new(0.0, 0.0, 7.0),
        axis: DVec3::new(0.0, 0.0, -2.0),
        angular_speed: -0.5,
        pitch: 0.0,
    };
    for motion in [turn, screw] {
        let case =
            Case::new(bar.clone(), Pose::IDENTITY, motion, ball.clone(), at(0.0, 2.0, 0.0), Motion::Rest);
        let impact = case.check_impact(&EXACT, 20);
        assert!(impact.time <= expected && impact.time > expected - 2e-6, "{impact:?} {expected}");
    }
    // The ball moves around the bar instead; by symmetry the time is the same.
    let case = Case::new(
        bar,
        Pose::IDENTITY,
        Motion::Rest,
        ball,
        at(0.0, 2.0, 0.0),
        Motion::Screw { point: DVec3::ZERO, axis: DVec3::Z, angular_speed: -0.5, pitch: 0.0 },
    );
    let impact = case.check_impact(&EXACT, 20);
    assert!((impact.time - expected).abs() < 2e-6, "{impact:?} {expected}");
}

#[test]
fn random_motions_are_free_before_the_impact_and_touch_at_it() {
    let mut random = Random(6);
    let bumpy = asset(&Surface::default().add_sphere(DVec3::ZERO, 1, || random.between(0.7, 1.0)).solid());
    let tetra = boxed(DVec3::new(0.9, 0.2, 0.4));
    let mut hits = 0;
    for _ in 0..24 {
        let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
        let from = 3.0 * random.direction();
        let start = Pose::new(from, turn).expect("a pose");
        let velocity = -from * random.between(0.2, 0.6) + 0.5 * random.in_cube();
        let motion = linear(velocity.to_array(), (2.0 * random.in_cube()).to_array());
        let screw = Motion::Screw {
            point: random.in_cube(),
            axis: random.direction(),
            angular_speed: random.between(-1.0, 1.0),
            pitch: random.between(-1.0, 1.0),
        };
        let case = Case::new(bumpy.clone(), start, motion, tetra.clone(), Pose::IDENTITY, screw);
        let options = TimeOfImpactOptions { tolerance: Length::Absolute(1e-4), end: 4.0, iterations: 1000 };
        hits += usize::from(case.check(&options, 40).impact().is_some());
    }
    assert!((6..24).contains(&hits), "{hits} of 24: the motions should both hit and miss");
}

#[test]
fn cylinders_and_boxes_are_free_before_the_impact_and_touch_at_it() {
    let mut random = Random(12);
    let block = boxed(DVec3::new(0.1, 0.2, 0.05));
    let shapes = [
        Shape::Cylinder { half_height: 0.01, radius: 0.1 },
        Shape::Cylinder { half_height: 0.3, radius: 0.02 },
        Shape::Box { half_extents: DVec3::new(0.1, 0.2, 0.05) },
        Shape::Capsule { half_height: 0.2, radius: 0.05 },
        block.into(),
    ];
    let options = TimeOfImpactOptions { tolerance: Length::Absolute(2e-7), end: 1.0, iterations: 1000 };
    let (mut hits, mut most) = (0, 0);
    for (a, b) in (0..3).flat_map(|i| (i..5).map(move |j| (i, j))).cycle().take(120) {
        let mut pose = |at: DVec3, size: f64| {
            let turn = DQuat::from_scaled_axis(3.0 * random.in_cube());
            // Some are as they are made, so that faces and round sides are parallel.
            let turn = if random.unit() < 0.3 { DQuat::IDENTITY } else { turn };
            Pose::new(at + size * random.in_cube(), turn).expect("a pose")
        };
        let poses = [pose(0.7 * DVec3::X, 0.1), pose(DVec3::ZERO, 0.1)];
        let mut spin = || if random.unit() < 0.3 { [0.0; 3] } else { (5.0 * random.in_cube()).to_array() };
        let motions = [linear([-1.0, 0.0, 0.0], spin()), linear([0.0; 3], spin())];
        let [first, second] = [a, b].map(|k: usize| shapes[k].clone());
        let case = Case::new(first, poses[0], motions[0], second, poses[1], motions[1]);
        let verdict = case.check(&options, 40);
        hits += usize::from(verdict.impact().is_some());
        most = most.max(verdict.iterations());
    }
    assert!((60..120).contains(&hits) && most < 500, "{hits} of 120, {most}");
}

#[test]
fn times_and_normals_are_known_to_tolerances_of_a_few_rounding_errors() {
    let mut random = Random(8);
    let ball = asset(&Surface::default().add_sphere(DVec3::ZERO, 2, || 1.0).solid());
    let tetra = boxed(DVec3::new(0.9, 0.2, 0.4));
    for _ in 0..12 {
        let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
        let from = 3.0 * random.direction();
        let start = Pose::new(from, turn).expect("a pose");
        let motion = linear((-from).to_array(), random.in_cube().to_array());
        let case = Case::new(ball.clone(), start, motion, tetra.clone(), Pose::IDENTITY, Motion::Rest);
        let options = |tolerance| TimeOfImpactOptions { tolerance: Length::Absolute(tolerance), ..EXACT };
        let (rough, fine) = (case.impact(&options(1e-7)), case.impact(&options(1e-12)));
        assert!(rough.time <= fine.time && fine.time - rough.time < 1e-6, "{rough:?} {fine:?}");
        // Also where it is that of two edges, which nearly touch.
        let [rough, fine] = [rough, fine].map(|impact| impact.clearance.normal);
        assert!(rough.distance(fine) < 2e-6, "{rough} {fine}");
    }
}

#[test]
fn bodies_in_contact_at_the_start_have_time_0() {
    let cube = boxed(DVec3::ONE);
    for (height, distance) in [(0.25, -0.25), (1.5, -0.5), (2.0, 0.0), (2.0 + 5e-7, 5e-7)] {
        let case = Case::new(
            cube.clone(),
            at(0.0, 0.0, height),
            Motion::Rest,
            cube.clone(),
            Pose::IDENTITY,
            Motion::Rest,
        );
        let impact = case.impact(&EXACT);
        assert_eq!((impact.time, impact.iterations), (0.0, 0));
        assert!((impact.clearance.distance - distance).abs() < 2e-7, "{impact:?}");
    }
}

#[test]
fn near_misses_are_free_in_a_few_steps() {
    // Unit cubes that slide past each other: over a side, over an edge, and corner by corner.
    let (cube, still) = (boxed(DVec3::splat(0.5)), Motion::Rest);
    let past = linear([1.0, 0.0, 0.0], [0.0; 3]);
    let turned = DQuat::from_rotation_z(0.25 * std::f64::consts::PI);
    let diagonal = std::f64::consts::SQRT_2;
    for gap in [1e-3, 1e-4, 1e-5] {
        let cases = [
            (Pose::at(DVec3::new(-3.0, 0.1, 1.0 + gap)), 6.0),
            (Pose::at(DVec3::new(-3.0, 1.0 + gap, 0.3)), 6.0),
            (Pose::new(DVec3::new(-3.0, 0.5 * (1.0 + diagonal) + gap, 0.0), turned).expect("a pose"), 6.0),
            // From the start, it is over the other cube.
            (Pose::at(DVec3::new(-0.5, 0.0, 1.0 + gap)), 1.0),
        ];
        for (pose, end) in cases {
            let case = Case::new(cube.clone(), pose, past, cube.clone(), Pose::IDENTITY, still);
            let verdict = case.check(&TimeOfImpactOptions { end, ..EXACT }, 60);
            assert!(verdict.is_free() && verdict.iterations() < 20, "{gap}: {verdict:?}");
        }
        // Corners of two cubes on their edges pass each other, above and beside.
        let on_edge = |x, y, z| Pose::new(DVec3::new(x, y, z), turned).expect("a pose");
        let case = Case::new(
            cube.clone(),
            on_edge(-3.0, diagonal + 0.7 * gap, 0.4),
            past,
            cube.clone(),
            on_edge(0.0, 0.0, 0.0),
            linear([-0.3, 0.0, 0.0], [0.0; 3]),
        );
        let verdict = case.check(&TimeOfImpactOptions { end: 6.0, ..EXACT }, 60);
        assert!(verdict.is_free() && verdict.iterations() < 40, "{gap}: {verdict:?}");
        // A gap less: they touch when the corners are above each other.
        let case = Case::new(
            cube.clone(),
            on_edge(-3.0, diagonal - gap, 0.4),
            past,
            cube.clone(),
            on_edge(0.0, 0.0, 0.0),
            still,
        );
        let impact = case.check_impact(&EXACT, 20);
        let (expected, late) = (3.0 - gap, 2e-6);
        assert!(impact.time <= expected && impact.time > expected - late, "{gap}: {impact:?}");
    }
}

#[test]
fn turning_past_at_a_small_gap_takes_a_few_steps() {
    // A cube turns by 0.01 above another one. Then a bar turns past the corner of a post: at the
    // end its corner, at a distance of √(9 + 0.01) from the axis, misses it by the gap.
    let cube = boxed(DVec3::splat(0.5));
    for gap in [1e-3, 1e-4, 1e-5] {
        let turn = linear([0.0; 3], [0.0, 0.0, 0.01]);
        let case = Case::new(
            cube.clone(),
            at(0.0, 0.0, 1.0 + gap),
            turn,
            cube.clone(),
            Pose::IDENTITY,
            Motion::Rest,
        );
        let verdict = case.check(&TimeOfImpactOptions { end: 1.0, ..EXACT }, 20);
        assert!(verdict.is_free() && verdict.iterations() < 20, "{gap}: {verdict:?}");
        let bar = boxed(DVec3::new(3.0, 0.1, 0.1));
        let corner = 9.01f64.sqrt();
        let turn = linear([0.0; 3], [0.0, 0.0, 1.0]);
        let post = at(0.0, corner + gap + 0.5, 0.0);
        let case = Case::new(bar, Pose::IDENTITY, turn, cube.clone(), post, Motion::Rest);
        let verdict = case.check(&TimeOfImpactOptions { end: 3.0, ..EXACT }, 60);
        assert!(verdict.is_free() && verdict.iterations() < 200, "{gap}: {verdict:?}");
    }
}

#[test]
fn a_cast_by_a_small_angle_takes_a_few_steps() {
    // A bar of length 1 falls about its end by up to 0.01 onto a plane 0.005 below its other end.
    let bar = boxed(DVec3::new(0.5, 0.1, 0.1));
    let hinge =
        Motion::Screw { point: DVec3::new(-0.5, 0.0, -0.1), axis: DVec3::Y, angular_speed: 0.01, pitch: 0.0 };
    for (drop, expected) in [(0.005, Some(0.005f64.asin() / 0.01)), (0.0101, None)] {
        let floor = at(0.0, 0.0, -0.1 - drop);
        let case = Case::new(bar.clone(), Pose::IDENTITY, hinge, Shape::Plane, floor, Motion::Rest);
        let verdict = case.check(&TimeOfImpactOptions { end: 1.0, ..EXACT }, 20);
        assert_eq!(verdict.impact().is_some(), expected.is_some(), "{verdict:?}");
        assert!(verdict.iterations() < 20, "{verdict:?}");
        if let (Some(impact), Some(expected)) = (verdict.impact(), expected) {
            assert!(impact.time <= expected && impact.time > expected - 1.1e-4, "{impact:?} {expected}");
        }
    }
}

/// The height of a box or a cylinder over the plane z = 0.
fn height_over_plane(shape: &Shape, pose: Pose) -> f64 {
    let down = pose.rotation.inverse() * DVec3::Z;
    pose.translation.z
        - match *shape {
            Shape::Box { half_extents } => half_extents.dot(down.abs()),
            Shape::Cylinder { half_height, radius } => {
                half_height * down.z.abs() + radius * down.truncate().length()
            }
            _ => panic!("a box or a cylinder"),
        }
}

#[test]
fn fast_boxes_and_cylinders_touch_a_plane_when_formulas_say() {
    let mut random = Random(5);
    let mut vector = |size: f64| size * random.in_cube();
    let coin = Shape::Cylinder { half_height: 0.01, radius: 0.1 };
    let rod = Shape::Cylinder { half_height: 0.3, radius: 0.02 };
    let block = Shape::Box { half_extents: DVec3::new(0.1, 0.2, 0.05) };
    let options = TimeOfImpactOptions { tolerance: Length::Absolute(1e-6), end: 0.2, iterations: 1000 };
    let (mut hits, mut most) = (0, 0);
    for (k, shape) in (0..60).flat_map(|k| [&coin, &rod, &block].map(|shape| (k, shape))) {
        let rotation = DQuat::from_scaled_axis(vector(3.0));
        let pose = Pose::new(vector(0.05) + DVec3::Z * 0.35, rotation).expect("a pose");
        let velocity = Velocity { linear: vector(2.0), angular: vector(40.0) };
        // About the middle or any other point; flat on the plane at first.
        let motion = match k % 3 {
            0 => Motion::About { point: pose.translation + vector(0.05), velocity },
            _ => Motion::Linear { velocity },
        };
        let pose = match k % 6 {
            1 => Pose::at(DVec3::Z * (2e-6 - height_over_plane(shape, Pose::IDENTITY))),
            _ => pose,
        };
        let case = Case::new(shape.clone(), pose, motion, Shape::Plane, Pose::IDENTITY, Motion::Rest);
        let verdict = case.verdict(&options);
        let until = verdict.free_until();
        for sample in 0..2_000 {
            let at = motion.pose_at(pose, until * f64::from(sample) / 2_000.0);
            let height = height_over_plane(shape, at);
            assert!(height > 0.0, "{k}, {shape:?}: {height} before {verdict:?}");
        }
        match verdict {
            TimeOfImpact::Impact(impact) => {
                let height = height_over_plane(shape, motion.pose_at(pose, impact.time));
                assert!(height <= 1e-6 + 1e-12, "{k}, {shape:?}: {height} at {impact:?}");
                hits += 1;
            }
            TimeOfImpact::Free { .. } => {}
            TimeOfImpact::Undecided(_) => panic!("{k}, {shape:?}: {verdict:?}"),
        }
        most = most.max(verdict.iterations());
    }
    assert!(hits > 30 && most < 300, "{hits} {most}");
}

#[test]
fn a_wheel_that_rolls_takes_one_step() {
    let wheel = Shape::Cylinder { half_height: 0.02, radius: 0.1 };
    let pose = Pose::new(DVec3::Z * (0.1 + 2e-6), DQuat::from_rotation_x(FRAC_PI_2)).expect("a pose");
    let rolling = linear([10.0, 0.0, 0.0], [0.0, 100.0, 0.0]);
    let case = Case::new(wheel, pose, rolling, Shape::Plane, Pose::IDENTITY, Motion::Rest);
    let verdict = case.check(&TimeOfImpactOptions { end: 1.0, ..EXACT }, 20);
    assert!(verdict.is_free() && verdict.iterations() <= 1, "{verdict:?}");
}

#[test]
fn simple_shapes_touch_when_formulas_say() {
    let ball = |radius| Shape::Sphere { radius };
    let rod = Shape::Capsule { half_height: 1.0, radius: 0.25 };
    let cube = Shape::Box { half_extents: DVec3::splat(0.5) };
    let across = Pose::new(DVec3::ZERO, DQuat::from_rotation_x(0.5 * std::f64::consts::PI)).expect("a pose");
    // Balls that meet off their centres; a rod and a ball, rods that cross, cubes.
    let cases = [
        (ball(1.0), at(-5.0, 1.2, 0.0), ball(1.0), Pose::IDENTITY, 5.0 - 2.56f64.sqrt()),
        (ball(0.5), at(-5.0, 0.0, 0.8), rod.clone(), Pose::IDENTITY, 4.25),
        (ball(0.5), at(-5.0, 0.0, 1.45), rod.clone(), Pose::IDENTITY, 5.0 - 0.36f64.sqrt()),
        (rod.clone(), at(-5.0, 0.4, 0.7), rod, across, 4.5),
        (cube.clone(), at(-5.0, 0.9, -0.9), cube.clone(), Pose::IDENTITY, 4.0),
        (boxed(DVec3::splat(0.5)).into(), at(-5.0, 0.9, -0.9), cube, Pose::IDENTITY, 4.0),
    ];
    for (a, from, b, to, expected) in cases {
        let fast = linear([1.0, 0.0, 0.0], [0.0; 3]);
        let case = Case::new(a.clone(), from, fast, b.clone(), to, Motion::Rest);
        let impact = case.check_impact(&EXACT, 20);
        assert!(impact.time <= expected && impact.time > expected - 4e-6, "{impact:?} {expected}");
        let swapped = Case::new(b, to, Motion::Rest, a, from, fast).impact(&EXACT);
        assert!((swapped.time - impact.time).abs() < 4e-6, "{impact:?} {swapped:?}");
    }
}

#[test]
fn used_up_steps_leave_it_undecided() {
    let cube = boxed(DVec3::ONE);
    let fall = linear([0.0, 0.0, -1.0], [0.3, 0.0, 0.2]);
    let case = |shape: &Arc<TeSdf>| {
        Case::new(shape.clone(), at(0.0, 0.0, 4.0), fall, cube.clone(), Pose::IDENTITY, Motion::Rest)
    };
    let impact = case(&cube).check_impact(&EXACT, 20);
    for iterations in 0..2 {
        let options = TimeOfImpactOptions { iterations, ..EXACT };
        let TimeOfImpact::Undecided(found) = case(&cube).verdict(&options) else { panic!("it is not known") };
        assert!(found.time < impact.time && found.iterations == iterations, "{found:?} {impact:?}");
        let gap = case(&cube).clearance(found.time);
        assert!(gap > 1e-6 && (gap - found.clearance.distance).abs() < 1e-6, "{found:?} {gap}");
    }
    // Rounding of places this far out is more than the tolerance.
    let far = DVec3::splat(1e10);
    let down = linear([0.0, 0.0, -1.0], [0.0; 3]);
    let case = Case::new(
        cube.clone(),
        Pose::at(far + 4.0 * DVec3::Z),
        linear([1e10, 0.0, -1.0], [0.0; 3]),
        cube.clone(),
        Pose::at(far),
        linear([1e10, 0.0, 0.0], [0.0; 3]),
    );
    let TimeOfImpact::Undecided(found) = case.verdict(&EXACT) else { panic!("it is not known") };
    assert!(found.time <= 2.0 && found.time > 1.999 && found.clearance.distance > 0.0, "{found:?}");
    let near = Case::new(cube.clone(), at(0.0, 0.0, 4.0), down, cube.clone(), Pose::IDENTITY, Motion::Rest);
    assert!(near.impact(&EXACT).time <= 2.0);
}

#[test]
fn a_nut_turns_freely_down_its_pitch_and_jams_otherwise() {
    let (bolt, nut) =
        (asset(&named("procedural/iso_m16_bolt_6k.obj")), asset(&named("procedural/iso_m16_nut_c100.obj")));
    let unit = bolt.bounds().extent().z / 40.0;
    let turn = DQuat::from_rotation_z(std::f64::consts::TAU * 5.0 / 2.0);
    let start = Pose::new(DVec3::new(0.0, 0.0, 5.0 * unit), turn).expect("a pose");
    let screw = |pitch: f64| Motion::Screw {
        point: DVec3::ZERO,
        axis: DVec3::Z,
        angular_speed: 1.0,
        pitch: pitch * unit,
    };
    let options =
        TimeOfImpactOptions { tolerance: Length::Absolute(0.02 * unit), end: 0.05, iterations: 400 };
    let case =
        |pitch| Case::new(nut.clone(), start, screw(pitch), bolt.clone(), Pose::IDENTITY, Motion::Rest);
    let free = case(2.0).verdict(&options);
    assert!(free.is_free(), "along its thread it is free: {free:?}");
    // With ten times the pitch, the nut is off by nine pitches per turn. The flanks are 0.05 apart,
    // so 0.058 along the axis, minus the effect of flat facets.
    let jam = case(20.0).check_impact(&options, 3);
    let shift = 18.0 * jam.time / std::f64::consts::TAU;
    assert!((0.01..0.06).contains(&shift), "{jam:?} after {shift}");
}

#[test]
fn invalid_motions_and_options_are_refused() {
    let ball = Shape::Sphere { radius: 1.0 };
    let case = |motion_a, motion_b, options: TimeOfImpactOptions| {
        let case =
            Case::new(ball.clone(), at(0.0, 0.0, 3.0), motion_a, Shape::Plane, Pose::IDENTITY, motion_b);
        time_of_impact(&case.scene, case.ids[0], case.ids[1], motion_a, motion_b, &options)
            .expect_err("an error")
    };
    let spin = linear([0.0; 3], [0.0, 1.0, 0.0]);
    let error = case(Motion::Rest, spin, EXACT).to_string();
    assert!(error.contains("instance 1") && error.contains("plane that turns"), "{error}");
    let error = case(linear([f64::NAN, 0.0, 0.0], [0.0; 3]), Motion::Rest, EXACT).to_string();
    assert!(error.contains("instance 0") && error.contains("velocity"), "{error}");
    let flat = Motion::Screw { point: DVec3::ZERO, axis: DVec3::ZERO, angular_speed: 1.0, pitch: 0.0 };
    assert!(case(flat, Motion::Rest, EXACT).to_string().contains("screw axis"));
    for (option, options) in [
        ("end", TimeOfImpactOptions { end: f64::INFINITY, ..EXACT }),
        ("end", TimeOfImpactOptions { end: -1.0, ..EXACT }),
        ("tolerance", TimeOfImpactOptions { tolerance: Length::Absolute(0.0), ..EXACT }),
    ] {
        let error = case(Motion::Rest, Motion::Rest, options);
        assert!(matches!(error, CollideError::Option { option: o, .. } if o == option), "{error}");
    }
}
