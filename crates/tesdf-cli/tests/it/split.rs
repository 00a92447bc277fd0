//! `tesdf encode --split`, units of files, and CAD files on the command line.

use crate::folder::{Folder, data};
use serde_json::Value;
use tesdf::TeSdf;

const FACES: &str = "f -4 -2 -3\nf -4 -3 -1\nf -3 -2 -1\nf -2 -4 -1\n";

fn tetrahedron(x: f64) -> String {
    format!("v {x} 0 0\nv {} 0 0\nv {x} 1 0\nv {x} 0 1\n{FACES}", x + 1.0)
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn each_object_becomes_an_asset_with_its_name() {
    let folder = Folder::new();
    let objects = ["o wheel\n", "o a/b\n", "o Wheel\n", "o open\nv 9 0 0\nv 9 1 0\nv 9 0 1\nf -1 -2 -3\n"];
    let text: String =
        objects.iter().zip([0.0, 2.0, 4.0]).map(|(name, x)| format!("{name}{}", tetrahedron(x))).collect();
    folder.write("machine.obj", format!("{text}{}", objects[3]));
    let (code, out, err) = folder.tesdf(&["encode", "machine.obj", "--split", "-o", "parts", "--json"]);
    // The open one is in the manifest, and stops nothing.
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(err.contains("machine.obj: object 'open'"), "{err}");
    assert_eq!(json(&out)["encoded"], 3);
    let manifest = json(&std::fs::read_to_string(folder.path("parts/manifest.json")).unwrap());
    let entries: Vec<_> = manifest["meshes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|entry| {
            (entry["mesh"].as_str().unwrap(), entry["part"].as_str().unwrap(), entry["asset"].as_str())
        })
        .collect();
    assert_eq!(
        entries,
        [
            ("machine.obj#wheel", "wheel", Some("wheel.tesdf")),
            ("machine.obj#a_b", "a/b", Some("a_b.tesdf")),
            ("machine.obj#Wheel-2", "Wheel", Some("Wheel-2.tesdf")),
            ("machine.obj#open", "open", None),
        ]
    );
    let asset = TeSdf::open(folder.path("parts/a_b.tesdf")).unwrap();
    assert_eq!((asset.face_count(), &*asset.about().source.name), (4, "machine.obj#a/b"));
    // The same command gives the same bytes.
    let read = || {
        ["wheel", "a_b", "Wheel-2"]
            .map(|name| std::fs::read(folder.path(&format!("parts/{name}.tesdf"))).unwrap())
    };
    let before = read();
    folder.tesdf(&["encode", "machine.obj", "--split", "-o", "parts", "--threads", "1"]);
    assert_eq!(read(), before);

    // Without names, connected components.
    folder.write("two.obj", tetrahedron(0.0) + &tetrahedron(5.0));
    folder.good(&["encode", "two.obj", "--split", "-o", "two"]);
    assert!(folder.path("two/two-1.tesdf").exists() && folder.path("two/two-2.tesdf").exists());
    let whole = folder.good(&["encode", "two.obj", "-o", "two.tesdf"]);
    assert!(whole.contains("8 faces"), "{whole}");
}

#[test]
fn a_step_file_is_checked_repaired_and_encoded_in_parts() {
    let folder = Folder::new();
    let step = data("cad/machine.step");
    folder.good(&[
        "encode",
        &step,
        "--split",
        "-o",
        "parts",
        "--preset",
        "fast",
        "--unit",
        "mm",
        "--deviation",
        "0.5",
    ]);
    let asset = TeSdf::open(folder.path("parts/ball.tesdf")).unwrap();
    assert_eq!(asset.unit(), Some("mm"));
    assert!(folder.path("parts/ring.tesdf").exists());
    let (code, out, err) =
        folder.tesdf(&["check", &step, "--mesh-size", "5", "--deviation", "0.5", "--json"]);
    assert_eq!((code, json(&out)["load"]["unit"].as_str()), (Some(0), Some("mm")), "{err}");

    let without = |args: &[&str]| {
        let out = folder.command(args).env("TESDF_GMSH", "no-such-gmsh").output().unwrap();
        (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    for args in
        [&["check", &step][..], &["encode", &step, "-o", "x.tesdf"], &["repair", &step, "-o", "x.ply"]]
    {
        let (code, err) = without(args);
        assert!(code == Some(2) && err.contains("pip install gmsh"), "{err}");
    }
    folder.write("two.obj", tetrahedron(0.0));
    let (code, _, err) = folder.tesdf(&["encode", "two.obj", "-o", "x.tesdf", "--deviation", "1"]);
    assert!(code == Some(2) && err.contains("of STEP, IGES and BREP files"), "{err}");

    // A folder has meshes alone; a list may name CAD files.
    std::fs::copy(&step, folder.path("machine.step")).unwrap();
    std::fs::create_dir(folder.path("meshes")).unwrap();
    std::fs::copy(&step, folder.path("meshes/machine.step")).unwrap();
    folder.write("meshes/two.obj", tetrahedron(0.0));
    let (_, err) = without(&["encode-all", "meshes", "-o", "all"]);
    assert_eq!(err, "");
    folder.write("list", "machine.step\n");
    let (code, err) = without(&["encode-all", "list", "-o", "all"]);
    assert!(code == Some(1) && err.contains("pip install gmsh"), "{err}");
}

#[test]
fn the_unit_of_the_file_is_recorded_and_a_contradiction_is_a_warning() {
    let folder = Folder::new();
    folder.write("part.gltf", closed_gltf());
    folder.good(&["encode", "part.gltf", "-o", "part.tesdf"]);
    assert_eq!(TeSdf::open(folder.path("part.tesdf")).unwrap().unit(), Some("m"));
    let (code, _, err) = folder.tesdf(&["encode", "part.gltf", "-o", "mm.tesdf", "--unit", "mm"]);
    assert!(code == Some(0) && err.contains("the file is in m, but the unit mm was given"), "{err}");
    assert_eq!(TeSdf::open(folder.path("mm.tesdf")).unwrap().unit(), Some("mm"));
    std::fs::create_dir(folder.path("meshes")).unwrap();
    folder.write("meshes/part.gltf", closed_gltf());
    folder.good(&["encode-all", "meshes", "-o", "all"]);
    let again = folder.good(&["encode-all", "meshes", "-o", "all"]);
    assert!(again.contains("0 now, 1 before"), "{again}");
}

/// A tetrahedron with its bytes in the file.
fn closed_gltf() -> String {
    // 4 positions and 12 indices.
    let uri = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAACAAEAAAABAAMAAQACAAMAAgAAAAMA";
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0,"name":"part"}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},{{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":24}}],"buffers":[{{"byteLength":72,"uri":"{uri}"}}]}}"#
    )
}
