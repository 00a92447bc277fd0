//! Eq. (4): the signed distance of a shape at a point, with its gradient; formulas for planes, boxes and what is round.
//!
//! Points are in the frame of the field: for a mesh its local frame relative to the middle of the cube, for a simple shape its own.
use cubecl::prelude::*;

use super::assets::{
    Assets, BOX, KIND, LISTS, MESH, NODES, PLANE, RECORDS, SIDE, SIZES, byte, entry, number, vector,
};
use super::list::{list, list_face};
use super::locate::{
    Lambda, NOT_OF_DOMAIN, axes, code, in_child, in_cube, in_root, is_crossing, is_inside, is_split,
    lambda_at, next_k, offset, place, root,
};
use super::nearest::{FAR, Nearest, nearest_in_list, nearest_in_tree};
use super::triangle::{PART, ROWS, across, closest, corner, face, is_flat};
use super::vector::{V3, cross, dot, length, minus, pick, plus, same, scaled, v3};

/// What a field says at a point.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Value {
    /// Signed distance.
    pub distance: f32,
    /// Its gradient, unit.
    pub gradient: V3,
    /// The nearest point of the surface.
    pub point: V3,
    /// Position of the nearest face; of a box the number of its side.
    pub face: u32,
    /// 0 that face, 1–3 its edges, 4–6 its corners.
    pub feature: u32,
}

/// Below this distance the gradient is the normal of the nearest face.
const ON_SURFACE: f32 = 1e-6;
/// Below this distance from a face without a normal no direction is left: its square is next to nothing in `f32`.
const ON_EDGE: f32 = 1e-15;

/// Whether a cell has a list.
#[cube]
pub fn is_listed(word: u32) -> bool {
    code(word) <= 5u32
}

/// The nearest face to a point of a cell; none of a simple shape.
#[cube]
pub fn nearest(assets: &Assets, shape: u32, word: u32, p: V3) -> Nearest {
    let mut squared = FAR.runtime();
    let mut position = u32::MAX.runtime();
    if entry(assets, shape, KIND) == MESH {
        if is_listed(word) {
            let faces = list(assets, shape, offset(word));
            let found = nearest_in_list(assets, shape, faces, 0u32, 1u32, p);
            squared = found.squared;
            position = found.face;
        } else {
            let found = nearest_in_tree(assets, shape, p, FAR);
            squared = found.squared;
            position = found.face;
        }
    }
    Nearest { squared, face: position }
}

/// The value at a point whose nearest face is known.
#[cube]
pub fn value_of(assets: &Assets, shape: u32, word: u32, p: V3, nearest: Nearest) -> Value {
    let at = (entry(assets, shape, RECORDS) + nearest.face * comptime!(ROWS as u32)) as usize;
    let f = face(&assets.rows, at);
    let c = closest(f, p, u32::reinterpret(nearest.squared) & PART);
    let distance = length(c.outward);
    let flat = is_flat(f);
    let mut inside = is_inside(word);
    if is_crossing(word) {
        let hint = (f.hints >> (2u32 * c.feature)) & 3u32;
        inside = hint == 3u32 || (hint == 1u32 && c.height < 0.0f32);
        // What is no more than its edges has no height that could tell.
        if hint == 0u32 || (hint == 1u32 && flat) {
            inside = winding(assets, shape, p) >= 1i32;
        }
    }
    let sign = select(inside, -1.0f32, 1.0f32);
    let away = distance > ON_EDGE;
    let along = pick(away, scaled(sign / select(away, distance, 1.0f32), c.outward), across(f));
    // In the plane of a face the height knows the direction better than the difference of two points.
    let normal =
        scaled(select(c.feature == 0u32 && !same(c.height < 0.0f32, inside), -1.0f32, 1.0f32), f.normal);
    let by_normal = !flat && (distance < ON_SURFACE || c.feature == 0u32);
    let on_surface = pick(distance < ON_SURFACE, f.normal, normal);
    let gradient = pick(by_normal, on_surface, along);
    Value { distance: sign * distance, gradient, point: c.point, face: nearest.face, feature: c.feature }
}

/// Winding number of a point: that at the centroid of its cell, and the faces on the way there.
///
/// The cell is the one that [`place`] finds. On a border that may be another one than what the caller has, with another label and another centroid.
#[cube]
fn winding(assets: &Assets, shape: u32, p: V3) -> i32 {
    let held = centroid(assets, shape, p);
    let word = held.word;
    let kind = code(word);
    let mut sum = select(is_inside(word), 1i32, 0i32);
    if is_crossing(word) {
        let at = offset(word);
        let lists = entry(assets, shape, LISTS);
        sum = (kind - 2u32) as i32;
        if kind == 5u32 {
            let mut k = 0u32;
            let mut long = 0u32;
            while k < 4u32 {
                long |= byte(&assets.words, lists, at - 4u32 + k) << (8u32 * k);
                k += 1u32;
            }
            sum = long as i32;
        }
        let faces = list(assets, shape, at);
        let mut i = 0u32;
        while i < faces.count {
            let position = list_face(assets, shape, faces, i);
            let row = (entry(assets, shape, RECORDS) + position * comptime!(ROWS as u32)) as usize;
            let f = face(&assets.rows, row);
            sum += crossing(p, held.centroid, corner(f, 0u32), corner(f, 1u32), corner(f, 2u32));
            i += 1u32;
        }
    }
    sum
}

/// 1 where the segment from `p` to `q` leaves the solid through the triangle, −1 where it enters, else 0.
#[cube]
pub fn crossing(p: V3, q: V3, a: V3, b: V3, c: V3) -> i32 {
    let normal = cross(minus(b, a), minus(c, a));
    let p_over = dot(normal, minus(p, a)) >= 0.0f32;
    let q_over = dot(normal, minus(q, a)) >= 0.0f32;
    let way = minus(q, p);
    let (pa, pb, pc) = (minus(a, p), minus(b, p), minus(c, p));
    let ab = is_left(way, pa, pb);
    let bc = is_left(way, pb, pc);
    let ca = is_left(way, pc, pa);
    let through = !same(p_over, q_over) && same(ab, bc) && same(bc, ca);
    select(through, select(p_over, -1i32, 1i32), 0i32)
}

/// Whether the origin is on the left of the way from `a` to `b`, seen along `way`; never both of that and of the way back.
///
/// Two faces at an edge ask for either: the same number has to tell both, or a segment through the edge would meet none of them, or both. Where the
/// number is 0, as in bodies with symmetries, a direction does in which the segment is thought to be moved a little.
#[cube]
fn is_left(way: V3, a: V3, b: V3) -> bool {
    let swapped = b.x < a.x || (b.x == a.x && (b.y < a.y || (b.y == a.y && b.z < a.z)));
    let (first, second) = (pick(swapped, b, a), pick(swapped, a, b));
    let turn = dot(way, cross(first, second));
    let moved = v3(0.54f32, 0.21f32, 0.81f32);
    let tie = dot(cross(moved, way), minus(second, first)) >= 0.0f32;
    !same(select(turn == 0.0f32, tie, turn > 0.0f32), swapped)
}

/// A cell and its middle.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Middle {
    word: u32,
    centroid: V3,
}

/// The cell that holds a point, found as [`place`] finds it, and its centroid. A point that rounding puts out of the cube is moved into it.
#[cube]
fn centroid(assets: &Assets, shape: u32, p: V3) -> Middle {
    let free = in_cube(assets, shape, p);
    let u = v3(free.x.clamp(0.0f32, 1.0f32), free.y.clamp(0.0f32, 1.0f32), free.z.clamp(0.0f32, 1.0f32));
    let nodes = entry(assets, shape, NODES);
    let first = root(u);
    let l = in_root(u, first);
    let mut l0 = l.l0;
    let mut l1 = l.l1;
    let mut l2 = l.l2;
    let mut l3 = l.l3;
    // Corners 0, e_i, e_i + e_j, (1, 1, 1) of the unit cube.
    let (i, j, _) = axes(first);
    let mut corners = Array::<f32>::new(12usize);
    let mut axis = 0u32;
    while axis < 3u32 {
        corners[axis as usize] = 0.0f32;
        corners[(3u32 + axis) as usize] = select(axis == i, 1.0f32, 0.0f32);
        corners[(6u32 + axis) as usize] = select(axis == i || axis == j, 1.0f32, 0.0f32);
        corners[(9u32 + axis) as usize] = 1.0f32;
        axis += 1u32;
    }
    let mut k = 3u32;
    let mut word = assets.words[(nodes + first) as usize];
    while is_split(word) {
        let here = Lambda { l0, l1, l2, l3 };
        let second = l0 < lambda_at(here, k);
        let below = in_child(here, k, second);
        l0 = below.l0;
        l1 = below.l1;
        l2 = below.l2;
        l3 = below.l3;
        let mut axis = 0u32;
        while axis < 3u32 {
            let c0 = corners[axis as usize];
            let c1 = corners[(3u32 + axis) as usize];
            let c2 = corners[(6u32 + axis) as usize];
            let c3 = corners[(9u32 + axis) as usize];
            let end = select(k == 3u32, c3, select(k == 2u32, c2, c1));
            let m = 0.5f32 * (c0 + end);
            // The corners of the child, as `Cell::child_corners` orders them.
            let shifted = second && k > 1u32;
            let n0 = select(second, c1, c0);
            let n1 = select(k == 1u32, m, select(shifted, c2, c1));
            let n2 = select(k == 2u32, m, select(k == 3u32 && second, c3, c2));
            let n3 = select(k == 3u32, m, c3);
            corners[axis as usize] = n0;
            corners[(3u32 + axis) as usize] = n1;
            corners[(6u32 + axis) as usize] = n2;
            corners[(9u32 + axis) as usize] = n3;
            axis += 1u32;
        }
        let at = word + select(second, 1u32, 0u32);
        k = next_k(k);
        word = assets.words[(nodes + at) as usize];
    }
    let side = 0.25f32 * number(assets, shape, SIDE);
    let half = 0.5f32 * number(assets, shape, SIDE);
    let middle = v3(
        side * (corners[0] + corners[3] + corners[6] + corners[9]) - half,
        side * (corners[1] + corners[4] + corners[7] + corners[10]) - half,
        side * (corners[2] + corners[5] + corners[8] + corners[11]) - half,
    );
    Middle { word, centroid: middle }
}

/// The value of a simple shape.
#[cube]
pub fn simple_value(assets: &Assets, shape: u32, p: V3) -> Value {
    let kind = entry(assets, shape, KIND);
    let sizes = vector(assets, shape, SIZES);
    // What is round: all within the radius of a segment on the z axis.
    let core = v3(0.0f32, 0.0f32, p.z.clamp(-sizes.x, sizes.x));
    let from_core = minus(p, core);
    let reach = length(from_core);
    let on_core = reach <= 0.0f32;
    let round_gradient =
        pick(on_core, v3(1.0f32, 0.0f32, 0.0f32), scaled(1.0f32 / reach.max(1e-30f32), from_core));
    let mut distance = reach - sizes.y;
    let mut gx = round_gradient.x;
    let mut gy = round_gradient.y;
    let mut gz = round_gradient.z;
    let mut side = 0u32;
    if kind == PLANE {
        distance = p.z;
        gx = 0.0f32;
        gy = 0.0f32;
        gz = 1.0f32;
    }
    if kind == BOX {
        let clamped =
            v3(p.x.clamp(-sizes.x, sizes.x), p.y.clamp(-sizes.y, sizes.y), p.z.clamp(-sizes.z, sizes.z));
        let outward = minus(p, clamped);
        let depth = minus(sizes, v3(p.x.abs(), p.y.abs(), p.z.abs()));
        let x_least = depth.x <= depth.y && depth.x <= depth.z;
        let axis = select(x_least, 0u32, select(depth.y <= depth.z, 1u32, 2u32));
        let along = select(axis == 0u32, p.x, select(axis == 1u32, p.y, p.z));
        let least = select(axis == 0u32, depth.x, select(axis == 1u32, depth.y, depth.z));
        let sign = select(along < 0.0f32, -1.0f32, 1.0f32);
        side = 2u32 * axis + select(sign > 0.0f32, 1u32, 0u32);
        let out = length(outward);
        let inverse = 1.0f32 / out.max(1e-30f32);
        let is_out = out > 0.0f32;
        distance = select(is_out, out, -least);
        gx = select(is_out, inverse * outward.x, select(axis == 0u32, sign, 0.0f32));
        gy = select(is_out, inverse * outward.y, select(axis == 1u32, sign, 0.0f32));
        gz = select(is_out, inverse * outward.z, select(axis == 2u32, sign, 0.0f32));
    }
    let gradient = v3(gx, gy, gz);
    Value { distance, gradient, point: plus(p, scaled(-distance, gradient)), face: side, feature: 0u32 }
}

/// The value at a point of a cell, of any shape, when the nearest face is known.
#[cube]
pub fn value_near(assets: &Assets, shape: u32, word: u32, p: V3, nearest: Nearest) -> Value {
    let mut distance = 0.0f32;
    let mut gx = 0.0f32;
    let mut gy = 0.0f32;
    let mut gz = 0.0f32;
    let mut px = 0.0f32;
    let mut py = 0.0f32;
    let mut pz = 0.0f32;
    let mut position = 0u32;
    let mut feature = 0u32;
    if entry(assets, shape, KIND) == MESH {
        let v = value_of(assets, shape, word, p, nearest);
        distance = v.distance;
        gx = v.gradient.x;
        gy = v.gradient.y;
        gz = v.gradient.z;
        px = v.point.x;
        py = v.point.y;
        pz = v.point.z;
        position = v.face;
        feature = v.feature;
    } else {
        let v = simple_value(assets, shape, p);
        distance = v.distance;
        gx = v.gradient.x;
        gy = v.gradient.y;
        gz = v.gradient.z;
        px = v.point.x;
        py = v.point.y;
        pz = v.point.z;
        position = v.face;
    }
    Value { distance, gradient: v3(gx, gy, gz), point: v3(px, py, pz), face: position, feature }
}

/// The value at a point of a cell, of any shape.
#[cube]
pub fn value_in_cell(assets: &Assets, shape: u32, word: u32, p: V3) -> Value {
    value_near(assets, shape, word, p, nearest(assets, shape, word, p))
}

/// The value at any point of any shape.
#[cube]
pub fn value(assets: &Assets, shape: u32, p: V3) -> Value {
    let mut word = NOT_OF_DOMAIN.runtime();
    if entry(assets, shape, KIND) == MESH {
        word = place(assets, shape, p).word;
    }
    value_in_cell(assets, shape, word, p)
}

#[cfg(test)]
mod tests {
    use super::super::vector::v3;
    use super::*;

    /// Segments through edges and corners of a cube, as its symmetry makes them, enter it once, and leave it once.
    #[test]
    fn a_segment_through_an_edge_or_a_corner_crosses_once() {
        let corner = |k: u32| [k & 1, k >> 1 & 1, k >> 2].map(|bit| bit as f32 * 2.0 - 1.0);
        let squares = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let faces = squares.map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).concat();
        let sum = |p: V3, q: V3| -> i32 {
            let of = |f: &[u32; 3]| f.map(corner).map(|[x, y, z]| v3(x, y, z));
            faces.iter().map(of).map(|[a, b, c]| crossing(p, q, a, b, c)).sum()
        };
        let steps = [-3.0, -2.0, -1.5, 0.0, 1.5, 2.0, 3.0f32];
        for x in steps {
            for y in steps {
                for z in steps {
                    if x == 0.0 && y == 0.0 && z == 0.0 {
                        continue;
                    }
                    let (out, middle) = (v3(x, y, z), v3(0.0, 0.0, 0.0));
                    assert_eq!((sum(out, middle), sum(middle, out)), (-1, 1), "{x} {y} {z}");
                    assert_eq!(sum(out, v3(-x, -y, -z)), 0, "{x} {y} {z}, to the other side");
                }
            }
        }
    }
}
