use glam::DVec3;

use crate::TeSdf;
use crate::asset::layout::{Label, List, Node, Side};
use crate::domain::{Barycentric, Cell};

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

/// Where the descents of an asset begin: the words of all cells of one depth, made on opening.
///
/// The upper levels of the forest are nearly all bisected; a grid that holds them saves half of the way.
#[derive(Debug)]
pub struct Entries {
    level: u32,
    words: Vec<u32>,
}

/// Share of the forest's words that the entries may take.
const ENTRY_SHARE: usize = 4;

impl Entries {
    /// The deepest grid that takes at most a quarter of the forest's own words.
    pub fn new(nodes: &[u32]) -> Self {
        if nodes.len() < 6 {
            return Self { level: 0, words: Vec::new() };
        }
        let level = (0..10).take_while(|l| (6usize << (3 * l)) * ENTRY_SHARE <= nodes.len()).last().unwrap_or(0);
        let mut words = vec![0; 6 << (3 * level)];
        for root in 0..6 {
            Self::fill(nodes, root, Cell::root(DVec3::ZERO, 1.0, root), level, &mut words);
        }
        Self { level, words }
    }

    fn fill(nodes: &[u32], word: usize, cell: Cell, level: u32, words: &mut [u32]) {
        if cell.depth == 3 * level {
            if let Some((at, _)) = Barycentric::in_grid(cell.centroid(), level) {
                words[at] = word as u32;
            }
            return;
        }
        for side in 0..2 {
            // A leaf above the grid stands for all of its part of the grid.
            let below = match Node::decode(nodes[word], &[]) {
                Node::Split(children) => children as usize + side,
                _ => word,
            };
            Self::fill(nodes, below, cell.child(side), level, words);
        }
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(self.words.as_slice())
    }
}

/// The faces of a list, by position.
#[derive(Clone, Copy)]
pub enum ListIds<'a> {
    /// Slots of a palette.
    Slots(Slots<'a>),
    /// Four bytes per face.
    Faces(Words<'a>),
}

/// Slots of a palette.
#[derive(Clone, Copy)]
pub struct Slots<'a> {
    slots: &'a [u8],
    low: &'a [u16],
    high: Option<&'a [u8]>,
}

impl Ids for Slots<'_> {
    #[inline(always)]
    fn len(self) -> usize {
        self.slots.len()
    }

    #[inline(always)]
    fn get(self, i: usize) -> u32 {
        let slot = self.slots[i] as usize;
        let high = self.high.map_or(0, |high| u32::from(high[slot]));
        u32::from(self.low[slot]) | high << 16
    }
}

/// Four bytes per face.
#[derive(Clone, Copy)]
pub struct Words<'a>(&'a [u8]);

impl Ids for Words<'_> {
    #[inline(always)]
    fn len(self) -> usize {
        self.0.len() / 4
    }

    #[inline(always)]
    fn get(self, i: usize) -> u32 {
        let b = &self.0[4 * i..4 * i + 4];
        u32::from_le_bytes([b[0], b[1], b[2], b[3]])
    }
}

impl TeSdf {
    /// Finds what answers for a point of the local frame.
    #[inline]
    pub(super) fn place(&self, local: DVec3) -> Place {
        let entries = &self.entries;
        let Some((entry, mut lambda)) = self.cube.locate(local, entries.level) else { return Place::NotOfDomain };
        let mut word = entries.words[entry] as usize;
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

    /// The cell that holds a point of the local frame, with its label and list if it has them.
    ///
    /// On a border this may be another of the cells that share it than [`place`](Self::place) finds: the grid rounds
    /// up, the descent to side 0.
    pub(super) fn cell(&self, local: DVec3) -> Option<(Cell, Label, u32)> {
        let (mut word, mut lambda) = self.cube.locate(local, 0)?;
        let mut cell = self.cube.root(word);
        loop {
            match Node::decode(self.nodes[word], &self.lists) {
                Node::Split(children) => {
                    let side = lambda.descend(cell.depth);
                    cell = cell.child(side);
                    word = children as usize + side;
                }
                Node::Listed(label, offset) => return Some((cell, label, offset)),
                Node::Far(Side::Inside) => return Some((cell, Label::Inside, 0)),
                Node::Far(Side::Outside) | Node::NotOfDomain => return Some((cell, Label::Outside, 0)),
            }
        }
    }

    /// The list at `offset`, which opening has checked.
    #[inline]
    pub(super) fn list(&self, offset: u32) -> ListIds<'_> {
        match List::decode(&self.lists, offset).unwrap_or(List::Faces(&[])) {
            List::Slots(palette, slots) => {
                let palette = palette as usize;
                let range = self.palette_starts[palette] as usize..self.palette_starts[palette + 1] as usize;
                let high = self.palettes_high.as_ref().map(|high| &high[range.clone()]);
                ListIds::Slots(Slots { slots, low: &self.palettes[range], high })
            }
            List::Faces(bytes) => ListIds::Faces(Words(bytes)),
        }
    }

    /// Length of the list at `offset`.
    pub(super) fn list_len(&self, offset: u32) -> usize {
        match self.list(offset) {
            ListIds::Slots(s) => s.len(),
            ListIds::Faces(w) => w.len(),
        }
    }

    /// The faces of a list, by position.
    pub(super) fn list_faces(&self, offset: u32) -> impl Iterator<Item = u32> {
        let ids = self.list(offset);
        (0..self.list_len(offset)).map(move |i| match ids {
            ListIds::Slots(s) => s.get(i),
            ListIds::Faces(w) => w.get(i),
        })
    }
}
