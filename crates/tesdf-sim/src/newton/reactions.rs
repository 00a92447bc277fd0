//! The forces of a solution, as users read them.
use super::Newton;
use super::integrate::unpack;
use super::joints::row_count;
use super::rows::{Row, RowForce, RowId};
use crate::forces::{ContactForce, Forces, JointForce};
use crate::joint::axes;
use crate::{Joint, JointKind, System};

impl Newton {
    /// What these rows do. The last ones, from `of_joints` on, are those of all joints and
    /// couplings.
    pub(super) fn reactions(&self, rows: &[Row], forces: &[RowForce], of_joints: usize) -> Forces {
        let mut all = Forces::none(self.system.joints().len());
        let (contacts, joints) = rows.split_at(of_joints);
        let pairs = contacts.iter().zip(forces).filter(|(_, force)| force.along > 0.0);
        all.contacts.extend(pairs.filter_map(|(row, force)| self.contact_force(row, force)));
        all.contacts.sort_by_key(|contact| contact.bodies);
        let mut rows = joints.iter().zip(&forces[of_joints..]);
        for (joint, sum) in self.system.joints().iter().zip(&mut all.joints) {
            let of_joint = rows.by_ref().take(row_count(joint));
            for (row, force) in of_joint {
                sum.add(row, force);
                sum.motor = force.along;
            }
            if joint.motor.is_none() {
                sum.motor = 0.0;
            }
        }
        for (coupling, (_, force)) in self.system.couplings().iter().zip(rows) {
            for (joint, share) in [(coupling.joint, 1.0), (coupling.of, -coupling.ratio)] {
                self.couple(&self.system.joints()[joint], share * force.along, &mut all.joints[joint]);
            }
        }
        all
    }

    /// Adds what a coupling does along the coordinate of a joint.
    fn couple(&self, joint: &Joint, along: f64, to: &mut JointForce) {
        let [parent, _] = joint.frames_in_world(System::poses_of(joint, self.system.states()));
        let [_, _, axis] = axes(parent);
        match joint.kind {
            JointKind::Slider => to.force += along * axis,
            JointKind::Hinge | JointKind::Weld | JointKind::Ball => to.torque += along * axis,
        }
        to.coupling += along;
    }

    /// `None` where a body is not of the system.
    fn contact_force(&self, row: &Row, force: &RowForce) -> Option<ContactForce> {
        let RowId::Contact([a, b], _) = row.id else { return None };
        let bodies = [self.system.body_of(a)?, self.system.body_of(b)?];
        let push = match row.sides {
            [Some((_, jacobian)), _] => force.along * unpack(&jacobian).0,
            [None, Some((_, jacobian))] => -force.along * unpack(&jacobian).0,
            [None, None] => return None,
        };
        // The mean of two directions is shorter than 1.
        let (normal, normal_force) = push.normalize_and_length();
        let RowForce { friction, torsion, .. } = *force;
        Some(ContactForce { bodies, point: row.point, normal, normal_force, friction, torque: torsion })
    }

    /// The forces of a step in which parts have `made` these: bodies that are still in it have those
    /// of the last one.
    pub(super) fn with_still(&self, made: Forces) -> Forces {
        let is_still = |body: usize| self.sleep.is_still(body);
        let Forces { mut contacts, mut joints } = made;
        let before = self.forces.contacts.iter().filter(|c| c.bodies.iter().all(|&body| is_still(body)));
        contacts.extend(before);
        contacts.sort_by_key(|contact| contact.bodies);
        let before = self.system.joints().iter().zip(&self.forces.joints);
        for ((joint, before), now) in before.zip(&mut joints) {
            if is_still(joint.child) && joint.parent.is_none_or(is_still) {
                *now = *before;
            }
        }
        Forces { contacts, joints }
    }
}

impl JointForce {
    /// Adds what a row does to the child.
    fn add(&mut self, row: &Row, force: &RowForce) {
        let side = [(0, 1.0), (1, -1.0)].into_iter().find_map(|(k, sign)| Some((k, sign, row.sides[k]?.1)));
        let Some((k, sign, jacobian)) = side else { return };
        let (linear, angular) = unpack(&jacobian);
        self.force += sign * force.along * linear;
        self.torque += sign * force.along * (angular - row.arms[k].cross(linear));
    }
}
