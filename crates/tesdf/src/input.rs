//! Reads whole files. Pipes and devices are accepted too.
use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::Path;

/// Largest number of bytes that are read from a pipe, which may never end: 4 GiB.
pub const MAX_STREAMED: u64 = 1 << 32;
/// Largest number of bytes that are read from a device: 16 MiB. People type on a terminal, and
/// `/dev/zero` never ends.
pub const MAX_FROM_DEVICE: u64 = 1 << 24;

/// Reads all bytes of a file, a pipe or a device. A regular file may be as large as memory allows.
///
/// # Errors
/// The error of the operating system; [`io::ErrorKind::OutOfMemory`] when the file does not fit
/// into memory; [`io::ErrorKind::FileTooLarge`] when a pipe gives more than [`MAX_STREAMED`] bytes,
/// or a device more than [`MAX_FROM_DEVICE`].
pub fn read(path: impl AsRef<Path>) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let mut bytes = Vec::new();
    read_rest(&mut file, &mut bytes)?;
    Ok(bytes)
}

/// Checks that a file that another file names is a regular one. A pipe may never give a byte, and
/// only the user may ask for that.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`]: it is a folder, a pipe or a device. A file that does not exist
/// is an error where it is opened.
pub fn check_regular(path: impl AsRef<Path>) -> io::Result<()> {
    match std::fs::metadata(path) {
        Ok(found) if !found.is_file() => {
            Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file"))
        }
        _ => Ok(()),
    }
}

/// Reads a file as [`read`] does and returns it as text.
///
/// # Errors
/// As [`read`]; [`io::ErrorKind::InvalidData`], with the line, when the bytes are not UTF-8.
pub fn read_to_string(path: impl AsRef<Path>) -> io::Result<String> {
    String::from_utf8(read(path)?).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        io::Error::new(io::ErrorKind::InvalidData, format!("line {line} is not UTF-8 text"))
    })
}

/// Appends the remaining bytes of an open file to `bytes`.
pub(crate) fn read_rest(file: &mut File, bytes: &mut Vec<u8>) -> io::Result<()> {
    let metadata = file.metadata()?;
    let length = metadata.len();
    // Files of the kernel (such as those in `/proc`) report a length of 0 but have content.
    if metadata.is_file() && length > 0 {
        bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX))?;
        file.read_to_end(bytes)?;
        return Ok(());
    }
    let (kind, most) = match is_device(&metadata) {
        true => ("a device", MAX_FROM_DEVICE),
        false => ("not a regular file", MAX_STREAMED),
    };
    file.take(most + 1).read_to_end(bytes)?;
    if bytes.len() as u64 > most {
        let found = format!("it is {kind}, and more than {most} bytes came from it");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, found));
    }
    Ok(())
}

#[cfg(unix)]
fn is_device(metadata: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt as _;
    let kind = metadata.file_type();
    kind.is_char_device() || kind.is_block_device()
}

#[cfg(not(unix))]
fn is_device(_: &Metadata) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_that_is_not_utf8_is_an_error_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text");
        std::fs::write(&path, "a\nµ").unwrap();
        assert_eq!(read(&path).unwrap(), "a\nµ".as_bytes());
        assert_eq!(read_to_string(&path).unwrap(), "a\nµ");
        std::fs::write(&path, b"a\n\xff").unwrap();
        assert_eq!(read_to_string(&path).unwrap_err().to_string(), "line 2 is not UTF-8 text");
        assert_eq!(read(folder.path().join("none")).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn a_device_that_never_ends_is_refused_after_16_mib() {
        let refused = read("/dev/zero").unwrap_err();
        assert_eq!(refused.to_string(), "it is a device, and more than 16777216 bytes came from it");
        assert_eq!(check_regular("/dev/zero").unwrap_err().kind(), io::ErrorKind::InvalidInput);
    }
}
