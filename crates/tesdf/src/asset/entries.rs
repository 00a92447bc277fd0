use glam::DVec3;

use super::layout::Node;
use crate::domain::{Barycentric, Cell};

/// The words at which the location of a point begins: those of all cells of one depth. Made on
/// opening.
///
/// The upper levels of the forest are nearly all bisected. A grid that holds these words saves half
/// of the way down.
#[derive(Clone, Debug)]
pub(crate) struct Entries {
    pub level: u32,
    pub words: Vec<u32>,
}

/// The entries take at most one word for this many words of the forest.
const ENTRY_SHARE: usize = 2;

impl Entries {
    /// Makes the deepest grid that takes at most half as many words as the forest.
    pub fn new(nodes: &[u32]) -> Self {
        if nodes.len() < 6 {
            return Self { level: 0, words: Vec::new() };
        }
        let level =
            (0..10).take_while(|l| (6usize << (3 * l)) * ENTRY_SHARE <= nodes.len()).last().unwrap_or(0);
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
            // A leaf above the grid stands for its whole part of the grid.
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
