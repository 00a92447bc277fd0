use std::fs::{self, File, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use tempfile::NamedTempFile;

use super::SaveError;
use super::links::folder_of;

const PREFIX: &str = ".tesdf-";
const SUFFIX: &str = ".part";

/// A new file that is being written beside the file that it will replace. Dropping it removes it.
#[derive(Debug)]
pub struct Part {
    file: NamedTempFile,
    /// The file that it will replace.
    target: PathBuf,
    /// The name of the target in messages.
    name: PathBuf,
}

impl Part {
    /// Creates an empty file in the folder of `target`, which must not be a link. Part files of
    /// ended processes are removed first.
    pub(super) fn new(target: &Path, name: &Path) -> Result<Self, SaveError> {
        if is_growing(target) {
            return Err(SaveError::Busy { path: name.to_path_buf() });
        }
        let folder = folder_of(target);
        remove_abandoned(folder);
        let failed = SaveError::io("create a file in", folder);
        loop {
            let file = create(target, folder).map_err(&failed)?;
            // An error is ignored: on a file system without locks, `remove_abandoned` cannot lock
            // either and removes nothing.
            let _ = file.as_file().lock();
            // Before the file was locked, another process may have removed it as abandoned.
            if file.path().exists() {
                return Ok(Self { file, target: target.to_path_buf(), name: name.to_path_buf() });
            }
        }
    }

    /// Writes the bytes to the disk and renames the file to its target.
    ///
    /// # Errors
    /// The operating system refuses. The file at the target is then unchanged.
    pub fn finish(self) -> Result<GrowingFile, SaveError> {
        let Self { file, target, name } = self;
        if let Ok(replaced) = fs::metadata(&target) {
            keep_owner_and_mode(file.as_file(), &replaced)
                .map_err(SaveError::io("set the permissions of", &name))?;
        }
        file.as_file().sync_all().map_err(SaveError::io("write", &name))?;
        let file = file.persist(&target).map_err(|e| SaveError::io("replace", &name)(e.error))?;
        // The rename itself must reach the disk too. Errors are ignored, as some file systems do
        // not let a folder be opened or synced.
        #[cfg(unix)]
        if let Ok(folder) = File::open(folder_of(&target)) {
            let _ = folder.sync_all();
        }
        Ok(GrowingFile(file))
    }
}

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// A file at its final path that may still grow. This crate refuses to replace it until it is
/// dropped.
#[derive(Debug)]
pub struct GrowingFile(File);

impl GrowingFile {
    /// Truncates the file to `bytes` and continues writing there. This undoes a write that failed
    /// halfway.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn cut(&mut self, bytes: u64) -> io::Result<()> {
        self.0.set_len(bytes)?;
        self.0.seek(SeekFrom::Start(bytes)).map(drop)
    }
}

impl Write for GrowingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl Drop for GrowingFile {
    fn drop(&mut self) {
        // Closing is not enough. A child process that another thread is starting also holds the
        // file open until it executes its program.
        let _ = self.0.unlock();
    }
}

/// Creates the file with the permissions of the file that it replaces, so nobody else can read it
/// meanwhile.
fn create(target: &Path, folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The umask turns 0666 into the mode of an ordinary file.
        let mode = fs::metadata(target).map_or(0o666, |m| m.permissions().mode() & 0o777);
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = target;
    builder.tempfile_in(folder)
}

#[cfg(unix)]
fn keep_owner_and_mode(file: &File, replaced: &fs::Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, fchown};
    let created = file.metadata()?;
    if (created.uid(), created.gid()) != (replaced.uid(), replaced.gid()) {
        // Only an administrator may change the owner. A user may set a group that the user belongs
        // to.
        let _ = fchown(file, Some(replaced.uid()), Some(replaced.gid()))
            .or_else(|_| fchown(file, None, Some(replaced.gid())));
    }
    // Set after the owner, because changing the owner clears mode bits.
    file.set_permissions(replaced.permissions())
}

#[cfg(not(unix))]
fn keep_owner_and_mode(_: &File, _: &fs::Metadata) -> io::Result<()> {
    Ok(())
}

/// Whether a living process keeps a lock on the file. A file that another process has just renamed
/// is locked for a moment, and a growing file as long as it grows.
fn is_growing(path: &Path) -> bool {
    const WAITS: u32 = 50;
    const WAIT: Duration = Duration::from_millis(10);
    (0..WAITS).all(|_| {
        let locked = is_locked(path);
        if locked {
            thread::sleep(WAIT);
        }
        locked
    })
}

/// Whether a living process holds a lock on the file.
fn is_locked(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| m.is_file())
        && File::open(path).is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// Removes part files that no process locks. Folders and files that cannot be read or removed are
/// left alone.
fn remove_abandoned(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_part = name.to_str().is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(SUFFIX));
        if !is_part || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        // The lock is held until the file is removed. A process that has just created the file
        // waits for the lock and then sees that its file is gone.
        if let Ok(file) = File::open(entry.path())
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}
