//! From a mesh file to an asset: read, check, encode, save, open again.
//!
//! `cargo run --release --example encode -- [MESH] [FILE.tesdf]`
use std::error::Error;
use std::path::PathBuf;

use tesdf::asset::about::Source;
use tesdf::encode::{EncodeOptions, Preset, encode};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, read};
use tesdf::query::Precision;
use tesdf::{Progress, TeSdf};

fn main() -> Result<(), Box<dyn Error>> {
    let cube = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/cube.obj");
    let mesh = std::env::args_os().nth(1).map_or(PathBuf::from(cube), PathBuf::from);
    let file = std::env::args_os().nth(2).map_or(std::env::temp_dir().join("example.tesdf"), PathBuf::from);

    let loaded = read(&mesh)?;
    // A mesh without a well-defined inside stops here, with the first defects and what to do about them.
    let solid = SolidMesh::new(loaded.mesh)?;
    solid.warnings().iter().for_each(|w| eprintln!("warning: {}", w.message));

    let name = mesh.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let source = Source { name, blake3: loaded.report.source_blake3 };
    // Another thread may watch the progress, and cancel.
    let progress = Progress::default();
    let asset = encode(&solid, &source, &EncodeOptions::preset(Preset::Fast), &progress)?;
    asset.save(&file)?;

    let opened = TeSdf::open(&file)?;
    opened.verify_checksums()?;
    let statistics = &opened.about().statistics;
    println!(
        "{}: {} faces, {} cells, {:.1} faces per cell, {} bytes",
        file.display(),
        statistics.faces,
        statistics.listed_cells,
        statistics.volume_weighted_list,
        opened.as_bytes().len()
    );

    // The same answers as before it was written, on the surface and beside it.
    let corner = solid.mesh().vertices()[0];
    for p in [corner, corner + DVec3::splat(0.1 * solid.mesh().diagonal())] {
        assert_eq!(opened.query(p, Precision::F64), asset.query(p, Precision::F64));
    }
    assert!(opened.signed_distance(corner, Precision::F64).abs() < 1e-12 * solid.mesh().diagonal());
    Ok(())
}
