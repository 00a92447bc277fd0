//! Converts between numpy arrays and the library's slices, without a copy where possible.
use bytemuck::Pod;
use numpy::ndarray::ArrayView;
use numpy::{
    Element, IntoPyArray, PyArray1, PyArray2, PyArrayDescrMethods, PyArrayMethods, PyReadonlyArray2,
    PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use tesdf::glam::DVec3;

use crate::errors::argument;

/// Rows of three `f64`. A contiguous and aligned array is used in place, other arrays are copied.
pub struct Rows<'py>(PyReadonlyArray2<'py, f64>);

impl<'py> Rows<'py> {
    /// Converts any object that numpy can convert to a `float64` array of shape `[N, 3]`.
    ///
    /// # Errors
    /// `ValueError` names the argument and the shape that was found.
    pub fn new(name: &str, any: &Bound<'py, PyAny>) -> PyResult<Self> {
        Self::of(name, &floats(name, any)?, "shape (N, 3)")
    }

    fn of(name: &str, array: &Bound<'py, PyAny>, expected: &str) -> PyResult<Self> {
        match array.extract::<PyReadonlyArray2<'py, f64>>() {
            Ok(rows) if rows.shape()[1] == 3 => Ok(Self(rows)),
            _ => {
                let shape = array.getattr("shape")?;
                Err(argument(name, format!("an array of shape {shape}"), expected))
            }
        }
    }

    /// The rows as a slice.
    pub fn as_slice(&self) -> PyResult<&[DVec3]> {
        Ok(bytemuck::cast_slice(self.0.as_slice()?))
    }
}

/// Points `[N, 3]`, or one point `[3]`.
pub struct Points<'py> {
    rows: Rows<'py>,
    is_one: bool,
}

impl<'py> Points<'py> {
    /// As [`Rows::new`] for the argument `points`.
    ///
    /// # Errors
    /// Those of [`Rows::new`].
    pub fn new(any: &Bound<'py, PyAny>) -> PyResult<Self> {
        let array = floats("points", any)?;
        let is_one = array.getattr("shape")?.eq((3,))?;
        let array = if is_one { array.call_method1("reshape", (1, 3))? } else { array };
        Ok(Self { rows: Rows::of("points", &array, "shape (N, 3) or (3,)")?, is_one })
    }

    /// The points as a slice.
    pub fn as_slice(&self) -> PyResult<&[DVec3]> {
        self.rows.as_slice()
    }

    /// What is answered, from an array with a row for each point: of one point, that row.
    pub fn answered<T>(&self, rows: Bound<'py, T>) -> PyResult<Bound<'py, PyAny>> {
        if self.is_one { rows.into_any().get_item(0) } else { Ok(rows.into_any()) }
    }
}

/// A contiguous array `float64`, in place where the object is one.
///
/// # Errors
/// `ValueError` for complex numbers, truth values, text and times, which numpy would convert, too.
pub fn floats<'py>(name: &str, any: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = any.py();
    static ASARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let array = ASARRAY.import(py, "numpy", "asarray")?.call1((on_host(any)?,))?;
    let dtype = array.cast::<PyUntypedArray>()?.dtype();
    if !matches!(dtype.kind(), b'f' | b'i' | b'u' | b'O') {
        return Err(argument(name, format!("an array of {dtype}"), "real numbers"));
    }
    static REQUIRE: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let require = REQUIRE.import(py, "numpy", "require")?;
    require.call1((array, numpy::dtype::<f64>(py), ["C_CONTIGUOUS", "ALIGNED"]))
}

/// An object that numpy converts: the array of an object that has its memory by DLPack alone, and
/// any other object as it is.
///
/// # Errors
/// `BufferError` for memory that is not on the processor.
pub fn on_host<'py>(any: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    if any.cast::<PyUntypedArray>().is_err() && any.hasattr("__dlpack__")? && !any.hasattr("__array__")? {
        return any.py().import("numpy")?.call_method1("from_dlpack", (any,));
    }
    Ok(any.clone())
}

/// Converts an array of integers of any type, whose shape must satisfy `fits`. Without numbers, its
/// type does not matter: numpy makes floats of an empty list.
///
/// # Errors
/// `ValueError` names the argument, and what was found and expected.
pub fn integers<'py>(
    name: &str,
    any: &Bound<'py, PyAny>,
    expected: &str,
    fits: impl Fn(&[usize]) -> bool,
) -> PyResult<PyReadonlyArrayDyn<'py, i64>> {
    let py = any.py();
    let array = py.import("numpy")?.call_method1("asarray", (on_host(any)?,))?;
    let untyped = array.cast::<PyUntypedArray>()?;
    if !fits(untyped.shape()) {
        return Err(argument(name, format!("an array of shape {}", array.getattr("shape")?), expected));
    }
    if !untyped.is_empty() && !matches!(untyped.dtype().kind(), b'i' | b'u') {
        return Err(argument(name, format!("an array of {}", untyped.dtype()), "integers"));
    }
    array.call_method1("astype", (numpy::dtype::<i64>(py), "C"))?.extract()
}

/// Converts an array of ids of shape `[N]`.
///
/// # Errors
/// `ValueError` names the argument and what was found.
pub fn ids(name: &str, any: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    let numbers = integers(name, any, "shape (N,)", |shape| shape.len() == 1)?;
    let id = |&number: &i64| {
        u32::try_from(number)
            .map_err(|_| argument(name, format!("the id {number}"), "ids from 0 to 2^32 - 1 (0-based)"))
    };
    numbers.as_slice()?.iter().map(id).collect()
}

/// An array of shape `[N, 3]` with one row per vector.
pub fn of_rows<'py>(py: Python<'py>, vectors: &[DVec3]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, bytemuck::cast_slice(vectors)).reshape([vectors.len(), 3])
}

/// An array of shape `[F, 3]` with one row per face.
pub fn of_faces<'py>(py: Python<'py>, faces: &[[u32; 3]]) -> PyResult<Bound<'py, PyArray2<u32>>> {
    faces.as_flattened().to_vec().into_pyarray(py).reshape([faces.len(), 3])
}

/// A read-only array of shape `[N]`, or `[N, columns]` if `columns` is not 1, over memory of
/// `owner`. The array keeps `owner` alive.
///
/// # Safety
/// `numbers` must neither move nor change while `owner` lives.
pub unsafe fn view<'py, T: Element + Pod>(
    owner: &Bound<'py, PyAny>,
    numbers: &[T],
    columns: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let flat = ArrayView::from(numbers);
    // SAFETY: the caller guarantees that the memory lives as long as the owner, which becomes the
    // array's base.
    let array = unsafe { PyArray1::borrow_from_array(&flat, owner.clone()) };
    let array = array.try_readwrite()?.make_nonwriteable();
    match columns {
        1 => Ok(array.as_any().clone()),
        _ => Ok(array.reshape([numbers.len() / columns, columns])?.into_any()),
    }
}
