use glam::DVec3;

use crate::TeSdf;
use crate::asset::layout::{Label, List, NO_PALETTE, Node, Side};
use crate::domain::Cell;

use super::kernel::Ids;

/// What answers for a point.
#[derive(Clone, Copy, Debug)]
pub enum Place {
    /// A cell with the list at this offset.
    Listed {
        /// Where the cell lies.
        label: Label,
        /// Byte of its list.
        offset: u32,
    },
    /// A cell whose points the face tree answers.
    Far(Side),
    /// No cell, or one outside of the domain.
    NotOfDomain,
}

/// The faces of a list, by position.
#[derive(Clone, Copy)]
pub enum ListIds<'a> {
    /// Slots of a palette.
    Slots {
        /// The asset.
        asset: &'a TeSdf,
        /// Where the palette begins.
        start: u32,
        /// One byte per face.
        slots: &'a [u8],
    },
    /// Four bytes per face.
    Faces(&'a [u8]),
}

impl Ids for ListIds<'_> {
    #[inline(always)]
    fn len(self) -> usize {
        match self {
            Self::Slots { slots, .. } => slots.len(),
            Self::Faces(bytes) => bytes.len() / 4,
        }
    }

    #[inline(always)]
    fn get(self, i: usize) -> u32 {
        match self {
            Self::Slots { asset, start, slots } => asset.palette_face(start, slots[i]),
            Self::Faces(b) => u32::from_le_bytes([b[4 * i], b[4 * i + 1], b[4 * i + 2], b[4 * i + 3]]),
        }
    }
}

impl TeSdf {
    /// Finds what answers for a point of the local frame.
    #[inline]
    pub(super) fn place(&self, local: DVec3) -> Place {
        let Some((mut word, mut lambda)) = self.cube.locate(local) else { return Place::NotOfDomain };
        // Three bisections a turn, so that each knows its refinement edge.
        loop {
            for k in [3, 2, 1] {
                let children = match Node::decode(self.nodes[word], &self.lists) {
                    Node::Split(children) => children as usize,
                    Node::Listed(label, offset) => return Place::Listed { label, offset },
                    Node::Far(side) => return Place::Far(side),
                    Node::NotOfDomain => return Place::NotOfDomain,
                };
                word = children
                    + match k {
                        3 => lambda.descend_k::<3>(),
                        2 => lambda.descend_k::<2>(),
                        _ => lambda.descend_k::<1>(),
                    };
            }
        }
    }

    /// The cell that holds a point of the local frame.
    pub(super) fn cell(&self, local: DVec3) -> Option<Cell> {
        let (mut word, mut lambda) = self.cube.locate(local)?;
        let mut cell = self.cube.root(word);
        while let Node::Split(children) = Node::decode(self.nodes[word], &self.lists) {
            let side = lambda.descend(cell.depth);
            cell = cell.child(side);
            word = children as usize + side;
        }
        Some(cell)
    }

    /// The list at `offset`, which opening has checked.
    #[inline]
    pub(super) fn list(&self, offset: u32) -> ListIds<'_> {
        match List::decode(&self.lists, offset).unwrap_or(List::Slots(NO_PALETTE, &[])) {
            List::Slots(palette, slots) => {
                let start = self.palette_starts.get(palette as usize).copied().unwrap_or(0);
                ListIds::Slots { asset: self, start, slots }
            }
            List::Faces(bytes) => ListIds::Faces(bytes),
        }
    }

    /// The faces of a list, by position.
    pub(super) fn list_faces(&self, offset: u32) -> impl Iterator<Item = u32> {
        let ids = self.list(offset);
        (0..ids.len()).map(move |i| ids.get(i))
    }
}
