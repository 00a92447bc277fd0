//! Signed distances, contacts and encoding on the GPU.
//!
//! ```text
//! TeSdf ──Images──▶ buffers ──SignedDistances──▶ answers of many points
//! SolidMesh ──tesdf::Encoder, DeviceSampler──▶ TeSdf
//! Scene ──Detector──▶ contacts, in the form and order of `tesdf::collide::detect`
//! ```
//!
//! Kernels are written once, with [CubeCL](https://github.com/tracel-ai/cubecl), and run through wgpu on Vulkan, Metal and
//! DirectX 12, and as generated CUDA C++ ([`cuda`]). Everything is computed in `f32`, in the local frame of the field; `docs/gpu.md` has stages, layouts and limits.
#![warn(missing_docs)]

mod arrays;
mod contacts;
pub mod cuda;
mod detector;
mod device;
mod encode;
mod error;
mod images;
mod instances;
mod kernels;
mod placed;
mod query;
// What the kernels of the processor are compared with.
#[cfg(test)]
#[path = "../../tesdf/src/testing/mod.rs"]
#[allow(dead_code, reason = "other crates use the rest")]
mod testing;

pub use arrays::{DeviceAnswers, DeviceArray, query_arrays};
pub use detector::{
    Capacities, Counting, Detector, DetectorOptions, DeviceBytes, DeviceReport, Exchange, Lanes, Memory,
    Pruning,
};
pub use device::{Device, DeviceInfo, DeviceKind, devices};
pub use encode::{DeviceSampler, ROUNDING, SampleCounter, SampleCounts, SamplerLimits};
pub use error::GpuError;
pub use images::{ImageBytes, Images};
pub use query::{WorldAnswer, query};
