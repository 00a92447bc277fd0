//! Tests with Gmsh as a subprocess. It must be installed (`pip install gmsh` or `apt install
//! gmsh`), or `TESDF_GMSH` must have its path; `./test` does that.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::support::meshes::named;
use tesdf::domain::gmsh::{
    GmshAlgorithm, GmshError, GmshOptimizer, GmshOptions, GmshSettings, RefusedBecause, tetrahedralise,
    tetrahedralise_and_report,
};
use tesdf::domain::{ConformingError, ConformingMesh};
use tesdf::encode::{Domain, EncodeOptions, Encoder, Refinement};
use tesdf::geometry::Aabb;
use tesdf::geometry::internal::tetrahedron_volume;
use tesdf::glam::DVec3;
use tesdf::mesh::{ProgramError, SolidMesh, TriangleMesh, WindingNumber};
use tesdf::verify::{ProveOptions, prove};
use tesdf::{Length, Preset, Progress, Side};

fn volume(mesh: &ConformingMesh, side: Side) -> f64 {
    let of_side = |&t: &usize| mesh.sides()[t] == side;
    (0..mesh.sides().len()).filter(of_side).map(|t| tetrahedron_volume(&mesh.corners(t))).sum()
}

fn fill(file: &str, options: &GmshOptions) -> (SolidMesh, ConformingMesh) {
    let solid = named(file);
    let mesh = tetrahedralise(&solid, options).unwrap_or_else(|e| panic!("{file}: {e}"));
    (solid, mesh)
}

#[test]
fn the_inside_is_filled() {
    for file in ["procedural/cube.obj", "procedural/beam.obj", "procedural/iso_m16_nut_c50.obj"] {
        let (solid, mesh) = fill(file, &GmshOptions::default());
        assert!(mesh.sides().iter().all(|&s| s == Side::Inside));
        let (classes, faces) = (mesh.classes(), solid.mesh().faces().len());
        assert_eq!(classes.surface_vertices, solid.mesh().vertices().len());
        // The paper has such a ratio for a bolt; a cube needs five or six tetrahedra.
        let ratio = mesh.tetrahedra().len() as f64 / faces as f64;
        assert!((0.4..2.0).contains(&ratio), "{file}: {ratio} tetrahedra per face");
        // Labels are compared with the winding number at another point than the one that labelled
        // them.
        let winding = WindingNumber::new(solid.mesh());
        for t in (0..mesh.sides().len()).step_by(7) {
            let [a, b, c, d] = mesh.corners(t);
            assert_eq!(winding.at(0.4 * a + 0.3 * b + 0.2 * c + 0.1 * d), 1, "{file}, tetrahedron {t}");
        }
    }
}

/// Its bent surfaces have faces close beside tetrahedra, which only planes through corners of both
/// separate.
#[test]
fn an_encoding_in_it_is_proved() {
    let (solid, mesh) = fill("procedural/beam_bent.obj", &GmshOptions::default());
    let options = EncodeOptions { refinement: Refinement::None, ..EncodeOptions::preset(Preset::Fast) };
    let encoder = Encoder::new().options(options).domain(Domain::Conforming(&mesh));
    let asset = encoder.encode(&solid).expect("encodes");
    let report = prove(&asset, &ProveOptions::default(), |_| ControlFlow::Continue(())).expect("closed");
    assert!(report.proved && report.signs.claims > 1000, "{report:#?}");
}

#[test]
fn a_band_fills_the_grown_bounds() {
    let options = GmshOptions { band: Some(Length::OfDiagonal(0.1)), ..GmshOptions::default() };
    let (solid, mesh) = fill("procedural/iso_m16_nut_c50.obj", &options);
    let all = solid.mesh().bounds().grown(0.1 * solid.mesh().diagonal()).extent().element_product();
    let (inside, outside) = (volume(&mesh, Side::Inside), volume(&mesh, Side::Outside));
    assert!((inside + outside - all).abs() < 1e-9 * all);
    let classes = mesh.classes();
    assert!(
        classes.outer_vertices > 0 && classes.boundary_outer_tetrahedra > 0 && classes.outer_tetrahedra > 0
    );
    let winding = WindingNumber::new(solid.mesh());
    for t in (0..mesh.sides().len()).step_by(11) {
        let [a, b, c, d] = mesh.corners(t);
        let expected = i32::from(mesh.sides()[t] == Side::Inside);
        assert_eq!(winding.at(0.4 * a + 0.3 * b + 0.2 * c + 0.1 * d), expected, "tetrahedron {t}");
    }
}

/// The domain contains all that meets the region, and nothing else.
#[test]
fn only_the_region_is_filled() {
    let region = [0.09, -0.005, -0.005, 0.12, 0.025, 0.025];
    let options = GmshOptions { regions: vec![region], ..GmshOptions::default() };
    let (solid, mesh) = fill("procedural/beam.obj", &options);
    let [a, b, c, d, e, f] = region;
    let region = Aabb { min: DVec3::new(a, b, c), max: DVec3::new(d, e, f) };
    let outside: Vec<usize> = (0..mesh.sides().len()).filter(|&t| mesh.sides()[t] == Side::Outside).collect();
    assert!(!outside.is_empty());
    assert!(outside.iter().all(|&t| Aabb::of(&mesh.corners(t)).overlaps(region)));
    assert!(mesh.vertices()[solid.mesh().vertices().len()..].iter().all(|p| p.x > 0.0));
    let holds = |t: usize, p: DVec3| {
        let corners = mesh.corners(t);
        let parts = (0..4).map(|k| {
            let mut part = corners;
            part[k] = p;
            tetrahedron_volume(&part)
        });
        parts.sum::<f64>() <= (1.0 + 1e-9) * tetrahedron_volume(&corners)
    };
    for i in 0..125 {
        let share = DVec3::new((i % 5).into(), (i / 5 % 5).into(), (i / 25).into()) / 4.0;
        let p = region.min + share * region.extent();
        assert!((0..mesh.sides().len()).any(|t| holds(t, p)), "{p} is in no tetrahedron");
    }
}

/// Gmsh sees the local frame, so a mesh 1e6 units away, in units of 1e20, is the same to it.
#[test]
fn unit_and_place_do_not_matter() {
    let near = named("procedural/cube.obj");
    let moved: Vec<DVec3> = near.mesh().vertices().iter().map(|&p| (p + 1e6) * 1e20).collect();
    let far = SolidMesh::new(TriangleMesh::new(moved, near.mesh().faces().to_vec()).unwrap()).unwrap();
    let mesh = tetrahedralise(&far, &GmshOptions::default()).unwrap();
    assert_eq!(mesh.classes(), tetrahedralise(&near, &GmshOptions::default()).unwrap().classes());
}

#[test]
fn the_same_input_gives_the_same_tetrahedra() {
    let options = GmshOptions { band: Some(Length::OfDiagonal(0.05)), ..GmshOptions::default() };
    let (_, first) = fill("procedural/beam_bent.obj", &options);
    let (_, second) = fill("procedural/beam_bent.obj", &options);
    assert_eq!(first, second);
}

#[test]
fn all_settings_work() {
    for settings in [
        (GmshAlgorithm::Frontal, GmshOptimizer::Off),
        (GmshAlgorithm::Hxt, GmshOptimizer::Gmsh),
        (GmshAlgorithm::Delaunay, GmshOptimizer::Netgen),
    ] {
        let settings = GmshSettings { algorithm: settings.0, optimizer: settings.1 };
        let options = GmshOptions { settings: vec![settings], ..GmshOptions::default() };
        fill("procedural/beam.obj", &options);
    }
}

/// A script that replaces Gmsh.
#[cfg(unix)]
fn stand_in(folder: &Path, script: &str) -> GmshOptions {
    use std::os::unix::fs::PermissionsExt;
    let path = folder.join("stand_in");
    std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    GmshOptions { executable: Some(path), ..GmshOptions::default() }
}

/// An MSH file with the unit cube in its local frame and the given tetrahedra.
fn msh(tetrahedra: &[[u32; 4]]) -> String {
    let mut out = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n".to_owned();
    for i in 0..8 {
        out += &format!(
            "{i} {} {} {}\n",
            0.5 * f64::from(i & 1),
            0.5 * f64::from(i >> 1 & 1),
            0.5 * f64::from(i >> 2)
        );
    }
    out += &format!("$EndNodes\n$Elements\n{}\n", tetrahedra.len());
    for (t, [a, b, c, d]) in tetrahedra.iter().enumerate() {
        out += &format!("{t} 4 0 {a} {b} {c} {d}\n");
    }
    out + "$EndElements\n"
}

const CUBE: [[u32; 4]; 6] =
    [[0, 1, 3, 7], [0, 1, 7, 5], [0, 2, 7, 3], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 7, 6]];

fn unit_cube() -> SolidMesh {
    let faces = [[0, 3, 1], [0, 2, 3], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 7, 3], [2, 6, 7]];
    let faces = [&faces[..], &[[0, 6, 2], [0, 4, 6], [1, 3, 7], [1, 7, 5]]].concat();
    let corner = |i: u32| DVec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2).into());
    SolidMesh::new(TriangleMesh::new((0..8).map(corner).collect(), faces).unwrap()).unwrap()
}

#[cfg(unix)]
#[test]
fn the_next_settings_are_tried_if_the_tetrahedra_do_not_conform() {
    let folder = tempfile::tempdir().unwrap();
    let mut flat = CUBE.to_vec();
    flat.push([0, 1, 2, 3]);
    std::fs::write(folder.path().join("flat.msh"), msh(&flat)).unwrap();
    std::fs::write(folder.path().join("open.msh"), msh(&CUBE[1..])).unwrap();
    std::fs::write(folder.path().join("good.msh"), msh(&CUBE)).unwrap();
    let at = folder.path().display();
    let script = format!(
        "if grep -q 'Algorithm3D = 10' domain.geo; then cp {at}/good.msh domain.msh; else cp {at}/flat.msh domain.msh; fi"
    );
    let options = stand_in(folder.path(), &script);
    let report = tetrahedralise_and_report(&unit_cube(), &options, &Progress::default()).unwrap();
    assert_eq!(report.mesh.sides(), [Side::Inside; 6]);
    assert_eq!(report.settings.algorithm, GmshAlgorithm::Hxt);
    let [first] = &report.refused[..] else { panic!("{:?}", report.refused) };
    let because = &first.because;
    assert!(
        matches!(because, RefusedBecause::Gate(ConformingError::Flat { tetrahedron: 6, .. })),
        "{because}"
    );

    // No settings give a valid result.
    let script = format!(
        "if grep -q 'Algorithm3D = 10' domain.geo; then cp {at}/open.msh domain.msh; else cp {at}/flat.msh domain.msh; fi"
    );
    let error = tetrahedralise(&unit_cube(), &stand_in(folder.path(), &script)).unwrap_err().to_string();
    let lines: Vec<&str> = error.lines().collect();
    assert_eq!(lines.len(), 7, "{error}");
    assert!(
        lines[1].contains("Mesh.Algorithm3D=1 Mesh.Optimize=1 Mesh.OptimizeNetgen=0: orientation: "),
        "{error}"
    );
    assert!(lines[2].contains("Mesh.Algorithm3D=10 ") && lines[2].contains(": faces: 2 of 12"), "{error}");
    assert!(lines[6].contains("bisection"), "{error}");
}

#[cfg(unix)]
#[test]
fn missing_libraries_refusals_and_timeouts_are_different_errors() {
    let folder = tempfile::tempdir().unwrap();
    let run = |script: &str| tetrahedralise(&unit_cube(), &stand_in(folder.path(), script)).unwrap_err();
    let error = run("echo 'ImportError: libGLU.so.1: cannot open shared object file' >&2; exit 1");
    assert!(
        matches!(error, GmshError::Program(ProgramError::Broken { ref output, .. }) if output.contains("libGLU")),
        "{error}"
    );
    let error =
        run("echo 'Info    : Running'; echo 'Error   : PLC Error: A segment and a facet intersect'; exit 1");
    let GmshError::AllRefused(refused) = error else { panic!("{error}") };
    assert_eq!(refused.len(), 5);
    assert!(refused[0].to_string().contains("A segment and a facet intersect"), "{}", refused[0]);

    let options =
        GmshOptions { time_limit: Duration::from_millis(30), ..stand_in(folder.path(), "exec sleep 60") };
    let options = GmshOptions { settings: options.settings[..1].to_vec(), ..options };
    let error = tetrahedralise(&unit_cube(), &options).unwrap_err();
    assert!(error.to_string().contains("stopped after 30ms"), "{error}");
}

#[cfg(unix)]
#[test]
fn cancelling_ends_gmsh() {
    let folder = tempfile::tempdir().unwrap();
    let started = folder.path().join("started");
    let options = stand_in(folder.path(), &format!("touch {}; exec sleep 60", started.display()));
    let progress = Progress::default();
    let found = std::thread::scope(|scope| {
        let running = scope.spawn(|| tetrahedralise_and_report(&unit_cube(), &options, &progress));
        while !started.exists() && !running.is_finished() {
            std::thread::yield_now();
        }
        progress.cancel();
        running.join().unwrap()
    });
    assert!(matches!(found, Err(GmshError::Cancelled)), "{found:?}");
}

#[test]
fn errors_say_what_to_do() {
    let options = |change: fn(&mut GmshOptions)| {
        let mut options = GmshOptions::default();
        change(&mut options);
        tetrahedralise(&unit_cube(), &options).unwrap_err().to_string()
    };
    let error = options(|o| o.executable = Some(PathBuf::from("no-such-gmsh")));
    assert!(error.contains("no-such-gmsh") && error.contains("pip install gmsh"), "{error}");
    let error = options(|o| o.band = Some(Length::Absolute(0.0)));
    assert!(error.contains("expected a positive length"), "{error}");
    let error =
        options(|o| o.regions = vec![[0.0, 0.0, 0.0, 1.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0, -1.0, 1.0]]);
    assert!(error.starts_with("region 1 "), "{error}");
    let error = options(|o| o.settings.clear());
    assert!(error.contains("at least one"), "{error}");
}
