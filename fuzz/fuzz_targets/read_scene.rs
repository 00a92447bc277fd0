//! Reads arbitrary text as a scene file. An accepted scene that names no files is built into a
//! system.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use tesdf_sim::scene_file::LoadedScene;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(loaded) = LoadedScene::parse(text.into(), Path::new("fuzz.toml")) else { return };
    if loaded.geometry_files().is_empty() {
        let _ = loaded.system();
    }
});
