use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::links::{Meant, folder_of, follow, is_same_file};
use super::{Part, SaveError};

/// Whether a read-only file may be replaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReadOnly {
    /// It is refused.
    #[default]
    Keep,
    /// It is replaced, and its permissions are kept.
    Replace,
}

/// What a [`Destination`] must respect.
#[derive(Clone, Copy, Debug, Default)]
pub struct SaveOptions<'a> {
    /// Files that the work reads; none of them may be the output.
    pub inputs: &'a [&'a Path],
    /// Whether a read-only file may be replaced.
    pub read_only: ReadOnly,
}

/// Where the result of some work goes: checked before the work, so that an output that cannot be written costs nothing.
#[derive(Debug)]
pub struct Destination {
    path: PathBuf,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// A regular file, there already or not, at this path, which is no link.
    File(PathBuf),
    /// A pipe, a device or an open descriptor.
    Stream(File),
    /// The standard output of this process.
    Stdout,
}

impl Destination {
    /// Checks that `path` can be written: it is none of the inputs, no folder, not read-only, in a folder where files can
    /// be created, and no other process is writing it. A pipe is opened, which waits for its reader.
    ///
    /// # Errors
    /// [`SaveError`] says which of these it is. Nothing was changed, but abandoned part files are gone.
    pub fn new(path: &Path, options: &SaveOptions<'_>) -> Result<Self, SaveError> {
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
        if !folder.is_dir() {
            return Err(SaveError::NoFolder { path: path.to_path_buf(), folder: folder.to_path_buf() });
        }
        // Created and removed again: the only way to know that files can be created.
        drop(Part::new(&target, path)?);
        Ok(Kind::File(target))
    }

    fn stream(target: &Path, path: &Path) -> Result<Kind, SaveError> {
        // At the end of what is there: a descriptor may be of a file that holds bytes already.
        let file = OpenOptions::new().append(true).open(target).map_err(SaveError::io("open", path))?;
        Ok(Kind::Stream(file))
    }

    /// The path as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the bytes go to the standard output of this process, where no other text should go then.
    pub fn is_stdout(&self) -> bool {
        matches!(self.kind, Kind::Stdout)
    }

    /// The regular file that [`write`](Self::write) replaces; `None` when it replaces none, but writes to a pipe, a device or an
    /// open descriptor.
    pub fn file_path(&self) -> Option<&Path> {
        match &self.kind {
            Kind::File(target) => Some(target),
            Kind::Stream(_) | Kind::Stdout => None,
        }
    }

    /// A file to be written piece by piece; `None` when [`file_path`](Self::file_path) is.
    ///
    /// # Errors
    /// What the operating system refused; another process that has begun to write the file.
    pub fn part(&self) -> Result<Option<Part>, SaveError> {
        self.file_path().map(|target| Part::new(target, &self.path)).transpose()
    }

    /// Writes all of the bytes.
    ///
    /// # Errors
    /// What the operating system refused; a regular file is then as it was and no part file is left.
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

/// By its permission bits, also for an administrator; or because the system does not let this process write it.
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
