//! The repair that finds its own options.
use crate::support::meshes::load;
use proptest::prelude::*;
use tesdf::{
    base::Inside,
    glam::DVec3,
    mesh::{
        RepairMode, RepairOptions, ShellOrientation, SolidMesh, Topology, TriangleMesh, closing_tolerance,
        repair, repair_auto,
    },
};

/// The flags that make a mesh encodable; `None` when none do.
fn flags(mesh: &TriangleMesh) -> Option<String> {
    let found = repair_auto(mesh).unwrap_or_else(|e| panic!("{e}"))?;
    assert!(found.repaired.report.encodable, "{}", found.repaired.report);
    if let Some(options) = found.options {
        assert_eq!(repair(mesh, &options).unwrap(), found.repaired, "the options give the same mesh");
    } else {
        assert_eq!(found.repaired.mesh, *mesh);
    }
    Some(found.options.map_or("as it is".into(), |options| options.to_string()))
}

#[test]
fn the_first_repair_that_works_is_taken() {
    for (name, expected) in [
        ("cavity.obj", Some("as it is")),
        ("two_boxes_overlap.obj", Some("as it is")),
        ("mixed_winding.obj", Some("")),
        ("t_junction.obj", Some("")),
        ("duplicate_faces.obj", Some("")),
        ("soup_jitter.obj", Some(" --weld-tolerance 6.9e-9")),
        ("t_junction_gap.obj", Some(" --weld-tolerance 3.5e-6")),
        ("open_holes.obj", Some(" --fill-holes")),
        ("open_half.obj", Some(" --fill-holes")),
        ("internal_fin.obj", Some(" --fill-holes")),
    ] {
        assert_eq!(flags(&load(name)).as_deref(), expected, "{name}");
    }
}

#[test]
fn a_refusal_names_the_options_that_work() {
    let refusal = SolidMesh::new(load("open_half.obj")).unwrap_err();
    let options = RepairOptions { fill_holes: Some(u32::MAX), ..RepairOptions::DEFAULT };
    assert_eq!(refusal.suggestion(), Some(&options));
    let text = refusal.to_string();
    assert!(text.contains(". The repair `auto` makes it encodable"), "{text}");
    let (solid, changes) =
        SolidMesh::with_repair(load("open_half.obj"), Inside::default(), RepairMode::Auto).unwrap();
    assert_eq!(changes.unwrap().options, Some(options));
    assert!(solid.is_simple());
    assert!(
        SolidMesh::with_repair(load("cavity.obj"), Inside::default(), RepairMode::Auto).unwrap().1.is_none()
    );
}

/// A sheet is no solid with a hole, bent or flat.
#[test]
fn sheets_are_not_filled() {
    let n = 6;
    let bent = |v: u32, height: f64| {
        let (x, y) = (f64::from(v % n), f64::from(v / n));
        DVec3::new(x, y, height * (0.5 * x).sin())
    };
    let square = |k: u32| {
        let a = k / (n - 1) * n + k % (n - 1);
        [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]
    };
    for height in [0.0, 0.3] {
        let vertices = (0..n * n).map(|v| bent(v, height)).collect();
        let sheet = TriangleMesh::new(vertices, (0..(n - 1) * (n - 1)).flat_map(square).collect()).unwrap();
        assert_eq!(flags(&sheet), None, "height {height}");
        let refusal = SolidMesh::with_repair(sheet, Inside::default(), RepairMode::Auto).unwrap_err();
        assert!(
            refusal.suggestion().is_none() && refusal.to_string().contains("No repair makes it encodable")
        );
    }
}

#[test]
fn all_shells_inside_out_that_meet_are_turned() {
    let mesh = load("two_boxes_overlap.obj");
    let faces = mesh.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
    let inverted = TriangleMesh::new(mesh.vertices().to_vec(), faces).unwrap();
    assert_eq!(flags(&inverted).as_deref(), Some(" --orient"));
    let options = repair_auto(&inverted).unwrap().unwrap().options.unwrap();
    assert_eq!(options.shells, ShellOrientation::All);
}

#[test]
fn modes_are_named() {
    assert_eq!(("auto".parse(), "never".parse()), (Ok(RepairMode::Auto), Ok(RepairMode::Never)));
    let unknown = "always".parse::<RepairMode>().unwrap_err();
    assert_eq!(unknown.to_string(), "repair = 'always'; expected 'auto' or 'never'");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    /// Each face has corners of its own, which are moved by up to a share of the diagonal. The
    /// tolerance that is found closes all cracks, and is no more than some times the width of the
    /// widest one.
    #[test]
    fn the_weld_tolerance_fits_the_cracks(
        exponent in -6.5f64..-4.6, moves in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 60),
    ) {
        let whole = load("mixed_winding.obj");
        let fixed = repair(&whole, &RepairOptions::DEFAULT).unwrap().mesh;
        let width = 10f64.powf(exponent) * fixed.diagonal();
        let mut vertices = Vec::new();
        let faces = (0..fixed.faces().len()).map(|f| {
            [0, 1, 2].map(|k| {
                let n = vertices.len();
                let shift = 0.28 * width * DVec3::from_array(moves[(7 * n) % moves.len()]);
                vertices.push(fixed.triangle(f)[k] + shift);
                n as u32
            })
        });
        let faces = faces.collect();
        let torn = TriangleMesh::new(vertices, faces).unwrap();
        let tolerance = closing_tolerance(&torn).expect("cracks are narrower than the largest tolerance");
        prop_assert!(tolerance <= 3.5 * width.max(1e-7 * torn.diagonal()), "{tolerance:e} for {width:e}");
        let options = RepairOptions { weld_tolerance: Some(tolerance), ..RepairOptions::DEFAULT };
        let welded = repair(&torn, &options).unwrap();
        prop_assert!(welded.report.encodable, "{}", welded.report);
        // An edge may be split at a vertex that was not merged, but nothing is lost.
        prop_assert!(welded.mesh.faces().len() >= fixed.faces().len());
        prop_assert_eq!(closing_tolerance(&fixed), None);
    }

    /// For any faces, nothing panics, what is found is a solid, and it is found again.
    #[test]
    fn random_faces_never_panic(
        corners in prop::collection::vec(prop::array::uniform3(0i8..4), 3..12),
        faces in prop::collection::vec(prop::array::uniform3(0u32..12), 1..40),
    ) {
        let n = corners.len() as u32;
        let vertices = corners.iter().map(|c| DVec3::from_array(c.map(f64::from))).collect();
        let faces: Vec<[u32; 3]> = faces.iter().map(|f| f.map(|v| v % n)).collect();
        let mesh = TriangleMesh::new(vertices, faces).unwrap();
        for shells in [ShellOrientation::Separate, ShellOrientation::All] {
            let options = RepairOptions { fill_holes: Some(u32::MAX), shells, ..RepairOptions::DEFAULT };
            if let Ok(found) = repair(&mesh, &options) {
                let _ = found.report.to_string();
                let is_closed = Topology::new(found.mesh.faces()).is_closed();
                prop_assert!(is_closed || !found.report.holes_left.is_empty(), "{}", found.report);
                prop_assert_eq!(&repair(&mesh, &options).unwrap(), &found);
            }
        }
        if let Ok(Some(found)) = repair_auto(&mesh) {
            prop_assert!(SolidMesh::new(found.repaired.mesh).is_ok());
        }
    }
}

/// 100,000 triangles at random, each a hole of its own. The work is bounded.
#[test]
#[ignore = "long: .ci/release"]
fn a_soup_of_triangles_ends() {
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut vertices = Vec::new();
    for _ in 0..100_000 {
        let at = DVec3::new(random(), random(), random());
        vertices.extend((0..3).map(|_| at + 0.01 * DVec3::new(random(), random(), random())));
    }
    let faces = (0..100_000).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let soup = TriangleMesh::new(vertices, faces).unwrap();
    assert!(
        SolidMesh::with_repair(soup, Inside::default(), RepairMode::Auto).is_err(),
        "sheets are no solid"
    );
}
