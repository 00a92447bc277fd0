//! Barycentric coordinates of a face's three corners.
use cubecl::prelude::*;

use crate::kernels::bodies::level_bits::{Bits, BitsExpand};
use crate::kernels::bodies::polygon::Cut;
use crate::kernels::detect::ordered_pair::Part;
use crate::kernels::geometry::vector::{V3, v3};
use crate::kernels::query::locate::Lambda;
use crate::kernels::query::tetrahedra::Tetrahedron;

/// Coordinates of a face's corners in a cell.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Corners {
    pub a: Lambda,
    pub b: Lambda,
    pub c: Lambda,
}

/// Whether no corner is above the plane, and at least one is below it.
#[cube]
fn is_out(heights: V3) -> bool {
    let greatest = heights.greatest();
    greatest < 0.0f32 || (greatest <= 0.0f32 && heights.least() < 0.0f32)
}

/// Picks by the number of levels that are left: one, two, or three and more.
#[cube]
fn pick_lambda(left: u32, one: Lambda, two: Lambda, three: Lambda) -> Lambda {
    Lambda {
        l0: select(left == 1u32, one.l0, select(left == 2u32, two.l0, three.l0)),
        l1: select(left == 1u32, one.l1, select(left == 2u32, two.l1, three.l1)),
        l2: select(left == 1u32, one.l2, select(left == 2u32, two.l2, three.l2)),
        l3: select(left == 1u32, one.l3, select(left == 2u32, two.l3, three.l3)),
    }
}

/// The coordinates of a part's corners in a root.
#[cube]
pub fn corners_in(root: Tetrahedron, part: Part) -> Corners {
    Corners { a: root.lambda(part.a), b: root.lambda(part.b), c: root.lambda(part.c) }
}

#[cube]
impl Corners {
    /// Heights of the corners above a side of the cell, relative to the height of the opposite
    /// corner.
    pub fn over(self, side: u32) -> V3 {
        v3(over(self.a, side), over(self.b, side), over(self.c, side))
    }

    /// Whether the face lies entirely outside of one side of the cell.
    pub fn is_separate(self) -> bool {
        is_out(v3(self.a.l0, self.b.l0, self.c.l0))
            || is_out(v3(self.a.l1, self.b.l1, self.c.l1))
            || is_out(v3(self.a.l2, self.b.l2, self.c.l2))
            || is_out(v3(self.a.l3, self.b.l3, self.c.l3))
    }

    /// Whether the face lies entirely in the cell.
    pub fn is_within(self) -> bool {
        self.a.least().min(self.b.least()).min(self.c.least()) >= 0.0f32
    }

    /// Coordinates in child 0 (or in child 1 when `second` is true) of a cell whose refinement edge
    /// ends at corner `k`.
    pub fn in_child(self, k: u32, second: bool) -> Corners {
        Corners {
            a: self.a.in_child(k, second),
            b: self.b.in_child(k, second),
            c: self.c.in_child(k, second),
        }
    }

    /// Heights above the plane that bisects the cell. Child 0 is above the plane.
    pub fn over_bisection(self, k: u32) -> V3 {
        v3(self.a.l0 - self.a.at(k), self.b.l0 - self.b.at(k), self.c.l0 - self.c.at(k))
    }

    /// Cuts the polygon of the face to the part in the cell.
    pub fn clip(self, polygon: &mut Cut) {
        polygon.cut(v3(self.a.l0, self.b.l0, self.c.l0), 1.0f32);
        polygon.cut(v3(self.a.l1, self.b.l1, self.c.l1), 1.0f32);
        polygon.cut(v3(self.a.l2, self.b.l2, self.c.l2), 1.0f32);
        polygon.cut(v3(self.a.l3, self.b.l3, self.c.l3), 1.0f32);
    }
}

#[cube]
fn over(l: Lambda, side: u32) -> f32 {
    select(side == 0u32, l.l0, l.at(side))
}

#[cube]
impl Bits {
    /// Coordinates in a cell, from those in its root. The first `depth` bits of the path lead to
    /// the cell.
    pub fn follow(&self, root: Corners, depth: u32) -> Corners {
        self.follow_from(root, 0u32, depth)
    }

    /// Coordinates in a cell, from those in the cell at level `from` of its path, a multiple of 3.
    pub fn follow_from(&self, kept: Corners, from: u32, depth: u32) -> Corners {
        let mut held = kept;
        // Each turn descends three levels, each with its own refinement edge.
        let mut level = from;
        while level < depth {
            let one = held.in_child(3u32, self.get(level));
            let two = one.in_child(2u32, self.get(level + 1u32));
            let three = two.in_child(1u32, self.get(level + 2u32));
            let left = depth - level;
            held = Corners {
                a: pick_lambda(left, one.a, two.a, three.a),
                b: pick_lambda(left, one.b, two.b, three.b),
                c: pick_lambda(left, one.c, two.c, three.c),
            };
            level += 3u32;
        }
        held
    }
}
