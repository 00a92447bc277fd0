//! Compares bands and largest errors with a direct loop over all points of the grid and all faces.

use crate::tetrahedra::grid;
use tesdf::TeSdf;
use tesdf::domain::ConformingMesh;
use tesdf::encode::{Domain, EncodeOptions, Encoder, Method, Refinement, Sampling, Threshold};
use tesdf::geometry::Triangle;
use tesdf::mesh::{SolidMesh, WindingNumber, read};
use tesdf_lab::on_grid::{BandReport, Grid, compare};

fn data(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/procedural").join(name)
}

fn solid(name: &str) -> SolidMesh {
    SolidMesh::new(read(data(name)).unwrap().mesh).unwrap()
}

fn encoded(solid: &SolidMesh, domain: Domain, options: &EncodeOptions) -> TeSdf {
    Encoder::new().options(options.clone()).domain(domain).encode(solid).unwrap()
}

/// An L of cubes with six tetrahedra each, and a layer around it.
fn block() -> (SolidMesh, ConformingMesh) {
    let l =
        |x, y, z| (1..5).contains(&x) && (1..3).contains(&z) && ((1..3).contains(&y) || (x < 3 && y == 3));
    let (solid, tetrahedra) = grid(6, 0.15, l);
    let conforming = ConformingMesh::new(&solid, &tetrahedra).unwrap();
    (solid, conforming)
}

/// Distance from the surface and error at each point of the domain, from all faces.
fn direct(solid: &SolidMesh, asset: &TeSdf, grid: &Grid) -> Vec<(f64, f64)> {
    let mesh = solid.mesh();
    let triangles: Vec<Triangle> = (0..mesh.faces().len()).map(|f| Triangle::new(mesh.triangle(f))).collect();
    let mut found = Vec::new();
    for z in 0..grid.counts[2] {
        for (y, x) in (0..grid.counts[1]).flat_map(|y| (0..grid.counts[0]).map(move |x| (y, x))) {
            let p = grid.point([x, y, z]);
            if let Some(answer) = asset.query_in_domain(p) {
                let d = triangles.iter().map(|t| t.closest(p).distance).fold(f64::INFINITY, f64::min);
                let inside = WindingNumber::brute_force(mesh, p) >= 1;
                let exact = if inside { -d } else { d };
                found.push((exact, (answer.signed_distance - exact).abs()));
            }
        }
    }
    found
}

fn agrees(report: &BandReport, solid: &SolidMesh, asset: &TeSdf, grid: &Grid) {
    let found = direct(solid, asset, grid);
    let diagonal = solid.mesh().diagonal();
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * diagonal;
    assert_eq!(report.points, found.len() as u64);
    assert_eq!(report.points + report.points_outside, grid.len());
    assert_eq!(report.points_inside, found.iter().filter(|f| f.0 < 0.0).count() as u64);
    let inside = found.iter().map(|f| -f.0).fold(0.0, f64::max);
    let domain = found.iter().map(|f| f.0.abs()).fold(0.0, f64::max);
    let error = found.iter().map(|f| f.1).fold(0.0, f64::max);
    assert!(near(report.max_inside, inside) && near(report.max_domain, domain), "{report:?}");
    assert!(near(report.max_error, error), "{report:?} {error}");
    assert!((report.max_error_percent.unwrap() - 100.0 * error / inside).abs() < 1e-8);
    let least =
        |bound: f64| found.iter().filter(|f| f.1 > bound).map(|f| f.0.abs()).fold(inside, f64::min) / inside;
    assert!((report.exactness_band.unwrap() - least(1e-6 * diagonal)).abs() < 1e-9, "{report:?}");
    assert!((report.one_percent_band.unwrap() - least(0.01 * inside)).abs() < 1e-9, "{report:?}");
    let inexact = found.iter().filter(|f| f.1 > 1e-6 * diagonal).count() as u64;
    assert_eq!(report.points_inexact, inexact);
    assert_eq!(report.cells_inexact > 0, inexact > 0);
}

#[test]
fn errors_of_full_and_truncated_lists_equal_a_direct_loop() {
    let solid = solid("l_bracket.obj");
    let options = EncodeOptions { byte_worth: 2.0, tighten_levels: 2, ..EncodeOptions::default() };
    let cut = EncodeOptions { max_entries: Some(3), ..options.clone() };
    let [full, cut] = [options, cut].map(|o| encoded(&solid, Domain::Bisection, &o));
    let reports = compare(&[&full, &cut], 24, |_| {}).unwrap();
    let grid = Grid::of(&[&full, &cut], 24);
    assert!((grid.voxel - solid.mesh().diagonal() / 24.0).abs() < 1e-15);
    agrees(&reports[0], &solid, &full, &grid);
    agrees(&reports[1], &solid, &cut, &grid);
    assert_eq!((reports[0].exactness_band, reports[0].one_percent_band), (Some(1.0), Some(1.0)));
    assert!(reports[0].max_error <= 1e-6 * solid.mesh().diagonal());
    assert!(reports[1].exactness_band < Some(1.0), "{:?}", reports[1]);
    assert!(reports[1].exactness_band <= reports[1].one_percent_band);
    // The certificate's distance is a lower bound of the band's width.
    let promised = cut.about().certificate().exactness_distance().unwrap();
    assert!(reports[1].exactness_width >= promised, "{promised} {:?}", reports[1]);
    // One asset alone gives the same report as several together.
    assert_eq!(compare(&[&cut], 24, |_| {}).unwrap(), reports[1..]);
}

#[test]
fn errors_of_sampled_lists_in_a_conforming_domain_equal_a_direct_loop() {
    let (solid, domain) = block();
    let coarse = Sampling { resolution: 1, shrink: 0.5, threshold: Threshold::Absolute(0.0) };
    let sampled = EncodeOptions { method: Method::Sampled(coarse), ..EncodeOptions::PAPER };
    let certified = EncodeOptions { refinement: Refinement::None, ..EncodeOptions::default() };
    let cut = EncodeOptions { max_entries: Some(8), ..certified.clone() };
    let assets = [sampled, certified, cut].map(|o| encoded(&solid, Domain::Conforming(&domain), &o));
    let all: Vec<&TeSdf> = assets.iter().collect();
    let reports = compare(&all, 24, |_| {}).unwrap();
    let points = Grid::of(&all, 24);
    reports.iter().zip(&assets).for_each(|(report, asset)| agrees(report, &solid, asset, &points));
    assert!(reports[0].cells_inexact > 10, "{:?}", reports[0]);
    assert_eq!((reports[1].cells_inexact, reports[1].exactness_band), (0, Some(1.0)));
    assert!(reports[2].exactness_band < Some(1.0), "{:?}", reports[2]);
    assert_eq!(reports[0].points_by_tree, 0);
    // One thread gives the same reports.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one.install(|| compare(&all, 24, |_| {})).unwrap(), reports);
}
