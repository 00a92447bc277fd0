//! Filling of holes, and the orientation of shells that meet.
use std::collections::BTreeMap;
use std::path::Path;

use proptest::prelude::*;
use tesdf::{
    glam::{DQuat, DVec3},
    mesh::{
        FillMethod, LeftReason, MeshError, RepairOptions, Repaired, ShellOrientation, SolidMesh, Topology,
        TriangleMesh, WindingNumber, read, repair,
    },
};

const FILL: RepairOptions = RepairOptions { fill_holes: Some(u32::MAX), ..RepairOptions::DEFAULT };
const ALL: RepairOptions = RepairOptions { shells: ShellOrientation::All, ..RepairOptions::DEFAULT };

fn filled(mesh: &TriangleMesh) -> Repaired {
    repair(mesh, &FILL).unwrap_or_else(|e| panic!("{e}"))
}

fn solid(found: &Repaired) -> SolidMesh {
    SolidMesh::new(found.mesh.clone()).unwrap_or_else(|e| panic!("{}\n{e}", found.report))
}

/// Six times the signed volume.
fn volume(mesh: &TriangleMesh) -> f64 {
    let middle = mesh.bounds().center();
    let term = |f: usize| {
        let [a, b, c] = mesh.triangle(f).map(|p| p - middle);
        a.dot(b.cross(c))
    };
    (0..mesh.faces().len()).map(term).sum()
}

/// A unit cube whose sides are grids of `n` × `n` squares with two triangles each. The faces of the
/// lid (z = 1) come last.
fn cube(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut ids = BTreeMap::new();
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [0, n] {
            let mut id = |i: u32, j: u32| {
                let mut at = [0; 3];
                (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (side, i, j);
                *ids.entry(at).or_insert_with(|| {
                    vertices.push(DVec3::new(at[0].into(), at[1].into(), at[2].into()) / f64::from(n));
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

fn without(mut faces: Vec<[u32; 3]>, removed: impl Fn(usize) -> bool) -> Vec<[u32; 3]> {
    let mut number = 0..;
    faces.retain(|_| !number.next().is_some_and(&removed));
    faces
}

/// A sphere of rings, whose points are moved along their radius.
fn sphere(radii: &[f64]) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (rings, around) = (6u32, 8u32);
    let mut vertices = vec![DVec3::Z, DVec3::NEG_Z];
    for i in 1..=rings {
        for j in 0..around {
            let t = std::f64::consts::PI * f64::from(i) / f64::from(rings + 1);
            let u = std::f64::consts::TAU * f64::from(j) / f64::from(around);
            let direction = DVec3::new(t.sin() * u.cos(), t.sin() * u.sin(), t.cos());
            vertices.push(direction * radii[vertices.len() % radii.len()]);
        }
    }
    let id = |i: u32, j: u32| 2 + i * around + j % around;
    let mut faces = Vec::new();
    for j in 0..around {
        faces.push([0, id(0, j), id(0, j + 1)]);
        faces.push([1, id(rings - 1, j + 1), id(rings - 1, j)]);
        for i in 0..rings - 1 {
            faces.push([id(i, j), id(i + 1, j), id(i + 1, j + 1)]);
            faces.push([id(i, j), id(i + 1, j + 1), id(i, j + 1)]);
        }
    }
    (vertices, faces)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Any faces of a sphere are missing. The filled mesh is closed, has the faces that were there,
    /// and no new vertices. The same mesh gives the same result.
    #[test]
    fn a_sphere_without_some_of_its_faces_is_closed(
        radii in prop::collection::vec(0.6f64..1.4, 50), removed in prop::collection::btree_set(0usize..96, 1..60),
    ) {
        let (vertices, faces) = sphere(&radii);
        let kept = without(faces, |f| removed.contains(&f));
        let open = TriangleMesh::new(vertices, kept).unwrap();
        let found = filled(&open);
        prop_assert!(Topology::new(found.mesh.faces()).is_closed(), "{}", found.report);
        prop_assert!(found.report.holes_left.is_empty() && !found.report.filled_holes.is_empty());
        let added: usize = found.report.filled_holes.iter().map(|hole| hole.faces).sum();
        prop_assert_eq!(found.mesh.faces().len(), open.faces().len() + added);
        prop_assert!(found.mesh.vertices().iter().all(|v| open.vertices().contains(v)));
        for hole in &found.report.filled_holes {
            let edges: usize = hole.loops.iter().map(Vec::len).sum();
            prop_assert_eq!(hole.faces, edges + 2 * hole.loops.len() - 4);
        }
        prop_assert_eq!(&filled(&open), &found);
    }

    /// Any faces of the lid of a cube are missing: flat holes that touch at vertices, have islands
    /// in them, and vertices on straight sides. The volume comes back exactly, and the lid is flat.
    #[test]
    fn flat_holes_give_back_the_volume_exactly(removed in prop::collection::btree_set(0usize..32, 1..33)) {
        let (vertices, faces) = cube(4);
        let lid = faces.len() - 32;
        let kept = without(faces, |f| f >= lid && removed.contains(&(f - lid)));
        let open = TriangleMesh::new(vertices, kept).unwrap();
        let found = filled(&open);
        let solid = solid(&found);
        prop_assert_eq!(volume(solid.mesh()), 6.0);
        prop_assert!(found.report.filled_holes.iter().all(|hole| hole.method == FillMethod::Flat));
        let area: f64 = found.report.filled_holes.iter().map(|hole| hole.area).sum();
        prop_assert_eq!(area, removed.len() as f64 / 32.0);
        prop_assert_eq!(WindingNumber::new(solid.mesh()).at(DVec3::splat(0.5)), 1);
    }

    /// The same in any position: the volume comes back within the rounding.
    #[test]
    fn turned_flat_holes_give_back_the_volume_within_rounding(
        removed in prop::collection::btree_set(0usize..32, 1..33), turn in prop::array::uniform4(-1.0f64..1.0),
        shift in prop::array::uniform3(-3.0f64..3.0),
    ) {
        let turn = DQuat::from_array(turn).normalize();
        prop_assume!(turn.is_finite());
        let (mut vertices, faces) = cube(4);
        vertices.iter_mut().for_each(|p| *p = turn * *p + DVec3::from_array(shift));
        let lid = faces.len() - 32;
        let kept = without(faces, |f| f >= lid && removed.contains(&(f - lid)));
        let found = filled(&TriangleMesh::new(vertices, kept).unwrap());
        prop_assert!((volume(solid(&found).mesh()) - 6.0).abs() < 1e-13, "{}", found.report);
    }

    /// Cubes that overlap their neighbours and have a cavity each. Any of the shells are turned
    /// inside out, and come back.
    #[test]
    fn shells_that_meet_are_turned_back(flipped in prop::collection::vec(any::<bool>(), 6)) {
        let (corners, sides) = cube(1);
        let (mut vertices, mut faces, mut expected) = (Vec::new(), Vec::new(), Vec::new());
        for (k, flip) in flipped.iter().enumerate() {
            let (solid, cavity) = (k / 2, k % 2 == 1);
            let scale = if cavity { 0.25 } else { 1.0 };
            let at = 0.75 * solid as f64 * DVec3::new(1.0, 0.125, 0.0) + if cavity { 0.3125 } else { 0.0 };
            let first = vertices.len() as u32;
            vertices.extend(corners.iter().map(|p| at + scale * *p));
            let shell = sides.iter().map(|f| f.map(|v| v + first));
            let inward = |f: [u32; 3]| [f[0], f[2], f[1]];
            expected.extend(shell.clone().map(|f| if cavity { inward(f) } else { f }));
            faces.extend(shell.map(|f| if cavity != *flip { inward(f) } else { f }));
        }
        let mesh = TriangleMesh::new(vertices.clone(), faces).unwrap();
        let found = repair(&mesh, &ALL).unwrap();
        let turned: Vec<_> = found.mesh.faces().iter().map(|f| [f[0], f[1].min(f[2]), f[1].max(f[2])]).collect();
        let unturned: Vec<_> = expected.iter().map(|f| [f[0], f[1].min(f[2]), f[1].max(f[2])]).collect();
        prop_assert_eq!(turned, unturned);
        prop_assert_eq!(volume(&found.mesh), volume(&TriangleMesh::new(vertices, expected).unwrap()));
        prop_assert!(found.report.encodable && found.report.crossing_shells.is_empty());
    }
}

#[test]
fn a_single_face_comes_back() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bad/open_holes.obj");
    let open = read(path).unwrap().mesh;
    let found = filled(&open);
    assert!(solid(&found).is_simple());
    assert_eq!(found.report.filled_holes.len(), 3);
    let text = found.report.to_string();
    assert!(text.contains("3 holes filled (0-based): ") && text.contains("(3 edges, flat, area "), "{text}");
}

/// A fan of faces is missing, the apex with it. The fill has no vertex in its middle.
#[test]
fn a_missing_fan_is_filled() {
    let (vertices, faces) = sphere(&[1.0]);
    let kept = without(faces.clone(), |f| faces[f].contains(&0));
    let found = filled(&TriangleMesh::new(vertices, kept).unwrap());
    assert!(solid(&found).is_simple());
    assert_eq!((found.report.filled_holes[0].faces, found.report.unused_vertices), (6, 1));
}

/// Two missing faces touch at a vertex: each is a hole of its own, with the face that was there.
#[test]
fn holes_that_touch_at_a_vertex_are_filled_one_by_one() {
    let (vertices, faces) = sphere(&[1.0, 1.1, 0.9]);
    let [at, other] = [0, 4 * 12].map(|f: usize| faces[f]);
    assert!(at.contains(&0) && other.contains(&0), "{at:?} {other:?}");
    let whole = TriangleMesh::new(vertices.clone(), faces.clone()).unwrap();
    let kept = without(faces, |f| f == 0 || f == 48);
    let found = filled(&TriangleMesh::new(vertices, kept).unwrap());
    assert_eq!(found.report.filled_holes.len(), 2);
    assert!((volume(&found.mesh) - volume(&whole)).abs() < 1e-14);
}

#[test]
fn larger_holes_are_left_open_and_named() {
    let (vertices, faces) = cube(2);
    let lid = faces.len() - 8;
    // A face of the bottom and the whole lid, which has eight edges.
    let bottom = lid - 8;
    let open = TriangleMesh::new(vertices, without(faces, |f| f >= lid || f == bottom)).unwrap();
    let found = repair(&open, &RepairOptions { fill_holes: Some(7), ..RepairOptions::DEFAULT }).unwrap();
    assert_eq!(found.report.filled_holes.len(), 1);
    let [left] = &found.report.holes_left[..] else { panic!("{}", found.report) };
    assert_eq!((left.vertices.len(), left.reason), (8, LeftReason::TooManyEdges));
    assert!(!found.report.encodable);
    assert!(found.report.to_string().contains("1 hole left open (0-based): "), "{}", found.report);
    assert_eq!(volume(solid(&filled(&open)).mesh()), 6.0);
}

/// Holes of a bent surface with more than 300 edges are filled in pieces.
#[test]
fn a_large_bent_hole_is_filled_in_pieces() {
    let n = 400;
    let at = |k: u32, z: f64| {
        let angle = std::f64::consts::TAU * f64::from(k % n) / f64::from(n);
        DVec3::new(angle.cos(), angle.sin(), z + 0.2 * (3.0 * angle).cos())
    };
    let vertices = [0.0, 1.0].iter().flat_map(|&z| (0..n).map(move |k| at(k, z))).collect();
    let quad = |k: u32| {
        let [a, b] = [k, (k + 1) % n];
        [[a, b, n + b], [a, n + b, n + a]]
    };
    let tube = TriangleMesh::new(vertices, (0..n).flat_map(quad).collect()).unwrap();
    let found = filled(&tube);
    let methods: Vec<_> = found.report.filled_holes.iter().map(|hole| hole.method).collect();
    assert_eq!(methods, [FillMethod::Pieces; 2]);
    // The lids are alike, so the volume is nearly that of a straight tube.
    let expected = 6.0 * std::f64::consts::PI;
    assert!((volume(solid(&found).mesh()) / expected - 1.0).abs() < 0.1, "{}", volume(&found.mesh));
}

#[test]
fn one_sided_surfaces_are_left_alone() {
    let vertices: Vec<DVec3> = (0..10)
        .map(|i| {
            let t = std::f64::consts::TAU * f64::from(i / 2) / 5.0;
            let across = if i % 2 == 0 { -0.3 } else { 0.3 };
            let (u, v) = (across * (0.5 * t).cos(), across * (0.5 * t).sin());
            DVec3::new((1.0 + u) * t.cos(), (1.0 + u) * t.sin(), v)
        })
        .collect();
    // The strip closes with a half turn: vertex 10 is vertex 1, vertex 11 is vertex 0.
    let id = |i: u32| if i < 10 { i } else { 11 - i };
    let faces = (0..10)
        .map(|i| if i % 2 == 0 { [id(i), id(i + 1), id(i + 2)] } else { [id(i + 1), id(i), id(i + 2)] });
    let strip = TriangleMesh::new(vertices, faces.collect()).unwrap();
    let found = filled(&strip);
    assert_eq!(found.mesh.faces().len(), 10);
    let [left] = &found.report.holes_left[..] else { panic!("{}", found.report) };
    assert_eq!(left.reason, LeftReason::OneSided);
    assert!(found.report.to_string().contains("one-sided, as a Moebius strip is"), "{}", found.report);
    assert!(!found.report.encodable);
}

#[test]
fn a_triangle_alone_gets_its_reverse_and_has_no_inside() {
    let alone = TriangleMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]).unwrap();
    let found = filled(&alone);
    assert!(Topology::new(found.mesh.faces()).is_closed() && !found.report.encodable, "{}", found.report);
    assert_eq!(TriangleMesh::new(vec![DVec3::ZERO], Vec::new()), Err(MeshError::Empty));
}

/// Two tetrahedra with a common side, which is there twice. No edge around it has two faces, so
/// neighbours say nothing about the lower tetrahedron, which is inside out.
#[test]
fn surfaces_agree_over_edges_with_four_faces() {
    let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Z];
    let mut faces = vec![[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1], [0, 1, 2]];
    faces.extend([[1, 0, 4], [2, 1, 4], [0, 2, 4]].map(|[a, b, c]| [b, a, c]));
    let mesh = TriangleMesh::new(vertices, faces).unwrap();
    assert!(!repair(&mesh, &RepairOptions::DEFAULT).unwrap().report.encodable);
    let found = repair(&mesh, &ALL).unwrap();
    assert_eq!(found.report.paired_edges, [[0, 1], [0, 2], [1, 2]]);
    assert!((volume(solid(&found).mesh()) - 2.0).abs() < 1e-15, "{}", found.report);
    assert!(found.report.to_string().contains("paired by angle"), "{}", found.report);
}
