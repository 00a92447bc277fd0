//! The forces of a run's frames.
use tesdf::glam::{DVec3, Vec3};
use tesdf_sim::ContactForce;

use crate::Playback;
use crate::contacts::{CUBES, spread};

/// The contact forces of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameForces {
    /// The step whose mean forces they are: the last recorded one that begins at the frame or
    /// before. `None`: there is none.
    pub step: Option<u64>,
    /// Number of contacts that push.
    pub found: usize,
    /// Those that are kept, the greatest first.
    pub kept: Vec<DrawnForce>,
}

/// A force that is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnForce {
    /// Where it acts, m, relative to the centre of the run.
    pub point: Vec3,
    /// The force with friction on the body with the greater number, N, world frame.
    pub force: Vec3,
}

impl Playback<'_> {
    /// The contact forces of each frame, of which at most `most` are kept: the greatest of each of
    /// the cubes of [`ContactOptions::most`](crate::ContactOptions::most). `None` where that is
    /// 0, or the run has recorded no forces.
    pub fn forces(&self, most: usize) -> Option<Vec<FrameForces>> {
        if most == 0 || self.record.forces().len() == 0 {
            return None;
        }
        let of_frame = |&step: &usize| {
            let Some((step, forces)) = self.record.latest_forces(step as u64) else {
                return FrameForces::default();
            };
            let (found, kept) = drawn(&forces.contacts, self.centre, self.diagonal(), most);
            FrameForces { step: Some(step), found, kept }
        };
        Some(self.steps.iter().map(of_frame).collect())
    }
}

/// The number of forces, and those that are drawn, around `centre`.
pub(crate) fn drawn(
    contacts: &[ContactForce],
    centre: DVec3,
    diagonal: f64,
    most: usize,
) -> (usize, Vec<DrawnForce>) {
    let arrow = |contact: &ContactForce| {
        let [first, second] = contact.bodies;
        let sign = if first < second { -1.0 } else { 1.0 };
        DrawnForce { point: (contact.point - centre).as_vec3(), force: (sign * contact.force()).as_vec3() }
    };
    let mut arrows: Vec<DrawnForce> = contacts.iter().map(arrow).collect();
    // A file that was made by hand may have anything.
    arrows.retain(|arrow| arrow.point.is_finite() && arrow.force.is_finite());
    let found = arrows.len();
    arrows.sort_by(|a, b| b.force.length().total_cmp(&a.force.length()));
    (found, spread(arrows, |arrow| arrow.point, diagonal / CUBES, most))
}
