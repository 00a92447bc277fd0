//! `tesdf devices`, and the option `--device` of other commands.
use std::sync::{Mutex, PoisonError};

use serde::Serialize;
use tesdf::collide::{CollideError, CollideOptions, Contacts, Scene};
use tesdf::encode::Sampler;
use tesdf::encode::sampled::Processor;
use tesdf_gpu::{Detector, DetectorOptions, Device, DeviceInfo, DeviceSampler, devices};
use tesdf_sim::newton::Detect;

use crate::report::{self, Failure, Outcome};

/// Arguments of `tesdf devices`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Print the devices as a JSON array
    #[arg(long)]
    pub json: bool,
}

/// The help of `--device`: where `what` is done.
pub fn help(what: &str) -> String {
    format!(
        "Where {what}: cpu (64 bits), gpu (32 bits; what TESDF_DEVICE names, else the best device), or a device by its number or a part \
         of its name"
    )
}

/// What `--device` says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Choice {
    /// The processor.
    #[default]
    Processor,
    /// What `TESDF_DEVICE` says, or the best device there is.
    Best,
    /// A device, by its number or a part of its name.
    Named(String),
}

impl Choice {
    /// `cpu`, `gpu`, or the number or name of a device.
    ///
    /// # Errors
    /// None: whether there is such a device is seen when it is opened.
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
    /// There is no such device.
    pub fn open(&self) -> Result<Option<Device>, Failure> {
        let device = match self {
            Self::Processor => return Ok(None),
            Self::Best => Device::choose(None),
            Self::Named(name) => Device::choose(Some(name)),
        };
        device
            .map(Some)
            .map_err(|e| Failure::new(e).hint("`tesdf devices` lists them; `cpu` is the processor"))
    }

    /// What looks at the samples of Algorithm 1 there.
    ///
    /// # Errors
    /// There is no such device.
    pub fn sampler(&self) -> Result<Box<dyn Sampler>, Failure> {
        Ok(match self.open()? {
            Some(device) => Box::new(DeviceSampler::new(device)),
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

/// A detector that keeps its shapes on a device.
pub struct OnDevice {
    device: Device,
    detector: Mutex<Option<Detector>>,
}

impl OnDevice {
    /// Shapes are uploaded with the first scene.
    pub fn new(device: Device) -> Self {
        Self { device, detector: Mutex::new(None) }
    }
}

impl Detect for OnDevice {
    fn detect(&self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, CollideError> {
        let failed = |e: tesdf_gpu::GpuError| CollideError::Device(e.to_string());
        let mut held = self.detector.lock().unwrap_or_else(PoisonError::into_inner);
        let detector = match held.take() {
            Some(detector) => detector,
            None => Detector::new(&self.device, scene, DetectorOptions::default()).map_err(failed)?,
        };
        held.insert(detector).detect(scene, options).map_err(failed)
    }
}

#[derive(Serialize)]
struct Row {
    number: usize,
    name: String,
    kind: String,
    plane: (u32, u32),
    plane_operations: bool,
    most_buffer_bytes: u64,
    timestamps: bool,
}

impl Row {
    fn new((number, info): (usize, DeviceInfo)) -> Self {
        Self {
            number,
            name: info.name,
            kind: info.kind.to_string(),
            plane: info.plane,
            plane_operations: info.has_plane_operations,
            most_buffer_bytes: info.most_bytes,
            timestamps: info.has_timestamps,
        }
    }
}

/// Lists the devices.
///
/// # Errors
/// There is none, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let rows: Vec<Row> = devices().into_iter().enumerate().map(Row::new).collect();
    if args.json {
        report::json(&rows)?;
    } else if rows.is_empty() {
        return Err(Failure::new(tesdf_gpu::GpuError::NoDevice));
    } else {
        let mut text = String::new();
        for row in &rows {
            let (least, most) = row.plane;
            let plane = if least == most { least.to_string() } else { format!("{least} to {most}") };
            text += &format!(
                "{}  {}, {}, {plane} threads in lockstep, buffers of up to {} MiB\n",
                row.number,
                row.name,
                row.kind,
                row.most_buffer_bytes >> 20
            );
        }
        report::text(&text)?;
    }
    Ok(Outcome::Good)
}
