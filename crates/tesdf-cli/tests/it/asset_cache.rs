//! Encoded meshes of scenes that are kept from run to run.
use std::fs;
use std::path::Path;

use crate::folder::{Folder, block, texts};

const SCENE: &str =
    "time_step = 1e-3\nduration = 0.01\n[[bodies]]\nname = \"cube\"\nmesh = \"cube.obj\"\nmass = 1\n";

/// The notes of a run with a cache in `kept`, and the bytes of its data.
fn run(folder: &Folder, kept: &Path, more: &[&str]) -> (String, Vec<u8>) {
    let args = [&["simulate", "scene.toml", "-o", "run.tesrun"], more].concat();
    let (code, out, err) = texts(folder.command(&args).env("TESDF_CACHE", kept).output().unwrap());
    assert_eq!(code, Some(0), "{out}{err}");
    (err, fs::read(folder.path("run.tesrun")).unwrap())
}

/// The assets in a folder.
fn assets(kept: &Path) -> Vec<std::path::PathBuf> {
    let Ok(files) = fs::read_dir(kept) else { return Vec::new() };
    let mut files: Vec<_> = files.map(|file| file.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn a_mesh_is_encoded_once() {
    let folder = Folder::new();
    folder.write("cube.obj", block(2));
    folder.write("scene.toml", SCENE);
    let kept = folder.path("kept");
    let (note, first) = run(&folder, &kept, &[]);
    assert!(note.contains("encoded") && note.contains("cube.obj; kept in"), "{note}");
    assert_eq!(assets(&kept).len(), 1);
    let asset = fs::read(&assets(&kept)[0]).unwrap();
    let (note, second) = run(&folder, &kept, &[]);
    assert!(!note.contains("encoded"), "{note}");
    // Without a cache, nothing else comes out.
    let (note, third) = run(&folder, &folder.path("none"), &["--no-cache"]);
    assert!(!note.contains("encoded") && !folder.path("none").exists(), "{note}");
    assert!(first == second && second == third);
    // A damaged file is replaced.
    let mut flipped = asset.clone();
    *flipped.last_mut().unwrap() ^= 1;
    for damaged in [b"no asset".to_vec(), flipped] {
        fs::write(&assets(&kept)[0], damaged).unwrap();
        let (note, again) = run(&folder, &kept, &[]);
        assert!(note.contains("encoded") && again == first, "{note}");
        assert!(fs::read(&assets(&kept)[0]).unwrap() == asset);
    }
}

#[test]
fn what_matters_makes_another_asset() {
    let folder = Folder::new();
    folder.write("cube.obj", block(2));
    folder.write("scene.toml", SCENE);
    let kept = folder.path("kept");
    run(&folder, &kept, &[]);
    folder.write("scene.toml", SCENE.replace("mass = 1", "mass = 1\ninside = \"odd\""));
    assert!(run(&folder, &kept, &[]).0.contains("encoded"));
    folder.write("cube.obj", block(3));
    assert!(run(&folder, &kept, &[]).0.contains("encoded"));
    assert_eq!(assets(&kept).len(), 3);
    // A cache that cannot be written costs time alone.
    folder.write("file", "no folder");
    assert!(run(&folder, &folder.path("file"), &[]).0.contains("encoded"));
}
