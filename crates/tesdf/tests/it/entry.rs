//! The entry points of the library: from files and solids to assets, by the builder and with the
//! defaults.

use std::error::Error as _;
use std::path::PathBuf;

use crate::support::meshes::data;
use tesdf::encode::{Domain, EncodeError, EncodeFileError, Method, Sampling};
use tesdf::mesh::{ReadSolidError, read};
use tesdf::{EncodeOptions, Encoder, Length, Preset, SolidMesh, Source, TeSdf};

fn cube() -> PathBuf {
    data().join("procedural/cube.obj")
}

#[test]
fn encoding_a_file_equals_encoding_its_solid_and_records_the_file() {
    let loaded = read(cube()).unwrap();
    let source = Source::of_file(cube(), loaded.report.source_blake3);
    let solid = SolidMesh::new(loaded.mesh).unwrap();
    assert_eq!(SolidMesh::read(cube()).unwrap(), solid);
    let asset = TeSdf::encode_file(cube()).unwrap();
    assert_eq!(asset.about().source, source);
    assert_eq!((source.name.as_str(), source.blake3.len()), ("cube.obj", 64));
    let by_hand = Encoder::new().source(source).encode(&solid).unwrap();
    assert!(asset.as_bytes() == by_hand.as_bytes());
    // The file replaces another source.
    let other = Source { name: "another.stl".into(), ..Source::default() };
    assert!(Encoder::new().source(other).encode_file(cube()).unwrap().as_bytes() == asset.as_bytes());
}

#[test]
fn the_order_of_encoder_methods_does_not_matter() {
    let solid = SolidMesh::read(cube()).unwrap();
    let (band, unit) = (Length::Absolute(0.003), "m");
    let options = EncodeOptions { band, unit: Some(unit.into()), ..EncodeOptions::preset(Preset::Compact) };
    let expected = Encoder::new().options(options).encode(&solid).unwrap();
    let before = Encoder::new().band(band).unit(unit).preset(Preset::Compact).encode(&solid).unwrap();
    let after = Encoder::new().preset(Preset::Compact).unit(unit).band(band).encode(&solid).unwrap();
    assert!(before.as_bytes() == expected.as_bytes() && after.as_bytes() == expected.as_bytes());
    // One encoder can encode many solids.
    let encoder = Encoder::new().preset(Preset::Fast);
    let [first, second] = [(); 2].map(|()| encoder.encode(&solid).unwrap());
    assert!(first.as_bytes() == second.as_bytes() && first.unit().is_none());
}

#[test]
fn names_of_options_in_files_are_stable() {
    let of = |options: EncodeOptions| serde_json::to_value(options).unwrap()["encoder"].clone();
    assert_eq!(of(EncodeOptions::default()), "certified");
    let sampled = of(EncodeOptions::SAMPLED_SAFE);
    let sampling = &sampled["sampled"];
    assert_eq!((&sampling["resolution"], &sampling["threshold"]), (&16.into(), &"covering_radius".into()));
    let read: EncodeOptions = serde_json::from_str(
        r#"{"band":{"of_diagonal":0.05},"regions":[],"byte_worth":0.067,"tighten_levels":0,"unit":null,
            "encoder":{"sampled":{"resolution":16,"shrink":1.0,"threshold":"covering_radius"}},
            "refinement":"none"}"#,
    )
    .unwrap();
    assert_eq!(read, EncodeOptions::SAMPLED_SAFE);
    assert_eq!(read.method, Method::Sampled(Sampling::SAFE));
}

#[test]
fn errors_name_the_file_once_and_carry_the_cause() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let garbage = write("garbage.obj", "v 0 0\n");
    let open = write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let missing = folder.path().join("missing.stl");
    let unknown = write("part.xyz", "");
    let encoder = Encoder::new();
    for (path, kind) in [(&garbage, "read"), (&missing, "read"), (&unknown, "read"), (&open, "not solid")] {
        let error = encoder.encode_file(path).unwrap_err();
        let found = match &error {
            EncodeFileError::Solid(ReadSolidError::Read { .. }) => "read",
            EncodeFileError::Solid(ReadSolidError::NotSolid { .. }) => "not solid",
            EncodeFileError::Encode { .. } => "encode",
            _ => "other",
        };
        assert_eq!((found, error.path()), (kind, path.as_path()));
        let text = error.to_string();
        assert_eq!(text.matches(&path.display().to_string()).count(), 1, "{text}");
        assert!(error.source().is_some_and(|cause| text.ends_with(&cause.to_string())), "{text}");
        let of_solid = SolidMesh::read(path).unwrap_err();
        assert_eq!((of_solid.to_string(), of_solid.path()), (text, path.as_path()));
        assert_eq!(matches!(of_solid, ReadSolidError::NotSolid { .. }), kind == "not solid");
    }
    let error = encoder.band(Length::Absolute(-1.0)).encode_file(cube()).unwrap_err();
    assert!(error.to_string().starts_with(&cube().display().to_string()), "{error}");
    assert!(matches!(
        error,
        EncodeFileError::Encode { source: EncodeError::Option { option: "band", .. }, .. }
    ));
    let plain = Encoder::new().preset(Preset::Paper).domain(Domain::Bisection).encode_file(cube());
    assert!(matches!(
        plain,
        Err(EncodeFileError::Encode { source: EncodeError::Option { option: "refinement", .. }, .. })
    ));
}
