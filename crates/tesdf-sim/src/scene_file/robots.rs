//! Robots of a scene: their links become bodies, and their joints joints.
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tesdf::base::elementary;
use tesdf::collide::Pose;
use tesdf::glam::{DMat3, DQuat, DVec3};

use super::parts::{PartSection, PartShape};
use super::{BodySection, CouplingSection, ExcludeSection, JointSection, PoseSection, identity};
use crate::joint::{relative, wrapped};
use crate::robot::{Base, Collision, Geometry, Link, Motion, Robot, RobotCoupling, RobotJoint, composed};
use crate::{Drive, JointKind, JointResistance, MassProperties, Motor};

/// Greatest number of links of a robot: pairs of them are listed.
const MAX_LINKS: usize = 1000;

/// A robot description and its place. A loaded scene has its links and joints as bodies and joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotSection {
    /// Path of a URDF or MJCF file.
    pub file: PathBuf,
    /// Begins the names of its bodies and joints.
    #[serde(default)]
    pub prefix: String,
    /// Whether the root of a URDF file never moves. MJCF says so itself.
    #[serde(default)]
    pub fixed: bool,
    /// Position of the robot's frame, m, world frame.
    #[serde(default)]
    pub translation: [f64; 3],
    /// Orientation: a unit quaternion x y z w.
    #[serde(default = "identity")]
    pub rotation: [f64; 4],
    /// Both together: x y z qx qy qz qw, or the rows of a matrix of 4 × 4. A loaded scene has them
    /// apart.
    #[serde(default, skip_serializing)]
    pub pose: Option<PoseSection>,
    /// Coordinates of joints at the start, rad or m, by the joint's name in the file; others are 0,
    /// or the nearest number within their limits, or follow from that of a joint that they follow.
    #[serde(default)]
    pub coordinates: BTreeMap<String, f64>,
    /// Motors of joints, by the joint's name in the file.
    #[serde(default)]
    pub motors: BTreeMap<String, RobotMotor>,
    /// Coefficient of friction of all bodies [default: of MJCF the greatest of the body's geoms;
    /// URDF has none: 0].
    #[serde(default)]
    pub friction: Option<f64>,
    /// Coefficient of torsional friction of all bodies, m [default: of MJCF the greatest of the body's
    /// geoms with a `condim` of 4 or 6; URDF has none: 0].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction_torsional: Option<f64>,
    /// Whether links that are not neighbours have contacts with each other.
    #[serde(default = "yes")]
    pub self_contacts: bool,
    /// As that of a body, for all meshes.
    #[serde(default)]
    pub repair: Option<String>,
    /// Folders of packages, by name.
    #[serde(default)]
    pub packages: BTreeMap<String, PathBuf>,
    /// Elements of the file that are left out, such as `actuator`: those that have no effect here,
    /// which are an error otherwise, and `mimic` or `equality`.
    #[serde(default)]
    pub ignore: Vec<String>,
}

/// A motor of a joint of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotMotor {
    /// What the motor aims at.
    pub drive: Drive,
    /// Greatest force or torque [default: the effort of the file].
    #[serde(default)]
    pub limit: Option<f64>,
}

fn yes() -> bool {
    true
}

/// The bodies, joints, couplings and pairs without contacts of a robot.
#[derive(Default)]
pub(super) struct Expanded {
    pub bodies: Vec<BodySection>,
    pub joints: Vec<JointSection>,
    pub couplings: Vec<CouplingSection>,
    pub exclude: Vec<ExcludeSection>,
}

/// What becomes of a link.
#[derive(Clone)]
struct Placed {
    /// The frame of the link in the world.
    pose: Pose,
    /// The body that it is a part of, and its frame there; `None` where it is part of none.
    body: Option<usize>,
    /// Whether it never moves.
    is_fixed: bool,
    /// The first link of those that are fixed to it.
    group: usize,
}

/// Makes bodies and joints of a robot.
///
/// # Errors
/// The link, joint or key at fault, and what to do.
pub(super) fn expand(section: &RobotSection, robot: &Robot) -> Result<Expanded, String> {
    if let Some(unread) = robot.unread.iter().find(|unread| !section.ignore.contains(&unread.element)) {
        let cure = format!("leave it out of the file, or give ignore = [\"{}\"]", unread.element);
        return Err(format!("{}, which is not simulated: {cure}", unread.place));
    }
    if robot.links.len() > MAX_LINKS {
        let found = robot.links.len();
        return Err(format!("it has {found} links; expected at most {MAX_LINKS}: divide the file"));
    }
    if section.fixed && robot.links.first().is_some_and(Link::is_world) {
        return Err("fixed: MJCF says itself what is fixed: all bodies without a joint; leave it out".into());
    }
    let mut builder = Builder::new(section, robot)?;
    builder.check_couplings()?;
    for link in 0..robot.links.len() {
        builder.place(link)?;
    }
    builder.finish()
}

struct Builder<'a> {
    section: &'a RobotSection,
    robot: &'a Robot,
    start: Pose,
    /// The joints that turn or slide.
    moving: Vec<&'a RobotJoint>,
    /// The couplings that are not left out.
    couplings: Vec<&'a RobotCoupling>,
    /// Coordinates and motors that no joint has had so far.
    coordinates: BTreeMap<&'a str, f64>,
    motors: BTreeMap<&'a str, RobotMotor>,
    places: Vec<Placed>,
    /// For each body its link.
    links: Vec<usize>,
    /// The frame of each body in the world.
    poses: Vec<Pose>,
    parts: Vec<Vec<PartSection>>,
    joints: Vec<JointSection>,
    /// Groups of links between which a joint is.
    neighbours: BTreeSet<[usize; 2]>,
    /// Bodies that the file keeps apart, the lower one first.
    apart: BTreeSet<[usize; 2]>,
}

impl<'a> Builder<'a> {
    fn new(section: &'a RobotSection, robot: &'a Robot) -> Result<Self, String> {
        let rotation = DQuat::from_array(section.rotation);
        let start = Pose::new(DVec3::from_array(section.translation), rotation).map_err(|e| e.to_string())?;
        let moving = robot.links.iter().filter_map(|link| match &link.base {
            Base::Joint(joint) if matches!(joint.motion, Motion::Hinge | Motion::Slider) => Some(joint),
            _ => None,
        });
        let couplings = robot.couplings.iter();
        let couplings = couplings.filter(|coupling| !section.ignore.iter().any(|e| e == coupling.element));
        Ok(Self {
            section,
            robot,
            start,
            moving: moving.collect(),
            couplings: couplings.collect(),
            coordinates: section.coordinates.iter().map(|(name, &x)| (name.as_str(), x)).collect(),
            motors: section.motors.iter().map(|(name, &motor)| (name.as_str(), motor)).collect(),
            places: Vec::new(),
            links: Vec::new(),
            poses: Vec::new(),
            parts: Vec::new(),
            joints: Vec::new(),
            neighbours: BTreeSet::new(),
            apart: BTreeSet::new(),
        })
    }

    fn name(&self, name: &str) -> String {
        format!("{}{name}", self.section.prefix)
    }

    /// The names of the joints that turn or slide.
    fn moving_names(&self) -> String {
        self.moving.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    fn moving(&self, name: &str) -> Option<&'a RobotJoint> {
        self.moving.iter().copied().find(|joint| joint.name == name)
    }

    /// The coupling by which a joint follows another one.
    fn following(&self, name: &str) -> Option<&'a RobotCoupling> {
        self.couplings.iter().copied().find(|coupling| coupling.joint == name)
    }

    /// Checks what couplings couple.
    fn check_couplings(&self) -> Result<(), String> {
        for (k, RobotCoupling { joint, of, ratio, place, .. }) in self.couplings.iter().enumerate() {
            if let Some(name) = [joint, of].into_iter().find(|name| self.moving(name).is_none()) {
                let found = format!("{place}: there is no joint {name} that turns or slides");
                return Err(format!("{found}; expected one of {}", self.moving_names()));
            }
            if *ratio == 0.0 {
                let found = format!("{place}: the joint {joint} follows {of} with the ratio 0");
                return Err(format!("{found}; expected another number, or a joint that is fixed"));
            }
            if let Some(other) = self.couplings[..k].iter().find(|other| other.joint == *joint) {
                let found = format!("{place}: the joint {joint} follows both {} and {of}", other.of);
                return Err(format!("{found}; expected one of them"));
            }
            let next = |name: &&'a str| self.following(name).map(|coupling| coupling.of.as_str());
            let followed = std::iter::successors(Some(joint.as_str()), next).skip(1);
            if followed.take(self.couplings.len()).any(|name| name == joint) {
                return Err(format!("{place}: the joint {joint} follows itself; take one coupling out"));
            }
        }
        Ok(())
    }

    fn place(&mut self, k: usize) -> Result<(), String> {
        let link = &self.robot.links[k];
        let placed = match &link.base {
            Base::Root { pose, is_fixed } => {
                let is_fixed = is_fixed.unwrap_or(self.section.fixed);
                let pose = composed(self.start, *pose);
                Placed { pose, body: None, is_fixed, group: k }
            }
            Base::Joint(joint) => self.behind(joint, k)?,
        };
        let fixed_to = match &link.base {
            Base::Joint(joint) if joint.motion == Motion::Fixed => Some(joint),
            _ => None,
        };
        self.places.push(placed);
        let is_fixed = self.places[k].is_fixed;
        match (link.mass, fixed_to) {
            // What never moves needs no mass, and without a geometry no body.
            _ if is_fixed => {
                if !link.collisions.is_empty() {
                    self.add_body(k);
                }
            }
            (Some(_), _) => {
                self.add_body(k);
                if let Some(joint) = fixed_to {
                    self.weld(joint, k);
                }
            }
            (None, Some(joint)) => {
                let whole = self.places[joint.parent].body;
                let Some(whole) = whole else { return Err(massless(&self.robot.links[joint.parent])) };
                self.join(k, whole);
            }
            // A frame that a link with mass is fixed to may be a part of that.
            (None, None) => match self.heir(k) {
                Some(heir) => self.adopt(k, heir),
                None => return Err(massless(link)),
            },
        }
        if let Base::Joint(joint) = &link.base
            && matches!(joint.motion, Motion::Hinge | Motion::Slider | Motion::Ball)
        {
            self.joint(joint, k)?;
        }
        Ok(())
    }

    /// Where the link behind a joint is.
    fn behind(&mut self, joint: &'a RobotJoint, k: usize) -> Result<Placed, String> {
        let parent = self.places[joint.parent].clone();
        let at_zero = composed(parent.pose, joint.pose);
        if joint.motion == Motion::Fixed {
            return Ok(Placed { pose: at_zero, body: None, ..parent });
        }
        if joint.motion == Motion::Free {
            return Ok(Placed { pose: at_zero, body: None, is_fixed: false, group: k });
        }
        if !self.robot.links[joint.parent].is_world() {
            self.neighbours.insert([parent.group, k]);
        }
        let coordinate = self.coordinate(joint)?;
        let axis = joint.axis.normalize();
        let motion = match joint.motion {
            Motion::Slider => Pose { translation: coordinate * axis, rotation: DQuat::IDENTITY },
            _ => {
                let rotation = elementary::from_axis_angle(axis, coordinate);
                Pose { translation: joint.anchor - rotation * joint.anchor, rotation }
            }
        };
        Ok(Placed { pose: composed(at_zero, motion), body: None, is_fixed: false, group: k })
    }

    /// The coordinate of a joint at the start.
    fn coordinate(&self, joint: &RobotJoint) -> Result<f64, String> {
        let given = self.section.coordinates.get(&joint.name).copied();
        if let (None, Some(coupling)) = (given, self.following(&joint.name))
            && let Some(followed) = self.moving(&coupling.of)
        {
            return Ok(coupling.ratio * self.coordinate(followed)? + coupling.offset);
        }
        match (given, joint.limits) {
            (Some(_), _) if joint.motion == Motion::Ball => {
                Err(format!("coordinates: {} is a ball, which has none; leave it out", joint.name))
            }
            (_, _) if joint.motion == Motion::Ball => Ok(0.0),
            (Some(x), _) if !x.is_finite() => {
                Err(format!("coordinates: that of {} is {x}; expected a finite number", joint.name))
            }
            (Some(x), _) => Ok(x),
            (None, Some([low, high])) if low <= high => Ok(0.0_f64.clamp(low, high)),
            (None, _) => Ok(0.0),
        }
    }

    /// The link with mass that is fixed to a link.
    fn heir(&self, k: usize) -> Option<usize> {
        let mut fixed = BTreeSet::from([k]);
        for (j, link) in self.robot.links.iter().enumerate().skip(k + 1) {
            if let Base::Joint(joint) = &link.base
                && joint.motion == Motion::Fixed
                && fixed.contains(&joint.parent)
            {
                if link.mass.is_some() {
                    return Some(j);
                }
                fixed.insert(j);
            }
        }
        None
    }

    /// Makes a link without mass a part of the body of `heir`, which is fixed to it.
    fn adopt(&mut self, k: usize, heir: usize) {
        let mut pose = self.places[k].pose;
        let mut chain = Vec::new();
        let mut link = heir;
        while let (true, Base::Joint(joint)) = (link != k, &self.robot.links[link].base) {
            chain.push(joint.pose);
            link = joint.parent;
        }
        for step in chain.into_iter().rev() {
            pose = composed(pose, step);
        }
        self.new_body(heir, pose);
        self.join(k, self.links.len() - 1);
    }

    fn new_body(&mut self, link: usize, pose: Pose) {
        self.links.push(link);
        self.poses.push(pose);
        self.parts.push(Vec::new());
    }

    /// Makes a link the body that it is, unless what is fixed to it has become a part of that
    /// before.
    fn add_body(&mut self, k: usize) {
        let body = self.links.iter().position(|&link| link == k).unwrap_or_else(|| {
            self.new_body(k, self.places[k].pose);
            self.links.len() - 1
        });
        self.join(k, body);
    }

    /// Makes a link a part of a body.
    fn join(&mut self, k: usize, body: usize) {
        self.places[k].body = Some(body);
        // The frame of the body is that of its own link without rounding.
        let frame = match self.links[body] == k {
            true => Pose::IDENTITY,
            false => relative(self.poses[body], self.places[k].pose),
        };
        let parts = self.robot.links[k].collisions.iter().map(|collision| part(collision, frame));
        self.parts[body].extend(parts);
    }

    fn weld(&mut self, joint: &RobotJoint, k: usize) {
        let parent = self.places[joint.parent].body;
        // The body of a link without mass is that of the link.
        if parent != self.places[k].body {
            let child = self.name(&self.robot.links[k].name);
            let parent = parent.map(|body| self.name(&self.robot.links[self.links[body]].name));
            let weld = JointSection::new(self.name(&joint.name), JointKind::Weld, child);
            self.joints.push(JointSection { parent, ..weld });
        }
    }

    fn joint(&mut self, joint: &RobotJoint, k: usize) -> Result<(), String> {
        let mut coordinate = self.coordinate(joint)?;
        let is_given = self.coordinates.remove(joint.name.as_str()).is_some();
        if !is_given && joint.motion == Motion::Hinge {
            // Of a joint that follows another one. The coupling counts its turns.
            coordinate = wrapped(coordinate);
        }
        let kind = match joint.motion {
            Motion::Hinge => JointKind::Hinge,
            Motion::Slider => JointKind::Slider,
            Motion::Ball | Motion::Fixed | Motion::Free => JointKind::Ball,
        };
        let motor = self.motors.remove(joint.name.as_str());
        let motor = motor.map(|motor| motor_of(joint, motor)).transpose()?;
        let body =
            |k: usize| self.places[k].body.map(|body| self.robot.links[self.links[body]].name.as_str());
        let pose = self.places[k].pose;
        let child = self.name(body(k).unwrap_or(&self.robot.links[k].name));
        // Bodies that a joint connects have no contacts; with the world of MJCF they have.
        let parent = Some(joint.parent).filter(|&parent| !self.robot.links[parent].is_world());
        let parent = parent.and_then(body).map(|name| self.name(name));
        self.joints.push(JointSection {
            parent,
            anchor: Some(pose.to_world(joint.anchor).to_array()),
            axis: (pose.rotation * joint.axis).to_array(),
            coordinate,
            limits: joint.limits,
            motor,
            resistance: JointResistance {
                damping: joint.damping,
                friction: joint.friction,
                armature: joint.armature,
            },
            ..JointSection::new(self.name(&joint.name), kind, child)
        });
        Ok(())
    }

    fn finish(mut self) -> Result<Expanded, String> {
        let body = |link: usize| self.places[link].body;
        let apart = self.robot.apart.iter().filter_map(|&[a, b]| Some([body(a)?, body(b)?]));
        self.apart = apart.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        let unused = self.coordinates.keys().map(|name| ("coordinates", name));
        let unused = unused.chain(self.motors.keys().map(|name| ("motors", name))).next();
        if let Some((key, name)) = unused {
            return Err(format!(
                "{key}: the robot has no joint {name} that turns or slides; expected one of {}",
                self.moving_names()
            ));
        }
        let bodies = self.links.iter().zip(&self.parts).map(|(&k, parts)| self.body(k, parts)).collect();
        let exclude = self.pairs().collect();
        let couplings = self.couplings.iter().map(|coupling| CouplingSection {
            joint: self.name(&coupling.joint),
            of: self.name(&coupling.of),
            ratio: coupling.ratio,
            offset: coupling.offset,
        });
        let couplings = couplings.collect();
        Ok(Expanded { bodies, joints: self.joints, couplings, exclude })
    }

    /// The pairs of bodies without contacts.
    fn pairs(&self) -> impl Iterator<Item = ExcludeSection> {
        let apart = |&[a, b]: &[usize; 2]| {
            let [p, q] = [a, b].map(|body| &self.places[self.links[body]]);
            let [one, other] = [a, b].map(|body| &self.robot.links[self.links[body]]);
            let [[of, with], [of_other, with_other]] = [one.groups, other.groups];
            let meet = of & with_other != 0 || of_other & with != 0;
            let are_neighbours = p.group == q.group
                || self.neighbours.contains(&[p.group, q.group])
                || self.neighbours.contains(&[q.group, p.group]);
            !self.section.self_contacts || are_neighbours || !meet || self.apart.contains(&[a, b])
        };
        let bodies = self.links.len();
        let pairs = (0..bodies).flat_map(move |a| (a + 1..bodies).map(move |b| [a, b]));
        let name = |body: usize| self.name(&self.robot.links[self.links[body]].name);
        pairs.filter(apart).map(move |pair| ExcludeSection { bodies: pair.map(name) })
    }

    fn body(&self, k: usize, parts: &[PartSection]) -> BodySection {
        let (link, placed) = (&self.robot.links[k], &self.places[k]);
        let mut body = BodySection {
            translation: placed.pose.translation.to_array(),
            rotation: placed.pose.rotation.to_array(),
            fixed: placed.is_fixed,
            parts: parts.to_vec(),
            friction: self.section.friction.or(link.friction).unwrap_or(0.0),
            friction_torsional: self.section.friction_torsional.or(link.friction_torsional).unwrap_or(0.0),
            ..BodySection::new(self.name(&link.name))
        };
        if let Some(MassProperties { mass, center, inertia }) = link.mass.filter(|_| !placed.is_fixed) {
            let DMat3 { x_axis: x, y_axis: y, z_axis: z } = inertia;
            body.mass = Some(mass);
            body.center_of_mass = Some(center.to_array());
            body.inertia = Some([x.x, y.y, z.z, x.y, x.z, y.z]);
            if parts.is_empty() {
                // A ball of its radius of gyration that meets nothing.
                let radius = (0.5 * (x.x + y.y + z.z) / mass).sqrt();
                body.shape = Some(super::ShapeSection::Sphere { radius });
                (body.memberships, body.filter) = (0, 0);
            }
        }
        if parts.iter().any(|part| part.mesh.is_some()) {
            body.repair.clone_from(&self.section.repair);
        }
        body
    }
}

fn massless(link: &Link) -> String {
    format!(
        "{}: the link {} moves and has no mass; give it an <inertial> with a mass above 0, or fix it to a link that has one",
        link.place, link.name
    )
}

fn motor_of(joint: &RobotJoint, RobotMotor { drive, limit }: RobotMotor) -> Result<Motor, String> {
    match limit.or(joint.effort.filter(|effort| *effort > 0.0)) {
        Some(limit) => Ok(Motor { drive, limit }),
        None => {
            Err(format!("motors: that of {} has no limit, and the file no effort; give a limit", joint.name))
        }
    }
}

/// A collision in a body in which the frame of its link is `frame`.
fn part(collision: &Collision, frame: Pose) -> PartSection {
    let pose = composed(frame, collision.pose);
    let (mesh, shape, scale) = match &collision.geometry {
        Geometry::Mesh { file, scale } => (Some(file.clone()), None, *scale),
        Geometry::Box { half_extents } => {
            (None, Some(PartShape::Box { half_extents: half_extents.to_array() }), DVec3::ONE)
        }
        &Geometry::Sphere { radius } => (None, Some(PartShape::Sphere { radius }), DVec3::ONE),
        &Geometry::Cylinder { half_height, radius } => {
            (None, Some(PartShape::Cylinder { half_height, radius }), DVec3::ONE)
        }
        &Geometry::Capsule { half_height, radius } => {
            (None, Some(PartShape::Capsule { half_height, radius }), DVec3::ONE)
        }
    };
    PartSection {
        mesh,
        shape,
        scale: scale.to_array(),
        translation: pose.translation.to_array(),
        rotation: pose.rotation.to_array(),
        pose: None,
    }
}
