//! Cylinders against formulas: they roll, stand, spin and topple.
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use tesdf::collide::{CollideOptions, Instance, Pose, Shape, detect};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf_sim::newton::{Newton, NewtonOptions};
use tesdf_sim::{Dynamics, Mass, MassProperties, State, System};

use crate::support::meshes::tiles;

const G: f64 = 9.81;
const H: f64 = 0.08;
const R: f64 = 0.05;
const CYLINDER: Shape = Shape::Cylinder { half_height: H, radius: R };

/// A floor whose surface is at z = 0, and a cylinder in a state.
fn engine(gravity: DVec3, (floor, z): (Shape, f64), friction: f64, pose: Pose) -> Newton {
    let mut system = System::new(gravity);
    let floor = system.add_shape(floor).unwrap();
    system.add("floor", Instance::new(floor, Pose::at(DVec3::Z * z)), Mass::Fixed).unwrap();
    let mass = Mass::Free(MassProperties::of_shape(&CYLINDER, 1.0, 1000.0).unwrap());
    let shape = system.add_shape(CYLINDER).unwrap();
    system.add("cylinder", Instance::new(shape, pose), mass).unwrap();
    for body in 0..2 {
        system.set_friction(body, friction).unwrap();
    }
    let options = CollideOptions { contact_distance: 1e-3, ..CollideOptions::for_simulation() };
    Newton::new(system, detect, options, NewtonOptions::default()).unwrap()
}

fn floors() -> [(&'static str, (Shape, f64)); 3] {
    let mesh = SolidMesh::new(tiles(9, 1.8, 0.1)).expect("it is solid");
    let asset = Encoder::new().preset(Preset::Fast).encode(&mesh).expect("it encodes");
    let top = asset.bounds().max.z;
    [
        ("plane", (Shape::Plane, 0.0)),
        ("box", (Shape::Box { half_extents: DVec3::new(3.0, 3.0, 0.5) }, -0.5)),
        ("mesh", (Shape::Mesh(Arc::new(asset)), -top)),
    ]
}

/// Along y.
fn lying() -> DQuat {
    DQuat::from_rotation_x(FRAC_PI_2)
}

fn inclined(angle: f64) -> DVec3 {
    G * DVec3::new(angle.sin(), 0.0, -angle.cos())
}

#[test]
fn a_cylinder_rolls_down_as_its_formula() {
    for (name, floor) in floors() {
        let angle = 0.2f64;
        let start = Pose { translation: DVec3::new(-0.3, 0.03, R), rotation: lying() };
        let mut engine = engine(inclined(angle), floor, 0.8, start);
        let (h, steps) = (2e-3, 200);
        for step in 0..steps {
            assert!(engine.step(h).unwrap().converged, "{name}: step {step}");
        }
        let State { pose, linear, angular } = engine.system().states()[1];
        let time = h * f64::from(steps);
        // A solid cylinder: a = g sin α / (1 + ½).
        let expected = G * angle.sin() / 1.5 * time;
        assert!((linear.x / expected - 1.0).abs() < 2e-3, "{name}: {linear} instead of {expected}");
        assert!((angular.y * R / linear.x - 1.0).abs() < 1e-3, "{name}: it slips, {angular} {linear}");
        assert!((pose.translation.z - R).abs() < 5e-6, "{name}: {pose:?}");
        assert!(
            (pose.translation.y - 0.03).abs() < 1e-5 && linear.y.abs() < 1e-4,
            "{name}: {pose:?} {linear}"
        );
    }
}

#[test]
fn a_cylinder_goes_on_rolling() {
    for (name, floor) in floors() {
        let start = Pose { translation: DVec3::new(-0.4, 0.0, R), rotation: lying() };
        let mut engine = engine(inclined(0.0), floor, 0.5, start);
        let speed = 0.8;
        let mut states = engine.system().states().to_vec();
        (states[1].linear, states[1].angular) = (speed * DVec3::X, speed / R * DVec3::Y);
        engine.set_state(1, states[1]).unwrap();
        for _ in 0..400 {
            assert!(engine.step(2e-3).unwrap().converged, "{name}");
        }
        let State { pose, linear, .. } = engine.system().states()[1];
        assert!((linear.x / speed - 1.0).abs() < 1e-3, "{name}: {linear}");
        assert!((pose.translation.x - (speed * 0.8 - 0.4)).abs() < 1e-3, "{name}: {pose:?}");
        assert!((pose.translation.z - R).abs() < 5e-6, "{name}: {pose:?}");
    }
}

/// The slopes of the sides of the groove.
const SIDES: [f64; 2] = [0.7, 0.75];

/// A block with a groove along y, whose sides meet at the origin.
fn groove() -> Shape {
    let [left, right] = SIDES.map(|slope| 0.2 * slope.tan());
    let profile = [(0.0, 0.0), (-0.2, left), (-0.2, -0.1), (0.2, -0.1), (0.2, right)];
    let end = |y: f64| profile.map(|(x, z)| DVec3::new(x, y, z));
    let n = profile.len() as u32;
    let mut faces = Vec::new();
    for k in 0..n {
        let next = (k + 1) % n;
        faces.extend([[k, k + n, next], [next, k + n, next + n]]);
    }
    for k in 2..n {
        faces.extend([[0, k - 1, k], [n, n + k, n + k - 1]]);
    }
    let mesh = TriangleMesh::new([end(-0.3), end(0.3)].concat(), faces).unwrap();
    let solid = SolidMesh::new(mesh).expect("it is solid");
    Shape::Mesh(Arc::new(Encoder::new().preset(Preset::Fast).encode(&solid).expect("it encodes")))
}

#[test]
fn a_cylinder_spins_in_a_groove_without_friction() {
    // Its axis is at the same distance from both sides.
    let [a, b] = SIDES;
    let center = R / (0.5 * (a + b)).cos() * DVec3::new((0.5 * (a - b)).sin(), 0.0, (0.5 * (a - b)).cos());
    let start = Pose { translation: center, rotation: lying() };
    for spin in [40.0, -40.0] {
        let mut engine = engine(inclined(0.0), (groove(), 0.0), 0.0, start);
        let mut state = engine.system().states()[1];
        state.angular = spin * DVec3::Y;
        engine.set_state(1, state).unwrap();
        for _ in 0..300 {
            assert!(engine.step(2e-3).unwrap().converged);
        }
        let State { pose, linear, angular } = engine.system().states()[1];
        assert!((angular - spin * DVec3::Y).length() < 1e-3 * spin.abs(), "{angular}");
        assert!(linear.length() < 1e-3 && pose.translation.distance(center) < 1e-4, "{pose:?} {linear}");
    }
}

#[test]
fn a_cylinder_stands_and_topples() {
    for (name, floor) in floors() {
        // Upright on an incline: it stands while gravity passes through its end, if it does not slip.
        let edge = R.atan2(H);
        for (angle, stands) in [(0.0, true), (0.95 * edge, true), (1.05 * edge, false)] {
            let start = Pose::at(DVec3::new(-0.1, 0.05, H));
            let mut engine = engine(inclined(angle), floor.clone(), 2.0, start);
            for _ in 0..150 {
                engine.step(2e-3).unwrap();
            }
            let pose = engine.system().states()[1].pose;
            let lean = (pose.rotation * DVec3::Z).angle_between(DVec3::Z);
            assert_eq!(lean < 1e-4, stands, "{name}: it leans by {lean} on {angle}");
            let moved = pose.translation.distance(start.translation);
            assert!(!stands || moved < 1e-5, "{name}: it moved by {moved} on {angle}");
        }
    }
}

#[test]
fn a_cylinder_dropped_on_its_rim_comes_to_rest() {
    for (name, floor) in floors() {
        let rotation = DQuat::from_rotation_z(0.4) * DQuat::from_rotation_x(0.9);
        let start = Pose { translation: DVec3::new(0.02, 0.03, 0.12), rotation };
        let mut engine = engine(inclined(0.0), floor, 0.5, start);
        let mut deepest = 0.0f64;
        for _ in 0..1500 {
            engine.step(2e-3).unwrap();
            for contact in engine.contacts().iter() {
                deepest = deepest.min(contact.distance);
            }
        }
        let State { pose, linear, angular } = engine.system().states()[1];
        let height = pose.translation.z;
        assert!((height - R).abs() < 1e-5 || (height - H).abs() < 1e-5, "{name}: {pose:?}");
        // It may go on rolling.
        assert!(linear.z.abs() < 1e-3 && angular.z.abs() < 1e-2, "{name}: {linear} {angular}");
        assert!(deepest > -1e-4, "{name}: {deepest} deep");
    }
}
