//! Narrow phase: the least signed distance over a node or a clipped polygon, and its point.
mod branch_and_bound;
mod deepest;
mod exact;
pub mod extremes;
mod frank_wolfe;
mod jump;
mod over_cylinder;
mod simple_shape;

use glam::DVec3;

use crate::collide::bodies::clip::{self, ClippedPolygon};
use crate::collide::bodies::field::{CellField, Field, FieldBody, ROUNDING, TIE};
use crate::collide::bodies::polygon::Polygon;
use crate::collide::bodies::surface::Part;
use crate::collide::mode::{ContactsPer, Mode};
use crate::collide::options::CollideOptions;
use crate::collide::scene::field_value::FieldValue;
use crate::geometry::{Aabb, Triangle};
use crate::query::{Faces, Place, Precision, Surroundings};
use extremes::{OPPOSES, Patch};

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
    /// The corner of the part that the point is, if it is one.
    pub corner: Option<u8>,
    /// Whether the point was found as the lowest of its part, not as an extreme of what touches.
    pub is_lowest: bool,
}

/// Result of a search over one polygon: a point of it, and whether no other point is lower by more
/// than the tolerance.
struct Lowest {
    point: DVec3,
    converged: bool,
    /// The face that is nearest to the point, up to the tolerance, where the polygon is outside.
    face: Option<u32>,
}

/// Parameters of the search for minima in one field. Lengths are in its frame.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    mode: Mode,
    /// A part with a longer edge is large against a body (field's frame).
    large: f64,
    /// Signed distances above this are ignored.
    pub reach: f64,
    /// Least distances are found up to this.
    pub tolerance: f64,
    precision: Precision,
}

/// From this tolerance on, searches use `f32`, whose rounding is then small relative to the
/// tolerance.
const COARSE: f64 = 20.0 * ROUNDING;

/// A face is large against a body when its longest edge exceeds this fraction of the body's
/// diagonal. One contact for such a face would not hold the other body up. Smaller faces have
/// neighbours whose contacts do.
pub const LARGE: f64 = 1.0 / 16.0;

impl Search {
    /// `reach` is the contact distance; `diagonals` are those of the surface's and the field's
    /// body. All in the world's unit.
    pub fn new(options: &CollideOptions, reach: f64, field: &FieldBody, diagonals: [f64; 2]) -> Self {
        let unit = field.unit();
        let of_faces = options.mode.faces().copied().unwrap_or_default();
        let tolerance = of_faces.tolerance.resolve(diagonals[1]) / unit;
        let large = LARGE * diagonals[0].min(diagonals[1]) / unit;
        let CollideOptions { mode, precision, .. } = *options;
        Self { mode, large, reach: reach / unit, tolerance, precision }
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
            (Field::Mesh(asset), &[point]) => clip::locate(asset, point, reach, visit),
            (Field::Mesh(asset), _) => clip::clip(asset, polygon, reach, visit),
            (Field::Simple(_), _) => {
                visit(&ClippedPolygon { polygon, place: Place::NotOfDomain, cell: None });
            }
        }
    }

    /// Whether a part is so large against a body that its corners alone do not hold it up.
    pub fn is_large(&self, part: &Part) -> bool {
        let points = part.points();
        let edges = (0..points.len()).map(|i| points[i].distance_squared(points[(i + 1) % points.len()]));
        edges.fold(0.0, f64::max) > self.large * self.large
    }

    /// Whether parts are searched as a whole, not cell by cell.
    pub fn is_of_faces(&self) -> bool {
        matches!(self.mode.contacts_per(), Some(ContactsPer::Face | ContactsPer::Minimum))
    }

    /// The mesh around parts that lie near each other, for [`minima`](Self::minima). `None` where
    /// parts are searched cell by cell, and for simple shapes.
    pub fn surroundings<'a, 'p>(
        &self,
        field: &FieldBody<'a>,
        parts: impl Iterator<Item = &'p Part>,
    ) -> Option<Surroundings<'a>> {
        let Field::Mesh(asset) = field.field else { return None };
        let (mut bounds, mut radius) = (Aabb::EMPTY, 0.0f64);
        if !self.is_of_faces() {
            return None;
        }
        for part in parts {
            (bounds, radius) = (bounds.union(Aabb::of(part.points())), radius.max(part.radius));
        }
        let limit = self.reach.max(0.0) + radius + self.tolerance + ROUNDING;
        Some(Surroundings::new(asset, bounds, limit))
    }

    /// Finds the minima of a part that are within reach, cell by cell or over the whole part.
    /// `around` is the mesh around it, where that is known. `polygon` receives every polygon,
    /// `found` every minimum.
    pub fn minima(
        &self,
        field: &FieldBody,
        part: &Part,
        around: Option<&Surroundings>,
        polygon: &mut impl FnMut(&ClippedPolygon),
        found: &mut impl FnMut(&ClippedPolygon, Minimum),
    ) {
        if self.is_of_faces() {
            return match (around, field.field) {
                (Some(around), _) => self.of_face(&CellField::Whole(around), part, polygon, found),
                (None, Field::Mesh(asset)) => {
                    self.of_face(&CellField::Whole(&Surroundings::all(asset)), part, polygon, found)
                }
                (None, Field::Simple(simple)) => {
                    self.of_face(&CellField::Simple(simple), part, polygon, found)
                }
            };
        }
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

    /// The least signed distance over a whole face that Frank–Wolfe finds in this number of
    /// iterations; infinite beyond reach.
    pub fn frank_wolfe(&self, field: &FieldBody, face: &Triangle, iterations: u32) -> f64 {
        let least = |cell: &CellField| {
            let lowest = frank_wolfe::lowest(cell, &Polygon::new(&face.corners), iterations, self.reach);
            lowest.map_or(f64::INFINITY, |lowest| cell.value(lowest.point, self.precision).distance)
        };
        match field.field {
            Field::Mesh(asset) => least(&CellField::Whole(&Surroundings::all(asset))),
            Field::Simple(simple) => least(&CellField::Simple(simple)),
        }
    }

    /// The least signed distance over a whole part. Where the part is flat on the field's body, or
    /// large, also the extremes of what touches.
    fn of_face(
        &self,
        everywhere: &CellField,
        part: &Part,
        polygon: &mut impl FnMut(&ClippedPolygon),
        found: &mut impl FnMut(&ClippedPolygon, Minimum),
    ) {
        let whole =
            ClippedPolygon { polygon: Polygon::new(part.points()), place: Place::NotOfDomain, cell: None };
        polygon(&whole);
        let reach = self.reach + part.radius;
        let Some(minimum) = self.in_cell(everywhere, &whole, part, reach) else { return };
        // The minimum is found up to the tolerance: at its point, near a border of the other body, the
        // side of that body may be nearer than the face that the part is flat on.
        let tie = self.tolerance.clamp(TIE, ROUNDING);
        let value = everywhere.most_opposing(minimum.point, part.normal, tie, minimum.value, self.precision);
        let on_face = Minimum { value, ..minimum };
        let extremes = Patch::new(everywhere, part, &on_face, self).extremes();
        let leans = minimum.value.gradient.dot(part.normal) >= OPPOSES;
        found(&whole, if leans { on_face } else { minimum });
        extremes.into_iter().for_each(|extreme| found(&whole, extreme));
    }

    /// The lowest point of a polygon of a part, within the tolerance.
    fn exact(&self, cell: &CellField, polygon: &Polygon, part: &Part, reach: f64) -> Option<Lowest> {
        let precision = if self.tolerance >= COARSE { Precision::F32 } else { Precision::F64 };
        let normal = part.normal;
        if let Some(jump) = cell.jump() {
            return jump::lowest(jump, cell, polygon, normal, (self.tolerance, reach), precision);
        }
        exact::lowest(cell, polygon, normal, self.tolerance, reach, precision)
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
                Some(Lowest { point: polygon.vertices()[0].point, converged: true, face: None })
            }
            Mode::Node => Some(Lowest { point: polygon.vertices()[0].point, converged: true, face: None }),
            // Steps along the gradient do not see what is beyond a jump.
            Mode::Face { iterations, .. } if cell.jump().is_none() => {
                frank_wolfe::lowest(cell, polygon, iterations, reach)
            }
            Mode::Face { .. } | Mode::Exact(_) => self.exact(cell, polygon, part, reach),
        }?;
        let Lowest { point, converged, face } = lowest;
        let normal = part.normal;
        let outside = match (cell, face) {
            (CellField::Whole(around), Some(face)) if self.precision == Precision::F64 => {
                around.asset.value_outside(point, face)
            }
            _ => None,
        };
        let value = match (outside, self.mode.contacts_per()) {
            (Some(value), _) => value,
            (None, Some(ContactsPer::Cell)) => cell.value(point, self.precision),
            (None, _) => cell.opposing(point, normal, self.precision),
        };
        let value = Some(value).filter(|value| value.distance <= reach)?;
        let converged = match self.mode {
            Mode::Face { .. } if polygon.vertices().len() > 1 && cell.jump().is_none() => {
                let least = match self.precision {
                    Precision::F64 => value,
                    Precision::F32 => cell.value(point, Precision::F64),
                };
                exact::is_least(cell, polygon, normal, point, &least, self.tolerance)
            }
            _ => converged,
        };
        let value = match (outside, self.mode.contacts_per()) {
            (Some(value), Some(ContactsPer::Face | ContactsPer::Minimum)) => {
                cell.most_opposing(point, normal, TIE, value, self.precision)
            }
            _ => value,
        };
        let listed = clipped.cell.filter(|_| matches!(clipped.place, Place::Listed { .. }));
        let cell = listed.or_else(|| cell_of(cell, point));
        let corner = part.points().iter().position(|p| *p == point).map(|k| k as u8);
        Some(Minimum { point, value, cell, converged, corner, is_lowest: true })
    }
}

/// The word of the cell whose list answers a point, in the whole field of a mesh.
fn cell_of(field: &CellField, point: DVec3) -> Option<u32> {
    let CellField::Whole(around) = field else { return None };
    match around.asset.locate_with_word(point) {
        (Place::Listed { .. }, word) => u32::try_from(word).ok(),
        _ => None,
    }
}
