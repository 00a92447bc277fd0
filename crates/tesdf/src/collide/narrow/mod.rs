//! Narrow phase: the least signed distance over a node or a clipped polygon, and its point.
mod branch_and_bound;
mod exact;
mod frank_wolfe;

pub use branch_and_bound::greatest_minimum;

use glam::DVec3;

use super::field::{CellField, Field, FieldBody, ROUNDING};
use super::field_value::FieldValue;
use super::middle::{self, ClippedPolygon};
use super::polygon::Polygon;
use super::surface::Part;
use super::{CollideOptions, Mode};
use crate::query::{Faces, Place, Precision};

/// The least signed distance of a part in one cell, in the field's frame.
#[derive(Clone, Copy, Debug)]
pub struct Minimum {
    /// The point of the part.
    pub point: DVec3,
    /// The field's value there.
    pub value: FieldValue,
    /// The cell's word; `None` where the face tree or a formula answered.
    pub cell: Option<u32>,
    /// Whether the error is within the tolerance.
    pub converged: bool,
}

/// Result of a search over one polygon: a point of it, and whether no other point is lower by more
/// than the tolerance.
struct Lowest {
    point: DVec3,
    converged: bool,
}

/// Parameters of the search for minima in one field. Lengths are in its frame.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    mode: Mode,
    iterations: u32,
    /// Signed distances above this are ignored.
    pub reach: f64,
    tolerance: f64,
    precision: Precision,
}

/// From this tolerance on, searches use `f32`, whose rounding is then small relative to the
/// tolerance.
const COARSE: f64 = 20.0 * ROUNDING;

impl Search {
    /// `reach` is the contact distance and `diagonal` that of the field's body, both in the world's
    /// unit.
    pub fn new(options: &CollideOptions, reach: f64, field: &FieldBody, diagonal: f64) -> Self {
        let unit = field.unit();
        let tolerance = match options.mode {
            Mode::Exact => options.tolerance.resolve(diagonal) / unit,
            Mode::Node | Mode::Face => 0.0,
        };
        let CollideOptions { mode, iterations, precision, .. } = *options;
        Self { mode, iterations, reach: reach / unit, tolerance, precision }
    }

    /// The same search up to another signed distance (field's frame).
    pub fn within(self, reach: f64) -> Self {
        Self { reach, ..self }
    }

    /// Clips a part by the cells of the field and visits each polygon.
    pub fn polygons(&self, field: &FieldBody, part: &Part, visit: &mut impl FnMut(&ClippedPolygon)) {
        let polygon = Polygon::new(part.points());
        // Bounds of cells are only known outside: a cell that contains a part of the solid has the
        // bound 0.
        let reach = (self.reach + part.radius).max(0.0);
        match (field.field, part.points()) {
            (Field::Mesh(asset), &[point]) => middle::locate(asset, point, reach, visit),
            (Field::Mesh(asset), _) => middle::clip(asset, polygon, reach, visit),
            (Field::Simple(_), _) => {
                visit(&ClippedPolygon { polygon, place: Place::NotOfDomain, cell: None });
            }
        }
    }

    /// Finds the minima of a part, cell by cell, that are within reach. `polygon` receives every
    /// polygon, `found` every minimum.
    pub fn minima(
        &self,
        field: &FieldBody,
        part: &Part,
        polygon: &mut impl FnMut(&ClippedPolygon),
        found: &mut impl FnMut(&ClippedPolygon, Minimum),
    ) {
        let reach = self.reach + part.radius;
        self.polygons(field, part, &mut |clipped| {
            polygon(clipped);
            let mut look = |cell: &CellField| {
                if let Some(minimum) = self.in_cell(cell, clipped, part, reach) {
                    found(clipped, minimum);
                }
            };
            match (field.field, clipped.place) {
                (Field::Simple(simple), _) => look(&CellField::Simple(simple)),
                (Field::Mesh(asset), place @ Place::Listed { offset, .. }) => {
                    asset.with_list(offset, |faces| look(&CellField::Mesh { asset, place, faces }));
                }
                (Field::Mesh(asset), place) => {
                    look(&CellField::Mesh { asset, place, faces: &Faces::default() })
                }
            }
        });
    }

    fn in_cell(
        &self,
        cell: &CellField,
        clipped: &ClippedPolygon,
        part: &Part,
        reach: f64,
    ) -> Option<Minimum> {
        let polygon = &clipped.polygon;
        let lowest = match self.mode {
            _ if polygon.vertices().len() == 1 => {
                Some(Lowest { point: polygon.vertices()[0].point, converged: true })
            }
            Mode::Node => Some(Lowest { point: polygon.vertices()[0].point, converged: true }),
            Mode::Face => frank_wolfe::lowest(cell, polygon, self.iterations, reach),
            Mode::Exact => {
                let precision = if self.tolerance >= COARSE { Precision::F32 } else { Precision::F64 };
                exact::lowest(cell, polygon, part.normal, self.tolerance, reach, precision)
            }
        }?;
        let value = cell.value(lowest.point, self.precision);
        let listed = matches!(clipped.place, Place::Listed { .. });
        (value.distance <= reach).then_some(Minimum {
            point: lowest.point,
            value,
            cell: clipped.cell.filter(|_| listed),
            converged: lowest.converged,
        })
    }
}
