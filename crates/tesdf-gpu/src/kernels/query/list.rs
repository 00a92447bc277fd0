//! The faces that a cell lists. [`tesdf::asset::layout::List`] defines the bytes.
use cubecl::prelude::*;
use tesdf::asset::layout;

use crate::kernels::scene::shape::{
    Field, FieldExpand, LISTS, NONE, PALETTE_STARTS, PALETTES, PALETTES_HIGH,
};

/// A list from which faces can be read.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct List {
    /// Number of faces.
    pub count: u32,
    /// First word of the bytes of the lists.
    lists: u32,
    /// Byte of the first palette slot, or of the first face.
    first: u32,
    /// Start of the palette among the palette faces; [`NONE`] when the list stores faces directly.
    palette: u32,
}

const NO_PALETTE: u32 = layout::NO_PALETTE as u32;
const PALETTE_BYTES: u32 = layout::PALETTE_BYTES;
const SLOTS: u32 = layout::SLOTS;
const LISTED_FACES: u32 = layout::LISTED_FACES;
const FACE_BYTES: u32 = layout::FACE_BYTES;

#[cube]
impl Field<'_> {
    /// Reads the header of the list at a byte.
    pub fn list(self, offset: u32) -> List {
        let lists = self.entry(LISTS);
        let number = self.half(lists, offset);
        let mut count = self.byte(lists, offset + PALETTE_BYTES);
        let mut first = offset + SLOTS;
        let mut palette = NONE.runtime();
        if number == NO_PALETTE {
            count |= (self.byte(lists, offset + comptime!(PALETTE_BYTES + 1)) << 8u32)
                | (self.half(lists, offset + comptime!(PALETTE_BYTES + 2)) << 16u32);
            first = offset + LISTED_FACES;
        } else {
            palette = self.word(self.entry(PALETTE_STARTS) + number);
        }
        List { count, lists, first, palette }
    }

    /// Index of the `i`-th face of a list.
    pub fn listed(self, list: List, i: u32) -> u32 {
        let mut face = 0u32;
        if list.palette == NONE {
            let at = list.first + FACE_BYTES * i;
            face = self.half(list.lists, at) | (self.half(list.lists, at + 2u32) << 16u32);
        } else {
            let at = list.palette + self.byte(list.lists, list.first + i);
            let low = self.word(self.entry(PALETTES) + at / 2u32);
            face = (low >> (16u32 * (at % 2u32))) & 65535u32;
            let high = self.entry(PALETTES_HIGH);
            if high != NONE {
                face |= self.byte(high, at) << 16u32;
            }
        }
        face
    }
}
