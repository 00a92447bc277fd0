//! Reading a written file gives the mesh back.
use std::path::Path;

use proptest::prelude::*;
use tesdf::glam::DVec3;
use tesdf::mesh::{TriangleMesh, WriteError, WriteFormat, read, write};

/// Unusual but finite coordinates.
fn mesh() -> TriangleMesh {
    let vertices = vec![
        DVec3::new(0.1, 1.0 / 3.0, -2e-7),
        DVec3::new(1e6 + 0.02, 5e-324, f64::MIN_POSITIVE),
        DVec3::new(-1e30, 123_456_789.123_456_79, 0.0),
        DVec3::new(0.1f64.next_up(), 1.0, 1e-30),
    ];
    TriangleMesh::new(vertices, vec![[0, 1, 2], [3, 2, 1], [0, 3, 3]]).unwrap()
}

#[test]
fn ply_and_obj_keep_every_bit() {
    let folder = tempfile::tempdir().unwrap();
    for (name, format) in [("a.ply", WriteFormat::Ply), ("b.OBJ", WriteFormat::Obj)] {
        let path = folder.path().join(name);
        assert_eq!(write(&path, &mesh()).unwrap(), format);
        assert!(format.is_exact());
        assert_eq!(read(&path).unwrap().mesh, mesh(), "{name}");
    }
}

#[test]
fn stl_rounds_to_f32() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.stl");
    let format = write(&path, &mesh()).unwrap();
    assert!(!format.is_exact());
    let loaded = read(&path).unwrap().mesh;
    for face in 0..3 {
        let rounded = mesh().triangle(face).map(|p| p.as_vec3().as_dvec3() + DVec3::ZERO);
        assert_eq!(loaded.triangle(face), rounded);
    }
    let huge = TriangleMesh::new(vec![DVec3::splat(1e39); 3], vec![[0, 1, 2]]).unwrap();
    let error = write(&path, &huge).unwrap_err();
    assert!(matches!(error, WriteError::BeyondF32 { vertex: 0, .. }), "{error}");
    assert_eq!(read(&path).unwrap().mesh, loaded, "a failed write leaves the file as it was");
}

#[test]
fn files_are_replaced_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    std::fs::write(&path, "old").unwrap();
    write(&path, &mesh()).unwrap();
    assert_eq!(read(&path).unwrap().mesh, mesh());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file is left");

    let unknown = write(folder.path().join("a.off"), &mesh()).unwrap_err().to_string();
    assert!(unknown.contains(".ply, .obj, .stl"), "{unknown}");
    let missing = write(Path::new("no/such/folder/a.ply"), &mesh()).unwrap_err().to_string();
    assert!(missing.contains("no/such/folder/a.ply"), "{missing}");
}

proptest! {
    /// Any finite bit pattern survives. Equal positions would be welded, so numbering z avoids
    /// them.
    #[test]
    fn any_finite_coordinates_survive_ply_and_obj(
        points in prop::collection::vec((any::<f64>(), any::<f64>()), 3..40),
        corners in prop::collection::vec(0..1000usize, 3),
    ) {
        let finite = |v: f64| if v.is_finite() { v + 0.0 } else { 1.0 };
        let vertices: Vec<_> = points.iter().enumerate()
            .map(|(i, p)| DVec3::new(finite(p.0), finite(p.1), i as f64)).collect();
        let n = vertices.len() as u32;
        // Every vertex is used, because reading drops unused vertices.
        let mut faces: Vec<_> = (0..n).map(|i| [i, (i + 1) % n, (i + 2) % n]).collect();
        faces.push([0, 1, 2].map(|i: usize| corners[i] as u32 % n));
        let mesh = TriangleMesh::new(vertices, faces).unwrap();
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.ply", "a.obj"] {
            let path = folder.path().join(name);
            write(&path, &mesh).unwrap();
            prop_assert_eq!(&read(&path).unwrap().mesh, &mesh);
        }
    }
}
