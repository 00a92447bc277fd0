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
use std::sync::atomic::{AtomicBool, Ordering};

use crate::parallel::*;
use glam::DVec3;

use crate::asset::layout::TreeChild;
use crate::collide::bodies::branch::Branch;
use crate::collide::bodies::field::{Field, FieldBody};
use crate::collide::bodies::surface::SurfaceBody;
use crate::collide::detect::ordered_pair::OrderedPair;
use crate::collide::mode::Mode;
use crate::collide::options::{CollideOptions, HiddenSearch};
use crate::collide::report::contact::Contact;
use crate::collide::report::hidden_overlap::HiddenOverlap;
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::field_value::FieldValue;
use crate::collide::scene::ids::InstanceId;
use crate::collide::search::longest_edge::longest_edge;
use crate::collide::search::queue::Queue;
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
/// Number of triangles that are halved at a time.
const WAVE: usize = 16;
/// From this number of places on, they are looked at on several threads, this number at a time.
const MANY: usize = 512;
const TASK: usize = 128;
impl HiddenOverlap {
    /// The overlaps that the contacts do not show.
    pub fn not_shown(overlaps: Vec<Self>, contacts: &[Contact]) -> Vec<Self> {
        if overlaps.is_empty() {
            return overlaps;
        }
        let shown = Shown::by(contacts);
        let is_hidden = |o: &Self| o.depth > Self::SHOWN * shown.of(o.instance_a, o.instance_b);
        overlaps.into_iter().filter(is_hidden).collect()
    }
}

/// The depth of the deepest contact of each pair of instances, in the world's unit.
struct Shown(BTreeMap<(InstanceId, InstanceId), f64>);

impl Shown {
    fn by(contacts: &[Contact]) -> Self {
        let mut shown = BTreeMap::new();
        for run in contacts.chunk_by(|x, y| (x.instance_a, x.instance_b) == (y.instance_a, y.instance_b)) {
            let (a, b) = (run[0].instance_a, run[0].instance_b);
            let depth: &mut f64 = shown.entry((a.min(b), a.max(b))).or_default();
            *depth = run.iter().map(|c| -c.distance).fold(*depth, f64::max);
        }
        Self(shown)
    }

    /// 0 where no contact is inside.
    fn of(&self, a: InstanceId, b: InstanceId) -> f64 {
        self.0.get(&(a.min(b), a.max(b))).copied().unwrap_or(0.0)
    }
}

/// The overlaps of a scene that `contacts` do not show, sorted by world and instances. `contacts`
/// must come from a detection with the same options. This gives
/// [`Contacts::hidden`](crate::collide::Contacts::hidden) for contacts of other detectors.
///
/// # Errors
/// As [`detect`](crate::collide::detect()).
pub fn hidden_overlaps(
    scene: &Scene,
    options: &CollideOptions,
    contacts: &[Contact],
) -> Result<Vec<HiddenOverlap>, CollideError> {
    let options = CollideOptions { hidden: HiddenSearch::On, ..*options };
    Ok(among(&OrderedPair::all(scene, &options)?, &options, contacts, &AtomicBool::new(false)))
}

/// The same for ordered pairs. The two orders of a pair must be adjacent. Once `stop` is set,
/// overlaps are missing. Empty where the options say that nothing is searched.
pub fn among(
    pairs: &[OrderedPair],
    options: &CollideOptions,
    contacts: &[Contact],
    stop: &AtomicBool,
) -> Vec<HiddenOverlap> {
    if options.hidden == HiddenSearch::Off {
        return Vec::new();
    }
    let shown = Shown::by(contacts);
    let overlap = |pair: &[OrderedPair]| {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let (a, b) = (pair[0].a, pair[0].b);
        let shown = shown.of(a, b);
        let depth = |p: &OrderedPair| {
            let unit = p.field.unit();
            depth(&p.surface, &p.field, options.mode, shown / unit) * unit
        };
        let depth = pair.iter().map(depth).fold(0.0, f64::max);
        let is_hidden = depth > HiddenOverlap::SHOWN * shown;
        is_hidden.then_some(HiddenOverlap { instance_a: a.min(b), instance_b: a.max(b), depth })
    };
    pairs.par_chunks(2).filter_map(overlap).collect()
}

/// Lower bound of the depth of a surface in a field, at places that need not have a contact. In the
/// field's frame; 0 when no place was found that is deep compared with the thickness. `shown` is
/// the depth that contacts show.
fn depth(surface: &SurfaceBody, field: &FieldBody, mode: Mode, shown: f64) -> f64 {
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
    let deepest = radius.min(field.half_thickness() - at_center).max(0.0);
    let mut search = Looks { field, core, thickness, shown, deepest, looks: 0 };
    if mode == Mode::Node {
        let faces = search.faces(surface);
        search.search(faces);
    }
    if search.deepest > HiddenOverlap::FINE * thickness { search.deepest } else { 0.0 }
}

/// Searches places where a surface is deep in a field.
struct Looks<'a> {
    field: &'a FieldBody<'a>,
    /// Points that are deep enough lie in this box.
    core: Aabb,
    thickness: f64,
    /// The depth that contacts show.
    shown: f64,
    /// The greatest depth so far.
    deepest: f64,
    looks: u32,
}

/// A triangle that can be deep.
#[derive(Clone, Copy)]
struct DeepTriangle {
    corners: [DVec3; 3],
    /// The surface lies within this distance of the triangle.
    radius: f64,
}

impl Looks<'_> {
    /// The search ignores depths up to this value.
    fn wanted(&self, share: f64) -> f64 {
        (share * self.thickness).max(HiddenOverlap::SHOWN * self.shown).max(DEEPER * self.deepest)
    }

    /// Whether faces with this greatest [`corner_reach`] are skipped: contacts show the depth of
    /// their corners.
    fn is_fine(&self, reach: f64) -> bool {
        reach <= (HiddenOverlap::SURE * self.thickness).max(self.wanted(0.0) - self.shown)
    }

    /// The values at the points that can be deep, `None` for points outside the core: these often
    /// lie outside the domain, where a value takes long. In order, for any number of threads.
    fn values(&mut self, points: &[DVec3]) -> Vec<Option<FieldValue>> {
        let is_in_core = |p: &DVec3| self.core.distance_squared(*p) == 0.0;
        let in_core: Vec<DVec3> = points.iter().copied().filter(is_in_core).collect();
        let field = &self.field.field;
        let values = match in_core.len() {
            ..MANY => field.rough_values(&in_core),
            _ => {
                let parts: Vec<_> = in_core.par_chunks(TASK).map(|part| field.rough_values(part)).collect();
                parts.into_iter().flatten().collect()
            }
        };
        self.looks += values.len() as u32;
        let mut values = values.into_iter();
        points.iter().map(|p| if is_in_core(p) { values.next() } else { None }).collect()
    }

    /// The faces that can be deep, by the balls around the nodes of the face tree.
    fn faces(&mut self, surface: &SurfaceBody) -> Vec<DeepTriangle> {
        let mut faces = Vec::new();
        let mut level = vec![surface.whole()];
        while !level.is_empty() {
            let mut branches = Vec::new();
            for child in level {
                match child {
                    TreeChild::Leaf(start, count) => {
                        let pieces =
                            (start..start + count).map(|face| DeepTriangle::face(surface, face, self.field));
                        faces.extend(pieces.filter(|piece| !self.is_fine(corner_reach(piece.corners))));
                    }
                    TreeChild::Node(node) => {
                        branches.extend(surface.halves(node).into_iter().flatten().filter(|branch| {
                            self.core.distance_squared(branch.center) <= branch.radius * branch.radius
                                && !self.is_fine(surface.corner_reach(branch.child))
                        }));
                    }
                }
            }
            let centers: Vec<DVec3> = branches.iter().map(|branch| branch.center).collect();
            let values = self.values(&centers);
            let wanted = self.wanted(HiddenOverlap::FINE);
            let can_be_deep = |(branch, value): &(Branch, Option<FieldValue>)| {
                value.is_none_or(|value| branch.radius - self.field.lowest_beside(value.distance) > wanted)
            };
            level = branches.into_iter().zip(values).filter(can_be_deep).map(|(b, _)| b.child).collect();
        }
        faces
    }

    /// Looks at each face, then at halves of those that can be deepest.
    fn search(&mut self, faces: Vec<DeepTriangle>) {
        let mut open = Queue::new();
        self.look(faces, &mut open);
        let mut fine = 0;
        while self.looks < HiddenOverlap::MAX_LOOKS
            && let Some(greatest) = open.least().map(|bound| -bound)
        {
            let is_sure = greatest > self.wanted(HiddenOverlap::SURE);
            if !is_sure && (fine >= HiddenOverlap::FINE_LOOKS || greatest <= self.wanted(HiddenOverlap::FINE))
            {
                break;
            }
            let before = self.looks;
            let wave: Vec<DeepTriangle> =
                std::iter::from_fn(|| open.pop()).take(WAVE).map(|(_, piece)| piece).collect();
            self.look(wave.into_iter().flat_map(DeepTriangle::halves).collect(), &mut open);
            if !is_sure {
                fine += self.looks - before;
            }
        }
    }

    /// Looks at triangles, and keeps those that can be deep enough.
    fn look(&mut self, mut pieces: Vec<DeepTriangle>, open: &mut Queue<DeepTriangle>) {
        pieces.retain(|piece| Aabb::of(&piece.corners).grown(piece.radius).overlaps(self.core));
        let middles: Vec<(DVec3, f64)> = pieces.iter().map(|piece| middle(piece.corners)).collect();
        let points: Vec<DVec3> = middles.iter().map(|(middle, _)| *middle).collect();
        let values = self.values(&points);
        let depth = |(piece, value): (&DeepTriangle, &Option<FieldValue>)| {
            Some(piece.radius - value.as_ref()?.distance)
        };
        self.deepest = pieces.iter().zip(&values).filter_map(depth).fold(self.deepest, f64::max);
        let wanted = self.wanted(HiddenOverlap::FINE);
        for ((piece, (middle, reach)), value) in pieces.into_iter().zip(middles).zip(values) {
            if reach <= SETTLED * wanted {
                continue;
            }
            let greatest = match value {
                None => piece.radius + reach - self.core.distance_squared(middle).sqrt(),
                Some(value) => {
                    let within_reach = reach - self.field.lowest_beside(value.distance);
                    if piece.radius + within_reach <= wanted {
                        continue;
                    }
                    piece.radius + within_reach.min(self.field.greatest_depth(piece.corners, middle, &value))
                }
            };
            if greatest > wanted {
                open.push(-greatest, piece);
            }
        }
    }
}

impl DeepTriangle {
    fn face(surface: &SurfaceBody, face: u32, field: &FieldBody) -> Self {
        let (corners, radius) = surface.triangle(face, field);
        Self { corners, radius }
    }

    /// The halves, divided in the middle of the longest edge.
    fn halves(mut self) -> [Self; 2] {
        let start = longest_edge(self.corners);
        self.corners.rotate_left(start);
        let [a, b, c] = self.corners;
        let middle = 0.5 * (a + b);
        [[a, middle, c], [middle, b, c]].map(|corners| Self { corners, ..self })
    }
}

impl FieldBody<'_> {
    /// Upper bound of the depth over a triangle, by the value at a point.
    fn greatest_depth(&self, corners: [DVec3; 3], p: DVec3, value: &FieldValue) -> f64 {
        let bounds = match self.field {
            // The distance from the longest side of a face is convex, and takes less time than that
            // from the face.
            Field::Mesh(asset) => {
                let [a, b, c] = asset.local_corners(value.position as usize);
                let longer = |x: [DVec3; 2], y: [DVec3; 2]| {
                    if x[0].distance_squared(x[1]) < y[0].distance_squared(y[1]) { y } else { x }
                };
                let [start, end] = longer([a, b], longer([b, c], [c, a]));
                let along = (end - start) / start.distance_squared(end).max(f64::MIN_POSITIVE);
                corners.map(|p| {
                    let t = along.dot(p - start).clamp(0.0, 1.0);
                    p.distance(start + t * (end - start))
                })
            }
            // A convex function lies above its tangents.
            Field::Simple(_) => corners.map(|c| -(value.distance + value.gradient.dot(c - p))),
        };
        bounds.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
}

/// The middle of a triangle's side or its centroid, whichever has the smaller distance to its
/// farthest corner, and that distance.
fn middle(corners: [DVec3; 3]) -> (DVec3, f64) {
    let [a, b, c] = corners;
    let reach = |p: DVec3| corners.map(|q| q.distance_squared(p)).into_iter().fold(0.0, f64::max);
    let points = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0];
    let nearer = |x: (DVec3, f64), y: (DVec3, f64)| if y.1 < x.1 { y } else { x };
    let (middle, squared) = points.into_iter().map(|p| (p, reach(p))).fold((a, f64::INFINITY), nearer);
    (middle, squared.sqrt())
}
