//! The proof succeeds for good assets and finds the faults of others.

use std::ops::ControlFlow;

use crate::support::cells::lattice;
use crate::support::random::Random;
use crate::support::shapes::{FAMILIES, Shape};
use crate::support::tetrahedra::beam;
use tesdf::TeSdf;
use tesdf::asset::layout::{self, Label, List, Node};
use tesdf::asset::{CellKind, SectionSpec};
use tesdf::encode::{Domain, EncodeOptions, Encoder, Method, Preset, Refinement, Sampling, Threshold};
use tesdf::geometry::Triangle;
use tesdf::glam::DVec3;
use tesdf::mesh::SolidMesh;
use tesdf::verify::{Claim, ProveError, ProveOptions, ProveReport, Verdict, prove};

fn fast() -> EncodeOptions {
    EncodeOptions::preset(Preset::Fast)
}

fn encoded_with(solid: &SolidMesh, domain: Domain, options: &EncodeOptions) -> TeSdf {
    Encoder::new().options(options.clone()).domain(domain).encode(solid).expect("valid options")
}

fn encoded(solid: &SolidMesh) -> TeSdf {
    encoded_with(solid, Domain::Bisection, &fast())
}

/// A ball with a box-shaped cavity, which has cells of every label.
fn hollow() -> TeSdf {
    let mut shape = Shape::default().add_sphere(DVec3::new(3.0, -2.0, 0.5), 2, || 1.0);
    let outer = shape.faces.len();
    shape = shape.add_box(DVec3::new(2.8, -2.3, 0.4), DVec3::new(3.2, -1.9, 0.7), 2);
    shape.faces[outer..].iter_mut().for_each(|f| f.swap(1, 2));
    encoded(&shape.solid())
}

fn one_box() -> Shape {
    Shape::default().add_box(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), 1)
}

fn proved_with(asset: &TeSdf, pieces: u64) -> ProveReport {
    prove(asset, &ProveOptions { pieces }, |_| ControlFlow::Continue(())).expect("a closed mesh")
}

fn proved(asset: &TeSdf) -> ProveReport {
    proved_with(asset, 1 << 16)
}

/// The asset after `change` of a section. Opening does not verify checksums.
fn changed(asset: &TeSdf, spec: SectionSpec, change: impl FnOnce(&mut [u8])) -> TeSdf {
    let mut bytes = asset.as_bytes().to_vec();
    let section = asset.container().sections().find(|s| s.spec == spec).expect("the section is there").bytes;
    let start = section.as_ptr().addr() - asset.as_bytes().as_ptr().addr();
    change(&mut bytes[start..start + section.len()]);
    TeSdf::from_bytes(&bytes).expect("still well formed")
}

fn change_nodes(asset: &TeSdf, change: impl Fn(Node) -> Node) -> TeSdf {
    changed(asset, layout::NODES, |bytes| {
        for word in bytes.as_chunks_mut::<4>().0 {
            *word = change(Node::decode(u32::from_le_bytes(*word), &[])).encode().to_le_bytes();
        }
    })
}

/// Replaces a face by another face in every palette.
fn replace_in_palettes(asset: &TeSdf, from: u16, to: u16) -> TeSdf {
    changed(asset, layout::PALETTES, |bytes| {
        for word in bytes.as_chunks_mut::<2>().0 {
            if u16::from_le_bytes(*word) == from {
                *word = to.to_le_bytes();
            }
        }
    })
}

/// Distance of a point from faces, given by their ids, which are their indices in the mesh.
fn distance(solid: &SolidMesh, faces: &[u32], p: DVec3) -> f64 {
    let of = |&f: &u32| Triangle::new(solid.mesh().triangle(f as usize)).closest(p).distance;
    faces.iter().map(of).fold(f64::INFINITY, f64::min)
}

/// Whether a lattice of points in each cell shows a list with an error above `tolerance`.
fn is_wrong_somewhere(solid: &SolidMesh, asset: &TeSdf, tolerance: f64) -> bool {
    let all: Vec<u32> = (0..solid.mesh().faces().len() as u32).collect();
    let mut is_wrong = false;
    asset.visit_cells(|cell| {
        let list = asset.list_of(cell.id);
        let points = lattice(&cell.corners, 4);
        is_wrong |= cell.kind.is_listed()
            && points.iter().any(|&p| distance(solid, &list, p) > distance(solid, &all, p) + tolerance);
    });
    is_wrong
}

#[test]
fn good_assets_are_proved_the_same_way_on_any_number_of_threads() {
    let asset = hollow();
    let report = proved(&asset);
    assert!(report.proved && report.certified && report.faults.is_empty(), "{report:#?}");
    let statistics = &asset.about().statistics;
    assert_eq!(report.distances.proved, statistics.listed_cells);
    let cells = statistics.listed_cells + statistics.far_cells + statistics.outside_cells;
    assert_eq!((report.signs.proved, report.face_tree.proved), (cells + 1, 1));
    assert!(report.pieces > 1000 && report.most_pieces > 10);
    assert_eq!(Some(report.delta), asset.about().certificate().delta());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    assert_eq!(pool.install(|| proved(&asset)), report);
}

#[test]
fn hard_shapes_are_proved() {
    for (seed, family) in (20..).zip(FAMILIES) {
        let report = proved(&encoded(&family.member(seed)));
        assert!(report.proved, "{family:?}: {report:#?}");
    }
}

#[test]
fn faces_without_area_are_proved() {
    // The middle of an edge of a box becomes a vertex on one side only. A face without area closes
    // the gap.
    let mut shape = one_box();
    let [a, b, c] = shape.faces[0];
    let middle = shape.vertices.len() as u32;
    shape.vertices.push(0.5 * (shape.vertices[a as usize] + shape.vertices[b as usize]));
    shape.faces[0] = [a, middle, c];
    shape.faces.extend([[middle, b, c], [a, b, middle]]);
    let ball = shape.add_sphere(DVec3::new(4.0, 0.0, 0.0), 1, || 1.0);
    let report = proved(&encoded(&ball.solid()));
    assert!(report.proved, "{report:#?}");
}

#[test]
fn a_list_that_lost_a_face_is_refuted_with_a_point() {
    let solid = one_box().solid();
    let asset = replace_in_palettes(&encoded(&solid), 4, 5);
    let report = proved(&asset);
    assert!(!report.proved && report.distances.refuted > 0, "{report:#?}");
    let refuted = report.faults.iter().find(|f| f.claim == Claim::Distance && f.verdict == Verdict::Refuted);
    let fault = refuted.expect("a refuted list");
    let (cell, face) = (fault.cell.expect("a cell"), fault.face.expect("a face"));
    let point = DVec3::from_array(fault.point.expect("a point"));
    let list = asset.list_of(cell);
    assert!(!list.contains(&face));
    let (of_list, of_face) = (distance(&solid, &list, point), distance(&solid, &[face], point));
    assert!(of_face + report.delta < of_list, "{of_face} {of_list}");
    let close = |found: Option<f64>, expected: f64| (found.expect("a distance") - expected).abs() < 1e-12;
    assert!(close(fault.list_distance, of_list) && close(fault.face_distance, of_face), "{fault:?}");
}

/// Each list loses one face. The proof never accepts a list that a lattice of points shows to be
/// wrong, and a list that it refutes is wrong.
#[test]
fn verdicts_agree_with_a_lattice_of_points() {
    let solid = Shape::default().add_sphere(DVec3::ZERO, 1, || 1.0).solid();
    let asset = encoded(&solid);
    let lists = asset.container().section::<u8>(layout::LISTS.name).expect("typed").expect("there");
    let mut offsets = Vec::new();
    let nodes = asset.container().section::<u32>(layout::NODES.name).expect("typed").expect("there");
    for &word in nodes {
        if let Node::Listed(_, offset) = Node::decode(word, lists) {
            offsets.push(offset);
        }
    }
    offsets.sort_unstable();
    offsets.dedup();
    let all: Vec<u32> = (0..solid.mesh().faces().len() as u32).collect();
    let mut random = Random(3);
    let (mut wrong, mut right) = (0, 0);
    for _ in 0..40 {
        let offset = offsets[random.index(offsets.len())];
        let Some(List::Slots(_, slots)) = List::decode(lists, offset) else { continue };
        if slots.len() < 2 {
            continue;
        }
        let lost = random.index(slots.len());
        let other = slots[(lost + 1) % slots.len()];
        // Layout: palette, count, slots.
        let at = offset as usize + 3 + lost;
        let asset = changed(&asset, layout::LISTS, |bytes| bytes[at] = other);
        let report = proved(&asset);
        if is_wrong_somewhere(&solid, &asset, 1e-9) {
            // The list must not be proved. It is refuted, unless rounding ends the search first.
            assert!(report.distances.proved < report.distances.claims, "{report:#?}");
            wrong += usize::from(report.distances.refuted > 0);
        } else {
            right += usize::from(report.distances.proved == report.distances.claims);
        }
        for fault in report.faults.iter().filter(|f| f.list_distance.is_some()) {
            let p = DVec3::from_array(fault.point.expect("a point"));
            let list = asset.list_of(fault.cell.expect("a cell"));
            assert!(distance(&solid, &list, p) > distance(&solid, &all, p) + report.delta, "{fault:?}");
        }
    }
    assert!(wrong > 5 && right + wrong > 20, "{wrong} wrong, {right} right");
}

#[test]
fn a_duplicate_face_replaces_its_twin_in_distances_but_not_in_signs() {
    let shape = one_box().add_box(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), 1);
    let solid = shape.solid();
    let asset = encoded(&solid);
    assert!(proved(&asset).proved);
    let corners = |place: usize| {
        let mut corners = asset.face_corners(place).map(|p| p.to_array().map(f64::to_bits));
        corners.sort_unstable();
        corners
    };
    let twin = (1..asset.face_count()).find(|&k| corners(k) == corners(0)).expect("a twin");
    let report = proved(&replace_in_palettes(&asset, 0, twin as u16));
    assert_eq!(report.distances.proved, report.distances.claims, "{report:#?}");
    assert!(report.signs.refuted > 0 && !report.proved, "{report:#?}");
    // Without both twins, the distances are wrong too.
    let other = (1..asset.face_count()).find(|&k| corners(k) != corners(0)).expect("another one") as u16;
    let report = proved(&replace_in_palettes(&replace_in_palettes(&asset, 0, other), twin as u16, other));
    assert!(report.distances.refuted > 0, "{report:#?}");
}

#[test]
fn wrong_labels_are_refuted() {
    let asset = hollow();
    let outside = change_nodes(&asset, |node| match node {
        Node::Listed(Label::Inside, offset) => Node::Listed(Label::Outside, offset),
        node => node,
    });
    let winding = change_nodes(&asset, |node| match node {
        Node::Listed(Label::Crossing(w), offset) => Node::Listed(Label::Crossing(1 - w.min(1)), offset),
        node => node,
    });
    let never = change_nodes(&asset, |node| match node {
        Node::Listed(Label::Crossing(_), offset) => Node::Listed(Label::Outside, offset),
        node => node,
    });
    let mut kinds = [0; 2];
    asset.visit_cells(|cell| {
        kinds[0] += usize::from(cell.kind == CellKind::Inside);
        kinds[1] += usize::from(cell.kind == CellKind::Crossing);
    });
    for (asset, refuted) in [(outside, kinds[0]), (winding, kinds[1])] {
        let report = proved(&asset);
        assert_eq!(report.distances.proved, report.distances.claims);
        assert_eq!((report.signs.refuted, report.signs.undecided), (refuted, 0), "{report:#?}");
        assert!(
            report.faults.iter().all(|f| f.claim == Claim::Sign && f.cell.is_some() && f.point.is_some())
        );
    }
    // A face near a cell that does not pass through it makes no sign wrong.
    assert!(proved(&never).signs.refuted > kinds[1] / 2);
}

#[test]
fn a_face_tree_that_misses_a_face_is_refuted() {
    let asset = hollow();
    let small = changed(&asset, layout::TREE_BOXES, |bytes| {
        // The lowest x of the first box.
        let (first, _) = bytes.split_first_chunk_mut::<4>().expect("a box");
        *first = (f32::from_le_bytes(*first) + 0.1).to_le_bytes();
    });
    let report = proved(&small);
    assert!(report.face_tree.refuted == 1 && report.faults.iter().all(|f| f.claim == Claim::FaceTree));
    let twice = changed(&asset, layout::FACE_IDS, |bytes| bytes.copy_within(0..4, 4));
    assert_eq!(proved(&twice).face_tree.refuted, 1);
}

#[test]
fn truncated_lists_are_proved_near_the_surface() {
    let solid = Shape::default().add_sphere(DVec3::ZERO, 2, || 1.0).solid();
    let options = EncodeOptions { max_entries: Some(16), ..fast() };
    let asset = encoded_with(&solid, Domain::Bisection, &options);
    let report = proved(&asset);
    assert!(report.within.is_some_and(|within| within > 0.0) && report.proved, "{report:#?}");
    // Farther out the lists are wrong; otherwise this test would show nothing.
    assert!(is_wrong_somewhere(&solid, &asset, 1e-6));
}

#[test]
fn sampled_lists_are_tested_with_the_delta_of_the_certified_encoder() {
    let solid = Shape::default().add_sphere(DVec3::ZERO, 2, || 1.0).solid();
    let sampling = Sampling { resolution: 1, shrink: 1.0, threshold: Threshold::Absolute(0.0) };
    let options =
        EncodeOptions { method: Method::Sampled(sampling), refinement: Refinement::ByCost, ..fast() };
    let report = proved_with(&encoded_with(&solid, Domain::Bisection, &options), 1 << 12);
    assert!(!report.certified && !report.proved && report.distances.refuted > 0, "{:?}", report.distances);
    assert!(report.distances.proved > 0 && report.delta > 0.0);
    let refuted: Vec<_> = report.faults.iter().filter(|f| f.verdict == Verdict::Refuted).collect();
    assert_eq!(refuted.len(), report.distances.refuted.min(ProveReport::REFUTED));
    let amounts: Vec<f64> = refuted.iter().filter_map(|f| f.nearer_by).collect();
    assert!(amounts.len() == refuted.len() && amounts.iter().all(|&by| by > report.delta), "{amounts:?}");
    assert!(amounts.iter().all(|&by| Some(by) <= report.nearer_by));
}

#[test]
fn conforming_domains_are_proved() {
    let (solid, domain) = beam();
    for refinement in [Refinement::None, Refinement::ByCost] {
        let options = EncodeOptions { refinement, ..fast() };
        let asset = encoded_with(&solid, Domain::Conforming(&domain), &options);
        let report = proved(&asset);
        assert!(report.proved && report.faults.is_empty(), "{refinement:?}: {report:#?}");
        let listed = asset.about().statistics.listed_cells;
        assert_eq!(report.signs.claims, listed + domain.tetrahedra().len() + 1);
        let wrong = change_nodes(&asset, |node| match node {
            Node::Listed(Label::Inside, offset) => Node::Listed(Label::Outside, offset),
            node => node,
        });
        assert!(proved(&wrong).signs.refuted > 0);
    }
}

#[test]
fn a_budget_leaves_cells_undecided() {
    let asset = hollow();
    let report = proved_with(&asset, 2);
    let tally = report.distances;
    assert!(tally.undecided > 0 && tally.refuted == 0 && tally.proved > 0 && !report.proved, "{tally:?}");
    assert_eq!(tally.proved + tally.undecided, tally.claims);
    assert!(report.faults.iter().all(|f| f.verdict == Verdict::Undecided && f.reason.contains("pieces")));
    assert_eq!((report.out_of_pieces, report.faults.len()), (tally.undecided, ProveReport::UNDECIDED));
}

#[test]
fn a_proof_can_be_cancelled_and_open_meshes_are_refused() {
    let asset = hollow();
    let stop = prove(&asset, &ProveOptions::default(), |_| ControlFlow::Break(()));
    assert_eq!(stop, Err(ProveError::Cancelled));
    let open = changed(&asset, layout::FACES, |bytes| {
        let [first, second, ..] = bytes.as_chunks_mut::<4>().0 else { panic!("no face") };
        std::mem::swap(first, second);
    });
    let refused = prove(&open, &ProveOptions::default(), |_| ControlFlow::Continue(()));
    assert!(matches!(refused, Err(ProveError::NotClosed { .. })), "{refused:?}");
}
