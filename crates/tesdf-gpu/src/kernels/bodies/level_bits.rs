//! One bit for each level of the forest, along the path of a walk.
use cubecl::prelude::*;

/// Levels of the forest: those of the deepest cell, as in `tesdf::domain::MAX_DEPTH`, and the level
/// of the roots.
pub const LEVELS: usize = tesdf::domain::MAX_DEPTH as usize + 1;
/// Words for the bits.
pub const WORDS: usize = LEVELS.div_ceil(32);

/// One bit for each level.
#[derive(CubeType)]
pub struct Bits {
    words: Array<u32>,
}

#[cube]
pub fn no_bits() -> Bits {
    Bits { words: Array::<u32>::new(WORDS) }
}

#[cube]
impl Bits {
    pub fn clear(&mut self) {
        self.words[0] = 0u32;
        self.words[1] = 0u32;
        self.words[2] = 0u32;
    }

    pub fn get(&self, level: u32) -> bool {
        (self.words[(level / 32u32) as usize] >> (level % 32u32)) & 1u32 == 1u32
    }

    pub fn set(&mut self, level: u32, value: bool) {
        let mask = 1u32 << (level % 32u32);
        let at = (level / 32u32) as usize;
        let cleared = self.words[at] & !mask;
        self.words[at] = select(value, cleared | mask, cleared);
    }

    pub fn word(&self, #[comptime] at: usize) -> u32 {
        self.words[at]
    }

    pub fn set_word(&mut self, #[comptime] at: usize, word: u32) {
        self.words[at] = word;
    }

    /// One more than the lowest level whose bit is set; 0 when no bit is set.
    pub fn first(&self) -> u32 {
        let (low, middle, high) = (self.words[0], self.words[1], self.words[2]);
        let of_low = 32u32 - (low & (!low + 1u32)).leading_zeros();
        let of_middle = 64u32 - (middle & (!middle + 1u32)).leading_zeros();
        let of_high = 96u32 - (high & (!high + 1u32)).leading_zeros();
        let of_rest = select(high > 0u32, of_high, 0u32);
        select(low > 0u32, of_low, select(middle > 0u32, of_middle, of_rest))
    }

    /// One more than the highest level whose bit is set; 0 when no bit is set.
    pub fn last(&self) -> u32 {
        let (low, middle, high) = (self.words[0], self.words[1], self.words[2]);
        let of_low = 32u32 - low.leading_zeros();
        let of_middle = 64u32 - middle.leading_zeros();
        let of_high = 96u32 - high.leading_zeros();
        select(high > 0u32, of_high, select(middle > 0u32, of_middle, of_low))
    }
}
