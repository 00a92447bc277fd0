//! Places with a negative winding number are found wherever on a face they are, and they count as
//! outside.

use crate::support::parts::{Parts, Turn};
use crate::support::random::Random;
use proptest::prelude::*;
use tesdf::TeSdf;
use tesdf::encode::{EncodeOptions, Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf::mesh::{
    CheckReport, DefectKind, RepairOptions, Severity, SolidMesh, TriangleMesh, WindingNumber, check,
};
use tesdf::query::Precision;
use tesdf::verify::{VerifyOptions, verify};

/// Faces of a tetrahedron with positive volume, oriented outward.
const OUTWARD: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

/// A unit cube containing an inverted tetrahedron whose apex is `height` above the lid of the cube.
fn pierced(height: f64) -> TriangleMesh {
    let corners = [
        DVec3::new(0.6, 0.6, 0.3),
        DVec3::new(0.9, 0.6, 0.3),
        DVec3::new(0.7, 0.9, 0.3),
        DVec3::new(0.77, 0.7, 1.0 + height),
    ];
    Parts::default().cube(DVec3::ZERO, 1.0, Turn::Outward).add(&corners, &OUTWARD, Turn::Inward).mesh()
}

fn negative(report: &CheckReport) -> Vec<(Severity, DVec3)> {
    let defects = report.defects.iter().filter(|d| d.kind == DefectKind::NegativeWinding);
    defects.map(|d| (d.severity, DVec3::from_array(d.place))).collect()
}

/// No face has its centroid near the tip, so centroids alone are not enough.
#[test]
fn a_tip_through_a_face_is_found_away_from_all_centres() {
    for height in [0.3, 1e-3, 1e-6, 1e-9, 1e-12] {
        let report = check(&pierced(height));
        assert_eq!((report.winding, report.encodable), (Some([-1, 1]), true), "{height}: {report}");
        let places = negative(&report);
        assert!(!places.is_empty() && places.iter().all(|(s, _)| *s == Severity::Warning), "{report}");
        for (_, place) in places {
            assert!((1.0 - 1e-12..1.0 + height).contains(&place.z), "{height}: {place}");
        }
        assert!(!report.is_simple());
    }
    let below = check(&pierced(-1e-12));
    assert_eq!(below.winding, Some([0, 1]), "{below}");
    assert!(negative(&below).is_empty());
}

/// Compares points near faces, vertices and places of negative winding number with all faces and
/// exact winding numbers.
fn assert_exact(mesh: &TriangleMesh, asset: &TeSdf) {
    let options = VerifyOptions { samples: 3000, ..VerifyOptions::default() };
    let report = verify(asset, &options, |_| std::ops::ControlFlow::Continue(())).expect("it ran to its end");
    assert!(report.passed, "{report:?}");
    let (winding, bounds) = (WindingNumber::new(mesh), mesh.bounds());
    let (_, inside_out) = negative(&check(mesh))[0];
    let mut random = Random(7);
    let mut below_zero = 0;
    for k in 0..4000 {
        let p = match k % 2 {
            0 => bounds.center() + 0.55 * bounds.extent() * random.in_cube(),
            _ => inside_out + 0.1 * bounds.extent() * random.in_cube(),
        };
        let w = WindingNumber::brute_force(mesh, p);
        assert_eq!(winding.at(p), w, "{p}");
        below_zero += usize::from(w < 0);
        let distance = (0..mesh.faces().len())
            .map(|f| tesdf::geometry::Triangle::new(mesh.triangle(f)).closest(p).distance)
            .fold(f64::INFINITY, f64::min);
        let expected = if w >= 1 { -distance } else { distance };
        for (precision, tolerance) in [(Precision::F32, 1e-6), (Precision::F64, 1e-12)] {
            let found = asset.query_with(p, precision).signed_distance;
            let beside = distance <= tolerance * mesh.diagonal();
            let error = if beside { found.abs() - distance } else { found - expected };
            assert!(
                error.abs() <= tolerance * mesh.diagonal(),
                "{p}: {found}, expected {expected}, winding {w}"
            );
        }
        assert_eq!(asset.is_inside(p), w >= 1, "{p}");
    }
    assert!(below_zero > 20, "{below_zero} points with a negative winding number");
}

/// Places with a negative winding number are outside, and their distance is that of brute force.
#[test]
fn regions_of_negative_winding_number_are_outside() {
    let folded = {
        // A cube whose lid is a fan around a vertex beyond one side of it, below the lid.
        let cube = Parts::default().cube(DVec3::ZERO, 1.0, Turn::Outward);
        let lid = |f: &[u32; 3]| !f.iter().all(|&v| v >= 4);
        let faces: Vec<[u32; 3]> = cube.faces.iter().copied().filter(lid).collect();
        let fan = [[4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]];
        let apex = DVec3::new(1.6, 0.5, 0.4);
        let faces: Vec<[u32; 3]> = faces.into_iter().chain(fan).collect();
        Parts::default().add(&[&cube.vertices[..], &[apex]].concat(), &faces, Turn::Outward).mesh()
    };
    for mesh in [pierced(0.4), folded] {
        let solid = SolidMesh::new(mesh.clone()).expect("places that are inside out are a warning");
        let warned = solid.warnings().iter().any(|d| d.kind == DefectKind::NegativeWinding);
        assert!(warned, "{:?}", solid.warnings());
        for options in [EncodeOptions::preset(Preset::Fast), EncodeOptions::preset(Preset::Compact)] {
            let asset = Encoder::new().options(options).encode(&solid).unwrap();
            assert_exact(&mesh, &asset);
        }
    }
}

#[test]
fn a_mesh_that_is_all_inside_out_stays_an_error() {
    let cube = Parts::default().cube(DVec3::ZERO, 1.0, Turn::Outward).mesh();
    let faces = cube.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
    let inverted = TriangleMesh::new(cube.vertices().to_vec(), faces).unwrap();
    let report = check(&inverted);
    assert_eq!((report.winding, report.encodable), (Some([-1, 0]), false));
    let refusal = SolidMesh::new(inverted).unwrap_err();
    assert!(
        refusal.suggestion() == Some(&RepairOptions::DEFAULT) && refusal.to_string().contains("inside out"),
        "{refusal}"
    );
}

/// The same tetrahedron once or twice on the same faces: the jumps of coinciding faces add up.
#[test]
fn coincident_faces_count_together() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let turned = |turns: &[Turn]| {
        turns.iter().fold(Parts::default(), |parts, &turn| parts.add(&corners, &OUTWARD, turn)).mesh()
    };
    assert_eq!(check(&turned(&[Turn::Outward, Turn::Outward])).winding, Some([0, 2]));
    assert_eq!(check(&turned(&[Turn::Outward, Turn::Inward])).winding, Some([0, 0]));
    assert_eq!(check(&turned(&[Turn::Outward, Turn::Inward, Turn::Inward])).winding, Some([-1, 0]));
    // A smaller face inside a larger coplanar face.
    let half = corners.map(|p| DVec3::new(0.2, 0.2, 0.0) + 0.5 * p);
    let tetrahedron = || Parts::default().add(&corners, &OUTWARD, Turn::Outward);
    let within = tetrahedron().add(&half, &OUTWARD, Turn::Inward).mesh();
    let mirrored = half.map(|p| DVec3::new(p.x, p.y, -p.z));
    let beside = tetrahedron().add(&mirrored, &OUTWARD, Turn::Outward).mesh();
    assert_eq!(check(&within).winding, Some([0, 1]));
    assert_eq!(check(&beside).winding, Some([-1, 1]));
}

/// Range of the winding numbers on a fine grid between lattice points, from all faces.
fn on_a_grid(mesh: &TriangleMesh) -> [i32; 2] {
    let bounds = mesh.bounds();
    let steps = 23;
    let mut range = [0, 0];
    for k in 0..steps * steps * steps {
        let at = DVec3::new((k % steps).into(), (k / steps % steps).into(), (k / steps / steps).into());
        // Off the lattice, so that no point is on a face.
        let p = bounds.min + bounds.extent() * (at + DVec3::new(0.513, 0.487, 0.507)) / f64::from(steps);
        let w = WindingNumber::brute_force(mesh, p);
        range = [range[0].min(w), range[1].max(w)];
    }
    range
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// Boundaries of random tetrahedra of either orientation. `check` finds at least the range that
    /// a grid of points finds, and where it reports a negative winding number there is one.
    #[test]
    fn every_winding_number_of_a_grid_is_in_the_range(
        tetrahedra in prop::collection::vec(prop::array::uniform4(prop::array::uniform3(0i32..7)), 1..5),
        shift in prop::bool::ANY,
    ) {
        let origin = if shift { DVec3::splat(1000.0) } else { DVec3::ZERO };
        let mut shells = Parts::default();
        for corners in tetrahedra {
            let corners = corners.map(|c| origin + DVec3::new(c[0].into(), c[1].into(), c[2].into()));
            shells = shells.add(&corners, &OUTWARD, Turn::Outward);
        }
        let mesh = shells.mesh();
        let report = check(&mesh);
        prop_assume!(report.diagonal > 0.0);
        let Some([least, greatest]) = report.winding else { panic!("{report}") };
        let [low, high] = on_a_grid(&mesh);
        prop_assert!(least <= low && greatest >= high, "{least} {greatest}, on the grid {low} {high}: {report}");
        let winding = WindingNumber::new(&mesh);
        for (_, place) in negative(&report) {
            let mut random = Random(3);
            // The smallest cell between tetrahedra on this lattice is larger than 1e-4.
            let around = (0..4000).map(|k| place + [1e-3, 1e-5][k % 2] * random.in_cube());
            prop_assert!(around.into_iter().any(|p| winding.at(p) < 0), "no negative winding number at {place}");
        }
    }
}

/// Two sheets 2.5e-43 apart. Rounding moves a place on one sheet beyond the other, which used to
/// look like an inside.
#[test]
fn a_solid_inside_out_with_sheets_nearer_than_rounding() {
    let vertices = [
        (0.0, 0.0, 0.0),
        (1e-5, -0.9, -0.9),
        (0.0, 1.0, 0.0),
        (1.0, 1.0, 0.0),
        (0.0, 0.0, 1.0),
        (1.0, 0.0, 1.0),
        (-0.25, 0.25, 0.0),
        (-0.25, -0.25, -2.5e-43),
    ];
    let squares = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = squares.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let mesh = TriangleMesh::new(vertices.map(DVec3::from).to_vec(), faces).expect("valid ids");
    let report = check(&mesh);
    assert!(report.of_severity(Severity::Error).any(|d| d.kind == DefectKind::NoInside), "{report:?}");
}
