//! Devices of the crate `tesdf-gpu`.
use std::sync::{Mutex, PoisonError};

use tesdf::collide::{CollideError, CollideOptions, Contacts, Scene};
use tesdf::encode::Sampler;
use tesdf_gpu::{Detector, DetectorOptions, DeviceSampler, GpuError};
use tesdf_sim::newton::Detect;

use crate::report::Failure;

/// An open device.
pub struct Device(pub tesdf_gpu::Device);

/// Opens the device with this number or name. With `None` it opens the device that `TESDF_DEVICE`
/// names, or the best device.
///
/// # Errors
/// The device does not exist.
pub fn open(name: Option<&str>) -> Result<Device, Failure> {
    tesdf_gpu::Device::choose(name)
        .map(Device)
        .map_err(|e| Failure::new(e).hint("`tesdf devices` lists them; `cpu` is the processor"))
}

impl Device {
    /// The name that the driver reports.
    pub fn name(&self) -> &str {
        &self.0.info().name
    }

    /// A sampler that evaluates the samples of Algorithm 1 on this device.
    pub fn into_sampler(self) -> Box<dyn Sampler> {
        Box::new(DeviceSampler::new(self.0))
    }

    /// A detector that finds contacts on this device.
    pub fn into_detector(self) -> impl Detect {
        DeviceDetector { device: self.0, detector: Mutex::new(None) }
    }
}

/// A detector that keeps the shapes of its scene on a device. It uploads them with the first scene.
struct DeviceDetector {
    device: tesdf_gpu::Device,
    detector: Mutex<Option<Detector>>,
}

impl Detect for DeviceDetector {
    fn detect(&self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, CollideError> {
        let failed = |e: GpuError| CollideError::Device(e.to_string());
        let mut held = self.detector.lock().unwrap_or_else(PoisonError::into_inner);
        let detector = match held.take() {
            Some(detector) => detector,
            None => Detector::new(&self.device, scene, DetectorOptions::default()).map_err(failed)?,
        };
        held.insert(detector).detect(scene, options).map_err(failed)
    }
}
