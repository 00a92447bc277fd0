//! A walk over some faces: those of a list, or those of the leaves of the face tree that a kernel
//! asks for.
use cubecl::prelude::*;

use crate::kernels::query::list::List;
use crate::kernels::query::nearest::{TREE_DEPTH, TreeChild};
use crate::kernels::scene::shape::{CHILDREN, Field, NONE};

/// The faces of a list, or of one leaf after the other. The caller tells which nodes are looked
/// into, and its long code for a face stands in the kernel once.
#[derive(CubeType)]
pub struct FaceWalk {
    /// Words of the children that are still to be visited.
    words: Array<u32>,
    top: u32,
    /// The list; not used in the tree.
    list: List,
    by_list: bool,
    /// The first face of a leaf.
    first: u32,
    /// Number of faces at hand.
    pub count: u32,
}

/// A walk over a list, or over the face tree.
#[cube]
pub fn face_walk(list: List, by_list: bool) -> FaceWalk {
    let mut words = Array::<u32>::new(TREE_DEPTH);
    words[0] = 0u32;
    FaceWalk {
        words,
        top: select(by_list, 0u32, 1u32),
        list,
        by_list,
        first: 0u32.runtime(),
        count: select(by_list, list.count, 0u32),
    }
}

#[cube]
impl FaceWalk {
    /// Face `i` of those at hand.
    pub fn face(&self, field: Field<'_>, i: u32) -> u32 {
        let mut face = self.first + i;
        if self.by_list {
            face = field.listed(self.list, i);
        }
        face
    }

    /// Whether children are still to be visited.
    pub fn is_open(&self) -> bool {
        self.top > 0u32
    }

    /// Goes on to the next child. Takes the faces of a leaf, and returns [`NONE`]; or returns a
    /// node, for which the caller says by [`look_into`](Self::look_into) where to look.
    pub fn next(&mut self) -> u32 {
        self.top -= 1u32;
        let child = TreeChild { word: self.words[self.top as usize] };
        let mut node = NONE.runtime();
        if child.is_leaf() {
            self.take(child.start(), child.count());
        } else {
            node = child.word;
        }
        node
    }

    /// Takes `count` faces from `first` on.
    pub fn take(&mut self, first: u32, count: u32) {
        self.first = first;
        self.count = count;
    }

    /// Puts the children of a node on the way, the left one first.
    pub fn look_into(&mut self, field: Field<'_>, node: u32, left: bool, right: bool) {
        let first = field.entry(CHILDREN) + 2u32 * node;
        if right {
            self.words[self.top as usize] = field.word(first + 1u32);
            self.top += 1u32;
        }
        if left {
            self.words[self.top as usize] = field.word(first);
            self.top += 1u32;
        }
    }
}
