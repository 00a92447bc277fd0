//! The faces that a cell lists: [`tesdf::asset::layout::List`].
use cubecl::prelude::*;

use super::assets::{Assets, LISTS, NONE, PALETTE_STARTS, PALETTES, PALETTES_HIGH, byte, entry, half};

/// A list, ready to read faces from.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct List {
    /// Number of faces.
    pub count: u32,
    /// Word where the bytes of the lists begin.
    lists: u32,
    /// Byte of the first slot or face.
    first: u32,
    /// Where the palette begins among the palette faces; [`NONE`] when faces are written out.
    palette: u32,
}

const NO_PALETTE: u32 = 0xFFFF;

/// The list at a byte.
#[cube]
pub fn list(assets: &Assets, shape: u32, offset: u32) -> List {
    let lists = entry(assets, shape, LISTS);
    let number = half(&assets.words, lists, offset);
    let mut count = byte(&assets.words, lists, offset + 2u32);
    let mut first = offset + 3u32;
    let mut palette = NONE.runtime();
    if number == NO_PALETTE {
        count |= (byte(&assets.words, lists, offset + 3u32) << 8u32)
            | (half(&assets.words, lists, offset + 4u32) << 16u32);
        first = offset + 6u32;
    } else {
        palette = assets.words[(entry(assets, shape, PALETTE_STARTS) + number) as usize];
    }
    List { count, lists, first, palette }
}

/// Position of face `i` of a list.
#[cube]
pub fn list_face(assets: &Assets, shape: u32, list: List, i: u32) -> u32 {
    let mut face = 0u32;
    if list.palette == NONE {
        let at = list.first + 4u32 * i;
        face = half(&assets.words, list.lists, at) | (half(&assets.words, list.lists, at + 2u32) << 16u32);
    } else {
        let at = list.palette + byte(&assets.words, list.lists, list.first + i);
        let low = assets.words[(entry(assets, shape, PALETTES) + at / 2u32) as usize];
        face = (low >> (16u32 * (at % 2u32))) & 65535u32;
        let high = entry(assets, shape, PALETTES_HIGH);
        if high != NONE {
            face |= byte(&assets.words, high, at) << 16u32;
        }
    }
    face
}
