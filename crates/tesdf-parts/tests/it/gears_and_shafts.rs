//! Gears, dog clutches, sleeves and shafts.

use std::f64::consts::PI;

use crate::solid::{Pair, data, gap, good, holes, inside, message, near, radii, turned, volume};
use tesdf::Pose;
use tesdf::glam::{DQuat, DVec3};
use tesdf_parts::{
    Bore, Dogs, Gear, Hub, Keyway, PartError, Profile, Resolution, Section, Shaft, Sleeve, Spline, Teeth,
};

/// The dog teeth of the default sleeve.
fn dogs() -> Dogs {
    Sleeve::DEFAULT.dogs
}

/// A gear for the default sleeve: 36 teeth, a hub, and dog teeth on the hub.
fn dog_gear() -> Gear {
    Gear {
        teeth: Teeth { count: 36, ..Gear::DEFAULT.teeth },
        bore: Some(Bore::Round { diameter: 27e-3 }),
        hub: Some(Hub { diameter: 44e-3, height: 4e-3 }),
        dogs: Some(dogs()),
        ..Gear::DEFAULT
    }
}

#[test]
fn gears_of_many_kinds_are_closed() {
    let fine = Resolution::Deviation(5e-6);
    for resolution in [Resolution::Segments(12), Resolution::DEFAULT, fine] {
        for (count, profile_shift, module) in
            [(18, 0.0, 2e-3), (12, 0.35, 0.5e-3), (10, 0.45, 5e-3), (41, -0.3, 1e-3), (120, 0.5, 1e-3)]
        {
            let teeth = Teeth { module, count, profile_shift, backlash: 0.02 * module };
            let gear = Gear { teeth, width: 5.0 * module, bore: None, ..Gear::DEFAULT };
            assert_eq!(holes(&good(gear.mesh(resolution))), 0);
            let bore = Some(Bore::Round { diameter: teeth.root_radius() });
            let mesh = good(Gear { bore, ..gear }.mesh(resolution));
            assert_eq!(holes(&mesh), 1);
            let found = radii(&mesh, [0.0, 0.0]);
            near(found[1], teeth.tip_radius(), 1e-12);
            near(found[0], teeth.root_radius() / 2.0, 1e-12);
        }
        assert_eq!(holes(&good(dog_gear().mesh(resolution))), 1);
        let splined = Bore::Splined { spline: Spline::ISO_14_6X23X26, clearance: 0.05e-3 };
        good(Gear { bore: Some(splined), ..dog_gear() }.mesh(resolution));
        good(Gear { hub: None, ..dog_gear() }.mesh(resolution));
    }
}

#[test]
fn the_gear_agrees_with_the_mesh_in_data() {
    let ours = good(Gear::DEFAULT.mesh(Resolution::DEFAULT));
    let theirs = data("spur_gear_m2_z20.obj");
    let middle = [0.2e-3, 11.8e-3];
    // Between their chamfers.
    near(radii(&ours, [0.0, 0.0])[1], radii(&theirs, middle)[1], 2e-9);
    near(ours.bounds().extent().z, theirs.bounds().extent().z, 2e-9);
    // Theirs has chamfered tips, and no fillets.
    near(volume(&ours) / volume(&theirs), 1.0, 0.02);
    // Ours runs with theirs.
    let pair = Pair::new(&theirs, &ours);
    for angle in [0.0, 3.0f64, 7.0] {
        let angle = angle.to_radians();
        let found = pair.gap(turned(9f64.to_radians() - angle, DVec3::X * 40e-3));
        // The other gear does not turn here, so only the first angle is in mesh.
        assert_eq!(found > 0.0, angle == 0.0, "{found:e}");
    }
}

/// Two gears at their centre distance, through one pitch: each flank has half of the backlash from
/// the other, measured along the line of action.
#[test]
fn gear_pairs_run_with_their_backlash() {
    let resolution = Resolution::Segments(144);
    for (counts, shift) in [([20, 20], 0.0), ([18, 31], 0.0), ([14, 30], 0.25)] {
        let backlash = 60e-6;
        let gear = |count: usize, profile_shift: f64| Gear {
            teeth: Teeth { module: 2e-3, count, profile_shift, backlash },
            ..Gear::DEFAULT
        };
        let [a, b] = [gear(counts[0], shift), gear(counts[1], -shift)];
        let distance = a.teeth.pitch_radius() + b.teeth.pitch_radius();
        let meshes = [a, b].map(|gear| good(gear.mesh(resolution)));
        let pair = Pair::new(&meshes[0], &meshes[1]);
        let ratio = counts[0] as f64 / counts[1] as f64;
        // The pose of b seen from a, when a has turned by the angle.
        let pose = |angle: f64, more: f64| {
            let own = PI + PI / counts[1] as f64 - ratio * angle + more;
            let back = DQuat::from_rotation_z(-angle);
            Pose::new(back * DVec3::X * distance, back * DQuat::from_rotation_z(own)).unwrap()
        };
        let expected = backlash * 20f64.to_radians().cos();
        for step in 0..8 {
            let angle = 2.0 * PI / counts[0] as f64 * f64::from(step) / 8.0;
            let found = pair.gap(pose(angle, 0.0));
            assert!(
                (expected - 1e-6..expected + 4e-6).contains(&found),
                "{counts:?}, step {step}: {found:e}"
            );
            // Each gear is thinner by the backlash, so the second one can turn by this length.
            let turn = backlash / b.teeth.pitch_radius();
            assert!(pair.gap(pose(angle, 0.8 * turn)) > 0.0);
            assert!(pair.gap(pose(angle, 1.15 * turn)) < 0.0);
            assert!(pair.gap(pose(angle, -1.15 * turn)) < 0.0);
        }
    }
}

#[test]
fn a_sleeve_engages_with_a_gear() {
    let resolution = Resolution::Segments(48);
    let gear = good(dog_gear().mesh(resolution));
    let sleeve = good(Sleeve::DEFAULT.mesh(resolution));
    let pair = Pair::new(&gear, &sleeve);
    // The sleeve above the hub, whose end is at 16 mm: apart, then with 2 of 3 mm engaged.
    let engaged = 16e-3 + 3e-3 + 1e-3;
    let half = PI / 6.0;
    assert!(pair.gap(turned(0.0, DVec3::Z * engaged)) < 0.0, "tooth on tooth");
    let gap = dogs().clearance * dogs().inner_radius / (dogs().inner_radius + dogs().outer_radius) * 2.0;
    near(pair.gap(turned(half, DVec3::Z * engaged)), gap, 0.03 * gap);
    near(pair.gap(turned(0.0, DVec3::Z * (16e-3 + 6e-3 + 2e-3))), 2e-3, 1e-9);
    // The sleeve has teeth on both ends.
    let extent = sleeve.bounds();
    near(extent.min.z, -3e-3, 1e-12);
    near(extent.max.z, 19e-3, 1e-12);
    assert_eq!(holes(&sleeve), 1);
    assert!(!inside(&sleeve, DVec3::new(19e-3, 0.1e-3, 8e-3)), "the groove");
    assert!(inside(&sleeve, DVec3::new(17e-3, 0.1e-3, 8e-3)));
}

#[test]
fn a_sleeve_slides_on_its_splined_shaft() {
    let resolution = Resolution::Segments(96);
    let sleeve = good(Sleeve::DEFAULT.mesh(resolution));
    let shaft = Shaft {
        sections: vec![
            Section::round(20e-3, 10e-3),
            Section::splined(Spline::ISO_14_6X23X26, 60e-3),
            Section::round(18e-3, 10e-3),
        ],
        chamfer: 1e-3,
    };
    let mesh = good(shaft.mesh(resolution));
    let pair = Pair::new(&mesh, &sleeve);
    let found = pair.gap(turned(0.0, DVec3::Z * 30e-3));
    near(found, 0.05e-3, 10e-6);
    assert!(pair.gap(turned(0.2, DVec3::Z * 30e-3)) < 0.0);
    near(radii(&mesh, [10e-3, 70e-3])[1], 13e-3, 1e-12);
}

#[test]
fn a_shaft_has_its_volume_and_its_keyway() {
    let shaft = Shaft::example();
    let mesh = good(shaft.mesh(Resolution::Segments(384)));
    assert_eq!(holes(&mesh), 0);
    let cylinder = |diameter: f64, length: f64| PI / 4.0 * diameter * diameter * length;
    let cone = |r: f64| PI * (r * r - r * 1e-3 + 1e-6 / 3.0) * 1e-3;
    let mut expected = cylinder(22e-3, 2e-3) + cylinder(24e-3, 33e-3) + cylinder(30e-3, 5e-3);
    expected += cylinder(16e-3, 19e-3) + cylinder(20e-3, 29e-3) + cone(8e-3) + cone(10e-3);
    // The keyway up to the chord of its edges; the rest of the segment above is within 2 %.
    let [width, length] = [5e-3f64, 19e-3];
    let area = width * (length - width) + PI / 4.0 * width * width;
    let sagitta = 10e-3 - (1e-4f64 - 6.25e-6).sqrt();
    let keyway = area * (3e-3 - sagitta / 3.0);
    near(volume(&mesh), expected - keyway, 0.01 * keyway + 2e-4 * expected);

    // The keyway of data/procedural/shaft_keyway.obj: floor at y = -7 mm, from 65 to 84 mm.
    for mesh in [&mesh, &data("shaft_keyway.obj")] {
        for (point, expected) in [
            ((0.1, -6.9, 75.03), true),
            ((0.1, -7.1, 75.03), false),
            ((2.4, -8.0, 75.03), false),
            ((2.6, -8.0, 75.03), true),
            ((0.1, -8.0, 65.1), false),
            ((0.1, -8.0, 64.9), true),
            ((0.1, -8.0, 83.9), false),
            ((0.1, -8.0, 84.1), true),
            ((2.0, -8.0, 65.5), true),
            ((0.1, 9.8, 75.03), true),
            ((0.1, 14.8, 57.03), true),
            ((0.1, 11.8, 50.03), true),
            ((0.1, 12.2, 50.03), false),
            ((0.1, 7.8, 10.03), true),
            ((0.1, 8.2, 10.03), false),
        ] {
            let (x, y, z) = point;
            assert_eq!(inside(mesh, DVec3::new(x, y, z) * 1e-3), expected, "{point:?}");
        }
    }
}

#[test]
fn shafts_with_a_keyway_in_any_section_are_closed() {
    let keyway = Keyway { width: 6e-3, depth: 3.5e-3, length: 20e-3, start: 3e-3 };
    for resolution in [Resolution::Segments(12), Resolution::Segments(50), Resolution::Deviation(1e-6)] {
        for k in 0..3 {
            let diameters = [20e-3, 30e-3, 24e-3];
            let mut sections = diameters.map(|diameter| Section::round(diameter, 26e-3)).to_vec();
            sections[k] = sections[k].with_keyway(keyway);
            good(Shaft { sections, chamfer: 0.5e-3 }.mesh(resolution));
        }
        good(Shaft { sections: vec![Section::round(0.01, 0.05)], chamfer: 0.0 }.mesh(resolution));
    }
}

#[test]
fn impossible_gears_sleeves_and_shafts_are_errors() {
    let n = Resolution::DEFAULT;
    let gear = Gear::DEFAULT;
    let teeth = |teeth: Teeth| message(Gear { teeth, ..gear }.mesh(n));
    let shaft = |sections: Vec<Section>| message(Shaft { sections, chamfer: 1e-3 }.mesh(n));
    let keyed = |keyway| shaft(vec![Section::round(20e-3, 30e-3).with_keyway(keyway)]);
    let keyway = Keyway { width: 5e-3, depth: 3e-3, length: 19e-3, start: 5e-3 };
    for (found, expected) in [
        (
            teeth(Teeth { count: 14, ..gear.teeth }),
            "the profile shift is 0 modules; expected 0.182 (below it, 14 teeth are undercut) to 1",
        ),
        (
            teeth(Teeth { count: 8, profile_shift: 1.0, ..gear.teeth }),
            "the profile shift is 1 modules; expected less: the tips would be narrower",
        ),
        (
            teeth(Teeth { backlash: 1.5e-3, ..gear.teeth }),
            "the backlash is 1.5 mm; expected less than 0.6 mm, 0.3 modules",
        ),
        (teeth(Teeth { module: 0.0, ..gear.teeth }), "the module is 0 mm; expected more than 0 mm"),
        (
            message(Gear { bore: Some(Bore::Round { diameter: 36e-3 }), ..gear }.mesh(n)),
            "the radius of the bore is 18 mm; expected less than 17.4",
        ),
        (
            message(Gear { hub: Some(Hub { diameter: 36e-3, height: 1e-3 }), ..gear }.mesh(n)),
            "the diameter of the hub is 36 mm; expected less than 34.9",
        ),
        (
            message(Gear { dogs: Some(Dogs { outer_radius: 30e-3, ..dogs() }), ..gear }.mesh(n)),
            "the outer radius of the dog teeth is 30 mm; expected less than 17.4",
        ),
        (
            message(Sleeve { groove_depth: 9e-3, ..Sleeve::DEFAULT }.mesh(n)),
            "the depth of the groove is 9 mm; expected less than 8.9",
        ),
        (
            shaft(vec![Section::round(20e-3, 10e-3), Section::round(20e-3, 10e-3)]),
            "the diameter of a section is 20 mm, as that of the section before it; expected another one",
        ),
        (shaft(vec![]), "the number of sections is 0; expected 1 to 1000"),
        (
            keyed(Keyway { length: 26e-3, ..keyway }),
            "the end of the keyway is 31 mm; expected less than 30 mm, the length of its section",
        ),
        (
            keyed(Keyway { depth: 0.1e-3, ..keyway }),
            "the depth of the keyway is 0.1 mm; expected more than 0.3175",
        ),
        (keyed(Keyway { start: 0.5e-3, ..keyway }), "the chamfer is 1 mm; expected less than 0.5 mm"),
    ] {
        assert!(found.starts_with(expected), "{found}\n{expected}");
    }
    // A round section between the roots and the tips of a spline crosses its outline.
    let crossing = Shaft {
        sections: vec![Section::round(25e-3, 10e-3), Section::splined(Spline::ISO_14_6X23X26, 20e-3)],
        chamfer: 1e-3,
    };
    assert!(matches!(crossing.mesh(n), Err(PartError::Outlines { part: "shaft" })));
    assert_eq!(Section::round(0.01, 0.1).profile, Profile::Round { diameter: 0.01 });
    assert!(gap(&good(gear.mesh(n)), &good(gear.mesh(n)), turned(0.0, DVec3::Z * 0.02)) > 0.0079);
}
