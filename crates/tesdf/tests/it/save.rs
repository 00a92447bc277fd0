//! Outputs: refused paths, kept attributes, and files left behind.
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use tesdf::save::{Destination, ReadOnly, SaveError, SaveOptions, is_same_file, save_atomic};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Names of all files, sorted.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn destination(path: &Path) -> Result<Destination, SaveError> {
    Destination::new(path, &SaveOptions::default())
}

#[test]
fn writers_of_one_file_do_not_stop_each_other() {
    let folder = folder();
    let path = folder.path().join("a.tesdf");
    let write = |writer: u8| (0..50).for_each(|_| save_atomic(&path, &[writer; 1000]).unwrap());
    std::thread::scope(|scope| {
        for writer in 0..4 {
            let write = &write;
            scope.spawn(move || write(writer));
        }
        for _ in 0..200 {
            let Ok(found) = fs::read(&path) else { continue };
            assert!(found.len() == 1000 && found.iter().all(|byte| *byte == found[0]));
        }
    });
    assert_eq!(names(folder.path()), ["a.tesdf"]);
}

#[test]
fn saving_replaces_whole_files_and_leaves_no_part_files() {
    let folder = folder();
    let path = folder.path().join("a.tesdf");
    fs::write(&path, b"old").unwrap();
    save_atomic(&path, b"new").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
    assert!(matches!(destination(folder.path()), Err(SaveError::IsFolder { .. })));
    assert!(matches!(destination(&folder.path().join("no/a.tesdf")), Err(SaveError::NoFolder { .. })));
    assert_eq!(names(folder.path()), ["a.tesdf"]);
}

/// Another process puts a folder in the place of the file while it is written.
#[test]
fn a_rename_that_fails_leaves_nothing() {
    let folder = folder();
    let path = folder.path().join("a.tesdf");
    let mut part = destination(&path).unwrap().part().unwrap().expect("a regular file");
    part.write_all(b"new").unwrap();
    fs::create_dir(&path).unwrap();
    let found = part.finish().unwrap_err().to_string();
    assert!(found.starts_with("cannot replace ") && found.contains("a.tesdf: "), "{found}");
    assert_eq!(names(folder.path()), ["a.tesdf"]);
    assert_eq!(fs::read_dir(&path).unwrap().count(), 0);
}

#[test]
fn an_output_that_is_an_input_is_refused() {
    let folder = folder();
    let [input, other, hard] = ["input", "other", "hard"].map(|name| folder.path().join(name));
    fs::write(&input, b"precious").unwrap();
    fs::write(&other, b"precious").unwrap();
    fs::hard_link(&input, &hard).unwrap();
    let mut outputs = vec![input.clone(), hard, folder.path().join("./input")];
    #[cfg(unix)]
    {
        let [link, link_to_link] = ["link", "link_to_link"].map(|name| folder.path().join(name));
        std::os::unix::fs::symlink("input", &link).unwrap();
        std::os::unix::fs::symlink(&link, &link_to_link).unwrap();
        outputs.extend([link, link_to_link]);
    }
    let inputs = [other.as_path(), &input];
    let options = SaveOptions { inputs: &inputs, ..SaveOptions::default() };
    for output in &outputs {
        match Destination::new(output, &options) {
            Err(SaveError::Input { output: found, input: of }) => {
                assert_eq!((&found, &of), (output, &input));
            }
            found => panic!("{}: {found:?}", output.display()),
        }
        assert!(is_same_file(output, &input) && !is_same_file(output, &other));
    }
    // A file with equal bytes is another file. A missing file is not the same as itself.
    let none = folder.path().join("none");
    assert!(!is_same_file(&none, &none));
    let options = SaveOptions { inputs: &[&input, &none], ..options };
    assert!(Destination::new(&other, &options).is_ok() && Destination::new(&none, &options).is_ok());
    assert_eq!(fs::read(&input).unwrap(), b"precious");
}

/// Part files as a killed process leaves them, and as a living process holds them.
#[test]
fn part_files_of_ended_processes_are_removed_and_others_stay() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    for name in [".tesdf-abc.part", ".tesdf-abc.parts", ".other.part", "tesdf-abc.part"] {
        fs::write(at(name), b"half").unwrap();
    }
    let held = File::create(at(".tesdf-held.part")).unwrap();
    held.lock().unwrap();
    fs::create_dir(at(".tesdf-folder.part")).unwrap();
    save_atomic(at("a"), b"a").unwrap();
    let kept =
        [".other.part", ".tesdf-abc.parts", ".tesdf-folder.part", ".tesdf-held.part", "a", "tesdf-abc.part"];
    assert_eq!(names(folder.path()), kept);
    held.unlock().unwrap();
    destination(&at("b")).unwrap();
    assert!(!at(".tesdf-held.part").exists());
}

#[test]
fn a_part_grows_beside_its_target_and_keeps_others_away() {
    let folder = folder();
    let path = folder.path().join("run");
    fs::write(&path, b"old").unwrap();
    let to = destination(&path).unwrap();
    drop(to.part().unwrap());
    assert_eq!(names(folder.path()), ["run"]);
    let mut part = to.part().unwrap().expect("a regular file");
    part.write_all(b"new").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"old");
    // Another write into the folder acts like another process, because locks belong to the open
    // file.
    save_atomic(folder.path().join("other"), b"").unwrap();
    let mut file = part.finish().unwrap();
    file.write_all(b"er").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"newer");
    assert!(matches!(destination(&path), Err(SaveError::Busy { .. })));
    assert!(matches!(to.write(b""), Err(SaveError::Busy { .. })));
    drop(file);
    to.write(b"newest").unwrap();
    assert_eq!(
        (fs::read(&path).unwrap(), names(folder.path())),
        (b"newest".into(), vec!["other".into(), "run".into()])
    );
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt, symlink};
    use std::process::Command;

    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o7777
    }

    fn set_mode(path: &Path, mode: u32) {
        fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    }

    #[test]
    fn a_new_file_has_usual_permissions_and_a_replaced_file_keeps_its_own() {
        let folder = folder();
        let [usual, saved] = ["usual", "saved"].map(|name| folder.path().join(name));
        fs::write(&usual, b"").unwrap();
        save_atomic(&saved, b"").unwrap();
        assert_eq!(mode(&saved), mode(&usual));
        for bits in [0o600, 0o640, 0o666, 0o755] {
            set_mode(&saved, bits);
            save_atomic(&saved, b"again").unwrap();
            assert_eq!(mode(&saved), bits, "{bits:o}");
        }
        // Nobody else may read the new bytes, not even before the rename.
        set_mode(&saved, 0o600);
        let _part = destination(&saved).unwrap().part().unwrap();
        let part = names(folder.path()).into_iter().find(|name| name.ends_with(".part")).unwrap();
        assert_eq!(mode(&folder.path().join(part)), 0o600);
    }

    /// Only an administrator may change the owner of a file.
    #[test]
    fn a_replaced_file_keeps_its_owner_where_the_system_allows_it() {
        let folder = folder();
        let path = folder.path().join("a");
        fs::write(&path, b"old").unwrap();
        let given = std::os::unix::fs::chown(&path, Some(12_345), Some(54_321)).is_ok();
        let owner = |path: &Path| fs::metadata(path).map(|m| (m.uid(), m.gid())).unwrap();
        let before = owner(&path);
        assert_eq!(given, before == (12_345, 54_321));
        save_atomic(&path, b"new").unwrap();
        assert_eq!(owner(&path), before);
    }

    #[test]
    fn a_read_only_file_is_replaced_with_consent_only() {
        let folder = folder();
        let path = folder.path().join("a");
        fs::write(&path, b"old").unwrap();
        set_mode(&path, 0o444);
        assert!(matches!(destination(&path), Err(SaveError::ReadOnly { .. })));
        assert!(matches!(save_atomic(&path, b"new"), Err(SaveError::ReadOnly { .. })));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        let options = SaveOptions { read_only: ReadOnly::Replace, ..SaveOptions::default() };
        Destination::new(&path, &options).unwrap().write(b"new").unwrap();
        assert_eq!((fs::read(&path).unwrap(), mode(&path)), (b"new".into(), 0o444));
        assert_eq!(names(folder.path()), ["a"]);
    }

    #[test]
    fn links_to_existing_and_missing_files_are_followed() {
        let folder = folder();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("sub")).unwrap();
        for (link, to) in [("link", "sub/a"), ("circle", "circle")] {
            symlink(to, at(link)).unwrap();
        }
        for bytes in [b"first", b"again"] {
            save_atomic(at("link"), bytes).unwrap();
            assert!(at("link").is_symlink());
            assert_eq!(fs::read(at("sub/a")).unwrap(), bytes);
        }
        assert!(matches!(destination(&at("circle")), Err(SaveError::Io { .. })));
        assert_eq!(names(folder.path()), ["circle", "link", "sub"]);
    }

    #[test]
    fn pipes_and_devices_are_written_and_stay() {
        let folder = folder();
        let pipe = folder.path().join("pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).unwrap()
        });
        save_atomic(&pipe, b"through the pipe").unwrap();
        assert_eq!(reader.join().unwrap(), b"through the pipe");
        assert!(fs::symlink_metadata(&pipe).unwrap().file_type().is_fifo());
        assert_eq!(names(folder.path()), ["pipe"]);

        let null = destination(Path::new("/dev/null")).unwrap();
        assert!(null.file_path().is_none() && null.part().unwrap().is_none() && !null.is_stdout());
        null.write(b"nowhere").unwrap();
        assert!(fs::symlink_metadata("/dev/null").unwrap().file_type().is_char_device());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn full_devices_and_closed_folders_are_errors() {
        let full = destination(Path::new("/dev/full")).unwrap();
        let found = full.write(b"x").unwrap_err().to_string();
        assert!(found.starts_with("cannot write /dev/full: No space left"), "{found}");
        // A folder where nobody, not even an administrator, can create files.
        let found = destination(Path::new("/proc/a")).unwrap_err().to_string();
        assert!(found.starts_with("cannot create a file in /proc: "), "{found}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn an_open_descriptor_is_written_at_its_end_and_its_file_stays() {
        use std::os::fd::AsRawFd;
        let folder = folder();
        let path = folder.path().join("a");
        let mut file = File::create(&path).unwrap();
        file.write_all(b"begun, ").unwrap();
        let link = PathBuf::from(format!("/dev/fd/{}", file.as_raw_fd()));
        let before = fs::metadata(&path).unwrap().ino();
        save_atomic(&link, b"continued").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"begun, continued");
        assert_eq!(fs::metadata(&path).unwrap().ino(), before);
        assert!(destination(Path::new("/dev/stdout")).unwrap().is_stdout());
        assert!(!destination(Path::new("/dev/stderr")).unwrap().is_stdout());
    }
}
