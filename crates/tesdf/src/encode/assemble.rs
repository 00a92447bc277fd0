//! Lays out refined trees as the sections of an asset.

use std::collections::HashMap;
use std::ops::Range;

use super::error::EncodeError;
use super::refine::{Leaf, Tree};
use crate::asset::layout::{LONG_WINDING, Label, List, MAX_LIST_OFFSET, NO_PALETTE, Node, PALETTE_SIZE};
use crate::base::Side;

/// The forest and its lists, as the file stores them.
#[derive(Debug, Default)]
pub struct Forest {
    /// Words of the forest.
    pub nodes: Vec<u32>,
    /// Bytes of the lists.
    pub lists: Vec<u8>,
    /// Where each palette begins among the palette faces.
    pub palette_starts: Vec<u32>,
    /// Faces of the palettes.
    pub palettes: Vec<u32>,
}

/// Lays out the trees of all roots.
///
/// - `labels` has one label for each leaf, in depth-first order.
/// - `position` maps a face to its place in the asset. Lists are sorted by it.
/// - `order` names each root once. Near roots follow each other, so that small trees can share a
///   palette.
///
/// # Errors
/// The asset has more palettes, or more bytes of lists, than the words of the file can name.
pub fn assemble(
    roots: &mut [Tree],
    labels: &[Label],
    position: &[u32],
    order: &[u32],
) -> Result<Forest, EncodeError> {
    let mut starts = vec![0];
    for root in roots.iter_mut() {
        let mut count = starts[starts.len() - 1];
        collect(root, &mut |leaf| {
            count += 1;
            if let Leaf::Listed { faces, .. } = leaf {
                faces.iter_mut().for_each(|f| *f = position[*f as usize]);
                faces.sort_unstable();
            }
        });
        starts.push(count);
    }
    let mut forest = Forest { nodes: vec![0; roots.len()], palette_starts: vec![0], ..Default::default() };
    let mut palette_of = vec![None; labels.len()];
    let (mut open, mut sharing): (Vec<u32>, Vec<Range<usize>>) = Default::default();
    for &root in order {
        let mut own = Vec::new();
        let union = forest.find_palettes(&roots[root as usize], &mut own);
        let range = starts[root as usize]..starts[root as usize + 1];
        palette_of[range.clone()].copy_from_slice(&own);
        if let Union::Small(faces) = union {
            let all = united(&open, &faces);
            if all.len() <= PALETTE_SIZE {
                open = all;
            } else {
                forest.share_palette(&open, &mut sharing, &mut palette_of);
                open = faces;
            }
            sharing.push(range);
        }
    }
    forest.share_palette(&open, &mut sharing, &mut palette_of);
    if forest.palette_starts.len() > usize::from(NO_PALETTE) {
        return Err(EncodeError::TooLarge {
            what: "palettes",
            found: forest.palette_starts.len(),
            limit: usize::from(NO_PALETTE),
        });
    }
    let mut writer = Writer { forest, labels, palette_of: &palette_of, next: 0, seen: HashMap::new() };
    for (word, root) in roots.iter().enumerate() {
        writer.write(root, word)?;
    }
    Ok(writer.forest)
}

/// Calls `visit` with each leaf in depth-first order.
pub fn collect<'a>(tree: &'a mut Tree, visit: &mut impl FnMut(&'a mut Leaf)) {
    match tree {
        Tree::Leaf(leaf) => visit(leaf),
        Tree::Split(children) => children.iter_mut().for_each(|c| collect(c, visit)),
    }
}

/// The union of two sets of faces, ascending.
fn united(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut all = [a, b].concat();
    all.sort_unstable();
    all.dedup();
    all
}

/// The faces of a subtree, unless there are too many for one palette.
enum Union {
    Small(Vec<u32>),
    Large,
}

impl Forest {
    /// Gives a palette to each of the largest subtrees that name at most 256 faces.
    ///
    /// `palette_of` grows by one entry for each leaf of `tree`. The leaves of a subtree that is
    /// still `Small` have no palette yet.
    fn find_palettes(&mut self, tree: &Tree, palette_of: &mut Vec<Option<u16>>) -> Union {
        match tree {
            Tree::Leaf(Leaf::Listed { faces, .. }) => {
                palette_of.push(None);
                if faces.len() < PALETTE_SIZE { Union::Small(faces.clone()) } else { Union::Large }
            }
            Tree::Leaf(_) => {
                palette_of.push(None);
                Union::Small(Vec::new())
            }
            Tree::Split(children) => {
                let start = palette_of.len();
                let left = self.find_palettes(&children[0], palette_of);
                let middle = palette_of.len();
                let right = self.find_palettes(&children[1], palette_of);
                let end = palette_of.len();
                match (left, right) {
                    (Union::Small(a), Union::Small(b)) => {
                        let all = united(&a, &b);
                        if all.len() <= PALETTE_SIZE {
                            return Union::Small(all);
                        }
                        palette_of[start..middle].fill(self.add_palette(&a));
                        palette_of[middle..end].fill(self.add_palette(&b));
                    }
                    (Union::Small(a), Union::Large) => palette_of[start..middle].fill(self.add_palette(&a)),
                    (Union::Large, Union::Small(b)) => palette_of[middle..end].fill(self.add_palette(&b)),
                    (Union::Large, Union::Large) => {}
                }
                Union::Large
            }
        }
    }

    /// Adds a palette and returns its number. A subtree without faces needs no palette.
    fn add_palette(&mut self, faces: &[u32]) -> Option<u16> {
        if faces.is_empty() {
            return None;
        }
        // The caller counts the palettes and reports more of them than a `u16` can name.
        let number = (self.palette_starts.len() - 1).min(usize::from(NO_PALETTE)) as u16;
        self.palettes.extend(faces);
        self.palette_starts.push(self.palettes.len() as u32);
        Some(number)
    }

    fn share_palette(
        &mut self,
        faces: &[u32],
        sharing: &mut Vec<Range<usize>>,
        palette_of: &mut [Option<u16>],
    ) {
        let number = self.add_palette(faces);
        for range in sharing.drain(..) {
            palette_of[range].fill(number);
        }
    }

    fn palette(&self, palette: u16) -> &[u32] {
        let start = self.palette_starts[palette as usize] as usize;
        &self.palettes[start..self.palette_starts[palette as usize + 1] as usize]
    }
}

struct Writer<'a> {
    forest: Forest,
    labels: &'a [Label],
    palette_of: &'a [Option<u16>],
    next: usize,
    /// Where the same bytes of a list are stored already.
    seen: HashMap<Vec<u8>, u32>,
}

impl Writer<'_> {
    fn write(&mut self, tree: &Tree, word: usize) -> Result<(), EncodeError> {
        let node = match tree {
            Tree::Split(children) => {
                let at = self.forest.nodes.len();
                self.forest.nodes.extend([0, 0]);
                self.forest.nodes[word] = Node::Split(at as u32).encode();
                self.write(&children[0], at)?;
                return self.write(&children[1], at + 1);
            }
            Tree::Leaf(leaf) => {
                let (label, palette) = (self.labels[self.next], self.palette_of[self.next]);
                self.next += 1;
                match leaf {
                    Leaf::Listed { faces, .. } => Node::Listed(label, self.list(faces, label, palette)?),
                    Leaf::Far => {
                        Node::Far(if label == Label::Outside { Side::Outside } else { Side::Inside })
                    }
                    Leaf::Outside => Node::NotOfDomain,
                }
            }
        };
        self.forest.nodes[word] = node.encode();
        Ok(())
    }

    fn list(&mut self, faces: &[u32], label: Label, palette: Option<u16>) -> Result<u32, EncodeError> {
        let mut bytes = Vec::with_capacity(faces.len() + 8);
        let prefix = match label {
            Label::Crossing(winding) if winding >= LONG_WINDING => {
                bytes.extend(winding.to_le_bytes());
                4
            }
            _ => 0,
        };
        let slots = palette.and_then(|p| {
            let all = self.forest.palette(p);
            let slot = |f: &u32| all.binary_search(f).ok().map(|s| s as u8);
            Some((p, faces.iter().map(slot).collect::<Option<Vec<u8>>>()?))
        });
        match slots {
            Some((palette, slots)) => List::Slots(palette, &slots).encode(&mut bytes),
            None => {
                let raw: Vec<u8> = faces.iter().flat_map(|f| f.to_le_bytes()).collect();
                List::Faces(&raw).encode(&mut bytes);
            }
        }
        if let Some(&offset) = self.seen.get(&bytes) {
            return Ok(offset + prefix);
        }
        let offset = self.forest.lists.len();
        if offset + bytes.len() > MAX_LIST_OFFSET as usize {
            return Err(EncodeError::TooLarge {
                what: "bytes of lists",
                found: offset + bytes.len(),
                limit: MAX_LIST_OFFSET as usize,
            });
        }
        self.forest.lists.extend(&bytes);
        self.seen.insert(bytes, offset as u32);
        Ok(offset as u32 + prefix)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Chains;

    fn listed(faces: Vec<u32>) -> Tree {
        Tree::Leaf(Leaf::Listed { faces, crossing: false, chains: Chains::NONE })
    }

    /// A tree of `count` lists of one face beside a list of all faces, which fits no palette. Each
    /// of the short lists has a palette of its own.
    fn with_palettes(count: usize) -> Tree {
        let all = listed((0..PALETTE_SIZE as u32).collect());
        (0..count).fold(all, |tree, at| Tree::Split(Box::new([listed(vec![at as u32 % 7]), tree])))
    }

    fn assembled(mut trees: Vec<Tree>, leaves: usize) -> Result<Forest, EncodeError> {
        let position: Vec<u32> = (0..PALETTE_SIZE as u32).rev().collect();
        let order: Vec<u32> = (0..trees.len() as u32).collect();
        assemble(&mut trees, &vec![Label::Outside; leaves], &position, &order)
    }

    #[test]
    fn more_palettes_than_a_list_can_name_are_an_error() {
        // Number 65535 says that a list has no palette.
        let trees = |rest| (0..255).map(|_| with_palettes(256)).chain([with_palettes(rest)]).collect();
        let forest = assembled(trees(254), 256 + 255 * 256 + 254).expect("as many as can be named");
        assert_eq!(forest.palette_starts.len(), 255 * 256 + 254 + 1);
        let last = forest.palette(u16::MAX - 2);
        assert_eq!(last, [255 - 253 % 7]);
        match assembled(trees(255), 256 + 255 * 256 + 255) {
            Err(EncodeError::TooLarge { what: "palettes", found, limit: 65535 }) => assert_eq!(found, 65536),
            other => panic!("{:?}", other.map(|forest| forest.palette_starts.len())),
        }
    }

    #[test]
    fn lists_name_their_faces_by_place_and_equal_lists_are_stored_once() {
        let all: Vec<u32> = (0..PALETTE_SIZE as u32).collect();
        let lists = [vec![3, 9], vec![200], vec![3, 9], all, vec![3, 9]];
        let forest = assembled(lists.iter().cloned().map(listed).collect(), lists.len()).expect("few");
        let offsets: Vec<u32> = forest
            .nodes
            .iter()
            .map(|&word| match Node::decode(word, &forest.lists) {
                Node::Listed(Label::Outside, offset) => offset,
                other => panic!("{other:?}"),
            })
            .collect();
        assert!(offsets[0] == offsets[2] && offsets[0] == offsets[4], "{offsets:?}");
        for (faces, offset) in lists.iter().zip(offsets) {
            let mut expected: Vec<u32> = faces.iter().map(|f| 255 - f).collect();
            expected.sort_unstable();
            let found: Vec<u32> = match List::decode(&forest.lists, offset).expect("a list") {
                List::Slots(palette, slots) => {
                    slots.iter().map(|&slot| forest.palette(palette)[slot as usize]).collect()
                }
                List::Faces(bytes) => {
                    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
                }
            };
            assert_eq!(found, expected);
        }
    }
}
