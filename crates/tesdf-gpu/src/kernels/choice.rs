//! The member of a pair with the greatest key; of equal ones that with the lowest name, so that the order of members does not matter.
use cubecl::prelude::*;

use super::assets::NONE;
use super::products::{CONTACT_ROWS, CONTACT_WORDS};

/// Threads that choose together.
pub const GROUP: u32 = 256;

/// 0 undecided, 1 the first is before, 2 after.
#[cube]
fn compare(order: u32, a: u32, b: u32) -> u32 {
    select(order == 0u32, select(a < b, 1u32, select(a > b, 2u32, 0u32)), order)
}

/// Whether the name of one contact is before that of the other of its pair: direction, face, cell, corner, bits of the point.
#[cube]
fn is_before(
    words: &[u32],
    rows: &[Vector<f32, Const<4>>],
    numbers: &[u32],
    member: u32,
    other: u32,
) -> bool {
    let (x, y) = (numbers[member as usize], numbers[other as usize]);
    let a = (x * comptime!(CONTACT_WORDS as u32)) as usize;
    let b = (y * comptime!(CONTACT_WORDS as u32)) as usize;
    let p = rows[(x * comptime!(CONTACT_ROWS as u32)) as usize];
    let q = rows[(y * comptime!(CONTACT_ROWS as u32)) as usize];
    let mut order = compare(0u32, words[a + 7usize] % 2u32, words[b + 7usize] % 2u32);
    order = compare(order, words[a + 2usize], words[b + 2usize]);
    order = compare(order, words[a + 3usize], words[b + 3usize]);
    order = compare(order, words[a + 6usize], words[b + 6usize]);
    order = compare(order, u32::reinterpret(p.extract(0usize)), u32::reinterpret(q.extract(0usize)));
    order = compare(order, u32::reinterpret(p.extract(1usize)), u32::reinterpret(q.extract(1usize)));
    order = compare(order, u32::reinterpret(p.extract(2usize)), u32::reinterpret(q.extract(2usize)));
    order == 1u32
}

/// A member and what it is chosen by.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Chosen {
    pub key: f32,
    pub member: u32,
}

/// Whether a member has the greater key, or an equal one and the lower name.
#[cube]
pub fn wins(words: &[u32], rows: &[Vector<f32, Const<4>>], numbers: &[u32], a: Chosen, b: Chosen) -> bool {
    let is_greater = a.key > b.key;
    let mut better = false;
    if a.key == b.key && a.member != NONE && b.member != NONE {
        better = is_before(words, rows, numbers, a.member, b.member);
    }
    is_greater || better
}

/// The best of all threads. All threads call it.
#[cube]
pub fn best(
    words: &[u32],
    rows: &[Vector<f32, Const<4>>],
    numbers: &[u32],
    mine: Chosen,
    keys: &mut Shared<[f32]>,
    chosen: &mut Shared<[u32]>,
) -> Chosen {
    // Nobody writes while another still reads the last result.
    sync_cube();
    let unit = UNIT_POS as usize;
    keys[unit] = mine.key;
    chosen[unit] = mine.member;
    sync_cube();
    let mut apart = comptime!(GROUP / 2).runtime();
    while apart > 0u32 {
        if UNIT_POS < apart {
            let at = (UNIT_POS + apart) as usize;
            let other = Chosen { key: keys[at], member: chosen[at] };
            let own = Chosen { key: keys[unit], member: chosen[unit] };
            if wins(words, rows, numbers, other, own) {
                keys[unit] = other.key;
                chosen[unit] = other.member;
            }
        }
        apart /= 2u32;
        sync_cube();
    }
    Chosen { key: keys[0], member: chosen[0] }
}
