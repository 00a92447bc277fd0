//! A voxel grid of signed distances: the baseline of the paper's Table III.
//!
//! ```text
//! TeSdf ──VoxelGrid::new──▶ VoxelGrid ──VoxelDetector──▶ Contacts
//!                               └─────────accuracy─────▶ VoxelAccuracy
//! ```
//!
//! - [`VoxelGrid`]: exact distances at the corners of voxels, trilinear values and gradients
//!   between them.
//! - [`VoxelDetector`]: contacts of nodes or faces with the grids of the bodies, behind
//!   [`Detect`](tesdf_sim::newton::Detect).
//! - [`accuracy`](accuracy()): the greatest error near the surface.
mod accuracy;
mod detect;
mod fill;
mod grid;

pub use accuracy::{VoxelAccuracy, accuracy};
pub use detect::VoxelDetector;
pub use fill::{VoxelError, VoxelOptions};
pub use grid::{VoxelGrid, VoxelValue};
