//! Middle phase: which cells a face meets, and the polygon that each of them holds.
//!
//! A thread walks the bisection forest, from the roots of the cube or from the tetrahedra of a conforming domain that a tree of boxes finds, with the barycentric coordinates of the three corners. It goes down one child and comes back for
//! the other: what it needs for that is the way it went, a bit a level, and the words of the first children. A polygon is
//! kept as weights of the face's corners, in which the coordinates of all cells are linear.
use cubecl::prelude::*;

use super::assets::{
    Assets, BAND, FACE_COUNT, KIND, MESH, MESHLET_FACES, NODES, NONE, TREE_NODES, entry, is_conforming,
    number,
};
use super::broad::{cell_bound, is_beyond};
use super::cut::{ROOM, cut, start};
use super::locate::{Lambda, NOT_OF_DOMAIN, code, coordinate, in_child, in_cube, is_split, lambda_at, place};
use super::narrow::{LANES, node};
use super::pairs::four;
use super::products::{
    self, PAIR_WORDS, POLYGON_ROWS, POLYGON_VERTICES, POLYGON_WORDS, append, tell_if_broken_off,
};
use super::surface::{Direction, Part, ball_center, ball_radius, direction, part};
use super::tetrahedra::{around_of, is_flat, lambda_in, tetrahedron, visit};
use super::vector::V3;

/// Deepest cell, as in `tesdf::domain::MAX_DEPTH`, and what is above it.
const LEVELS: usize = 67;
/// Words of a way through them, a bit a level; read three levels at a time.
const PATH: usize = 3;

/// First face and number of faces of a meshlet; simple shapes have one.
#[cube]
pub fn faces_of(assets: &Assets, shape: u32, meshlet: u32, #[comptime] which: u32) -> u32 {
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

/// Appends a polygon.
#[cube]
pub fn write(
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
            rows[row + k] =
                four(s[2usize * k], t[2usize * k], s[2usize * k + 1usize], t[2usize * k + 1usize]);
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
pub fn is_separate(l: Corners) -> bool {
    is_out(l.a.l0, l.b.l0, l.c.l0)
        || is_out(l.a.l1, l.b.l1, l.c.l1)
        || is_out(l.a.l2, l.b.l2, l.c.l2)
        || is_out(l.a.l3, l.b.l3, l.c.l3)
}

/// Side taken at a level, of three words of bits.
#[cube]
fn bit(path: &Array<u32>, level: u32) -> bool {
    (path[(level / 32u32) as usize] >> (level % 32u32)) & 1u32 == 1u32
}

/// One more than the highest level whose bit is set; 0 without one.
#[cube]
fn last_bit(bits: &Array<u32>) -> u32 {
    let high = 96u32 - bits[2].leading_zeros();
    let middle = 64u32 - bits[1].leading_zeros();
    let low = 32u32 - bits[0].leading_zeros();
    select(bits[2] > 0u32, high, select(bits[1] > 0u32, middle, low))
}

#[cube]
fn set_bit(path: &mut Array<u32>, level: u32, value: bool) {
    let mask = 1u32 << (level % 32u32);
    let at = (level / 32u32) as usize;
    let cleared = path[at] & !mask;
    path[at] = select(value, cleared | mask, cleared);
}

/// Coordinates of the three corners of a face in a cell.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Corners {
    pub a: Lambda,
    pub b: Lambda,
    pub c: Lambda,
}

#[cube]
fn corners_in_child(held: Corners, k: u32, second: bool) -> Corners {
    Corners { a: in_child(held.a, k, second), b: in_child(held.b, k, second), c: in_child(held.c, k, second) }
}

/// After one level, two, or three and more.
#[cube]
fn pick_lambda(levels: u32, one: Lambda, two: Lambda, three: Lambda) -> Lambda {
    Lambda {
        l0: select(levels == 1u32, one.l0, select(levels == 2u32, two.l0, three.l0)),
        l1: select(levels == 1u32, one.l1, select(levels == 2u32, two.l1, three.l1)),
        l2: select(levels == 1u32, one.l2, select(levels == 2u32, two.l2, three.l2)),
        l3: select(levels == 1u32, one.l3, select(levels == 2u32, two.l3, three.l3)),
    }
}

/// Coordinates of the corners in the cell that a path leads to.
#[cube]
fn at_path(assets: &Assets, shape: u32, p: Part, root: u32, path: &Array<u32>, depth: u32) -> Corners {
    let from = tetrahedron(assets, shape, root);
    let held = Corners { a: lambda_in(from, p.a), b: lambda_in(from, p.b), c: lambda_in(from, p.c) };
    let mut a0 = held.a.l0;
    let mut a1 = held.a.l1;
    let mut a2 = held.a.l2;
    let mut a3 = held.a.l3;
    let mut b0 = held.b.l0;
    let mut b1 = held.b.l1;
    let mut b2 = held.b.l2;
    let mut b3 = held.b.l3;
    let mut c0 = held.c.l0;
    let mut c1 = held.c.l1;
    let mut c2 = held.c.l2;
    let mut c3 = held.c.l3;
    // Three levels a turn, each with its refinement edge.
    let mut level = 0u32;
    while level < depth {
        let here = Corners {
            a: Lambda { l0: a0, l1: a1, l2: a2, l3: a3 },
            b: Lambda { l0: b0, l1: b1, l2: b2, l3: b3 },
            c: Lambda { l0: c0, l1: c1, l2: c2, l3: c3 },
        };
        let one = corners_in_child(here, 3u32, bit(path, level));
        let two = corners_in_child(one, 2u32, bit(path, level + 1u32));
        let three = corners_in_child(two, 1u32, bit(path, level + 2u32));
        let left = depth - level;
        let below = Corners {
            a: pick_lambda(left, one.a, two.a, three.a),
            b: pick_lambda(left, one.b, two.b, three.b),
            c: pick_lambda(left, one.c, two.c, three.c),
        };
        a0 = below.a.l0;
        a1 = below.a.l1;
        a2 = below.a.l2;
        a3 = below.a.l3;
        b0 = below.b.l0;
        b1 = below.b.l1;
        b2 = below.b.l2;
        b3 = below.b.l3;
        c0 = below.c.l0;
        c1 = below.c.l1;
        c2 = below.c.l2;
        c3 = below.c.l3;
        level += 3u32;
    }
    Corners {
        a: Lambda { l0: a0, l1: a1, l2: a2, l3: a3 },
        b: Lambda { l0: b0, l1: b1, l2: b2, l3: b3 },
        c: Lambda { l0: c0, l1: c1, l2: c2, l3: c3 },
    }
}

/// How many threads share a face of a meshlet of few faces, which may be large: a power of two.
#[cube]
fn threads_per_face(faces: u32) -> u32 {
    let mut threads = 1u32;
    while 2u32 * threads * faces <= LANES {
        threads *= 2u32;
    }
    threads
}

/// A group for each meshlet, a thread for each face, or several where there are few.
#[cube(launch, create_dummy_kernel)]
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
        let faces = faces_of(assets, d.shape_a, meshlet, 1u32);
        let threads = threads_per_face(faces);
        let mine = UNIT_POS % threads;
        if UNIT_POS / threads < faces {
            let number_of = faces_of(assets, d.shape_a, meshlet, 0u32) + UNIT_POS / threads;
            let p: Part = part(assets, d, number_of);
            let center = ball_center(p);
            if !is_beyond(assets, d.shape_b, center, ball_radius(p, center), d.reach + d.radius, prune) {
                if mine == 0u32 {
                    counters[products::CANDIDATES as usize].fetch_add(1u32);
                }
                let mut s = Array::<f32>::new(ROOM);
                let mut t = Array::<f32>::new(ROOM);
                if entry(assets, d.shape_b, KIND) == MESH {
                    clip(
                        assets, d, p, counters, words, rows, most, at, number_of, prune, mine, threads,
                        &mut s, &mut t,
                    );
                } else if mine == 0u32 {
                    start(&mut s, &mut t);
                    write(counters, words, rows, most, at, number_of, NONE, &mut s, &mut t, p.count);
                }
            }
        }
        tell_if_broken_off(counters, select(count > 0u32, 2u32, 0u32));
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
    mine: u32,
    threads: u32,
    s: &mut Array<f32>,
    t: &mut Array<f32>,
) {
    let shape = d.shape_b;
    let reach = d.reach + d.radius;
    let conforming = is_conforming(assets, shape);
    // Around a conforming domain `outside::outside_polygons` looks.
    let beyond = (conforming && reach > 0.0f32) || (!conforming && reach >= number(assets, shape, BAND));
    if beyond && !conforming && mine == 0u32 {
        let a = in_cube(assets, shape, p.a);
        let b = in_cube(assets, shape, p.b);
        let c = in_cube(assets, shape, p.c);
        outside(a, b, c, p.count, counters, words, rows, most, at, face, s, t);
    }
    let nodes = entry(assets, shape, NODES);
    // The first child at each level, and whether its sibling is still to be looked at.
    let mut children = Array::<u32>::new(LEVELS);
    let mut path = Array::<u32>::new(PATH);
    let mut waiting = Array::<u32>::new(PATH);
    // One thread goes through the six roots; several share the cells three levels below, or take turns at the tetrahedra of a conforming
    // domain, where a part is a node of the tree that finds them.
    let levels = select(threads > 1u32 && !conforming, 3u32, 0u32);
    let parts = select(conforming, entry(assets, shape, TREE_NODES), 6u32 << levels);
    let around = around_of(p.a, p.b, p.c);
    let mut part_of = select(conforming, 0u32, mine);
    let mut turn = 0u32;
    while part_of < parts {
        let mut root = part_of >> levels;
        let mut next_part = part_of + threads;
        let mut elsewhere = false;
        if conforming {
            let step = visit(assets, shape, part_of, around);
            next_part = step.next;
            root = select(step.tetrahedron == NONE, 0u32, step.tetrahedron);
            elsewhere = step.tetrahedron == NONE
                || turn % threads != mine
                || is_flat(tetrahedron(assets, shape, root));
            turn += select(step.tetrahedron == NONE, 0u32, 1u32);
        }
        let mut depth = 0u32;
        let mut cell = root;
        // A cell above stands for all of its part, once.
        let mut open = true;
        while depth < levels && open {
            let word = assets.words[(nodes + cell) as usize];
            if is_split(word) {
                let side = (part_of >> (levels - 1u32 - depth)) & 1u32;
                set_bit(&mut path, depth, side == 1u32);
                cell = word + side;
                depth += 1u32;
            } else {
                open = false;
            }
        }
        let skipped =
            elsewhere || (depth < levels && (part_of & ((1u32 << (levels - depth)) - 1u32)) != 0u32);
        let held = at_path(assets, shape, p, root, &path, depth);
        let mut a0 = held.a.l0;
        let mut a1 = held.a.l1;
        let mut a2 = held.a.l2;
        let mut a3 = held.a.l3;
        let mut b0 = held.b.l0;
        let mut b1 = held.b.l1;
        let mut b2 = held.b.l2;
        let mut b3 = held.b.l3;
        let mut c0 = held.c.l0;
        let mut c1 = held.c.l1;
        let mut c2 = held.c.l2;
        let mut c3 = held.c.l3;
        waiting[0] = 0u32;
        waiting[1] = 0u32;
        waiting[2] = 0u32;
        open = !skipped;
        while open {
            let here = Corners {
                a: Lambda { l0: a0, l1: a1, l2: a2, l3: a3 },
                b: Lambda { l0: b0, l1: b1, l2: b2, l3: b3 },
                c: Lambda { l0: c0, l1: c1, l2: c2, l3: c3 },
            };
            let word = assets.words[(nodes + cell) as usize];
            let mut down = false;
            let mut side = false;
            let k = 3u32 - depth % 3u32;
            if !is_separate(here) && (prune == 0u32 || cell_bound(assets, shape, cell) <= reach) {
                if is_split(word) {
                    let ha = a0 - lambda_at(here.a, k);
                    let hb = b0 - lambda_at(here.b, k);
                    let hc = c0 - lambda_at(here.c, k);
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
                    n = cut(s, t, n, a0, b0, c0, 1.0f32);
                    n = cut(s, t, n, a1, b1, c1, 1.0f32);
                    n = cut(s, t, n, a2, b2, c2, 1.0f32);
                    n = cut(s, t, n, a3, b3, c3, 1.0f32);
                    if n > 0u32 {
                        write(counters, words, rows, most, at, face, cell, s, t, n);
                    }
                }
            }
            let next = corners_in_child(here, k, side);
            if down {
                cell = word + select(side, 1u32, 0u32);
                depth += 1u32;
            } else {
                // Up to the last level whose sibling waits.
                depth = last_bit(&waiting);
                open = depth > 0u32;
                if open {
                    set_bit(&mut waiting, depth - 1u32, false);
                    set_bit(&mut path, depth - 1u32, true);
                    cell = children[(depth - 1u32) as usize] + 1u32;
                }
            }
            let again = at_path(assets, shape, p, root, &path, select(down || !open, 0u32, depth));
            a0 = select(down, next.a.l0, again.a.l0);
            a1 = select(down, next.a.l1, again.a.l1);
            a2 = select(down, next.a.l2, again.a.l2);
            a3 = select(down, next.a.l3, again.a.l3);
            b0 = select(down, next.b.l0, again.b.l0);
            b1 = select(down, next.b.l1, again.b.l1);
            b2 = select(down, next.b.l2, again.b.l2);
            b3 = select(down, next.b.l3, again.b.l3);
            c0 = select(down, next.c.l0, again.c.l0);
            c1 = select(down, next.c.l1, again.c.l1);
            c2 = select(down, next.c.l2, again.c.l2);
            c3 = select(down, next.c.l3, again.c.l3);
        }
        part_of = next_part;
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
#[cube(launch, create_dummy_kernel)]
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
