//! `tesdf.Worlds`
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use numpy::{PyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rayon::ThreadPool;
use tesdf::Progress;
use tesdf::glam::DVec3;
use tesdf_sim::newton::Newton;
use tesdf_sim::{self as sim, Dynamics, Forces, JointForce, System, World, Wrench};

use crate::contacts::{self, Columns};
use crate::detection::named;
use crate::errors::{Error, argument};
use crate::interrupt::{POLL, cancellable};
use crate::opening::{Opened, Replaced, Source};
use crate::poses::{columns, of_twist, poses_of};
use crate::settings::{self, index_of, rows_of, shaped};
use crate::simulation::Snapshot;
use crate::whole;
use crate::{arrays, forces, pool};

/// Many worlds of a scene, for control and learning: all threads step them, on the processor. What
/// a world does is that of a Simulation with the same settings, byte for byte, on any number of
/// threads. No history is kept; warnings says what a world did not do as its scene asks.
///
/// - scene: path of a TOML file, or a dict with the keys of such a file, as in Simulation.
/// - count: number of worlds, n.
/// - mode, time_step: replace those of the scene.
/// - threads: number of threads; None is one per core.
///
/// States are arrays [n, ...] with a row for each world; bodies and joints have the numbers of
/// their order in the scene. Methods that set something take one value for all worlds, or an array
/// with a row for each, and worlds: the worlds concerned, as their numbers or as a mask [n]; None
/// is all. Units are SI.
///
/// Raises OSError if a file cannot be read, and SceneError with the line of the scene.
#[pyclass(frozen, module = "tesdf")]
pub struct Worlds {
    threads: Arc<ThreadPool>,
    inner: Mutex<sim::Worlds>,
}

impl Worlds {
    fn locked(&self) -> MutexGuard<'_, sim::Worlds> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the worlds. Waits for a step of another thread without the interpreter's lock.
    fn read<T: Send>(&self, py: Python<'_>, read: impl FnOnce(&[World]) -> T + Send) -> T {
        py.detach(|| read(self.locked().as_slice()))
    }

    /// Reads the bodies that all worlds have alike.
    fn system<T: Send>(&self, py: Python<'_>, read: impl FnOnce(&System) -> T + Send) -> T {
        self.read(py, |worlds| read(worlds[0].engine().system()))
    }

    /// Some numbers of each world, in an array of shape [n, …].
    fn numbers<'py>(
        &self,
        py: Python<'py>,
        shape: &[usize],
        add: impl Fn(&World, &mut Vec<f64>) + Sync + Send,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (worlds, numbers) = self.read(py, |worlds| {
            let mut numbers = Vec::new();
            worlds.iter().for_each(|world| add(world, &mut numbers));
            (worlds.len(), numbers)
        });
        shaped(py, numbers, [&[worlds], shape].concat())
    }

    fn counts(&self, py: Python<'_>) -> [usize; 2] {
        self.system(py, |system| [system.bodies().len(), system.joints().len()])
    }

    /// The numbers of the worlds that an argument names.
    fn chosen(&self, py: Python<'_>, worlds: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<usize>> {
        let count = self.read(py, <[World]>::len);
        let Some(any) = worlds else { return Ok((0..count).collect()) };
        let expected = format!("numbers from 0 to {}, or a mask of shape ({count},)", count - 1);
        let array = py.import("numpy")?.call_method1("asarray", (arrays::on_host(any)?,))?;
        if let Ok(mask) = array.extract::<numpy::PyReadonlyArrayDyn<'_, bool>>() {
            if mask.shape() != [count] {
                let found = format!("a mask of shape {}", array.getattr("shape")?);
                return Err(argument("worlds", found, &expected));
            }
            let mask = mask.as_array();
            return Ok((0..count).filter(|&world| mask[world]).collect());
        }
        let numbers = arrays::integers("worlds", &array, &expected, |shape| shape.len() <= 1)?;
        let mut seen = vec![false; count];
        let number = |&number: &i64| {
            let world = usize::try_from(number).ok().filter(|&world| world < count);
            let world = world.ok_or_else(|| argument("worlds", number, &expected))?;
            if std::mem::replace(&mut seen[world], true) {
                return Err(argument("worlds", format!("{world} twice"), "each number once"));
            }
            Ok(world)
        };
        numbers.as_slice()?.iter().map(number).collect()
    }

    /// Changes some worlds, each with its value.
    fn change<T: Send>(
        &self,
        py: Python<'_>,
        chosen: Vec<usize>,
        values: impl IntoIterator<Item = T> + Send,
        change: impl Fn(&mut World, T) -> Result<(), Error> + Send + Sync,
    ) -> PyResult<()> {
        let changed = py.detach(|| {
            let mut worlds = self.locked();
            let worlds = worlds.as_mut_slice();
            chosen.into_iter().zip(values).try_for_each(|(world, value)| {
                change(&mut worlds[world], value).map_err(|e| Error::World(world, Box::new(e)))
            })
        });
        changed.map_err(|e| e.raise(py))
    }

    /// Changes the engines of some worlds, each with its value.
    fn set<T: Send>(
        &self,
        py: Python<'_>,
        chosen: Vec<usize>,
        values: impl IntoIterator<Item = T> + Send,
        set: impl Fn(&mut Newton, T) -> Result<(), Error> + Send + Sync,
    ) -> PyResult<()> {
        self.change(py, chosen, values, |world, value| set(world.engine_mut(), value))
    }

    /// Sets a coefficient of a body, a number or [k].
    fn set_coefficient(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        coefficient: &Bound<'_, PyAny>,
        worlds: Option<&Bound<'_, PyAny>>,
        set: fn(&mut Newton, usize, f64) -> Result<(), sim::DynamicsError>,
    ) -> PyResult<()> {
        let (body, chosen) = (self.body(py, body)?, self.chosen(py, worlds)?);
        let values = columns::<1>("coefficient", coefficient, chosen.len())?;
        self.set(py, chosen, values, |engine, [coefficient]| {
            set(engine, body, coefficient).map_err(Error::Dynamics)
        })
    }

    fn body(&self, py: Python<'_>, any: &Bound<'_, PyAny>) -> PyResult<usize> {
        index_of("body", any, &self.bodies(py))
    }

    /// A world, by its number.
    fn one(&self, py: Python<'_>, world: usize) -> PyResult<usize> {
        let count = self.read(py, <[World]>::len);
        match world < count {
            true => Ok(world),
            false => Err(argument("world", world, &format!("a number from 0 to {}", count - 1))),
        }
    }
}

/// Values for each of the rows, if they are given.
fn optional<T: Clone>(values: Option<PyResult<Vec<T>>>, rows: usize) -> PyResult<Vec<Option<T>>> {
    Ok(match values.transpose()? {
        Some(values) => values.into_iter().map(Some).collect(),
        None => vec![None; rows],
    })
}

fn forces_of(world: &World) -> Option<&Forces> {
    world.engine().forces()
}

fn joint_forces_of(world: &World) -> &[JointForce] {
    forces_of(world).map_or(&[], |forces| &forces.joints)
}

#[pymethods]
impl Worlds {
    #[new]
    #[pyo3(signature = (scene, count, *, mode = None, time_step = None, threads = None))]
    fn new(
        py: Python<'_>,
        scene: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = whole::count)] count: usize,
        mode: Option<&Bound<'_, PyAny>>,
        time_step: Option<f64>,
        #[pyo3(from_py_with = whole::threads)] threads: Option<NonZeroUsize>,
    ) -> PyResult<Self> {
        if count == 0 {
            return Err(argument("count", count, "a number of worlds, 1 or more"));
        }
        let mode = mode.map(|any| named("mode", any)).transpose()?;
        let replaced = Replaced { mode, time_step, duration: None };
        let threads = pool::of(threads).map_err(|e| e.raise(py))?;
        let progress = Progress::default();
        let source = Source::new(scene)?;
        let work = || {
            threads.install(|| {
                let Opened { scene, engine, .. } = Opened::new(source, &replaced, None, &progress)?;
                let world = World::new(&scene, engine).map_err(Error::Simulate)?;
                Ok::<_, Error>(sim::Worlds::new(&world, count))
            })
        };
        let worlds = cancellable(py, work, || progress.cancel(), || Ok(()))?.map_err(|e| e.raise(py))?;
        Ok(Self { threads, inner: Mutex::new(worlds) })
    }

    /// Makes `count` steps of each world. Ctrl-C ends it between two steps; the steps so far
    /// remain, the same number in each world. No thread is started for a call.
    ///
    /// Raises SimulationError if a step of a world fails. That world stays as it was before the
    /// step; the others make theirs.
    #[pyo3(signature = (count = 1))]
    fn step(&self, py: Python<'_>, #[pyo3(from_py_with = whole::count)] count: u64) -> PyResult<()> {
        let mut left = count;
        while left > 0 {
            // For as long as a signal may wait.
            let slice = || {
                let (worlds, begin) = (&mut *self.locked(), Instant::now());
                let mut made = 0;
                while made < left && begin.elapsed() < POLL {
                    worlds.step(1)?;
                    made += 1;
                }
                Ok::<u64, sim::WorldError>(made)
            };
            let made = py.detach(|| self.threads.install(slice));
            left -= made.map_err(|e| Error::World(e.world, Box::new(Error::Simulate(e.source))).raise(py))?;
            py.check_signals()?;
        }
        Ok(())
    }

    /// Begins worlds again at time 0, with the states of the scene's beginning, or with these poses
    /// [B, 7], x y z qx qy qz qw, and velocities [B, 6], or [k, B, ...] with a row for each of the
    /// k worlds. Motors are those of the scene, wrenches zero. Masses, friction and gravity stay as
    /// they were set. The steps from there on have the same bytes as those of new worlds. Takes
    /// some microseconds for each world.
    #[pyo3(signature = (worlds = None, *, poses = None, velocities = None))]
    fn reset(
        &self,
        py: Python<'_>,
        worlds: Option<&Bound<'_, PyAny>>,
        poses: Option<&Bound<'_, PyAny>>,
        velocities: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let chosen = self.chosen(py, worlds)?;
        let first = self.read(py, |worlds| worlds[0].first_states().to_vec());
        let states = settings::states(&first, chosen.len(), poses, velocities)?;
        let states = states.map_or(vec![None; chosen.len()], |rows| rows.into_iter().map(Some).collect());
        self.change(py, chosen, states, |world, states| world.reset(states).map_err(Error::Dynamics))
    }

    /// All that the next steps of worlds depend on, to go back to: a Snapshot.
    #[pyo3(signature = (worlds = None))]
    fn snapshot(&self, py: Python<'_>, worlds: Option<&Bound<'_, PyAny>>) -> PyResult<Snapshot> {
        let chosen = self.chosen(py, worlds)?;
        let of = |all: &[World]| chosen.iter().map(|&world| all[world].snapshot()).collect();
        Ok(Snapshot::of_worlds(self.read(py, of)))
    }

    /// Goes back to a snapshot of as many worlds, in their order, or sets all of them to a snapshot
    /// of one. It may be of other worlds of this object or of a copy. The steps from there on have
    /// the same bytes as those after the snapshot.
    #[pyo3(signature = (snapshot, worlds = None))]
    fn restore(
        &self,
        py: Python<'_>,
        snapshot: &Snapshot,
        worlds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let chosen = self.chosen(py, worlds)?;
        let (found, wanted) = (&snapshot.worlds, chosen.len());
        if found.len() != wanted && found.len() != 1 {
            let expected = format!("one of {wanted} worlds, or of one");
            return Err(argument("snapshot", format!("of {} worlds", found.len()), &expected));
        }
        self.change(py, chosen, found.iter().cycle(), |world, snapshot| {
            world.restore(snapshot).map_err(Error::Dynamics)
        })
    }

    /// Worlds that go on from the same moment on their own. They share the meshes.
    fn copy(&self, py: Python<'_>) -> Self {
        let worlds = py.detach(|| self.locked().clone());
        Self { threads: Arc::clone(&self.threads), inner: Mutex::new(worlds) }
    }

    fn __copy__(&self, py: Python<'_>) -> Self {
        self.copy(py)
    }

    /// Sets the masses of a free body, kg: a number or [k]; center_of_mass [3] or [k, 3], m, and
    /// inertia [6] or [k, 6], kg m², as in Simulation.set_mass.
    #[pyo3(signature = (body, mass, *, center_of_mass = None, inertia = None, worlds = None))]
    fn set_mass(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        mass: &Bound<'_, PyAny>,
        center_of_mass: Option<&Bound<'_, PyAny>>,
        inertia: Option<&Bound<'_, PyAny>>,
        worlds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (body, chosen) = (self.body(py, body)?, self.chosen(py, worlds)?);
        let rows = chosen.len();
        let mass = columns::<1>("mass", mass, rows)?;
        let center = optional(center_of_mass.map(|any| columns::<3>("center_of_mass", any, rows)), rows)?;
        let inertia = optional(inertia.map(|any| columns::<6>("inertia", any, rows)), rows)?;
        let values: Vec<_> = mass.into_iter().zip(center.into_iter().zip(inertia)).collect();
        self.change(py, chosen, values, |world, ([mass], (center, inertia))| {
            settings::set_mass(world, body, mass, center, inertia)
        })
    }

    /// Sets the coefficients of friction of a body: a number or [k], as in Simulation.set_friction.
    #[pyo3(signature = (body, coefficient, *, worlds = None))]
    fn set_friction(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        coefficient: &Bound<'_, PyAny>,
        worlds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        self.set_coefficient(py, body, coefficient, worlds, Newton::set_friction)
    }

    /// Sets the coefficients of torsional friction of a body, m: a number or [k], as in
    /// Simulation.set_friction_torsional.
    #[pyo3(signature = (body, coefficient, *, worlds = None))]
    fn set_friction_torsional(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        coefficient: &Bound<'_, PyAny>,
        worlds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        self.set_coefficient(py, body, coefficient, worlds, Newton::set_friction_torsional)
    }

    /// Sets gravity: [3] or [k, 3], m/s², as in Simulation.set_gravity.
    #[pyo3(signature = (gravity, *, worlds = None))]
    fn set_gravity(
        &self,
        py: Python<'_>,
        gravity: &Bound<'_, PyAny>,
        worlds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let chosen = self.chosen(py, worlds)?;
        let values = columns::<3>("gravity", gravity, chosen.len())?;
        self.set(py, chosen, values, |engine, gravity| {
            engine.set_gravity(DVec3::from_array(gravity)).map_err(Error::Dynamics)
        })
    }

    /// Sets the motors of a joint, as in Simulation.set_motor: velocity, position, force and limit
    /// are numbers or [k], spring is [3] or [k, 3].
    #[pyo3(signature = (joint, *, velocity = None, position = None, force = None, spring = None, limit = None, worlds = None), text_signature = "($self, joint, *, velocity=None, position=None, force=None, spring=None, limit=..., worlds=None)")]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn set_motor(
        &self,
        py: Python<'_>,
        joint: &Bound<'_, PyAny>,
        velocity: Option<&Bound<'_, PyAny>>,
        position: Option<&Bound<'_, PyAny>>,
        force: Option<&Bound<'_, PyAny>>,
        spring: Option<&Bound<'_, PyAny>>,
        limit: Option<&Bound<'_, PyAny>>,
        worlds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let joint = index_of("joint", joint, &self.joints(py))?;
        let chosen = self.chosen(py, worlds)?;
        let rows = chosen.len();
        let one = |name: &str, any: Option<&Bound<'_, PyAny>>| {
            optional(any.map(|any| columns::<1>(name, any, rows)), rows)
        };
        let velocity = one("velocity", velocity)?;
        let position = one("position", position)?;
        let force = one("force", force)?;
        let limit = one("limit", limit)?;
        let spring = optional(spring.map(|any| columns::<3>("spring", any, rows)), rows)?;
        let first = |numbers: Option<[f64; 1]>| numbers.map(|[number]| number);
        let motor = |k: usize| {
            let limit = first(limit[k]).unwrap_or(f64::INFINITY);
            settings::motor(first(velocity[k]), first(position[k]), first(force[k]), spring[k], limit)
        };
        let motors = (0..rows).map(motor).collect::<PyResult<Vec<_>>>()?;
        self.set(py, chosen, motors, |engine, motor| engine.set_motor(joint, motor).map_err(Error::Dynamics))
    }

    /// Sets the force, N, and the torque, N m, on a body, each [3] or [k, 3], as in
    /// Simulation.set_wrench. What is None is zero.
    #[pyo3(signature = (body, *, force = None, torque = None, worlds = None))]
    fn set_wrench(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        force: Option<&Bound<'_, PyAny>>,
        torque: Option<&Bound<'_, PyAny>>,
        worlds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (body, chosen) = (self.body(py, body)?, self.chosen(py, worlds)?);
        let of = |name: &str, any: Option<&Bound<'_, PyAny>>| {
            any.map_or_else(|| Ok(vec![[0.0; 3]; chosen.len()]), |any| columns::<3>(name, any, chosen.len()))
        };
        let (force, torque) = (of("force", force)?, of("torque", torque)?);
        let wrenches: Vec<_> = force.into_iter().zip(torque).collect();
        self.set(py, chosen, wrenches, |engine, (force, torque)| {
            let [force, torque] = [force, torque].map(DVec3::from_array);
            engine.set_wrench(body, Wrench { force, torque }).map_err(Error::Dynamics)
        })
    }

    /// Sets the pose, [7], [4, 4], [k, 7] or [k, 4, 4], and the velocity, [6] or [k, 6], of a body,
    /// as in Simulation.set_state. What is None stays.
    #[pyo3(signature = (body, *, pose = None, velocity = None, worlds = None))]
    fn set_state(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        pose: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        worlds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (body, chosen) = (self.body(py, body)?, self.chosen(py, worlds)?);
        let rows = chosen.len();
        let pose = optional(pose.map(|any| poses_of("pose", any, rows)), rows)?;
        let velocity = optional(velocity.map(|any| columns::<6>("velocity", any, rows)), rows)?;
        let values: Vec<_> = pose.into_iter().zip(velocity).collect();
        self.set(py, chosen, values, |engine, (pose, velocity)| {
            settings::set_state(engine, body, pose, velocity.as_ref().map(of_twist))
        })
    }

    /// Names of the bodies.
    #[getter]
    fn bodies(&self, py: Python<'_>) -> Vec<String> {
        self.system(py, settings::bodies)
    }

    /// Names of the joints.
    #[getter]
    fn joints(&self, py: Python<'_>) -> Vec<String> {
        self.system(py, settings::joints)
    }

    /// The time step, s.
    #[getter]
    fn time_step(&self, py: Python<'_>) -> f64 {
        self.read(py, |worlds| worlds[0].time_step())
    }

    /// Times [n] since the beginning or the last reset, s.
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, &[], |world, to| to.push(world.time()))
    }

    /// Numbers of steps [n] since the beginning or the last reset.
    #[getter]
    fn steps<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        PyArray1::from_vec(py, self.read(py, |worlds| worlds.iter().map(World::steps).collect()))
    }

    /// Numbers of steps [n] since the beginning or the last reset that did not converge: contacts
    /// or joints contradict each other there, or the time step is too long.
    #[getter]
    fn unconverged_steps<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        let of_worlds = self.read(py, |worlds| worlds.iter().map(World::unconverged_steps).collect());
        PyArray1::from_vec(py, of_worlds)
    }

    /// Current poses [n, B, 7] of the bodies' frames, x y z qx qy qz qw.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [bodies, _] = self.counts(py);
        self.numbers(py, &[bodies, 7], |world, to| {
            to.extend(rows_of(world.engine().system().states()).flat_map(|(pose, _)| pose));
        })
    }

    /// Current velocities [n, B, 6], vx vy vz wx wy wz: of the centre of mass, and angular.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [bodies, _] = self.counts(py);
        self.numbers(py, &[bodies, 6], |world, to| {
            to.extend(rows_of(world.engine().system().states()).flat_map(|(_, velocity)| velocity));
        })
    }

    /// Current coordinates [n, J] of the joints, as in Simulation.
    #[getter]
    fn coordinates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [_, joints] = self.counts(py);
        self.numbers(py, &[joints], |world, to| to.extend(world.engine().system().coordinates()))
    }

    /// Current rates [n, J] of the coordinates, rad/s or m/s.
    #[getter]
    fn coordinate_rates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [_, joints] = self.counts(py);
        self.numbers(py, &[joints], |world, to| to.extend(world.engine().system().coordinate_rates()))
    }

    /// The force [n, B, 3] of all contacts on each body, in the world's frame, N: the mean over the
    /// last step.
    #[getter]
    fn net_contact_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [bodies, _] = self.counts(py);
        self.numbers(py, &[bodies, 3], |world, to| {
            let sums =
                forces_of(world).map_or_else(|| vec![DVec3::ZERO; bodies], |forces| forces.on_each(bodies));
            to.extend(sums.iter().flat_map(DVec3::to_array));
        })
    }

    /// What each joint did to its child, as the mean over the last step: JointForces with arrays
    /// [n, J, ...].
    #[getter]
    fn joint_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [_, joints] = self.counts(py);
        let vectors = |of: fn(&JointForce) -> DVec3| {
            self.numbers(py, &[joints, 3], move |world, to| {
                to.extend(joint_forces_of(world).iter().flat_map(|joint| of(joint).to_array()));
            })
        };
        let along = |of: fn(&JointForce) -> f64| {
            self.numbers(py, &[joints], move |world, to| to.extend(joint_forces_of(world).iter().map(of)))
        };
        Columns::new(py)
            .with("forces", vectors(|joint| joint.force)?)?
            .with("torques", vectors(|joint| joint.torque)?)?
            .with("motors", along(|joint| joint.motor)?)?
            .with("couplings", along(|joint| joint.coupling)?)?
            .build("JointForces")
    }

    /// The forces of the contacts of a world that push: ContactForces.
    fn contact_forces<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = whole::world)] world: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let world = self.one(py, world)?;
        let found = self.read(py, |worlds| forces_of(&worlds[world]).map(|forces| forces.contacts.clone()));
        forces::of_contacts(py, &found.unwrap_or_default())
    }

    /// What the steps of a world since its beginning did not do as its scene asks, in lines for
    /// users, as in Simulation.warnings. Overlaps are those of now, and are measured for this.
    fn warnings(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = whole::world)] world: usize,
    ) -> PyResult<Vec<String>> {
        let world = self.one(py, world)?;
        let warnings = self.read(py, |worlds| worlds[world].warnings());
        Ok(warnings.into_iter().map(|warning| warning.message).collect())
    }

    /// The contacts of a world at the beginning of the last step: StepContacts.
    fn contacts<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = whole::world)] world: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let world = self.one(py, world)?;
        let (found, hidden) = self.read(py, |worlds| {
            let engine = worlds[world].engine();
            (engine.contacts().to_vec(), engine.hidden().to_vec())
        });
        contacts::of_step(py, &found, &hidden)
    }

    /// Masses [n, B], kg; inf of bodies that are not free.
    #[getter]
    fn masses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [bodies, _] = self.counts(py);
        self.numbers(py, &[bodies], |world, to| to.extend(settings::masses(world.engine().system())))
    }

    /// Coefficients of friction [n, B] of the bodies.
    #[getter]
    fn frictions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [bodies, _] = self.counts(py);
        self.numbers(py, &[bodies], |world, to| to.extend(settings::frictions(world.engine().system())))
    }

    /// Coefficients of torsional friction [n, B] of the bodies, m.
    #[getter]
    fn frictions_torsional<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [bodies, _] = self.counts(py);
        self.numbers(py, &[bodies], |world, to| {
            to.extend(settings::frictions_torsional(world.engine().system()));
        })
    }

    /// Gravity [n, 3], m/s².
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, &[3], |world, to| to.extend(world.engine().system().gravity.to_array()))
    }

    /// Number of worlds.
    fn __len__(&self, py: Python<'_>) -> usize {
        self.read(py, <[World]>::len)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (worlds, [bodies, _]) = (self.__len__(py), self.counts(py));
        format!("<tesdf.Worlds: {worlds} worlds of {bodies} bodies>")
    }
}
