//! Reads the data of a PLY file as rows of numbers.
use super::super::text::{Lines, malformed, number, shown};
use super::header::{Element, Encoding, Scalar};
use super::{PLY, Place, ReadError};

/// Returns the values one after the other. All scalar types are exact in f64.
pub(super) struct Rows<'a> {
    source: Source<'a>,
    /// The current row, for messages.
    element: String,
    row: u64,
    count: u64,
}

enum Source<'a> {
    Ascii {
        lines: Lines<'a>,
        /// The rest of the current line.
        line: &'a [u8],
    },
    Binary {
        bytes: &'a [u8],
        at: usize,
        big_endian: bool,
    },
}

impl<'a> Rows<'a> {
    pub fn new(bytes: &'a [u8], at: usize, encoding: Encoding, header_lines: u64) -> Self {
        let source = match encoding {
            Encoding::Ascii => Source::Ascii { lines: Lines::after(&bytes[at..], header_lines), line: b"" },
            _ => Source::Binary { bytes, at, big_endian: encoding == Encoding::Big },
        };
        Self { source, element: String::new(), row: 0, count: 0 }
    }

    /// Begins a row and returns its line or byte.
    pub fn begin(&mut self, element: &Element, row: u64) -> Result<u64, ReadError> {
        if row == 0 {
            self.element = String::from_utf8_lossy(&element.name).into_owned();
            self.count = element.count;
        }
        self.row = row;
        match &mut self.source {
            Source::Binary { at, .. } => Ok(*at as u64),
            Source::Ascii { lines, line } => match lines.find(|(_, text)| !text.trim_ascii().is_empty()) {
                Some((number, text)) => {
                    *line = text;
                    Ok(number)
                }
                None => Err(self.cut_short()),
            },
        }
    }

    pub fn value(&mut self, ty: Scalar) -> Result<f64, ReadError> {
        match &mut self.source {
            Source::Ascii { lines, line } => {
                let text = line.trim_ascii_start();
                let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
                let (word, rest) = text.split_at(end);
                *line = rest;
                let at = lines.number();
                if word.is_empty() { Err(self.cut_short()) } else { number(word, PLY, at) }
            }
            Source::Binary { bytes, at, big_endian } => {
                let big = *big_endian;
                let rest = &bytes[*at..];
                let value = match ty {
                    Scalar::I8 => take(rest, big, i8::from_le_bytes).map(|(v, n)| (f64::from(v), n)),
                    Scalar::U8 => take(rest, big, u8::from_le_bytes).map(|(v, n)| (f64::from(v), n)),
                    Scalar::I16 => take(rest, big, i16::from_le_bytes).map(|(v, n)| (f64::from(v), n)),
                    Scalar::U16 => take(rest, big, u16::from_le_bytes).map(|(v, n)| (f64::from(v), n)),
                    Scalar::I32 => take(rest, big, i32::from_le_bytes).map(|(v, n)| (f64::from(v), n)),
                    Scalar::U32 => take(rest, big, u32::from_le_bytes).map(|(v, n)| (f64::from(v), n)),
                    Scalar::F32 => take(rest, big, f32::from_le_bytes).map(|(v, n)| (f64::from(v), n)),
                    Scalar::F64 => take(rest, big, f64::from_le_bytes),
                };
                match value {
                    Some((value, size)) => {
                        *at += size;
                        Ok(value)
                    }
                    None => Err(self.cut_short()),
                }
            }
        }
    }

    /// The number of items of a list.
    pub fn list_size(&mut self, ty: Scalar) -> Result<u64, ReadError> {
        let value = self.value(ty)?;
        super::vertex_index(value).ok_or_else(|| {
            self.malformed(format!("a list of {value} items"), "expected a whole number from 0")
        })
    }

    /// Ends a row. A text row must have been read completely.
    pub fn end(&self) -> Result<(), ReadError> {
        match &self.source {
            Source::Ascii { line, .. } if !line.trim_ascii().is_empty() => Err(self.malformed(
                format!(
                    "{} row {} (0-based) goes on with {}",
                    self.element,
                    self.row,
                    shown(line.trim_ascii())
                ),
                "expected the end of the line: do the properties in the header fit the data?",
            )),
            _ => Ok(()),
        }
    }

    /// Checks that only white space and zero bytes follow.
    pub fn finish(mut self) -> Result<(), ReadError> {
        const HELP: &str = "expected the end of the file: are the counts in the header right?";
        let is_padding = |b: &u8| b.is_ascii_whitespace() || *b == 0;
        match &mut self.source {
            Source::Ascii { lines, .. } => match lines.find(|(_, text)| !text.iter().all(is_padding)) {
                None => Ok(()),
                Some((n, text)) => {
                    Err(malformed(PLY, n, format!("{} after the last row", shown(text)), HELP))
                }
            },
            Source::Binary { bytes, at, .. } if bytes[*at..].iter().all(is_padding) => Ok(()),
            Source::Binary { bytes, at, .. } => {
                let found = format!("{} bytes after the last row", bytes.len() - *at);
                Err(self.malformed(found, HELP))
            }
        }
    }

    pub fn malformed(&self, found: String, help: &str) -> ReadError {
        let place = match &self.source {
            Source::Ascii { lines, .. } => Place::Line(lines.number()),
            Source::Binary { at, .. } => Place::Byte(*at as u64),
        };
        ReadError::Malformed { format: PLY, place, found, help: help.into() }
    }

    fn cut_short(&self) -> ReadError {
        let end = match &self.source {
            Source::Ascii { .. } => "the line or file ends".to_owned(),
            Source::Binary { bytes, .. } => format!("the file ends at byte {}", bytes.len()),
        };
        let found = format!("{end} in {} {} (0-based) of {}", self.element, self.row, self.count);
        self.malformed(found, "expected more data: is the file cut short, or a count in its header wrong?")
    }
}

/// The first value of `bytes`, and its size in bytes.
fn take<const N: usize, T>(bytes: &[u8], big_endian: bool, from_le: fn([u8; N]) -> T) -> Option<(T, usize)> {
    let mut value: [u8; N] = bytes.get(..N)?.try_into().ok()?;
    if big_endian {
        value.reverse();
    }
    Some((from_le(value), N))
}
