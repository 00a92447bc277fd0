//! Wrenches of unit forces, and ways to them from a convex hull: differences of a wrench and a point of the hull of others.
//!
//! A way gets shorter by going to the shortest way from a triangle: of its point and two vertices of the hull. With segments to one vertex alone
//! (Frank–Wolfe) steps go to and fro between the vertices of a face: eight of them left bounds three times as far from the distances where 64 contacts are kept of
//! a curved patch.
use cubecl::prelude::*;

use super::vector::{V3, dot, minus, pick, plus, scaled};

/// Force, and torque over a length; or the difference of two such.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Wrench {
    pub force: V3,
    pub torque: V3,
}

/// A way, and what rounding may have added to its length or taken away.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Way {
    pub way: Wrench,
    pub rounding: f32,
}

/// What a step may round off, as a share of the lengths that it adds: six operations on each coordinate, 6e-8 each.
const STEP_ROUNDING: f32 = 4e-7;
/// Below this share of the product of squares two directions are one.
const PARALLEL: f32 = 1e-6;
/// No division by less.
const LEAST: f32 = 1e-30;

#[cube]
pub fn product(a: Wrench, b: Wrench) -> f32 {
    dot(a.force, b.force) + dot(a.torque, b.torque)
}

#[cube]
pub fn difference(a: Wrench, b: Wrench) -> Wrench {
    Wrench { force: minus(a.force, b.force), torque: minus(a.torque, b.torque) }
}

#[cube]
pub fn sum(a: Wrench, b: Wrench) -> Wrench {
    Wrench { force: plus(a.force, b.force), torque: plus(a.torque, b.torque) }
}

#[cube]
pub fn times(s: f32, a: Wrench) -> Wrench {
    Wrench { force: scaled(s, a.force), torque: scaled(s, a.torque) }
}

/// `first` where the condition holds, else `second`.
#[cube]
pub fn pick_wrench(first: bool, a: Wrench, b: Wrench) -> Wrench {
    Wrench { force: pick(first, a.force, b.force), torque: pick(first, a.torque, b.torque) }
}

/// Makes one the other: a branch or a loop cannot assign a structure.
#[cube]
pub fn set_wrench(a: &mut Wrench, to: Wrench) {
    a.force.x = to.force.x;
    a.force.y = to.force.y;
    a.force.z = to.force.z;
    a.torque.x = to.torque.x;
    a.torque.y = to.torque.y;
    a.torque.z = to.torque.z;
}

/// The same of a way.
#[cube]
pub fn set_way(a: &mut Way, to: Way) {
    set_wrench(&mut a.way, to.way);
    a.rounding = to.rounding;
}

/// `x`, from a point of the hull, or a shorter way: from a point of the triangle of that point and the vertices from which `to_f` and `to_g` come. Better than `x`, or `x`.
#[cube]
pub fn shorter(x: Way, to_f: Wrench, to_g: Wrench) -> Way {
    let along_f = difference(x.way, to_f);
    let along_g = difference(x.way, to_g);
    let ff = product(along_f, along_f);
    let gg = product(along_g, along_g);
    let fg = product(along_f, along_g);
    let xf = product(x.way, along_f);
    let xg = product(x.way, along_g);
    let square = product(x.way, x.way);
    let area = ff * gg - fg * fg;
    let inside_f = (xf * gg - xg * fg) / area.max(LEAST);
    let inside_g = (xg * ff - xf * fg) / area.max(LEAST);
    let is_inside = area > PARALLEL * ff * gg
        && inside_f >= 0.0f32
        && inside_g >= 0.0f32
        && inside_f + inside_g <= 1.0f32;
    // On the side from x to f.
    let of_f = (xf / ff.max(LEAST)).max(0.0f32).min(1.0f32);
    let of_f_square = square - 2.0f32 * of_f * xf + of_f * of_f * ff;
    // On the side from g to f.
    let side = difference(to_g, to_f);
    let side_square = product(side, side);
    let of_g = product(to_g, side);
    let from_g = (of_g / side_square.max(LEAST)).max(0.0f32).min(1.0f32);
    let from_g_square = product(to_g, to_g) - 2.0f32 * from_g * of_g + from_g * from_g * side_square;
    let on_side = !is_inside && from_g_square < of_f_square;
    let f = select(is_inside, inside_f, select(on_side, from_g, of_f));
    let g = select(is_inside, inside_g, select(on_side, 1.0f32 - from_g, 0.0f32));
    let rest = select(on_side, 0.0f32, (1.0f32 - f - g).max(0.0f32));
    let new = sum(times(rest, x.way), sum(times(f, to_f), times(g, to_g)));
    let lengths = rest * square.sqrt() + f * product(to_f, to_f).sqrt() + g * product(to_g, to_g).sqrt();
    let rounding = rest * x.rounding + STEP_ROUNDING * lengths;
    let is_shorter = product(new, new) < square;
    Way { way: pick_wrench(is_shorter, new, x.way), rounding: select(is_shorter, rounding, x.rounding) }
}
