//! Devices of the crate `tesdf-gpu`.
use tesdf::encode::Sampler;
use tesdf_gpu::{DeviceSampler, SharedDetector};
use tesdf_sim::newton::Detect;

use crate::terminal::report::Failure;

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

    /// A detector that finds contacts on this device, and solves islands there.
    pub fn into_detector(self) -> impl Detect {
        SharedDetector::new(self.0)
    }
}
