//! Reads tetrahedra: each format is compared with the same mesh, and faulty files give errors that
//! name the fault.
use std::path::{Path, PathBuf};

use tesdf::Side;
use tesdf::domain::{
    Classes, ConformingError, ConformingMesh, MissingFace, ReadTetrahedraError, Skipped, TetFormat, TetMesh,
    load_tetrahedra, read_tetrahedra,
};
use tesdf::mesh::{SolidMesh, read};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/procedural").join(name)
}

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/tetrahedra").join(name)
}

/// Other elements of the cylinder, besides its 60 tetrahedra.
const SKIPPED: Skipped = Skipped { points: 2, lines: 16, surfaces: 58 };

/// Corners of each tetrahedron as positions, which do not depend on vertex numbers.
fn positions(mesh: &TetMesh) -> Vec<[[f64; 3]; 4]> {
    (0..mesh.tetrahedra().len()).map(|t| mesh.corners(t).map(|p| p.to_array())).collect()
}

#[test]
fn gmsh_files_hold_the_same_tetrahedra() {
    let text = positions(&read_tetrahedra(golden("v22.msh")).unwrap());
    assert_eq!(text.len(), 60);
    let binary = positions(&read_tetrahedra(golden("v22_binary.msh")).unwrap());
    for (a, b) in text.iter().flatten().flatten().zip(binary.iter().flatten().flatten()) {
        assert!((a - b).abs() <= 1e-15, "{a} {b}");
    }
    for (name, expected) in [
        ("v22.msh", &text),
        ("v41.msh", &text),
        ("v41_parametric.msh", &text),
        ("v22_binary.msh", &binary),
        ("v41_binary.msh", &binary),
        ("v41_binary_parametric.msh", &binary),
    ] {
        let loaded = load_tetrahedra(golden(name)).unwrap();
        assert!(positions(&loaded.mesh) == *expected, "{name}");
        assert_eq!((loaded.format, loaded.mesh.vertices().len()), (TetFormat::Msh, 32), "{name}");
        assert_eq!(loaded.skipped, SKIPPED, "{name}");
    }
}

/// TetGen's files, from either path, counted from 0 or from 1, conform to the surface that they
/// fill.
#[test]
fn the_beam_conforms() {
    let beam = read_tetrahedra(data("beam.node")).unwrap();
    assert_eq!(read_tetrahedra(data("beam.ele")).unwrap(), beam);
    // The surface file cuts half of the squares along the other diagonal.
    let other = SolidMesh::new(read(data("beam.obj")).unwrap().mesh).unwrap();
    let error = ConformingMesh::new(&other, &beam).unwrap_err();
    let expected =
        ConformingError::FaceMissing { missing: 352, of: 704, face: 0, reason: MissingFace::Recut };
    assert_eq!(error, expected);
    let solid = SolidMesh::new(beam.surface().unwrap()).unwrap();
    assert!(solid.is_simple());
    let mesh = ConformingMesh::new(&solid, &beam).unwrap();
    assert_eq!(mesh.sides(), [Side::Inside; 1920]);
    let expected = Classes {
        surface_vertices: 354,
        inner_vertices: 171,
        boundary_inner_tetrahedra: mesh.classes().boundary_inner_tetrahedra,
        inner_tetrahedra: 1920 - mesh.classes().boundary_inner_tetrahedra,
        ..Classes::default()
    };
    assert_eq!(mesh.classes(), expected);
    // Inner tetrahedra are those of the 18 x 2 x 2 inner grid cells, six each.
    assert_eq!(mesh.classes().inner_tetrahedra, 18 * 2 * 2 * 6);

    let folder = tempfile::tempdir().unwrap();
    let [node, ele] = ["BEAM.NODE", "BEAM.ELE"].map(|name| folder.path().join(name));
    let from_one = |name: &str, ids: usize| -> String {
        let text = std::fs::read_to_string(data(name)).unwrap();
        let mut lines = text.lines();
        let mut out = format!("{}\n", lines.next().unwrap());
        for line in lines.filter(|l| !l.starts_with('#')) {
            let cells = line.split_whitespace().enumerate();
            let up = |(k, cell): (usize, &str)| match k < ids {
                true => format!("{} ", cell.parse::<u32>().unwrap() + 1),
                false => format!("{cell} "),
            };
            out += &(cells.map(up).collect::<String>() + "\n");
        }
        out
    };
    std::fs::write(&node, from_one("beam.node", 1)).unwrap();
    std::fs::write(&ele, from_one("beam.ele", 5)).unwrap();
    assert_eq!(read_tetrahedra(&ele).unwrap(), beam);
    assert_eq!(read_tetrahedra(&node).unwrap(), beam);
}

fn error_of(name: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_tetrahedra(&path).unwrap_err().to_string()
}

#[test]
fn second_order_elements_are_an_error() {
    let error = read_tetrahedra(golden("second_order.msh")).unwrap_err();
    let ReadTetrahedraError::Element { element: 77, ref kind, .. } = error else { panic!("{error}") };
    assert_eq!(kind, "a second-order tetrahedron");
    assert!(error.to_string().starts_with("Gmsh MSH, line "), "{error}");
    let error = read_tetrahedra(golden("second_order_v22_binary.msh")).unwrap_err().to_string();
    assert!(error.starts_with("Gmsh MSH, byte ") && error.contains("second-order"), "{error}");
}

#[test]
fn errors_name_the_place() {
    let msh = std::fs::read_to_string(golden("v22.msh")).unwrap();
    let line_of = |text: &str, word: &str| 1 + text[..text.find(word).unwrap()].matches('\n').count();

    let broken = msh.replacen("\n7 ", "\n7 x", 1);
    let error = error_of("a.msh", broken.as_bytes());
    assert!(error.starts_with(&format!("Gmsh MSH, line {}: 'x", line_of(&broken, "7 x"))), "{error}");
    let error = error_of("a.msh", msh.replace("2.2 0 8", "4.0 0 8").as_bytes());
    assert!(
        error.starts_with("Gmsh MSH, line ") && error.contains("4.0") && error.contains("msh41"),
        "{error}"
    );
    let error = error_of("a.msh", msh.replace("\n32\n", "\n31\n").as_bytes());
    assert!(error.contains("$EndNodes"), "{error}");
    let error = error_of("a.msh", msh.replacen("\n8 ", "\n7 ", 1).as_bytes());
    assert!(error.contains("node 7 is there twice"), "{error}");
    let error = error_of("a.msh", b"solid cube\n");
    assert!(error.contains("$MeshFormat"), "{error}");
    let surface =
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n0\n$EndElements\n";
    let error = error_of("a.msh", surface.as_bytes());
    assert!(error.contains("no tetrahedra"), "{error}");

    let mut binary = std::fs::read(golden("v41_binary.msh")).unwrap();
    binary.truncate(3000);
    let error = error_of("a.msh", &binary);
    assert!(error.starts_with("Gmsh MSH, byte ") && error.contains("cut short"), "{error}");

    let error = read_tetrahedra(Path::new("mesh.obj")).unwrap_err().to_string();
    assert!(error.contains(".msh, .node, .ele: `meshio convert"), "{error}");
    let error = error_of("a.node", b"1 3 0 0\n0 0 0 0\n");
    assert!(error.starts_with("cannot read") && error.contains("a.ele"), "{error}");
}

#[test]
fn tetgen_errors_name_the_line() {
    let folder = tempfile::tempdir().unwrap();
    let node = "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n";
    let ele = "1 4 0\n0 0 1 2 3\n";
    let read = |node: &str, ele: &str| {
        std::fs::write(folder.path().join("a.node"), node).unwrap();
        std::fs::write(folder.path().join("a.ele"), ele).unwrap();
        read_tetrahedra(folder.path().join("a.ele")).map_err(|e| e.to_string())
    };
    assert!(read(node, ele).is_ok());
    for (node, ele, expected) in [
        (node, "1 4 0\n0 0 1 2 4\n", "TetGen .ele, line 2: tetrahedron 0 uses vertex 4; expected 0 to 3"),
        (
            node,
            "1 10 0\n0 0 1 2 3 0 0 0 0 0 0\n",
            "TetGen .ele, line 1: element 0 is a second-order tetrahedron",
        ),
        (node, "2 4 0\n0 0 1 2 3\n", "TetGen .ele, line 2: the file ends after 1 of 2 rows"),
        (node, "1 4 0\n0 0 1 2 3\n1 0 1 2 3\n", "TetGen .ele, line 3: '1 0 1 2 3' after the last of 1 rows"),
        (node, "1 4 0\n0 0 1 2\n", "TetGen .ele, line 2: tetrahedron 0 has 3 vertices"),
        ("0 3 0 0\n", ele, "TetGen .node, line 1: no vertices"),
        ("4 2 0 0\n", ele, "TetGen .node, line 1: dimension 2"),
        (&node.replace("2 0 1 0", "2 0 inf 0"), ele, "TetGen .node, line 4: vertex 2 has y = 'inf'"),
        (&node.replace("2 0 1 0", "3 0 1 0"), ele, "TetGen .node, line 4: row 3; expected row 2"),
    ] {
        let error = read(node, ele).unwrap_err();
        assert!(error.starts_with(expected), "{error}");
    }
}
