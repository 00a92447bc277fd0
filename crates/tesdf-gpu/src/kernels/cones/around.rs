//! The normals of the faces of a shape around a place.
//!
//! Mirrors `collide/cones/around.rs` of `tesdf`.
use cubecl::prelude::*;
use tesdf::collide::internal::limits;

use crate::kernels::cones::cone::{Cones, MOST};
use crate::kernels::geometry::triangle::{Face, FaceExpand};
use crate::kernels::geometry::vector::{V3, from_bits, v3};
use crate::kernels::scene::shape::{
    BOX, FACE_VERTICES, FANS, Fans, Field, FieldExpand, KIND, MESH, NONE, PLANE, SIZES,
};

/// A place with more faces has no cone.
const MOST_FACES: u32 = limits::MOST_FACES as u32;
/// The surroundings of a vertex must be clear up to this multiple of the limit of a place.
const CLEAR: f32 = limits::CLEAR as f32;
/// On a side, the vertices must be farther than this multiple of the limit.
const BESIDE: f32 = limits::BESIDE as f32;
/// A corner may be higher over the plane of a face by this part of its distance.
const CONVEX: f32 = limits::CONVEX as f32;
/// And by this: the rounding of a corner and a plane in `f32` (local frame), a tenth of the
/// distance up to which two places are one.
const ROUNDED: f32 = 2e-7;

/// A place on a shape or in it, in the frame of its field.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Place {
    pub at: V3,
    /// Faces up to this distance belong to it.
    pub limit: f32,
    /// One of them.
    pub face: u32,
}

/// The faces that have a vertex: words from the first one to the end.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Fan {
    first: u32,
    end: u32,
    /// The distance of [`Fans::words`].
    clear: f32,
}

/// Faces around a place.
#[derive(CubeType)]
struct Found {
    faces: Array<u32>,
    count: u32,
}

#[cube]
impl Face {
    /// Height of a point over side `k` in the plane of the face.
    fn over_side(self, p: V3, k: u32) -> f32 {
        let side = self.corner((k + 1u32) % 3u32) - self.corner(k);
        let length = side.length();
        // A point without a side is on it.
        select(
            length > 0.0f32,
            self.normal.cross(side).dot(p - self.corner(k)) / select(length > 0.0f32, length, 1.0f32),
            0.0f32,
        )
    }

    /// How far a point is inside all sides.
    fn within_sides(self, p: V3) -> f32 {
        self.over_side(p, 0u32).min(self.over_side(p, 1u32)).min(self.over_side(p, 2u32))
    }
}

#[cube]
impl Found {
    fn has(&self, face: u32) -> bool {
        let mut has = false;
        let mut i = 0u32;
        while i < self.count && !has {
            has = self.faces[i as usize] == face;
            i += 1u32;
        }
        has
    }

    fn add(&mut self, face: u32) {
        self.faces[self.count as usize] = face;
        self.count += 1u32;
    }
}

#[cube]
impl Field<'_> {
    /// Collects the different outward normals of the faces around a place as the rays of a cone:
    /// none at rounded shapes, at surfaces that do not enclose a solid, and where the surface is
    /// concave.
    pub fn normals(self, fans: &Fans, place: Place, cones: &mut Cones, cone: u32) {
        let kind = self.entry(KIND);
        if kind == PLANE {
            cones.add(cone, v3(0.0f32, 0.0f32, 1.0f32));
        }
        if kind == BOX {
            self.normals_of_box(place, cones, cone);
        }
        if kind == MESH && self.entry(FANS) != NONE {
            let mut found =
                Found { faces: Array::<u32>::new(comptime!(MOST_FACES as usize + 1usize)), count: 0u32 };
            found.add(place.face);
            let first = self.face(place.face);
            if first.within_sides(place.at) <= place.limit {
                let is_known = self.known_around(fans, place, first, &mut found, cones, cone);
                if !is_known {
                    self.search(fans, place, &mut found);
                }
            }
            if found.count <= MOST_FACES {
                self.convex(&found, cones, cone);
            }
        }
        if cones.count(cone) > MOST {
            cones.clear(cone);
        }
    }

    fn normals_of_box(self, place: Place, cones: &mut Cones, cone: u32) {
        let depth = self.vector(SIZES) - place.at.abs();
        let mut axis = 0u32;
        while axis < 3u32 {
            let sign = select(place.at.at(axis) < 0.0f32, -1.0f32, 1.0f32);
            if depth.at(axis) <= place.limit {
                cones.add(
                    cone,
                    v3(
                        select(axis == 0u32, sign, 0.0f32),
                        select(axis == 1u32, sign, 0.0f32),
                        select(axis == 2u32, sign, 0.0f32),
                    ),
                );
            }
            axis += 1u32;
        }
    }

    /// Vertex `k` of a face.
    fn vertex(self, face: u32, k: u32) -> u32 {
        self.word(self.entry(FACE_VERTICES) + 3u32 * face + k)
    }

    fn fan(self, fans: &Fans, vertex: u32) -> Fan {
        let at = self.entry(FANS) + 2u32 * vertex;
        Fan { first: fans.word(at), end: fans.word(at + 2u32), clear: from_bits(fans.word(at + 1u32)) }
    }

    /// Collects the normals at a vertex with clear surroundings, which leaves no faces, or the
    /// faces at a side. Returns whether the place is there.
    fn known_around(
        self,
        fans: &Fans,
        place: Place,
        first: Face,
        found: &mut Found,
        cones: &mut Cones,
        cone: u32,
    ) -> bool {
        // The first corner at the place, and the side; 3 for none.
        let mut corner = 3u32;
        let mut side = 3u32;
        let mut sides = 0u32;
        let mut is_beside = true;
        let mut k = 0u32;
        while k < 3u32 {
            let clear = self.fan(fans, self.vertex(place.face, k)).clear;
            let way = (first.corner(k) - place.at).length();
            if corner == 3u32 && way <= place.limit {
                corner = k;
            }
            is_beside = is_beside && clear != 0.0f32 && way > BESIDE * place.limit;
            if first.over_side(place.at, k) <= place.limit {
                side = k;
                sides += 1u32;
            }
            k += 1u32;
        }
        let mut is_known = false;
        if corner < 3u32 {
            let fan = self.fan(fans, self.vertex(place.face, corner));
            is_known = fan.clear.abs() > CLEAR * place.limit;
            if is_known {
                found.count = 0u32;
                let mut i = fan.first;
                while i < fan.end {
                    cones.add(cone, self.face(fans.word(i)).normal);
                    i += 1u32;
                }
                if fan.clear < 0.0f32 && cones.count(cone) > 1u32 {
                    cones.clear(cone);
                }
            }
        } else if is_beside && sides == 1u32 {
            let other = self.beside(fans, place.face, side);
            is_known = other != NONE;
            if is_known {
                found.add(other);
            }
        }
        is_known
    }

    /// The other face that has a side of a face; none where there is not exactly one.
    fn beside(self, fans: &Fans, face: u32, side: u32) -> u32 {
        let fan = self.fan(fans, self.vertex(face, side));
        let end = self.vertex(face, (side + 1u32) % 3u32);
        let mut found = NONE.runtime();
        let mut is_one = true;
        let mut i = fan.first;
        while i < fan.end {
            let other = fans.word(i);
            let has_side = self.vertex(other, 0u32) == end
                || self.vertex(other, 1u32) == end
                || self.vertex(other, 2u32) == end;
            // A face that has the vertex twice is named twice.
            if other != face && has_side && other != found {
                is_one = is_one && found == NONE;
                found = other;
            }
            i += 1u32;
        }
        select(is_one, found, NONE)
    }

    /// Adds the faces that have vertices in common, up to one more than [`MOST_FACES`].
    fn search(self, fans: &Fans, place: Place, found: &mut Found) {
        let mut next = 0u32;
        while next < 3u32 * found.count && found.count <= MOST_FACES {
            let fan = self.fan(fans, self.vertex(found.faces[(next / 3u32) as usize], next % 3u32));
            let mut i = fan.first;
            while i < fan.end && found.count <= MOST_FACES {
                let other = fans.word(i);
                if !found.has(other) && self.face(other).distance(place.at) <= place.limit {
                    found.add(other);
                }
                i += 1u32;
            }
            next += 1u32;
        }
    }

    /// Collects the different normals of faces that have a place in common; none where they are not
    /// convex.
    fn convex(self, found: &Found, cones: &mut Cones, cone: u32) {
        let mut i = 0u32;
        while i < found.count {
            cones.add(cone, self.face(found.faces[i as usize]).normal);
            i += 1u32;
        }
        let mut is_convex = true;
        let count = select(cones.count(cone) > 1u32 && cones.count(cone) <= MOST, found.count, 0u32);
        let mut i = 0u32;
        while i < count && is_convex {
            let face = self.face(found.faces[i as usize]);
            let mut k = 0u32;
            while k < 3u32 * count && is_convex {
                let other = self.face(found.faces[(k / 3u32) as usize]);
                let way = other.corner(k % 3u32) - face.a;
                is_convex = way.dot(face.normal) <= CONVEX * way.length() + ROUNDED;
                k += 1u32;
            }
            i += 1u32;
        }
        if !is_convex {
            cones.clear(cone);
        }
    }
}
