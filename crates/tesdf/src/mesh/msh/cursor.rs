//! Reads numbers from text or binary data, with the place of each number.
use glam::DVec3;

use super::{MshError, Place, shown};

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    /// Words between white space.
    Ascii,
    /// Four or eight bytes, least significant first.
    Little,
    /// Four or eight bytes, most significant first.
    Big,
}

/// A place in a file. It moves on as lines and numbers are read.
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    /// Position of the next byte.
    at: usize,
    /// Line of the next byte, 1-based.
    line: u64,
    pub encoding: Encoding,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, line: 1, encoding: Encoding::Ascii }
    }

    /// The line in a text file, or the byte in a binary file.
    pub fn place(&self) -> Place {
        match self.encoding {
            Encoding::Ascii => Place::Line(self.line),
            _ => Place::Byte(self.at as u64),
        }
    }

    pub fn error(&self, found: impl Into<String>, help: impl Into<String>) -> MshError {
        MshError::Malformed { place: self.place(), found: found.into(), help: help.into() }
    }

    fn advance(&mut self, to: usize) -> &'a [u8] {
        let passed = &self.bytes[self.at..to];
        self.line += passed.iter().filter(|&&b| b == b'\n').count() as u64;
        self.at = to;
        passed
    }

    pub fn skip_space(&mut self) {
        let rest = &self.bytes[self.at..];
        let space = rest.iter().take_while(|b| b.is_ascii_whitespace()).count();
        self.advance(self.at + space);
    }

    /// The rest of the line, without its end. The cursor moves behind it.
    pub fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|&b| b == b'\n').map_or(self.bytes.len(), |n| self.at + n + 1);
        self.advance(end).trim_ascii_end()
    }

    /// The next word, empty at the end of the file. The cursor moves behind it and stays on the
    /// same line.
    pub fn word(&mut self) -> &'a [u8] {
        self.skip_space();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
        self.advance(self.at + length)
    }

    /// Moves behind the next occurrence of these bytes. Returns false when there is none.
    pub fn skip_past(&mut self, pattern: &[u8]) -> bool {
        let rest = &self.bytes[self.at..];
        match rest.windows(pattern.len()).position(|w| w == pattern) {
            Some(n) => {
                self.advance(self.at + n + pattern.len());
                true
            }
            None => false,
        }
    }

    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N], MshError> {
        match self.bytes[self.at..].first_chunk::<N>() {
            Some(chunk) => {
                self.at += N;
                Ok(match self.encoding {
                    Encoding::Big => std::array::from_fn(|i| chunk[N - 1 - i]),
                    _ => *chunk,
                })
            }
            None => Err(self.error(
                format!("the file ends where {what} should be"),
                format!("expected {N} bytes: is the file cut short?"),
            )),
        }
    }

    fn parse<T: std::str::FromStr>(&mut self, what: &str, kind: &str) -> Result<T, MshError> {
        let word = self.word();
        std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).ok_or_else(|| match word {
            b"" => self.error(
                format!("the file ends where {what} should be"),
                format!("expected {kind}: is the file cut short?"),
            ),
            _ => self.error(format!("{} where {what} should be", shown(word)), format!("expected {kind}")),
        })
    }

    /// A whole number. It has four bytes in binary data.
    pub fn int(&mut self, what: &str) -> Result<i32, MshError> {
        match self.encoding {
            Encoding::Ascii => self.parse(what, "a whole number"),
            _ => Ok(i32::from_le_bytes(self.take(what)?)),
        }
    }

    /// A count or an id. It has eight bytes in binary data.
    pub fn size(&mut self, what: &str) -> Result<u64, MshError> {
        match self.encoding {
            Encoding::Ascii => self.parse(what, "a whole number that is not negative"),
            _ => Ok(u64::from_le_bytes(self.take(what)?)),
        }
    }

    /// A floating-point number. It has eight bytes in binary data.
    pub fn double(&mut self, what: &str) -> Result<f64, MshError> {
        match self.encoding {
            Encoding::Ascii => self.parse(what, "a decimal number such as -1.5e-3"),
            _ => Ok(f64::from_le_bytes(self.take(what)?)),
        }
    }

    /// Three floating-point numbers.
    pub fn point(&mut self) -> Result<DVec3, MshError> {
        Ok(DVec3::new(self.double("x")?, self.double("y")?, self.double("z")?))
    }
}
