//! Which file a path means.
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// What a path means once its links are followed.
#[derive(Debug)]
pub(super) enum Meant {
    /// A path that is no link; there need not be a file.
    Path(PathBuf),
    /// A descriptor that a process holds open, such as `/dev/stdout`.
    Descriptor(PathBuf),
}

/// As many as Linux follows.
const MOST_LINKS: usize = 40;

/// Follows the links of the last component. Renaming over a link would replace the link instead of its file.
///
/// # Errors
/// Links in a circle.
pub(super) fn follow(path: &Path) -> io::Result<Meant> {
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        // A link of /proc names a file that may be renamed or gone: the descriptor is what is meant.
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

/// The folder that the last component of a path is in.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether two paths lead to one file, by its identity on the disk: under other names, and through hard and symbolic
/// links, too. `false` when one of them leads to no file.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        // Nothing is opened: opening a pipe would wait for its other end.
        let identity = |path| fs::metadata(path).map(|m| (m.dev(), m.ino()));
        identity(a).is_ok_and(|a| identity(b).is_ok_and(|b| a == b))
    }
    #[cfg(not(unix))]
    {
        same_file::is_same_file(a, b).unwrap_or(false)
    }
}
