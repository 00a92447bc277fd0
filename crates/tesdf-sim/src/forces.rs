//! The forces of contacts and joints in a step.
use glam::DVec3;

/// The force between two bodies at a contact: its mean over a step. Times the time step, it is the
/// impulse of the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactForce {
    /// The numbers of the bodies. The force acts on the first one, and its opposite on the second.
    pub bodies: [usize; 2],
    /// Where it acts in the world, m.
    pub point: DVec3,
    /// Unit normal in the world, out of the second body.
    pub normal: DVec3,
    /// The force along the normal, N; greater than 0.
    pub normal_force: f64,
    /// The force of friction on the first body, in the world and across the normal, N.
    pub friction: DVec3,
    /// The moment of torsional friction on the first body about the normal, N m; its opposite acts
    /// on the second.
    pub torque: f64,
}

impl ContactForce {
    /// The whole force on the first body, in the world, N.
    pub fn force(&self) -> DVec3 {
        self.normal_force * self.normal + self.friction
    }
}

/// What a joint does to its child: its mean over a step. To its parent, it does the opposite. Force
/// and torque are with those of its motor and its couplings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointForce {
    /// The force on the child in the world, N.
    pub force: DVec3,
    /// The torque on the child about the origin of the joint's frame on it, in the world, N m.
    pub torque: DVec3,
    /// What the motor does: torque about the axis of a hinge, N m, or force along that of a slider,
    /// N.
    pub motor: f64,
    /// Likewise what couplings with other joints do.
    pub coupling: f64,
}

/// The forces of a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Forces {
    /// Of the contacts that push, in the order of the bodies. A step that an engine divides has
    /// those of each part, and each force is the mean over the whole step: they may be added up.
    pub contacts: Vec<ContactForce>,
    /// Of each joint, in the order of their numbers.
    pub joints: Vec<JointForce>,
}

impl Forces {
    /// No contacts and `joints` joints without force.
    pub(crate) fn none(joints: usize) -> Self {
        Self { contacts: Vec::new(), joints: vec![JointForce::default(); joints] }
    }

    /// Adds the forces of a part that takes this share of the step.
    pub(crate) fn add(&mut self, part: &Self, share: f64) {
        self.contacts.extend(part.contacts.iter().map(|contact| ContactForce {
            normal_force: share * contact.normal_force,
            friction: share * contact.friction,
            torque: share * contact.torque,
            ..*contact
        }));
        for (sum, joint) in self.joints.iter_mut().zip(&part.joints) {
            sum.force += share * joint.force;
            sum.torque += share * joint.torque;
            sum.motor += share * joint.motor;
            sum.coupling += share * joint.coupling;
        }
    }

    /// The force of all contacts on a body, in the world, N.
    pub fn on(&self, body: usize) -> DVec3 {
        let of_contact = |contact: &ContactForce| match contact.bodies {
            [first, _] if first == body => contact.force(),
            [_, second] if second == body => -contact.force(),
            _ => DVec3::ZERO,
        };
        self.contacts.iter().map(of_contact).sum()
    }

    /// The force of all contacts on each of `bodies` bodies, in the world, N.
    pub fn on_each(&self, bodies: usize) -> Vec<DVec3> {
        let mut sums = vec![DVec3::ZERO; bodies];
        for contact in &self.contacts {
            let [first, second] = contact.bodies;
            sums[first] += contact.force();
            sums[second] -= contact.force();
        }
        sums
    }
}
