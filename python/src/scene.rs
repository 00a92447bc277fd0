//! `tesdf.Scene`
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tesdf::base::unit::is_same_unit;
use tesdf::collide::{
    self, ClearanceOptions, CollideError, Instance, InstanceId, Pose, Shape, ShapeId, TimeOfImpactOptions,
    clearance, coarse_contacts, detect_until, time_of_impact, why,
};

use crate::arrays;
use crate::contacts::{self, Columns, contacts_of};
use crate::detection::{self, Keywords};
use crate::device::{self, HeldDetector};
use crate::errors::{Error, argument};
use crate::instance_columns::{InstanceColumns, PerInstance};
use crate::interrupt::cancellable;
use crate::pairs::{self, Motions, pairs_of};
use crate::poses::{self, Count};
use crate::whole;
use crate::{classes, pool, shapes};

/// Shapes, and instances of them with poses; detect finds the contacts.
///
/// - A shape is an Asset, Plane, Box, Sphere, Capsule or Cylinder, or a mesh in memory, (vertices,
///   faces) or an object that has both, which is encoded with the preset "fast". All its instances
///   share it.
/// - A pose maps the shape's frame to the world's frame: first rotate, then translate. It has seven
///   numbers, x y z qx qy qz qw: the translation and a unit quaternion, whose real part qw comes
///   last, as in scene files and on the command line. Or it is a matrix [4, 4] that maps columns,
///   with the translation in its last column.
/// - A velocity has six numbers, vx vy vz wx wy wz: that of the origin of the shape, and the
///   angular velocity about this origin in radians. It only matters with speculative_time.
/// - Lengths are in the world's unit, which is that of the shapes times the instances' scale.
/// - Ids of shapes and of instances count from 0 in the order of adding. They are never reused.
///
/// Threads may share a scene. detect works with the state at its call, also when another thread
/// changes the scene meanwhile. Methods that get arrays do all or nothing: after an error the scene
/// is unchanged. Errors are CollideError with the library's text, and ValueError for arrays of the
/// wrong shape.
#[pyclass(frozen, module = "tesdf")]
pub struct Scene {
    /// A computation keeps the scene that it began with. A change then makes a copy, without the
    /// meshes.
    inner: Mutex<Arc<collide::Scene>>,
    on_device: HeldDetector,
}

impl Scene {
    fn locked(&self) -> MutexGuard<'_, Arc<collide::Scene>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The scene as it is now.
    pub fn now(&self) -> Arc<collide::Scene> {
        Arc::clone(&self.locked())
    }

    pub fn change<T>(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut collide::Scene) -> Result<T, CollideError>,
    ) -> PyResult<T> {
        change(Arc::make_mut(&mut self.locked())).map_err(|e| Error::Collide(e).raise(py))
    }

    /// Computes without the interpreter's lock, on all threads.
    fn compute<T: Send>(
        &self,
        py: Python<'_>,
        compute: impl FnOnce(&collide::Scene) -> Result<T, CollideError> + Send,
    ) -> PyResult<T> {
        let (scene, pool) = (self.now(), pool::shared().map_err(|e| e.raise(py))?);
        py.detach(|| pool.install(|| compute(&scene))).map_err(|e| Error::Collide(e).raise(py))
    }
}

#[pymethods]
impl Scene {
    /// An empty scene.
    #[new]
    pub fn new() -> Self {
        Self { inner: Mutex::default(), on_device: HeldDetector::default() }
    }

    /// Adds a shape: an Asset, which the scene shares, a Plane, Box, Sphere, Capsule or Cylinder.
    /// Returns its id.
    fn add_shape(&self, shape: &Bound<'_, PyAny>) -> PyResult<u32> {
        let added = shapes::shape("shape", shape)?;
        self.change(shape.py(), |scene| scene.add_shape(added)).map(|id| id.0)
    }

    /// Removes a shape that no instance uses.
    fn remove_shape(&self, py: Python<'_>, #[pyo3(from_py_with = whole::shape)] shape: u32) -> PyResult<()> {
        self.change(py, |scene| scene.remove_shape(ShapeId(shape)).map(|_| ()))
    }

    /// Adds an instance of the shape with this id. Returns the id of the instance.
    ///
    /// - pose: [7], x y z qx qy qz qw, or [4, 4]; None is the identity.
    /// - velocity: [6], vx vy vz wx wy wz; None is rest.
    /// - scale: world units for each unit of the shape.
    /// - world: instances of different worlds never meet.
    /// - memberships, filter: sets of 32 groups, as bits. Two instances meet when the memberships
    ///   of each share a bit with the filter of the other.
    #[pyo3(signature = (
        shape, pose = None, *, velocity = None, scale = None, world = None, memberships = None, filter = None
    ), text_signature = "($self, shape, pose=None, *, velocity=None, scale=1.0, world=0, memberships=0xFFFFFFFF, filter=0xFFFFFFFF)")]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn add<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = whole::shape)] shape: u32,
        pose: Option<&Bound<'py, PyAny>>,
        velocity: Option<&Bound<'py, PyAny>>,
        scale: Option<&Bound<'py, PyAny>>,
        world: Option<&Bound<'py, PyAny>>,
        memberships: Option<&Bound<'py, PyAny>>,
        filter: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<u32> {
        let pose = pose.map(|any| poses::poses("pose", any, Count::One)).transpose()?;
        let velocity = velocity.map(|any| poses::velocities("velocity", any, Count::One)).transpose()?;
        let given =
            InstanceColumns::new(1, pose, velocity, &PerInstance { scale, world, memberships, filter })?;
        let instance = given.row(0, Instance::new(ShapeId(shape), Pose::IDENTITY));
        self.change(py, |scene| scene.add(instance)).map(|id| id.0)
    }

    /// Adds instances in one call, at the poses [N, 7] or [N, 4, 4]. Returns their ids [N], which
    /// are consecutive.
    ///
    /// shape, scale, world, memberships and filter have one value for all, or one for each, [N].
    /// velocities has the shape [N, 6]. add explains them. An error names the instance by its row.
    #[pyo3(signature = (
        shape, poses, *, velocities = None, scale = None, world = None, memberships = None, filter = None
    ), text_signature = "($self, shape, poses, *, velocities=None, scale=1.0, world=0, memberships=0xFFFFFFFF, filter=0xFFFFFFFF)")]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn add_many<'py>(
        &self,
        py: Python<'py>,
        shape: &Bound<'py, PyAny>,
        poses: &Bound<'py, PyAny>,
        velocities: Option<&Bound<'py, PyAny>>,
        scale: Option<&Bound<'py, PyAny>>,
        world: Option<&Bound<'py, PyAny>>,
        memberships: Option<&Bound<'py, PyAny>>,
        filter: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let poses = poses::poses("poses", poses, Count::Rows)?;
        let rows = poses.len();
        let shape = poses::words("shape", shape, rows)?;
        let velocities =
            velocities.map(|any| poses::velocities("velocities", any, Count::Rows)).transpose()?;
        let given = InstanceColumns::new(
            rows,
            Some(poses),
            velocities,
            &PerInstance { scale, world, memberships, filter },
        )?;
        let instance = |(row, &shape)| given.row(row, Instance::new(ShapeId(shape), Pose::IDENTITY));
        let instances: Vec<Instance> = shape.iter().enumerate().map(instance).collect();
        let ids = self.change(py, |scene| scene.add_many(&instances))?;
        Ok(PyArray1::from_iter(py, ids.start.0..ids.end.0))
    }

    /// Changes the instances with these ids [N]. An argument that is None changes nothing. poses
    /// have the shape [N, 7] or [N, 4, 4], velocities [N, 6]; the others have one value for all, or
    /// one for each. An error names the instance by its id, and a pose by its row.
    #[pyo3(signature = (
        ids, *, poses = None, velocities = None, scale = None, world = None, memberships = None, filter = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn update<'py>(
        &self,
        py: Python<'py>,
        ids: &Bound<'py, PyAny>,
        poses: Option<&Bound<'py, PyAny>>,
        velocities: Option<&Bound<'py, PyAny>>,
        scale: Option<&Bound<'py, PyAny>>,
        world: Option<&Bound<'py, PyAny>>,
        memberships: Option<&Bound<'py, PyAny>>,
        filter: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<()> {
        let ids = arrays::ids("ids", ids)?;
        let poses = poses.map(|any| poses::poses("poses", any, Count::Rows)).transpose()?;
        let velocities =
            velocities.map(|any| poses::velocities("velocities", any, Count::Rows)).transpose()?;
        let given = InstanceColumns::new(
            ids.len(),
            poses,
            velocities,
            &PerInstance { scale, world, memberships, filter },
        )?;
        self.change(py, |scene| {
            let updated = |(row, &id): (usize, &u32)| {
                let id = InstanceId(id);
                Ok((id, given.row(row, *scene.instance(id)?)))
            };
            let updates = ids.iter().enumerate().map(updated).collect::<Result<Vec<_>, CollideError>>()?;
            scene.update(&updates)
        })
    }

    /// Removes the instances with these ids [N], and their exclusions.
    fn remove(&self, py: Python<'_>, ids: &Bound<'_, PyAny>) -> PyResult<()> {
        let ids: Vec<InstanceId> = arrays::ids("ids", ids)?.into_iter().map(InstanceId).collect();
        self.change(py, |scene| scene.remove(&ids))
    }

    /// Excludes pairs of instances [P, 2], so that they never meet.
    fn exclude(&self, py: Python<'_>, pairs: &Bound<'_, PyAny>) -> PyResult<()> {
        let pairs = pairs_of(pairs)?;
        self.change(py, |scene| {
            pairs.iter().flatten().try_for_each(|&id| scene.instance(id).map(|_| ()))?;
            pairs.iter().try_for_each(|&[a, b]| scene.exclude(a, b))
        })
    }

    /// Revokes the exclusion of pairs of instances [P, 2].
    fn include(&self, py: Python<'_>, pairs: &Bound<'_, PyAny>) -> PyResult<()> {
        let pairs = pairs_of(pairs)?;
        self.change(py, |scene| {
            pairs.iter().for_each(|&[a, b]| scene.include(a, b));
            Ok(())
        })
    }

    /// The excluded pairs [P, 2], uint32, sorted, with the lower id first.
    #[getter]
    fn excluded<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let pairs: Vec<u32> = self.now().excluded().flat_map(|(a, b)| [a.0, b.0]).collect();
        let shape = [pairs.len() / 2, 2];
        pairs.into_pyarray(py).reshape(shape)
    }

    /// The shapes by their ids.
    #[getter]
    fn shapes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        for (id, shape) in self.now().shapes() {
            found.set_item(id.0, shapes::object(py, shape)?)?;
        }
        Ok(found)
    }

    /// The states of all instances in the order of their ids: Instances(ids, shape, poses,
    /// velocities, scale, world, memberships, filter), copied.
    #[getter]
    fn instances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let scene = self.now();
        let of = || scene.instances();
        Columns::new(py)
            .add("ids", of().map(|(id, _)| id.0))?
            .add("shape", of().map(|(_, i)| i.shape.0))?
            .add_rows("poses", of().map(|(_, i)| poses::of_pose(&i.pose)))?
            .add_rows("velocities", of().map(|(_, i)| poses::of_velocity(&i.velocity)))?
            .add("scale", of().map(|(_, i)| i.scale))?
            .add("world", of().map(|(_, i)| i.world))?
            .add("memberships", of().map(|(_, i)| i.groups.memberships))?
            .add("filter", of().map(|(_, i)| i.groups.filter))?
            .build("Instances")
    }

    /// All contacts up to the contact distance, as Contacts: arrays with a row for each contact.
    ///
    /// Both orders of each pair of instances are tested: features of *a* against the signed
    /// distance of *b*, and vice versa. The rows are sorted by world, instances, face and cell. The
    /// bytes do not depend on the number of threads. Ctrl-C ends a detection with
    /// KeyboardInterrupt.
    ///
    /// - mode: what is tested of a: "node" (its vertices), "face" (faces, by Frank-Wolfe
    ///   iterations, as in the paper) or "exact" (faces, with the exact minimum).
    /// - contacts_per: in the modes "face" and "exact" only, one contact for each "cell" of b that a
    ///   face meets, as in the paper; or for each "face", with the extremes of flat contact; or of
    ///   these only each local "minimum" over the surface.
    /// - contact_distance: contacts are reported up to this signed distance.
    /// - speculative_time: adds to the contact distance what the velocities close within this time.
    /// - cos_theta: in the modes "face" and "exact" only, drops a contact when the cosine between
    ///   the gradient and the face's normal is above -cos_theta. None keeps all.
    /// - iterations: number of Frank-Wolfe iterations in the mode "face" only; None is 16.
    /// - tolerance: largest error in the modes "face" and "exact" only, in the world's unit. None is 1e-7 of the
    ///   diagonal of b.
    /// - reduce, spread: at most this many contacts for each pair of instances; only one of them.
    ///   reduce finds all contacts and keeps those that matter most for forces and torques. spread
    ///   finds contacts that are spread over the places that touch.
    /// - precision: "f64" or "f32", of distances, normals and points.
    /// - threads: number of threads; None is one per core.
    /// - device: "cpu", "gpu" (what TESDF_DEVICE names, else the best device), or the number of a
    ///   device or a part of its name, such as "cuda:0"; devices lists them. A device computes in
    ///   f32; docs/gpu/design.md says how far its contacts agree with the processor's. It keeps
    ///   the shapes until a detection on another device. Ctrl-C acts after the detection.
    #[pyo3(signature = (*, device = None, **options), text_signature = "($self, *, mode='exact', contacts_per='face', contact_distance=0.0, speculative_time=0.0, cos_theta=None, iterations=None, tolerance=None, reduce=None, spread=None, precision='f64', threads=None, device='cpu')")]
    fn detect<'py>(
        &self,
        py: Python<'py>,
        device: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let Keywords { options, threads } = Keywords::new("detect", options)?;
        let (scene, pool) = (self.now(), pool::of(threads).map_err(|e| e.raise(py))?);
        if let Some(device) = device::chosen(device)? {
            let found = py.detach(|| pool.install(|| self.on_device.detect(&device, &scene, &options)));
            return contacts::contacts(py, &found.map_err(|e| e.raise(py))?);
        }
        let stop = AtomicBool::new(false);
        let work = || pool.install(|| detect_until(&scene, &options, &stop));
        let found = cancellable(py, work, || stop.store(true, Ordering::Relaxed), || Ok(()))?;
        contacts::contacts(py, &found.map_err(|e| Error::Collide(e).raise(py))?)
    }

    /// Contacts that stay on a device, as DeviceContacts, for a physics engine on the same device.
    ///
    /// They are those of detect on this device, rounded to float32, sorted by world and instances;
    /// within a pair, faces have the order of the asset. Normals are gradients of the signed distance,
    /// and contacts are reduced on the device. On a CUDA device other libraries use the
    /// arrays in place, and their poses are used in place. Only counters are copied to the processor,
    /// and contacts only to tell whether they show a deep overlap that was found otherwise. Where the
    /// processor finds contacts of a body (docs/meshes.md), poses and contacts are copied.
    ///
    /// - poses: float32 [N, 7], x y z qx qy qz qw, a row for each instance in the order of ids: a
    ///   DeviceArray, memory of another library on this device (DLPack or __cuda_array_interface__),
    ///   or an array, which is copied to it. Quaternions have length 1, up to 1e-5. None: the poses
    ///   of the scene, which poses do not change.
    /// - velocities: float32 [N, 6], vx vy vz wx wy wz, likewise; only with poses. None: at rest.
    /// - device: as in detect; None is that of poses if these are a DeviceArray, else "gpu".
    /// - The other options are those of detect, with the same defaults. A device cannot leave all
    ///   contacts per face there: give reduce or spread, contacts_per="cell" or mode="node".
    ///   Without, and with contacts_per="minimum", a DeviceError is raised.
    #[pyo3(signature = (*, poses = None, velocities = None, device = None, **options), text_signature = "($self, *, poses=None, velocities=None, device=None, mode='exact', contacts_per='face', contact_distance=0.0, speculative_time=0.0, cos_theta=None, iterations=None, tolerance=None, reduce=None, spread=None, precision='f64', threads=None)")]
    fn detect_on_device<'py>(
        &self,
        py: Python<'py>,
        poses: Option<&Bound<'py, PyAny>>,
        velocities: Option<&Bound<'py, PyAny>>,
        device: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let Keywords { options, .. } = Keywords::new("detect_on_device", options)?;
        let device = match device {
            Some(_) => device::chosen(device)?
                .ok_or_else(|| argument("device", "\"cpu\"", "a device other than the processor"))?,
            None => match poses.and_then(device::of_array) {
                Some(device) => device,
                None => device::open(py, None)?,
            },
        };
        device::detect_on_device(py, &self.on_device, &device, &self.now(), poses, velocities, &options)
    }

    /// Faces that touch and that are large against the other body, one for each ordered pair of
    /// instances: there, the mode "node" can miss where they touch. Returns
    /// CoarseContacts(instance_a, instance_b, face_a, corner_reach, distance). Options are those of
    /// detect; mode, contacts_per, cos_theta and the reductions are not used.
    #[pyo3(signature = (**options), text_signature = "($self, *, mode='exact', contacts_per='face', contact_distance=0.0, speculative_time=0.0, cos_theta=None, iterations=None, tolerance=None, reduce=None, spread=None, precision='f64', threads=None)")]
    fn coarse_contacts<'py>(
        &self,
        py: Python<'py>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let Keywords { options, threads } = Keywords::new("coarse_contacts", options)?;
        let (scene, pool) = (self.now(), pool::of(threads).map_err(|e| e.raise(py))?);
        let found = py.detach(|| pool.install(|| coarse_contacts(&scene, &options)));
        contacts::coarse(py, &found.map_err(|e| Error::Collide(e).raise(py))?)
    }

    /// The vertices, edges or faces at the two points of each contact of a detection:
    /// TouchingFeatures. The scene must have the poses of the detection. Where both orders of two
    /// instances find the same two features, a and b are swapped in the other order.
    ///
    /// A point is at a vertex or an edge when it is nearer than 2e-6 of the diagonal of the larger
    /// body, at most 1e-4 of that of the smaller one. Vertices and faces are numbered as in the mesh;
    /// of a Box, faces are its sides 0 to 5 for -x +x -y +y -z +z, and vertices its nodes; a
    /// Cylinder has the face 0 on its round side, 1 and 2 at its ends at -z and +z; a Plane, Sphere
    /// or Capsule has the face 0.
    ///
    /// contacts: Contacts of Scene.detect, or the contacts of a Simulation with a scene of its
    /// bodies.
    ///
    /// Raises CollideError if the scene lacks an instance or a face of a contact.
    fn touching_features<'py>(
        &self,
        py: Python<'py>,
        contacts: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let found = contacts_of(contacts)?;
        let features = self.compute(py, |scene| {
            found.iter().map(|c| c.touching_features(scene)).collect::<Result<Vec<_>, _>>()
        })?;
        contacts::touching(py, &features)
    }

    /// The signed distance between the surfaces of two instances, whatever their worlds, groups and
    /// exclusions, with witness points: a Clearance.
    ///
    /// tolerance: largest error, in the world's unit. None is 1e-8 of the smaller diagonal.
    #[pyo3(signature = (a, b, *, tolerance = None))]
    fn clearance<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = whole::a)] a: u32,
        #[pyo3(from_py_with = whole::b)] b: u32,
        tolerance: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut options = ClearanceOptions::default();
        options.tolerance = detection::tolerance(tolerance, options.tolerance)?;
        let found = self.compute(py, |scene| clearance(scene, InstanceId(a), InstanceId(b), &options))?;
        classes::report(py, "Clearance", &found)
    }

    /// The clearances of pairs of instances [P, 2], on all threads: Clearances, arrays with a row
    /// for each pair. Otherwise as clearance; an error names the row. Ctrl-C ends it with
    /// KeyboardInterrupt.
    #[pyo3(signature = (pairs, *, tolerance = None))]
    fn clearances<'py>(
        &self,
        py: Python<'py>,
        pairs: &Bound<'py, PyAny>,
        tolerance: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut options = ClearanceOptions::default();
        options.tolerance = detection::tolerance(tolerance, options.tolerance)?;
        pairs::clearances(py, &self.now(), &pairs_of(pairs)?, &options)
    }

    /// The first time at which two moving instances touch: an Impact, or None if they stay apart
    /// until the end. It is never too late: nothing is sampled. An Impact whose verdict is
    /// "undecided" has no time; the bodies are apart up to free_until, and what comes then is not
    /// known.
    ///
    /// - velocity_a, velocity_b: [6], vx vy vz wx wy wz: velocity of the body's origin, and angular
    ///   velocity about it in radians. The velocities of the instances are not used.
    /// - screw_a, screw_b: [8], px py pz ax ay az omega pitch: a point and the direction of the
    ///   axis, the angular speed in radians, and the travel along the axis for each turn. A body
    ///   without velocity and screw rests.
    /// - end: the motion is followed from time 0 to this time.
    /// - tolerance: bodies touch when they are at most this far apart, in the world's unit. None is
    ///   1e-6 of the smaller diagonal.
    /// - iterations: largest number of steps of a pair of parts of the surfaces. If it is used up,
    ///   the verdict is "undecided".
    #[pyo3(signature = (
        a, b, *, velocity_a = None, velocity_b = None, screw_a = None, screw_b = None, end = 1.0, tolerance = None,
        iterations = 1000
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn time_of_impact<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = whole::a)] a: u32,
        #[pyo3(from_py_with = whole::b)] b: u32,
        velocity_a: Option<&Bound<'py, PyAny>>,
        velocity_b: Option<&Bound<'py, PyAny>>,
        screw_a: Option<&Bound<'py, PyAny>>,
        screw_b: Option<&Bound<'py, PyAny>>,
        end: f64,
        tolerance: Option<&Bound<'py, PyAny>>,
        #[pyo3(from_py_with = whole::iterations)] iterations: u32,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let mut options = TimeOfImpactOptions { end, iterations, ..TimeOfImpactOptions::default() };
        options.tolerance = detection::tolerance(tolerance, options.tolerance)?;
        let motions = [poses::motion('a', velocity_a, screw_a)?, poses::motion('b', velocity_b, screw_b)?];
        let found = self.compute(py, |scene| {
            let [motion_a, motion_b] = motions;
            time_of_impact(scene, InstanceId(a), InstanceId(b), motion_a, motion_b, &options)
        })?;
        let clearance = found.clearance();
        let report = |clearance| classes::report(py, "Impact", &classes::Impact::of(&found, clearance));
        clearance.map(report).transpose()
    }

    /// The first impacts of pairs of moving instances [P, 2], on all threads: Impacts, arrays with
    /// a row for each pair, whose time is inf where the bodies stay apart until the end, and NaN
    /// where it is not known.
    ///
    /// velocities_a and velocities_b have the shape [P, 6], screws_a and screws_b [P, 8]; bodies
    /// without either rest. Otherwise as time_of_impact; an error names the row. Ctrl-C ends it
    /// with KeyboardInterrupt.
    #[pyo3(signature = (
        pairs, *, velocities_a = None, velocities_b = None, screws_a = None, screws_b = None, end = 1.0,
        tolerance = None, iterations = 1000
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn times_of_impact<'py>(
        &self,
        py: Python<'py>,
        pairs: &Bound<'py, PyAny>,
        velocities_a: Option<&Bound<'py, PyAny>>,
        velocities_b: Option<&Bound<'py, PyAny>>,
        screws_a: Option<&Bound<'py, PyAny>>,
        screws_b: Option<&Bound<'py, PyAny>>,
        end: f64,
        tolerance: Option<&Bound<'py, PyAny>>,
        #[pyo3(from_py_with = whole::iterations)] iterations: u32,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut options = TimeOfImpactOptions { end, iterations, ..TimeOfImpactOptions::default() };
        options.tolerance = detection::tolerance(tolerance, options.tolerance)?;
        let pairs = pairs_of(pairs)?;
        let motions = |body, velocities, screws| poses::motions(body, velocities, screws, pairs.len());
        let of = [motions('a', velocities_a, screws_a)?, motions('b', velocities_b, screws_b)?];
        pairs::impacts(py, &self.now(), &pairs, &Motions { of }, &options)
    }

    /// Why contacts of two instances exist or not: what each stage of a detection did with the
    /// faces of a (in the mode "node" its vertices) in the field of b. Returns a WhyReport.
    ///
    /// part: the face or vertex of a (as face_a or feature_a of a contact). None reports all
    /// candidates. The options are those of detect; the report is that before a reduction.
    #[pyo3(signature = (a, b, part = None, **options), text_signature = "($self, a, b, part=None, *, mode='exact', contacts_per='face', contact_distance=0.0, speculative_time=0.0, cos_theta=None, iterations=None, tolerance=None, reduce=None, spread=None, precision='f64', threads=None)")]
    fn why<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = whole::a)] a: u32,
        #[pyo3(from_py_with = whole::b)] b: u32,
        #[pyo3(from_py_with = whole::part)] part: Option<u32>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let Keywords { options, .. } = Keywords::new("why", options)?;
        let found = self.compute(py, |scene| why(scene, &options, InstanceId(a), InstanceId(b), part))?;
        crate::why_report::report(py, &found)
    }

    /// Number of instances.
    fn __len__(&self) -> usize {
        self.now().instances().len()
    }

    /// A copy that shares the assets.
    fn __copy__(&self) -> Self {
        Self { inner: Mutex::new(self.now()), on_device: HeldDetector::default() }
    }

    fn __repr__(&self) -> String {
        let scene = self.now();
        format!("<tesdf.Scene: {} instances of {} shapes>", scene.instances().len(), scene.shapes().len())
    }
}

/// A scene of two bodies, as the instances 0 and 1.
///
/// Raises ValueError if they are assets in different units.
#[pyfunction]
#[pyo3(signature = (a, b, pose_a, pose_b))]
pub fn pair(
    py: Python<'_>,
    a: &Bound<'_, PyAny>,
    b: &Bound<'_, PyAny>,
    pose_a: Option<&Bound<'_, PyAny>>,
    pose_b: Option<&Bound<'_, PyAny>>,
) -> PyResult<Scene> {
    let shapes = [shapes::shape("a", a)?, shapes::shape("b", b)?];
    if let [Shape::Mesh(a), Shape::Mesh(b)] = &shapes
        && let (Some(a), Some(b)) = (a.unit(), b.unit())
        && !is_same_unit(a, b)
    {
        return Err(argument("b", format!("an asset in {b}, and a is in {a}"), "assets in one unit"));
    }
    let poses = [("pose_a", pose_a), ("pose_b", pose_b)];
    let scene = Scene::new();
    for (shape, (name, pose)) in shapes.into_iter().zip(poses) {
        let pose = pose.map(|any| poses::poses(name, any, Count::One)).transpose()?;
        let pose = pose.map_or(Pose::IDENTITY, |poses| poses[0]);
        scene.change(py, |scene| {
            let shape = scene.add_shape(shape)?;
            scene.add(Instance::new(shape, pose))
        })?;
    }
    Ok(scene)
}
