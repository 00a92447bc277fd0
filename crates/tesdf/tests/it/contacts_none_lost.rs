//! Meshes of `data/` in all relative placements: no contact is lost, and each contact is sound.
//!
//! `TESDF_TEST_FACES=6600 cargo test --release -p tesdf --test it contacts_none_lost` is the long run,
//! with larger meshes.

use std::collections::BTreeMap;

use crate::support::bodies::{Placed, RELATIONS, Relation, body, of_direction, rotation, scene};
use crate::support::lowest::sampled;
use crate::support::meshes;
use crate::support::random::Random;
use rayon::prelude::*;
use tesdf::Length;
use tesdf::collide::{
    CollideOptions, Contact, Contacts, ContactsPer, FeatureId, InstanceId, Mode, Pose, detect,
};
use tesdf::geometry::{Aabb, Triangle};
use tesdf::glam::DVec3;

/// Meshes with more faces are part of the long run only.
const FACES: usize = 1_200;
/// `contacts_exact` tests the default tolerance of 1e-7, which would take minutes here.
const COARSE: f64 = 1e-4;
const TOLERANCE: Length = Length::OfDiagonal(COARSE);
/// Accepted shortfall of 16 Frank–Wolfe iterations. The worst cases are large faces in large cells,
/// where the field is least convex.
const FRANK_WOLFE: f64 = 5e-2;
/// Number of sampled faces per ordered pair.
const SAMPLED: usize = 30;
/// Rounding of world coordinates, relative to their size.
const ROUNDING: f64 = 1e-13;

/// Bodies whose size differs from that of all other bodies.
const EXTREME: [&str; 2] = ["huge_1e30_obj", "tiny_1e-30_obj"];

fn names() -> Vec<String> {
    let most = match std::env::var("TESDF_TEST_FACES") {
        Ok(text) => text.parse().expect("TESDF_TEST_FACES is a number of faces"),
        Err(_) => FACES,
    };
    let rows = meshes::manifest().into_iter();
    rows.filter(|r| r.faces <= most && !meshes::CRACKED.contains(&r.name.as_str())).map(|r| r.name).collect()
}

/// For each mesh a scene with a second mesh. All relations and all meshes occur.
fn cases() -> Vec<(Relation, [Placed; 2])> {
    let names = names();
    assert!(names.len() > 20, "only {} meshes", names.len());
    let mut random = Random(7);
    // Encodes in parallel.
    names.par_iter().for_each(|name| drop(body(name)));
    let pair = |k: usize| {
        let relation = RELATIONS[k % RELATIONS.len()];
        let (first, second) = (&names[k % names.len()], &names[random.index(names.len())]);
        // The relation `Same` is meaningful only for the same mesh. A body of extreme size has no
        // useful placement with one 1e12 times as large.
        let is_alone = |name: &String| EXTREME.contains(&name.as_str());
        let alone = relation == Relation::Same || is_alone(first) || is_alone(second);
        let second = if alone { first } else { second };
        (relation, relation.place([first, second], &mut random))
    };
    (0..names.len()).map(pair).collect()
}

/// Largest absolute coordinate that occurs between the bodies and the world.
fn size(bodies: &[Placed]) -> f64 {
    let of = |b: &Placed| {
        let bounds = b.at.bounds(b.body.solid.mesh().bounds());
        let own = b.body.solid.mesh().bounds();
        let largest = |x: Aabb| x.min.abs().max(x.max.abs()).max_element();
        largest(bounds).max(b.at.scale * largest(own)).max(b.at.pose.translation.abs().max_element())
    };
    bodies.iter().map(of).fold(0.0, f64::max)
}

fn is_small(bodies: &[Placed]) -> bool {
    bodies.iter().all(|b| b.body.solid.mesh().faces().len() < 100)
}

fn wide(k: usize, relation: Relation, bodies: &[Placed]) -> f64 {
    let small = is_small(bodies);
    let share = match (k % 3, relation) {
        // Beyond the band of 0.05, where the face tree answers.
        (_, Relation::Far) if small => 150.0,
        (_, Relation::Apart) if small => 2.0,
        (1, Relation::Apart) => 0.07,
        (1, _) => 0.01,
        _ => 0.0,
    };
    share * bodies[0].diagonal()
}

/// Checks the guarantees of a contact. Returns whether its normal is the gradient.
fn is_sound(c: &Contact, bodies: &[Placed], mode: Mode, contact_distance: f64) -> bool {
    let (a, b) = (&bodies[c.instance_a.0 as usize], &bodies[c.instance_b.0 as usize]);
    let diagonal = a.diagonal().max(b.diagonal());
    let rounding = ROUNDING * size(bodies) + 1e-12 * diagonal;
    let what = || format!("{c:?} {mode:?}");
    assert!(c.distance <= contact_distance, "{}", what());
    let face = a.body.face(c.face_a, a.at);
    assert!(Triangle::new(face).closest(c.point_a).distance < 1e-9 * diagonal + rounding, "{}", what());
    assert!((c.normal.length() - 1.0).abs() < 1e-9, "{}", what());
    let between = c.point_a - c.point_b;
    assert!((between.length() - c.distance.abs()).abs() < rounding, "{}", what());
    let answer = b.body.asset.query(b.at.to_shape(c.point_a));
    let asked = b.at.scale * answer.signed_distance;
    assert!((asked - c.distance).abs() < rounding, "{} query: {asked}", what());
    let on_b = Triangle::new(b.body.face(c.face_b, b.at));
    assert!(on_b.closest(c.point_b).distance < rounding, "{}", what());
    let mut is_gradient = true;
    if c.distance.abs() > 1e-6 * diagonal + 1e6 * rounding {
        // The normal is the gradient; or of a face one that both bodies allow, as far as the place is
        // known (`docs/math.md`, section 18).
        let off = c.normal.distance(between / c.distance);
        is_gradient = off < 1e-5;
        let known = 1e-6 * diagonal + (8.0 * COARSE * b.diagonal() * c.distance.abs()).sqrt();
        assert!(is_gradient || mode != Mode::Node && off * c.distance.abs() <= known, "{}", what());
    }
    if is_gradient && c.distance.abs() > 1e-6 * diagonal + 1e6 * rounding {
        // It equals the gradient of the query, unless another point is equally near.
        let same = (b.at.to_world(answer.closest_point) - c.point_b).length() < 1e-6 * diagonal;
        let gradient = b.at.pose.rotation * answer.gradient;
        assert!(!same || c.normal.distance(gradient) < 1e-3, "{} query: {gradient}", what());
    }
    if mode == Mode::Node {
        let node = a.at.to_world(a.body.solid.mesh().vertices()[c.feature.a as usize]);
        assert!(node.distance(c.point_a) < rounding, "{}", what());
        let faces = a.body.solid.mesh().faces();
        assert_eq!(faces.iter().position(|f| f.contains(&c.feature.a)), Some(c.face_a as usize));
    } else {
        assert_eq!(c.feature.a, c.face_a);
    }
    is_gradient
}

/// Contacts are sorted by pair, order, face and cell. Contacts per cell: a face has at most one in
/// each cell.
fn is_sorted(contacts: &[Contact], per: ContactsPer) {
    let key = |c: &Contact| {
        let (a, b) = (c.instance_a, c.instance_b);
        (a.min(b), a.max(b), a > b, c.face_a, c.feature.a, c.tet_b)
    };
    for pair in contacts.windows(2) {
        let (x, y) = (key(&pair[0]), key(&pair[1]));
        let is_same = x == y && (x.5.is_none() || per == ContactsPer::Face);
        assert!(x < y || is_same, "{:?} {:?}", pair[0], pair[1]);
    }
}

/// The least distance of each face or node.
fn least(contacts: &[Contact], a: u32, b: u32) -> BTreeMap<u32, f64> {
    let mut least = BTreeMap::new();
    for c in of_direction(contacts, a, b) {
        let known: &mut f64 = least.entry(c.feature.a).or_insert(f64::INFINITY);
        *known = known.min(c.distance);
    }
    least
}

/// All vertices of `a` within reach of the field of `b` have contacts.
fn has_all_nodes(found: &Contacts, bodies: &[Placed], a: usize, b: usize, contact_distance: f64) {
    let nodes = least(found.as_slice(), a as u32, b as u32);
    let (from, to) = (&bodies[a], &bodies[b]);
    let band = ROUNDING * size(bodies) + 1e-12 * to.diagonal();
    let mut used = vec![false; from.body.solid.mesh().vertices().len()];
    let faces = from.body.solid.mesh().faces();
    faces.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    for (v, &p) in from.body.solid.mesh().vertices().iter().enumerate() {
        if !used[v] {
            continue;
        }
        let p = from.at.to_world(p);
        let distance = to.at.scale * to.body.asset.query(to.at.to_shape(p)).signed_distance;
        match nodes.get(&(v as u32)) {
            Some(known) => assert!((known - distance).abs() < band, "vertex {v}: {known} {distance}"),
            None => assert!(distance > contact_distance - band, "vertex {v}, {distance}, is lost"),
        }
    }
}

/// Samples of some faces of `a`, and all its vertices, are not deeper in the field of `b` than the
/// contacts. `shallow` is the accepted shortfall of the method.
fn has_the_deepest(
    found: &Contacts,
    bodies: &[Placed],
    a: usize,
    b: usize,
    contact_distance: f64,
    shallow: f64,
) {
    let faces = least(found.as_slice(), a as u32, b as u32);
    let (from, to) = (&bodies[a], &bodies[b]);
    let band = ROUNDING * size(bodies) + shallow * to.diagonal();
    let count = from.body.solid.mesh().faces().len();
    for face in (0..count as u32).step_by(count.div_ceil(SAMPLED)) {
        let triangle = from.body.face(face, from.at);
        let (lowest, at) = sampled(&triangle, 5, 1.0, |p| to.distance_by_tree(p));
        let known = faces.get(&face).copied().unwrap_or(contact_distance);
        assert!(
            known.min(contact_distance) < lowest + band || lowest > contact_distance,
            "face {face} is {lowest} deep at {at}, within {shallow}; reported {:?}",
            faces.get(&face)
        );
    }
}

/// The contacts with the two instances exchanged.
fn renamed(contacts: &[Contact]) -> Vec<Contact> {
    let other = |id: InstanceId| InstanceId(1 - id.0);
    let mut all: Vec<Contact> = contacts
        .iter()
        .map(|c| Contact { instance_a: other(c.instance_a), instance_b: other(c.instance_b), ..*c })
        .collect();
    all.sort_by_key(|c| c.instance_a);
    all
}

/// Both results have the same faces with the same least distances, up to rounding. Faces at the
/// threshold may differ.
fn same_but_rounding(one: &Contacts, other: &Contacts, bodies: &[Placed], contact_distance: f64, error: f64) {
    for (a, b) in [(0, 1), (1, 0)] {
        let band = error * bodies[b as usize].diagonal() + 1e-12 * size(bodies);
        let [one, other] = [one, other].map(|c| least(c.as_slice(), a, b));
        for (x, y) in [(&one, &other), (&other, &one)] {
            for (part, distance) in x {
                match y.get(part) {
                    Some(again) => assert!((distance - again).abs() < band, "{part}: {distance} {again}"),
                    None => assert!(*distance > contact_distance - band, "{part}, {distance}, is lost"),
                }
            }
        }
    }
}

#[test]
fn no_contact_is_lost() {
    let cases = cases();
    let counts: Vec<(Relation, usize)> = cases
        .par_iter()
        .enumerate()
        .map(|(k, (relation, bodies))| {
            let contact_distance = wide(k, *relation, bodies);
            let (scene, mut count) = (scene(bodies), 0);
            let swapped = crate::support::bodies::scene(&[bodies[1].clone(), bodies[0].clone()]);
            let mut random = Random(k as u64);
            let motion = Pose {
                translation: bodies[0].diagonal() * random.in_cube(),
                rotation: rotation(&mut random),
            };
            let moved = [bodies[0].moved(motion), bodies[1].moved(motion)];
            // Accepted differences: twice the tolerance in the exact mode, rounding for nodes.
            for (mode, error) in
                [(Mode::Node, 1e-12), (Mode::exact(), 2.1 * COARSE), (Mode::face(), f64::INFINITY)]
            {
                // When surfaces coincide, the exact mode reaches its limit of evaluations.
                let is_flat = matches!(relation, Relation::Same | Relation::SharedFaces);
                if mode == Mode::exact() && is_flat && !is_small(bodies) {
                    continue;
                }
                let options = CollideOptions {
                    contact_distance,
                    ..CollideOptions::with_mode(mode.per(ContactsPer::Cell).within(TOLERANCE))
                };
                let found = detect(&scene, &options).expect("a good scene");
                let of_others = detect(&swapped, &options).expect("a good scene");
                count += found.len();
                is_sorted(found.as_slice(), ContactsPer::Cell);
                let is_turned = |c: &&Contact| !is_sound(c, bodies, mode, contact_distance);
                let turned = found.iter().filter(is_turned).count();
                assert!(10 * turned <= found.len() + 20, "{turned} of {} normals, {mode:?}", found.len());
                assert_eq!(renamed(of_others.as_slice()), {
                    let mut all = found.as_slice().to_vec();
                    all.sort_by_key(|c| c.instance_a);
                    all
                });
                for (a, b) in [(0, 1), (1, 0)] {
                    match mode {
                        Mode::Node => has_all_nodes(&found, bodies, a, b, contact_distance),
                        Mode::Face { .. } => {
                            has_the_deepest(&found, bodies, a, b, contact_distance, FRANK_WOLFE)
                        }
                        _ => has_the_deepest(&found, bodies, a, b, contact_distance, 1.01 * COARSE),
                    }
                }
                if error.is_finite() {
                    let after =
                        detect(&crate::support::bodies::scene(&moved), &options).expect("a good scene");
                    same_but_rounding(&found, &after, bodies, contact_distance, error);
                }
            }
            (*relation, count)
        })
        .collect();
    for relation in RELATIONS {
        let found: usize = counts.iter().filter(|c| c.0 == relation).map(|c| c.1).sum();
        // In the relation `Far`, only small bodies have contacts, because of a wide contact
        // distance.
        assert!(found > 0 || relation == Relation::Far, "{relation:?}: no contact at all");
    }
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let mut random = Random(11);
    let names = ["factory_round_peg_8mm_tight", "l_bracket", "beam", "torus_quads"];
    let bodies: Vec<Placed> = (0..4)
        .map(|k| {
            let to = 0.004 * random.in_cube();
            let name = names[k % names.len()];
            Placed::around(name, rotation(&mut random), 0.03 / body(name).diagonal(), to)
        })
        .collect();
    let scene = scene(&bodies);
    for (mode, contacts_per) in [
        (Mode::Node, ContactsPer::Face),
        (Mode::face(), ContactsPer::Cell),
        (Mode::face(), ContactsPer::Face),
        (Mode::exact(), ContactsPer::Cell),
        (Mode::exact(), ContactsPer::Face),
    ] {
        let options = CollideOptions {
            contact_distance: 1e-4,
            ..CollideOptions::with_mode(mode.per(contacts_per).within(TOLERANCE))
        };
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| detect(&scene, &options).expect("a good scene"))
        };
        let [one, two, eight] = [1, 2, 8].map(on);
        assert!(one.len() > 100, "{mode:?}, {contacts_per:?}: {} contacts", one.len());
        is_sorted(one.as_slice(), contacts_per);
        for other in [two, eight] {
            assert_eq!(bits(one.as_slice()), bits(other.as_slice()), "{mode:?}, {contacts_per:?}");
            assert_eq!(one.statistics, other.statistics);
        }
    }
}

type Bits = ([u64; 10], [u32; 4], Option<u32>, FeatureId, bool);

/// All bits of the contacts. Equal numbers, such as 0 and -0, may differ in their bits.
fn bits(contacts: &[Contact]) -> Vec<Bits> {
    let all = |c: &Contact| {
        let [p, q, n]: [DVec3; 3] = [c.point_a, c.point_b, c.normal];
        let numbers = [p.x, p.y, p.z, q.x, q.y, q.z, n.x, n.y, n.z, c.distance].map(f64::to_bits);
        let ids = [c.face_a, c.face_b, c.instance_a.0, c.instance_b.0];
        (numbers, ids, c.tet_b, c.feature, c.converged)
    };
    contacts.iter().map(all).collect()
}
