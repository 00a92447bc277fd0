use std::io::Write;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;

use crate::PlaybackError;

/// Arrays of 32-bit words, so that they deflate well: the differences of successive words, first
/// the lowest bytes of all of them, then the next ones. Of a smooth motion, the upper bytes are 0.
#[derive(Default)]
pub struct Numbers(Vec<u8>);

impl Numbers {
    /// Appends an array.
    pub fn push(&mut self, words: impl Iterator<Item = u32>) {
        let mut before = 0u32;
        let differences: Vec<u32> =
            words.map(|word| word.wrapping_sub(std::mem::replace(&mut before, word))).collect();
        for byte in 0..4 {
            self.0.extend(differences.iter().map(|word| word.to_le_bytes()[byte]));
        }
    }

    /// Appends an array of floats, bit for bit.
    pub fn push_floats(&mut self, numbers: impl Iterator<Item = f32>) {
        self.push(numbers.map(f32::to_bits));
    }

    /// The arrays, deflated in the format of zlib, in base64.
    pub fn to_text(&self) -> Result<String, PlaybackError> {
        let mut deflated = ZlibEncoder::new(Vec::new(), Compression::best());
        let deflated = deflated.write_all(&self.0).and_then(|()| deflated.finish());
        Ok(BASE64_STANDARD.encode(deflated.map_err(|e| PlaybackError::Encode(e.to_string()))?))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::ZlibDecoder;

    use super::*;

    #[test]
    fn words_come_back_from_their_differences() {
        let arrays: [&[u32]; 3] = [&[7, 3, u32::MAX, 0, 0x8000_0000], &[], &[1.5f32.to_bits()]];
        let mut numbers = Numbers::default();
        arrays.iter().for_each(|words| numbers.push(words.iter().copied()));
        let deflated = BASE64_STANDARD.decode(numbers.to_text().unwrap()).unwrap();
        let mut bytes = Vec::new();
        ZlibDecoder::new(&*deflated).read_to_end(&mut bytes).unwrap();
        let mut rest = &*bytes;
        for words in arrays {
            let (own, after) = rest.split_at(4 * words.len());
            let mut word = 0u32;
            for (k, expected) in words.iter().enumerate() {
                let bytes = [0, 1, 2, 3].map(|byte| own[byte * words.len() + k]);
                word = word.wrapping_add(u32::from_le_bytes(bytes));
                assert_eq!(word, *expected);
            }
            rest = after;
        }
        assert!(rest.is_empty());
    }
}
