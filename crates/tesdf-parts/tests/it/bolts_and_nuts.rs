//! Bolts and nuts: dimensions of the standards, agreement with the meshes in `data`, and fits.

use std::f64::consts::PI;

use crate::solid::{Pair, data, good, holes, inside, message, near, radii, turned, volume};
use tesdf::glam::{DVec3, dvec3};
use tesdf_parts::{Bolt, Nut, Resolution, Size, Thread, ThreadRows};

fn m(text: &str) -> Size {
    text.parse().unwrap()
}

/// The bolt and the nut of the meshes in `data`.
fn data_bolt() -> Bolt {
    Bolt { length: 30e-3, thread_length: 24e-3, ..Bolt::iso_4014(m("M16")) }
}

fn data_nut(clearance: f64) -> Nut {
    Nut { height: 13e-3, clearance, ..Nut::iso_4032(m("M16")) }
}

/// ISO 4014 and 4032, in millimetres: size, pitch, width across flats, height of the head, shortest
/// length and its thread, height of the nut, least width across corners.
#[rustfmt::skip]
const STANDARDS: [(&str, [f64; 7]); 9] = [
    ("M3",  [0.5,   5.5,  2.0,  20.0, 12.0,  2.4,  6.01]),
    ("M6",  [1.0,  10.0,  4.0,  30.0, 18.0,  5.2, 11.05]),
    ("M8",  [1.25, 13.0,  5.3,  40.0, 22.0,  6.8, 14.38]),
    ("M10", [1.5,  16.0,  6.4,  45.0, 26.0,  8.4, 17.77]),
    ("M12", [1.75, 18.0,  7.5,  50.0, 30.0, 10.8, 20.03]),
    ("M16", [2.0,  24.0, 10.0,  65.0, 38.0, 14.8, 26.75]),
    ("M20", [2.5,  30.0, 12.5,  80.0, 46.0, 18.0, 32.95]),
    ("M24", [3.0,  36.0, 15.0,  90.0, 54.0, 21.5, 39.55]),
    ("M36", [4.0,  55.0, 22.5, 140.0, 84.0, 31.0, 60.79]),
];

#[test]
fn bolts_and_nuts_have_the_dimensions_of_the_standards() {
    for (name, mm) in STANDARDS {
        let [pitch, flats, head, length, thread, height, corners] = mm.map(|x| x * 1e-3);
        let bolt = Bolt::iso_4014(m(name));
        near(bolt.thread.pitch, pitch, 1e-15);
        near(bolt.thread_length, thread, 1e-15);
        let mesh = good(bolt.mesh(Resolution::Segments(48)));
        let size = mesh.bounds().extent();
        near(size.x, flats, 1e-12);
        assert!(size.y >= corners && size.y <= flats / 30f64.to_radians().cos() + 1e-12, "{name}");
        near(size.z, length + head, 1e-12);
        near(mesh.bounds().min.z, 0.0, 0.0);
        // Away from the tip and the run-out, major and minor diameter.
        let found = radii(&mesh, [2.0 * pitch, thread - pitch]);
        near(2.0 * found[1], bolt.thread.diameter, 1e-12);
        near(2.0 * found[0], bolt.thread.minor_diameter(), 1e-12);

        let mesh = good(Nut::iso_4032(m(name)).mesh(Resolution::Segments(48)));
        let size = mesh.bounds().extent();
        near(size.x, flats, 1e-12);
        near(size.z, height, 1e-12);
        assert!(size.y >= corners, "{name}");
        assert_eq!(holes(&mesh), 1);
    }
}

#[test]
fn every_size_is_made_at_every_resolution() {
    for size in Size::all() {
        for resolution in [Resolution::Segments(12), Resolution::Deviation(size.thread().diameter / 500.0)] {
            assert_eq!(holes(&good(Bolt::iso_4014(size).mesh(resolution))), 0);
            good(Nut::iso_4032(size).mesh(resolution));
        }
    }
}

/// At the pitch diameter, thread and groove take turns, half of a pitch each; and the thread rises
/// counter-clockwise.
#[test]
fn threads_are_right_handed_with_their_pitch() {
    let thread = m("M16").thread();
    let [bolt, nut] = [
        good(data_bolt().mesh(Resolution::Segments(96))),
        good(data_nut(25e-6).mesh(Resolution::Segments(96))),
    ];
    let radius = thread.pitch_diameter() / 2.0;
    for turn in [0.0, 0.125, 0.25, 0.5] {
        for pitches in [2.0, 3.0, 4.0] {
            let at = |phase: f64| {
                let angle = 2.0 * PI * turn;
                dvec3(radius * angle.cos(), radius * angle.sin(), (pitches + turn + phase) * thread.pitch)
            };
            for (phase, thread_there) in
                [(0.0, true), (0.22, true), (0.28, false), (0.5, false), (-0.22, true)]
            {
                assert_eq!(inside(&bolt, at(phase)), thread_there, "bolt, turn {turn}, phase {phase}");
                assert_eq!(inside(&nut, at(phase)), !thread_there, "nut, turn {turn}, phase {phase}");
            }
        }
    }
}

#[test]
fn bolt_and_nut_agree_with_the_meshes_in_data() {
    let ours = good(data_bolt().mesh(Resolution::Segments(96)));
    let theirs = data("iso_m16_bolt_24k.obj");
    // Rounded to 1 nm in the file.
    assert!((ours.bounds().extent() - theirs.bounds().extent()).abs().max_element() < 2e-9);
    for (a, b) in [(4e-3, 20e-3), (24.0e-3, 29e-3)] {
        let [ours, theirs] = [&ours, &theirs].map(|mesh| radii(mesh, [a, b]));
        near(ours[0], theirs[0], 2e-9);
        near(ours[1], theirs[1], 2e-9);
    }
    near(volume(&ours) / volume(&theirs), 1.0, 5e-3);
    for clearance in [25, 50, 100] {
        let ours = good(data_nut(f64::from(clearance) * 1e-6).mesh(Resolution::Segments(96)));
        let theirs = data(&format!("iso_m16_nut_c{clearance}.obj"));
        assert!((ours.bounds().extent() - theirs.bounds().extent()).abs().max_element() < 2e-9);
        let [a, b] = [&ours, &theirs].map(|mesh| radii(mesh, [4e-3, 9e-3]));
        near(a[0], b[0], 2e-9);
        near(volume(&ours) / volume(&theirs), 1.0, 5e-3);
    }
}

/// The gap of the flanks is half of the clearance. It is never less, and more by less than the
/// chords of bolt and nut deviate.
#[test]
fn a_nut_has_its_clearance_on_the_bolt() {
    let segments = 48;
    let bolt = good(data_bolt().mesh(Resolution::Segments(segments)));
    let chord = 8e-3 * (1.0 - (PI / segments as f64).cos());
    for clearance in [25e-6, 100e-6] {
        let nut = good(data_nut(clearance).mesh(Resolution::Segments(segments)));
        let pair = Pair::new(&bolt, &nut);
        // At the pose of the bolt, and turned up the thread by steps that are no whole columns.
        for turns in [1.0, 2.3, 4.71] {
            let found = pair.gap(turned(2.0 * PI * turns, DVec3::Z * turns * 2e-3));
            assert!(
                (clearance / 2.0..clearance / 2.0 + chord).contains(&found),
                "{clearance}: {found:e} after {turns} turns"
            );
        }
        // Out of step by a quarter of a pitch, it overlaps.
        assert!(pair.gap(turned(0.0, DVec3::Z * 2.5e-3)) < 0.0);
    }
    // A bolt with clearance in a nut without.
    let bolt = good(Bolt { clearance: 60e-6, ..data_bolt() }.mesh(Resolution::Segments(segments)));
    let nut = good(data_nut(0.0).mesh(Resolution::Segments(segments)));
    let found = Pair::new(&bolt, &nut).gap(turned(0.0, DVec3::Z * 4e-3));
    assert!((30e-6..30e-6 + chord).contains(&found), "{found:e}");
}

#[test]
fn the_resolution_bounds_the_number_of_faces_and_the_chords() {
    let faces = |resolution| good(Bolt::iso_4014(m("M16")).mesh(resolution)).faces().len();
    assert!((22_000..26_000).contains(&faces(Resolution::DEFAULT)), "{}", faces(Resolution::DEFAULT));
    assert!((3500..4500).contains(&faces(Resolution::Segments(24))));
    // Between thread and head the shank is a cylinder.
    let bolt = good(data_bolt().mesh(Resolution::Deviation(20e-6)));
    let mut deviation: f64 = 0.0;
    for face in 0..bolt.faces().len() {
        let corners = bolt.triangle(face);
        if corners.iter().all(|p| p.z > 25e-3 && p.z < 29.3e-3) {
            let middle = (corners[0] + corners[1]) / 2.0;
            deviation = deviation.max(8e-3 - middle.truncate().length());
        }
    }
    assert!((5e-6..20e-6).contains(&deviation), "{deviation:e}");
}

#[test]
fn impossible_bolts_and_nuts_are_errors_that_name_the_limit() {
    let bolt = Bolt::iso_4014(m("M16"));
    let nut = Nut::iso_4032(m("M16"));
    let n = Resolution::Segments(24);
    for (found, expected) in [
        (
            message(Bolt { thread_length: 65e-3, ..bolt }.mesh(n)),
            "the thread length is 65 mm; expected less than 62.84 mm, the length without run-out and fillet",
        ),
        (message(Bolt { length: -1.0, ..bolt }.mesh(n)), "the length is -1000 mm; expected more than 0 mm"),
        (
            message(Bolt { clearance: 2e-3, ..bolt }.mesh(n)),
            "the clearance is 2 mm; expected less than 1.082532 mm, the depth of the thread",
        ),
        (
            message(Nut { across_flats: 17e-3, ..nut }.mesh(n)),
            "the width across flats is 16.15 mm; expected more than",
        ),
        (message(nut.mesh(Resolution::Segments(3))), "the number of segments is 3; expected 12 to 4096"),
        (
            message(nut.mesh(Resolution::Deviation(f64::NAN))),
            "the deviation is NaN mm; expected at least 0.000004 mm, which takes 4096 segments",
        ),
        (
            message(
                Nut { thread: Thread { pitch: 1e-5, ..nut.thread }, clearance: 0.0, ..nut }
                    .mesh(Resolution::Segments(4000)),
            ),
            "the nut would have about",
        ),
        (
            message(Nut { thread: Thread { diameter: 4e-3, pitch: 3e-3 }, ..nut }.mesh(n)),
            "the pitch is 3 mm; expected less than 2 mm, half of the thread diameter",
        ),
    ] {
        assert!(found.starts_with(expected), "{found}\n{expected}");
    }
    // A short bolt is threaded up to its run-out.
    assert_eq!(Bolt::iso_thread_length(&bolt.thread, 0.03), Bolt::longest_thread(&bolt.thread, 0.03));
    good(Bolt { length: 0.03, thread_length: Bolt::iso_thread_length(&bolt.thread, 0.03), ..bolt }.mesh(n));
}

#[test]
fn threads_with_rows_at_their_corners_alone_have_four_in_a_pitch() {
    let segments = 96;
    let bolt = |turns: f64, rows| {
        let bolt = Bolt { length: 60e-3, thread_length: turns * 2e-3, rows, ..Bolt::iso_4014(m("M16")) };
        good(bolt.mesh(Resolution::Segments(segments)))
    };
    let more = |rows| bolt(20.0, rows).faces().len() - bolt(10.0, rows).faces().len();
    assert_eq!(more(ThreadRows::Corners), 10 * 4 * 2 * segments);
    // Flanks are 1.25 mm wide, and chords 0.52 mm long.
    assert_eq!(more(ThreadRows::AsChords), 10 * 6 * 2 * segments);
    let radii = radii(&bolt(20.0, ThreadRows::Corners), [6e-3, 30e-3]);
    near(radii[0], Size::thread(&m("M16")).minor_diameter() / 2.0, 1e-12);
    near(radii[1], 8e-3, 1e-12);
}
