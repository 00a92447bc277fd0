//! The option `--device`: the processor, or a device of the crate `tesdf-gpu`.
//!
//! A tool that was built without the feature `gpu` has the same option. Each choice except `cpu` is
//! then an error that says how to build the tool with the feature.
use tesdf::encode::Processor;
use tesdf::encode::Sampler;

use crate::terminal::report::Failure;

#[cfg(feature = "gpu")]
mod gpu;
// Tests of a tool with the GPU compile it, too, for the test of its error.
#[cfg(any(not(feature = "gpu"), test))]
#[cfg_attr(feature = "gpu", allow(dead_code))]
mod no_gpu;

#[cfg(feature = "gpu")]
pub use gpu::{Device, open};
#[cfg(not(feature = "gpu"))]
pub use no_gpu::{Device, built_without, open};

/// The help of `--device`. `what` completes the sentence "Where …".
pub fn help(what: &str) -> String {
    format!(
        "Where {what}: cpu (64 bits), gpu (32 bits; what TESDF_DEVICE names, else the best device), or a device by its number or a part \
         of its name"
    )
}

/// The value of `--device`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Choice {
    /// The processor.
    #[default]
    Processor,
    /// The device that `TESDF_DEVICE` names, or the best device.
    Best,
    /// A device, by its number or a part of its name.
    Named(String),
}

impl Choice {
    /// Parses `cpu`, `gpu`, or the number or name of a device.
    ///
    /// # Errors
    /// Never: a device that does not exist is an error of [`open`](Self::open).
    pub fn parse(text: &str) -> Result<Self, std::convert::Infallible> {
        Ok(match text {
            "cpu" => Self::Processor,
            "gpu" => Self::Best,
            name => Self::Named(name.into()),
        })
    }

    /// Opens the device; `None` for the processor.
    ///
    /// # Errors
    /// The device does not exist, or the tool was built without the feature `gpu`.
    pub fn open(&self) -> Result<Option<Device>, Failure> {
        match self {
            Self::Processor => Ok(None),
            Self::Best => open(None).map(Some),
            Self::Named(name) => open(Some(name)).map(Some),
        }
    }

    /// The sampler of Algorithm 1 on this device.
    ///
    /// # Errors
    /// The same errors as [`open`](Self::open).
    pub fn sampler(&self) -> Result<Box<dyn Sampler>, Failure> {
        Ok(match self.open()? {
            Some(device) => device.into_sampler(),
            None => Box::new(Processor),
        })
    }
}

impl std::fmt::Display for Choice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Processor => "cpu",
            Self::Best => "gpu",
            Self::Named(name) => name,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Choice;

    #[test]
    fn the_processor_is_no_device() {
        assert!(Choice::Processor.open().is_ok_and(|device| device.is_none()));
    }
}
