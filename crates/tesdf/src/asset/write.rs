//! Writing of `.tesdf` files, and the checksums of their bytes.
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use super::container::{Placed, shape_of};
use super::error::shown;
use super::header::{
    BEFORE_CHECKSUM, DIGITS, LENGTH_FIELD, MAGIC, MAX_HEADER, RULE, SECTION_CHECKSUM, Shape,
};
use super::{AssetError, Container, FORMAT_VERSION, FORMAT_VERSION_OF_RULES, Section, TeSdf};

pub use crate::save::save_atomic;

impl TeSdf {
    /// Writes the file, with the current vertices and lists. A file at `path` is replaced
    /// atomically.
    ///
    /// # Errors
    /// The same as for [`save_atomic`]. No half file is left.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), AssetError> {
        Ok(save_atomic(path, &self.to_bytes()?)?)
    }

    /// The whole file, with the current vertices and lists. It does not say which lists are stale.
    ///
    /// # Errors
    /// The same as for [`write_container`].
    pub fn to_bytes(&self) -> Result<Cow<'_, [u8]>, AssetError> {
        if self.motion.is_none() {
            return Ok(Cow::Borrowed(self.as_bytes()));
        }
        let sections: Vec<Section> = self.sections().collect();
        Ok(Cow::Owned(write_container(&sections, &self.about().to_metadata())?))
    }

    /// Compares every byte with the checksums.
    ///
    /// # Errors
    /// Names the header or the first damaged section.
    pub fn verify_checksums(&self) -> Result<(), AssetError> {
        self.container().verify_checksums()
    }
}

impl Container {
    /// Reads every byte of the file and compares it with the checksums.
    ///
    /// # Errors
    /// [`AssetError::Checksum`] names the header or the first damaged section.
    pub fn verify_checksums(&self) -> Result<(), AssetError> {
        let bytes = self.as_bytes();
        let compare = |part: String, found: String, expected: &[u8]| {
            if found.as_bytes() == expected {
                return Ok(());
            }
            let expected = shown(&String::from_utf8_lossy(expected));
            Err(AssetError::Checksum { part, found, expected })
        };
        let found = header_checksum(&bytes[..self.header_size()], self.digits);
        compare("header".into(), found, &bytes[self.digits..self.digits + DIGITS])?;
        for Placed { spec, range, checksum } in &self.sections {
            let found = blake3::hash(&bytes[range.clone()]).to_hex().to_string();
            compare(format!("section {}", spec.name), found, checksum.as_bytes())?;
        }
        Ok(())
    }
}

/// Writes sections and metadata as the bytes of a `.tesdf` file. The same input gives the same
/// bytes.
///
/// `metadata` has the keys of the caller. This function adds `format`, `version`, `checksum` and
/// `checksum.*`. The version is that of rules ([`FORMAT_VERSION_OF_RULES`]) when there is the key
/// `inside`.
///
/// # Errors
/// A section is given twice or does not have whole rows, a metadata key is reserved, or the header
/// has more than 1 MiB.
pub fn write_container(
    sections: &[Section<'_>],
    metadata: &BTreeMap<String, String>,
) -> Result<Vec<u8>, AssetError> {
    if let Some(key) = metadata.keys().find(|key| is_reserved(key)) {
        return Err(AssetError::header(format!("the metadata key {key} is reserved; use another")));
    }
    // The widest elements come first. safetensors forbids gaps, and only this order keeps every
    // section aligned.
    let mut ordered: Vec<_> = sections.iter().collect();
    ordered.sort_by_key(|s| std::cmp::Reverse(s.spec.element.size()));
    let mut metadata = metadata.clone();
    let mut lines = Vec::with_capacity(ordered.len());
    let mut begin = 0;
    for Section { spec, bytes } in &ordered {
        let row = spec.row_size();
        if row == 0 || !bytes.len().is_multiple_of(row) {
            return Err(AssetError::section(
                spec.name,
                format!("{} bytes are not whole rows of {row} bytes", bytes.len()),
            ));
        }
        let digest = blake3::hash(bytes).to_hex().to_string();
        if metadata.insert(format!("{SECTION_CHECKSUM}{}", spec.name), digest).is_some() {
            return Err(AssetError::section(spec.name, "given twice"));
        }
        let end = begin + bytes.len() as u64;
        lines.push(Line {
            name: spec.name,
            dtype: spec.element.name(),
            shape: shape_of(spec, (bytes.len() / row) as u64),
            data_offsets: [begin, end],
        });
        begin = end;
    }
    let mut file = write_header(&metadata, &lines)?;
    file.reserve_exact(ordered.iter().map(|s| s.bytes.len()).sum());
    ordered.iter().for_each(|s| file.extend_from_slice(s.bytes));
    Ok(file)
}

/// One section, ready to be written into a header.
struct Line<'a> {
    name: &'a str,
    dtype: &'a str,
    shape: Shape,
    data_offsets: [u64; 2],
}

/// Whether a caller may use `key` for its own metadata.
fn is_reserved(key: &str) -> bool {
    matches!(key, "format" | "version" | "checksum") || key.starts_with(SECTION_CHECKSUM)
}

/// Makes the length field, the JSON and the padding, with the checksum of the header in place.
fn write_header(metadata: &BTreeMap<String, String>, lines: &[Line<'_>]) -> Result<Vec<u8>, AssetError> {
    let quoted = |s: &str| serde_json::Value::from(s).to_string();
    let version = if metadata.contains_key(RULE) { FORMAT_VERSION_OF_RULES } else { FORMAT_VERSION };
    let mut json = format!("{MAGIC}{version}{BEFORE_CHECKSUM}{}\"", "0".repeat(DIGITS));
    for (key, value) in metadata {
        json += &format!(",{}:{}", quoted(key), quoted(value));
    }
    json.push('}');
    for Line { name, dtype, shape, data_offsets: [begin, end] } in lines {
        json += &format!(
            ",{}:{{\"dtype\":\"{dtype}\",\"shape\":{shape},\"data_offsets\":[{begin},{end}]}}",
            quoted(name)
        );
    }
    json.push('}');
    while !json.len().is_multiple_of(LENGTH_FIELD) {
        json.push(' ');
    }
    if json.len() > MAX_HEADER {
        return Err(AssetError::header(format!(
            "{} bytes of JSON are more than the {MAX_HEADER} allowed; shorten the metadata",
            json.len()
        )));
    }
    let mut bytes = (json.len() as u64).to_le_bytes().to_vec();
    bytes.extend_from_slice(json.as_bytes());
    let at = LENGTH_FIELD + MAGIC.len() + version.to_string().len() + BEFORE_CHECKSUM.len();
    let digest = header_checksum(&bytes, at);
    bytes[at..at + DIGITS].copy_from_slice(digest.as_bytes());
    Ok(bytes)
}

/// BLAKE3 of the header with the `DIGITS` bytes at `at` set to `0`, in hex.
fn header_checksum(header: &[u8], at: usize) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&header[..at]);
    hasher.update("0".repeat(DIGITS).as_bytes());
    hasher.update(&header[at + DIGITS..]);
    hasher.finalize().to_hex().to_string()
}
