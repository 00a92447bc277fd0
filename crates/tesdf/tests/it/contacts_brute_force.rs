//! Compares the (face, cell) pairs that detection examines with all pairs: none is missing, and
//! none is invented.

use std::collections::{BTreeMap, BTreeSet};

use crate::support::bodies::{Placed, Relation, of_direction, rotation, scene};
use crate::support::lowest::{area, clip, sampled};
use crate::support::random::Random;
use rayon::prelude::*;
use tesdf::collide::internal::{count_faces, count_polygons};
use tesdf::collide::{CollideOptions, ContactsPer, Mode, candidates, detect};
use tesdf::geometry::Aabb;
use tesdf::glam::DVec3;

/// A face and a cell.
type Pair = (u32, u32);

/// Pairs closer to the threshold than this fraction of the diagonal may be decided either way; the
/// tolerance of the exact mode is 1e-7.
const BAND: f64 = 1e-6;
/// Polygons with less area than this fraction of the squared diagonal are points and lines up to
/// rounding.
const DEGENERATE: f64 = 1e-12;

/// The pairs of one ordered pair of bodies, by brute force.
#[derive(Default)]
struct BruteForce {
    /// For each nonempty polygon: its area and the least signed distance found on it, in b's unit.
    pairs: BTreeMap<Pair, (f64, f64)>,
}

impl BruteForce {
    /// Every `stride`-th face of `a` with every cell of `b`.
    fn of(a: &Placed, b: &Placed, stride: usize, contact_distance: f64) -> Self {
        let mut cells = Vec::new();
        // Cells without a list are answered by the face tree, and contacts there name no cell.
        b.body.asset.visit_cells(|cell| {
            if cell.kind.is_listed() {
                cells.push((cell.id, cell.corners, Aabb::of(&cell.corners)));
            }
        });
        let faces: Vec<u32> = (0..a.body.solid.mesh().faces().len() as u32).step_by(stride).collect();
        let value = |p: DVec3| b.body.asset.query_by_tree(p).signed_distance;
        let of_face = |&face: &u32| {
            let triangle = a.body.face(face, a.at).map(|p| b.at.to_shape(p));
            let bounds = Aabb::of(&triangle);
            let near = cells.iter().filter(move |(.., bounds_of_cell)| bounds_of_cell.overlaps(bounds));
            let mut found = Vec::new();
            for (cell, corners, _) in near {
                let polygon = clip(triangle, corners);
                if polygon.is_empty() {
                    continue;
                }
                let middle = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
                let reach = polygon.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
                let at_middle = value(middle);
                // The field is 1-Lipschitz.
                let least = if at_middle - reach > contact_distance / b.at.scale {
                    f64::INFINITY
                } else {
                    sampled(&polygon, 3, 1e-6, value).0
                };
                found.push(((face, *cell), (area(&polygon), least)));
            }
            found
        };
        Self { pairs: faces.par_iter().flat_map_iter(of_face).collect() }
    }
}

/// Compares one ordered pair. Returns the number of required pairs and of pairs too close to
/// decide.
fn compare(a: usize, b: usize, bodies: &[Placed], stride: usize, contact_distance: f64) -> [usize; 2] {
    let all = BruteForce::of(&bodies[a], &bodies[b], stride, contact_distance);
    let options = CollideOptions {
        contact_distance,
        ..CollideOptions::with_mode(Mode::exact().per(ContactsPer::Cell))
    };
    let scene = scene(bodies);
    let found = detect(&scene, &options).expect("a good scene");
    let of_stride = |face: u32| (face as usize).is_multiple_of(stride);
    let reported: BTreeMap<Pair, f64> = of_direction(found.as_slice(), a as u32, b as u32)
        .filter(|c| of_stride(c.face_a))
        .filter_map(|c| c.tet_b.map(|cell| ((c.face_a, cell), c.distance)))
        .collect();
    let all_candidates = candidates(&scene, &options).expect("a good scene");
    assert_eq!(count_polygons(&scene, &options).expect("a good scene"), all_candidates.len());
    assert_eq!(count_faces(&scene, &options).expect("a good scene"), found.statistics.candidates);
    let looked_at: BTreeSet<Pair> = all_candidates
        .iter()
        .filter(|c| (c.instance_a.0, c.instance_b.0) == (a as u32, b as u32) && of_stride(c.face_a))
        .filter_map(|c| c.tet_b.map(|cell| (c.face_a, cell)))
        .collect();
    let (unit, diagonal) = (bodies[b].at.scale, bodies[b].body.diagonal());
    let [mut needed, mut unclear] = [0; 2];
    for (pair, &(area, least)) in &all.pairs {
        let degenerate = area < DEGENERATE * diagonal * diagonal;
        let beyond = least - contact_distance / unit;
        if degenerate || (beyond.abs() < BAND * diagonal) {
            unclear += usize::from(beyond < BAND * diagonal);
            continue;
        }
        if beyond < 0.0 {
            needed += 1;
            assert!(looked_at.contains(pair), "face and cell {pair:?}, {least} deep, is no candidate");
            let distance = reported.get(pair);
            let distance =
                distance.unwrap_or_else(|| panic!("face and cell {pair:?}, {least} deep, is lost"));
            assert!(distance / unit < least + BAND * diagonal, "{pair:?}: {distance} {least}");
            assert!(distance / unit > least - 0.02 * diagonal, "{pair:?}: {distance} {least}: poor samples?");
        } else {
            assert!(!reported.contains_key(pair), "{pair:?} is {beyond} beyond the contact distance");
        }
    }
    // When a face only touches a cell, rounding may leave a point or a line in it.
    let (faces, mut corners) = (&bodies[a], BTreeMap::new());
    bodies[b].body.asset.visit_cells(|cell| {
        if cell.kind.is_listed() {
            corners.insert(cell.id, cell.corners);
        }
    });
    for pair in looked_at.iter().chain(reported.keys()) {
        if all.pairs.contains_key(pair) {
            continue;
        }
        let triangle = faces.body.face(pair.0, faces.at).map(|p| bodies[b].at.to_shape(p));
        let Some(cell) = corners.get(&pair.1) else { continue };
        let middle = cell.iter().sum::<DVec3>() / 4.0;
        let grown = cell.map(|p| p + 1e-9 * diagonal * (p - middle).normalize());
        let polygon = clip(triangle, &grown);
        assert!(!polygon.is_empty(), "{pair:?} do not meet");
        assert!(area(&polygon) < 1e-8 * diagonal * diagonal, "{pair:?} meet by rounding only");
    }
    [needed, unclear]
}

/// Required pairs and pairs too close to decide, over both orders.
fn compare_both(bodies: &[Placed], stride: usize, contact_distance: f64) -> [usize; 2] {
    let forth = compare(0, 1, bodies, stride, contact_distance);
    let back = compare(1, 0, bodies, stride, contact_distance);
    [0, 1].map(|i| forth[i] + back[i])
}

fn hold(names: [&str; 2], relations: &[Relation], stride: usize, share_unclear: f64) {
    let mut random = Random(names.iter().flat_map(|n| n.bytes()).map(u64::from).sum());
    let (mut needed, mut unclear) = (0, 0);
    for relation in relations {
        let bodies = relation.place(names, &mut random);
        // Contact distances: zero, within the band of 0.05, and, for small bodies, beyond it.
        for &wide in &[0.0, 0.02, 0.08][..if stride == 1 { 3 } else { 2 }] {
            let [n, u] = compare_both(&bodies, stride, wide * bodies[0].diagonal());
            (needed, unclear) = (needed + n, unclear + u);
        }
    }
    assert!(needed > 40, "{names:?}: only {needed} pairs");
    let share = unclear as f64 / needed as f64;
    assert!(share < share_unclear, "{names:?}: {unclear} of {needed} pairs are too close to call");
}

const GENERAL: [Relation; 4] = [Relation::Touching, Relation::Deep, Relation::Inside, Relation::Apart];

#[test]
fn cube_and_tetrahedron() {
    hold(["cube", "tetra"], &[GENERAL, GENERAL].concat(), 1, 0.1);
}

#[test]
fn brackets() {
    hold(["l_bracket", "l_bracket"], &GENERAL, 31, 0.1);
}

#[test]
fn sponge_and_cube() {
    hold(["menger_2", "cube"], &GENERAL, 211, 0.1);
}

#[test]
fn peg_in_a_hole() {
    hold(["lobed_hole_c50", "lobed_peg"], &[Relation::Touching, Relation::Inside], 307, 0.1);
}

#[test]
fn bolt_in_a_nut() {
    let mut random = Random(16);
    for by in [0.0, 2e-4] {
        let bolt = Placed::around("iso_m16_bolt_6k", rotation(&mut random), 1.0, DVec3::ZERO);
        let nut = tesdf::collide::Placement {
            pose: tesdf::collide::Pose {
                translation: bolt.at.pose.translation + by * random.direction(),
                ..bolt.at.pose
            },
            scale: 1.0,
        };
        let [needed, unclear] = compare_both(&[bolt, Placed::new("iso_m16_nut_c25", nut)], 211, 2e-4);
        assert!(needed > 20 && unclear < needed / 5, "{needed} {unclear}");
    }
}

#[test]
fn node_contacts_equal_brute_force_over_vertices() {
    let mut random = Random(4);
    for relation in [Relation::Deep, Relation::Touching, Relation::Inside] {
        let bodies = relation.place(["l_bracket", "torus_quads"], &mut random);
        let contact_distance = 0.03 * bodies[0].diagonal();
        let options = CollideOptions { contact_distance, ..CollideOptions::with_mode(Mode::Node) };
        let found = detect(&scene(&bodies), &options).expect("a good scene");
        for (a, b) in [(0, 1), (1, 0)] {
            let nodes: BTreeSet<u32> =
                of_direction(found.as_slice(), a as u32, b as u32).map(|c| c.feature.a).collect();
            let (from, to) = (&bodies[a], &bodies[b]);
            for (v, &p) in from.body.solid.mesh().vertices().iter().enumerate() {
                let beyond = to.distance_by_tree(from.at.to_world(p)) - contact_distance;
                if beyond.abs() > 1e-12 * to.diagonal() {
                    assert_eq!(
                        nodes.contains(&(v as u32)),
                        beyond < 0.0,
                        "{relation:?} vertex {v}: {beyond}"
                    );
                }
            }
        }
    }
}
