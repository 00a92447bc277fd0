//! Assets with hostile bytes: opening is refused with a named error, or every query ends without a
//! panic.

use std::path::Path;

use crate::support::cells::Cells;
use crate::support::random::Random;
use crate::support::reference::Reference;
use crate::support::shapes::Shape;
use crate::support::well_formed::WellFormed;
use proptest::prelude::*;
use tesdf::asset::about::Source;
use tesdf::asset::{AssetError, layout, save_atomic};
use tesdf::encode::{EncodeOptions, Encoder};
use tesdf::glam::DVec3;
use tesdf::mesh::SolidMesh;
use tesdf::query::Precision;
use tesdf::{Length, TeSdf};

fn ball() -> SolidMesh {
    Shape::default().add_sphere(DVec3::new(0.1, 0.2, 0.3), 1, || 1.0).solid()
}

/// A small asset with every kind of cell: outside, inside, crossing, far, not of the domain.
fn small() -> TeSdf {
    let options =
        EncodeOptions { byte_worth: 0.5, band: Length::OfDiagonal(0.3), ..EncodeOptions::default() };
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
