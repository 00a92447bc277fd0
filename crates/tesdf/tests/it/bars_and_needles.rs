//! Bodies with long edges, which touch between their vertices: compared with samples of all sides, and
//! with formulas.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4};

use crate::support::bodies::{Placed, of_direction, scene};
use crate::support::per_face::block;
use crate::support::random::Random;
use tesdf::collide::{
    CollideOptions, Contact, Contacts, FeatureB, Instance, Mode, Placement, PolygonVerdict, Pose, Scene,
    Shape, detect, why,
};
use tesdf::glam::{DQuat, DVec3};

/// Of the diagonal, as the default.
const TOLERANCE: f64 = 1e-7;

fn options(contact_distance: f64) -> CollideOptions {
    CollideOptions { contact_distance, ..CollideOptions::default() }
}

fn found(scene: &Scene, contact_distance: f64) -> Contacts {
    detect(scene, &options(contact_distance)).expect("a good scene")
}

fn least<'a>(contacts: impl IntoIterator<Item = &'a Contact>) -> f64 {
    contacts.into_iter().map(|c| c.distance).fold(f64::INFINITY, f64::min)
}

/// The corners of each face of a body by its id, in the world.
fn faces(body: &Placed) -> BTreeMap<u32, [DVec3; 3]> {
    let asset = &body.body.asset;
    let corners = |face: usize| asset.face_corners(face).map(|p| body.at.to_world(p));
    (0..asset.face_count()).map(|face| (asset.face_id(face), corners(face))).collect()
}

/// Two bars with square sections of width 0.2 that cross at 1.2 rad, each standing on an edge
/// of 2. The lower edge of the upper one is `gap` above the upper edge of the lower one.
fn crossing_bars(gap: f64) -> [Placed; 2] {
    let half = DVec3::new(1.0, 0.1, 0.1);
    let half_diagonal = 0.1 * 2f64.sqrt();
    let mut lower = block(-half, half, 1);
    lower.at.pose.rotation = DQuat::from_rotation_x(FRAC_PI_4);
    let mut upper = lower.clone();
    upper.at.pose = Pose {
        // Not in the middle of the edges.
        translation: DVec3::new(0.31, 0.17, 2.0 * half_diagonal + gap),
        rotation: DQuat::from_rotation_z(1.2) * lower.at.pose.rotation,
    };
    [lower, upper]
}

#[test]
fn bars_that_cross_touch_where_their_edges_do() {
    for gap in [1e-2, 1e-5, -1e-5, -1e-2] {
        let bars = crossing_bars(gap);
        let scene = scene(&bars);
        let nodes = CollideOptions { contact_distance: 0.02, ..CollideOptions::with_mode(Mode::Node) };
        assert!(detect(&scene, &nodes).expect("a good scene").is_empty());
        let all = found(&scene, 0.02);
        // The edges cross on the line through (0, 0, 1) and the point where their directions meet.
        let along = DVec3::new(1.2f64.cos(), 1.2f64.sin(), 0.0);
        let top = DVec3::new(0.31 - 0.17 * along.x / along.y, 0.0, 0.1 * 2f64.sqrt());
        // Inside, the nearest point is on a side, at 45° to the vertical.
        let distance = if gap > 0.0 { gap } else { gap / 2f64.sqrt() };
        // Near the surface, the normal is that of both edges.
        let vertical = if gap > -1e-3 { 1.0 } else { FRAC_1_SQRT_2 };
        for [a, b] in [[0, 1], [1, 0]] {
            let own: Vec<&Contact> = of_direction(all.as_slice(), a, b).collect();
            let deepest = least(own.iter().copied());
            assert!((deepest - distance).abs() < 1e-6, "{gap}: {deepest}");
            for contact in own.iter().filter(|c| c.distance < deepest + 1e-7) {
                let place = if a == 0 { top } else { top + gap * DVec3::Z };
                assert!(contact.point_a.distance(place) < 1e-5, "{gap}: {contact:?}");
                assert!((contact.normal.z.abs() - vertical).abs() < 1e-6, "{gap}: {contact:?}");
                assert!(contact.converged, "{gap}: {contact:?}");
                if gap > 0.0 {
                    assert!(matches!(contact.feature.b, FeatureB::Edge(..)), "{contact:?}");
                }
            }
        }
    }
}

/// Compares the contacts of each face with samples of its sides: none is lower than the lowest contact,
/// or a corner, whose contact other faces may have. Returns the number of samples.
fn compare_with_samples(bodies: &[Placed; 2], reach: f64, samples: u32) -> usize {
    let size = bodies[0].diagonal().max(bodies[1].diagonal());
    let all = found(&scene(bodies), reach);
    let mut count = 0;
    for [a, b] in [[0, 1], [1, 0]] {
        let mut lowest: BTreeMap<u32, f64> = BTreeMap::new();
        for contact in of_direction(all.as_slice(), a as u32, b as u32) {
            assert!(contact.converged, "{contact:?}");
            let known = lowest.entry(contact.face_a).or_insert(f64::INFINITY);
            *known = known.min(contact.distance);
        }
        let corners = faces(&bodies[a]);
        for (face, distance) in lowest {
            let corners = corners[&face];
            let own = corners.map(|p| bodies[b].distance_by_tree(p)).into_iter().fold(distance, f64::min);
            for (k, t) in (0..3).flat_map(|k| (1..samples).map(move |t| (k, t))) {
                let p = corners[k].lerp(corners[(k + 1) % 3], f64::from(t) / f64::from(samples));
                let sample = bodies[b].distance_by_tree(p);
                assert!(own <= sample + 2.0 * TOLERANCE * size, "{own} {sample}");
                count += 1;
            }
        }
    }
    count
}

/// Needles through, in, along and beside a body, with edges from 1e-12 to 100 of its size.
#[test]
fn needles_have_their_least_distances() {
    let mut random = Random(43);
    let mut count = 0;
    for name in ["cube", "l_bracket", "torus_quads", "shaft_keyway", "bowl_overhang"] {
        for length in [1e-12, 1e-3, 0.3, 2.0, 100.0] {
            for _ in 0..4 {
                let body = Placed::new(name, Placement { pose: Pose::IDENTITY, scale: 1.0 });
                let size = body.diagonal();
                let half = 0.5 * size * DVec3::new(length, 1e-3 * length.min(1e-3), 1e-3 * length.min(1e-3));
                let mut needle = block(-half, half, 1);
                let translation = body.body.center() + 0.3 * size * random.in_cube();
                needle.at.pose =
                    Pose { translation, rotation: crate::support::bodies::rotation(&mut random) };
                count += compare_with_samples(&[needle, body], 0.1 * size, 256);
            }
        }
    }
    assert!(count > 20_000, "{count}");
}

/// Needles parallel to the axes of a box have a constant depth over a part, or the same depth below
/// two sides; others lie in a side, or just above or below it.
#[test]
fn level_needles_have_their_least_distances() {
    let half = DVec3::new(0.5, 0.3, 0.2);
    let thin = DVec3::new(0.35, 1e-7, 1e-7);
    let mut count = 0;
    for divisions in [1, 4] {
        let body = block(-half, half, divisions);
        for turn in [0.0, 1e-9, 1e-4, 0.3] {
            for y in [0.0, 0.1, 0.3] {
                for z in [0.0, 0.1, 0.2 - 1e-6, 0.2, 0.2 + 1e-7, 0.2 + 1e-3] {
                    for x in [0.0, 0.3, 0.85] {
                        let mut needle = block(-thin, thin, 1);
                        let rotation = DQuat::from_rotation_y(turn);
                        needle.at.pose = Pose { translation: DVec3::new(x, y, z), rotation };
                        count += compare_with_samples(&[needle, body.clone()], 0.01, 64);
                    }
                }
            }
        }
    }
    assert!(count > 10_000, "{count}");
}

/// Boxes as meshes and as simple shapes have the same contacts.
#[test]
fn simple_boxes_have_the_contacts_of_their_meshes() {
    let half = DVec3::new(0.05, 0.08, 0.03);
    let mesh = Shape::Mesh(block(-half, half, 1).body.asset.clone());
    let simple = Shape::Box { half_extents: half };
    let mut random = Random(41);
    for _ in 0..40 {
        let poses = [0.0, 0.06].map(|away| Pose {
            translation: away * random.direction(),
            rotation: crate::support::bodies::rotation(&mut random),
        });
        let of = |shapes: [&Shape; 2]| {
            let mut scene = Scene::new();
            for (shape, pose) in shapes.into_iter().zip(poses) {
                let id = scene.add_shape(shape.clone()).expect("a shape");
                scene.add(Instance::new(id, pose)).expect("a pose");
            }
            let all = found(&scene, 0.02);
            // The least of each order, and the number of contacts outside: inside a box, mesh and
            // formula may choose different faces that are equally near.
            [[0, 1], [1, 0]].map(|[a, b]| {
                let own: Vec<&Contact> = of_direction(all.as_slice(), a, b).collect();
                (least(own.iter().copied()), own.iter().filter(|c| c.distance > 1e-6).count())
            })
        };
        let expected = of([&mesh, &mesh]);
        for shapes in [[&simple, &simple], [&simple, &mesh], [&mesh, &simple]] {
            for (own, other) in of(shapes).into_iter().zip(expected) {
                let is_near = own.0 == other.0 || (own.0 - other.0).abs() < 1e-7;
                assert!(is_near, "{own:?} {other:?}");
            }
        }
    }
}

#[test]
fn a_capsule_across_an_edge_touches_between_its_ends() {
    let half = DVec3::new(1.0, 0.1, 0.1);
    let mut bar = block(-half, half, 1);
    bar.at.pose.rotation = DQuat::from_rotation_x(FRAC_PI_4);
    let mut scene = scene(&[bar]);
    let capsule = scene.add_shape(Shape::Capsule { half_height: 1.0, radius: 0.05 }).expect("a capsule");
    let height = 0.1 * 2f64.sqrt() + 0.05 + 1e-3;
    let pose =
        Pose { translation: DVec3::new(0.3, 0.2, height), rotation: DQuat::from_rotation_x(2.0 * FRAC_PI_4) };
    scene.add(Instance::new(capsule, pose)).expect("a pose");
    let all = found(&scene, 0.01);
    for (a, b) in [(0, 1), (1, 0)] {
        let own: Vec<&Contact> = of_direction(all.as_slice(), a, b).collect();
        let contact = own.iter().min_by(|c, d| c.distance.total_cmp(&d.distance)).expect("a contact");
        assert!((contact.distance - 1e-3).abs() < 1e-7, "{contact:?}");
        assert!(
            contact.point_a.truncate().distance(DVec3::new(0.3, 0.0, 0.0).truncate()) < 1e-4,
            "{contact:?}"
        );
    }
}

#[test]
fn why_names_the_faces_that_touch() {
    let bars = crossing_bars(1e-3);
    let scene = scene(&bars);
    let options = options(0.01);
    let ids: Vec<_> = scene.instances().map(|(id, _)| id).collect();
    let all = why(&scene, &options, ids[0], ids[1], None).expect("a pair");
    assert_eq!(all.total, 12);
    let of_detection = detect(&scene, &options).expect("a good scene");
    let contacts: usize = all.parts.iter().map(|part| part.contacts()).sum();
    assert_eq!(contacts, of_direction(of_detection.as_slice(), 0, 1).count());
    let first = of_direction(of_detection.as_slice(), 0, 1).next().expect("a contact");
    let one = why(&scene, &options, ids[0], ids[1], Some(first.feature.a)).expect("an edge");
    assert_eq!((one.parts.len(), one.parts[0].id), (1, first.feature.a));
    assert_eq!(one.parts[0].polygons[0].verdict, PolygonVerdict::Contact);
    assert!(why(&scene, &options, ids[0], ids[1], Some(999)).is_err());
}
