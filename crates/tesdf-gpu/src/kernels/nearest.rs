//! The nearest face to a point, of a list or of all faces.
use cubecl::prelude::*;

use super::assets::{Assets, BOXES, CHILDREN, RECORDS, entry};
use super::list::{List, list_face};
use super::triangle::{ROWS, distance_squared, face};
use super::vector::{V3, dot, v3};

/// A face and how far it is.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Nearest {
    /// Squared distance, with the part in its low bits.
    pub squared: f32,
    /// Position of the face.
    pub face: u32,
}

/// Farther than anything.
pub const FAR: f32 = 1e30;

/// Levels that the stack of the face tree holds; an asset with a deeper tree is refused.
pub const TREE_DEPTH: usize = 48;

/// The squared distance to a face.
#[cube]
pub fn to_face(assets: &Assets, shape: u32, position: u32, p: V3) -> f32 {
    let at = (entry(assets, shape, RECORDS) + position * comptime!(ROWS as u32)) as usize;
    distance_squared(face(&assets.rows, at), p)
}

/// Of every `step`-th face of a list from `first` on; of equally near ones the lowest position.
#[cube]
pub fn nearest_in_list(assets: &Assets, shape: u32, list: List, first: u32, step: u32, p: V3) -> Nearest {
    let mut squared = FAR.runtime();
    let mut position = u32::MAX.runtime();
    let mut i = first;
    while i < list.count {
        let other = list_face(assets, shape, list, i);
        let d = to_face(assets, shape, other, p);
        let nearer = d < squared || (d == squared && other < position);
        squared = select(nearer, d, squared);
        position = select(nearer, other, position);
        i += step;
    }
    Nearest { squared, face: position }
}

/// Squared distance to a box.
#[cube]
fn to_box(p: V3, low: V3, high: V3) -> f32 {
    let d = v3(
        (low.x - p.x).max(p.x - high.x).max(0.0f32),
        (low.y - p.y).max(p.y - high.y).max(0.0f32),
        (low.z - p.z).max(p.z - high.z).max(0.0f32),
    );
    dot(d, d)
}

/// Of all faces, by the face tree; faces farther than `limit` (squared) need not be found.
#[cube]
pub fn nearest_in_tree(assets: &Assets, shape: u32, p: V3, limit: f32) -> Nearest {
    let children = entry(assets, shape, CHILDREN);
    let boxes = entry(assets, shape, BOXES);
    let mut words = Array::<u32>::new(TREE_DEPTH);
    let mut bounds = Array::<f32>::new(TREE_DEPTH);
    let mut squared = limit;
    let mut position = u32::MAX.runtime();
    let mut top = 1usize;
    words[0] = 0u32;
    bounds[0] = 0.0f32;
    while top > 0usize {
        top -= 1usize;
        let child = words[top];
        if bounds[top] < squared {
            if child >= 2147483648u32 {
                let start = (child & 2147483647u32) >> 3u32;
                let count = (child & 7u32) + 1u32;
                let mut i = 0u32;
                while i < count {
                    let d = to_face(assets, shape, start + i, p);
                    let nearer = d < squared;
                    squared = select(nearer, d, squared);
                    position = select(nearer, start + i, position);
                    i += 1u32;
                }
            } else {
                let at = (boxes + 3u32 * child) as usize;
                let (r, s, t) = (assets.rows[at], assets.rows[at + 1], assets.rows[at + 2]);
                let left = to_box(
                    p,
                    v3(r.extract(0usize), r.extract(1usize), r.extract(2usize)),
                    v3(r.extract(3usize), s.extract(0usize), s.extract(1usize)),
                );
                let right = to_box(
                    p,
                    v3(s.extract(2usize), s.extract(3usize), t.extract(0usize)),
                    v3(t.extract(1usize), t.extract(2usize), t.extract(3usize)),
                );
                let left_word = assets.words[(children + 2u32 * child) as usize];
                let right_word = assets.words[(children + 2u32 * child + 1u32) as usize];
                let left_first = left <= right;
                words[top] = select(left_first, right_word, left_word);
                bounds[top] = left.max(right);
                words[top + 1usize] = select(left_first, left_word, right_word);
                bounds[top + 1usize] = left.min(right);
                top += 2usize;
            }
        }
    }
    Nearest { squared, face: position }
}
