//! Faces that all meet each other have a quadratic number of pairs, which are not listed.
use std::collections::BTreeMap;

use tesdf::glam::DVec3;
use tesdf::mesh::{DefectKind, RepairOptions, Severity, SolidMesh, TriangleMesh, check, repair};

/// Closed needles along x and along y that all cross each other.
fn crossing_needles(count: u32) -> TriangleMesh {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for k in 0..count {
        let (at, width) = (f64::from(k) / f64::from(count), 0.3 / f64::from(count));
        for turn in [|x, y, z| DVec3::new(x, y, z), |x, y, z| DVec3::new(y, x, z)] {
            let base = vertices.len() as u32;
            vertices.extend([turn(-1.0, at, 0.0), turn(2.0, at, 0.0), turn(2.0, at + width, 0.0)]);
            vertices.push(turn(2.0, at, 0.01));
            faces.extend([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|f: [u32; 3]| f.map(|v| v + base)));
        }
    }
    TriangleMesh::new(vertices, faces).unwrap()
}

#[test]
#[ignore = "long: .ci/release"]
fn a_million_pairs_are_refused_and_not_listed() {
    let mesh = crossing_needles(400);
    let report = check(&mesh);
    assert!(!report.encodable && report.winding.is_none());
    let mut kinds: BTreeMap<DefectKind, Vec<Severity>> = BTreeMap::new();
    report.defects.iter().for_each(|d| kinds.entry(d.kind).or_default().push(d.severity));
    assert_eq!(kinds.get(&DefectKind::SelfIntersection), Some(&vec![Severity::Error]), "{kinds:?}");
    let refusal = SolidMesh::new(mesh.clone()).unwrap_err();
    assert!(refusal.suggestion() != Some(&RepairOptions::DEFAULT));
    assert!(refusal.to_string().contains("1048576 pairs of faces intersect"), "{refusal}");
    assert!(!repair(&mesh, &RepairOptions::default()).unwrap().report.encodable);
}

#[test]
fn a_hundred_thousand_pairs_are_listed() {
    let report = check(&crossing_needles(60));
    let pairs = report.defects.iter().filter(|d| d.kind == DefectKind::SelfIntersection).count();
    assert!((10_000..100_000).contains(&pairs) && report.encodable, "{pairs} {:?}", report.winding);
}
