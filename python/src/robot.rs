//! `tesdf.Robot`
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{PoisonError, RwLock};

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tesdf::Progress;
use tesdf::collide::Pose;
use tesdf::glam::DVec3;
use tesdf::mesh::RepairMode;
use tesdf_sim::planning::{
    MotionCheck, MotionOptions, MotionVerdict, PlanningError, Robot as Model, RobotClearance, RobotOptions,
};
use tesdf_sim::scene_file::AssetCache;

use crate::contacts::Columns;
use crate::errors::{Error, argument};
use crate::interrupt::cancellable;
use crate::poses::{Count, of_pose, poses};
use crate::settings::shaped;
use crate::whole;
use crate::{arrays, pool, shapes};

/// Rows between two looks at Ctrl-C.
const TOGETHER: usize = 512;
/// The number of a body that there is not.
const NO_BODY: u32 = u32::MAX;

/// A robot among obstacles, for planners: clearances with derivatives, and motions that are checked
/// as a whole.
///
/// - file: path of a URDF or MJCF file. Its meshes are encoded once and kept, as those of scenes.
/// - pose: [7], x y z qx qy qz qw, or [4, 4], of the robot's frame. None: the world's.
/// - packages: folders of the packages of a URDF file, by name.
/// - repair: "auto" repairs meshes first where they need it; "never" does not.
/// - ignore: elements of the file that are left out, such as "mimic" or "equality". Those that change
///   shapes or joints in a way that is not read are an error otherwise.
///
/// A configuration q [dof] has a number for each of `joints`, which turn or slide and follow no other
/// joint: rad or m, also beyond `limits`. Boxes, spheres, capsules and cylinders of links are
/// exact.
///
/// Looked at are all pairs of a link and an obstacle and of two links, but those that never move
/// against each other, those that a joint connects, those that the file keeps apart, and those that
/// set_allowed allows: `checked_pairs`. Lengths are metres.
///
/// Raises SceneError with the place in the file.
#[pyclass(frozen, module = "tesdf")]
pub struct Robot {
    model: RwLock<Model>,
}

/// Configurations, row by row.
struct Rows<'py> {
    array: PyReadonlyArrayDyn<'py, f64>,
    dof: usize,
}

impl<'py> Rows<'py> {
    fn new(name: &str, any: &Bound<'py, PyAny>, dof: usize) -> PyResult<Self> {
        let array: Bound<'py, PyArrayDyn<f64>> = arrays::floats(name, any)?.cast_into()?;
        match *array.shape() {
            [_, width] if width == dof => Ok(Self { array: array.readonly(), dof }),
            _ => {
                let found = format!("an array of shape {}", array.getattr("shape")?);
                Err(argument(name, found, &format!("shape (N, {dof}), a number for each joint")))
            }
        }
    }

    fn rows(&self) -> PyResult<Vec<&[f64]>> {
        let numbers = self.array.as_slice()?;
        let rows = self.array.shape()[0];
        Ok((0..rows).map(|k| &numbers[k * self.dof..(k + 1) * self.dof]).collect())
    }
}

impl Robot {
    fn read<T>(&self, read: impl FnOnce(&Model) -> T) -> T {
        read(&self.model.read().unwrap_or_else(PoisonError::into_inner))
    }

    fn change(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut Model) -> Result<(), PlanningError> + Send,
    ) -> PyResult<()> {
        let changed = py.detach(|| change(&mut self.model.write().unwrap_or_else(PoisonError::into_inner)));
        changed.map_err(|e| Error::Planning(e).raise(py))
    }

    /// Answers one question. The interpreter's lock is released meanwhile.
    fn one<T: Send>(
        &self,
        py: Python<'_>,
        answer: impl FnOnce(&Model) -> Result<T, PlanningError> + Send,
    ) -> PyResult<T> {
        let pool = pool::shared().map_err(|e| e.raise(py))?;
        py.detach(|| pool.install(|| self.read(answer))).map_err(|e| Error::Planning(e).raise(py))
    }

    /// Answers a question for each row on all threads. Ctrl-C ends it.
    fn all<R: Sync, T: Send>(
        &self,
        py: Python<'_>,
        rows: &[R],
        threads: Option<NonZeroUsize>,
        answer: impl Fn(&Model, &[R]) -> Result<Vec<T>, PlanningError> + Sync,
    ) -> PyResult<Vec<T>> {
        let pool = pool::of(threads).map_err(|e| e.raise(py))?;
        let stop = AtomicBool::new(false);
        let work = || {
            self.read(|model| {
                let mut found = Vec::with_capacity(rows.len());
                for (k, rows) in rows.chunks(TOGETHER).enumerate() {
                    if stop.load(Ordering::Relaxed) {
                        return Err((k, PlanningError::Cancelled));
                    }
                    found.extend(pool.install(|| answer(model, rows)).map_err(|e| (k, e))?);
                }
                Ok(found)
            })
        };
        let found = cancellable(py, work, || stop.store(true, Ordering::Relaxed), || Ok(()))?;
        found.map_err(|(k, e)| Error::Planning(e.after_rows(k * TOGETHER)).raise(py))
    }

    fn dof(&self) -> usize {
        self.read(Model::dof)
    }

    fn names(&self) -> Vec<String> {
        self.read(|model| model.bodies().into_iter().map(str::to_owned).collect())
    }
}

fn motion_options(margin: f64, tolerance: f64, steps: u32) -> MotionOptions {
    MotionOptions { margin, tolerance, steps }
}

/// The numbers of a configuration.
fn numbers(name: &str, any: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array: Bound<'_, PyArrayDyn<f64>> = arrays::floats(name, any)?.cast_into()?;
    match array.shape() {
        [_] => Ok(array.readonly().as_slice()?.to_vec()),
        _ => {
            let found = format!("an array of shape {}", array.getattr("shape")?);
            Err(argument(name, found, "one configuration, a number for each joint"))
        }
    }
}

/// An object of a class of `tesdf.planning`.
fn built<'py>(py: Python<'py>, class: &str, fields: &Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
    py.import("tesdf.planning")?.getattr(class)?.call((), Some(fields))
}

#[pymethods]
impl Robot {
    #[new]
    #[pyo3(signature = (file, *, pose = None, packages = None, repair = "never", ignore = None))]
    fn new(
        py: Python<'_>,
        file: PathBuf,
        pose: Option<&Bound<'_, PyAny>>,
        packages: Option<BTreeMap<String, PathBuf>>,
        repair: &str,
        ignore: Option<Vec<String>>,
    ) -> PyResult<Self> {
        let pose = pose.map(|any| poses("pose", any, Count::One)).transpose()?;
        let repair: RepairMode =
            repair.parse().map_err(|_| argument("repair", format!("'{repair}'"), "\"auto\" or \"never\""))?;
        let options = RobotOptions {
            pose: pose.and_then(|rows| rows.first().copied()).unwrap_or(Pose::IDENTITY),
            packages: packages.unwrap_or_default().into_iter().collect(),
            repair,
            ignore: ignore.unwrap_or_default(),
            assets: AssetCache::of_user(),
        };
        let pool = pool::shared().map_err(|e| e.raise(py))?;
        let progress = Progress::default();
        let work = || pool.install(|| Model::load(&file, &options, &progress));
        let model = cancellable(py, work, || progress.cancel(), || Ok(()))?;
        Ok(Self { model: RwLock::new(model.map_err(|e| Error::Planning(e).raise(py))?) })
    }

    /// Adds an obstacle.
    ///
    /// - name: that no other body has.
    /// - shape: an Asset, Plane, Box, Sphere or Capsule, or a mesh, which is encoded once.
    /// - pose: [7] or [4, 4]; None is that of the world.
    /// - scale: metres for each unit of the shape.
    #[pyo3(signature = (name, shape, pose = None, *, scale = 1.0))]
    fn add_obstacle(
        &self,
        py: Python<'_>,
        name: &str,
        shape: &Bound<'_, PyAny>,
        pose: Option<&Bound<'_, PyAny>>,
        scale: f64,
    ) -> PyResult<()> {
        let shape = shapes::shape("shape", shape)?;
        let pose = pose.map(|any| poses("pose", any, Count::One)).transpose()?;
        let pose = pose.and_then(|rows| rows.first().copied()).unwrap_or(Pose::IDENTITY);
        self.change(py, |model| model.add_obstacle(name, shape, pose, scale))
    }

    /// Sets the pose of an obstacle: [7], x y z qx qy qz qw, or [4, 4].
    fn move_obstacle(&self, py: Python<'_>, name: &str, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        let pose = poses("pose", pose, Count::One)?.first().copied().unwrap_or(Pose::IDENTITY);
        self.change(py, |model| model.move_obstacle(name, pose))
    }

    /// Removes an obstacle.
    fn remove_obstacle(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.change(py, |model| model.remove_obstacle(name))
    }

    /// Sets whether two bodies may collide, by their names: links or a link and an obstacle. Nothing is
    /// looked at between those that may.
    ///
    /// Raises CollideError for a name that no body has.
    #[pyo3(signature = (a, b, allowed = true))]
    fn set_allowed(&self, py: Python<'_>, a: &str, b: &str, allowed: bool) -> PyResult<()> {
        self.change(py, |model| model.set_allowed(a, b, allowed))
    }

    /// The clearance at a configuration q [dof]: RobotClearance, with the pair that is nearest, its
    /// witness points and the gradient by q.
    ///
    /// tolerance bounds the error, m.
    #[pyo3(signature = (q, *, tolerance = 1e-6))]
    fn clearance<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        tolerance: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let q = numbers("q", q)?;
        let (found, names) = self.one(py, |model| {
            let names: Vec<String> = model.bodies().into_iter().map(str::to_owned).collect();
            Ok((model.clearance(&q, tolerance)?, names))
        })?;
        let fields = PyDict::new(py);
        let nearest = found.nearest.as_ref();
        fields.set_item("distance", found.distance)?;
        fields.set_item("lower_bound", found.lower_bound)?;
        fields.set_item("converged", found.converged)?;
        for (k, [body, point]) in [["body_a", "point_a"], ["body_b", "point_b"]].into_iter().enumerate() {
            fields.set_item(body, nearest.map(|n| &names[n.bodies[k]]))?;
            fields.set_item(
                point,
                nearest.map(|n| n.points[k].to_array()).map(|p| PyArray1::from_slice(py, &p)),
            )?;
        }
        fields.set_item("normal", nearest.map(|n| PyArray1::from_slice(py, &n.normal.to_array())))?;
        fields.set_item("gradient", nearest.map(|n| PyArray1::from_slice(py, &n.gradient)))?;
        built(py, "RobotClearance", &fields)
    }

    /// The clearances at many configurations q [N, dof], on all threads: RobotClearances. The result
    /// does not depend on threads; None is one per core.
    #[pyo3(signature = (q, *, tolerance = 1e-6, threads = None))]
    fn clearances<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        tolerance: f64,
        #[pyo3(from_py_with = whole::threads)] threads: Option<NonZeroUsize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (dof, q) = (self.dof(), Rows::new("q", q, self.dof())?);
        let rows = q.rows()?;
        let found = self.all(py, &rows, threads, |model, rows| model.clearances(rows, tolerance))?;
        let body =
            |k: usize| move |c: &RobotClearance| c.nearest.as_ref().map_or(NO_BODY, |n| n.bodies[k] as u32);
        let point = |k: usize| {
            move |c: &RobotClearance| c.nearest.as_ref().map_or(DVec3::NAN, |n| n.points[k]).to_array()
        };
        let normal = |c: &RobotClearance| c.nearest.as_ref().map_or(DVec3::NAN, |n| n.normal).to_array();
        let gradient = found.iter().flat_map(|c| match &c.nearest {
            Some(nearest) => nearest.gradient.clone(),
            None => vec![f64::NAN; dof],
        });
        let columns = Columns::new(py)
            .add("distance", found.iter().map(|c| c.distance))?
            .add("lower_bound", found.iter().map(|c| c.lower_bound))?
            .add("body_a", found.iter().map(body(0)))?
            .add("body_b", found.iter().map(body(1)))?
            .add_rows("point_a", found.iter().map(point(0)))?
            .add_rows("point_b", found.iter().map(point(1)))?
            .add_rows("normal", found.iter().map(normal))?
            .with("gradient", shaped(py, gradient, [found.len(), dof])?)?
            .add("converged", found.iter().map(|c| c.converged))?;
        columns.build_of("tesdf.planning", "RobotClearances")
    }

    /// Whether the clearance at a configuration q [dof] is below a bound, m. False is certain. True
    /// says that it is below bound + tolerance. Takes less time than the clearance.
    #[pyo3(signature = (q, bound, *, tolerance = 1e-6))]
    fn is_clearance_below(
        &self,
        py: Python<'_>,
        q: &Bound<'_, PyAny>,
        bound: f64,
        tolerance: f64,
    ) -> PyResult<bool> {
        let q = numbers("q", q)?;
        self.one(py, |model| model.is_clearance_below(&q, bound, tolerance))
    }

    /// As is_clearance_below, at many configurations q [N, dof], on all threads: bool [N].
    #[pyo3(signature = (q, bound, *, tolerance = 1e-6, threads = None))]
    fn are_clearances_below<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        bound: f64,
        tolerance: f64,
        #[pyo3(from_py_with = whole::threads)] threads: Option<NonZeroUsize>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let q = Rows::new("q", q, self.dof())?;
        let rows = q.rows()?;
        let found =
            self.all(py, &rows, threads, |model, rows| model.are_clearances_below(rows, bound, tolerance))?;
        Ok(PyArray1::from_vec(py, found))
    }

    /// Whether bodies collide at a configuration q [dof]: whether the clearance is below 0, up to the
    /// tolerance, m. False is certain.
    #[pyo3(signature = (q, *, tolerance = 1e-6))]
    fn in_collision(&self, py: Python<'_>, q: &Bound<'_, PyAny>, tolerance: f64) -> PyResult<bool> {
        self.is_clearance_below(py, q, 0.0, tolerance)
    }

    /// As in_collision, at many configurations q [N, dof], on all threads: bool [N].
    #[pyo3(signature = (q, *, tolerance = 1e-6, threads = None))]
    fn are_in_collision<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        tolerance: f64,
        #[pyo3(from_py_with = whole::threads)] threads: Option<NonZeroUsize>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        self.are_clearances_below(py, q, 0.0, tolerance, threads)
    }

    /// Checks the straight line between the configurations q0 [dof] and q1 [dof] as a whole:
    /// MotionCheck, whose verdict is "free", "collision" or "undecided". The first two are certain:
    /// nothing between samples is missed. Coordinates are not wrapped.
    ///
    /// - margin: the clearance to keep, m.
    /// - tolerance: the motion is undecided only where its clearance is above the margin by less than
    ///   twice this, m, or after `steps`.
    /// - steps: most intervals of pairs of bodies that are looked at.
    #[pyo3(signature = (q0, q1, *, margin = 0.0, tolerance = 1e-4, steps = 100_000))]
    fn check_motion<'py>(
        &self,
        py: Python<'py>,
        q0: &Bound<'py, PyAny>,
        q1: &Bound<'py, PyAny>,
        margin: f64,
        tolerance: f64,
        #[pyo3(from_py_with = whole::steps)] steps: u32,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (from, to) = (numbers("q0", q0)?, numbers("q1", q1)?);
        let options = motion_options(margin, tolerance, steps);
        let MotionCheck { verdict, at, steps } =
            self.one(py, |model| model.check_motion(&from, &to, &options))?;
        let names = self.names();
        let fields = PyDict::new(py);
        let verdict = match verdict {
            MotionVerdict::Free => "free",
            MotionVerdict::Collision => "collision",
            MotionVerdict::Undecided => "undecided",
        };
        fields.set_item("verdict", verdict)?;
        fields.set_item("parameter", at.map(|at| at.parameter))?;
        fields.set_item("body_a", at.map(|at| &names[at.bodies[0]]))?;
        fields.set_item("body_b", at.map(|at| &names[at.bodies[1]]))?;
        fields.set_item("distance", at.map(|at| at.distance))?;
        fields.set_item("steps", steps)?;
        built(py, "MotionCheck", &fields)
    }

    /// Checks the motions from the rows of q0 [N, dof] to those of q1 [N, dof], as check_motion, on all
    /// threads: MotionChecks.
    #[pyo3(signature = (q0, q1, *, margin = 0.0, tolerance = 1e-4, steps = 100_000, threads = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn check_motions<'py>(
        &self,
        py: Python<'py>,
        q0: &Bound<'py, PyAny>,
        q1: &Bound<'py, PyAny>,
        margin: f64,
        tolerance: f64,
        #[pyo3(from_py_with = whole::steps)] steps: u32,
        #[pyo3(from_py_with = whole::threads)] threads: Option<NonZeroUsize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (from, to) = (Rows::new("q0", q0, self.dof())?, Rows::new("q1", q1, self.dof())?);
        let (from, to) = (from.rows()?, to.rows()?);
        if from.len() != to.len() {
            return Err(argument("q1", format!("{} rows", to.len()), &format!("{}, as q0", from.len())));
        }
        let options = motion_options(margin, tolerance, steps);
        let motions: Vec<[&[f64]; 2]> = from.into_iter().zip(to).map(|(a, b)| [a, b]).collect();
        let found = self.all(py, &motions, threads, |model, rows| model.check_motions(rows, &options))?;
        let is = |verdict: MotionVerdict| move |check: &MotionCheck| check.verdict == verdict;
        let body = |k: usize| move |check: &MotionCheck| check.at.map_or(NO_BODY, |at| at.bodies[k] as u32);
        let columns = Columns::new(py)
            .add("free", found.iter().map(is(MotionVerdict::Free)))?
            .add("collides", found.iter().map(is(MotionVerdict::Collision)))?
            .add("parameter", found.iter().map(|check| check.at.map_or(f64::NAN, |at| at.parameter)))?
            .add("body_a", found.iter().map(body(0)))?
            .add("body_b", found.iter().map(body(1)))?
            .add("distance", found.iter().map(|check| check.at.map_or(f64::NAN, |at| at.distance)))?
            .add("steps", found.iter().map(|check| check.steps))?;
        columns.build_of("tesdf.planning", "MotionChecks")
    }

    /// The poses [L, 7] of the links at a configuration q [dof], x y z qx qy qz qw, in the world. Links
    /// are the first of `bodies`.
    fn poses<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let q = numbers("q", q)?;
        let poses = self.one(py, |model| model.poses(&q))?;
        let rows = poses.len();
        shaped(py, poses.iter().flat_map(of_pose), [rows, 7])
    }

    /// Names of the joints of a configuration, in its order.
    #[getter]
    fn joints(&self) -> Vec<String> {
        self.read(|model| model.joints().into_iter().map(str::to_owned).collect())
    }

    /// Limits [dof, 2] of the joints, rad or m; infinite where the file has none.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let limits = self.read(|model| model.limits().to_vec());
        let rows = limits.len();
        shaped(py, limits.into_flattened(), [rows, 2])
    }

    /// Names of the bodies: the links of the robot in the order of the file, then the obstacles.
    #[getter]
    fn bodies(&self) -> Vec<String> {
        self.names()
    }

    /// The pairs of bodies that are looked at, by their names.
    #[getter]
    fn checked_pairs(&self) -> Vec<(String, String)> {
        let names = self.names();
        let pairs = self.read(Model::checked_pairs);
        pairs.into_iter().map(|[a, b]| (names[a].clone(), names[b].clone())).collect()
    }

    fn __repr__(&self) -> String {
        let (links, obstacles, dof) =
            self.read(|model| (model.link_count(), model.bodies().len() - model.link_count(), model.dof()));
        format!("<tesdf.Robot: {dof} joints, {links} links, {obstacles} obstacles>")
    }
}
