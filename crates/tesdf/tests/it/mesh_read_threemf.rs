//! Reads 3MF: units, transforms, components, other parts, errors with places, and hostile archives.
use std::fmt::Write as _;
use std::io::{Cursor, Write};

use tesdf::glam::DVec3;
use tesdf::mesh::{LoadedMesh, MeshFormat, NamedMesh, read_bytes, split};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

const CORE: &str = r#"xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02""#;
const TETRAHEDRON: &str = r#"<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1"
 z="0"/><vertex x="0" y="0" z="1"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>
<triangle v1="1" v2="2" v3="3"/><triangle v1="2" v2="0" v3="3"/></triangles></mesh>"#;

fn archive(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, text) in parts {
        zip.start_file(*name, options).unwrap();
        zip.write_all(text.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn model(attributes: &str, resources: &str, build: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model {CORE} {attributes}><resources>{resources}</resources><build>{build}</build></model>"
    )
}

fn object(id: u32, attributes: &str, content: &str) -> String {
    format!(r#"<object id="{id}" {attributes}>{content}</object>"#)
}

fn load(model: &str) -> Result<LoadedMesh, String> {
    read_bytes(&archive(&[("3D/3dmodel.model", model)]), MeshFormat::ThreeMf).map_err(|e| e.to_string())
}

fn volume6(part: &NamedMesh) -> f64 {
    let mesh = &part.mesh;
    (0..mesh.faces().len()).map(|f| mesh.triangle(f)).map(|[a, b, c]| a.dot(b.cross(c))).sum()
}

#[test]
fn objects_are_placed_named_and_have_the_unit_of_the_file() {
    let resources = object(1, r#"name="left &amp; right""#, TETRAHEDRON) + &object(2, "", TETRAHEDRON);
    let build = r#"<item objectid="2"/><item objectid="1" transform="0 2 0 -1 0 0 0 0 1 10 20 30"/>"#;
    let loaded = load(&model(r#"unit="inch""#, &resources, build)).unwrap();
    assert_eq!(loaded.report.unit.as_deref(), Some("in"));
    let parts = split(&loaded);
    assert_eq!(parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>(), ["object 2", "left & right"]);
    // Row vectors: x goes to the first row of the matrix.
    let (ten, x, y) = (DVec3::new(10.0, 20.0, 30.0), DVec3::new(0.0, 2.0, 0.0), DVec3::new(-1.0, 0.0, 0.0));
    assert_eq!(parts[1].mesh.vertices(), [ten, ten + x, ten + y, ten + DVec3::Z]);
    assert_eq!(parts.iter().map(volume6).collect::<Vec<_>>(), [1.0, 2.0]);
    for (unit, metres) in [("micron", "um"), ("meter", "m"), ("foot", "ft"), ("centimeter", "cm")] {
        let loaded = load(&model(&format!("unit='{unit}'"), &resources, build)).unwrap();
        assert_eq!(loaded.report.unit.as_deref(), Some(metres));
    }
    assert_eq!(load(&model("", &resources, build)).unwrap().report.unit.as_deref(), Some("mm"));
}

#[test]
fn components_nest_and_mirrored_faces_still_point_outward() {
    let twice = r#"<components><component objectid="1" transform="1 0 0 0 1 0 0 0 1 5 0 0"/>
        <component objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/></components>"#;
    let resources = object(1, "", TETRAHEDRON) + &object(7, r#"name="pair""#, twice);
    let build = r#"<item objectid="7" transform="2 0 0 0 2 0 0 0 2 0 0 1"/>"#;
    let parts = split(&load(&model("", &resources, build)).unwrap());
    assert_eq!(parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>(), ["pair", "pair"]);
    // The component is placed first, then the item.
    assert_eq!(parts[0].mesh.vertices()[1], DVec3::new(12.0, 0.0, 1.0));
    assert_eq!(parts[1].mesh.vertices()[1], DVec3::new(-2.0, 0.0, 1.0));
    assert_eq!(parts.iter().map(volume6).map(f64::round).collect::<Vec<_>>(), [8.0, 8.0]);
}

#[test]
fn parts_of_the_production_extension_and_the_relationship_are_followed() {
    let production =
        r#"xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06" requiredextensions="p""#;
    let far = r#"<components><component p:path="/3D/Objects/a.model" objectid="1"/></components>"#;
    let root = model(production, &object(1, r#"name="outer""#, far), r#"<item objectid="1" p:UUID="x"/>"#);
    let other = model("", &object(1, r#"name="inner""#, TETRAHEDRON), "");
    let relations = r#"<Relationships><Relationship Target="/3D/thumb.png" Type="other"/><Relationship Target="/3D/root.model"
        Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#;
    let bytes =
        archive(&[("3D/root.model", &root), ("3D/Objects/a.model", &other), ("_rels/.rels", relations)]);
    let loaded = read_bytes(&bytes, MeshFormat::ThreeMf).unwrap();
    assert_eq!(loaded.mesh.faces(), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
    assert_eq!(loaded.parts[0].name, "inner");
}

#[test]
fn supports_are_left_out_and_a_file_without_items_shows_all_objects() {
    let resources = object(1, r#"type="support""#, TETRAHEDRON) + &object(2, "", TETRAHEDRON);
    let both = r#"<item objectid="1"/><item objectid="2"/>"#;
    let loaded = load(&model("", &resources, both)).unwrap();
    assert_eq!(loaded.report.faces_in_file, 4);
    assert!(loaded.report.notes[0].contains("supports"), "{:?}", loaded.report.notes);
    let loaded = load(&model("", &object(2, "", TETRAHEDRON), "")).unwrap();
    assert_eq!(loaded.report.faces_in_file, 4);
    assert!(loaded.report.notes[0].contains("no build items"));
}

#[test]
fn errors_name_the_part_and_the_object() {
    let item = r#"<item objectid="1"/>"#;
    let broken = TETRAHEDRON.replace(r#"v3="1""#, r#"v3="4""#);
    let own = r#"<components><component objectid="1"/></components>"#;
    let nan = TETRAHEDRON.replacen(r#"x="0""#, r#"x="NaN""#, 1);
    let cases = [
        (
            model("", &object(1, "", &broken), item),
            "object 1: triangle 0 (0-based) uses vertex 4, but the object has 4",
        ),
        (
            model("", &object(1, "", TETRAHEDRON), r#"<item objectid="3"/>"#),
            "build item 0 (0-based): it shows object 3",
        ),
        (model("", &object(1, "", own), item), "object 1: the object shows itself"),
        (
            model("", &(object(1, "", TETRAHEDRON) + &object(1, "", TETRAHEDRON)), item),
            "two objects have this id",
        ),
        (model("", &object(1, "", &nan), item), "object 1: vertex 0 (0-based) has x = NaN"),
        (
            model("", &object(1, "", TETRAHEDRON), r#"<item objectid="1" transform="1 0 0"/>"#),
            "the transform is '1 0 0'",
        ),
        (
            model(
                "",
                &object(1, "", TETRAHEDRON),
                r#"<item objectid="1" transform="0 0 0 0 1 0 0 0 1 0 0 0"/>"#,
            ),
            "transform",
        ),
        (model("unit='cubit'", &object(1, "", TETRAHEDRON), item), "the unit is 'cubit'"),
        (
            model("requiredextensions='q' xmlns:q='urn:lattice'", &object(1, "", TETRAHEDRON), item),
            "needs the extension 'q'",
        ),
        (model("", &object(1, "", &TETRAHEDRON.replace("y=", "q=")), item), "the attribute 'y' is missing"),
        (model("", &object(1, "", "<mesh>"), item), "the XML cannot be read"),
        (model("", &object(1, "", ""), item), "no face"),
    ];
    for (text, expected) in cases {
        let message = load(&text).unwrap_err();
        assert!(message.contains(expected), "{message}\nexpected: {expected}");
    }
    let bytes = archive(&[("other", "")]);
    let message = read_bytes(&bytes, MeshFormat::ThreeMf).unwrap_err().to_string();
    assert!(message.contains("3D/3dmodel.model: the archive has no such part"), "{message}");
    let message = read_bytes(b"solid a", MeshFormat::ThreeMf).unwrap_err().to_string();
    assert!(message.contains("is an ASCII STL file"), "{message}");
}

#[test]
fn bombs_are_refused_before_they_unfold() {
    // 20 MB of spaces in 20 kB.
    let spaces = model("", &(object(1, "", TETRAHEDRON) + &" ".repeat(20 << 20)), r#"<item objectid="1"/>"#);
    let message = load(&spaces).unwrap_err();
    assert!(message.contains("unpacks to more than 100 times its size"), "{message}");

    // Each object shows the one before ten times: 10^30 tetrahedra.
    let mut resources = object(1, "", TETRAHEDRON);
    for id in 2..=31 {
        let shown = format!(r#"<component objectid="{}"/>"#, id - 1).repeat(10);
        resources += &object(id, "", &format!("<components>{shown}</components>"));
    }
    let message = load(&model("", &resources, r#"<item objectid="31"/>"#)).unwrap_err();
    assert!(message.contains("places of objects") && message.contains("split the file"), "{message}");

    // A chain as deep as the file is long needs no stack.
    let mut chain = object(1, "", TETRAHEDRON);
    for id in 2..=20_000 {
        let shown = format!(r#"<components><component objectid="{}"/></components>"#, id - 1);
        let _ = write!(chain, "{}", object(id, "", &shown));
    }
    let loaded = load(&model("", &chain, r#"<item objectid="20000"/>"#)).unwrap();
    assert_eq!(loaded.report.faces_in_file, 4);
}

#[test]
fn every_proper_prefix_and_every_changed_byte_is_an_error_or_a_mesh() {
    let resources = object(1, "", TETRAHEDRON);
    let bytes = archive(&[("3D/3dmodel.model", &model("", &resources, r#"<item objectid="1"/>"#))]);
    for end in 0..bytes.len() {
        assert!(read_bytes(&bytes[..end], MeshFormat::ThreeMf).is_err(), "the first {end} bytes were read");
    }
    let mut refused = 0;
    for at in 0..bytes.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut changed = bytes.clone();
            changed[at] ^= flip;
            match read_bytes(&changed, MeshFormat::ThreeMf) {
                Ok(loaded) => assert!(loaded.mesh.vertices().iter().all(|p| p.is_finite())),
                Err(error) => {
                    refused += 1;
                    assert!(error.to_string().len() > 20);
                }
            }
        }
    }
    assert!(refused > bytes.len());
}
