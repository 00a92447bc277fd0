//! Options of a detection, from keywords.
use std::num::NonZeroUsize;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use tesdf::Length;
use tesdf::base::Named;
use tesdf::collide::{CollideOptions, FaceOptions, ModeChoices, Reduction};

use crate::errors::{Error, argument, kind_of};
use crate::whole::Whole;

/// The keywords, in the order of the documentation.
const NAMES: &str = "mode, contacts_per, contact_distance, speculative_time, cos_theta, iterations, tolerance, reduce, \
                     spread, precision or threads";

/// The options of a detection. They have the names and defaults of `tesdf collide`, and those of
/// the library where the command has none.
pub struct Keywords {
    pub options: CollideOptions,
    pub threads: Option<NonZeroUsize>,
}

impl Keywords {
    /// Converts the keywords of `function`.
    ///
    /// # Errors
    /// `TypeError` for an unknown keyword; `ValueError` for a value of another type, an unknown
    /// name, and keywords that exclude each other. `CollideError` for a keyword that the mode does
    /// not use. The library checks ranges.
    pub fn new(function: &str, keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut found = Self { options: CollideOptions::default(), threads: None };
        let mut reduction: Option<(String, Reduction)> = None;
        let mut choices = ModeChoices::default();
        for (name, value) in keywords.into_iter().flatten() {
            let name: String = name.extract()?;
            let options = &mut found.options;
            match name.as_str() {
                "mode" => choices.mode = Some(named(&name, &value)?),
                "contacts_per" => choices.contacts_per = optional(&name, &value, named)?,
                "contact_distance" => options.contact_distance = number(&name, &value)?,
                "speculative_time" => options.speculative_time = number(&name, &value)?,
                "cos_theta" => choices.cos_theta = optional(&name, &value, number)?,
                "iterations" => choices.iterations = optional(&name, &value, count)?,
                "tolerance" => {
                    choices.tolerance = optional(&name, &value, number)?.map(Length::Absolute);
                }
                "precision" => options.precision = named(&name, &value)?,
                "threads" => found.threads = optional(&name, &value, threads)?,
                "reduce" | "spread" => {
                    let Some(kept) = optional(&name, &value, count)? else { continue };
                    if let Some((other, _)) = &reduction {
                        let found = format!("given together with {other}");
                        return Err(argument(&name, found, "one of them"));
                    }
                    let kind = match name.as_str() {
                        "reduce" => Reduction::PerPair(kept),
                        _ => Reduction::Spread(kept),
                    };
                    reduction = Some((name, kind));
                }
                _ => {
                    let text = format!("{function}() has no keyword '{name}'; expected {NAMES}");
                    return Err(PyTypeError::new_err(text));
                }
            }
        }
        let mode = choices.mode(FaceOptions::default());
        found.options.mode = Python::attach(|py| mode.map_err(|e| Error::Collide(e).raise(py)))?;
        found.options.reduction = reduction.map_or(Reduction::None, |(_, kind)| kind);
        Ok(found)
    }
}

/// Converts a length in the world's unit; None is `default`.
pub fn tolerance(any: Option<&Bound<'_, PyAny>>, default: Length) -> PyResult<Length> {
    match any {
        Some(any) if !any.is_none() => number("tolerance", any).map(Length::Absolute),
        _ => Ok(default),
    }
}

/// Converts the name of a choice.
pub fn named<T: Named>(name: &str, any: &Bound<'_, PyAny>) -> PyResult<T> {
    let text = any.cast::<PyString>().map(|text| text.to_string());
    let found = match &text {
        Ok(text) => match T::of_name(text) {
            Some(value) => return Ok(value),
            None => format!("'{text}'"),
        },
        Err(_) => kind_of(any),
    };
    Err(argument(name, found, &T::names("'")))
}

fn number(name: &str, any: &Bound<'_, PyAny>) -> PyResult<f64> {
    any.extract().map_err(|_| argument(name, shown(any), "a number"))
}

fn count(name: &str, any: &Bound<'_, PyAny>) -> PyResult<u32> {
    any.extract().map_err(|_| argument(name, shown(any), u32::RANGE))
}

fn threads(name: &str, any: &Bound<'_, PyAny>) -> PyResult<NonZeroUsize> {
    any.extract().map_err(|_| argument(name, shown(any), "an integer greater than 0"))
}

fn optional<'py, T>(
    name: &str,
    any: &Bound<'py, PyAny>,
    convert: impl Fn(&str, &Bound<'py, PyAny>) -> PyResult<T>,
) -> PyResult<Option<T>> {
    if any.is_none() { Ok(None) } else { convert(name, any).map(Some) }
}

/// A number as it is, and another object by its type.
fn shown(any: &Bound<'_, PyAny>) -> String {
    match any.extract::<f64>() {
        Ok(_) => any.to_string(),
        Err(_) => kind_of(any),
    }
}
