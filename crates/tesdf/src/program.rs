//! Runs Gmsh. It is a program of its own and never linked, because its licence is the GPL.
//!
//! It runs on one thread, in a temporary folder and without the configuration of the user, so the
//! same input gives the same output.
use std::env;
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::base::Progress;

/// Time between two looks at whether the program has ended.
const PAUSE: Duration = Duration::from_millis(5);

const LOG: &str = "log.txt";

/// The program, with a folder for its files.
pub(crate) struct Gmsh {
    executable: PathBuf,
    folder: tempfile::TempDir,
}

/// Why the program Gmsh cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProgramError {
    /// It does not exist, or does not start.
    #[error("cannot run Gmsh as '{}': {source}. {INSTALL}", executable.display())]
    NotFound {
        /// The program that was started.
        executable: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// It starts and ends without doing anything.
    #[error("Gmsh, run as '{}', does not work: {output}. {INSTALL}", executable.display())]
    Broken {
        /// The program that was started.
        executable: PathBuf,
        /// The end of its output.
        output: String,
    },
    /// Files cannot be written to or read from the temporary folder.
    #[error("cannot use a temporary folder for Gmsh: {0}; set TMPDIR to a folder with space")]
    Folder(io::Error),
}

const INSTALL: &str = "Install it with `pip install gmsh` and the libraries that it names, or with `apt install gmsh`, or \
                       set TESDF_GMSH to the path of the program";

/// Why the program did not run to its end.
#[derive(Debug)]
pub(crate) enum RunError {
    /// It cannot be used.
    Program(ProgramError),
    /// The caller asked to stop.
    Cancelled,
    /// The program was ended after the time limit.
    TimeLimit,
}

/// What the program printed.
pub(crate) struct Printed {
    text: String,
    status: ExitStatus,
}

impl Gmsh {
    /// Gmsh as `named`, or as the environment variable `TESDF_GMSH` names it, or else `gmsh`.
    ///
    /// # Errors
    /// There is no temporary folder.
    pub fn new(named: Option<&Path>) -> Result<Self, ProgramError> {
        let folder = tempfile::Builder::new().prefix("tesdf-gmsh-").tempdir();
        let folder = folder.map_err(ProgramError::Folder)?;
        Ok(Self { executable: executable(named), folder })
    }

    /// The path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file into the folder.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> Result<(), ProgramError> {
        fs::write(self.path(name), content).map_err(ProgramError::Folder)
    }

    /// Why a run wrote no result: the end of what it printed.
    ///
    /// # Errors
    /// It was not Gmsh that ran.
    pub fn why_no_result(&self, printed: &Printed) -> Result<String, ProgramError> {
        let output = printed.last_words();
        match printed.is_of_gmsh() {
            true => Ok(output),
            false => Err(ProgramError::Broken { executable: self.executable.clone(), output }),
        }
    }

    /// Runs the program in the folder, until it ends.
    pub fn run(&self, arguments: &[&str], limit: Duration, progress: &Progress) -> Result<Printed, RunError> {
        let folder = |e| RunError::Program(ProgramError::Folder(e));
        let log = File::create(self.path(LOG)).map_err(folder)?;
        let log_too = log.try_clone().map_err(folder)?;
        let started = Command::new(&self.executable)
            .args(arguments)
            .current_dir(self.folder.path())
            // Gmsh looks in this folder for the configuration of the user, which must not change
            // the result.
            .env("GMSH_HOME", self.folder.path())
            .env("OMP_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .stdout(log)
            .stderr(log_too)
            .spawn();
        let started = started.map_err(|source| {
            RunError::Program(ProgramError::NotFound { executable: self.executable.clone(), source })
        })?;
        let status = wait(started, limit, progress).map_err(folder)?;
        if progress.is_cancelled() {
            return Err(RunError::Cancelled);
        }
        let status = status.ok_or(RunError::TimeLimit)?;
        let text = fs::read(self.path(LOG)).map_err(folder)?;
        Ok(Printed { text: String::from_utf8_lossy(&text).into_owned(), status })
    }
}

impl Printed {
    /// Whether it was Gmsh that ran: it prints "Info" and its version when it starts. A shell, a
    /// loader or an interpreter does not.
    fn is_of_gmsh(&self) -> bool {
        self.text.contains("Info    :")
    }

    /// The first line in which Gmsh reports an error.
    pub fn first_error(&self) -> Option<String> {
        let said = self.text.lines().find_map(|line| line.strip_prefix("Error   : "));
        said.map(|said| said.trim().to_owned())
    }

    /// The first error, or the last line if there is no error.
    pub fn last_words(&self) -> String {
        let last = || self.text.lines().rev().map(str::trim).find(|l| !l.is_empty()).map(str::to_owned);
        self.first_error().or_else(last).unwrap_or_else(|| format!("it printed nothing ({})", self.status))
    }

    /// The version that Gmsh printed.
    pub fn version(&self) -> Option<&str> {
        let after = self.text.split_once("[Gmsh ")?.1;
        after.split([',', ']']).next()
    }
}

/// The program to start. A path with a folder is made absolute, because the program runs in another
/// folder.
fn executable(named: Option<&Path>) -> PathBuf {
    let of_environment = || env::var_os("TESDF_GMSH").filter(|v| !v.is_empty()).map(PathBuf::from);
    let path = named.map(Path::to_path_buf).or_else(of_environment).unwrap_or_else(|| "gmsh".into());
    let has_folder = path.parent().is_some_and(|p| p != Path::new(""));
    if has_folder { std::path::absolute(&path).unwrap_or(path) } else { path }
}

/// Waits for the program. Returns `None` when it took too long or was cancelled. It is ended then.
fn wait(mut child: Child, limit: Duration, progress: &Progress) -> io::Result<Option<ExitStatus>> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if start.elapsed() > limit || progress.is_cancelled() {
            match child.kill() {
                // The program has ended in between.
                Err(error) if error.kind() == ErrorKind::InvalidInput => {}
                other => other?,
            }
            child.wait()?;
            return Ok(None);
        }
        thread::sleep(PAUSE);
    }
}
