//! Narrow phase: the least signed distance over a node (Node-TES) or a clipped polygon (Face-TES, Eq. 9), and the cosine filter (Eq. 10).
use cubecl::prelude::*;

use super::assets::{Assets, KIND, MESH, NODES, NONE, RECORDS, entry};
use super::broad::ROUNDING;
use super::field::{Value, is_listed, nearest, value_in_cell, value_near};
use super::group::{least, of_lane, width_for};
use super::list::{List, list, list_face};
use super::locate::{NOT_OF_DOMAIN, offset};
use super::nearest::{FAR, Nearest, nearest_in_list};
use super::pairs::four;
use super::polygon_distance::{ball_around, weight};
use super::products::{
    self, CONTACT_ROWS, CONTACT_WORDS, CONVERGED, POLYGON_VERTICES, POLYGON_WORDS, append, tell_if_broken_off,
};
use super::surface::{Direction, Part, at_weights, direction, normal, part};
use super::triangle::{Face, ROWS, distance_squared, face};
use super::vector::{V3, dot, minus, pick, plus_scaled, v3};

/// Threads that work on one polygon.
pub const LANES: u32 = 32;

/// Corner `k` of a part.
#[cube]
pub fn node(p: Part, k: u32) -> V3 {
    pick(k == 1u32, p.b, pick(k == 2u32, p.c, p.a))
}

/// The word of a cell.
#[cube]
pub fn word_of(assets: &Assets, shape: u32, cell: u32) -> u32 {
    let mut word = NOT_OF_DOMAIN.runtime();
    if cell != NONE && entry(assets, shape, KIND) == MESH {
        word = assets.words[(entry(assets, shape, NODES) + cell) as usize];
    }
    word
}

/// Appends a contact.
#[cube]
pub fn write(
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    most: u32,
    d: Direction,
    face: u32,
    cell: u32,
    corner: u32,
    converged: u32,
    point: V3,
    v: Value,
) {
    let slot = append(counters, products::CONTACTS);
    if slot < most {
        let word = (slot * comptime!(CONTACT_WORDS as u32)) as usize;
        words[word] = d.a;
        words[word + 1usize] = d.b;
        words[word + 2usize] = face;
        words[word + 3usize] = cell;
        words[word + 4usize] = v.face;
        words[word + 5usize] = v.feature;
        words[word + 6usize] = corner + converged * CONVERGED;
        words[word + 7usize] = d.number;
        let row = (slot * comptime!(CONTACT_ROWS as u32)) as usize;
        let on_surface = plus_scaled(point, -d.radius, v.gradient);
        rows[row] = four(on_surface.x, on_surface.y, on_surface.z, v.distance - d.radius);
        rows[row + 1usize] = four(v.gradient.x, v.gradient.y, v.gradient.z, 0.0f32);
        rows[row + 2usize] = four(v.point.x, v.point.y, v.point.z, 0.0f32);
    }
}

/// The cell of a contact: only one with a list is named.
#[cube]
pub fn named(word: u32, cell: u32) -> u32 {
    select(is_listed(word), cell, NONE)
}

/// A thread for each node and its cell.
#[cube(launch, create_dummy_kernel)]
pub fn narrow_nodes(
    assets: &Assets,
    directions: &[u32],
    maps: &[Vector<f32, Const<4>>],
    items: &[u32],
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    most_items: u32,
    most: u32,
) {
    let item = ABSOLUTE_POS as u32;
    let count = counters[products::POLYGONS as usize].load().min(most_items);
    if item < count {
        let first = (item * comptime!(POLYGON_WORDS as u32)) as usize;
        let d: Direction = direction(directions, maps, items[first]);
        let face = items[first + 1usize];
        let cell = items[first + 2usize];
        let corner = items[first + 3usize];
        let p = node(part(assets, d, face), corner);
        let word = word_of(assets, d.shape_b, cell);
        let v = value_in_cell(assets, d.shape_b, word, p);
        if v.distance <= d.reach + d.radius {
            write(counters, words, rows, most, d, face, named(word, cell), corner, 1u32, p, v);
        }
    }
}

/// The field at a point of the polygon's cell, by `width` threads of the group together: each part of the group may have a point of its own. `own` is
/// the face that the thread keeps in registers, `position` its number, when it has one.
#[cube]
fn value_in(
    assets: &Assets,
    d: Direction,
    word: u32,
    faces: List,
    own: Face,
    position: u32,
    width: u32,
    p: V3,
    squares: &mut Shared<[f32]>,
    ids: &mut Shared<[u32]>,
    #[comptime] lanes: u32,
    #[comptime] planes: bool,
) -> Value {
    let shape = d.shape_b;
    let mut squared = FAR.runtime();
    let mut nearest_face = NONE.runtime();
    if entry(assets, shape, KIND) == MESH && is_listed(word) {
        let first = select(lanes == 1u32, 0u32, UNIT_POS % width);
        if first < faces.count {
            squared = distance_squared(own, p);
            nearest_face = position;
        }
        let rest = nearest_in_list(assets, shape, faces, first + lanes, lanes, p);
        let nearer = rest.squared < squared || (rest.squared == squared && rest.face < nearest_face);
        squared = select(nearer, rest.squared, squared);
        nearest_face = select(nearer, rest.face, nearest_face);
        let all = least(Nearest { squared, face: nearest_face }, width, squares, ids, lanes, planes);
        squared = all.squared;
        nearest_face = all.face;
    } else {
        let found = nearest(assets, shape, word, p);
        squared = found.squared;
        nearest_face = found.face;
    }
    value_near(assets, shape, word, p, Nearest { squared, face: nearest_face })
}

/// Frank–Wolfe on Eq. (9): from the best of centre and vertices, `iterations` steps of 2 / (k + 2) towards the vertex that lies farthest down
/// the gradient; the best point seen, as `tesdf` does it.
///
/// With `lanes` 32 a group works on each polygon, each thread with a face of the list in registers and with every 32nd of the rest; a list of 16
/// faces or less leaves threads for more vertices at a time. With `lanes` 1 a thread works on each polygon alone. `planes` says how a group finds its least distance: in a plane of 32 threads, or in shared memory.
#[cube(launch, create_dummy_kernel)]
pub fn narrow_faces(
    assets: &Assets,
    directions: &[u32],
    maps: &[Vector<f32, Const<4>>],
    items: &[u32],
    weights: &[Vector<f32, Const<4>>],
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    iterations: u32,
    cos_theta: f32,
    most_items: u32,
    most: u32,
    #[comptime] lanes: u32,
    #[comptime] planes: bool,
    #[comptime] counting: bool,
) {
    let mut squares = Shared::<[f32]>::new_slice(LANES as usize);
    let mut ids = Shared::<[u32]>::new_slice(LANES as usize);
    let polygons = comptime!((LANES / lanes) as usize);
    let mut best_rows = Shared::<[Vector<f32, Const<4>>]>::new_slice(comptime!(2 * polygons));
    let mut best_words = Shared::<[u32]>::new_slice(comptime!(2 * polygons));
    let item = select(lanes == 1u32, ABSOLUTE_POS as u32, CUBE_POS as u32);
    let count = counters[products::POLYGONS as usize].load().min(most_items);
    if item < count {
        let first = (item * comptime!(POLYGON_WORDS as u32)) as usize;
        let d: Direction = direction(directions, maps, items[first]);
        let face_a = items[first + 1usize];
        let cell = items[first + 2usize];
        let n = items[first + 3usize];
        let surface = part(assets, d, face_a);
        let reach = d.reach + d.radius;
        let word = word_of(assets, d.shape_b, cell);
        // The thread's own face stays in registers.
        let faces = list(assets, d.shape_b, select(is_listed(word), offset(word), 0u32));
        let mut position = 0u32;
        let lane = select(lanes == 1u32, 0u32, UNIT_POS);
        let width = width_for(select(is_listed(word), faces.count, 0u32));
        let points = select(lanes == 1u32, 1u32, LANES / width);
        if is_listed(word) && lane % width < faces.count {
            position = list_face(assets, d.shape_b, faces, lane % width);
        }
        let own = face(
            &assets.rows,
            (entry(assets, d.shape_b, RECORDS) + position * comptime!(ROWS as u32)) as usize,
        );
        let ball = ball_around(surface, weights, item, n);
        // Where the iteration is, in weights, from the centre on; and what the field gains there along both edges of the face.
        let mut at_s = ball.s;
        let mut at_t = ball.t;
        let mut down_s = 0.0f32;
        let mut down_t = 0.0f32;
        // The same at the vertices, each with the threads that had it.
        let mut downs = Array::<f32>::new(comptime!(2 * POLYGON_VERTICES));
        // The best point so far. What only its contact needs is not held in registers, of which a thread has too few.
        let mut best_s = ball.s;
        let mut best_t = ball.t;
        let mut best = FAR.runtime();
        let held = select(lanes == 1u32, UNIT_POS, 0u32) as usize;
        // One place evaluates the field, as the code of it is long: the centre, the vertices, then the steps.
        let evaluations = select(n > 1u32, 1u32 + n + iterations, 1u32);
        let mut evaluation = 0u32;
        let mut made = 0u32;
        let mut made_points = 0u32;
        while evaluation < evaluations {
            let mut s = at_s;
            let mut t = at_t;
            let is_step = evaluation > n;
            let is_vertex = evaluation >= 1u32 && !is_step;
            let mut is_known = false;
            let mut ends = false;
            let mut vertex = 0u32;
            if is_vertex {
                vertex = (evaluation - 1u32 + lane / width).min(n - 1u32);
                s = weight(weights, item, vertex, 0usize);
                t = weight(weights, item, vertex, 1usize);
            }
            if is_step {
                // Down the gradient, in weights: the height of a corner over the first one.
                let mut lowest = FAR.runtime();
                let mut to = 0u32;
                let mut to_s = 0.0f32;
                let mut to_t = 0.0f32;
                let mut i = 0u32;
                while i < n {
                    let vs = weight(weights, item, i, 0usize);
                    let vt = weight(weights, item, i, 1usize);
                    let height = down_s * vs + down_t * vt;
                    let lower = height < lowest;
                    lowest = select(lower, height, lowest);
                    to = select(lower, i, to);
                    to_s = select(lower, vs, to_s);
                    to_t = select(lower, vt, to_t);
                    i += 1u32;
                }
                let step = 2.0f32 / ((evaluation - n - 1u32) as f32 + 2.0f32);
                s = at_s + step * (to_s - at_s);
                t = at_t + step * (to_t - at_t);
                // At a vertex that is the target itself every further step stays there: most minima are such.
                ends = to_s == at_s && to_t == at_t;
                is_known = ends;
                // The first step goes all the way to a vertex, where the field is known.
                if evaluation == n + 1u32 {
                    is_known = true;
                    at_s = to_s;
                    at_t = to_t;
                    let at = (2u32 * (to / points)) as usize;
                    let from = to % points * width;
                    down_s = of_lane(downs[at], from, &mut squares, lanes, planes);
                    down_t = of_lane(downs[at + 1usize], from, &mut squares, lanes, planes);
                }
            }
            if !is_known {
                made += 1u32;
                made_points += select(is_vertex, points.min(n + 1u32 - evaluation), 1u32);
                let p = at_weights(surface, s, t);
                let here = value_in(
                    assets,
                    d,
                    word,
                    faces,
                    own,
                    position,
                    width,
                    p,
                    &mut squares,
                    &mut ids,
                    lanes,
                    planes,
                );
                let mut here_s = dot(here.gradient, minus(surface.b, surface.a));
                let mut here_t = dot(here.gradient, minus(surface.c, surface.a));
                let mut distance = here.distance;
                let mut from = 0u32;
                if is_vertex {
                    let at = (2u32 * ((evaluation - 1u32) / points)) as usize;
                    downs[at] = here_s;
                    downs[at + 1usize] = here_t;
                    if points > 1u32 {
                        // Of the vertices of this turn the lowest.
                        let mine = Nearest { squared: distance, face: vertex };
                        let first = least(mine, LANES, &mut squares, &mut ids, lanes, planes);
                        distance = first.squared;
                        from = ((first.face - (evaluation - 1u32)) * width).min(comptime!(LANES - 1));
                        s = of_lane(s, from, &mut squares, lanes, planes);
                        t = of_lane(t, from, &mut squares, lanes, planes);
                        here_s = of_lane(here_s, from, &mut squares, lanes, planes);
                        here_t = of_lane(here_t, from, &mut squares, lanes, planes);
                    }
                }
                let lower = distance < best;
                if lower && lane == from {
                    best_rows[2usize * held] =
                        four(here.gradient.x, here.gradient.y, here.gradient.z, 0.0f32);
                    best_rows[2usize * held + 1usize] =
                        four(here.point.x, here.point.y, here.point.z, 0.0f32);
                    best_words[2usize * held] = here.face;
                    best_words[2usize * held + 1usize] = here.feature;
                }
                best_s = select(lower, s, best_s);
                best_t = select(lower, t, best_t);
                best = select(lower, distance, best);
                // The start is the best of centre and vertices.
                let moves = is_step || lower;
                at_s = select(moves, s, at_s);
                at_t = select(moves, t, at_t);
                down_s = select(moves, here_s, down_s);
                down_t = select(moves, here_t, down_t);
                // From the centre: can any point be within reach?
                ends = evaluation == 0u32 && distance - ball.distance > reach + ROUNDING;
            }
            let next = select(is_vertex, (evaluation + points).min(n + 1u32), evaluation + 1u32);
            evaluation = select(ends, evaluations, next);
        }
        if lanes > 1u32 {
            // The thread that writes the contact need not be the one that found it.
            sync_cube();
        }
        if counting && lane == 0u32 {
            counters[products::EVALUATIONS as usize].fetch_add(made);
            if is_listed(word) && entry(assets, d.shape_b, KIND) == MESH {
                counters[products::DISTANCES as usize].fetch_add(made_points * faces.count);
            }
        }
        if best <= reach && lane == 0u32 {
            let gradient = best_rows[2usize * held];
            let point = best_rows[2usize * held + 1usize];
            let v = Value {
                distance: best,
                gradient: v3(gradient.extract(0usize), gradient.extract(1usize), gradient.extract(2usize)),
                point: v3(point.extract(0usize), point.extract(1usize), point.extract(2usize)),
                face: best_words[2usize * held],
                feature: best_words[2usize * held + 1usize],
            };
            let is_face = surface.count == 3u32;
            if is_face && dot(v.gradient, normal(assets, d, face_a)) > -cos_theta {
                counters[products::FILTERED as usize].fetch_add(1u32);
            } else {
                let point = at_weights(surface, best_s, best_t);
                write(counters, words, rows, most, d, face_a, named(word, cell), 0u32, 1u32, point, v);
            }
        }
        tell_if_broken_off(counters, select(count > 0u32, 2u32, 0u32));
    }
}
