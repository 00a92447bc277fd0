//! What a robot description says of bodies and joints.
use std::path::PathBuf;

use glam::DVec3;
use tesdf::collide::Pose;

use crate::MassProperties;

/// A robot, in SI units: links in an order in which each comes after its parent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Robot {
    /// The links.
    pub links: Vec<Link>,
    /// Joints that follow others.
    pub couplings: Vec<RobotCoupling>,
    /// Pairs of links that have no contacts with each other.
    pub apart: Vec<[usize; 2]>,
    /// Elements that neither bodies nor joints obey, and what they are: who reads them may refuse
    /// them or leave them out.
    pub unread: Vec<Unread>,
}

/// An element of a description that has an effect there and none here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unread {
    /// Name of the element, such as `actuator`.
    pub element: String,
    /// Where it is and what it does.
    pub place: String,
}

/// A joint that follows another one: `mimic` of URDF, and `joint` of `equality` of MJCF.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotCoupling {
    /// Name of the joint that follows.
    pub joint: String,
    /// Name of the joint that it follows.
    pub of: String,
    /// Change of its coordinate by that of the other one.
    pub ratio: f64,
    /// Its coordinate where that of the other one is 0, rad or m.
    pub offset: f64,
    /// Name of the element.
    pub element: &'static str,
    /// Where it is, for messages.
    pub place: String,
}

/// A link of a robot: a rigid body, or a frame that others refer to.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Its name in the file.
    pub name: String,
    /// File and line, for messages.
    pub place: String,
    /// How it is connected.
    pub base: Base,
    /// Mass, centre and inertia in the frame of the link; `None` where the file gives none.
    pub mass: Option<MassProperties>,
    /// What of it can touch others.
    pub collisions: Vec<Collision>,
    /// Coefficient of friction, where the file has one.
    pub friction: Option<f64>,
    /// Coefficient of torsional friction, m, where the file has one.
    pub friction_torsional: Option<f64>,
    /// The bits of its groups, and of those that it meets: two links meet where one of them meets a
    /// group of the other.
    pub groups: [u32; 2],
}

impl Link {
    /// Whether it is what does not move and is no part of the robot, as the world of MJCF.
    pub(crate) fn is_world(&self) -> bool {
        matches!(self.base, Base::Root { is_fixed: Some(true), .. })
    }
}

/// How a link is connected to what comes before it.
#[derive(Clone, Debug, PartialEq)]
pub enum Base {
    /// It is where the robot is placed: a root, with its frame in that of the robot. URDF leaves it
    /// to the scene whether it is fixed.
    Root {
        /// The frame of the link in that of the robot.
        pose: Pose,
        /// `None`: as the scene says.
        is_fixed: Option<bool>,
    },
    /// By a joint to an earlier link.
    Joint(RobotJoint),
}

/// A joint of a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotJoint {
    /// Its name in the file.
    pub name: String,
    /// Index of the link before it.
    pub parent: usize,
    /// What it lets the link do.
    pub motion: Motion,
    /// The frame of the link in that of the parent, where the coordinate is 0.
    pub pose: Pose,
    /// A point of the joint, in the frame of the link, m.
    pub anchor: DVec3,
    /// In the frame of the link, of any length except 0.
    pub axis: DVec3,
    /// Bounds of the coordinate.
    pub limits: Option<[f64; 2]>,
    /// Torque or force per rate.
    pub damping: f64,
    /// Greatest torque or force of dry friction.
    pub friction: f64,
    /// Inertia that moves along.
    pub armature: f64,
    /// Greatest torque or force of a motor, where the file has one.
    pub effort: Option<f64>,
}

/// What a joint of a robot lets its link do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Nothing.
    Fixed,
    /// Turn about the axis.
    Hinge,
    /// Slide along the axis.
    Slider,
    /// Turn about the anchor.
    Ball,
    /// Everything.
    Free,
}

/// A shape or mesh of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct Collision {
    /// Its frame in that of the link.
    pub pose: Pose,
    /// What it is.
    pub geometry: Geometry,
}

/// The geometry of a collision, in metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// A mesh file.
    Mesh {
        /// Its path.
        file: PathBuf,
        /// Factors along the axes of the mesh.
        scale: DVec3,
    },
    /// A box around the origin.
    Box {
        /// Half of the edges.
        half_extents: DVec3,
    },
    /// A ball around the origin.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// A cylinder about the z axis.
    Cylinder {
        /// Half of its length.
        half_height: f64,
        /// Radius.
        radius: f64,
    },
    /// A capsule about the z axis.
    Capsule {
        /// Half of the segment within it.
        half_height: f64,
        /// Radius.
        radius: f64,
    },
}

/// The pose of a frame that has the pose `inner` in the frame `outer`.
pub fn composed(outer: Pose, inner: Pose) -> Pose {
    Pose {
        translation: outer.to_world(inner.translation),
        rotation: (outer.rotation * inner.rotation).normalize(),
    }
}
