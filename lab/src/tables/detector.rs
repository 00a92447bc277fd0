//! The detector of a simulation: the processor, or a device.
use std::sync::Arc;

use tesdf::collide::{CollideError, CollideOptions, Contacts, Scene, detect};
use tesdf_sim::newton::Detect;

use tesdf_cli::terminal::device::Choice;
use tesdf_cli::terminal::report::Failure;

/// A detector that several engines use, one after the other.
#[derive(Clone)]
pub struct Shared(pub Arc<dyn Detect>);

impl Shared {
    /// The detector of encoded meshes on a device.
    ///
    /// # Errors
    /// The device is missing.
    pub fn open(choice: &Choice) -> Result<Self, Failure> {
        Ok(match choice.open()? {
            Some(device) => Self(Arc::new(device.into_detector())),
            None => Self(Arc::new(detect)),
        })
    }
}

impl Detect for Shared {
    fn detect(&self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, CollideError> {
        self.0.detect(scene, options)
    }

    fn holds_all(&self, options: &CollideOptions) -> bool {
        self.0.holds_all(options)
    }
}
