//! The sections of an asset and the words in them. This module defines the byte layout. The kernels
//! of `tesdf-gpu` read the same words and bytes with the constants of this module.

use super::{Element, SectionSpec};
use crate::base::Side;

/// `[V, 3]` positions of the vertices, in the unit of the mesh and in the order of the source.
pub const VERTICES: SectionSpec = SectionSpec::required("mesh.vertices", Element::F64, 3);
/// `[F, 3]` corner vertices of the faces, in the order of the face tree's leaves.
pub const FACES: SectionSpec = SectionSpec::required("mesh.faces", Element::U32, 3);
/// `[S, 3]` corner vertices of faces that are no part of the surface, but count for the sign. Only
/// in files of version 2.
pub const SIGN_FACES: SectionSpec = SectionSpec::optional("mesh.sign_faces", Element::U32, 3);
/// `[F]` id of each face in the source mesh.
pub const FACE_IDS: SectionSpec = SectionSpec::required("mesh.face_ids", Element::U32, 1);
/// `[F]` how each feature of a face tells the sign; see [`SignHints`].
pub const SIGN_HINTS: SectionSpec = SectionSpec::required("mesh.sign_hints", Element::U16, 1);
/// `[8]` local frame and cube: offset x y z, scale, cube origin x y z, cube side.
pub const FRAME: SectionSpec = SectionSpec::required("domain.frame", Element::F64, 1);
/// `[W, 3]` positions, in the unit of the mesh, of those vertices of a conforming domain that are
/// not of the mesh.
pub const DOMAIN_VERTICES: SectionSpec = SectionSpec::optional("domain.vertices", Element::F64, 3);
/// `[T, 4]` corners of the tetrahedra of a conforming domain: first the vertices of the mesh, then
/// those of [`DOMAIN_VERTICES`]. A file without this section has the bisection domain.
pub const TETRAHEDRA: SectionSpec = SectionSpec::optional("domain.tetrahedra", Element::U32, 4);
/// `[N]` the bisection forest; see [`Node`]. The roots come first: 6, or one for each of
/// [`TETRAHEDRA`]. The two children of a node are neighbours.
pub const NODES: SectionSpec = SectionSpec::required("domain.nodes", Element::U32, 1);
/// The encoded lists of the cells; see [`List`].
pub const LISTS: SectionSpec = SectionSpec::required("lists.bytes", Element::U8, 1);
/// `[P + 1]` where each palette begins among the palette faces.
pub const PALETTE_STARTS: SectionSpec = SectionSpec::required("lists.palette_starts", Element::U32, 1);
/// Low bits of the palette faces (positions in [`FACES`]); see [`palette_face`].
pub const PALETTES: SectionSpec = SectionSpec::required("lists.palettes", Element::U16, 1);
/// High bits of the palette faces. Only for meshes of more than [`SHORT_FACES`] faces.
pub const PALETTES_HIGH: SectionSpec = SectionSpec::optional("lists.palettes_high", Element::U8, 1);
/// `[M, 12]` boxes of the two children of each node of the face tree: min x y z, max x y z, twice.
/// They are relative to the middle of the cube, in the local frame.
pub const TREE_BOXES: SectionSpec = SectionSpec::required("tree.boxes", Element::F32, 12);
/// `[M, 2]` children of each node of the face tree; see [`TreeChild`].
pub const TREE_CHILDREN: SectionSpec = SectionSpec::required("tree.children", Element::U32, 2);

/// All sections of a file.
pub const SECTIONS: [SectionSpec; 15] = [
    VERTICES,
    FACES,
    SIGN_FACES,
    FACE_IDS,
    SIGN_HINTS,
    FRAME,
    DOMAIN_VERTICES,
    TETRAHEDRA,
    NODES,
    LISTS,
    PALETTE_STARTS,
    PALETTES,
    PALETTES_HIGH,
    TREE_BOXES,
    TREE_CHILDREN,
];

/// Bits of a palette face in [`PALETTES`]. The others are in [`PALETTES_HIGH`].
const LOW_BITS: u32 = u16::BITS;
/// Largest number of faces of an asset without [`PALETTES_HIGH`].
pub const SHORT_FACES: usize = 1 << LOW_BITS;
/// Largest number of faces of an asset.
pub const MAX_FACES: usize = 1 << (LOW_BITS + u8::BITS);
/// Largest number of faces in a leaf of the face tree.
pub const TREE_LEAF: usize = 8;
/// Bits of a leaf's word for the number of faces, minus one.
pub const TREE_LEAF_BITS: u32 = TREE_LEAF.trailing_zeros();

/// Where a cell lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Label {
    /// Winding number 0 in the whole cell.
    Outside,
    /// Winding number 1 or more in the whole cell.
    Inside,
    /// The surface comes within the padding of the cell. The number is the winding number at its
    /// centroid.
    Crossing(u32),
}

/// A word of the forest.
///
/// ```text
///   0 c…c                      bisected; the children are words c and c + 1
///   1 code(3) offset(28)       a cell
///     0 outside  1 inside      list at byte `offset`
///     2 3 4 crossing           the same; winding number 0, 1, 2 at the centroid
///     5 crossing               the same; winding number in the four bytes before
///     6 far                    no list; offset 1 inside, 0 outside
///     7 not of the domain
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Node {
    /// The cell is bisected. Its children are this word and the next.
    Split(u32),
    /// The cell has a list that begins at this byte of [`LISTS`].
    Listed(Label, u32),
    /// The cell is far from the surface, on this side of it. The face tree answers.
    Far(Side),
    /// The cell is farther out than the band.
    NotOfDomain,
}

/// The bit of a word of the forest or of the face tree that says "no children".
pub const LEAF: u32 = 1 << 31;
/// The lowest bit of a cell's code.
pub const CODE: u32 = 28;
/// The bits of a cell's code, after a shift by [`CODE`].
pub const CODES: u32 = 7;
/// Code of a cell outside, with a list.
pub const OUTSIDE: u32 = 0;
/// Code of a cell inside, with a list.
pub const INSIDE: u32 = 1;
/// Code of a crossing cell with winding number 0; the winding number is added.
pub const CROSSING: u32 = 2;
/// Code of a cell without a list; its offset is 1 inside, 0 outside.
pub const FAR: u32 = 6;
/// Code of a cell that is not of the domain.
pub const NOT_OF_DOMAIN: u32 = 7;
/// The offsets of lists are below this.
pub const MAX_LIST_OFFSET: u32 = 1 << CODE;
/// From this winding number on, the number is written before the list.
pub const LONG_WINDING: u32 = 3;
/// Bytes of this number.
pub const WINDING_BYTES: u32 = size_of::<u32>() as u32;
/// Code of a crossing cell with such a number.
pub const LONG_CROSSING: u32 = CROSSING + LONG_WINDING;

impl Node {
    /// Whether the word is that of a bisected cell. The word is then the place of its children.
    #[inline]
    pub fn is_split(word: u32) -> bool {
        word & LEAF == 0
    }

    /// Reads a word.
    #[inline]
    pub fn decode(word: u32, lists: &[u8]) -> Self {
        if word & LEAF == 0 {
            return Self::Split(word);
        }
        let offset = word & (MAX_LIST_OFFSET - 1);
        match (word >> CODE) & CODES {
            OUTSIDE => Self::Listed(Label::Outside, offset),
            INSIDE => Self::Listed(Label::Inside, offset),
            code @ CROSSING..LONG_CROSSING => Self::Listed(Label::Crossing(code - CROSSING), offset),
            LONG_CROSSING => {
                let at = offset.checked_sub(WINDING_BYTES);
                let bytes = at.and_then(|at| lists.get(at as usize..)?.first_chunk());
                Self::Listed(Label::Crossing(bytes.map_or(0, |b| u32::from_le_bytes(*b))), offset)
            }
            FAR if offset == 1 => Self::Far(Side::Inside),
            FAR => Self::Far(Side::Outside),
            _ => Self::NotOfDomain,
        }
    }

    /// Writes a word.
    pub fn encode(self) -> u32 {
        match self {
            Self::Split(children) => children,
            Self::Listed(label, offset) => {
                let code = match label {
                    Label::Outside => OUTSIDE,
                    Label::Inside => INSIDE,
                    Label::Crossing(winding) => CROSSING + winding.min(LONG_WINDING),
                };
                LEAF | code << CODE | offset
            }
            Self::Far(side) => LEAF | FAR << CODE | u32::from(side == Side::Inside),
            Self::NotOfDomain => LEAF | NOT_OF_DOMAIN << CODE,
        }
    }
}

/// Reads a palette face from its low and high bits.
#[inline]
pub fn palette_face(low: u16, high: u8) -> u32 {
    u32::from(low) | u32::from(high) << LOW_BITS
}

/// The low and the high bits of a palette face.
pub fn palette_bits(face: u32) -> (u16, u8) {
    (face as u16, (face >> LOW_BITS) as u8)
}

/// The palette number that stands for "no palette". The list then has a u32 count and u32 faces.
pub const NO_PALETTE: u16 = u16::MAX;
/// Largest number of faces in a palette, so that one byte names each face.
pub const PALETTE_SIZE: usize = 256;
/// Bytes of a list before its count: the number of the palette.
pub const PALETTE_BYTES: u32 = size_of_val(&NO_PALETTE) as u32;
/// Bytes of a list before its slots.
pub const SLOTS: u32 = PALETTE_BYTES + size_of::<u8>() as u32;
/// Bytes of a list without a palette before its faces.
pub const LISTED_FACES: u32 = PALETTE_BYTES + size_of::<u32>() as u32;
/// Bytes of a face in such a list.
pub const FACE_BYTES: u32 = size_of::<u32>() as u32;

/// The list of a cell, little-endian and unaligned. It is `palette u16, count u8, count × u8` with
/// slots of the palette, or `NO_PALETTE u16, count u32, count × u32` with faces.
#[derive(Clone, Copy, Debug)]
pub enum List<'a> {
    /// Slots of a palette.
    Slots(u16, &'a [u8]),
    /// Faces, with four bytes each.
    Faces(&'a [u8]),
}

impl<'a> List<'a> {
    /// Reads the list at `offset`. `None` when the list does not lie in `bytes`.
    #[inline]
    pub fn decode(bytes: &'a [u8], offset: u32) -> Option<Self> {
        let rest = bytes.get(offset as usize..)?;
        let (&palette, rest) = rest.split_first_chunk()?;
        let palette = u16::from_le_bytes(palette);
        if palette == NO_PALETTE {
            let (&count, rest) = rest.split_first_chunk()?;
            let length = (u32::from_le_bytes(count) as usize).checked_mul(FACE_BYTES as usize)?;
            return rest.get(..length).map(Self::Faces);
        }
        let (&count, rest) = rest.split_first()?;
        rest.get(..count as usize).map(|slots| Self::Slots(palette, slots))
    }

    /// Appends the list to `bytes`.
    pub fn encode(self, bytes: &mut Vec<u8>) {
        match self {
            Self::Slots(palette, slots) => {
                bytes.extend(palette.to_le_bytes());
                bytes.push(slots.len() as u8);
                bytes.extend(slots);
            }
            Self::Faces(faces) => {
                bytes.extend(NO_PALETTE.to_le_bytes());
                bytes.extend(((faces.len() / FACE_BYTES as usize) as u32).to_le_bytes());
                bytes.extend(faces);
            }
        }
    }

    /// Number of faces.
    pub fn len(self) -> usize {
        match self {
            Self::Slots(_, slots) => slots.len(),
            Self::Faces(bytes) => bytes.len() / FACE_BYTES as usize,
        }
    }

    /// Whether there is no face.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }
}

/// A child of a node of the face tree: `0 node(31)`, or `1 start(28) count-1(3)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeChild {
    /// A node. Its index is greater than that of its parent.
    Node(u32),
    /// Faces `start .. start + count`. `count` is from 1 to [`TREE_LEAF`].
    Leaf(u32, u32),
}

impl TreeChild {
    /// Reads a word.
    #[inline]
    pub fn decode(word: u32) -> Self {
        const COUNT: u32 = TREE_LEAF as u32 - 1;
        if word & LEAF == 0 {
            Self::Node(word)
        } else {
            Self::Leaf((word & !LEAF) >> TREE_LEAF_BITS, (word & COUNT) + 1)
        }
    }

    /// Writes a word.
    pub fn encode(self) -> u32 {
        match self {
            Self::Node(node) => node,
            Self::Leaf(start, count) => LEAF | start << TREE_LEAF_BITS | (count - 1),
        }
    }
}

/// How the closest feature tells the sign, with two bits each for the face, the edges 0–2 and the
/// corners 0–2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct SignHints(pub u16);

/// How a feature tells the sign of a point to which it is closest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum SignHint {
    /// The feature does not tell the sign. The winding number does.
    Winding = 0,
    /// The side of the face's plane tells the sign.
    Plane = 1,
    /// The point is outside, because the feature is convex.
    Outside = 2,
    /// The point is inside, because the feature is concave.
    Inside = 3,
}

impl SignHints {
    /// Bits of a hint.
    pub const BITS: u32 = 2;

    /// The hint of feature `k`: 0 is the face, 1–3 are the edges, 4–6 are the corners.
    #[inline]
    pub fn get(self, k: usize) -> SignHint {
        match (self.0 >> (Self::BITS as usize * k)) & 3 {
            0 => SignHint::Winding,
            1 => SignHint::Plane,
            2 => SignHint::Outside,
            _ => SignHint::Inside,
        }
    }

    /// Sets the hint of feature `k`.
    pub fn set(&mut self, k: usize, hint: SignHint) {
        let at = Self::BITS as usize * k;
        self.0 = self.0 & !(3 << at) | (hint as u16) << at;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_round_trip() {
        let lists = 7u32.to_le_bytes();
        for node in [
            Node::Split(77),
            Node::Listed(Label::Outside, 0),
            Node::Listed(Label::Inside, 12345),
            Node::Listed(Label::Crossing(0), MAX_LIST_OFFSET - 1),
            Node::Listed(Label::Crossing(2), 9),
            Node::Listed(Label::Crossing(7), 4),
            Node::Far(Side::Inside),
            Node::Far(Side::Outside),
            Node::NotOfDomain,
        ] {
            assert_eq!(Node::decode(node.encode(), &lists), node);
        }
        for child in [TreeChild::Node(5), TreeChild::Leaf(0, 1), TreeChild::Leaf((1 << 24) - 1, 8)] {
            assert_eq!(TreeChild::decode(child.encode()), child);
        }
        let mut hints = SignHints::default();
        hints.set(3, SignHint::Inside);
        hints.set(6, SignHint::Plane);
        hints.set(3, SignHint::Outside);
        assert_eq!(
            (hints.get(3), hints.get(6), hints.get(0)),
            (SignHint::Outside, SignHint::Plane, SignHint::Winding)
        );
    }

    #[test]
    fn lists_round_trip_and_prefixes_are_refused() {
        for list in [List::Slots(3, &[1, 2, 250]), List::Faces(&[0, 1, 0, 0, 5, 0, 0, 0])] {
            let mut bytes = Vec::new();
            list.encode(&mut bytes);
            assert_eq!(List::decode(&bytes, 0).map(List::len), Some(list.len()));
            for end in 0..bytes.len() {
                assert!(List::decode(&bytes[..end], 0).is_none());
            }
        }
    }
}
