//! Contact patches: contacts grouped by place and normal, and followed from one detection to the
//! next.
//!
//! A contact is one point of one face, and there are thousands on a thread. A patch is a region in
//! which two bodies touch: contacts of one pair of instances, in both orders, whose normals are
//! similar and which are near each other or share a face. It has a few points that span it, and an
//! id that stays the same as long as the region touches.
mod group;
mod outline;

use std::collections::BTreeMap;

use glam::DVec3;
use serde::Serialize;

use crate::base::Length;
use crate::collide::report::contact::Contact;
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::collide::scene::pose::Placement;
use group::groups;
use outline::Outline;

/// Options of a [`PatchTracker`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchOptions {
    /// Largest angle, in radians, between the normal of a contact and that of the deepest contact
    /// of its patch.
    pub angle: f64,
    /// Contacts up to this distance apart belong together: a fraction of the diagonal of the
    /// smaller body, or a length in the world's unit. Contacts on one face belong together at any
    /// distance.
    pub link: Length,
    /// Largest number of points of a patch.
    pub points: usize,
}

impl Default for PatchOptions {
    /// 30°, 1/32 of the smaller diagonal, four points.
    fn default() -> Self {
        Self { angle: 30f64.to_radians(), link: Length::OfDiagonal(1.0 / 32.0), points: 4 }
    }
}

impl PatchOptions {
    /// Checks all values.
    ///
    /// # Errors
    /// [`CollideError::Option`] names the option.
    pub fn validate(&self) -> Result<(), CollideError> {
        let refuse = |option, found: String, expected| Err(CollideError::Option { option, found, expected });
        if !(0.0..=std::f64::consts::FRAC_PI_2).contains(&self.angle) {
            return refuse("angle", self.angle.to_string(), "0 to π/2");
        }
        let (Length::OfDiagonal(link) | Length::Absolute(link)) = self.link;
        if !(link > 0.0 && link.is_finite()) {
            return refuse("link", link.to_string(), "a finite number greater than 0");
        }
        if self.points == 0 {
            return refuse("points", "0".into(), "at least 1");
        }
        Ok(())
    }
}

/// A point of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PatchPoint {
    /// Stays the same as long as the point keeps its place on one of the two bodies, for example on
    /// a corner that slides.
    pub id: u64,
    /// The index of its contact.
    pub contact: usize,
}

/// A region in which two instances touch.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactPatch {
    /// Stays the same as long as the region shares a face, of either body, with the region of the
    /// detection before. Never used again.
    pub id: u64,
    /// Number of updates since the patch appeared; 0 at its first one.
    pub age: u64,
    /// The instance with the lower id.
    pub instance_a: InstanceId,
    /// The instance with the higher id.
    pub instance_b: InstanceId,
    /// Mean unit normal, from b to a, in the world.
    pub normal: DVec3,
    /// Least signed distance, in the world's unit.
    pub distance: f64,
    /// Area of the convex hull of the contacts, seen along the normal; in the square of the world's
    /// unit. 0 where they lie on a line.
    pub area: f64,
    /// Pressure centre, in the world: the mean point of the hull, weighted by a pressure that is
    /// proportional to how far the distance of a point is below the greatest one of the patch.
    /// Where all distances are equal, all points count the same.
    pub center: DVec3,
    /// Points that span the patch. The first is the deepest.
    pub points: Vec<PatchPoint>,
    /// The indices of all its contacts, in ascending order.
    pub contacts: Vec<usize>,
}

/// The patches of a detection.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ContactPatches {
    /// The patches, sorted by instances. Those of one pair are sorted by distance.
    pub patches: Vec<ContactPatch>,
    /// Ids of the patches of the detection before that no longer touch, in ascending order.
    pub ended: Vec<u64>,
}

/// Groups the contacts of each detection into patches, and gives patches and points that continue
/// the ids that they had.
///
/// The result depends only on the detections so far, not on the number of threads.
///
/// # Example
///
/// ```
/// use tesdf::glam::DVec3;
/// use tesdf::collide::{PatchOptions, PatchTracker};
/// use tesdf::{CollideOptions, Instance, Pose, Scene, Shape, detect};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut scene = Scene::new();
/// let ball = scene.add_shape(Shape::Sphere { radius: 1.0 })?;
/// let floor = scene.add_shape(Shape::Plane)?;
/// let rolling = scene.add(Instance::new(ball, Pose::at(DVec3::new(0.0, 0.0, 1.0))))?;
/// scene.add(Instance::new(floor, Pose::IDENTITY))?;
/// let options = CollideOptions { contact_distance: 0.01, ..CollideOptions::default() };
/// let mut tracker = PatchTracker::new(PatchOptions::default())?;
/// for step in 0..10 {
///     let at = DVec3::new(0.1 * f64::from(step), 0.0, 1.0);
///     scene.set_poses(&[(rolling, Pose::at(at))])?;
///     let found = tracker.update(&scene, detect(&scene, &options)?.as_slice())?;
///     assert_eq!((found.patches.len(), found.patches[0].id), (1, 0));
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct PatchTracker {
    options: PatchOptions,
    known: BTreeMap<(InstanceId, InstanceId), Vec<Known>>,
    next_patch: u64,
    next_point: u64,
}

/// A patch of the detection before.
#[derive(Clone, Debug)]
struct Known {
    id: u64,
    age: u64,
    /// Its faces: for each, whether it is of the second instance, and its id. Sorted.
    faces: Vec<(bool, u32)>,
    points: Vec<KnownPoint>,
}

#[derive(Clone, Copy, Debug)]
struct KnownPoint {
    id: u64,
    /// Its place in the frames of both shapes.
    places: [DVec3; 2],
}

/// The two instances of a pair, the lower id first.
struct Pair {
    ids: (InstanceId, InstanceId),
    placements: [Placement; 2],
    /// In the world's unit.
    link: f64,
}

/// A point keeps its id when its place on one of the bodies has changed by at most this fraction of
/// the link.
const SAME_PLACE: f64 = 0.01;

impl PatchTracker {
    /// A tracker that has seen no contacts yet.
    ///
    /// # Errors
    /// [`CollideError::Option`] for an invalid option.
    pub fn new(options: PatchOptions) -> Result<Self, CollideError> {
        options.validate()?;
        Ok(Self { options, known: BTreeMap::new(), next_patch: 0, next_point: 0 })
    }

    /// The patches of a detection's contacts. `scene` must have the poses of the detection.
    ///
    /// # Errors
    /// A contact names an instance that the scene does not have. Nothing is changed then.
    pub fn update(&mut self, scene: &Scene, contacts: &[Contact]) -> Result<ContactPatches, CollideError> {
        let mut by_pair: BTreeMap<(InstanceId, InstanceId), Vec<usize>> = BTreeMap::new();
        for (i, c) in contacts.iter().enumerate() {
            let ids = (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b));
            by_pair.entry(ids).or_default().push(i);
        }
        let pairs = by_pair
            .into_iter()
            .map(|(ids, members)| Ok((self.pair(scene, ids)?, members)))
            .collect::<Result<Vec<_>, CollideError>>()?;
        let mut before = std::mem::take(&mut self.known);
        let mut found = ContactPatches::default();
        for (pair, members) in pairs {
            let groups = groups(contacts, &members, pair.ids.0, pair.link, self.options.angle);
            let regions: Vec<Region> =
                groups.into_iter().map(|members| Region::new(contacts, &pair, members)).collect();
            let mut old = before.remove(&pair.ids).unwrap_or_default();
            let continued = continued(&regions, &mut old);
            found.ended.extend(old.into_iter().map(|known| known.id));
            for (region, known) in regions.into_iter().zip(continued) {
                let patch = self.patch(contacts, &pair, region, known);
                found.patches.push(patch);
            }
        }
        found.ended.extend(before.into_values().flatten().map(|known| known.id));
        found.ended.sort_unstable();
        Ok(found)
    }

    fn pair(&self, scene: &Scene, ids: (InstanceId, InstanceId)) -> Result<Pair, CollideError> {
        let instances = [scene.instance(ids.0)?, scene.instance(ids.1)?];
        let mut smaller = f64::INFINITY;
        for instance in instances {
            smaller = smaller.min(scene.shape(instance.shape)?.diagonal() * instance.scale);
        }
        let link = self.options.link.resolve(smaller);
        Ok(Pair { ids, placements: instances.map(|instance| instance.placement()), link })
    }

    /// Makes a patch of the contacts of a region, and remembers it.
    fn patch(
        &mut self,
        contacts: &[Contact],
        pair: &Pair,
        region: Region,
        known: Option<Known>,
    ) -> ContactPatch {
        let Region { members, faces } = region;
        let outline = Outline::new(contacts, &members, pair.ids.0);
        let Known { id, age, points: before, .. } = known.unwrap_or_else(|| {
            self.next_patch += 1;
            Known { id: self.next_patch - 1, age: 0, faces: Vec::new(), points: Vec::new() }
        });
        let chosen = outline.points(self.options.points);
        let places: Vec<[DVec3; 2]> = chosen.iter().map(|&i| pair.places(&contacts[i])).collect();
        let ids = self.point_ids(&places, &before, SAME_PLACE * pair.link);
        let points: Vec<KnownPoint> =
            ids.iter().zip(places).map(|(&id, places)| KnownPoint { id, places }).collect();
        self.known.entry(pair.ids).or_default().push(Known { id, age: age + 1, faces, points });
        ContactPatch {
            id,
            age,
            instance_a: pair.ids.0,
            instance_b: pair.ids.1,
            normal: outline.normal,
            distance: outline.distance,
            area: outline.area,
            center: outline.center,
            points: chosen.iter().zip(ids).map(|(&contact, id)| PatchPoint { id, contact }).collect(),
            contacts: members,
        }
    }

    /// The ids of points: those of earlier points at the same places, the nearest first, and new
    /// ones.
    fn point_ids(&mut self, places: &[[DVec3; 2]], before: &[KnownPoint], near: f64) -> Vec<u64> {
        let mut matches = Vec::new();
        for (i, place) in places.iter().enumerate() {
            for (j, old) in before.iter().enumerate() {
                let moved = (0..2).map(|k| place[k].distance(old.places[k])).fold(f64::INFINITY, f64::min);
                if moved <= near {
                    matches.push((moved, j, i));
                }
            }
        }
        matches.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let mut ids = vec![None; places.len()];
        let mut taken = vec![false; before.len()];
        for (_, j, i) in matches {
            if ids[i].is_none() && !taken[j] {
                (ids[i], taken[j]) = (Some(before[j].id), true);
            }
        }
        ids.into_iter()
            .map(|id| {
                id.unwrap_or_else(|| {
                    self.next_point += 1;
                    self.next_point - 1
                })
            })
            .collect()
    }
}

impl Pair {
    /// The places of a contact's witness points in the frames of both shapes, in the world's unit.
    fn places(&self, contact: &Contact) -> [DVec3; 2] {
        let points = match contact.instance_a == self.ids.0 {
            true => [contact.point_a, contact.point_b],
            false => [contact.point_b, contact.point_a],
        };
        [0, 1].map(|k| self.placements[k].pose.to_body(points[k]))
    }
}

/// The contacts of a patch to be.
struct Region {
    /// Their indices, in ascending order.
    members: Vec<usize>,
    /// Their faces, as [`Known::faces`].
    faces: Vec<(bool, u32)>,
}

impl Region {
    fn new(contacts: &[Contact], pair: &Pair, members: Vec<usize>) -> Self {
        let of_contact = |&i: &usize| {
            let c = &contacts[i];
            let is_second = c.instance_a != pair.ids.0;
            [(is_second, c.face_a), (!is_second, c.face_b)]
        };
        let mut faces: Vec<(bool, u32)> = members.iter().flat_map(of_contact).collect();
        faces.sort_unstable();
        faces.dedup();
        Self { members, faces }
    }
}

/// For each region, the earlier patch that it continues: the one with which it shares the most
/// faces. A patch is continued once. Removes these patches from `old`.
fn continued(regions: &[Region], old: &mut Vec<Known>) -> Vec<Option<Known>> {
    let mut shared = Vec::new();
    for (r, region) in regions.iter().enumerate() {
        for (k, known) in old.iter().enumerate() {
            let count = region.faces.iter().filter(|face| known.faces.binary_search(face).is_ok()).count();
            if count > 0 {
                shared.push((std::cmp::Reverse(count), known.id, k, r));
            }
        }
    }
    shared.sort_unstable();
    let mut owner: Vec<Option<usize>> = vec![None; old.len()];
    let mut is_continued = vec![false; regions.len()];
    for (_, _, k, r) in shared {
        if owner[k].is_none() && !is_continued[r] {
            (owner[k], is_continued[r]) = (Some(r), true);
        }
    }
    let mut continued: Vec<Option<Known>> = regions.iter().map(|_| None).collect();
    let mut rest = Vec::new();
    for (known, owner) in std::mem::take(old).into_iter().zip(owner) {
        match owner {
            Some(region) => continued[region] = Some(known),
            None => rest.push(known),
        }
    }
    *old = rest;
    continued
}
