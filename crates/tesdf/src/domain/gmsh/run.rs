//! Runs the program in a temporary folder.
use std::{
    env,
    fs::{self, File},
    io::ErrorKind,
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

use super::{GmshError, GmshOptions, RefusedBecause, input::SURFACE};
use crate::base::Progress;
use crate::domain::{TetMesh, read_tetrahedra};

/// Time between two looks at whether Gmsh has ended.
const PAUSE: Duration = Duration::from_millis(5);

const SCRIPT: &str = "domain.geo";
const RESULT: &str = "domain.msh";
const LOG: &str = "log.txt";

/// Runs Gmsh and returns its tetrahedra, in the local frame. The inner error is one that other
/// settings may not have.
pub(super) fn run(
    surface: &str,
    script: &str,
    options: &GmshOptions,
    progress: &Progress,
) -> Result<Result<TetMesh, RefusedBecause>, GmshError> {
    let folder = tempfile::Builder::new().prefix("tesdf-gmsh-").tempdir().map_err(GmshError::Folder)?;
    let path = |name: &str| folder.path().join(name);
    fs::write(path(SURFACE), surface).map_err(GmshError::Folder)?;
    fs::write(path(SCRIPT), script).map_err(GmshError::Folder)?;
    let log = File::create(path(LOG)).map_err(GmshError::Folder)?;
    let log_too = log.try_clone().map_err(GmshError::Folder)?;

    let executable = executable(options);
    let started = Command::new(&executable)
        .args([SCRIPT, "-3", "-format", "msh2", "-bin", "-o", RESULT, "-nt", "1", "-v", "3"])
        .current_dir(folder.path())
        // Gmsh looks in this folder for the configuration of the user, which must not change the
        // result.
        .env("GMSH_HOME", folder.path())
        .env("OMP_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(log)
        .stderr(log_too)
        .spawn();
    let child = started.map_err(|source| GmshError::NotFound { executable: executable.clone(), source })?;
    let status = wait(child, options.time_limit, progress).map_err(GmshError::Folder)?;
    if progress.is_cancelled() {
        return Err(GmshError::Cancelled);
    }
    let Some(status) = status else {
        return Ok(Err(RefusedBecause::TimeLimit(options.time_limit)));
    };
    let printed = fs::read(path(LOG)).map_err(GmshError::Folder)?;
    let printed = String::from_utf8_lossy(&printed);
    let result = path(RESULT);
    if !result.exists() {
        let output = last_words(&printed, status);
        // Gmsh prints "Info" and its version when it starts. A shell, a loader or an interpreter
        // does not.
        if !printed.contains("Info    :") {
            return Err(GmshError::Broken { executable, output });
        }
        return Ok(Err(RefusedBecause::Gmsh(output)));
    }
    Ok(read_tetrahedra(&result).map_err(|error| match first_error(&printed) {
        // Such a message, for example "no elements in volume", says more than that the file has no
        // tetrahedra.
        Some(said) => RefusedBecause::Gmsh(said),
        None => RefusedBecause::Read(error),
    }))
}

/// The program to start. A path with a folder is made absolute, because the program runs in another
/// folder.
fn executable(options: &GmshOptions) -> PathBuf {
    let named = options.executable.clone();
    let path = named.or_else(|| env::var_os("TESDF_GMSH").filter(|v| !v.is_empty()).map(PathBuf::from));
    let path = path.unwrap_or_else(|| "gmsh".into());
    let has_folder = path.parent().is_some_and(|p| p != Path::new(""));
    if has_folder { std::path::absolute(&path).unwrap_or(path) } else { path }
}

/// Waits for the program. Returns `None` when it took too long or was cancelled. It is ended then.
fn wait(mut child: Child, limit: Duration, progress: &Progress) -> std::io::Result<Option<ExitStatus>> {
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

/// The first line in which Gmsh reports an error.
fn first_error(printed: &str) -> Option<String> {
    printed.lines().find_map(|line| line.strip_prefix("Error   : ")).map(|said| said.trim().to_owned())
}

/// The first error, or the last line if there is no error.
fn last_words(printed: &str, status: ExitStatus) -> String {
    let last = || printed.lines().rev().map(str::trim).find(|l| !l.is_empty()).map(str::to_owned);
    first_error(printed).or_else(last).unwrap_or_else(|| format!("it printed nothing ({status})"))
}
