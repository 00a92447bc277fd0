//! Faces that are points or segments, exactly or after rounding, in otherwise valid meshes:
//! encoding, queries and contacts.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::support::meshes;
use crate::support::random::Random;
use crate::support::reference::Reference;
use crate::support::shapes::{FAMILIES, Family, Shape};
use proptest::prelude::*;
use tesdf::TeSdf;
use tesdf::base::{Inside, InsideRule, SurfaceFaces};
use tesdf::collide::{
    ClearanceOptions, CollideOptions, Instance, InstanceId, Mode, Pose, Scene, Shape as Body, clearance,
    detect,
};
use tesdf::encode::{EncodeOptions, Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf::mesh::{Defect, RepairMode, Severity, SolidMesh, TriangleMesh, check, repair_auto};
use tesdf::query::Precision;
use tesdf::verify::{VerifyOptions, verify};

const CUBE: [[u32; 3]; 12] = [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
];

/// The cube from −1 to 1. The bits of vertex k are its x, y, z.
fn cube() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let corner = |k: u32| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64) * 2.0 - 1.0;
    ((0..8).map(corner).collect(), CUBE.to_vec())
}

fn encoded(vertices: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Arc<TeSdf> {
    let solid = SolidMesh::new(TriangleMesh::new(vertices, faces).expect("valid ids")).expect("a solid");
    let options = EncodeOptions::default();
    Arc::new(Encoder::new().options(options).encode(&solid).expect("encodes"))
}

/// Checks distances, signs and gradients against their promises, in both precisions.
fn assert_right(asset: &TeSdf) {
    let options = VerifyOptions { samples: 4000, seed: 3 };
    let report = verify(asset, &options, |_| ControlFlow::Continue(())).expect("a valid mesh");
    assert!(report.passed, "{report:#?}");
    asset.visit_cells(|cell| {
        for precision in [Precision::F32, Precision::F64] {
            let answer = asset.query_with(cell.corners[0], precision);
            assert!((answer.gradient.length() - 1.0).abs() < 1e-3, "{answer:?}");
        }
    });
}

/// Depths by mode of a box that dips by 0.1 into the top of a body with the given height.
fn depths(asset: &Arc<TeSdf>, top: f64) -> Vec<f64> {
    let mut scene = Scene::new();
    let body = scene.add_shape(asset.clone()).expect("room");
    let probe = scene.add_shape(Body::Box { half_extents: DVec3::splat(0.25) }).expect("room");
    scene.add(Instance::new(body, Pose::IDENTITY)).expect("valid");
    scene.add(Instance::new(probe, Pose::at(DVec3::new(0.1, 0.2, top + 0.15)))).expect("valid");
    let modes = [Mode::Node, Mode::face(), Mode::exact()];
    modes
        .into_iter()
        .map(|mode| {
            let options = CollideOptions { mode, ..CollideOptions::default() };
            let contacts = detect(&scene, &options).expect("valid");
            contacts.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min)
        })
        .collect()
}

#[test]
fn a_face_of_one_vertex() {
    let (vertices, mut faces) = cube();
    faces.push([1, 1, 1]);
    let asset = encoded(vertices, faces);
    for precision in [Precision::F32, Precision::F64] {
        assert_eq!(asset.query_with(DVec3::ZERO, precision).signed_distance, -1.0);
    }
    assert_right(&asset);
    for depth in depths(&asset, 1.0) {
        assert!((depth + 0.1).abs() < 1e-5, "{depth}");
    }
}

#[test]
fn a_facet_of_zeros() {
    // Some exporters write such a facet at the end of a binary STL: a point away from the surface.
    let (mut vertices, mut faces) = cube();
    vertices.iter_mut().for_each(|v| *v += DVec3::splat(3.0));
    vertices.push(DVec3::ZERO);
    faces.push([8, 8, 8]);
    let asset = encoded(vertices, faces);
    assert_right(&asset);
    let at = DVec3::splat(0.5);
    assert!((asset.signed_distance(at) - at.length()).abs() < 1e-12);
}

/// The cube with one corner cut off by a triangle of the given size.
fn chamfered(size: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (mut vertices, faces) = cube();
    // Vertex 7 becomes three vertices, one along each edge. Each face there uses two of them.
    let along = |axis: usize| vertices[7] - size * DVec3::AXES[axis];
    let cut = [along(0), along(1), along(2)];
    vertices[7] = cut[0];
    vertices.extend([cut[1], cut[2]]);
    let id = [7u32, 8, 9];
    // The sides x = −1, y = −1, z = −1 stay.
    let is_low = |f: &[u32; 3]| (0..3).any(|axis| f.iter().all(|v| v >> axis & 1 == 0));
    let mut all: Vec<[u32; 3]> = faces.into_iter().filter(is_low).collect();
    // The sides x = 1, y = 1, z = 1 are squares with one corner cut off, so they are pentagons.
    let sides: [[u32; 5]; 3] = [[1, 3, id[2], id[1], 5], [2, 6, id[0], id[2], 3], [4, 5, id[1], id[0], 6]];
    for [a, b, c, d, e] in sides {
        all.extend([[a, b, c], [a, c, d], [a, d, e]]);
    }
    all.push([id[0], id[1], id[2]]);
    (vertices, all)
}

#[test]
fn a_tiny_chamfer() {
    for size in [1e-3, 1e-7, 4e-8, 1e-9, 1e-12, 1e-15] {
        let (vertices, faces) = chamfered(size);
        let asset = encoded(vertices, faces);
        assert_right(&asset);
        for depth in depths(&asset, 1.0) {
            assert!((depth + 0.1).abs() < 1e-5, "chamfer of {size}: {depth}");
        }
    }
}

#[test]
fn a_sphere_on_a_coarse_grid() {
    let solid = Shape::default().add_sphere(DVec3::ZERO, 3, || 1.0).solid();
    for step in [0.4, 0.25, 0.1] {
        let vertices = solid.mesh().vertices().iter().map(|v| (*v / step).round() * step).collect();
        let mesh = TriangleMesh::new(vertices, solid.mesh().faces().to_vec()).expect("valid ids");
        let collapsed = (0..mesh.faces().len()).filter(|&f| {
            let [a, b, c] = mesh.triangle(f);
            a == b || b == c || c == a
        });
        assert!(step < 0.2 || collapsed.count() > 10);
        assert_right(&encoded(mesh.vertices().to_vec(), mesh.faces().to_vec()));
    }
}

#[test]
fn vertices_far_away_and_thin_plates() {
    let tetrahedron = |far: f64| {
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.1, 0.2, far)];
        (vertices, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    };
    let spiked = |far: f64| {
        let (mut vertices, faces) = cube();
        vertices[7] = DVec3::new(1.0, 1.0, far);
        (vertices, faces)
    };
    let plate = |thickness: f64| {
        let (mut vertices, faces) = cube();
        vertices.iter_mut().for_each(|v| v.z = if v.z > 0.0 { thickness } else { 0.0 });
        (vertices, faces)
    };
    for (name, (vertices, faces)) in [
        ("tetrahedron 1e3", tetrahedron(1e3)),
        ("tetrahedron 1e15", tetrahedron(1e15)),
        ("spike 1e3", spiked(1e3)),
        ("spike 1e7", spiked(1e7)),
        ("plate 1e-8", plate(1e-8)),
        ("plate 1e-15", plate(1e-15)),
    ] {
        println!("{name}");
        assert_right(&encoded(vertices, faces));
    }
}

/// Face 7 has a height of 5e-60, so it is a segment after rounding. Its normal used to decide the
/// sign of points nearest to that segment.
#[test]
fn a_face_that_is_a_segment_does_not_decide_the_sign() {
    let mut vertices: Vec<DVec3> =
        (0..8).map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect();
    vertices[1] = DVec3::new(1.2731877562933331, 0.15, 8.500000000000001e-10);
    vertices[5] = DVec3::new(0.775, 0.0, 0.85);
    vertices[7] = DVec3::new(0.25, 1.0, 5e-60);
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = sides.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let asset = encoded(vertices, faces);
    assert_right(&asset);
    for precision in [Precision::F32, Precision::F64] {
        let answer = asset.query_with(DVec3::new(0.1882258779474606, 1.232421875, -0.232421875), precision);
        assert!((answer.signed_distance - 0.2324_f64.hypot(0.2324)).abs() < 1e-3, "{answer:?}");
    }
}

#[test]
fn clearance_is_right_with_faces_of_one_vertex() {
    let (vertices, mut faces) = cube();
    faces.push([1, 1, 1]);
    faces.push([6, 6, 6]);
    let asset = encoded(vertices, faces);
    for (x, expected) in [(2.5, 0.5), (7.0, 5.0)] {
        let mut scene = Scene::new();
        let shape = scene.add_shape(asset.clone()).expect("room");
        let a = scene.add(Instance::new(shape, Pose::IDENTITY)).expect("valid");
        let b = scene.add(Instance::new(shape, Pose::at(DVec3::new(x, 0.0, 0.0)))).expect("valid");
        let found = clearance(&scene, a, b, &ClearanceOptions::default()).expect("valid");
        assert!((found.distance - expected).abs() < 1e-6, "{found:?}");
    }
}

/// A member of a family with some edges shrunk to zero or nearly zero, and with some faces that use
/// one vertex three times. It stays closed.
fn degenerate(family: Family, seed: u64) -> SolidMesh {
    let solid = family.member(seed);
    let mut random = Random(seed);
    let mut vertices = solid.mesh().vertices().to_vec();
    let mut faces = solid.mesh().faces().to_vec();
    let diagonal = solid.mesh().diagonal();
    for _ in 0..1 + random.index(8) {
        let [a, b, c] = faces[random.index(faces.len())].map(|v| v as usize);
        let beside = random.power(-17.0, -7.0) * diagonal * random.in_cube();
        vertices[a] = match random.index(4) {
            0 => vertices[b],
            1 => vertices[b] + beside,
            2 => 0.5 * (vertices[b] + vertices[c]),
            _ => 0.3 * vertices[b] + 0.7 * vertices[c] + beside,
        };
    }
    for _ in 0..random.index(3) {
        let vertex = random.index(vertices.len()) as u32;
        faces.push([vertex; 3]);
    }
    match SolidMesh::new(TriangleMesh::new(vertices, faces).expect("valid ids")) {
        Ok(solid) => solid,
        // Shrinking an edge can turn a part inside out.
        Err(_) => solid,
    }
}

/// Compares the deepest contact of each mode with the depths of the vertices, and the distance of
/// every contact with all faces.
fn check_contacts(asset: &Arc<TeSdf>, solid: &SolidMesh, shift: DVec3) -> Result<(), TestCaseError> {
    let reference = Reference::new(solid.mesh());
    let mut scene = Scene::new();
    let shape = scene.add_shape(asset.clone()).expect("room");
    for at in [DVec3::ZERO, shift] {
        scene.add(Instance::new(shape, Pose::at(at))).expect("valid");
    }
    let tolerance = 4.0 * reference.tolerance_f32(shift);
    let others = |p: DVec3, instance: InstanceId| {
        let placed = if instance == InstanceId(0) { p } else { p - shift };
        reference.signed_distance(placed)
    };
    for mode in [Mode::Node, CollideOptions::default().mode] {
        let options = CollideOptions { mode, ..CollideOptions::default() };
        let found = detect(&scene, &options).expect("valid");
        for contact in &found {
            let exact = others(contact.point_a, contact.instance_b);
            prop_assert!((contact.distance - exact).abs() < tolerance, "{exact} {contact:?}");
            prop_assert!((contact.normal.length() - 1.0).abs() < 1e-3, "{contact:?}");
        }
        let deepest = found.iter().map(|c| c.distance).fold(0.0, f64::min);
        let of_nodes =
            solid.mesh().vertices().iter().map(|&v| reference.signed_distance(v - shift)).fold(0.0, f64::min);
        prop_assert!(deepest <= of_nodes + tolerance, "{mode:?}: {deepest}, but a node at {of_nodes}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn random_meshes_with_degenerate_faces(family in prop::sample::select(FAMILIES.to_vec()), seed in any::<u64>()) {
        let solid = degenerate(family, seed);
        let preset = if seed % 2 == 0 { Preset::Fast } else { Preset::Gpu };
        let asset = Encoder::new().preset(preset).encode(&solid).expect("encodes");
        let report = verify(&asset, &VerifyOptions { samples: 600, seed }, |_| ControlFlow::Continue(())).expect("a valid mesh");
        prop_assert!(report.passed, "{report:#?}");
        let shift = 0.4 * solid.mesh().diagonal() * Random(seed).in_cube();
        check_contacts(&Arc::new(asset), &solid, shift)?;
    }
}

/// Faces without area that stand out of a cube, with the vertices they add.
fn hairs() -> Vec<(Vec<DVec3>, Vec<[u32; 3]>)> {
    let far = DVec3::new(0.0, 0.0, 3.0);
    vec![
        // From a corner to a point far from the cube.
        (vec![far], vec![[7, 8, 7]]),
        // A point on its own.
        (vec![far], vec![[8, 8, 8]]),
        // Three corners on a line, there and back.
        (vec![far, far + DVec3::X, far + 2.0 * DVec3::X], vec![[8, 9, 10], [10, 9, 8]]),
        (vec![far, DVec3::new(0.5, 0.5, 2.0)], vec![[7, 9, 8], [8, 9, 7]]),
    ]
}

fn with_hair((more, faces): (Vec<DVec3>, Vec<[u32; 3]>)) -> TriangleMesh {
    let (vertices, cube) = cube();
    TriangleMesh::new([vertices, more].concat(), [cube, faces].concat()).expect("valid ids")
}

#[test]
fn faces_without_area_that_stand_out_are_left_out_where_they_are_no_surface() {
    let at = DVec3::new(0.0, 0.0, 3.0);
    let distance = |solid: &SolidMesh| meshes::encoded(solid).signed_distance(at);
    let tells = |warnings: &[Defect], what: &str| {
        let has = |d: &Defect| d.severity == Severity::Warning && d.message.ends_with(what);
        assert!(warnings.iter().any(has), "{what}: {warnings:?}");
    };
    let (left_out, counts) =
        ("stands out of the surface, and is left out of it", "and distances refer to it, too");
    for (k, hair) in hairs().into_iter().enumerate() {
        let mesh = with_hair(hair);
        // As it is, the faces count, and a warning says so.
        tells(&check(&mesh).defects, counts);
        let solid = SolidMesh::new(mesh.clone()).expect("a solid");
        tells(solid.warnings(), counts);
        assert!(distance(&solid) < 1e-6, "{k}");
        for rule in [InsideRule::Winding, InsideRule::Nonzero, InsideRule::Odd] {
            let inside = Inside { rule, surface: SurfaceFaces::Boundary };
            let solid = SolidMesh::with_inside(mesh.clone(), inside).expect("a solid");
            assert!((distance(&solid) - 2.0).abs() < 1e-6, "{k} {rule:?}: {}", distance(&solid));
            tells(solid.warnings(), left_out);
        }
        let (solid, changes) =
            SolidMesh::with_repair(mesh.clone(), Inside::default(), RepairMode::Auto).expect("a solid");
        assert!((distance(&solid) - 2.0).abs() < 1e-6, "{k}: {}", distance(&solid));
        assert!(solid.is_simple() && solid.mesh().faces().len() == 12, "{k}: {:?}", solid.warnings());
        let changes = changes.expect("changes");
        let dropped: Vec<u32> = (12..mesh.faces().len() as u32).collect();
        assert_eq!(changes.repaired.report.collapsed_faces, dropped);
        assert_eq!(repair_auto(&mesh).expect("an answer"), Some(changes));
    }
    // Along an edge of the cube such a face changes no distance, and nothing is repaired.
    let mesh = with_hair((Vec::new(), vec![[6, 7, 6]]));
    let solid = SolidMesh::new(mesh.clone()).expect("a solid");
    assert!((distance(&solid) - 2.0).abs() < 1e-6);
    assert!(solid.warnings().iter().all(|d| !d.message.contains("stands out")), "{:?}", solid.warnings());
    assert!(SolidMesh::with_repair(mesh, Inside::default(), RepairMode::Auto).expect("a solid").1.is_none());
}
