//! Reads the numbers of the arrays of a VTU file, in all encodings.
use std::str::FromStr;

use roxmltree::Node;

use super::bytes::{Block, Budget, Bytes};
use super::{Appended, Result, at, child};
use crate::mesh::text::{shown, words};

/// The numbers of an array.
pub(super) enum Values {
    Float(Vec<f64>),
    Whole(Vec<i64>),
}

/// The data that all arrays of a file share.
pub(super) struct Arrays<'a> {
    appended: Option<(Appended<'a>, Encoding)>,
    block: Block,
    budget: Budget,
}

#[derive(Clone, Copy)]
enum Encoding {
    Base64,
    Raw,
}

impl<'a> Arrays<'a> {
    /// `file` is the number of bytes of the file.
    pub fn new(root: &Node<'_, '_>, appended: Option<Appended<'a>>, file: usize) -> Result<Self> {
        let big_endian = match root.attribute("byte_order") {
            None | Some("LittleEndian") => false,
            Some("BigEndian") => true,
            Some(other) => {
                let found = format!("byte_order {}", shown(other.as_bytes()));
                return Err(at(root, found, "expected LittleEndian or BigEndian"));
            }
        };
        let word = match root.attribute("header_type") {
            None | Some("UInt32") => 4,
            Some("UInt64") => 8,
            Some(other) => {
                let found = format!("header_type {}", shown(other.as_bytes()));
                return Err(at(root, found, "expected UInt32 or UInt64"));
            }
        };
        let zlib = match root.attribute("compressor") {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                let help = "expected vtkZLibDataCompressor: save with zlib, or not compressed";
                return Err(at(root, format!("the compressor {}", shown(other.as_bytes())), help));
            }
        };
        let appended = match appended {
            None => None,
            Some(data) => {
                let tag = child(root, "AppendedData")?;
                match tag.attribute("encoding") {
                    Some("raw") => Some((data, Encoding::Raw)),
                    None | Some("base64") => Some((data, Encoding::Base64)),
                    Some(other) => {
                        let found = format!("encoding {}", shown(other.as_bytes()));
                        return Err(at(&tag, found, "expected raw or base64"));
                    }
                }
            }
        };
        Ok(Self { appended, block: Block { big_endian, word, zlib }, budget: Budget::new(file) })
    }

    pub fn read(&self, array: &Node<'_, '_>) -> Result<Values> {
        let kind = array.attribute("type").unwrap_or_default();
        let bytes = match array.attribute("format") {
            Some("ascii") => return ascii(array, kind),
            Some("binary") => {
                let text = text_of(array);
                let error = |found: String, help: &str| at(array, found, help);
                self.block.read(Bytes::base64(text.as_bytes()), &self.budget, error)?
            }
            Some("appended") => {
                let Some((data, encoding)) = self.appended else {
                    return Err(at(
                        array,
                        "an appended array, but no AppendedData",
                        "is the file cut short?",
                    ));
                };
                let offset = array.attribute("offset").unwrap_or_default();
                let place = offset.trim().parse().ok().and_then(|n: usize| Some((n, data.bytes.get(n..)?)));
                let Some((offset, rest)) = place else {
                    let found = format!("offset is {}", shown(offset.as_bytes()));
                    let help = format!("expected at most {}: is the file cut short?", data.bytes.len());
                    return Err(at(array, found, help));
                };
                let start = data.start + offset;
                let bytes = match encoding {
                    Encoding::Raw => Bytes::Raw(rest),
                    Encoding::Base64 => Bytes::base64(rest),
                };
                let error = |found: String, help: &str| at(array, format!("at byte {start}: {found}"), help);
                self.block.read(bytes, &self.budget, error)?
            }
            other => {
                let found = format!("the format {}", shown(other.unwrap_or_default().as_bytes()));
                return Err(at(array, found, "expected ascii, binary or appended"));
            }
        };
        self.numbers(array, kind, bytes)
    }

    fn numbers(&self, array: &Node<'_, '_>, kind: &str, bytes: Vec<u8>) -> Result<Values> {
        let big = self.block.big_endian;
        macro_rules! numbers {
            ($t:ty as $wide:ty) => {{
                const N: usize = size_of::<$t>();
                let (chunks, left) = bytes.as_chunks::<N>();
                if !left.is_empty() {
                    let found = format!("{} bytes of {kind}", bytes.len());
                    return Err(at(array, found, format!("expected a multiple of {N}")));
                }
                let mut numbers = Vec::<$wide>::new();
                if numbers.try_reserve_exact(chunks.len()).is_err() {
                    let found = format!("no memory is left for {} numbers", chunks.len());
                    return Err(at(array, found, "free memory, or read the file where there is more"));
                }
                numbers.extend(chunks.iter().map(|&chunk: &[u8; N]| {
                    <$wide>::from(if big { <$t>::from_be_bytes(chunk) } else { <$t>::from_le_bytes(chunk) })
                }));
                numbers
            }};
        }
        Ok(match kind {
            "Float32" => Values::Float(numbers!(f32 as f64)),
            "Float64" => Values::Float(numbers!(f64 as f64)),
            "Int8" => Values::Whole(numbers!(i8 as i64)),
            "UInt8" => Values::Whole(numbers!(u8 as i64)),
            "Int16" => Values::Whole(numbers!(i16 as i64)),
            "UInt16" => Values::Whole(numbers!(u16 as i64)),
            "Int32" => Values::Whole(numbers!(i32 as i64)),
            "UInt32" => Values::Whole(numbers!(u32 as i64)),
            // Ids beyond 63 bits become negative, and negative ids are refused.
            "Int64" | "UInt64" => Values::Whole(numbers!(i64 as i64)),
            _ => return Err(unknown(array, kind)),
        })
    }
}

fn unknown(array: &Node<'_, '_>, kind: &str) -> super::ReadTetrahedraError {
    at(
        array,
        format!("the type {}", shown(kind.as_bytes())),
        "expected Float32, Float64, or a type such as Int32",
    )
}

/// The text of an array, without the text of elements in it, where VTK puts ranges.
fn text_of(array: &Node<'_, '_>) -> String {
    array.children().filter(Node::is_text).filter_map(|n| n.text()).collect()
}

fn ascii(array: &Node<'_, '_>, kind: &str) -> Result<Values> {
    let text = text_of(array);
    if kind.starts_with("Float") {
        Ok(Values::Float(parse(array, &text)?))
    } else if kind.starts_with("Int") || kind.starts_with("UInt") {
        Ok(Values::Whole(parse(array, &text)?))
    } else {
        Err(unknown(array, kind))
    }
}

fn parse<T: FromStr>(array: &Node<'_, '_>, text: &str) -> Result<Vec<T>> {
    let number = |word: &[u8]| {
        let parsed = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        parsed.ok_or_else(|| {
            let name = array.attribute("Name").unwrap_or("Points");
            let found = format!("{} in the array {}", shown(word), shown(name.as_bytes()));
            at(array, found, "expected numbers of its type")
        })
    };
    words(text.as_bytes()).map(number).collect()
}
