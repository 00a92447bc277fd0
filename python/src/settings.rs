//! What is set between steps, from arguments: bodies and joints by name or number, motors, masses,
//! states.
use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use tesdf::collide::{Pose, Velocity};
use tesdf::glam::{DMat3, DQuat, DVec3};
use tesdf_sim::newton::Newton;
use tesdf_sim::{Drive, Dynamics, Mass, MassProperties, Motor, State, System, World, inertia_matrix};

use crate::errors::{Error, argument, kind_of};
use crate::poses::{self, of_pose, of_twist, of_velocity};

/// The number of a body or joint, given by its name or number.
pub fn index_of(what: &str, any: &Bound<'_, PyAny>, names: &[String]) -> PyResult<usize> {
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

/// Names of the bodies.
pub fn bodies(system: &System) -> Vec<String> {
    system.bodies().iter().map(|body| body.name.clone()).collect()
}

/// Names of the joints.
pub fn joints(system: &System) -> Vec<String> {
    system.joints().iter().map(|joint| joint.name.clone()).collect()
}

/// The motor of one drive; `None` without one.
pub fn motor(
    velocity: Option<f64>,
    position: Option<f64>,
    force: Option<f64>,
    spring: Option<[f64; 3]>,
    limit: f64,
) -> PyResult<Option<Motor>> {
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
            let expected = "one of velocity, position, force and spring, or spring with velocity and force";
            return Err(argument("joint", "several drives", expected));
        }
    };
    Ok(drive.map(|drive| Motor { drive, limit }))
}

/// Sets the mass of a free body. What is not given follows from the mass properties in the scene.
pub fn set_mass(
    world: &mut World,
    body: usize,
    mass: f64,
    center: Option<[f64; 3]>,
    inertia: Option<[f64; 6]>,
) -> Result<(), Error> {
    let name = world.engine().system().bodies()[body].name.clone();
    let refused = |e: tesdf_sim::MassError| Error::Mass(name.clone(), e);
    let scaled = match world.first_masses()[body] {
        Mass::Free(before) => before.with_mass(mass).map_err(refused)?,
        // The engine refuses it.
        Mass::Fixed | Mass::Kinematic => {
            MassProperties { mass, center: DVec3::ZERO, inertia: DMat3::IDENTITY }
        }
    };
    let inertia = inertia.map_or(scaled.inertia, inertia_matrix);
    let center = center.map_or(scaled.center, DVec3::from_array);
    let properties = MassProperties::new(mass, center, inertia).map_err(refused)?;
    world.engine_mut().set_mass(body, properties).map_err(Error::Dynamics)
}

/// Sets what is given of the state of a body.
pub fn set_state(
    engine: &mut Newton,
    body: usize,
    pose: Option<Pose>,
    velocity: Option<Velocity>,
) -> Result<(), Error> {
    let mut state = engine.system().states()[body];
    state.pose = pose.unwrap_or(state.pose);
    if let Some(Velocity { linear, angular }) = velocity {
        (state.linear, state.angular) = (linear, angular);
    }
    engine.set_state(body, state).map_err(Error::Dynamics)
}

/// The states at which worlds begin again, one list for each of `rows` worlds: poses [.., B, 7] and
/// velocities [.., B, 6] for each world or for all, or those of `first`.
pub fn states(
    first: &[State],
    rows: usize,
    poses: Option<&Bound<'_, PyAny>>,
    velocities: Option<&Bound<'_, PyAny>>,
) -> PyResult<Option<Vec<Vec<State>>>> {
    if poses.is_none() && velocities.is_none() {
        return Ok(None);
    }
    let mut states = vec![first.to_vec(); rows];
    if let Some(any) = poses {
        let found = of_bodies::<7>("poses", any, rows, first.len())?;
        for (row, (of_world, states)) in found.iter().zip(&mut states).enumerate() {
            for (body, (&[x, y, z, i, j, k, w], state)) in of_world.iter().zip(states).enumerate() {
                let pose = Pose { translation: DVec3::new(x, y, z), rotation: DQuat::from_xyzw(i, j, k, w) };
                // Only checked: poses that were read from a simulation stay bit for bit.
                Pose::new(pose.translation, pose.rotation).map_err(|e| {
                    let at = if rows == 1 { String::new() } else { format!("row {row}, ") };
                    Error::CollideAt(format!("poses: {at}body {body}"), e).raise(any.py())
                })?;
                state.pose = pose;
            }
        }
    }
    if let Some(any) = velocities {
        let found = of_bodies::<6>("velocities", any, rows, first.len())?;
        for (row, state) in found.iter().flatten().zip(states.iter_mut().flatten()) {
            let Velocity { linear, angular } = of_twist(row);
            (state.linear, state.angular) = (linear, angular);
        }
    }
    Ok(Some(states))
}

/// N numbers for each body of each of `rows` worlds, or for each body in all.
fn of_bodies<const N: usize>(
    name: &str,
    any: &Bound<'_, PyAny>,
    rows: usize,
    bodies: usize,
) -> PyResult<Vec<Vec<[f64; N]>>> {
    let array = poses::floats(name, any)?;
    let numbers = array.as_slice()?.as_chunks::<N>().0;
    match *array.shape() {
        [b, n] if [b, n] == [bodies, N] => Ok(vec![numbers.to_vec(); rows]),
        [w, b, n] if [w, b, n] == [rows, bodies, N] => {
            Ok((0..rows).map(|row| numbers[row * bodies..(row + 1) * bodies].to_vec()).collect())
        }
        _ => {
            let of_each = match rows {
                1 => String::new(),
                _ => format!(", or ({rows}, {bodies}, {N}) with a row for each world"),
            };
            let expected = format!("shape ({bodies}, {N}), a row for each body{of_each}");
            Err(poses::shape_error(name, &array, &expected))
        }
    }
}

/// The seven numbers of each body's pose, and the six of its velocity.
pub fn rows_of(states: &[State]) -> impl Iterator<Item = ([f64; 7], [f64; 6])> {
    states
        .iter()
        .map(|&State { pose, linear, angular }| (of_pose(&pose), of_velocity(&Velocity { linear, angular })))
}

/// The mass of each body, kg; inf of one that is not free.
pub fn masses(system: &System) -> impl Iterator<Item = f64> {
    system.bodies().iter().map(|body| match body.mass {
        Mass::Free(mass) => mass.mass,
        Mass::Fixed | Mass::Kinematic => f64::INFINITY,
    })
}

/// The coefficient of friction of each body.
pub fn frictions(system: &System) -> impl Iterator<Item = f64> {
    system.bodies().iter().map(|body| body.friction)
}

/// The coefficient of torsional friction of each body, m.
pub fn frictions_torsional(system: &System) -> impl Iterator<Item = f64> {
    system.bodies().iter().map(|body| body.friction_torsional)
}

/// An array of this shape.
pub fn shaped<'py>(
    py: Python<'py>,
    numbers: impl IntoIterator<Item = f64>,
    shape: impl Into<Vec<usize>>,
) -> PyResult<Bound<'py, PyAny>> {
    let numbers: Vec<f64> = numbers.into_iter().collect();
    Ok(PyArray1::from_vec(py, numbers).reshape(numpy::ndarray::IxDyn(&shape.into()))?.into_any())
}
