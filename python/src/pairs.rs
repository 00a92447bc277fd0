//! Pairs of instances: the measures of many pairs in one call.
use std::sync::atomic::{AtomicBool, Ordering};

use pyo3::prelude::*;
use rayon::prelude::*;
use tesdf::collide::{
    self, Clearance, ClearanceOptions, CollideError, InstanceId, Motion, TimeOfImpact, TimeOfImpactOptions,
    clearance, time_of_impact,
};
use tesdf::glam::DVec3;

use crate::contacts::Columns;
use crate::errors::{Error, argument};
use crate::interrupt::cancellable;
use crate::{arrays, pool};

/// Two instances.
pub type Ids = [InstanceId; 2];

/// Converts pairs of ids of instances.
pub fn pairs_of(any: &Bound<'_, PyAny>) -> PyResult<Vec<Ids>> {
    let numbers = arrays::integers("pairs", any, "shape (P, 2)", |shape| matches!(shape, [_, 2]))?;
    let id = |&number: &i64| {
        let expected = "ids from 0 to 2^32 - 1 (0-based)";
        u32::try_from(number)
            .map(InstanceId)
            .map_err(|_| argument("pairs", format!("the id {number}"), expected))
    };
    numbers.as_slice()?.as_chunks::<2>().0.iter().map(|[a, b]| Ok([id(a)?, id(b)?])).collect()
}

/// Measures pairs on all threads. Ctrl-C ends it.
///
/// # Errors
/// The error of the first pair that cannot be measured, with its row.
fn measured<T: Send>(
    py: Python<'_>,
    pairs: &[Ids],
    measure: impl Fn(usize, Ids) -> Result<T, CollideError> + Sync,
) -> PyResult<Vec<T>> {
    let pool = pool::shared().map_err(|e| e.raise(py))?;
    let stop = AtomicBool::new(false);
    let one = |(row, &pair)| match stop.load(Ordering::Relaxed) {
        true => Err((row, CollideError::Stopped)),
        false => measure(row, pair).map_err(|e| (row, e)),
    };
    let work = || {
        let found: Vec<Result<T, _>> = pool.install(|| pairs.par_iter().enumerate().map(one).collect());
        found.into_iter().collect::<Result<Vec<T>, _>>()
    };
    let found = cancellable(py, work, || stop.store(true, Ordering::Relaxed), || Ok(()))?;
    found.map_err(|(row, e)| Error::CollideAt(format!("pairs: row {row}"), e).raise(py))
}

/// `Clearances` of pairs of instances.
pub fn clearances<'py>(
    py: Python<'py>,
    scene: &collide::Scene,
    pairs: &[Ids],
    options: &ClearanceOptions,
) -> PyResult<Bound<'py, PyAny>> {
    let found = measured(py, pairs, |_, [a, b]| clearance(scene, a, b, options))?;
    columns(py, pairs, &found)?.build("Clearances")
}

/// The motions of both bodies of each pair.
pub struct Motions {
    /// Of the first bodies, and of the second ones; nothing if they rest.
    pub of: [Option<Vec<Motion>>; 2],
}

impl Motions {
    fn of_row(&self, row: usize) -> [Motion; 2] {
        [0, 1].map(|body| self.of[body].as_ref().map_or(Motion::Rest, |motions| motions[row]))
    }
}

/// `Impacts` of pairs of moving instances.
pub fn impacts<'py>(
    py: Python<'py>,
    scene: &collide::Scene,
    pairs: &[Ids],
    motions: &Motions,
    options: &TimeOfImpactOptions,
) -> PyResult<Bound<'py, PyAny>> {
    let measure = |row, [a, b]: Ids| {
        let [motion_a, motion_b] = motions.of_row(row);
        time_of_impact(scene, a, b, motion_a, motion_b, options)
    };
    let found = measured(py, pairs, measure)?;
    let time = |found: &TimeOfImpact| match found {
        TimeOfImpact::Impact(impact) => impact.time,
        TimeOfImpact::Free { .. } => f64::INFINITY,
        TimeOfImpact::Undecided(_) => f64::NAN,
    };
    let clearances: Vec<Clearance> =
        found.iter().map(|found| found.clearance().copied().unwrap_or(APART)).collect();
    columns(py, pairs, &clearances)?
        .add("time", found.iter().map(time))?
        .add("free_until", found.iter().map(TimeOfImpact::free_until))?
        .add("iterations", found.iter().map(TimeOfImpact::iterations))?
        .add("touches", found.iter().map(|found| found.impact().is_some()))?
        .add("decided", found.iter().map(|found| !matches!(found, TimeOfImpact::Undecided(_))))?
        .build("Impacts")
}

/// The number of a face that there is not.
const NO_FACE: u32 = tesdf::query::Answer::NO_FACE;

/// The clearance at the impact of bodies that stay apart.
const APART: Clearance = Clearance {
    distance: f64::NAN,
    lower_bound: f64::NAN,
    point_a: DVec3::NAN,
    point_b: DVec3::NAN,
    normal: DVec3::NAN,
    face_a: NO_FACE,
    face_b: NO_FACE,
    field: InstanceId(u32::MAX),
    converged: true,
    overlap: false,
};

fn columns<'py>(py: Python<'py>, pairs: &[Ids], found: &[Clearance]) -> PyResult<Columns<'py>> {
    let of = || found.iter();
    Columns::new(py)
        .add("instance_a", pairs.iter().map(|[a, _]| a.0))?
        .add("instance_b", pairs.iter().map(|[_, b]| b.0))?
        .add("distance", of().map(|c| c.distance))?
        .add("lower_bound", of().map(|c| c.lower_bound))?
        .add_rows("point_a", of().map(|c| c.point_a.to_array()))?
        .add_rows("point_b", of().map(|c| c.point_b.to_array()))?
        .add_rows("normal", of().map(|c| c.normal.to_array()))?
        .add("face_a", of().map(|c| c.face_a))?
        .add("face_b", of().map(|c| c.face_b))?
        .add("field", of().map(|c| c.field.0))?
        .add("converged", of().map(|c| c.converged))?
        .add("overlap", of().map(|c| c.overlap))
}
