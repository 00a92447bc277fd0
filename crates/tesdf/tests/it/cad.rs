//! Reads STEP, IGES and BREP by Gmsh: units, names, solids, and the distance from curved surfaces.
//!
//! `tests/data/cad/machine.geo` makes a ball of radius 10 around (40, 0, 0) and a ring of radii 3 and
//! 5 and height 20 around the z axis, in millimetres. The names in the STEP file were set by hand.
use std::path::{Path, PathBuf};

use tesdf::Length;
use tesdf::glam::DVec3;
use tesdf::mesh::{
    CadError, CadOptions, MeshFormat, ProgramError, ReadError, SolidMesh, TriangleMesh, read, read_bytes,
    read_with, split,
};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/cad").join(name)
}

fn volume(mesh: &TriangleMesh) -> f64 {
    (0..mesh.faces().len()).map(|f| mesh.triangle(f)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

/// Distance to the surfaces of the ball and the ring.
fn distance(p: DVec3) -> f64 {
    let ball = (p.distance(DVec3::new(40.0, 0.0, 0.0)) - 10.0).abs();
    let radius = p.x.hypot(p.y);
    let (walls, ends) =
        (f64::min((radius - 3.0).abs(), (radius - 5.0).abs()), f64::min(p.z.abs(), (p.z - 20.0).abs()));
    ball.min(walls).min(ends)
}

#[test]
fn a_step_file_gives_named_solids_in_millimetres() {
    let loaded = read(data("machine.step")).unwrap();
    assert_eq!((loaded.report.format, loaded.report.unit.as_deref()), (MeshFormat::Step, Some("mm")));
    assert!(loaded.report.notes[0].starts_with("Gmsh 4."), "{:?}", loaded.report.notes);
    let parts = split(&loaded);
    let names: Vec<_> = parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["ball", "ring"]);
    let exact = [4.0 / 3.0 * 1000.0, 16.0 * 20.0].map(|v| v * std::f64::consts::PI);
    for (part, exact) in parts.iter().zip(exact) {
        let solid = SolidMesh::new(part.mesh.clone()).unwrap();
        assert!(solid.is_simple());
        assert!(
            (volume(&part.mesh) / exact - 1.0).abs() < 0.02,
            "{}: {} {exact}",
            part.name,
            volume(&part.mesh)
        );
    }
    assert_eq!(loaded.mesh, read(data("machine.step")).unwrap().mesh);
    assert!(SolidMesh::new(loaded.mesh).unwrap().is_simple());
}

#[test]
fn the_deviation_is_kept_and_more_triangles_come_from_a_smaller_one() {
    let mut faces = 0;
    for wanted in [0.5, 0.02] {
        let options = CadOptions { deviation: Length::Absolute(wanted), ..CadOptions::default() };
        let mesh = read_with(data("machine.step"), &options).unwrap().mesh;
        // Measured at the middle of the edges, and here within the triangles, too.
        let found = (0..mesh.faces().len())
            .flat_map(|f| {
                let [a, b, c] = mesh.triangle(f);
                [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0]
            })
            .map(distance)
            .fold(0.0, f64::max);
        assert!(found <= 1.5 * wanted, "{found} of {wanted}");
        assert!(mesh.faces().len() > faces);
        faces = mesh.faces().len();
    }
    let options = CadOptions { mesh_size: Length::Absolute(1.0), ..CadOptions::default() };
    let mesh = read_with(data("machine.step"), &options).unwrap().mesh;
    let longest =
        (0..mesh.faces().len()).map(|f| mesh.triangle(f)).map(|[a, b, _]| a.distance(b)).fold(0.0, f64::max);
    assert!(longest < 2.0, "{longest}");
}

#[test]
fn a_step_file_in_metres_is_converted() {
    let text = std::fs::read_to_string(data("machine.step")).unwrap();
    assert!(text.contains("SI_UNIT(.MILLI.,.METRE.)"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("metres.stp");
    std::fs::write(&path, text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)")).unwrap();
    let metres = read(&path).unwrap();
    let millimetres = read(data("machine.step")).unwrap();
    assert_eq!(metres.report.unit.as_deref(), Some("mm"));
    let ratio = metres.mesh.diagonal() / millimetres.mesh.diagonal();
    assert!((ratio / 1000.0 - 1.0).abs() < 0.01, "{ratio}");
}

#[test]
fn a_brep_file_gives_the_same_solids_without_a_unit() {
    let loaded = read(data("machine.brep")).unwrap();
    assert_eq!((loaded.report.unit.as_deref(), loaded.report.unused_vertices), (None, 0));
    let parts = split(&loaded);
    let names: Vec<_> = parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["solid 1", "solid 2"]);
    let volumes: Vec<_> = parts.iter().map(|part| volume(&part.mesh)).collect();
    assert!((volumes[0] - 4188.8).abs() < 84.0 && (volumes[1] - 1005.3).abs() < 20.0, "{volumes:?}");
    parts.into_iter().for_each(|part| drop(SolidMesh::new(part.mesh).unwrap()));
}

#[test]
fn an_iges_file_gives_its_surfaces() {
    let loaded = read(data("machine.iges")).unwrap();
    assert_eq!(loaded.report.unit.as_deref(), Some("mm"));
    assert!(loaded.report.notes.iter().any(|note| note.contains("no solid")), "{:?}", loaded.report.notes);
    let area = |f| {
        let [a, b, c] = loaded.mesh.triangle(f);
        (b - a).cross(c - a).length() / 2.0
    };
    let found: f64 = (0..loaded.mesh.faces().len()).map(area).sum();
    let exact = std::f64::consts::PI * (400.0 + 2.0 * 16.0 + 2.0 * 20.0 * (3.0 + 5.0));
    assert!((found / exact - 1.0).abs() < 0.02, "{found} {exact}");
}

#[test]
fn errors_say_what_to_do() {
    let without = CadOptions { executable: Some("no-such-gmsh".into()), ..CadOptions::default() };
    let message = read_with(data("machine.step"), &without).unwrap_err().to_string();
    assert!(message.contains("no-such-gmsh") && message.contains("pip install gmsh"), "{message}");
    let wrong = CadOptions { mesh_size: Length::Absolute(-1.0), ..CadOptions::default() };
    let message = read_with(data("machine.step"), &wrong).unwrap_err().to_string();
    assert!(message.contains("mesh size") && message.contains("-1"), "{message}");

    let bytes = std::fs::read(data("machine.step")).unwrap();
    let error = read_bytes(&bytes, MeshFormat::Step).unwrap_err();
    assert!(matches!(error, ReadError::FileOnly { .. }), "{error}");

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("half.step");
    for bytes in [&bytes[..bytes.len() / 2], b"no STEP file", b"\0\xff\0"] {
        std::fs::write(&path, bytes).unwrap();
        let error = read(&path).unwrap_err();
        assert!(
            matches!(
                error,
                ReadError::Cad(CadError::Failed(_) | CadError::Program(ProgramError::Broken { .. }))
                    | ReadError::NoFaces { .. }
            ),
            "{error:?}"
        );
    }
}
