//! The output of the middle phase for the narrow phase: nodes with their cells, and polygons.
//!
//! Mirrors `collide/detect/candidates.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::bodies::polygon::{Cut, CutExpand};
use crate::kernels::counters::{Counters, POLYGONS};
use crate::kernels::detect::ordered_pair::{OrderedPair, OrderedPairs, Part};
use crate::kernels::geometry::vector::{Row, row};
use crate::kernels::scene::shape::Shapes;

/// A list of nodes, or of polygons without their vertices.
#[derive(CubeType, CubeLaunch)]
pub struct Items {
    /// [`WORDS`] words for each: ordered pair, face of a, cell, number.
    pub words: Box<[u32]>,
    /// Capacity of the list.
    pub room: u32,
}

/// Polygons: parts of faces clipped by cells.
#[derive(CubeType, CubeLaunch)]
pub struct Polygons {
    pub items: Items,
    /// [`ROWS`] rows for each: the vertices, two per row, as weights of the second and the third
    /// corner of the face.
    pub weights: Box<[Row]>,
}

/// Words of an item.
pub const WORDS: u32 = 4;
/// Rows of a polygon.
pub const ROWS: usize = 4;
/// Capacity for the vertices of a polygon. A triangle that is clipped by a tetrahedron has at most
/// seven.
pub const MAX_VERTICES: usize = 8;

/// The weights of a whole face. Where the items are whole faces, the buffer holds these alone.
pub const WHOLE: [[f32; 4]; ROWS] = [[0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0; 4], [0.0; 4]];

/// A node, a polygon or a whole face.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Item {
    /// The ordered pair.
    pub pair: u32,
    /// The face of the first instance.
    pub face: u32,
    /// The cell in the field of the second instance; [`NONE`](crate::kernels::scene::shape::NONE)
    /// outside of the domain.
    pub cell: u32,
    /// For a node the corner of the face, otherwise the number of vertices.
    pub number: u32,
}

/// A face in the frame of the field.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Subject {
    pub pair: OrderedPair,
    pub face: u32,
    pub part: Part,
    /// Contact distance for the part: smaller distances are contacts.
    pub reach: f32,
}

/// A face of the first shape of a pair, in the frame of the field.
#[cube]
pub fn subject_of(shapes: &Shapes, pairs: &OrderedPairs, pair: OrderedPair, face: u32) -> Subject {
    let part = shapes.part(pair, face);
    Subject { pair, face, part, reach: pairs.reach_of(pair, part) }
}

/// A point of a face: the weights of its second and third corner.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Weights {
    pub s: f32,
    pub t: f32,
}

#[cube]
impl Items {
    pub fn get(&self, item: u32) -> Item {
        let at = (item * WORDS) as usize;
        Item {
            pair: self.words[at],
            face: self.words[at + 1],
            cell: self.words[at + 2],
            number: self.words[at + 3],
        }
    }

    pub fn put(&mut self, at: u32, item: Item) {
        let at = (at * WORDS) as usize;
        self.words[at] = item.pair;
        self.words[at + 1] = item.face;
        self.words[at + 2] = item.cell;
        self.words[at + 3] = item.number;
    }
}

#[cube]
impl Polygons {
    /// Vertex `i` of polygon `item`.
    pub fn vertex(&self, item: u32, i: u32) -> Weights {
        let row = self.weights[(item * comptime!(ROWS as u32) + i / 2u32) as usize];
        let is_first = i % 2u32 == 0u32;
        Weights {
            s: select(is_first, row.extract(0usize), row.extract(2usize)),
            t: select(is_first, row.extract(1usize), row.extract(3usize)),
        }
    }
}

#[cube]
impl Cut {
    /// Appends a polygon of a face.
    pub fn write(&self, polygons: &mut Polygons, counters: &Counters, subject: Subject, cell: u32) {
        let at = counters.append(POLYGONS);
        if at < polygons.items.room {
            // Rounding may leave more than eight vertices. The additional ones lie almost on a line
            // with their neighbours, so the first eight cover the polygon.
            let number = self.count.min(comptime!(MAX_VERTICES as u32));
            polygons.items.put(at, Item { pair: subject.pair.number, face: subject.face, cell, number });
            let first = at as usize * ROWS;
            let mut k = 0usize;
            while k < ROWS {
                polygons.weights[first + k] = row(
                    self.s[2usize * k],
                    self.t[2usize * k],
                    self.s[2usize * k + 1usize],
                    self.t[2usize * k + 1usize],
                );
                k += 1usize;
            }
        }
    }
}
