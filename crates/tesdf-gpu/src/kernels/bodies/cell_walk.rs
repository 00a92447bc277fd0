//! A walk of a thread through the cells of a field.
use cubecl::prelude::*;

use crate::kernels::bodies::corners::Corners;
use crate::kernels::bodies::level_bits::{Bits, LEVELS, no_bits};
use crate::kernels::query::locate::Lambda;

/// A walk through the cells that a face meets, between two steps.
#[derive(CubeType)]
pub struct Walk {
    pub face: u32,
    pub root: u32,
    pub cell: u32,
    pub depth: u32,
    /// Whether the cell still has to be visited.
    pub open: bool,
    /// Whether no step of this walk has been made by this thread.
    pub is_new: bool,
    pub path: Bits,
    /// The levels with a sibling to visit.
    pub waiting: Bits,
    /// The first child at each level.
    pub children: Array<u32>,
    /// The face's corners at each third level, 12 numbers each.
    corners: Array<f32>,
}

#[cube]
pub fn no_walk() -> Walk {
    let mut waiting = no_bits();
    waiting.clear();
    Walk {
        face: 0u32,
        root: 0u32,
        cell: 0u32,
        depth: 0u32,
        open: false,
        is_new: false,
        path: no_bits(),
        waiting,
        children: Array::<u32>::new(LEVELS),
        corners: Array::<f32>::new(comptime!(12 * LEVELS.div_ceil(3))),
    }
}

#[cube]
impl Walk {
    /// Keeps the corners in the cell at level `depth`, at each third level.
    pub fn keep(&mut self, depth: u32, corners: Corners) {
        if depth % 3u32 == 0u32 {
            let at = (4u32 * depth) as usize;
            self.put(at, corners.a);
            self.put(at + 4usize, corners.b);
            self.put(at + 8usize, corners.c);
        }
    }

    /// The corners in the cell at level `depth` of the path, from those kept at level `base`.
    pub fn corners(&self, base: u32, depth: u32) -> Corners {
        let at = (4u32 * base) as usize;
        let kept = Corners { a: self.get(at), b: self.get(at + 4usize), c: self.get(at + 8usize) };
        self.path.follow_from(kept, base, depth)
    }

    fn put(&mut self, at: usize, l: Lambda) {
        self.corners[at] = l.l0;
        self.corners[at + 1usize] = l.l1;
        self.corners[at + 2usize] = l.l2;
        self.corners[at + 3usize] = l.l3;
    }

    fn get(&self, at: usize) -> Lambda {
        Lambda {
            l0: self.corners[at],
            l1: self.corners[at + 1usize],
            l2: self.corners[at + 2usize],
            l3: self.corners[at + 3usize],
        }
    }
}
