//! Assets with hostile bytes: opening is refused with a named error, or every query ends without a
//! panic.

use std::collections::BTreeMap;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use crate::support::cells::{Cells, section};
use crate::support::meshes::encoded;
use crate::support::random::Random;
use crate::support::reference::Reference;
use crate::support::shapes::Shape;
use crate::support::tetrahedra::cube;
use crate::support::well_formed::WellFormed;
use proptest::prelude::*;
use tesdf::asset::about::Source;
use tesdf::asset::{AssetError, CellKind, Section, SectionSpec, layout, save_atomic, write_container};
use tesdf::base::{Inside, InsideRule};
use tesdf::domain::MAX_DEPTH;
use tesdf::encode::{Domain, EncodeOptions, Encoder, Preset};
use tesdf::geometry::internal::AabbTree;
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf::query::Precision;
use tesdf::{Length, TeSdf};

fn ball() -> SolidMesh {
    Shape::default().add_sphere(DVec3::new(0.1, 0.2, 0.3), 1, || 1.0).solid()
}

/// A small asset with every kind of cell: outside, inside, crossing, far, not of the domain.
fn small() -> TeSdf {
    // Between the ball and the region is no part of the domain.
    let regions = vec![[3.0, 3.0, 3.0, 3.5, 3.5, 3.5]];
    let band = Length::OfDiagonal(0.3);
    let options = EncodeOptions { byte_worth: 0.1, band, regions, ..EncodeOptions::default() };
    let source = Source { name: "ball.obj".into(), blake3: "0".repeat(64), repair: None };
    Encoder::new().options(options).source(source.clone()).encode(&ball()).expect("valid options")
}

/// A file of this format version, written once. It must continue to open and give the same answers.
/// Raise `FORMAT_VERSION` when the bytes of an asset change their meaning. `TESDF_WRITE_GOLDEN=1`
/// writes the file.
#[test]
fn the_golden_asset_answers() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/golden_asset_v1");
    if std::env::var_os("TESDF_WRITE_GOLDEN").is_some() {
        save_atomic(&path, small().as_bytes()).expect("a writable folder");
    }
    let asset = TeSdf::open(&path).expect("a golden file of this version opens");
    asset.verify_checksums().expect("intact");
    let layout = |asset: &TeSdf| asset.container().sections().map(|s| s.spec).collect::<Vec<_>>();
    assert_eq!(layout(&asset), layout(&small()), "the sections changed");

    let solid = ball();
    let (reference, cells) = (Reference::new(solid.mesh()), Cells::of(&asset));
    let band = 0.3 * reference.local_diagonal();
    WellFormed { reference: &reference, cells: &cells, band, lattice: 2, max_cells: usize::MAX }
        .check()
        .expect("cells");
    for (kind, p) in crate::support::points::sample(solid.mesh(), &cells, 900) {
        let error = asset.signed_distance(p) - reference.signed_distance(p);
        assert!(error.abs() <= reference.tolerance_f64(p), "{kind:?} {p}: {error:e}");
        let error = asset.signed_distance_f32(p) - reference.signed_distance(p);
        assert!(error.abs() <= 2.0 * reference.tolerance_f32(p), "{kind:?} {p}: {error:e}");
    }
}

#[test]
fn the_small_asset_has_every_kind_of_cell() {
    let mut kinds = Vec::new();
    small().visit_cells(|cell| kinds.push(cell.kind));
    let is_far = |kind: &CellKind| matches!(kind, CellKind::FarOutside | CellKind::FarInside);
    assert!(kinds.iter().any(is_far));
    for kind in [CellKind::Outside, CellKind::Inside, CellKind::Crossing, CellKind::NotOfDomain] {
        assert!(kinds.contains(&kind), "{kind:?}");
    }
}

#[test]
fn every_proper_prefix_is_refused() {
    let bytes = small().as_bytes().to_vec();
    for end in 0..bytes.len() {
        assert!(TeSdf::from_bytes(&bytes[..end]).is_err(), "the first {end} of {} bytes open", bytes.len());
    }
    let longer = [bytes.as_slice(), &[0]].concat();
    assert!(matches!(TeSdf::from_bytes(&longer), Err(AssetError::TrailingBytes { .. })));
}

/// Flips one bit anywhere. The checksums detect it, if opening does not.
#[test]
fn checksums_cover_every_byte() {
    let bytes = small().as_bytes().to_vec();
    let mut random = Random(9);
    for at in (0..bytes.len()).step_by(7) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << random.index(8);
        let seen = TeSdf::from_bytes(&damaged).and_then(|asset| asset.verify_checksums());
        assert!(seen.is_err(), "byte {at} of {}", bytes.len());
    }
}

/// Byte ranges of the sections in the file.
fn ranges(asset: &TeSdf) -> Vec<(&'static str, std::ops::Range<usize>)> {
    let file = asset.as_bytes().as_ptr() as usize;
    let sections = asset.container().sections();
    let placed = sections.map(|s| (s.spec.name, s.bytes.as_ptr() as usize - file, s.bytes.len()));
    placed.filter(|(_, _, n)| *n > 0).map(|(name, at, n)| (name, at..at + n)).collect()
}

/// Calls every kind of query, at points near, far, on the body and not finite.
fn ask(asset: &TeSdf, random: &mut Random) {
    let extremes = [f64::NAN, f64::INFINITY, f64::MAX, -f64::MAX, 1e30, 1e-310, 0.0];
    for i in 0..12 {
        let mut p = DVec3::new(0.1, 0.2, 0.3) + 1.2 * random.in_cube();
        match i {
            0 => p[random.index(3)] = extremes[random.index(extremes.len())],
            1 => p *= 1e3,
            2 => p = DVec3::from_array(std::array::from_fn(|k| asset.face_corners(0)[0][k])),
            _ => {}
        }
        for precision in [Precision::F32, Precision::F64] {
            asset.query_with(p, precision);
            asset.query_in_domain_with(p, precision);
        }
        asset.query_batch_f32(&[p, -p]);
        asset.is_inside(p);
        asset.reads(p);
        asset.ray_cast(p, random.in_cube(), f64::INFINITY);
        asset.ray_cast(p, DVec3::X * 1e300, 1e300);
    }
}

/// Opens the bytes and queries them. Returns whether they opened.
fn survives(bytes: &[u8], random: &mut Random) -> bool {
    match TeSdf::from_bytes(bytes) {
        Ok(asset) => {
            ask(&asset, random);
            true
        }
        Err(e) => {
            let text = e.to_string();
            assert!(
                text.contains("section") || text.contains("header") || text.contains("metadata"),
                "{text}"
            );
            false
        }
    }
}

/// A number that is hostile as an index, a count, an offset or a coordinate.
fn hostile_bytes(random: &mut Random, width: usize, size: usize) -> [u8; 8] {
    let word = [
        0,
        1,
        u64::MAX,
        1 << 31,
        (1 << 31) - 1,
        (7 << 28) | 1 << 31,
        size as u64,
        random.bits(),
        random.bits() % 64,
    ];
    let floats = [f64::NAN, f64::INFINITY, -1e300, 1e-300, f64::MIN_POSITIVE, 0.0, -0.0, 1e20, f64::MAX];
    let which = random.index(word.len());
    match (width, random.index(2)) {
        (8, 0) => floats[which].to_le_bytes(),
        (4, 0) => {
            let mut bytes = [0; 8];
            bytes[..4].copy_from_slice(&(floats[which] as f32).to_le_bytes());
            bytes
        }
        _ => word[which].to_le_bytes(),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, ..ProptestConfig::default() })]

    /// Changes the sections, but not the header.
    #[test]
    fn mutated_sections(seed in any::<u64>(), changes in 1usize..4) {
        let asset = SMALL.get_or_init(small);
        let ranges = ranges(asset);
        let mut random = Random(seed);
        let mut bytes = asset.as_bytes().to_vec();
        for _ in 0..changes {
            let (name, range) = &ranges[random.index(ranges.len())];
            let spec = layout::SECTIONS.iter().find(|s| s.name == *name).expect("a section of the format");
            let width = spec.element.size();
            let at = range.start + width * random.index(range.len() / width);
            let value = hostile_bytes(&mut random, width, range.len() / width);
            bytes[at..at + width].copy_from_slice(&value[..width]);
        }
        survives(&bytes, &mut random);
    }

    /// Changes the header too.
    #[test]
    fn mutated_bytes(seed in any::<u64>(), changes in 1usize..4) {
        let asset = SMALL.get_or_init(small);
        let mut random = Random(seed);
        let mut bytes = asset.as_bytes().to_vec();
        let header = bytes.len() - ranges(asset).iter().map(|r| r.1.len()).sum::<usize>();
        for _ in 0..changes {
            let at = random.index(header);
            bytes[at] = random.bits() as u8;
        }
        if let Ok(asset) = TeSdf::from_bytes(&bytes) {
            ask(&asset, &mut random);
        }
    }
}

static SMALL: std::sync::OnceLock<TeSdf> = std::sync::OnceLock::new();

/// Writes one hostile number at a time: everywhere in short sections, and in the first words of
/// long sections.
#[test]
fn every_word_in_turn() {
    let asset = small();
    let mut random = Random(1);
    let mut opened = 0;
    let mut refused = 0;
    for (name, range) in ranges(&asset) {
        let spec = layout::SECTIONS.iter().find(|s| s.name == name).expect("a section of the format");
        let width = spec.element.size();
        for at in range.clone().step_by(width).take(48) {
            for _ in 0..12 {
                let mut bytes = asset.as_bytes().to_vec();
                let value = hostile_bytes(&mut random, width, range.len() / width);
                bytes[at..at + width].copy_from_slice(&value[..width]);
                if survives(&bytes, &mut random) { opened += 1 } else { refused += 1 }
            }
        }
    }
    assert!(opened > 100 && refused > 100, "{opened} opened, {refused} refused");
}

/// A forest with a cycle, or with a word that is reached twice, is refused; so is such a face tree.
#[test]
fn cycles_are_refused() {
    let asset = small();
    let at = |name: &str| ranges(&asset).into_iter().find(|r| r.0 == name).expect("the section").1.start;
    let refused = |at: usize, words: &[u32]| {
        let mut bytes = asset.as_bytes().to_vec();
        let words: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
        bytes[at..at + words.len()].copy_from_slice(&words);
        TeSdf::from_bytes(&bytes).expect_err("a cycle").to_string()
    };
    for child in [0, 1, 5, 7, u32::MAX >> 1] {
        let e = refused(at("domain.nodes"), &[child]);
        assert!(e.contains("domain.nodes"), "{child}: {e}");
    }
    let shared = refused(at("domain.nodes"), &[6, 6]);
    assert!(shared.contains("domain.nodes"), "{shared}");
    for children in [[0, 0], [1, 1], [u32::MAX >> 1, 1]] {
        let e = refused(at("tree.children"), &children);
        assert!(e.contains("tree.children"), "{children:?}: {e}");
    }
}

/// Overlapping lists would let a small file demand the work of a large one.
#[test]
fn lists_that_overlap_are_refused() {
    let asset = small();
    let place = |name: &str| ranges(&asset).into_iter().find(|r| r.0 == name).expect("the section").1;
    let (nodes, lists) = (place(layout::NODES.name), place(layout::LISTS.name));
    // Every third byte begins the slots of one list and is a slot of others. All lists use palette
    // 0.
    const COUNT: u8 = 36;
    let mut bytes = asset.as_bytes().to_vec();
    bytes[lists.clone()].iter_mut().enumerate().for_each(|(i, b)| *b = if i % 3 == 2 { COUNT } else { 0 });
    let offsets = (0..lists.len() as u32 - 3 - u32::from(COUNT)).step_by(3).cycle();
    let listed = bytes[nodes].chunks_exact_mut(4).filter(|word| matches!(word[3] >> 4, 8..=13));
    listed.zip(offsets).for_each(|(word, offset)| word.copy_from_slice(&(1 << 31 | offset).to_le_bytes()));
    let error = TeSdf::from_bytes(&bytes).unwrap_err().to_string();
    assert!(error.contains("domain.nodes") && error.contains("it overlaps others"), "{error}");
}

/// A section, and the bytes that it gets.
type Change = (SectionSpec, Vec<u8>);

fn rows<T: bytemuck::Pod>(spec: SectionSpec, rows: &[T]) -> Change {
    (spec, bytemuck::cast_slice(rows).to_vec())
}

/// The file of the asset with other sections and metadata, and with their checksums.
fn rewritten(asset: &TeSdf, changes: &[Change], metadata: &BTreeMap<String, String>) -> Vec<u8> {
    let is_kept = |s: &Section| changes.iter().all(|(spec, _)| *spec != s.spec);
    let mut sections: Vec<Section> = asset.container().sections().filter(is_kept).collect();
    sections.extend(changes.iter().map(|(spec, bytes)| Section { spec: *spec, bytes }));
    write_container(&sections, metadata).expect("whole rows")
}

fn with_changes(asset: &TeSdf, changes: &[Change]) -> Result<TeSdf, AssetError> {
    TeSdf::from_bytes(&rewritten(asset, changes, asset.container().metadata()))
}

/// An asset with changed sections does not open, and the error names a section and says why.
fn assert_refused(asset: &TeSdf, changes: &[Change], section: SectionSpec, expected: &str) {
    match with_changes(asset, changes) {
        Err(AssetError::Section { name, reason }) => {
            assert!(name == section.name && reason.contains(expected), "{name}: {reason}; {expected}");
        }
        other => panic!("{}: {expected}: {:?}", section.name, other.map(|_| ())),
    }
}

/// A forest whose first root is bisected this often, always at the first child. The other words are
/// not of the domain.
fn forest_of_depth(depth: u32) -> Vec<u32> {
    let mut nodes = vec![layout::Node::NotOfDomain.encode(); 6 + 2 * depth as usize];
    let mut word = 0;
    for children in (6..).step_by(2).take(depth as usize) {
        nodes[word] = layout::Node::Split(children).encode();
        word = children as usize;
    }
    nodes
}

/// A face tree of this many nodes in a row. Each of them has the next one and a leaf.
fn tree_in_a_row(nodes: u32) -> [Change; 2] {
    let leaf = layout::TreeChild::Leaf(0, 1).encode();
    let below = (1..nodes).map(|n| layout::TreeChild::Node(n).encode()).chain([leaf]);
    let children: Vec<[u32; 2]> = below.map(|child| [child, leaf]).collect();
    let boxes = vec![[0_f32; 12]; children.len()];
    [rows(layout::TREE_CHILDREN, &children), rows(layout::TREE_BOXES, &boxes)]
}

#[test]
fn sections_that_do_not_fit_each_other_are_refused_by_name() {
    use layout::*;
    let asset = small();
    let f = asset.face_count();
    let bytes = |spec: SectionSpec| {
        let found = asset.container().sections().find(|s| s.spec == spec);
        found.expect("the section").bytes.to_vec()
    };
    let less = |spec: SectionSpec| (spec, bytes(spec)[spec.row_size()..].to_vec());
    let more = |spec: SectionSpec| (spec, [bytes(spec), vec![0; spec.row_size()]].concat());
    let palettes = section::<u16>(&asset, PALETTES).len();
    let p = palettes as u32;
    let boxes = section::<[f32; 12]>(&asset, TREE_BOXES).len();
    let depth = AabbTree::MAX_DEPTH;
    let deep = format!("node {} is deeper than {depth}", depth + 1);
    let of_faces = |n: usize| format!("{n} entries for {f} faces");
    let cases: Vec<(Vec<Change>, SectionSpec, String)> = vec![
        (vec![rows::<u32>(FACES, &[])], FACES, "0 faces; expected 1 to".into()),
        (vec![less(FACE_IDS)], FACE_IDS, of_faces(f - 1)),
        (vec![more(FACE_IDS)], FACE_IDS, of_faces(f + 1)),
        (vec![less(SIGN_HINTS)], SIGN_HINTS, of_faces(f - 1)),
        (vec![rows(FRAME, &[0_f64; 7])], FRAME, "7 numbers; expected 8".into()),
        (vec![rows(FRAME, &[0_f64; 9])], FRAME, "9 numbers; expected 8".into()),
        (
            vec![rows(PALETTES_HIGH, &vec![0_u8; palettes + 1])],
            PALETTES_HIGH,
            format!("{} entries for {palettes}", palettes + 1),
        ),
        (vec![rows(PALETTES_HIGH, &vec![1_u8; palettes])], PALETTES, "entry 0 names a face".into()),
        (vec![rows::<u32>(PALETTE_STARTS, &[])], PALETTE_STARTS, "does not begin at 0".into()),
        (
            vec![rows(PALETTE_STARTS, &[0, p, 0, p])],
            PALETTE_STARTS,
            "palette 1 has not 0 to 256 faces".into(),
        ),
        (
            vec![rows(PALETTE_STARTS, &[0_u32, 257]), rows(PALETTES, &[0_u16; 257])],
            PALETTE_STARTS,
            "palette 0 has not 0 to 256 faces".into(),
        ),
        (vec![rows(NODES, &[0_u32; 5])], NODES, "5 words; expected the 6 roots at least".into()),
        (
            vec![rows(NODES, &forest_of_depth(MAX_DEPTH + 1))],
            NODES,
            format!("deeper than {MAX_DEPTH} bisections"),
        ),
        (
            vec![rows::<u32>(TREE_CHILDREN, &[]), rows::<f32>(TREE_BOXES, &[])],
            TREE_BOXES,
            "0 boxes for 0 nodes".into(),
        ),
        (vec![less(TREE_BOXES)], TREE_BOXES, format!("{} boxes for {boxes} nodes", boxes - 1)),
        (tree_in_a_row(depth as u32 + 2).to_vec(), TREE_CHILDREN, deep),
        (vec![rows(SIGN_FACES, &[[0_u32, 1, 2]])], SIGN_FACES, "no rule that counts them".into()),
    ];
    for (changes, section, expected) in &cases {
        assert_refused(&asset, changes, *section, expected);
    }

    // As deep as may be, and with bits of faces that a small asset can do without.
    let chain = rows(NODES, &forest_of_depth(MAX_DEPTH));
    assert!(with_changes(&asset, &[chain]).is_ok());
    let error = with_changes(&asset, &tree_in_a_row(depth as u32 + 1)).expect_err("faces are missing");
    assert!(error.to_string().contains("leaves hold"), "{error}");
    let high = with_changes(&asset, &[rows(PALETTES_HIGH, &vec![0_u8; palettes])]).expect("whole");
    for k in 0..20 {
        let p = DVec3::splat(0.1 * f64::from(k) - 0.9);
        assert_eq!(high.query(p), asset.query(p));
    }
}

/// Files of more faces than words can name are mostly a hole, which takes no room and no time.
#[test]
fn more_faces_than_words_can_name_are_refused() {
    let asset = small();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("large.tesdf");
    let rows = (layout::MAX_FACES + 1) as u64;
    let bytes = asset.as_bytes();
    let end = asset.container().header_size();
    let json = std::str::from_utf8(&bytes[8..end]).expect("JSON");
    let faces = ranges(&asset).into_iter().find(|r| r.0 == layout::FACES.name).expect("the section").1;
    let (from, to) = (faces.start - end, faces.end - end);
    let old = format!("\"shape\":[{},3],\"data_offsets\":[{from},{to}]", asset.face_count());
    assert!(json.contains(&format!("\"{}\":{{\"dtype\":\"U32\",{old}", layout::FACES.name)), "{json}");
    // The sections after the faces follow the hole.
    let more = (rows - asset.face_count() as u64) * layout::FACES.row_size() as u64;
    let mut json = json
        .trim_end()
        .replace(&old, &format!("\"shape\":[{rows},3],\"data_offsets\":[{from},{}]", to as u64 + more));
    for (name, range) in ranges(&asset).into_iter().filter(|(_, range)| range.start >= faces.end) {
        let [from, to] = [range.start - end, range.end - end];
        let moved = format!("[{},{}]", from as u64 + more, to as u64 + more);
        let old = format!("\"data_offsets\":[{from},{to}]");
        assert!(json.contains(&old), "{name}");
        json = json.replace(&old, &format!("\"data_offsets\":{moved}"));
    }
    while !json.len().is_multiple_of(8) {
        json.push(' ');
    }
    let head = [&(json.len() as u64).to_le_bytes()[..], json.as_bytes(), &bytes[end..faces.end]].concat();
    std::fs::write(&path, head).expect("a writable folder");
    let mut file = std::fs::OpenOptions::new().write(true).open(&path).expect("the file");
    let length = file.metadata().expect("a length").len();
    file.set_len(length + more).expect("a hole");
    file.seek(SeekFrom::End(0)).expect("the end");
    file.write_all(&bytes[faces.end..]).expect("room");
    drop(file);
    let error = TeSdf::open(&path).expect_err("too many faces").to_string();
    assert_eq!(error, format!("section mesh.faces: {rows} faces; expected 1 to {}", layout::MAX_FACES));
}

/// A cube in a conforming domain of a few tetrahedra.
fn conforming() -> TeSdf {
    let (solid, domain) = cube();
    let encoder = Encoder::new().preset(Preset::Fast).domain(Domain::Conforming(&domain));
    encoder.encode(&solid).expect("valid options")
}

#[test]
fn damaged_tetrahedra_are_refused_by_name() {
    use layout::*;
    let asset = conforming();
    let mut vertices: Vec<[f64; 3]> = section(&asset, DOMAIN_VERTICES);
    let mut tetrahedra: Vec<[u32; 4]> = section(&asset, TETRAHEDRA);
    let count = vertices.len() + section::<[f64; 3]>(&asset, VERTICES).len();
    vertices[7][1] = f64::NAN;
    tetrahedra[5][2] = count as u32;
    let used = format!("tetrahedron 5 uses {:?} of {count} vertices", tetrahedra[5]);
    assert_refused(&asset, &[rows(DOMAIN_VERTICES, &vertices)], DOMAIN_VERTICES, "vertex 7 is not finite");
    assert_refused(&asset, &[rows(TETRAHEDRA, &tetrahedra)], TETRAHEDRA, &used);
    assert_refused(&asset, &[rows::<u32>(TETRAHEDRA, &[])], TETRAHEDRA, "there is no tetrahedron");
    tetrahedra[5][2] = count as u32 - 1;
    assert!(with_changes(&asset, &[rows(TETRAHEDRA, &tetrahedra)]).is_ok(), "all vertices exist");
}

/// What the metadata says of the sign fits the sections and the certificate, or is refused.
#[test]
fn signs_that_do_not_fit_are_refused() {
    let asset = conforming();
    let mut metadata = asset.container().metadata().clone();
    metadata.insert("inside".into(), "rule".into());
    let error = TeSdf::from_bytes(&rewritten(&asset, &[], &metadata)).expect_err("cells tell the side");
    let text = error.to_string();
    assert!(text.starts_with("section domain.tetrahedra: a conforming domain, whose cells tell"), "{text}");

    let plate = TriangleMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]).expect("valid ids");
    let inside = Inside::new(InsideRule::Sheet { thickness: 0.34375 });
    let plate = SolidMesh::with_inside(plate, inside).expect("a sheet");
    let asset = encoded(&plate);
    let metadata = asset.container().metadata();
    let fit = "the certificate's rule sheet does not fit the key inside";
    let cases = [
        ("0.34375", "0.0", fit),
        ("0.34375", "-0.34375", fit),
        ("0.34375", "1e999", "the metadata's certificate is not what was expected: number out of range"),
        ("0.34375", "null", "the metadata's certificate is not what was expected: invalid type"),
    ];
    for (from, to, expected) in cases {
        let mut metadata = metadata.clone();
        let certificate = metadata.get_mut("certificate").expect("the certificate");
        assert!(certificate.contains(from), "{certificate}");
        *certificate = certificate.replace(from, to);
        let error = TeSdf::from_bytes(&rewritten(&asset, &[], &metadata)).expect_err("no thickness");
        assert!(error.to_string().contains(expected), "{to}: {error}");
    }
    for (signs, expected) in
        [("cells", fit), ("rule", fit), ("sheets", "inside is sheets; expected cells, rule")]
    {
        let mut metadata = metadata.clone();
        metadata.insert("inside".into(), signs.into());
        let error = TeSdf::from_bytes(&rewritten(&asset, &[], &metadata)).expect_err("another rule");
        assert!(error.to_string().contains(expected), "{signs}: {error}");
    }
}
