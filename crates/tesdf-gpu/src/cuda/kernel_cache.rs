//! Compiled kernels on disk, because NVRTC takes seconds for each.
//!
//! The folder is that of the environment variable `TESDF_KERNEL_CACHE`, otherwise `tesdf/kernels`
//! in `XDG_CACHE_HOME`, `LOCALAPPDATA` or `HOME/.cache`. An empty variable switches the cache off.
//! A folder that cannot be read or written only costs the time to compile.
//!
//! A file is named by a hash of all that decides its contents: text, architecture and compiler. It
//! begins with a hash of the rest, so a damaged file is compiled anew.
use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use super::CudaSource;
use super::nvrtc::{self, Compiled, compile};
use crate::GpuError;

/// Bytes of the hash at the start of a file.
const HASH: usize = blake3::OUT_LEN;

/// The image of a kernel: from the cache, or from the compiler and then kept.
pub fn image(source: &CudaSource, architecture: &str) -> Result<Vec<u8>, GpuError> {
    match file(source, architecture)?.as_deref().and_then(read) {
        Some(kept) => Ok(kept),
        None => Ok(compile_ahead(source, architecture)?.image),
    }
}

/// Compiles a kernel, and keeps it for all later processes that launch it.
///
/// # Errors
/// As of [`compile`].
pub fn compile_ahead(source: &CudaSource, architecture: &str) -> Result<Compiled, GpuError> {
    let compiled = compile(source, architecture)?;
    // Machine code, in an ELF file of 64 bits, or PTX: an image of something else may refer to
    // files of its own, as that of the stand-in of the tests does.
    if (compiled.image.starts_with(b"\x7fELF\x02") || architecture.starts_with("compute_"))
        && let Some(file) = file(source, architecture)?
    {
        keep(&file, &compiled.image);
    }
    Ok(compiled)
}

fn file(source: &CudaSource, architecture: &str) -> Result<Option<PathBuf>, GpuError> {
    let Some(folder) = folder(|name| env::var_os(name)) else { return Ok(None) };
    Ok(Some(folder.join(name(source, architecture, nvrtc::version()?))))
}

fn folder(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    if let Some(named) = variable("TESDF_KERNEL_CACHE") {
        return (!named.is_empty()).then(|| named.into());
    }
    let known = |name| variable(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let caches = known("XDG_CACHE_HOME")
        .or_else(|| known("LOCALAPPDATA"))
        .or_else(|| known("HOME").map(|home| home.join(".cache")))?;
    Some(caches.join("tesdf/kernels"))
}

fn name(source: &CudaSource, architecture: &str, (major, minor): (i32, i32)) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(format!("NVRTC {major}.{minor} {architecture} {:?}\n", nvrtc::OPTIONS).as_bytes());
    hasher.update(source.text.as_bytes());
    format!("{}-{architecture}-{}", source.entry, &hasher.finalize().to_hex()[..32])
}

fn read(file: &Path) -> Option<Vec<u8>> {
    let mut bytes = fs::read(file).ok()?;
    let (hash, image) = bytes.split_at_checked(HASH)?;
    (blake3::hash(image).as_bytes() == hash).then(|| bytes.split_off(HASH))
}

/// Writes beside the file and renames, so that a process never reads half of it.
fn keep(file: &Path, image: &[u8]) {
    let unfinished = file.with_extension(format!("{}.part", std::process::id()));
    let write = || {
        fs::create_dir_all(file.parent()?).ok()?;
        fs::write(&unfinished, [blake3::hash(image).as_bytes(), image].concat()).ok()?;
        fs::rename(&unfinished, file).ok()
    };
    if write().is_none() {
        let _ = fs::remove_file(&unfinished);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_follows_the_environment() {
        let with = |set: &[(&str, &str)]| {
            folder(|name| set.iter().find(|(n, _)| *n == name).map(|(_, value)| value.into()))
        };
        assert_eq!(with(&[]), None);
        assert_eq!(with(&[("HOME", "/h")]), Some("/h/.cache/tesdf/kernels".into()));
        assert_eq!(with(&[("HOME", "/h"), ("XDG_CACHE_HOME", "/x")]), Some("/x/tesdf/kernels".into()));
        assert_eq!(with(&[("HOME", "/h"), ("TESDF_KERNEL_CACHE", "/k")]), Some("/k".into()));
        assert_eq!(with(&[("HOME", "/h"), ("TESDF_KERNEL_CACHE", "")]), None);
    }

    #[test]
    fn a_kept_image_returns_and_a_damaged_one_does_not() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("a/b");
        assert_eq!(read(&file), None);
        keep(&file, b"image");
        assert_eq!(read(&file).as_deref(), Some(&b"image"[..]));
        fs::write(&file, &fs::read(&file)?[..HASH + 3])?;
        assert_eq!(read(&file), None);
        keep(&file, b"other");
        assert_eq!(read(&file).as_deref(), Some(&b"other"[..]));
        Ok(())
    }
}
