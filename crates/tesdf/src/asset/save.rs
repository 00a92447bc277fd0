use std::fs;
use std::io::{self, Write};
use std::path::Path;

use super::AssetError;

/// Writes `bytes` to `path` so that a reader sees the old file or the whole new one, never a part.
///
/// The bytes go to a temporary file in the same folder, are flushed to the disk, and the file is renamed. On Unix it has
/// the permissions of a normally created file (0666 less the umask). A symbolic link is followed.
///
/// # Errors
/// [`AssetError::Io`]: the folder does not exist or cannot be written, the disk is full, or `path` is something other than
/// a file (a folder, a device). `path` is then as it was and no temporary file is left.
pub fn save_atomic(path: &Path, bytes: &[u8]) -> Result<(), AssetError> {
    let at = |action: &'static str, path: &Path| {
        let path = path.to_path_buf();
        move |source: io::Error| AssetError::Io { action, path, source }
    };
    // Renaming over a link would replace the link, and over /dev/null, as root, the device.
    let target = match fs::canonicalize(path) {
        Ok(target) if target.is_file() => target,
        Ok(_) => {
            let e = io::Error::new(io::ErrorKind::InvalidInput, "it exists and is not a regular file");
            return Err(at("write", path)(e));
        }
        Err(_) => path.to_path_buf(),
    };
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".tesdf-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder).map_err(at("create a file in", folder))?;
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(at("write", path))?;
    file.persist(&target).map_err(|e| at("replace", path)(e.error))?;
    // The rename itself must reach the disk too; not every file system lets a folder be opened or synced.
    #[cfg(unix)]
    if let Ok(folder) = fs::File::open(folder) {
        let _ = folder.sync_all();
    }
    Ok(())
}
