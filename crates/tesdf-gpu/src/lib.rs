//! Signed distances, contacts and encoding by samples on the GPU.
//!
//! ```text
//! Shape ──GpuShapes::upload──▶ buffers ──signed_distances──▶ answers of many points
//! SolidMesh ──tesdf::Encoder, DeviceSampler──▶ TeSdf
//! Scene ──Detector──▶ contacts, in the form and order of `tesdf::collide::detect`
//! Scene, arrays of poses ──Detector──▶ arrays of contacts on the device
//! ```
//!
//! Each kernel is written once, in Rust with [CubeCL](https://github.com/tracel-ai/cubecl). It runs
//! through wgpu on Vulkan, Metal and DirectX 12, or as generated CUDA C++ ([`cuda`]). Tests run on
//! Vulkan's software driver, and run the CUDA C++ on the processor. An NVIDIA H100 has run it by
//! hand; Metal and DirectX 12 have not.
//!
//! Kernels compute in `f32`, in the local frame of the field. `docs/gpu/design.md` describes the
//! stages and the memory layouts.
#![warn(missing_docs)]

mod collide;
pub mod cuda;
mod device;
mod encode;
mod error;
mod islands;
#[cfg(test)]
mod kernel_tests;
mod kernels;
mod query;
// Code of `tesdf` that unit tests compare the kernels with.
#[cfg(test)]
#[path = "../../tesdf/src/testing/mod.rs"]
#[allow(dead_code, reason = "other crates use the rest")]
mod testing;

pub use collide::scene::{GpuShapeId, GpuShapes, ShapeBytes};
pub use collide::{
    Capacities, Counting, Counts, Detector, DetectorOptions, DeviceBytes, DeviceContacts, DeviceReport,
    Exchange, Lanes, Memory, PoseArrays, Pruning, SharedDetector,
};
pub use device::{Device, DeviceArray, DeviceInfo, DeviceKind, Word, devices};
pub use encode::{DeviceSampler, ROUNDING, SampleCounter, SampleCounts, SamplerLimits};
pub use error::GpuError;
pub use islands::IslandSolver;
pub use query::{DeviceAnswers, WorldAnswer};
