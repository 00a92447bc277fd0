//! Checks that the face tree can find every face: its leaves name each face once, and its boxes
//! contain the faces below them.
use std::collections::HashMap;

use glam::DVec3;

use super::exact::difference;
use super::report::{Claim, Fault};
use crate::TeSdf;
use crate::asset::layout::TreeChild;
use crate::geometry::Aabb;

/// The faults of the face tree and of the face ids.
pub fn faults(asset: &TeSdf, triangles: &[[DVec3; 3]]) -> Vec<Fault> {
    let mut check = Check { asset, triangles, named: vec![0; triangles.len()], faults: Vec::new() };
    check.node(0);
    if let Some(face) = check.named.iter().position(|&times| times != 1) {
        let times = check.named[face];
        let reason = format!("the leaves of the face tree name the face {times} times; expected once");
        check.faults.push(Fault::refuted(Claim::FaceTree, reason).face(asset, face as u32));
    }
    // A single face is written with its reverse, which has the same id.
    let mut ids: HashMap<u32, [u32; 3]> = HashMap::new();
    for (face, &id) in (0..).zip(asset.face_ids.iter()) {
        let mut corners = asset.faces[face as usize];
        corners.sort_unstable();
        if ids.insert(id, corners).is_some_and(|other| other != corners) {
            let reason = format!("two faces of the file have the id {id}");
            check.faults.push(Fault::refuted(Claim::FaceTree, reason).face(asset, face));
            break;
        }
    }
    check.faults
}

struct Check<'a> {
    asset: &'a TeSdf,
    triangles: &'a [[DVec3; 3]],
    /// Number of times that the leaves name each face.
    named: Vec<u32>,
    faults: Vec<Fault>,
}

impl Check<'_> {
    /// Checks a node. Returns the bounds of the faces below it. Opening the asset has limited the
    /// depth of the tree, so the recursion fits the stack.
    fn node(&mut self, node: u32) -> Aabb {
        let boxes = self.asset.tree_boxes[node as usize];
        let children = self.asset.tree_children[node as usize].map(TreeChild::decode);
        let mut all = Aabb::EMPTY;
        for (side, child) in children.into_iter().enumerate() {
            let bounds = match child {
                TreeChild::Node(below) => self.node(below),
                TreeChild::Leaf(start, count) => (start..start + count).fold(Aabb::EMPTY, |bounds, face| {
                    self.named[face as usize] += 1;
                    bounds.union(Aabb::of(&self.triangles[face as usize]))
                }),
            };
            let middle = self.asset.cube.middle();
            let holds = (0..3).all(|k| {
                let (low, high) = (f64::from(boxes[6 * side + k]), f64::from(boxes[6 * side + 3 + k]));
                is_at_most(low, bounds.min[k], middle[k]) && is_at_most(-high, -bounds.max[k], -middle[k])
            });
            if !holds {
                let reason =
                    format!("box {side} of node {node} of the face tree does not hold the faces below it");
                self.faults.push(Fault::refuted(Claim::FaceTree, reason));
            }
            all = all.union(bounds);
        }
        all
    }
}

/// Exact test of `bound <= x - middle`.
fn is_at_most(bound: f64, x: f64, middle: f64) -> bool {
    let (rounded, lost) = difference(x, middle);
    bound < rounded || (bound == rounded && lost >= 0.0)
}
