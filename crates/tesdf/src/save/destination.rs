use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::links::{Meant, folder_of, follow, is_same_file};
use super::{Part, SaveError};

/// Whether a read-only file may be replaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReadOnly {
    /// A read-only file is an error.
    #[default]
    Keep,
    /// A read-only file is replaced, and its permissions are kept.
    Replace,
}

/// The restrictions of a [`Destination`].
#[derive(Clone, Copy, Debug, Default)]
pub struct SaveOptions<'a> {
    /// Files that the work reads. The output must not be one of them.
    pub inputs: &'a [&'a Path],
    /// Whether a read-only file may be replaced.
    pub read_only: ReadOnly,
}

/// The output of some work. It is checked before the work begins, so an output that cannot be
/// written is found before time is spent.
#[derive(Debug)]
pub struct Destination {
    path: PathBuf,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// A regular file at this path, which is not a link. The file need not exist yet.
    File(PathBuf),
    /// A pipe, a device or an open descriptor.
    Stream(File),
    /// The standard output of this process.
    Stdout,
}

impl Destination {
    /// Checks that `path` can be written. It must not be an input, a folder or a read-only file.
    /// Its folder must accept new files, and no other process may be writing it. A pipe is opened,
    /// which waits for its reader.
    ///
    /// # Errors
    /// [`SaveError`] says which condition fails. Nothing is changed, except that abandoned part
    /// files are removed.
    pub fn new(path: impl AsRef<Path>, options: &SaveOptions<'_>) -> Result<Self, SaveError> {
        Self::of(path.as_ref(), options)
    }

    fn of(path: &Path, options: &SaveOptions<'_>) -> Result<Self, SaveError> {
        if let Some(input) = options.inputs.iter().find(|input| is_same_file(path, input)) {
            return Err(SaveError::Input { output: path.to_path_buf(), input: input.to_path_buf() });
        }
        let kind = match follow(path).map_err(SaveError::io("write", path))? {
            Meant::Descriptor(descriptor) if is_stdout(&descriptor) => Kind::Stdout,
            Meant::Descriptor(descriptor) => Self::stream(&descriptor, path)?,
            Meant::Path(target) => match fs::metadata(&target) {
                Ok(found) if found.is_dir() => {
                    return Err(SaveError::IsFolder { path: path.to_path_buf() });
                }
                Ok(found) if !found.is_file() => Self::stream(&target, path)?,
                found => {
                    if options.read_only == ReadOnly::Keep
                        && found.is_ok_and(|found| is_read_only(&target, &found))
                    {
                        return Err(SaveError::ReadOnly { path: path.to_path_buf() });
                    }
                    Self::file(target, path)?
                }
            },
        };
        Ok(Self { path: path.to_path_buf(), kind })
    }

    fn file(target: PathBuf, path: &Path) -> Result<Kind, SaveError> {
        let folder = folder_of(&target);
        match fs::metadata(folder) {
            Ok(found) if found.is_dir() => {}
            Err(e) if !matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
                return Err(SaveError::io("find the folder", folder)(e));
            }
            _ => return Err(SaveError::NoFolder { path: path.to_path_buf(), folder: folder.to_path_buf() }),
        }
        // Creates a file and removes it again: no other test shows that the folder accepts files.
        drop(Part::new(&target, path)?);
        Ok(Kind::File(target))
    }

    fn stream(target: &Path, path: &Path) -> Result<Kind, SaveError> {
        // Appends, because the descriptor may belong to a file that already holds bytes.
        let file = OpenOptions::new().append(true).open(target).map_err(SaveError::io("open", path))?;
        Ok(Kind::Stream(file))
    }

    /// The path as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the bytes go to the standard output of this process. No other text should be written
    /// there then.
    pub fn is_stdout(&self) -> bool {
        matches!(self.kind, Kind::Stdout)
    }

    /// The regular file that [`write`](Self::write) replaces; `None` when the destination is a
    /// pipe, a device or an open descriptor.
    pub fn file_path(&self) -> Option<&Path> {
        match &self.kind {
            Kind::File(target) => Some(target),
            Kind::Stream(_) | Kind::Stdout => None,
        }
    }

    /// Opens a part file to be written piece by piece; `None` when [`file_path`](Self::file_path)
    /// is `None`.
    ///
    /// # Errors
    /// The operating system refuses, or another process is writing the file.
    pub fn part(&self) -> Result<Option<Part>, SaveError> {
        self.file_path().map(|target| Part::new(target, &self.path)).transpose()
    }

    /// Writes all of `bytes`.
    ///
    /// # Errors
    /// The operating system refuses. A regular file is then unchanged, and no part file is left.
    pub fn write(&self, bytes: &[u8]) -> Result<(), SaveError> {
        let failed = SaveError::io("write", &self.path);
        match &self.kind {
            Kind::File(target) => {
                let mut part = Part::new(target, &self.path)?;
                part.write_all(bytes).map_err(failed)?;
                part.finish().map(drop)
            }
            Kind::Stream(file) => (&*file).write_all(bytes).map_err(failed),
            Kind::Stdout => {
                let mut out = io::stdout().lock();
                out.write_all(bytes).and_then(|()| out.flush()).map_err(failed)
            }
        }
    }
}

/// Whether the permission bits forbid writing, even for an administrator, or the system does not
/// let this process write the file.
fn is_read_only(target: &Path, found: &fs::Metadata) -> bool {
    let refused = || OpenOptions::new().append(true).open(target).err();
    found.permissions().readonly() || refused().is_some_and(|e| e.kind() == io::ErrorKind::PermissionDenied)
}

fn is_stdout(descriptor: &Path) -> bool {
    let own = ["/proc/self/fd", "/dev/fd"].map(fs::canonicalize);
    descriptor.file_name().is_some_and(|name| name == "1")
        && fs::canonicalize(folder_of(descriptor))
            .is_ok_and(|folder| own.iter().flatten().any(|own| *own == folder))
}
