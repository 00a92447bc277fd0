//! A contact with the normal that the cones allow. A thread takes a contact.
use cubecl::prelude::*;
use tesdf::collide::internal;

use crate::kernels::cones::around::Place;
use crate::kernels::cones::cone::{Cones, Direction, PARALLEL, SLOPE, is_close, no_cones, no_direction};
use crate::kernels::counters::{CONTACTS, Counters};
use crate::kernels::detect::ordered_pair::{OrderedPair, OrderedPairExpand, OrderedPairs};
use crate::kernels::geometry::vector::{V3, pick};
use crate::kernels::report::contact::{Contacts, ContactsExpand};
use crate::kernels::scene::shape::{DIAGONAL, Fans, Field, KIND, ROUND, SIZES, Shapes};

/// A place belongs to a feature when it is nearer than this part of the larger diagonal.
const NEAR: f32 = internal::ROUNDING as f32;
/// Bodies have one size when their diagonals differ by less than this part.
const SAME_SIZE: f32 = 1.0 + internal::limits::SAME as f32;

/// A contact of faces, in the frame of the field.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Contact {
    point_a: V3,
    point_b: V3,
    distance: f32,
    gradient: V3,
    face_a: u32,
    face_b: u32,
}

/// The lengths that the rule compares with, in the frame of the field.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Lengths {
    /// Diagonals of both bodies; 0 for a plane.
    of_a: f32,
    of_b: f32,
    /// Two places that are nearer are one.
    near: f32,
    /// Bound of the error of a distance.
    tolerance: f32,
}

#[cube]
impl Lengths {
    /// The error of the place of a contact at a distance.
    fn place(self, distance: f32) -> f32 {
        self.near + (8.0f32 * self.tolerance * distance.abs()).sqrt()
    }

    /// The normal of two faces that lie flush on each other: that of the larger body, or the mean.
    fn flush(self, of_a: V3, of_b: V3) -> V3 {
        let a_larger = self.of_a == 0.0f32 || (self.of_b > 0.0f32 && self.of_a > SAME_SIZE * self.of_b);
        let b_larger = self.of_b == 0.0f32 || self.of_b > SAME_SIZE * self.of_a;
        let sum = of_a + of_b;
        let mean = sum * (1.0f32 / sum.length());
        pick(a_larger, of_a, pick(b_larger, of_b, mean))
    }
}

#[cube]
impl Contacts {
    fn contact(&self, number: u32) -> Contact {
        let faces = self.faces(number);
        Contact {
            point_a: self.point(number),
            point_b: self.closest(number),
            distance: self.distance(number),
            gradient: self.gradient(number),
            face_a: faces.a,
            face_b: faces.b,
        }
    }
}

#[cube]
impl OrderedPair {
    fn lengths(self, a: Field<'_>, b: Field<'_>, tolerance: f32) -> Lengths {
        let (of_a, of_b) = (a.number(DIAGONAL) * self.scale, b.number(DIAGONAL));
        // The processor also takes 1e-6 of the smaller diagonal, which is less.
        let near = NEAR * of_a.max(of_b);
        Lengths { of_a, of_b, near, tolerance: tolerance.max(near) }
    }
}

#[cube]
impl Contact {
    /// The cones of both bodies. That of *b* is empty where that of *a* is.
    fn cones(self, shapes: &Shapes, fans: &Fans, pair: OrderedPair, lengths: Lengths, cones: &mut Cones) {
        // Inside of b, the faces of one place are equally near. Outside, they have the nearest
        // point.
        let is_apart = self.distance > lengths.near;
        let in_field = pick(is_apart, self.point_b, self.point_a);
        let deep = select(is_apart, lengths.near, self.distance.abs() + 2.0f32 * lengths.near);
        let on_surface = pair.to_surface(self.point_a);
        let mut cone = 0u32;
        while cone < select(cones.count(0u32) > 0u32, 2u32, 1u32) {
            let is_b = cone == 1u32;
            let place = Place {
                at: pick(is_b, in_field, on_surface),
                limit: select(is_b, deep, lengths.near / pair.scale),
                face: select(is_b, self.face_b, self.face_a),
            };
            shapes.field(select(is_b, pair.shape_b, pair.shape_a)).normals(fans, place, cones, cone);
            cone += 1u32;
            if !is_b {
                let mut i = 0u32;
                while i < cones.count(0u32) {
                    let ray = pair.rotate(cones.ray(0u32, i)).negated();
                    cones.set_ray(0u32, i, ray);
                    i += 1u32;
                }
            }
        }
    }

    /// The normal that both cones allow; none where they allow none, or are not known.
    fn of_cones(self, cones: &Cones, lengths: Lengths) -> Direction {
        let is_apart = self.distance > lengths.near;
        let (rays_a, rays_b) = (cones.count(0u32), cones.count(1u32));
        let mut found = no_direction();
        if rays_a > 0u32 && rays_b > 0u32 {
            let (of_a, of_b) = (cones.ray(0u32, 0u32), cones.ray(1u32, 0u32));
            let across = cones.crossing();
            let is_of_face = rays_a == 1u32 || rays_b == 1u32;
            if rays_a == 1u32 && rays_b == 1u32 {
                let is_flush = is_close(of_a, of_b, PARALLEL);
                found = Direction { vector: lengths.flush(of_a, of_b), is_known: is_flush };
            } else if is_of_face || across.is_known {
                // The plane of a face, or of both edges.
                let turns = across.vector.dot(self.gradient) < 0.0f32;
                let of_edges = pick(turns, across.vector.negated(), across.vector);
                let mut vector = pick(is_of_face, pick(rays_a == 1u32, of_a, of_b), of_edges);
                // At contact the gradient may be the normal of a face along the edge of a, on
                // neither side.
                let tries = select(is_of_face || is_apart, 1u32, 2u32);
                let mut is_known = false;
                let mut k = 0u32;
                while k < tries && !is_known {
                    vector = pick(k == 0u32, vector, vector.negated());
                    is_known = cones.are_within(vector, SLOPE);
                    k += 1u32;
                }
                found = Direction { vector, is_known };
            } else if is_apart {
                found = cones.clamped(self.gradient);
            } else {
                found = cones.mean_of_common();
            }
        }
        found
    }

    /// The normal of a ball or capsule of a radius at a face.
    fn of_round(self, cones: &Cones, lengths: Lengths, radius: f32) -> Direction {
        let mut found = no_direction();
        if cones.count(0u32) == 1u32 {
            let along = cones.ray(0u32, 0u32);
            let core = self.point_b - self.gradient * radius;
            let height = along.dot(self.point_a - core);
            let foot = core + along * height;
            let is_over = height > 0.0f32 && is_close(foot, self.point_a, lengths.place(height));
            found = Direction { vector: along, is_known: is_over };
        }
        found
    }
}

/// Replaces the gradient of a contact of faces by the normal that both bodies allow, a thread each.
/// `tolerances` are the bounds of the errors of distances, of all instances in the frames of their
/// fields.
#[cube(launch, create_dummy_kernel)]
pub fn in_cones(
    shapes: &Shapes,
    fans: &Fans,
    pairs: &OrderedPairs,
    tolerances: &[f32],
    counters: &Counters,
    contacts: &mut Contacts,
) {
    let number = ABSOLUTE_POS as u32;
    let count = counters.within(CONTACTS, contacts.room);
    if number < count {
        let pair = pairs.get(contacts.pair(number));
        let (a, b) = (shapes.field(pair.shape_a), shapes.field(pair.shape_b));
        let contact = contacts.contact(number);
        let lengths = pair.lengths(a, b, tolerances[pair.b as usize]);
        let mut cones = no_cones();
        contact.cones(shapes, fans, pair, lengths, &mut cones);
        let mut found = contact.of_cones(&cones, lengths);
        if b.entry(KIND) == ROUND {
            found = contact.of_round(&cones, lengths, b.vector(SIZES).y);
        }
        // The contact keeps its points, so the way between them must be along the normal.
        let along = contact.point_b + found.vector * contact.distance;
        if found.is_known && is_close(contact.point_a, along, lengths.place(contact.distance)) {
            contacts.turn(number, found.vector);
        }
        counters.tell_if_broken_off(count);
    }
}
