//! The defects that `check` finds and the meshes that `SolidMesh` accepts, for every readable file
//! of `data/bad`.
use std::collections::BTreeMap;

use crate::support::meshes::{bad, load};
use tesdf::glam::DVec3;
use tesdf::mesh::{
    CheckReport, Defect, DefectKind, RepairOptions, Severity, SolidMesh, TriangleMesh, check, read,
};

use DefectKind::*;

/// Kinds and numbers of the defects of each readable file. Files without an entry have none.
const FOUND: &[(&str, &[(DefectKind, usize)])] = &[
    ("open_holes.obj", &[(OpenEdge, 9), (NonManifoldVertex, 1)]),
    ("open_half.obj", &[(OpenEdge, 24)]),
    ("flipped_all.obj", &[(NegativeWinding, 1), (NoInside, 1)]),
    ("mixed_winding.obj", &[(InconsistentOrientation, 10)]),
    ("duplicate_faces.obj", &[(NonManifoldEdge, 9), (DuplicateFace, 3)]),
    ("duplicate_face_reversed.obj", &[(NonManifoldEdge, 3), (ReversedDuplicateFace, 1)]),
    ("soup_jitter.obj", &[(TJunction, 13), (OpenEdge, 960), (SelfIntersection, 167)]),
    ("t_junction.obj", &[(TJunction, 1), (OpenEdge, 3)]),
    ("t_junction_gap.obj", &[(OpenEdge, 3)]),
    ("zero_area_repeated_index.obj", &[(RepeatedCorner, 2)]),
    ("zero_area_cap.obj", &[(ZeroArea, 1)]),
    ("needle_slivers.obj", &[(NeedleFace, 2)]),
    ("nonmanifold_edge.obj", &[(NonManifoldEdge, 1)]),
    ("nonmanifold_vertex.obj", &[(NonManifoldVertex, 1)]),
    ("internal_fin.obj", &[(OpenEdge, 1), (NonManifoldEdge, 2)]),
    ("two_boxes_overlap.obj", &[(SelfIntersection, 12), (WindingAboveOne, 1)]),
    ("cavity_inverted.obj", &[(WindingAboveOne, 1)]),
    ("huge_1e30.obj", &[(ExtremeScale, 1)]),
    ("huge_1e200.obj", &[(OutOfRange, 7)]),
    ("tiny_1e-30.obj", &[(ExtremeScale, 1)]),
    ("denormal_1e-310.obj", &[(OutOfRange, 7)]),
    ("far_from_origin.obj", &[(FarFromOrigin, 1)]),
];

/// Files that the encoder refuses, with words of the error, and whether repair helps.
const REFUSED: &[(&str, &str, bool)] = &[
    ("open_holes.obj", "edge 6-7 is open: only face 4 has it", false),
    ("open_half.obj", "is open: only face", false),
    ("flipped_all.obj", "inside out", true),
    ("mixed_winding.obj", "in the same direction", true),
    ("duplicate_faces.obj", "face 320 repeats face 10", true),
    ("duplicate_face_reversed.obj", "face 320 is face 10 reversed", false),
    ("soup_jitter.obj", "is open", false),
    ("t_junction.obj", "vertex 8 lies on the open edge 4-6 of face 8", true),
    ("t_junction_gap.obj", "edge 4-6 is open: only face 8 has it", false),
    ("internal_fin.obj", "edge 0-7 is open: only face 12 has it", false),
    ("huge_1e200.obj", "vertex 1 has z = 1e200", false),
    ("denormal_1e-310.obj", "vertex 1 has z = 1e-310", false),
];

fn readable() -> Vec<String> {
    let table = std::fs::read_to_string(bad("expected.tsv")).unwrap();
    let names = table.lines().skip(1).map(|line| line.split('\t').next().unwrap().to_owned());
    names.filter(|name| read(bad(name)).is_ok()).collect()
}

fn counts(defects: &[Defect]) -> BTreeMap<DefectKind, usize> {
    let mut counts = BTreeMap::new();
    defects.iter().for_each(|d| *counts.entry(d.kind).or_default() += 1);
    counts
}

#[test]
fn exactly_the_expected_defects_are_found() {
    let names = readable();
    assert!(FOUND.iter().all(|(name, _)| names.iter().any(|n| n == name)));
    for name in names {
        let expected = FOUND.iter().find(|(n, _)| *n == name).map_or(&[][..], |(_, found)| found);
        let expected: BTreeMap<_, _> = expected.iter().copied().collect();
        assert_eq!(counts(&check(&load(&name)).defects), expected, "{name}");
    }
}

#[test]
fn meshes_with_an_inside_are_solids_and_others_are_refused() {
    for name in readable() {
        let refused = REFUSED.iter().find(|(n, ..)| *n == name);
        match (SolidMesh::new(load(&name)), refused) {
            (Ok(solid), None) => {
                assert!(solid.warnings().iter().all(|d| d.severity != Severity::Error), "{name}");
                assert_eq!(solid.warnings().is_empty(), !FOUND.iter().any(|(n, _)| *n == name), "{name}");
            }
            (Err(error), Some((_, words, repairable))) => {
                let message = error.to_string();
                assert!(message.contains(words) && message.contains("repair"), "{name}: {message}");
                assert_eq!(
                    (error.suggestion() == Some(&RepairOptions::DEFAULT)),
                    *repairable,
                    "{name}: {message}"
                );
            }
            (Ok(_), Some(_)) => panic!("{name} was accepted"),
            (Err(error), None) => panic!("{name} was refused: {error}"),
        }
    }
}

#[test]
fn meshes_are_accepted_or_refused_as_the_table_says() {
    let table = std::fs::read_to_string(bad("expected.tsv")).unwrap();
    // Rows marked for repair whose mesh is a solid already.
    let solid_as_is = ["zero_area_repeated_index.obj", "cavity_inverted.obj", "nan_unused_vertex.obj"];
    for line in table.lines().skip(1) {
        let fields: Vec<&str> = line.split('\t').collect();
        let (name, expect) = (fields[0], fields[1]);
        let accepted = read(bad(name)).is_ok_and(|loaded| SolidMesh::new(loaded.mesh).is_ok());
        assert_eq!(accepted, expect.starts_with("accept") || solid_as_is.contains(&name), "{name} {expect}");
        if expect == "accept+note" || solid_as_is.contains(&name) {
            let loaded = read(bad(name)).unwrap();
            let solid = SolidMesh::new(loaded.mesh).unwrap();
            assert!(!solid.warnings().is_empty() || !loaded.report.notes.is_empty(), "{name}: no notice");
        }
    }
}

#[test]
fn simple_meshes() {
    let simple = |name: &str| SolidMesh::new(load(name)).unwrap().is_simple();
    for name in
        ["cavity.obj", "three_components.obj", "needle_slivers.obj", "far_from_origin.obj", "quads.obj"]
    {
        assert!(simple(name), "{name}");
    }
    for name in [
        "zero_area_repeated_index.obj",
        "zero_area_cap.obj",
        "nonmanifold_edge.obj",
        "nonmanifold_vertex.obj",
        "two_boxes_overlap.obj",
        "cavity_inverted.obj",
    ] {
        assert!(!simple(name), "{name}");
    }
}

fn of_kind(report: &CheckReport, kind: DefectKind) -> Vec<&Defect> {
    report.defects.iter().filter(|d| d.kind == kind).collect()
}

#[test]
fn defects_name_elements_and_places() {
    let report = check(&load("t_junction.obj"));
    let junction = of_kind(&report, TJunction)[0];
    assert_eq!((&junction.vertices[..], &junction.faces[..]), (&[8, 4, 6][..], &[8][..]));
    assert_eq!(junction.place, [0.02, 0.01, 0.0]);

    let report = check(&load("nonmanifold_edge.obj"));
    let edge = of_kind(&report, NonManifoldEdge)[0];
    assert_eq!((edge.severity, edge.faces.len(), edge.vertices.len()), (Severity::Warning, 4, 2));

    let report = check(&load("zero_area_cap.obj"));
    assert_eq!(of_kind(&report, ZeroArea)[0].faces, [13]);

    let report = check(&load("duplicate_faces.obj"));
    let repeats: Vec<_> = of_kind(&report, DuplicateFace).iter().map(|d| d.faces.clone()).collect();
    assert_eq!(repeats, [[320, 10], [321, 20], [322, 21]]);

    let report = check(&load("open_half.obj"));
    let [chain] = &report.boundary_loops[..] else { panic!("{:?}", report.boundary_loops) };
    assert!(chain.closed && chain.vertices.len() == 24);
    let mesh = load("open_half.obj");
    let edges = mesh.faces().iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let position = |v: u32| mesh.vertices()[v as usize];
    let all: Vec<_> = edges.collect();
    let open = all.iter().filter(|(a, b)| !all.contains(&(*b, *a)));
    let length: f64 = open.map(|&(a, b)| position(a).distance(position(b))).sum();
    assert!((chain.length - length).abs() < 1e-12, "{} {length}", chain.length);
}

#[test]
fn winding_numbers_of_the_report() {
    for (name, winding) in [
        ("cavity.obj", Some([0, 1])),
        ("cavity_inverted.obj", Some([0, 2])),
        ("two_boxes_overlap.obj", Some([0, 2])),
        ("flipped_all.obj", Some([-1, 0])),
        ("open_half.obj", None),
    ] {
        assert_eq!(check(&load(name)).winding, winding, "{name}");
    }
}

#[test]
fn reports_can_be_read_by_people_and_programs() {
    let report = check(&load("open_half.obj"));
    let text = report.to_string();
    assert_eq!(text.matches("is open: only face").count(), 5, "{text}");
    assert!(text.contains("24 open edges in all") && text.contains("boundary loop 0: 24 edges"), "{text}");
    assert!(text.ends_with("not encodable: 24 errors, 0 warnings"), "{text}");
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["defects"].as_array().unwrap().len(), 24);
    assert_eq!(json["defects"][0]["kind"], "open-edge");
    assert_eq!(json["defects"][0]["severity"], "error");
    assert_eq!(json["encodable"], false);
}

#[test]
fn a_moebius_strip_is_non_orientable() {
    let vertices: Vec<_> = (0..10)
        .map(|i| {
            // Triangles of a strip with a half turn, five around.
            let angle = std::f64::consts::TAU * f64::from(i) / 10.0;
            let (side, tilt) = (if i % 2 == 0 { 1.0 } else { -1.0 }, angle / 2.0);
            let radius = 3.0 + side * tilt.cos();
            DVec3::new(radius * angle.cos(), radius * angle.sin(), side * tilt.sin())
        })
        .collect();
    // After one round, vertex 0 comes again with the sides exchanged, so vertex 10 is replaced by
    // vertex 1.
    let id = |i: u32| if i < 10 { i } else { 11 - i };
    let faces = (0..10)
        .map(|i| if i % 2 == 0 { [id(i), id(i + 1), id(i + 2)] } else { [id(i + 1), id(i), id(i + 2)] });
    let mesh = TriangleMesh::new(vertices, faces.collect()).unwrap();
    let report = check(&mesh);
    assert_eq!(of_kind(&report, NonOrientable).len(), 1, "{report}");
    let refusal = SolidMesh::new(mesh).unwrap_err();
    assert!(refusal.suggestion() != Some(&RepairOptions::DEFAULT));
}

#[test]
fn folds_are_accepted_with_a_warning() {
    // A unit cube whose lid is a fan around a vertex that lies beyond one side of the lid, above or
    // below it.
    let folded = |height: f64| {
        let corner = |x: i32, y: i32, z: i32| DVec3::new(x.into(), y.into(), z.into());
        let mut vertices: Vec<DVec3> = [0, 1]
            .iter()
            .flat_map(|&z| [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| corner(x, y, z)))
            .collect();
        vertices.push(DVec3::new(1.5, 0.5, 1.0 + height));
        let mut faces = vec![[0, 2, 1], [0, 3, 2]];
        for i in 0..4 {
            let j = (i + 1) % 4;
            faces.extend([[i, j, j + 4], [i, j + 4, i + 4], [i + 4, j + 4, 8]]);
        }
        check(&TriangleMesh::new(vertices, faces).unwrap())
    };
    for height in [1e-8, 0.2] {
        assert!(folded(height).is_simple(), "{}", folded(height));
    }
    for height in [-1e-8, -0.2] {
        let report = folded(height);
        assert_eq!((report.winding, report.encodable), (Some([-1, 1]), true), "{report}");
        let places = of_kind(&report, NegativeWinding);
        assert!(!places.is_empty() && places.iter().all(|d| d.severity == Severity::Warning), "{report}");
    }
}
