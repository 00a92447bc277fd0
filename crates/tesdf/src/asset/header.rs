//! The JSON header.
//!
//! `docs/architecture.md` says why it is not written and read by the crate `safetensors`.
use std::collections::BTreeMap;
use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};

use super::error::shown;
use super::{AssetError, FORMAT_VERSION, FORMAT_VERSION_OF_RULES};

/// Number of bytes of the length field.
pub(super) const LENGTH_FIELD: usize = 8;
/// Largest size of a header. The header has only metadata, so a larger one is not ours. This bounds
/// what a reader parses.
pub(super) const MAX_HEADER: usize = 1 << 20;
const MAX_ENTRIES: usize = 1 << 10;
/// The start of every header. The version follows.
pub(super) const MAGIC: &str = r#"{"__metadata__":{"format":"tesdf","version":""#;
pub(super) const BEFORE_CHECKSUM: &str = r#"","checksum":""#;
pub(super) const DIGITS: usize = 64;
/// Metadata keys with this prefix hold the checksums of sections.
pub(super) const SECTION_CHECKSUM: &str = "checksum.";
/// The metadata key that says how the sign is told. Files of [`FORMAT_VERSION_OF_RULES`] have it,
/// other files do not.
pub(super) const RULE: &str = "inside";

/// A header as parsed. Only its syntax was checked.
pub(super) struct Header {
    pub metadata: BTreeMap<String, String>,
    pub entries: Vec<(String, Entry)>,
}

/// The entry of one section in the header.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Entry {
    pub dtype: String,
    pub shape: Shape,
    pub data_offsets: [u64; 2],
}

/// One or two dimensions.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Shape {
    pub rows: u64,
    pub columns: Option<u64>,
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.columns {
            None => write!(f, "[{}]", self.rows),
            Some(columns) => write!(f, "[{},{columns}]", self.rows),
        }
    }
}

/// The start of a file.
pub(super) struct Prefix {
    pub version: u32,
    /// The place of the checksum's digits.
    pub digits: usize,
    /// The end of the header.
    pub end: usize,
}

/// Checks magic and version.
pub(super) fn read_prefix(bytes: &[u8]) -> Result<Prefix, AssetError> {
    let after = bytes.get(LENGTH_FIELD..).unwrap_or_default();
    let seen = after.len().min(MAGIC.len());
    if after[..seen] != MAGIC.as_bytes()[..seen] || bytes.is_empty() {
        return Err(recognise(bytes));
    }
    let truncated =
        |expected: usize| AssetError::Truncated { found: bytes.len() as u64, expected: expected as u64 };
    let smallest = LENGTH_FIELD + MAGIC.len() + 1 + BEFORE_CHECKSUM.len() + DIGITS + "\"}}".len();
    if seen < MAGIC.len() {
        return Err(if bytes.len() < LENGTH_FIELD + 1 && !could_be_length(bytes) {
            recognise(bytes)
        } else {
            truncated(smallest)
        });
    }
    const LONGEST_VERSION: usize = 20;
    let version = &after[MAGIC.len()..];
    let end = version.iter().take(LONGEST_VERSION + 1).position(|&b| b == b'"');
    let Some(version) = end.and_then(|end| std::str::from_utf8(&version[..end]).ok()) else {
        return Err(if version.len() <= LONGEST_VERSION {
            truncated(smallest)
        } else {
            AssetError::header("the version is not a number of at most 20 digits")
        });
    };
    let known = [FORMAT_VERSION, FORMAT_VERSION_OF_RULES];
    let Some(number) = known.into_iter().find(|known| version == known.to_string()) else {
        return Err(AssetError::Version { found: shown(version) });
    };
    let mut field = [0; LENGTH_FIELD];
    field.copy_from_slice(&bytes[..LENGTH_FIELD]);
    let length = u64::from_le_bytes(field);
    if length > MAX_HEADER as u64 || length % LENGTH_FIELD as u64 != 0 {
        return Err(AssetError::header(format!(
            "its length field says {length} bytes; expected a multiple of {LENGTH_FIELD} of at most {MAX_HEADER}"
        )));
    }
    let end = LENGTH_FIELD + length as usize;
    if end > bytes.len() {
        return Err(truncated(end));
    }
    let at = LENGTH_FIELD + MAGIC.len() + version.len();
    let digits = at + BEFORE_CHECKSUM.len();
    if end < digits + DIGITS || &bytes[at..digits] != BEFORE_CHECKSUM.as_bytes() {
        return Err(AssetError::header(
            "the checksum does not follow the version; another tool rewrote the file, encode the mesh again",
        ));
    }
    Ok(Prefix { version: number, digits, end })
}

fn could_be_length(bytes: &[u8]) -> bool {
    // A header is shorter than 2^24 bytes, so all but three bytes of its length are 0.
    bytes.iter().skip(3).all(|&b| b == 0)
}

/// The error for bytes that do not start like a `.tesdf` file.
fn recognise(bytes: &[u8]) -> AssetError {
    const ENCODE: &str = "encode it first: tesdf encode MESH -o FILE.tesdf";
    const OTHER: &str = "give a file that tesdf encode wrote";
    let starts = |magic: &[u8]| bytes.starts_with(magic);
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let (found, next) = if bytes.is_empty() {
        ("an empty file", "encode the mesh again")
    } else if text.starts_with(b"solid") || is_binary_stl(bytes) {
        ("an STL mesh", ENCODE)
    } else if starts(b"ply\n") || starts(b"ply\r") {
        ("a PLY mesh", ENCODE)
    } else if starts(b"glTF") {
        ("a GLB mesh", ENCODE)
    } else if text.starts_with(b"OFF") {
        ("an OFF mesh", ENCODE)
    } else if [&b"v "[..], b"o ", b"g ", b"mtllib ", b"# "].iter().any(|m| text.starts_with(m)) {
        ("text, perhaps an OBJ mesh", ENCODE)
    } else if starts(b"PK\x03\x04") {
        ("a ZIP archive", "unpack it first")
    } else if starts(b"\x1f\x8b") {
        ("a gzip file", "unpack it first")
    } else if bytes.get(LENGTH_FIELD) == Some(&b'{') {
        ("a safetensors file of another kind, or one that another tool rewrote", OTHER)
    } else {
        ("an unknown kind of file", OTHER)
    };
    AssetError::NotTesdf { found, next }
}

fn is_binary_stl(bytes: &[u8]) -> bool {
    let Some(count) = bytes.get(80..84) else { return false };
    let count = count.iter().rev().fold(0_u64, |n, &b| n << 8 | u64::from(b));
    count > 0 && bytes.len() as u64 == 84 + 50 * count
}

/// Parses the JSON of a header. `bytes` does not include the length field.
pub(super) fn parse(bytes: &[u8]) -> Result<Header, AssetError> {
    serde_json::from_slice(bytes).map_err(|e| AssetError::header(format!("not the expected JSON: {e}")))
}

impl<'de> Deserialize<'de> for Header {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Fields;
        impl<'de> Visitor<'de> for Fields {
            type Value = Header;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object with __metadata__ and one entry per section")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Header, A::Error> {
                let mut header = Header { metadata: BTreeMap::new(), entries: Vec::new() };
                let mut metadata = None;
                while let Some(name) = map.next_key::<String>()? {
                    if name == "__metadata__" {
                        if metadata.replace(map.next_value::<Metadata>()?).is_some() {
                            return Err(Error::custom("two entries __metadata__"));
                        }
                    } else if header.entries.len() == MAX_ENTRIES {
                        return Err(Error::custom(format!("more than {MAX_ENTRIES} sections")));
                    } else {
                        let entry = map
                            .next_value()
                            .map_err(|e| Error::custom(format!("section {}: {e}", shown(&name))))?;
                        header.entries.push((name, entry));
                    }
                }
                header.metadata = metadata.unwrap_or_default().0;
                Ok(header)
            }
        }
        deserializer.deserialize_map(Fields)
    }
}

#[derive(Default)]
struct Metadata(BTreeMap<String, String>);

impl<'de> Deserialize<'de> for Metadata {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Pairs;
        impl<'de> Visitor<'de> for Pairs {
            type Value = Metadata;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object of strings")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Metadata, A::Error> {
                let mut pairs = BTreeMap::new();
                while let Some((key, value)) = map.next_entry::<String, String>()? {
                    if pairs.len() == MAX_ENTRIES {
                        return Err(Error::custom(format!("more than {MAX_ENTRIES} metadata keys")));
                    }
                    if pairs.contains_key(&key) {
                        return Err(Error::custom(format!("two metadata keys {}", shown(&key))));
                    }
                    pairs.insert(key, value);
                }
                Ok(Metadata(pairs))
            }
        }
        deserializer.deserialize_map(Pairs)
    }
}

impl<'de> Deserialize<'de> for Shape {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Dimensions;
        impl<'de> Visitor<'de> for Dimensions {
            type Value = Shape;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("one or two sizes")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Shape, A::Error> {
                let rows = seq.next_element()?.ok_or_else(|| Error::invalid_length(0, &self))?;
                let columns = seq.next_element()?;
                if seq.next_element::<u64>()?.is_some() {
                    return Err(Error::invalid_length(3, &self));
                }
                Ok(Shape { rows, columns })
            }
        }
        deserializer.deserialize_seq(Dimensions)
    }
}
