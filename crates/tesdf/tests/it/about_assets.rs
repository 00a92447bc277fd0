//! What an asset says of itself and of its parts: a repair in words, the lists of cells, the
//! corners of the mesh, the bytes to save.
use std::borrow::Cow;

use crate::support::meshes::encoded;
use crate::support::parts::Parts;
use crate::support::parts::Turn::Outward;
use crate::support::shapes::Shape;
use serde_json::json;
use tesdf::asset::about::Repair;
use tesdf::asset::{CellKind, Section, layout, write_container};
use tesdf::base::{Inside, InsideRule};
use tesdf::collide::{ClearanceOptions, Instance, Pose, Scene, Shape as Body, clearance};
use tesdf::encode::{EncodeOptions, Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf::{Source, TeSdf};

#[test]
fn a_repair_is_told_in_one_line() {
    let none = Repair::default();
    let some = Repair {
        flags: "--fill-holes".into(),
        welded_vertices: 1,
        dropped_faces: 2,
        reversed_faces: 1,
        filled_holes: 3,
        filled_area: 0.25,
        ..Repair::default()
    };
    let one = Repair { split_edges: 1, filled_holes: 1, filled_area: 1e-6, ..Repair::default() };
    for (repair, expected) in [
        (none, "as by `tesdf repair`"),
        (
            some,
            "as by `tesdf repair --fill-holes`; 1 vertex merged; 2 faces dropped; 1 face reversed; \
             3 holes filled, area 2.500e-1",
        ),
        (one, "as by `tesdf repair`; 1 edge split; 1 hole filled, area 1.000e-6"),
    ] {
        assert_eq!(repair.to_string(), expected);
    }
}

#[test]
fn cells_have_lists_and_other_ids_have_none() {
    // Between the ball and the region is no part of the domain.
    let regions = vec![[3.0, 3.0, 3.0, 3.5, 3.5, 3.5]];
    let options = EncodeOptions { regions, ..EncodeOptions::preset(Preset::Fast) };
    let ball = Shape::default().add_sphere(DVec3::ZERO, 1, || 1.0).solid();
    let asset = Encoder::new().options(options).encode(&ball).expect("valid options");
    let (mut listed, mut others, mut last) = (0, 0, 0);
    asset.visit_cells(|cell| {
        let list = asset.list_of(cell.id);
        assert_eq!(list.len(), cell.list_length, "{cell:?}");
        assert!(list.is_sorted() && list.iter().all(|&face| (face as usize) < asset.face_count()));
        assert_eq!(cell.kind.is_listed(), !list.is_empty(), "{cell:?}");
        *if cell.kind.is_listed() { &mut listed } else { &mut others } += 1;
        assert!(cell.kind != CellKind::Crossing || cell.list_length > 0);
        last = last.max(cell.id);
    });
    assert!(listed > 10 && others > 0, "{listed} listed cells, {others} others");
    // The first root is bisected, so it is no cell. Other words do not exist.
    for id in [0, last + 1, last + 2, u32::MAX] {
        assert!(asset.list_of(id).is_empty(), "{id}");
    }
}

#[test]
fn an_asset_that_did_not_move_is_saved_as_it_was_opened() {
    let asset = encoded(&Shape::default().add_box(DVec3::ZERO, DVec3::ONE, 1).solid());
    let bytes = asset.to_bytes().expect("the bytes");
    assert!(matches!(bytes, Cow::Borrowed(same) if std::ptr::eq(same, asset.as_bytes())));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("box.tesdf");
    asset.save(&path).expect("a writable folder");
    assert_eq!(std::fs::read(&path).expect("the file"), asset.as_bytes());
}

#[test]
fn devices_detect_assets_whose_field_does_not_jump() {
    let cup = Parts::default().open_cube(DVec3::ZERO, 1.0, Outward).mesh();
    for (rule, expected) in [(InsideRule::Generalized, false), (InsideRule::Sheet { thickness: 0.1 }, true)] {
        let solid = SolidMesh::with_inside(cup.clone(), Inside::new(rule)).expect("any mesh");
        assert_eq!(encoded(&solid).is_detected_on_devices(), expected, "{rule:?}");
    }
    let closed = SolidMesh::new(Parts::default().cube(DVec3::ZERO, 1.0, Outward).mesh()).expect("a solid");
    assert!(encoded(&closed).is_detected_on_devices());
}

/// A tetrahedron with three right angles, and two vertices that no face has.
fn corner() -> TriangleMesh {
    let vertices = vec![DVec3::NEG_ONE, DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
    TriangleMesh::new(vertices, vec![[1, 3, 2], [1, 2, 4], [2, 3, 4], [3, 1, 4]]).expect("valid ids")
}

#[test]
fn corners_are_clear_up_to_the_nearest_other_side() {
    let asset = encoded(&SolidMesh::new(corner()).expect("a solid"));
    let cones = asset.corner_cones();
    // From the right angle to the slanted edges, and from the tips to the edges across.
    let expected = [0.0, 0.5_f32.sqrt(), 1.0, 1.0, 1.0, 0.0];
    for (vertex, (found, expected)) in cones.iter().zip(expected).enumerate() {
        assert!((found - expected).abs() < 1e-6, "vertex {vertex}: {found}, expected {expected}");
    }
}

/// A hostile file can have any finite positions.
#[test]
fn corners_whose_lengths_overflow_are_not_clear() {
    let asset = encoded(&SolidMesh::new(corner()).expect("a solid"));
    let [at, p, q] = asset.face_vertices(0).map(|v| v as usize);
    let mut vertices = vec![[0.0; 3]; 6];
    vertices[p] = [1e160, 0.0, 0.0];
    vertices[q] = [2e160, 1e-100, 0.0];
    let sections: Vec<Section> = asset
        .container()
        .sections()
        .map(|s| if s.spec == layout::VERTICES { Section::new(s.spec, &vertices) } else { s })
        .collect();
    let bytes = write_container(&sections, asset.container().metadata()).expect("whole rows");
    let hostile = TeSdf::from_bytes(&bytes).expect("finite positions open");
    assert_eq!(hostile.corner_cones()[at], 0.0);
}

/// The tetrahedron with the lists of a file that nobody proved: inside all faces, outside one of
/// them.
fn imported(outside: u32) -> TeSdf {
    let file = json!({
        "surface_nodes": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "inner_nodes": [], "outer_nodes": [[1, 1, 1]],
        "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        "surface_inner_tetras": [[0, 1, 3, 2]], "inner_tetras": [],
        "surface_outer_tetras": [[1, 2, 3, 4]], "outer_tetras": [],
        "encoded_faces_surface_inner": [[0, 1, 2, 3]], "encoded_faces_surface_outer": [[outside]],
    });
    TeSdf::import_json_bytes(file.to_string().as_bytes(), &Source::default()).expect("it conforms")
}

#[test]
fn points_a_little_outside_of_all_tetrahedra_are_of_none() {
    let asset = imported(2);
    // The middle of a slanted side of the tetrahedron outside.
    let middle = DVec3::new(2.0, 2.0, 1.0) / 3.0;
    let out = DVec3::new(1.0, 1.0, -1.0).normalize();
    for (by, is_in) in [(-1e-3, true), (-1e-10, true), (1e-14, true), (1e-10, false), (1e-3, false)] {
        let p = middle + by * out;
        assert_eq!(asset.query_in_domain(p).is_some(), is_in, "{by:e}");
        // The answer is the same wherever it comes from.
        let expected = (p.x + p.y + p.z - 1.0) / 3.0_f64.sqrt();
        assert!((asset.signed_distance(p) - expected).abs() < 1e-14, "{by:e}");
    }
}

/// Detection does not rely on lists that are not proved.
#[test]
fn wrong_lists_do_not_change_the_clearance_of_bodies() {
    let to_the_ball = |asset: TeSdf| {
        let mut scene = Scene::new();
        let [asset, ball] = [asset.into(), Body::Sphere { radius: 0.05 }]
            .map(|shape: Body| scene.add_shape(shape).expect("a shape"));
        let asset = scene.add(Instance::new(asset, Pose::IDENTITY)).expect("an instance");
        let ball = Instance::new(ball, Pose::at(DVec3::splat(0.5)));
        let ball = scene.add(ball).expect("an instance");
        clearance(&scene, asset, ball, &ClearanceOptions::default()).expect("one").distance
    };
    let expected = 0.5 / 3.0_f64.sqrt() - 0.05;
    for outside in 0..4 {
        let asset = imported(outside);
        let by_list = asset.signed_distance(DVec3::splat(0.5)) - 0.05;
        assert_eq!((by_list - expected).abs() < 1e-9, outside == 2, "{outside}: {by_list}");
        let found = to_the_ball(asset);
        assert!((found - expected).abs() < 1e-7, "{outside}: {found}, expected {expected}");
    }
}
