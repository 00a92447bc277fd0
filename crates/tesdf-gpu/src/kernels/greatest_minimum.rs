//! The greatest minimum of four linear functions over a triangle, each given by its values at the corners: what bounds the depth of a piece.
use cubecl::prelude::*;

use super::vector::{V3, cross, dot, minus, v3};

/// Least of four linear functions at weights.
#[cube]
fn least_of(f: V3, g: V3, h: V3, k: V3, a: f32, b: f32, c: f32) -> f32 {
    let w = v3(a, b, c);
    dot(f, w).min(dot(g, w)).min(dot(h, w).min(dot(k, w)))
}

/// Where two of them are equal on an edge, the least of all four; `least` when they are not equal there.
#[cube]
fn on_edges(least: f32, d: V3, f: V3, g: V3, h: V3, k: V3) -> f32 {
    let mut greatest = least;
    if d.x * d.y < 0.0f32 {
        let w = d.x / (d.x - d.y);
        greatest = greatest.max(least_of(f, g, h, k, 1.0f32 - w, w, 0.0f32));
    }
    if d.y * d.z < 0.0f32 {
        let w = d.y / (d.y - d.z);
        greatest = greatest.max(least_of(f, g, h, k, 0.0f32, 1.0f32 - w, w));
    }
    if d.z * d.x < 0.0f32 {
        let w = d.z / (d.z - d.x);
        greatest = greatest.max(least_of(f, g, h, k, w, 0.0f32, 1.0f32 - w));
    }
    greatest
}

/// Where three are equal inside, given two of their differences.
#[cube]
fn inside(least: f32, d: V3, e: V3, f: V3, g: V3, h: V3, k: V3) -> f32 {
    let w = cross(d, e);
    let sum = w.x + w.y + w.z;
    let some = sum != 0.0f32;
    let inverse = select(some, 1.0f32 / select(some, sum, 1.0f32), 0.0f32);
    let (a, b, c) = (inverse * w.x, inverse * w.y, inverse * w.z);
    let is_inside = some && a >= 0.0f32 && b >= 0.0f32 && c >= 0.0f32;
    let mut greatest = least;
    if is_inside {
        greatest = greatest.max(least_of(f, g, h, k, a, b, c));
    }
    greatest
}

/// The greatest minimum of four linear functions over a triangle: at a corner, where two are equal on an edge, or three inside. Written out, as
/// a loop over them is most of the iterations of a search.
#[cube]
pub fn greatest_minimum(f: V3, g: V3, h: V3, k: V3) -> f32 {
    let (fg, fh, fk) = (minus(f, g), minus(f, h), minus(f, k));
    let (gh, gk, hk) = (minus(g, h), minus(g, k), minus(h, k));
    let mut greatest = least_of(f, g, h, k, 1.0f32, 0.0f32, 0.0f32)
        .max(least_of(f, g, h, k, 0.0f32, 1.0f32, 0.0f32))
        .max(least_of(f, g, h, k, 0.0f32, 0.0f32, 1.0f32));
    greatest = on_edges(greatest, fg, f, g, h, k);
    greatest = on_edges(greatest, fh, f, g, h, k);
    greatest = on_edges(greatest, fk, f, g, h, k);
    greatest = on_edges(greatest, gh, f, g, h, k);
    greatest = on_edges(greatest, gk, f, g, h, k);
    greatest = on_edges(greatest, hk, f, g, h, k);
    greatest = inside(greatest, fg, fh, f, g, h, k);
    greatest = inside(greatest, fg, fk, f, g, h, k);
    greatest = inside(greatest, fh, fk, f, g, h, k);
    inside(greatest, gh, gk, f, g, h, k)
}
