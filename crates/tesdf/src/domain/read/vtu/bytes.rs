//! Reads the bytes of an array: base64 or raw, with a header of sizes, compressed or not.
use std::cell::Cell;
use std::io::Read;

use base64::{Engine, prelude::BASE64_STANDARD};
use flate2::read::ZlibDecoder;

use super::Result;
use crate::domain::read::ReadTetrahedraError;

/// The source of the bytes.
pub(super) enum Bytes<'a> {
    Raw(&'a [u8]),
    /// Base64, in parts. A new part begins after padding, because VTK encodes sizes and data
    /// separately.
    Base64 {
        text: &'a [u8],
        decoded: Vec<u8>,
    },
}

impl<'a> Bytes<'a> {
    pub fn base64(text: &'a [u8]) -> Self {
        Self::Base64 { text, decoded: Vec::new() }
    }

    /// The next `count` bytes. `None` when there are not as many, or when they are not base64.
    fn take(&mut self, count: usize) -> Option<Vec<u8>> {
        match self {
            Self::Raw(rest) => {
                let (taken, left) = rest.split_at_checked(count)?;
                *rest = left;
                Some(taken.to_vec())
            }
            Self::Base64 { text, decoded } => {
                while decoded.len() < count {
                    let part = next_part(text, count - decoded.len())?;
                    decoded.extend(BASE64_STANDARD.decode(part).ok()?);
                }
                let left = decoded.split_off(count);
                Some(std::mem::replace(decoded, left))
            }
        }
    }
}

/// Takes characters that encode at least `count` bytes, or fewer up to padding or the end. It takes
/// whole groups of four.
fn next_part(text: &mut &[u8], count: usize) -> Option<Vec<u8>> {
    let wanted = count.div_ceil(3).checked_mul(4)?;
    let mut part = Vec::new();
    while let [first, rest @ ..] = *text {
        if part.len() % 4 == 0 && (part.len() >= wanted || part.last() == Some(&b'=')) {
            break;
        }
        *text = rest;
        if !first.is_ascii_whitespace() {
            part.push(*first);
        }
    }
    (!part.is_empty()).then_some(part)
}

/// How the file stores arrays in bytes.
#[derive(Clone, Copy)]
pub(super) struct Block {
    pub big_endian: bool,
    /// Number of bytes of a size: 4 or 8.
    pub word: usize,
    pub zlib: bool,
}

const CUT: &str = "is the file cut short?";

/// A limit on the memory of all arrays of a file together.
///
/// Zlib packs at most 1032 bytes to one, so a file of 2 MB can give 2 GB. Several arrays can also
/// name the same appended bytes. Numbers of meshes are packed at most 20 to 1.
#[derive(Debug)]
pub(super) struct Budget {
    /// Number of bytes of the file.
    file: u64,
    /// Number of bytes taken from the file so far, and number of bytes that they gave.
    taken: Cell<[u64; 2]>,
}

/// The arrays may give this many bytes, however they are packed.
const SMALL: u64 = 1 << 28;
/// Beyond that, the number of bytes that arrays may give for each byte of the file that they take.
const RATIO: u64 = 100;
/// How many times arrays may take all bytes of the file.
const TIMES: u64 = 4;

impl Budget {
    /// The limit for a file with this number of bytes.
    pub fn new(file: usize) -> Self {
        Self { file: file as u64, taken: Cell::new([0; 2]) }
    }

    /// Takes `packed` bytes of the file, which give `unpacked` bytes. An error says which limit is
    /// exceeded.
    fn spend(&self, packed: usize, unpacked: usize) -> std::result::Result<(), String> {
        let [all, given] = self.taken.get();
        let (all, given) = (all.saturating_add(packed as u64), given.saturating_add(unpacked as u64));
        self.taken.set([all, given]);
        if all > TIMES * self.file {
            return Err(format!("the arrays up to here take {all} bytes of a file of {}", self.file));
        }
        if given > SMALL.max(RATIO * all) {
            return Err(format!("the arrays up to here unpack from {all} to {given} bytes"));
        }
        Ok(())
    }
}

impl Block {
    /// The bytes of an array. `error` makes an error of what was found and of a hint.
    pub fn read(
        &self,
        mut bytes: Bytes<'_>,
        budget: &Budget,
        error: impl Fn(String, &str) -> ReadTetrahedraError,
    ) -> Result<Vec<u8>> {
        let spend = |packed: usize, unpacked: usize| {
            budget.spend(packed, unpacked).map_err(|found| {
                error(found, "expected at most 100 times as many, each byte used once: is the file damaged?")
            })
        };
        let size = |bytes: &mut Bytes<'_>| -> Result<usize> {
            let word = bytes
                .take(self.word)
                .ok_or_else(|| error("the size of an array is not there".into(), CUT))?;
            let value = word.iter().enumerate().fold(0u64, |value, (i, &b)| {
                let place = if self.big_endian { self.word - 1 - i } else { i };
                value | u64::from(b) << (8 * place)
            });
            usize::try_from(value).map_err(|_| error(format!("an array of {value} bytes"), CUT))
        };
        let take = |bytes: &mut Bytes<'_>, count: usize| {
            bytes
                .take(count)
                .ok_or_else(|| error(format!("an array of {count} bytes, but not so many are there"), CUT))
        };
        let first = size(&mut bytes)?;
        if !self.zlib {
            let array = take(&mut bytes, first)?;
            return spend(first, first).map(|()| array);
        }
        let (whole, last) = (size(&mut bytes)?, size(&mut bytes)?);
        let mut sizes = Vec::new();
        for _ in 0..first {
            sizes.push(size(&mut bytes)?);
        }
        let mut out = Vec::new();
        for (block, &compressed) in sizes.iter().enumerate() {
            let expected = if block + 1 == first && last != 0 { last } else { whole };
            let before = out.len();
            let packed = take(&mut bytes, compressed)?;
            spend(compressed, expected)?;
            // One byte more than expected shows that there are too many. No further bytes are
            // unpacked.
            let mut unpacked = ZlibDecoder::new(packed.as_slice()).take((expected as u64).saturating_add(1));
            unpacked
                .read_to_end(&mut out)
                .map_err(|e| error(format!("block {block} does not unpack: {e}"), CUT))?;
            if out.len() - before != expected {
                let found = format!("block {block} unpacks to {} bytes", out.len() - before);
                return Err(error(found, "expected as many as the header says: is the file damaged?"));
            }
        }
        Ok(out)
    }
}
