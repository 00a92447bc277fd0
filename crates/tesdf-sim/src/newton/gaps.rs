//! The gaps of contacts: at the beginning of a step, and at the poses that a minimisation predicts.
use std::collections::BTreeMap;

use glam::DVec3;
use nalgebra::Vector6;
use tesdf::collide::{Contact, InstanceId, Mode, Pose};

use super::NewtonOptions;
use super::far_contacts::{FarContacts, Reach};
use super::flat_patches::{Place, spanning};
use super::normals::normals;
use super::rows::{Bodies, Center, Row};
use super::runs::sort_runs;
use super::step::Step;
use crate::joint::{relative, rotation_between};
use crate::{Mass, State, System};

/// Directions at the beginning and the end of a step are averaged when the cosine of their angle is
/// above this: the contact crosses an edge of a curved surface. Sharper edges are two surfaces.
const SAME_SURFACE: f64 = 0.97;

/// Normals that differ by less, rad, are those of one face.
const SAME_NORMAL: f64 = 1e-6;

/// A contact that slides is lifted by at most this share of its way.
const LIFT: f64 = 0.01;

/// A contact that slides by less than this share of its skin in a step is at rest. Lifts by the
/// rounding of bodies at rest would add up.
const STILL: f64 = 0.1;

/// Room for the rows of joints behind those of contacts, which would have to move for more.
const OTHERS: usize = 64;

/// What the gaps of contacts depend on.
#[derive(Clone, Copy)]
pub struct Gaps<'a> {
    /// The bodies, in the states at the beginning of the step.
    pub system: &'a System,
    /// Parameters of the engine.
    pub options: &'a NewtonOptions,
    /// Diagonal of each body's bounding box, m.
    pub sizes: &'a [f64],
    /// The mode of the detection.
    pub mode: Mode,
    /// The step.
    pub step: &'a Step,
}

/// A contact and what the gap of its row depends on.
pub struct Found<'a> {
    pub contact: &'a Contact,
    /// That of [`normals`].
    normal: DVec3,
    /// The way by which kinematic bodies open the gap in the step, m.
    carried: f64,
    /// The distance that the contact keeps, m.
    skin: f64,
    /// The way by which the contact slides in the step, m.
    way: f64,
}

impl Found<'_> {
    /// The way by which kinematic bodies open the gap in the step, m.
    pub fn carried(&self) -> f64 {
        self.carried
    }
}

/// What the contacts of two instances have in common.
struct Pair {
    centers: [Option<Center>; 2],
    /// Coefficients of friction, and of torsional friction, m.
    friction: [f64; 2],
    skin: f64,
    motions: [BodyMotion; 2],
    /// The gap up to which contacts get rows, m.
    reach: f64,
}

/// The motion of a body.
struct BodyMotion {
    /// Of the centre, m/s.
    linear: DVec3,
    /// rad/s
    angular: DVec3,
    /// m
    center: DVec3,
    is_kinematic: bool,
}

impl BodyMotion {
    /// The velocity of a point of the body, m/s.
    fn at(&self, point: DVec3) -> DVec3 {
        self.linear + self.angular.cross(point - self.center)
    }
}

/// What predicted gaps need of the contacts at the beginning of the step.
pub struct Beginning<'a> {
    depths: Depths,
    before: Before<'a>,
}

/// For each pair of instances and feature of the first one: how far it is below the skin, m.
struct Depths {
    features: Vec<((InstanceId, InstanceId, u32), f64)>,
    /// The same for each pair, the lower instance first.
    pairs: BTreeMap<(InstanceId, InstanceId), f64>,
}

/// The contacts whose directions the predicted ones are averaged with, sorted by their features.
struct Before<'a>(Vec<Earlier<'a>>);

/// A contact at the beginning of the step.
#[derive(Clone, Copy)]
struct Earlier<'a> {
    found: &'a Found<'a>,
    row: &'a Row,
    /// Its point in the frame of *a*.
    point: DVec3,
}

impl Pair {
    /// The velocity of *a* relative to *b* at a point, as far as these are kinematic, m/s.
    fn carrying(&self, point: DVec3) -> DVec3 {
        let at = |motion: &BodyMotion| if motion.is_kinematic { motion.at(point) } else { DVec3::ZERO };
        at(&self.motions[0]) - at(&self.motions[1])
    }

    /// The angular velocity of *a* relative to *b*, as far as these are kinematic, rad/s.
    fn turning(&self) -> DVec3 {
        let of = |motion: &BodyMotion| if motion.is_kinematic { motion.angular } else { DVec3::ZERO };
        of(&self.motions[0]) - of(&self.motions[1])
    }
}

impl<'a> Gaps<'a> {
    /// The bodies that rows connect.
    pub fn bodies(&self) -> Bodies<'a> {
        Bodies { system: self.system, free_of: &self.step.free_of }
    }

    /// The contacts that were detected at `poses` and have a free body, and the row of each, whose
    /// gap is the distance above the skin. Without rows are those that `reach` does not reach when
    /// bodies go on for `time` seconds with the velocities of the beginning of the step, and those of
    /// flat patches that others span.
    pub fn find<'c>(
        &self,
        contacts: &'c [Contact],
        poses: &[Pose],
        reach: Reach<'_>,
        time: f64,
    ) -> (Vec<Found<'c>>, Vec<Row>, FarContacts) {
        let (mut near, mut far) = (Vec::with_capacity(contacts.len()), FarContacts::default());
        let mut pairs: Vec<((InstanceId, InstanceId), Option<Pair>)> = Vec::new();
        for contact in contacts {
            // The contacts of a pair come together.
            if pairs.last().is_none_or(|(last, _)| *last != ids(contact)) {
                pairs.push((ids(contact), self.pair(ids(contact), poses, reach)));
            }
            let Some((_, Some(pair))) = pairs.last() else { continue };
            let Pair { centers, skin, motions, reach, .. } = pair;
            let (normal, point) = (contact.normal, contact.point_a);
            let relative = motions[0].at(point) - motions[1].at(point);
            let gap = contact.distance - skin;
            if gap + time * relative.dot(normal) > *reach {
                far.push(gap + time * pair.carrying(point).dot(normal), normal, point, centers);
            } else {
                near.push((contact, pairs.len() - 1, relative));
            }
        }
        let normals = match self.mode {
            Mode::Node => Some(normals(near.iter().map(|(contact, ..)| *contact))),
            // Those of the detection are in the normal cones.
            Mode::Face { .. } | Mode::Exact(_) => None,
        };
        let place = |k: usize| {
            let contact = near[k].0;
            let normal = normals.as_ref().map_or(contact.normal, |normals| normals[k]);
            let normal = if contact.instance_a < contact.instance_b { normal } else { -normal };
            Place { normal, point: 0.5 * (contact.point_a + contact.point_b), gap: contact.distance }
        };
        let of = |k: usize| {
            let (a, b) = ids(near[k].0);
            (a.min(b), a.max(b))
        };
        let spanning = spanning(near.len(), of, place);
        // Others follow the rows of contacts.
        let mut rows = Vec::with_capacity(near.len() + OTHERS);
        let mut found = Vec::with_capacity(near.len());
        for (k, (contact, pair, relative)) in near.into_iter().enumerate() {
            let normal = normals.as_ref().map_or(contact.normal, |normals| normals[k]);
            let Some(pair) = &pairs[pair].1 else { continue };
            if !spanning[k] {
                continue;
            }
            let stiffness = self.options.stiffness;
            let Some(mut row) = Row::of_contact(contact, normal, &pair.centers, pair.friction, stiffness)
            else {
                continue;
            };
            let carried = self.step.h * pair.carrying(contact.point_a);
            if let Some(friction) = &mut row.friction {
                friction.way = carried.reject_from_normalized(normal);
                friction.turn = self.step.h * pair.turning().dot(normal);
            }
            row.gap -= pair.skin;
            let slip = relative.reject_from_normalized(normal);
            let (carried, way) = (carried.dot(normal), self.step.h * slip.length());
            rows.push(row);
            found.push(Found { contact, normal, carried, skin: pair.skin, way });
        }
        (found, rows, far)
    }

    /// What contacts of these instances, found at `poses`, have in common. `None` where neither is of
    /// a free body.
    fn pair(&self, (a, b): (InstanceId, InstanceId), poses: &[Pose], reach: Reach<'_>) -> Option<Pair> {
        let bodies = [self.system.body_of(a)?, self.system.body_of(b)?];
        let center = |body: usize| match self.system.bodies()[body].mass {
            Mass::Free(mass) => {
                Some(Center { free: self.step.free_of[body]?, place: poses[body].to_world(mass.center) })
            }
            Mass::Fixed | Mass::Kinematic => None,
        };
        let centers = bodies.map(center);
        (centers != [None; 2]).then(|| Pair {
            reach: reach.between(&centers),
            centers,
            friction: [
                self.system.friction(bodies[0], bodies[1]),
                self.system.friction_torsional(bodies[0], bodies[1]),
            ],
            skin: self.skin(bodies[0], bodies[1]),
            motions: bodies.map(|body| self.motion(body, poses)),
        })
    }

    /// The motion of a body that is at `poses`, with the velocities of the beginning of the step.
    fn motion(&self, body: usize, poses: &[Pose]) -> BodyMotion {
        let State { linear, angular, .. } = self.system.states()[body];
        let (linear, angular, center) = match self.system.bodies()[body].mass {
            Mass::Free(mass) => (linear, angular, poses[body].to_world(mass.center)),
            Mass::Kinematic => (linear, angular, poses[body].translation),
            Mass::Fixed => (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO),
        };
        let is_kinematic = self.system.bodies()[body].mass == Mass::Kinematic;
        BodyMotion { linear, angular, center, is_kinematic }
    }

    /// Gives the rows of contacts that were found the gaps of the beginning of the step.
    pub fn begin(&self, found: &[Found<'_>], rows: &mut [Row]) {
        for (found, row) in found.iter().zip(rows) {
            let depth = (-row.gap).max(0.0);
            row.relaxed_gap = row.gap + depth + found.carried;
            row.gap = row.relaxed_gap - self.lift(depth, found);
        }
    }

    /// For each free body: the share of the step after which it is hit, when it is where these
    /// contacts were found and goes on with the velocities of `target`. Only contacts count that
    /// close by more than `far` of the smaller body's size in the step. Infinite without any.
    pub fn shares(&self, found: &[Found<'_>], rows: &[Row], target: &[Vector6<f64>], far: f64) -> Vec<f64> {
        let mut shares = vec![f64::INFINITY; self.step.free.len()];
        for (Found { contact, skin, .. }, row) in found.iter().zip(rows) {
            let bodies = [contact.instance_a, contact.instance_b].into_iter();
            let sizes = bodies.filter_map(|id| Some(self.sizes[self.system.body_of(id)?]));
            let way = -self.step.h * row.rate(target);
            if way > far * sizes.fold(f64::INFINITY, f64::min) {
                for (k, _) in row.sides.iter().flatten() {
                    shares[*k] = shares[*k].min((contact.distance - skin).max(0.0) / way);
                }
            }
        }
        shares
    }

    /// The rows of the contacts at the poses that `velocities` predict. `is_hit` tells of free
    /// bodies whether these are the poses at which they are hit. Each gap is the predicted
    /// distance, extrapolated back to the beginning of the step along its gradient.
    pub fn predicted_rows(
        &self,
        contacts: &[Contact],
        poses: &[Pose],
        velocities: &[Vector6<f64>],
        Beginning { depths, before }: &Beginning<'_>,
        is_hit: &[bool],
        reach: Reach<'_>,
    ) -> (Vec<Row>, FarContacts) {
        let (found, mut rows, mut far) = self.find(contacts, poses, reach, 0.0);
        far.extrapolate(velocities, self.step.h);
        for (found, row) in found.iter().zip(&mut rows) {
            if let Some(point) = self.point_of_a(found.contact, poses)
                && let Some(before) = before.of(found, point)
            {
                // Where a body slides along a face, the contact before may be that of another corner.
                let turns = before.found.normal.distance(found.normal) > SAME_NORMAL;
                if turns
                    && before.point.distance(point) <= self.travel(found.contact, point, poses)
                    && !row.sides.iter().flatten().any(|(k, _)| is_hit[*k])
                {
                    row.average(before.row);
                }
            }
            let gap = row.gap - self.step.h * row.rate(velocities);
            // A face may have several contacts, and its deepest one is not at this place. The body
            // must not sink in here by the depth there.
            let depth = depths.of(found).min(-gap).max(0.0);
            row.gap = gap + depth - self.lift(depth, found);
            row.relaxed_gap = gap + depth;
            if self.mode != Mode::Node {
                // Where a body crosses an edge, the gap at the beginning is below the plane of the
                // face at the end. Asking for that way as a velocity, too, drove a nut on. Only
                // bodies that are moved may ask for a velocity that parts the bodies, so energy is
                // never gained.
                row.relaxed_gap = row.relaxed_gap.max(found.carried.min(0.0));
            }
        }
        (rows, far)
    }

    /// What [`predicted_rows`](Self::predicted_rows) needs of the `contacts` at the beginning of
    /// the step. Those in `found` have a free body, and these rows.
    pub fn beginning<'f>(
        &self,
        contacts: &[Contact],
        found: &'f [Found<'f>],
        rows: &'f [Row],
    ) -> Beginning<'f> {
        Beginning { depths: self.depths(contacts), before: self.before(found, rows) }
    }

    /// With the directions of the end alone, a body that crosses an edge is braked or driven on by
    /// it; the mean over the step does neither. Contacts of vertices stay as they are: for gears
    /// the mean was worse.
    fn before<'f>(&self, found: &'f [Found<'f>], rows: &'f [Row]) -> Before<'f> {
        if self.mode == Mode::Node {
            return Before(Vec::new());
        }
        let earlier = |(found, row): (&'f Found<'f>, &'f Row)| {
            let point = self.point_of_a(found.contact, &self.step.poses)?;
            Some(Earlier { found, row, point })
        };
        let before = found.iter().zip(rows).filter_map(earlier).collect();
        let pair = |earlier: &Earlier<'_>| ids(earlier.found.contact);
        Before(sort_runs(before, pair, |earlier| earlier.found.contact.feature.a))
    }

    /// The point of *a* of a contact that was found at `poses`, in the frame of *a*.
    fn point_of_a(&self, contact: &Contact, poses: &[Pose]) -> Option<DVec3> {
        Some(poses[self.system.body_of(contact.instance_a)?].to_body(contact.point_a))
    }

    /// How far the contact at `point`, in the frame of *a*, can have come along *a* since the
    /// beginning of the step, m: as *b* slides there and rolls about radii up to the smaller body's
    /// size. A contact farther away is that of another corner.
    fn travel(&self, contact: &Contact, point: DVec3, poses: &[Pose]) -> f64 {
        let bodies = [contact.instance_a, contact.instance_b].map(|id| self.system.body_of(id));
        let [Some(a), Some(b)] = bodies else { return 0.0 };
        let [from, to] = [&self.step.poses[..], poses].map(|poses| relative(poses[a], poses[b]));
        let slide = from.to_world(to.to_body(point)).distance(point);
        slide + rotation_between(from, to).length() * self.sizes[a].min(self.sizes[b])
    }

    fn depths(&self, contacts: &[Contact]) -> Depths {
        let depth = |c: &Contact| {
            let [a, b] = [c.instance_a, c.instance_b].map(|id| self.system.body_of(id));
            let depth = self.skin(a?, b?) - c.distance;
            (depth > 0.0).then_some((feature(c), depth))
        };
        let depths: Vec<_> = contacts.iter().filter_map(depth).collect();
        let mut depths = sort_runs(depths, |((a, b, _), _)| (*a, *b), |((.., feature), _)| *feature);
        // A face may touch in several cells; the deepest contact counts.
        depths.dedup_by(|(k, d), (l, e)| {
            let same = k == l;
            if same {
                *e = e.max(*d);
            }
            same
        });
        let mut pairs = BTreeMap::new();
        for &((a, b, _), depth) in &depths {
            let of_pair = pairs.entry((a.min(b), a.max(b))).or_insert(depth);
            *of_pair = depth.max(*of_pair);
        }
        Depths { features: depths, pairs }
    }

    /// The distance by which the step lifts a contact that is `depth` metres below its skin.
    fn lift(&self, depth: f64, &Found { skin, way, .. }: &Found<'_>) -> f64 {
        let NewtonOptions { correction, correction_speed, .. } = *self.options;
        let penetration = (depth - skin).max(0.0);
        let removed = (correction * penetration).min(correction_speed * self.step.h);
        let slid = (way - STILL * skin).max(0.0);
        removed + (correction * (depth - penetration)).min(LIFT * slid)
    }

    /// The distance that contacts of a pair of bodies keep, m.
    fn skin(&self, a: usize, b: usize) -> f64 {
        self.options.skin * self.sizes[a].min(self.sizes[b])
    }
}

impl<'a> Before<'a> {
    /// The contact of the same face of *a* whose point is nearest to that of another one, which is
    /// `point` in the frame of *a*.
    fn of(&self, Found { contact, normal, .. }: &Found<'_>, point: DVec3) -> Option<&Earlier<'a>> {
        let key = feature(contact);
        let first = self.0.partition_point(|e| feature(e.found.contact) < key);
        let same = self.0[first..].iter().take_while(|e| feature(e.found.contact) == key);
        let same = same.filter(|e| e.found.normal.dot(*normal) > SAME_SURFACE);
        same.min_by(|p, q| p.point.distance(point).total_cmp(&q.point.distance(point)))
    }
}

impl Depths {
    /// Depth of the feature that a contact belongs to, m. Within the skin it is at least that of
    /// the pair: contacts come and go there, and one that comes must not lift the bodies.
    fn of(&self, Found { contact, skin, .. }: &Found<'_>) -> f64 {
        let (a, b) = (contact.instance_a, contact.instance_b);
        let key = (a, b, contact.feature.a);
        let of_feature =
            self.features.binary_search_by_key(&key, |&(key, _)| key).map_or(0.0, |at| self.features[at].1);
        let of_pair = self.pairs.get(&(a.min(b), a.max(b))).copied().unwrap_or(0.0);
        of_feature.max(of_pair.min(*skin))
    }
}

/// The instances of a contact.
fn ids(contact: &Contact) -> (InstanceId, InstanceId) {
    (contact.instance_a, contact.instance_b)
}

/// The face or vertex of a contact.
fn feature(contact: &Contact) -> (InstanceId, InstanceId, u32) {
    (contact.instance_a, contact.instance_b, contact.feature.a)
}
