//! Gripper fingers and spoons.

use std::f64::consts::PI;

use crate::solid::{Pair, data, good, holes, message, near, turned, volume};
use tesdf::Pose;
use tesdf::glam::DVec3;
use tesdf_parts::{Finger, Resolution, Spoon};

#[test]
fn a_finger_has_its_volume() {
    let n = Resolution::Segments(192);
    let finger = Finger::DEFAULT;
    let plain = Finger { groove_depth: 0.0, hole_diameter: 0.0, ..finger };
    // Root, tapered part, pad.
    let side: f64 = 12e-3 * 40e-3 + (12e-3 + 7e-3) / 2.0 * 20e-3 + 2e-3 * 20e-3;
    let mesh = good(plain.mesh(n));
    assert_eq!(holes(&mesh), 0);
    near(volume(&mesh), side * 15e-3, 1e-15);
    let mesh = good(finger.mesh(n));
    assert_eq!(holes(&mesh), 2);
    let hole = PI / 4.0 * 4e-3f64.powi(2);
    near(volume(&mesh), (side - 9e-6 - 2.0 * hole) * 15e-3, 1e-3 * hole * 15e-3);
    let bounds = mesh.bounds();
    near(bounds.max.x, 0.0, 0.0);
    near(bounds.max.z, 60e-3, 1e-15);
    // Two fingers face each other.
    let pair = Pair::new(&mesh, &mesh);
    near(pair.gap(turned(PI, DVec3::X * 5e-3)), 5e-3, 1e-9);
    for (found, expected) in [
        (
            message(Finger { groove_depth: 11e-3, ..finger }.mesh(n)),
            "the depth of the groove is 11 mm; expected less than 10 mm, half of the pad and its thickness",
        ),
        (
            message(Finger { hole_diameter: 12e-3, ..finger }.mesh(n)),
            "the diameter of the holes is 12 mm; expected less than 10.8 mm",
        ),
        (
            message(Finger { tip_thickness: 13e-3, ..finger }.mesh(n)),
            "the thickness of the tip is 13 mm; expected less than 12 mm, the thickness of the root",
        ),
    ] {
        assert!(found.starts_with(expected), "{found}\n{expected}");
    }
}

#[test]
fn spoons_are_closed_and_nest() {
    let spoon = Spoon::DEFAULT;
    let resolutions = [Resolution::Segments(24), Resolution::DEFAULT, Resolution::Deviation(10e-6)];
    for (resolution, within) in resolutions.into_iter().zip([1.5e-3, 0.1e-3, 0.1e-3]) {
        let mesh = good(spoon.mesh(resolution));
        assert_eq!(holes(&mesh), 0);
        near(mesh.bounds().extent().x, 160e-3, 1e-12);
        near(mesh.bounds().extent().y, 40e-3, within);
    }
    let mesh = good(spoon.mesh(Resolution::Segments(48)));
    let theirs = data("spoon.obj");
    assert!((mesh.bounds().extent() - theirs.bounds().extent()).abs().max_element() < 3e-3);
    near(volume(&mesh) / volume(&theirs), 1.0, 0.1);
    // One lies in the other.
    let pair = Pair::new(&mesh, &mesh);
    assert!(pair.gap(Pose::at(DVec3::Z * 6e-3)) > 0.5e-3);
    let flat = message(Spoon { thickness: 0.0, ..spoon }.mesh(Resolution::DEFAULT));
    assert_eq!(flat, "the thickness is 0 mm; expected more than 0 mm");
}
