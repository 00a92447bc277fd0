//! Launches, counted and timed.
use std::time::Duration;

use crate::GpuError;
use crate::device::Device;

/// Whether stages are timed.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Timing {
    Off,
    On,
}

/// Counts launches, and times them.
pub struct Stages<'a> {
    device: &'a Device,
    timing: Timing,
    pub launches: usize,
    pub times: Vec<(&'static str, Duration)>,
}

impl<'a> Stages<'a> {
    pub fn new(device: &'a Device, timing: Timing) -> Self {
        Self { device, timing, launches: 0, times: Vec::new() }
    }

    pub fn run(&mut self, name: &'static str, launch: impl FnOnce()) -> Result<(), GpuError> {
        self.launches += 1;
        match self.timing {
            Timing::Off => launch(),
            Timing::On => self.times.push((name, self.device.time(launch)?)),
        }
        Ok(())
    }
}
