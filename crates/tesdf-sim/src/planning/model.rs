//! A robot and its surroundings.
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use tesdf::Progress;
use tesdf::base::InsideRule;
use tesdf::collide::{Instance, InstanceId, Pose, Scene, Shape, ShapeId};
use tesdf::mesh::RepairMode;

use super::error::PlanningError;
use super::kinematics::Chain;
use super::reach::Hull;
use super::shapes::shape_of;
use crate::robot::{Base, Robot as Description, composed};
use crate::scene_file::AssetCache;

/// How a robot is read.
#[derive(Clone, Debug)]
pub struct RobotOptions {
    /// The frame of the robot in the world.
    pub pose: Pose,
    /// Folders of the packages of a URDF file, by name.
    pub packages: Vec<(String, PathBuf)>,
    /// Whether meshes are repaired first.
    pub repair: RepairMode,
    /// Elements of the file that are left out, such as `equality` or `mimic`: those that change
    /// shapes or joints in a way that is not read are an error otherwise.
    pub ignore: Vec<String>,
    /// Where encoded meshes are kept; `None` encodes them anew.
    pub assets: Option<AssetCache>,
}

impl Default for RobotOptions {
    /// At the origin, without packages, repairs and cache.
    fn default() -> Self {
        let (packages, ignore) = (Vec::new(), Vec::new());
        Self { pose: Pose::IDENTITY, packages, repair: RepairMode::Never, ignore, assets: None }
    }
}

/// Greatest number of links: pairs of them are listed.
const MAX_LINKS: usize = 1000;

/// Elements of MJCF that change neither shapes nor joints.
const HARMLESS: [&str; 12] = [
    "actuator",
    "tendon",
    "condim",
    "stiffness",
    "damping",
    "settotalmass",
    "boundmass",
    "boundinertia",
    "balanceinertia",
    "inertiagrouprange",
    "gravcomp",
    "pair",
];

/// A robot among obstacles, for planners.
///
/// A *configuration* has a number for each [joint](Self::joints) that turns or slides and follows no
/// other one: an angle, rad, or a travel, m. It may be beyond the [limits](Self::limits). *Bodies* are
/// the links of the robot, by their numbers in the order of the file, and after them the obstacles.
///
/// Of the pairs of bodies, [some](Self::checked_pairs) are looked at: all but links that never move
/// against each other, links that a joint connects, links that the file keeps apart, and pairs that
/// [are allowed](Self::set_allowed) to collide.
#[derive(Clone, Debug)]
pub struct Robot {
    pub(super) chain: Chain,
    /// The parts of links have the instances of their numbers.
    pub(super) scene: Scene,
    /// The parts of the links, in the order of the links.
    pub(super) parts: Vec<Part>,
    links: usize,
    bodies: Vec<Body>,
    /// Pairs of links that the file or a joint keeps apart, or a caller allows; lower one first.
    allowed: BTreeSet<[usize; 2]>,
    /// The pairs of instances that are looked at, with their bodies.
    pub(super) pairs: Vec<[InstanceId; 2]>,
    pub(super) bodies_of_pairs: Vec<[usize; 2]>,
}

/// A shape of a link.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub link: usize,
    pub instance: InstanceId,
    /// In the frame of the link.
    pub pose: Pose,
    pub hull: Hull,
}

#[derive(Clone, Debug)]
struct Body {
    name: String,
    instances: Vec<InstanceId>,
}

impl Robot {
    /// Reads the URDF or MJCF file at `path` and encodes the meshes of its links. Boxes, spheres,
    /// capsules and cylinders are exact.
    ///
    /// # Errors
    /// [`PlanningError::Robot`] with the place in the file, or the link whose mesh cannot be encoded.
    pub fn load(path: &Path, options: &RobotOptions, progress: &Progress) -> Result<Self, PlanningError> {
        let RobotOptions { pose, packages, repair, ignore, assets } = options;
        let file = Description::read(path, packages)?;
        let matters = |element: &String| !ignore.contains(element) && !HARMLESS.contains(&element.as_str());
        if let Some(unread) = file.unread.iter().find(|unread| matters(&unread.element)) {
            let cure = format!("leave it out of the file, or ignore \"{}\"", unread.element);
            return Err(PlanningError::Robot(format!("{}, which is not read: {cure}", unread.place)));
        }
        if file.links.len() > MAX_LINKS {
            let found = format!("{}: it has {} links", path.display(), file.links.len());
            return Err(PlanningError::Robot(format!(
                "{found}; expected at most {MAX_LINKS}: divide the file"
            )));
        }
        let chain = Chain::new(&file, *pose, ignore)?;
        let mut robot = Self {
            allowed: apart(&file, &chain),
            chain,
            scene: Scene::new(),
            parts: Vec::new(),
            links: file.links.len(),
            bodies: Vec::new(),
            pairs: Vec::new(),
            bodies_of_pairs: Vec::new(),
        };
        let mut shapes: BTreeMap<String, ShapeId> = BTreeMap::new();
        for (k, link) in file.links.iter().enumerate() {
            let mut instances = Vec::new();
            for collision in &link.collisions {
                let key = format!("{:?}", collision.geometry);
                let at = |source| PlanningError::Body { body: link.name.clone(), source };
                let shape = match shapes.get(&key) {
                    Some(&shape) => shape,
                    None => {
                        let of = &collision.geometry;
                        let shape = shape_of(&link.name, of, *repair, assets.as_ref(), progress)?;
                        let id = robot.scene.add_shape(shape).map_err(at)?;
                        shapes.insert(key, id);
                        id
                    }
                };
                let instance = Instance::new(shape, collision.pose);
                let instance = robot.scene.add(instance).map_err(at)?;
                let hull = Hull::new(robot.scene.shape(shape)?, collision.pose);
                robot.parts.push(Part { link: k, instance, pose: collision.pose, hull });
                instances.push(instance);
            }
            robot.bodies.push(Body { name: link.name.clone(), instances });
        }
        robot.list_pairs();
        Ok(robot)
    }

    /// Adds an obstacle, with the scale of its shape: metres per unit.
    ///
    /// # Errors
    /// The name is that of another body, the shape is an open mesh, whose surface has no place in its
    /// holes, or shape, pose or scale are no ones.
    pub fn add_obstacle(
        &mut self,
        name: &str,
        shape: Shape,
        pose: Pose,
        scale: f64,
    ) -> Result<(), PlanningError> {
        if self.bodies.iter().any(|body| body.name == name) {
            let found = format!("obstacle {name}: there is a body of this name");
            return Err(PlanningError::Argument(format!(
                "{found}; expected another one than {}",
                self.names()
            )));
        }
        if let Shape::Mesh(asset) = &shape
            && asset.inside().rule == InsideRule::Generalized
        {
            return Err(PlanningError::Argument(format!(
                "obstacle {name}: its inside is by the generalised winding number, which has no surface in holes; \
                 expected a closed mesh of another rule, or a sheet"
            )));
        }
        let at = |source| PlanningError::Body { body: name.into(), source };
        let shape = self.scene.add_shape(shape).map_err(at)?;
        let instance = Instance { scale, ..Instance::new(shape, pose) };
        let instance = self.scene.add(instance).map_err(at)?;
        self.bodies.push(Body { name: name.into(), instances: vec![instance] });
        self.list_pairs();
        Ok(())
    }

    /// Sets the pose of an obstacle.
    ///
    /// # Errors
    /// There is no such obstacle, or the pose is none.
    pub fn move_obstacle(&mut self, name: &str, pose: Pose) -> Result<(), PlanningError> {
        let body = self.obstacle(name)?;
        let at = |source| PlanningError::Body { body: name.into(), source };
        let poses: Vec<_> = self.bodies[body].instances.iter().map(|&id| (id, pose)).collect();
        self.scene.set_poses(&poses).map_err(at)
    }

    /// Removes an obstacle. The numbers of those after it fall by one.
    ///
    /// # Errors
    /// There is no such obstacle.
    pub fn remove_obstacle(&mut self, name: &str) -> Result<(), PlanningError> {
        let gone = self.obstacle(name)?;
        let Body { instances, .. } = self.bodies.remove(gone);
        let shapes: BTreeSet<_> = instances
            .iter()
            .map(|&id| Ok(self.scene.instance(id)?.shape))
            .collect::<Result<_, PlanningError>>()?;
        self.scene.remove(&instances)?;
        for shape in shapes {
            self.scene.remove_shape(shape)?;
        }
        let moved = |body: usize| if body > gone { body - 1 } else { body };
        let kept = self.allowed.iter().filter(|pair| !pair.contains(&gone));
        self.allowed = kept.map(|pair| pair.map(moved)).collect();
        self.list_pairs();
        Ok(())
    }

    fn obstacle(&self, name: &str) -> Result<usize, PlanningError> {
        let known = &self.bodies[self.links..];
        let found = known.iter().position(|body| body.name == name);
        found.map(|k| self.links + k).ok_or_else(|| {
            let names: Vec<_> = known.iter().map(|body| body.name.as_str()).collect();
            let expected = if names.is_empty() { "one: there are none".into() } else { names.join(", ") };
            PlanningError::Argument(format!("there is no obstacle {name}; expected {expected}"))
        })
    }

    /// Number of the numbers of a configuration.
    pub fn dof(&self) -> usize {
        self.chain.free.len()
    }

    /// The names of the joints of a configuration, in its order.
    pub fn joints(&self) -> Vec<&str> {
        self.chain.free.iter().map(|&joint| self.chain.joints[joint].name.as_str()).collect()
    }

    /// The limits of the numbers of a configuration, rad or m; infinite where the file has none.
    pub fn limits(&self) -> &[[f64; 2]] {
        &self.chain.limits
    }

    /// The names of the bodies: the links of the robot, then the obstacles.
    pub fn bodies(&self) -> Vec<&str> {
        self.bodies.iter().map(|body| body.name.as_str()).collect()
    }

    /// Number of links, which are the first bodies.
    pub fn link_count(&self) -> usize {
        self.links
    }

    /// The pose of each link at a configuration, in the world.
    ///
    /// # Errors
    /// The configuration has not [`dof`](Self::dof) finite numbers.
    pub fn poses(&self, q: &[f64]) -> Result<Vec<Pose>, PlanningError> {
        self.check(q)?;
        Ok(self.chain.poses(q))
    }

    /// The pairs of bodies that are looked at, lower number first, sorted.
    pub fn checked_pairs(&self) -> Vec<[usize; 2]> {
        let mut pairs = self.bodies_of_pairs.clone();
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }

    /// Sets whether two bodies may collide, by their names: nothing is looked at between those that
    /// may.
    ///
    /// # Errors
    /// A name that no body has, or of bodies to look at: bodies that never move against each other.
    pub fn set_allowed(&mut self, a: &str, b: &str, allowed: bool) -> Result<(), PlanningError> {
        let body = |name: &str| {
            self.bodies.iter().position(|body| body.name == name).ok_or_else(|| {
                PlanningError::Argument(format!("there is no body {name}; expected one of {}", self.names()))
            })
        };
        let (a, b) = (body(a)?, body(b)?);
        if !allowed && !self.can_move([a, b]) {
            let [a, b] = [a, b].map(|body| &self.bodies[body].name);
            return Err(PlanningError::Argument(format!(
                "{a} and {b} never move against each other; expected bodies that a joint of the configuration moves"
            )));
        }
        let pair = [a.min(b), a.max(b)];
        if allowed {
            self.allowed.insert(pair);
        } else {
            self.allowed.remove(&pair);
        }
        self.list_pairs();
        Ok(())
    }

    fn names(&self) -> String {
        self.bodies().join(", ")
    }

    /// The joints above a body; none for obstacles.
    pub(super) fn above(&self, body: usize) -> &[usize] {
        self.chain.above.get(body).map_or(&[], Vec::as_slice)
    }

    /// Whether bodies can move against each other.
    fn can_move(&self, [a, b]: [usize; 2]) -> bool {
        a != b && self.above(a) != self.above(b)
    }

    fn list_pairs(&mut self) {
        let (mut pairs, mut bodies) = (Vec::new(), Vec::new());
        for a in 0..self.links {
            for b in a + 1..self.bodies.len() {
                if self.allowed.contains(&[a, b]) || !self.can_move([a, b]) {
                    continue;
                }
                for &one in &self.bodies[a].instances {
                    for &other in &self.bodies[b].instances {
                        pairs.push([one, other]);
                        bodies.push([a, b]);
                    }
                }
            }
        }
        (self.pairs, self.bodies_of_pairs) = (pairs, bodies);
    }

    /// Checks a configuration.
    pub(super) fn check(&self, q: &[f64]) -> Result<(), PlanningError> {
        let expected = || {
            let joints = self.joints().join(", ");
            format!("expected {} finite numbers, of the joints {joints}", self.dof())
        };
        let found = match q.iter().find(|x| !x.is_finite()) {
            _ if q.len() != self.dof() => format!("{} numbers", q.len()),
            Some(x) => format!("the number {x}"),
            None => return Ok(()),
        };
        Err(PlanningError::Argument(format!("a configuration has {found}; {}", expected())))
    }

    /// Moves the links of a scene to their poses.
    pub(super) fn place(&self, scene: &mut Scene, poses: &[Pose]) -> Result<(), PlanningError> {
        let placed = self.parts.iter().map(|part| (part.instance, composed(poses[part.link], part.pose)));
        Ok(scene.set_poses(&placed.collect::<Vec<_>>())?)
    }
}

/// The pairs of links that the file keeps apart, and those that a joint connects.
fn apart(file: &Description, chain: &Chain) -> BTreeSet<[usize; 2]> {
    // Links with the same joints above them move together.
    let mut groups: BTreeMap<&[usize], usize> = BTreeMap::new();
    let group: Vec<usize> = chain
        .above
        .iter()
        .map(|above| {
            let next = groups.len();
            *groups.entry(above).or_insert(next)
        })
        .collect();
    let mut neighbours: BTreeSet<[usize; 2]> = BTreeSet::new();
    for (k, link) in file.links.iter().enumerate() {
        if let Base::Joint(joint) = &link.base
            && !file.links[joint.parent].is_world()
        {
            let [a, b] = [group[joint.parent], group[k]];
            neighbours.insert([a.min(b), a.max(b)]);
        }
    }
    let is_apart = |&[a, b]: &[usize; 2]| {
        let [[of, with], [of_other, with_other]] = [file.links[a].groups, file.links[b].groups];
        let meet = of & with_other != 0 || of_other & with != 0;
        let [one, other] = [group[a], group[b]];
        !meet || neighbours.contains(&[one.min(other), one.max(other)])
    };
    let links = file.links.len();
    let pairs = (0..links).flat_map(|a| (a + 1..links).map(move |b| [a, b]));
    let of_file = file.apart.iter().map(|&[a, b]| [a.min(b), a.max(b)]);
    pairs.filter(is_apart).chain(of_file).collect()
}
