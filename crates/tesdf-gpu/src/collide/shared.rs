//! A detector that threads share.
use std::sync::{Mutex, PoisonError};

use tesdf::collide::{CollideOptions, Contacts, Scene};

use super::{Detector, DetectorOptions};
use crate::GpuError;
use crate::device::Device;

/// A [`Detector`] with default options that threads share. It uploads shapes with the first scene,
/// and detects for one thread after the other.
pub struct SharedDetector {
    device: Device,
    detector: Mutex<Option<Detector>>,
}

impl SharedDetector {
    /// A detector that holds no shapes yet.
    pub fn new(device: Device) -> Self {
        Self { device, detector: Mutex::new(None) }
    }

    /// As [`Detector::detect`].
    ///
    /// # Errors
    /// The errors of [`Detector::new`] and [`Detector::detect`].
    pub fn detect(&self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, GpuError> {
        let mut held = self.detector.lock().unwrap_or_else(PoisonError::into_inner);
        let detector = match held.take() {
            Some(detector) => detector,
            None => Detector::new(&self.device, scene, DetectorOptions::default())?,
        };
        held.insert(detector).detect(scene, options)
    }
}
