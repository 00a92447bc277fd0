//! `tesdf slice FILE -o out.png`: draws the signed distance on an axis-aligned plane, with
//! contours, cells and the surface.
//!
//! With `--error` it draws where the asset is exact instead ([`draw_error`]).
//!
//! [`draw`] takes a [`View`], a function that returns the signed distance, and the [`Overlay`] of
//! the plane's sections. It returns a PNG and does not depend on the asset.
mod colour;
mod cut;
mod error;
mod picture;
mod text;
pub(crate) mod ticks;

use std::path::PathBuf;

use tesdf::asset::CellKind;
use tesdf::geometry::Aabb;
use tesdf::glam::DVec3;

pub use cut::{Axis, View, cut_tetrahedron, cut_triangle};
pub use error::{Deviation, draw_error};
pub use picture::{PictureError, draw};

use crate::terminal::output::{self, Consent};
use crate::terminal::report::{Failure, Outcome};
use crate::terminal::{asset_file, parse};

/// Arguments of `tesdf slice`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A .tesdf file
    #[arg(value_parser = parse::input())]
    pub file: PathBuf,
    /// Output PNG file; an existing file is replaced, a pipe or device is written to
    #[arg(short, long, value_name = "PNG", value_parser = parse::output())]
    pub output: PathBuf,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// The plane is perpendicular to this axis
    #[arg(long, value_enum, default_value_t = Axis::Z)]
    pub axis: Axis,
    /// Relative position of the plane: 0 is the lower end of the mesh, 1 the upper end [default:
    /// 0.5]
    #[arg(long, value_name = "FRACTION", value_parser = parse::fraction, conflicts_with = "offset", allow_hyphen_values = true)]
    pub at: Option<f64>,
    /// Coordinate of the plane along the axis, in the mesh's unit
    #[arg(long, value_name = "LENGTH", value_parser = parse::number, allow_hyphen_values = true)]
    pub offset: Option<f64>,
    /// Draw where the signed distance is exact in the domain, and its error elsewhere; useful for
    /// truncated or sampled lists
    #[arg(long)]
    pub error: bool,
    /// Length of the picture's longer side, pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1200)]
    pub size: u32,
}

impl Args {
    /// The plane through a mesh with these bounds, with the file's name as title.
    pub fn view(&self, bounds: Aabb, unit: &str) -> View {
        let [low, high] = [bounds.min, bounds.max].map(|p| self.axis.along(p));
        let offset = self.offset.unwrap_or_else(|| low + (high - low) * self.at.unwrap_or(0.5));
        let mut view = View::of_box(self.axis, offset, bounds.min, bounds.max);
        view.unit = unit.to_string();
        view.title = self.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        view
    }
}

/// Draws the picture and saves it.
///
/// # Errors
/// The asset cannot be opened, the size or the view cannot be drawn, or the file cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let output = output::open(&args.output, std::slice::from_ref(&args.file), args.consent)?;
    let asset = asset_file::open(&args.file)?;
    let about = asset.about();
    let view = args.view(asset_file::bounds(&asset), about.options.unit.as_deref().unwrap_or(""));
    let faces = (0..asset.face_count()).map(|face| asset.face_corners(face));
    let mut overlay = Overlay::of(&view, [], faces);
    asset.visit_cells(|cell| {
        let label = match cell.kind {
            CellKind::Inside => CellLabel::Inside,
            CellKind::Outside => CellLabel::Outside,
            CellKind::Crossing => CellLabel::Crossing,
            CellKind::FarInside | CellKind::FarOutside => CellLabel::Far,
            CellKind::NotOfDomain => return,
        };
        if let Some(polygon) = cut_tetrahedron(view.axis, view.offset, cell.corners) {
            overlay.cells.push(CellOutline { polygon, label });
        }
    });
    let png = if args.error {
        // Cells would hide the borders of the bands.
        overlay.cells.clear();
        let deviation = |p: DVec3| {
            let found = asset.query_in_domain(p)?.signed_distance;
            let exact = asset.query_by_tree(p).signed_distance;
            Some(Deviation { exact, error: (found - exact).abs() })
        };
        let tolerance = EXACT * asset.bounds().extent().length();
        draw_error(&view, &overlay, args.size, tolerance, deviation)
    } else {
        draw(&view, &overlay, args.size, |p| asset.signed_distance_f32(p))
    }
    .map_err(Failure::new)?;
    output::write(&output, &png)?;
    Ok(Outcome::Good)
}

/// Errors up to this fraction of the diagonal count as zero.
const EXACT: f64 = 1e-6;

/// Position of a cell relative to the solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellLabel {
    /// Inside the solid.
    Inside,
    /// Outside the solid.
    Outside,
    /// Crossed by the surface.
    Crossing,
    /// Far from the surface, without a list of faces.
    Far,
}

/// The section of a tetrahedron with the plane.
#[derive(Clone, Debug)]
pub struct CellOutline {
    /// Three or four corners in the plane, in order around the polygon, in the mesh's unit.
    pub polygon: Vec<[f64; 2]>,
    /// Position of the cell relative to the solid.
    pub label: CellLabel,
}

/// Lines that are drawn over the colours.
#[derive(Clone, Debug, Default)]
pub struct Overlay {
    /// Sections of cells, as thin lines.
    pub cells: Vec<CellOutline>,
    /// Section of the surface, as a strong line, in the mesh's unit.
    pub surface: Vec<[[f64; 2]; 2]>,
}

impl Overlay {
    /// The sections of labelled tetrahedra and of the surface's triangles with the plane of `view`.
    pub fn of(
        view: &View,
        cells: impl IntoIterator<Item = ([DVec3; 4], CellLabel)>,
        surface: impl IntoIterator<Item = [DVec3; 3]>,
    ) -> Self {
        let outline = |(corners, label)| {
            let polygon = cut_tetrahedron(view.axis, view.offset, corners)?;
            Some(CellOutline { polygon, label })
        };
        Self {
            cells: cells.into_iter().filter_map(outline).collect(),
            surface: surface
                .into_iter()
                .filter_map(|corners| cut_triangle(view.axis, view.offset, corners))
                .collect(),
        }
    }
}
