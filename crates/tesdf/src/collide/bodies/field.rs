//! The body of a pair whose signed distance field is used.
use std::cell::RefCell;

use glam::DVec3;

use crate::TeSdf;
use crate::asset::layout::Label;
use crate::base::Side;
use crate::base::elementary;
use crate::collide::report::contact::FeatureB;
use crate::collide::scene::field_value::FieldValue;
use crate::collide::scene::pose::{Placement, Pose};
use crate::collide::scene::shape::Shape;
use crate::collide::scene::simple::Simple;
use crate::geometry::{Closest, Feature, GeneralizedWinding};
use crate::query::{Faces, ON_SURFACE_F64, Place, Precision, Surroundings};

/// A field in the frame of its computations: the local frame of an asset, or the frame of a simple
/// shape.
#[derive(Clone, Copy, Debug)]
pub enum Field<'a> {
    /// The field of an encoded mesh.
    Mesh(&'a TeSdf),
    /// The field of a simple shape.
    Simple(Simple),
}

impl Field<'_> {
    /// The signed distance at `p` and a bound of its error.
    pub fn rough(&self, p: DVec3) -> (f64, f64) {
        let (value, slack) = self.rough_value(p);
        (value.distance, slack)
    }

    /// As [`rough`](Self::rough), with the gradient and the nearest point.
    pub fn rough_value(&self, p: DVec3) -> (FieldValue, f64) {
        match self {
            Field::Mesh(asset) => {
                // Uses exact distances: distances from inexact lists cannot rule out a ball.
                let found = asset.found_exactly(p);
                (found.into(), ROUNDING + FAR * found.signed_distance.abs())
            }
            // The formula's rounding is relative to the size of its numbers.
            Field::Simple(simple) => {
                let value = simple.value(p);
                (value, FAR * (value.distance.abs() + p.abs().max_element()))
            }
        }
    }

    /// The number by which the sign changes where there is no face; `None` where it does not.
    pub fn jump(&self) -> Option<&GeneralizedWinding> {
        match self {
            Field::Mesh(asset) => asset.jump(),
            Field::Simple(_) => None,
        }
    }

    /// Lower bound of the signed distances within `radius` of `p`, where that at `p` is `distance`
    /// up to `slack`.
    pub fn least_in_ball(&self, p: DVec3, radius: f64, (distance, slack): (f64, f64)) -> f64 {
        let Some(jump) = self.jump() else { return distance - slack - radius };
        // Only the distance without its sign is 1-Lipschitz.
        let nearest = distance - slack - radius;
        if nearest > 0.0 && jump.is_outside_within(p, radius) {
            nearest
        } else {
            -(distance.abs() + slack + radius)
        }
    }

    /// As [`rough_value`](Self::rough_value) for several points, in order.
    pub fn rough_values(&self, points: &[DVec3]) -> Vec<FieldValue> {
        let mut values = Vec::with_capacity(points.len());
        match self {
            Field::Mesh(asset) => asset.found_exactly_all(points, |found| values.push(found.into())),
            Field::Simple(simple) => values.extend(points.iter().map(|&p| simple.value(p))),
        }
        values
    }

    /// The value at `p` in `f64`, with the exact distance also where lists are not proved exact.
    pub fn exact_value(&self, p: DVec3) -> FieldValue {
        match self {
            Field::Mesh(asset) => match asset.locate(p) {
                Place::Listed { .. } if !asset.has_exact_lists() => {
                    let is_inside = asset.found_exactly(p).signed_distance < 0.0;
                    let side = if is_inside { Side::Inside } else { Side::Outside };
                    asset.found_at(p, Place::Far(side), Precision::F64).into()
                }
                place => asset.found_at(p, place, Precision::F64).into(),
            },
            Field::Simple(simple) => simple.value(p),
        }
    }
}

/// A field placed in the world.
#[derive(Clone, Debug)]
pub struct FieldBody<'a> {
    /// The field.
    pub field: Field<'a>,
    signs: Signs,
    placement: Placement,
}

/// Whether distances have their signs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Signs {
    Kept,
    Dropped,
}

/// Error bound of `f32` in the local frame of an asset: twice the bound promised for queries.
pub const ROUNDING: f64 = 2e-6;

/// Relative error bound of a value in `f64`, with respect to the numbers in its computation.
const FAR: f64 = 1e-12;

impl<'a> FieldBody<'a> {
    /// The field of a shape.
    pub fn new(shape: &'a Shape, placement: Placement) -> Self {
        let field = match shape {
            Shape::Mesh(asset) => Field::Mesh(asset),
            simple => Field::Simple(Simple::from(simple)),
        };
        Self { field, signs: Signs::Kept, placement }
    }

    /// A field whose frame is that of the world.
    pub fn in_own_frame(field: Field<'a>) -> Self {
        Self { field, signs: Signs::Kept, placement: Placement { pose: Pose::IDENTITY, scale: 1.0 } }
    }

    /// The distance to the faces without a sign, where the sign jumps. Any other field is the same.
    pub fn without_jump(self) -> Self {
        match self.field.jump() {
            Some(_) => Self { signs: Signs::Dropped, ..self },
            None => self,
        }
    }

    /// The number by which the sign changes where there is no face; `None` where it does not.
    pub fn jump(&self) -> Option<&GeneralizedWinding> {
        self.field.jump().filter(|_| self.signs == Signs::Kept)
    }

    /// No distance is below this.
    pub fn lowest(&self) -> f64 {
        match self.signs {
            Signs::Kept => f64::NEG_INFINITY,
            Signs::Dropped => 0.0,
        }
    }

    fn value_of(&self, value: FieldValue) -> FieldValue {
        match self.signs {
            Signs::Kept => value,
            Signs::Dropped => value.unsigned(),
        }
    }

    /// As [`Field::rough_value`].
    pub fn rough_value(&self, p: DVec3) -> (FieldValue, f64) {
        let (value, slack) = self.field.rough_value(p);
        (self.value_of(value), slack)
    }

    /// As [`Field::exact_value`].
    pub fn exact_value(&self, p: DVec3) -> FieldValue {
        self.value_of(self.field.exact_value(p))
    }

    /// As [`Field::least_in_ball`].
    pub fn least_in_ball(&self, p: DVec3, radius: f64, (distance, slack): (f64, f64)) -> f64 {
        match self.signs {
            Signs::Kept => self.field.least_in_ball(p, radius, (distance, slack)),
            Signs::Dropped => (distance - slack - radius).max(0.0),
        }
    }

    /// World units per unit of the field's frame.
    pub fn unit(&self) -> f64 {
        match self.field {
            Field::Mesh(asset) => self.placement.scale * asset.frame.inverse_scale(),
            Field::Simple(_) => self.placement.scale,
        }
    }

    /// Maps a point from the world to the field's frame.
    pub fn to_field(&self, p: DVec3) -> DVec3 {
        let p = self.placement.to_shape(p);
        match self.field {
            Field::Mesh(asset) => asset.frame.to_local(p),
            Field::Simple(_) => p,
        }
    }

    /// Maps a point from the field's frame to the world.
    pub fn to_world(&self, p: DVec3) -> DVec3 {
        match self.field {
            Field::Mesh(asset) => self.placement.to_world(asset.frame.to_world(p)),
            Field::Simple(_) => self.placement.to_world(p),
        }
    }

    /// Rotates a direction from the field's frame to the world.
    pub fn rotate(&self, v: DVec3) -> DVec3 {
        self.placement.pose.rotation * v
    }

    /// Rotates a direction from the world to the field's frame.
    pub fn rotate_back(&self, v: DVec3) -> DVec3 {
        self.placement.pose.rotation.inverse() * v
    }

    /// Whether no point within `radius` of `p` can have a signed distance up to `reach`. All in the
    /// field's frame. `true` is certain; `false` may be wrong.
    pub fn is_beyond(&self, p: DVec3, radius: f64, reach: f64) -> bool {
        self.least_up_to(p, radius, reach).is_none()
    }

    /// Lower bound of the signed distance within `radius` of `p`; `None` where it is certain that
    /// no point there has a signed distance up to `reach`. All in the field's frame.
    pub fn least_up_to(&self, p: DVec3, radius: f64, reach: f64) -> Option<f64> {
        let limit = radius + reach;
        // Far out, the bounds are a good approximation of the body.
        if let Field::Mesh(asset) = self.field {
            let far = limit.max(0.0) + ROUNDING;
            let far = self.jump().map_or(far, |jump| far.max(radius + jump.reach_beyond()));
            if asset.local_bounds().distance_squared(p) > elementary::powi(far, 2) {
                return None;
            }
        }
        let (distance, slack) = self.rough(p);
        if self.field.jump().is_some() {
            let least = self.least_in_ball(p, radius, (distance, slack));
            return (least <= reach).then_some(least);
        }
        (distance <= limit + slack).then_some(distance - slack - radius)
    }

    /// Lower bound of the distances that contacts within `radius` of `p` report; `None` where none
    /// is up to `reach`. All in the field's frame.
    pub fn least_contact(&self, p: DVec3, radius: f64, reach: f64) -> Option<f64> {
        let least = self.least_up_to(p, radius, reach)?;
        // A list that lacks faces gives too great a depth.
        let is_unknown = least < 0.0 && !self.has_exact_lists();
        Some(if is_unknown { f64::NEG_INFINITY } else { least })
    }

    /// Contacts at one vertex report distances that differ by less than this (field's frame). With
    /// this slack, a contact is known together with all others at its vertex.
    pub fn rounding(&self) -> f64 {
        match self.field {
            Field::Mesh(_) => ROUNDING,
            Field::Simple(_) => 0.0,
        }
    }

    /// How far the surface of the body lies from the points where the field is 0: half of the
    /// thickness of a sheet, whose field is the distance to its faces; otherwise 0. In the field's
    /// frame.
    pub fn half_thickness(&self) -> f64 {
        if let Field::Mesh(asset) = self.field { asset.half_thickness } else { 0.0 }
    }

    /// Whether all values are exact up to rounding, inside the body, too.
    pub fn has_exact_lists(&self) -> bool {
        !matches!(self.field, Field::Mesh(asset) if !asset.has_exact_lists())
    }

    /// The signed distance at `p` and a bound of its error, in the field's frame.
    pub fn rough(&self, p: DVec3) -> (f64, f64) {
        let (value, slack) = self.rough_value(p);
        (value.distance, slack)
    }

    /// The value at `p`. Where several faces are equally near, with the gradient that most opposes
    /// `normal`. In the field's frame.
    pub fn opposing(&self, p: DVec3, normal: DVec3, precision: Precision) -> FieldValue {
        match self.field {
            Field::Mesh(asset) => CellField::Whole(&Surroundings::all(asset)).opposing(p, normal, precision),
            Field::Simple(simple) => CellField::Simple(simple).opposing(p, normal, precision),
        }
    }

    /// Lower bound of the signed distance within `radius` of `p`. All in the field's frame.
    pub fn least_within(&self, p: DVec3, radius: f64) -> f64 {
        self.least_in_ball(p, radius, self.rough(p))
    }

    /// The lowest value that a signed distance can have where it jumps at a point with this one.
    pub fn lowest_beside(&self, distance: f64) -> f64 {
        if self.jump().is_some() { -distance.abs() } else { distance }
    }

    /// The nearest points of a part's surface and of the body's surface, where the part's core is
    /// at `point` and has this radius, the thickness of the body included. All in the field's
    /// frame.
    pub fn surface_points(&self, point: DVec3, radius: f64, value: &FieldValue) -> [DVec3; 2] {
        let half = self.half_thickness();
        [point - (radius - half) * value.gradient, value.closest_point + half * value.gradient]
    }

    /// Radius of a ball inside, in the field's frame; see [`Shape::inner_ball`].
    pub fn inner_radius(&self) -> Option<f64> {
        match self.field {
            Field::Mesh(asset) => Some(asset.inner_ball().radius).filter(|&radius| radius > 0.0),
            Field::Simple(simple) => simple.inner_radius(),
        }
    }

    /// The ids of a face and a feature in the user's numbering.
    pub fn names(&self, value: &FieldValue) -> (u32, FeatureB) {
        let Field::Mesh(asset) = self.field else {
            return (value.position, FeatureB::Face(value.position));
        };
        let corners = asset.faces[value.position as usize];
        let face = asset.face_ids[value.position as usize];
        let feature = match value.feature {
            Feature::Face => FeatureB::Face(face),
            Feature::Vertex(k) => FeatureB::Vertex(corners[usize::from(k)]),
            Feature::Edge(k) => {
                let (a, b) = (corners[usize::from(k)], corners[(usize::from(k) + 1) % 3]);
                FeatureB::Edge(a.min(b), a.max(b))
            }
        };
        (face, feature)
    }
}

/// The field for the points of one polygon: within one cell, where all points are answered in the
/// same way, or everywhere.
#[derive(Clone, Copy, Debug)]
pub enum CellField<'a> {
    /// A cell of a mesh's domain, with the faces of its list, if it has one.
    Mesh {
        /// The mesh.
        asset: &'a TeSdf,
        /// The part of the asset that answers the cell's points.
        place: Place,
        /// The faces of its list; empty without a list.
        faces: &'a Faces,
    },
    /// The complete field of a mesh around some polygons.
    Whole(&'a Surroundings<'a>),
    /// The complete field of a simple shape.
    Simple(Simple),
}

impl CellField<'_> {
    /// The value at a point of the polygon. The point must be finite.
    #[inline]
    pub fn value(&self, p: DVec3, precision: Precision) -> FieldValue {
        match *self {
            Self::Mesh { asset, place, faces } => asset.find(p, place, faces, precision).into(),
            Self::Whole(around) => {
                let known = if precision == Precision::F64 { around.found(p) } else { None };
                let asset = around.asset;
                known.unwrap_or_else(|| asset.found_at(p, asset.locate(p), precision)).into()
            }
            Self::Simple(simple) => simple.value(p),
        }
    }

    /// The mesh, the part of it that answers points, and the faces of the list there. The whole
    /// field of a mesh has `none`. `None` for a simple shape.
    pub fn mesh<'b>(&'b self, none: &'b Faces) -> Option<(&'b TeSdf, Place, &'b Faces)> {
        match *self {
            Self::Mesh { asset, place, faces } => Some((asset, place, faces)),
            Self::Whole(around) => Some((around.asset, Place::NotOfDomain, none)),
            Self::Simple(_) => None,
        }
    }

    /// As [`Field::rough`]; for a cell of a mesh, from all its faces.
    pub fn rough(&self, p: DVec3) -> (f64, f64) {
        match *self {
            Self::Mesh { asset, .. } => Field::Mesh(asset).rough(p),
            Self::Whole(around) => {
                let distance = around.found_exactly(p).signed_distance;
                (distance, ROUNDING + FAR * distance.abs())
            }
            Self::Simple(simple) => Field::Simple(simple).rough(p),
        }
    }

    /// The number by which the sign changes where there is no face; `None` where it does not.
    pub fn jump(&self) -> Option<&GeneralizedWinding> {
        match *self {
            // All points of the cell are on one side.
            Self::Mesh { place: Place::Listed { label: Label::Inside | Label::Outside, .. }, .. } => None,
            Self::Mesh { asset, .. } => asset.jump(),
            Self::Whole(around) => around.asset.jump(),
            Self::Simple(_) => None,
        }
    }

    /// The mesh around the polygons of the whole field.
    pub fn surroundings(&self) -> Option<&Surroundings<'_>> {
        match self {
            Self::Whole(around) => Some(around),
            _ => None,
        }
    }

    /// The value at `p`. Where several faces are equally near, with the gradient that most opposes
    /// `normal`.
    pub fn opposing(&self, p: DVec3, normal: DVec3, precision: Precision) -> FieldValue {
        match (*self, precision) {
            (Self::Mesh { asset, place, faces }, Precision::F64) => asset.opposing(p, normal, place, faces),
            (Self::Whole(around), Precision::F64) => around
                .with_near(p, TIE, |found, near| around.asset.opposing_of(p, normal, found.into(), near)),
            _ => self.most_opposing(p, normal, TIE, self.value(p, precision), precision),
        }
    }

    /// As [`opposing`](Self::opposing), where the `value` is known, and faces are equally near up to
    /// `tie`.
    pub fn most_opposing(
        &self,
        p: DVec3,
        normal: DVec3,
        tie: f64,
        value: FieldValue,
        precision: Precision,
    ) -> FieldValue {
        if opposes(&value, normal) {
            return value;
        }
        let rounding = if precision == Precision::F32 { ROUNDING } else { TIE };
        let tie = tie.max(rounding);
        let near = |asset: &TeSdf, faces: &Faces| {
            asset.most_opposing(p, normal, value, [tie, rounding], |offer| {
                asset.faces_within(p, faces, value.distance.abs() + tie, &mut |face| {
                    offer(face, asset.local_triangle(face as usize).closest(p));
                });
            })
        };
        match *self {
            Self::Mesh { asset, faces, .. } => near(asset, faces),
            Self::Whole(Surroundings { asset, .. }) => match asset.locate(p) {
                Place::Listed { offset, .. } => asset.with_list(offset, |faces| near(asset, faces)),
                _ => near(asset, &Faces::default()),
            },
            Self::Simple(simple) => simple.most_opposing(p, normal, tie, value),
        }
    }
}

/// Whether the gradient opposes the normal so well that ties are not looked for. A part without a
/// normal takes any gradient.
fn opposes(value: &FieldValue, normal: DVec3) -> bool {
    normal == DVec3::ZERO || value.gradient.dot(normal) < OPPOSITE
}

/// Below this cosine a gradient opposes a normal so well that ties are not looked for.
const OPPOSITE: f64 = -0.999;

/// Faces whose distances differ by less (local frame) are equally near.
pub const TIE: f64 = 1e-12;

impl TeSdf {
    /// The value at a point outside whose nearest face is known; `None` on the surface.
    pub fn value_outside(&self, p: DVec3, face: u32) -> Option<FieldValue> {
        let closest = self.local_triangle(face as usize).closest(p);
        (closest.distance > ON_SURFACE_F64).then(|| FieldValue {
            distance: closest.distance,
            gradient: (p - closest.point) / closest.distance,
            closest_point: closest.point,
            position: face,
            feature: closest.feature,
        })
    }

    /// The value at `p` in `f64`. Of the equally near faces, the one whose gradient most opposes
    /// `normal`. `faces` are those of the place's list, if it has one.
    fn opposing(&self, p: DVec3, normal: DVec3, place: Place, faces: &Faces) -> FieldValue {
        thread_local! {
            static NEAR: RefCell<Vec<(u32, Closest)>> = const { RefCell::new(Vec::new()) };
        }
        NEAR.with_borrow_mut(|near| {
            let value = self.found_with_near(p, place, faces, TIE, near).into();
            self.opposing_of(p, normal, value, near)
        })
    }

    /// As [`opposing`](Self::opposing), where the value at `p` and the faces near it are known.
    fn opposing_of(&self, p: DVec3, normal: DVec3, value: FieldValue, near: &[(u32, Closest)]) -> FieldValue {
        if near.len() == 1 && !is_on_surface(&value, TIE) || opposes(&value, normal) {
            return value;
        }
        self.most_opposing(p, normal, value, [TIE; 2], |offer| {
            near.iter().for_each(|(face, closest)| offer(*face, *closest));
        })
    }

    /// Of the faces at the distance of `value`, up to `tie`, the one whose gradient most opposes
    /// `normal`. Up to `rounding`, points are on the surface. `near` offers all faces up to this
    /// distance, and maybe others, with their nearest points.
    fn most_opposing(
        &self,
        p: DVec3,
        normal: DVec3,
        value: FieldValue,
        [tie, rounding]: [f64; 2],
        near: impl FnOnce(&mut dyn FnMut(u32, Closest)),
    ) -> FieldValue {
        let limit = value.distance.abs() + tie;
        // On the surface the gradients are the normals of the faces, and of a sheet those of both
        // of its sides.
        let on_surface = is_on_surface(&value, rounding);
        let (mut best, mut id) = (value, self.face_ids[value.position as usize]);
        near(&mut |face, closest| {
            if closest.distance > limit || face == value.position && !on_surface {
                return;
            }
            let outward = if value.distance < 0.0 { closest.point - p } else { p - closest.point };
            let mut gradient = match on_surface {
                true => self.outward_normal(face, closest.point),
                false => outward.normalize_or_zero(),
            };
            // A face that is outside on both sides, or on none.
            let is_either = on_surface && gradient == DVec3::ZERO;
            if is_either {
                gradient = self.local_triangle(face as usize).normal;
            }
            if on_surface && (self.half_thickness > 0.0 || is_either) && gradient.dot(normal) > 0.0 {
                gradient = -gradient;
            }
            let (own, other) = (gradient.dot(normal), best.gradient.dot(normal));
            let face_id = self.face_ids[face as usize];
            let is_better = own < other - TIE || (own < other + TIE && face_id < id);
            if gradient != DVec3::ZERO && is_better {
                let (closest_point, feature) = (closest.point, closest.feature);
                best = FieldValue { gradient, closest_point, position: face, feature, ..value };
                id = face_id;
            }
        });
        best
    }
}

/// Whether the gradients at a value are the normals of the faces.
fn is_on_surface(value: &FieldValue, tie: f64) -> bool {
    value.distance.abs() <= tie.max(ON_SURFACE_F64)
}
