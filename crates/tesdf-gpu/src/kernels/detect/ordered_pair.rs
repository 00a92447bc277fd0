//! Ordered pairs of instances: the surface of the first instance, seen in the frame of the second
//! instance's field.
//!
//! Mirrors `collide/detect/ordered_pair.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::bodies::polygon::Quarter;
use crate::kernels::geometry::triangle::Triangle;
use crate::kernels::geometry::vector::{Row, V3, last, pick, row_of, v3, xyz, zero};
use crate::kernels::pairs::ahead::Approach;
use crate::kernels::query::tetrahedra::bounds_of;
use crate::kernels::scene::shape::{
    Field, FieldExpand, HIGH, KIND, LOW, MESH, OWNED_CORNERS, PLANE, ROUND, SIZES, Shapes, ShapesExpand,
};

/// The ordered pairs of a scene. The two ordered pairs of the same instances are neighbours.
#[derive(CubeType, CubeLaunch)]
pub struct OrderedPairs {
    /// [`WORDS`] words for each: instances a and b, shapes of a and b.
    pub words: Box<[u32]>,
    /// [`ROWS`] rows for each: the three rows of the linear map, each with its coordinate of the
    /// shift; scale, reach and both radii; way and rest of the approach, its turn, and whether the
    /// field is a plane that does not turn.
    pub rows: Box<[Row]>,
    /// Capacity of the list.
    pub room: u32,
}

/// Words of an ordered pair.
pub const WORDS: u32 = 4;
/// Rows of an ordered pair.
pub const ROWS: u32 = 6;

/// An ordered pair: instance a has the surface, instance b has the field.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct OrderedPair {
    /// Its index. The pair with both instances exchanged is its neighbour.
    pub number: u32,
    pub a: u32,
    pub b: u32,
    pub shape_a: u32,
    pub shape_b: u32,
    /// Rows of the linear map from the frame of a to the frame of the field.
    pub x: V3,
    pub y: V3,
    pub z: V3,
    pub shift: V3,
    /// Length of one unit of a, in units of the field.
    pub scale: f32,
    /// Contact distance of the pair in the frame of the field: smaller signed distances are
    /// contacts. No part looks farther.
    pub reach: f32,
    /// The surfaces touch where a part of a is this far from the points where the field is 0: the
    /// sum of the own radius, and of half of the thickness of a sheet that has the field.
    pub radius: f32,
    /// How far the surface of a lies from its parts, in the frame of the field: the radius of a
    /// sphere or capsule, half of the thickness of a sheet. Otherwise 0.
    pub own_radius: f32,
}

#[cube]
impl OrderedPairs {
    /// Reads the ordered pair with this number.
    pub fn get(&self, number: u32) -> OrderedPair {
        let word = (number * WORDS) as usize;
        let row = (number * ROWS) as usize;
        let (p, q, r, s) = (self.rows[row], self.rows[row + 1], self.rows[row + 2], self.rows[row + 3]);
        OrderedPair {
            number,
            a: self.words[word],
            b: self.words[word + 1],
            shape_a: self.words[word + 2],
            shape_b: self.words[word + 3],
            x: xyz(p),
            y: xyz(q),
            z: xyz(r),
            shift: v3(last(p), last(q), last(r)),
            scale: s.extract(0usize),
            reach: s.extract(1usize),
            radius: s.extract(2usize),
            own_radius: last(s),
        }
    }

    /// The contact distance of an ordered pair for all points within `radius` of `p`, with the
    /// radius of the pair.
    pub fn reach_around(&self, pair: OrderedPair, p: V3, radius: f32) -> f32 {
        pair.reach.min(self.approach(pair).around(p, radius)) + pair.radius
    }

    /// The contact distance for a part of the surface, with the radius of the pair.
    pub fn reach_of(&self, pair: OrderedPair, part: Part) -> f32 {
        let approach = self.approach(pair);
        let (a, b) = (approach.around(part.a, pair.radius), approach.around(part.b, pair.radius));
        // The motion is linear in the place, so it is greatest at a corner.
        pair.reach.min(a.max(b).max(approach.around(part.c, pair.radius))) + pair.radius
    }

    fn approach(&self, pair: OrderedPair) -> Approach {
        let row = (pair.number * ROWS) as usize;
        let (p, q) = (self.rows[row + 4], self.rows[row + 5]);
        Approach { way: xyz(p), turn: xyz(q), rest: last(p), is_over_plane: last(q) }
    }

    /// Writes an ordered pair. Its number is its index. The rest of the approach contains the
    /// contact distance of parts that do not move against the other body.
    pub fn put(&mut self, pair: OrderedPair, approach: Approach) {
        let word = (pair.number * WORDS) as usize;
        self.words[word] = pair.a;
        self.words[word + 1] = pair.b;
        self.words[word + 2] = pair.shape_a;
        self.words[word + 3] = pair.shape_b;
        let row = (pair.number * ROWS) as usize;
        self.rows[row] = row_of(pair.x, pair.shift.x);
        self.rows[row + 1] = row_of(pair.y, pair.shift.y);
        self.rows[row + 2] = row_of(pair.z, pair.shift.z);
        self.rows[row + 3] = row_of(v3(pair.scale, pair.reach, pair.radius), pair.own_radius);
        self.rows[row + 4] = row_of(approach.way, approach.rest);
        self.rows[row + 5] = row_of(approach.turn, approach.is_over_plane);
    }
}

#[cube]
impl OrderedPair {
    /// Greatest contact distance for parts of the surface: the reach plus the radius.
    pub fn part_reach(self) -> f32 {
        self.reach + self.radius
    }

    /// Whether the cosine filter of Eq. (10) drops a contact. It does not apply to rounded shapes
    /// and sheets, because they have normals in all directions.
    pub fn is_filtered(self, cosine: f32, cos_theta: f32) -> bool {
        self.own_radius == 0.0f32 && cosine > -cos_theta
    }

    fn linear(self, p: V3) -> V3 {
        v3(self.x.dot(p), self.y.dot(p), self.z.dot(p))
    }

    /// Transforms a point from the frame of a to the frame of the field.
    pub fn to_field(self, p: V3) -> V3 {
        self.linear(p) + self.shift
    }

    /// Rotates a unit vector from the frame of a to the frame of the field.
    pub fn rotate(self, v: V3) -> V3 {
        self.linear(v) * (1.0f32 / self.scale)
    }

    /// Transforms a point from the frame of the field to the frame of a. The map is a similarity.
    pub fn to_surface(self, p: V3) -> V3 {
        let q = p - self.shift;
        let back = (self.x * q.x + self.y * q.y) + self.z * q.z;
        back * (1.0f32 / (self.scale * self.scale))
    }
}

/// A face, or a part of a simple shape, in the frame of the field.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Part {
    pub a: V3,
    pub b: V3,
    pub c: V3,
    /// Number of corners: 3, or 2 for the segment of a capsule, or 1 for the point of a sphere.
    pub count: u32,
    /// Corners that no earlier part has, as bits.
    pub owned: u32,
}

#[cube]
impl Part {
    /// Corner `k`.
    pub fn corner(self, k: u32) -> V3 {
        pick(k == 1u32, self.b, pick(k == 2u32, self.c, self.a))
    }

    /// The point with the weights `s` of the second corner and `t` of the third corner.
    pub fn at(self, s: f32, t: f32) -> V3 {
        (self.a + (self.b - self.a) * s) + (self.c - self.a) * t
    }

    /// The piece `q` of this part.
    pub fn quarter(self, q: Quarter) -> Part {
        Part {
            a: self.at(q.a_s, q.a_t),
            b: self.at(q.b_s, q.b_t),
            c: self.at(q.c_s, q.c_t),
            count: self.count,
            owned: 0u32,
        }
    }

    /// The same part, moved.
    pub fn moved(self, by: V3) -> Part {
        Part { a: self.a + by, b: self.b + by, c: self.c + by, count: self.count, owned: self.owned }
    }

    /// The center of the box around the part.
    pub fn center(self) -> V3 {
        let bounds = bounds_of(self.a, self.b, self.c);
        (bounds.low + bounds.high) * 0.5f32
    }

    /// The greatest distance of a corner from `p`.
    pub fn radius_around(self, p: V3) -> f32 {
        (self.a - p).length().max((self.b - p).length()).max((self.c - p).length())
    }
}

#[cube]
impl Field<'_> {
    /// The center of a bounded shape.
    fn body_center(self) -> V3 {
        let middle = (self.vector(LOW) + self.vector(HIGH)) * 0.5f32;
        pick(self.is_mesh(), middle, zero())
    }

    /// The greatest distance of a point of a bounded shape from this center.
    fn body_radius(self) -> f32 {
        let kind = self.entry(KIND);
        let sizes = self.vector(SIZES);
        let extent = self.vector(HIGH) - self.vector(LOW);
        let round = select(kind == ROUND, sizes.x + sizes.y, sizes.length());
        select(kind == MESH, 0.5f32 * extent.length(), round)
    }

    /// One of the two triangles of a plane, in the plane's frame. Together they are a square that
    /// covers the body of the field.
    fn plane_part(self, pair: OrderedPair, number: u32) -> Triangle {
        let center = pair.to_surface(self.body_center());
        let half = (self.body_radius() + pair.reach) / pair.scale;
        let (low, high) = (center - v3(half, half, half), center + v3(half, half, half));
        let is_first = number == 0u32;
        Triangle {
            a: v3(low.x, low.y, 0.0f32),
            b: v3(high.x, select(is_first, low.y, high.y), 0.0f32),
            c: v3(select(is_first, high.x, low.x), high.y, 0.0f32),
        }
    }
}

#[cube]
impl Shapes {
    /// Part `number` of the surface of an ordered pair, in the frame of the field.
    pub fn part(&self, pair: OrderedPair, number: u32) -> Part {
        let surface = self.field(pair.shape_a);
        let kind = surface.entry(KIND);
        let mut corners = Triangle { a: zero(), b: zero(), c: zero() };
        let mut count = 3u32;
        let mut owned = 0u32;
        if kind == PLANE {
            corners = self.field(pair.shape_b).plane_part(pair, number);
        } else {
            let f = surface.face(number);
            corners = f.corners();
            owned = (f.hints >> OWNED_CORNERS) & 7u32;
            if kind == ROUND {
                let is_sphere = surface.entry(SIZES) == 0u32;
                count = select(is_sphere, 1u32, 2u32);
            }
        }
        let (a, b, c) = (pair.to_field(corners.a), pair.to_field(corners.b), pair.to_field(corners.c));
        Part { a, b, c, count, owned }
    }

    /// Unit normal of part `number` in the frame of the field; zero for spheres, capsules and flat
    /// faces. The normal comes from the face, because the corners of a needle, transformed and
    /// rounded, would give an arbitrary normal.
    pub fn part_normal(&self, pair: OrderedPair, number: u32) -> V3 {
        let surface = self.field(pair.shape_a);
        let mut normal = v3(0.0f32, 0.0f32, 1.0f32);
        if surface.entry(KIND) != PLANE {
            normal = surface.face(number).normal;
        }
        pair.rotate(normal)
    }
}
