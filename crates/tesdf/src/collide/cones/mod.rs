//! Normals of contacts from the normal cones of the features that touch; proof in `docs/math.md`,
//! section 18.
//!
//! The gradient of the signed distance says in which direction the distance of one point changes.
//! Where a body lies on another one, this is the normal of any face of *b* that is as near, also
//! where an edge of *b* lies on a face of *a*: as a plane, such a contact is a wall that is not
//! there. And the point is only known to the tolerance of its distance, so just apart the gradient
//! is off by √(2 tolerance / distance). A contact's normal must be in the cone of the outward
//! normals at the place of *b*, and its opposite in that of *a*: a face has one, an edge the arc
//! between its two faces, a vertex the cone of its faces.
mod around;
mod cone;
mod elsewhere;

use glam::DVec3;

use crate::collide::bodies::field::ROUNDING;
use crate::collide::mode::ContactsPer;
use crate::collide::report::contact::Contact;
use crate::collide::scene::cylinder::Cylinder;
use crate::collide::scene::pose::Placement;
use crate::collide::scene::shape::Shape;
use crate::collide::scene::shape::least_and_most;
use crate::query::Precision;
use around::around;
use cone::{Cone, Normals, PARALLEL, SAME, SLOPE, clamped, common, crossing, is_near, least_cosine};
pub use elsewhere::{in_cones, keep_different};

/// The limits of the rule, for kernels on other devices.
pub mod limits {
    pub use super::around::{BESIDE, CLEAR, MOST_FACES};
    pub use super::cone::{ALTERNATIONS, MOST, NEAR, PARALLEL, SAME, SLOPE};
    pub use crate::asset::corner_cones::CONVEX;
}

/// A place belongs to a feature when it is nearer than this: parts of the diagonals of the smaller
/// and of the larger body. The search knows a place to its tolerance.
const OF_SMALLER: f64 = 1e-6;
const OF_LARGER: f64 = 2e-7;

/// Of the prism of a cylinder, a place this far from its edge, in radii, is not on the round side, and
/// 1 less the cosine of the angle to the lowest place.
const OFF_ROUND: f64 = 1e-5;

/// The normal cones of two bodies, in the world.
#[derive(Clone, Copy, Debug)]
pub struct Cones<'a> {
    a: Body<'a>,
    b: Body<'a>,
    /// The diagonals, in the world.
    sizes: [f64; 2],
    near: f64,
    /// Bound of the error of a distance.
    tolerance: f64,
}

/// A shape in the world.
#[derive(Clone, Copy, Debug)]
struct Body<'a> {
    shape: &'a Shape,
    placement: Placement,
}

/// A place on a body or in it, in the world.
struct Place {
    at: DVec3,
    /// Faces up to this distance belong to it.
    limit: f64,
    /// One of them, by its index in the shape.
    face: u32,
}

impl<'a> Cones<'a> {
    /// Of the body that has the faces, and the body whose field is used. `tolerance` is the bound of
    /// the error of distances in the world's unit, and `precision` is that of the contacts.
    pub fn new([a, b]: [(&'a Shape, Placement); 2], tolerance: f64, precision: Precision) -> Self {
        let [a, b] = [a, b].map(|(shape, placement)| Body { shape, placement });
        let sizes = [a, b].map(|body| body.shape.diagonal() * body.placement.scale);
        let (least, most) = least_and_most(sizes);
        let rounding = match precision {
            Precision::F64 => OF_LARGER,
            Precision::F32 => ROUNDING,
        };
        let near = (OF_SMALLER * least.min(f64::MAX)).max(rounding * most);
        Self { a, b, sizes, near, tolerance: tolerance.max(near) }
    }

    /// The distance up to which two places are one, in the world's unit.
    pub fn near(&self) -> f64 {
        self.near
    }

    /// The error of the place of a contact at a distance: the distance of a point beside the nearest
    /// one exceeds it by the square of the way over twice the distance.
    fn place(&self, distance: f64) -> f64 {
        self.near + (8.0 * self.tolerance * distance.abs()).sqrt()
    }

    /// Whether the faces of the second body have all contacts per local minimum that hold the
    /// first.
    ///
    /// *A plane*: its height is linear over each face of the other body, so it is lowest at
    /// vertices, which are contacts of their faces. Other contacts of the plane lie between them,
    /// or inside the body and less deep. The faces of a cylinder are those of a prism, one of whose
    /// edges is lowest. *A ball* has one nearest point on a convex body, which its
    /// centre finds.
    pub fn are_of_other_order(&self, per: ContactsPer) -> bool {
        let is_all = match (self.a.shape, self.b.shape) {
            (Shape::Plane, Shape::Mesh(mesh)) => mesh.faces_enclose_the_solid() && mesh.half_thickness == 0.0,
            (Shape::Plane, other) => !matches!(other, Shape::Plane),
            (Shape::Box { .. } | Shape::Cylinder { .. }, Shape::Sphere { .. }) => true,
            _ => false,
        };
        per == ContactsPer::Minimum && is_all
    }

    /// A contact of a face as a detection reports it, with the normal that the cones allow. `faces`
    /// are the indices of its faces in the shapes. Per local minimum, its distance is that along
    /// the normal, and `None` is a contact that there is not; others keep their points and
    /// distances.
    pub fn contact(&self, contact: Contact, faces: [u32; 2], per: ContactsPer) -> Option<Contact> {
        let turned = self.of(contact, faces);
        match per {
            ContactsPer::Minimum => turned,
            ContactsPer::Cell | ContactsPer::Face => Some(self.beside(contact, turned)),
        }
    }

    /// A contact of a face with the normal that the cones allow, and its distance along that
    /// normal. `faces` are the indices of its faces in the shapes. `None` where they allow none: no
    /// motion of the bodies brings these features together before others.
    ///
    /// Contacts of open meshes and sheets, at places that are not convex, and those that are deeper
    /// than the features are known, stay as they are.
    fn of(&self, contact: Contact, faces: [u32; 2]) -> Option<Contact> {
        let keep = Some(contact);
        let Contact { point_a, point_b, distance, normal, .. } = contact;
        if self.is_beside_lowest(&contact) {
            return None;
        }
        let Some(of_a) = self.a.normals(&Place { at: point_a, limit: self.near, face: faces[0] }) else {
            return keep;
        };
        if let Some(radius) = self.b.radius() {
            return self.of_round(contact, &of_a, radius);
        }
        let is_apart = distance > self.near;
        // Inside of b, the faces of one place are equally near. Outside, they have the nearest point.
        let place = match is_apart {
            true => Place { at: point_b, limit: self.near, face: faces[1] },
            false => Place { at: point_a, limit: distance.abs() + 2.0 * self.near, face: faces[1] },
        };
        let Some(of_b) = self.b.normals(&place) else { return keep };
        // Above a plane, only its normal holds, however deep.
        let is_deep = distance < -self.near && !matches!(self.a.shape, Shape::Plane);
        let otherwise = if is_deep { keep } else { None };
        let along = |normal: DVec3| Some(Contact { normal, ..contact });
        // The common normal of two edges.
        let across = match (of_a.as_slice(), of_b.as_slice()) {
            ([a, b], [c, d]) => crossing([a, b], [c, d]),
            _ => None,
        };
        match (of_a.as_slice(), of_b.as_slice(), across) {
            // The corners of a patch are at edges or vertices of one of them.
            ([m], [h], _) => {
                if h.distance(-*m) <= PARALLEL {
                    along(self.flush(-*m, *h))
                } else {
                    otherwise
                }
            }
            // The plane of the face: the way to it from the nearest point of b.
            ([m], ..) => match (is_near(of_b.iter().copied(), -*m), is_apart) {
                (false, _) => otherwise,
                (true, true) => self.turned(contact, -*m),
                (true, false) => along(-*m),
            },
            (_, [h], _) => {
                if is_near(of_a.iter().map(|n| -*n), *h) {
                    along(*h)
                } else {
                    keep
                }
            }
            (.., Some(across)) => {
                // The distance along the common normal of two edges is the same between all points
                // of their lines.
                let n = if across.dot(normal) < 0.0 { -across } else { across };
                let cones = [Cone::opposite(&of_a), Cone::new(of_b.iter().copied())];
                let is_allowed = |n: DVec3| cones.iter().all(|cone| cone.is_near(n));
                if is_apart {
                    let distance = n.dot(point_a - point_b);
                    if is_allowed(n) { Some(Contact { normal: n, distance, ..contact }) } else { keep }
                } else {
                    // The gradient may be the normal of a face along the edge of a, on neither side.
                    [n, -n].into_iter().find(|n| is_allowed(*n)).map_or(otherwise, along)
                }
            }
            _ if is_apart => {
                // The gradient of the exact place is in both cones.
                let within = clamped(&Cone::opposite(&of_a), &Cone::new(of_b.iter().copied()), normal);
                within.and_then(|normal| self.turned(contact, normal)).or(keep)
            }
            _ => {
                // The mean is the same in both orders of a pair. The gradient, moved into the
                // cones, is not: two such contacts would be a notch that locks.
                let rays = common(&Cone::opposite(&of_a), &Cone::new(of_b.iter().copied()));
                match rays.iter().sum::<DVec3>().try_normalize() {
                    Some(mean) => along(mean),
                    None if rays.is_empty() => otherwise,
                    None => keep,
                }
            }
        }
    }

    /// Whether a contact of the prism of a cylinder in the field of a mesh is beside the place where
    /// the round side touches, which the faces of the mesh find. As a plane, a contact ahead of it
    /// would stop the cylinder from turning.
    fn is_beside_lowest(&self, contact: &Contact) -> bool {
        let (Shape::Cylinder { radius, .. }, Shape::Mesh(_)) = (self.a.shape, self.b.shape) else {
            return false;
        };
        let Placement { pose, scale } = self.a.placement;
        let axis = pose.rotation * DVec3::Z;
        let beside = (contact.point_a - pose.translation).reject_from_normalized(axis) / (scale * radius);
        let is_of_round_side = contact.normal.dot(axis).abs() < SLOPE && beside.length() > 1.0 - OFF_ROUND;
        is_of_round_side && beside.normalize_or_zero().dot(-contact.normal) < 1.0 - OFF_ROUND
    }

    /// The normal of two faces that lie flush on each other, as far as bodies turn in a step. That
    /// of the larger body: a small one that comes to lie on it gets no push to the side. Of bodies
    /// of one size it is the mean. Both are the same in both orders.
    fn flush(&self, of_a: DVec3, of_b: DVec3) -> DVec3 {
        let [a, b] = self.sizes;
        if a > (1.0 + SAME) * b {
            of_a
        } else if b > (1.0 + SAME) * a {
            of_b
        } else {
            (of_a + of_b).normalize()
        }
    }

    /// A contact of bodies that are apart with another normal, and its distance along it. `None` where
    /// this is not the direction from one point to the other, as far as the places are known and
    /// the bodies may turn.
    fn turned(&self, contact: Contact, normal: DVec3) -> Option<Contact> {
        let Contact { point_a, point_b, distance, .. } = contact;
        let way = point_a - point_b;
        let is_right = normal.dot(contact.normal) > least_cosine()
            || way.distance(distance * normal) <= self.place(distance);
        is_right.then(|| Contact { normal, distance: normal.dot(way), ..contact })
    }

    /// A contact of a face that keeps its distance and its points: its normal is that of `turned`
    /// where the way from one point to the other is along it, as far as the place is known.
    fn beside(&self, contact: Contact, turned: Option<Contact>) -> Contact {
        let Contact { point_a, point_b, distance, .. } = contact;
        let is_along = |normal: &DVec3| {
            let way = point_a - point_b;
            way.distance(distance * *normal) <= self.place(distance)
        };
        let normal = turned.map(|turned| turned.normal).filter(is_along).unwrap_or(contact.normal);
        Contact { normal, ..contact }
    }

    /// A contact of a ball or capsule of a radius, in the world, with faces of these normals. The
    /// gradient is exact there, because it begins at the core.
    fn of_round(&self, contact: Contact, of_a: &[DVec3], radius: f64) -> Option<Contact> {
        let &[m] = of_a else { return Some(contact) };
        let core = contact.point_b - radius * contact.normal;
        let height = m.dot(core - contact.point_a);
        let foot = core - height * m;
        if height > 0.0 && foot.distance(contact.point_a) <= self.place(height) {
            let (normal, point_b) = (-m, core - radius * m);
            return Some(Contact { point_a: foot, point_b, normal, distance: height - radius, ..contact });
        }
        // The core is over another face, or inside.
        (height <= 0.0 || !contact.converged).then_some(contact)
    }
}

impl Body<'_> {
    /// Radius of a rounded shape, in the world.
    fn radius(&self) -> Option<f64> {
        match *self.shape {
            Shape::Sphere { radius } | Shape::Capsule { radius, .. } => Some(radius * self.placement.scale),
            _ => None,
        }
    }

    /// The different outward normals of the faces around a place, in the world. `None` where they
    /// are no cone: at rounded shapes, borders, and where the surface is concave.
    fn normals(&self, place: &Place) -> Option<Normals> {
        let at = self.placement.to_shape(place.at);
        let limit = place.limit / self.placement.scale;
        let rotation = self.placement.pose.rotation;
        let mut normals = Normals::new();
        match *self.shape {
            Shape::Plane => normals.push(rotation * DVec3::Z),
            Shape::Box { half_extents } => {
                for axis in 0..3 {
                    if half_extents[axis] - at[axis].abs() <= limit {
                        let sign = if at[axis] < 0.0 { -1.0 } else { 1.0 };
                        normals.push(rotation * (sign * DVec3::AXES[axis]));
                    }
                }
            }
            Shape::Mesh(ref asset) => {
                normals = around(asset, at, limit, place.face)?;
                normals.iter_mut().for_each(|n| *n = rotation * *n);
            }
            Shape::Cylinder { half_height, radius } => {
                let cylinder = Cylinder { half_height, radius };
                normals.extend(cylinder.normals(at, limit)?.into_iter().map(|n| rotation * n));
            }
            Shape::Sphere { .. } | Shape::Capsule { .. } => return None,
        }
        (!normals.is_empty()).then_some(normals)
    }
}
