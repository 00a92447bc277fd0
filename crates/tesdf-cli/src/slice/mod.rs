//! A picture of a signed distance on an axis-aligned plane: colours, contours, cells and the cut surface.
//!
//! In go a [`View`], a function that gives the signed distance and the [`Overlay`] of what the plane cuts; out comes a
//! PNG. Nothing here knows what an asset is.
mod colour;
mod cut;
mod picture;
mod text;
mod ticks;

pub use cut::{Axis, View, cut_tetrahedron, cut_triangle};
pub use picture::{PictureError, draw};

/// Where a cell lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellLabel {
    /// Inside the solid.
    Inside,
    /// Outside the solid.
    Outside,
    /// On both sides of the surface.
    Crossing,
}

/// A tetrahedron cut by the plane.
#[derive(Clone, Debug)]
pub struct CellOutline {
    /// Corners in the plane, three or four, in order around the polygon; mesh unit.
    pub polygon: Vec<[f64; 2]>,
    /// Where the cell lies.
    pub label: CellLabel,
}

/// What is drawn over the colours.
#[derive(Clone, Debug, Default)]
pub struct Overlay {
    /// Cells, as thin lines.
    pub cells: Vec<CellOutline>,
    /// The surface cut by the plane, as a strong line; mesh unit.
    pub surface: Vec<[[f64; 2]; 2]>,
}
