//! Lobed pegs and holes, chain links and spools.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::solid::{Pair, data, gap, good, holes, message, near, radii, turned, volume};
use tesdf::Pose;
use tesdf::glam::{DQuat, DVec3};
use tesdf_parts::{ChainLink, Groove, LobedHole, LobedPeg, Lobes, Resolution, Spool};

#[test]
fn peg_and_hole_agree_with_the_meshes_in_data() {
    let ours = good(LobedPeg::DEFAULT.mesh(Resolution::Segments(192)));
    let theirs = data("lobed_peg.obj");
    near(volume(&ours) / volume(&theirs), 1.0, 1e-6);
    assert!((ours.bounds().extent() - theirs.bounds().extent()).abs().max_element() < 2e-9);
    for clearance in [50, 100, 150] {
        let hole = LobedHole { clearance: f64::from(clearance) * 1e-6, ..LobedHole::DEFAULT };
        let ours = good(hole.mesh(Resolution::Segments(192)));
        let theirs = data(&format!("lobed_hole_c{clearance}.obj"));
        near(volume(&ours) / volume(&theirs), 1.0, 1e-3);
        // Ours is wider by the deviation of a chord.
        let [a, b] = [&ours, &theirs].map(|mesh| radii(mesh, [10e-3, 20e-3]));
        assert!((0.0..4e-6).contains(&(a[0] - b[0])), "{:e}", a[0] - b[0]);
    }
}

#[test]
fn a_peg_has_its_clearance_in_the_hole() {
    for (lobes, segments) in
        [(LobedPeg::DEFAULT.lobes, 96), (Lobes { radius: 10e-3, amplitude: 0.3e-3, count: 5 }, 60)]
    {
        let resolution = Resolution::Segments(segments);
        let peg = good(LobedPeg { lobes, ..LobedPeg::DEFAULT }.mesh(resolution));
        let hole = LobedHole { lobes, clearance: 80e-6, ..LobedHole::DEFAULT };
        let hole = good(hole.mesh(resolution));
        let pair = Pair::new(&hole, &peg);
        let found = pair.gap(turned(0.0, DVec3::Z * 10e-3));
        let chord = 10e-3 * (1.0 - (PI / segments as f64).cos());
        assert!((80e-6..80e-6 + 2.5 * chord).contains(&found), "{found:e}, chords {chord:e}");
        // A lobe does not turn into a valley.
        assert!(pair.gap(turned(PI / lobes.count as f64, DVec3::Z * 10e-3)) < 0.0);
    }
}

#[test]
fn impossible_pegs_and_holes_are_errors() {
    let n = Resolution::DEFAULT;
    let peg = LobedPeg::DEFAULT;
    let lobes = |amplitude, count| Lobes { amplitude, count, ..peg.lobes };
    for (found, expected) in [
        (
            message(LobedPeg { lobes: lobes(5e-3, 3), ..peg }.mesh(n)),
            "the amplitude is 5 mm; expected less than 4 mm, half of the mean radius",
        ),
        (
            message(LobedPeg { lobes: lobes(1e-3, 0), ..peg }.mesh(n)),
            "the number of lobes is 0; expected 1 to 64",
        ),
        (
            message(LobedPeg { length: 1e-3, ..peg }.mesh(n)),
            "the length is 1 mm; expected more than 2 mm, twice the chamfer",
        ),
        (
            message(LobedHole { outer_radius: 9e-3, ..LobedHole::DEFAULT }.mesh(n)),
            "the outer radius is 9 mm; expected more than 9.7",
        ),
        // Valleys so narrow that the hole cannot be widened by its clearance are found by the check
        // of the surface.
        (
            message(LobedPeg { lobes: lobes(3.9e-3, 12), ..peg }.mesh(n)),
            "the chamfer is 1 mm; expected less than 0.",
        ),
    ] {
        assert!(found.starts_with(expected), "{found}\n{expected}");
    }
}

#[test]
fn a_link_has_its_volume_and_agrees_with_data() {
    let link = ChainLink::DEFAULT;
    let mesh = good(link.mesh(Resolution::Segments(192)));
    assert_eq!(holes(&mesh), 1);
    let wire = PI * 2.5e-3f64.powi(2);
    near(volume(&mesh) / (wire * (2.0 * 20e-3 + 2.0 * PI * 7e-3)), 1.0, 1e-3);
    assert!((mesh.bounds().extent() - data("chain_link.obj").bounds().extent()).abs().max_element() < 2e-9);
}

#[test]
fn links_fit_in_each_other() {
    let link = ChainLink::DEFAULT;
    let mesh = good(link.mesh(Resolution::Segments(48)));
    let pair = Pair::new(&mesh, &mesh);
    let next = |along: f64| Pose::new(DVec3::X * along, DQuat::from_rotation_x(FRAC_PI_2)).unwrap();
    // Slack by 0.5 mm, then tight, then too far.
    near(pair.gap(next(link.pitch() - 0.5e-3)), 0.5e-3, 30e-6);
    near(pair.gap(next(link.pitch())), 0.0, 30e-6);
    assert!(pair.gap(next(link.pitch() + 0.2e-3)) < -0.1e-3);
    let error = message(ChainLink { bend_radius: 4e-3, ..link }.mesh(Resolution::DEFAULT));
    assert_eq!(error, "the radius of the bends is 4 mm; expected more than 5 mm, so that the next link fits");
}

#[test]
fn a_spool_has_its_volume() {
    let spool = Spool::DEFAULT;
    let mesh = good(spool.mesh(Resolution::Segments(192)));
    assert_eq!(holes(&mesh), 1);
    let disc = |diameter: f64| PI / 4.0 * diameter * diameter;
    let expected = disc(60e-3) * 50e-3 + disc(90e-3) * 10e-3 - disc(12e-3) * 60e-3;
    near(volume(&mesh) / expected, 1.0, 1e-3);
}

#[test]
fn a_chain_lies_in_the_groove_of_a_spool() {
    let link = ChainLink { wire_diameter: 3e-3, straight: 6e-3, bend_radius: 4e-3 };
    let groove = Groove::of_chain(&link, 0.5e-3);
    let spool = Spool { groove: Some(groove), drum_length: 60e-3, ..Spool::DEFAULT };
    let drum = good(spool.mesh(Resolution::Segments(96)));
    let found = radii(&drum, [15e-3, 55e-3]);
    near(found[1], 30e-3, 1e-12);
    near(found[0], 30e-3 - groove.depth, 1e-12);
    // A link stands in the groove at +x, along the helix. Its middle is at the height of the drum.
    let height = 5e-3 + groove.pitch * ((30e-3 / groove.pitch).round() - 5e-3 / groove.pitch);
    let slope = (groove.pitch / (2.0 * PI * 28e-3)).atan();
    let standing = DQuat::from_rotation_x(slope) * DQuat::from_rotation_z(FRAC_PI_2);
    let link = good(link.mesh(Resolution::Segments(48)));
    let found = gap(&drum, &link, Pose::new(DVec3::new(31.5e-3, 0.0, height), standing).unwrap());
    assert!(found > 0.1e-3 && found < 0.8e-3, "{found:e}");
}

#[test]
fn impossible_spools_are_errors() {
    let n = Resolution::DEFAULT;
    let spool = Spool::DEFAULT;
    let groove = Groove { width: 5e-3, depth: 5e-3, pitch: 10e-3 };
    let with = |groove| message(Spool { groove: Some(groove), ..spool }.mesh(n));
    for (found, expected) in [
        (
            message(Spool { bore_diameter: 70e-3, ..spool }.mesh(n)),
            "the diameter of the drum is 60 mm; expected more than 70 mm, that of the bore",
        ),
        (with(Groove { pitch: 6e-3, ..groove }), "the pitch of the groove is 6 mm; expected more than 7.1"),
        (
            with(Groove { depth: 30e-3, ..groove }),
            "the depth of the groove is 30 mm; expected less than 22.8 mm",
        ),
    ] {
        assert!(found.starts_with(expected), "{found}\n{expected}");
    }
}
