//! The changes and reports of `repair`, and what it leaves unchanged.
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use tesdf::{
    glam::DVec3,
    mesh::{
        DefectKind, RepairError, RepairOptions, Repaired, SolidMesh, TriangleMesh, WindingNumber, check,
        read, repair,
    },
};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn load(name: &str) -> TriangleMesh {
    read(data(name)).unwrap_or_else(|e| panic!("{name}: {e}")).mesh
}

fn repaired(mesh: &TriangleMesh) -> Repaired {
    repair(mesh, &RepairOptions::DEFAULT).unwrap_or_else(|e| panic!("{e}"))
}

fn welding(tolerance: f64) -> RepairOptions {
    RepairOptions { weld_tolerance: Some(tolerance), ..RepairOptions::DEFAULT }
}

fn solid(repaired: &Repaired) -> SolidMesh {
    assert!(repaired.report.encodable && repaired.report.remaining.is_empty(), "{}", repaired.report);
    SolidMesh::new(repaired.mesh.clone()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn reversed_faces_are_named() {
    let fixed = repaired(&load("bad/mixed_winding.obj"));
    assert_eq!(fixed.report.reversed_faces, [3, 50, 51, 200]);
    assert!(solid(&fixed).is_simple());

    let fixed = repaired(&load("bad/flipped_all.obj"));
    assert_eq!(fixed.report.reversed_faces, (0..320).collect::<Vec<_>>());
    assert!(solid(&fixed).is_simple());
}

#[test]
fn duplicates_and_collapsed_faces_are_dropped() {
    let fixed = repaired(&load("bad/duplicate_faces.obj"));
    assert_eq!(fixed.report.duplicate_faces, [[320, 10], [321, 20], [322, 21]]);
    assert!(solid(&fixed).is_simple());

    let fixed = repaired(&load("bad/zero_area_repeated_index.obj"));
    assert_eq!(fixed.report.collapsed_faces, [12, 13]);
    assert!(solid(&fixed).is_simple());
}

/// A tetrahedron with one face present twice and once reversed.
#[test]
fn a_duplicate_that_closes_the_surface_stays() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].to_vec();
    let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 2, 3], [1, 3, 2]];
    let mesh = TriangleMesh::new(corners, faces).expect("valid ids");
    let repaired = repaired(&mesh);
    assert!(repaired.report.duplicate_faces.is_empty() && repaired.report.encodable, "{:?}", repaired.report);
}

#[test]
fn t_junctions_are_split() {
    let fixed = repaired(&load("bad/t_junction.obj"));
    let [split] = &fixed.report.split_edges[..] else { panic!("{}", fixed.report) };
    assert_eq!(
        (split.edge, &split.at[..], &split.faces[..], split.distance),
        ([4, 6], &[8][..], &[8][..], 0.0)
    );
    assert_eq!(fixed.mesh.faces().len(), 14);
    assert!(solid(&fixed).is_simple());
    assert!(fixed.report.to_string().contains("4-6 at 8 (face 8"), "{}", fixed.report);
}

#[test]
fn a_collinear_face_goes_when_its_neighbours_are_split() {
    // The collinear face of the file closes the mesh, so nothing is repaired.
    let capped = load("bad/zero_area_cap.obj");
    let fixed = repaired(&capped);
    assert!(fixed.report.is_unchanged());
    assert_eq!(fixed.mesh, capped);
    // Without this face there is a T-junction.
    let open = TriangleMesh::new(capped.vertices().to_vec(), capped.faces()[..13].to_vec()).unwrap();
    assert!(solid(&repaired(&open)).is_simple());
    // Reversed, the face closes nothing. Its long edge is split at its own middle corner.
    let mut faces = capped.faces().to_vec();
    faces[13].swap(1, 2);
    let spoiled = TriangleMesh::new(capped.vertices().to_vec(), faces).unwrap();
    assert!(!check(&spoiled).encodable);
    let fixed = repaired(&spoiled);
    assert_eq!((&fixed.report.vanished_faces[..], fixed.mesh.faces().len()), (&[13][..], 14));
    assert!(solid(&fixed).is_simple());
}

#[test]
fn a_shell_inside_another_becomes_a_cavity() {
    let fixed = repaired(&load("bad/cavity_inverted.obj"));
    assert_eq!(fixed.report.reversed_faces, (12..24).collect::<Vec<_>>());
    assert!(solid(&fixed).is_simple());
    assert_eq!(WindingNumber::new(&fixed.mesh).at(DVec3::splat(0.01)), 0);
}

#[test]
fn near_vertices_merge_only_with_a_weld_tolerance() {
    let soup = load("bad/soup_jitter.obj");
    assert!(!repaired(&soup).report.encodable);
    let fixed = repair(&soup, &welding(1e-8)).unwrap();
    assert_eq!(fixed.report.welded_vertices.len(), 960 - 162);
    assert_eq!(fixed.mesh.vertices().len(), 162);
    assert!(solid(&fixed).is_simple());
    assert!(fixed.report.to_string().contains("798 vertices merged"), "{}", fixed.report);

    let gap = load("bad/t_junction_gap.obj");
    let left = repaired(&gap).report;
    assert!(left.is_unchanged() && !left.encodable);
    assert!(left.remaining.iter().all(|d| d.kind == DefectKind::OpenEdge));
    assert!(!repair(&gap, &welding(2e-6)).unwrap().report.encodable);
    assert!(solid(&repair(&gap, &welding(3e-6)).unwrap()).is_simple());
}

#[test]
fn unrepairable_meshes_are_unchanged_and_reported() {
    for name in ["open_holes", "open_half", "duplicate_face_reversed", "internal_fin"] {
        let mesh = load(&format!("bad/{name}.obj"));
        let left = repaired(&mesh);
        assert!(!left.report.encodable && !left.report.remaining.is_empty(), "{name}");
        assert_eq!(left.mesh, mesh, "{name} changed");
    }
    for name in ["huge_1e200", "denormal_1e-310"] {
        let result = repair(&load(&format!("bad/{name}.obj")), &RepairOptions::DEFAULT);
        assert!(matches!(result, Err(RepairError::OutOfRange(_))), "{name}");
    }
}

#[test]
fn good_meshes_are_unchanged() {
    for name in
        ["cavity", "three_components", "polygon_concave", "nonmanifold_edge", "nonmanifold_vertex", "quads"]
    {
        let mesh = load(&format!("bad/{name}.obj"));
        let same = repaired(&mesh);
        assert!(same.report.is_unchanged(), "{name}: {}", same.report);
        assert_eq!(same.mesh, mesh, "{name}");
    }
}

#[test]
fn crossing_shells_keep_their_orientation() {
    let mesh = load("bad/two_boxes_overlap.obj");
    let mut faces = mesh.faces().to_vec();
    // The second box is inverted completely, and one face of the first box is reversed.
    faces[12..].iter_mut().for_each(|f| f.swap(0, 1));
    faces[5].swap(0, 1);
    let fixed = repaired(&TriangleMesh::new(mesh.vertices().to_vec(), faces).unwrap());
    assert_eq!(fixed.report.reversed_faces, [5]);
    assert_eq!(fixed.report.crossing_shells.len(), 1);
    assert!(fixed.report.to_string().contains("keeps its orientation"), "{}", fixed.report);
    assert!(fixed.report.encodable, "the second box counts as outside where it is inside out");
}

#[test]
fn tolerances_must_be_positive_numbers() {
    let mesh = load("bad/cavity.obj");
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(repair(&mesh, &welding(tolerance)), Err(RepairError::Tolerance { .. })));
    }
    assert!(matches!(
        repair(&mesh, &welding(1.0)),
        Err(RepairError::NoFaceLeft { collapsed: 24, faces: 24 })
    ));
    assert!(repair(&mesh, &welding(1e-300)).unwrap().report.is_unchanged());
}

fn distance(x: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let to_edge = |a: DVec3, b: DVec3| {
        let t = (x - a).dot(b - a) / (b - a).length_squared();
        (a + t.clamp(0.0, 1.0) * (b - a)).distance(x)
    };
    let n = (b - a).cross(c - a);
    let edges = [(a, b), (b, c), (c, a)];
    if edges.iter().all(|&(a, b)| (b - a).cross(x - a).dot(n) > 0.0) {
        return ((x - a).dot(n) / n.length()).abs();
    }
    edges.map(|(a, b)| to_edge(a, b)).into_iter().fold(f64::INFINITY, f64::min)
}

#[test]
fn repaired_parts_have_the_reference_distances() {
    for name in ["factory_round_hole_8mm_subdiv_3x", "factory_rectangular_hole_8mm_subdiv_3x"] {
        let mesh = load(&format!("repair/{name}.obj"));
        let error = SolidMesh::new(mesh.clone()).unwrap_err();
        assert!(
            error.suggestion() == Some(&RepairOptions::DEFAULT) && error.to_string().contains("T-junctions"),
            "{error}"
        );
        let fixed = repaired(&mesh);
        let solid = solid(&fixed);
        let winding = WindingNumber::new(solid.mesh());
        let faces = 0..solid.mesh().faces().len();
        let largest = solid.mesh().bounds().max.abs().max(solid.mesh().bounds().min.abs()).max_element();
        let tolerance = 1e-12 * mesh.diagonal() + 4.0 * f64::EPSILON * largest;
        let mut points = 0;
        for file in [format!("repair/{name}.csv"), format!("repair/{name}_near.csv")] {
            for line in std::fs::read_to_string(data(&file)).unwrap().lines().skip(1) {
                let v: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
                let x = DVec3::new(v[0], v[1], v[2]);
                let d = faces
                    .clone()
                    .map(|f| distance(x, solid.mesh().triangle(f)))
                    .fold(f64::INFINITY, f64::min);
                let signed = if winding.at(x) >= 1 { -d } else { d };
                assert!((signed - v[3]).abs() <= tolerance, "{name} {line}: {signed}");
                points += 1;
            }
        }
        assert_eq!(points, 300);
    }
}

/// A box whose sides are grids of `n` × `n` cells with two triangles each.
fn grid_box(min: DVec3, max: DVec3, n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut ids = std::collections::BTreeMap::new();
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [0, n] {
            let mut id = |i: u32, j: u32| {
                let mut at = [0; 3];
                (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (side, i, j);
                *ids.entry(at).or_insert_with(|| {
                    let t = DVec3::new(at[0].into(), at[1].into(), at[2].into()) / f64::from(n);
                    vertices.push(min + t * (max - min));
                    vertices.len() as u32 - 1
                })
            };
            for i in 0..n {
                for j in 0..n {
                    let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
                    for [a, b, c] in [[a, b, c], [a, c, d]] {
                        faces.push(if side == 0 { [a, c, b] } else { [a, b, c] });
                    }
                }
            }
        }
    }
    (vertices, faces)
}

/// Nested boxes, the k-th inside the (k-1)-th, alternately outward and inward.
fn nested(depth: u32, n: u32) -> TriangleMesh {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for k in 0..depth {
        let (inset, first) = (f64::from(k), vertices.len() as u32);
        let (v, f) = grid_box(DVec3::splat(inset), DVec3::new(11.0, 12.0, 13.0) - inset, n);
        vertices.extend(v);
        faces.extend(
            f.iter().map(|f| f.map(|v| v + first)).map(
                |[a, b, c]| {
                    if k % 2 == 0 { [a, b, c] } else { [a, c, b] }
                },
            ),
        );
    }
    TriangleMesh::new(vertices, faces).unwrap()
}

fn sorted_faces(mesh: &TriangleMesh) -> Vec<[[u64; 3]; 3]> {
    let corner = |v: u32| mesh.vertices()[v as usize].to_array().map(f64::to_bits);
    let mut faces: Vec<_> = mesh
        .faces()
        .iter()
        .map(|f| {
            let mut corners = f.map(corner);
            let lowest = (0..3).min_by_key(|&k| corners[k]).unwrap();
            corners.rotate_left(lowest);
            corners
        })
        .collect();
    faces.sort_unstable();
    faces
}

proptest! {
    /// Faces are reversed at random, duplicate and collapsed faces are added, and everything is
    /// shuffled. Repair restores the nested shells.
    #[test]
    fn spoiled_shells_are_restored(
        depth in 1u32..5, n in 1u32..3,
        reversed in prop::collection::vec(any::<bool>(), 200), repeats in prop::collection::vec(0usize..1000, 0..6),
        order in Just((0..400usize).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        let good = nested(depth, n);
        let mut faces: Vec<[u32; 3]> = good.faces().to_vec();
        for (f, _) in faces.iter_mut().zip(&reversed).filter(|(_, r)| **r) {
            f.swap(0, 1);
        }
        for k in repeats {
            let [a, b, c] = faces[k % faces.len()];
            faces.push(if k % 3 == 0 { [a, a, c] } else { [b, c, a] });
        }
        let mut keys: Vec<usize> = (0..faces.len()).collect();
        keys.sort_by_key(|&k| order[k % 400]);
        let faces = keys.into_iter().map(|k| faces[k]).collect();
        let spoiled = TriangleMesh::new(good.vertices().to_vec(), faces).unwrap();
        let fixed = repaired(&spoiled);
        prop_assert!(fixed.report.encodable, "{}", fixed.report);
        prop_assert_eq!(sorted_faces(&fixed.mesh), sorted_faces(&good));
        prop_assert!(repaired(&fixed.mesh).report.is_unchanged());
    }

    /// Faces of a box are split at edges on one side only, some faces are reversed, and the box is
    /// rotated, so that points on edges are rounded.
    #[test]
    fn t_junctions_of_rounded_points_close(
        splits in prop::collection::vec((0usize..1000, 0u8..3, 0.05f64..0.95), 1..30),
        reversed in prop::collection::vec(0usize..1000, 0..4),
        turn in prop::array::uniform4(-1.0f64..1.0), scale in -30i32..30, shift in -100.0f64..100.0,
    ) {
        let (mut vertices, mut faces) = grid_box(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), 2);
        let turn = tesdf::glam::DQuat::from_array(turn).normalize();
        prop_assume!(turn.is_finite());
        vertices.iter_mut().for_each(|p| *p = (turn * *p + shift) * 2f64.powi(scale));
        for (k, edge, t) in splits {
            let (k, e) = (k % faces.len(), usize::from(edge));
            let [a, b, c] = [0, 1, 2].map(|i| faces[k][(e + i) % 3]);
            let (p, q) = (vertices[a as usize], vertices[b as usize]);
            vertices.push(p + t * (q - p));
            let m = vertices.len() as u32 - 1;
            faces[k] = [a, m, c];
            faces.push([m, b, c]);
        }
        for k in reversed {
            let k = k % faces.len();
            faces[k].swap(0, 1);
        }
        let mesh = TriangleMesh::new(vertices, faces).unwrap();
        prop_assert!(!check(&mesh).encodable);
        let fixed = repaired(&mesh);
        prop_assert!(fixed.report.encodable, "{}", fixed.report);
        let winding = WindingNumber::new(&fixed.mesh);
        for (x, w) in [(DVec3::new(0.5, 1.0, 1.5), 1), (DVec3::new(0.01, 0.01, 2.99), 1), (DVec3::new(1.01, 1.0, 1.0), 0)] {
            prop_assert_eq!(winding.at((turn * x + shift) * 2f64.powi(scale)), w);
        }
    }

    /// For any faces, nothing panics, and an encodable result is a solid.
    #[test]
    fn random_faces_never_panic(
        corners in prop::collection::vec(prop::array::uniform3(0i8..4), 3..10),
        faces in prop::collection::vec(prop::array::uniform3(0u32..10), 1..40),
        tolerance in prop::option::of(0.1f64..1.5),
    ) {
        let n = corners.len() as u32;
        let vertices = corners.iter().map(|c| DVec3::from_array(c.map(f64::from))).collect();
        let faces: Vec<[u32; 3]> = faces.iter().map(|f| f.map(|v| v % n)).collect();
        let mesh = TriangleMesh::new(vertices, faces).unwrap();
        let report = check(&mesh);
        let _ = report.to_string();
        let options = RepairOptions { weld_tolerance: tolerance, ..RepairOptions::DEFAULT };
        match repair(&mesh, &options) {
            Ok(fixed) => {
                let _ = fixed.report.to_string();
                prop_assert_eq!(SolidMesh::new(fixed.mesh).is_ok(), fixed.report.encodable);
            }
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}
