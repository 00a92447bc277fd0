//! The server that runs the launches on a CUDA device.
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ffi::c_void;
use std::sync::{Arc, Mutex, PoisonError};

use cubecl::client::Client;
use cubecl::device_handle::DeviceHandle;
use cubecl::future::DynFut;
use cubecl::ir::{
    DeviceIdentity, DeviceProperties, HardwareProperties, MemoryDeviceProperties, TargetProperties,
};
use cubecl::prelude::{CubeCount, CubeKernel};
use cubecl::profile::{Duration, Instant, ProfileDuration, ProfileTicks};
use cubecl::server::{
    BufferBinding, CopyDescriptor, Handle, KernelArguments, KernelResource, ProfileError, ProfilingToken,
    Server, ServerCommunication, ServerError, ServerStorage, ServerUtilities,
};
use cubecl::{StreamMemoryReport, bytes::Bytes};
use cubecl_common::device::{DeviceId, DeviceService, ServerUtilitiesHandle, ServiceId};
use cubecl_environment::backtrace::BackTrace;
use cubecl_environment::stream::StreamId;
use cubecl_runtime::dry_run::LaunchMode;
use cubecl_runtime::id::KernelId;
use cubecl_runtime::kernel::BufferIOAttr;
use cubecl_runtime::logging::ServerLogger;
use cubecl_runtime::memory_management::{ManagedMemoryHandle, MemoryAllocationMode};
use cubecl_runtime::storage::ManagedResource;
use cubecl_server::allocator::ContiguousMemoryLayoutPolicy;

use super::driver::{self, Event, Facts, Function, Gpu};
use super::kernel_cache;
use super::memory::{ALIGNMENT, Memory, Storage};
use super::nvrtc::architecture;
use super::source::{CudaSource, least_hardware, properties, source};
use crate::GpuError;
use crate::device::stream::STREAM;
use crate::kernels::catalog::Count;

/// An indirect launch starts this many blocks for each block that the GPU runs at the same time.
/// With more than one, the GPU starts the next block as soon as one ends early.
const WAVES: u32 = 4;

/// A CUDA device with its buffers and kernels.
#[derive(Debug)]
pub struct CudaServer {
    gpu: Arc<Gpu>,
    /// The architecture that kernels are compiled for.
    architecture: String,
    utilities: Arc<ServerUtilities>,
    memory: Memory,
    kernels: Kernels,
    /// The first failure that no caller has received yet.
    failure: Option<ServerError>,
    /// Start events of the stages that are being timed.
    stages: HashMap<u64, Event>,
    next_stage: u64,
}

type Kernels = HashMap<(KernelId, Count), Kernel>;

#[derive(Debug)]
struct Kernel {
    source: CudaSource,
    /// Present once the kernel is loaded.
    function: Option<Function>,
}

/// Number of CUDA devices; 0 when no driver is installed.
pub fn count() -> usize {
    driver::count()
}

/// Properties of CUDA device `index`, without opening it. For a device that does not answer, the
/// minimum that all devices have.
pub fn properties_of(index: usize) -> DeviceProperties {
    properties_from(index, &driver::facts(index).unwrap_or_default())
}

fn properties_from(index: usize, facts: &Facts) -> DeviceProperties {
    let identity = DeviceIdentity {
        name: format!("{} (cuda:{index})", facts.name),
        fingerprint: format!("cuda_sm{}", facts.capability),
        physical: None,
    };
    let memory =
        MemoryDeviceProperties::new(facts.memory_bytes, ALIGNMENT as u64).with_max_memory(facts.memory_bytes);
    let hardware = HardwareProperties {
        max_shared_memory_size: facts.shared_bytes,
        num_streaming_multiprocessors: Some(facts.multiprocessors),
        ..least_hardware()
    };
    properties(identity, memory, hardware)
}

/// A client of CUDA device `index`. Opens the device at the first call.
pub fn client(index: usize) -> Result<Client, GpuError> {
    static OPEN: Mutex<Vec<usize>> = Mutex::new(Vec::new());
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    let id = id(index);
    if open.contains(&index) {
        return Ok(Client::load::<CudaServer>(id));
    }
    let reason = |reason: String| GpuError::Device {
        device: format!("cuda:{index}"),
        doing: "opening the device",
        reason,
    };
    let server = CudaServer::open(index)?;
    let client = Client::try_init(id, server).map_err(|e| reason(format!("{e:?}")))?;
    open.push(index);
    Ok(client)
}

fn id(index: usize) -> DeviceId {
    DeviceId::new(0, index as u16)
}

/// The number of the CUDA device of a client. `None` when it is not a CUDA device.
pub fn number(client: &Client) -> Option<usize> {
    let device = client.service_id().device;
    let is_cuda = client.service_id() == ServiceId::of::<CudaServer>(device);
    is_cuda.then_some(usize::from(device.index_id))
}

/// Wraps memory of another library as a buffer. `None` when the device is not a CUDA device.
pub fn from_raw_ptr(client: &Client, pointer: u64, bytes: u64) -> Option<Handle> {
    number(client)?;
    let device = client.service_id().device;
    let handle = Handle::new(client.service_id(), STREAM, bytes);
    let memory = handle.memory.clone();
    // Submitted like a launch, so that it comes before later launches.
    DeviceHandle::<CudaServer>::new(device).submit(move |server| server.memory.adopt(memory, pointer));
    Some(handle)
}

/// Address of a buffer on the device.
pub fn pointer(client: &Client, handle: Handle) -> Result<u64, ServerError> {
    Ok(*client.get_resource::<CudaServer>(handle)?.resource())
}

impl CudaServer {
    fn open(index: usize) -> Result<Self, GpuError> {
        let device = || format!("cuda:{index}");
        let failed = |e: driver::Failure| GpuError::Device {
            device: device(),
            doing: "opening the device",
            reason: e.to_string(),
        };
        let gpu = Arc::new(Gpu::open(index).map_err(failed)?);
        let (utilities, _captures) = ServerUtilities::init(
            ServiceId::of::<Self>(id(index)),
            "cuda",
            properties_from(index, &gpu.facts),
            TargetProperties::default(),
            Arc::new(ServerLogger::default()),
            ContiguousMemoryLayoutPolicy::new(ALIGNMENT),
        );
        Ok(Self {
            architecture: architecture(gpu.facts.capability)?,
            memory: Memory::new(gpu.clone()),
            gpu,
            utilities: Arc::new(utilities),
            kernels: HashMap::new(),
            failure: None,
            stages: HashMap::new(),
            next_stage: 0,
        })
    }

    fn run(
        &mut self,
        function: Function,
        io: &[BufferIOAttr],
        count: &CubeCount,
        arguments: &KernelArguments,
    ) -> Result<(), ServerError> {
        for buffer in arguments.buffers_read(Some(io)) {
            self.memory.check(buffer)?;
        }
        if arguments.info.dynamic_metadata_offset < arguments.info.data.len() {
            return Err(generic("tensors are not supported; expected slices".into()));
        }
        let mut pointers = Vec::with_capacity(arguments.resources.len() + 1);
        for resource in &arguments.resources {
            match resource {
                KernelResource::Buffer(buffer) => pointers.push(self.memory.pointer(buffer)?),
                KernelResource::TensorMap(_) => return Err(generic("tensor maps are not supported".into())),
            }
        }
        let blocks = match count {
            CubeCount::Static(x, y, z) => (*x, *y, *z),
            CubeCount::Dynamic(buffer) => {
                self.memory.check(buffer)?;
                pointers.push(self.memory.pointer(buffer)?);
                (WAVES * function.resident, 1, 1)
            }
        };
        let mut addresses: Vec<*mut c_void> = pointers.iter_mut().map(|p| (&raw mut *p).cast()).collect();
        let info = &arguments.info.data;
        if !info.is_empty() {
            let at = arguments.resources.len();
            addresses.insert(at, info.as_ptr().cast_mut().cast());
        }
        // SAFETY: the arguments are in the order that the module's documentation gives. Kernels
        // stay within their buffers.
        unsafe { self.gpu.launch(function, blocks, &mut addresses) }?;
        Ok(())
    }

    /// Marks the buffers of a failed launch as invalid. An atomic buffer counts as read only, so
    /// the next read of any buffer reports the failure, too.
    fn settle<'a>(
        &mut self,
        written: impl Iterator<Item = &'a BufferBinding>,
        result: Result<(), ServerError>,
    ) {
        self.memory.written(written, &result);
        if let Err(failure) = result {
            self.failure.get_or_insert(failure);
        }
    }

    fn report(&mut self) -> Result<(), ServerError> {
        self.failure.take().map_or(Ok(()), Err)
    }

    fn read_now(&mut self, buffers: &[CopyDescriptor]) -> Result<Vec<Bytes>, ServerError> {
        self.report()?;
        self.gpu.make_current()?;
        let mut read = Vec::with_capacity(buffers.len());
        for buffer in buffers {
            self.memory.check(&buffer.handle)?;
            let pointer = self.memory.pointer(&buffer.handle)?;
            let bytes = buffer.shape.iter().product::<usize>() * buffer.elem_size;
            // SAFETY: buffers are contiguous, and their size follows from their shape.
            let bytes = unsafe { self.gpu.read(pointer, bytes) }?;
            read.push(Bytes::from_bytes_vec(bytes));
        }
        Ok(read)
    }

    fn write_now(&mut self, buffer: &BufferBinding, bytes: &[u8]) -> Result<(), ServerError> {
        let pointer = self.memory.pointer(buffer)?;
        // SAFETY: as in `read_now`.
        unsafe { self.gpu.write(pointer, bytes) }?;
        Ok(())
    }
}

impl Kernel {
    /// The kernel of a launch. At the first call its text is made.
    fn of<'a>(
        known: &'a mut Kernels,
        kernel: &dyn CubeKernel,
        count: Count,
    ) -> Result<&'a mut Self, ServerError> {
        match known.entry((kernel.id(), count)) {
            Entry::Occupied(known) => Ok(known.into_mut()),
            Entry::Vacant(place) => {
                let mut source = source(kernel, kernel.name()).map_err(refused)?;
                if count == Count::Indirect {
                    source = source.counted_by_device().map_err(refused)?;
                }
                Ok(place.insert(Self { source, function: None }))
            }
        }
    }

    /// The loaded kernel. The first call that succeeds loads it from the cache, or compiles it.
    fn load(&mut self, gpu: &Gpu, architecture: &str) -> Result<Function, ServerError> {
        let Self { source, function } = self;
        if let Some(function) = function {
            return Ok(*function);
        }
        let image = kernel_cache::image(source, architecture).map_err(refused)?;
        Ok(*function.insert(gpu.load(&image, &source.entry, source.threads, source.shared_bytes)?))
    }
}

fn refused(error: GpuError) -> ServerError {
    generic(error.to_string())
}

fn generic(reason: String) -> ServerError {
    ServerError::Generic { reason, backtrace: BackTrace::capture() }
}

fn ready<T: Send + 'static>(value: T) -> DynFut<T> {
    Box::pin(std::future::ready(value))
}

impl DeviceService for CudaServer {
    fn init(device_id: DeviceId) -> Self {
        let index = usize::from(device_id.index_id);
        // `client` opens each device before the server starts, and reports why a device cannot be
        // opened.
        Self::open(index).unwrap_or_else(|e| unreachable!("cuda:{index} was not opened: {e}"))
    }

    fn utilities(&self) -> ServerUtilitiesHandle {
        self.utilities.clone()
    }
}

impl ServerCommunication for CudaServer {}

impl Server for CudaServer {
    fn initialize_memory(
        &mut self,
        memory: ManagedMemoryHandle,
        size: u64,
        _: StreamId,
    ) -> Result<(), ServerError> {
        let current = self.gpu.make_current();
        self.memory.allocate(memory, size, current)
    }

    fn logger(&self) -> Arc<ServerLogger> {
        self.utilities.logger.clone()
    }

    fn utilities(&self) -> Arc<ServerUtilities> {
        self.utilities.clone()
    }

    fn read(
        &mut self,
        descriptors: Vec<CopyDescriptor>,
        _: StreamId,
    ) -> DynFut<Result<Vec<Bytes>, ServerError>> {
        ready(self.read_now(&descriptors))
    }

    fn write(&mut self, descriptors: Vec<(CopyDescriptor, Bytes)>, _: StreamId) {
        let current = self.gpu.make_current().map_err(ServerError::from);
        for (to, bytes) in descriptors {
            let written = current.clone().and_then(|()| self.write_now(&to.handle, &bytes));
            self.settle(std::iter::once(&to.handle), written);
        }
    }

    fn sync(&mut self, handles: Vec<BufferBinding>, stream: StreamId) -> DynFut<Result<(), ServerError>> {
        let waited = self.gpu.make_current().and_then(|()| self.gpu.wait()).map_err(ServerError::from);
        let reported = self.report();
        ready(waited.and(reported).and_then(|()| self.check(handles, stream)))
    }

    fn check(&mut self, handles: Vec<BufferBinding>, _: StreamId) -> Result<(), ServerError> {
        handles.iter().try_for_each(|buffer| self.memory.check(buffer))
    }

    unsafe fn launch(
        &mut self,
        kernel: Box<dyn CubeKernel>,
        count: CubeCount,
        bindings: KernelArguments,
        _: StreamId,
        mode: LaunchMode,
    ) {
        let way = if matches!(count, CubeCount::Dynamic(_)) { Count::Indirect } else { Count::Direct };
        let kernel = match Kernel::of(&mut self.kernels, &*kernel, way) {
            Ok(kernel) => kernel,
            Err(error) => return self.settle(bindings.buffers_written(None), Err(error)),
        };
        // A launch that fails leaves the buffers that it reads as they are.
        let io = kernel.source.io.clone();
        let current = self.gpu.make_current().map_err(ServerError::from);
        let loaded = current.and_then(|()| kernel.load(&self.gpu, &self.architecture));
        if mode.is_skipped() {
            return;
        }
        // After a failure nothing runs until it is reported: a buffer that counters are in counts
        // as read only, so it does not tell that a launch has left it without contents.
        let result = match &self.failure {
            Some(failure) => Err(failure.clone()),
            None => loaded.and_then(|function| self.run(function, &io, &count, &bindings)),
        };
        self.settle(bindings.buffers_written(Some(&io)), result);
    }

    fn flush(&mut self, _: StreamId) -> Result<(), ServerError> {
        Ok(())
    }

    fn memory_report(&mut self, _: StreamId) -> Option<StreamMemoryReport> {
        None
    }

    fn memory_cleanup(&mut self, _: StreamId) -> Result<(), ServerError> {
        self.gpu.make_current()?;
        self.memory.give_back();
        Ok(())
    }

    fn start_profile(&mut self, _: StreamId) -> Result<ProfilingToken, ServerError> {
        self.gpu.make_current()?;
        let id = self.next_stage;
        self.next_stage += 1;
        self.stages.insert(id, self.gpu.mark()?);
        Ok(ProfilingToken { id })
    }

    fn end_profile(&mut self, _: StreamId, token: ProfilingToken) -> Result<ProfileDuration, ProfileError> {
        let missing = || ProfileError::NotRegistered { backtrace: BackTrace::capture() };
        let begin = self.stages.remove(&token.id).ok_or_else(missing)?;
        let milliseconds = self
            .gpu
            .make_current()
            .and_then(|()| self.gpu.mark())
            .and_then(|end| self.gpu.between(&begin, &end))
            .map_err(|e| ProfileError::from(&ServerError::from(e)))?;
        let start = Instant::now();
        let end = start + Duration::from_secs_f64(f64::from(milliseconds) * 1e-3);
        Ok(ProfileDuration::new_device_time(std::future::ready(ProfileTicks::from_start_end(start, end))))
    }

    fn abandon_profile(&mut self, _: StreamId, token: ProfilingToken) {
        self.stages.remove(&token.id);
    }

    fn allocation_mode(&mut self, _: MemoryAllocationMode, _: StreamId) {}
}

impl ServerStorage for CudaServer {
    type Storage = Storage;

    fn get_resource(
        &mut self,
        binding: BufferBinding,
        _: StreamId,
    ) -> Result<ManagedResource<u64>, ServerError> {
        self.memory.check(&binding)?;
        let pointer = self.memory.pointer(&binding)?;
        Ok(ManagedResource::new(binding.memory, pointer))
    }
}
