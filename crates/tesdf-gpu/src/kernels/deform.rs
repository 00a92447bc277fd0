//! Deformation (Sec. V-D): the arrays of a shape follow its vertices. Connectivity, lists and labels stay.
//!
//! [`follow`] makes faces and tetrahedra anew, a thread each. [`refit`] fits boxes, balls and bounds to them, from the leaves of the trees upwards: one group for a shape, as
//! nothing orders writes between groups but the end of a launch.
use cubecl::prelude::*;

use super::assets::{
    BAD_VERTEX, BOUND_UNIT, BOXES, CHILDREN, EXACT_LISTS, FACE_COUNT, FACE_LEVELS, FACE_VERTICES, HIGH,
    INNER_BALL, LOW, MESHLET_COUNT, MESHLET_FACES, MESHLETS, NONE, RECORDS, SIDE, STRIDE, TET_VERTICES,
    TETRAHEDRA, TREE, TREE_BOXES, TREE_LEVELS, TREE_NODES, VERTEX_COUNT,
};
use super::pairs::four;
use super::tetrahedra::{ROWS as TETRAHEDRON_ROWS, tetrahedron_of};
use super::triangle::{ROWS as FACE_ROWS, record_of};
use super::vector::{V3, length, minus, v3};

/// Threads of the group that refits.
pub const GROUP: u32 = 256;

/// What a ball is grown by, of its radius and of the cube: more than rounding to `f32` takes away.
pub const GROWN: f32 = 1e-6;

/// An entry of a shape's table.
#[cube]
fn entry(table: &mut [u32], shape: u32, #[comptime] at: u32) -> u32 {
    table[(shape * STRIDE + at) as usize]
}

/// A vertex in the local frame, relative to the middle of the cube. `frame`: the middle in the shape's unit, as a sum of two, and the scale.
#[cube]
fn vertex(positions: &[f32], frame: &[Vector<f32, Const<4>>], v: u32) -> V3 {
    let at = (3u32 * v) as usize;
    let (high, low) = (frame[0], frame[1]);
    let scale = high.extract(3usize);
    v3(
        scale * ((positions[at] - high.extract(0usize)) - low.extract(0usize)),
        scale * ((positions[at + 1] - high.extract(1usize)) - low.extract(1usize)),
        scale * ((positions[at + 2] - high.extract(2usize)) - low.extract(2usize)),
    )
}

/// A box while it grows; empty when the least corner is above the greatest.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Bounds {
    low: V3,
    high: V3,
}

#[cube]
fn nothing() -> Bounds {
    Bounds { low: v3(1e30f32, 1e30f32, 1e30f32), high: v3(-1e30f32, -1e30f32, -1e30f32) }
}

#[cube]
fn both(a: Bounds, b: Bounds) -> Bounds {
    Bounds {
        low: v3(a.low.x.min(b.low.x), a.low.y.min(b.low.y), a.low.z.min(b.low.z)),
        high: v3(a.high.x.max(b.high.x), a.high.y.max(b.high.y), a.high.z.max(b.high.z)),
    }
}

#[cube]
fn point(p: V3) -> Bounds {
    Bounds { low: p, high: p }
}

/// A thread for each face, then one for each node of the tree over tetrahedra, of which leaves have work.
#[cube(launch, create_dummy_kernel)]
pub fn follow(
    table: &mut [u32],
    words: &[u32],
    rows: &mut [Vector<f32, Const<4>>],
    positions: &[f32],
    frame: &[Vector<f32, Const<4>>],
    shape: u32,
) {
    let item = ABSOLUTE_POS as u32;
    let faces = entry(table, shape, FACE_COUNT);
    let nodes = entry(table, shape, TREE_NODES);
    if item < faces {
        let at = (entry(table, shape, FACE_VERTICES) + 3u32 * item) as usize;
        let a = vertex(positions, frame, words[at]);
        let b = vertex(positions, frame, words[at + 1]);
        let c = vertex(positions, frame, words[at + 2]);
        let r = record_of(a, b, c);
        let to = (entry(table, shape, RECORDS) + item * comptime!(FACE_ROWS as u32)) as usize;
        // Hints and owned corners stay.
        let hints = rows[to + 3].extract(3usize);
        rows[to] = four(r.a.x, r.a.y, r.a.z, r.ab.x);
        rows[to + 1] = four(r.ab.y, r.ab.z, r.ac.x, r.ac.y);
        rows[to + 2] = four(r.ac.z, r.normal.x, r.normal.y, r.normal.z);
        rows[to + 3] = four(r.inverse.x, r.inverse.y, r.inverse.z, hints);
    } else if item < faces + nodes {
        let node = item - faces;
        let root = words[(entry(table, shape, TREE) + 2u32 * node + 1u32) as usize];
        if root != NONE {
            let at = (entry(table, shape, TET_VERTICES) + 4u32 * root) as usize;
            let a = vertex(positions, frame, words[at]);
            let b = vertex(positions, frame, words[at + 1]);
            let c = vertex(positions, frame, words[at + 2]);
            let d = vertex(positions, frame, words[at + 3]);
            let t = tetrahedron_of(a, b, c, d);
            let to = (entry(table, shape, TETRAHEDRA) + root * comptime!(TETRAHEDRON_ROWS as u32)) as usize;
            rows[to] = four(t.corner.x, t.corner.y, t.corner.z, t.h0);
            rows[to + 1] = four(t.g1.x, t.g1.y, t.g1.z, t.h1);
            rows[to + 2] = four(t.g2.x, t.g2.y, t.g2.z, t.h2);
            rows[to + 3] = four(t.g3.x, t.g3.y, t.g3.z, t.h3);
            rows[to + 4] = four(t.g0.x, t.g0.y, t.g0.z, 0.0f32);
            let all = both(both(point(a), point(b)), both(point(c), point(d)));
            let to = (entry(table, shape, TREE_BOXES) + 2u32 * node) as usize;
            rows[to] = four(all.low.x, all.low.y, all.low.z, 0.0f32);
            rows[to + 1] = four(all.high.x, all.high.y, all.high.z, 0.0f32);
        }
    }
}

/// Around both boxes of a node of the face tree.
#[cube]
fn of_node(rows: &mut [Vector<f32, Const<4>>], boxes: u32, node: u32) -> Bounds {
    let at = (boxes + 3u32 * node) as usize;
    let (r, s, t) = (rows[at], rows[at + 1], rows[at + 2]);
    let left = Bounds {
        low: v3(r.extract(0usize), r.extract(1usize), r.extract(2usize)),
        high: v3(r.extract(3usize), s.extract(0usize), s.extract(1usize)),
    };
    let right = Bounds {
        low: v3(s.extract(2usize), s.extract(3usize), t.extract(0usize)),
        high: v3(t.extract(1usize), t.extract(2usize), t.extract(3usize)),
    };
    both(left, right)
}

/// Around the faces or boxes below one side of a node of the face tree.
#[cube]
fn below(
    words: &[u32],
    rows: &mut [Vector<f32, Const<4>>],
    positions: &[f32],
    frame: &[Vector<f32, Const<4>>],
    child: u32,
    boxes: u32,
    vertices: u32,
) -> Bounds {
    let start = nothing();
    let mut lx = start.low.x;
    let mut ly = start.low.y;
    let mut lz = start.low.z;
    let mut hx = start.high.x;
    let mut hy = start.high.y;
    let mut hz = start.high.z;
    if child >= 2147483648u32 {
        let first = 3u32 * ((child & 2147483647u32) >> 3u32);
        let count = 3u32 * ((child & 7u32) + 1u32);
        let all = around(words, positions, frame, vertices + first, count);
        lx = all.low.x;
        ly = all.low.y;
        lz = all.low.z;
        hx = all.high.x;
        hy = all.high.y;
        hz = all.high.z;
    } else {
        let all = of_node(rows, boxes, child);
        lx = all.low.x;
        ly = all.low.y;
        lz = all.low.z;
        hx = all.high.x;
        hy = all.high.y;
        hz = all.high.z;
    }
    Bounds { low: v3(lx, ly, lz), high: v3(hx, hy, hz) }
}

/// Around `count` vertices that are named from word `first` on.
#[cube]
fn around(
    words: &[u32],
    positions: &[f32],
    frame: &[Vector<f32, Const<4>>],
    first: u32,
    count: u32,
) -> Bounds {
    let start = nothing();
    let mut lx = start.low.x;
    let mut ly = start.low.y;
    let mut lz = start.low.z;
    let mut hx = start.high.x;
    let mut hy = start.high.y;
    let mut hz = start.high.z;
    let mut k = 0u32;
    while k < count {
        let p = vertex(positions, frame, words[(first + k) as usize]);
        lx = lx.min(p.x);
        ly = ly.min(p.y);
        lz = lz.min(p.z);
        hx = hx.max(p.x);
        hy = hy.max(p.y);
        hz = hz.max(p.z);
        k += 1u32;
    }
    Bounds { low: v3(lx, ly, lz), high: v3(hx, hy, hz) }
}

/// One group of [`GROUP`] threads. Levels of a tree are words: their number, where each begins and the last ends, then the inner nodes, those over leaves first.
#[cube(launch, create_dummy_kernel)]
pub fn refit(
    table: &mut [u32],
    words: &[u32],
    rows: &mut [Vector<f32, Const<4>>],
    positions: &[f32],
    frame: &[Vector<f32, Const<4>>],
    shape: u32,
) {
    let boxes = entry(table, shape, BOXES);
    let children = entry(table, shape, CHILDREN);
    let vertices = entry(table, shape, FACE_VERTICES);
    let faces = entry(table, shape, FACE_LEVELS);
    let levels = words[faces as usize];
    let mut level = 0u32;
    while level < levels {
        let mut i = words[(faces + 1u32 + level) as usize] + UNIT_POS;
        let end = words[(faces + 2u32 + level) as usize];
        while i < end {
            let node = words[(faces + 2u32 + levels + i) as usize];
            let left_word = words[(children + 2u32 * node) as usize];
            let right_word = words[(children + 2u32 * node + 1u32) as usize];
            let left = below(words, rows, positions, frame, left_word, boxes, vertices);
            let right = below(words, rows, positions, frame, right_word, boxes, vertices);
            let to = (boxes + 3u32 * node) as usize;
            rows[to] = four(left.low.x, left.low.y, left.low.z, left.high.x);
            rows[to + 1] = four(left.high.y, left.high.z, right.low.x, right.low.y);
            rows[to + 2] = four(right.low.z, right.high.x, right.high.y, right.high.z);
            i += GROUP;
        }
        sync_storage();
        level += 1u32;
    }
    let tree = entry(table, shape, TREE);
    let tree_boxes = entry(table, shape, TREE_BOXES);
    let nodes = entry(table, shape, TREE_LEVELS);
    let levels = words[nodes as usize];
    let mut level = 0u32;
    while level < levels {
        let mut i = words[(nodes + 1u32 + level) as usize] + UNIT_POS;
        let end = words[(nodes + 2u32 + level) as usize];
        while i < end {
            let node = words[(nodes + 2u32 + levels + i) as usize];
            let start = nothing();
            let mut lx = start.low.x;
            let mut ly = start.low.y;
            let mut lz = start.low.z;
            let mut hx = start.high.x;
            let mut hy = start.high.y;
            let mut hz = start.high.z;
            let last = words[(tree + 2u32 * node) as usize];
            let mut child = node + 1u32;
            while child < last {
                let at = (tree_boxes + 2u32 * child) as usize;
                let (low, high) = (rows[at], rows[at + 1]);
                lx = lx.min(low.extract(0usize));
                ly = ly.min(low.extract(1usize));
                lz = lz.min(low.extract(2usize));
                hx = hx.max(high.extract(0usize));
                hy = hy.max(high.extract(1usize));
                hz = hz.max(high.extract(2usize));
                child = words[(tree + 2u32 * child) as usize];
            }
            let to = (tree_boxes + 2u32 * node) as usize;
            rows[to] = four(lx, ly, lz, 0.0f32);
            rows[to + 1] = four(hx, hy, hz, 0.0f32);
            i += GROUP;
        }
        sync_storage();
        level += 1u32;
    }
    let meshlets = entry(table, shape, MESHLETS);
    let ranges = entry(table, shape, MESHLET_FACES);
    let side = f32::reinterpret(entry(table, shape, SIDE));
    let mut i = UNIT_POS;
    while i < entry(table, shape, MESHLET_COUNT) {
        let first = vertices + 3u32 * words[(ranges + 2u32 * i) as usize];
        let count = 3u32 * words[(ranges + 2u32 * i + 1u32) as usize];
        let all = around(words, positions, frame, first, count);
        let middle = v3(
            0.5f32 * (all.low.x + all.high.x),
            0.5f32 * (all.low.y + all.high.y),
            0.5f32 * (all.low.z + all.high.z),
        );
        let mut radius = 0.0f32;
        let mut k = 0u32;
        while k < count {
            let p = vertex(positions, frame, words[(first + k) as usize]);
            radius = radius.max(length(minus(p, middle)));
            k += 1u32;
        }
        radius += GROWN * (radius + side);
        rows[(meshlets + i) as usize] = four(middle.x, middle.y, middle.z, radius);
        i += GROUP;
    }
    // The lowest vertex that is nowhere, or farther out than `f32` can tell faces apart.
    let mut bad = Shared::<[u32]>::new_slice(GROUP as usize);
    let mut lowest = NONE.runtime();
    let mut v = UNIT_POS;
    while v < entry(table, shape, VERTEX_COUNT) {
        let p = vertex(positions, frame, v);
        let limit = 2.0f32 * side;
        let good = p.x.abs() <= limit && p.y.abs() <= limit && p.z.abs() <= limit;
        lowest = select(good, lowest, lowest.min(v));
        v += GROUP;
    }
    bad[UNIT_POS as usize] = lowest;
    sync_cube();
    if UNIT_POS == 0u32 {
        let mut k = 1u32;
        while k < GROUP {
            lowest = lowest.min(bad[k as usize]);
            k += 1u32;
        }
        let first = (shape * STRIDE) as usize;
        table[first + BAD_VERTEX as usize] = lowest;
        // Of moved lists and cells nothing is proved.
        table[first + EXACT_LISTS as usize] = 0u32;
        table[first + BOUND_UNIT as usize] = 0u32;
        // As thick as before, more or less, but not where.
        let inner = entry(table, shape, INNER_BALL) as usize;
        let thickness = rows[inner].extract(3usize).abs();
        rows[inner] = four(0.0f32, 0.0f32, 0.0f32, -thickness);
        let all = of_node(rows, boxes, 0u32);
        table[first + LOW as usize] = u32::reinterpret(all.low.x);
        table[first + LOW as usize + 1usize] = u32::reinterpret(all.low.y);
        table[first + LOW as usize + 2usize] = u32::reinterpret(all.low.z);
        table[first + HIGH as usize] = u32::reinterpret(all.high.x);
        table[first + HIGH as usize + 1usize] = u32::reinterpret(all.high.y);
        table[first + HIGH as usize + 2usize] = u32::reinterpret(all.high.z);
    }
}
