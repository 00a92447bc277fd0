//! The velocities of a step: from the contacts at its beginning, and those at the poses that they
//! predict.
use std::collections::BTreeSet;

use nalgebra::Vector6;
use tesdf::collide::{Contact, HiddenSearch, InstanceId, Pose};

use super::Newton;
use super::chains::Iterate;
use super::deep::pair;
use super::far_contacts::Reach;
use super::geometric::{Loads, Motion, Start};
use super::integrate::{unpack, velocity};
use super::islands::spread;
use super::joints::{joint_rows, predict};
use super::kept::Known;
use super::rows::{Gap, Resistance, Row, RowForce};
use super::solve::{Guess, carry_rows, from_last};
use super::step::Step;
use crate::DynamicsError;
use crate::forces::Forces;

/// The solution of a step.
pub struct Solved {
    /// The velocities of the free bodies that move the poses, ...
    pub velocities: Vec<Vector6<f64>>,
    /// ... and those that the next step starts from.
    pub carried: Vec<Vector6<f64>>,
    /// The forces that lead to the velocities of the next step, without those that correct poses.
    pub forces: Forces,
}

impl Newton {
    /// The velocities that move the poses, and the velocities that the next step starts from.
    pub(super) fn velocities(
        &mut self,
        step: &mut Step,
        contacts: &[Contact],
    ) -> Result<Solved, DynamicsError> {
        let start: Vec<_> = step.free.iter().map(|free| velocity(&self.system.states()[free.body])).collect();
        let ways: Vec<f64> = self.ways(step, &start, &step.target).collect();
        let mut reach = Reach::Near(&ways);
        loop {
            let verdict = step.report.verdict();
            if let Some(found) = self.velocities_within(step, contacts, &start, reach)? {
                return Ok(found);
            }
            step.report.take_back(verdict);
            reach = Reach::All;
        }
    }

    /// The same, with rows of the contacts within `near` and of those that a minimisation closes. Returns
    /// `None` where the last of them are closed after all.
    fn velocities_within(
        &mut self,
        step: &mut Step,
        contacts: &[Contact],
        start: &[Vector6<f64>],
        near: Reach<'_>,
    ) -> Result<Option<Solved>, DynamicsError> {
        let all = contacts;
        let contacts = &*self.surfaces.acting(self.system.scene(), all, |c| self.is_deep(c));
        let joints = joint_rows(&self.gaps(step).bodies(), step.h);
        // Where bodies overlap deeply, rigid contacts would contradict each other.
        let apart = self.apart(all);
        let mut plain = Motion::new(&step.free, &step.target);
        let count = step.free.len();
        let loads =
            |rows: &[Row], forces: &[RowForce]| Loads::new(count, rows, forces, rows.len() - joints.len());
        let from = Start { velocities: start, h: step.h, whole: step.whole };
        let mut found_at = vec![Vector6::zeros(); count];
        let mut reach = near;
        // Rows of the contacts, then those of the joints.
        let (found, first, mut far, mut velocities, mut forces, mut stiffened) = loop {
            let (found, mut first, far) = self.gaps(step).find(contacts, &step.poses, reach, step.h);
            self.gaps(step).begin(&found, &mut first);
            first.extend_from_slice(&joints);
            step.deep = self.deep(step, all, &first);
            step.resting.fill(false);
            for (row, found) in first.iter_mut().zip(&found).filter(|(row, _)| step.is_deep(row)) {
                let parts = apart.contains(&pair(found.contact));
                row.resistance = if parts { Resistance::Parting } else { Resistance::Spring };
            }
            let verdict = step.report.verdict();
            let known = self.kept.of(&first, start);
            let kept = known.as_ref().map(Known::forces);
            let of_kept =
                kept.as_deref().and_then(|kept| plain.stiffened(&loads(&first, kept), &found_at, &from));
            let motion = of_kept.as_ref().unwrap_or(&plain);
            let guess = Guess { velocities: start, forces: kept.as_deref(), known: known.as_ref() };
            let (mut velocities, mut forces) = self.solve(step, motion, &first, Gap::Position, guess)?;
            let stiffened = plain.stiffened(&loads(&first, &forces), &found_at, &from);
            let again = stiffened.as_ref().unwrap_or(&plain);
            if again.differs(motion, &plain) {
                (velocities, forces) =
                    self.solve(step, again, &first, Gap::Position, from_last(&velocities, &forces))?;
            }
            if !far.closes(&velocities, step.h) {
                break (found, first, far, velocities, forces, stiffened);
            }
            step.report.take_back(verdict);
            reach = Reach::All;
        };
        let of_contacts = &first[..found.len()];
        // Those of the last detection.
        let mut later: Option<Vec<Row>> = None;
        step.resting = self.resting(step, all, &first, &velocities);
        // The contacts at which bodies are hit, found where they are hit.
        let mut held: Vec<Row> = Vec::new();
        if first.iter().any(|row| !step.stays(row)) {
            let beginning = self.gaps(step).beginning(contacts, &found, of_contacts);
            let mut hit = match self.options.redetections {
                0 => None,
                _ => self.hit(step, &found, of_contacts, &velocities)?,
            };
            let mut round = 0;
            while round < self.options.redetections {
                // The first round, if any, is at the hits. The poses at the end of the step are
                // predicted from its beginning all the same: a body may turn far after it was hit.
                let hit = hit.take();
                round += u32::from(hit.is_none());
                let seen = hit.as_ref().map_or(&velocities, |hit| &hit.velocities).clone();
                let is_hit = hit.as_ref().map_or(vec![false; seen.len()], |hit| hit.is_hit.clone());
                let moved = self.moved(step, &seen);
                let mut predicted = moved.clone();
                // The contacts of these bodies stay, so the detection need not look as far as they
                // are pushed.
                for (k, free) in step.free.iter().enumerate().filter(|(k, _)| step.deep[*k]) {
                    let seen = &mut predicted[free.body];
                    (seen.linear, seen.angular) = unpack(&step.target[k]);
                }
                // A step reports the overlaps at its beginning.
                self.mark_resting(step);
                let detection = self.detect(step, &predicted, HiddenSearch::Off);
                self.mark_still();
                let detection = detection?;
                let poses: Vec<Pose> = predicted.iter().map(|state| state.pose).collect();
                let rows_within = |step: &Step, reach: Reach<'_>, held: &[Row]| {
                    let contacts = detection.contacts().as_slice();
                    let (mut next, far) =
                        self.gaps(step).predicted_rows(contacts, &poses, &seen, &beginning, &is_hit, reach);
                    next.retain(|row| !step.stays(row));
                    next.extend(of_contacts.iter().filter(|row| step.stays(row)).cloned());
                    next.extend_from_slice(held);
                    next.extend_from_slice(&joints);
                    let of_joints = next.len() - joints.len()..;
                    predict(&mut next[of_joints], &self.gaps(step).bodies(), &moved, &seen, step.h);
                    (next, far)
                };
                if let Some(hit) = hit {
                    let (next, _) = rows_within(step, Reach::All, &held);
                    let motion = stiffened.as_ref().unwrap_or(&plain);
                    let guess = carry_rows(later.as_ref().unwrap_or(&first), &forces, &next);
                    let (_, forces) =
                        self.solve(step, motion, &next, Gap::Position, from_last(&velocities, &guess))?;
                    held = hit.held(&next, &forces, |row| step.stays(row));
                    continue;
                }
                step.turn(&mut plain, &velocities);
                found_at.clone_from(&velocities);
                let last = later.as_ref().unwrap_or(&first);
                stiffened = plain.stiffened(&loads(last, &forces), &found_at, &from);
                let motion = stiffened.as_ref().unwrap_or(&plain);
                let before = velocities.clone();
                let verdict = step.report.verdict();
                let mut reach = near;
                loop {
                    let next;
                    (next, far) = rows_within(step, reach, &held);
                    let guess = carry_rows(later.as_ref().unwrap_or(&first), &forces, &next);
                    let rows = &*later.insert(next);
                    let guess = from_last(&velocities, &guess);
                    (velocities, forces) = self.solve(step, motion, rows, Gap::Position, guess)?;
                    if !far.closes(&velocities, step.h) {
                        break;
                    }
                    step.report.take_back(verdict);
                    reach = Reach::All;
                }
                if self.stirs(step, &velocities) {
                    step.resting.fill(false);
                    round -= 1;
                    continue;
                }
                if self.ways(step, &before, &velocities).fold(0.0, f64::max) < self.options.settled {
                    break;
                }
            }
        }
        let rows = later.unwrap_or(first);
        let of_joints = rows.len() - joints.len();
        let mut solved = Iterate { rows, velocities, forces, found_at, plain, stiffened };
        self.close_joints(step, &mut solved, of_joints, &from)?;
        let Iterate { rows, velocities, forces, plain, .. } = &solved;
        let differs = rows.iter().any(|row| row.relaxed_gap != row.gap);
        let relaxed = differs.then(|| {
            let known = self.kept.of(rows, start);
            let guess = Guess { known: known.as_ref(), ..from_last(velocities, forces) };
            self.solve(step, solved.motion(), rows, Gap::Relaxed, guess)
        });
        let relaxed = relaxed.transpose()?;
        // Without corrections of poses, both are the same.
        let (carried, carrying) = relaxed.as_ref().map_or((velocities, forces), |(v, f)| (v, f));
        if far.closes(velocities, step.h) || far.closes(carried, step.h) {
            return Ok(None);
        }
        let reactions = self.reactions(rows, carrying, of_joints);
        let ended = step.ended(plain, velocities, carried);
        let (carried, carrying) = (carried.clone(), carrying.clone());
        let Iterate { rows, velocities, forces, .. } = solved;
        self.kept.keep(step, start, [&velocities, &carried], rows, [forces, carrying]);
        Ok(Some(Solved { velocities, carried: ended, forces: reactions }))
    }

    /// For each free body a bound of the way between the points that these velocities move in a step,
    /// m.
    pub(super) fn ways<'a>(
        &'a self,
        step: &'a Step,
        from: &'a [Vector6<f64>],
        to: &'a [Vector6<f64>],
    ) -> impl Iterator<Item = f64> + 'a {
        step.free.iter().zip(from).zip(to).map(|((free, from), to)| {
            let (linear, angular) = unpack(&(to - from));
            step.h * (linear.length() + self.sizes[free.body] * angular.length())
        })
    }

    /// Whether a contact penetrates too deeply for a linear prediction.
    pub(super) fn is_deep(&self, contact: &Contact) -> bool {
        let bodies = [contact.instance_a, contact.instance_b].map(|id| self.system.body_of(id));
        let size = bodies.iter().flatten().map(|&b| self.sizes[b]).fold(f64::INFINITY, f64::min);
        -contact.distance > self.options.deep * size
    }

    /// The pairs that overlap deeply and that no joint holds. None where contacts do not show all
    /// of an overlap: bodies that do not turn would stay in each other where no vertex is.
    fn apart(&self, contacts: &[Contact]) -> BTreeSet<[InstanceId; 2]> {
        if !self.detector.holds_all(&self.collide) {
            return BTreeSet::new();
        }
        let joints = self.system.joints();
        let is_held = |id: &InstanceId| {
            let body = self.system.body_of(*id);
            joints.iter().any(|joint| body == Some(joint.child) || body == joint.parent)
        };
        let deep = contacts.iter().filter(|c| self.is_deep(c)).map(pair);
        deep.filter(|pair| !pair.iter().any(is_held)).collect()
    }

    /// The bodies of islands that overlap deeply, as [`Step::deep`].
    fn deep(&self, step: &Step, contacts: &[Contact], rows: &[Row]) -> Vec<bool> {
        let mut deep = vec![false; step.free.len()];
        for contact in contacts.iter().filter(|c| self.is_deep(c)) {
            let bodies = [contact.instance_a, contact.instance_b].map(|id| self.system.body_of(id));
            bodies.iter().flatten().filter_map(|&b| step.free_of[b]).for_each(|k| deep[k] = true);
        }
        if deep.contains(&true) {
            spread(&mut deep, rows);
        }
        deep
    }
}
