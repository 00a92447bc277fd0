//! The vertices, edges and faces of two bodies at which a contact is.
use glam::DVec3;
use serde::Serialize;

use crate::TeSdf;
use crate::collide::report::contact::{Contact, FeatureB};
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::pose::Placement;
use crate::collide::scene::shape::Shape;
use crate::collide::scene::shape::least_and_most;
use crate::collide::scene::simple::{Simple, box_node};
use crate::geometry::Triangle;

/// A point is at a vertex or an edge when it is nearer than this part of the diagonal of the larger
/// body, which is the rounding of contacts in `f32`; of a much smaller body, at most this part of
/// its own diagonal.
const OF_LARGER: f64 = 2e-6;
const OF_SMALLER: f64 = 1e-4;

/// The vertices, edges or faces of two bodies that touch in a contact, by
/// [`Contact::touching_features`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct TouchingFeatures {
    /// That of the instance `instance_a`.
    pub a: FeatureB,
    /// That of the instance `instance_b`.
    pub b: FeatureB,
}

impl Contact {
    /// The vertices, edges or faces at the two points of the contact. Where both orders of a pair of
    /// instances find the same two features, `a` and `b` are swapped in the other order. So the
    /// instances with these features name a contact of two bodies.
    ///
    /// A point is at a vertex or an edge when it is nearer than 2e-6 of the diagonal of the larger
    /// body, at most 1e-4 of that of the smaller one. Edges between coplanar faces count.
    /// [`feature`](Self::feature) instead has the face of *a*, and of *b* the nearest feature to
    /// `point_a`, also where this is beside an edge by less than contacts are known.
    ///
    /// Of a box, vertices have the numbers of its nodes, edges those of their two vertices, and
    /// faces those of its sides, 0 to 5 for −x +x −y +y −z +z, as in `face_b`. A cylinder has the
    /// face 0 on its round side, 1 and 2 at its ends at −z and +z. Planes, spheres and capsules have
    /// the face 0.
    ///
    /// `scene` is that of the detection, with the same poses. Contacts do not keep the answer:
    /// it costs time only where it is asked for, and no memory.
    ///
    /// # Errors
    /// [`CollideError::NoInstance`] for an instance that the scene lacks, and
    /// [`CollideError::Option`] for a face that its shape lacks: the contact is of another scene.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::glam::{DQuat, DVec3};
    /// use tesdf::collide::FeatureB;
    /// use tesdf::{CollideOptions, Instance, Pose, Scene, Shape, detect};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let mut scene = Scene::new();
    /// let cube = scene.add_shape(Shape::Box { half_extents: DVec3::ONE })?;
    /// let floor = scene.add_shape(Shape::Plane)?;
    /// // On an edge.
    /// let rotation = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_4);
    /// scene.add(Instance::new(cube, Pose { translation: DVec3::Z * 2f64.sqrt(), rotation }))?;
    /// scene.add(Instance::new(floor, Pose::IDENTITY))?;
    /// let options = CollideOptions { contact_distance: 1e-3, ..CollideOptions::default() };
    /// for contact in detect(&scene, &options)? {
    ///     let features = contact.touching_features(&scene)?;
    ///     let of_cube = if contact.instance_a.0 == 0 { features.a } else { features.b };
    ///     assert!(!matches!(of_cube, FeatureB::Face(_)));
    /// }
    /// # Ok(())
    /// # }
    /// ```
    pub fn touching_features(&self, scene: &Scene) -> Result<TouchingFeatures, CollideError> {
        let bodies = [scene.placed(self.instance_a)?, scene.placed(self.instance_b)?];
        let sizes = bodies.map(|(shape, placement)| shape.diagonal() * placement.scale);
        let (least, most) = least_and_most(sizes);
        let near = (OF_LARGER * most).min(OF_SMALLER * least);
        let [a, b] = bodies;
        Ok(TouchingFeatures {
            a: feature(a, self.point_a, self.face_a, near)?,
            b: feature(b, self.point_b, self.face_b, near)?,
        })
    }
}

/// The feature of a body at a point on a face of it, in the world.
fn feature(
    (shape, placement): (&Shape, Placement),
    point: DVec3,
    face: u32,
    near: f64,
) -> Result<FeatureB, CollideError> {
    let (at, near) = (placement.to_shape(point), near / placement.scale);
    match shape {
        Shape::Mesh(asset) => of_mesh(asset, at, face, near).ok_or_else(|| CollideError::Option {
            option: "face",
            found: format!("{face} (of {})", asset.face_count()),
            expected: "a face of the body: the contact is of another scene",
        }),
        Shape::Box { half_extents } => Ok(of_box(*half_extents, at, near)),
        Shape::Cylinder { .. } => Ok(FeatureB::Face(Simple::from(shape).value(at).position)),
        Shape::Plane | Shape::Sphere { .. } | Shape::Capsule { .. } => Ok(FeatureB::Face(0)),
    }
}

fn of_mesh(asset: &TeSdf, at: DVec3, face: u32, near: f64) -> Option<FeatureB> {
    let place = asset.place_of_face(face)?;
    let (corners, vertices) = (asset.face_corners(place), asset.face_vertices(place));
    // The surface of a sheet is off its faces.
    let at = Triangle::new(corners).closest(at).point;
    let nearest = |distance: [f64; 3]| {
        let k = (0..3).min_by(|&i, &j| distance[i].total_cmp(&distance[j])).unwrap_or(0);
        (distance[k] <= near).then_some(k)
    };
    if let Some(k) = nearest(corners.map(|corner| corner.distance(at))) {
        return Some(FeatureB::Vertex(vertices[k]));
    }
    let to_side = |k: usize| {
        let (start, side) = (corners[k], corners[(k + 1) % 3] - corners[k]);
        (at - start).cross(side).length() / side.length()
    };
    Some(match nearest([0, 1, 2].map(to_side)) {
        Some(k) => {
            let (p, q) = (vertices[k], vertices[(k + 1) % 3]);
            FeatureB::Edge(p.min(q), p.max(q))
        }
        None => FeatureB::Face(face),
    })
}

fn of_box(half: DVec3, at: DVec3, near: f64) -> FeatureB {
    let gap = half - at.abs();
    let nearest = (0..3).min_by(|&i, &j| gap[i].total_cmp(&gap[j])).unwrap_or(0);
    let is_at = |axis: usize| axis == nearest || gap[axis] <= near;
    let is_high = |axis: usize| at[axis] >= 0.0;
    match [0, 1, 2].map(is_at) {
        [true, true, true] => FeatureB::Vertex(box_node([0, 1, 2].map(is_high))),
        [true, true, false] | [true, false, true] | [false, true, true] => {
            let along = (0..3).find(|&axis| !is_at(axis)).unwrap_or(0);
            let end =
                |high: bool| box_node([0, 1, 2].map(|axis| if axis == along { high } else { is_high(axis) }));
            let (p, q) = (end(false), end(true));
            FeatureB::Edge(p.min(q), p.max(q))
        }
        _ => FeatureB::Face(2 * nearest as u32 + u32::from(is_high(nearest))),
    }
}
