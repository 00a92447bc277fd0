//! Where the arrays of all shapes lie in the buffers: the one place that knows it, for the host that writes and the kernels that read.
use cubecl::prelude::*;

use super::vector::{V3, v3};

/// The shapes of a scene: three buffers, shared by all instances.
#[derive(CubeType, CubeLaunch)]
pub struct Assets {
    /// [`STRIDE`] words a shape: what it is and where its arrays begin.
    pub table: Box<[u32]>,
    /// Arrays of words, of bytes and of half words.
    pub words: Box<[u32]>,
    /// Arrays of rows of four `f32`.
    pub rows: Box<[Vector<f32, Const<4>>]>,
}

/// Words a shape takes in the table.
pub const STRIDE: u32 = 40;

/// One of `MESH` … `ROUND`.
pub const KIND: u32 = 0;
/// Word of the forest's first root.
pub const NODES: u32 = 1;
/// Word where the bytes of the lists begin.
pub const LISTS: u32 = 2;
/// Word of the first palette's start.
pub const PALETTE_STARTS: u32 = 3;
/// Word where the low halves of the palette faces begin.
pub const PALETTES: u32 = 4;
/// Word where their high bytes begin; `NONE` without them.
pub const PALETTES_HIGH: u32 = 5;
/// Word where the bytes of the cell bounds begin.
pub const BOUNDS: u32 = 6;
/// Word of the face tree's first child.
pub const CHILDREN: u32 = 7;
/// Row of the first face.
pub const RECORDS: u32 = 8;
/// Row of the face tree's first boxes, three rows a node.
pub const BOXES: u32 = 9;
/// Row of the first meshlet's ball: middle and radius.
pub const MESHLETS: u32 = 10;
/// Word of the first meshlet's first face and number of faces.
pub const MESHLET_FACES: u32 = 11;
/// Number of meshlets.
pub const MESHLET_COUNT: u32 = 12;
/// Number of faces.
pub const FACE_COUNT: u32 = 13;
/// 1 when every list is exact.
pub const EXACT_LISTS: u32 = 14;
/// Side of the cube, and its inverse.
pub const SIDE: u32 = 15;
pub const INVERSE_SIDE: u32 = 16;
/// What a squared byte of the cell bounds is worth.
pub const BOUND_UNIT: u32 = 17;
/// How far around the solid the domain is sure to reach.
pub const BAND: u32 = 18;
/// Bounds of the surface, relative to the middle of the cube: least corner, then greatest.
pub const LOW: u32 = 19;
pub const HIGH: u32 = 22;
/// Half extents of a box; half height and radius of what is round.
pub const SIZES: u32 = 25;
/// Row of the first root, [`tetrahedra::ROWS`](super::tetrahedra::ROWS) each.
pub const TETRAHEDRA: u32 = 28;
/// Row of the first box of the tree that finds the tetrahedra of a conforming domain: least corner, greatest corner.
pub const TREE_BOXES: u32 = 29;
/// Word of its first node: where to go on when the box is left out, and the tetrahedron of a leaf, else [`NONE`].
pub const TREE: u32 = 30;
/// Number of its nodes; 0 for the bisection domain.
pub const TREE_NODES: u32 = 31;

/// Of a conforming domain, for shapes whose vertices move: word of the three vertices of the first face, of the four of the first tetrahedron, of the
/// levels of the face tree and of the tree over tetrahedra.
pub const FACE_VERTICES: u32 = 32;
pub const TET_VERTICES: u32 = 33;
pub const FACE_LEVELS: u32 = 34;
pub const TREE_LEVELS: u32 = 35;
/// Number of vertices, of the mesh and of the domain.
pub const VERTEX_COUNT: u32 = 36;
/// The lowest vertex that was moved to where nothing can be; [`NONE`] when all is well.
pub const BAD_VERTEX: u32 = 37;
/// Row of a ball inside of the shape: middle and radius; 0 without one, negative when the vertices have moved here, so that the middle need not be
/// inside.
pub const INNER_BALL: u32 = 38;

/// No such array, or no cell.
pub const NONE: u32 = u32::MAX;

/// An encoded mesh.
pub const MESH: u32 = 0;
/// z ≤ 0.
pub const PLANE: u32 = 1;
/// A box.
pub const BOX: u32 = 2;
/// A sphere or a capsule.
pub const ROUND: u32 = 3;

/// Bits of a face's hints above those of [`SignHints`](tesdf::asset::layout::SignHints): the corners that no face before it has.
pub const OWNED_CORNERS: u32 = 16;

/// Hints are the low bits of a number from 1 to 2: a shader may take numbers that are nearly zero for zero.
pub const HINTS: u32 = 0x3F80_0000;

/// A word of a shape's table.
#[cube]
pub fn entry(assets: &Assets, shape: u32, #[comptime] at: u32) -> u32 {
    assets.table[(shape * STRIDE + at) as usize]
}

/// The same as a number.
#[cube]
pub fn number(assets: &Assets, shape: u32, #[comptime] at: u32) -> f32 {
    f32::reinterpret(entry(assets, shape, at))
}

/// Three of them.
#[cube]
pub fn vector(assets: &Assets, shape: u32, #[comptime] at: u32) -> V3 {
    v3(number(assets, shape, at), number(assets, shape, at + 1), number(assets, shape, at + 2))
}

/// Whether the domain is a conforming one: its roots are tetrahedra of their own, not the six of the cube.
#[cube]
pub fn is_conforming(assets: &Assets, shape: u32) -> bool {
    entry(assets, shape, TREE_NODES) > 0u32
}

/// Byte `at` of an array of bytes that begins at word `start`.
#[cube]
pub fn byte(words: &[u32], start: u32, at: u32) -> u32 {
    (words[(start + at / 4u32) as usize] >> (8u32 * (at % 4u32))) & 255u32
}

/// The half word at byte `at`, at any alignment.
#[cube]
pub fn half(words: &[u32], start: u32, at: u32) -> u32 {
    byte(words, start, at) | (byte(words, start, at + 1u32) << 8u32)
}
