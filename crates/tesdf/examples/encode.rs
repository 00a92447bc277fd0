//! From a mesh file to an asset: read, check, encode, save, open again.
//!
//! `cargo run --release --example encode -- [MESH] [FILE.tesdf]`
use std::error::Error;

use tesdf::glam::DVec3;
use tesdf::mesh::read;
use tesdf::{Encoder, Preset, Progress, SolidMesh, Source, TeSdf};

fn main() -> Result<(), Box<dyn Error>> {
    let cube = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/cube.obj");
    let mut arguments = std::env::args_os().skip(1);
    let mesh = arguments.next().unwrap_or(cube.into());
    let file = arguments.next().unwrap_or(std::env::temp_dir().join("example.tesdf").into());

    // Step by step what `TeSdf::encode_file` does, with warnings and progress.
    let loaded = read(&mesh)?;
    // A mesh without a well-defined inside is an error here. The error names the first defects and
    // says how to repair them.
    let solid = SolidMesh::new(loaded.mesh)?;
    solid.warnings().iter().for_each(|w| eprintln!("warning: {}", w.message));

    let source = Source::of_file(&mesh, loaded.report.source_blake3);
    // Another thread may watch the progress, and cancel.
    let progress = Progress::default();
    let asset = Encoder::new().preset(Preset::Fast).source(source).progress(&progress).encode(&solid)?;
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
        assert_eq!(opened.query(p), asset.query(p));
    }
    assert!(opened.signed_distance(corner).abs() < 1e-12 * solid.mesh().diagonal());
    Ok(())
}
