//! Lines, words and numbers of text files of unknown encoding.
use super::{MeshFormat, Place, ReadError};

/// Lines with their 1-based numbers. A line ends at LF, CR LF or a lone CR. A UTF-8 byte-order mark
/// at the start is skipped.
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    number: u64,
}

impl<'a> Lines<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: without_bom(bytes), number: 0 }
    }

    /// The lines of `rest`, which begins after line `number`.
    pub fn after(rest: &'a [u8], number: u64) -> Self {
        Self { rest, number }
    }

    /// The number of the line that was returned last; 0 before the first.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The bytes after the line that was returned last.
    pub fn rest(&self) -> &'a [u8] {
        self.rest
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (u64, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(self.rest.len());
        let (line, tail) = self.rest.split_at(end);
        let ending = if tail.starts_with(b"\r\n") { 2 } else { tail.len().min(1) };
        self.rest = &tail[ending..];
        self.number += 1;
        Some((self.number, line))
    }
}

pub(crate) fn without_bom(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// The words of a line.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    // Vertical tab and form feed are white space for C's isspace, so exporters may write them.
    line.split(|b| b.is_ascii_whitespace() || *b == 0x0B).filter(|w| !w.is_empty())
}

/// The line up to a `#`.
pub(crate) fn without_comment(line: &[u8]) -> &[u8] {
    line.split(|b| *b == b'#').next().unwrap_or(line)
}

/// A word as shown in messages: at most 40 bytes, with control characters escaped.
pub(crate) fn shown(word: &[u8]) -> String {
    let cut = &word[..word.len().min(40)];
    let dots = if cut.len() < word.len() { "…" } else { "" };
    format!("'{}{dots}'", cut.escape_ascii())
}

/// Parses a number. NaN and infinities are accepted here and checked later.
pub(super) fn number(word: &[u8], format: MeshFormat, line: u64) -> Result<f64, ReadError> {
    std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).ok_or_else(|| {
        if word.contains(&b',') {
            let found = format!("{} has a comma", shown(word));
            malformed(format, line, found, "numbers need a decimal point: export again with another locale")
        } else {
            let found = format!("{} is not a number", shown(word));
            malformed(format, line, found, "expected a decimal number such as -1.5e-3")
        }
    })
}

/// Parses an integer, which may be negative.
pub(super) fn integer(word: &[u8], format: MeshFormat, line: u64) -> Result<i64, ReadError> {
    std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).ok_or_else(|| {
        malformed(
            format,
            line,
            format!("{} is not a whole number", shown(word)),
            "expected a vertex index or a count",
        )
    })
}

pub(super) fn malformed(
    format: MeshFormat,
    line: u64,
    found: impl Into<String>,
    help: impl Into<String>,
) -> ReadError {
    ReadError::Malformed { format, place: Place::Line(line), found: found.into(), help: help.into() }
}
