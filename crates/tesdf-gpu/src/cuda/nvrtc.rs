//! NVRTC, the compiler of CUDA C++. The library is loaded at the first use.
use std::ffi::{CStr, CString, c_char};
use std::fmt;
use std::sync::LazyLock;

use cudarc::nvrtc::{result, sys};

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
    if !is_present() {
        return Err(GpuError::NoNvrtc);
    }
    let refused = |reason: String| GpuError::Kernel { kernel: source.kernel.clone(), reason };
    let text = CString::new(source.text.as_str()).map_err(|e| refused(e.to_string()))?;
    let mut program = Program::new(&text).map_err(|e| refused(e.to_string()))?;
    let is_machine_code = architecture.starts_with("sm_");
    let mut options = vec![format!("--gpu-architecture={architecture}")];
    options.extend(OPTIONS.map(String::from));
    if is_machine_code {
        options.push("--ptxas-options=-v".into());
    }
    let compiled = program.compile(&options);
    let log = program.log();
    compiled.map_err(|e| refused(format!("{e} for {architecture}\n{log}")))?;
    let image = program.image(is_machine_code).map_err(|e| refused(e.to_string()))?;
    Ok(Compiled { image, resources: is_machine_code.then(|| resources(&log)) })
}

/// The architecture to compile for, on a GPU with compute capability `capability`, such as 90:
/// machine code for this GPU, or PTX for the next lower capability that NVRTC knows.
pub(super) fn architecture(capability: i32) -> Result<String, GpuError> {
    if !is_present() {
        return Err(GpuError::NoNvrtc);
    }
    let known = supported();
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

fn is_present() -> bool {
    // SAFETY: the call opens libraries by NVIDIA's names. Their initialisers are trusted, as for
    // the driver.
    static PRESENT: LazyLock<bool> = LazyLock::new(|| unsafe { sys::is_culib_present() });
    *PRESENT
}

/// Version of the compiler: major and minor number.
pub(super) fn version() -> Result<(i32, i32), GpuError> {
    if !is_present() {
        return Err(GpuError::NoNvrtc);
    }
    let (mut major, mut minor) = (0, 0);
    // SAFETY: the call writes two numbers, and fails only without a place for them.
    let _ = unsafe { sys::nvrtcVersion(&mut major, &mut minor) };
    Ok((major, minor))
}

fn supported() -> Vec<i32> {
    let mut count = 0;
    // SAFETY: the first call writes one number. The second call writes as many numbers as the first
    // returned.
    unsafe {
        if sys::nvrtcGetNumSupportedArchs(&mut count).result().is_err() {
            return Vec::new();
        }
        let mut known = vec![0; count.max(0) as usize];
        if sys::nvrtcGetSupportedArchs(known.as_mut_ptr()).result().is_err() {
            return Vec::new();
        }
        known
    }
}

/// A program of NVRTC. Dropping it destroys it.
struct Program<'a> {
    program: sys::nvrtcProgram,
    /// NVRTC may keep a pointer to the text.
    _text: &'a CStr,
}

impl<'a> Program<'a> {
    fn new(text: &'a CStr) -> Result<Self, result::NvrtcError> {
        Ok(Self { program: result::create_program(text, None)?, _text: text })
    }

    fn compile(&mut self, options: &[String]) -> Result<(), result::NvrtcError> {
        // SAFETY: the program is alive until it is dropped. The options contain no zero bytes.
        unsafe {
            result::compile_program(self.program, &options.iter().map(String::as_str).collect::<Vec<_>>())
        }
    }

    fn log(&self) -> String {
        // SAFETY: the program is alive, and the log ends with a zero byte.
        let log = unsafe { result::get_program_log(self.program) }.unwrap_or_default();
        let bytes: Vec<u8> = log.iter().map(|&c| c as u8).take_while(|&c| c != 0).collect();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    fn image(&self, is_machine_code: bool) -> Result<Vec<u8>, result::NvrtcError> {
        let mut size = 0;
        // SAFETY: the program is alive, and the buffer has the size that NVRTC returned.
        unsafe {
            if is_machine_code {
                sys::nvrtcGetCUBINSize(self.program, &mut size).result()?;
            } else {
                sys::nvrtcGetPTXSize(self.program, &mut size).result()?;
            }
            let mut image = vec![0u8; size];
            let to = image.as_mut_ptr().cast::<c_char>();
            if is_machine_code {
                sys::nvrtcGetCUBIN(self.program, to).result()?;
            } else {
                sys::nvrtcGetPTX(self.program, to).result()?;
            }
            Ok(image)
        }
    }
}

impl Drop for Program<'_> {
    fn drop(&mut self) {
        // SAFETY: `new` created the program, and it is destroyed once. After a failure nothing is
        // left to do.
        let _ = unsafe { result::destroy_program(self.program) };
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
