//! Queries on a device.
use std::sync::{Arc, Mutex, PoisonError};

use numpy::PyArray1;
use pyo3::prelude::*;
use tesdf::TeSdf;
use tesdf::collide::{Placement, Pose, Shape};
use tesdf::glam::DVec3;
use tesdf_gpu::{DeviceAnswers, GpuError, GpuShapes, WorldAnswer};

use super::array::{DeviceArray, Words};
use super::foreign::{Named, RowsThere, rows_there};
use super::gpu::Device;
use crate::arrays::{self, Rows};
use crate::errors::Error;
use crate::{classes, pool};

/// An asset on the device of its last query.
#[derive(Default)]
pub struct HeldShapes(Mutex<Option<(Device, Arc<GpuShapes>)>>);

impl HeldShapes {
    fn shapes(&self, asset: &Arc<TeSdf>, device: &Device) -> Result<Arc<GpuShapes>, GpuError> {
        let mut held = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match &*held {
            Some((of, shapes)) if of.is(device) => Ok(Arc::clone(shapes)),
            _ => {
                let shapes = GpuShapes::upload(device.inner(), &[Shape::Mesh(Arc::clone(asset))])?;
                let shapes = Arc::new(shapes);
                *held = Some((device.clone(), Arc::clone(&shapes)));
                Ok(shapes)
            }
        }
    }
}

/// The frame of the mesh.
const IN_PLACE: Placement = Placement { pose: Pose::IDENTITY, scale: 1.0 };

/// The points of a query.
const POINTS: Named = Named { name: "points", columns: 3 };

/// Number of points between two checks for Python's signals.
const CHUNK: usize = 1 << 19;

/// The device on which an object is that this package has made.
pub fn of_array(array: &Bound<'_, PyAny>) -> Option<Device> {
    array.cast::<DeviceArray>().ok().map(|array| array.get().device.clone())
}

/// The answers at points: `Answers`, or `DeviceAnswers` for points that are on the device.
pub fn query<'py>(
    held: &HeldShapes,
    asset: &Arc<TeSdf>,
    points: &Bound<'py, PyAny>,
    device: &Device,
) -> PyResult<Bound<'py, PyAny>> {
    let py = points.py();
    let failed = |e| Error::Device(e).raise(py);
    let there = rows_there(POINTS, points, device)?;
    let shapes = py.detach(|| held.shapes(asset, device)).map_err(failed)?;
    match there {
        Some(there) => stay(py, &shapes, device, &there),
        None => copied(&shapes, points),
    }
}

/// Answers that stay on the device.
fn stay<'py>(
    py: Python<'py>,
    shapes: &GpuShapes,
    device: &Device,
    points: &RowsThere,
) -> PyResult<Bound<'py, PyAny>> {
    let rows = points.rows;
    let array = &points.array;
    let answers = py.detach(|| {
        let answers = DeviceAnswers::empty(device.inner(), rows)?;
        shapes.signed_distances_into(array, &[(shapes.ids()[0], IN_PLACE)], &answers)?;
        // Other libraries may then free the points, and read the answers in any stream.
        device.inner().wait()?;
        Ok(answers)
    });
    let answers = answers.map_err(|e: GpuError| Error::Device(e).raise(py))?;
    let of = |words, shape| Bound::new(py, DeviceArray { device: device.clone(), words, shape });
    classes::device_answers(py)?.call1((
        of(Words::F32(answers.signed_distances), vec![rows])?,
        of(Words::F32(answers.gradients), vec![rows, 3])?,
        of(Words::F32(answers.closest_points), vec![rows, 3])?,
        of(Words::U32(answers.faces), vec![rows])?,
    ))
}

/// Answers to points of the processor, as numpy arrays.
fn copied<'py>(shapes: &GpuShapes, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = points.py();
    let points = Rows::new("points", points)?;
    let points = points.as_slice()?;
    let instances = [(shapes.ids()[0], IN_PLACE)];
    let pool = pool::shared().map_err(|e| e.raise(py))?;
    let mut found: Vec<WorldAnswer> = Vec::with_capacity(points.len());
    for chunk in points.chunks(CHUNK) {
        let answers = py.detach(|| pool.install(|| shapes.signed_distances(chunk, &instances)));
        found.extend(answers.map_err(|e| Error::Device(e).raise(py))?.into_iter().flatten());
        py.check_signals()?;
    }
    let of = |part: fn(&WorldAnswer) -> DVec3| found.iter().map(part).collect::<Vec<DVec3>>();
    classes::answers(py)?.call1((
        PyArray1::from_iter(py, found.iter().map(|answer| answer.signed_distance)),
        arrays::of_rows(py, &of(|answer| answer.gradient))?,
        arrays::of_rows(py, &of(|answer| answer.closest_point))?,
        PyArray1::from_iter(py, found.iter().map(|answer| answer.face)),
    ))
}
