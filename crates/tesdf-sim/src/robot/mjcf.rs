//! Reads MJCF.
//!
//! Parameters of MuJoCo's solver (`solref`, `solimp`, `margin`, `priority`, …), sensors, key
//! frames, sites, cameras and lights are of MuJoCo, and are not read; `<option>` is the scene's.
use std::collections::BTreeSet;
use std::path::Path;

use glam::{DMat3, DQuat, DVec3};
use mjcf_rs::Model;
use mjcf_rs::body::{Body, Geom, GeomType, InertiaSpec, Joint, JointType};
use mjcf_rs::compiler::InertiaFromGeom;
use mjcf_rs::equality::{Equality, EqualityJoint};
use tesdf::base::elementary;
use tesdf::collide::Pose;

use super::description::{Base, Collision, Geometry, Link, Motion, Robot, RobotCoupling, RobotJoint, Unread};
use super::{RobotError, expand, parse, solids};
use crate::{MassProperties, inertia_matrix};

/// Density of geoms without one, kg/m³.
const DENSITY: f64 = 1000.0;

/// Sections of a model that are not simulated.
const SECTIONS: [&str; 3] = ["tendon", "actuator", "deformable"];
/// Elements of bodies that are not simulated.
const OF_BODIES: [&str; 4] = ["composite", "flexcomp", "plugin", "replicate"];

/// Reads the MJCF file at `path`.
///
/// # Errors
/// The file cannot be read or is no MJCF, or bodies are not those of this program.
pub(super) fn read_mjcf(path: &Path) -> Result<Robot, RobotError> {
    let text = expand(path)?;
    let mut robot = Robot::default();
    check(path, &text, &mut robot.unread)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let model = Model::from_str(&text, folder).map_err(|e| RobotError::in_file(path, e))?;
    let file = File { path, folder, model: &model };
    for (k, entry) in model.bodies.iter().enumerate() {
        let link = file.link(k, entry.parent, &entry.body, &mut robot.unread)?;
        robot.links.push(link);
    }
    let body = |name: &str| {
        let found = robot.links.iter().position(|link| link.name == name);
        found.ok_or_else(|| {
            RobotError::in_file(path, format!("<exclude> names the body {name}, which is not there"))
        })
    };
    let pairs = model.contact.excludes.iter().map(|pair| Ok([body(&pair.body1)?, body(&pair.body2)?]));
    let pairs = pairs.collect::<Result<Vec<_>, RobotError>>()?;
    robot.apart = pairs;
    for equality in &model.equality {
        if let Equality::Joint(joint) = equality
            && joint.common.active
        {
            match file.coupling(joint) {
                Ok(coupling) => robot.couplings.push(coupling),
                Err(unread) => robot.unread.push(unread),
            }
        }
    }
    Ok(robot)
}

/// Finds what `mjcf-rs` leaves out without a word. The text has all includes, so its lines are
/// those of the file where it includes none.
fn check(path: &Path, text: &str, unread: &mut Vec<Unread>) -> Result<(), RobotError> {
    let document = parse(path, text)?;
    for node in document.descendants().filter(roxmltree::Node::is_element) {
        let name = node.tag_name().name();
        let parent = node.parent().map(|parent| parent.tag_name().name()).unwrap_or_default();
        let line = document.text_pos_at(node.range().start).row;
        let mut leave = |element: &str, what: &str| {
            let place = format!("{}, line {line}: {what}", path.display());
            unread.push(Unread { element: element.into(), place });
        };
        match (parent, name) {
            ("mujoco" | "mujocoinclude", section)
                if SECTIONS.contains(&section) && node.children().any(|child| child.is_element()) =>
            {
                leave(section, &format!("there is <{section}>"));
            }
            ("equality", element) if element != "joint" => {
                leave("equality", &format!("there is <{element}> in <equality>"));
            }
            ("contact", "pair") => leave("pair", "a <pair> of geoms has its own contacts"),
            ("body" | "worldbody" | "frame", element) if OF_BODIES.contains(&element) => {
                leave(element, &format!("there is <{element}>"));
            }
            (_, "attach") => {
                let found =
                    "there is <attach>; expected bodies of the file: write them there, or <include> them";
                return Err(RobotError::in_line(path, line, found));
            }
            ("frame", "joint" | "freejoint" | "inertial") => {
                let found = format!("<{name}> is within <frame>; expected it right below its <body>");
                return Err(RobotError::in_line(path, line, found));
            }
            ("mujoco" | "mujocoinclude", "compiler") => {
                for attribute in
                    ["settotalmass", "boundmass", "boundinertia", "balanceinertia", "inertiagrouprange"]
                {
                    if node.has_attribute(attribute) {
                        leave(attribute, &format!("<compiler> has {attribute}"));
                    }
                }
            }
            ("worldbody" | "body" | "frame", "body") => {
                for attribute in ["mocap", "gravcomp"] {
                    if node.has_attribute(attribute) {
                        leave(attribute, &format!("a <body> has {attribute}"));
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
}

struct File<'a> {
    path: &'a Path,
    folder: &'a Path,
    model: &'a Model,
}

fn vec3(v: mjcf_rs::glam::DVec3) -> DVec3 {
    DVec3::new(v.x, v.y, v.z)
}

fn pose(pose: &mjcf_rs::Pose) -> Pose {
    let q = pose.rotation;
    let rotation = DQuat::from_xyzw(q.x, q.y, q.z, q.w).normalize();
    Pose { translation: vec3(pose.translation), rotation }
}

impl File<'_> {
    fn name(&self, k: usize) -> String {
        let own = self.model.bodies[k].body.name.clone();
        own.unwrap_or_else(|| if k == 0 { "world".into() } else { format!("body{k}") })
    }

    fn place(&self, k: usize) -> String {
        format!("{}, body {}", self.path.display(), self.name(k))
    }

    fn at(&self, k: usize, found: impl std::fmt::Display) -> RobotError {
        RobotError(format!("{}: {found}", self.place(k)))
    }

    fn link(
        &self,
        k: usize,
        parent: Option<usize>,
        body: &Body,
        unread: &mut Vec<Unread>,
    ) -> Result<Link, RobotError> {
        let (mut collisions, mut masses) = (Vec::new(), Vec::new());
        let (mut friction, mut friction_torsional) = (None, None);
        let mut groups = BTreeSet::new();
        let from_geoms = self.model.compiler.inertia_from_geom;
        let needs_mass = from_geoms == InertiaFromGeom::True
            || body.inertial.is_none() && from_geoms == InertiaFromGeom::Auto;
        for geom in &body.geoms {
            let name = geom.name.clone().unwrap_or_default();
            let Some(collision) = self.geom(k, geom, unread)? else { continue };
            if needs_mass && parent.is_some() && geom.mass != Some(0.0) && geom.density != Some(0.0) {
                let one = solids::of_density_one(&collision);
                let one = one.map_err(|e| self.at(k, format!("geom {name}: {e}")));
                masses.push((one, geom.mass, geom.density.unwrap_or(DENSITY)));
            }
            if geom.contype == 0 && geom.conaffinity == 0 {
                continue;
            }
            groups.insert([geom.contype, geom.conaffinity]);
            if groups.len() > 1 {
                let found = format!("geom {name} has another contype or conaffinity than the ones before it");
                return Err(self.at(k, format!("{found}; expected the same of all geoms of a body")));
            }
            if geom.condim > 4 {
                let place = format!("{}: geom {name} has condim {}", self.place(k), geom.condim);
                unread.push(Unread { element: "condim".into(), place });
            }
            let [slide, spin, _] = geom.friction;
            let greatest = |most: Option<f64>, of: f64| Some(most.map_or(of, |most| most.max(of)));
            friction = greatest(friction, if geom.condim == 1 { 0.0 } else { slide });
            friction_torsional = greatest(friction_torsional, if geom.condim > 3 { spin } else { 0.0 });
            collisions.push(collision);
        }
        let joint = match body.joints.as_slice() {
            [] => None,
            [joint] => Some(joint),
            _ => {
                let found = format!("it has {} joints; expected one", body.joints.len());
                return Err(self.at(k, format!("{found}: put bodies with an <inertial> between them")));
            }
        };
        let base = match (parent, joint) {
            (None, _) => Base::Root { pose: Pose::IDENTITY, is_fixed: Some(true) },
            (Some(parent), joint) => Base::Joint(self.joint(k, parent, body, joint, unread)?),
        };
        Ok(Link {
            name: self.name(k),
            place: self.place(k),
            base,
            mass: self.mass(k, body, masses)?,
            collisions,
            friction,
            friction_torsional,
            groups: groups.first().copied().unwrap_or([1; 2]),
        })
    }

    /// The mass of a body: of `geoms`, each with its mass or its density, or of its `<inertial>`.
    fn mass(
        &self,
        k: usize,
        body: &Body,
        geoms: Vec<(Result<MassProperties, RobotError>, Option<f64>, f64)>,
    ) -> Result<Option<MassProperties>, RobotError> {
        if let (Some(inertial), true) = (&body.inertial, geoms.is_empty()) {
            if inertial.mass == 0.0 {
                return Ok(None);
            }
            let own = match inertial.inertia {
                InertiaSpec::Diagonal(moments) => DMat3::from_diagonal(DVec3::from_array(moments)),
                InertiaSpec::Full(moments) => inertia_matrix(moments),
            };
            let pose = pose(&inertial.pose);
            let turn = DMat3::from_quat(pose.rotation);
            let found = MassProperties::new(inertial.mass, pose.translation, turn * own * turn.transpose());
            return found.map(Some).map_err(|e| self.at(k, format!("<inertial>: {e}")));
        }
        let of_geom = |(one, mass, density): (Result<MassProperties, RobotError>, Option<f64>, f64)| {
            let one = one?;
            let found = one.with_mass(mass.unwrap_or(one.mass * density));
            found.map_err(|e| self.at(k, format!("a geom: {e}")))
        };
        Ok(solids::together(&geoms.into_iter().map(of_geom).collect::<Result<Vec<_>, _>>()?))
    }

    fn joint(
        &self,
        k: usize,
        parent: usize,
        body: &Body,
        joint: Option<&Joint>,
        unread: &mut Vec<Unread>,
    ) -> Result<RobotJoint, RobotError> {
        let fixed = RobotJoint {
            name: self.name(k),
            parent,
            motion: Motion::Fixed,
            pose: pose(&body.pose),
            anchor: DVec3::ZERO,
            axis: DVec3::Z,
            limits: None,
            damping: 0.0,
            friction: 0.0,
            armature: 0.0,
            effort: None,
        };
        let Some(joint) = joint else { return Ok(fixed) };
        let name = joint.name.clone().unwrap_or_else(|| self.name(k));
        let motion = match joint.type_ {
            JointType::Hinge => Motion::Hinge,
            JointType::Slide => Motion::Slider,
            JointType::Ball => Motion::Ball,
            JointType::Free => return Ok(RobotJoint { name, motion: Motion::Free, ..fixed }),
        };
        let axis = DVec3::from_array(joint.axis);
        if motion != Motion::Ball && axis.try_normalize().is_none() {
            return Err(self.at(k, format!("the axis of the joint {name} is {axis}; expected a direction")));
        }
        if joint.ref_ != 0.0 {
            let found = format!("the joint {name} has ref {}", joint.ref_);
            return Err(
                self.at(k, format!("{found}; expected 0: count its range from where the file has the body"))
            );
        }
        let mut leave = |element: &str, what: &str| {
            let place = format!("{}: the joint {name} has {what}", self.place(k));
            unread.push(Unread { element: element.into(), place });
        };
        if joint.stiffness != 0.0 || joint.springdamper.is_some() {
            leave("stiffness", "a spring");
        }
        let resists = [joint.damping, joint.frictionloss, joint.armature];
        let is_ball = motion == Motion::Ball;
        if is_ball && resists.iter().any(|part| *part != 0.0) {
            leave("damping", "damping, frictionloss or armature, and is a ball");
        }
        let [damping, friction, armature] = if is_ball { [0.0; 3] } else { resists };
        let is_limited = joint.limited.resolve(self.model.compiler.autolimits, joint.range.is_some());
        let range = joint.range.filter(|_| is_limited);
        if is_limited && range.is_none() {
            return Err(self.at(k, format!("the joint {name} is limited and has no range; expected one")));
        }
        // The range of a ball is not converted to radians.
        let degrees = is_ball && self.model.compiler.angle_is_degree;
        let limits = range.map(|range| if degrees { range.map(f64::to_radians) } else { range });
        let anchor = DVec3::from_array(joint.pos);
        Ok(RobotJoint { name, motion, anchor, axis, limits, damping, friction, armature, ..fixed })
    }

    /// `Err` where it is no linear function of another joint.
    fn coupling(&self, equality: &EqualityJoint) -> Result<RobotCoupling, Unread> {
        let EqualityJoint { joint1, joint2, polycoef: [offset, ratio, higher @ ..], .. } = equality;
        let place = format!("{}: the equality of the joint {joint1}", self.path.display());
        let unread = |what: &str| Unread { element: "equality".into(), place: format!("{place} {what}") };
        let of = joint2.as_ref().ok_or_else(|| unread("keeps it where it is"))?;
        if higher.iter().any(|coefficient| *coefficient != 0.0) {
            return Err(unread("has a polycoef that is not linear"));
        }
        Ok(RobotCoupling {
            joint: joint1.clone(),
            of: of.clone(),
            ratio: *ratio,
            offset: *offset,
            element: "equality",
            place,
        })
    }

    /// The geometry of a geom; `None` where it is not simulated.
    fn geom(&self, k: usize, geom: &Geom, unread: &mut Vec<Unread>) -> Result<Option<Collision>, RobotError> {
        let name = geom.name.clone().unwrap_or_default();
        let at = |found: &str| self.at(k, format!("geom {name}: {found}"));
        let can_touch = geom.contype != 0 || geom.conaffinity != 0;
        let [x, y, z] = geom.size;
        let is_mesh = matches!(geom.type_, GeomType::Mesh | GeomType::Sdf);
        if geom.mesh.is_some() && !is_mesh {
            return Err(at("a simple shape is fitted to a mesh; give the shape its size, or type=\"mesh\""));
        }
        let mut own = pose(&geom.pose);
        let mut half_height = y;
        if let Some([ax, ay, az, bx, by, bz]) = geom.fromto {
            if !matches!(geom.type_, GeomType::Capsule | GeomType::Cylinder) {
                return Err(at("fromto is of capsules and cylinders; give pos, quat and size"));
            }
            let (from, to) = (DVec3::new(ax, ay, az), DVec3::new(bx, by, bz));
            let along = (to - from).try_normalize().ok_or_else(|| at("the ends of fromto are one point"))?;
            half_height = 0.5 * from.distance(to);
            own = Pose {
                translation: 0.5 * (from + to),
                rotation: elementary::from_rotation_arc(DVec3::Z, along),
            };
        }
        let geometry = match geom.type_ {
            GeomType::Box => Geometry::Box { half_extents: DVec3::new(x, y, z) },
            GeomType::Sphere => Geometry::Sphere { radius: x },
            GeomType::Capsule => Geometry::Capsule { half_height, radius: x },
            GeomType::Cylinder => Geometry::Cylinder { half_height, radius: x },
            GeomType::Mesh | GeomType::Sdf => return self.mesh(k, geom, own).map(Some),
            GeomType::Plane | GeomType::Hfield | GeomType::Ellipsoid => {
                let element = match geom.type_ {
                    GeomType::Plane => "plane",
                    GeomType::Hfield => "hfield",
                    _ => "ellipsoid",
                };
                if can_touch {
                    let place = format!("{}: geom {name} is of type {element}", self.place(k));
                    unread.push(Unread { element: element.into(), place });
                }
                return Ok(None);
            }
        };
        Ok(Some(Collision { pose: own, geometry }))
    }

    fn mesh(&self, k: usize, geom: &Geom, own: Pose) -> Result<Collision, RobotError> {
        let name = geom.mesh.as_deref().unwrap_or_default();
        let at = |found: String| self.at(k, format!("the mesh '{name}' {found}"));
        let mesh = self.model.assets.mesh(name);
        let mesh = mesh.ok_or_else(|| at("is not in <asset>; expected it there".into()))?;
        let file = self.model.resolve_mesh_file(mesh, self.folder);
        let file =
            file.ok_or_else(|| at("has its vertices in the MJCF file; write them to an OBJ file".into()))?;
        let scale = DVec3::from_array(mesh.scale);
        // MuJoCo subtracts `refpos`, rotates by the inverse of `refquat`, and then scales.
        let reference = pose(&mesh.refpose);
        let turned = reference.rotation.inverse();
        let is_even = scale == DVec3::splat(scale.x);
        if turned != DQuat::IDENTITY && !is_even {
            return Err(at(
                "has a refquat and different factors along its axes; turn the mesh in its file".into()
            ));
        }
        let inner = Pose { translation: turned * (scale * -reference.translation), rotation: turned };
        Ok(Collision { pose: super::composed(own, inner), geometry: Geometry::Mesh { file, scale } })
    }
}
