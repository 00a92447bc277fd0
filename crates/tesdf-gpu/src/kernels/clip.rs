//! Middle phase: which cells a face meets, and the polygon that each of them holds.
//!
//! A thread walks the bisection forest with the barycentric coordinates of the three corners. It goes down one child and comes back for
//! the other: what it needs for that is the way it went, a bit a level, and the words of the first children. A polygon is
//! kept as weights of the face's corners, in which the coordinates of all cells are linear.
use cubecl::prelude::*;

use super::assets::{Assets, BAND, FACE_COUNT, KIND, MESH, MESHLET_FACES, NODES, NONE, entry, number};
use super::broad::{cell_bound, part_is_beyond};
use super::locate::{Lambda, NOT_OF_DOMAIN, code, coordinate, in_child, in_cube, in_root, is_split, lambda_at, place};
use super::narrow::node;
use super::pairs::four;
use super::products::{self, PAIR_WORDS, POLYGON_ROWS, POLYGON_VERTICES, POLYGON_WORDS, append};
use super::surface::{Direction, Part, ball_center, ball_radius, direction, part};
use super::vector::V3;

/// Deepest cell, as in `tesdf::domain::MAX_DEPTH`, and what is above it.
const LEVELS: usize = 67;
/// Room for the vertices of a polygon while it is cut.
const ROOM: usize = 12;

/// First face and number of faces of a meshlet; simple shapes have one.
#[cube]
fn faces_of(assets: &Assets, shape: u32, meshlet: u32, #[comptime] which: u32) -> u32 {
    let mut value = comptime!(0u32).runtime();
    if entry(assets, shape, KIND) == MESH {
        value = assets.words[(entry(assets, shape, MESHLET_FACES) + 2u32 * meshlet + which) as usize];
    } else {
        if which == 1u32 {
            value = entry(assets, shape, FACE_COUNT);
        }
    }
    value
}

/// Cuts a polygon of `n` weights by a linear function with values `h0`, `h1`, `h2` at the corners of the face; keeps what is above when
/// `keep` is 1, what is below when it is −1. Returns the number of weights.
#[cube]
fn cut(s: &mut Array<f32>, t: &mut Array<f32>, n: u32, h0: f32, h1: f32, h2: f32, keep: f32) -> u32 {
    let mut above = false;
    let mut below = false;
    let mut heights = Array::<f32>::new(ROOM);
    let mut old_s = Array::<f32>::new(ROOM);
    let mut old_t = Array::<f32>::new(ROOM);
    let mut i = 0u32;
    while i < n {
        let (x, y) = (s[i as usize], t[i as usize]);
        let h = keep * (h0 + x * (h1 - h0) + y * (h2 - h0));
        heights[i as usize] = h;
        old_s[i as usize] = x;
        old_t[i as usize] = y;
        above = above || h > 0.0f32;
        below = below || h < 0.0f32;
        i += 1u32;
    }
    // What only touches the plane is not cut, and belongs above.
    let mut count = select(below && !above, 0u32, n);
    if keep < 0.0f32 && !above {
        count = 0u32;
    }
    if below && above {
        count = 0u32;
        i = 0u32;
        while i < n {
            let j = select(i + 1u32 == n, 0u32, i + 1u32);
            let h = heights[i as usize];
            let next = heights[j as usize];
            if h >= 0.0f32 && count < comptime!(ROOM as u32) {
                s[count as usize] = old_s[i as usize];
                t[count as usize] = old_t[i as usize];
                count += 1u32;
            }
            // A segment has no edge back.
            let is_edge = n > 2u32 || i == 0u32;
            let crosses = (h > 0.0f32 && next < 0.0f32) || (h < 0.0f32 && next > 0.0f32);
            if is_edge && crosses && count < comptime!(ROOM as u32) {
                let w = h / (h - next);
                s[count as usize] = old_s[i as usize] + w * (old_s[j as usize] - old_s[i as usize]);
                t[count as usize] = old_t[i as usize] + w * (old_t[j as usize] - old_t[i as usize]);
                count += 1u32;
            }
            i += 1u32;
        }
    }
    count
}

#[cube]
fn start(s: &mut Array<f32>, t: &mut Array<f32>) {
    s[0] = 0.0f32;
    t[0] = 0.0f32;
    s[1] = 1.0f32;
    t[1] = 0.0f32;
    s[2] = 0.0f32;
    t[2] = 1.0f32;
}

#[cube]
fn write(
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    most: u32,
    at: u32,
    face: u32,
    cell: u32,
    s: &mut Array<f32>,
    t: &mut Array<f32>,
    n: u32,
) {
    let slot = append(counters, products::POLYGONS);
    if slot < most {
        // Rounding may leave more than eight, all but on a line: the first ones cover the polygon.
        let count = n.min(comptime!(POLYGON_VERTICES as u32));
        let word = (slot * comptime!(POLYGON_WORDS as u32)) as usize;
        words[word] = at;
        words[word + 1usize] = face;
        words[word + 2usize] = cell;
        words[word + 3usize] = count;
        let row = (slot * comptime!(POLYGON_ROWS as u32)) as usize;
        let mut k = 0usize;
        while k < POLYGON_ROWS {
            rows[row + k] = four(s[2usize * k], t[2usize * k], s[2usize * k + 1usize], t[2usize * k + 1usize]);
            k += 1usize;
        }
    }
}

/// Below in all corners, or touching from below.
#[cube]
fn is_out(a: f32, b: f32, c: f32) -> bool {
    let greatest = a.max(b).max(c);
    let least = a.min(b).min(c);
    greatest < 0.0f32 || (greatest <= 0.0f32 && least < 0.0f32)
}

/// Whether a face is all on the outer side of a side of a cell.
#[cube]
fn is_separate(a: Lambda, b: Lambda, c: Lambda) -> bool {
    is_out(a.l0, b.l0, c.l0) || is_out(a.l1, b.l1, c.l1) || is_out(a.l2, b.l2, c.l2) || is_out(a.l3, b.l3, c.l3)
}

/// Side taken at a level, of three words of bits.
#[cube]
fn bit(path: &Array<u32>, level: u32) -> bool {
    (path[(level / 32u32) as usize] >> (level % 32u32)) & 1u32 == 1u32
}

#[cube]
fn set_bit(path: &mut Array<u32>, level: u32, value: bool) {
    let mask = 1u32 << (level % 32u32);
    let at = (level / 32u32) as usize;
    let cleared = path[at] & !mask;
    path[at] = select(value, cleared | mask, cleared);
}

/// Coordinates of a corner of the face in the cell that a path leads to.
#[cube]
fn at_path(u: V3, root: u32, path: &Array<u32>, depth: u32) -> Lambda {
    let first = in_root(u, root);
    let mut l0 = first.l0;
    let mut l1 = first.l1;
    let mut l2 = first.l2;
    let mut l3 = first.l3;
    let mut level = 0u32;
    while level < depth {
        let below = in_child(Lambda { l0, l1, l2, l3 }, 3u32 - level % 3u32, bit(path, level));
        l0 = below.l0;
        l1 = below.l1;
        l2 = below.l2;
        l3 = below.l3;
        level += 1u32;
    }
    Lambda { l0, l1, l2, l3 }
}

/// A group for each meshlet, a thread for each face.
#[cube(launch)]
pub fn polygons(
    assets: &Assets,
    directions: &[u32],
    maps: &[Vector<f32, Const<4>>],
    meshlets: &[u32],
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    most_meshlets: u32,
    most: u32,
    prune: u32,
) {
    let item = CUBE_POS as u32;
    let count = counters[products::MESHLETS as usize].load().min(most_meshlets);
    if item < count {
        let at = meshlets[(item * comptime!(PAIR_WORDS as u32)) as usize];
        let meshlet = meshlets[(item * comptime!(PAIR_WORDS as u32) + 1u32) as usize];
        let d: Direction = direction(directions, maps, at);
        if UNIT_POS < faces_of(assets, d.shape_a, meshlet, 1u32) {
            let number_of = faces_of(assets, d.shape_a, meshlet, 0u32) + UNIT_POS;
            let p: Part = part(assets, d, number_of);
            let center = ball_center(p);
            if !part_is_beyond(assets, d, center, ball_radius(p, center), prune) {
                counters[products::CANDIDATES as usize].fetch_add(1u32);
                let mut s = Array::<f32>::new(ROOM);
                let mut t = Array::<f32>::new(ROOM);
                if entry(assets, d.shape_b, KIND) == MESH {
                    clip(assets, d, p, counters, words, rows, most, at, number_of, prune, &mut s, &mut t);
                } else {
                    start(&mut s, &mut t);
                    write(counters, words, rows, most, at, number_of, NONE, &mut s, &mut t, p.count);
                }
            }
        }
    }
}

#[cube]
fn clip(
    assets: &Assets,
    d: Direction,
    p: Part,
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    most: u32,
    at: u32,
    face: u32,
    prune: u32,
    s: &mut Array<f32>,
    t: &mut Array<f32>,
) {
    let shape = d.shape_b;
    let reach = d.reach + d.radius;
    let beyond = reach >= number(assets, shape, BAND);
    let a = in_cube(assets, shape, p.a);
    let b = in_cube(assets, shape, p.b);
    let c = in_cube(assets, shape, p.c);
    if beyond {
        outside(a, b, c, p.count, counters, words, rows, most, at, face, s, t);
    }
    let nodes = entry(assets, shape, NODES);
    // The first child at each level, and whether its sibling is still to be looked at.
    let mut children = Array::<u32>::new(LEVELS);
    let mut path = Array::<u32>::new(3usize);
    let mut waiting = Array::<u32>::new(3usize);
    let mut root = 0u32;
    while root < 6u32 {
        let mut depth = 0u32;
        let mut cell = root;
        let first_a = in_root(a, root);
        let first_b = in_root(b, root);
        let first_c = in_root(c, root);
        let mut a0 = first_a.l0;
        let mut a1 = first_a.l1;
        let mut a2 = first_a.l2;
        let mut a3 = first_a.l3;
        let mut b0 = first_b.l0;
        let mut b1 = first_b.l1;
        let mut b2 = first_b.l2;
        let mut b3 = first_b.l3;
        let mut c0 = first_c.l0;
        let mut c1 = first_c.l1;
        let mut c2 = first_c.l2;
        let mut c3 = first_c.l3;
        waiting[0] = 0u32;
        waiting[1] = 0u32;
        waiting[2] = 0u32;
        let mut open = true;
        while open {
            let la = Lambda { l0: a0, l1: a1, l2: a2, l3: a3 };
            let lb = Lambda { l0: b0, l1: b1, l2: b2, l3: b3 };
            let lc = Lambda { l0: c0, l1: c1, l2: c2, l3: c3 };
            let word = assets.words[(nodes + cell) as usize];
            let mut down = false;
            let mut side = false;
            if !is_separate(la, lb, lc) && (prune == 0u32 || cell_bound(assets, shape, cell) <= reach) {
                if is_split(word) {
                    let k = 3u32 - depth % 3u32;
                    let ha = la.l0 - lambda_at(la, k);
                    let hb = lb.l0 - lambda_at(lb, k);
                    let hc = lc.l0 - lambda_at(lc, k);
                    let above = ha > 0.0f32 || hb > 0.0f32 || hc > 0.0f32;
                    let below = ha < 0.0f32 || hb < 0.0f32 || hc < 0.0f32;
                    down = true;
                    side = below && !above;
                    children[depth as usize] = word;
                    set_bit(&mut waiting, depth, above && below);
                    set_bit(&mut path, depth, side);
                } else if code(word) != 7u32 || beyond {
                    start(s, t);
                    let mut n = p.count;
                    n = cut(s, t, n, la.l0, lb.l0, lc.l0, 1.0f32);
                    n = cut(s, t, n, la.l1, lb.l1, lc.l1, 1.0f32);
                    n = cut(s, t, n, la.l2, lb.l2, lc.l2, 1.0f32);
                    n = cut(s, t, n, la.l3, lb.l3, lc.l3, 1.0f32);
                    if n > 0u32 {
                        write(counters, words, rows, most, at, face, cell, s, t, n);
                    }
                }
            }
            if down {
                let k = 3u32 - depth % 3u32;
                let na = in_child(la, k, side);
                let nb = in_child(lb, k, side);
                let nc = in_child(lc, k, side);
                a0 = na.l0;
                a1 = na.l1;
                a2 = na.l2;
                a3 = na.l3;
                b0 = nb.l0;
                b1 = nb.l1;
                b2 = nb.l2;
                b3 = nb.l3;
                c0 = nc.l0;
                c1 = nc.l1;
                c2 = nc.l2;
                c3 = nc.l3;
                cell = word + select(side, 1u32, 0u32);
                depth += 1u32;
            } else {
                // Up to the last level whose sibling waits.
                while depth > 0u32 && !bit(&waiting, depth - 1u32) {
                    depth -= 1u32;
                }
                if depth == 0u32 {
                    open = false;
                } else {
                    set_bit(&mut waiting, depth - 1u32, false);
                    set_bit(&mut path, depth - 1u32, true);
                    cell = children[(depth - 1u32) as usize] + 1u32;
                    let na = at_path(a, root, &path, depth);
                    let nb = at_path(b, root, &path, depth);
                    let nc = at_path(c, root, &path, depth);
                    a0 = na.l0;
                    a1 = na.l1;
                    a2 = na.l2;
                    a3 = na.l3;
                    b0 = nb.l0;
                    b1 = nb.l1;
                    b2 = nb.l2;
                    b3 = nb.l3;
                    c0 = nc.l0;
                    c1 = nc.l1;
                    c2 = nc.l2;
                    c3 = nc.l3;
                }
            }
        }
        root += 1u32;
    }
}

/// The parts of a face outside of the cube, at most six.
#[cube]
fn outside(
    a: V3,
    b: V3,
    c: V3,
    corners: u32,
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    most: u32,
    at: u32,
    face: u32,
    s: &mut Array<f32>,
    t: &mut Array<f32>,
) {
    // What lies behind the side, of what lies before all sides that were before it.
    let mut side = 0u32;
    while side < 6u32 {
        start(s, t);
        let mut n = corners;
        let mut before = 0u32;
        while before <= side && n > 0u32 {
            let axis = before / 2u32;
            let ua = coordinate(a, axis);
            let ub = coordinate(b, axis);
            let uc = coordinate(c, axis);
            let is_low = before % 2u32 == 0u32;
            let ha = select(is_low, ua, 1.0f32 - ua);
            let hb = select(is_low, ub, 1.0f32 - ub);
            let hc = select(is_low, uc, 1.0f32 - uc);
            let keep = select(before == side, -1.0f32, 1.0f32);
            n = cut(s, t, n, ha, hb, hc, keep);
            before += 1u32;
        }
        if n > 0u32 {
            write(counters, words, rows, most, at, face, NONE, s, t, n);
        }
        side += 1u32;
    }
}

/// Nodes: a group for each meshlet, a thread for each face with the corners that no face before has. What can touch is written with its cell.
#[cube(launch)]
pub fn nodes(
    assets: &Assets,
    directions: &[u32],
    maps: &[Vector<f32, Const<4>>],
    meshlets: &[u32],
    counters: &[Atomic<u32>],
    words: &mut [u32],
    most_meshlets: u32,
    most: u32,
    prune: u32,
) {
    let item = CUBE_POS as u32;
    let count = counters[products::MESHLETS as usize].load().min(most_meshlets);
    if item < count {
        let at = meshlets[(item * comptime!(PAIR_WORDS as u32)) as usize];
        let meshlet = meshlets[(item * comptime!(PAIR_WORDS as u32) + 1u32) as usize];
        let d: Direction = direction(directions, maps, at);
        if UNIT_POS < faces_of(assets, d.shape_a, meshlet, 1u32) {
            let face = faces_of(assets, d.shape_a, meshlet, 0u32) + UNIT_POS;
            let p: Part = part(assets, d, face);
            let reach = d.reach + d.radius;
            let mut k = 0u32;
            while k < 3u32 {
                if (p.owned >> k) & 1u32 == 1u32 {
                    counters[products::CANDIDATES as usize].fetch_add(1u32);
                    let mut cell = NONE.runtime();
                    let mut kept = true;
                    if entry(assets, d.shape_b, KIND) == MESH {
                        let held = place(assets, d.shape_b, node(p, k));
                        let out = code(held.word) == code(NOT_OF_DOMAIN.runtime());
                        cell = held.at;
                        kept = (!out || reach >= number(assets, d.shape_b, BAND))
                            && (prune == 0u32 || cell_bound(assets, d.shape_b, cell) <= reach);
                    }
                    if kept {
                        let slot = append(counters, products::POLYGONS);
                        if slot < most {
                            let word = (slot * comptime!(POLYGON_WORDS as u32)) as usize;
                            words[word] = at;
                            words[word + 1usize] = face;
                            words[word + 2usize] = cell;
                            words[word + 3usize] = k;
                        }
                    }
                }
                k += 1u32;
            }
        }
    }
}
