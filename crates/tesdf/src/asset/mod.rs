//! The `.tesdf` file: an open container, memory-mapped, and checked before any section is read.
//!
//! The input is a list of named arrays ([`Section`]) and text metadata. The output is one string of
//! bytes, the same for the same input. It is a valid
//! [safetensors](https://github.com/huggingface/safetensors) file: `safetensors.numpy.load_file`
//! and all other readers of that format read its arrays without code of ours.
//!
//! ```text
//! byte 0   length n of the header, u64 little-endian, a multiple of 8
//!      8   {"__metadata__":{"format":"tesdf","version":"1","checksum":"<64 hex digits>",…},
//!           "name":{"dtype":"F32","shape":[1000,3],"data_offsets":[0,12000]},…}
//!          padded with spaces to n bytes
//!  8 + n   the sections, back to back, widest element first, so that each is aligned
//!          to its element
//! ```
//!
//! `checksum` is BLAKE3 of the first 8 + n bytes, with its own 64 digits set to `0`.
//! `checksum.NAME` is BLAKE3 of section NAME. Together they cover every byte of the file.
pub mod about;
mod cell_bounds;
mod cells;
mod conforming;
mod container;
#[cfg(feature = "collide")]
pub(crate) mod corner_cones;
mod entries;
mod error;
mod face_record;
#[cfg(feature = "collide")]
mod faces_at;
#[cfg(feature = "collide")]
mod faces_by_id;
mod header;
mod incidence;
mod inner_ball;
pub mod layout;
mod motion;
pub(crate) mod options;
mod roots;
mod section;
mod te_sdf;
#[cfg(feature = "encode")]
mod write;

pub(crate) use cell_bounds::CellBounds;
pub use cells::{CellKind, CellView};
pub(crate) use conforming::Conforming;
pub use container::{Container, SharedSection};
pub use error::AssetError;
pub use face_record::FaceRecord;
pub(crate) use incidence::Incidence;
pub(crate) use inner_ball::InnerBall;
pub(crate) use motion::Motion;
pub use section::{Element, Presence, Section, SectionSpec};
pub use te_sdf::TeSdf;
#[cfg(feature = "encode")]
pub use write::{save_atomic, write_container};

/// The version of the file format for assets whose sign is that of the winding number. Most are.
pub const FORMAT_VERSION: u32 = 1;
/// The version for assets whose sign needs more: a rule that is evaluated over all faces, or a
/// thickness. Apart from this it is version 1. A build reads these two versions.
pub const FORMAT_VERSION_OF_RULES: u32 = 2;
