//! Reads arbitrary bytes as a mesh file: the first byte selects the format, the rest is the file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tesdf::mesh::{MeshFormat, read_bytes};

fuzz_target!(|data: &[u8]| {
    let Some((choice, bytes)) = data.split_first() else { return };
    let format = MeshFormat::ALL[*choice as usize % MeshFormat::ALL.len()];
    if let Ok(loaded) = read_bytes(bytes, format) {
        let vertices = loaded.mesh.vertices();
        assert!(!loaded.mesh.faces().is_empty());
        assert!(loaded.mesh.faces().iter().flatten().all(|&v| (v as usize) < vertices.len()));
        assert!(vertices.iter().all(|p| p.is_finite()));
    }
});
