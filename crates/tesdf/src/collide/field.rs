//! The body whose signed distance field it is.
use glam::DVec3;

use super::field_value::FieldValue;
use super::simple::Simple;
use super::{FeatureB, Placement, Shape};
use crate::TeSdf;
use crate::geometry::Feature;
use crate::query::{Faces, Place, Precision};

/// A field in the frame that it is computed in: the local frame of an asset, the frame of a simple shape.
#[derive(Clone, Copy, Debug)]
pub enum Field<'a> {
    /// Of an encoded mesh.
    Mesh(&'a TeSdf),
    /// Of a plane, box, sphere or capsule.
    Simple(Simple),
}

/// A field placed in the world.
#[derive(Clone, Debug)]
pub struct FieldBody<'a> {
    /// The field.
    pub field: Field<'a>,
    placement: Placement,
}

/// What `f32` may be off by, in the local frame of an asset: twice what is promised for queries.
pub const ROUNDING: f64 = 2e-6;

/// What a value may be off by in `f64`, relative to the numbers that it is made of.
const FAR: f64 = 1e-12;

impl<'a> FieldBody<'a> {
    /// The field of a shape.
    pub fn new(shape: &'a Shape, placement: Placement) -> Self {
        let field = match shape {
            Shape::Mesh(asset) => Field::Mesh(asset),
            simple => Field::Simple(Simple::from(simple)),
        };
        Self { field, placement }
    }

    /// World units per unit of the field's frame.
    pub fn unit(&self) -> f64 {
        match self.field {
            Field::Mesh(asset) => self.placement.scale * asset.frame.inverse_scale(),
            Field::Simple(_) => self.placement.scale,
        }
    }

    /// From the world to the field's frame.
    pub fn to_field(&self, p: DVec3) -> DVec3 {
        let p = self.placement.to_shape(p);
        match self.field {
            Field::Mesh(asset) => asset.frame.to_local(p),
            Field::Simple(_) => p,
        }
    }

    /// From the field's frame to the world.
    pub fn to_world(&self, p: DVec3) -> DVec3 {
        match self.field {
            Field::Mesh(asset) => self.placement.to_world(asset.frame.to_world(p)),
            Field::Simple(_) => self.placement.to_world(p),
        }
    }

    /// Of a direction, from the field's frame to the world.
    pub fn rotate(&self, v: DVec3) -> DVec3 {
        self.placement.pose.rotation * v
    }

    /// Of a direction, from the world to the field's frame.
    pub fn rotate_back(&self, v: DVec3) -> DVec3 {
        self.placement.pose.rotation.inverse() * v
    }

    /// Whether no point within `radius` of `p` can have a signed distance up to `reach`; all in the field's frame. May
    /// say no where it is so.
    pub fn is_beyond(&self, p: DVec3, radius: f64, reach: f64) -> bool {
        let limit = radius + reach;
        // Far out the bounds are nearly the body.
        if let Field::Mesh(asset) = self.field
            && asset.local_bounds().distance_squared(p) > (limit.max(0.0) + ROUNDING).powi(2)
        {
            return true;
        }
        let (distance, slack) = self.rough(p);
        distance > limit + slack
    }

    /// The signed distance at `p`, and what it may be off by; in the field's frame.
    pub fn rough(&self, p: DVec3) -> (f64, f64) {
        match self.field {
            Field::Mesh(asset) => {
                // Between listed distances and true ones no ball can be ruled out.
                let distance = asset.found_exactly(p).signed_distance;
                (distance, ROUNDING + FAR * distance.abs())
            }
            // Rounding of a formula, relative to the size of its numbers.
            Field::Simple(simple) => {
                let distance = simple.value(p).distance;
                (distance, FAR * (distance.abs() + p.abs().max_element()))
            }
        }
    }

    /// No point within `radius` of `p` has a lower signed distance than this; all in the field's frame.
    pub fn least_within(&self, p: DVec3, radius: f64) -> f64 {
        let (distance, slack) = self.rough(p);
        distance - slack - radius
    }

    /// Radius of a ball inside, in the field's frame; see [`Shape::inner_ball`].
    pub fn inner_radius(&self) -> Option<f64> {
        match self.field {
            Field::Mesh(asset) => Some(asset.inner_ball().radius).filter(|&radius| radius > 0.0),
            Field::Simple(simple) => simple.inner_radius(),
        }
    }

    /// The names of a face and a feature, as the user knows them.
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

/// The field within one cell: all of its points are answered in the same way.
#[derive(Clone, Copy, Debug)]
pub enum CellField<'a> {
    /// A cell of a mesh's domain, with the faces of its list if it has one.
    Mesh {
        /// The mesh.
        asset: &'a TeSdf,
        /// Where the cell lies.
        place: Place,
        /// Its list; empty without one.
        faces: &'a Faces,
    },
    /// All of a simple shape's field.
    Simple(Simple),
}

impl CellField<'_> {
    /// The value at a point of the cell; the point is finite.
    #[inline]
    pub fn value(&self, p: DVec3, precision: Precision) -> FieldValue {
        match *self {
            Self::Mesh { asset, place, faces } => asset.find(p, place, faces, precision).into(),
            Self::Simple(simple) => simple.value(p),
        }
    }
}
