//! Finds the cell that holds a point. The search descends the bisection forest in barycentric
//! coordinates, from a root of the cube or of a conforming domain.
//!
//! [`tesdf::domain::Cell`] defines the bisection rule. In `f32`, a point has an error of 2^-24 of
//! the cube's side, which is far below the margin of the lists. At a border the search may find a
//! neighbour instead. The list of the neighbour is valid there, too.
//!
//! Mirrors `query/locate.rs` of `tesdf`.
use cubecl::prelude::*;
use tesdf::asset::layout;

use crate::kernels::geometry::vector::{V3, v3};
use crate::kernels::scene::shape::{BOUND_UNIT, BOUNDS, Field, FieldExpand, INVERSE_SIDE, NODES, NONE};

/// Barycentric coordinates of a point in a cell.
#[derive(CubeType, CubeTypeMut, Clone, Copy, Debug, PartialEq)]
#[expand(derive(Clone, Copy))]
pub struct Lambda {
    pub l0: f32,
    pub l1: f32,
    pub l2: f32,
    pub l3: f32,
}

/// A cell of the forest: its node word ([`tesdf::asset::layout::Node`]) and its number.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Cell {
    pub word: u32,
    /// [`NONE`] outside of all roots.
    pub number: u32,
}

/// The node word for points outside of all roots.
pub const NOT_OF_DOMAIN: u32 = layout::LEAF | layout::NOT_OF_DOMAIN << layout::CODE;
const LEAF: u32 = layout::LEAF;
const CODE: u32 = layout::CODE;
const CODES: u32 = layout::CODES;
const OFFSET: u32 = layout::MAX_LIST_OFFSET - 1;
const INSIDE: u32 = layout::INSIDE;
const CROSSING: u32 = layout::CROSSING;
const LONG_CROSSING: u32 = layout::LONG_CROSSING;
const FAR: u32 = layout::FAR;
const OUT: u32 = layout::NOT_OF_DOMAIN;

/// Whether the cell of this node word is bisected. The word then has the number of the first child.
#[cube]
pub fn is_split(word: u32) -> bool {
    word & LEAF == 0u32
}

#[cube]
impl Cell {
    /// The code of the label.
    pub fn code(self) -> u32 {
        (self.word >> CODE) & CODES
    }

    /// Byte at which the list begins. For a far cell: 1 inside, 0 outside.
    pub fn offset(self) -> u32 {
        self.word & OFFSET
    }

    /// Whether the whole cell is inside. It may have a list, or be a far cell.
    pub fn is_inside(self) -> bool {
        self.code() == INSIDE || (self.code() == FAR && self.offset() == 1u32)
    }

    /// Whether the surface passes through the cell or close to it.
    pub fn is_crossing(self) -> bool {
        self.code() >= CROSSING && self.code() <= LONG_CROSSING
    }

    /// The winding number at the centroid of a crossing cell. Valid when
    /// [`has_long_winding`](Self::has_long_winding) is false.
    pub fn short_winding(self) -> u32 {
        self.code() - CROSSING
    }

    /// Whether the winding number stands before the list.
    pub fn has_long_winding(self) -> bool {
        self.code() == LONG_CROSSING
    }

    /// Whether the cell has a list.
    pub fn is_listed(self) -> bool {
        self.code() <= LONG_CROSSING
    }

    /// Whether the point or cell is outside of the domain.
    pub fn is_out(self) -> bool {
        self.code() == OUT
    }

    /// The number by which contacts name the cell; [`NONE`] for a cell without a list.
    pub fn name(self) -> u32 {
        select(self.is_listed(), self.number, NONE)
    }
}

/// The cell for points outside of all roots.
#[cube]
pub fn no_cell() -> Cell {
    Cell { word: NOT_OF_DOMAIN.runtime(), number: NONE.runtime() }
}

/// The root that holds a point of the unit cube. It follows from the order of the coordinates.
#[cube]
pub fn root(u: V3) -> u32 {
    let xy = u.x >= u.y;
    let xz = u.x >= u.z;
    let yz = u.y >= u.z;
    let x_first = select(yz, 0u32, 1u32);
    let y_first = select(xz, 2u32, 3u32);
    let z_first = select(xy, 4u32, 5u32);
    select(xy && xz, x_first, select(yz && !xy, y_first, z_first))
}

/// The axes in the order of a root's edges, as in [`tesdf::domain::ROOTS`].
#[cube]
pub fn axes(root: u32) -> (u32, u32, u32) {
    let i = root / 2u32;
    // In even roots, the lower of the other two axes comes first.
    let low = select(i == 0u32, 1u32, 0u32);
    let high = select(i == 2u32, 1u32, 2u32);
    let even = root % 2u32 == 0u32;
    (i, select(even, low, high), select(even, high, low))
}

/// Coordinates of a point in a root of the cube. Root `r` follows the axes i, j, k.
#[cube]
pub fn in_root(u: V3, root: u32) -> Lambda {
    let (i, j, k) = axes(root);
    let (x, y, z) = (u.at(i), u.at(j), u.at(k));
    Lambda { l0: 1.0f32 - x, l1: x - y, l2: y - z, l3: z }
}

#[cube]
impl Lambda {
    /// Coordinate `k`, from 1 to 3.
    pub fn at(self, k: u32) -> f32 {
        select(k == 3u32, self.l3, select(k == 2u32, self.l2, self.l1))
    }

    /// Whether the point is in child 1 of a cell whose refinement edge ends at corner `k`.
    pub fn is_in_second(self, k: u32) -> bool {
        self.l0 < self.at(k)
    }

    /// Coordinates in child 0 (or in child 1 when `second` is true) of a cell whose refinement edge
    /// ends at corner `k`.
    pub fn in_child(self, k: u32, second: bool) -> Lambda {
        let a = self.l0;
        let b = self.at(k);
        let kept = select(second, b - a, a - b);
        let middle = 2.0f32 * select(second, a, b);
        let is3 = k == 3u32;
        let is2 = k == 2u32;
        // Order of the coordinates in child 0, and in child 1. k = 3: kept 1 2 middle, and 1 2 kept
        // middle. k = 2: kept 1 middle 3, and 1 kept middle 3. k = 1: kept middle 2 3 in both.
        let shifted = second && k > 1u32;
        let l1_of_2 = select(second, kept, self.l1);
        let l1_of_3 = select(second, self.l2, self.l1);
        let l2_of_3 = select(second, kept, self.l2);
        Lambda {
            l0: select(shifted, self.l1, kept),
            l1: select(is3, l1_of_3, select(is2, l1_of_2, middle)),
            l2: select(is3, l2_of_3, select(is2, middle, self.l2)),
            l3: select(is3, middle, self.l3),
        }
    }

    /// The smallest coordinate.
    pub fn least(self) -> f32 {
        self.l0.min(self.l1).min(self.l2).min(self.l3)
    }
}

#[cube]
pub fn no_lambda() -> Lambda {
    Lambda { l0: 0.0f32, l1: 0.0f32, l2: 0.0f32, l3: 0.0f32 }
}

/// A point and its cell during the descent.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Descent {
    pub cell: Cell,
    /// Coordinates of the point in the cell.
    pub lambda: Lambda,
    /// The corner at which the cell's refinement edge ends.
    pub k: u32,
}

#[cube]
impl Descent {
    /// Descends to a child of a bisected cell.
    pub fn descend(&mut self, field: Field<'_>, second: bool) {
        self.lambda = self.lambda.in_child(self.k, second);
        self.cell.number = self.cell.word + select(second, 1u32, 0u32);
        self.cell.word = field.cell_word(self.cell.number);
        self.k = next_k(self.k);
    }
}

/// The corner at which the refinement edge of a child ends.
#[cube]
pub fn next_k(k: u32) -> u32 {
    select(k == 1u32, 3u32, k - 1u32)
}

#[cube]
impl Field<'_> {
    /// Coordinates of a point in the cube, from 0 to 1.
    pub fn in_cube(self, p: V3) -> V3 {
        p * self.number(INVERSE_SIDE) + v3(0.5f32, 0.5f32, 0.5f32)
    }

    /// The node word of a cell.
    pub fn cell_word(self, number: u32) -> u32 {
        self.word(self.entry(NODES) + number)
    }

    /// The cell with this number. For [`NONE`] and simple shapes: the cell outside of the domain.
    pub fn cell(self, number: u32) -> Cell {
        let mut word = NOT_OF_DOMAIN.runtime();
        if number != NONE && self.is_mesh() {
            word = self.cell_word(number);
        }
        Cell { word, number }
    }

    /// The cell that holds a point. The point is relative to the center of the cube.
    pub fn locate(self, p: V3) -> Cell {
        let mut at = Descent { cell: no_cell(), lambda: no_lambda(), k: 3u32 };
        if self.is_conforming() {
            let held = self.root_holding(p);
            at.cell.number = held.root;
            at.lambda = held.lambda;
        } else {
            let u = self.in_cube(p);
            if u.least() >= 0.0f32 && u.greatest() <= 1.0f32 {
                at.cell.number = root(u);
                at.lambda = in_root(u, root(u));
            }
        }
        if at.cell.number != NONE {
            at.cell.word = self.cell_word(at.cell.number);
            while is_split(at.cell.word) {
                let second = at.lambda.is_in_second(at.k);
                at.descend(self, second);
            }
        }
        at.cell
    }

    /// Lower bound of the signed distance in a cell; 0 for a cell that may meet the solid.
    pub fn cell_bound(self, number: u32) -> f32 {
        let mut least = 0.0f32;
        if number != NONE {
            let step = self.byte(self.entry(BOUNDS), number) as f32;
            least = step * step * self.number(BOUND_UNIT);
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use tesdf::domain::{Barycentric, Cell as DomainCell};
    use tesdf::glam::DVec3;

    use super::*;
    use crate::kernels::query::winding::corners_of_root;

    fn lambda_of([l0, l1, l2, l3]: [f32; 4]) -> Lambda {
        Lambda { l0, l1, l2, l3 }
    }

    /// The root, the children and their corners are those of the processor. Points are whole
    /// multiples of 2^-12 of the side, where `f32` is exact, so that many lie on borders of cells,
    /// in edges and in corners.
    #[test]
    fn descents_are_those_of_the_processor() {
        let mut random = fastrand::Rng::with_seed(8);
        for case in 0..20_000u32 {
            let steps = 1u32 << [1, 2, 4, 12][case as usize % 4];
            let mut coordinate = || random.u32(0..=steps) as f32 / steps as f32;
            let u = v3(coordinate(), coordinate(), coordinate());
            let p = DVec3::new(u.x.into(), u.y.into(), u.z.into());
            let (expected_root, mut fixed) = Barycentric::in_unit_cube(p).expect("in the cube");
            let found = root(u);
            assert_eq!(found as usize, expected_root, "{p}");
            let mut cell = DomainCell::root(DVec3::ZERO, 1.0, expected_root);
            let mut corners = [0, 1, 2].map(|axis| corners_of_root(found, axis));
            let (mut lambda, mut k) = (in_root(u, found), 3);
            for depth in 0..24 {
                let second = lambda.is_in_second(k);
                let values = [lambda.l0, lambda.l1, lambda.l2, lambda.l3];
                let child =
                    DomainCell::lambda_of_child(values.map(f64::from), k as usize, usize::from(second));
                assert_eq!(usize::from(second), fixed.descend(depth), "{p} at depth {depth}");
                lambda = lambda.in_child(k, second);
                assert_eq!(lambda, lambda_of(child.map(|x| x as f32)), "{p} at depth {depth}");
                cell = cell.child(usize::from(second));
                corners = corners.map(|c| c.of_child(k, second));
                k = next_k(k);
            }
            for (axis, c) in corners.into_iter().enumerate() {
                let found = [c.c0, c.c1, c.c2, c.c3].map(f64::from);
                assert_eq!(found, cell.corners.map(|corner| corner[axis]), "{p}");
            }
        }
    }
}
