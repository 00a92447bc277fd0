//! Threads of a group give branches of their walks to threads without work.
use cubecl::prelude::*;

use crate::kernels::bodies::cell_walk::Walk;
use crate::kernels::bodies::level_bits::WORDS;
use crate::kernels::narrow::exchange::LANES;

/// Words of a branch: face, root, cell, depth and path.
const BRANCH: u32 = 4 + WORDS as u32;

/// What a thread tells the others.
const FREE: u32 = 0;
const BUSY: u32 = 1;
const GIVES: u32 = 2;

/// Shared memory for branches on their way.
#[derive(CubeType)]
pub struct Branches {
    states: Shared<[u32]>,
    words: Shared<[u32]>,
}

#[cube]
pub fn no_branches() -> Branches {
    Branches {
        states: Shared::<[u32]>::new_slice(LANES as usize),
        words: Shared::<[u32]>::new_slice(comptime!((LANES * BRANCH) as usize)),
    }
}

#[cube]
impl Branches {
    /// Each thread that is free takes a branch of a thread whose walk has one waiting: the topmost,
    /// which is likely to be the largest. Returns whether a thread of the group has work. All
    /// threads of the group call it together.
    pub fn exchange(&mut self, is_free: bool, walk: &mut Walk) -> bool {
        let top = walk.waiting.first();
        let gives = walk.open && top > 0u32;
        // Wait until all threads have read the last states.
        sync_cube();
        self.states[UNIT_POS as usize] = select(is_free, FREE, select(gives, GIVES, BUSY));
        sync_cube();
        let mut free = 0u32;
        let mut givers = 0u32;
        let mut before = 0u32;
        #[unroll]
        for lane in 0..LANES {
            let state = self.states[lane as usize];
            before = select(lane == UNIT_POS, select(is_free, free, givers), before);
            free += select(state == FREE, 1u32, 0u32);
            givers += select(state == GIVES, 1u32, 0u32);
        }
        let moves = before < free.min(givers);
        let at = (before * BRANCH) as usize;
        if gives && moves {
            walk.waiting.set(top - 1u32, false);
            self.words[at] = walk.face;
            self.words[at + 1usize] = walk.root;
            self.words[at + 2usize] = walk.children[(top - 1u32) as usize] + 1u32;
            self.words[at + 3usize] = top;
            #[unroll]
            for word in 0..WORDS {
                self.words[at + 4usize + word] = walk.path.word(word);
            }
        }
        sync_cube();
        if is_free && moves {
            walk.face = self.words[at];
            walk.root = self.words[at + 1usize];
            walk.cell = self.words[at + 2usize];
            walk.depth = self.words[at + 3usize];
            walk.open = true;
            walk.is_new = true;
            #[unroll]
            for word in 0..WORDS {
                walk.path.set_word(word, self.words[at + 4usize + word]);
            }
            let level = walk.depth - 1u32;
            walk.path.set(level, true);
        }
        free < LANES
    }
}
