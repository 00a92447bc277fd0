//! Counts and times launches.
use std::cell::{Cell, RefCell};
use std::time::Duration;

use crate::GpuError;
use crate::device::Device;

/// Whether the device time of stages is measured.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Timing {
    Off,
    On,
}

/// Counts launches, and measures their device time.
pub struct Stages<'a> {
    pub device: &'a Device,
    timing: Timing,
    pub launches: Cell<usize>,
    pub times: RefCell<Vec<(&'static str, Duration)>>,
}

impl<'a> Stages<'a> {
    pub fn new(device: &'a Device, timing: Timing) -> Self {
        Self { device, timing, launches: Cell::new(0), times: RefCell::default() }
    }

    /// Counts and times a launch. The macro `launch!` calls it.
    pub fn run(&self, name: &'static str, launch: impl FnOnce(&Device)) -> Result<(), GpuError> {
        self.launches.set(self.launches.get() + 1);
        let device = self.device;
        match self.timing {
            Timing::Off => launch(device),
            Timing::On => {
                let time = device.time(|| launch(device))?;
                self.times.borrow_mut().push((name, time));
            }
        }
        Ok(())
    }
}

/// Launches a kernel. The arguments are: stages, name of the stage, number of groups, threads per
/// group, and the kernel with its arguments.
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
