//! `tesdf.Simulation`
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::ThreadPool;
use tesdf::Progress;
use tesdf::collide::Velocity;
use tesdf::glam::DVec3;
use tesdf_playback::{LiveView, PlaybackError};
use tesdf_sim::newton::Newton;
use tesdf_sim::scene_file::{AssetCache, DetectorMode, LoadedScene, SceneError};
use tesdf_sim::{
    Drive, Dynamics, DynamicsError, Motor, PartialRun, Run, RunRecord, SimulateError, State, System, Wrench,
};

use crate::contacts::{self, Columns};
use crate::detection::named;
use crate::device::{self, Device};
use crate::errors::{Error, argument, kind_of};
use crate::interrupt::cancellable;
use crate::poses::{Count, of_pose, of_velocity, poses, velocities};
use crate::{classes, forces, pool};

/// A simulation of a scene, as that of the command `tesdf simulate`, with the same bits. step and
/// run advance it.
///
/// - scene: path of a TOML file, or a dict with the keys of such a file. Paths in a dict are
///   relative to the current folder, and arrays may be those of numpy.
/// - mode: replaces the mode of the scene's detector: "node", "face", "exact" or "off".
/// - time_step, duration: replace those of the scene, in seconds.
/// - threads: number of threads; None is one per core. The states do not depend on it.
/// - device: where contacts are found, as in Scene.detect.
///
/// Units are SI: metres, kilograms, seconds, radians. Bodies have the numbers of their order in the
/// scene, from 0. Meshes of the scene are encoded first, which Ctrl-C ends with KeyboardInterrupt.
///
/// Raises OSError if a file cannot be read, and SceneError with the line of the scene.
#[pyclass(frozen, module = "tesdf")]
pub struct Simulation {
    threads: Option<Arc<ThreadPool>>,
    inner: Mutex<Running>,
}

struct Running {
    engine: Newton,
    run: Run,
    /// The page that follows the steps.
    view: Option<LiveView>,
}

/// Where a scene comes from.
enum Source {
    File(PathBuf),
    Json(serde_json::Value),
}

impl Source {
    fn new(any: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(path) = any.extract() {
            return Ok(Self::File(path));
        }
        let expected = "a path, or a dict with the keys of a scene file";
        let Ok(dict) = any.cast::<PyDict>() else {
            return Err(PyTypeError::new_err(format!("scene: {}; expected {expected}", kind_of(any))));
        };
        let text: String = dict.py().import("tesdf.scenes")?.getattr("to_json")?.call1((dict,))?.extract()?;
        let json = serde_json::from_str(&text).map_err(|e| argument("scene", e, "finite numbers"))?;
        Ok(Self::Json(json))
    }

    fn read(self) -> Result<LoadedScene, SceneError> {
        match self {
            Self::File(path) => LoadedScene::read(path),
            Self::Json(json) => LoadedScene::of_json(json, "<scene>"),
        }
    }
}

impl Running {
    /// Reads the scene, encodes its meshes, and begins the run.
    fn begin(mut loaded: LoadedScene, device: Option<Device>, progress: &Progress) -> Result<Self, Error> {
        let scene_error = Error::Scene;
        loaded.assets = AssetCache::of_user();
        let system = loaded.system_watched(progress).map_err(scene_error)?;
        // The run stores the scene's folder, so its meshes are found from any folder.
        loaded.path = std::path::absolute(&loaded.path)
            .map_err(|source| scene_error(SceneError::Read { path: loaded.path.clone(), source }))?;
        let folder = loaded.path.parent().unwrap_or(&loaded.path).to_string_lossy().into_owned();
        let run = PartialRun::new(&loaded.scene, &system, folder);
        let engine = match device {
            Some(device) => loaded.newton_with(system, device.into_detector()),
            None => loaded.newton(system),
        };
        let engine = engine.map_err(scene_error)?;
        let run = Run::new(&loaded.scene, engine.system(), run).map_err(Error::Simulate)?;
        Ok(Self { engine, run, view: None })
    }

    fn states(&self) -> &[State] {
        self.engine.system().states()
    }
}

impl Simulation {
    fn locked(&self) -> MutexGuard<'_, Running> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the state. Waits for a step of another thread without the interpreter's lock.
    fn read<T: Send>(&self, py: Python<'_>, read: impl FnOnce(&Running) -> T + Send) -> T {
        py.detach(|| read(&self.locked()))
    }

    /// The run so far, and its bodies. Waits for a step of another thread, so the caller must not
    /// hold the interpreter's lock.
    pub fn so_far(&self) -> (RunRecord, System) {
        let running = self.locked();
        let system = running.engine.system();
        (running.run.clone().into_record(system), system.clone())
    }

    fn pool(&self, py: Python<'_>) -> PyResult<Arc<ThreadPool>> {
        match &self.threads {
            Some(threads) => Ok(Arc::clone(threads)),
            None => pool::shared().map_err(|e| e.raise(py)),
        }
    }

    /// Changes the engine between two steps.
    fn change(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut Newton) -> Result<(), DynamicsError> + Send,
    ) -> PyResult<()> {
        let changed = py.detach(|| change(&mut self.locked().engine));
        changed.map_err(|e| Error::Dynamics(e).raise(py))
    }

    /// Makes this number of steps, or all that the duration leaves. Ctrl-C ends it between two
    /// steps.
    fn advance(
        &self,
        py: Python<'_>,
        count: Option<u64>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let pool = self.pool(py)?;
        let stop = AtomicBool::new(false);
        let (done, planned) = self.read(py, |r| (r.run.record().steps(), r.run.planned_steps()));
        let done = AtomicU64::new(done);
        let work = || {
            pool.install(|| -> Result<(), SimulateError> {
                let Running { engine, run, view } = &mut *self.locked();
                let count = count.unwrap_or(planned.saturating_sub(run.record().steps()));
                for _ in 0..count {
                    if stop.load(Ordering::Relaxed) {
                        break;
                    }
                    let moment = run.step(engine)?;
                    done.store(moment.step, Ordering::Relaxed);
                    if let Some(live) = view
                        && live.show(&moment).is_err()
                    {
                        // A state that no page can draw ends the page, not the run.
                        *view = None;
                    }
                }
                Ok(())
            })
        };
        let watch = || match progress {
            Some(progress) => progress.call1((done.load(Ordering::Relaxed), planned)).map(|_| ()),
            None => Ok(()),
        };
        let made = cancellable(py, work, || stop.store(true, Ordering::Relaxed), watch)?;
        made.map_err(|e| Error::Simulate(e).raise(py))?;
        watch()
    }
}

/// The number of a body or joint, given by its name or number.
fn index_of(what: &str, any: &Bound<'_, PyAny>, names: &[String]) -> PyResult<usize> {
    let expected = || match names {
        [] => format!("nothing: the scene has no {what}"),
        _ => format!("a number from 0 to {}, or one of {}", names.len() - 1, names.join(", ")),
    };
    let found = match any.extract::<String>() {
        Ok(name) => names.iter().position(|n| *n == name).ok_or(format!("'{name}'")),
        Err(_) => match any.extract::<usize>() {
            Ok(number) => Some(number).filter(|&number| number < names.len()).ok_or(number.to_string()),
            Err(_) => Err(any.repr().map_or_else(|_| kind_of(any), |text| text.to_string())),
        },
    };
    found.map_err(|found| argument(what, found, &expected()))
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scene, *, mode = None, time_step = None, duration = None, threads = None, device = None), text_signature = "(scene, *, mode=None, time_step=None, duration=None, threads=None, device=\"cpu\")")]
    fn new(
        py: Python<'_>,
        scene: &Bound<'_, PyAny>,
        mode: Option<&Bound<'_, PyAny>>,
        time_step: Option<f64>,
        duration: Option<f64>,
        threads: Option<NonZeroUsize>,
        device: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let device = device::chosen(device)?;
        let mode: Option<DetectorMode> = mode.map(|any| named("mode", any)).transpose()?;
        let threads = threads.map(|n| pool::of(Some(n))).transpose().map_err(|e| e.raise(py))?;
        let pool = match &threads {
            Some(threads) => Arc::clone(threads),
            None => pool::shared().map_err(|e| e.raise(py))?,
        };
        let progress = Progress::default();
        let scene = Source::new(scene)?;
        let work = || {
            pool.install(|| {
                let mut loaded = scene.read().map_err(Error::Scene)?;
                let file = &mut loaded.scene;
                file.detector.choose(mode.unwrap_or(file.detector.name()));
                file.time_step = time_step.unwrap_or(file.time_step);
                file.duration = duration.unwrap_or(file.duration);
                file.steps().map_err(|e| Error::Simulate(e.into()))?;
                Running::begin(loaded, device, &progress)
            })
        };
        let running = cancellable(py, work, || progress.cancel(), || Ok(()))?.map_err(|e| e.raise(py))?;
        Ok(Self { threads, inner: Mutex::new(running) })
    }

    /// Makes `count` steps. The duration of the scene does not limit their number. Ctrl-C ends it
    /// between two steps; the steps so far remain.
    ///
    /// Raises SimulationError if a step fails. The steps before it remain.
    #[pyo3(signature = (count = 1))]
    fn step(&self, py: Python<'_>, count: u64) -> PyResult<()> {
        self.advance(py, Some(count), None)
    }

    /// Makes the steps that the duration of the scene leaves. Returns the summary.
    ///
    /// progress is called with the number of steps so far and of all steps, about twenty times a
    /// second. An exception from it ends the run between two steps and is raised.
    #[pyo3(signature = (*, progress = None))]
    fn run<'py>(&self, py: Python<'py>, progress: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        self.advance(py, None, progress)?;
        self.summary(py)
    }

    /// Summary of the steps so far, with the names of `tesdf simulate --json`: a dict with
    /// contacts, energies, momenta and the report of each criterion of the scene. passed says
    /// whether the criteria hold; None if there are none.
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let summary = self.read(py, |r| r.run.summary(r.engine.system()));
        classes::dict(py, &summary)
    }

    /// What the steps so far did not do as the scene asks, in lines for users: bodies that overlap,
    /// joints that came apart, energy from nowhere, steps that did not converge.
    /// summary()["warnings"] has them with names and values.
    #[getter]
    fn warnings(&self, py: Python<'_>) -> Vec<String> {
        let summary = self.read(py, |r| r.run.summary(r.engine.system()));
        summary.warnings.into_iter().map(|warning| warning.message).collect()
    }

    /// Writes the run file of the steps so far, with the bytes of that of the command.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let saved = self.read(py, |r| r.run.clone().into_record(r.engine.system()).save(&path));
        saved.map_err(|e| Error::Record(path, e).raise(py))
    }

    /// All states so far, recorded contacts, forces and warnings: Record(times, poses, velocities, ...),
    /// copied.
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let record = self.read(py, |r| r.run.clone().into_record(r.engine.system()));
        let (steps, bodies) = (record.times().len(), record.bodies.len());
        let each = || (0..steps).flat_map(|step| (0..bodies).map(move |body| (step, body)));
        let poses = each().filter_map(|(step, body)| record.pose(step, body)).flat_map(|p| of_pose(&p));
        let velocities = each()
            .filter_map(|(step, body)| record.velocity(step, body))
            .flat_map(|[linear, angular]| of_velocity(&Velocity { linear, angular }));
        let shaped =
            |numbers: Vec<f64>, width: usize| PyArray1::from_vec(py, numbers).reshape([steps, bodies, width]);
        let contacts: Vec<_> = record.contacts().collect();
        let all = || contacts.iter().flat_map(|(_, of_step)| of_step);
        let of_row = contacts.iter().flat_map(|(step, of_step)| of_step.iter().map(move |_| *step));
        let forces: Vec<_> = record.forces().collect();
        let of_force = forces.iter().flat_map(|(step, f)| f.contacts.iter().map(move |_| *step));
        let pushing: Vec<_> = forces.iter().flat_map(|(_, f)| f.contacts.iter().copied()).collect();
        let joints: Vec<_> = forces.iter().flat_map(|(_, f)| f.joints.iter().copied()).collect();
        Columns::new(py)
            .add("times", record.times().iter().copied())?
            .with("poses", shaped(poses.collect(), 7)?.into_any())?
            .with("velocities", shaped(velocities.collect(), 6)?.into_any())?
            .add("contact_steps", contacts.iter().map(|(step, _)| *step))?
            .add("steps", of_row)?
            .add_rows("points", all().map(|c| c.point))?
            .add_rows("normals", all().map(|c| c.normal))?
            .add("distances", all().map(|c| c.distance))?
            .add_rows("bodies", all().map(|c| c.bodies))?
            .add_rows("faces", all().map(|c| c.faces))?
            .add("force_steps", forces.iter().map(|(step, _)| *step))?
            .add("contact_force_steps", of_force)?
            .with("contact_forces", forces::of_contacts(py, &pushing)?)?
            .with("joint_forces", forces::of_joints(py, &joints)?)?
            .with("warnings", classes::dict(py, &record.warnings())?)?
            .build("Record")
    }

    /// Serves a page on this machine that follows the steps from now on, until the simulation is
    /// deleted: LiveView, whose open() shows it in a browser, and which a notebook shows. title is its
    /// heading.
    ///
    /// Raises SimulationError where the machine has no loopback interface.
    #[pyo3(signature = (*, title = "simulation"))]
    fn view<'py>(&self, py: Python<'py>, title: &str) -> PyResult<Bound<'py, PyAny>> {
        let url = py.detach(|| -> Result<String, PlaybackError> {
            let Running { engine, view, .. } = &mut *self.locked();
            if view.is_none() {
                *view = Some(LiveView::open(engine.system(), title)?);
            }
            Ok(view.as_ref().map(LiveView::url).unwrap_or_default())
        });
        let url = url.map_err(|e| Error::Playback(e).raise(py))?;
        py.import("tesdf.playback")?.getattr("LiveView")?.call1((url,))
    }

    /// Names of the bodies.
    #[getter]
    fn bodies(&self, py: Python<'_>) -> Vec<String> {
        self.read(py, |r| r.run.record().bodies.clone())
    }

    /// Simulated time, s.
    #[getter]
    fn time(&self, py: Python<'_>) -> f64 {
        self.read(py, |r| r.run.record().times().last().copied().unwrap_or(0.0))
    }

    /// Number of steps so far.
    #[getter]
    fn steps(&self, py: Python<'_>) -> u64 {
        self.read(py, |r| r.run.record().steps())
    }

    /// Number of steps of the scene's duration.
    #[getter]
    fn planned_steps(&self, py: Python<'_>) -> u64 {
        self.read(py, |r| r.run.planned_steps())
    }

    /// Names of the joints.
    #[getter]
    fn joints(&self, py: Python<'_>) -> Vec<String> {
        self.read(py, |r| r.engine.system().joints().iter().map(|joint| joint.name.clone()).collect())
    }

    /// Current coordinates [J] of the joints: the angle of a hinge, rad, with the whole turns since
    /// the start, the travel of a slider, m, the angle by which a ball is bent, rad; 0 for a weld.
    #[getter]
    fn coordinates<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.read(py, |r| r.engine.system().coordinates().to_vec()))
    }

    /// Current rates [J] of the coordinates, rad/s or m/s; 0 for a ball and a weld.
    #[getter]
    fn coordinate_rates<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.read(py, |r| r.engine.system().coordinate_rates()))
    }

    /// The forces of the contacts that push, each the mean over the last step: ContactForces.
    #[getter]
    fn contact_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let forces = self.read(py, |r| r.engine.forces().map(|forces| forces.contacts.clone()));
        forces::of_contacts(py, &forces.unwrap_or_default())
    }

    /// What each joint did to its child, as the mean over the last step: JointForces.
    #[getter]
    fn joint_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let forces = self.read(py, |r| r.engine.forces().map(|forces| forces.joints.clone()));
        forces::of_joints(py, &forces.unwrap_or_default())
    }

    /// Sets the motor of a joint, given by its name or number, from the next step on. It drives one
    /// of
    ///
    /// - velocity: a rate, rad/s or m/s.
    /// - position: the coordinate at the end of the step, rad or m.
    /// - force: a torque, N m, or force, N.
    /// - spring: (rest, stiffness, damping), in rad, N m/rad, N m s/rad or m, N/m, N s/m. With it,
    ///   velocity is the rate that its damper aims at, and force acts in addition (feed-forward).
    ///
    /// limit is the greatest force, N, or torque, N m. Without a drive the joint has no motor. A
    /// script of the scene that drives the same joint replaces the motor in each step.
    ///
    /// Raises SimulationError if the joint is no hinge or slider, or if a number is out of range.
    #[pyo3(signature = (joint, *, velocity = None, position = None, force = None, spring = None, limit = f64::INFINITY))]
    #[allow(clippy::too_many_arguments, reason = "they are keywords")]
    fn set_motor(
        &self,
        py: Python<'_>,
        joint: &Bound<'_, PyAny>,
        velocity: Option<f64>,
        position: Option<f64>,
        force: Option<f64>,
        spring: Option<[f64; 3]>,
        limit: f64,
    ) -> PyResult<()> {
        let drive = match (velocity, position, force, spring) {
            (None, None, None, None) => None,
            (Some(velocity), None, None, None) => Some(Drive::Velocity(velocity)),
            (None, Some(position), None, None) => Some(Drive::Position(position)),
            (None, None, Some(force), None) => Some(Drive::Force(force)),
            (velocity, None, force, Some([rest, stiffness, damping])) => {
                let [velocity, force] = [velocity, force].map(Option::unwrap_or_default);
                Some(Drive::Spring { rest, stiffness, damping, velocity, force })
            }
            _ => {
                let expected =
                    "one of velocity, position, force and spring, or spring with velocity and force";
                return Err(argument("joint", "several drives", expected));
            }
        };
        let motor = drive.map(|drive| Motor { drive, limit });
        let joint = index_of("joint", joint, &self.joints(py))?;
        self.change(py, |engine| engine.set_motor(joint, motor))
    }

    /// Sets the force [3], N, on the centre of mass and the torque [3], N m, that act on a body
    /// from the next step on, in the world frame. The body is given by its name or number. They
    /// have no effect on fixed and kinematic bodies. A script of the scene for the same body
    /// replaces them in each step.
    #[pyo3(signature = (body, *, force = [0.0; 3], torque = [0.0; 3]))]
    fn set_wrench(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        force: [f64; 3],
        torque: [f64; 3],
    ) -> PyResult<()> {
        let [force, torque] = [force, torque].map(DVec3::from_array);
        let body = index_of("body", body, &self.bodies(py))?;
        self.change(py, |engine| engine.set_wrench(body, Wrench { force, torque }))
    }

    /// Sets the pose [7], x y z qx qy qz qw, or [4, 4], and the velocity [6], vx vy vz wx wy wz, of
    /// a body, given by its name or number. What is None stays. For a kinematic body this is its
    /// motion in the next steps.
    #[pyo3(signature = (body, *, pose = None, velocity = None))]
    fn set_state(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        pose: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let pose = pose.map(|any| poses("pose", any, Count::One)).transpose()?;
        let velocity = velocity.map(|any| velocities("velocity", any, Count::One)).transpose()?;
        let body = index_of("body", body, &self.bodies(py))?;
        self.change(py, |engine| {
            let mut state = engine.system().states()[body];
            if let Some(&pose) = pose.iter().flatten().next() {
                state.pose = pose;
            }
            if let Some(&Velocity { linear, angular }) = velocity.iter().flatten().next() {
                (state.linear, state.angular) = (linear, angular);
            }
            engine.set_state(body, state)
        })
    }

    /// Current poses [B, 7] of the bodies' frames, x y z qx qy qz qw.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let poses: Vec<_> = self.read(py, |r| r.states().iter().map(|state| of_pose(&state.pose)).collect());
        PyArray1::from_slice(py, poses.as_flattened()).reshape([poses.len(), 7])
    }

    /// Current velocities [B, 6], vx vy vz wx wy wz: of the centre of mass, and angular.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let velocity = |&State { linear, angular, .. }: &State| of_velocity(&Velocity { linear, angular });
        let velocities: Vec<_> = self.read(py, |r| r.states().iter().map(velocity).collect());
        PyArray1::from_slice(py, velocities.as_flattened()).reshape([velocities.len(), 6])
    }

    /// The contacts at the beginning of the last step: StepContacts. They include contacts that the
    /// motion of the step could close. Instances are the bodies.
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (found, hidden) = self.read(py, |r| (r.engine.contacts().to_vec(), r.engine.hidden().to_vec()));
        contacts::of_step(py, &found, &hidden)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (bodies, steps, planned) =
            self.read(py, |r| (r.states().len(), r.run.record().steps(), r.run.planned_steps()));
        format!("<tesdf.Simulation: {bodies} bodies, step {steps} of {planned}>")
    }
}
