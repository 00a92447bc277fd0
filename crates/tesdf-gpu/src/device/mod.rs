//! The devices of this machine, and their memory.
mod array;
mod buffer;
pub(crate) mod stream;

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

pub use array::{DeviceArray, Word};
pub(crate) use buffer::{Buffer, spread};

/// The environment variable that selects the device when the program does not.
pub const DEVICE_VARIABLE: &str = "TESDF_DEVICE";

/// The kind of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceKind {
    /// A graphics card, or any CUDA device.
    Discrete,
    /// A GPU inside the processor.
    Integrated,
    /// A virtual GPU of a virtual machine.
    Virtual,
    /// A driver that runs kernels on the processor.
    Software,
    /// The driver does not tell the kind.
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

/// The description of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Name that the driver reports.
    pub name: String,
    /// Kind of the device.
    pub kind: DeviceKind,
    /// Smallest and largest size of a subgroup, in threads. The threads of a subgroup run in
    /// lockstep.
    pub subgroup_size: (u32, u32),
    /// Whether the threads of a subgroup can exchange values without shared memory.
    pub has_subgroup_operations: bool,
    /// Size of the largest buffer that a kernel can bind, in bytes.
    pub max_buffer_bytes: u64,
    /// Whether the clock of the device measures the time of each stage. Otherwise the host measures
    /// it.
    pub has_timestamps: bool,
}

/// A device that is ready to run kernels. A clone refers to the same device and is cheap.
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

/// All devices of this machine, the best first: graphics cards through wgpu, CUDA devices, GPUs
/// inside the processor, virtual GPUs, others, software drivers.
pub fn devices() -> Vec<DeviceInfo> {
    ids().into_iter().map(Id::info).collect()
}

/// The interface through which a device is reached.
#[derive(Clone, Copy)]
enum Id {
    /// Through wgpu: Vulkan, Metal or DirectX 12.
    Wgpu(DeviceId),
    /// Through CUDA, by the number of the device.
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
        let mut client = match self {
            Self::Wgpu(id) => <WgpuRuntime>::client(&WgpuDevice::from_id(id)),
            #[cfg(feature = "cuda")]
            Self::Cuda(index) => cuda::server::client(index)?,
        };
        // SAFETY: the stream only orders launches and copies. In one stream all of them are in the
        // order of the calls, whichever threads make these.
        unsafe { client.set_stream(stream::STREAM) };
        Ok(client)
    }

    /// Describes the device. This does not open a CUDA device, because an open device takes some of
    /// its memory.
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

/// The message of the driver in an error of CubeCL, which stands below those of the layers above it
/// and before a backtrace.
fn reason(error: &impl fmt::Display) -> String {
    let text = error.to_string();
    let of_driver = text.rsplit("Caused by:").next().unwrap_or_default();
    let lines = of_driver.lines().map(str::trim).filter(|line| !line.is_empty());
    let lines = lines.take_while(|line| !line.to_lowercase().contains("backtrace"));
    let message: Vec<&str> = lines.collect();
    let message = message.join(" ");
    message.strip_prefix("Unknown error happened during execution: ").unwrap_or(&message).to_owned()
}

impl Device {
    /// Opens a device. `asked` is the number of a device in [`devices`], or a part of its name,
    /// such as `cuda:0`; upper and lower case are equal. `wgpu:0` is the first device that is
    /// reached through wgpu. With `None` the environment variable `TESDF_DEVICE` selects the
    /// device. Without this variable the best device is opened.
    ///
    /// # Errors
    /// [`GpuError::NoDevice`] when the machine has no device, [`GpuError::NoSuchDevice`] when no
    /// device has this name; [`GpuError::Device`] or [`GpuError::NoNvrtc`] when CUDA cannot open
    /// the device.
    pub fn choose(asked: Option<&str>) -> Result<Self, GpuError> {
        let variable = std::env::var(DEVICE_VARIABLE).ok().filter(|v| !v.is_empty());
        let ids = ids();
        let Some(&best) = ids.first() else { return Err(GpuError::NoDevice) };
        let Some(asked) = asked.map(str::to_owned).or(variable) else { return Self::open(best) };
        if let Some(&id) = asked.parse().ok().and_then(|i: usize| ids.get(i)) {
            return Self::open(id);
        }
        let through_wgpu = asked.strip_prefix("wgpu:").and_then(|number| number.parse().ok());
        if let Some(&id) = through_wgpu.and_then(|i| ids.iter().filter(|id| matches!(id, Id::Wgpu(_))).nth(i))
        {
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

    /// The description of this device.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Whether both are the same device, however it was asked for.
    pub fn is_same(&self, other: &Self) -> bool {
        self.client.service_id() == other.client.service_id()
    }

    /// The number of this device in CUDA; `None` for a device that is reached through wgpu.
    pub fn cuda_number(&self) -> Option<usize> {
        #[cfg(feature = "cuda")]
        {
            cuda::server::number(&self.client)
        }
        #[cfg(not(feature = "cuda"))]
        {
            None
        }
    }

    /// Waits until all launches are complete.
    ///
    /// # Errors
    /// [`GpuError::Device`] when a launch failed.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.check("waiting", [])
    }

    /// Waits until all launches and copies are complete. Fails where one of them failed, or left
    /// one of these buffers without memory or contents, while `doing` this.
    pub(crate) fn check<'a>(
        &self,
        doing: &'static str,
        buffers: impl IntoIterator<Item = &'a Buffer>,
    ) -> Result<(), GpuError> {
        let handles = buffers.into_iter().map(|buffer| &buffer.handle);
        cubecl::future::block_on(self.client.sync_buffers(handles)).map_err(|e| self.failed(doing, &e))
    }

    fn failed(&self, doing: &'static str, error: &impl fmt::Display) -> GpuError {
        GpuError::Device { device: self.info.name.clone(), doing, reason: reason(error) }
    }

    /// The client that launches kernels.
    pub(crate) fn client(&self) -> &Client {
        &self.client
    }

    /// Whether the subgroups have 32 threads that can exchange values without shared memory.
    pub(crate) fn has_subgroups_of_32(&self) -> bool {
        self.info.has_subgroup_operations && self.info.subgroup_size == (32, 32)
    }

    /// Copies `data` to a new buffer. A buffer has at least 16 bytes, because an empty buffer
    /// cannot be bound.
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

    /// Allocates a buffer with arbitrary contents.
    pub(crate) fn empty(&self, name: &'static str, bytes: usize) -> Result<Buffer, GpuError> {
        self.fits(name, bytes)?;
        Ok(Buffer { name, handle: self.client.empty(bytes.max(16)), bytes: bytes.max(16) })
    }

    /// Wraps memory of another library, which begins at `pointer`. Only for CUDA devices.
    ///
    /// # Safety
    /// The memory is on this device, and stays allocated until the buffer is dropped and all
    /// launches with it are complete.
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

    /// Address of a buffer on the device. Only for CUDA devices.
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

    /// Runs `launch`, and measures the device time of the kernels that it launches, after all
    /// earlier launches are complete.
    pub(crate) fn time(&self, launch: impl FnOnce()) -> Result<Duration, GpuError> {
        const DOING: &str = "timing a stage";
        let window = self.client.profile_start().map_err(|e| self.failed(DOING, &e))?;
        launch();
        let time = self.client.profile_end(window).map_err(|e| self.failed(DOING, &e))?;
        cubecl::future::block_on(time.resolve())
            .map(|ticks| ticks.duration())
            .ok_or_else(|| self.failed(DOING, &"the device gave no time"))
    }

    /// Waits for all earlier launches, and reads the first `count` elements of a buffer.
    pub(crate) fn read<T: Pod>(&self, buffer: &Buffer, count: usize) -> Result<Vec<T>, GpuError> {
        let bytes = count * size_of::<T>();
        if bytes == 0 {
            return Ok(Vec::new());
        }
        let unread = buffer.bytes.saturating_sub(bytes) as u64;
        let handle = buffer.handle.clone().offset_end(unread);
        let read = self.client.read_one(handle).map_err(|e| self.failed(buffer.name, &e))?;
        Ok(bytemuck::pod_collect_to_vec(&read[..bytes]))
    }
}
