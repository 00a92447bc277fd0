//! One body's surface as the field of another sees it.
use cubecl::prelude::*;

use super::assets::{
    Assets, HIGH, KIND, LOW, MESH, OWNED_CORNERS, PLANE, RECORDS, ROUND, SIZES, entry, vector,
};
use super::products::{DIRECTION_ROWS, DIRECTION_WORDS};
use super::triangle::{ROWS, corner, face};
use super::vector::{V3, dot, length, minus, pick, plus, plus_scaled, scaled, v3};

/// An ordered pair of instances.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Direction {
    /// Its place; the other direction of the pair is its neighbour.
    pub number: u32,
    pub a: u32,
    pub b: u32,
    pub shape_a: u32,
    pub shape_b: u32,
    /// Rows of the linear part of the map from the frame of a to the field's.
    pub x: V3,
    pub y: V3,
    pub z: V3,
    pub shift: V3,
    /// Field units per unit of a.
    pub scale: f32,
    /// Signed distances up to this count.
    pub reach: f32,
    /// The surface is all within this of its parts.
    pub radius: f32,
}

/// Reads a direction.
#[cube]
pub fn direction(words: &[u32], maps: &[Vector<f32, Const<4>>], at: u32) -> Direction {
    let first = (at * comptime!(DIRECTION_WORDS as u32)) as usize;
    let row = (at * comptime!(DIRECTION_ROWS as u32)) as usize;
    let (p, q, r, s) = (maps[row], maps[row + 1usize], maps[row + 2usize], maps[row + 3usize]);
    Direction {
        number: at,
        a: words[first],
        b: words[first + 1usize],
        shape_a: words[first + 2usize],
        shape_b: words[first + 3usize],
        x: v3(p.extract(0usize), p.extract(1usize), p.extract(2usize)),
        y: v3(q.extract(0usize), q.extract(1usize), q.extract(2usize)),
        z: v3(r.extract(0usize), r.extract(1usize), r.extract(2usize)),
        shift: v3(p.extract(3usize), q.extract(3usize), r.extract(3usize)),
        scale: s.extract(0usize),
        reach: s.extract(1usize),
        radius: s.extract(2usize),
    }
}

/// From the frame of a to the field's.
#[cube]
pub fn to_field(d: Direction, p: V3) -> V3 {
    plus(v3(dot(d.x, p), dot(d.y, p), dot(d.z, p)), d.shift)
}

/// From the field's frame to that of a: the map is a similarity.
#[cube]
fn from_field(d: Direction, p: V3) -> V3 {
    let q = minus(p, d.shift);
    let back = plus_scaled(plus_scaled(scaled(q.x, d.x), q.y, d.y), q.z, d.z);
    scaled(1.0f32 / (d.scale * d.scale), back)
}

/// A face, or a part of a simple shape, in the field's frame.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Part {
    pub a: V3,
    pub b: V3,
    pub c: V3,
    /// Corners: 3, or 2 and 1 for the cores of capsules and spheres.
    pub count: u32,
    /// Corners that no part before has, as bits.
    pub owned: u32,
}

/// The middle and the size of a body that has a field.
#[cube]
fn middle_of(assets: &Assets, shape: u32) -> V3 {
    let is_mesh = entry(assets, shape, KIND) == MESH;
    let middle = scaled(0.5f32, plus(vector(assets, shape, LOW), vector(assets, shape, HIGH)));
    pick(is_mesh, middle, v3(0.0f32, 0.0f32, 0.0f32))
}

#[cube]
fn size_of_body(assets: &Assets, shape: u32) -> f32 {
    let kind = entry(assets, shape, KIND);
    let sizes = vector(assets, shape, SIZES);
    let extent = minus(vector(assets, shape, HIGH), vector(assets, shape, LOW));
    let round = select(kind == ROUND, sizes.x + sizes.y, length(sizes));
    select(kind == MESH, 0.5f32 * length(extent), round)
}

/// Part `number` of the surface of a direction.
#[cube]
pub fn part(assets: &Assets, d: Direction, number: u32) -> Part {
    let kind = entry(assets, d.shape_a, KIND);
    let mut ax = 0.0f32;
    let mut ay = 0.0f32;
    let mut az = 0.0f32;
    let mut bx = 0.0f32;
    let mut by = 0.0f32;
    let mut bz = 0.0f32;
    let mut cx = 0.0f32;
    let mut cy = 0.0f32;
    let mut cz = 0.0f32;
    let mut count = 3u32;
    let mut owned = 0u32;
    if kind == PLANE {
        // Only what is over or under the field's body matters: a square of two triangles.
        let center = from_field(d, middle_of(assets, d.shape_b));
        let half = (size_of_body(assets, d.shape_b) + d.reach) / d.scale;
        ax = center.x - half;
        ay = center.y - half;
        bx = center.x + half;
        by = select(number == 0u32, center.y - half, center.y + half);
        cx = select(number == 0u32, center.x + half, center.x - half);
        cy = center.y + half;
    } else {
        let at = (entry(assets, d.shape_a, RECORDS) + number * comptime!(ROWS as u32)) as usize;
        let f = face(&assets.rows, at);
        let (a, b, c) = (corner(f, 0u32), corner(f, 1u32), corner(f, 2u32));
        ax = a.x;
        ay = a.y;
        az = a.z;
        bx = b.x;
        by = b.y;
        bz = b.z;
        cx = c.x;
        cy = c.y;
        cz = c.z;
        owned = (f.hints >> OWNED_CORNERS) & 7u32;
        if kind == ROUND {
            let is_ball = entry(assets, d.shape_a, SIZES) == 0u32;
            count = select(is_ball, 1u32, 2u32);
        }
    }
    Part {
        a: to_field(d, v3(ax, ay, az)),
        b: to_field(d, v3(bx, by, bz)),
        c: to_field(d, v3(cx, cy, cz)),
        count,
        owned,
    }
}

/// Unit normal of part `number` of the surface of a direction; zero for what is round or no more than its edges. It is that of the face: of a
/// needle's corners in another frame rounding would make any.
#[cube]
pub fn normal(assets: &Assets, d: Direction, number: u32) -> V3 {
    let mut x = 0.0f32;
    let mut y = 0.0f32;
    let mut z = 1.0f32;
    if entry(assets, d.shape_a, KIND) != PLANE {
        let at = (entry(assets, d.shape_a, RECORDS) + number * comptime!(ROWS as u32)) as usize;
        let f = face(&assets.rows, at);
        x = f.normal.x;
        y = f.normal.y;
        z = f.normal.z;
    }
    let own = v3(x, y, z);
    scaled(1.0f32 / d.scale, v3(dot(d.x, own), dot(d.y, own), dot(d.z, own)))
}

/// The middle of the box around a part.
#[cube]
pub fn ball_center(p: Part) -> V3 {
    let low = v3(p.a.x.min(p.b.x).min(p.c.x), p.a.y.min(p.b.y).min(p.c.y), p.a.z.min(p.b.z).min(p.c.z));
    let high = v3(p.a.x.max(p.b.x).max(p.c.x), p.a.y.max(p.b.y).max(p.c.y), p.a.z.max(p.b.z).max(p.c.z));
    scaled(0.5f32, plus(low, high))
}

/// The reach of a part from there.
#[cube]
pub fn ball_radius(p: Part, center: V3) -> f32 {
    length(minus(p.a, center)).max(length(minus(p.b, center))).max(length(minus(p.c, center)))
}

/// The point of a part with weights `s` of its second and `t` of its third corner.
#[cube]
pub fn at_weights(p: Part, s: f32, t: f32) -> V3 {
    plus_scaled(plus_scaled(p.a, s, minus(p.b, p.a)), t, minus(p.c, p.a))
}
