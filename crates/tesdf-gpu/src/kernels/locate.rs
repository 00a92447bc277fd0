//! Which cell holds a point, by descending the bisection forest in barycentric coordinates, from a root of the cube or of a conforming domain.
//!
//! [`tesdf::domain::Cell`] has the rule. In `f32` a point is off by 2^-24 of the cube, which is far less than what the lists leave room for:
//! on a border a neighbour may be found instead, whose list is good there too.
use cubecl::prelude::*;

use super::assets::{Assets, INVERSE_SIDE, NODES, NONE, entry, is_conforming, number};
use super::tetrahedra::root_holding;
use super::vector::{V3, plus, scaled, v3};

/// Barycentric coordinates in a cell.
#[derive(CubeType, Clone, Copy, Debug, PartialEq)]
#[expand(derive(Clone, Copy))]
pub struct Lambda {
    pub l0: f32,
    pub l1: f32,
    pub l2: f32,
    pub l3: f32,
}

/// The word of a cell, and where in the forest it is.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Place {
    /// The word.
    pub word: u32,
    /// Its number; [`NONE`] outside of all roots.
    pub at: u32,
}

/// What a word says about a cell: 0 outside, 1 inside, 2–5 crossing, 6 far, 7 not of the domain.
#[cube]
pub fn code(word: u32) -> u32 {
    (word >> 28u32) & 7u32
}

/// The byte of a cell's list; of a far cell 1 inside, 0 outside.
#[cube]
pub fn offset(word: u32) -> u32 {
    word & 268435455u32
}

/// Whether all of a cell is inside, with a list or far from the surface.
#[cube]
pub fn is_inside(word: u32) -> bool {
    code(word) == 1u32 || (code(word) == 6u32 && offset(word) == 1u32)
}

/// Whether the surface comes into a cell, or close to it.
#[cube]
pub fn is_crossing(word: u32) -> bool {
    code(word) >= 2u32 && code(word) <= 5u32
}

/// The word of what is not of the domain.
pub const NOT_OF_DOMAIN: u32 = 0xF000_0000;

#[cube]
pub fn is_split(word: u32) -> bool {
    word < 2147483648u32
}

/// Where a point lies in the cube, each coordinate from 0 to 1.
#[cube]
pub fn in_cube(assets: &Assets, shape: u32, p: V3) -> V3 {
    plus(scaled(number(assets, shape, INVERSE_SIDE), p), v3(0.5f32, 0.5f32, 0.5f32))
}

/// The root that holds a point of the unit cube, by the order of its coordinates.
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

/// Coordinate `axis` of a vector.
#[cube]
pub fn coordinate(u: V3, axis: u32) -> f32 {
    select(axis == 0u32, u.x, select(axis == 1u32, u.y, u.z))
}

/// The axes in the order in which a root walks them, as [`tesdf::domain::ROOTS`].
#[cube]
pub fn axes(root: u32) -> (u32, u32, u32) {
    let i = root / 2u32;
    // The lower of the other two comes first in even roots.
    let low = select(i == 0u32, 1u32, 0u32);
    let high = select(i == 2u32, 1u32, 2u32);
    let even = root % 2u32 == 0u32;
    (i, select(even, low, high), select(even, high, low))
}

/// Coordinates in a root of the cube: root `r` walks the axes i, j, k.
#[cube]
pub fn in_root(u: V3, root: u32) -> Lambda {
    let (i, j, k) = axes(root);
    let (x, y, z) = (coordinate(u, i), coordinate(u, j), coordinate(u, k));
    Lambda { l0: 1.0f32 - x, l1: x - y, l2: y - z, l3: z }
}

/// Coordinate `k` (1 to 3).
#[cube]
pub fn lambda_at(l: Lambda, k: u32) -> f32 {
    select(k == 3u32, l.l3, select(k == 2u32, l.l2, l.l1))
}

/// Coordinates in child 0, or in child 1 when `second`, of a cell whose refinement edge ends at corner `k`.
#[cube]
pub fn in_child(l: Lambda, k: u32, second: bool) -> Lambda {
    let a = l.l0;
    let b = lambda_at(l, k);
    let kept = select(second, b - a, a - b);
    let middle = 2.0f32 * select(second, a, b);
    let is3 = k == 3u32;
    let is2 = k == 2u32;
    // k = 3: kept 1 2 middle, or 1 2 kept middle; k = 2: kept 1 middle 3, or 1 kept middle 3; k = 1: kept middle 2 3.
    let shifted = second && k > 1u32;
    let l0 = select(shifted, l.l1, kept);
    let l1_of_2 = select(second, kept, l.l1);
    let l1_of_3 = select(second, l.l2, l.l1);
    let l1 = select(is3, l1_of_3, select(is2, l1_of_2, middle));
    let l2_of_3 = select(second, kept, l.l2);
    let l2 = select(is3, l2_of_3, select(is2, middle, l.l2));
    let l3 = select(is3, middle, l.l3);
    Lambda { l0, l1, l2, l3 }
}

/// The corner that the next refinement edge ends at.
#[cube]
pub fn next_k(k: u32) -> u32 {
    select(k == 1u32, 3u32, k - 1u32)
}

/// The cell that holds a point, relative to the middle of the cube.
#[cube]
pub fn place(assets: &Assets, shape: u32, p: V3) -> Place {
    let mut word = NOT_OF_DOMAIN.runtime();
    let mut at = NONE.runtime();
    let mut l0 = 0.0f32;
    let mut l1 = 0.0f32;
    let mut l2 = 0.0f32;
    let mut l3 = 0.0f32;
    if is_conforming(assets, shape) {
        let held = root_holding(assets, shape, p);
        at = held.root;
        l0 = held.lambda.l0;
        l1 = held.lambda.l1;
        l2 = held.lambda.l2;
        l3 = held.lambda.l3;
    } else {
        let u = in_cube(assets, shape, p);
        let least = u.x.min(u.y).min(u.z);
        let greatest = u.x.max(u.y).max(u.z);
        if least >= 0.0f32 && greatest <= 1.0f32 {
            at = root(u);
            let l = in_root(u, at);
            l0 = l.l0;
            l1 = l.l1;
            l2 = l.l2;
            l3 = l.l3;
        }
    }
    if at != NONE {
        let nodes = entry(assets, shape, NODES);
        let mut k = 3u32;
        word = assets.words[(nodes + at) as usize];
        while is_split(word) {
            let here = Lambda { l0, l1, l2, l3 };
            let second = l0 < lambda_at(here, k);
            let below = in_child(here, k, second);
            l0 = below.l0;
            l1 = below.l1;
            l2 = below.l2;
            l3 = below.l3;
            at = word + select(second, 1u32, 0u32);
            k = next_k(k);
            word = assets.words[(nodes + at) as usize];
        }
    }
    Place { word, at }
}
