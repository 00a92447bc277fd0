//! Explains why a contact is present or missing: the result of each stage of a detection for one
//! ordered pair.
use glam::DVec3;
use serde::Serialize;

use crate::collide::bodies::clip::ClippedPolygon;
use crate::collide::detect::ordered_pair::{Dropped, OrderedPair};
use crate::collide::mode::Mode;
use crate::collide::narrow::Minimum;
use crate::collide::options::CollideOptions;
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::collide::scene::shape::Shape;

/// The result for a pair of instances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PairVerdict {
    /// The pair goes on to the broad phase.
    Tested,
    /// They are the same instance.
    SameInstance,
    /// They are in different worlds.
    OtherWorlds,
    /// Their groups do not meet.
    GroupsDoNotMeet,
    /// The pair is excluded.
    Excluded,
    /// Both are planes.
    BothPlanes,
    /// Their bounds are farther apart than the contact distance.
    BoundsApart,
    /// The faces of *b* have all contacts: *a* is a plane, or a convex body and *b* a ball.
    OfOtherOrder,
}

/// The result of the broad phase for a face or node. Bounds are in the world's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BroadVerdict {
    /// It goes on to the middle phase.
    Candidate,
    /// A node of the face tree above it has no signed distance below `bound`, which is above the
    /// contact distance.
    PrunedByTree {
        /// The bound of the first such node on the way down.
        bound: f64,
    },
    /// The ball around it has no signed distance below `bound`, which is above the contact
    /// distance.
    PrunedByBall {
        /// Signed distance at the centre of the ball, minus its radius.
        bound: f64,
    },
}

/// The result of the middle and the narrow phase for a part of a face.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PolygonVerdict {
    /// It is a contact.
    Contact,
    /// Its cell has no signed distance up to the contact distance, so it was dropped without a
    /// search.
    CellBeyond,
    /// Its least signed distance is above the contact distance.
    Beyond,
    /// Dropped by the cosine filter, Eq. (10): the cosine between the gradient and the face's
    /// normal is above −cos θ.
    Filtered {
        /// ∇φ · n.
        cosine: f64,
    },
    /// Dropped because the surface is lower beside it, where local minima are wanted.
    Descending,
    /// Dropped because no direction is in the normal cones of both bodies there, where local minima
    /// are wanted: other places of the bodies meet first.
    OutOfCones,
}

/// A face clipped by one cell, a point of a whole face, or a node; in the world's unit and frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolygonReport {
    /// The cell's word in `domain.nodes`; `None` outside the domain's cube, and in the field of a
    /// simple shape.
    pub cell: Option<u32>,
    /// Corners of the clipped polygon; for a rounded shape, those of its core.
    pub vertices: Vec<DVec3>,
    /// The least signed distance that the mode finds without a limit.
    pub distance: f64,
    /// The point with this distance.
    pub point: DVec3,
    /// The face of *b* nearest to this point.
    pub face_b: u32,
    /// The result.
    pub verdict: PolygonVerdict,
}

/// A face of *a*, or a node in node mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartReport {
    /// The id of the face or node in the user's numbering.
    pub id: u32,
    /// The part's contact distance, in the world's unit: at most that of the pair. Parts that
    /// hardly move against the other body look less far.
    pub contact_distance: f64,
    /// The result of the broad phase.
    pub broad: BroadVerdict,
    /// All its polygons, in the order of the forest. With one contact per face: its contacts, or
    /// else the face with its least distance.
    pub polygons: Vec<PolygonReport>,
}

impl PartReport {
    /// The least signed distance over all polygons.
    pub fn distance(&self) -> f64 {
        self.polygons.iter().map(|p| p.distance).fold(f64::INFINITY, f64::min)
    }

    /// Number of its polygons that are contacts.
    pub fn contacts(&self) -> usize {
        self.polygons.iter().filter(|p| p.verdict == PolygonVerdict::Contact).count()
    }
}

/// The report for one ordered pair, before reduction: faces (or nodes) of *a* in the field of *b*.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WhyReport {
    /// The instance that has the faces.
    pub instance_a: InstanceId,
    /// The instance whose field is used.
    pub instance_b: InstanceId,
    /// The result for the pair. The rest is reported as if the pair was tested.
    pub pair: PairVerdict,
    /// The pair's contact distance, in the world's unit: that of the options plus what velocities
    /// add.
    pub contact_distance: f64,
    /// Distance between the bounds along the axis on which they are farthest apart; 0 when they
    /// overlap.
    pub bounds_gap: f64,
    /// Number of faces or nodes of *a*.
    pub total: usize,
    /// Number of faces or nodes that the broad phase keeps.
    pub candidates: usize,
    /// The requested face or node; without a request, all candidates.
    pub parts: Vec<PartReport>,
}

/// Reports the result of each stage of [`detect`](crate::collide::detect()) for the faces (in node mode:
/// nodes) of `a` in the field of `b`: for `part`, or for all candidates. The stages are those of
/// the detection itself. What they drop is still computed for the report. With one contact per
/// face, a contact that faces share at a vertex is reported for each of them.
///
/// # Errors
/// As [`detect`](crate::collide::detect()); also for an unknown instance, or a face or node that `a` does
/// not have.
pub fn why(
    scene: &Scene,
    options: &CollideOptions,
    a: InstanceId,
    b: InstanceId,
    part: Option<u32>,
) -> Result<WhyReport, CollideError> {
    options.validate()?;
    let (of_a, of_b) = (scene.instance(a)?, scene.instance(b)?);
    let (shape_a, shape_b) = (scene.shape(of_a.shape)?, scene.shape(of_b.shape)?);
    let contact_distance = OrderedPair::contact_distance(scene, options, [a, b])?;
    let (bounds_a, bounds_b) = (scene.bounds(a)?, scene.bounds(b)?);
    let bounds_gap = bounds_a.gap(bounds_b).max_element();
    let pair = match () {
        () if a == b => PairVerdict::SameInstance,
        () if of_a.world != of_b.world => PairVerdict::OtherWorlds,
        () if !of_a.groups.meet(of_b.groups) => PairVerdict::GroupsDoNotMeet,
        () if scene.is_excluded(a, b) => PairVerdict::Excluded,
        () if matches!((shape_a, shape_b), (Shape::Plane, Shape::Plane)) => PairVerdict::BothPlanes,
        () if bounds_gap > contact_distance => PairVerdict::BoundsApart,
        () => PairVerdict::Tested,
    };
    let mut report = WhyReport {
        instance_a: a,
        instance_b: b,
        pair,
        contact_distance,
        bounds_gap,
        total: 0,
        candidates: 0,
        parts: Vec::new(),
    };
    if pair == PairVerdict::BothPlanes {
        return Ok(report);
    }
    let stages = Stages { pair: OrderedPair::new(scene, options, a, b, contact_distance)?, options };
    if report.pair == PairVerdict::Tested && stages.pair.is_of_other_order() {
        report.pair = PairVerdict::OfOtherOrder;
    }
    let candidates = stages.pair.candidates();
    let wanted = match part {
        None => candidates.clone(),
        Some(id) => stages.named(id)?,
    };
    report.total = stages.total();
    report.candidates = candidates.len();
    report.parts = wanted.into_iter().map(|p| stages.part(p, candidates.binary_search(&p).is_ok())).collect();
    Ok(report)
}

struct Stages<'a> {
    pair: OrderedPair<'a>,
    options: &'a CollideOptions,
}

impl Stages<'_> {
    fn total(&self) -> usize {
        let surface = &self.pair.surface;
        match self.options.mode {
            Mode::Node => surface.node_count() as usize,
            Mode::Face { .. } | Mode::Exact(_) => surface.face_count() as usize,
        }
    }

    /// The candidates with this id in the user's numbering; a plane has two.
    fn named(&self, id: u32) -> Result<Vec<u32>, CollideError> {
        let total = self.total() as u32;
        let found: Vec<u32> = match self.options.mode {
            Mode::Node => (0..total).filter(|&node| node == id).collect(),
            Mode::Face { .. } | Mode::Exact(_) => {
                (0..total).filter(|&f| self.pair.surface.face_id(f) == id).collect()
            }
        };
        if found.is_empty() {
            let (option, expected) = match self.options.mode {
                Mode::Node => ("node", "a node of the body, counted from 0"),
                Mode::Face { .. } | Mode::Exact(_) => {
                    ("face", "a face of the body, counted from 0 as in the encoded mesh")
                }
            };
            return Err(CollideError::Option { option, found: format!("{id} (of {total})"), expected });
        }
        Ok(found)
    }

    fn part(&self, candidate: u32, is_candidate: bool) -> PartReport {
        let OrderedPair { surface, field, reach, .. } = &self.pair;
        let (part, face, id) = self.pair.part(candidate);
        let search = self.pair.search_of([&part]);
        let contact_distance = search.reach * field.unit();
        let unit = field.unit();
        let broad = if is_candidate {
            BroadVerdict::Candidate
        } else {
            let holds = |start: u32, count: u32| surface.holds(start, count, candidate, self.options.mode);
            match surface.pruned_by(field, reach, holds) {
                Some(bound) => BroadVerdict::PrunedByTree { bound: bound * unit },
                None => {
                    let (center, radius) = part.ball();
                    let bound = field.least_within(center, radius + part.radius) * unit;
                    BroadVerdict::PrunedByBall { bound }
                }
            }
        };
        let describe = |polygon: &ClippedPolygon, minimum: &Minimum, verdict| PolygonReport {
            cell: polygon.cell,
            vertices: polygon.polygon.points().map(|p| field.to_world(p)).collect(),
            distance: (minimum.value.distance - part.radius) * unit,
            point: field.to_world(field.surface_points(minimum.point, part.radius, &minimum.value)[0]),
            face_b: field.names(&minimum.value).0,
            verdict,
        };
        // First the limits of the detection, then no limit.
        let mut seen = Vec::new();
        let mut kept = Vec::new();
        search.minima(field, &part, None, &mut |polygon| seen.push(key(polygon)), &mut |polygon, minimum| {
            let (minimum, cosine) = self.pair.faced(&part, candidate, minimum);
            let verdict = match self.pair.contact(&part, candidate, &minimum, cosine, [face, id]) {
                Err(Dropped::ByCosine(cosine)) => PolygonVerdict::Filtered { cosine },
                Err(Dropped::Descending) => PolygonVerdict::Descending,
                Err(Dropped::OutOfCones) => PolygonVerdict::OutOfCones,
                Ok(_) => PolygonVerdict::Contact,
            };
            kept.push((key(polygon), describe(polygon, &minimum, verdict)));
        });
        if search.is_of_faces() && !kept.is_empty() {
            let polygons = kept.into_iter().map(|k| k.1).collect();
            return PartReport { id, contact_distance, broad, polygons };
        }
        let mut polygons = Vec::new();
        search.within(f64::INFINITY).minima(field, &part, None, &mut |_| (), &mut |polygon, minimum| {
            let key = key(polygon);
            let verdict = match kept.iter().find(|k| k.0 == key) {
                Some((_, found)) => found.verdict,
                None if seen.contains(&key) => PolygonVerdict::Beyond,
                None => PolygonVerdict::CellBeyond,
            };
            polygons.push(describe(polygon, &minimum, verdict));
        });
        if search.is_of_faces() {
            // Without a limit, the extremes of flat contact are others.
            polygons.truncate(1);
        }
        PartReport { id, contact_distance, broad, polygons }
    }
}

/// Identifies a polygon among those of one face.
type Key = (Option<u32>, [u64; 3]);

fn key(polygon: &ClippedPolygon) -> Key {
    let first = polygon.polygon.points().next().unwrap_or(DVec3::NAN);
    (polygon.cell, first.to_array().map(f64::to_bits))
}
