//! Contacts per face against contacts per cell, and flat contact between bodies that rest on each
//! other.

use crate::support::bodies::{Placed, RELATIONS, Relation, of_direction, scene};
use crate::support::per_face::{Detection, block};
use crate::support::random::Random;
use crate::support::rotation::{least, of_the_day};
use tesdf::collide::{
    CollideOptions, Contact, Contacts, ContactsPer, Mode, Placement, Pose, Scene, coarse_contacts,
};
use tesdf::glam::{DQuat, DVec3};

fn detect(scene: &Scene, options: &CollideOptions) -> Contacts {
    tesdf::collide::detect(scene, options).expect("a good scene")
}

/// Twice the default tolerance of the exact mode, and rounding.
const PROCESSOR: Detection =
    Detection { detect: &detect, distance: 2.01e-7, point: 1e-9, level: 1e-9, cosine: 1e-9 };

#[test]
fn each_face_keeps_its_least_distance() {
    let mut random = Random(11);
    let names = [
        ["cube", "cube"],
        ["l_bracket", "cube"],
        ["torus_quads", "tetra"],
        ["beam", "l_bracket"],
        ["lobed_peg", "lobed_hole_c100"],
    ];
    let mut faces = 0;
    for names in names {
        for relation in RELATIONS {
            if relation == Relation::Same && names[0] != names[1] {
                continue;
            }
            let bodies = relation.place(names, &mut random);
            faces += PROCESSOR.keeps_least_distances(&bodies, 1e-3 * bodies[0].diagonal()).faces;
        }
    }
    assert!(faces > 3000, "{faces} faces");
}

#[test]
fn each_face_of_bolt_and_nut_keeps_its_least_distance() {
    let identity = Placement { pose: Pose::IDENTITY, scale: 1.0 };
    let bodies = ["iso_m16_bolt_6k", "iso_m16_nut_c100"].map(|name| Placed::new(name, identity));
    let kept = PROCESSOR.keeps_least_distances(&bodies, 2e-4);
    assert!(kept.faces > 3000, "{kept:?}");
}

#[test]
fn minima_are_followed_by_no_lower_point() {
    let mut random = Random(23);
    let names = [["l_bracket", "cube"], ["torus_quads", "tetra"], ["lobed_peg", "lobed_hole_c100"]];
    let mut all = [0, 0];
    for names in names {
        for relation in of_the_day(RELATIONS.into_iter().filter(|&relation| relation != Relation::Same)) {
            let bodies = relation.place(names, &mut random);
            let contact_distance = 1e-3 * bodies[0].diagonal();
            for mode in [Mode::exact(), Mode::face()] {
                let counts = PROCESSOR.minima_are_followed_by_no_lower_point(&bodies, contact_distance, mode);
                all = [all[0] + counts[0], all[1] + counts[1]];
            }
        }
    }
    assert!(all[0] > least(1000, 100) && all[1] > least(1000, 100), "{all:?}");
}

#[test]
fn a_border_ahead_of_a_peg_is_no_minimum() {
    PROCESSOR.border_ahead_of_a_peg_is_no_minimum();
}

#[test]
fn the_sides_of_a_bend_are_walls() {
    PROCESSOR.sides_of_a_bend_are_walls();
}

#[test]
fn a_box_stands_on_the_corners_of_the_patch() {
    for per in [ContactsPer::Face, ContactsPer::Minimum] {
        assert_eq!(PROCESSOR.box_stands_on_the_corners_of_the_patch(per), 0, "all searches converge");
    }
}

#[test]
fn a_box_stands_on_a_plane_and_on_four_pegs() {
    for per in [ContactsPer::Face, ContactsPer::Minimum] {
        PROCESSOR.box_stands_on_a_plane_and_on_four_pegs(per);
    }
}

#[test]
fn a_vertex_of_several_faces_has_one_contact() {
    PROCESSOR.vertex_of_several_faces_has_one_contact(&[Mode::face(), Mode::exact()]);
}

/// Two cubes whose edges are flush up to rounding, or up to less than the tolerance: at each corner
/// there is a contact with a vertical normal and the distance between the planes. A distance to the
/// side of a cube, or to its edge, would let it sink in there.
#[test]
fn the_corners_of_flush_faces_have_the_distance_of_the_planes() {
    let half = DVec3::splat(0.05);
    let lower = block(-half, half, 1);
    let options = CollideOptions { contact_distance: 2e-4, ..CollideOptions::default() };
    let mut random = Random(5);
    let mut signed = |size: f64| size * (2.0 * random.unit() - 1.0);
    for shift in [0.0, 1e-16, 1e-14, 1e-12, 1e-10, 1e-9] {
        for tilt in [0.0, 1e-14, 1e-12, 1e-10] {
            for gap in [0.0, -1e-11, 1e-11] {
                let translation = DVec3::new(signed(shift), signed(shift), 0.1 + gap + signed(0.1 * tilt));
                let rotation =
                    DQuat::from_scaled_axis(DVec3::new(signed(tilt), signed(tilt), signed(10.0 * shift)));
                let mut upper = lower.clone();
                upper.at.pose = Pose { translation, rotation };
                let found = detect(&scene(&[lower.clone(), upper]), &options);
                let (down, bottom) =
                    (rotation * DVec3::NEG_Z, translation + rotation * DVec3::new(0.0, 0.0, -0.05));
                for corner in [(-0.05, -0.05), (-0.05, 0.05), (0.05, -0.05), (0.05, 0.05)] {
                    let corner = DVec3::new(corner.0, corner.1, 0.05);
                    let height = (bottom - corner).dot(down) / down.z;
                    let error = |c: &Contact| {
                        let near = c.point_a.distance(corner) < 1e-7 && c.normal.z.abs() > 1.0 - 1e-9;
                        if near { (c.distance - height).abs() } else { f64::INFINITY }
                    };
                    let error = found.iter().map(error).fold(f64::INFINITY, f64::min);
                    assert!(
                        error < 1e-12,
                        "shift {shift:e}, tilt {tilt:e}, gap {gap:e}: {error:e} at {corner}"
                    );
                }
            }
        }
    }
}

/// Nodes do not see a box that is turned on another one: every vertex is beside the other box.
#[test]
fn faces_that_nodes_miss_are_named() {
    let half = DVec3::splat(0.05);
    let node = CollideOptions { contact_distance: 1e-4, ..CollideOptions::with_mode(Mode::Node) };
    let on = |n: u32, height: f64| {
        let rotation = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_6);
        let mut upper = block(-half, half, n);
        upper.at.pose = Pose { translation: DVec3::new(0.0, 0.0, height), rotation };
        let scene = scene(&[block(-half, half, n), upper]);
        (detect(&scene, &node).len(), coarse_contacts(&scene, &node).expect("good"))
    };
    let (contacts, coarse) = on(1, 0.1);
    assert_eq!((contacts, coarse.len()), (0, 2), "{coarse:?}");
    for contact in &coarse {
        // The top and the bottom are two right triangles each, with legs of 0.1.
        assert!((contact.corner_reach - 0.05 * 2f64.sqrt()).abs() < 1e-9, "{contact:?}");
        assert!(contact.distance.abs() < 1e-9);
    }
    // Apart, or finely meshed: nothing is missed.
    assert!(on(1, 0.101).1.is_empty());
    let (contacts, coarse) = on(24, 0.1);
    assert!(contacts > 0 && coarse.is_empty(), "{coarse:?}");
}

/// Where a large face touches, all corners of what lies on it are found, however far from where it is
/// nearest or deepest.
#[test]
fn a_large_face_has_the_corners_of_what_leans_on_it_or_sank_into_it() {
    const SIDE: f64 = 0.1;
    for (sunk, tilt) in [(0.0, 0.0), (0.0, 4e-4), (0.0, -4e-4), (1e-3, 0.0), (0.02, 0.0)] {
        let plate = block(DVec3::new(-0.5, -0.5, -0.1), DVec3::new(0.5, 0.5, 0.0), 1);
        let mut box_of_16 = block(DVec3::splat(-SIDE), DVec3::splat(SIDE), 16);
        let rotation = DQuat::from_rotation_y(tilt);
        box_of_16.at.pose =
            Pose { translation: DVec3::new(0.013, 0.027, SIDE * (1.0 + tilt.abs()) - sunk), rotation };
        let pose = box_of_16.at.pose;
        let scene = scene(&[plate, box_of_16]);
        let options = CollideOptions { contact_distance: 1e-4, ..CollideOptions::with_mode(Mode::exact()) };
        let contacts = detect(&scene, &options);
        for corner in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let corner = pose.to_world(SIDE * DVec3::new(corner[0], corner[1], -1.0));
            let of_plate = of_direction(contacts.as_slice(), 0, 1);
            let nearest = of_plate.map(|c| c.point_a.distance(corner)).fold(f64::INFINITY, f64::min);
            // Beside the corner of a box that sank, its other sides are nearer.
            assert!(nearest < 1e-4 + 2.0 * sunk, "{sunk} m, {tilt} rad: {nearest} m from {corner}");
        }
    }
}
