//! Playback of recorded runs.
//!
//! ```text
//! RunRecord, System ──Playback::new──▶ Playback ──glb──▶ run.glb
//!                                          └──contacts, forces, page──▶ page.html
//! ```
//!
//! - [`Playback`]: the bodies of a run at chosen steps, with their meshes.
//! - [`Frames`]: which steps these are.
//! - [`glb()`]: an animated GLB file, which Blender, three.js and others play.
//! - [`Playback::contacts`]: the contacts of each frame, recorded or detected again.
//! - [`Playback::forces`]: the recorded forces of each frame.
//! - [`page()`]: a page that plays the run in a browser, without a server.
//! - [`LiveView`]: a page that follows a run while it is made.
//!
//! Units are SI: metres, seconds. Everything is deterministic: the same run gives the same bytes.
#![warn(missing_docs)]

mod colour;
mod contacts;
mod error;
mod forces;
mod frames;
mod glb;
mod live;
mod mesh;
mod normals;
mod page;
mod playback;
mod simple;

pub use colour::{Linear, linear, of_body, srgb};
pub use contacts::{ContactOptions, DrawnContact, FrameContacts};
pub use error::PlaybackError;
pub use forces::{DrawnForce, FrameForces};
pub use frames::Frames;
pub use glb::{GlbOptions, glb};
pub use live::{LiveFrame, LiveView};
pub use mesh::Mesh;
pub use normals::SmoothNormals;
pub use page::{Arrows, page};
pub use playback::{DrawnBody, Part, Playback};
pub use simple::round_step;
