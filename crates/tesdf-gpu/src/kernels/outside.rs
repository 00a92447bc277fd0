//! Middle phase around conforming domains: the parts of a face that no tetrahedron holds, whose points the face tree answers.
//!
//! A tetrahedron leaves up to four convex parts of a polygon outside. A thread walks through the choices of parts, one tetrahedron after the other, and makes each polygon
//! again from the face: what it remembers is a number for each tetrahedron. A face that has too many tetrahedra near is looked at in quarters.
use cubecl::prelude::*;

use super::assets::{Assets, KIND, MESH, NONE, TREE_NODES, entry, is_conforming};
use super::broad::{ROUNDING, is_beyond};
use super::clip::{Corners, faces_of, is_separate, write};
use super::cut::{ROOM, cut};
use super::locate::{is_inside, place};
use super::narrow::LANES;
use super::nearest::nearest_in_tree;
use super::products::{self, PAIR_WORDS, POLYGON_VERTICES, tell_if_broken_off};
use super::surface::{Direction, Part, at_weights, ball_center, ball_radius, direction, part};
use super::tetrahedra::{Around, OUT, around_of, is_flat, lambda_in, part_of, tetrahedron, visit};
use super::vector::{V3, cross, length, minus, v3};

/// Most tetrahedra that parts are chosen of.
const MOST: usize = 48;
/// A face with more than so many near is quartered: choices cost the square of their number.
const MANY: u32 = 8;
/// What is covered but for this share of its area is covered. A part that is left out has a cell beside it, where the face is as near up to its width, 1e-5 of the face.
const UNCOVERED: f32 = 1e-5;
/// How often, at most. What then still has more than [`MOST`] near, 2^-12 of the face, is not cut: a contact too many, with the distance to the surface,
/// rather than one too few.
const QUARTERINGS: u32 = 12;

/// A quarter of a quarter of … a face: its corners as weights of the second and the third corner of the face.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Quarter {
    pub a_s: f32,
    pub a_t: f32,
    pub b_s: f32,
    pub b_t: f32,
    pub c_s: f32,
    pub c_t: f32,
}

/// By two bits a level, the last level lowest: 0 to 2 at that corner, 3 in the middle.
#[cube]
pub fn quarter(path: u32, levels: u32) -> Quarter {
    let mut a_s = 0.0f32;
    let mut a_t = 0.0f32;
    let mut b_s = 1.0f32;
    let mut b_t = 0.0f32;
    let mut c_s = 0.0f32;
    let mut c_t = 1.0f32;
    let mut level = 0u32;
    while level < levels {
        let which = (path >> (2u32 * (levels - 1u32 - level))) & 3u32;
        let (ab_s, ab_t) = (0.5f32 * (a_s + b_s), 0.5f32 * (a_t + b_t));
        let (bc_s, bc_t) = (0.5f32 * (b_s + c_s), 0.5f32 * (b_t + c_t));
        let (ca_s, ca_t) = (0.5f32 * (c_s + a_s), 0.5f32 * (c_t + a_t));
        let at_a = which == 0u32;
        let at_b = which == 1u32;
        let at_c = which == 2u32;
        a_s = select(at_a, a_s, select(at_c, ca_s, ab_s));
        a_t = select(at_a, a_t, select(at_c, ca_t, ab_t));
        b_s = select(at_b, b_s, select(at_a, ab_s, bc_s));
        b_t = select(at_b, b_t, select(at_a, ab_t, bc_t));
        c_s = select(at_c, c_s, select(at_b, bc_s, ca_s));
        c_t = select(at_c, c_t, select(at_b, bc_t, ca_t));
        level += 1u32;
    }
    Quarter { a_s, a_t, b_s, b_t, c_s, c_t }
}

/// Cuts a polygon by a tetrahedron: `choice` 0 keeps what it holds, 1 to 4 what is out of that side and within those before.
#[cube]
fn keep(
    assets: &Assets,
    shape: u32,
    root: u32,
    p: Part,
    choice: u32,
    s: &mut Array<f32>,
    t: &mut Array<f32>,
    n: u32,
) -> u32 {
    let from = tetrahedron(assets, shape, root);
    let (a, b, c) = (lambda_in(from, p.a), lambda_in(from, p.b), lambda_in(from, p.c));
    let sides = select(choice == 0u32, 4u32, choice);
    let mut count = n;
    let mut side = 0u32;
    while side < sides && count > 0u32 {
        let is0 = side == 0u32;
        let is1 = side == 1u32;
        let is2 = side == 2u32;
        let ha = select(is0, a.l0, select(is1, a.l1, select(is2, a.l2, a.l3)));
        let hb = select(is0, b.l0, select(is1, b.l1, select(is2, b.l2, b.l3)));
        let hc = select(is0, c.l0, select(is1, c.l1, select(is2, c.l2, c.l3)));
        let sign = select(side + 1u32 == choice, -1.0f32, 1.0f32);
        count = cut(s, t, count, ha, hb, hc, sign);
        side += 1u32;
    }
    count
}

/// Whether a part is all in a tetrahedron.
#[cube]
fn is_within(l: Corners) -> bool {
    let a = l.a.l0.min(l.a.l1).min(l.a.l2).min(l.a.l3);
    let b = l.b.l0.min(l.b.l1).min(l.b.l2).min(l.b.l3);
    let c = l.c.l0.min(l.c.l1).min(l.c.l2).min(l.c.l3);
    a.min(b).min(c) >= 0.0f32
}

/// Whether no point of a part that is out of all tetrahedra can have a distance up to `reach`: it is far out, or deep inside.
#[cube]
fn is_far(assets: &Assets, shape: u32, center: V3, radius: f32, reach: f32) -> bool {
    let inside = is_inside(place(assets, shape, center).word);
    let limit = radius + select(inside, 0.0f32, reach) + ROUNDING;
    nearest_in_tree(assets, shape, center, limit * limit).face == NONE
}

/// A group for each meshlet, a thread for each face: what of it lies around the domain of the field is written, with [`NONE`] for a cell.
/// Faces that are to be quartered wait for the whole group.
#[cube(launch, create_dummy_kernel)]
pub fn outside_polygons(
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
    let mut waiting = Shared::<[u32]>::new_slice(LANES as usize);
    let item = CUBE_POS as u32;
    let count = counters[products::MESHLETS as usize].load().min(most_meshlets);
    if item < count {
        let at = meshlets[(item * comptime!(PAIR_WORDS as u32)) as usize];
        let meshlet = meshlets[(item * comptime!(PAIR_WORDS as u32) + 1u32) as usize];
        let d: Direction = direction(directions, maps, at);
        let reach = d.reach + d.radius;
        let is_around =
            entry(assets, d.shape_b, KIND) == MESH && is_conforming(assets, d.shape_b) && reach > 0.0f32;
        let faces = select(is_around, faces_of(assets, d.shape_a, meshlet, 1u32), 0u32);
        // First each thread its own face, then all together those that wait.
        let mut turn = 0u32;
        while turn <= faces {
            sync_cube();
            let alone = turn == 0u32;
            let number = select(alone, UNIT_POS, turn.max(1u32) - 1u32);
            let mut active = number < faces;
            if !alone {
                active = waiting[number as usize] == 1u32;
            }
            let mut waits = 0u32;
            if active {
                let face = faces_of(assets, d.shape_a, meshlet, 0u32) + number;
                let p: Part = part(assets, d, face);
                let center = ball_center(p);
                if !is_beyond(assets, d.shape_b, center, ball_radius(p, center), reach, prune) {
                    waits = around(assets, d, p, alone, counters, words, rows, most, at, face, reach);
                }
            }
            if alone {
                waiting[UNIT_POS as usize] = waits;
            }
            turn += 1u32;
        }
        tell_if_broken_off(counters, select(count > 0u32, 2u32, 0u32));
    }
}

/// Levels of quarters that a group shares out, and their number.
const SHARED_LEVELS: u32 = 3;
const SHARED: u32 = 64;

/// The parts of one face, quarter by quarter: of all of it `alone`, or of the thread's share of the group's quarters. 1 when nothing was written because the face is to be quartered
/// and the thread is alone.
#[cube]
fn around(
    assets: &Assets,
    d: Direction,
    p: Part,
    alone: bool,
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    most: u32,
    at: u32,
    face: u32,
    reach: f32,
) -> u32 {
    let shape = d.shape_b;
    let nodes = entry(assets, shape, TREE_NODES);
    let face_plane = around_of(p.a, p.b, p.c);
    let mut s = Array::<f32>::new(ROOM);
    let mut t = Array::<f32>::new(ROOM);
    let mut near = Array::<u32>::new(MOST);
    let mut choices = Array::<u32>::new(MOST);
    let top = select(alone, 0u32, SHARED_LEVELS);
    let end = select(alone, 1u32, SHARED);
    let mut path = select(alone, 0u32, UNIT_POS);
    let mut level = top;
    let mut waits = 0u32;
    let mut open = true;
    while open {
        let q = quarter(path, level);
        let here = Part {
            a: at_weights(p, q.a_s, q.a_t),
            b: at_weights(p, q.b_s, q.b_t),
            c: at_weights(p, q.c_s, q.c_t),
            count: p.count,
            owned: 0u32,
        };
        let middle = ball_center(here);
        let mut down = false;
        if !is_far(assets, shape, middle, ball_radius(here, middle), reach) {
            let bounds: Around = part_of(face_plane, here.a, here.b, here.c);
            let mut found = 0u32;
            let mut held = false;
            let mut node = 0u32;
            while node < nodes {
                let step = visit(assets, shape, node, bounds);
                node = step.next;
                if step.tetrahedron != NONE {
                    let from = tetrahedron(assets, shape, step.tetrahedron);
                    let l = Corners {
                        a: lambda_in(from, here.a),
                        b: lambda_in(from, here.b),
                        c: lambda_in(from, here.c),
                    };
                    if !is_flat(from) && !is_separate(l) {
                        if found < comptime!(MOST as u32) {
                            near[found as usize] = step.tetrahedron;
                        }
                        found += 1u32;
                        held = held || is_within(l);
                        node = select(held, nodes, node);
                    }
                }
            }
            if !held && found <= comptime!(MOST as u32) && p.count == 3u32 {
                held = is_covered(assets, shape, p, q, &mut near, found, &mut s, &mut t);
            }
            down = !held && found > MANY && level < QUARTERINGS && p.count == 3u32;
            if !held && !down && found > comptime!(MOST as u32) {
                begin(q, &mut s, &mut t);
                write(counters, words, rows, most, at, face, NONE, &mut s, &mut t, p.count);
            } else if !held && !down {
                parts(
                    assets,
                    shape,
                    p,
                    q,
                    &mut near,
                    found,
                    &mut choices,
                    counters,
                    words,
                    rows,
                    most,
                    at,
                    face,
                    &mut s,
                    &mut t,
                );
            }
        }
        if down && alone {
            waits = 1u32;
            open = false;
        } else if down {
            path *= 4u32;
            level += 1u32;
        } else {
            // On to the next quarter, of the last level that has one.
            while level > top && path % 4u32 == 3u32 {
                path /= 4u32;
                level -= 1u32;
            }
            path += select(level > top, 1u32, LANES);
            open = level > top || path < end;
        }
    }
    waits
}

/// The whole quarter.
#[cube]
fn begin(q: Quarter, s: &mut Array<f32>, t: &mut Array<f32>) {
    s[0] = q.a_s;
    t[0] = q.a_t;
    s[1] = q.b_s;
    t[1] = q.b_t;
    s[2] = q.c_s;
    t[2] = q.c_t;
}

/// Whether the tetrahedra hold all of a quarter: no two hold the same part, so areas add up.
#[cube]
fn is_covered(
    assets: &Assets,
    shape: u32,
    p: Part,
    q: Quarter,
    near: &mut Array<u32>,
    found: u32,
    s: &mut Array<f32>,
    t: &mut Array<f32>,
) -> bool {
    // Twice the areas, relative to corner a: in weights that is no shear that matters.
    let whole = ((q.b_s - q.a_s) * (q.c_t - q.a_t) - (q.b_t - q.a_t) * (q.c_s - q.a_s)).abs();
    let mut covered = 0.0f32;
    let mut i = 0u32;
    while i < found {
        begin(q, s, t);
        let n = keep(assets, shape, near[i as usize], p, 0u32, s, t, 3u32);
        let mut k = 2u32;
        while k < n {
            let (x, y) = (s[(k - 1u32) as usize] - s[0], t[(k - 1u32) as usize] - t[0]);
            covered += (x * (t[k as usize] - t[0]) - y * (s[k as usize] - s[0])).abs();
            k += 1u32;
        }
        i += 1u32;
    }
    // More than all: some are inside out, and what is counted twice may hide a gap.
    covered >= (1.0f32 - UNCOVERED) * whole && covered <= (1.0f32 + UNCOVERED) * whole
}

/// The parts of a quarter that are out of all tetrahedra near it.
#[cube]
fn parts(
    assets: &Assets,
    shape: u32,
    p: Part,
    q: Quarter,
    near: &mut Array<u32>,
    found: u32,
    choices: &mut Array<u32>,
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    most: u32,
    at: u32,
    face: u32,
    s: &mut Array<f32>,
    t: &mut Array<f32>,
) {
    let mut depth = 0u32;
    let mut choice = 0u32;
    let mut open = true;
    while open {
        begin(q, s, t);
        let mut n = p.count;
        let mut i = 0u32;
        while i <= depth && i < found {
            let mut chosen = choice;
            let mut cuts = true;
            if i < depth {
                chosen = choices[i as usize];
                cuts = chosen > 0u32;
            }
            if cuts {
                n = keep(assets, shape, near[i as usize], p, chosen, s, t, n);
            }
            i += 1u32;
        }
        let mut back = false;
        if depth == found {
            if n > 0u32 {
                write_outside(assets, shape, p, counters, words, rows, most, at, face, s, t, n, found);
            }
            back = true;
        } else if choice == 0u32 && n > 0u32 {
            // It holds something: what is out of it, side by side.
            choice = 1u32;
        } else if choice == 0u32 || n > 0u32 {
            choices[depth as usize] = choice;
            depth += 1u32;
            choice = 0u32;
        } else if choice < 4u32 {
            choice += 1u32;
        } else {
            back = true;
        }
        if back {
            open = false;
            while depth > 0u32 && !open {
                depth -= 1u32;
                choice = choices[depth as usize] + 1u32;
                open = choice > 1u32 && choice <= 4u32;
            }
        }
    }
}

/// A part of a face that is thinner than this (local frame) is what rounding has left along the side that two tetrahedra share, and goes on along its plane out of the domain.
/// A true part so thin has others beside it, where the face is as near up to that.
const SLIVER: f32 = 2.0 * OUT;

/// Appends a part, unless it is a sliver between two tetrahedra.
#[cube]
fn write_outside(
    assets: &Assets,
    shape: u32,
    p: Part,
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    most: u32,
    at: u32,
    face: u32,
    s: &mut Array<f32>,
    t: &mut Array<f32>,
    n: u32,
    cuts: u32,
) {
    let first = at_weights(p, s[0], t[0]);
    let mut sum_s = s[0];
    let mut sum_t = t[0];
    let mut longest = 0.0f32;
    // Twice the area.
    let mut x = 0.0f32;
    let mut y = 0.0f32;
    let mut z = 0.0f32;
    let mut before_x = 0.0f32;
    let mut before_y = 0.0f32;
    let mut before_z = 0.0f32;
    let mut i = 1u32;
    while i < n {
        sum_s += s[i as usize];
        sum_t += t[i as usize];
        let here = minus(at_weights(p, s[i as usize], t[i as usize]), first);
        let across = cross(v3(before_x, before_y, before_z), here);
        x += across.x;
        y += across.y;
        z += across.z;
        longest = longest.max(length(here));
        before_x = here.x;
        before_y = here.y;
        before_z = here.z;
        i += 1u32;
    }
    // What no tetrahedron has cut is as thin as the face itself.
    let is_sliver = cuts > 0u32 && p.count == 3u32 && length(v3(x, y, z)) < SLIVER * longest;
    let middle = at_weights(p, sum_s / n as f32, sum_t / n as f32);
    if !is_sliver && place(assets, shape, middle).at == NONE {
        write(counters, words, rows, most, at, face, NONE, s, t, n);
        // What is more than a polygon holds: the first vertex, the last one written, and the rest.
        let last = comptime!(POLYGON_VERTICES as u32 - 1).runtime();
        if n > last + 1u32 {
            let mut k = last;
            while k < n {
                s[(k - last + 1u32) as usize] = s[k as usize];
                t[(k - last + 1u32) as usize] = t[k as usize];
                k += 1u32;
            }
            write(counters, words, rows, most, at, face, NONE, s, t, n - last + 1u32);
        }
    }
}
