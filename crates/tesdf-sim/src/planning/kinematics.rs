//! Where the links of a robot are, by the coordinates of its joints.
use tesdf::base::elementary;
use tesdf::collide::Pose;
use tesdf::glam::{DQuat, DVec3};

use super::error::PlanningError;
use crate::robot::{Base, Motion, Robot as Description, RobotCoupling, RobotJoint, composed};

/// A joint that turns or slides.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub name: String,
    /// The link that it moves.
    pub link: usize,
    pub slides: bool,
    /// Unit vector in the frame of the link.
    pub axis: DVec3,
    /// A point of the axis, in the frame of the link.
    anchor: DVec3,
    /// The number of the configuration on which its coordinate depends, and how.
    pub of: usize,
    pub ratio: f64,
    offset: f64,
}

/// The links and joints of a robot.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    /// For each link what it is connected to, where it is there at the coordinate 0, and its joint.
    links: Vec<(Option<usize>, Pose, Option<usize>)>,
    pub joints: Vec<Joint>,
    /// For each link the joints that move it, from the root on.
    pub above: Vec<Vec<usize>>,
    /// For each number of a configuration the joint that it is the coordinate of.
    pub free: Vec<usize>,
    /// For each number its limits.
    pub limits: Vec<[f64; 2]>,
}

/// A joint in the world: its axis, a unit vector, and a point of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub direction: DVec3,
    pub point: DVec3,
}

impl Axis {
    /// Distance of a point from the axis.
    pub fn distance(&self, p: DVec3) -> f64 {
        self.direction.cross(p - self.point).length()
    }
}

impl Chain {
    /// The chain of a robot whose frame has this pose. Couplings of the elements `ignore` are left
    /// out.
    ///
    /// # Errors
    /// A joint that is a ball or free, or a coupling of joints that are not there.
    pub fn new(robot: &Description, at: Pose, ignore: &[String]) -> Result<Self, PlanningError> {
        let couplings: Vec<_> =
            robot.couplings.iter().filter(|c| !ignore.contains(&c.element.into())).collect();
        let mut chain = Self { links: vec![], joints: vec![], above: vec![], free: vec![], limits: vec![] };
        for (k, link) in robot.links.iter().enumerate() {
            let joint = match &link.base {
                Base::Root { pose, .. } => {
                    chain.links.push((None, composed(at, *pose), None));
                    chain.above.push(Vec::new());
                    continue;
                }
                Base::Joint(joint) => joint,
            };
            let mut above = chain.above[joint.parent].clone();
            let own = match joint.motion {
                Motion::Fixed => None,
                Motion::Hinge | Motion::Slider => {
                    let own = chain.joints.len();
                    above.push(own);
                    chain.joints.push(chain.joint(joint, k));
                    Some(own)
                }
                Motion::Ball | Motion::Free => {
                    let kind = if joint.motion == Motion::Ball { "is a ball" } else { "is free" };
                    let found = format!("{}: the joint {} {kind}", link.place, joint.name);
                    return Err(PlanningError::Robot(format!(
                        "{found}; planning takes joints that turn or slide: make it fixed, or hinges, in a copy of the file"
                    )));
                }
            };
            chain.links.push((Some(joint.parent), joint.pose, own));
            chain.above.push(above);
        }
        chain.number(robot, &couplings)?;
        Ok(chain)
    }

    fn joint(&self, joint: &RobotJoint, link: usize) -> Joint {
        Joint {
            name: joint.name.clone(),
            link,
            slides: joint.motion == Motion::Slider,
            axis: joint.axis.normalize(),
            anchor: joint.anchor,
            of: 0,
            ratio: 1.0,
            offset: 0.0,
        }
    }

    /// Gives the joints that follow no other one their numbers in configurations.
    fn number(&mut self, robot: &Description, couplings: &[&RobotCoupling]) -> Result<(), PlanningError> {
        let followed = |name: &str| couplings.iter().find(|coupling| coupling.joint == name);
        self.free = (0..self.joints.len()).filter(|&k| followed(&self.joints[k].name).is_none()).collect();
        for (k, coupling) in couplings.iter().enumerate() {
            let names: Vec<_> = self.joints.iter().map(|joint| joint.name.as_str()).collect();
            let refused = |found: String| Err(PlanningError::Robot(format!("{}: {found}", coupling.place)));
            if let Some(name) =
                [&coupling.joint, &coupling.of].into_iter().find(|n| !names.contains(&n.as_str()))
            {
                let expected = names.join(", ");
                return refused(format!(
                    "there is no joint {name} that turns or slides; expected one of {expected}"
                ));
            }
            if couplings[..k].iter().any(|other| other.joint == coupling.joint) {
                return refused(format!("the joint {} follows two joints; expected one", coupling.joint));
            }
        }
        for k in 0..self.joints.len() {
            let (mut ratio, mut offset, mut name) = (1.0, 0.0, self.joints[k].name.as_str());
            for _ in 0..=couplings.len() {
                let Some(coupling) = followed(name) else { break };
                offset += ratio * coupling.offset;
                ratio *= coupling.ratio;
                name = coupling.of.as_str();
            }
            let Some(of) = self.free.iter().position(|&free| self.joints[free].name == name) else {
                let found = format!("the joint {name} follows itself");
                return Err(PlanningError::Robot(format!("{found}; take one coupling out of the file")));
            };
            let joint = &mut self.joints[k];
            (joint.of, joint.ratio, joint.offset) = (of, ratio, offset);
        }
        let limits = |&free: &usize| match &robot.links[self.joints[free].link].base {
            Base::Joint(joint) => joint.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
            Base::Root { .. } => [f64::NEG_INFINITY, f64::INFINITY],
        };
        self.limits = self.free.iter().map(limits).collect();
        Ok(())
    }

    /// The poses of the links in the world.
    pub fn poses(&self, q: &[f64]) -> Vec<Pose> {
        let mut poses: Vec<Pose> = Vec::with_capacity(self.links.len());
        for &(parent, at_zero, joint) in &self.links {
            let outer = parent.map_or(at_zero, |parent| composed(poses[parent], at_zero));
            let pose = joint.map_or(outer, |joint| composed(outer, self.joints[joint].motion(q)));
            poses.push(pose);
        }
        poses
    }

    /// A joint in the world, where the links have these poses.
    pub fn axis(&self, joint: usize, poses: &[Pose]) -> Axis {
        let Joint { link, axis, anchor, .. } = self.joints[joint];
        Axis { direction: poses[link].rotation * axis, point: poses[link].to_world(anchor) }
    }

    /// Adds the derivatives of `along · p` by the configuration, times `factor`, where `p` is a point
    /// of a link in the world.
    pub fn add_derivatives(
        &self,
        link: usize,
        poses: &[Pose],
        (p, along): (DVec3, DVec3),
        factor: f64,
        derivatives: &mut [f64],
    ) {
        for &k in &self.above[link] {
            let (joint, axis) = (&self.joints[k], self.axis(k, poses));
            let velocity = match joint.slides {
                true => axis.direction,
                false => axis.direction.cross(p - axis.point),
            };
            derivatives[joint.of] += factor * joint.ratio * along.dot(velocity);
        }
    }
}

impl Joint {
    /// What the joint does to the frame of its link.
    fn motion(&self, q: &[f64]) -> Pose {
        let x = self.ratio * q[self.of] + self.offset;
        match self.slides {
            true => Pose { translation: x * self.axis, rotation: DQuat::IDENTITY },
            false => {
                let rotation = elementary::from_axis_angle(self.axis, x);
                Pose { translation: self.anchor - rotation * self.anchor, rotation }
            }
        }
    }
}
