//! The shapes of a scene in buffers, and the field of one of them. The table's layout is defined here, for the host that
//! writes and the kernels that read.
use cubecl::prelude::*;

use super::super::math::triangle::{Face, ROWS as FACE_ROWS, read_face};
use super::super::math::vector::{Row, V3, from_bits, last, pick, v3, xyz};

/// The shapes of a scene: three buffers, shared by all instances.
#[derive(CubeType, CubeLaunch)]
pub struct Shapes {
    /// [`STRIDE`] words a shape: its kind and where its arrays begin.
    pub table: Box<[u32]>,
    /// Arrays of words, of bytes and of half words.
    pub words: Box<[u32]>,
    /// Arrays of rows.
    pub rows: Box<[Row]>,
}

/// Words of a shape in the table.
pub const STRIDE: u32 = 40;

/// [`MESH`], [`PLANE`], [`BOX`] or [`ROUND`].
pub const KIND: u32 = 0;
/// Word of the forest's first root.
pub const NODES: u32 = 1;
/// Word where the bytes of the lists begin.
pub const LISTS: u32 = 2;
/// Word of the first palette's start.
pub const PALETTE_STARTS: u32 = 3;
/// Word where the low halves of the palette faces begin.
pub const PALETTES: u32 = 4;
/// Word where their high bytes begin; [`NONE`] without them.
pub const PALETTES_HIGH: u32 = 5;
/// Word where the bytes of the cell bounds begin.
pub const BOUNDS: u32 = 6;
/// Word of the face tree's first child.
pub const CHILDREN: u32 = 7;
/// Row of the first face.
pub const RECORDS: u32 = 8;
/// Row of the face tree's first boxes, three rows a node.
pub const BOXES: u32 = 9;
/// Row of the first meshlet's ball: center and radius.
pub const MESHLETS: u32 = 10;
/// Word of the first meshlet's first face and number of faces.
pub const MESHLET_FACES: u32 = 11;
/// Number of meshlets.
pub const MESHLET_COUNT: u32 = 12;
/// Number of faces.
pub const FACE_COUNT: u32 = 13;
/// 1 when every list is exact.
pub const EXACT_LISTS: u32 = 14;
/// Side of the cube.
pub const SIDE: u32 = 15;
/// Inverse of the side of the cube.
pub const INVERSE_SIDE: u32 = 16;
/// The distance that a byte of the cell bounds is squared and multiplied with.
pub const BOUND_UNIT: u32 = 17;
/// How far around the solid the domain reaches at least.
pub const BAND: u32 = 18;
/// Least corner of the surface's bounds, relative to the middle of the cube: three words.
pub const LOW: u32 = 19;
/// Greatest corner, likewise.
pub const HIGH: u32 = 22;
/// Half extents of a box; half height and radius of a capsule, of which a sphere has no height: three words.
pub const SIZES: u32 = 25;
/// Row of the first root, [`tetrahedra::ROWS`](super::tetrahedra::ROWS) each.
pub const TETRAHEDRA: u32 = 28;
/// Row of the first box of the tree over the tetrahedra of a conforming domain: least corner, greatest corner.
pub const TREE_BOXES: u32 = 29;
/// Word of its first node: the node after all that is below, and the tetrahedron of a leaf, else [`NONE`].
pub const TREE: u32 = 30;
/// Number of its nodes; 0 for the bisection domain.
pub const TREE_NODES: u32 = 31;

// Of conforming domains, whose vertices may move.

/// Word of the three vertices of the first face.
pub const FACE_VERTICES: u32 = 32;
/// Word of the four vertices of the first tetrahedron.
pub const TET_VERTICES: u32 = 33;
/// Word of the levels of the face tree: see [`refit`](super::super::deform::refit::refit).
pub const FACE_LEVELS: u32 = 34;
/// Word of the levels of the tree over tetrahedra, likewise.
pub const TREE_LEVELS: u32 = 35;
/// Number of vertices, of the mesh and of the domain.
pub const VERTEX_COUNT: u32 = 36;
/// The lowest vertex that was moved to a position that is not finite or too far away; [`NONE`] when there is none.
pub const BAD_VERTEX: u32 = 37;
/// Row of a ball inside of the shape: center and radius. The radius is 0 without a ball, and negative once vertices have
/// moved, as the center then need not be inside.
pub const INNER_BALL: u32 = 38;

/// No such array, face, cell or vertex.
pub const NONE: u32 = u32::MAX;

/// An encoded mesh.
pub const MESH: u32 = 0;
/// The half space z ≤ 0.
pub const PLANE: u32 = 1;
/// A box.
pub const BOX: u32 = 2;
/// A sphere or a capsule.
pub const ROUND: u32 = 3;

/// First bit of a face's owned corners, above the bits of [`SignHints`](tesdf::asset::layout::SignHints): the corners
/// that no face before it has.
pub const OWNED_CORNERS: u32 = 16;

/// Bits above those, with which the hints are a number from 1 to 2: a shader may read tiny numbers as zero.
pub const HINTS: u32 = 0x3F80_0000;

/// One shape: where its arrays lie in the buffers.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Field<'a> {
    shapes: &'a Shapes,
    /// First word in the table.
    entry: u32,
}

/// A ball.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Ball {
    pub center: V3,
    pub radius: f32,
}

/// An axis-aligned box.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Bounds {
    pub low: V3,
    pub high: V3,
}

#[cube]
impl Shapes {
    /// The field of a shape.
    pub fn field<'a>(&'a self, shape: u32) -> Field<'a> {
        Field::<'a> { shapes: self, entry: shape * STRIDE }
    }
}

#[cube]
impl Field<'_> {
    /// A word of the table.
    pub fn entry(self, #[comptime] at: u32) -> u32 {
        self.shapes.table[(self.entry + at) as usize]
    }

    /// The same as a number.
    pub fn number(self, #[comptime] at: u32) -> f32 {
        from_bits(self.entry(at))
    }

    /// Three of them.
    pub fn vector(self, #[comptime] at: u32) -> V3 {
        v3(self.number(at), self.number(at + 1), self.number(at + 2))
    }

    /// A word of the arrays.
    pub fn word(self, at: u32) -> u32 {
        self.shapes.words[at as usize]
    }

    /// A row of the arrays.
    pub fn row(self, at: u32) -> Row {
        self.shapes.rows[at as usize]
    }

    /// Byte `at` of the bytes that begin at word `start`.
    pub fn byte(self, start: u32, at: u32) -> u32 {
        (self.word(start + at / 4u32) >> (8u32 * (at % 4u32))) & 255u32
    }

    /// The half word at byte `at`, at any alignment.
    pub fn half(self, start: u32, at: u32) -> u32 {
        self.byte(start, at) | (self.byte(start, at + 1u32) << 8u32)
    }

    pub fn is_mesh(self) -> bool {
        self.entry(KIND) == MESH
    }

    /// Whether the roots are the tetrahedra of a conforming domain, not the six of the cube.
    pub fn is_conforming(self) -> bool {
        self.entry(TREE_NODES) > 0u32
    }

    /// Whether distances of lists are those of the surface.
    pub fn has_exact_lists(self) -> bool {
        self.entry(EXACT_LISTS) == 1u32
    }

    /// The face at a position.
    pub fn face(self, position: u32) -> Face {
        read_face(&self.shapes.rows, self.entry(RECORDS) + position * FACE_ROWS)
    }

    /// The bounds of a body that has an end: not of a plane.
    pub fn bounds(self) -> Bounds {
        let kind = self.entry(KIND);
        let sizes = self.vector(SIZES);
        let half = pick(kind == BOX, sizes, v3(sizes.y, sizes.y, sizes.x + sizes.y));
        let is_mesh = kind == MESH;
        Bounds {
            low: pick(is_mesh, self.vector(LOW), half.negated()),
            high: pick(is_mesh, self.vector(HIGH), half),
        }
    }

    /// The ball of a meshlet.
    pub fn meshlet_ball(self, meshlet: u32) -> Ball {
        let row = self.row(self.entry(MESHLETS) + meshlet);
        Ball { center: xyz(row), radius: last(row) }
    }

    /// The ball of [`INNER_BALL`].
    pub fn inner_ball(self) -> Ball {
        let row = self.row(self.entry(INNER_BALL));
        Ball { center: xyz(row), radius: last(row) }
    }

    /// The first face of a meshlet; simple shapes have one meshlet.
    pub fn first_face(self, meshlet: u32) -> u32 {
        let mut face = 0u32;
        if self.is_mesh() {
            face = self.word(self.entry(MESHLET_FACES) + 2u32 * meshlet);
        }
        face
    }

    /// The number of faces of a meshlet.
    pub fn faces_of(self, meshlet: u32) -> u32 {
        let mut count = self.entry(FACE_COUNT);
        if self.is_mesh() {
            count = self.word(self.entry(MESHLET_FACES) + 2u32 * meshlet + 1u32);
        }
        count
    }
}
