//! The `.tesdf` container on good, damaged and hostile bytes.
use std::collections::BTreeMap;
use std::path::Path;

use proptest::prelude::*;
use tesdf::asset::{
    AssetError, Container, Element, FORMAT_VERSION, Section, SectionSpec, save_atomic, write_container,
};

const TABLE: &[SectionSpec] = &[
    SectionSpec::required("flags", Element::U8, 1),
    SectionSpec::required("points", Element::F64, 3),
    SectionSpec::required("faces", Element::U32, 3),
    SectionSpec::required("lengths", Element::U16, 1),
    SectionSpec::required("planes", Element::F32, 4),
    SectionSpec::optional("extra", Element::U32, 1),
];

const POINTS: [[f64; 3]; 3] = [[0.0, -1.5, 1e300], [f64::MIN_POSITIVE, 0.1, 2.0], [3.0, 4.0, 5.0]];

fn metadata() -> BTreeMap<String, String> {
    [("unit", "mm"), ("name", "Ⅿ16 \"bolt\"\n")].map(|(k, v)| (k.to_string(), v.to_string())).into()
}

fn sample() -> Vec<u8> {
    let sections = [
        Section::new(TABLE[0], &[1_u8, 2, 3]),
        Section::new(TABLE[1], &POINTS),
        Section::new(TABLE[2], &[[0_u32, 1, 2], [u32::MAX, 7, 8]]),
        Section::new(TABLE[3], &[513_u16, 2, 3]),
        Section::new(TABLE[4], &[] as &[[f32; 4]]),
    ];
    write_container(&sections, &metadata()).unwrap()
}

fn open(bytes: &[u8]) -> Result<Container, AssetError> {
    Container::from_bytes(bytes, TABLE)
}

fn message(bytes: &[u8]) -> String {
    open(bytes).unwrap_err().to_string()
}

/// The sample with an edited JSON header; the length field and the padding are adjusted.
fn edited(from: &str, to: &str) -> Vec<u8> {
    let bytes = sample();
    let end = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let json = std::str::from_utf8(&bytes[8..end]).unwrap().trim_end();
    assert!(json.contains(from), "{from} is not in {json}");
    let mut json = json.replacen(from, to, 1);
    while !json.len().is_multiple_of(8) {
        json.push(' ');
    }
    [&(json.len() as u64).to_le_bytes()[..], json.as_bytes(), &bytes[end..]].concat()
}

#[test]
fn round_trip_in_memory_and_mapped() {
    let bytes = sample();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tesdf");
    save_atomic(&path, &bytes).unwrap();
    for container in [open(&bytes).unwrap(), Container::open(&path, TABLE).unwrap()] {
        container.verify_checksums().unwrap();
        assert_eq!(container.as_bytes(), bytes);
        assert_eq!(container.metadata(), &metadata());
        assert_eq!(container.section::<[f64; 3]>("points").unwrap(), Some(&POINTS[..]));
        assert_eq!(container.section::<f64>("points").unwrap().unwrap().len(), 9);
        assert_eq!(container.section("lengths").unwrap(), Some(&[513_u16, 2, 3][..]));
        assert_eq!(container.section("flags").unwrap(), Some(&[1_u8, 2, 3][..]));
        assert_eq!(container.section::<[f32; 4]>("planes").unwrap(), Some(&[][..]));
        assert_eq!(container.section::<u32>("extra").unwrap(), None);
        assert!(container.section::<u16>("points").is_err());
        assert!(container.shared_section::<u32>("extra").is_err());
        let size: usize = container.sections().map(|s| s.bytes.len()).sum();
        assert_eq!(container.header_size() + size, bytes.len());
        let faces = container.shared_section::<[u32; 3]>("faces").unwrap();
        drop(container);
        let faces = std::thread::spawn(move || faces.to_vec()).join().unwrap();
        assert_eq!(faces, [[0, 1, 2], [u32::MAX, 7, 8]]);
    }
}

#[test]
fn same_input_same_bytes_as_the_golden_file() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/golden_container_v1");
    if std::env::var_os("TESDF_WRITE_GOLDEN").is_some() {
        save_atomic(&path, &sample()).unwrap();
    }
    let golden = std::fs::read(&path).unwrap();
    assert_eq!(sample(), golden, "the file format changed: raise FORMAT_VERSION and keep this file");
    assert_eq!(sample(), sample());
}

#[test]
fn the_safetensors_crate_reads_it() {
    let bytes = sample();
    let tensors = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    assert_eq!(tensors.len(), 5);
    let points = tensors.tensor("points").unwrap();
    assert_eq!(points.dtype(), safetensors::Dtype::F64);
    assert_eq!(points.shape(), [3, 3]);
    assert_eq!(points.data(), bytemuck::bytes_of(&POINTS));
    assert_eq!(tensors.tensor("flags").unwrap().shape(), [3]);
    let (_, header) = safetensors::SafeTensors::read_metadata(&bytes).unwrap();
    let stored = header.metadata().as_ref().unwrap();
    assert_eq!(stored["format"], "tesdf");
    assert_eq!(stored["version"], FORMAT_VERSION.to_string());
    assert_eq!(stored["name"], metadata()["name"]);
}

#[test]
fn every_proper_prefix_and_trailing_bytes_are_rejected() {
    let bytes = sample();
    for length in 0..bytes.len() {
        let e = open(&bytes[..length]).unwrap_err();
        if length > 0 {
            assert!(
                matches!(e, AssetError::Truncated { .. } | AssetError::Section { .. }),
                "prefix of {length} bytes: {e}"
            );
        }
    }
    let longer = [&bytes[..], &[0]].concat();
    assert!(matches!(open(&longer), Err(AssetError::TrailingBytes { extra: 1, .. })));
}

#[test]
fn every_flipped_bit_is_found() {
    let bytes = sample();
    for at in 0..bytes.len() {
        for bit in 0..8 {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << bit;
            assert!(open(&damaged).and_then(|c| c.verify_checksums()).is_err(), "byte {at} bit {bit}");
        }
    }
}

#[test]
fn errors_name_the_damaged_part() {
    let mut bytes = sample();
    let last = bytes.len() - 1;
    bytes[last] ^= 1; // the narrowest section comes last
    let e = open(&bytes).unwrap().verify_checksums().unwrap_err().to_string();
    assert!(e.starts_with("section flags: the checksum is "), "{e}");
    let e = open(&edited("mm", "cm")).unwrap().verify_checksums().unwrap_err().to_string();
    assert!(e.starts_with("header: the checksum is "), "{e}");
}

#[test]
fn wrong_sizes_in_the_header_name_the_section() {
    let huge = u64::MAX.to_string();
    let cases = [
        ("\"shape\":[3,3]", "\"shape\":[4,3]", "section points: data_offsets [0,72]"),
        ("\"shape\":[3,3]", "\"shape\":[3,4]", "section points: shape [3,4]; expected [3,3]"),
        ("\"shape\":[3,3]", "\"shape\":[9]", "section points: shape [9]; expected [9,3]"),
        ("\"shape\":[3,3]", "\"shape\":[3,3,1]", "section points: invalid length 3"),
        ("\"shape\":[3,3]", "\"shape\":[]", "section points: invalid length 0"),
        ("\"shape\":[3,3]", "\"shape\":[-3,3]", "section points: invalid value"),
        (
            "[3,3]",
            &format!("[{huge},3]"),
            "section points: data_offsets [0,72]; the section before ends at 0 and the shape [18446744073709551615,3] needs more",
        ),
        ("[0,72]", &format!("[0,{huge}]"), "section points: data_offsets"),
        ("[0,72]", "[72,0]", "section points: data_offsets [72,0]"),
        ("[0,72]", "[8,80]", "section points: data_offsets [8,80]"),
        (
            "\"shape\":[3,3],\"data_offsets\":[0,72]",
            "\"shape\":[384307168202282325,3],\"data_offsets\":[0,9223372036854775800]",
            "section points: it ends at byte 9223372036854775800 of the data",
        ),
        ("\"F64\"", "\"F32\"", "section points: element type F32; expected F64"),
        ("\"points\"", "\"faces\"", "section faces: element type F64"),
        ("\"points\":", "\"pints\":", "section pints: no section"),
        ("checksum.points", "checksum.pints", "section points: the metadata has no checksum.points"),
        ("\"unit\":", "\"checksum.z\":", "header: checksum.z belongs to no section"),
        ("\"unit\":", "\"name\":", "header: not the expected JSON: two metadata keys name"),
        ("\"mm\"", "7", "header: not the expected JSON: invalid type"),
        (
            "\"version\":\"1\"",
            "\"version\":\"3\"",
            "file-format version 3; this build reads versions 1 and 2; a newer",
        ),
        (
            "\"version\":\"1\"",
            "\"version\":\"0\"",
            "file-format version 0; this build reads versions 1 and 2; encode",
        ),
        ("\"checksum\":", "\"chksum\":", "header: the checksum does not follow"),
        ("\"tesdf\"", "\"tesfd\"", "this is a safetensors file of another kind"),
        ("\"planes\":", "\"points\":", "section points: it has two entries"),
        (
            "\"points\":{\"dtype\":\"F64\",\"shape\":[3,3],\"data_offsets\":[0,72]}",
            "\"flags\":{\"dtype\":\"U8\",\"shape\":[3],\"data_offsets\":[0,3]},\
             \"points\":{\"dtype\":\"F64\",\"shape\":[3,3],\"data_offsets\":[3,75]}",
            "section points: data_offsets [3,75] are not aligned to 8 bytes",
        ),
        (
            "\"points\":{",
            "\"__metadata__\":{\"a\":\"b\"},\"points\":{",
            "header: not the expected JSON: two entries __metadata__",
        ),
    ];
    for (from, to, expected) in cases {
        let found = message(&edited(from, to));
        assert!(found.contains(expected), "{from} -> {to}: {found}");
    }
    let mut bytes = sample();
    for length in [u64::MAX, 1 << 40, (1 << 20) + 8, 255, 0, 8] {
        bytes[..8].copy_from_slice(&length.to_le_bytes());
        let found = message(&bytes);
        assert!(found.starts_with("header: "), "length {length}: {found}");
    }
    let without = [Section::new(TABLE[0], &[0_u8])];
    let found = message(&write_container(&without, &BTreeMap::new()).unwrap());
    assert_eq!(found, "section points: it is missing");
    let nested = [&40_000_u64.to_le_bytes()[..], "[".repeat(40_000).as_bytes()].concat();
    assert!(open(&nested).is_err());
}

#[test]
fn a_header_has_at_most_1024_sections_and_as_many_metadata_keys() {
    let empty = "\"x\":{\"dtype\":\"U8\",\"shape\":[0],\"data_offsets\":[0,0]},";
    // The sample has five sections of its own.
    for (count, expected) in [(1024 - 5, "section x: no section"), (1024 - 4, "more than 1024 sections")] {
        let found = message(&edited("\"points\":{", &(empty.repeat(count) + "\"points\":{")));
        assert!(found.contains(expected), "{count} sections: {found}");
    }
    // The sample has the format, the version, two keys of its own, and six checksums.
    for (count, is_read) in [(1024 - 10, true), (1024 - 9, false)] {
        let keys: String = (0..count).map(|k| format!("\"k{k}\":\"\",")).collect();
        let bytes = edited("\"unit\":", &(keys + "\"unit\":"));
        match open(&bytes) {
            Ok(container) => assert!(is_read && container.metadata().len() == count + 2, "{count}"),
            Err(e) => {
                assert!(!is_read && e.to_string().contains("more than 1024 metadata keys"), "{count}: {e}")
            }
        }
    }
}

#[test]
fn errors_shorten_long_names_and_count_bytes_in_words() {
    for (length, shown) in [(64, "x".repeat(64)), (65, "x".repeat(64) + "…")] {
        let found = message(&edited("\"points\":", &format!("\"{}\":", "x".repeat(length))));
        assert!(found.starts_with(&format!("section {shown}: no section")), "{length}: {found}");
    }
    for (extra, expected) in [(1, "1 byte follows the last section"), (2, "2 bytes follow the last section")]
    {
        let found = message(&[&sample()[..], &vec![0; extra]].concat());
        assert!(found.starts_with(expected), "{found}");
    }
}

#[test]
fn other_formats_are_recognised() {
    let stl = [vec![0; 80], 1_u32.to_le_bytes().to_vec(), vec![0; 50]].concat();
    for (bytes, expected) in [
        (&stl[..], "an STL mesh"),
        (b"solid part\nfacet", "an STL mesh"),
        (b"ply\nformat ascii 1.0\n", "a PLY mesh"),
        (b"ply\rformat ascii 1.0\r", "a PLY mesh"),
        (b"OFF\n3 1 0\n", "an OFF mesh"),
        (b"glTF\x02\0\0\0\0\0\0\0", "a GLB mesh"),
        (b"# made by\nv 0 0 0\n", "text, perhaps an OBJ mesh"),
        (b"PK\x03\x04", "a ZIP archive"),
        (b"\x1f\x8b\x08\0\0\0\0\0\0\x03", "a gzip file"),
        // An STL file without triangles is as long as its head, and tells nothing.
        (&[0x80; 80].into_iter().chain([0; 4]).collect::<Vec<u8>>(), "an unknown kind of file"),
        (b"", "an empty file"),
        (b"\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff", "an unknown kind of file"),
    ] {
        let found = message(bytes);
        assert!(found.starts_with(&format!("this is {expected}, not a .tesdf file; ")), "{found}");
    }
    let folder = tempfile::tempdir().unwrap();
    let e = Container::open(folder.path().join("none.tesdf"), TABLE).unwrap_err();
    assert!(e.to_string().starts_with("cannot open "), "{e}");
    assert!(Container::open(folder.path(), TABLE).is_err());
    let empty = folder.path().join("empty");
    save_atomic(&empty, b"").unwrap();
    assert!(matches!(Container::open(&empty, TABLE), Err(AssetError::NotTesdf { .. })));
}

#[test]
fn unreadable_files_are_never_written() {
    let reserved = BTreeMap::from([("checksum.x".to_string(), String::new())]);
    let e = write_container(&[], &reserved).unwrap_err().to_string();
    assert_eq!(e, "header: the metadata key checksum.x is reserved; use another");
    let part = Section::new(TABLE[1], &[1.0_f64, 2.0]);
    let e = write_container(&[part], &BTreeMap::new()).unwrap_err().to_string();
    assert_eq!(e, "section points: 16 bytes are not whole rows of 24 bytes");
    let twice = [Section::new(TABLE[0], &[0_u8]); 2];
    let e = write_container(&twice, &BTreeMap::new()).unwrap_err().to_string();
    assert_eq!(e, "section flags: given twice");
    let no_columns = Section::new(SectionSpec::required("none", Element::U8, 0), &[] as &[u8]);
    let e = write_container(&[no_columns], &BTreeMap::new()).unwrap_err().to_string();
    assert_eq!(e, "section none: 0 bytes are not whole rows of 0 bytes");
    let long = BTreeMap::from([("k".to_string(), "x".repeat(1 << 20))]);
    assert!(write_container(&[], &long).is_err());
}

/// A pipe cannot be mapped, and its length is not known before its end.
#[cfg(target_os = "linux")]
#[test]
fn a_container_is_read_from_a_pipe() {
    use std::io::Write;
    use std::os::fd::AsRawFd;
    let (reader, mut writer) = std::io::pipe().unwrap();
    writer.write_all(&sample()).unwrap();
    drop(writer);
    let container = Container::open(format!("/dev/fd/{}", reader.as_raw_fd()), TABLE).unwrap();
    container.verify_checksums().unwrap();
    assert_eq!(container.as_bytes(), sample());
}

#[test]
fn types_are_send_and_sync() {
    fn check<T: Send + Sync>() {}
    check::<Container>();
    check::<tesdf::asset::SharedSection<f64>>();
    check::<AssetError>();
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None,
        rng_seed: prop::test_runner::RngSeed::Fixed(7), ..ProptestConfig::default() })]

    /// Replaces, removes and inserts bytes, mostly in the header, and calls every accessor.
    #[test]
    fn mutated_bytes_never_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0..4_u8, any::<u8>()), 1..12),
        repair_length in any::<bool>(),
    ) {
        let mut bytes = sample();
        let original = bytes.clone();
        let end = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        let mut shift = 0_i64;
        for (at, kind, value) in edits {
            let at = 8 + at.index(end - 8).min(bytes.len() - 9);
            let digit = b"0123456789[]{},:\"-.eE "[usize::from(value) % 22];
            match kind {
                0 => bytes[at] = value,
                1 => bytes[at] = digit,
                2 => { bytes.remove(at); shift -= 1; }
                _ => { bytes.insert(at, digit); shift += 1; }
            }
        }
        if repair_length {
            let length = (end as i64 - 8 + shift).max(0) as u64 / 8 * 8;
            bytes[..8].copy_from_slice(&length.to_le_bytes());
        }
        if let Ok(container) = open(&bytes) {
            for section in container.sections() {
                let _ = container.section::<u8>(section.spec.name);
                let _ = container.section::<[f64; 3]>(section.spec.name);
            }
            prop_assert!(container.verify_checksums().is_err() || bytes == original);
        }
    }
}
