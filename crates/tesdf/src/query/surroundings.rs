//! The faces of a mesh near a group of polygons, found once for all of them.
use std::cell::{OnceCell, RefCell};
use std::ops::Range;

use glam::{DVec3, Vec3};

use super::kernel::{self, LANES};
use super::locate::{Faces, Place};
use super::{LocalAnswer, polygon};
use crate::TeSdf;
use crate::asset::layout::TreeChild;
use crate::geometry::{Aabb, Closest};

/// Up to this number of leaves of the face tree, polygons are compared with the box of each leaf.
/// With more, a walk down the tree costs less.
const MOST: usize = 64;

/// The mesh around a group of polygons. The leaves of its face tree near the group are found when
/// they are first needed.
#[derive(Debug)]
pub(crate) struct Surroundings<'a> {
    pub asset: &'a TeSdf,
    /// Bounds of the group (local frame).
    bounds: Aabb,
    /// Leaves up to this distance from the bounds are near.
    limit: f64,
    /// `None` where there are too many.
    leaves: OnceCell<Option<Leaves>>,
    answers: RefCell<Answers>,
}

/// Answers to points that several polygons of a group ask about: neighbours have their corners in
/// common, and the points where they cross the faces of the mesh.
#[derive(Debug, Default)]
struct Answers {
    /// In `f64`, with the range of the faces nearby.
    exact: Vec<(DVec3, LocalAnswer, Range<usize>)>,
    near: Vec<(u32, Closest)>,
    /// The faces near one point.
    near_one: Vec<(u32, Closest)>,
    /// In `f32`.
    rough: Vec<(DVec3, LocalAnswer)>,
}

/// Number of answers that are kept at a time. More would be searched for longer than they save.
const KEPT: usize = 32;

/// Leaves of a face tree.
#[derive(Debug, Default)]
struct Leaves {
    /// First face and number of faces of each leaf.
    faces: Vec<(u32, u32)>,
    /// The boxes, for [`LANES`] leaves at a time: their lowest corners, then their highest.
    boxes: Vec<[[f32; LANES]; 6]>,
}

impl<'a> Surroundings<'a> {
    /// Those of polygons within `bounds` that are compared with faces up to `limit` away.
    pub fn new(asset: &'a TeSdf, bounds: Aabb, limit: f64) -> Self {
        Self { asset, bounds, limit, leaves: OnceCell::new(), answers: RefCell::default() }
    }

    /// No group: the whole face tree is searched for every polygon.
    pub fn all(asset: &'a TeSdf) -> Self {
        Self::new(asset, Aabb::EMPTY, f64::NEG_INFINITY)
    }

    /// As [`TeSdf::found_exactly`].
    pub fn found_exactly(&self, p: DVec3) -> LocalAnswer {
        let rough = &mut self.answers.borrow_mut().rough;
        if let Some((_, found)) = rough.iter().find(|(at, _)| is_same(*at, p)) {
            return *found;
        }
        let found = self.asset.found_exactly(p);
        if rough.len() == KEPT {
            rough.clear();
        }
        rough.push((p, found));
        found
    }

    /// As [`TeSdf::found_at`] in `f64`, from the answers that are kept, if it is one of them.
    pub fn found(&self, p: DVec3) -> Option<LocalAnswer> {
        self.answers.borrow().exact.iter().find(|(at, ..)| is_same(*at, p)).map(|(_, found, _)| *found)
    }

    /// The answer at a point in `f64`, and all faces that are within `tie` of the least distance, as
    /// [`TeSdf::found_with_near`]. All calls have the same tie.
    pub fn with_near<R>(
        &self,
        p: DVec3,
        tie: f64,
        then: impl FnOnce(LocalAnswer, &[(u32, Closest)]) -> R,
    ) -> R {
        let answers = &mut *self.answers.borrow_mut();
        let kept = answers.exact.iter().position(|(at, ..)| is_same(*at, p));
        let kept = kept.unwrap_or_else(|| {
            let (place, near_one) = (self.asset.locate(p), &mut answers.near_one);
            let mut found = |faces: &Faces| self.asset.found_with_near(p, place, faces, tie, near_one);
            let found = match place {
                Place::Listed { offset, .. } => self.asset.with_list(offset, found),
                _ => found(&Faces::default()),
            };
            if answers.exact.len() == KEPT {
                answers.exact.clear();
                answers.near.clear();
            }
            let first = answers.near.len();
            answers.near.extend_from_slice(&answers.near_one);
            answers.exact.push((p, found, first..answers.near.len()));
            answers.exact.len() - 1
        });
        let (_, found, near) = &answers.exact[kept];
        then(*found, &answers.near[near.clone()])
    }

    /// Offers the faces that can come within a limit of a polygon of the group, those in nearer
    /// leaves first, as [`TeSdf::near_polygon`].
    pub fn near_polygon(
        &self,
        points: &[DVec3],
        normal: DVec3,
        limit: f64,
        offer: &mut impl FnMut(u32) -> f64,
    ) {
        if limit > self.limit {
            return self.asset.near_polygon(points, normal, limit, offer);
        }
        // Where the group has too many leaves, those of the polygon alone. So the order of the
        // faces does not depend on the group.
        let own;
        let leaves = match self.leaves.get_or_init(|| self.find(self.bounds)) {
            Some(leaves) => leaves,
            None => match self.find(Aabb::of(points)) {
                Some(leaves) => {
                    own = leaves;
                    &own
                }
                None => return self.asset.near_polygon(points, normal, limit, offer),
            },
        };
        let axes = self.asset.axes(points, normal);
        let mut now = axes.with_slack(limit);
        let mut near = [(0.0, 0); MOST];
        let mut count = 0;
        for (first, boxes) in (0..).step_by(LANES).zip(&leaves.boxes) {
            let bounds = kernel::boxes_apart(self.asset.isa, boxes, &axes);
            for (leaf, bound) in (first..leaves.faces.len()).zip(bounds) {
                if bound <= now {
                    near[count] = (bound, leaf);
                    count += 1;
                }
            }
        }
        let near = &mut near[..count];
        near.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        for &mut (bound, leaf) in near {
            if bound > now {
                break;
            }
            let (start, count) = leaves.faces[leaf];
            now = self.asset.offer_leaf(start, count, &axes, now, offer);
        }
    }

    /// The leaves near `bounds`; `None` where there are too many.
    fn find(&self, bounds: Aabb) -> Option<Leaves> {
        let b = bounds.rounded_from(self.asset.cube.middle());
        let (low, high) = (Vec3::from_slice(&b), Vec3::from_slice(&b[3..]));
        let reach = low.abs().max(high.abs()).max_element();
        let limit = self.limit as f32 * (1.0 + polygon::ROUNDING) + polygon::ROUNDING * (1.0 + reach);
        let mut leaves = Leaves::default();
        let mut stack = vec![0];
        while let Some(node) = stack.pop() {
            let (boxes, _) = self.asset.tree_boxes[node as usize].as_chunks::<6>();
            let children = self.asset.tree_children[node as usize].map(TreeChild::decode);
            for (b, child) in boxes.iter().zip(children) {
                let apart = (Vec3::from_slice(b) - high).max(low - Vec3::from_slice(&b[3..])).max(Vec3::ZERO);
                match child {
                    _ if apart.length() > limit => {}
                    TreeChild::Node(node) => stack.push(node),
                    TreeChild::Leaf(..) if leaves.faces.len() == MOST => return None,
                    TreeChild::Leaf(start, count) => leaves.push(start, count, b),
                }
            }
        }
        Some(leaves)
    }
}

/// Whether two points are equal bit by bit: so are then their answers.
fn is_same(one: DVec3, other: DVec3) -> bool {
    one.to_array().map(f64::to_bits) == other.to_array().map(f64::to_bits)
}

impl Leaves {
    fn push(&mut self, start: u32, count: u32, bounds: &[f32; 6]) {
        let lane = self.faces.len() % LANES;
        if lane == 0 {
            self.boxes.push([[0.0; LANES]; 6]);
        }
        self.faces.push((start, count));
        if let Some(boxes) = self.boxes.last_mut() {
            boxes.iter_mut().zip(bounds).for_each(|(row, &x)| row[lane] = x);
        }
    }
}
