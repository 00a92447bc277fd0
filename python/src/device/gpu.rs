//! Devices of the crate `tesdf-gpu`.
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use serde::Serialize;
use tesdf::collide::{CollideOptions, Contacts, Scene};
use tesdf_gpu::{DeviceInfo, SharedDetector};
use tesdf_sim::newton::Detect;

use crate::classes;
use crate::errors::Error;

/// An open device.
#[derive(Clone)]
pub struct Device {
    inner: tesdf_gpu::Device,
    /// What was asked for. The same text is the same device.
    asked: String,
}

/// The devices that are open in a process.
struct Open {
    process: u32,
    devices: Vec<Device>,
}

static OPEN: Mutex<Option<Open>> = Mutex::new(None);

/// Opens the device with this number or name once. With `None` it opens the device that
/// `TESDF_DEVICE` names, or the best device.
///
/// # Errors
/// `DeviceError` if the device does not exist, or if this process was forked from one that has used
/// a device.
pub fn open(py: Python<'_>, name: Option<&str>) -> PyResult<Device> {
    let asked = match name {
        Some(name) => name.to_owned(),
        None => std::env::var("TESDF_DEVICE").unwrap_or_default(),
    };
    py.detach(|| opened(asked, name)).map_err(|e| e.raise(py))
}

fn opened(asked: String, name: Option<&str>) -> Result<Device, Error> {
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    let open = begun(&mut open)?;
    if let Some(device) = open.devices.iter().find(|device| device.asked == asked) {
        return Ok(device.clone());
    }
    let device = Device { inner: tesdf_gpu::Device::choose(name).map_err(Error::Device)?, asked };
    open.devices.push(device.clone());
    Ok(device)
}

/// The open devices of this process. The threads of a driver do not exist in a forked process.
fn begun(open: &mut Option<Open>) -> Result<&mut Open, Error> {
    let process = std::process::id();
    let open = open.get_or_insert_with(|| Open { process, devices: Vec::new() });
    if open.process == process { Ok(open) } else { Err(Error::ForkedWithDevice) }
}

/// A device, as `tesdf.Device` has it.
#[derive(Serialize)]
struct Described {
    number: usize,
    name: String,
    kind: String,
    subgroup_size: (u32, u32),
    has_subgroup_operations: bool,
    max_buffer_bytes: u64,
    has_timestamps: bool,
}

impl Described {
    fn new((number, info): (usize, DeviceInfo)) -> Self {
        Self {
            number,
            name: info.name,
            kind: info.kind.to_string(),
            subgroup_size: info.subgroup_size,
            has_subgroup_operations: info.has_subgroup_operations,
            max_buffer_bytes: info.max_buffer_bytes,
            has_timestamps: info.has_timestamps,
        }
    }
}

/// The devices of this machine, the best first: a list of Device, whose number or a part of whose
/// name is an argument device. Empty where the package was built without the GPU.
#[pyfunction]
pub fn devices(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyAny>>> {
    let found = py.detach(|| -> Result<Vec<DeviceInfo>, Error> {
        begun(&mut OPEN.lock().unwrap_or_else(PoisonError::into_inner))?;
        Ok(tesdf_gpu::devices())
    });
    let found = found.map_err(|e| e.raise(py))?.into_iter().enumerate().map(Described::new);
    found.map(|device| classes::report(py, "Device", &device)).collect()
}

impl Device {
    pub fn inner(&self) -> &tesdf_gpu::Device {
        &self.inner
    }

    pub fn is(&self, other: &Self) -> bool {
        self.inner.is_same(&other.inner)
    }

    /// The name that the driver reports.
    pub fn name(&self) -> &str {
        &self.inner.info().name
    }

    /// A detector for the bodies of a simulation.
    pub fn into_detector(self) -> impl Detect {
        SharedDetector::new(self.inner)
    }
}

/// The detector of a scene, which keeps the shapes on the device of the last detection.
#[derive(Default)]
pub struct HeldDetector(Mutex<Option<(Device, Arc<SharedDetector>)>>);

impl HeldDetector {
    /// Finds the contacts of a scene on a device.
    pub fn detect(
        &self,
        device: &Device,
        scene: &Scene,
        options: &CollideOptions,
    ) -> Result<Contacts, Error> {
        let detector = self.detector(device);
        detector.detect(scene, options).map_err(Error::Device)
    }

    /// The detector of this device.
    pub fn detector(&self, device: &Device) -> Arc<SharedDetector> {
        let mut held = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match &*held {
            Some((of, detector)) if of.is(device) => Arc::clone(detector),
            _ => {
                let detector = Arc::new(SharedDetector::new(device.inner.clone()));
                *held = Some((device.clone(), Arc::clone(&detector)));
                detector
            }
        }
    }
}
