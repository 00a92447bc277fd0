//! Reads glTF: buffers, transforms, primitive modes, and errors that name the element.

use crate::sample::{DATA_URI, glb, json, tetrahedron_buffer};
use tesdf::glam::DVec3;
use tesdf::mesh::{LoadedMesh, MeshFormat, read, read_bytes, source_blake3};

const NODE: &str = r#"{"mesh":0}"#;

fn load(text: &str) -> LoadedMesh {
    read_bytes(text.as_bytes(), MeshFormat::Gltf).unwrap()
}

fn volume6(loaded: &LoadedMesh) -> f64 {
    (0..loaded.mesh.faces().len()).map(|f| loaded.mesh.triangle(f)).map(|[a, b, c]| a.dot(b.cross(c))).sum()
}

#[test]
fn embedded_and_external_buffers_agree() {
    let embedded = load(&json(DATA_URI, NODE));
    assert_eq!(embedded.mesh.vertices(), [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
    assert_eq!(embedded.mesh.faces(), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
    let binary = read_bytes(&glb(&json("", NODE), &tetrahedron_buffer()), MeshFormat::Glb).unwrap();
    assert_eq!(binary.mesh, embedded.mesh);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.gltf");
    std::fs::write(&path, json(r#""uri":"part%20a.bin","#, NODE)).unwrap();
    let missing = read(&path).unwrap_err().to_string();
    assert!(missing.contains("buffers[0]") && missing.contains("part a.bin"), "{missing}");
    std::fs::write(folder.path().join("part a.bin"), tetrahedron_buffer()).unwrap();
    let external = read(&path).unwrap();
    assert_eq!(external.mesh, embedded.mesh);
    let only_json = blake3::hash(&std::fs::read(&path).unwrap());
    assert_ne!(external.report.source_blake3, only_json.to_hex().as_str(), "the buffer is hashed too");
    assert_eq!(source_blake3(&path).unwrap(), external.report.source_blake3);
}

#[test]
fn transforms_compose_and_mirrored_faces_still_point_outward() {
    // A scale of 0.001 means the decimal number, although the JSON is read in f32.
    let nodes = r#"{"translation":[1,2,3],"children":[1]},{"mesh":0,"scale":[0.001,0.001,0.001]}"#;
    let loaded = load(&json(DATA_URI, nodes));
    assert_eq!(loaded.mesh.vertices()[1], DVec3::new(1.001, 2.0, 3.0));
    let nodes = r#"{"mesh":0,"scale":[-2,1,1]}"#;
    let mirrored = load(&json(DATA_URI, nodes));
    assert_eq!(volume6(&mirrored), 2.0);
    let nodes = r#"{"mesh":0,"matrix":[0,1,0,0, -1,0,0,0, 0,0,1,0, 5,0,0,1]}"#;
    let turned = load(&json(DATA_URI, nodes));
    assert_eq!(turned.mesh.vertices()[1], DVec3::new(5.0, 1.0, 0.0));
    let nodes = r#"{"mesh":0,"rotation":[0,0,0.70710677,0.70710677]}"#;
    let turned = load(&json(DATA_URI, nodes));
    assert!(turned.mesh.vertices()[1].distance(DVec3::Y) < 1e-15);
}

#[test]
fn strips_fans_lists_and_sparse_positions() {
    let buffer = tetrahedron_buffer();
    // Without indices, the four vertices are a strip or a fan of two triangles.
    let bare = |mode: u32| json("", NODE).replace(r#","indices":1"#, &format!(r#","mode":{mode}"#));
    let read_glb = |text: &str| read_bytes(&glb(text, &buffer), MeshFormat::Glb);
    assert_eq!(read_glb(&bare(5)).unwrap().mesh.faces(), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(read_glb(&bare(6)).unwrap().mesh.faces(), [[0, 1, 2], [0, 2, 3]]);
    let error = read_glb(&bare(4)).unwrap_err().to_string();
    assert!(error.contains("meshes[0].primitives[0]") && error.contains("4 corners"), "{error}");
    let error = read_glb(&bare(1)).unwrap_err().to_string();
    assert!(error.contains("no face"), "{error}");

    // A sparse accessor replaces the position of vertex 3 by that of vertex 1.
    let sparse = json("", NODE).replace(
        r#""count":4,"#,
        r#""count":4,"sparse":{"count":1,"indices":{"bufferView":1,"byteOffset":5,"componentType":5121},
           "values":{"bufferView":0,"byteOffset":12}},"#,
    );
    let loaded = read_glb(&sparse).unwrap();
    assert_eq!((loaded.mesh.vertices().len(), loaded.report.welded_vertices), (3, 1));
}

#[test]
fn materials_textures_and_bounds_are_ignored() {
    let text = json(DATA_URI, NODE).replace(r#","min":[0,0,0],"max":[1,1,1]"#, "").replace(
        r#""scene":0"#,
        r#""extensionsRequired":["KHR_materials_unlit"],"textures":[{"source":3}],"scene":0"#,
    );
    assert_eq!(load(&text).mesh, load(&json(DATA_URI, NODE)).mesh);
}

#[test]
fn errors_name_the_json_element() {
    let whole = json(DATA_URI, NODE);
    let cases = [
        (whole.replace(r#""indices":1"#, r#""indices":7"#), "meshes[0].primitives[0].indices"),
        (whole.replace(r#""bufferView":1"#, r#""bufferView":9"#), "accessors[1].bufferView"),
        (whole.replace(r#""count":12"#, r#""count":4000000000"#), "accessors[1]"),
        (whole.replace(r#""count":4,"#, r#""count":18446744073709551615,"#), "accessors[0]"),
        (whole.replace(r#""byteOffset":48"#, r#""byteOffset":49"#), "bufferViews[1]"),
        (whole.replace(r#""byteLength":60"#, r#""byteLength":61"#), "buffers[0]"),
        (whole.replace(r#""count":4,"#, r#""count":3,"#), "meshes[0].primitives[0]: index 5"),
        (whole.replace(r#""VEC3""#, r#""VEC2""#), "accessors[0]"),
        (whole.replace("AAAAAAA", "AA*AAAA"), "buffers[0]"),
        (whole.replace(r#""POSITION""#, r#""NORMAL""#), "meshes[0].primitives[0]"),
        (whole.replace(NODE, r#"{"mesh":0,"scale":[1,0,1]}"#), "nodes[0]"),
        (whole.replace(NODE, r#"{"mesh":0,"children":[0]}"#), "nodes[0]"),
        (
            whole.replace(r#""scene":0"#, r#""extensionsRequired":["KHR_draco_mesh_compression"]"#),
            "extensionsRequired",
        ),
        (whole.replace(r#""asset""#, r#""asse""#), "line"),
        (whole.replace(r#""POSITION":0"#, r#""POSITION":5"#), "meshes[0].primitives[0].attributes.POSITION"),
        (whole.replace(r#""mesh":0"#, r#""mesh":1"#), "nodes[0].mesh"),
        (json(r#""uri":"../x.bin","#, NODE), "buffers[0]"),
        (json("", NODE), "buffers[0]"),
        ("{".into(), "line 1"),
    ];
    for (text, element) in cases {
        let message = read_bytes(text.as_bytes(), MeshFormat::Gltf).unwrap_err().to_string();
        assert!(message.contains(element), "no {element:?} in {message:?}");
    }
    let nan: Vec<u8> = tetrahedron_buffer()
        .iter()
        .enumerate()
        .map(|(i, b)| if (16..20).contains(&i) { 0xFF } else { *b })
        .collect();
    let message = read_bytes(&glb(&json("", NODE), &nan), MeshFormat::Glb).unwrap_err().to_string();
    for words in ["meshes[0].primitives[0]", "vertex 1 (0-based)", "y = NaN"] {
        assert!(message.contains(words), "no {words:?} in {message:?}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.gltf");
    std::fs::write(&path, json(r#""uri":"../x.bin","#, NODE)).unwrap();
    let message = read(&path).unwrap_err().to_string();
    assert!(message.contains("buffers[0]") && message.contains("../x.bin"), "{message}");
}

#[test]
fn a_mesh_with_too_many_instances_is_refused() {
    // 8192 faces that all use one vertex. A file of some kilobytes would expand to 10 GB.
    let shows = |times: usize| {
        let text = json("", &vec![NODE; times].join(",")).replace(r#""count":12"#, r#""count":24576"#);
        let text = text.replace(r#""byteLength":60"#, r#""byteLength":24624"#);
        let text = text.replace(r#""byteLength":12"#, r#""byteLength":24576"#);
        let nodes: Vec<String> = (0..times).map(|node| node.to_string()).collect();
        let text = text.replace(r#""nodes":[0]"#, &format!(r#""nodes":[{}]"#, nodes.join(",")));
        let buffer = [&tetrahedron_buffer()[..48], &[0; 24576]].concat();
        read_bytes(&glb(&text, &buffer), MeshFormat::Glb).unwrap_err().to_string()
    };
    let error = shows(5462);
    for part in ["meshes[0]", "134234112 corners of faces", "expected at most 134217728"] {
        assert!(error.contains(part), "no {part:?} in {error}");
    }
}
