//! Poses, velocities and motions from numpy arrays.
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use tesdf::collide::{CollideError, Motion, Pose, Velocity};
use tesdf::glam::{DQuat, DVec3};

use crate::arrays;
use crate::errors::{Error, argument};

/// How many poses or velocities an argument has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// One, without an axis for rows.
    One,
    /// Any number of rows.
    Rows,
}

/// Converts poses: translation and unit quaternion, x y z qx qy qz qw, or matrices of 4 × 4.
///
/// # Errors
/// `ValueError` for other shapes; `CollideError` names the row that is not a pose.
pub fn poses(name: &str, any: &Bound<'_, PyAny>, count: Count) -> PyResult<Vec<Pose>> {
    let array = floats(name, any)?;
    let numbers = array.as_slice()?;
    let found: Vec<Result<Pose, CollideError>> = match (count, array.shape()) {
        (Count::One, [7]) | (Count::Rows, [_, 7]) => rows(numbers).map(of_quaternion).collect(),
        (Count::One, [4, 4]) | (Count::Rows, [_, 4, 4]) => rows(numbers).map(Pose::from_matrix).collect(),
        _ => {
            let expected = match count {
                Count::One => "shape (7,), x y z qx qy qz qw, or (4, 4)",
                Count::Rows => "shape (N, 7), each x y z qx qy qz qw, or (N, 4, 4)",
            };
            return Err(shape_error(name, &array, expected));
        }
    };
    let named = |(row, pose): (usize, Result<Pose, CollideError>)| {
        let at = if count == Count::One { name.to_string() } else { format!("{name}: row {row}") };
        pose.map_err(|e| Error::CollideAt(at, e).raise(any.py()))
    };
    found.into_iter().enumerate().map(named).collect()
}

/// Converts velocities: linear, then angular in radians, vx vy vz wx wy wz. The scene checks that
/// they are finite.
///
/// # Errors
/// `ValueError` for other shapes.
pub fn velocities(name: &str, any: &Bound<'_, PyAny>, count: Count) -> PyResult<Vec<Velocity>> {
    let array = floats(name, any)?;
    match (count, array.shape()) {
        (Count::One, [6]) | (Count::Rows, [_, 6]) => Ok(rows(array.as_slice()?).map(of_twist).collect()),
        (Count::One, _) => Err(shape_error(name, &array, "shape (6,), vx vy vz wx wy wz")),
        (Count::Rows, _) => Err(shape_error(name, &array, "shape (N, 6), each vx vy vz wx wy wz")),
    }
}

/// Converts the motion of a body: a velocity of six numbers or a screw of eight, by the command's
/// names, or neither.
///
/// # Errors
/// `ValueError` for both, or for other shapes. The library checks the numbers.
pub fn motion(
    body: char,
    velocity: Option<&Bound<'_, PyAny>>,
    screw: Option<&Bound<'_, PyAny>>,
) -> PyResult<Motion> {
    match (velocity, screw) {
        (None, None) => Ok(Motion::Rest),
        (Some(velocity), None) => {
            let name = format!("velocity_{body}");
            let velocities = velocities(&name, velocity, Count::One)?;
            Ok(velocities.first().map_or(Motion::Rest, |&velocity| Motion::Linear { velocity }))
        }
        (None, Some(screw)) => {
            let array = floats(&format!("screw_{body}"), screw)?;
            let ([8], Some(screw)) = (array.shape(), rows(array.as_slice()?).next()) else {
                let expected = "shape (8,), px py pz ax ay az omega pitch";
                return Err(shape_error(&format!("screw_{body}"), &array, expected));
            };
            Ok(of_screw(screw))
        }
        (Some(_), Some(_)) => {
            let found = format!("given together with screw_{body}");
            Err(argument(&format!("velocity_{body}"), found, "one of them"))
        }
    }
}

/// Converts the motions of the bodies of this number of pairs, as [`motion`] does that of one.
/// `None` if neither is given.
///
/// # Errors
/// `ValueError` for both, or for other shapes. The library checks the numbers.
pub fn motions(
    body: char,
    velocities: Option<&Bound<'_, PyAny>>,
    screws: Option<&Bound<'_, PyAny>>,
    pairs: usize,
) -> PyResult<Option<Vec<Motion>>> {
    let (name, width, any) = match (velocities, screws) {
        (None, None) => return Ok(None),
        (Some(any), None) => (format!("velocities_{body}"), 6, any),
        (None, Some(any)) => (format!("screws_{body}"), 8, any),
        (Some(_), Some(_)) => {
            let found = format!("given together with screws_{body}");
            return Err(argument(&format!("velocities_{body}"), found, "one of them"));
        }
    };
    let array = floats(&name, any)?;
    if array.shape() != [pairs, width] {
        return Err(shape_error(&name, &array, &format!("shape ({pairs}, {width}), a row for each pair")));
    }
    let numbers = array.as_slice()?;
    Ok(Some(match width {
        6 => rows(numbers).map(|row| Motion::Linear { velocity: of_twist(row) }).collect(),
        _ => rows(numbers).map(of_screw).collect(),
    }))
}

/// Converts numbers, of which one stands for all rows.
///
/// # Errors
/// `ValueError` names the argument and the shape.
pub fn numbers(name: &str, any: &Bound<'_, PyAny>, rows: usize) -> PyResult<Vec<f64>> {
    let array = floats(name, any)?;
    match *array.shape() {
        [] => Ok(vec![array.as_slice()?[0]; rows]),
        [n] if n == rows => Ok(array.as_slice()?.to_vec()),
        _ => Err(shape_error(name, &array, &format!("a number, or shape ({rows},): one for each instance"))),
    }
}

/// Converts a pose for each of some rows, or one for all.
///
/// # Errors
/// As [`poses`].
pub fn poses_of(name: &str, any: &Bound<'_, PyAny>, rows: usize) -> PyResult<Vec<Pose>> {
    let shape = floats(name, any)?.shape().to_vec();
    match *shape {
        [7] | [4, 4] => Ok(vec![poses(name, any, Count::One)?[0]; rows]),
        [n, 7] | [n, 4, 4] if n == rows => poses(name, any, Count::Rows),
        _ => {
            let expected =
                format!("shape (7,), x y z qx qy qz qw, or (4, 4), or ({rows}, …) with a row for each world");
            Err(shape_error(name, &floats(name, any)?, &expected))
        }
    }
}

/// Converts N numbers for each of some rows, or N for all.
///
/// # Errors
/// `ValueError` names the argument and the shape.
pub fn columns<const N: usize>(name: &str, any: &Bound<'_, PyAny>, rows: usize) -> PyResult<Vec<[f64; N]>> {
    let array = floats(name, any)?;
    let numbers = array.as_slice()?.as_chunks::<N>().0;
    let (one, each): (&[usize], Vec<usize>) = if N == 1 { (&[], vec![rows]) } else { (&[N], vec![rows, N]) };
    match array.shape() {
        shape if shape == one => Ok(vec![numbers[0]; rows]),
        shape if shape == each => Ok(numbers.to_vec()),
        _ => {
            let of_each = if N == 1 {
                format!("a number, or shape ({rows},)")
            } else {
                format!("shape ({N},) or ({rows}, {N})")
            };
            Err(shape_error(name, &array, &format!("{of_each} with a row for each world")))
        }
    }
}

/// Converts numbers of 32 bits, of which one stands for all rows.
///
/// # Errors
/// `ValueError` names the argument, and the shape or the number.
pub fn words(name: &str, any: &Bound<'_, PyAny>, rows: usize) -> PyResult<Vec<u32>> {
    let expected = format!("an integer, or shape ({rows},): one for each instance");
    let array = arrays::integers(name, any, &expected, |shape| shape.is_empty() || *shape == [rows])?;
    let word = |&number: &i64| {
        u32::try_from(number).map_err(|_| argument(name, number, "integers from 0 to 2^32 - 1"))
    };
    let words = array.as_slice()?.iter().map(word).collect::<PyResult<Vec<u32>>>()?;
    Ok(if array.shape().is_empty() { vec![words[0]; rows] } else { words })
}

/// The seven numbers of a pose.
pub fn of_pose(pose: &Pose) -> [f64; 7] {
    let (t, q) = (pose.translation, pose.rotation);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
}

/// The six numbers of a velocity.
pub fn of_velocity(velocity: &Velocity) -> [f64; 6] {
    let Velocity { linear: v, angular: w } = velocity;
    [v.x, v.y, v.z, w.x, w.y, w.z]
}

/// An argument as an array `float64` of any shape.
///
/// # Errors
/// As [`arrays::floats`].
pub fn floats<'py>(name: &str, any: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    Ok(arrays::floats(name, any)?.cast_into::<PyArrayDyn<f64>>()?.try_readonly()?)
}

pub fn shape_error(name: &str, array: &PyReadonlyArrayDyn<'_, f64>, expected: &str) -> PyErr {
    match array.getattr("shape") {
        Ok(shape) => argument(name, format!("an array of shape {shape}"), expected),
        Err(e) => e,
    }
}

fn rows<const N: usize>(numbers: &[f64]) -> impl Iterator<Item = &[f64; N]> {
    numbers.as_chunks::<N>().0.iter()
}

fn of_quaternion(&[x, y, z, i, j, k, w]: &[f64; 7]) -> Result<Pose, CollideError> {
    Pose::new(DVec3::new(x, y, z), DQuat::from_xyzw(i, j, k, w))
}

/// The velocity of six numbers.
pub fn of_twist(&[x, y, z, i, j, k]: &[f64; 6]) -> Velocity {
    Velocity { linear: DVec3::new(x, y, z), angular: DVec3::new(i, j, k) }
}

fn of_screw(&[px, py, pz, ax, ay, az, angular_speed, pitch]: &[f64; 8]) -> Motion {
    let [point, axis] = [[px, py, pz], [ax, ay, az]].map(DVec3::from_array);
    Motion::Screw { point, axis, angular_speed, pitch }
}
