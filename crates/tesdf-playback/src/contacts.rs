//! The contacts of a run's frames.
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use tesdf::collide::{CollideError, CollideOptions, Contact, detect_until};
use tesdf::glam::{DVec3, Vec3};
use tesdf_sim::record::RecordedContact;
use tesdf_sim::{Mass, State, System};

use crate::playback::pose;
use crate::{Playback, PlaybackError};

/// Recorded points are 32-bit floats in the world frame. They are used where the run is within this
/// many diagonals of the origin, so that they are right to 10⁻⁵ of the diagonal.
const NEAR: f64 = 100.0;
/// Number of cubes along the diagonal of a run of which each first keeps one arrow.
pub(crate) const CUBES: f64 = 32.0;

/// Options of [`Playback::contacts`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactOptions {
    /// How contacts are detected where the run has not recorded them: those of the scene, from
    /// [`LoadedScene::detection`](tesdf_sim::scene_file::LoadedScene::detection). `None`: the scene
    /// detects none.
    pub detection: Option<CollideOptions>,
    /// Most contacts of a frame that are kept. Space is cut into cubes, 32 along the diagonal of
    /// the run. First the deepest contact of each cube is kept, the deepest of all first, then the
    /// second of each, and so on.
    pub most: usize,
}

impl ContactOptions {
    /// Most contacts of a frame by default.
    pub const MOST: usize = 128;
}

/// The contacts of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameContacts {
    /// Number of contacts up to the scene's contact distance, except those between fixed bodies.
    pub found: usize,
    /// Those that are kept, the deepest first. The deepest of all is among them.
    pub kept: Vec<DrawnContact>,
}

/// A contact that is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnContact {
    /// The point on the body whose distance field was asked, m, relative to the centre of the run.
    pub point: Vec3,
    /// Unit normal that points away from that body, world frame.
    pub normal: Vec3,
    /// Signed distance, m; negative where the bodies overlap.
    pub distance: f64,
}

impl Playback<'_> {
    /// The contacts of each frame: those that the run has recorded at its step, or else those that
    /// are detected again at its poses. `system` is that of the run. `done` gets the number of
    /// frames so far. `None` when the run has no contacts: its scene detects none.
    ///
    /// # Errors
    /// A state or an option is not valid, or [`CollideError::Stopped`] after `stop` was set.
    pub fn contacts(
        &self,
        system: &System,
        options: &ContactOptions,
        stop: &AtomicBool,
        mut done: impl FnMut(usize),
    ) -> Result<Option<Vec<FrameContacts>>, PlaybackError> {
        let Some(detection) = &options.detection else { return Ok(None) };
        let recorded: BTreeMap<u64, Vec<RecordedContact>> = match self.is_near() {
            true => self.record.contacts().collect(),
            false => BTreeMap::new(),
        };
        let mut moved = system.clone();
        let mut frames = Vec::with_capacity(self.steps.len());
        for (frame, &step) in self.steps.iter().enumerate() {
            if stop.load(Ordering::Relaxed) {
                return Err(CollideError::Stopped.into());
            }
            let mut contacts = match recorded.get(&(step as u64)) {
                Some(contacts) => self.of_record(system, contacts, detection.contact_distance),
                None => {
                    let states = (0..self.bodies.len())
                        .map(|body| Ok(State::at_rest(pose(self.record, step, body)?)))
                        .collect::<Result<Vec<_>, PlaybackError>>()?;
                    let found = detect_until(moved.scene_at(&states)?, detection, stop)?;
                    self.of_detection(system, found.as_slice())
                }
            };
            let found = contacts.len();
            contacts.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            let kept = spread(contacts, |c| c.point, self.diagonal() / CUBES, options.most);
            frames.push(FrameContacts { found, kept });
            done(frame + 1);
        }
        Ok(Some(frames))
    }

    /// Whether the run has recorded the contacts of all frames but the last one, whose step has none,
    /// so that [`contacts`](Self::contacts) detects those of this one at most.
    pub fn has_recorded_contacts(&self) -> bool {
        let recorded = self.record.contact_steps();
        let others = &self.steps[..self.steps.len().saturating_sub(1)];
        let is_recorded = |&step: &usize| recorded.binary_search(&(step as u64)).is_ok();
        self.is_near() && !recorded.is_empty() && others.iter().all(is_recorded)
    }

    /// Whether the run is so near to the origin that recorded points are precise.
    fn is_near(&self) -> bool {
        self.bounds.center().length() <= NEAR * self.diagonal()
    }

    fn of_record(
        &self,
        system: &System,
        contacts: &[RecordedContact],
        contact_distance: f64,
    ) -> Vec<DrawnContact> {
        let is_fixed = |body: u32| system.body(body as usize).is_ok_and(|body| body.mass == Mass::Fixed);
        // The run has recorded contacts ahead of moving bodies, too.
        let is_kept = |c: &&RecordedContact| {
            f64::from(c.distance) <= contact_distance && !c.bodies.iter().all(|&body| is_fixed(body))
        };
        let drawn = |c: &RecordedContact| {
            let [point, normal] = [c.point, c.normal].map(|v| Vec3::from_array(v).as_dvec3());
            self.drawn(point, normal, f64::from(c.distance))
        };
        contacts.iter().filter(is_kept).map(drawn).collect()
    }

    fn of_detection(&self, system: &System, contacts: &[Contact]) -> Vec<DrawnContact> {
        let is_fixed =
            |instance| system.body_of(instance).is_some_and(|body| system.bodies()[body].mass == Mass::Fixed);
        let is_kept = |c: &&Contact| !is_fixed(c.instance_a) || !is_fixed(c.instance_b);
        let drawn = |c: &Contact| self.drawn(c.point_a, c.normal, c.distance);
        contacts.iter().filter(is_kept).map(drawn).collect()
    }

    /// The arrow begins on the body with the field, because the normal points away from it.
    fn drawn(&self, point_a: DVec3, normal: DVec3, distance: f64) -> DrawnContact {
        let point = (point_a - self.centre - distance * normal).as_vec3();
        DrawnContact { point, normal: normal.as_vec3(), distance }
    }
}

/// At most this many arrows, spread over cubes of this edge. They are and stay in the order of
/// their importance.
pub(crate) fn spread<T: Copy>(arrows: Vec<T>, point: fn(&T) -> Vec3, edge: f64, most: usize) -> Vec<T> {
    if arrows.len() <= most {
        return arrows;
    }
    let mut counts: BTreeMap<[i64; 3], usize> = BTreeMap::new();
    let mut ranked: Vec<(usize, usize)> = Vec::with_capacity(arrows.len());
    for (place, arrow) in arrows.iter().enumerate() {
        let cube = (point(arrow).as_dvec3() / edge).floor().to_array().map(|x| x as i64);
        let count = counts.entry(cube).or_default();
        ranked.push((*count, place));
        *count += 1;
    }
    ranked.sort_unstable();
    ranked.truncate(most);
    let mut places: Vec<usize> = ranked.into_iter().map(|(_, place)| place).collect();
    places.sort_unstable();
    places.into_iter().map(|place| arrows[place]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cube_keeps_its_deepest_contact_before_another_keeps_two() {
        let contact = |x: f32, distance: f64| DrawnContact { point: Vec3::X * x, normal: Vec3::Z, distance };
        let all = vec![
            contact(0.1, -9.0),
            contact(0.2, -8.0),
            contact(0.3, -7.0),
            contact(1.5, -6.0),
            contact(-0.5, 1.0),
        ];
        let kept = |most| -> Vec<f64> {
            spread(all.clone(), |c| c.point, 1.0, most).iter().map(|c| c.distance).collect()
        };
        assert!(kept(0).is_empty());
        assert_eq!(kept(2), [-9.0, -6.0]);
        assert_eq!(kept(3), [-9.0, -6.0, 1.0]);
        assert_eq!(kept(4), [-9.0, -8.0, -6.0, 1.0]);
        assert_eq!(kept(9), [-9.0, -8.0, -7.0, -6.0, 1.0]);
    }
}
