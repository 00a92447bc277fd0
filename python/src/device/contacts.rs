//! Contacts that stay on a device.
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use tesdf::collide::{CollideOptions, Scene};
use tesdf_gpu::PoseArrays;

use super::array::{DeviceArray, Words};
use super::foreign::{Named, RowsThere, rows_there};
use super::gpu::{Device, HeldDetector};
use crate::arrays;
use crate::contacts::{Columns, hidden_overlaps};
use crate::errors::{Error, argument};

const POSES: Named = Named { name: "poses", columns: 7 };
const VELOCITIES: Named = Named { name: "velocities", columns: 6 };

/// The rows of an array, which is copied to the device unless it is there.
fn rows(named: Named, any: &Bound<'_, PyAny>, device: &Device) -> PyResult<RowsThere> {
    if let Some(there) = rows_there(named, any, device)? {
        return Ok(there);
    }
    let py = any.py();
    let given =
        py.import("numpy")?.call_method1("asarray", (arrays::on_host(any)?, numpy::dtype::<f32>(py), "C"))?;
    let numbers = given.cast_into::<PyArrayDyn<f32>>()?.try_readonly()?;
    let &[count, columns] = numbers.shape() else {
        return Err(named.wrong(format!("an array of shape {:?}", numbers.shape())));
    };
    if columns != named.columns {
        return Err(named.wrong(format!("an array of shape {:?}", numbers.shape())));
    }
    RowsThere::upload(device, count, numbers.as_slice()?).map_err(|e| Error::Device(e).raise(py))
}

/// `DeviceContacts`: the contacts of a scene with its instances at the given poses and velocities,
/// which are used in place where they are on the device.
pub fn detect_on_device<'py>(
    py: Python<'py>,
    held: &HeldDetector,
    device: &Device,
    scene: &Scene,
    poses: Option<&Bound<'py, PyAny>>,
    velocities: Option<&Bound<'py, PyAny>>,
    options: &CollideOptions,
) -> PyResult<Bound<'py, PyAny>> {
    let poses = poses.map(|any| rows(POSES, any, device)).transpose()?;
    let velocities = velocities.map(|any| rows(VELOCITIES, any, device)).transpose()?;
    let given = match (&poses, &velocities) {
        (Some(poses), velocities) => {
            let velocities = velocities.as_ref().map(|rows| &rows.array);
            Some(PoseArrays { poses: &poses.array, velocities })
        }
        (None, Some(_)) => {
            return Err(argument("velocities", "an array without poses", "both, or poses alone"));
        }
        (None, None) => None,
    };
    let detector = held.detector(device);
    let found = py.detach(|| detector.detect_on_device(scene, given.as_ref(), options));
    let found = found.map_err(|e| Error::Device(e).raise(py))?;
    let count = found.count;
    let of = |words, shape| {
        Ok::<_, PyErr>(Bound::new(py, DeviceArray { device: device.clone(), words, shape })?.into_any())
    };
    Columns::new(py)
        .with("point_a", of(Words::F32(found.points_a), vec![count, 3])?)?
        .with("point_b", of(Words::F32(found.points_b), vec![count, 3])?)?
        .with("normal", of(Words::F32(found.normals), vec![count, 3])?)?
        .with("distance", of(Words::F32(found.distances), vec![count])?)?
        .with("instances", of(Words::U32(found.instances), vec![count, 2])?)?
        .with("hidden", hidden_overlaps(py, &found.hidden)?)?
        .build("DeviceContacts")
}
