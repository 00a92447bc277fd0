//! Where bodies are hit that close fast in a step.
//!
//! The contacts of a fast body at the beginning of a step have the normals of where it was, and
//! those at the predicted end may be deep, with the normals of other faces: a ball that met another
//! one off centre at 25 mm a step kept 3.9 instead of 2.5 m/s. So such bodies are moved, without
//! contacts, to where they are hit first (conservative advancement), and the contacts with a force
//! there hold for the step.
use nalgebra::Vector6;
use tesdf::collide::{HiddenSearch, Pose};

use super::Newton;
use super::far_contacts::Reach;
use super::gaps::Found;
use super::rows::{Row, RowForce};
use super::step::Step;
use crate::DynamicsError;

/// Bodies that close by more than this part of the smaller one's size in a step are moved to where
/// they are hit.
pub const FAR: f64 = 0.1;

/// Most detections on the way.
const ADVANCES: u32 = 6;

/// The advancement ends when no body moves on by more than this part of a step.
const ARRIVED: f64 = 1e-3;

/// The bodies that are hit in a step.
pub struct Hit {
    /// For each free body: whether it is hit.
    pub is_hit: Vec<bool>,
    /// Velocities that move these bodies to where they are hit, and the others as before.
    pub velocities: Vec<Vector6<f64>>,
}

impl Newton {
    /// The bodies that contacts in `found`, with these rows, let meet fast. `otherwise` are the
    /// velocities of the others. `None` when there are none.
    pub(super) fn hit(
        &mut self,
        step: &mut Step,
        found: &[Found<'_>],
        rows: &[Row],
        otherwise: &[Vector6<f64>],
    ) -> Result<Option<Hit>, DynamicsError> {
        let target = step.target.clone();
        let mut shares = self.gaps(step).shares(found, rows, &target, FAR);
        let mut hit = Hit { is_hit: vec![false; shares.len()], velocities: otherwise.to_vec() };
        for _ in 0..ADVANCES {
            for (k, share) in shares.iter().enumerate() {
                hit.is_hit[k] = *share < 1.0 && !step.deep[k];
                hit.velocities[k] = if hit.is_hit[k] { *share * target[k] } else { otherwise[k] };
            }
            if !hit.is_hit.contains(&true) {
                return Ok(None);
            }
            step.report.advances += 1;
            let predicted = self.moved(step, &hit.velocities);
            let detection = self.detect(step, &predicted, HiddenSearch::Off)?;
            let poses: Vec<Pose> = predicted.iter().map(|state| state.pose).collect();
            let (found, rows, _) =
                self.gaps(step).find(detection.contacts().as_slice(), &poses, Reach::All, 0.0);
            let more = self.gaps(step).shares(&found, &rows, &target, FAR);
            let mut most = 0.0f64;
            for ((share, more), _) in shares.iter_mut().zip(more).zip(&hit.is_hit).filter(|(_, hit)| **hit) {
                most = most.max(more.min(1.0 - *share));
                *share += more;
            }
            if most < ARRIVED {
                break;
            }
        }
        Ok(Some(hit))
    }
}

impl Hit {
    /// Of rows at the places of the hits, those with a force, for the rest of the step: nothing
    /// comes closer there after it was hit.
    pub fn held(&self, rows: &[Row], forces: &[RowForce], stays: impl Fn(&Row) -> bool) -> Vec<Row> {
        let is_of_hit = |row: &Row| {
            let meets = row.sides.iter().flatten().any(|(k, _)| self.is_hit[*k]);
            meets && row.is_contact() && !stays(row)
        };
        let acting = rows.iter().zip(forces).filter(|(row, force)| force.along > 0.0 && is_of_hit(row));
        acting.map(|(row, _)| Row { relaxed_gap: row.relaxed_gap.min(0.0), ..row.clone() }).collect()
    }
}
