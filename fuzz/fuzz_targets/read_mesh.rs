//! Reads arbitrary bytes as a mesh file: the first byte selects the format, the rest is the file.
//! CAD files are read by another program, from a file, and not here.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tesdf::mesh::{MeshFormat, read_bytes, split};

fuzz_target!(|data: &[u8]| {
    let Some((choice, bytes)) = data.split_first() else { return };
    let formats = MeshFormat::ALL.into_iter().filter(|format| !format.is_cad());
    let Some(format) = formats.cycle().nth(*choice as usize) else { return };
    if let Ok(loaded) = read_bytes(bytes, format) {
        let objects: usize = split(&loaded).iter().map(|part| part.mesh.faces().len()).sum();
        assert_eq!(objects, loaded.mesh.faces().len());
        let vertices = loaded.mesh.vertices();
        assert!(!loaded.mesh.faces().is_empty());
        assert!(loaded.mesh.faces().iter().flatten().all(|&v| (v as usize) < vertices.len()));
        assert!(vertices.iter().all(|p| p.is_finite()));
    }
});
