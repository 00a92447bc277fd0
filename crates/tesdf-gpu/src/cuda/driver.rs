//! A GPU through NVIDIA's driver. The driver's library is loaded at the first use.
use std::ffi::{CString, c_void};
use std::sync::LazyLock;

use cubecl::server::{IoError, ServerError};
use cubecl_environment::backtrace::BackTrace;
use cubecl_runtime::poison::DevicePoison;
use cudarc::driver::sys::CUdevice_attribute as Attribute;
use cudarc::driver::sys::CUresult;
use cudarc::driver::{DriverError, result, sys};

/// A call of the driver that failed.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{call}: {reason}")]
pub struct Failure {
    call: &'static str,
    reason: String,
    ends_the_context: bool,
}

/// Turns an error of a driver call into a failure.
fn failed(call: &'static str) -> impl FnOnce(DriverError) -> Failure {
    move |error| {
        let text = error.error_string().map(|text| text.to_string_lossy().into_owned());
        let status = error.0 as u32;
        let mut reason = format!("{} (status {status})", text.unwrap_or_else(|_| "failed".into()));
        let ends_the_context = ends_the_context(error.0);
        if ends_the_context {
            reason += ". All later calls of this process fail, too: start it again";
        }
        Failure { call, reason, ends_the_context }
    }
}

/// Whether all later calls in the context fail after an error. CUDA's driver API says so of each of
/// these, or that its device or context is gone.
fn ends_the_context(error: CUresult) -> bool {
    // Of drivers later than the headers.
    const CONTAINED: u32 = 226;
    const TENSOR_MEMORY_LEAK: u32 = 721;
    matches!(
        error,
        CUresult::CUDA_ERROR_ECC_UNCORRECTABLE
            | CUresult::CUDA_ERROR_NVLINK_UNCORRECTABLE
            | CUresult::CUDA_ERROR_ILLEGAL_ADDRESS
            | CUresult::CUDA_ERROR_LAUNCH_TIMEOUT
            | CUresult::CUDA_ERROR_CONTEXT_IS_DESTROYED
            | CUresult::CUDA_ERROR_ASSERT
            | CUresult::CUDA_ERROR_HARDWARE_STACK_ERROR
            | CUresult::CUDA_ERROR_ILLEGAL_INSTRUCTION
            | CUresult::CUDA_ERROR_MISALIGNED_ADDRESS
            | CUresult::CUDA_ERROR_INVALID_ADDRESS_SPACE
            | CUresult::CUDA_ERROR_INVALID_PC
            | CUresult::CUDA_ERROR_LAUNCH_FAILED
            | CUresult::CUDA_ERROR_MPS_CLIENT_TERMINATED
            | CUresult::CUDA_ERROR_EXTERNAL_DEVICE
    ) || matches!(error as u32, CONTAINED | TENSOR_MEMORY_LEAK)
}

impl From<Failure> for ServerError {
    fn from(failure: Failure) -> Self {
        let reason = failure.to_string();
        match failure.ends_the_context {
            true => DevicePoison::new(reason).into(),
            false => Self::Generic { reason, backtrace: BackTrace::capture() },
        }
    }
}

impl From<Failure> for IoError {
    fn from(failure: Failure) -> Self {
        let description = failure.to_string();
        match failure.ends_the_context {
            true => DevicePoison::new(description).into(),
            false => Self::Unknown { description, backtrace: BackTrace::capture() },
        }
    }
}

/// Number of CUDA devices; 0 when no driver is installed.
pub fn count() -> usize {
    // SAFETY: the call opens libraries by NVIDIA's names, and the initialisers of a driver are
    // trusted.
    static PRESENT: LazyLock<bool> =
        LazyLock::new(|| unsafe { sys::is_culib_present() } && result::init().is_ok());
    if *PRESENT { result::device::get_count().map_or(0, |n| n.max(0) as usize) } else { 0 }
}

/// Facts about a device that the driver reports without a context.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    pub name: String,
    /// Compute capability times 10, such as 90.
    pub capability: i32,
    pub memory_bytes: u64,
    pub shared_bytes: usize,
    pub multiprocessors: u32,
    /// Whether the device has memory pools: memory is then allocated and freed in stream order.
    has_pools: bool,
}

/// Asks the driver about device `index`.
pub fn facts(index: usize) -> Result<Facts, Failure> {
    let device = result::device::get(index as i32).map_err(failed("cuDeviceGet"))?;
    // SAFETY: the driver returned this device.
    let ask = |attribute| unsafe {
        result::device::get_attribute(device, attribute).map_err(failed("cuDeviceGetAttribute"))
    };
    let major = ask(Attribute::CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR)?;
    let minor = ask(Attribute::CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR)?;
    Ok(Facts {
        name: result::device::get_name(device).map_err(failed("cuDeviceGetName"))?,
        capability: 10 * major + minor,
        // SAFETY: as above.
        memory_bytes: unsafe { result::device::total_mem(device) }.map_err(failed("cuDeviceTotalMem"))?
            as u64,
        shared_bytes: ask(Attribute::CU_DEVICE_ATTRIBUTE_MAX_SHARED_MEMORY_PER_BLOCK_OPTIN)? as usize,
        multiprocessors: ask(Attribute::CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT)? as u32,
        has_pools: ask(Attribute::CU_DEVICE_ATTRIBUTE_MEMORY_POOLS_SUPPORTED)? != 0,
    })
}

/// The primary context of a device, with one stream.
#[derive(Debug)]
pub struct Gpu {
    pub facts: Facts,
    context: sys::CUcontext,
    stream: sys::CUstream,
}

// SAFETY: any thread may call the driver, also several threads at the same time, once the context
// is current on the thread.
unsafe impl Send for Gpu {}
// SAFETY: as above.
unsafe impl Sync for Gpu {}

/// A loaded kernel.
#[derive(Clone, Copy, Debug)]
pub struct Function {
    function: sys::CUfunction,
    threads: (u32, u32, u32),
    shared_bytes: usize,
    /// Blocks of this kernel that the whole GPU runs at the same time.
    pub resident: u32,
}

// SAFETY: as for `Gpu`.
unsafe impl Send for Function {}
// SAFETY: as for `Gpu`.
unsafe impl Sync for Function {}

/// A position in the stream.
#[derive(Debug)]
pub struct Event(sys::CUevent);

// SAFETY: as for `Gpu`.
unsafe impl Send for Event {}

impl Drop for Event {
    fn drop(&mut self) {
        // SAFETY: the event was created once, and is destroyed once. After a failure nothing is
        // left to do.
        let _ = unsafe { result::event::destroy(self.0) };
    }
}

impl Gpu {
    /// Opens device `index`. Its context and allocations live as long as the process.
    pub fn open(index: usize) -> Result<Self, Failure> {
        let facts = facts(index)?;
        let device = result::device::get(index as i32).map_err(failed("cuDeviceGet"))?;
        // SAFETY: the driver returned this device, and the context is current when the stream is
        // created.
        unsafe {
            let context = result::primary_ctx::retain(device).map_err(failed("cuDevicePrimaryCtxRetain"))?;
            result::ctx::set_current(context).map_err(failed("cuCtxSetCurrent"))?;
            // A stream of the default kind is ordered with the legacy default stream, in which
            // other libraries work.
            let stream = result::stream::create(result::stream::StreamKind::Default)
                .map_err(failed("cuStreamCreate"))?;
            if facts.has_pools {
                let pool = result::device::get_default_mem_pool(device)
                    .map_err(failed("cuDeviceGetDefaultMemPool"))?;
                // The pool keeps freed memory for later buffers.
                let mut kept = u64::MAX;
                let attribute = sys::CUmemPool_attribute::CU_MEMPOOL_ATTR_RELEASE_THRESHOLD;
                result::mem_pool::set_attribute(pool, attribute, (&raw mut kept).cast())
                    .map_err(failed("cuMemPoolSetAttribute"))?;
            }
            Ok(Self { facts, context, stream })
        }
    }

    /// Makes the context current on this thread. Must come before any other call on a thread.
    pub fn make_current(&self) -> Result<(), Failure> {
        // SAFETY: the context is never released.
        unsafe { result::ctx::set_current(self.context) }.map_err(failed("cuCtxSetCurrent"))
    }

    pub fn allocate(&self, bytes: usize) -> Result<u64, Failure> {
        // SAFETY: the stream is never destroyed, and the memory is used in this stream alone.
        let allocated = unsafe {
            if self.facts.has_pools {
                result::malloc_async(self.stream, bytes).map_err(failed("cuMemAllocAsync"))
            } else {
                result::malloc_sync(bytes).map_err(failed("cuMemAlloc"))
            }
        };
        allocated.map_err(|mut failure| {
            failure.reason += &format!("; expected {bytes} bytes");
            if let Ok((free, total)) = result::mem_get_info() {
                failure.reason += &format!(", of {total} bytes {free} are free");
            }
            failure
        })
    }

    /// # Safety
    /// `pointer` came from [`Gpu::allocate`], and no later call uses it.
    pub unsafe fn free(&self, pointer: u64) -> Result<(), Failure> {
        // SAFETY: the caller guarantees the condition; earlier launches complete first in stream
        // order.
        unsafe {
            if self.facts.has_pools {
                result::free_async(pointer, self.stream).map_err(failed("cuMemFreeAsync"))
            } else {
                result::free_sync(pointer).map_err(failed("cuMemFree"))
            }
        }
    }

    /// # Safety
    /// The memory at `pointer` on the device has at least `bytes.len()` bytes.
    pub unsafe fn write(&self, pointer: u64, bytes: &[u8]) -> Result<(), Failure> {
        // SAFETY: the caller guarantees the condition. `bytes` is pageable, so it has been copied
        // when the call returns.
        unsafe { result::memcpy_htod_async(pointer, bytes, self.stream) }.map_err(failed("cuMemcpyHtoDAsync"))
    }

    /// Waits for all earlier launches, and reads `bytes` bytes.
    ///
    /// # Safety
    /// The memory at `pointer` on the device has at least `bytes` bytes.
    pub unsafe fn read(&self, pointer: u64, bytes: usize) -> Result<Vec<u8>, Failure> {
        let mut read = vec![0; bytes];
        // SAFETY: the caller guarantees the condition; `read` outlives the copy.
        unsafe { result::memcpy_dtoh_async(&mut read, pointer, self.stream) }
            .map_err(failed("cuMemcpyDtoHAsync"))?;
        self.wait()?;
        Ok(read)
    }

    pub fn wait(&self) -> Result<(), Failure> {
        // SAFETY: the stream is never destroyed.
        unsafe { result::stream::synchronize(self.stream) }.map_err(failed("cuStreamSynchronize"))
    }

    /// Loads a kernel from machine code or PTX.
    pub fn load(
        &self,
        image: &[u8],
        entry: &str,
        threads: (u32, u32, u32),
        shared_bytes: usize,
    ) -> Result<Function, Failure> {
        let entry = CString::new(entry).unwrap_or_default();
        // SAFETY: NVRTC made the image. The module is never unloaded.
        unsafe {
            let module =
                result::module::load_data(image.as_ptr().cast()).map_err(failed("cuModuleLoadData"))?;
            let function =
                result::module::get_function(module, entry).map_err(failed("cuModuleGetFunction"))?;
            let attribute = sys::CUfunction_attribute::CU_FUNC_ATTRIBUTE_MAX_DYNAMIC_SHARED_SIZE_BYTES;
            result::function::set_function_attribute(function, attribute, shared_bytes as i32)
                .map_err(failed("cuFuncSetAttribute"))?;
            let all = (threads.0 * threads.1 * threads.2) as i32;
            let on_one = result::occupancy::max_active_block_per_multiprocessor(function, all, shared_bytes)
                .map_err(failed("cuOccupancyMaxActiveBlocksPerMultiprocessor"))?;
            Ok(Function {
                function,
                threads,
                shared_bytes,
                resident: on_one.max(1) as u32 * self.facts.multiprocessors,
            })
        }
    }

    /// # Safety
    /// `arguments` point to the arguments of the kernel, in order, and the kernel stays within its
    /// buffers.
    pub unsafe fn launch(
        &self,
        kernel: Function,
        blocks: (u32, u32, u32),
        arguments: &mut [*mut c_void],
    ) -> Result<(), Failure> {
        // SAFETY: the caller guarantees the conditions; the arguments have been copied when the
        // call returns.
        unsafe {
            result::launch_kernel(
                kernel.function,
                blocks,
                kernel.threads,
                kernel.shared_bytes as u32,
                self.stream,
                arguments,
            )
        }
        .map_err(failed("cuLaunchKernel"))
    }

    /// Records an event after all earlier launches.
    pub fn mark(&self) -> Result<Event, Failure> {
        let event =
            result::event::create(sys::CUevent_flags::CU_EVENT_DEFAULT).map_err(failed("cuEventCreate"))?;
        let event = Event(event);
        // SAFETY: the event and the stream are alive.
        unsafe { result::event::record(event.0, self.stream) }.map_err(failed("cuEventRecord"))?;
        Ok(event)
    }

    /// Milliseconds between two events, by the clock of the device. Waits for the second event.
    pub fn between(&self, from: &Event, to: &Event) -> Result<f32, Failure> {
        // SAFETY: both events are alive and recorded.
        unsafe {
            result::event::synchronize(to.0).map_err(failed("cuEventSynchronize"))?;
            result::event::elapsed(from.0, to.0).map_err(failed("cuEventElapsedTime"))
        }
    }
}
