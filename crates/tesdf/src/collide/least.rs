//! The least signed distance over a whole surface, by best-first search over its face tree.
use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::field::FieldBody;
use super::narrow::{Minimum, Search};
use super::surface::{Part, SurfaceBody};
use crate::asset::layout::TreeChild;

/// The point of a surface that is deepest in a field or nearest to it, in the field's frame.
#[derive(Clone, Copy, Debug)]
pub struct Least {
    /// Signed distance of the surface point.
    pub distance: f64,
    /// The face, by its index in the surface's asset.
    pub face: u32,
    /// The face itself.
    pub part: Part,
    /// The minimum over the core of the face.
    pub minimum: Minimum,
    /// Whether all required searches over faces reached their tolerance.
    pub converged: bool,
}

/// A part of the surface that is still to be searched.
struct Open {
    /// Lower bound of the signed distances on it.
    bound: f64,
    item: Item,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Item {
    Face(u32),
    Leaf(u32, u32),
    Node(u32),
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Open {}
impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        // The heap returns the lowest bound first; among equal bounds, faces first.
        other.bound.total_cmp(&self.bound).then_with(|| other.item.cmp(&self.item))
    }
}

/// The least signed distance over a surface, in the field's frame. The error is within the sum of
/// the search's tolerance and `tolerance`. `None` when the value is above `limit`, or when
/// positions are too far out for their numbers.
///
/// The field is 1-Lipschitz: over a ball it is at least the value at the centre minus the radius.
/// Nodes and faces are visited in the order of this bound. A face is searched exactly, up to the
/// least value so far. Before the first face is searched, the values at the centres of faces bound
/// the result from above. Bounds are `f32` values with a margin for their rounding; the result is
/// `f64`.
pub fn least(
    surface: &SurfaceBody,
    field: &FieldBody,
    search: &Search,
    tolerance: f64,
    limit: f64,
) -> Option<Least> {
    let mut best: Option<Least> = None;
    let mut converged = true;
    // Values above this are not needed.
    let mut limit = limit;
    let mut open = BinaryHeap::new();
    open.push(Open { bound: f64::NEG_INFINITY, item: item(surface.whole()) });
    while let Some(Open { bound, item: next }) = open.pop() {
        if bound > limit {
            break;
        }
        match next {
            Item::Node(node) => {
                for branch in surface.halves(node).into_iter().flatten() {
                    if field.is_beyond(branch.center, branch.radius, limit) {
                        continue;
                    }
                    let own = field.least_within(branch.center, branch.radius);
                    open.push(Open { bound: own.max(bound), item: item(branch.child) });
                }
            }
            Item::Leaf(start, count) => {
                for face in start..start + count {
                    let part = surface.face(face, field, 0.0);
                    let (center, radius) = middle(&part);
                    let (distance, slack) = field.rough(center);
                    let distance = distance - part.radius;
                    limit = limit.min(distance + slack);
                    let own = (distance - slack - radius).max(bound);
                    if own <= limit {
                        open.push(Open { bound: own, item: Item::Face(face) });
                    }
                }
            }
            Item::Face(face) => {
                let part = surface.face(face, field, 0.0);
                search.within(limit).minima(field, &part, None, &mut |_| (), &mut |_, minimum| {
                    converged &= minimum.converged;
                    let distance = minimum.value.distance - part.radius;
                    if best.is_none_or(|b| distance < b.distance) {
                        best = Some(Least { distance, face, part, minimum, converged });
                        limit = limit.min(distance - tolerance);
                    }
                });
            }
        }
    }
    best.map(|b| Least { converged, ..b })
}

fn item(child: TreeChild) -> Item {
    match child {
        TreeChild::Node(node) => Item::Node(node),
        TreeChild::Leaf(start, count) => Item::Leaf(start, count),
    }
}

/// Centre of a part's core, and the radius of a ball around it that contains the core.
fn middle(part: &Part) -> (DVec3, f64) {
    let center = part.points().iter().sum::<DVec3>() / part.points().len() as f64;
    (center, part.points().iter().map(|p| p.distance(center)).fold(0.0, f64::max))
}
