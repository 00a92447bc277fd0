//! Reads URDF.
//!
//! `velocity` of `<limit>`, `<safety_controller>`, `<calibration>`, `<transmission>`, `<visual>` and
//! elements of other programs are for controllers and pictures, and are not read.
use std::collections::BTreeMap;
use std::path::Path;

use glam::{DMat3, DVec3};
use roxmltree::{Document, Node};
use tesdf::base::elementary;
use tesdf::collide::Pose;

use super::description::{Base, Collision, Geometry, Link, Motion, Robot, RobotCoupling, RobotJoint};
use super::{Packages, RobotError, parse, read};
use crate::{MassProperties, inertia_matrix};

/// Reads the URDF file at `path`, whose meshes are found with `packages`.
///
/// # Errors
/// The file cannot be read or is no URDF, or links and joints are no tree.
pub fn read_urdf(path: &Path, packages: &Packages<'_>) -> Result<Robot, RobotError> {
    let text = read(path)?;
    let document = parse(path, &text)?;
    let file = File { path, document: &document, packages };
    let robot = document.root_element();
    if !robot.has_tag_name("robot") {
        let found = format!("found <{}>; expected <robot> of URDF", robot.tag_name().name());
        return Err(file.at(robot, found));
    }
    file.robot(robot)
}

/// The name of the file of a `<mesh>` and its scale.
///
/// # Errors
/// It has no file name, or its scale is none.
pub fn mesh_reference<'a>(
    path: &Path,
    document: &Document<'_>,
    mesh: Node<'a, '_>,
) -> Result<(&'a str, DVec3), RobotError> {
    let at = |found: String| RobotError::in_line(path, document.text_pos_at(mesh.range().start).row, found);
    let name = mesh.attribute("filename").map(str::trim).filter(|name| !name.is_empty());
    let name = name.ok_or_else(|| at("<mesh> has no filename; expected one".into()))?;
    let Some(text) = mesh.attribute("scale") else { return Ok((name, DVec3::ONE)) };
    // One number is for all axes, as some files have it.
    let scale = match numbers(text).as_deref() {
        Some(&[all]) => DVec3::splat(all),
        Some(&[x, y, z]) => DVec3::new(x, y, z),
        _ => DVec3::ZERO,
    };
    match scale.cmpne(DVec3::ZERO).all() {
        true => Ok((name, scale)),
        false => Err(at(format!("the scale is '{text}'; expected three numbers other than 0"))),
    }
}

/// Finite numbers between spaces.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let number = |word: &str| word.parse().ok().filter(|x: &f64| x.is_finite());
    text.split_whitespace().map(number).collect()
}

struct File<'a> {
    path: &'a Path,
    document: &'a Document<'a>,
    packages: &'a Packages<'a>,
}

fn child<'a>(node: Node<'a, 'a>, name: &'static str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

impl<'a> File<'a> {
    fn line(&self, node: Node<'_, '_>) -> u32 {
        self.document.text_pos_at(node.range().start).row
    }

    fn at(&self, node: Node<'_, '_>, found: impl std::fmt::Display) -> RobotError {
        RobotError::in_line(self.path, self.line(node), found)
    }

    /// An attribute that must be there.
    fn text(&self, node: Node<'a, 'a>, name: &str) -> Result<&'a str, RobotError> {
        let found = node.attribute(name).map(str::trim).filter(|text| !text.is_empty());
        found
            .ok_or_else(|| self.at(node, format!("<{}> has no {name}; expected one", node.tag_name().name())))
    }

    /// Numbers of an attribute; `None` where it is left out.
    fn numbers<const N: usize>(
        &self,
        node: Node<'a, 'a>,
        name: &str,
    ) -> Result<Option<[f64; N]>, RobotError> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        let found = numbers(text).and_then(|numbers| numbers.try_into().ok());
        let found = found.ok_or_else(|| {
            let count = if N == 1 { "a finite number".into() } else { format!("{N} finite numbers") };
            self.at(node, format!("{name} of <{}> is '{text}'; expected {count}", node.tag_name().name()))
        });
        found.map(Some)
    }

    fn number(&self, node: Node<'a, 'a>, name: &str) -> Result<f64, RobotError> {
        self.text(node, name)?;
        Ok(self.numbers::<1>(node, name)?.unwrap_or_default()[0])
    }

    /// The `<origin>` of an element.
    fn origin(&self, node: Node<'a, 'a>) -> Result<Pose, RobotError> {
        let Some(origin) = child(node, "origin") else { return Ok(Pose::IDENTITY) };
        let translation = DVec3::from_array(self.numbers(origin, "xyz")?.unwrap_or_default());
        let [roll, pitch, yaw] = self.numbers(origin, "rpy")?.unwrap_or_default();
        let [x, y, z] = [(DVec3::X, roll), (DVec3::Y, pitch), (DVec3::Z, yaw)]
            .map(|(axis, angle)| elementary::from_axis_angle(axis, angle));
        Ok(Pose { translation, rotation: (z * y * x).normalize() })
    }

    fn robot(&self, robot: Node<'a, 'a>) -> Result<Robot, RobotError> {
        let mut nodes = BTreeMap::new();
        let mut names = Vec::new();
        for node in robot.children().filter(|node| node.has_tag_name("link")) {
            let name = self.text(node, "name")?;
            if nodes.insert(name, node).is_some() {
                return Err(self.at(node, format!("the link {name} is there twice; give each its own name")));
            }
            names.push(name);
        }
        let mut above: BTreeMap<&str, (&str, Node<'a, 'a>)> = BTreeMap::new();
        let mut below: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for joint in robot.children().filter(|node| node.has_tag_name("joint")) {
            let [parent, link] = ["parent", "child"].map(|role| {
                let end = child(joint, role)
                    .ok_or_else(|| self.at(joint, format!("<joint> has no <{role}>; expected one")))?;
                let name = self.text(end, "link")?;
                match nodes.get_key_value(name) {
                    Some((&name, _)) => Ok(name),
                    None => Err(self.at(end, format!("there is no link {name}; expected one of the links"))),
                }
            });
            let (parent, link) = (parent?, link?);
            if above.insert(link, (parent, joint)).is_some() {
                let found = format!("the link {link} is the child of two joints");
                return Err(self.at(joint, format!("{found}; expected a tree: a link has one parent")));
            }
            below.entry(parent).or_default().push(link);
        }
        let mut roots = names.iter().copied().filter(|name| !above.contains_key(name));
        let root = match (roots.next(), roots.next()) {
            (Some(root), None) => root,
            (Some(one), Some(other)) => {
                let found = format!("the links {one} and {other} have no parent");
                return Err(
                    self.at(nodes[other], format!("{found}; expected one root: connect them by a joint"))
                );
            }
            (None, _) if names.is_empty() => {
                return Err(self.at(robot, "the robot has no link; expected at least one"));
            }
            (None, _) => return Err(self.at(robot, "each link has a parent; expected a root: a tree")),
        };
        let (mut found, mut places) = (Robot::default(), BTreeMap::new());
        let mut stack = vec![root];
        while let Some(name) = stack.pop() {
            let base = match above.get(name) {
                None => Base::Root { pose: Pose::IDENTITY, is_fixed: None },
                Some(&(parent, joint)) => {
                    Base::Joint(self.joint(joint, places[parent], &mut found.couplings)?)
                }
            };
            places.insert(name, found.links.len());
            found.links.push(self.link(nodes[name], name, base)?);
            stack.extend(below.get(name).into_iter().flatten().rev());
        }
        // Links that only each other have as parents.
        match names.iter().find(|name| !places.contains_key(*name)) {
            Some(lost) => {
                Err(self.at(nodes[lost], format!("the link {lost} is in a circle; expected a tree")))
            }
            None => Ok(found),
        }
    }

    fn link(&self, node: Node<'a, 'a>, name: &str, base: Base) -> Result<Link, RobotError> {
        let mass = child(node, "inertial").map(|inertial| self.mass(inertial)).transpose()?.flatten();
        let collisions = node.children().filter(|node| node.has_tag_name("collision"));
        Ok(Link {
            name: name.to_owned(),
            place: format!("{}, line {}", self.path.display(), self.line(node)),
            base,
            mass,
            collisions: collisions.map(|collision| self.collision(collision)).collect::<Result<_, _>>()?,
            friction: None,
            friction_torsional: None,
            groups: [1; 2],
        })
    }

    /// `None`: of mass 0, as some files say of frames.
    fn mass(&self, inertial: Node<'a, 'a>) -> Result<Option<MassProperties>, RobotError> {
        let need = |name| {
            child(inertial, name)
                .ok_or_else(|| self.at(inertial, format!("<inertial> has no <{name}>; expected one")))
        };
        let mass = self.number(need("mass")?, "value")?;
        if mass == 0.0 {
            return Ok(None);
        }
        let node = need("inertia")?;
        let mut moments = [0.0; 6];
        for (moment, name) in moments.iter_mut().zip(["ixx", "iyy", "izz", "ixy", "ixz", "iyz"]) {
            *moment = self.numbers::<1>(node, name)?.unwrap_or_default()[0];
        }
        let inertia = inertia_matrix(moments);
        let origin = self.origin(inertial)?;
        let turn = DMat3::from_quat(origin.rotation);
        let found = MassProperties::new(mass, origin.translation, turn * inertia * turn.transpose());
        found.map(Some).map_err(|e| self.at(inertial, e))
    }

    fn collision(&self, node: Node<'a, 'a>) -> Result<Collision, RobotError> {
        let geometry = child(node, "geometry");
        let shape = geometry.and_then(|geometry| geometry.children().find(Node::is_element));
        let shape = shape.ok_or_else(|| self.at(node, "<collision> has no geometry; expected one"))?;
        let half_length = || Ok(0.5 * self.number(shape, "length")?);
        let geometry = match shape.tag_name().name() {
            "box" => {
                self.text(shape, "size")?;
                let size = DVec3::from_array(self.numbers(shape, "size")?.unwrap_or_default());
                Geometry::Box { half_extents: 0.5 * size }
            }
            "sphere" => Geometry::Sphere { radius: self.number(shape, "radius")? },
            "cylinder" => {
                Geometry::Cylinder { half_height: half_length()?, radius: self.number(shape, "radius")? }
            }
            "capsule" => {
                Geometry::Capsule { half_height: half_length()?, radius: self.number(shape, "radius")? }
            }
            "mesh" => {
                let (name, scale) = mesh_reference(self.path, self.document, shape)?;
                let file = self.packages.resolve(name).map_err(|e| self.at(shape, e))?;
                Geometry::Mesh { file, scale }
            }
            other => {
                let expected = "expected box, sphere, cylinder, capsule or mesh";
                return Err(self.at(shape, format!("the geometry <{other}> is not known; {expected}")));
            }
        };
        Ok(Collision { pose: self.origin(node)?, geometry })
    }

    fn joint(
        &self,
        node: Node<'a, 'a>,
        parent: usize,
        couplings: &mut Vec<RobotCoupling>,
    ) -> Result<RobotJoint, RobotError> {
        let name = self.text(node, "name")?;
        let kind = self.text(node, "type")?;
        let limit = child(node, "limit");
        let motion = match kind {
            "fixed" => Motion::Fixed,
            "revolute" | "continuous" => Motion::Hinge,
            "prismatic" => Motion::Slider,
            "floating" => Motion::Free,
            "planar" => {
                let cure = "expected two prismatic joints and a continuous one, with links between them";
                return Err(self.at(node, format!("the joint {name} is planar; {cure}")));
            }
            other => {
                let expected = "expected revolute, continuous, prismatic, fixed or floating";
                return Err(self.at(node, format!("the type of the joint {name} is '{other}'; {expected}")));
            }
        };
        let limits = match (kind, limit) {
            ("revolute" | "prismatic", Some(limit)) => {
                let bound = |name| Ok(self.numbers::<1>(limit, name)?.unwrap_or_default()[0]);
                Some([bound("lower")?, bound("upper")?])
            }
            ("revolute" | "prismatic", None) => {
                return Err(
                    self.at(node, format!("the joint {name} is {kind} and has no <limit>; expected one"))
                );
            }
            _ => None,
        };
        let axis = child(node, "axis").map(|axis| self.numbers(axis, "xyz")).transpose()?.flatten();
        let axis = DVec3::from_array(axis.unwrap_or([1.0, 0.0, 0.0]));
        if axis == DVec3::ZERO && motion != Motion::Fixed {
            return Err(self.at(node, format!("the axis of the joint {name} has no direction; expected one")));
        }
        let dynamics = child(node, "dynamics");
        let resists = |name| {
            let found = dynamics.map(|dynamics| self.numbers::<1>(dynamics, name)).transpose()?.flatten();
            Ok::<_, RobotError>(found.unwrap_or_default()[0])
        };
        let moves = matches!(motion, Motion::Hinge | Motion::Slider);
        if let Some(mimic) = child(node, "mimic").filter(|_| moves) {
            let number = |name| Ok::<_, RobotError>(self.numbers::<1>(mimic, name)?.map(|[x]| x));
            couplings.push(RobotCoupling {
                joint: name.to_owned(),
                of: self.text(mimic, "joint")?.to_owned(),
                ratio: number("multiplier")?.unwrap_or(1.0),
                offset: number("offset")?.unwrap_or(0.0),
                element: "mimic",
                place: format!("{}, line {}", self.path.display(), self.line(mimic)),
            });
        }
        Ok(RobotJoint {
            name: name.to_owned(),
            parent,
            motion,
            pose: self.origin(node)?,
            anchor: DVec3::ZERO,
            axis,
            limits,
            damping: if moves { resists("damping")? } else { 0.0 },
            friction: if moves { resists("friction")? } else { 0.0 },
            armature: 0.0,
            effort: limit.map(|limit| self.numbers::<1>(limit, "effort")).transpose()?.flatten().map(|[x]| x),
        })
    }
}
