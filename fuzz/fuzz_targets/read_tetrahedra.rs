//! Reads arbitrary bytes as a tetrahedra file: the first byte selects the format, the rest is the
//! file. For TetGen's pair of files, the first zero byte separates the two files.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tesdf::domain::load_tetrahedra;

fuzz_target!(|data: &[u8]| {
    let Some((choice, bytes)) = data.split_first() else { return };
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let at = |extension: &str| folder.path().join("fuzz").with_extension(extension);
    let write =
        |extension: &str, bytes: &[u8]| std::fs::write(at(extension), bytes).expect("room for a file");
    let path = match choice % 2 {
        0 => {
            write("msh", bytes);
            at("msh")
        }
        _ => {
            let split = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
            write("node", &bytes[..split]);
            write("ele", bytes.get(split + 1..).unwrap_or_default());
            at("node")
        }
    };
    if let Ok(loaded) = load_tetrahedra(&path) {
        let vertices = loaded.mesh.vertices();
        assert!(loaded.mesh.tetrahedra().iter().flatten().all(|&v| (v as usize) < vertices.len()));
        assert!(vertices.iter().all(|p| p.is_finite()));
    }
});
