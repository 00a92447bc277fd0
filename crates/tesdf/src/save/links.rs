//! Finds the file that a path refers to.
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// What a path refers to after its links are followed.
#[derive(Debug)]
pub(super) enum Meant {
    /// A path that is not a link. The file need not exist.
    Path(PathBuf),
    /// A descriptor that a process holds open, such as `/dev/stdout`.
    Descriptor(PathBuf),
}

/// The same limit as that of Linux.
const MAX_LINKS: usize = 40;

/// Follows the links of the last component. Renaming over a link would replace the link instead of
/// its file.
///
/// # Errors
/// The links form a circle.
pub(super) fn follow(path: &Path) -> io::Result<Meant> {
    let mut path = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        // A link in /proc may name a file that was renamed or removed, so the descriptor itself is
        // used.
        if is_descriptor(&path) {
            return Ok(Meant::Descriptor(path));
        }
        match fs::read_link(&path) {
            Ok(next) => path = folder_of(&path).join(next),
            Err(_) => return Ok(Meant::Path(path)),
        }
    }
    Err(io::Error::other("its links lead in a circle"))
}

fn is_descriptor(path: &Path) -> bool {
    fs::canonicalize(folder_of(path)).is_ok_and(|folder| {
        folder == Path::new("/dev/fd") || folder.starts_with("/proc") && folder.ends_with("fd")
    })
}

/// The folder that contains the last component of a path.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether two paths refer to the same file on the disk. Names may differ, and hard and symbolic
/// links are followed. `false` when a path refers to no file.
pub fn is_same_file(a: impl AsRef<Path>, b: impl AsRef<Path>) -> bool {
    let (a, b) = (a.as_ref(), b.as_ref());
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        // Reads metadata only: opening a pipe would wait for its other end.
        let identity = |path| fs::metadata(path).map(|m| (m.dev(), m.ino()));
        identity(a).is_ok_and(|a| identity(b).is_ok_and(|b| a == b))
    }
    #[cfg(not(unix))]
    {
        same_file::is_same_file(a, b).unwrap_or(false)
    }
}
