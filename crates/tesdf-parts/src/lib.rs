//! Closed triangle meshes of machine parts, from their parameters.
//!
//! ```text
//! Bolt, Gear, Shaft, … ──mesh(Resolution)──▶ SolidMesh ──tesdf::encode──▶ TeSdf
//! ```
//!
//! - [`Bolt`] and [`Nut`]: ISO metric threads, sizes M3 to M36, any clearance.
//! - [`LobedPeg`] and [`LobedHole`].
//! - [`Gear`]: involute spur gear, with a hub and a dog clutch if asked. [`Sleeve`]: a splined
//!   sleeve with dog teeth on both ends and a groove for a fork. [`Shaft`]: sections of different
//!   diameters, keyways and splines.
//! - [`ChainLink`] and [`Spool`], [`Finger`] of a gripper, [`Spoon`].
//!
//! Lengths are in metres. Parts are made to be put together: their docs say at which pose they fit.
//!
//! ```
//! use tesdf::Encoder;
//! use tesdf_parts::{Bolt, Nut, Resolution, Size};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let size: Size = "M16".parse()?;
//! let bolt = Bolt { length: 30e-3, thread_length: 24e-3, ..Bolt::iso_4014(size) };
//! let nut = Nut { clearance: 25e-6, ..Nut::iso_4032(size) };
//! let coarse = Resolution::Segments(24); // of a turn; or Resolution::Deviation(10e-6)
//! let bolt = Encoder::new().unit("m").encode(&bolt.mesh(coarse)?)?;
//! let nut = Encoder::new().unit("m").encode(&nut.mesh(coarse)?)?;
//! assert!(bolt.face_count() > 1000 && nut.face_count() > 1000);
//! # Ok(())
//! # }
//! ```
//!
//! # Closed by construction, without booleans
//!
//! A part is a set of blocks (`surface.rs`): bands between rings, helical surfaces, and flat faces
//! with holes. Neighbouring blocks share vertices by number, so nothing is welded. Features that
//! programs for solids would cut with a boolean are built: the rim of a keyway passes through
//! columns of its cylinder, and dog teeth stand on holes of a face. Flat faces come from spade,
//! whose triangulation decides by exact predicates.
//!
//! No boolean crate is used. In November 2026, manifold-rust was at version 0.19 and boolmesh at
//! 0.2, each before a stable interface, and manifold-csg builds C++. A boolean also rounds the
//! vertices on its cuts, while the vertices of these parts are where the dimensions say.
//!
//! `mesh` returns a checked [`SolidMesh`](tesdf::SolidMesh) that
//! [is simple](tesdf::SolidMesh::is_simple): a closed manifold that does not touch itself.
//! Parameters that would give anything else are a [`PartError`].
//!
//! # Curves
//!
//! Vertices lie on the curves, and chords inside of convex ones. So bolts, pegs, shafts and gears
//! are never larger than asked. Threads of nuts and lobed holes are widened until their chords have
//! the clearance. Round bores and splined bores are not widened: add the deviation to the
//! clearance.
#![warn(missing_docs)]
mod bolt;
mod chain_link;
mod dogs;
mod error;
mod finger;
mod gear;
mod helix;
mod involute;
mod lobed;
mod nut;
mod outline;
mod resolution;
mod shaft;
mod sleeve;
mod spline;
mod spool;
mod spoon;
mod surface;
mod thread;

pub use bolt::Bolt;
pub use chain_link::ChainLink;
pub use dogs::Dogs;
pub use error::PartError;
pub use finger::Finger;
pub use gear::{Gear, Hub};
pub use involute::Teeth;
pub use lobed::{LobedHole, LobedPeg, Lobes};
pub use nut::Nut;
pub use resolution::Resolution;
pub use shaft::{Keyway, Profile, Section, Shaft};
pub use sleeve::Sleeve;
pub use spline::{Bore, Spline};
pub use spool::{Groove, Spool};
pub use spoon::Spoon;
pub use thread::{Size, Thread, ThreadRows};
