//! The buffer of contacts.
//!
//! Mirrors `collide/report/contact.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::counters::{CONTACTS, Counters};
use crate::kernels::detect::ordered_pair::OrderedPair;
use crate::kernels::geometry::vector::{Row, V3, last, row_of, to_bits, xyz};
use crate::kernels::query::value::Value;

/// Contacts, or the contacts that a reduction keeps.
#[derive(CubeType, CubeLaunch)]
pub struct Contacts {
    /// [`WORDS`] words for each: instances a and b, face of a, cell, face of b, feature of this
    /// face, corner of a plus [`CONVERGED`], ordered pair.
    pub words: Box<[u32]>,
    /// [`ROWS`] rows for each, in the field's frame: point of a and distance; gradient and its
    /// cosine with the face's normal; point of b.
    pub rows: Box<[Row]>,
    /// Capacity of the list.
    pub room: u32,
}

/// Words of a contact.
pub const WORDS: u32 = 8;
/// Rows of a contact.
pub const ROWS: u32 = 3;
/// The corner of a contact that is at no corner of its face, or where this does not matter.
pub const NO_CORNER: u32 = 3;
/// Added to the corner of a contact when the search for its minimum has converged.
pub const CONVERGED: u32 = 4;

/// A part of a surface in a cell, and the point of the part with the least signed distance.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Touch {
    pub face: u32,
    /// The number of the cell; [`NONE`](crate::kernels::scene::shape::NONE) without a list.
    pub cell: u32,
    /// The corner of the part that the point is, or [`NO_CORNER`], plus [`CONVERGED`] when the
    /// search has converged.
    pub corner: u32,
    pub point: V3,
    /// Cosine between the gradient and the face's normal; 0 for nodes.
    pub cosine: f32,
}

/// The key by which the contacts of a pair of instances are ordered. Contacts with equal keys are
/// ordered by the bits of their points.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Name {
    /// 0 for the first ordered pair of two instances, 1 for the second.
    pub order: u32,
    pub face: u32,
    pub cell: u32,
    pub corner: u32,
}

/// Result of a comparison: 0 undecided, 1 the first comes before, 2 it comes after.
#[cube]
pub fn compare(order: u32, a: u32, b: u32) -> u32 {
    select(order == 0u32, select(a < b, 1u32, select(a > b, 2u32, 0u32)), order)
}

/// Two instances, or two faces.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Both {
    pub a: u32,
    pub b: u32,
}

#[cube]
impl Contacts {
    /// Appends a contact.
    pub fn append(&mut self, counters: &Counters, pair: OrderedPair, touch: Touch, v: Value) {
        let at = counters.append(CONTACTS);
        if at < self.room {
            let word = (at * WORDS) as usize;
            self.words[word] = pair.a;
            self.words[word + 1] = pair.b;
            self.words[word + 2] = touch.face;
            self.words[word + 3] = touch.cell;
            self.words[word + 4] = v.face;
            self.words[word + 5] = v.feature;
            self.words[word + 6] = touch.corner;
            self.words[word + 7] = pair.number;
            let row = (at * ROWS) as usize;
            let on_surface = touch.point + v.gradient * -pair.own_radius;
            self.rows[row] = row_of(on_surface, v.distance - pair.radius);
            self.rows[row + 1] = row_of(v.gradient, touch.cosine);
            self.rows[row + 2] = row_of(v.point + v.gradient * (pair.radius - pair.own_radius), 0.0f32);
        }
    }

    /// The ordered pair of a contact.
    pub fn pair(&self, contact: u32) -> u32 {
        self.words[(contact * WORDS + 7u32) as usize]
    }

    pub fn has_converged(&self, contact: u32) -> bool {
        self.words[(contact * WORDS + 6u32) as usize] >= CONVERGED
    }

    pub fn name(&self, contact: u32) -> Name {
        let at = (contact * WORDS) as usize;
        Name {
            order: self.words[at + 7] % 2u32,
            face: self.words[at + 2],
            cell: self.words[at + 3],
            corner: self.words[at + 6],
        }
    }

    /// Compares two contacts of one pair of instances by their names, and then by the bits of their
    /// points. `order` is the result of comparisons before.
    pub fn compare_names(&self, order: u32, x: u32, y: u32) -> u32 {
        let (a, b) = (self.name(x), self.name(y));
        let (p, q) = (self.point(x), self.point(y));
        let mut order = compare(order, a.order, b.order);
        order = compare(order, a.face, b.face);
        order = compare(order, a.cell, b.cell);
        order = compare(order, a.corner, b.corner);
        order = compare(order, to_bits(p.x), to_bits(q.x));
        order = compare(order, to_bits(p.y), to_bits(q.y));
        compare(order, to_bits(p.z), to_bits(q.z))
    }

    /// The faces of a contact: of both shapes.
    pub fn faces(&self, contact: u32) -> Both {
        let at = (contact * WORDS) as usize;
        Both { a: self.words[at + 2], b: self.words[at + 4] }
    }

    /// The instances of a contact: that of the surface, and that of the field.
    pub fn instances(&self, contact: u32) -> Both {
        let at = (contact * WORDS) as usize;
        Both { a: self.words[at], b: self.words[at + 1] }
    }

    /// The point of a and the distance of a contact.
    pub fn point_and_distance(&self, contact: u32) -> Row {
        self.rows[(contact * ROWS) as usize]
    }

    pub fn point(&self, contact: u32) -> V3 {
        xyz(self.point_and_distance(contact))
    }

    pub fn distance(&self, contact: u32) -> f32 {
        last(self.point_and_distance(contact))
    }

    /// The gradient, or the normal that [`turn`](Self::turn) has put in its place.
    pub fn gradient(&self, contact: u32) -> V3 {
        xyz(self.rows[(contact * ROWS + 1u32) as usize])
    }

    /// Replaces the gradient by a normal. The cosine stays that of the gradient.
    pub fn turn(&mut self, contact: u32, normal: V3) {
        let at = (contact * ROWS + 1u32) as usize;
        let cosine = last(self.rows[at]);
        self.rows[at] = row_of(normal, cosine);
    }

    /// The point of b.
    pub fn closest(&self, contact: u32) -> V3 {
        xyz(self.rows[(contact * ROWS + 2u32) as usize])
    }

    /// Copies a contact of `other` to index `at`.
    pub fn copy(&mut self, at: u32, other: &Contacts, contact: u32) {
        let mut k = 0u32;
        while k < WORDS {
            self.words[(at * WORDS + k) as usize] = other.words[(contact * WORDS + k) as usize];
            k += 1u32;
        }
        k = 0u32;
        while k < ROWS {
            self.rows[(at * ROWS + k) as usize] = other.rows[(contact * ROWS + k) as usize];
            k += 1u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_difference_decides() {
        let of = |a: &[u32], b: &[u32]| a.iter().zip(b).fold(0, |order, (&a, &b)| compare(order, a, b));
        assert_eq!(
            [of(&[1, 2, 3], &[1, 2, 3]), of(&[1, 2, 9], &[1, 3, 0]), of(&[1, 4, 0], &[1, 3, 9])],
            [0, 1, 2]
        );
    }
}
