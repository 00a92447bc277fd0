//! Forces of contacts and joints in a run.
use std::ops::Range;

use tesdf::glam::{DVec3, Vec3};

use super::RunRecord;
use crate::{ContactForce, Forces, JointForce};

/// All recorded forces. Steps ascend.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ForceRows {
    /// The steps whose forces are recorded.
    pub steps: Vec<u64>,
    /// Where the contacts of each of these steps end.
    pub ends: Vec<u64>,
    /// The bodies of each contact: the force acts on the first one.
    pub ids: Vec<[u32; 2]>,
    /// Where it acts, m, world frame.
    pub points: Vec<[f64; 3]>,
    /// The force along the normal, then that of friction, N, world frame.
    pub contacts: Vec<[f32; 6]>,
    /// The moment about the normal, N m.
    pub torques: Vec<f32>,
    /// Force on the child, N, its torque, N m, world frame, what the motor and what couplings do;
    /// for each joint of each step.
    pub joints: Vec<[f32; 8]>,
}

impl ForceRows {
    /// Appends the forces of `step`.
    pub fn push(&mut self, step: u64, forces: &Forces) {
        self.steps.push(step);
        for contact in &forces.contacts {
            self.ids.push(contact.bodies.map(|body| body as u32));
            self.points.push(contact.point.to_array());
            let [n, f] = [contact.normal_force * contact.normal, contact.friction].map(DVec3::as_vec3);
            self.contacts.push([n.x, n.y, n.z, f.x, f.y, f.z]);
            self.torques.push(contact.torque as f32);
        }
        self.ends.push(self.ids.len() as u64);
        for joint in &forces.joints {
            let [f, t] = [joint.force, joint.torque].map(DVec3::as_vec3);
            self.joints.push([f.x, f.y, f.z, t.x, t.y, t.z, joint.motor as f32, joint.coupling as f32]);
        }
    }

    /// The place of `step` among the steps, if its forces are recorded.
    pub fn place(&self, step: u64) -> Option<usize> {
        self.steps.binary_search(&step).ok()
    }

    /// The rows of the contacts of the step at `place`.
    pub fn contacts_at(&self, place: usize) -> Range<usize> {
        let begin = place.checked_sub(1).map_or(0, |before| self.ends[before]);
        begin as usize..self.ends[place] as usize
    }

    /// The forces of the step at `place`, of a run with `joints` joints.
    fn at(&self, place: usize, joints: usize) -> Forces {
        let vector = |values: &[f32]| Vec3::from_slice(values).as_dvec3();
        let contact = |k: usize| {
            let (along, friction) = (vector(&self.contacts[k][..3]), vector(&self.contacts[k][3..]));
            ContactForce {
                bodies: self.ids[k].map(|body| body as usize),
                point: DVec3::from_array(self.points[k]),
                normal: along.normalize_or_zero(),
                normal_force: along.length(),
                friction,
                torque: f64::from(self.torques[k]),
            }
        };
        let joint = |row: &[f32; 8]| JointForce {
            force: vector(&row[..3]),
            torque: vector(&row[3..6]),
            motor: f64::from(row[6]),
            coupling: f64::from(row[7]),
        };
        Forces {
            contacts: self.contacts_at(place).map(contact).collect(),
            joints: self.joints[place * joints..][..joints].iter().map(joint).collect(),
        }
    }

    /// Whether all columns match, and refer to existing steps and bodies.
    pub fn fit(&self, steps: u64, bodies: usize, joints: usize) -> bool {
        let contacts = self.ids.len();
        [self.points.len(), self.contacts.len(), self.torques.len()] == [contacts; 3]
            && self.ends.len() == self.steps.len()
            && self.ends.is_sorted()
            && self.ends.last().copied().unwrap_or(0) == contacts as u64
            && self.steps.is_sorted_by(|a, b| a < b)
            && self.steps.last().is_none_or(|&step| step < steps)
            && self.ids.as_flattened().iter().all(|&body| (body as usize) < bodies)
            && self.steps.len().checked_mul(joints) == Some(self.joints.len())
    }
}

impl RunRecord {
    /// Appends the forces of `step`: their means from its beginning to its end. The steps of
    /// successive calls must ascend.
    pub fn push_forces(&mut self, step: u64, forces: &Forces) {
        self.forces.push(step, forces);
        self.has_torques |= forces.contacts.iter().any(|contact| contact.torque != 0.0);
    }

    /// The steps with recorded forces, each with its forces, which are kept as 32-bit floats.
    pub fn forces(&self) -> impl ExactSizeIterator<Item = (u64, Forces)> {
        let of = |(place, &step)| (step, self.forces.at(place, self.joints.len()));
        self.forces.steps.iter().enumerate().map(of)
    }

    /// The recorded forces of the last step that begins at or before the state after `step` steps.
    pub fn latest_forces(&self, step: u64) -> Option<(u64, Forces)> {
        let place = self.forces.steps.partition_point(|&s| s <= step).checked_sub(1)?;
        Some((self.forces.steps[place], self.forces.at(place, self.joints.len())))
    }
}
