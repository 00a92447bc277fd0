//! Contacts per face against contacts per cell, and flat contact between bodies that rest on each
//! other.
mod support;

use std::collections::BTreeMap;
use std::sync::Arc;

use support::bodies::{Body, Placed, RELATIONS, Relation, of_direction, scene};
use support::random::Random;
use support::shapes;
use tesdf::collide::{
    CollideOptions, Contact, Contacts, ContactsPer, Instance, Mode, Placement, Pose, Scene, Shape, detect,
};
use tesdf::glam::{DQuat, DVec3};

/// Twice the default tolerance of the exact mode, and rounding.
const TOLERANCE: f64 = 2.01e-7;

fn found(scene: &Scene, per: ContactsPer, contact_distance: f64) -> Contacts {
    let options = CollideOptions { contacts_per: per, contact_distance, ..CollideOptions::default() };
    detect(scene, &options).expect("a good scene")
}

/// Checks that each face with a contact per cell has its least distance among the contacts per
/// face: its own, or that of one of its vertices. Returns the number of faces.
fn faces_keep_their_minimum(bodies: &[Placed; 2], contact_distance: f64) -> usize {
    let scene = scene(bodies);
    let by_cell = found(&scene, ContactsPer::Cell, contact_distance);
    let by_face = found(&scene, ContactsPer::Face, contact_distance);
    assert_eq!(by_cell.hidden, by_face.hidden);
    let mut faces = 0;
    for [a, b] in [[0, 1], [1, 0]] {
        let diagonal = bodies[b].diagonal();
        let tolerance = TOLERANCE * diagonal;
        let least = |contacts: &Contacts| {
            let mut least: BTreeMap<u32, (f64, bool)> = BTreeMap::new();
            for c in of_direction(contacts.as_slice(), a as u32, b as u32) {
                let known = least.entry(c.face_a).or_insert((f64::INFINITY, true));
                if c.distance < known.0 {
                    *known = (c.distance, c.converged);
                }
            }
            least
        };
        let (cells, own) = (least(&by_cell), least(&by_face));
        for (&face, &(distance, converged)) in &cells {
            let corners = bodies[a].body.face(face, bodies[a].at);
            let at_corner = of_direction(by_face.as_slice(), a as u32, b as u32)
                .filter(|c| corners.iter().any(|p| p.distance(c.point_a) <= 1e-9 * diagonal))
                .map(|c| c.distance);
            let own = own.get(&face).copied();
            let least = at_corner.chain(own.map(|o| o.0)).fold(f64::INFINITY, f64::min);
            assert!(
                (least - distance).abs() <= tolerance || !converged || own.is_some_and(|o| !o.1),
                "face {face} of {a}: {distance} per cell, {least} per face"
            );
            faces += 1;
        }
        for (face, (distance, _)) in own {
            let known = cells.get(&face).map(|c| c.0);
            // A minimum at the contact distance itself may be found by one of the two alone.
            let is_border = distance > contact_distance - tolerance;
            assert!(
                is_border || known.is_some_and(|d| distance >= d - tolerance),
                "face {face} of {a}: {distance} per face, {known:?} per cell"
            );
        }
    }
    faces
}

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
            faces += faces_keep_their_minimum(&bodies, 1e-3 * bodies[0].diagonal());
        }
    }
    assert!(faces > 3000, "{faces} faces");
}

#[test]
fn each_face_of_bolt_and_nut_keeps_its_least_distance() {
    let identity = Placement { pose: Pose::IDENTITY, scale: 1.0 };
    let bodies = ["iso_m16_bolt_6k", "iso_m16_nut_c100"].map(|name| Placed::new(name, identity));
    let faces = faces_keep_their_minimum(&bodies, 2e-4);
    assert!(faces > 3000, "{faces} faces");
}

fn block(min: DVec3, max: DVec3, n: u32) -> Placed {
    let body = Arc::new(Body::new(shapes::Shape::default().add_box(min, max, n).solid()));
    Placed { body, at: Placement { pose: Pose::IDENTITY, scale: 1.0 } }
}

/// The contacts hold the upper body up: the normals of the nearest contacts are vertical, and each
/// corner of the patch has a contact nearby. Beside the patch, faces are farther away, with other
/// normals.
fn stands(contacts: &[Contact], corners: &[DVec3], near: f64, what: &str) {
    let least = contacts.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
    let nearest: Vec<&Contact> = contacts.iter().filter(|c| c.distance < least + 1e-9).collect();
    for c in &nearest {
        assert!(c.normal.z.abs() > 1.0 - 1e-9, "{what}: {c:?}");
    }
    for corner in corners {
        let away = nearest.iter().map(|c| c.point_a.distance(*corner)).fold(f64::INFINITY, f64::min);
        assert!(away <= near, "{what}: no contact within {near} of {corner}, but at {away}");
    }
}

/// Boxes of side 0.1 on a lower one with n × n squares a side.
#[test]
fn a_box_stands_on_the_corners_of_the_patch() {
    let half = DVec3::splat(0.05);
    let options = CollideOptions {
        contacts_per: ContactsPer::Face,
        contact_distance: 2e-4,
        cos_theta: Some(0.5),
        ..CollideOptions::default()
    };
    for [n_lower, n_upper] in [[1, 1], [1, 8], [8, 1], [8, 8], [3, 5]] {
        let lower = block(-half, half, n_lower);
        let upper = block(-half, half, n_upper);
        for (turn, shift) in [
            (0.0, DVec3::ZERO),
            (0.0, DVec3::new(0.03, 0.02, 0.0)),
            (std::f64::consts::FRAC_PI_6, DVec3::ZERO),
            (std::f64::consts::FRAC_PI_6, DVec3::new(0.04, 0.0, 0.0)),
        ] {
            for gap in [-1e-6, 0.0, 5e-5] {
                let rotation = DQuat::from_rotation_z(turn);
                let translation = shift + DVec3::new(0.0, 0.0, 0.1 + gap);
                let mut placed = upper.clone();
                placed.at.pose = Pose { translation, rotation };
                let found = detect(&scene(&[lower.clone(), placed.clone()]), &options).expect("good");
                let corners = overlap(&rotation, shift);
                // A small face reports the flat part of itself within the tolerance, a large one
                // everything within the contact distance.
                let what = format!(
                    "{n_lower} and {n_upper} squares, turned by {turn}, shifted by {shift}, gap {gap}"
                );
                stands(found.as_slice(), &corners, 1.5e-5, &what);
                assert_eq!(found.statistics.unconverged, 0);
            }
        }
    }
}

/// Corners of the square of side 0.1 around the origin, intersected with itself, turned and
/// shifted, at the height 0.05.
fn overlap(rotation: &DQuat, shift: DVec3) -> Vec<DVec3> {
    let square = [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]];
    let mut polygon: Vec<DVec3> = square.map(|[x, y]| *rotation * DVec3::new(x, y, 0.0) + shift).to_vec();
    for axis in [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y] {
        let inside = |p: DVec3| 0.05 - p.dot(axis);
        let mut cut = Vec::new();
        for i in 0..polygon.len() {
            let (p, q) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (at_p, at_q) = (inside(p), inside(q));
            if at_p >= -1e-12 {
                cut.push(p);
            }
            if at_p * at_q < -1e-24 {
                cut.push(p + at_p / (at_p - at_q) * (q - p));
            }
        }
        polygon = cut;
    }
    polygon.into_iter().map(|p| p.with_z(0.05)).collect()
}

#[test]
fn a_box_stands_on_a_plane_and_on_four_pegs() {
    let options = CollideOptions {
        contacts_per: ContactsPer::Face,
        contact_distance: 2e-4,
        cos_theta: Some(0.5),
        ..CollideOptions::default()
    };
    let plate = block(DVec3::new(-0.05, -0.05, 0.0), DVec3::new(0.05, 0.05, 0.01), 1);
    let corners =
        [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]].map(|[x, y]| DVec3::new(x, y, 0.0));
    let mut on_plane = Scene::new();
    for shape in [Shape::Plane, Shape::Mesh(plate.body.asset.clone())] {
        let id = on_plane.add_shape(shape).expect("a shape");
        on_plane.add(Instance::new(id, Pose::IDENTITY)).expect("an instance");
    }
    stands(detect(&on_plane, &options).expect("good").as_slice(), &corners, 1e-12, "on a plane");

    let mut pegs = shapes::Shape::default();
    let mut tips = Vec::new();
    for [x, y] in [[-0.04, -0.04], [0.04, -0.04], [0.04, 0.04], [-0.04, 0.04]] {
        let half = DVec3::new(0.005, 0.005, 0.0);
        let center = DVec3::new(x, y, 0.0);
        pegs = pegs.add_box(center - half - 0.02 * DVec3::Z, center + half, 1);
        tips.extend([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[u, v]| {
            let outward = DVec3::new(u, v, 0.0);
            // Only the outer corners carry.
            (center + 0.005 * outward, outward.dot(center) > 0.07)
        }));
    }
    let pegs = Placed { body: Arc::new(Body::new(pegs.solid())), at: plate.at };
    let found = detect(&scene(&[pegs, plate]), &options).expect("good");
    let outer: Vec<DVec3> = tips.iter().filter(|t| t.1).map(|t| t.0).collect();
    assert_eq!(outer.len(), 4);
    stands(found.as_slice(), &outer, 1e-9, "on pegs");
}

#[test]
fn a_vertex_of_several_faces_has_one_contact() {
    // A corner of the cube points down onto a plane.
    let cube = block(DVec3::splat(-0.5), DVec3::splat(0.5), 1);
    let down = DQuat::from_rotation_arc(DVec3::ONE.normalize(), DVec3::NEG_Z);
    let mut scene = Scene::new();
    let (floor, mesh) = (Shape::Plane, Shape::Mesh(cube.body.asset.clone()));
    for (shape, pose) in [
        (floor, Pose::IDENTITY),
        (mesh, Pose { translation: DVec3::new(0.0, 0.0, 0.75f64.sqrt() - 1e-3), rotation: down }),
    ] {
        let id = scene.add_shape(shape).expect("a shape");
        scene.add(Instance::new(id, pose)).expect("an instance");
    }
    let of = |per, mode| {
        let options = CollideOptions { contacts_per: per, ..CollideOptions::with_mode(mode) };
        let found = detect(&scene, &options).expect("good");
        of_direction(found.as_slice(), 1, 0).map(|c| (c.face_a, c.distance)).collect::<Vec<_>>()
    };
    for mode in [Mode::Face, Mode::Exact] {
        let all = of(ContactsPer::Cell, mode);
        assert!(all.len() >= 3, "{all:?}");
        let one = of(ContactsPer::Face, mode);
        assert_eq!(one.len(), 1, "{one:?}");
        let lowest = all.iter().map(|c| c.0).min().expect("a face");
        assert!(one[0].0 == lowest && (one[0].1 + 1e-3).abs() < 1e-9, "{one:?}");
    }
}

/// Two cubes whose edges are flush up to rounding, or up to less than the tolerance: at each corner
/// there is a contact with a vertical normal and the distance between the planes. A distance to the
/// side of a cube, or to its edge, would let it sink in there.
#[test]
fn the_corners_of_flush_faces_have_the_distance_of_the_planes() {
    let half = DVec3::splat(0.05);
    let lower = block(-half, half, 1);
    let options = CollideOptions {
        contacts_per: ContactsPer::Face,
        contact_distance: 2e-4,
        ..CollideOptions::default()
    };
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
                let found = detect(&scene(&[lower.clone(), upper]), &options).expect("good");
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
