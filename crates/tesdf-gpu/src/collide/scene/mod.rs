//! Shapes and instances as the device holds them.
pub mod instances;
mod movable;
mod moving;
pub mod pack;
pub mod placed;
mod roots;
mod shapes;

pub use shapes::{GpuShapeId, GpuShapes, ShapeBytes};
