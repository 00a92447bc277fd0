//! Compares both encoders with brute force, in both domains, truncated and for deformation.

use std::collections::BTreeSet;
use std::ops::ControlFlow;

use crate::support::random::Random;
use crate::support::rotation::of_the_day;
use crate::support::shapes::Shape;
use crate::support::tetrahedra::grid;
use tesdf::asset::CellKind;
use tesdf::domain::ConformingMesh;
use tesdf::encode::{
    Deformation, Domain, EncodeError, EncodeOptions, Encoder, Method, Preset, Refinement, SampledCell,
    Sampler, Sampling, Surface, Threshold,
};
use tesdf::glam::DVec3;
use tesdf::mesh::SolidMesh;
use tesdf::query::Precision;
use tesdf::verify::{VerifyOptions, VerifyReport, verify};
use tesdf::{Progress, TeSdf};

fn encoded(solid: &SolidMesh, domain: Domain, options: &EncodeOptions) -> TeSdf {
    Encoder::new().options(options.clone()).domain(domain).encode(solid).expect("valid options")
}

fn verified(asset: &TeSdf) -> VerifyReport {
    verify(asset, &VerifyOptions { samples: 3000, seed: 1 }, |_| ControlFlow::Continue(()))
        .expect("a valid mesh")
}

/// An L of 4 by 3 cubes, two cubes thick, in a grid with an outer layer.
fn block() -> (SolidMesh, ConformingMesh) {
    let l =
        |x, y, z| (1..5).contains(&x) && (1..3).contains(&z) && ((1..3).contains(&y) || (x < 3 && y == 3));
    let (solid, tetrahedra) = grid(6, 0.15, l);
    let conforming = ConformingMesh::new(&solid, &tetrahedra).expect("conforming by construction");
    (solid, conforming)
}

fn fast() -> EncodeOptions {
    EncodeOptions { byte_worth: 0.02, ..EncodeOptions::preset(Preset::Fast) }
}

#[test]
fn a_conforming_domain_is_exact_plain_or_bisected() {
    let (solid, conforming) = block();
    for refinement in [Refinement::None, Refinement::ByCost] {
        let options = EncodeOptions { refinement, ..fast() };
        let asset = encoded(&solid, Domain::Conforming(&conforming), &options);
        let report = verified(&asset);
        assert!(report.passed, "{refinement:?}: {report:#?}");
        let statistics = &asset.about().statistics;
        let plain = statistics.listed_cells == conforming.tetrahedra().len();
        assert_eq!(plain, refinement == Refinement::None);
        assert_eq!((statistics.far_cells, statistics.outside_cells, statistics.crossing_cells), (0, 0, 0));
        assert_eq!(asset.classes(), Some(conforming.classes()));
        // The domain is exactly the grid.
        assert!((statistics.domain_volume - 216.0).abs() < 20.0);
        assert!(asset.query_in_domain(DVec3::splat(-1.0)).is_none());
        assert!(asset.query_in_domain(DVec3::splat(3.3)).is_some());

        let again = TeSdf::from_bytes(asset.as_bytes()).expect("what was written opens");
        let mut random = Random(5);
        let points: Vec<DVec3> = (0..2000).map(|_| 3.0 + 4.0 * random.in_cube()).collect();
        for precision in [Precision::F32, Precision::F64] {
            let batch = again.query_batch_with(&points, precision);
            let alone: Vec<_> = points.iter().map(|&p| asset.query_with(p, precision)).collect();
            assert_eq!(batch, alone);
        }
    }
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let (solid, conforming) = block();
    let sampled = Method::Sampled(Sampling { resolution: 4, ..Sampling::SAFE });
    for method in [Method::Certified, sampled] {
        let options = EncodeOptions { method, max_entries: Some(12), ..fast() };
        for domain in [Domain::Bisection, Domain::Conforming(&conforming)] {
            let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
            let alone = one.install(|| encoded(&solid, domain, &options));
            assert_eq!(alone.as_bytes(), encoded(&solid, domain, &options).as_bytes());
        }
    }
}

#[test]
fn sampling_with_a_threshold_as_wide_as_the_grid_misses_nothing() {
    let (solid, conforming) = block();
    for resolution in [2, 5] {
        let sampling = Sampling { resolution, ..Sampling::SAFE };
        for domain in [Domain::Bisection, Domain::Conforming(&conforming)] {
            let options = EncodeOptions { method: Method::Sampled(sampling), ..fast() };
            let asset = encoded(&solid, domain, &options);
            let report = verified(&asset);
            assert!(report.passed && report.precisions[1].largest_error_beyond.is_none(), "{report:#?}");
            assert!(asset.about().certificate().delta().is_some());
        }
    }
}

/// Returns one face for each cell, whatever is asked.
struct OneFace;

impl Sampler for OneFace {
    fn name(&self) -> String {
        "sampled, one face".into()
    }

    fn sample(
        &self,
        _: &Surface,
        cells: &[SampledCell],
        _: &Sampling,
        _: &Progress,
    ) -> Result<Vec<Vec<f64>>, EncodeError> {
        let only_first = |cell: &SampledCell| {
            (0..cell.faces.len()).map(|at| if at == 0 { 0.0 } else { f64::INFINITY }).collect()
        };
        Ok(cells.iter().map(only_first).collect())
    }
}

#[test]
fn sampled_lists_are_never_certified() {
    let (solid, conforming) = block();
    let domains = [Domain::Bisection, Domain::Conforming(&conforming)];
    for (most, domain) in
        of_the_day([None, Some(3)].into_iter().flat_map(|most| domains.map(|domain| (most, domain))))
    {
        let method = Method::Sampled(Sampling { resolution: 3, ..Sampling::SAFE });
        let options = EncodeOptions { method, max_entries: most, ..fast() };
        let encoder = Encoder::new().options(options).domain(domain);
        let asset = encoder.sampler(&OneFace).encode(&solid).expect("encodes");
        let certificate = asset.about().certificate();
        assert_eq!((certificate.delta(), certificate.chains()), (None, None), "{certificate:?}");
    }
}

#[test]
fn the_papers_sampling_misses_faces_where_the_grid_is_coarse() {
    let (solid, conforming) = block();
    let plain = |method| EncodeOptions { method, refinement: Refinement::None, ..fast() };
    let certified = encoded(&solid, Domain::Conforming(&conforming), &plain(Method::Certified));
    let mut misses = Vec::new();
    for resolution in [1, 4, 16] {
        let sampling = Sampling { resolution, ..Sampling::PAPER };
        let asset = encoded(&solid, Domain::Conforming(&conforming), &plain(Method::Sampled(sampling)));
        let report = verified(&asset);
        assert!(asset.about().certificate().delta().is_none(), "nothing is promised");
        let wrong = report.precisions.iter().map(|p| p.distance_mistakes).sum::<usize>();
        assert_eq!(report.passed, wrong == 0, "what is wrong does not pass: {report:#?}");
        misses.push(report.precisions[1].largest_error_beyond.expect("nothing is promised"));
        // A sample is a point of the cell. The face closest to it is in the certified list, or as
        // close as a face of that list.
        assert!(asset.about().statistics.entries <= certified.about().statistics.entries * 12 / 10);
    }
    assert!(misses[0] > 1e-3 && misses[2] < 0.2 * misses[0], "{misses:?}");
}

#[test]
fn a_truncated_asset_is_exact_up_to_its_exactness_distance() {
    let (solid, conforming) = block();
    let ball = Shape::default().add_sphere(DVec3::ZERO, 3, || 1.0).solid();
    let safe = Method::Sampled(Sampling { resolution: 6, ..Sampling::SAFE });
    for (solid, domain, most) in [
        (&solid, Domain::Conforming(&conforming), 16),
        (&solid, Domain::Bisection, 10),
        (&ball, Domain::Bisection, 24),
    ] {
        for method in [Method::Certified, safe] {
            let options = EncodeOptions { method, max_entries: Some(most), ..fast() };
            let asset = encoded(solid, domain, &options);
            let certificate = asset.about().certificate();
            assert!(certificate.truncated());
            let report = verified(&asset);
            assert!(report.passed, "{method:?}: {report:#?}");
            let beyond = report.precisions[1].largest_error_beyond;
            if method == Method::Certified {
                let within = certificate.exactness_distance().expect("it is truncated");
                assert!(within > 0.0, "the nearest faces are kept");
                let points: usize = report.precisions[1].classes.iter().map(|c| c.points).sum();
                assert!((100..3000).contains(&points), "{points} points nearer than {within}");
            }
            assert!(beyond.is_some_and(|beyond| beyond > 0.0), "{beyond:?}: truncation costs something");
            asset.visit_cells(|cell| {
                let free = cell.kind != CellKind::Crossing;
                assert!(!free || cell.list_length <= most as usize, "{cell:?}");
            });
        }
    }
}

#[test]
fn lists_for_deformation_name_all_faces_around_surface_vertices() {
    let (solid, conforming) = block();
    let rigid = EncodeOptions { refinement: Refinement::None, ..fast() };
    let options = EncodeOptions { deformation: Deformation::Expected, ..rigid.clone() };
    let rigid = encoded(&solid, Domain::Conforming(&conforming), &rigid);
    let asset = encoded(&solid, Domain::Conforming(&conforming), &options);
    assert!(verified(&asset).passed);
    let surface = solid.mesh().vertices().len() as u32;
    let mut longer = 0;
    for (cell, corners) in conforming.tetrahedra().iter().enumerate() {
        let around = |face: &[u32; 3]| face.iter().any(|v| *v < surface && corners.contains(v));
        let faces = (0_u32..).zip(solid.mesh().faces());
        let wanted: BTreeSet<u32> = faces.filter(|(_, f)| around(f)).map(|(id, _)| id).collect();
        let listed: BTreeSet<u32> = asset.list_of(cell as u32).into_iter().collect();
        assert!(wanted.is_subset(&listed), "tetrahedron {cell}: {wanted:?} of {listed:?}");
        longer += usize::from(listed.len() > rigid.list_of(cell as u32).len());
    }
    assert!(longer > 50);
}

#[test]
fn invalid_combinations_of_options_are_errors() {
    let (solid, conforming) = block();
    let refused = |domain, options: EncodeOptions| match Encoder::new()
        .options(options)
        .domain(domain)
        .encode(&solid)
    {
        Err(EncodeError::Option { option, .. }) => option,
        other => panic!("{:?}", other.map(|_| ())),
    };
    let sampled = |resolution, shrink, threshold| EncodeOptions {
        method: Method::Sampled(Sampling { resolution, shrink, threshold }),
        ..fast()
    };
    let zero = Threshold::Absolute(0.0);
    let expected = EncodeOptions { deformation: Deformation::Expected, ..fast() };
    assert_eq!(refused(Domain::Bisection, expected), "deformation");
    assert_eq!(
        refused(Domain::Bisection, EncodeOptions { refinement: Refinement::None, ..fast() }),
        "refinement"
    );
    let conforming = Domain::Conforming(&conforming);
    assert_eq!(refused(conforming, EncodeOptions { max_entries: Some(0), ..fast() }), "max_entries");
    assert_eq!(refused(conforming, sampled(0, 0.999, zero)), "resolution");
    for shrink in [1.5, 0.0, -0.5, f64::NAN] {
        assert_eq!(refused(conforming, sampled(8, shrink, zero)), "shrink");
    }
    for number in [f64::NAN, f64::INFINITY, -1e-300] {
        for threshold in [Threshold::Absolute(number), Threshold::Squared(number)] {
            assert_eq!(refused(conforming, sampled(8, 0.999, threshold)), "threshold");
        }
    }
}
