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
    pub device: &'a Device,
    timing: Timing,
    pub launches: usize,
    pub times: Vec<(&'static str, Duration)>,
}

impl<'a> Stages<'a> {
    pub fn new(device: &'a Device, timing: Timing) -> Self {
        Self { device, timing, launches: 0, times: Vec::new() }
    }

    /// Counts and times a launch; [`launch!`] makes one.
    pub fn run(&mut self, name: &'static str, launch: impl FnOnce(&Device)) -> Result<(), GpuError> {
        self.launches += 1;
        let device = self.device;
        match self.timing {
            Timing::Off => launch(device),
            Timing::On => self.times.push((name, device.time(|| launch(device))?)),
        }
        Ok(())
    }
}

/// Launches a kernel: stages, the name of the stage, groups, threads of a group, and the kernel with its arguments.
macro_rules! launch {
    ($stages:expr, $name:literal, $groups:expr, $threads:expr, $($kernel:ident)::+($($argument:expr),* $(,)?)) => {
        $stages.run($name, |device| {
            $($kernel)::+::launch(
                device.client(),
                $groups,
                ::cubecl::prelude::CubeDim::new_1d($threads),
                $($argument),*
            )
        })
    };
}

pub(super) use launch;
