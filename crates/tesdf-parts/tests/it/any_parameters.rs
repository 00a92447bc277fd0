//! Random dimensions give a good part or an error, never a bad mesh or a panic.

use crate::solid::good;
use proptest::prelude::*;
use tesdf::SolidMesh;
use tesdf_parts::{
    Bolt, Bore, ChainLink, Dogs, Finger, Gear, Groove, Hub, Keyway, LobedHole, LobedPeg, Lobes, Nut,
    PartError, Resolution, Section, Shaft, Size, Sleeve, Spline, Spool, Spoon, Teeth, Thread, ThreadRows,
};

/// Numbers of dimensions, a millimetre to some centimetres.
fn lengths() -> impl Strategy<Value = [f64; 8]> {
    prop::array::uniform8(0.5e-3..40e-3)
}

fn resolutions() -> impl Strategy<Value = Resolution> {
    prop_oneof![(12usize..60).prop_map(Resolution::Segments), (20e-6..1e-3).prop_map(Resolution::Deviation),]
}

/// A part must be good if it was made.
fn good_or_refused(part: Result<SolidMesh, PartError>) {
    match part {
        Ok(solid) => drop(good(Ok(solid))),
        Err(PartError::Parameter { .. } | PartError::Outlines { .. } | PartError::Overlap { .. }) => {}
        Err(error) => panic!("{error}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn threads(l in lengths(), resolution in resolutions(), pitch in 0.05..0.45f64, corners: bool) {
        let size = "M16".parse::<Size>().unwrap();
        let thread = Thread { diameter: l[0], pitch: pitch * l[0] };
        let rows = if corners { ThreadRows::Corners } else { ThreadRows::AsChords };
        let nut = Nut { thread, rows, height: l[1], across_flats: 2.0 * l[0], clearance: l[2] / 50.0 };
        good_or_refused(nut.mesh(resolution));
        let bolt = Bolt {
            thread,
            rows,
            length: 2.0 * l[1],
            thread_length: l[3],
            across_flats: 2.0 * l[0],
            head_height: l[4],
            washer_diameter: 1.5 * l[0],
            clearance: l[2] / 50.0,
            ..Bolt::iso_4014(size)
        };
        good_or_refused(bolt.mesh(resolution));
    }

    #[test]
    fn gears(l in lengths(), resolution in resolutions(), count in 5usize..60, shift in -0.5..0.9f64, dogs in 2usize..12) {
        let spline = Spline { count: dogs + 1, minor_diameter: l[0], major_diameter: l[0] * 1.15, width: l[0] / 8.0 };
        let teeth = Teeth { module: l[1] / 10.0, count, profile_shift: shift, backlash: l[2] / 400.0 };
        let dogs = Dogs {
            count: dogs,
            inner_radius: l[0] * 0.7,
            outer_radius: l[0] * 0.7 + l[3] / 4.0,
            height: l[4] / 10.0,
            clearance: l[5] / 100.0,
        };
        let bore = Bore::Splined { spline, clearance: l[6] / 1000.0 };
        let hub = Some(Hub { diameter: l[0] * 1.5 + l[3], height: l[7] });
        good_or_refused(Gear { teeth, width: l[7], bore: Some(bore), hub, dogs: Some(dogs) }.mesh(resolution));
        good_or_refused(Gear { teeth, width: l[7], bore: Some(Bore::Round { diameter: l[0] }), hub: None, dogs: None }.mesh(resolution));
        let sleeve = Sleeve { diameter: 2.0 * l[1], width: l[7], bore, groove_width: l[5] / 2.0, groove_depth: l[6] / 4.0, dogs };
        good_or_refused(sleeve.mesh(resolution));
        let keyway = Keyway { width: l[2] / 4.0, depth: l[3] / 6.0, length: l[4], start: l[5] / 10.0 };
        let sections = vec![
            Section::round(l[0], l[1]).with_keyway(keyway),
            Section::splined(spline, l[6]),
            Section::round(l[7], 2.0 * l[4]).with_keyway(keyway),
        ];
        good_or_refused(Shaft { sections, chamfer: l[5] / 20.0 }.mesh(resolution));
    }

    #[test]
    fn pegs_links_and_spools(l in lengths(), resolution in resolutions(), count in 1usize..8) {
        let lobes = Lobes { radius: l[0], amplitude: l[1] / 40.0, count };
        good_or_refused(LobedPeg { lobes, length: l[2], chamfer: l[3] / 20.0 }.mesh(resolution));
        let hole = LobedHole {
            lobes, clearance: l[4] / 100.0, depth: l[2], floor: l[5], outer_radius: 2.0 * l[0] + l[6], chamfer: l[3] / 20.0,
        };
        good_or_refused(hole.mesh(resolution));
        let link = ChainLink { wire_diameter: l[1] / 4.0, straight: l[2], bend_radius: l[3] };
        good_or_refused(link.mesh(resolution));
        let spool = Spool {
            drum_diameter: l[4] + l[5],
            drum_length: 3.0 * l[6],
            flange_diameter: l[4] + l[5] + l[7],
            flange_thickness: l[7],
            bore_diameter: l[4] / 2.0,
            groove: Some(Groove { width: l[0] / 4.0, depth: l[1] / 4.0, pitch: l[2] }),
        };
        good_or_refused(spool.mesh(resolution));
        good_or_refused(Spool { groove: None, ..spool }.mesh(resolution));
    }

    #[test]
    fn fingers_and_spoons(l in lengths(), resolution in resolutions()) {
        let finger = Finger {
            length: 2.0 * l[0],
            width: l[1],
            root_thickness: l[2],
            tip_thickness: l[3],
            pad_length: l[4],
            pad_height: l[5] / 10.0,
            groove_depth: l[6] / 10.0,
            hole_diameter: l[7] / 4.0,
        };
        good_or_refused(finger.mesh(resolution));
        let spoon = Spoon {
            length: 4.0 * l[0],
            bowl_width: l[1],
            bowl_depth: l[2] / 2.0,
            handle_width: l[3] / 4.0,
            thickness: l[4] / 20.0,
        };
        good_or_refused(spoon.mesh(resolution));
    }
}
