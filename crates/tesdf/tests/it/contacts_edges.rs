//! The mode edge: compared with samples of all edges, with the mode exact, and with formulas.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, FRAC_PI_6};

use crate::support::bodies::{Placed, RELATIONS, Relation, of_direction, scene};
use crate::support::per_face::{Detection, block};
use crate::support::random::Random;
use crate::support::rotation::{least as at_least, of_the_day};
use tesdf::collide::{
    CollideOptions, Contact, Contacts, ContactsPer, FeatureB, Instance, Mode, Placement, PolygonVerdict,
    Pose, Scene, Shape, coarse_contacts, detect, why,
};
use tesdf::glam::{DQuat, DVec3};

/// Of the diagonal, as the default.
const TOLERANCE: f64 = 1e-7;

/// Bodies with few faces.
const SMALL: [&str; 4] = ["cube", "tetra", "l_bracket", "beam"];

fn options(contact_distance: f64) -> CollideOptions {
    CollideOptions { contact_distance, ..CollideOptions::with_mode(Mode::Edge) }
}

fn found(scene: &Scene, contact_distance: f64) -> Contacts {
    detect(scene, &options(contact_distance)).expect("a good scene")
}

fn least<'a>(contacts: impl IntoIterator<Item = &'a Contact>) -> f64 {
    contacts.into_iter().map(|c| c.distance).fold(f64::INFINITY, f64::min)
}

/// The ends of the edge of a contact, in the world; `None` for a node.
fn edge(body: &Placed, contact: &Contact) -> Option<[DVec3; 2]> {
    let vertices = body.body.solid.mesh().vertices().len() as u32;
    let edge = contact.feature.a.checked_sub(vertices)?;
    assert_eq!(edge / 3, contact.face_a);
    let position = (0..body.body.asset.face_count())
        .find(|&f| body.body.asset.face_id(f) == edge / 3)
        .expect("a face of the body");
    let corners = body.body.asset.face_corners(position);
    Some([edge % 3, edge % 3 + 1].map(|k| body.at.to_world(corners[k as usize % 3])))
}

/// Two bars with square sections of width 0.2 that cross at a right angle, each standing on an edge
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
fn bars_that_cross_touch_with_their_edges() {
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
        let (distance, vertical) = if gap > 0.0 { (gap, 1.0) } else { (gap / 2f64.sqrt(), 0.5f64.sqrt()) };
        for [a, b] in [[0, 1], [1, 0]] {
            let own: Vec<&Contact> = of_direction(all.as_slice(), a, b).collect();
            let deepest = least(own.iter().copied());
            assert!((deepest - distance).abs() < 1e-6, "{gap}: {deepest}");
            for contact in own.iter().filter(|c| c.distance < deepest + 1e-7) {
                let place = if a == 0 { top } else { top + gap * DVec3::Z };
                assert!(contact.point_a.distance(place) < 1e-5, "{gap}: {contact:?}");
                assert!((contact.normal.z.abs() - vertical).abs() < 1e-6, "{gap}: {contact:?}");
                assert!(contact.converged && edge(&bars[a as usize], contact).is_some());
                if gap > 0.0 {
                    assert!(matches!(contact.feature.b, FeatureB::Edge(..)), "{contact:?}");
                }
            }
        }
    }
}

/// Signed distances at points of each edge, by the face tree. All edges of the mesh, flat ones and
/// those in valleys, too.
fn lowest_sample(a: &Placed, b: &Placed) -> f64 {
    let mesh = a.body.solid.mesh();
    let mut edges: Vec<[u32; 2]> = Vec::new();
    for face in mesh.faces() {
        edges.extend((0..3).map(|k| [face[k], face[(k + 1) % 3]]).filter(|[p, q]| p < q));
    }
    let mut lowest = f64::INFINITY;
    for ends in edges {
        let [p, q] = ends.map(|v| a.at.to_world(mesh.vertices()[v as usize]));
        for k in 0..=16 {
            lowest = lowest.min(b.distance_by_tree(p.lerp(q, f64::from(k) / 16.0)));
        }
    }
    lowest
}

#[test]
fn bodies_that_are_apart_have_their_least_distance_at_nodes_and_edges() {
    let mut random = Random(31);
    let names = [
        ["cube", "cube"],
        ["tetra", "tetra"],
        ["cube", "tetra"],
        ["l_bracket", "cube"],
        ["l_bracket", "l_bracket"],
        ["beam", "l_bracket"],
        ["torus_quads", "tetra"],
        ["lobed_peg", "lobed_hole_c100"],
        ["bowl_overhang", "l_bracket"],
    ];
    let (mut apart, mut between, mut nodes) = (0, 0, 0);
    for names in of_the_day(names) {
        for relation in RELATIONS {
            if relation == Relation::Same && names[0] != names[1] {
                continue;
            }
            let is_small = names.iter().all(|name| SMALL.contains(name));
            let count = if is_small { 6 } else { 1 };
            for _ in 0..count {
                let bodies = relation.place(names, &mut random);
                let size = bodies[0].diagonal().max(bodies[1].diagonal());
                let scene = scene(&bodies);
                let reach = if count > 1 && relation != Relation::Far { size } else { 0.02 * size };
                let own = found(&scene, reach);
                let exact = CollideOptions { contact_distance: reach, ..CollideOptions::default() };
                let exact = least(&detect(&scene, &exact).expect("a good scene"));
                if exact > 0.0 {
                    let difference = least(&own) - exact;
                    let is_same = exact == f64::INFINITY && own.is_empty();
                    assert!(
                        is_same || difference.abs() <= 2.0 * TOLERANCE * size,
                        "{names:?}, {relation:?}: {difference}"
                    );
                    apart += usize::from(!is_same);
                }
                for [a, b] in [[0, 1], [1, 0]] {
                    let mut of_edges: BTreeMap<u32, usize> = BTreeMap::new();
                    for contact in of_direction(own.as_slice(), a as u32, b as u32) {
                        let at_point = bodies[b].distance_by_tree(contact.point_a);
                        assert!((at_point - contact.distance).abs() <= 1e-9 * size, "{at_point} {contact:?}");
                        let Some([p, q]) = edge(&bodies[a], contact) else {
                            nodes += 1;
                            continue;
                        };
                        let t = (contact.point_a - p).dot(q - p) / p.distance_squared(q);
                        assert!(
                            (0.0..=1.0).contains(&t) && p.lerp(q, t).distance(contact.point_a) < 1e-9 * size
                        );
                        *of_edges.entry(contact.feature.a).or_default() += 1;
                        between += 1;
                    }
                    assert!(of_edges.values().all(|&count| count <= 3), "the least one and two ends");
                }
                // Every edge of both bodies, where bodies are apart.
                let sampled =
                    lowest_sample(&bodies[0], &bodies[1]).min(lowest_sample(&bodies[1], &bodies[0]));
                if exact > 0.0 && sampled <= reach {
                    assert!(least(&own) <= sampled + TOLERANCE * size, "{names:?}, {relation:?}: {sampled}");
                }
            }
        }
    }
    assert!(
        apart > at_least(60, 10) && between > at_least(1000, 300) && nodes > at_least(1000, 300),
        "{apart} {between} {nodes}"
    );
}

/// Compares the contacts of each edge with samples of the edge: none is lower than the lowest
/// contact, or an end, which has a contact as a node. Returns the number of samples.
fn compare_with_samples(bodies: &[Placed; 2], reach: f64, samples: u32) -> usize {
    let size = bodies[0].diagonal().max(bodies[1].diagonal());
    let all = found(&scene(bodies), reach);
    let mut count = 0;
    for [a, b] in [[0, 1], [1, 0]] {
        let mut lowest: BTreeMap<u32, (f64, [DVec3; 2])> = BTreeMap::new();
        for contact in of_direction(all.as_slice(), a as u32, b as u32) {
            if let Some(ends) = edge(&bodies[a], contact) {
                let known = lowest.entry(contact.feature.a).or_insert((f64::INFINITY, ends));
                known.0 = known.0.min(contact.distance);
                assert!(contact.converged, "{contact:?}");
            }
        }
        for (distance, [p, q]) in lowest.into_values() {
            let own = [p, q].map(|end| bodies[b].distance_by_tree(end));
            let own = distance.min(own[0]).min(own[1]);
            for k in 1..samples {
                let sample = bodies[b].distance_by_tree(p.lerp(q, f64::from(k) / f64::from(samples)));
                assert!(own <= sample + 2.0 * TOLERANCE * size, "{own} {sample}");
                count += 1;
            }
        }
    }
    count
}

#[test]
fn each_sharp_edge_has_its_least_distance() {
    let mut random = Random(37);
    let mut count = 0;
    for names in [["cube", "l_bracket"], ["l_bracket", "torus_quads"], ["tetra", "cube"]] {
        for relation in [Relation::Touching, Relation::Deep, Relation::Apart, Relation::Touching] {
            let bodies = relation.place(names, &mut random);
            let size = bodies[0].diagonal().max(bodies[1].diagonal());
            count += compare_with_samples(&bodies, size, 64);
        }
    }
    assert!(count > 10_000, "{count}");
}

/// Needles through, in, along and beside a body, with edges from 1e-12 to 100 of its size.
#[test]
fn edges_of_needles_have_their_least_distances() {
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
fn edges_of_level_needles_have_their_least_distances() {
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

fn by_edges(scene: &Scene, options: &CollideOptions) -> Contacts {
    detect(scene, &CollideOptions { mode: Mode::Edge, ..*options }).expect("a good scene")
}

const PROCESSOR: Detection =
    Detection { detect: &by_edges, distance: 2.01e-7, point: 1e-9, level: 1e-9, cosine: 1e-9 };

#[test]
fn a_box_stands_on_the_corners_of_the_patch() {
    // No vertex is on an edge of the other box: it may have the normal of either side. A corner of
    // the patch has a contact of a vertex of one of the boxes, which may be 5e-5 above it.
    let near = 5e-5 + 1e-9;
    let shift = DVec3::new(0.031, 0.0217, 0.0);
    assert_eq!(
        PROCESSOR.shifted_or_turned_box_stands_on_the_corners_of_the_patch(ContactsPer::Minimum, shift, near),
        0
    );
}

#[test]
fn a_box_stands_on_a_plane_and_on_four_pegs() {
    PROCESSOR.box_stands_on_a_plane_and_on_four_pegs(ContactsPer::Minimum);
}

/// Boxes as meshes and as simple shapes have the same contacts.
#[test]
fn simple_boxes_have_the_edges_of_their_meshes() {
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

/// What nodes miss, edges have: a box that is turned on another one.
#[test]
fn a_turned_box_has_contacts_where_its_edges_cross() {
    let half = DVec3::splat(0.05);
    let mut upper = block(-half, half, 1);
    upper.at.pose =
        Pose { translation: DVec3::new(0.0, 0.0, 0.1), rotation: DQuat::from_rotation_z(FRAC_PI_6) };
    let scene = scene(&[block(-half, half, 1), upper]);
    let nodes = CollideOptions { contact_distance: 1e-4, ..CollideOptions::with_mode(Mode::Node) };
    assert_eq!(detect(&scene, &nodes).expect("a good scene").len(), 0);
    assert_eq!(coarse_contacts(&scene, &nodes).expect("a good scene").len(), 2);
    let all = found(&scene, 1e-4);
    let touching = all.iter().filter(|c| c.distance.abs() < 1e-9 && c.normal.z.abs() > 1.0 - 1e-9).count();
    assert!(touching >= 8, "{touching}");
}

#[test]
fn why_names_edges_and_their_ends() {
    let bars = crossing_bars(1e-3);
    let scene = scene(&bars);
    let options = options(0.01);
    let ids: Vec<_> = scene.instances().map(|(id, _)| id).collect();
    let all = why(&scene, &options, ids[0], ids[1], None).expect("a pair");
    // Eight nodes and twelve edges: the six diagonals are flat.
    assert_eq!(all.total, 20);
    let of_detection = detect(&scene, &options).expect("a good scene");
    let contacts: usize = all.parts.iter().map(|part| part.contacts()).sum();
    assert_eq!(contacts, of_direction(of_detection.as_slice(), 0, 1).count());
    let first = of_direction(of_detection.as_slice(), 0, 1).next().expect("a contact");
    let one = why(&scene, &options, ids[0], ids[1], Some(first.feature.a)).expect("an edge");
    assert_eq!((one.parts.len(), one.parts[0].id), (1, first.feature.a));
    assert_eq!(one.parts[0].polygons[0].verdict, PolygonVerdict::Contact);
    assert!(why(&scene, &options, ids[0], ids[1], Some(999)).is_err());
}

/// Two sides of the boxes are flush, so vertices and edges of each box lie on an edge of the other
/// one.
#[test]
fn flush_boxes_push_each_other_up_along_their_common_edges() {
    let half = DVec3::splat(0.05);
    for divisions in [1, 3] {
        let mut upper = block(-half, half, divisions);
        upper.at.pose = Pose::at(DVec3::new(0.031, 0.0, 0.1));
        let all = found(&scene(&[block(-half, half, divisions), upper]), 1e-6);
        for contact in all.iter() {
            assert!(contact.normal.z.abs() > 1.0 - 1e-9, "{contact:?}");
        }
        for [a, b] in [[0, 1], [1, 0]] {
            let at_side =
                of_direction(all.as_slice(), a, b).filter(|c| (c.point_a.y.abs() - 0.05).abs() < 1e-9);
            assert!(at_side.count() >= 2);
        }
    }
}
