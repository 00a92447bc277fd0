//! The effect of every command on the file of its option `-o`.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt, symlink};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::folder::{Folder, texts};
use tesdf_sim::RunRecord;

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// A cube over another one, which is encoded.
pub const SCENE: &str = r#"
time_step = 2e-3
duration = 0.02

[[bodies]]
name = "floor"
asset = "a.tesdf"
fixed = true

[[bodies]]
name = "cube"
mesh = "cube.obj"
density = 1000
translation = [0, 0, 1.001]
"#;

const GLTF: &str =
    r#"{"asset": {"version": "2.0"}, "buffers": [{"uri": "m.bin", "byteLength": 4}, {"uri": "data:,"}]}"#;

/// A folder with meshes, assets, a scene and its run.
fn workplace() -> Folder {
    let folder = Folder::new();
    folder.write("cube.obj", CUBE);
    folder.write("open.obj", CUBE.replace("f 4 1 5 8\n", ""));
    folder.write("scene.toml", SCENE);
    for asset in ["a.tesdf", "b.tesdf"] {
        folder.good(&["encode", "cube.obj", "-o", asset, "--preset", "fast"]);
    }
    folder.good(&["simulate", "scene.toml", "-o", "run.tesrun"]);
    folder
}

/// Bytes, inode and mode of every file in the folder; for a link, its target.
fn snapshot(folder: &Path) -> BTreeMap<String, (Vec<u8>, u64, u32)> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, kind) = (entry.path(), entry.file_type().unwrap());
        if kind.is_dir() {
            found.extend(snapshot(&path));
            continue;
        }
        let about = fs::symlink_metadata(&path).unwrap();
        let bytes = match kind.is_symlink() {
            true => fs::read_link(&path).unwrap().into_os_string().into_encoded_bytes(),
            false => fs::read(&path).unwrap(),
        };
        found.insert(path.display().to_string(), (bytes, about.ino(), about.mode()));
    }
    found
}

#[test]
fn an_input_is_never_the_output() {
    let folder = workplace();
    // The output is refused before the work, so these files need no valid content.
    for name in ["t.msh", "t.node", "t.ele", "m.bin", "cube.ply"] {
        folder.write(name, "precious");
    }
    folder.write("m.gltf", GLTF);
    let cut = crate::folder::interrupted_run(&folder, "scene.toml", 4);
    folder.write("cut.tesrun", cut);
    let encode = ["encode", "cube.obj"];
    let of_run = ["render", "--run", "run.tesrun"];
    let cases: [(&[&str], &str); 17] = [
        (&encode, "cube.obj"),
        (&["encode", "cube.obj", "--domain", "t.msh"], "t.msh"),
        (&["encode", "cube.obj", "--domain", "t.node"], "t.node"),
        (&["encode", "cube.obj", "--domain", "t.node"], "t.ele"),
        (&["encode", "m.gltf"], "m.bin"),
        (&["repair", "cube.ply"], "cube.ply"),
        (&["slice", "a.tesdf"], "a.tesdf"),
        (&["render", "a.tesdf", "plane", "b.tesdf"], "b.tesdf"),
        (&of_run, "run.tesrun"),
        (&of_run, "cube.obj"),
        (&["render", "--run", "run.tesrun", "--geometry", "cube=b.tesdf"], "b.tesdf"),
        (&["simulate", "scene.toml"], "scene.toml"),
        (&["simulate", "scene.toml"], "a.tesdf"),
        (&["simulate", "scene.toml"], "cube.obj"),
        (&["simulate", "scene.toml", "--geometry", "cube=b.tesdf"], "b.tesdf"),
        (&["simulate", "--resume", "cut.tesrun"], "cube.obj"),
        (&["render", "--run", "cut.tesrun"], "cut.tesrun"),
    ];
    for (command, input) in cases {
        let extension = Path::new(input).extension().unwrap().to_str().unwrap();
        let [hard, soft] = ["hard", "soft"].map(|name| format!("{name}.{extension}"));
        fs::hard_link(folder.path(input), folder.path(&hard)).unwrap();
        symlink(input, folder.path(&soft)).unwrap();
        let before = snapshot(&folder.path(""));
        for output in [input, &hard, &soft] {
            let (code, out, err) = folder.tesdf(&[command, &["-o", output]].concat());
            assert_eq!((code, out.as_str()), (Some(2), ""), "{command:?} -o {output}: {err}");
            let name = Path::new(input).file_name().unwrap().to_str().unwrap();
            let names = [format!("error: the output {output} is the input "), format!("{name} itself")];
            assert!(names.iter().all(|name| err.contains(name)), "{command:?} -o {output}: {err}");
            assert!(err.ends_with("hint: give another file to -o\n"), "{err}");
        }
        assert!(snapshot(&folder.path("")) == before, "{command:?} changed a file");
        [hard, soft].iter().for_each(|name| fs::remove_file(folder.path(name)).unwrap());
    }
}

/// All commands that write one file, without `-o`, each with a file name.
const WRITERS: [(&[&str], &str); 5] = [
    (&["encode", "cube.obj", "--preset", "fast"], "out.tesdf"),
    (&["repair", "cube.obj"], "out.ply"),
    (&["slice", "a.tesdf", "--size", "256"], "out.png"),
    (&["render", "a.tesdf", "--size", "32x32"], "out.png"),
    (&["simulate", "scene.toml"], "out.tesrun"),
];

#[test]
fn stdout_carries_the_output_and_nothing_else() {
    let folder = workplace();
    for (command, name) in WRITERS {
        folder.good(&[command, &["-o", name]].concat());
        let expected = fs::read(folder.path(name)).unwrap();
        let out = folder.command(&[command, &["-o", "/dev/stdout"]].concat()).output().unwrap();
        assert_eq!(out.status.code(), Some(0), "{command:?}");
        assert!(out.stdout == expected, "{command:?}: {} bytes, not {}", out.stdout.len(), expected.len());
        let draws = ["slice", "render"].contains(&command[0]);
        assert_eq!(out.stderr.is_empty(), draws, "{command:?}: the result for people goes to stderr");
    }
    assert!(fs::symlink_metadata("/dev/stdout").unwrap().is_symlink());
    // The shell's file must not be replaced, and must not be written from its beginning.
    let script = "{ echo before; \"$0\" repair cube.obj -o /dev/stdout; echo after; } >>all 2>/dev/null";
    folder.write("all", "first\n");
    let shell = Command::new("sh")
        .env("TESDF_CACHE", "")
        .args(["-c", script, crate::folder::BINARY])
        .current_dir(folder.path(""))
        .status();
    assert!(shell.unwrap().success());
    let expected = [b"first\nbefore\n", &fs::read(folder.path("out.ply")).unwrap()[..], b"after\n"].concat();
    assert_eq!(fs::read(folder.path("all")).unwrap(), expected);
}

#[test]
fn pipes_and_devices_are_written_and_stay() {
    let folder = workplace();
    let pipe = folder.path("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for (command, name) in WRITERS {
        folder.good(&[command, &["-o", name]].concat());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).unwrap()
        });
        folder.good(&[command, &["-o", "pipe"]].concat());
        assert!(reader.join().unwrap() == fs::read(folder.path(name)).unwrap(), "{command:?}");
        assert!(fs::symlink_metadata(&pipe).unwrap().file_type().is_fifo(), "{command:?}");

        folder.good(&[command, &["-o", "/dev/null"]].concat());
        assert!(fs::symlink_metadata("/dev/null").unwrap().file_type().is_char_device(), "{command:?}");
        let (code, _, err) = folder.tesdf(&[command, &["-o", "/dev/full"]].concat());
        assert_eq!(code, Some(2), "{command:?}");
        assert!(err.contains("error: cannot write /dev/full: No space left on device"), "{command:?}: {err}");
    }
}

#[test]
fn permissions_are_kept_and_a_read_only_file_needs_consent() {
    let folder = workplace();
    for (command, name) in WRITERS {
        let path = folder.path(name);
        let mode = || fs::metadata(&path).unwrap().permissions().mode() & 0o7777;
        let set = |mode| fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        let command = [command, &["-o", name]].concat();
        folder.write(name, "old");
        set(0o600);
        folder.good(&command);
        assert_eq!(mode(), 0o600, "{command:?}");
        let written = fs::read(&path).unwrap();
        assert!(written != b"old");

        folder.write(name, "old");
        set(0o440);
        let (code, _, err) = folder.tesdf(&command);
        assert_eq!((code, fs::read(&path).unwrap()), (Some(2), b"old".into()), "{command:?}");
        let expected =
            format!("error: {name} is read-only\nhint: --force replaces it and keeps its permissions\n");
        assert_eq!(err, expected, "{command:?}");
        folder.good(&[&command[..], &["--force"]].concat());
        assert!(mode() == 0o440 && fs::read(&path).unwrap() == written, "{command:?}");
        fs::remove_file(path).unwrap();
    }
}

/// Runs the binary as an ordinary user, because the administrator may write everywhere. The binary
/// and the folder are made accessible to this user.
fn as_a_user(folder: &Folder, args: &[&str]) -> (Option<i32>, String, String) {
    let mut command = folder.command(args);
    if fs::metadata("/proc/self").unwrap().uid() == 0 {
        let binary = folder.path("tesdf");
        if !binary.exists() && fs::hard_link(crate::folder::BINARY, &binary).is_err() {
            fs::copy(crate::folder::BINARY, &binary).unwrap();
        }
        fs::set_permissions(folder.path(""), fs::Permissions::from_mode(0o755)).unwrap();
        command = Command::new(binary);
        command.env("TESDF_CACHE", "");
        command.args(args).current_dir(folder.path("")).uid(65_534).gid(65_534);
    }
    texts(command.output().unwrap())
}

/// The mesh cannot be encoded, so an error about the output shows that the output was checked
/// first.
#[test]
fn an_unwritable_folder_is_reported_before_the_work() {
    let folder = Folder::new();
    folder.write("open.obj", CUBE.replace("f 4 1 5 8\n", ""));
    let locked = folder.path("locked");
    fs::create_dir(&locked).unwrap();
    fs::write(locked.join("f.tesdf"), "old").unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    let encode = |output| ["encode", "open.obj", "-o", output];
    for (output, expected) in [
        ("no/f.tesdf", "error: cannot write no/f.tesdf: there is no folder no\n"),
        ("open.obj/f.tesdf", "error: cannot write open.obj/f.tesdf: there is no folder open.obj\n"),
        ("locked", "error: cannot write locked: it is a folder; expected the name of a file\n"),
        // Even the administrator cannot create files in this folder.
        ("/proc/f.tesdf", "error: cannot create a file in /proc: "),
    ] {
        let (code, _, err) = folder.tesdf(&encode(output));
        assert!(code == Some(2) && err.starts_with(expected), "{err}");
    }
    let (code, _, err) = as_a_user(&folder, &encode("locked/new.tesdf"));
    assert!(
        code == Some(2) && err.starts_with("error: cannot create a file in locked: Permission denied"),
        "{err}"
    );
    // A file and a folder of another user.
    let (code, _, err) = as_a_user(&folder, &encode("locked/f.tesdf"));
    assert!(code == Some(2) && err.starts_with("error: "), "{err}");
    assert_eq!(fs::read(locked.join("f.tesdf")).unwrap(), b"old");
    assert_eq!(fs::read_dir(&locked).unwrap().count(), 1);
}

/// A place that has room for few bytes.
enum FullDisk {
    /// A file size limit of the process.
    Limit,
    /// A small file system.
    Small,
}

impl FullDisk {
    /// The limit works everywhere. The file system needs a process that may mount it.
    fn all(folder: &Folder) -> Vec<Self> {
        fs::create_dir(folder.path("disk")).unwrap();
        let mount = ["-t", "tmpfs", "-o", "size=12k", "none"];
        let mounted = Command::new("mount").args(mount).arg(folder.path("disk")).output();
        let mounted = mounted.is_ok_and(|out| out.status.success());
        println!("a file system of its own: {mounted}");
        if mounted { vec![Self::Limit, Self::Small] } else { vec![Self::Limit] }
    }

    fn run(&self, folder: &Folder, args: &[&str]) -> (Option<i32>, String, String) {
        // The limit is 8 or 16 kB, because shells use different units. Without the trap, the signal
        // would end the process before it sees the error.
        let script = "trap '' XFSZ; ulimit -f 16; exec \"$0\" \"$@\"";
        match self {
            Self::Limit => {
                let mut shell = Command::new("sh");
                shell.env("TESDF_CACHE", "");
                shell.args(["-c", script, crate::folder::BINARY]).args(args).current_dir(folder.path(""));
                texts(shell.output().unwrap())
            }
            Self::Small => folder.tesdf(args),
        }
    }
}

/// Unmounts the file system, also when a test fails.
struct Unmount<'a>(&'a Folder);

impl Drop for Unmount<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0.path("disk")).output();
    }
}

#[test]
fn a_full_disk_leaves_the_old_file_and_a_run_its_steps() {
    let folder = workplace();
    let scene = SCENE.replace("duration = 0.02", "duration = 1.0").replace("[0, 0, 1.001]", "[0, 0, 9]");
    folder.write("long.toml", scene);
    folder.good(&["simulate", "long.toml", "-o", "whole.tesrun"]);
    let whole = fs::read(folder.path("whole.tesrun")).unwrap();
    assert!(whole.len() > 40_000);
    folder.write("block.obj", crate::folder::block(8));
    let disks = FullDisk::all(&folder);
    let _unmount = Unmount(&folder);
    for disk in &disks {
        folder.write("disk/f.tesdf", "old");
        let encode = ["encode", "block.obj", "-o", "disk/f.tesdf", "--preset", "fast"];
        let (code, _, err) = disk.run(&folder, &encode);
        assert_eq!(code, Some(2), "{err}");
        assert!(err.starts_with("error: cannot write disk/f.tesdf: "), "{err}");
        assert_eq!(fs::read(folder.path("disk/f.tesdf")).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path("disk")).unwrap().count(), 1);

        let (code, out, err) = disk.run(&folder, &["simulate", "long.toml", "-o", "disk/r.tesrun"]);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{err}");
        assert!(
            err.starts_with("error: cannot write disk/r.tesrun: ") && err.contains("has the previous steps"),
            "{err}"
        );
        assert!(
            err.ends_with("hint: `tesdf simulate --resume disk/r.tesrun` continues from there\n"),
            "{err}"
        );
        assert!(
            err.ends_with("hint: `tesdf simulate --resume disk/r.tesrun` continues from there\n"),
            "{err}"
        );
        let record = RunRecord::open(folder.path("disk/r.tesrun")).unwrap();
        assert!(record.planned_steps() == Some(500) && (10..500).contains(&record.steps()));
        folder.good(&["simulate", "--resume", "disk/r.tesrun", "-o", "again.tesrun"]);
        assert!(fs::read(folder.path("again.tesrun")).unwrap() == whole);
        for name in ["disk/f.tesdf", "disk/r.tesrun"] {
            fs::remove_file(folder.path(name)).unwrap();
        }
    }
}

#[test]
fn a_closed_or_full_stdout_keeps_the_output_file() {
    let folder = Folder::new();
    folder.write("cube.obj", CUBE);
    let run = |redirection: &str, output: &str| {
        let script = format!("\"$0\" encode cube.obj --preset fast -o {output} {redirection}");
        let mut shell = Command::new("bash");
        shell.env("TESDF_CACHE", "");
        texts(
            shell.args(["-c", &script, crate::folder::BINARY]).current_dir(folder.path("")).output().unwrap(),
        )
    };
    for redirection in [">&-", "| true; exit ${PIPESTATUS[0]}", "<&- >&- 2>&-"] {
        let (code, _, err) = run(redirection, "f.tesdf");
        assert_eq!((code, err.as_str()), (Some(0), ""), "{redirection}");
        folder.good(&["verify", "f.tesdf", "--samples", "100"]);
        fs::remove_file(folder.path("f.tesdf")).unwrap();
    }
    let (code, _, err) = run(">/dev/full", "f.tesdf");
    assert_eq!(
        (code, err.as_str()),
        (Some(2), "error: cannot write to stdout: No space left on device (os error 28)\n")
    );
    folder.good(&["verify", "f.tesdf", "--samples", "100"]);

    // A reader that closed the pipe did not get the output.
    let mut child = folder.command(&["encode", "cube.obj", "-o", "/dev/stdout"]);
    let mut child = child.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let (code, _, err) = texts(child.wait_with_output().unwrap());
    assert!(code == Some(2) && err.starts_with("error: cannot write /dev/stdout: Broken pipe"), "{err}");
    assert_eq!(folder.names(), ["cube.obj", "f.tesdf"]);
}
