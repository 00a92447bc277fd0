//! The device of a tool without the feature `gpu`: a type without values.
use tesdf::collide::{CollideError, CollideOptions, Contacts, Scene};
use tesdf::encode::Sampler;
use tesdf_sim::newton::Detect;

use crate::terminal::report::Failure;

/// A device. No value of this type exists.
pub enum Device {}

/// Always an error, because no device can be opened.
///
/// # Errors
/// The message says how to build the tool with the feature `gpu`.
pub fn open(name: Option<&str>) -> Result<Device, Failure> {
    Err(built_without(&format!("--device {}: ", name.unwrap_or("gpu"))))
}

/// The error of every operation that needs a device. `prefix` starts the message.
pub fn built_without(prefix: &str) -> Failure {
    Failure::new(format!("{prefix}this tesdf was built without the GPU")).hint(
        "build it in the repository with `cargo build --release --features gpu --bin tesdf`; `cpu` is the processor",
    )
}

impl Device {
    /// The name of the device.
    pub fn name(&self) -> &str {
        match *self {}
    }

    /// A sampler that evaluates the samples of Algorithm 1 on this device.
    pub fn into_sampler(self) -> Box<dyn Sampler> {
        match self {}
    }

    /// A detector that finds contacts on this device.
    pub fn into_detector(self) -> impl Detect {
        self
    }
}

impl Detect for Device {
    fn detect(&self, _: &Scene, _: &CollideOptions) -> Result<Contacts, CollideError> {
        match *self {}
    }
}

#[cfg(test)]
mod tests {
    use super::open;

    #[test]
    fn a_device_is_an_error_that_says_how_to_build_with_the_gpu() {
        for (choice, name) in [(None, "--device gpu"), (Some("2"), "--device 2")] {
            let failure = open(choice).err().expect("there is no device");
            assert!(failure.message.starts_with(name), "{failure:?}");
            assert!(failure.hint.is_some_and(|hint| hint.contains("--features gpu")));
        }
    }
}
