//! Compares the time of impact with formulas, and with clearances at many earlier times.

use std::sync::Arc;

use crate::support::meshes::named;
use crate::support::random::Random;
use crate::support::shapes::Shape as Surface;
use tesdf::collide::{
    ClearanceOptions, CollideError, Impact, Instance, InstanceId, Motion, Pose, Scene, Shape,
    TimeOfImpactOptions, Velocity, clearance, time_of_impact,
};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::SolidMesh;
use tesdf::{Length, TeSdf};

fn asset(solid: &SolidMesh) -> Arc<TeSdf> {
    Arc::new(Encoder::new().preset(Preset::Fast).encode(solid).expect("it encodes"))
}

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

    fn impact(&self, options: &TimeOfImpactOptions) -> Option<Impact> {
        let ([a, b], [motion_a, motion_b]) = (self.ids, self.motions);
        time_of_impact(&self.scene, a, b, motion_a, motion_b, options).expect("an answer")
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
    /// within the tolerance at the impact.
    fn check(&self, options: &TimeOfImpactOptions, samples: u32) -> Option<Impact> {
        let impact = self.impact(options);
        let until = impact.map_or(options.end, |i| i.time);
        for k in 0..samples {
            let time = until * f64::from(k) / f64::from(samples);
            assert!(self.clearance(time) > 0.0, "{impact:?}: touching at {time} already");
        }
        if let (Some(impact), Length::Absolute(tolerance)) = (impact, options.tolerance) {
            let there = self.clearance(impact.time);
            assert!((there - impact.clearance.distance).abs() < 1e-6, "{impact:?} {there}");
            assert!(there > 0.0 && (there <= tolerance || !impact.touches), "{impact:?} {there}");
        }
        impact
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
        let impact = case.check(&EXACT, 20).expect("it lands");
        assert!(impact.touches && impact.time <= expected, "{impact:?}");
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
    assert!(
        Case::new(ball.clone(), at(2.0, 0.0, 0.0), alike, cube.clone(), Pose::IDENTITY, alike)
            .impact(&EXACT)
            .is_none()
    );
    let away = linear([1.0, 0.0, 0.0], [0.0; 3]);
    let case = Case::new(ball.clone(), at(2.0, 0.0, 0.0), away, cube.clone(), Pose::IDENTITY, Motion::Rest);
    assert!(case.check(&EXACT, 5).is_none());
    // The end of the interval comes first.
    let slow = linear([-0.05, 0.0, 0.0], [0.0; 3]);
    assert!(
        Case::new(ball, at(2.0, 0.0, 0.0), slow, cube, Pose::IDENTITY, Motion::Rest).impact(&EXACT).is_none()
    );
}

#[test]
fn fast_bodies_do_not_tunnel_through_thin_bodies() {
    // A sheet that passes through a sheet of the same thickness in 2e-10 of the time.
    let sheet = boxed(DVec3::new(1.0, 1.0, 1e-4));
    let fast = linear([0.0, 0.0, -1e6], [0.0; 3]);
    let case = Case::new(sheet.clone(), at(0.3, 0.2, 500.0), fast, sheet, Pose::IDENTITY, Motion::Rest);
    let impact = case.check(&TimeOfImpactOptions { end: 1.0, ..EXACT }, 10).expect("they meet");
    assert!(impact.touches && (impact.time - (500.0 - 2e-4) / 1e6).abs() < 2e-12, "{impact:?}");
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
        let impact = case.check(&EXACT, 20).expect("it hits");
        assert!(
            impact.touches && impact.time <= expected && impact.time > expected - 2e-6,
            "{impact:?} {expected}"
        );
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
    let impact = case.check(&EXACT, 20).expect("it hits");
    assert!((impact.time - expected).abs() < 2e-6, "{impact:?} {expected}");
}

#[test]
fn random_motions_are_free_before_the_impact_and_touch_at_it() {
    let mut random = Random(6);
    let bumpy = asset(&Surface::default().add_sphere(DVec3::ZERO, 1, || random.between(0.7, 1.0)).solid());
    let tetra = boxed(DVec3::new(0.9, 0.2, 0.4));
    let mut hits = 0;
    for _ in 0..12 {
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
        if let Some(impact) = case.check(&options, 40) {
            assert!(impact.touches, "{impact:?}");
            hits += 1;
        }
    }
    assert!((3..12).contains(&hits), "{hits} of 12: the motions should both hit and miss");
}

#[test]
fn bodies_in_contact_at_the_start_have_time_0() {
    let cube = boxed(DVec3::ONE);
    for (height, distance) in [(1.5, -0.5), (2.0, 0.0), (2.0 + 5e-7, 5e-7)] {
        let case = Case::new(
            cube.clone(),
            at(0.0, 0.0, height),
            Motion::Rest,
            cube.clone(),
            Pose::IDENTITY,
            Motion::Rest,
        );
        let impact = case.impact(&EXACT).expect("it touches");
        assert_eq!((impact.time, impact.iterations, impact.touches), (0.0, 0, true));
        assert!((impact.clearance.distance - distance).abs() < 2e-7, "{impact:?}");
    }
}

#[test]
fn exhausted_iterations_are_reported() {
    // Sliding along a wall at a distance of 0.01 needs a very large number of steps.
    let (cube, slide) = (boxed(DVec3::ONE), linear([1.0, 0.0, 0.0], [0.0; 3]));
    let case = Case::new(cube.clone(), at(0.0, 0.0, 2.01), slide, cube, Pose::IDENTITY, Motion::Rest);
    let options = TimeOfImpactOptions { iterations: 10, ..EXACT };
    let impact = case.check(&options, 5).expect("a lower bound");
    assert!(!impact.touches && impact.iterations == 10, "{impact:?}");
    assert!((impact.time - 0.1).abs() < 1e-4, "{impact:?}");
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
    assert_eq!(case(2.0).impact(&options), None, "along its thread it is free");
    // With ten times the pitch, the nut is off by nine pitches per turn. The flanks are 0.05 apart,
    // so 0.058 along the axis, minus the effect of flat facets.
    let jam = case(20.0).check(&options, 3).expect("it jams");
    let shift = 18.0 * jam.time / std::f64::consts::TAU;
    assert!(jam.touches && (0.01..0.06).contains(&shift), "{jam:?} after {shift}");
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
