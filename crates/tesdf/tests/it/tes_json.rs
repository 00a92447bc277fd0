//! JSON files of TES-Encoder: a file that was written by hand, assets that are written and read
//! again, and files that are damaged.
use std::ops::ControlFlow;

use serde_json::{Value, json};

use crate::support::meshes::encoded;
use crate::support::random::Random;
use crate::support::reference::Reference;
use crate::support::tetrahedra::{cube, grid};
use tesdf::domain::ConformingMesh;
use tesdf::encode::{Domain, EncodeOptions, Encoder, ImportJsonError, Refinement};
use tesdf::geometry::Triangle;
use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;
use tesdf::verify::{ProveOptions, ProveReport, Verdict, VerifyOptions, VerifyReport, prove, verify};
use tesdf::{Preset, Source, TeSdf};

/// A tetrahedron with three right angles, and another over its slanted face.
fn by_hand() -> Value {
    json!({
        "num_of_surface_nodes": 4, "num_of_inner_nodes": 0, "num_of_outer_nodes": 1, "num_of_faces": 4,
        "num_of_surface_inner_tetras": 1, "num_of_inner_tetras": 0, "num_of_surface_outer_tetras": 1,
        "num_of_outer_tetras": 0,
        "surface_nodes": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "inner_nodes": [], "outer_nodes": [[1.0, 1.0, 1.0]],
        "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        "surface_inner_tetras": [[0, 1, 3, 2]], "inner_tetras": [],
        "surface_outer_tetras": [[1, 2, 3, 4]], "outer_tetras": [],
        "nums_of_encoded_faces_surface_inner": [4], "encoded_faces_surface_inner": [3, 2, 1, 0],
        "nums_of_encoded_faces_inner": [], "encoded_faces_inner": [],
        "nums_of_encoded_faces_surface_outer": [1], "encoded_faces_surface_outer": [[2]],
        "nums_of_encoded_faces_outer": [], "encoded_faces_outer": [],
        "a key of another program": {"version": [1, [2]]},
    })
}

fn import(file: &Value) -> Result<TeSdf, ImportJsonError> {
    TeSdf::import_json_bytes(file.to_string().as_bytes(), &Source::default())
}

#[test]
fn a_file_by_hand_answers_from_its_lists() {
    let mut file = by_hand();
    let asset = import(&file).unwrap();
    let certificate = asset.about().certificate();
    assert_eq!((certificate.delta(), certificate.domain()), (None, "conforming"));
    assert!(certificate.encoder().contains("TES-Encoder"), "{}", certificate.encoder());
    let (inside, outside) = (DVec3::splat(0.1), DVec3::splat(0.5));
    assert!((asset.signed_distance(inside) + 0.1).abs() < 1e-15);
    assert!((asset.signed_distance(outside) - 0.5 / 3.0_f64.sqrt()).abs() < 1e-15);
    assert!(proof(&asset, 1 << 20).proved, "{:?}", proof(&asset, 1 << 20).faults);

    // The corners may be in the other order, and the lists nested or flat.
    file["surface_inner_tetras"] = json!([[0, 1, 2, 3]]);
    file["surface_outer_tetras"] = json!([[2, 1, 3, 4]]);
    file["encoded_faces_surface_inner"] = json!([[0, 1, 2, 3]]);
    file["encoded_faces_surface_outer"] = json!([2]);
    assert_eq!(import(&file).unwrap().signed_distance(outside), asset.signed_distance(outside));

    // A list that misses the nearest face is kept, and the proof finds it.
    file["encoded_faces_surface_outer"] = json!([0]);
    let asset = import(&file).unwrap();
    let off = DVec3::new(0.4, 0.4, 0.5).distance(DVec3::new(0.4, 0.4, 0.0));
    assert_eq!(asset.signed_distance(DVec3::new(0.4, 0.4, 0.5)), off);
    let found = proof(&asset, 1 << 20);
    assert_eq!((found.proved, found.distances.refuted), (false, 1));
    assert!(!compared(&asset, 40).passed);
}

fn proof(asset: &TeSdf, pieces: u64) -> ProveReport {
    prove(asset, &ProveOptions { pieces }, |_| ControlFlow::Continue(())).unwrap()
}

fn compared(asset: &TeSdf, samples: usize) -> VerifyReport {
    verify(asset, &VerifyOptions { samples, seed: 1 }, |_| ControlFlow::Continue(())).unwrap()
}

/// An asset of a block in a grid of tetrahedra.
fn block(refinement: Refinement) -> TeSdf {
    let l = |x, y, z| (1..4).contains(&x) && (1..3).contains(&z) && (y == 1 || (x < 3 && y == 2));
    let (solid, tetrahedra) = grid(5, 0.15, l);
    let domain = ConformingMesh::new(&solid, &tetrahedra).expect("conforming by construction");
    let options = EncodeOptions { refinement, byte_worth: 0.02, ..EncodeOptions::preset(Preset::Fast) };
    Encoder::new().options(options).domain(Domain::Conforming(&domain)).encode(&solid).unwrap()
}

/// The lists of all cells, by the corners of the cells.
fn lists(asset: &TeSdf) -> Vec<(Vec<[u64; 3]>, Vec<u32>)> {
    let mut lists = Vec::new();
    asset.visit_cells(|cell| {
        let mut corners = cell.corners.map(|p| p.to_array().map(f64::to_bits)).to_vec();
        corners.sort_unstable();
        lists.push((corners, asset.list_of(cell.id)));
    });
    lists.sort_unstable();
    lists
}

#[test]
fn what_is_written_and_read_again_answers_the_same() {
    for refinement in [Refinement::None, Refinement::ByCost] {
        let asset = block(refinement);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("block.json");
        asset.export_json(&path).unwrap();
        let again = TeSdf::import_json(&path).unwrap();
        assert_eq!(again.about().source.name, "block.json");
        assert_eq!(again.classes(), asset.classes());
        if refinement == Refinement::None {
            assert!(lists(&again) == lists(&asset), "lists differ");
        }
        let mut random = Random(7);
        for _ in 0..3000 {
            let p = 2.5 + 3.5 * random.in_cube();
            let (a, b) = (asset.query(p), again.query(p));
            assert!((a.signed_distance - b.signed_distance).abs() < 1e-14, "{p}: {a:?}, {b:?}");
            assert!(a.gradient.distance(b.gradient) < 1e-9 || a.face != b.face, "{p}: {a:?}, {b:?}");
        }
        // Corners are in negative order.
        let file: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let mut nodes: Vec<DVec3> = Vec::new();
        for key in ["surface_nodes", "inner_nodes", "outer_nodes"] {
            let found: Vec<[f64; 3]> = serde_json::from_value(file[key].clone()).unwrap();
            nodes.extend(found.into_iter().map(DVec3::from_array));
        }
        for group in ["surface_inner", "inner", "surface_outer", "outer"] {
            let corners: Vec<[usize; 4]> =
                serde_json::from_value(file[format!("{group}_tetras")].clone()).unwrap();
            assert_eq!(file[format!("num_of_{group}_tetras")], corners.len());
            for t in corners {
                let [a, b, c, d] = t.map(|v| nodes[v]);
                assert!((b - a).cross(c - a).dot(d - a) < 0.0, "{group}: {t:?}");
            }
        }
    }
}

/// Two tetrahedra that have one vertex in common are a solid, but no simple one: no feature alone
/// tells the sign.
#[test]
fn solids_that_touch_at_a_vertex_answer_as_brute_force() {
    let mut file = by_hand();
    file["num_of_surface_nodes"] = json!(7);
    file["num_of_faces"] = json!(8);
    file["num_of_surface_inner_tetras"] = json!(2);
    file["surface_nodes"] =
        json!([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]);
    file["faces"] =
        json!([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 4, 5], [0, 6, 4], [4, 6, 5], [5, 6, 0],]);
    file["surface_inner_tetras"] = json!([[0, 1, 3, 2], [0, 4, 5, 6]]);
    file["surface_outer_tetras"] = json!([[1, 2, 3, 7]]);
    let all = [0, 1, 2, 3, 4, 5, 6, 7];
    file["nums_of_encoded_faces_surface_inner"] = json!([8, 8]);
    file["encoded_faces_surface_inner"] = json!([all, all]);
    let asset = import(&file).unwrap();

    let corners = |key: &str| -> Vec<[f64; 3]> { serde_json::from_value(file[key].clone()).unwrap() };
    let vertices = corners("surface_nodes").into_iter().map(DVec3::from_array).collect();
    let faces: Vec<[u32; 3]> = serde_json::from_value(file["faces"].clone()).unwrap();
    let reference = Reference::new(&TriangleMesh::new(vertices, faces).unwrap());
    let mut random = Random(5);
    let mut inside = 0;
    for k in 0..600 {
        // Many of the points are near the common vertex.
        let p = [1.0, 0.1, 1e-4][k % 3] * random.in_cube();
        let (found, expected) = (asset.signed_distance(p), reference.signed_distance(p));
        assert!((found - expected).abs() <= reference.tolerance_f64(p), "{p}: {found}, expected {expected}");
        inside += usize::from(found < 0.0);
    }
    assert!((60..540).contains(&inside), "{inside} inside");

    // Lists that are nested tell their own lengths, which the file may give all the same.
    file["nums_of_encoded_faces_surface_inner"] = json!([8, 7]);
    let error = import(&file).unwrap_err().to_string();
    assert!(error.contains("nums_of_encoded_faces_surface_inner[1]: 7, expected 8"), "{error}");
    file.as_object_mut().unwrap().remove("nums_of_encoded_faces_surface_inner");
    assert!(import(&file).is_ok());
}

#[test]
fn lengths_may_be_left_out_where_lists_are_nested_or_none() {
    let lists = "encoded_faces_surface_inner";
    let of_lists = "nums_of_encoded_faces_surface_inner";
    let without = |key: &str, value: Value| {
        let mut file = by_hand();
        file[lists] = value;
        file.as_object_mut().unwrap().remove(key);
        import(&file).map_err(|e| e.to_string())
    };
    let point = DVec3::splat(0.1);
    let expected = import(&by_hand()).unwrap().signed_distance(point);
    for (key, value) in [
        (of_lists, json!([[0, 1, 2, 3]])),
        (of_lists, json!([[3, 1, 2, 0, 3, 3]])),
        // A group without tetrahedra has no lists.
        ("nums_of_encoded_faces_inner", json!([0, 1, 2, 3])),
        ("encoded_faces_inner", json!([0, 1, 2, 3])),
    ] {
        assert_eq!(without(key, value.clone()).unwrap().signed_distance(point), expected, "{key}: {value}");
    }
    for (value, expected) in [
        (json!([0, 1, 2, 3]), "nums_of_encoded_faces_surface_inner"),
        (json!([[0, 1], [2, 3]]), "encoded_faces_surface_inner: 2 lists, expected 1 lists"),
        (json!([[]]), "encoded_faces_surface_inner: list 0 is empty"),
    ] {
        let error = without(of_lists, value.clone()).unwrap_err();
        assert!(error.contains(expected), "{value}: {error}");
    }
}

/// The import of an asset after one list outside the surface was cut to the face that is farthest
/// from the cell, and the cell.
fn import_with_a_wrong_list(asset: &TeSdf, at: usize) -> (TeSdf, u32) {
    let mut file: Value = serde_json::from_slice(&asset.to_json_bytes().unwrap()).unwrap();
    let numbers =
        |file: &Value, key: &str| -> Vec<usize> { serde_json::from_value(file[key].clone()).unwrap() };
    let mut rest = numbers(&file, "encoded_faces_surface_outer");
    let lengths = numbers(&file, "nums_of_encoded_faces_surface_outer");
    let mut lists: Vec<Vec<usize>> = lengths.into_iter().map(|n| rest.drain(..n).collect()).collect();
    let nodes: Vec<[f64; 3]> = ["surface_nodes", "inner_nodes", "outer_nodes"]
        .iter()
        .flat_map(|key| serde_json::from_value::<Vec<[f64; 3]>>(file[key].clone()).unwrap())
        .collect();
    let tetrahedra: Vec<[usize; 4]> = serde_json::from_value(file["surface_outer_tetras"].clone()).unwrap();
    let faces: Vec<[usize; 3]> = serde_json::from_value(file["faces"].clone()).unwrap();
    let at = at % lists.len();
    let middle = tetrahedra[at].iter().map(|&v| DVec3::from_array(nodes[v])).sum::<DVec3>() / 4.0;
    let far = |f: usize| {
        let corners = faces[f].map(|v| DVec3::from_array(nodes[v]));
        Triangle::new(corners).closest(middle).distance
    };
    let wrong = (0..faces.len()).max_by(|&a, &b| far(a).total_cmp(&far(b))).unwrap();
    lists[at] = vec![wrong];
    file["encoded_faces_surface_outer"] = json!(lists);
    file.as_object_mut().unwrap().remove("nums_of_encoded_faces_surface_outer");
    let asset = import(&file).unwrap();
    let mut found = None;
    asset.visit_cells(|cell| {
        let centroid = cell.corners.into_iter().sum::<DVec3>() / 4.0;
        if centroid.distance(middle) < 1e-12 {
            found = Some(cell.id);
        }
    });
    (asset, found.unwrap())
}

#[test]
fn a_wrong_list_among_many_does_not_pass_and_is_named_with_its_amount() {
    let good = block(Refinement::None);
    let bytes = good.to_json_bytes().unwrap();
    let again = TeSdf::import_json_bytes(&bytes, &Source::default()).unwrap();
    let report = compared(&again, 200);
    assert!(report.passed && !report.certified, "{report:#?}");
    assert_eq!((report.cells, report.cell_points), (report.listed_cells, 4 * 200));
    for precision in &report.precisions {
        let points: usize = precision.classes.iter().map(|c| c.points).sum();
        assert_eq!(points, 200 + report.cell_points, "each point is compared");
        assert_eq!(precision.largest_error_beyond, Some(precision.largest_error));
        assert!(precision.largest_error > 0.0 && precision.distance_mistakes == 0);
    }
    assert!(proof(&again, 1 << 20).proved, "{:?}", proof(&again, 1 << 20).faults);

    let mut random = Random(11);
    for turn in 0..12 {
        let (asset, wrong_cell) = import_with_a_wrong_list(&good, random.index(10_000));
        let report = compared(&asset, 200);
        assert!(!report.passed && report.precisions.iter().all(|p| !p.passed), "{turn}: {report:#?}");
        for precision in &report.precisions {
            assert!(precision.distance_mistakes > 0 && precision.largest_error > 0.1, "{precision:#?}");
            assert_eq!(precision.largest_error_beyond, Some(precision.largest_error));
        }
        // With one piece, more cells are undecided than are listed, but no refuted one is left out.
        for pieces in [1 << 20, 1] {
            let found = proof(&asset, pieces);
            let refuted: Vec<_> = found.faults.iter().filter(|f| f.verdict == Verdict::Refuted).collect();
            assert_eq!(
                (found.distances.refuted, refuted.len(), found.signs.refuted),
                (1, 1, 0),
                "{found:#?}"
            );
            let (cell, by) = (refuted[0].cell.unwrap(), refuted[0].nearer_by.unwrap());
            assert!(
                cell == wrong_cell && by > 0.1 && found.nearer_by == Some(by),
                "{wrong_cell}: {found:#?}"
            );
            assert_eq!(found.faults[0], *refuted[0], "refuted cells come first");
            let undecided = found.faults.len() - 1;
            assert_eq!(undecided, found.distances.undecided.min(ProveReport::UNDECIDED));
            assert_eq!((undecided > 0, found.out_of_pieces > 0), (pieces == 1, pieces == 1));
            assert_eq!((found.proved, found.signs.undecided), (false, 0));
        }
    }
}

#[test]
fn the_bisection_domain_is_not_written() {
    let (solid, _) = cube();
    let asset = encoded(&solid);
    let error = asset.to_json_bytes().unwrap_err().to_string();
    assert!(error.contains("--domain gmsh"), "{error}");
}

#[test]
fn errors_name_the_key_and_the_place() {
    let changed = |key: &str, value: Value| {
        let mut file = by_hand();
        file[key] = value;
        import(&file).unwrap_err().to_string()
    };
    for (key, value, expected) in [
        ("num_of_faces", json!(5), "num_of_faces: 5, expected 4"),
        ("num_of_faces", json!(-5), "num_of_faces: "),
        ("num_of_outer_tetras", json!(1e300), "num_of_outer_tetras: "),
        ("faces", json!([[0, 2, 1], [0, 1, 4], [1, 2, 3], [2, 0, 3]]), "faces[1]: node 4, expected below 4"),
        ("faces", json!([[0, 2, 1], [0, 1]]), "faces[1]: "),
        ("faces", json!([[0, 2, 1], [0, 1, 3, 2]]), "faces[1]: "),
        ("faces", json!([[0, 2, 1]]), "num_of_faces: 4, expected 1"),
        ("surface_inner_tetras", json!([[0, 1, 2, 5]]), "surface_inner_tetras[0]: node 5, expected below 5"),
        ("surface_inner_tetras", json!([[0, 1, 2, 4294967296_u64]]), "surface_inner_tetras[0]: "),
        ("surface_inner_tetras", json!("text"), "surface_inner_tetras: "),
        ("surface_nodes", json!([[0, 0, 0], [1, 0, null]]), "surface_nodes[1]: "),
        (
            "encoded_faces_surface_inner",
            json!([0, 1, 2, 4]),
            "encoded_faces_surface_inner[3]: face 4, expected below 4",
        ),
        ("encoded_faces_surface_inner", json!([[0, 1, 2, 4]]), "encoded_faces_surface_inner[0]: face 4"),
        ("encoded_faces_surface_inner", json!([0, 1, 2]), "encoded_faces_surface_inner: 3 faces, expected 4"),
        ("encoded_faces_surface_inner", json!([0, [1, 2]]), "encoded_faces_surface_inner[1]: "),
        ("encoded_faces_surface_inner", json!([[0, [1], 2]]), "encoded_faces_surface_inner[0]: "),
        (
            "encoded_faces_surface_inner",
            json!([[0], [1, 2]]),
            "nums_of_encoded_faces_surface_inner[0]: 4, expected 1",
        ),
        (
            "nums_of_encoded_faces_surface_inner",
            json!([1, 3]),
            "nums_of_encoded_faces_surface_inner: 2 numbers, expected 1",
        ),
        (
            "nums_of_encoded_faces_surface_outer",
            json!([0]),
            "nums_of_encoded_faces_surface_outer[0]: 0, expected 1",
        ),
        ("surface_outer_tetras", json!([[0, 1, 2, 4]]), "orientation"),
    ] {
        let error = changed(key, value);
        assert!(error.contains(expected) || expected == "orientation", "{key}: {error}; expected {expected}");
    }
    let mut file = by_hand();
    file["surface_inner_tetras"] = file["surface_outer_tetras"].clone();
    file["surface_outer_tetras"] = json!([[0, 1, 2, 3]]);
    let error = import(&file).unwrap_err().to_string();
    assert!(error.contains("surface_inner_tetras[0]: a tetrahedron outside"), "{error}");
    for key in ["surface_nodes", "outer_nodes", "faces", "inner_tetras", "encoded_faces_surface_outer"] {
        let mut file = by_hand();
        file.as_object_mut().unwrap().remove(key);
        assert!(import(&file).unwrap_err().to_string().contains(key), "{key}");
    }
    let error = TeSdf::import_json("/nowhere/a.json").unwrap_err().to_string();
    assert!(error.contains("/nowhere/a.json"), "{error}");
}

#[test]
fn damaged_text_is_refused() {
    let text = by_hand().to_string();
    let import = |text: &str| TeSdf::import_json_bytes(text.as_bytes(), &Source::default());
    assert!(import(&text).is_ok());
    for end in 0..text.len() {
        let error = import(&text[..end]).expect_err("it is cut short").to_string();
        assert!(error.len() > 20, "{error}");
    }
    // Any number may have any value.
    let bytes = text.as_bytes();
    let digits: Vec<usize> = (0..bytes.len()).filter(|&i| bytes[i].is_ascii_digit()).collect();
    for huge in ["4294967295", "18446744073709551615", "1e999", "-1", "NaN", "[[[[1]]]]", "\"1\""] {
        for &at in &digits {
            let _ = import(&format!("{}{huge}{}", &text[..at], &text[at + 1..]));
        }
    }
    let deep = |n: usize| format!("{{\"x\":{}", "[".repeat(n));
    assert!(import(&deep(1_000_000)).unwrap_err().to_string().contains("line 1"));
    let deep = format!("{{\"inner_tetras\":{}", "[".repeat(1_000_000));
    assert!(import(&deep).unwrap_err().to_string().contains("inner_tetras[0]"));
    let twice = text.replacen('{', "{\"faces\":[],", 1);
    assert!(import(&twice).unwrap_err().to_string().contains("faces is given twice"));
    assert!(import(&(text + "{}")).is_err());
}
