//! Compares Algorithm 1 on the device with Algorithm 1 on the processor.

use std::ops::ControlFlow;

use crate::compare::device;
use crate::support::meshes;
use crate::support::tetrahedra::grid;
use tesdf::domain::{Cell, ConformingMesh, DomainCube};
use tesdf::encode::internal::Touching;
use tesdf::encode::{
    Domain, EncodeError, EncodeOptions, Encoder, Method, Preset, Processor, Refinement, SampledCell, Sampler,
    Sampling, Surface, Threshold,
};
use tesdf::geometry::Aabb;
use tesdf::geometry::internal::{AabbTree, LocalFrame};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf::verify::{VerifyOptions, verify};
use tesdf::{Progress, TeSdf};
use tesdf_gpu::{DeviceSampler, ROUNDING, SamplerLimits};

fn solid(name: &str) -> SolidMesh {
    let row = meshes::manifest().into_iter().find(|r| r.name == name).expect("a row of the manifest");
    row.solid().expect("a solid")
}

/// A mesh in its local frame, with cells of several sizes: some deep cells that a face passes
/// through, and some of their ancestors.
struct Case {
    surface: Surface,
    tree: AabbTree,
    cells: Vec<Cell>,
}

impl Case {
    fn new(name: &str) -> Self {
        let solid = solid(name);
        let frame = LocalFrame::of(solid.mesh().bounds());
        let vertices = solid.mesh().vertices().iter().map(|&v| frame.to_local(v)).collect();
        let mesh = TriangleMesh::new(vertices, solid.mesh().faces().to_vec()).expect("valid ids");
        let cube = DomainCube::around(mesh.bounds());
        let surface = Surface::new(&mesh, cube.side(), Touching::Ignored);
        let boxes: Vec<Aabb> = surface.triangles.iter().map(|t| Aabb::of(&t.corners)).collect();
        let mut cells = Vec::new();
        for root in 0..6 {
            let mut cell = cube.root(root);
            for depth in 0..24 {
                if depth % 5 == 4 {
                    cells.push(cell);
                }
                let distance = |c: &Cell| {
                    let away = surface.triangles.iter().map(|t| t.closest(c.centroid()).distance);
                    away.fold(f64::INFINITY, f64::min)
                };
                let [a, b] = [0, 1].map(|side| cell.child(side));
                cell = if distance(&a) < distance(&b) { a } else { b };
            }
        }
        Self { tree: AabbTree::build(&boxes, 4), surface, cells }
    }

    fn sampled(&self, sampling: &Sampling) -> Vec<SampledCell> {
        let new = |cell: &Cell| SampledCell::new(&self.surface, &self.tree, *cell, sampling, 1.0);
        self.cells.iter().map(new).collect()
    }
}

#[test]
fn lists_have_the_faces_of_the_processor_and_ties_within_rounding() {
    let sampler = DeviceSampler::new(device());
    println!("device: {}", sampler.name());
    let progress = Progress::default();
    let thresholds = [
        Threshold::Absolute(0.0),
        Threshold::Absolute(1e-3),
        Threshold::Squared(1e-6),
        Threshold::CoveringRadius,
    ];
    let (mut listed, mut besides, mut most_candidates) = (0, 0, 0);
    for name in ["tetra", "cube", "l_bracket", "torus_quads", "shaft_keyway", "icosphere_5k"] {
        let case = Case::new(name);
        for (threshold, resolution) in thresholds.into_iter().zip([9, 4, 4, 3]) {
            let sampling = Sampling { resolution, threshold, ..Sampling::PAPER };
            let cells = case.sampled(&sampling);
            let found = sampler.sample(&case.surface, &cells, &sampling, &progress).expect("samples");
            let least = Processor.sample(&case.surface, &cells, &sampling, &progress).expect("samples");
            // Largest effect of rounding. At each sample, the distance to the surface is at most
            // the distance from the centroid plus the radius.
            let slack = |c: &SampledCell| {
                let center = c.cell.centroid();
                let away = case.surface.triangles.iter().map(|t| t.closest(center).distance);
                2.0 * ROUNDING * (2.0 * c.cell.radius() + away.fold(f64::INFINITY, f64::min) + c.threshold)
            };
            let wide = |c: &SampledCell| SampledCell { threshold: c.threshold + slack(c), ..c.clone() };
            let wider: Vec<SampledCell> = cells.iter().map(wide).collect();
            let most = Processor.sample(&case.surface, &wider, &sampling, &progress).expect("samples");
            for (at, cell) in cells.iter().enumerate() {
                let slack = slack(cell);
                most_candidates = most_candidates.max(cell.faces.len());
                for (k, face) in cell.faces.iter().enumerate() {
                    let (found, least, most) = (found[at][k], least[at][k], most[at][k]);
                    let what =
                        || format!("{name}, {sampling:?}, cell {at}, face {face}: {most} {found} {least}");
                    // Each face that the processor lists is listed here too, at no greater
                    // distance.
                    assert!(found <= least, "{}", what());
                    assert!(found >= most - slack, "{}", what());
                    assert!(found.is_finite() || most.is_infinite() || least.is_infinite(), "{}", what());
                    if threshold == Threshold::Absolute(0.0) {
                        listed += usize::from(least.is_finite());
                        besides += usize::from(found.is_finite() && least.is_infinite());
                    }
                }
            }
        }
    }
    // A group processes 1024 candidates at a time, so this needs several turns.
    assert!(most_candidates > 2048, "{most_candidates} candidates at most");
    // Ties: among faces at equal distances, rounding selects some in `f64`, too.
    println!("{listed} entries, {besides} besides");
    assert!(listed > 1000 && besides < listed, "{listed} entries, {besides} besides");
}

pub fn sampled(sampling: Sampling, refinement: Refinement) -> EncodeOptions {
    EncodeOptions {
        method: Method::Sampled(sampling),
        refinement,
        byte_worth: 1.0,
        ..EncodeOptions::preset(Preset::Fast)
    }
}

/// Cubes in the form of an L, in a grid with an outer layer.
pub fn block() -> (SolidMesh, ConformingMesh) {
    let l = |x, y, z| z == 1 && (1..3).contains(&x) && (y == 1 || (x < 2 && y == 2));
    let (solid, tetrahedra) = grid(4, 0.15, l);
    let conforming = ConformingMesh::new(&solid, &tetrahedra).expect("conforming by construction");
    (solid, conforming)
}

pub fn lists(asset: &TeSdf) -> Vec<Vec<u32>> {
    let mut lists = Vec::new();
    asset.visit_cells(|cell| lists.push(asset.list_of(cell.id)));
    lists
}

#[test]
fn a_whole_asset_in_both_domains() {
    let device = device();
    let (solid, conforming) = block();
    let sampling = Sampling { resolution: 7, ..Sampling::PAPER };
    for domain in [Domain::Bisection, Domain::Conforming(&conforming)] {
        let options = sampled(sampling, Refinement::ByCost);
        let sampler = DeviceSampler::new(device.clone());
        let encoder = Encoder::new().options(options.clone()).domain(domain);
        let asset = encoder.clone().sampler(&sampler).encode(&solid).expect("encodes");
        let expected = encoder.encode(&solid).expect("encodes");
        let (lists, expected_lists) = (lists(&asset), lists(&expected));
        assert_eq!(lists.len(), expected_lists.len());
        for (list, expected) in lists.iter().zip(&expected_lists) {
            assert!(expected.iter().all(|face| list.contains(face)), "{expected:?} are not all in {list:?}");
        }
        let said = |asset: &TeSdf| asset.about().certificate().encoder().to_string();
        assert_eq!(said(&asset), format!("sampled, f32, {}", device.info().kind));
        assert_eq!(said(&expected), "sampled");
        assert_eq!(asset.about().certificate().delta(), None);

        let again = encoder.clone().sampler(&sampler).encode(&solid).expect("encodes");
        assert!(asset.as_bytes() == again.as_bytes(), "two runs differ");
        let limits = SamplerLimits { candidates: 30, distances: 100_000 };
        let bit_by_bit = DeviceSampler::with_limits(device.clone(), limits);
        let again = encoder.sampler(&bit_by_bit).encode(&solid).expect("encodes");
        assert!(asset.as_bytes() == again.as_bytes(), "small batches differ");

        let cut = EncodeOptions { max_entries: Some(6), refinement: Refinement::ByCost, ..options };
        let cut =
            Encoder::new().options(cut).domain(domain).sampler(&sampler).encode(&solid).expect("encodes");
        let certificate = cut.about().certificate();
        assert!(certificate.truncated() && certificate.exactness_distance() > Some(0.0), "{certificate:?}");
        // Faces that pass through a cell of the bisection domain are always listed.
        if let Domain::Conforming(_) = domain {
            assert_eq!(cut.about().statistics.longest_list, 6);
        }
    }
}

#[test]
fn a_threshold_as_wide_as_the_grid_misses_nothing() {
    let (solid, conforming) = block();
    let options = sampled(Sampling { resolution: 3, ..Sampling::SAFE }, Refinement::None);
    let domain = Domain::Conforming(&conforming);
    let sampler = DeviceSampler::new(device());
    let asset =
        Encoder::new().options(options).domain(domain).sampler(&sampler).encode(&solid).expect("encodes");
    assert!(asset.about().certificate().delta().is_some());
    let go_on = |_| ControlFlow::Continue(());
    let report = verify(&asset, &VerifyOptions { samples: 3000, seed: 1 }, go_on).expect("a valid mesh");
    assert!(report.passed, "{report:#?}");
}

#[test]
fn sampling_can_be_cancelled() {
    let case = Case::new("tetra");
    let sampling = Sampling { resolution: 3, ..Sampling::PAPER };
    let progress = Progress::default();
    progress.cancel();
    let stopped =
        DeviceSampler::new(device()).sample(&case.surface, &case.sampled(&sampling), &sampling, &progress);
    assert!(matches!(stopped, Err(EncodeError::Cancelled)), "{stopped:?}");
}
