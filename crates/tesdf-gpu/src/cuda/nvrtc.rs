//! NVRTC, the compiler of CUDA C++. The library is loaded at the first use.
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::fmt;
use std::ptr;
use std::sync::LazyLock;

use libloading::Library;

use super::CudaSource;
use crate::GpuError;

/// Options of the compiler for every kernel. Products are not fused into sums.
pub(super) const OPTIONS: [&str; 2] = ["--fmad=false", "--std=c++17"];

/// A compiled kernel.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// Machine code (for `sm_…`), or PTX with a final zero byte (for `compute_…`).
    pub image: Vec<u8>,
    /// Resources that the kernel takes; `None` for PTX, where only the driver knows them.
    pub resources: Option<Resources>,
}

/// Resources of the GPU that the machine code of a kernel takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Resources {
    /// Registers per thread.
    pub registers: u32,
    /// Stack per thread, in bytes: spilled registers, and arrays with a computed index.
    pub stack_bytes: u32,
    /// Stores and loads of spilled registers, in bytes: (stored, loaded).
    pub spilled_bytes: (u32, u32),
    /// Static shared memory per block, in bytes.
    pub shared_bytes: u32,
}

impl Resources {
    /// Number of warps that a multiprocessor runs at the same time, in blocks of `threads` threads,
    /// as limited by registers. This holds for compute capability 8.0 and 9.0: 65,536 registers, at
    /// most 64 warps and 32 blocks.
    pub fn warps(&self, threads: u32) -> u32 {
        let of_block = threads.div_ceil(32).max(1);
        // Registers are allocated to a warp in units of 256.
        let registers = of_block * (32 * self.registers.max(1)).next_multiple_of(256);
        of_block * (65_536 / registers).min(64 / of_block).min(32)
    }
}

impl fmt::Display for Resources {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (stores, loads) = self.spilled_bytes;
        write!(
            f,
            "{} registers, {} bytes of stack, {stores} + {loads} spilled",
            self.registers, self.stack_bytes
        )
    }
}

/// Compiles a kernel for an architecture. `sm_90a` gives machine code, and `compute_75` gives PTX.
///
/// # Errors
/// [`GpuError::NoNvrtc`] when NVRTC is not installed; [`GpuError::Kernel`] with the compiler's
/// messages when NVRTC rejects the text.
pub fn compile(source: &CudaSource, architecture: &str) -> Result<Compiled, GpuError> {
    let nvrtc = nvrtc()?;
    let refused = |reason: String| GpuError::Kernel { kernel: source.kernel.clone(), reason };
    let text = CString::new(source.text.as_str()).map_err(|e| refused(e.to_string()))?;
    let mut program = Program::new(nvrtc, &text).map_err(&refused)?;
    let is_machine_code = architecture.starts_with("sm_");
    let target = format!("--gpu-architecture={architecture}");
    let mut options = vec![target.as_str()];
    options.extend(OPTIONS);
    if is_machine_code {
        options.push("--ptxas-options=-v");
    }
    let compiled = program.compile(&options);
    let log = program.log();
    compiled.map_err(|e| refused(format!("{e} for {architecture}\n{log}")))?;
    let image = program.image(is_machine_code).map_err(refused)?;
    Ok(Compiled { image, resources: is_machine_code.then(|| resources(&log)) })
}

/// The architecture to compile for, on a GPU with compute capability `capability`, such as 90:
/// machine code for this GPU, or PTX for the next lower capability that NVRTC knows.
pub(super) fn architecture(capability: i32) -> Result<String, GpuError> {
    let known = nvrtc()?.supported();
    if known.contains(&capability) {
        return Ok(format!("sm_{capability}"));
    }
    match known.iter().filter(|&&k| k < capability).max() {
        Some(below) => Ok(format!("compute_{below}")),
        None => Err(GpuError::Kernel {
            kernel: "every".into(),
            reason: format!("compute capability {capability}; this NVRTC knows {known:?}"),
        }),
    }
}

/// Version of the compiler: major and minor number.
pub(super) fn version() -> Result<(i32, i32), GpuError> {
    let (mut major, mut minor) = (0, 0);
    // SAFETY: the call writes two numbers. It fails only without a place for them.
    let _ = unsafe { (nvrtc()?.version)(&mut major, &mut minor) };
    Ok((major, minor))
}

/// Names of the library, newest first. Toolkits also install the first one, which stands for their
/// own version; packages of Python install the others alone.
const NAMES: [&str; 5] =
    ["libnvrtc.so", "libnvrtc.so.13", "libnvrtc.so.12", "nvrtc64_130_0.dll", "nvrtc64_120_0.dll"];

/// Result of a call; 0 is success.
type Status = c_int;
type Handle = *mut c_void;
type SizeOf = unsafe extern "C" fn(Handle, *mut usize) -> Status;
type Copy = unsafe extern "C" fn(Handle, *mut c_char) -> Status;

/// The functions of the library that are used here, as `nvrtc.h` of CUDA 12 and 13 declares them.
struct Nvrtc {
    version: unsafe extern "C" fn(*mut c_int, *mut c_int) -> Status,
    count_of_architectures: unsafe extern "C" fn(*mut c_int) -> Status,
    architectures: unsafe extern "C" fn(*mut c_int) -> Status,
    create: unsafe extern "C" fn(
        *mut Handle,
        *const c_char,
        *const c_char,
        c_int,
        *const *const c_char,
        *const *const c_char,
    ) -> Status,
    compile: unsafe extern "C" fn(Handle, c_int, *const *const c_char) -> Status,
    destroy: unsafe extern "C" fn(*mut Handle) -> Status,
    log_size: SizeOf,
    log: Copy,
    cubin_size: SizeOf,
    cubin: Copy,
    ptx_size: SizeOf,
    ptx: Copy,
    error: unsafe extern "C" fn(Status) -> *const c_char,
    /// Last, so that the functions are gone before the library.
    _library: Library,
}

/// The library, which is opened once.
fn nvrtc() -> Result<&'static Nvrtc, GpuError> {
    // SAFETY: the call opens libraries by NVIDIA's names. Their initialisers are trusted, as for
    // the driver.
    static NVRTC: LazyLock<Option<Nvrtc>> = LazyLock::new(|| {
        NAMES.iter().find_map(|&name| unsafe { Library::new(name) }.ok().and_then(|l| Nvrtc::of(l).ok()))
    });
    NVRTC.as_ref().ok_or(GpuError::NoNvrtc)
}

impl Nvrtc {
    fn of(library: Library) -> Result<Self, libloading::Error> {
        // SAFETY: the functions have the types that `nvrtc.h` declares.
        unsafe {
            Ok(Self {
                version: *library.get(b"nvrtcVersion")?,
                count_of_architectures: *library.get(b"nvrtcGetNumSupportedArchs")?,
                architectures: *library.get(b"nvrtcGetSupportedArchs")?,
                create: *library.get(b"nvrtcCreateProgram")?,
                compile: *library.get(b"nvrtcCompileProgram")?,
                destroy: *library.get(b"nvrtcDestroyProgram")?,
                log_size: *library.get(b"nvrtcGetProgramLogSize")?,
                log: *library.get(b"nvrtcGetProgramLog")?,
                cubin_size: *library.get(b"nvrtcGetCUBINSize")?,
                cubin: *library.get(b"nvrtcGetCUBIN")?,
                ptx_size: *library.get(b"nvrtcGetPTXSize")?,
                ptx: *library.get(b"nvrtcGetPTX")?,
                error: *library.get(b"nvrtcGetErrorString")?,
                _library: library,
            })
        }
    }

    /// Architectures that the compiler knows, such as 90.
    fn supported(&self) -> Vec<i32> {
        let mut count = 0;
        // SAFETY: the first call writes one number. The second call writes as many numbers as the
        // first returned.
        unsafe {
            if (self.count_of_architectures)(&mut count) != 0 {
                return Vec::new();
            }
            let mut known = vec![0; count.max(0) as usize];
            if (self.architectures)(known.as_mut_ptr()) != 0 {
                return Vec::new();
            }
            known
        }
    }

    /// The message of a status that is not 0.
    fn checked(&self, status: Status) -> Result<(), String> {
        if status == 0 {
            return Ok(());
        }
        // SAFETY: the message is a constant of the library.
        let message = unsafe { CStr::from_ptr((self.error)(status)) };
        Err(message.to_string_lossy().into_owned())
    }
}

/// A program of NVRTC. Dropping it destroys it.
struct Program<'a> {
    nvrtc: &'static Nvrtc,
    program: Handle,
    /// NVRTC may keep a pointer to the text.
    _text: &'a CStr,
}

impl<'a> Program<'a> {
    fn new(nvrtc: &'static Nvrtc, text: &'a CStr) -> Result<Self, String> {
        let mut program = ptr::null_mut();
        // SAFETY: the text ends with a zero byte; there are no headers.
        let status =
            unsafe { (nvrtc.create)(&mut program, text.as_ptr(), ptr::null(), 0, ptr::null(), ptr::null()) };
        nvrtc.checked(status)?;
        Ok(Self { nvrtc, program, _text: text })
    }

    fn compile(&mut self, options: &[&str]) -> Result<(), String> {
        let options: Vec<CString> =
            options.iter().map(|&o| CString::new(o)).collect::<Result<_, _>>().map_err(|e| e.to_string())?;
        let pointers: Vec<*const c_char> = options.iter().map(|o| o.as_ptr()).collect();
        // SAFETY: the program is alive until it is dropped, and so are the options.
        let status =
            unsafe { (self.nvrtc.compile)(self.program, pointers.len() as c_int, pointers.as_ptr()) };
        self.nvrtc.checked(status)
    }

    fn log(&self) -> String {
        let log = self.bytes(self.nvrtc.log_size, self.nvrtc.log).unwrap_or_default();
        let log: Vec<u8> = log.into_iter().take_while(|&c| c != 0).collect();
        String::from_utf8_lossy(&log).into_owned()
    }

    fn image(&self, is_machine_code: bool) -> Result<Vec<u8>, String> {
        let nvrtc = self.nvrtc;
        if is_machine_code {
            self.bytes(nvrtc.cubin_size, nvrtc.cubin)
        } else {
            self.bytes(nvrtc.ptx_size, nvrtc.ptx)
        }
    }

    fn bytes(&self, size_of: SizeOf, copy: Copy) -> Result<Vec<u8>, String> {
        let mut size = 0;
        // SAFETY: the program is alive, and the buffer has the size that NVRTC returned.
        unsafe {
            self.nvrtc.checked(size_of(self.program, &mut size))?;
            let mut bytes = vec![0u8; size];
            self.nvrtc.checked(copy(self.program, bytes.as_mut_ptr().cast::<c_char>()))?;
            Ok(bytes)
        }
    }
}

impl Drop for Program<'_> {
    fn drop(&mut self) {
        // SAFETY: `new` created the program, and it is destroyed once. After a failure nothing is
        // left to do.
        let _ = unsafe { (self.nvrtc.destroy)(&mut self.program) };
    }
}

/// Reads the output of `ptxas -v`: for the kernel, and for the function that an indirect kernel
/// calls.
fn resources(log: &str) -> Resources {
    let sum_before = |what: &str| -> u32 {
        log.match_indices(what)
            .filter_map(|(end, _)| log[..end].split_whitespace().next_back()?.parse::<u32>().ok())
            .sum()
    };
    Resources {
        registers: sum_before(" registers"),
        stack_bytes: sum_before(" bytes stack frame"),
        spilled_bytes: (sum_before(" bytes spill stores"), sum_before(" bytes spill loads")),
        shared_bytes: sum_before(" bytes smem"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_is_read() {
        let log = "ptxas info    : Compiling entry function 'k' for 'sm_90a'\nptxas info    : Function properties for k\nptxas         .    \
                   160 bytes stack frame, 8 bytes spill stores, 12 bytes spill loads\nptxas info    : Used 30 registers, used 0 barriers, \
                   64 bytes smem\n";
        let expected =
            Resources { registers: 30, stack_bytes: 160, spilled_bytes: (8, 12), shared_bytes: 64 };
        assert_eq!(resources(log), expected);
        // 30 registers are rounded up to 32.
        assert_eq!(expected.warps(64), 64);
        // At most 32 blocks.
        assert_eq!(expected.warps(32), 32);
        assert_eq!(Resources { registers: 65, ..expected }.warps(64), 28);
        assert_eq!(Resources { registers: 65, ..expected }.warps(128), 28);
    }
}
