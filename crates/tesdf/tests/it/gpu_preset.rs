//! The preset `gpu`: lists fill a group of 32 threads, and stay exact near the surface when they are
//! truncated to 32 faces.

use std::ops::ControlFlow;

use crate::support::rotation::of_the_day;
use crate::support::shapes::Shape;
use crate::support::tetrahedra::grid;
use tesdf::domain::ConformingMesh;
use tesdf::encode::{
    Domain, EncodeError, EncodeOptions, Encoder, Groups, Method, Preset, Refinement, Sampling,
};
use tesdf::glam::DVec3;
use tesdf::mesh::SolidMesh;
use tesdf::verify::{ProveOptions, VerifyOptions, prove, verify};
use tesdf::{Length, TeSdf};

fn encoded(solid: &SolidMesh, options: &EncodeOptions) -> TeSdf {
    Encoder::new().options(options.clone()).encode(solid).expect("valid options")
}

fn assert_verified(asset: &TeSdf) {
    let options = VerifyOptions { samples: 3000, seed: 3 };
    let report = verify(asset, &options, |_| ControlFlow::Continue(())).expect("a valid mesh");
    assert!(report.passed, "{report:#?}");
}

fn gpu() -> EncodeOptions {
    EncodeOptions::preset(Preset::Gpu)
}

/// The shaft of the paper's pile, which has fans of 60 faces.
fn shaft() -> SolidMesh {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/shaft_keyway.obj");
    SolidMesh::read(path).expect("a solid")
}

/// The lengths of the lists of cells that come nearer to the surface than a distance.
fn lists_within(asset: &TeSdf, distance: f64) -> Vec<usize> {
    let mut lengths = Vec::new();
    asset.visit_cells(|cell| {
        let middle = cell.corners.iter().sum::<DVec3>() / 4.0;
        let radius = cell.corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max);
        if cell.list_length > 0 && asset.signed_distance(middle).abs() - radius < distance {
            lengths.push(cell.list_length);
        }
    });
    lengths
}

#[test]
fn lists_near_the_surface_fill_a_group() {
    let solid = shaft();
    let [by_face, by_group] =
        [Preset::Default, Preset::Gpu].map(|preset| encoded(&solid, &EncodeOptions::preset(preset)));
    assert_verified(&by_group);
    let [many, few] = [&by_face, &by_group].map(|asset| asset.about().statistics.listed_cells);
    assert!(2 * few < many, "{few} cells instead of {many}");
    let within = 0.03 * solid.mesh().diagonal();
    let lists = lists_within(&by_group, within);
    let mean = |lists: &[usize]| lists.iter().sum::<usize>() as f64 / lists.len() as f64;
    let (filled, before) = (mean(&lists), mean(&lists_within(&by_face, within)));
    assert!(filled > 22.0 && before < 14.0, "{filled} instead of {before}");
    // Cells at the two fans cannot fit.
    let longer = lists.iter().filter(|&&length| length > 32).count();
    assert!(longer * 100 < lists.len(), "{longer} of {}", lists.len());
}

/// On a grid over the bounds, the least distance from the surface at which truncated lists are off by
/// more than a millionth of the diagonal, and the largest depth of a point.
fn exactness(cut: &TeSdf, full: &TeSdf, voxel: f64) -> (f64, f64) {
    let bounds = full.bounds();
    let counts = (bounds.extent() / voxel).ceil().as_uvec3();
    let (mut width, mut deepest) = (f64::INFINITY, 0.0f64);
    for z in 0..counts.z {
        for (y, x) in (0..counts.y).flat_map(|y| (0..counts.x).map(move |x| (y, x))) {
            let p = bounds.min + voxel * (DVec3::new(x.into(), y.into(), z.into()) + 0.5);
            let [found, exact] = [cut, full].map(|asset| asset.signed_distance(p));
            deepest = deepest.max(-exact);
            if (found - exact).abs() > 1e-6 * bounds.extent().length() {
                width = width.min(exact.abs());
            }
        }
    }
    (width.min(deepest), deepest)
}

#[test]
fn lists_of_32_faces_are_exact_farther_than_in_the_paper() {
    let solid = shaft();
    let diagonal = solid.mesh().diagonal();
    let cut = encoded(&solid, &EncodeOptions { max_entries: Some(32), ..gpu() });
    assert_verified(&cut);
    let certificate = cut.about().certificate();
    assert!(certificate.truncated());
    let promised = certificate.exactness_distance().expect("truncated");
    assert!(promised >= 0.03 * diagonal, "{promised}");
    let (width, deepest) = exactness(&cut, &encoded(&solid, &gpu()), diagonal / 64.0);
    // Table I: 0.105 in 6,111 tetrahedra.
    assert!(width > 0.3 * deepest && width >= promised, "{width} of {deepest}, promised {promised}");
    assert!(cut.about().statistics.listed_cells < 6111);
}

#[test]
fn any_group_is_proved_exact_and_truncated_as_promised() {
    let ball = Shape::default().add_sphere(DVec3::ZERO, 3, || 1.0).solid();
    let all = [(1, 0.0, 6), (4, 0.1, 4), (8, 0.02, 16), (32, 0.05, 8), (1000, 0.2, 32)];
    for (size, share, most) in of_the_day(all) {
        let groups = Some(Groups { size, fit_within: Length::OfDiagonal(share) });
        let options = EncodeOptions { groups, ..gpu() };
        let full = encoded(&ball, &options);
        assert_verified(&full);
        let report = prove(&full, &ProveOptions { pieces: 1 << 16 }, |_| ControlFlow::Continue(()));
        let report = report.expect("a closed mesh");
        assert!(report.proved, "groups of {size}: {report:#?}");
        let cut = encoded(&ball, &EncodeOptions { max_entries: Some(most), ..options });
        assert_verified(&cut);
        let within = cut.about().certificate().exactness_distance().unwrap_or(f64::INFINITY);
        assert!(within >= share * ball.mesh().diagonal(), "groups of {size}: {within}");
    }
}

#[test]
fn groups_fit_a_conforming_domain_and_samples() {
    let (solid, tetrahedra) = grid(6, 0.15, |x, y, z| [x, y, z].iter().all(|k| (1..4).contains(k)));
    let domain = ConformingMesh::new(&solid, &tetrahedra).expect("conforming by construction");
    let groups = Some(Groups { size: 4, fit_within: Length::OfDiagonal(0.1) });
    let safe = Method::Sampled(Sampling { resolution: 6, ..Sampling::SAFE });
    for refinement in [Refinement::None, Refinement::ByCost] {
        for method in [Method::Certified, safe] {
            for max_entries in [None, Some(5)] {
                let options = EncodeOptions { method, refinement, max_entries, groups, ..gpu() };
                let encoder = Encoder::new().options(options).domain(Domain::Conforming(&domain));
                let asset = encoder.encode(&solid).expect("valid options");
                assert_verified(&asset);
                let plain = asset.about().statistics.listed_cells == domain.tetrahedra().len();
                assert!(plain || refinement == Refinement::ByCost);
            }
        }
    }
}

#[test]
fn wrong_groups_are_refused_and_others_recorded() {
    let solid = Shape::default().add_box(DVec3::ZERO, DVec3::ONE, 1).solid();
    let with = |size, fit_within| EncodeOptions { groups: Some(Groups { size, fit_within }), ..gpu() };
    for (options, name) in [
        (with(0, Length::Absolute(0.1)), "groups.size"),
        (with(32, Length::Absolute(-0.1)), "groups.fit_within"),
        (with(32, Length::OfDiagonal(f64::NAN)), "groups.fit_within"),
    ] {
        let found = Encoder::new().options(options).encode(&solid).expect_err(name);
        assert!(matches!(found, EncodeError::Option { option, .. } if option == name), "{found}");
    }
    let asset = encoded(&solid, &gpu());
    let read = TeSdf::from_bytes(asset.as_bytes()).expect("its own bytes");
    assert_eq!(read.about().options.groups, Some(Groups::OF_A_GPU));
    // Assets without groups have the bytes that they had before groups were known.
    let text = String::from_utf8_lossy(encoded(&solid, &EncodeOptions::default()).as_bytes()).into_owned();
    assert!(text.contains("tighten_levels") && !text.contains("groups"));
}
