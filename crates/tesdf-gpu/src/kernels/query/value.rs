//! Eq. (4): the signed distance of a shape at a point, with its gradient.
//!
//! Points are in the frame of the field. For a mesh this is the local frame, moved to the center of
//! the cube. For a simple shape it is the shape's frame.
use cubecl::prelude::*;
use tesdf::asset::layout::{SignHint, SignHints};
use tesdf::query::internal;

use crate::kernels::geometry::triangle::part_of;
use crate::kernels::geometry::vector::{V3, pick, same};
use crate::kernels::query::locate::{Cell, no_cell};
use crate::kernels::query::nearest::Nearest;
use crate::kernels::scene::shape::{Field, FieldExpand};

/// The value of a field at a point.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Value {
    /// Signed distance in the unit of the field.
    pub distance: f32,
    /// Unit gradient of the signed distance.
    pub gradient: V3,
    /// The nearest point of the surface.
    pub point: V3,
    /// Index of the nearest face; for a box the number of the side.
    pub face: u32,
    /// The nearest feature of this face: 0 the face, 1–3 its edges, 4–6 its corners.
    pub feature: u32,
}

/// Below this distance, the gradient is the normal of the nearest face.
const ON_SURFACE: f32 = internal::ON_SURFACE as f32;
/// Below this distance from a flat face, the direction to the point is unknown, because the square
/// of the distance is nearly zero in `f32`.
const ON_EDGE: f32 = 1e-15;

#[cube]
impl Field<'_> {
    /// The value at a point of a mesh, when the nearest face is known.
    pub fn mesh_value(self, cell: Cell, p: V3, nearest: Nearest) -> Value {
        let f = self.face(nearest.face);
        let c = f.closest(p, part_of(nearest.squared));
        let distance = c.outward.length();
        let flat = f.is_flat();
        let on_surface = distance < ON_SURFACE;
        let over_face = c.feature == 0u32;
        let away = distance > ON_EDGE;
        // The gradient without its sign. It is computed before the winding number, which needs
        // the registers.
        let outward = pick(away, c.outward * (1.0f32 / select(away, distance, 1.0f32)), f.across());
        let by_normal = !flat && (on_surface || over_face);
        let direction = pick(by_normal, f.normal, outward);
        let mut inside = cell.is_inside();
        let mut by_number = self.is_open() && !cell.is_listed();
        if cell.is_crossing() {
            let hint = (f.hints >> (HINT_BITS * c.feature)) & HINT_MASK;
            inside = hint == INSIDE || (hint == BY_PLANE && c.height < 0.0f32);
            // A flat face has no plane from which the side could follow.
            by_number = hint == BY_WINDING || (hint == BY_PLANE && flat);
        }
        if by_number {
            inside = self.is_inside(p);
        }
        let sign = select(inside, -1.0f32, 1.0f32);
        // Over the interior of a face, the sign of the height gives the direction more precisely
        // than the difference of two points.
        let turned = !on_surface && over_face && !same(c.height < 0.0f32, inside);
        let mut sign_of_normal = select(turned, -1.0f32, 1.0f32);
        if self.has_turned_faces() && on_surface {
            sign_of_normal = select(self.facing(nearest.face, c.point) < 0.0f32, -1.0f32, 1.0f32);
        }
        let sign_of_outward = select(away, sign, 1.0f32);
        Value {
            distance: sign * distance,
            gradient: direction * select(by_normal, sign_of_normal, sign_of_outward),
            point: c.point,
            face: nearest.face,
            feature: c.feature,
        }
    }

    /// The value at a point of a cell, when the nearest face is known. For any shape.
    pub fn value_near(self, cell: Cell, p: V3, nearest: Nearest) -> Value {
        if self.is_mesh() { self.mesh_value(cell, p, nearest) } else { self.simple_value(p) }
    }

    /// The value at a point of a cell. For any shape.
    pub fn value_in_cell(self, cell: Cell, p: V3) -> Value {
        self.value_near(cell, p, self.nearest(cell, p))
    }

    /// The value at any point. For any shape.
    pub fn value(self, p: V3) -> Value {
        let mut cell = no_cell();
        if self.is_mesh() {
            cell = self.locate(p);
        }
        self.value_in_cell(cell, p)
    }

    /// The signed distance to the surface at any point: for a sheet, half of its thickness less
    /// than the value.
    pub fn answer(self, p: V3) -> Value {
        let v = self.value(p);
        let half = self.half_thickness();
        Value {
            distance: v.distance - half,
            gradient: v.gradient,
            point: v.point + v.gradient * half,
            face: v.face,
            feature: v.feature,
        }
    }

    /// The value at a point and its cell, exact up to rounding even when lists are truncated. For
    /// any shape.
    pub fn exact_value_in(self, cell: Cell, p: V3) -> Value {
        if self.is_mesh() {
            let nearest = if cell.is_listed() && self.has_exact_lists() {
                self.nearest_in_list(self.list(cell.offset()), 0u32, 1u32, p)
            } else {
                self.nearest_of_all(p)
            };
            self.mesh_value(cell, p, nearest)
        } else {
            self.simple_value(p)
        }
    }

    /// The cell of a point. Simple shapes have no cells.
    pub fn cell_at(self, p: V3) -> Cell {
        let mut cell = no_cell();
        if self.is_mesh() {
            cell = self.locate(p);
        }
        cell
    }

    /// The same at any point.
    pub fn exact_value(self, p: V3) -> Value {
        self.exact_value_in(self.cell_at(p), p)
    }

    /// Signed distance to the surface, exact up to rounding even when lists are truncated.
    pub fn exact_distance(self, p: V3) -> f32 {
        self.exact_value(p).distance
    }
}

const HINT_BITS: u32 = SignHints::BITS;
const HINT_MASK: u32 = (1 << HINT_BITS) - 1;
const BY_WINDING: u32 = SignHint::Winding as u32;
const BY_PLANE: u32 = SignHint::Plane as u32;
const INSIDE: u32 = SignHint::Inside as u32;
