//! Ground types that every stage may use: lengths, sides, progress, certificates, names of units.
//!
//! This module uses no other module.
mod certificate;
mod chains;
pub mod elementary;
mod inside;
mod isa;
mod length;
mod named;
mod progress;
mod side;
pub mod unit;

pub use certificate::Certificate;
pub(crate) use certificate::{Proved, Written};
pub(crate) use chains::Chains;
pub use inside::{Inside, InsideRule, SurfaceFaces};
pub use isa::Isa;
pub use length::Length;
pub(crate) use length::four_digits;
pub use named::Named;
pub use progress::{Progress, Stage};
pub use side::Side;
