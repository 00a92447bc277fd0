//! A file from a stranger: what opening finds by itself, and what the checksums find.
//!
//! `cargo run --release --example hostile_file -- [FILE.tesdf]`; without a file it makes one.
use std::error::Error;

use tesdf::TeSdf;
use tesdf::asset::{AssetError, layout};

fn main() -> Result<(), Box<dyn Error>> {
    let good = match std::env::args_os().nth(1) {
        Some(file) => std::fs::read(file)?,
        None => made()?,
    };
    let opened = TeSdf::from_bytes(&good)?;
    opened.verify_checksums()?;

    // Cut short: opening says so. Nothing was allocated by what the header claims.
    match TeSdf::from_bytes(&good[..good.len() - 1]) {
        Err(error) => println!("cut short: {error}"),
        Ok(_) => return Err("a file without its last byte opened".into()),
    }

    // An index that leads nowhere: opening checks all that a query follows, and names the section.
    let nodes =
        opened.container().sections().find(|s| s.spec.name == layout::NODES.name).ok_or("no nodes")?;
    let at = nodes.bytes.as_ptr() as usize - opened.as_bytes().as_ptr() as usize;
    let mut astray = good.clone();
    astray[at..at + 4].copy_from_slice(&0x7fff_ffff_u32.to_le_bytes());
    match TeSdf::from_bytes(&astray) {
        Err(error @ AssetError::Section { .. }) => println!("led astray: {error}"),
        other => return Err(format!("expected the section by name, got {other:?}").into()),
    }

    // A bit of a coordinate: it opens, and answers without a panic. Only the checksums know.
    let vertices =
        opened.container().sections().find(|s| s.spec.name == layout::VERTICES.name).ok_or("no vertices")?;
    let at = vertices.bytes.as_ptr() as usize - opened.as_bytes().as_ptr() as usize;
    let mut bent = good.clone();
    bent[at] ^= 1;
    let bent = TeSdf::from_bytes(&bent)?;
    bent.query_f32(opened.face_corners(0)[0]);
    match bent.verify_checksums() {
        Err(error @ AssetError::Checksum { .. }) => println!("bent: {error}"),
        other => return Err(format!("expected a checksum error, got {other:?}").into()),
    }
    Ok(())
}

fn made() -> Result<Vec<u8>, Box<dyn Error>> {
    let tetra = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/tetra.obj");
    Ok(TeSdf::encode_file(tetra)?.as_bytes().to_vec())
}
