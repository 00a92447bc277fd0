//! A detector that threads share.
use std::sync::{Mutex, PoisonError};

use tesdf::collide::{CollideError, CollideOptions, Contacts, Scene};
use tesdf_sim::newton::Detect;
use tesdf_sim::newton::internal::SolveIslands;

use super::{Detector, DetectorOptions, DeviceContacts, PoseArrays};
use crate::GpuError;
use crate::device::Device;
use crate::islands::IslandSolver;

/// A [`Detector`] with default options that threads share. It uploads shapes with the first scene,
/// and detects for one thread after the other. For a simulation, it also solves contact problems on
/// a CUDA device.
pub struct SharedDetector {
    device: Device,
    solver: Option<IslandSolver>,
    detector: Mutex<Option<Detector>>,
}

impl SharedDetector {
    /// A detector that holds no shapes yet.
    pub fn new(device: Device) -> Self {
        let solver = IslandSolver::new(&device);
        Self { device, solver, detector: Mutex::new(None) }
    }

    /// As [`Detector::detect`].
    ///
    /// # Errors
    /// The errors of [`Detector::new`] and [`Detector::detect`].
    pub fn detect(&self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, GpuError> {
        self.with(scene, |detector| detector.detect(scene, options))
    }

    /// As [`Detector::detect_on_device`].
    ///
    /// # Errors
    /// The errors of [`Detector::new`] and [`Detector::detect_on_device`].
    pub fn detect_on_device(
        &self,
        scene: &Scene,
        given: Option<&PoseArrays<'_>>,
        options: &CollideOptions,
    ) -> Result<DeviceContacts, GpuError> {
        self.with(scene, |detector| detector.detect_on_device(scene, given, options))
    }

    fn with<T>(
        &self,
        scene: &Scene,
        detect: impl FnOnce(&mut Detector) -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        let mut held = self.detector.lock().unwrap_or_else(PoisonError::into_inner);
        let detector = match held.take() {
            Some(detector) => detector,
            None => Detector::new(&self.device, scene, DetectorOptions::default())?,
        };
        detect(held.insert(detector))
    }
}

impl Detect for SharedDetector {
    fn detect(&self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, CollideError> {
        Self::detect(self, scene, options).map_err(|e| CollideError::Device(e.to_string()))
    }

    fn solver(&self) -> Option<&dyn SolveIslands> {
        self.solver.as_ref().map(|solver| solver as _)
    }
}
