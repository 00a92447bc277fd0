//! Overlaps that no contact shows.
//!
//! A node shows an overlap only where it is inside the other body. Two equal boxes, one moved along
//! an edge, overlap without such a node. So do two bars that cross like a plus sign. Two bodies in
//! the same pose overlap although no surface is inside the other body, so no face shows it either.
//!
//! Two searches find such overlaps. Neither changes a contact.
//! - In node mode, the faces of each body are searched in the field of the other. A face is deeper
//!   than its deepest corner by at most its [`corner_reach`], so finely meshed faces are skipped.
//! - In every mode, the centre of a ball inside each body is tested in the field of the other.
use std::collections::BTreeMap;

use crate::parallel::*;
use glam::DVec3;

use super::field::FieldBody;
use super::ordered_pair::OrderedPair;
use super::surface::SurfaceBody;
use super::{CollideError, CollideOptions, Contact, HiddenOverlap, InstanceId, Mode, Scene};
use crate::asset::layout::TreeChild;
use crate::geometry::Aabb;
use crate::query::corner_reach;

/// A place deeper than the deepest place so far is searched for only where it can be this many
/// times as deep.
pub const DEEPER: f64 = 1.25;
/// A piece of a face with a radius of at most this fraction of the wanted depth is not divided: no
/// point of it is deeper than its center by more than this fraction.
pub const SETTLED: f64 = 0.25;
/// A body is searched only when the least depth of a hidden overlap is more than this many times
/// the rounding error of distances.
pub const THICK: f64 = 2.0;

impl HiddenOverlap {
    /// The overlaps that the contacts do not show.
    pub fn not_shown(overlaps: Vec<Self>, contacts: &[Contact]) -> Vec<Self> {
        if overlaps.is_empty() {
            return overlaps;
        }
        let mut shown: BTreeMap<(InstanceId, InstanceId), f64> = BTreeMap::new();
        for c in contacts {
            let pair = (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b));
            let depth = shown.entry(pair).or_default();
            *depth = depth.max(-c.distance);
        }
        let of_pair = |o: &Self| shown.get(&(o.instance_a, o.instance_b)).copied().unwrap_or(0.0);
        overlaps.into_iter().filter(|overlap| overlap.depth > Self::SHOWN * of_pair(overlap)).collect()
    }
}

/// The overlaps of a scene that `contacts` do not show, sorted by world and instances. `contacts`
/// must come from a detection with the same options. This gives
/// [`Contacts::hidden`](super::Contacts::hidden) for contacts of other detectors.
///
/// # Errors
/// As [`detect`](super::detect()).
pub fn hidden_overlaps(
    scene: &Scene,
    options: &CollideOptions,
    contacts: &[Contact],
) -> Result<Vec<HiddenOverlap>, CollideError> {
    Ok(among(&OrderedPair::all(scene, options)?, options.mode, contacts))
}

/// The same for ordered pairs. The two orders of a pair must be adjacent.
pub fn among(pairs: &[OrderedPair], mode: Mode, contacts: &[Contact]) -> Vec<HiddenOverlap> {
    let overlap = |pair: &[OrderedPair]| {
        let depth = |p: &OrderedPair| depth(&p.surface, &p.field, mode) * p.field.unit();
        let (a, b) = (pair[0].a, pair[0].b);
        let depth = pair.iter().map(depth).fold(0.0, f64::max);
        (depth > 0.0).then_some(HiddenOverlap { instance_a: a.min(b), instance_b: a.max(b), depth })
    };
    HiddenOverlap::not_shown(pairs.par_chunks(2).filter_map(overlap).collect(), contacts)
}

/// Lower bound of the depth of a surface in a field, at places that need not have a contact. In the
/// field's frame; 0 when no such place was found.
fn depth(surface: &SurfaceBody, field: &FieldBody, mode: Mode) -> f64 {
    let (Some((center, radius)), Some(of_field)) = (surface.inner_ball(), field.inner_radius()) else {
        return 0.0;
    };
    let thickness = radius.min(of_field);
    let core = field.bounds().grown(-HiddenOverlap::FINE * thickness);
    if !surface.may_meet(core) {
        return 0.0;
    }
    let (at_center, slack) = field.rough(center);
    if HiddenOverlap::FINE * thickness <= THICK * slack {
        // The body is too thin relative to rounding.
        return 0.0;
    }
    let mut search = Looks { field, core, thickness, deepest: radius.min(-at_center).max(0.0), looks: 0 };
    if mode == Mode::Node {
        search.at_surface(surface);
    }
    if search.deepest > HiddenOverlap::FINE * thickness { search.deepest } else { 0.0 }
}

/// Searches places where a surface is deep in a field.
struct Looks<'a> {
    field: &'a FieldBody<'a>,
    /// Points that are deep enough lie in this box.
    core: Aabb,
    thickness: f64,
    /// The greatest depth so far.
    deepest: f64,
    looks: u32,
}

impl Looks<'_> {
    /// The search ignores depths up to this value.
    fn wanted(&self, share: f64) -> f64 {
        (share * self.thickness).max(DEEPER * self.deepest)
    }

    /// Depth of a point in the field.
    fn look(&mut self, p: DVec3) -> f64 {
        self.looks += 1;
        -self.field.rough(p).0
    }

    fn at_surface(&mut self, surface: &SurfaceBody) {
        let mut stack = vec![surface.whole()];
        while let Some(child) = stack.pop() {
            match child {
                TreeChild::Leaf(start, count) => {
                    (start..start + count).for_each(|f| self.at_face(surface, f))
                }
                TreeChild::Node(node) => {
                    for branch in surface.halves(node).into_iter().flatten() {
                        let is_fine = surface.corner_reach(branch.child) <= self.wanted(HiddenOverlap::SURE);
                        let is_out =
                            self.core.distance_squared(branch.center) > branch.radius * branch.radius;
                        if !is_fine
                            && !is_out
                            && self.look(branch.center) + branch.radius > self.wanted(HiddenOverlap::FINE)
                        {
                            stack.push(branch.child);
                        }
                    }
                }
            }
        }
    }

    /// Evaluates a face at its middle, then quarters it as long as its parts can be deep enough.
    fn at_face(&mut self, surface: &SurfaceBody, face: u32) {
        let part = surface.face(face, self.field, 0.0);
        let (first, last) = (part.points()[0], part.points()[part.points().len() - 1]);
        let corners = [first, *part.points().get(1).unwrap_or(&last), last];
        if corner_reach(corners) <= self.wanted(HiddenOverlap::SURE) {
            return;
        }
        let before = self.looks;
        let mut stack = vec![corners];
        while let Some(corners) = stack.pop() {
            if self.looks >= HiddenOverlap::MAX_LOOKS
                || !Aabb::of(&corners).grown(part.radius).overlaps(self.core)
            {
                continue;
            }
            let (middle, reach) = middle(corners);
            let depth = self.look(middle) + part.radius;
            self.deepest = self.deepest.max(depth);
            let wanted = self.wanted(if self.looks - before <= HiddenOverlap::FINE_LOOKS {
                HiddenOverlap::FINE
            } else {
                HiddenOverlap::SURE
            });
            if depth + reach > wanted && reach > SETTLED * wanted {
                stack.extend(quarters(corners));
            }
        }
    }
}

/// The middle of a triangle's side or its centroid, whichever has the smaller distance to its
/// farthest corner, and that distance.
fn middle(corners: [DVec3; 3]) -> (DVec3, f64) {
    let [a, b, c] = corners;
    let reach = |p: DVec3| corners.map(|q| q.distance(p)).into_iter().fold(0.0, f64::max);
    let points = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0];
    let nearer = |x: (DVec3, f64), y: (DVec3, f64)| if y.1 < x.1 { y } else { x };
    points.into_iter().map(|p| (p, reach(p))).fold((a, f64::INFINITY), nearer)
}

/// The triangle in the middle is last, so a stack returns it first.
fn quarters([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 4] {
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}
