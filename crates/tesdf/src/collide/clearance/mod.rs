//! The signed distance between two bodies, with its points.
pub mod apart;
pub mod deepest_penetration;
pub mod least_clearance;

use crate::parallel::*;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::base::Length;
use crate::collide::bodies::field::FieldBody;
use crate::collide::bodies::surface::SurfaceBody;
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::collide::scene::pose::Placement;
use crate::collide::scene::shape::Shape;
use crate::collide::search::lowest_point::{Least, Order, least};

/// Required accuracy of a clearance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClearanceOptions {
    /// Bound of the error: a fraction of the smaller body's diagonal, or a length in the world's
    /// unit. Rounding comes in addition: about 1e-15 of the largest coordinate.
    pub tolerance: Length,
}

impl Default for ClearanceOptions {
    /// 1e-8 of the smaller diagonal.
    fn default() -> Self {
        Self { tolerance: Length::OfDiagonal(1e-8) }
    }
}

/// Distance or penetration depth of two bodies, in the world's unit and frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Clearance {
    /// Positive: the least distance between the surfaces. Negative: the lesser of two values, the
    /// least signed distance to *b* over the surface of *a*, and the least signed distance to *a*
    /// over the surface of *b*. So a body completely inside the other penetrates it.
    ///
    /// It is never below the true value by more than rounding. When `converged`, it is never above
    /// the true value by more than the tolerance.
    pub distance: f64,
    /// The true value is between this and `distance`. When `converged`, it is `distance` minus the
    /// tolerance. Otherwise it says how deep the bodies can be in each other at most.
    pub lower_bound: f64,
    /// The witness point on *a*.
    pub point_a: DVec3,
    /// The witness point on *b*. Its distance from `point_a` is `|distance|`.
    pub point_b: DVec3,
    /// Unit vector from *b* to *a*. When *a* moves along it, the clearance of the witnesses grows.
    /// Nearer than 1e-9 of its diagonal, it is the normal of the feature of `field` that is nearest.
    pub normal: DVec3,
    /// The face of *a* that contains `point_a`.
    pub face_a: u32,
    /// The face of *b* that contains `point_b`.
    pub face_b: u32,
    /// The body whose field was used. The witness on the other body is the lowest point of a face
    /// in this field, and this body's witness is the surface point nearest to it.
    pub field: InstanceId,
    /// Whether the error is within the tolerance. False when a difficult search was cut short, for
    /// example because the tolerance is below rounding.
    pub converged: bool,
    /// Whether the two solids share volume. They do where `distance` is negative (up to the
    /// tolerance). Where `distance` is 0 (up to the tolerance), they do when their surfaces
    /// coincide with both solids on the same side. An example is a body and its copy in the same
    /// pose: no point of a surface is inside the other body, and yet they overlap.
    pub overlap: bool,
}

/// The clearance of two instances, whatever their worlds, groups and exclusions.
///
/// A best-first search over the face trees of both bodies, each in the field of the other body.
/// When the bodies are apart, both orders would give the same result. Then only the surface with
/// fewer faces is searched, and the other surface only for parts inside. The search runs on the
/// current rayon pool. The result is the same for any number of threads.
///
/// The signed distance of the surface of a sphere or capsule is that of its centre or segment minus
/// its radius. This is exact while these are outside the other body. With them inside, it is at
/// most the value at the surface. A plane's half-space is infinite, so only its field is used: no
/// point of a plane is deeper in a body than the body reaches below the plane.
///
/// The signed distance of an open mesh jumps in its holes: as soon as a point of a surface is
/// inside, the clearance is minus its distance from the faces. The place of the jump is found up to
/// the tolerance.
///
/// ```
/// use tesdf::collide::{ClearanceOptions, Instance, Pose, Scene, Shape, clearance};
/// use tesdf::glam::DVec3;
///
/// let mut scene = Scene::new();
/// let ball = scene.add_shape(Shape::Sphere { radius: 1.0 })?;
/// let a = scene.add(Instance::new(ball, Pose::IDENTITY))?;
/// let b = scene.add(Instance::new(ball, Pose::at(DVec3::new(0.0, 0.0, 5.0))))?;
/// let found = clearance(&scene, a, b, &ClearanceOptions::default())?;
/// assert_eq!((found.distance, found.point_a, found.normal), (3.0, DVec3::Z, -DVec3::Z));
/// # Ok::<(), tesdf::collide::CollideError>(())
/// ```
///
/// # Errors
/// [`CollideError`] for an unknown instance, the same instance twice, two planes, an invalid
/// tolerance, or positions too far out for double precision.
pub fn clearance(
    scene: &Scene,
    a: InstanceId,
    b: InstanceId,
    options: &ClearanceOptions,
) -> Result<Clearance, CollideError> {
    let pair = Pair::new(scene, a, b)?;
    let tolerance = pair.tolerance(options.tolerance)?;
    pair.clearance(tolerance)
}

/// A body of a pair.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// Its id.
    pub id: InstanceId,
    /// Its shape.
    pub shape: &'a Shape,
    /// Its pose and scale.
    pub placement: Placement,
}

/// Two bodies whose distance is measured.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// The first body, *a*.
    pub a: Body<'a>,
    /// The second body, *b*.
    pub b: Body<'a>,
}

/// The body whose surface is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::collide) enum Surface {
    A,
    B,
}

impl Surface {
    fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

impl<'a> Pair<'a> {
    /// Two instances of a scene.
    ///
    /// # Errors
    /// As [`clearance`], except for the tolerance.
    pub fn new(scene: &'a Scene, a: InstanceId, b: InstanceId) -> Result<Self, CollideError> {
        let body = |id| {
            let (shape, placement) = scene.placed(id)?;
            Ok(Body { id, shape, placement })
        };
        let pair = Self { a: body(a)?, b: body(b)? };
        let none = |reason| Err(CollideError::NoClearance { a, b, reason });
        if a == b {
            return none("they are one and the same; expected two");
        }
        if matches!((pair.a.shape, pair.b.shape), (Shape::Plane, Shape::Plane)) {
            return none("both are planes, which are endless; expected at most one");
        }
        Ok(pair)
    }

    /// Converts a tolerance to the world's unit; fractions refer to the smaller diagonal.
    ///
    /// # Errors
    /// The tolerance is not a finite number above 0.
    pub fn tolerance(&self, tolerance: Length) -> Result<f64, CollideError> {
        let (Length::OfDiagonal(value) | Length::Absolute(value)) = tolerance;
        if !(value > 0.0 && value.is_finite()) {
            return Err(CollideError::Option {
                option: "tolerance",
                found: value.to_string(),
                expected: "a finite number greater than 0",
            });
        }
        let diagonal = |body: &Body| body.shape.diagonal() * body.placement.scale;
        Ok(tolerance.resolve(diagonal(&self.a).min(diagonal(&self.b))))
    }

    /// The clearance from both orders, to a tolerance in the world's unit.
    ///
    /// # Errors
    /// Positions are too far out.
    pub fn clearance(&self, tolerance: f64) -> Result<Clearance, CollideError> {
        let first = self.first();
        if matches!(self.a.shape, Shape::Plane) || matches!(self.b.shape, Shape::Plane) {
            return self.least(vec![(first, self.field(first))], tolerance);
        }
        let both = [first, first.other()].map(|of| (of, self.field(of)));
        let found = self.least(both.into(), tolerance)?;
        let overlap = match found.distance {
            d if d < -tolerance => true,
            d if d > tolerance => false,
            _ => self.shares_volume(tolerance),
        };
        Ok(Clearance { overlap, ..found })
    }

    /// The surfaces that can be inside the other body, each in its field.
    pub(in crate::collide) fn surfaces(&self) -> Vec<(Surface, Order<'_>)> {
        let is_plane = [&self.a, &self.b].iter().any(|body| matches!(body.shape, Shape::Plane));
        let first = self.first();
        let of = if is_plane { vec![first] } else { vec![first, first.other()] };
        of.into_iter().map(|of| (of, self.order(of, self.field(of)))).collect()
    }

    /// Whether bodies whose surfaces touch up to the tolerance share volume. It tests whether a
    /// point behind a face, by more than the tolerance, is inside both bodies.
    ///
    /// In this situation no face of one body is inside the other. So a part of one body that
    /// overlaps the other has a common surface with it, and a point behind any face of that part
    /// decides.
    fn shares_volume(&self, tolerance: f64) -> bool {
        let deep = |body: &Body, p: DVec3, depth: f64| {
            let scale = body.placement.scale;
            body.shape.signed_distance(body.placement.to_shape(p)) * scale < -0.5 * depth
        };
        let size = |body: &Body| body.shape.diagonal() * body.placement.scale;
        // The depth must be less than the thickness of a wall, and more than the tolerance and
        // rounding.
        let depths = [1e-2, 1e-3, 1e-4].map(|share| share * size(&self.a).min(size(&self.b)));
        let behind = self.behind_faces();
        depths.into_iter().filter(|&depth| depth > 8.0 * tolerance).any(|depth| {
            let point = |&(p, inward): &(DVec3, DVec3)| p + depth * inward;
            behind.par_iter().map(point).any(|p| deep(&self.a, p, depth) && deep(&self.b, p, depth))
        })
    }

    /// For each face of *a*, a point of it and the inward direction, in the world's frame; both
    /// directions where faces do not all look outward. A simple shape is convex, so one point is
    /// enough.
    fn behind_faces(&self) -> Vec<(DVec3, DVec3)> {
        let Body { shape, placement, .. } = &self.a;
        let rotate = |n: DVec3| placement.pose.rotation * n;
        let of_face = |[a, b, c]: [DVec3; 3]| {
            let normal = (b - a).cross(c - a).try_normalize()?;
            Some((placement.to_world((a + b + c) / 3.0), rotate(-normal)))
        };
        match shape {
            Shape::Mesh(asset) => {
                let of_faces = (0..asset.face_count()).filter_map(|f| of_face(asset.face_corners(f)));
                match asset.faces_look_outward() {
                    true => of_faces.collect(),
                    false => of_faces.flat_map(|(p, inward)| [(p, inward), (p, -inward)]).collect(),
                }
            }
            Shape::Plane => Vec::new(),
            // The centre of its upper side, downwards.
            simple => vec![(placement.to_world(DVec3::Z * simple.bounds().max.z), rotate(DVec3::NEG_Z))],
        }
    }

    /// The clearance from one order. It is right when neither body is inside the other. For open
    /// meshes it is the distance of the surfaces, whose sign does not jump.
    ///
    /// # Errors
    /// Positions are too far out.
    pub fn apart(&self, tolerance: f64) -> Result<Clearance, CollideError> {
        let first = self.first();
        self.least(vec![(first, self.field(first).without_jump())], tolerance)
    }

    /// The body whose surface is searched first: that with fewer faces. The round side of a cylinder is
    /// searched in parts that get ever flatter, so the surface of the other body comes before it.
    fn first(&self) -> Surface {
        let first = self.with_fewer_faces();
        match (self.body(first).shape, self.body(first.other()).shape) {
            (Shape::Cylinder { .. }, other) if !matches!(other, Shape::Plane) => first.other(),
            _ => first,
        }
    }

    /// The body with fewer faces. A plane never is, because it has no finite surface.
    fn with_fewer_faces(&self) -> Surface {
        let faces = |body: &Body| match body.shape {
            Shape::Mesh(asset) => asset.face_count(),
            Shape::Plane => usize::MAX,
            _ => 0,
        };
        if faces(&self.b) < faces(&self.a) { Surface::B } else { Surface::A }
    }

    /// The least signed distance over surfaces, each in the field of the other body.
    fn least(
        &self,
        searches: Vec<(Surface, FieldBody<'_>)>,
        tolerance: f64,
    ) -> Result<Clearance, CollideError> {
        let (surfaces, orders): (Vec<Surface>, Vec<Order>) =
            searches.into_iter().map(|(of, field)| (of, self.order(of, field))).unzip();
        let found = least(&orders, tolerance).ok_or_else(|| self.too_far())?;
        Ok(self.witnesses(surfaces[found.order], &orders[found.order], &found, tolerance))
    }

    /// The surface of a body in the field of the other one.
    fn order<'b>(&'b self, of: Surface, field: FieldBody<'b>) -> Order<'b> {
        let Body { shape, placement, .. } = self.body(of);
        Order { surface: SurfaceBody::new(shape, *placement, &field), field }
    }

    /// # Errors
    /// Positions are too far out.
    fn check_distances(&self) -> Result<(), CollideError> {
        // Numbers in 32 bits end at some 1e38, and squares of distances at the square root of that.
        const FAR: f64 = 1e15;
        let far = |body: &Body, field: &FieldBody| {
            let p = field.to_field(body.placement.pose.translation);
            p.is_nan() || p.abs().max_element() > FAR
        };
        let is_far = [Surface::A, Surface::B].iter().any(|&of| far(self.body(of), &self.field(of)));
        match is_far && !self.surfaces().iter().all(|(_, order)| order.has_distances()) {
            true => Err(self.too_far()),
            false => Ok(()),
        }
    }

    pub(in crate::collide) fn too_far(&self) -> CollideError {
        CollideError::NoClearance {
            a: self.a.id,
            b: self.b.id,
            reason: "their positions are too far out for double precision; expected the bodies nearer to the origin",
        }
    }

    /// What was found of a surface in a field.
    pub(in crate::collide) fn witnesses(
        &self,
        of: Surface,
        order: &Order,
        found: &Least,
        tolerance: f64,
    ) -> Clearance {
        let Least { distance, lower_bound, lowest, converged, .. } = *found;
        let Order { surface, field } = order;
        let gradient = lowest.value.gradient;
        let points = field.surface_points(lowest.point, lowest.radius, &lowest.value);
        let [on_surface, on_field] = points.map(|p| field.to_world(p));
        let away = field.rotate(gradient);
        let (face_surface, (face_field, _)) = (surface.face_id(lowest.face), field.names(&lowest.value));
        let (point_a, point_b, normal, face_a, face_b, field) = match of {
            Surface::A => (on_surface, on_field, away, face_surface, face_field, self.b.id),
            Surface::B => (on_field, on_surface, -away, face_field, face_surface, self.a.id),
        };
        Clearance {
            distance,
            lower_bound,
            point_a,
            point_b,
            normal,
            face_a,
            face_b,
            field,
            converged,
            overlap: distance < -tolerance,
        }
    }

    fn body(&self, of: Surface) -> &Body<'a> {
        match of {
            Surface::A => &self.a,
            Surface::B => &self.b,
        }
    }

    /// The field in which a surface is searched: that of the other body.
    fn field(&self, of: Surface) -> FieldBody<'a> {
        let Body { shape, placement, .. } = self.body(of.other());
        if let Shape::Mesh(asset) = shape {
            asset.store_normals();
        }
        FieldBody::new(shape, *placement)
    }
}
