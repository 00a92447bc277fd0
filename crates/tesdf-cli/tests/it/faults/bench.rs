//! Commands whose calls of the system fail.
use std::fs::{self, File, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use tesdf_sim::RunRecord;

use super::rotation::of_the_day;
use crate::folder::Folder;

/// No command calls the system more often, but for memory.
pub const MOST: u32 = 400;
/// Longest time of a command.
const LIMIT: Duration = Duration::from_secs(60);
/// The bytes of outputs before a command.
const OLD: &[u8] = b"old";

/// Errors of the system, in words. The last one is a refusal to open a file for writing.
const REASONS: [&str; 7] = [
    "No space left on device",
    "Input/output error",
    "Permission denied",
    "Operation not permitted",
    "Cannot allocate memory",
    "Resource temporarily unavailable",
    "is read-only",
];

/// A command that writes one file.
#[derive(Clone, Copy)]
pub struct Writer {
    pub args: &'static [&'static str],
    pub output: &'static str,
}

/// How a command ended.
#[derive(Debug)]
pub struct Ended {
    pub code: Option<i32>,
    pub out: Vec<u8>,
    pub err: String,
    /// Whether a call failed.
    pub hit: bool,
}

/// A folder for commands, and one beside it.
pub struct Bench {
    pub folder: Folder,
    aside: Folder,
    /// The folder of encoded meshes of commands with faults; without a name, there is none.
    pub cache: &'static str,
}

/// The library of `preloaded.rs`. The compiler is there, as it compiled this test.
fn preloaded() -> &'static Path {
    static LIBRARY: OnceLock<PathBuf> = OnceLock::new();
    LIBRARY.get_or_init(|| {
        let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
        let (made, kept) = (folder.path().join("faults.so"), folder.path().with_file_name("faults.so"));
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/faults/preloaded.rs");
        let rustc = std::env::var_os("RUSTC").unwrap_or("rustc".into());
        let options = ["--edition=2024", "--crate-type=cdylib", "-O", "-Cpanic=abort", "-o"];
        let ended = Command::new(rustc).args(options).arg(&made).arg(source).status().unwrap();
        assert!(ended.success(), "the library of faults was not compiled");
        fs::rename(made, &kept).unwrap();
        kept
    })
}

impl Bench {
    pub fn new() -> Self {
        let bench = Self { folder: Folder::new(), aside: Folder::new(), cache: "" };
        bench.give_rights();
        bench
    }

    /// A fault of the kind `rights` takes them.
    fn give_rights(&self) {
        fs::set_permissions(self.folder.path(""), Permissions::from_mode(0o755)).unwrap();
    }

    /// Runs a command with a fault, as `preloaded.rs` describes it. It must end by itself, with an
    /// exit code and without a panic; where the code is 2, it says why.
    pub fn run(&self, args: &[&str], fault: &str) -> Ended {
        let (hit, out, err) = (self.aside.path("hit"), self.aside.path("out"), self.aside.path("err"));
        let _ = fs::remove_file(&hit);
        let mut command = self.folder.command(args);
        command.env("LD_PRELOAD", preloaded()).env("FAULT", fault).env("FAULT_HIT", &hit);
        command.env("FAULT_FOLDER", self.folder.path("")).env("RUST_BACKTRACE", "0");
        command.env("TESDF_CACHE", self.cache);
        command.stdin(Stdio::null()).stdout(File::create(&out).unwrap()).stderr(File::create(&err).unwrap());
        let (mut child, begin) = (command.spawn().unwrap(), Instant::now());
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            if begin.elapsed() > LIMIT {
                child.kill().unwrap();
                panic!("{args:?}, {fault}: it does not end");
            }
            std::thread::sleep(Duration::from_micros(500));
        };
        self.give_rights();
        let err = String::from_utf8_lossy(&fs::read(err).unwrap()).into_owned();
        let (code, out) = (status.code(), fs::read(out).unwrap());
        let ended = Ended { code, out, err, hit: hit.exists() };
        assert!([Some(0), Some(1), Some(2)].contains(&code), "{args:?}, {fault}: {status}, {ended:?}");
        let said = |text| ended.err.contains(text);
        assert!(!said("panicked") && !said("has a bug"), "{args:?}, {fault}: {ended:?}");
        assert!(code != Some(2) || said("error: "), "{args:?}, {fault}: {ended:?}");
        ended
    }

    /// The files of the folder, but those of unfinished writes, and whether there are some of
    /// these.
    fn names(&self) -> (Vec<String>, bool) {
        let (parts, names): (Vec<_>, Vec<_>) =
            self.folder.names().into_iter().partition(|name| name.starts_with(".tesdf-"));
        (names, !parts.is_empty())
    }

    /// Lets calls of each kind fail, in a third of all places, which the day chooses: each once,
    /// and that and all later ones. The result is the whole new file, or an error, with the old
    /// file or, for a run, with its steps so far.
    pub fn try_files(&self, writer: Writer, kinds: &[&str]) {
        let whole = self.whole(writer);
        let mut hits = 0;
        for kind in kinds {
            for how in ["once", "from"] {
                for number in of_the_day(1..MOST) {
                    let fault = format!("{kind} {number} {how}");
                    let ended = self.try_fault(writer, &fault, &whole);
                    if !ended.hit {
                        break;
                    }
                    hits += 1;
                    let reason = REASONS.iter().any(|reason| ended.err.contains(reason));
                    let files = ["stdout", "in .: ", "folder .: "].iter().chain(writer.args);
                    let file = files.chain([&writer.output]).any(|file| ended.err.contains(file));
                    let said = ended.code == Some(0) || reason && file;
                    assert!(said, "{:?}, {fault}: {ended:?}", writer.args);
                }
            }
        }
        assert!(hits > 0, "{:?}: nothing failed", writer.args);
    }

    /// The bytes that the command writes without a fault.
    pub fn whole(&self, Writer { args, output }: Writer) -> Vec<u8> {
        self.folder.good(&[args, &["-o", output]].concat());
        fs::read(self.folder.path(output)).unwrap()
    }

    /// Runs a command with a fault over an old file, and checks what is left of it.
    pub fn try_fault(&self, Writer { args, output }: Writer, fault: &str, whole: &[u8]) -> Ended {
        let command = [args, &["-o", output]].concat();
        self.folder.write(output, OLD);
        let (before, _) = self.names();
        let ended = self.run(&command, fault);
        let left = fs::read(self.folder.path(output)).unwrap();
        let (names, has_parts) = self.names();
        let context = || format!("{args:?}, {fault}: {} bytes, {names:?}, {ended:?}", left.len());
        assert_eq!(names, before, "{}", context());
        // What cannot be removed goes with the next write.
        let may_stay = ["remove", "rights"].iter().any(|kind| fault.starts_with(kind));
        assert!(!has_parts || may_stay, "{}", context());
        if has_parts {
            assert!(self.whole(Writer { args, output }) == whole && !self.names().1, "{}", context());
        }
        match ended.code {
            Some(0) => assert!(left == whole, "{}", context()),
            Some(2) if left == OLD || left == whole => {}
            _ => {
                assert!(ended.code == Some(2) && args[0] == "simulate", "{}", context());
                let record = RunRecord::from_bytes(&left).unwrap_or_else(|e| panic!("{e}: {}", context()));
                assert!(record.planned_steps() > Some(record.steps()) || !ended.err.is_empty());
                self.folder.write(output, &left);
                self.folder.good(&["simulate", "--resume", output]);
                assert!(fs::read(self.folder.path(output)).unwrap() == whole, "{}", context());
            }
        }
        ended
    }
}
