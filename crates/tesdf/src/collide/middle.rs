//! Middle phase: a face, clipped by every cell that it meets.
//!
//! The polygon goes down the bisection forest: each bisection is a plane through the cell, so what arrives at a leaf is the face
//! clipped by that leaf, and no cell that the face does not meet is visited.
use glam::DVec3;

use super::polygon::{Polygon, Vertex};
use crate::TeSdf;
use crate::asset::layout::{Node, Side};
use crate::domain::{Cell, ROOTS};
use crate::query::Place;

/// A face, clipped by a cell.
#[derive(Clone, Copy, Debug)]
pub struct ClippedPolygon {
    /// In the field's local frame.
    pub polygon: Polygon,
    /// What answers for the points of the cell.
    pub place: Place,
    /// The word of the cell in the forest; `None` outside of the cube.
    pub cell: Option<u32>,
}

/// Clips by the cells that can hold a signed distance up to `reach` (local frame).
///
/// What lies beyond the band is left out unless `reach` is wider than the band; then it is what the face tree answers.
pub fn clip(asset: &TeSdf, polygon: &Polygon, reach: f64, visit: &mut impl FnMut(&ClippedPolygon)) {
    let clipping = Clipping { asset, reach, beyond: reach >= asset.band() };
    let (origin, side) = (asset.cube.origin(), asset.cube.side());
    let mut inside = *polygon;
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            // x ≥ origin, then x ≤ origin + side.
            let height = |v: &Vertex| {
                let x = v.point[axis] - origin[axis];
                if sign > 0.0 { x } else { side - x }
            };
            let (kept, out) = inside.cut(height);
            if !out.is_empty() && clipping.beyond {
                visit(&ClippedPolygon { polygon: out, place: Place::NotOfDomain, cell: None });
            }
            inside = kept;
            if inside.is_empty() {
                return;
            }
        }
    }
    // The roots are x_i ≥ x_j ≥ x_k: three cuts.
    let halves =
        |p: Polygon, i: usize, j: usize| p.cut(move |v| (v.point - origin)[i] - (v.point - origin)[j]);
    let (xy, yx) = halves(inside, 0, 1);
    for (half, x_first) in [(xy, true), (yx, false)] {
        if half.is_empty() {
            continue;
        }
        let (xz, zx) = halves(half, 0, 2);
        for (part, x_before_z) in [(xz, true), (zx, false)] {
            if part.is_empty() {
                continue;
            }
            let (yz, zy) = halves(part, 1, 2);
            for (piece, y_before_z) in [(yz, true), (zy, false)] {
                let order = match (x_first, x_before_z, y_before_z) {
                    (true, true, true) => [0, 1, 2],
                    (true, true, false) => [0, 2, 1],
                    (false, true, true) => [1, 0, 2],
                    (false, false, true) => [1, 2, 0],
                    (true, false, false) => [2, 0, 1],
                    (false, false, false) => [2, 1, 0],
                    // x ≥ y ≥ z ≥ x: all equal, and part of others.
                    (true, false, true) | (false, true, false) => continue,
                };
                if piece.is_empty() {
                    continue;
                }
                let root = ROOTS.iter().position(|r| *r == order).unwrap_or(0);
                clipping.descend_root(root, piece, visit);
            }
        }
    }
}

struct Clipping<'a> {
    asset: &'a TeSdf,
    reach: f64,
    /// Whether what lies beyond the band counts.
    beyond: bool,
}

/// Greatest depth of the stack: one waiting sibling per level.
const STACK: usize = crate::domain::MAX_DEPTH as usize + 2;

impl Clipping<'_> {
    fn descend_root(&self, root: usize, mut polygon: Polygon, visit: &mut impl FnMut(&ClippedPolygon)) {
        let [i, j, k] = ROOTS[root];
        let (origin, inverse) = (self.asset.cube.origin(), 1.0 / self.asset.cube.side());
        for v in polygon.vertices_mut() {
            let u: DVec3 = (v.point - origin) * inverse;
            v.lambda = [1.0 - u[i], u[i] - u[j], u[j] - u[k], u[k]];
        }
        let mut stack = Vec::with_capacity(STACK);
        stack.push((root as u32, 0u32, polygon));
        while let Some((mut word, mut depth, mut polygon)) = stack.pop() {
            loop {
                if self.asset.cell_bounds().least(word) > self.reach {
                    break;
                }
                let children = match Node::decode(self.asset.nodes[word as usize], &self.asset.lists) {
                    Node::Split(children) => children,
                    leaf => {
                        self.leaf(word, leaf, polygon, visit);
                        break;
                    }
                };
                let k = 3 - (depth % 3) as usize;
                let (mut first, mut second) = polygon.cut(|v| v.lambda[0] - v.lambda[k]);
                first
                    .vertices_mut()
                    .iter_mut()
                    .for_each(|v| v.lambda = Cell::lambda_of_child(v.lambda, k, 0));
                second
                    .vertices_mut()
                    .iter_mut()
                    .for_each(|v| v.lambda = Cell::lambda_of_child(v.lambda, k, 1));
                depth += 1;
                match (first.is_empty(), second.is_empty()) {
                    (false, false) => {
                        stack.push((children + 1, depth, second));
                        (word, polygon) = (children, first);
                    }
                    (false, true) => (word, polygon) = (children, first),
                    _ => (word, polygon) = (children + 1, second),
                }
            }
        }
    }

    fn leaf(&self, word: u32, leaf: Node, polygon: Polygon, visit: &mut impl FnMut(&ClippedPolygon)) {
        let place = match leaf {
            Node::Listed(label, offset) => Place::Listed { label, offset },
            Node::Far(side) => Place::Far(side),
            Node::NotOfDomain if self.beyond => Place::Far(Side::Outside),
            Node::NotOfDomain | Node::Split(_) => return,
        };
        visit(&ClippedPolygon { polygon, place, cell: Some(word) });
    }
}
