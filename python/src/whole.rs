//! Integers from arguments. Their errors name the argument and what is expected.
use std::num::{NonZeroU32, NonZeroUsize};

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::errors::{argument, kind_of};

/// An integer of a range, or None.
pub trait Whole: Sized {
    /// The range, for messages.
    const RANGE: &str;

    fn of(any: &Bound<'_, PyAny>) -> PyResult<Self>;
}

macro_rules! whole {
    ($($kind:ty: $range:literal),*) => {
        $(impl Whole for $kind {
            const RANGE: &str = $range;

            fn of(any: &Bound<'_, PyAny>) -> PyResult<Self> {
                any.extract()
            }
        })*
    };
}

whole!(
    u32: "an integer from 0 to 2^32 - 1", u64: "an integer from 0 to 2^64 - 1",
    usize: "an integer from 0 to 2^64 - 1",
    NonZeroU32: "an integer from 1 to 2^32 - 1", NonZeroUsize: "an integer from 1 to 2^64 - 1"
);

impl<T: Whole> Whole for Option<T> {
    const RANGE: &str = T::RANGE;

    fn of(any: &Bound<'_, PyAny>) -> PyResult<Self> {
        if any.is_none() { Ok(None) } else { T::of(any).map(Some) }
    }
}

/// An integer argument.
///
/// # Errors
/// `TypeError` for an object that is no integer, `ValueError` for one out of the range. Both name the
/// argument, which PyO3 does not.
pub fn integer<T: Whole>(name: &str, any: &Bound<'_, PyAny>) -> PyResult<T> {
    T::of(any).map_err(|e| match e.is_instance_of::<PyTypeError>(any.py()) {
        true => PyTypeError::new_err(format!("{name}: {}; expected {}", kind_of(any), T::RANGE)),
        false => argument(name, any, T::RANGE),
    })
}

/// A function for `from_py_with` of each argument of that name.
macro_rules! arguments {
    ($($name:ident),*) => {
        $(pub fn $name<T: Whole>(any: &Bound<'_, PyAny>) -> PyResult<T> {
            integer(stringify!($name), any)
        })*
    };
}

arguments!(a, b, contacts, count, every, iterations, part, points, samples, shape, steps, threads, world);
