//! Reads every file of `data/bad`, and variants of each format.
use std::collections::BTreeMap;
use std::path::Path;

use crate::support::meshes::bad;
use tesdf::glam::DVec3;
use tesdf::mesh::{LoadedMesh, MeshFormat, ReadError, SolidMesh, read, read_bytes};

/// Result of reading: numbers of vertices and faces, or words of the error.
enum Outcome {
    Mesh(usize, usize),
    Error(&'static [&'static str]),
}
use Outcome::{Error, Mesh};

/// Files with a defect of the surface (open, crossing, wrongly oriented, out of range) are read,
/// and `check` finds the defect. Files with a defect of the file are refused.
const OUTCOMES: &[(&str, Outcome)] = &[
    ("open_holes.obj", Mesh(162, 317)),
    ("open_half.obj", Mesh(89, 152)),
    ("flipped_all.obj", Mesh(162, 320)),
    ("mixed_winding.obj", Mesh(162, 320)),
    ("duplicate_faces.obj", Mesh(162, 323)),
    ("duplicate_face_reversed.obj", Mesh(162, 321)),
    ("soup_unwelded.stl", Mesh(162, 320)),
    ("soup_unwelded.obj", Mesh(162, 320)),
    ("soup_jitter.obj", Mesh(960, 320)),
    ("t_junction.obj", Mesh(9, 13)),
    ("t_junction_gap.obj", Mesh(9, 13)),
    ("zero_area_repeated_index.obj", Mesh(8, 14)),
    ("zero_area_cap.obj", Mesh(9, 14)),
    ("needle_slivers.obj", Mesh(9, 14)),
    ("nonmanifold_edge.obj", Mesh(14, 24)),
    ("nonmanifold_vertex.obj", Mesh(15, 24)),
    ("internal_fin.obj", Mesh(8, 13)),
    ("two_boxes_overlap.obj", Mesh(16, 24)),
    ("cavity.obj", Mesh(16, 24)),
    ("cavity_inverted.obj", Mesh(16, 24)),
    ("three_components.obj", Mesh(24, 36)),
    ("nan_vertex.obj", Error(&["line 5", "vertex 5 (1-based)", "y = NaN", "face 2 (0-based)"])),
    ("inf_vertex.obj", Error(&["line 5", "vertex 5 (1-based)", "y = inf", "face 2 (0-based)"])),
    ("nan_unused_vertex.obj", Mesh(8, 12)),
    ("huge_1e30.obj", Mesh(8, 12)),
    ("huge_1e200.obj", Mesh(8, 12)),
    ("tiny_1e-30.obj", Mesh(8, 12)),
    ("denormal_1e-310.obj", Mesh(8, 12)),
    ("far_from_origin.obj", Mesh(8, 12)),
    ("index_out_of_range.obj", Error(&["line 20", "face 11 (0-based)", "vertex 9", "8 vertices"])),
    ("index_zero.obj", Error(&["line 20", "face 11 (0-based)", "vertex 0", "count from 1"])),
    ("index_negative_bad.obj", Error(&["line 20", "face 11 (0-based)", "vertex -9", "8 vertices"])),
    ("negative_indices.obj", Mesh(8, 12)),
    ("quads.obj", Mesh(8, 12)),
    ("polygons.obj", Mesh(12, 20)),
    ("polygon_concave.obj", Mesh(12, 20)),
    ("short_face.obj", Error(&["line 21", "face 12 (0-based)", "2 corners"])),
    ("garbage_number.obj", Error(&["line 2", "'0.0z2'", "not a number"])),
    ("zero_faces.obj", Error(&["8 vertices", "no face"])),
    ("empty.obj", Error(&["empty (0 bytes)", "OBJ"])),
    ("empty.stl", Error(&["empty (0 bytes)", "STL"])),
    ("continuation_line.obj", Mesh(8, 12)),
    ("stl_count_too_big.stl", Error(&["1000 triangles (50084 bytes)", "684 bytes", "12 triangles"])),
    ("stl_count_4g.stl", Error(&["4294967295 triangles", "684 bytes", "12 triangles"])),
    ("stl_count_too_small.stl", Error(&["7 triangles (434 bytes)", "684 bytes", "12 triangles"])),
    ("stl_truncated.stl", Error(&["12 triangles (684 bytes)", "651 bytes", "11 triangles", "17 bytes left"])),
    ("stl_solid_but_binary.stl", Mesh(8, 12)),
    ("stl_ascii.stl", Mesh(8, 12)),
    ("stl_ascii_commas.stl", Error(&["line 2", "'-1,000000'", "comma", "decimal point"])),
    ("stl_ascii_truncated.stl", Error(&["line 58", "'face' in facet 8 (0-based)", "'facet'"])),
    ("stl_ascii_upper.stl", Mesh(8, 12)),
    ("ply_big_endian.ply", Mesh(8, 12)),
    ("ply_little_double.ply", Mesh(8, 12)),
    ("ply_ascii.ply", Mesh(8, 12)),
    ("ply_truncated.ply", Error(&["face 10 (0-based) of 12", "ends at byte 523"])),
    ("ply_index_out_of_range.ply", Error(&["face 5 (0-based)", "vertex 77", "8 vertices (0 to 7)"])),
    ("png_named.stl", Error(&["not STL", "PNG picture"])),
    ("png_named.obj", Error(&["not OBJ", "PNG picture"])),
];

#[test]
fn each_bad_file_reads_or_is_refused_as_listed() {
    let listed: BTreeMap<_, _> = OUTCOMES.iter().map(|(name, outcome)| (*name, outcome)).collect();
    let table = std::fs::read_to_string(bad("expected.tsv")).unwrap();
    let rows: Vec<_> = table.lines().skip(1).filter_map(|row| row.split('\t').next()).collect();
    assert_eq!(rows.len(), listed.len());
    for name in rows {
        match (listed[name], read(bad(name))) {
            (Mesh(vertices, faces), Ok(loaded)) => {
                let found = (loaded.mesh.vertices().len(), loaded.mesh.faces().len());
                assert_eq!(found, (*vertices, *faces), "{name}");
                assert_consistent(&loaded);
            }
            (Error(words), Err(error)) => {
                let message = error.to_string();
                words.iter().for_each(|w| assert!(message.contains(w), "{name}: no {w:?} in {message:?}"));
            }
            (Mesh(..), Err(error)) => panic!("{name}: {error}"),
            (Error(_), Ok(_)) => panic!("{name} was read"),
        }
    }
}

fn assert_consistent(loaded: &LoadedMesh) {
    let LoadedMesh { mesh, report, origin, .. } = loaded;
    let vertices = mesh.vertices().len();
    assert_eq!(report.vertices_in_file, vertices + report.welded_vertices + report.unused_vertices);
    assert_eq!((origin.vertices.len(), origin.faces.len()), (vertices, mesh.faces().len()));
    assert!(origin.vertices.is_sorted() && origin.faces.is_sorted());
    assert_eq!(report.source_blake3.len(), 64);
}

/// Six times the signed volume.
fn volume6(loaded: &LoadedMesh) -> f64 {
    (0..loaded.mesh.faces().len()).map(|f| loaded.mesh.triangle(f)).map(|[a, b, c]| a.dot(b.cross(c))).sum()
}

#[test]
fn reports_name_each_change() {
    let soup = read(bad("soup_unwelded.obj")).unwrap();
    assert_eq!((soup.report.welded_vertices, soup.report.unused_vertices), (798, 0));
    let jitter = read(bad("soup_jitter.obj")).unwrap();
    assert_eq!(jitter.report.welded_vertices, 0);

    let nan = read(bad("nan_unused_vertex.obj")).unwrap();
    assert_eq!(nan.report.unused_vertices, 1);
    assert!(nan.report.notes.iter().any(|n| n.contains("line 9: vertex 9 (1-based) is not finite")));
    assert!(nan.mesh.diagonal() < 0.035);

    let concave = read(bad("polygon_concave.obj")).unwrap();
    assert_eq!((concave.report.triangulated_polygons, concave.report.concave_polygons), (8, 2));
    assert!(concave.report.notes.iter().any(|n| n.contains("2 of 8 polygons are concave")));
    assert!((volume6(&concave) / 6.0 - 5e-6).abs() < 1e-18, "{}", volume6(&concave) / 6.0);
    assert_eq!(concave.origin.faces[..8], [0, 0, 0, 0, 1, 1, 1, 1]);

    let quads = read(bad("quads.obj")).unwrap();
    assert_eq!((quads.report.triangulated_polygons, quads.report.concave_polygons), (6, 0));
    assert!(quads.report.notes.is_empty());
    let hash = blake3::hash(&std::fs::read(bad("quads.obj")).unwrap());
    assert_eq!(quads.report.source_blake3, hash.to_hex().as_str());
}

#[test]
fn all_encodings_of_one_cube_agree() {
    let cube = read(bad("continuation_line.obj")).unwrap();
    for name in ["negative_indices.obj", "ply_little_double.ply", "stl_ascii.stl", "stl_ascii_upper.stl"] {
        let other = read(bad(name)).unwrap();
        assert_eq!(other.mesh.faces().len(), 12, "{name}");
        for face in 0..12 {
            assert_eq!(other.mesh.triangle(face), cube.mesh.triangle(face), "{name}");
        }
    }
    for name in ["ply_big_endian.ply", "stl_solid_but_binary.stl"] {
        let other = read(bad(name)).unwrap();
        for face in 0..12 {
            let f32_of = |p: DVec3| p.as_vec3().as_dvec3();
            assert_eq!(other.mesh.triangle(face), cube.mesh.triangle(face).map(f32_of), "{name}");
        }
    }
}

#[test]
fn extensions_decide_and_unknown_ones_list_the_known() {
    assert_eq!(MeshFormat::of_path(Path::new("a/B.STL")).unwrap(), MeshFormat::Stl);
    assert_eq!(MeshFormat::of_path(Path::new("b.Glb")).unwrap(), MeshFormat::Glb);
    for name in ["part.sldprt", "part", ".obj"] {
        let error = MeshFormat::of_path(Path::new(name)).unwrap_err();
        assert!(matches!(error, ReadError::UnknownExtension { .. }));
        assert!(error.to_string().contains(".stl, .obj, .ply, .off, .gltf, .glb"), "{error}");
    }
    let error = read(Path::new("no/such/file.obj")).unwrap_err().to_string();
    assert!(error.contains("no/such/file.obj"), "{error}");
    let ply = std::fs::read(bad("ply_ascii.ply")).unwrap();
    let error = read_bytes(&ply, MeshFormat::Obj).unwrap_err().to_string();
    assert!(error.contains("is a PLY file") && error.contains("extension"), "{error}");
    let lfs = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n";
    let error = read_bytes(lfs, MeshFormat::Stl).unwrap_err().to_string();
    assert!(error.contains("git lfs pull"), "{error}");
}

fn error(text: &[u8], format: MeshFormat) -> String {
    read_bytes(text, format).unwrap_err().to_string()
}

#[test]
fn obj_as_found_in_the_wild() {
    let text = b"\xEF\xBB\xBF# caf\xE9 \\\r\nmtllib C:\\parts\\\r\no a\rv\t0 0 0 1 0.5 0.5\r\nv 1 0 0 1\r\n\
        v 0 1 0 0.1 0.2 0.3 1\rv 0 0 1\nvt 0 0\nvn 0 0 1\n\ng x\ns off\nusemtl red\nf 1// 2// 3//\n\
        f 1/1 2/1 4/1 # comment\nf -4//1 -2//1 \\\n  -1//1\nl 1 2\np 1 2\nl 2 3\nwibble 1\nfo 2/1/1 3/1/1 4/1/1";
    let loaded = read_bytes(text, MeshFormat::Obj).unwrap();
    assert_eq!(loaded.mesh.vertices(), [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
    assert_eq!(loaded.mesh.faces(), [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]);
    let notes = loaded.report.notes.join("\n");
    assert!(notes.contains("'l' (line elements) skipped; 2 in the file"), "{notes}");
    assert!(notes.contains("'wibble'") && notes.contains("'p'"), "{notes}");
}

#[test]
fn obj_faces_may_come_before_their_vertices() {
    let loaded = read_bytes(b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n", MeshFormat::Obj).unwrap();
    assert_eq!(loaded.mesh.faces(), [[0, 1, 2]]);
}

#[test]
fn obj_errors_name_the_line() {
    let cases: &[(&[u8], &[&str])] = &[
        (b"v 0 0\n", &["line 1", "vertex 1 (1-based) has 2 numbers"]),
        (b"v 0,5 0 0\n", &["line 1", "'0,5' has a comma"]),
        (b"v 0 0 0\r\nv 1 0 0\rv 0 1 0\nf 1 2 4294967299\n", &["line 4", "vertex 4294967299", "3 vertices"]),
        (b"v 0 0 0\nf 1 2 99999999999999999999\n", &["line 2", "not a whole number"]),
        (b"v 0 0 0\nf 1 1/1/1/1 1\n", &["line 2", "'1/1/1/1'"]),
        (b"v 0 0 0\nf 1 1/x 1\n", &["line 2", "'x'"]),
        (b"v 0 0 0\nf 1 1 \\\n 1.5\n", &["line 2", "'1.5'"]),
        (b"\x01\x02\x03", &["line 1", "expected OBJ text"]),
        (b"v 0 0 0\0", &["zero byte at byte 7"]),
        (b"hello world\n", &["0 vertices and no face"]),
    ];
    for (text, words) in cases {
        let message = error(text, MeshFormat::Obj);
        words.iter().for_each(|w| assert!(message.contains(w), "no {w:?} in {message:?}"));
    }
}

/// A tetrahedron with a corner at 1, which one facet has at `other`.
fn cracked_stl(other: &str) -> String {
    let facet = |[a, b, c]: [&str; 3]| {
        format!("facet normal 0 0 0\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n")
    };
    let moved = format!("{other} 0 0");
    let [o, x, y, z] = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];
    format!("solid\n{}endsolid\n", [[o, y, x], [o, x, z], [&moved, y, z], [o, z, y]].map(facet).concat())
}

#[test]
fn cracks_of_rounding_in_stl_are_closed() {
    let near = read_bytes(cracked_stl("1.0000001").as_bytes(), MeshFormat::Stl).unwrap();
    assert_consistent(&near);
    assert_eq!((near.mesh.vertices().len(), near.report.welded_vertices), (4, 8));
    assert!(near.report.notes[0].starts_with("1 vertex at most 2.4e-7 from another merged"), "{near:?}");
    assert!(SolidMesh::new(near.mesh).is_ok());
    let apart = read_bytes(cracked_stl("1.000001").as_bytes(), MeshFormat::Stl).unwrap();
    assert_eq!((apart.mesh.vertices().len(), apart.report.notes.len()), (5, 0));
    // Other formats have more digits.
    let obj = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1.0000001 0 0\nf 1 3 2\nf 1 2 4\nf 5 3 4\nf 1 4 3\n";
    assert_eq!(read_bytes(obj, MeshFormat::Obj).unwrap().mesh.vertices().len(), 5);
}

#[test]
fn ascii_stl_variants() {
    let one_line = b"solid my facet facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 \
        endloop endfacet endsolid my";
    // `facet` ends the name, so a name that contains this word cannot be distinguished from a
    // facet.
    assert!(error(one_line, MeshFormat::Stl).contains("expected 'normal'"));
    let two = b"\n solid a b c\nfacet normal -nan(ind) 1.#QNAN nan outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 \
        endloop endfacet endsolid a b c\nsolid\nfacet normal 0 0 1 outer loop\nvertex 0 0 0\nvertex 0 1 0\nvertex -0 0 1e0\
        \nendloop\nendfacet\nendsolid";
    let loaded = read_bytes(two, MeshFormat::Stl).unwrap();
    assert_eq!(loaded.mesh.faces(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(loaded.report.welded_vertices, 2);
    // Words that are written apart, and a last solid without an end.
    let facet =
        "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nEnd loop\nend facet\n";
    let split = read_bytes(format!("solid a\n{facet}end solid a\n").as_bytes(), MeshFormat::Stl).unwrap();
    assert_eq!((split.mesh.faces().len(), split.report.notes.len()), (1, 0));
    let open = read_bytes(format!("solid a\n{facet}{facet}").as_bytes(), MeshFormat::Stl).unwrap();
    let note = "line 15: the file ends after facet 1 (0-based) without 'endsolid': is it cut short?";
    assert!(open.report.notes.contains(&note.to_string()), "{:?}", open.report.notes);
    let cases: &[(&[u8], &[&str])] = &[
        (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nend it", &["line 7", "'it'"]),
        (b"solid a\nend it", &["line 2", "'end'", "expected 'facet'"]),
        (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0\n", &["line 5", "facet 0", "cut short"]),
        (b"solid a\n", &["line 1", "'facet' or 'endsolid'"]),
        (b"solid a\nendsolid a\n", &["no face"]),
        (b"solid a\nendsolid a\nxyz", &["line 3", "'xyz'"]),
        (b"facet", &["5 bytes", "84-byte header"]),
        (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 inf\nvertex 0 1 0\nendloop endfacet endsolid",
            &["line 5", "vertex 1 (0-based)", "z = inf"]),
        (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nvertex 1 1 1\nendloop",
            &["line 7", "'vertex'", "expected 'endloop'"]),
    ];
    for (text, words) in cases {
        let message = error(text, MeshFormat::Stl);
        words.iter().for_each(|w| assert!(message.contains(w), "no {w:?} in {message:?}"));
    }
}

#[test]
fn ply_variants() {
    let ascii = b"ply\r\nformat ascii 1.0\r\nobj_info x\r\nelement material 1\r\nproperty list uchar int stuff\r\n\
        property int16 k\r\nelement face 1\r\nproperty uchar flag\r\nproperty list uint8 uint32 vertex_index\r\n\
        element nothing 4000000000\r\nelement vertex 4\r\nproperty float64 z\r\nproperty int8 x\r\nproperty float y\r\n\
        element tristrips 1\r\nproperty list int int vertex_indices\r\nend_header\r\n3 1 2 3 -1\r\n\r\n7 3 0 1 2\r\n\
        0 0 0\r\n0 1 0\r\n0 0 1\r\n1 0 0\r\n8 0 1 2 3 -1 1 0 3\r\n";
    let loaded = read_bytes(ascii, MeshFormat::Ply).unwrap();
    assert_eq!(loaded.mesh.vertices(), [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
    assert_eq!(loaded.mesh.faces(), [[0, 1, 2], [0, 1, 2], [2, 1, 3], [1, 0, 3]]);

    let mut binary =
        b"ply\rformat binary_big_endian 1.0\relement vertex 3\rproperty uchar x\rproperty ushort y\r\
        property short z\relement face 1\rproperty list ushort char vertex_indices\rend_header\r"
            .to_vec();
    // The data begin with a line feed, which does not belong to the header's last line.
    binary.extend([10, 0, 1, 0, 2, 0, 1, 0, 0xFF, 0xFE, 5, 0, 0, 0, 0, 0, 3, 0, 1, 2]);
    let loaded = read_bytes(&binary, MeshFormat::Ply).unwrap();
    let expected = [DVec3::new(10.0, 1.0, 2.0), DVec3::new(0.0, 256.0, -2.0), DVec3::new(5.0, 0.0, 0.0)];
    assert_eq!(loaded.mesh.vertices(), expected);
}

#[test]
fn ply_errors_name_the_line_byte_or_row() {
    let text = String::from_utf8(std::fs::read(bad("ply_ascii.ply")).unwrap()).unwrap();
    let cases = [
        (text.replace("0 0 0.02 255", "0 0 0.02"), ["line 12", "vertex 1 (0-based) of 8"]),
        (
            text.replace("0 0 0.02 255", "0 0 0.02 255 7"),
            ["line 12", "vertex row 1 (0-based) goes on with '7'"],
        ),
        (text.replace("0 0 0.02 255", "0 0 nope 255"), ["line 12", "'nope' is not a number"]),
        (text.replace("4 4 6 7 5", "2 4 6"), ["line 20", "face 1 (0-based) has 2 corners"]),
        (text.replace("4 4 6 7 5", "4 4 6 7 -5"), ["line 20", "face 1 (0-based) uses vertex -5"]),
        (text.replace("4 4 6 7 5", "4 4 6 7 1.5"), ["line 20", "uses vertex 1.5"]),
        (text.replace("4 4 6 7 5", "4 4 6 7 8"), ["line 20", "face 1 (0-based) uses vertex 8"]),
        (text.replace("element face 6", "element face 5"), ["line 24", "after the last row"]),
        (text.replace("element face 6", "element face 7"), ["face 6 (0-based) of 7", "cut short"]),
        (
            text.replace("element face 6", "element face 4294967295"),
            ["face 6 (0-based) of 4294967295", "cut short"],
        ),
        (text.replace("property float y", "property float q"), ["line 3", "0 properties 'y'"]),
        (text.replace("property float y", "property half y"), ["line 5", "the type 'half'"]),
        (text.replace("format ascii", "format utf8"), ["line 2", "'utf8'"]),
        (text.replace("end_header", "end_headers"), ["line 10", "'end_headers'"]),
        (text.replace("vertex_indices", "corners"), ["line 8", "vertex_indices"]),
    ];
    for (text, words) in cases {
        let message = error(text.as_bytes(), MeshFormat::Ply);
        words.iter().for_each(|w| assert!(message.contains(w), "no {w:?} in {message:?}"));
    }
}

#[test]
fn off_variants() {
    let tetrahedron = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
    let colours =
        tetrahedron.replace("0 1 0\n", "0 1 0 0.5 0.5 0.5 1 # top\n\n").replace("3 0 1 3", "3 0 1 3 255 0 0");
    for header in [
        "OFF\n4 4 6\n",
        "OFF 4 4 6\n",
        "OFF4 4 6\n",
        "# made by hand\nCOFF\n# counts\n4 4 0\n",
        "4 4\n",
        "off\r\n4 4 6\r",
    ] {
        let loaded = read_bytes(format!("{header}{colours}").as_bytes(), MeshFormat::Off).unwrap();
        assert_eq!(loaded.mesh.vertices(), [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], "{header:?}");
        assert_eq!(loaded.mesh.faces(), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], "{header:?}");
        assert_eq!(volume6(&loaded), 1.0);
    }
    let whole = format!("OFF\n4 4 6\n{tetrahedron}");
    let cases = [
        (whole.replace("3 0 1 3", "3 0 1 4"), ["line 8", "face 1 (0-based) uses vertex 4"]),
        (whole.replace("3 0 1 3", "3 0 1 -1"), ["line 8", "face 1 (0-based) uses vertex -1"]),
        (whole.replace("3 0 1 3", "4 0 1 3"), ["line 8", "ends after 3 of 4 corners"]),
        (whole.replace("3 0 1 3", "2 0 1"), ["line 8", "has 2 corners"]),
        (whole.replace("0 1 0\n", "0 1\n"), ["line 5", "vertex 2 (0-based) has 2 numbers"]),
        (whole.replace("4 4 6", "4 5 6"), ["line 10", "before face 4 (0-based) of 5"]),
        (whole.replace("4 4 6", "4 3 6"), ["line 10", "after the last of 3 faces"]),
        (whole.replace("4 4 6", "-4 4 6"), ["line 2", "where the counts should be"]),
        (whole.replace("OFF", "4OFF"), ["line 1", "the variant '4OFF'"]),
        (whole.replace("OFF\n", "OFF BINARY\n"), ["line 1", "binary OFF"]),
    ];
    for (text, words) in cases {
        let message = error(text.as_bytes(), MeshFormat::Off);
        words.iter().for_each(|w| assert!(message.contains(w), "no {w:?} in {message:?}"));
    }
}
