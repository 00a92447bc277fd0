//! Reading files whole, whatever they are.
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Most bytes that are taken from a pipe or a device, which may never end: 4 GiB.
pub const MOST_STREAMED: u64 = 1 << 32;

/// All bytes of a file, a pipe or a device. A regular file may be of any size that the memory holds.
///
/// # Errors
/// What the operating system says; [`io::ErrorKind::OutOfMemory`]; [`io::ErrorKind::FileTooLarge`] when more than [`MOST_STREAMED`] bytes
/// come from what is no regular file.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let mut bytes = Vec::new();
    read_rest(&mut file, &mut bytes)?;
    Ok(bytes)
}

/// As [`read`], as text.
///
/// # Errors
/// As [`read`]; [`io::ErrorKind::InvalidData`] when the bytes are not UTF-8.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path)?).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        io::Error::new(io::ErrorKind::InvalidData, format!("line {line} is not UTF-8 text"))
    })
}

/// Appends what is left of an open file.
pub(crate) fn read_rest(file: &mut File, bytes: &mut Vec<u8>) -> io::Result<()> {
    let metadata = file.metadata()?;
    let length = metadata.len();
    // Files of the kernel have a length of 0 and content all the same.
    if metadata.is_file() && length > 0 {
        bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX))?;
        file.read_to_end(bytes)?;
        return Ok(());
    }
    file.take(MOST_STREAMED + 1).read_to_end(bytes)?;
    if bytes.len() as u64 > MOST_STREAMED {
        let found = format!("it is no regular file, and more than {MOST_STREAMED} bytes came from it");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, found));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_read_whole_and_text_has_to_be_text() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text");
        std::fs::write(&path, "a\nµ").unwrap();
        assert_eq!(read(&path).unwrap(), "a\nµ".as_bytes());
        assert_eq!(read_to_string(&path).unwrap(), "a\nµ");
        std::fs::write(&path, b"a\n\xff").unwrap();
        assert_eq!(read_to_string(&path).unwrap_err().to_string(), "line 2 is not UTF-8 text");
        assert_eq!(read(&folder.path().join("none")).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
