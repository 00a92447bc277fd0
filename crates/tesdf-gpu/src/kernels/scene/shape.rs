//! The shapes of a scene in buffers, and the field of a shape. This file defines the layout of the
//! table for the host, which writes it, and for the kernels, which read it.
//!
//! Mirrors `collide/scene/shape.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::geometry::triangle::{Face, ROWS as FACE_ROWS, read_face};
use crate::kernels::geometry::vector::{Row, V3, from_bits, last, pick, v3, xyz};

/// The shapes of a scene in three buffers. All instances share them.
#[derive(CubeType, CubeLaunch)]
pub struct Shapes {
    /// [`STRIDE`] words for each shape: its kind, and the starts of its arrays.
    pub table: Box<[u32]>,
    /// Arrays of words, bytes and half words.
    pub words: Box<[u32]>,
    /// Arrays of rows.
    pub rows: Box<[Row]>,
    /// The rules that some shape needs. Kernels are compiled without the others, which take
    /// registers.
    #[cube(comptime)]
    pub rules: Rules,
}

/// The fans of the vertices of meshes: the faces that have a vertex.
#[derive(CubeType, CubeLaunch)]
pub struct Fans {
    /// For each mesh, two words for each vertex: the word of its first face, and the bits of the
    /// distance from it within which there are only these faces, negative where they are not
    /// convex, and 0 where this is not known. Then the end of the last fan, and the faces.
    pub words: Box<[u32]>,
}

#[cube]
impl Fans {
    pub fn word(&self, at: u32) -> u32 {
        self.words[at as usize]
    }
}

/// What kernels need to know about the sides of shapes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Rules {
    /// Whether any shape is told by a rule at points.
    pub at_points: bool,
    /// Whether the side of any shape changes where there is no face.
    pub jumps: bool,
    /// Whether any shape has faces with the inside in front of them.
    pub turned: bool,
}

/// Words in the table for each shape: a multiple of 16, with which kernels take fewer registers
/// (`docs/gpu/measurements.md`).
pub const STRIDE: u32 = 48;

/// The kind: [`MESH`], [`PLANE`], [`BOX`] or [`ROUND`].
pub const KIND: u32 = 0;
/// Word of the node of the forest's first root.
pub const NODES: u32 = 1;
/// First word of the bytes of the lists.
pub const LISTS: u32 = 2;
/// Word with the start of the first palette.
pub const PALETTE_STARTS: u32 = 3;
/// First word of the low halves of the palette faces.
pub const PALETTES: u32 = 4;
/// First word of the high bytes of the palette faces; [`NONE`] when there are none.
pub const PALETTES_HIGH: u32 = 5;
/// First word of the bytes of the cell bounds.
pub const BOUNDS: u32 = 6;
/// Word of the first child in the face tree.
pub const CHILDREN: u32 = 7;
/// Row of the first face.
pub const RECORDS: u32 = 8;
/// Row of the first boxes of the face tree. A node has three rows.
pub const BOXES: u32 = 9;
/// Row of the first meshlet's ball: center and radius.
pub const MESHLETS: u32 = 10;
/// Word of the first meshlet's faces. A meshlet has two words: first face and number of faces.
pub const MESHLET_FACES: u32 = 11;
/// Number of meshlets.
pub const MESHLET_COUNT: u32 = 12;
/// Number of faces.
pub const FACE_COUNT: u32 = 13;
/// 1 when every list is exact, otherwise 0.
pub const EXACT_LISTS: u32 = 14;
/// Side of the cube.
pub const SIDE: u32 = 15;
/// Inverse of the cube's side.
pub const INVERSE_SIDE: u32 = 16;
/// Unit of the cell bounds: a bound is this distance times the square of the byte.
pub const BOUND_UNIT: u32 = 17;
/// Least distance around the solid up to which the domain reaches.
pub const BAND: u32 = 18;
/// Minimum corner of the bounds of the solid, relative to the center of the cube: three words. For
/// a sheet, half of its thickness is around the faces, and for an open mesh [`REACH_BEYOND`].
pub const LOW: u32 = 19;
/// Maximum corner, in the same way.
pub const HIGH: u32 = 22;
/// Three words: half extents of a box; or half height and radius of a capsule. A sphere has half
/// height 0.
pub const SIZES: u32 = 25;
/// Row of the first root. Each root has
/// [`tetrahedra::ROWS`](crate::kernels::query::tetrahedra::ROWS) rows.
pub const TETRAHEDRA: u32 = 28;
/// Row of the first box in the tree over the tetrahedra of a conforming domain: minimum corner,
/// maximum corner.
pub const TREE_BOXES: u32 = 29;
/// Word of the first node in this tree. The first word of a node is the index after its last
/// descendant. The second is the tetrahedron of a leaf, otherwise [`NONE`].
pub const TREE: u32 = 30;
/// Number of nodes in this tree; 0 for the bisection domain.
pub const TREE_NODES: u32 = 31;

/// Word of the first face's vertices. A face has three.
pub const FACE_VERTICES: u32 = 32;

// The following entries, up to that of the lowest bad vertex, belong to conforming domains, whose
// vertices may move.

/// Word of the first tetrahedron's vertices. A tetrahedron has four.
pub const TET_VERTICES: u32 = 33;
/// First word of the levels of the face tree: see [`refit`](crate::kernels::deform::refit::refit).
pub const FACE_LEVELS: u32 = 34;
/// First word of the levels of the tree over tetrahedra, in the same layout.
pub const TREE_LEVELS: u32 = 35;
/// Number of vertices of the mesh and the domain.
pub const VERTEX_COUNT: u32 = 36;
/// The lowest vertex that was moved to a position that is not finite or too far away; [`NONE`] when
/// there is none.
pub const BAD_VERTEX: u32 = 37;
/// Row of a ball inside the shape: center and radius. The radius is 0 when there is no ball. It is
/// negative after vertices have moved, because the center may then be outside.
pub const INNER_BALL: u32 = 38;
/// Half of the thickness of a sheet in the local frame; 0 for other meshes. Simple shapes have 0.
pub const HALF_THICKNESS: u32 = 39;
/// What tells the side of points in crossing cells: see [`rule`](crate::kernels::query::sign).
pub const RULE: u32 = 40;
/// Row of the first triangle that counts for the side alone, in the layout of faces.
pub const SIGN_TRIANGLES: u32 = 41;
/// Number of these triangles.
pub const SIGN_COUNT: u32 = 42;
/// Number of those among them that close an open mesh; they are the last ones. Each begins with an
/// open edge.
pub const CLOSING_COUNT: u32 = 43;
/// How far the inside of an open mesh can extend beyond the bounds of its faces; otherwise 0.
pub const REACH_BEYOND: u32 = 44;
/// 1 when faces may have the inside in front of them, otherwise 0.
pub const TURNED: u32 = 45;
/// Word of the first vertex in the buffer of [`Fans`]. [`NONE`] where faces do not enclose the
/// solid: such surfaces have no normal cones.
pub const FANS: u32 = 46;
/// Diagonal of the bounds; 0 for a plane.
pub const DIAGONAL: u32 = 47;

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

/// First bit of the owned corners of a face. These bits lie above those of
/// [`SignHints`](tesdf::asset::layout::SignHints). A face owns the corners that no face before it
/// has.
pub const OWNED_CORNERS: u32 = 16;

/// Bits above the owned corners. They make the hints, read as `f32`, a number from 1 to 2, because
/// a shader may flush tiny numbers to zero.
pub const HINTS: u32 = 0x3F80_0000;

/// The field of a shape: gives access to its arrays.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Field<'a> {
    pub shapes: &'a Shapes,
    /// First word of the shape in the table.
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
    /// Word `at` of the shape in the table.
    pub fn entry(self, #[comptime] at: u32) -> u32 {
        self.shapes.table[(self.entry + at) as usize]
    }

    /// Entry `at` of the table as an `f32`.
    pub fn number(self, #[comptime] at: u32) -> f32 {
        from_bits(self.entry(at))
    }

    /// Three entries of the table, from `at` on, as a vector.
    pub fn vector(self, #[comptime] at: u32) -> V3 {
        v3(self.number(at), self.number(at + 1), self.number(at + 2))
    }

    /// Word `at` of the arrays.
    pub fn word(self, at: u32) -> u32 {
        self.shapes.words[at as usize]
    }

    /// Row `at` of the arrays.
    pub fn row(self, at: u32) -> Row {
        self.shapes.rows[at as usize]
    }

    /// Byte `at` of the bytes that begin at word `start`.
    pub fn byte(self, start: u32, at: u32) -> u32 {
        (self.word(start + at / 4u32) >> (8u32 * (at % 4u32))) & 255u32
    }

    /// The half word at byte `at` of the bytes that begin at word `start`. It needs no alignment.
    pub fn half(self, start: u32, at: u32) -> u32 {
        self.byte(start, at) | (self.byte(start, at + 1u32) << 8u32)
    }

    pub fn is_mesh(self) -> bool {
        self.entry(KIND) == MESH
    }

    /// Whether the roots are the tetrahedra of a conforming domain. Otherwise they are the six
    /// roots of the cube.
    pub fn is_conforming(self) -> bool {
        self.entry(TREE_NODES) > 0u32
    }

    /// Half of the thickness of a sheet, whose field is the distance to its faces; otherwise 0.
    pub fn half_thickness(self) -> f32 {
        self.number(HALF_THICKNESS)
    }

    /// Whether distances to listed faces are distances to the surface.
    pub fn has_exact_lists(self) -> bool {
        self.entry(EXACT_LISTS) == 1u32
    }

    /// The face with this index.
    pub fn face(self, position: u32) -> Face {
        read_face(&self.shapes.rows, self.entry(RECORDS) + position * FACE_ROWS)
    }

    /// The bounds of a bounded shape. A plane has none.
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

    /// The first face of a meshlet. A simple shape has one meshlet.
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
