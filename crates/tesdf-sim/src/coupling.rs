//! Couplings of joints: gears, racks, and what URDF calls mimic.
use crate::joint::nearest_turn;
use crate::{DynamicsError, Joint, JointKind};

/// Couplings hold at the start when they are off by less than this, rad or m.
const BEGINS: f64 = 1e-6;

/// Keeps the coordinate of a joint at `ratio` times that of another one, plus `offset`. Both are
/// hinges or sliders, and whole turns of hinges count. What drives one joint drives the other: the
/// coupling takes and gives the same power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Number of the joint that follows.
    pub joint: usize,
    /// Number of the joint that it follows.
    pub of: usize,
    /// Change of its coordinate by that of the other one, in their units; not 0.
    pub ratio: f64,
    /// Its coordinate where that of the other one is 0, rad or m.
    pub offset: f64,
}

impl Coupling {
    /// The coordinate that it asks of the joint that follows, rad or m.
    pub fn target(&self, coordinates: &[f64]) -> f64 {
        self.ratio * coordinates[self.of] + self.offset
    }
}

/// The couplings of a system. Each joint follows one other joint at most, and none itself.
#[derive(Clone, Debug, Default)]
pub(crate) struct Couplings {
    all: Vec<Coupling>,
    /// Their numbers: each comes after those of the joint that it follows.
    order: Vec<usize>,
}

impl Couplings {
    pub fn all(&self) -> &[Coupling] {
        &self.all
    }

    /// The coupling by which a joint follows another one.
    fn of(&self, joint: usize) -> Option<&Coupling> {
        self.all.iter().find(|coupling| coupling.joint == joint)
    }

    /// The joints that a joint follows, the nearest one first.
    fn followed(&self, joint: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(self.of(joint), |coupling| self.of(coupling.of)).map(|coupling| coupling.of)
    }

    /// Adds a coupling of these joints.
    ///
    /// # Errors
    /// As [`System::add_coupling`](crate::System::add_coupling).
    pub fn add(&mut self, coupling: Coupling, joints: &[Joint]) -> Result<(), DynamicsError> {
        let Coupling { joint, of, ratio, offset } = coupling;
        let count = joints.len();
        if let Some(joint) = [joint, of].into_iter().find(|joint| *joint >= count) {
            return Err(DynamicsError::NoJoint { joint, joints: count });
        }
        let refuse = |joint: usize, reason: String| {
            let name = joints[joint].name.clone();
            Err(DynamicsError::Joint { name, reason })
        };
        let [name, of_name] = [joint, of].map(|joint| &joints[joint].name);
        let has_none = |joint: &usize| matches!(joints[*joint].kind, JointKind::Weld | JointKind::Ball);
        if let Some(joint) = [joint, of].into_iter().find(has_none) {
            let kind = if joints[joint].kind == JointKind::Weld { "weld" } else { "ball" };
            return refuse(joint, format!("it is a {kind}; only hinges and sliders can be coupled"));
        }
        if ratio == 0.0 || !ratio.is_finite() {
            let found = format!("it follows {of_name} with the ratio {ratio}");
            return refuse(joint, format!("{found}; expected a finite number other than 0"));
        }
        if !offset.is_finite() {
            let found = format!("it follows {of_name} with the offset {offset}");
            return refuse(joint, format!("{found}; expected a finite number"));
        }
        if joint == of {
            return refuse(joint, "it follows itself; couple it to another joint".into());
        }
        if let Some(other) = self.of(joint) {
            let found = format!("it follows both {} and {of_name}", joints[other.of].name);
            return refuse(joint, format!("{found}; expected one of them"));
        }
        if self.followed(of).any(|other| other == joint) {
            let found = format!("it follows {of_name}, which follows {name}");
            return refuse(joint, format!("{found}; take one of the couplings out"));
        }
        self.all.push(coupling);
        self.order.push(self.order.len());
        let mut order = std::mem::take(&mut self.order);
        order.sort_by_cached_key(|&k| self.followed(self.all[k].joint).count());
        self.order = order;
        Ok(())
    }

    /// Counts the turns of hinges that follow others so that their couplings hold, up to half a
    /// turn.
    pub fn count_turns(&self, joints: &[Joint], coordinates: &mut [f64]) {
        for coupling in self.order.iter().map(|&k| &self.all[k]) {
            if joints[coupling.joint].kind == JointKind::Hinge {
                let near = coupling.target(coordinates);
                coordinates[coupling.joint] = nearest_turn(coordinates[coupling.joint], near);
            }
        }
    }

    /// Checks whether all couplings hold at these coordinates.
    ///
    /// # Errors
    /// [`DynamicsError::Joint`] with a joint that is not where its coupling asks it to be.
    pub fn check(&self, joints: &[Joint], coordinates: &[f64]) -> Result<(), DynamicsError> {
        for coupling in &self.all {
            let [name, of] = [coupling.joint, coupling.of].map(|joint| &joints[joint].name);
            let (found, expected) = (coordinates[coupling.joint], coupling.target(coordinates));
            if (found - expected).abs() > BEGINS {
                let reason = format!(
                    "its coordinate is {found}; expected {expected}: it follows {of}, which is at {}",
                    coordinates[coupling.of]
                );
                return Err(DynamicsError::Joint { name: name.clone(), reason });
            }
        }
        Ok(())
    }
}
