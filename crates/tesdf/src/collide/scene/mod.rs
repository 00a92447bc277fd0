//! Shapes, their instances, and how these move.
pub mod cylinder;
pub mod error;
pub mod field_value;
pub mod ids;
pub mod motion;
pub mod pose;
pub mod shape;
pub mod shape_distance;
pub mod shape_ray;
pub mod simple;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::DVec3;

use crate::TeSdf;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::{InstanceId, ShapeId};
use crate::collide::scene::pose::{Placement, Pose};
use crate::collide::scene::shape::SIZE;
use crate::collide::scene::shape::Shape;
use crate::geometry::Aabb;

/// Groups decide which instances meet. Two instances meet when the `memberships` of each share a
/// bit with the `filter` of the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Groups {
    /// The groups to which the instance belongs.
    pub memberships: u32,
    /// The groups that the instance meets.
    pub filter: u32,
}

impl Groups {
    /// Member of all groups, meeting all groups.
    pub const ALL: Self = Self { memberships: u32::MAX, filter: u32::MAX };

    /// Whether instances of these groups meet.
    pub fn meet(self, other: Self) -> bool {
        self.memberships & other.filter != 0 && other.memberships & self.filter != 0
    }
}

/// Velocity of a body in the world, per unit of time. The angular part is about the body's origin,
/// in radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Velocity {
    /// Velocity of the body's origin.
    pub linear: DVec3,
    /// Angular velocity about the body's origin.
    pub angular: DVec3,
}

/// Largest distance of an instance from the origin, in diagonals of its shape. There, the rounding
/// of coordinates is about 1e-4 of the diagonal.
const FARTHEST: f64 = 1e12;

/// A shape placed in a world. It needs memory only for this state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// The shape.
    pub shape: ShapeId,
    /// Its pose.
    pub pose: Pose,
    /// Its velocity; used only for speculative contacts.
    pub velocity: Velocity,
    /// World units per unit of the shape; positive.
    pub scale: f64,
    /// Instances of different worlds never meet.
    pub world: u32,
    /// The groups that decide which instances it meets.
    pub groups: Groups,
}

impl Instance {
    /// A resting instance with scale 1 in world 0 that meets all others.
    pub fn new(shape: ShapeId, pose: Pose) -> Self {
        Self { shape, pose, velocity: Velocity::default(), scale: 1.0, world: 0, groups: Groups::ALL }
    }

    /// Pose and scale.
    pub fn placement(&self) -> Placement {
        Placement { pose: self.pose, scale: self.scale }
    }

    /// Bounds in the world; infinite for a plane. `shape` is its shape.
    pub(in crate::collide) fn bounds(&self, shape: &Shape) -> Aabb {
        match shape {
            // A rotated half-space has no useful box.
            Shape::Plane => Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY },
            _ => self.placement().bounds(shape.bounds()),
        }
    }
}

/// Shapes and their instances.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    shapes: BTreeMap<ShapeId, Shape>,
    /// Sorted by id, because ids only grow.
    ids: Vec<InstanceId>,
    instances: Vec<Instance>,
    excluded: BTreeSet<(InstanceId, InstanceId)>,
    /// Sorted.
    still: Vec<InstanceId>,
    next_shape: u32,
    next_instance: u32,
}

impl Scene {
    /// An empty scene.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a shape: an encoded mesh (shared by `Arc`) or a simple shape.
    ///
    /// # Errors
    /// [`CollideError::Shape`] for sizes that are not positive.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::{Scene, Shape, TeSdf};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let folder = tempfile::tempdir()?;
    /// # let path = folder.path().join("part.obj");
    /// # std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")?;
    /// let mut scene = Scene::new();
    /// let part = scene.add_shape(TeSdf::encode_file(&path)?)?;
    /// let floor = scene.add_shape(Shape::Plane)?;
    /// assert_ne!(part, floor);
    /// # Ok(())
    /// # }
    /// ```
    pub fn add_shape(&mut self, shape: impl Into<Shape>) -> Result<ShapeId, CollideError> {
        let shape = shape.into();
        shape.validate()?;
        let id = ShapeId(self.next_shape);
        self.next_shape += 1;
        self.shapes.insert(id, shape);
        Ok(id)
    }

    /// Mutable access to an encoded mesh, to move its vertices ([`TeSdf::move_vertices`]). All its
    /// instances deform alike. An asset that is shared outside this scene is copied first.
    ///
    /// # Errors
    /// [`CollideError::NoShape`] when there is no such shape, or it is not a mesh.
    pub fn mesh_mut(&mut self, shape: ShapeId) -> Result<&mut TeSdf, CollideError> {
        match self.shapes.get_mut(&shape) {
            Some(Shape::Mesh(asset)) => Ok(Arc::make_mut(asset)),
            _ => Err(CollideError::NoShape(shape)),
        }
    }

    /// Removes a shape that no instance uses.
    ///
    /// # Errors
    /// [`CollideError::ShapeInUse`] names an instance; [`CollideError::NoShape`] when there is no
    /// such shape.
    pub fn remove_shape(&mut self, shape: ShapeId) -> Result<Shape, CollideError> {
        if let Some(at) = self.instances.iter().position(|i| i.shape == shape) {
            return Err(CollideError::ShapeInUse { shape, instance: self.ids[at] });
        }
        self.shapes.remove(&shape).ok_or(CollideError::NoShape(shape))
    }

    /// Adds an instance.
    ///
    /// # Errors
    /// As [`add_many`](Self::add_many).
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::glam::DVec3;
    /// use tesdf::{Instance, Pose, Scene, Shape};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let mut scene = Scene::new();
    /// let ball = scene.add_shape(Shape::Sphere { radius: 1.0 })?;
    /// let small = Instance { scale: 0.1, ..Instance::new(ball, Pose::at(DVec3::X)) };
    /// let id = scene.add(small)?;
    /// assert_eq!(scene.instance(id)?.scale, 0.1);
    /// # Ok(())
    /// # }
    /// ```
    pub fn add(&mut self, instance: Instance) -> Result<InstanceId, CollideError> {
        self.add_many(&[instance]).map(|ids| ids.start)
    }

    /// Adds instances with consecutive ids. Either all are added or none.
    ///
    /// # Errors
    /// [`CollideError::Instance`] names the instance by its index in `instances`.
    pub fn add_many(&mut self, instances: &[Instance]) -> Result<std::ops::Range<InstanceId>, CollideError> {
        let first = self.next_instance;
        let end =
            u32::try_from(instances.len()).ok().and_then(|n| first.checked_add(n)).ok_or_else(|| {
                CollideError::Instance {
                    instance: first,
                    reason: format!("{} more instances; ids end at 2^32", instances.len()),
                }
            })?;
        let checked = |(k, instance)| {
            self.checked(instance).map_err(|reason| CollideError::Instance { instance: k as u32, reason })
        };
        let instances = instances.iter().enumerate().map(checked).collect::<Result<Vec<_>, _>>()?;
        self.ids.extend((first..end).map(InstanceId));
        self.instances.extend(instances);
        self.next_instance = end;
        Ok(InstanceId(first)..InstanceId(end))
    }

    /// Removes instances. Either all are removed or none.
    ///
    /// # Errors
    /// [`CollideError::NoInstance`] names an instance that does not exist.
    pub fn remove(&mut self, ids: &[InstanceId]) -> Result<(), CollideError> {
        ids.iter().try_for_each(|&id| self.at(id).map(|_| ()))?;
        let gone: BTreeSet<InstanceId> = ids.iter().copied().collect();
        let mut kept = self.ids.iter().map(|id| !gone.contains(id));
        self.instances.retain(|_| kept.next() == Some(true));
        self.ids.retain(|id| !gone.contains(id));
        self.excluded.retain(|(a, b)| !gone.contains(a) && !gone.contains(b));
        self.still.retain(|id| !gone.contains(id));
        Ok(())
    }

    /// Replaces the states of instances. Either all are replaced or none.
    ///
    /// # Errors
    /// Names the first instance that does not exist or has an invalid state.
    pub fn update(&mut self, updates: &[(InstanceId, Instance)]) -> Result<(), CollideError> {
        let checked = |&(id, instance): &(InstanceId, Instance)| {
            let instance = self
                .checked(&instance)
                .map_err(|reason| CollideError::Instance { instance: id.0, reason })?;
            Ok((self.at(id)?, instance))
        };
        for (at, instance) in updates.iter().map(checked).collect::<Result<Vec<_>, CollideError>>()? {
            self.instances[at] = instance;
        }
        Ok(())
    }

    /// Sets the poses of instances. Either all are set or none.
    ///
    /// # Errors
    /// As [`update`](Self::update).
    pub fn set_poses(&mut self, poses: &[(InstanceId, Pose)]) -> Result<(), CollideError> {
        let updates = poses
            .iter()
            .map(|&(id, pose)| Ok((id, Instance { pose, ..*self.instance(id)? })))
            .collect::<Result<Vec<_>, CollideError>>()?;
        self.update(&updates)
    }

    /// Excludes a pair of instances, so that they never meet.
    ///
    /// # Errors
    /// [`CollideError::NoInstance`].
    pub fn exclude(&mut self, a: InstanceId, b: InstanceId) -> Result<(), CollideError> {
        self.at(a)?;
        self.at(b)?;
        self.excluded.insert((a.min(b), a.max(b)));
        Ok(())
    }

    /// Revokes the exclusion of a pair of instances.
    pub fn include(&mut self, a: InstanceId, b: InstanceId) {
        self.excluded.remove(&(a.min(b), a.max(b)));
    }

    /// Marks these instances, and no others, as still. Two still instances never meet: nothing is
    /// detected between bodies that do not move, whose contacts the caller knows. The mark has no
    /// effect on queries of a given pair.
    pub fn set_still(&mut self, ids: impl IntoIterator<Item = InstanceId>) {
        self.still.clear();
        self.still.extend(ids);
        self.still.sort_unstable();
        self.still.dedup();
    }

    /// Whether an instance is marked as still.
    pub fn is_still(&self, id: InstanceId) -> bool {
        self.still.binary_search(&id).is_ok()
    }

    /// The instances that are marked as still, sorted.
    pub fn still(&self) -> &[InstanceId] {
        &self.still
    }

    /// The state of an instance.
    ///
    /// # Errors
    /// [`CollideError::NoInstance`].
    pub fn instance(&self, id: InstanceId) -> Result<&Instance, CollideError> {
        self.at(id).map(|at| &self.instances[at])
    }

    /// The shape of an instance, and where it is.
    ///
    /// # Errors
    /// [`CollideError::NoInstance`], and [`CollideError::NoShape`].
    pub(crate) fn placed(&self, id: InstanceId) -> Result<(&Shape, Placement), CollideError> {
        let instance = self.instance(id)?;
        Ok((self.shape(instance.shape)?, instance.placement()))
    }

    /// A shape.
    ///
    /// # Errors
    /// [`CollideError::NoShape`].
    pub fn shape(&self, id: ShapeId) -> Result<&Shape, CollideError> {
        self.shapes.get(&id).ok_or(CollideError::NoShape(id))
    }

    /// All shapes, in the order of their ids.
    pub fn shapes(&self) -> impl ExactSizeIterator<Item = (ShapeId, &Shape)> {
        self.shapes.iter().map(|(id, shape)| (*id, shape))
    }

    /// All instances, in the order of their ids.
    pub fn instances(&self) -> impl ExactSizeIterator<Item = (InstanceId, &Instance)> {
        self.ids.iter().copied().zip(&self.instances)
    }

    /// Whether two different instances may meet: they are in the same world, their groups meet, the
    /// pair is not excluded, and they are not both still.
    pub fn may_meet(&self, a: (InstanceId, &Instance), b: (InstanceId, &Instance)) -> bool {
        a.0 != b.0
            && a.1.world == b.1.world
            && a.1.groups.meet(b.1.groups)
            && !self.is_excluded(a.0, b.0)
            && !self.are_still(a.0, b.0)
    }

    /// Whether both instances of a pair are still.
    pub(in crate::collide) fn are_still(&self, a: InstanceId, b: InstanceId) -> bool {
        self.is_still(a) && self.is_still(b)
    }

    /// Whether a pair of instances is excluded.
    pub fn is_excluded(&self, a: InstanceId, b: InstanceId) -> bool {
        !self.excluded.is_empty() && self.excluded.contains(&(a.min(b), a.max(b)))
    }

    /// The excluded pairs of instances, lower id first, sorted.
    pub fn excluded(&self) -> impl ExactSizeIterator<Item = (InstanceId, InstanceId)> {
        self.excluded.iter().copied()
    }

    /// Bounds of an instance in the world; infinite for a plane.
    ///
    /// # Errors
    /// [`CollideError::NoInstance`].
    pub fn bounds(&self, id: InstanceId) -> Result<Aabb, CollideError> {
        let instance = self.instance(id)?;
        Ok(instance.bounds(self.shape(instance.shape)?))
    }

    /// Memory of the instances and exclusions in bytes, without shapes.
    pub fn instance_bytes(&self) -> usize {
        self.instances.len() * (size_of::<Instance>() + size_of::<InstanceId>())
            + self.excluded.len() * size_of::<(InstanceId, InstanceId)>()
    }

    fn at(&self, id: InstanceId) -> Result<usize, CollideError> {
        self.ids.binary_search(&id).map_err(|_| CollideError::NoInstance(id))
    }

    /// Checks an instance. Returns it with its rotation normalised.
    fn checked(&self, instance: &Instance) -> Result<Instance, String> {
        let shape = self.shape(instance.shape).map_err(|e| e.to_string())?;
        let Instance { pose, velocity, scale, .. } = instance;
        let pose = Pose::new(pose.translation, pose.rotation).map_err(|e| e.to_string())?;
        velocity.validate()?;
        if !(*scale > 0.0 && scale.is_finite()) {
            return Err(format!("scale {scale}; expected a finite number greater than 0"));
        }
        let diagonal = shape.diagonal() * scale;
        if !SIZE.contains(&diagonal) && !matches!(shape, Shape::Plane) {
            return Err(format!("scale {scale} gives it a diagonal of {diagonal:e}; expected 1e-50 to 1e50"));
        }
        let farthest = (FARTHEST * diagonal).min(*SIZE.end());
        if let Some(c) = pose.translation.to_array().into_iter().find(|c| c.abs() > farthest) {
            return Err(format!(
                "translation {c:e} is too far out: 64-bit floats place a body of diagonal {diagonal:e} to a share of its \
                 size only up to {farthest:e}; expected it nearer to the origin"
            ));
        }
        Ok(Instance { pose, ..*instance })
    }
}
