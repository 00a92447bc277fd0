//! The kernels as CUDA C++, and NVIDIA GPUs that have CUDA but no graphics driver.
//!
//! # One way to launch
//!
//! Host code launches a kernel as `kernel::launch(device.client(), count, threads, arguments…)`, whatever the device is: a
//! [`Client`](cubecl::client::Client) hides which server runs the launch. wgpu's server comes with CubeCL. `cuda::server` is ours for CUDA; CubeCL's
//! own builds LLVM, reads indirect counts back, and takes no memory that others allocated.
//!
//! ```text
//! kernel ──source──▶ CUDA C++ ──nvrtc──▶ machine code ──driver──▶ launch
//!           cubecl-cpp           library of CUDA           driver of the GPU
//! ```
//!
//! What makes the text needs no GPU and no CUDA, what compiles it no GPU: [`sources`] gives the text of every kernel in
//! `kernels::catalog`, and tests compile all of it.
//!
//! # Binary interface
//!
//! A kernel is an `extern "C"` function. Its arguments, in order:
//! 1. a pointer for each buffer, in the order of the Rust function; a struct of buffers is its fields, in order,
//! 2. `info_st`, by value: the scalars, each type in an array of its own, padded to 8 bytes (`u32` is `scalars_u32`), then `static_meta`, the
//!    length of each buffer in elements, in the order of the pointers. It is absent from a kernel with neither,
//! 3. with an indirect count, a pointer to three `u32`: blocks in x, y, z.
//!
//! Threads of a block are fixed by the kernel ([`CudaSource::threads`]), its shared memory is dynamic ([`CudaSource::shared_bytes`]).
//!
//! # Indirect counts
//!
//! wgpu reads the number of blocks from a buffer when the launch begins. CUDA cannot, so `cuda::source` puts a loop around the kernel: as many
//! blocks are launched as the GPU runs at a time, and each takes every so-many-th block of the count. Nothing is read back.
//!
//! # Numbers
//!
//! Products and sums are rounded one by one, divisions and roots are rounded right: CUDA gives the same bits on every GPU. Nothing tests
//! bounds: where a shader reads zero or another element, a CUDA kernel may end the context.
//!
//! # Memory of others
//!
//! All work is in one stream of the GPU's primary context, which torch and Warp use too. That stream waits for the legacy default stream and the
//! other way round; who works in further streams has to wait for them. [`DeviceArray::from_raw_ptr`](crate::DeviceArray) takes a pointer as an array, and nothing is copied.
#[cfg(feature = "cuda")]
mod driver;
#[cfg(feature = "cuda")]
mod memory;
#[cfg(feature = "cuda")]
mod nvrtc;
#[cfg(feature = "cuda")]
pub(crate) mod server;
mod source;

#[cfg(feature = "cuda")]
pub use nvrtc::{Compiled, Resources, compile};
pub use source::{Count, CudaSource, sources};
