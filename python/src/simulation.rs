//! `tesdf.Simulation`
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use numpy::PyArray1;
use pyo3::prelude::*;
use rayon::ThreadPool;
use tesdf::Progress;
use tesdf::collide::Velocity;
use tesdf::glam::DVec3;
use tesdf_playback::{LiveFrame, LiveView, PlaybackError};
use tesdf_sim::newton::Newton;
use tesdf_sim::scene_file::SceneFile;
use tesdf_sim::{Dynamics, PartialRun, Run, RunRecord, State, System, World, WorldSnapshot, Wrench};

use crate::contacts::{self, Columns};
use crate::detection::named;
use crate::device;
use crate::errors::{Error, argument};
use crate::interrupt::{POLL, cancellable};
use crate::opening::{Opened, Replaced, Source};
use crate::poses::{Count, of_pose, of_velocity, poses, velocities};
use crate::settings::{self, index_of, rows_of, shaped};
use crate::whole;
use crate::{classes, forces, pool};

/// A simulation of a scene, as that of the command `tesdf simulate`, with the same bits. step and
/// run advance it.
///
/// - scene: path of a TOML file, or a dict with the keys of such a file. Paths in a dict are
///   relative to the current folder, and arrays may be those of numpy.
/// - mode: replaces the mode of the scene's detector: "node", "face", "exact" or "off".
/// - time_step, duration: replace those of the scene, in seconds.
/// - threads: number of threads; None is one per core. The states do not depend on it.
/// - device: where contacts are found, as in Scene.detect; through CUDA also solved.
/// - history: whether states and the summary are kept, which takes memory in each step.
///   Control loops that neither save nor view their steps go without.
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
    world: World,
    /// With a history.
    run: Option<Run>,
    scene: Arc<SceneOfRun>,
    /// The page that follows the steps.
    view: Option<LiveView>,
}

/// What a run begins with.
struct SceneOfRun {
    scene: SceneFile,
    folder: String,
    planned: u64,
}

impl SceneOfRun {
    /// A run that begins with the states of `system`.
    fn run(&self, system: &System) -> Result<Run, Error> {
        let run = PartialRun::new(&self.scene, system, self.folder.clone());
        Run::new(&self.scene, system, run).map_err(Error::Simulate)
    }
}

impl Running {
    fn begin(opened: Opened, history: bool) -> Result<Self, Error> {
        let Opened { scene, folder, engine } = opened;
        let planned = scene.steps().map_err(|e| Error::Simulate(e.into()))?;
        let scene = Arc::new(SceneOfRun { scene, folder, planned });
        let run = history.then(|| scene.run(engine.system())).transpose()?;
        let world = World::new(&scene.scene, engine).map_err(Error::Simulate)?;
        Ok(Self { world, run, scene, view: None })
    }

    fn system(&self) -> &System {
        self.world.engine().system()
    }

    fn states(&self) -> &[State] {
        self.system().states()
    }

    fn step(&mut self) -> Result<(), Error> {
        match &mut self.run {
            Some(run) => self.world.step_of(run),
            None => self.world.step().map(|_| ()),
        }
        .map_err(Error::Simulate)?;
        let (world, engine) = (&self.world, self.world.engine());
        let (system, forces) = (engine.system(), engine.forces());
        if let Some(view) = &mut self.view
            && view.show(&LiveFrame { step: world.steps(), time: world.time(), system, forces }).is_err()
        {
            // A state that no page can draw ends the page, not the run.
            self.view = None;
        }
        Ok(())
    }

    fn history(&self) -> Result<&Run, Error> {
        self.run.as_ref().ok_or(Error::NoHistory)
    }

    fn record(&self) -> Result<RunRecord, Error> {
        Ok(self.history()?.clone().into_record(self.system()))
    }

    fn copy(&self) -> Self {
        Self { world: self.world.clone(), run: self.run.clone(), scene: Arc::clone(&self.scene), view: None }
    }
}

/// A moment of a Simulation, or of Worlds, to go back to with restore. It cannot be stored in a
/// file.
#[pyclass(frozen, module = "tesdf")]
pub struct Snapshot {
    /// One for each world.
    pub worlds: Vec<WorldSnapshot>,
    /// Of a simulation with a history.
    run: Option<Run>,
}

impl Snapshot {
    pub fn of_worlds(worlds: Vec<WorldSnapshot>) -> Self {
        Self { worlds, run: None }
    }
}

#[pymethods]
impl Snapshot {
    /// Number of worlds.
    fn __len__(&self) -> usize {
        self.worlds.len()
    }

    fn __repr__(&self) -> String {
        format!("<tesdf.Snapshot: {} worlds>", self.worlds.len())
    }
}

/// What a Record plays: its run, and the meshes of its bodies.
#[pyclass(frozen, module = "tesdf")]
pub struct RecordedRun {
    pub record: RunRecord,
    pub system: System,
}

impl Simulation {
    fn locked(&self) -> MutexGuard<'_, Running> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the state. Waits for a step of another thread without the interpreter's lock.
    fn read<T: Send>(&self, py: Python<'_>, read: impl FnOnce(&Running) -> T + Send) -> T {
        py.detach(|| read(&self.locked()))
    }

    /// Reads what may be missing.
    fn try_read<T: Send>(
        &self,
        py: Python<'_>,
        read: impl FnOnce(&Running) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        self.read(py, read).map_err(|e| e.raise(py))
    }

    /// The run so far, and its bodies. Waits for a step of another thread, so the caller must not
    /// hold the interpreter's lock.
    pub fn so_far(&self) -> Result<(RunRecord, System), Error> {
        let running = self.locked();
        Ok((running.record()?, running.system().clone()))
    }

    fn pool(&self, py: Python<'_>) -> PyResult<Arc<ThreadPool>> {
        match &self.threads {
            Some(threads) => Ok(Arc::clone(threads)),
            None => pool::shared().map_err(|e| e.raise(py)),
        }
    }

    /// Changes something between two steps.
    fn change(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut Running) -> Result<(), Error> + Send,
    ) -> PyResult<()> {
        py.detach(|| change(&mut self.locked())).map_err(|e| e.raise(py))
    }

    /// Changes the engine between two steps.
    fn set(&self, py: Python<'_>, set: impl FnOnce(&mut Newton) -> Result<(), Error> + Send) -> PyResult<()> {
        self.change(py, |r| set(r.world.engine_mut()))
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
        let (mut done, planned) = self.read(py, |r| (r.world.steps(), r.scene.planned));
        let mut left = count.unwrap_or(planned.saturating_sub(done));
        loop {
            // On a thread that is there already, for as long as a signal may wait.
            let slice = || -> Result<(u64, u64), Error> {
                let (running, begin) = (&mut *self.locked(), Instant::now());
                let mut left = left;
                while left > 0 {
                    running.step()?;
                    left -= 1;
                    if begin.elapsed() >= POLL {
                        break;
                    }
                }
                Ok((running.world.steps(), left))
            };
            (done, left) = py.detach(|| pool.install(slice)).map_err(|e| e.raise(py))?;
            if let Some(progress) = progress {
                progress.call1((done, planned))?;
            }
            py.check_signals()?;
            if left == 0 {
                return Ok(());
            }
        }
    }
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scene, *, mode = None, time_step = None, duration = None, threads = None, device = None, history = true), text_signature = "(scene, *, mode=None, time_step=None, duration=None, threads=None, device=\"cpu\", history=True)")]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn new(
        py: Python<'_>,
        scene: &Bound<'_, PyAny>,
        mode: Option<&Bound<'_, PyAny>>,
        time_step: Option<f64>,
        duration: Option<f64>,
        #[pyo3(from_py_with = whole::threads)] threads: Option<NonZeroUsize>,
        device: Option<&Bound<'_, PyAny>>,
        history: bool,
    ) -> PyResult<Self> {
        let device = device::chosen(device)?;
        let mode = mode.map(|any| named("mode", any)).transpose()?;
        let replaced = Replaced { mode, time_step, duration };
        let threads = threads.map(|n| pool::of(Some(n))).transpose().map_err(|e| e.raise(py))?;
        let pool = match &threads {
            Some(threads) => Arc::clone(threads),
            None => pool::shared().map_err(|e| e.raise(py))?,
        };
        let progress = Progress::default();
        let source = Source::new(scene)?;
        let work =
            || pool.install(|| Running::begin(Opened::new(source, &replaced, device, &progress)?, history));
        let running = cancellable(py, work, || progress.cancel(), || Ok(()))?.map_err(|e| e.raise(py))?;
        Ok(Self { threads, inner: Mutex::new(running) })
    }

    /// Makes `count` steps. The duration of the scene does not limit their number. Ctrl-C ends it
    /// between two steps; the steps so far remain. No thread is started for a call.
    ///
    /// Raises SimulationError if a step fails. The steps before it remain.
    #[pyo3(signature = (count = 1))]
    fn step(&self, py: Python<'_>, #[pyo3(from_py_with = whole::count)] count: u64) -> PyResult<()> {
        self.advance(py, Some(count), None)
    }

    /// Makes the steps that the duration of the scene leaves. Returns the summary.
    ///
    /// progress is called with the number of steps so far and of all steps, about twenty times a
    /// second. An exception from it ends the run between two steps and is raised.
    #[pyo3(signature = (*, progress = None))]
    fn run<'py>(&self, py: Python<'py>, progress: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        self.try_read(py, |r| r.history().map(|_| ()))?;
        self.advance(py, None, progress)?;
        self.summary(py)
    }

    /// Summary of the steps so far, with the names of `tesdf simulate --json`: a dict with
    /// contacts, energies, momenta and the report of each criterion of the scene. passed says
    /// whether the criteria hold; None if there are none.
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let summary = self.try_read(py, |r| Ok(r.history()?.summary(r.system())))?;
        classes::dict(py, &summary)
    }

    /// What the steps so far did not do as the scene asks, in lines for users: bodies that overlap,
    /// joints that came apart, energy from nowhere, steps that did not converge. Also without a
    /// history. summary()["warnings"] has them with names and values.
    #[getter]
    fn warnings(&self, py: Python<'_>) -> Vec<String> {
        let warnings = self.read(py, |r| match &r.run {
            Some(run) => run.summary(r.system()).warnings,
            None => r.world.warnings(),
        });
        warnings.into_iter().map(|warning| warning.message).collect()
    }

    /// Writes the run file of the steps so far, with the bytes of that of the command.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.try_read(py, |r| r.record()?.save(&path).map_err(|e| Error::Record(path, e)))
    }

    /// All states so far, recorded contacts, forces and warnings: Record(times, poses, velocities,
    /// ...), copied.
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (record, system) = self.try_read(py, |r| Ok((r.record()?, r.system().clone())))?;
        let (steps, bodies) = (record.times().len(), record.bodies.len());
        let each = || (0..steps).flat_map(|step| (0..bodies).map(move |body| (step, body)));
        let poses = each().filter_map(|(step, body)| record.pose(step, body)).flat_map(|p| of_pose(&p));
        let velocities = each()
            .filter_map(|(step, body)| record.velocity(step, body))
            .flat_map(|[linear, angular]| of_velocity(&Velocity { linear, angular }));
        let contacts: Vec<_> = record.contacts().collect();
        let all = || contacts.iter().flat_map(|(_, of_step)| of_step);
        let of_row = contacts.iter().flat_map(|(step, of_step)| of_step.iter().map(move |_| *step));
        let forces: Vec<_> = record.forces().collect();
        let of_force = forces.iter().flat_map(|(step, f)| f.contacts.iter().map(move |_| *step));
        let pushing: Vec<_> = forces.iter().flat_map(|(_, f)| f.contacts.iter().copied()).collect();
        let joints: Vec<_> = forces.iter().flat_map(|(_, f)| f.joints.iter().copied()).collect();
        Columns::new(py)
            .add("times", record.times().iter().copied())?
            .with("poses", shaped(py, poses, [steps, bodies, 7])?)?
            .with("velocities", shaped(py, velocities, [steps, bodies, 6])?)?
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
            .with("_run", Bound::new(py, RecordedRun { record, system })?.into_any())?
            .build("Record")
    }

    /// Serves a page on this machine that follows the steps from now on, until the simulation is
    /// deleted: LiveView, whose open() shows it in a browser, and which a notebook shows. title is
    /// its heading.
    ///
    /// Raises SimulationError where the machine has no loopback interface.
    #[pyo3(signature = (*, title = "simulation"))]
    fn view<'py>(&self, py: Python<'py>, title: &str) -> PyResult<Bound<'py, PyAny>> {
        let url = py.detach(|| -> Result<String, PlaybackError> {
            let Running { world, view, .. } = &mut *self.locked();
            if view.is_none() {
                *view = Some(LiveView::open(world.engine().system(), title)?);
            }
            Ok(view.as_ref().map(LiveView::url).unwrap_or_default())
        });
        let url = url.map_err(|e| Error::Playback(e).raise(py))?;
        py.import("tesdf.playback")?.getattr("LiveView")?.call1((url,))
    }

    /// Names of the bodies.
    #[getter]
    fn bodies(&self, py: Python<'_>) -> Vec<String> {
        self.read(py, |r| settings::bodies(r.system()))
    }

    /// Time since the beginning or the last reset, s: that of the poses and velocities.
    #[getter]
    fn time(&self, py: Python<'_>) -> f64 {
        self.read(py, |r| r.world.time())
    }

    /// Number of steps since the beginning or the last reset.
    #[getter]
    fn steps(&self, py: Python<'_>) -> u64 {
        self.read(py, |r| r.world.steps())
    }

    /// Number of steps of the scene's duration.
    #[getter]
    fn planned_steps(&self, py: Python<'_>) -> u64 {
        self.read(py, |r| r.scene.planned)
    }

    /// Names of the joints.
    #[getter]
    fn joints(&self, py: Python<'_>) -> Vec<String> {
        self.read(py, |r| settings::joints(r.system()))
    }

    /// Current coordinates [J] of the joints: the angle of a hinge, rad, with the whole turns since
    /// the start, the travel of a slider, m, the angle by which a ball is bent, rad; 0 for a weld.
    #[getter]
    fn coordinates<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.read(py, |r| r.system().coordinates().to_vec()))
    }

    /// Current rates [J] of the coordinates, rad/s or m/s; 0 for a ball and a weld.
    #[getter]
    fn coordinate_rates<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.read(py, |r| r.system().coordinate_rates()))
    }

    /// The forces of the contacts that push, each the mean over the last step: ContactForces.
    #[getter]
    fn contact_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let forces = self.read(py, |r| r.world.engine().forces().map(|forces| forces.contacts.clone()));
        forces::of_contacts(py, &forces.unwrap_or_default())
    }

    /// What each joint did to its child, as the mean over the last step: JointForces.
    #[getter]
    fn joint_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let forces = self.read(py, |r| r.world.engine().forces().map(|forces| forces.joints.clone()));
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
        let motor = settings::motor(velocity, position, force, spring, limit)?;
        let joint = index_of("joint", joint, &self.joints(py))?;
        self.set(py, |engine| engine.set_motor(joint, motor).map_err(Error::Dynamics))
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
        self.set(py, |engine| engine.set_wrench(body, Wrench { force, torque }).map_err(Error::Dynamics))
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
        let (pose, velocity) =
            (pose.and_then(|rows| rows.first().copied()), velocity.and_then(|rows| rows.first().copied()));
        self.set(py, |engine| settings::set_state(engine, body, pose, velocity))
    }

    /// Sets the mass of a free body, kg, given by its name or number, from the next step on. The
    /// body wakes.
    ///
    /// - center_of_mass: [3] in the body's frame, m. None: that in the scene.
    /// - inertia: [6] xx yy zz xy xz yz about the centre of mass, along the axes of the body's
    ///   frame, kg m². None: that in the scene, in proportion to the mass.
    ///
    /// A reset leaves it as it is; restore brings back that of the snapshot.
    ///
    /// Raises SimulationError if the body is not free, or no body has such a mass.
    #[pyo3(signature = (body, mass, *, center_of_mass = None, inertia = None))]
    fn set_mass(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        mass: f64,
        center_of_mass: Option<[f64; 3]>,
        inertia: Option<[f64; 6]>,
    ) -> PyResult<()> {
        let body = index_of("body", body, &self.bodies(py))?;
        self.change(py, |r| settings::set_mass(&mut r.world, body, mass, center_of_mass, inertia))
    }

    /// Sets the coefficient of friction of a body, given by its name or number, from the next step
    /// on. Between two bodies the geometric mean of theirs acts, unless the scene gives one for the
    /// pair. The body wakes, with those that it touches. A reset leaves it as it is.
    fn set_friction(&self, py: Python<'_>, body: &Bound<'_, PyAny>, coefficient: f64) -> PyResult<()> {
        let body = index_of("body", body, &self.bodies(py))?;
        self.set(py, |engine| engine.set_friction(body, coefficient).map_err(Error::Dynamics))
    }

    /// Sets the coefficient of torsional friction of a body, m, given by its name or number, from the
    /// next step on: a contact resists spin about its normal by a moment of at most this length times
    /// its force. Otherwise as set_friction.
    fn set_friction_torsional(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        coefficient: f64,
    ) -> PyResult<()> {
        let body = index_of("body", body, &self.bodies(py))?;
        self.set(py, |engine| engine.set_friction_torsional(body, coefficient).map_err(Error::Dynamics))
    }

    /// Sets gravity [3], m/s², from the next step on. All bodies wake. A reset leaves it as it is.
    fn set_gravity(&self, py: Python<'_>, gravity: [f64; 3]) -> PyResult<()> {
        let gravity = DVec3::from_array(gravity);
        self.set(py, |engine| engine.set_gravity(gravity).map_err(Error::Dynamics))
    }

    /// Begins again at time 0, with the states of the scene's beginning, or with these poses
    /// [B, 7], x y z qx qy qz qw, and velocities [B, 6]. Motors are those of the scene, wrenches
    /// zero, and the history begins anew. Masses, friction and gravity stay as they were set. The
    /// steps from there on have the same bytes as those of a new simulation.
    ///
    /// Takes some microseconds without a history.
    #[pyo3(signature = (*, poses = None, velocities = None))]
    fn reset(
        &self,
        py: Python<'_>,
        poses: Option<&Bound<'_, PyAny>>,
        velocities: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let first = self.read(py, |r| r.world.first_states().to_vec());
        let states = settings::states(&first, 1, poses, velocities)?.and_then(|mut rows| rows.pop());
        self.change(py, |running| {
            running.world.reset(states).map_err(Error::Dynamics)?;
            if running.run.is_some() {
                running.run = Some(running.scene.run(running.system())?);
            }
            Ok(())
        })
    }

    /// All that the next steps depend on, with the history, to go back to: a Snapshot.
    fn snapshot(&self, py: Python<'_>) -> Snapshot {
        self.read(py, |r| Snapshot { worlds: vec![r.world.snapshot()], run: r.run.clone() })
    }

    /// Goes back to a snapshot of this simulation or of a copy. The steps from there on have the
    /// same bytes as those after the snapshot.
    ///
    /// Raises SimulationError if the snapshot is of another simulation.
    fn restore(&self, py: Python<'_>, snapshot: &Snapshot) -> PyResult<()> {
        let [world] = &*snapshot.worlds else {
            return Err(argument(
                "snapshot",
                format!("of {} worlds", snapshot.worlds.len()),
                "one of a Simulation",
            ));
        };
        self.change(py, |running| {
            let run = match running.run {
                Some(_) => Some(snapshot.run.clone().ok_or(Error::NoHistory)?),
                None => None,
            };
            running.world.restore(world).map_err(Error::Dynamics)?;
            running.run = run;
            Ok(())
        })
    }

    /// A simulation that goes on from the same moment on its own. It shares the meshes.
    fn copy(&self, py: Python<'_>) -> Self {
        Self { threads: self.threads.clone(), inner: Mutex::new(self.read(py, Running::copy)) }
    }

    fn __copy__(&self, py: Python<'_>) -> Self {
        self.copy(py)
    }

    /// Masses [B], kg; inf of bodies that are not free.
    #[getter]
    fn masses<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.read(py, |r| settings::masses(r.system()).collect()))
    }

    /// Coefficients of friction [B] of the bodies.
    #[getter]
    fn frictions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.read(py, |r| settings::frictions(r.system()).collect()))
    }

    /// Coefficients of torsional friction [B] of the bodies, m.
    #[getter]
    fn frictions_torsional<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.read(py, |r| settings::frictions_torsional(r.system()).collect()))
    }

    /// Gravity [3], m/s².
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.read(py, |r| r.system().gravity.to_array()))
    }

    /// Current poses [B, 7] of the bodies' frames, x y z qx qy qz qw.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let poses: Vec<_> = self.read(py, |r| rows_of(r.states()).map(|(pose, _)| pose).collect());
        let bodies = poses.len();
        shaped(py, poses.into_flattened(), [bodies, 7])
    }

    /// Current velocities [B, 6], vx vy vz wx wy wz: of the centre of mass, and angular.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let velocities: Vec<_> =
            self.read(py, |r| rows_of(r.states()).map(|(_, velocity)| velocity).collect());
        let bodies = velocities.len();
        shaped(py, velocities.into_flattened(), [bodies, 6])
    }

    /// The contacts at the beginning of the last step: StepContacts. They include contacts that the
    /// motion of the step could close. Instances are the bodies.
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (found, hidden) =
            self.read(py, |r| (r.world.engine().contacts().to_vec(), r.world.engine().hidden().to_vec()));
        contacts::of_step(py, &found, &hidden)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("tesdf.playback")?.getattr("_of_notebook")?.call1((slf,))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (bodies, steps, planned) =
            self.read(py, |r| (r.states().len(), r.world.steps(), r.scene.planned));
        format!("<tesdf.Simulation: {bodies} bodies, step {steps} of {planned}>")
    }
}
