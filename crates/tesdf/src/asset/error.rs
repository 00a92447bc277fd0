use std::io;
use std::path::PathBuf;

/// Why a `.tesdf` file cannot be written, opened or trusted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AssetError {
    /// The file cannot be written.
    #[cfg(feature = "encode")]
    #[error(transparent)]
    Save(#[from] crate::save::SaveError),
    /// The operating system refused an action.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The action: `open`, `map`, …
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The answer of the operating system.
        source: io::Error,
    },
    /// The memory does not hold the file, or the data that is made of it.
    #[error("no memory is left for {bytes} bytes; free some, or open the file where there is more")]
    Memory {
        /// Number of bytes asked for.
        bytes: usize,
    },
    /// The bytes are not those of a `.tesdf` file.
    #[error("this is {found}, not a .tesdf file; {next}")]
    NotTesdf {
        /// What the bytes look like, with its article.
        found: &'static str,
        /// What to do next.
        next: &'static str,
    },
    /// The file has a version that this build does not read.
    #[error("file-format version {found}; this build reads versions {} and {}; {}", super::FORMAT_VERSION, super::FORMAT_VERSION_OF_RULES, next_for_version(.found))]
    Version {
        /// The version found, as written in the file.
        found: String,
    },
    /// The file ends before its header does. A file that ends later is an error of a
    /// [`Section`](Self::Section).
    #[error(
        "the file has {found} bytes, but its header needs {expected}; it was cut short, copy or encode it again"
    )]
    Truncated {
        /// Number of bytes found.
        found: u64,
        /// Least number of bytes that must be there.
        expected: u64,
    },
    /// There are bytes after the last section.
    #[error(
        "{} the last section, which ends at byte {expected}; copy or encode the file again",
        bytes_follow(.extra)
    )]
    TrailingBytes {
        /// Length of the file, according to its header.
        expected: u64,
        /// Number of bytes after that.
        extra: u64,
    },
    /// The header does not follow the format.
    #[error("header: {reason}")]
    Header {
        /// What was found and what was expected.
        reason: String,
    },
    /// The entry of a section does not follow the format.
    #[error("section {name}: {reason}")]
    Section {
        /// The section.
        name: String,
        /// What was found and what was expected.
        reason: String,
    },
    /// A checksum does not match, so the file was damaged or edited.
    #[error(
        "{part}: the checksum is {found}, the file says {expected}; the file was damaged, copy or encode it again"
    )]
    Checksum {
        /// `header` or `section NAME`.
        part: String,
        /// Checksum of the bytes, in hex.
        found: String,
        /// Checksum that is written in the file.
        expected: String,
    },
}

fn bytes_follow(extra: &u64) -> String {
    if *extra == 1 { "1 byte follows".into() } else { format!("{extra} bytes follow") }
}

fn next_for_version(found: &str) -> &'static str {
    match found.parse::<u32>() {
        Ok(v) if v > super::FORMAT_VERSION_OF_RULES => "a newer tesdf wrote it, update tesdf",
        _ => "encode the mesh again",
    }
}

impl AssetError {
    pub(super) fn section(name: &str, reason: impl Into<String>) -> Self {
        Self::Section { name: shown(name), reason: reason.into() }
    }

    pub(super) fn header(reason: impl Into<String>) -> Self {
        Self::Header { reason: reason.into() }
    }
}

/// A name from the file for a message. Control characters are escaped, and the length is limited.
pub(super) fn shown(name: &str) -> String {
    const LONGEST: usize = 64;
    let mut s: String = name.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if name.chars().nth(LONGEST).is_some() {
        s.push('…');
    }
    s
}
