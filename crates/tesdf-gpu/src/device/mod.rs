//! The devices of this machine, and memory on them.
mod array;
mod buffer;

use std::fmt;
use std::time::Duration;

use bytemuck::{NoUninit, Pod};
use cubecl::client::Client;
use cubecl::features::Plane;
use cubecl::wgpu::{WgpuDevice, WgpuDeviceKind, WgpuRuntime};
use cubecl_common::device::{Device as _, DeviceId};
use cubecl_runtime::runtime::Runtime;

use crate::GpuError;
#[cfg(feature = "cuda")]
use crate::cuda;

pub use array::DeviceArray;
pub(crate) use buffer::{Buffer, spread};

/// The environment variable that names the device when the program does not.
pub const DEVICE_VARIABLE: &str = "TESDF_DEVICE";

/// The kind of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// Part of the processor.
    Integrated,
    /// A device of a virtual machine.
    Virtual,
    /// A driver that computes on the processor.
    Software,
    /// Unknown.
    Other,
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Discrete => "discrete GPU",
            Self::Integrated => "integrated GPU",
            Self::Virtual => "virtual GPU",
            Self::Software => "software",
            Self::Other => "other",
        })
    }
}

/// A device of this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Its name, by the driver.
    pub name: String,
    /// Its kind.
    pub kind: DeviceKind,
    /// Least and greatest size of a subgroup: threads that run in lockstep.
    pub subgroup_size: (u32, u32),
    /// Whether the threads of a subgroup can exchange values without shared memory.
    pub has_subgroup_operations: bool,
    /// Greatest size of a buffer that a kernel can bind, in bytes.
    pub max_buffer_bytes: u64,
    /// Whether stages are timed by the device's own clock.
    pub has_timestamps: bool,
}

/// A device, ready to run kernels. Cheap to clone.
#[derive(Clone)]
pub struct Device {
    client: Client,
    info: DeviceInfo,
}

impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Device").field(&self.info).finish()
    }
}

/// The devices of this machine, the best first: graphics cards, the same through CUDA, then GPUs that are part of the
/// processor, then software.
pub fn devices() -> Vec<DeviceInfo> {
    ids().into_iter().map(Id::info).collect()
}

/// How a device is reached.
#[derive(Clone, Copy)]
enum Id {
    /// Vulkan, Metal or DirectX 12.
    Wgpu(DeviceId),
    /// CUDA, by number.
    #[cfg(feature = "cuda")]
    Cuda(usize),
}

fn ids() -> Vec<Id> {
    let mut ids: Vec<Id> = <WgpuRuntime>::enumerate_all_devices().into_iter().map(Id::Wgpu).collect();
    #[cfg(feature = "cuda")]
    ids.extend((0..cuda::server::count()).map(Id::Cuda));
    ids.sort_by_key(|id| match id.kind() {
        DeviceKind::Discrete => 0,
        DeviceKind::Integrated => 1,
        DeviceKind::Virtual => 2,
        DeviceKind::Other => 3,
        DeviceKind::Software => 4,
    });
    ids
}

impl Id {
    fn kind(self) -> DeviceKind {
        let id = match self {
            Self::Wgpu(id) => id,
            #[cfg(feature = "cuda")]
            Self::Cuda(_) => return DeviceKind::Discrete,
        };
        match WgpuDevice::from_id(id).kind {
            WgpuDeviceKind::DiscreteGpu(_) => DeviceKind::Discrete,
            WgpuDeviceKind::IntegratedGpu(_) => DeviceKind::Integrated,
            WgpuDeviceKind::VirtualGpu(_) => DeviceKind::Virtual,
            WgpuDeviceKind::Cpu => DeviceKind::Software,
            _ => DeviceKind::Other,
        }
    }

    fn client(self) -> Result<Client, GpuError> {
        match self {
            Self::Wgpu(id) => Ok(<WgpuRuntime>::client(&WgpuDevice::from_id(id))),
            #[cfg(feature = "cuda")]
            Self::Cuda(index) => cuda::server::client(index),
        }
    }

    /// Name, kind and limits. A CUDA device is not opened for this, as that takes some of its memory.
    fn info(self) -> DeviceInfo {
        let properties = match self {
            Self::Wgpu(id) => <WgpuRuntime>::client(&WgpuDevice::from_id(id)).properties().clone(),
            #[cfg(feature = "cuda")]
            Self::Cuda(index) => cuda::server::properties_of(index),
        };
        DeviceInfo {
            name: properties.identity.name,
            kind: self.kind(),
            subgroup_size: (properties.hardware.plane_size_min, properties.hardware.plane_size_max),
            has_subgroup_operations: properties.features.plane.contains(Plane::Ops),
            max_buffer_bytes: properties.memory.max_page_size,
            has_timestamps: properties.timing_method == cubecl::profile::TimingMethod::Device,
        }
    }
}

impl Device {
    /// Opens the device of this name: its number in [`devices`], or a part of its name, in upper or lower case, such as
    /// `cuda:0`. Without a name that of the environment variable `TESDF_DEVICE` counts, else the best device is opened.
    ///
    /// # Errors
    /// [`GpuError::NoDevice`], [`GpuError::NoSuchDevice`]; [`GpuError::Device`] and [`GpuError::NoNvrtc`] when CUDA cannot
    /// open the device.
    pub fn choose(asked: Option<&str>) -> Result<Self, GpuError> {
        let variable = std::env::var(DEVICE_VARIABLE).ok().filter(|v| !v.is_empty());
        let ids = ids();
        let Some(&best) = ids.first() else { return Err(GpuError::NoDevice) };
        let Some(asked) = asked.map(str::to_owned).or(variable) else { return Self::open(best) };
        if let Some(&id) = asked.parse().ok().and_then(|i: usize| ids.get(i)) {
            return Self::open(id);
        }
        let names: Vec<String> = ids.iter().map(|id| id.info().name).collect();
        match names.iter().position(|name| name.to_lowercase().contains(&asked.to_lowercase())) {
            Some(i) => Self::open(ids[i]),
            None => Err(GpuError::NoSuchDevice { asked, found: names }),
        }
    }

    fn open(id: Id) -> Result<Self, GpuError> {
        Ok(Self { client: id.client()?, info: id.info() })
    }

    /// Name, kind and limits.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Waits for all launches.
    ///
    /// # Errors
    /// [`GpuError::Device`] for a launch that failed.
    pub fn wait(&self) -> Result<(), GpuError> {
        cubecl::future::block_on(self.client.sync()).map_err(|e| GpuError::Device {
            device: self.info.name.clone(),
            doing: "waiting",
            reason: e.to_string(),
        })
    }

    /// Launches kernels.
    pub(crate) fn client(&self) -> &Client {
        &self.client
    }

    /// Whether 32 threads can exchange values without shared memory.
    pub(crate) fn has_subgroups_of_32(&self) -> bool {
        self.info.has_subgroup_operations && self.info.subgroup_size == (32, 32)
    }

    /// A buffer that holds `data`; one element at least, as nothing binds an empty buffer.
    pub(crate) fn upload<T: NoUninit>(&self, name: &'static str, data: &[T]) -> Result<Buffer, GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        self.fits(name, bytes.len())?;
        let handle = if bytes.is_empty() {
            self.client.create_from_slice(&[0; 16])
        } else {
            self.client.create_from_slice(bytes)
        };
        Ok(Buffer { name, handle, bytes: bytes.len().max(16) })
    }

    /// A buffer of any contents.
    pub(crate) fn empty(&self, name: &'static str, bytes: usize) -> Result<Buffer, GpuError> {
        self.fits(name, bytes)?;
        Ok(Buffer { name, handle: self.client.empty(bytes.max(16)), bytes: bytes.max(16) })
    }

    /// A buffer in memory that others allocated, from `pointer` on. Only for CUDA devices.
    ///
    /// # Safety
    /// That memory is on this device, and stays until the buffer is dropped and all launches with it are done.
    #[cfg(feature = "cuda")]
    pub(crate) unsafe fn adopt(
        &self,
        name: &'static str,
        pointer: u64,
        bytes: usize,
    ) -> Result<Buffer, GpuError> {
        let handle = cuda::server::from_raw_ptr(&self.client, pointer, bytes as u64)
            .ok_or_else(|| self.is_not_cuda())?;
        Ok(Buffer { name, handle, bytes })
    }

    /// Where a buffer begins. Only for CUDA devices.
    #[cfg(feature = "cuda")]
    pub(crate) fn pointer(&self, buffer: &Buffer) -> Result<u64, GpuError> {
        cuda::server::pointer(&self.client, buffer.handle.clone()).map_err(|_| self.is_not_cuda())
    }

    #[cfg(feature = "cuda")]
    fn is_not_cuda(&self) -> GpuError {
        GpuError::Unavailable {
            what: format!("a pointer of CUDA on {}", self.info.name),
            instead: "choose a device such as \"cuda:0\"",
        }
    }

    fn fits(&self, buffer: &'static str, bytes: usize) -> Result<(), GpuError> {
        let (needed, limit) = (bytes as u64, self.info.max_buffer_bytes);
        if needed > limit {
            return Err(GpuError::TooLarge { device: self.info.name.clone(), buffer, needed, limit });
        }
        Ok(())
    }

    /// Device time of what `launch` launches, once all before it is done.
    pub(crate) fn time(&self, launch: impl FnOnce()) -> Result<Duration, GpuError> {
        let failed = |reason: String| GpuError::Device {
            device: self.info.name.clone(),
            doing: "timing a stage",
            reason,
        };
        let window = self.client.profile_start().map_err(|e| failed(format!("{e:?}")))?;
        launch();
        let time = self.client.profile_end(window).map_err(|e| failed(format!("{e:?}")))?;
        cubecl::future::block_on(time.resolve())
            .map(|ticks| ticks.duration())
            .ok_or_else(|| failed("the device gave no time".into()))
    }

    /// Waits for all that was launched, and reads the first `count` elements of a buffer.
    pub(crate) fn read<T: Pod>(&self, buffer: &Buffer, count: usize) -> Result<Vec<T>, GpuError> {
        let bytes = count * size_of::<T>();
        if bytes == 0 {
            return Ok(Vec::new());
        }
        let unread = buffer.bytes.saturating_sub(bytes) as u64;
        let handle = buffer.handle.clone().offset_end(unread);
        let read = self.client.read_one(handle).map_err(|e| GpuError::Device {
            device: self.info.name.clone(),
            doing: buffer.name,
            reason: e.to_string(),
        })?;
        Ok(bytemuck::pod_collect_to_vec(&read[..bytes]))
    }
}
