//! The gradient that most opposes a face, where several faces of a body are equally near to a
//! point.
use cubecl::prelude::*;
use tesdf::collide::internal;

use crate::kernels::geometry::triangle::part_of;
use crate::kernels::geometry::vector::{LEAST_DIVISOR, V3, pick, same, v3};
use crate::kernels::query::face_walk::face_walk;
use crate::kernels::query::locate::Cell;
use crate::kernels::query::nearest::to_box;
use crate::kernels::query::value::Value;
use crate::kernels::scene::shape::{BOX, Field, FieldExpand, KIND, NONE, SIZES};

/// Below this cosine, a gradient opposes a normal so well that ties are not looked for.
const OPPOSITE: f32 = -0.999;
/// Faces whose distances differ by less (local frame) are equally near: the error of a distance in
/// `f32`. On the processor it is 1e-12 (`TIE` in `tesdf::collide::field`), as for cosines.
pub const TIE: f32 = internal::ROUNDING as f32;
/// Cosines that differ by less are equal.
const COSINE_TIE: f32 = 1e-6;

#[cube]
impl Field<'_> {
    /// The value `v` at a point. Where several faces are equally near, with the gradient that most
    /// opposes `normal`; among equals, that of the lowest face. For any shape.
    pub fn opposing(self, cell: Cell, p: V3, normal: V3, v: Value) -> Value {
        let mut best = v;
        if normal.dot(normal) > 0.5f32 && v.gradient.dot(normal) >= OPPOSITE {
            if self.is_mesh() {
                best = self.most_opposing_face(cell, p, normal, v);
            } else if self.entry(KIND) == BOX && v.distance <= 0.0f32 {
                best = most_opposing_side(self.vector(SIZES), p, normal, v);
            }
        }
        best
    }

    fn most_opposing_face(self, cell: Cell, p: V3, normal: V3, v: Value) -> Value {
        let limit = v.distance.abs() + TIE;
        let by_list = cell.is_listed() && self.has_exact_lists();
        let mut walk = face_walk(self.list(select(by_list, cell.offset(), 0u32)), by_list);
        let far = limit * limit;
        let mut best = v;
        let mut open = true;
        while open {
            let mut i = 0u32;
            while i < walk.count {
                best = self.more_opposing(p, normal, best, walk.face(self, i), limit);
                i += 1u32;
            }
            walk.count = 0u32;
            open = walk.is_open();
            if open {
                let node = walk.next();
                if node != NONE {
                    let boxes = self.node_boxes(node);
                    let (left, right) = (to_box(p, boxes.left) <= far, to_box(p, boxes.right) <= far);
                    walk.look_into(self, node, left, right);
                }
            }
        }
        best
    }

    /// The value by a face, when the face is within `limit` and opposes the normal more than `best`
    /// does.
    fn more_opposing(self, p: V3, normal: V3, best: Value, face: u32, limit: f32) -> Value {
        let f = self.face(face);
        let c = f.closest(p, part_of(f.distance_squared(p)));
        let distance = c.outward.length();
        let is_inside = best.distance < 0.0f32;
        // On the surface, the gradients are the normals of the faces.
        let on_surface = best.distance.abs() <= TIE;
        let turned = !same(c.height < 0.0f32, is_inside);
        // A sheet has both of its sides there.
        let other_side = self.half_thickness() > 0.0f32 && f.normal.dot(normal) > 0.0f32;
        let turned = select(on_surface, other_side, turned);
        let over_face = f.normal * select(turned, -1.0f32, 1.0f32);
        let away = c.outward * (select(is_inside, -1.0f32, 1.0f32) / distance.max(LEAST_DIVISOR));
        let gradient = pick(on_surface || c.feature == 0u32, over_face, away);
        let own = gradient.dot(normal);
        let other = best.gradient.dot(normal);
        let is_better = own < other - COSINE_TIE || (own < other + COSINE_TIE && face < best.face);
        let taken = distance <= limit && gradient.dot(gradient) > 0.5f32 && is_better;
        Value {
            distance: best.distance,
            gradient: pick(taken, gradient, best.gradient),
            point: pick(taken, c.point, best.point),
            face: select(taken, face, best.face),
            feature: select(taken, c.feature, best.feature),
        }
    }
}

/// The side of a box, among the sides that are equally near to a point inside, whose gradient most
/// opposes `normal`.
#[cube]
fn most_opposing_side(half: V3, p: V3, normal: V3, v: Value) -> Value {
    let tie = COSINE_TIE * half.greatest();
    let mut best = v;
    let mut axis = 0u32;
    while axis < 3u32 {
        let at = p.at(axis);
        let sign = select(at < 0.0f32, -1.0f32, 1.0f32);
        let outward = v3(
            select(axis == 0u32, sign, 0.0f32),
            select(axis == 1u32, sign, 0.0f32),
            select(axis == 2u32, sign, 0.0f32),
        );
        let depth = half.at(axis) - at.abs();
        if depth <= tie - v.distance && outward.dot(normal) < best.gradient.dot(normal) {
            best.gradient = outward;
            best.point = p + outward * depth;
            best.face = 2u32 * axis + select(at < 0.0f32, 0u32, 1u32);
        }
        axis += 1u32;
    }
    best
}
