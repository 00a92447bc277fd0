//! The kernels as CUDA C++, for NVIDIA GPUs with CUDA, also where no graphics driver is installed.
//!
//! Tests compile each kernel with NVRTC, and run the generated code on the processor. An NVIDIA
//! H100 gave the same bytes.
//!
//! # One way to launch
//!
//! Host code launches a kernel in one way on every device:
//! `kernel::launch(device.client(), count, threads, arguments…)`. A
//! [`Client`](cubecl::client::Client) hides the server that runs the launch. CubeCL has the server
//! for wgpu. The server for CUDA, `cuda::server`, belongs to this crate, because CubeCL's server
//! for CUDA builds LLVM, reads indirect counts back to the host, and accepts no memory of other
//! libraries.
//!
//! ```text
//! kernel ──source──▶ CUDA C++ ──nvrtc──▶ machine code ──driver──▶ launch
//!           cubecl-cpp           library of CUDA           driver of the GPU
//! ```
//!
//! Machine code is kept on disk ([`compile_ahead`]).
//!
//! Generating the text needs neither a GPU nor CUDA, and compiling it needs no GPU. [`sources`]
//! returns the text of every kernel in `kernels::catalog`, and tests compile each of them.
//!
//! # Binary interface
//!
//! A kernel is an `extern "C"` function. It takes these arguments, in this order:
//! 1. a pointer for each buffer, in the order of the Rust function; a struct of buffers gives one
//!    pointer for each field, in the order of the fields;
//! 2. `info_st`, by value: first the scalars, with one array for each type, padded to 8 bytes
//!    (`u32` is `scalars_u32`), then `static_meta`, the length of each buffer in elements, in the
//!    order of the pointers. A kernel without scalars and lengths has no `info_st`;
//! 3. in an indirect launch, a pointer to three `u32`: the number of blocks in x, y and z.
//!
//! The kernel fixes the number of threads of a block ([`CudaSource::threads`]). Its shared memory
//! is dynamic ([`CudaSource::shared_bytes`]).
//!
//! # Indirect counts
//!
//! wgpu reads the number of blocks from a buffer when the launch begins. CUDA cannot do this, so
//! `cuda::source` puts a loop around the kernel. The number of launched blocks depends on the GPU
//! alone: a few times the blocks that it runs at the same time. Together these blocks step through
//! all blocks of the count. The host reads nothing back.
//!
//! # Numbers
//!
//! Each product and each sum is rounded by itself, and divisions and square roots are correctly
//! rounded. By the rules of CUDA, the bits are then equal on every GPU. Kernels have no bounds
//! checks: where a shader reads zero or another element, a CUDA kernel may end the context.
//!
//! # Memory of other libraries
//!
//! All work is in one stream of the GPU's primary context, which torch and Warp use too. This
//! stream and the legacy default stream wait for each other. A caller that works in other streams
//! must wait for this stream. [`DeviceArray::from_raw_ptr`](crate::DeviceArray) wraps a pointer as
//! an array, without a copy.
#[cfg(feature = "cuda")]
mod driver;
#[cfg(feature = "cuda")]
mod kernel_cache;
#[cfg(feature = "cuda")]
mod memory;
#[cfg(feature = "cuda")]
mod nvrtc;
#[cfg(feature = "cuda")]
pub(crate) mod server;
mod source;

#[cfg(feature = "cuda")]
pub use kernel_cache::compile_ahead;
#[cfg(feature = "cuda")]
pub use nvrtc::{Compiled, Resources, compile};
pub use source::{CudaSource, sources};

pub use crate::kernels::catalog::Count;
