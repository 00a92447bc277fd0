//! The exact mode: the least signed distance over a polygon to a tolerance.
//!
//! Outside of the solid it is the least distance between the polygon and a face of the list, in closed form, a face to each thread. Inside it is
//! found by branch and bound, a piece of the polygon to each thread: the distance to one face is convex, so over a triangle it is at most
//! what the linear function through its corners says, and the field is at least minus the greatest minimum of those of some faces.
use cubecl::prelude::*;

use super::assets::{Assets, KIND, MESH, RECORDS, entry};
use super::broad::ROUNDING;
use super::field::{is_listed, value_in_cell};
use super::greatest_minimum::greatest_minimum;
use super::list::{list, list_face};
use super::locate::{is_crossing, is_inside, offset};
use super::narrow::{LANES, named, word_of, write};
use super::nearest::FAR;
use super::polygon_distance::{ball_around, polygon_to_face, weight};
use super::products::{self, POLYGON_WORDS, tell_if_broken_off};
use super::surface::{Direction, Part, at_weights, direction, normal, part};
use super::triangle::{ROWS, distance_squared, face};
use super::vector::{V3, dot, length, minus, plus, scaled, v3};

/// Pieces that wait.
const POOL: u32 = 128;
/// Rounds after which a search gives up; up to 32 pieces are cut in each.
const ROUNDS: u32 = 96;
/// Closer to the surface than this a polygon may cross it.
const CLEAR: f32 = 1e-6;

/// The lowest value over the group, and where; of equal ones that of the lowest thread. All threads call it.
#[cube]
fn lowest(mine: f32, s: f32, t: f32, shared: &mut Shared<[f32]>) -> V3 {
    sync_cube();
    shared[(3u32 * UNIT_POS) as usize] = mine;
    shared[(3u32 * UNIT_POS + 1u32) as usize] = s;
    shared[(3u32 * UNIT_POS + 2u32) as usize] = t;
    sync_cube();
    let mut value = shared[0];
    let mut at_s = shared[1];
    let mut at_t = shared[2];
    let mut lane = 1u32;
    while lane < LANES {
        let other = shared[(3u32 * lane) as usize];
        let lower = other < value;
        value = select(lower, other, value);
        at_s = select(lower, shared[(3u32 * lane + 1u32) as usize], at_s);
        at_t = select(lower, shared[(3u32 * lane + 2u32) as usize], at_t);
        lane += 1u32;
    }
    v3(value, at_s, at_t)
}

/// Distances from three corners to a face.
#[cube]
fn distances(assets: &Assets, shape: u32, position: u32, a: V3, b: V3, c: V3) -> V3 {
    let at = (entry(assets, shape, RECORDS) + position * comptime!(ROWS as u32)) as usize;
    let f = face(&assets.rows, at);
    v3(distance_squared(f, a).sqrt(), distance_squared(f, b).sqrt(), distance_squared(f, c).sqrt())
}

/// A piece of the polygon: where its middle is, the value there, and the bound.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Bound {
    value: f32,
    bound: f32,
}

/// No point of the piece has a lower signed distance than its bound.
#[cube]
fn bound_of(
    assets: &Assets,
    d: Direction,
    word: u32,
    a: V3,
    b: V3,
    c: V3,
    fa: u32,
    fb: u32,
    fc: u32,
) -> Bound {
    let middle = scaled(0.33333334f32, plus(plus(a, b), c));
    let radius = length(minus(a, middle)).max(length(minus(b, middle))).max(length(minus(c, middle)));
    let here = value_in_cell(assets, d.shape_b, word, middle);
    let mut bound = here.distance - radius;
    if entry(assets, d.shape_b, KIND) == MESH && here.distance - radius < 0.0f32 {
        let shape = d.shape_b;
        let near = distances(assets, shape, here.face, a, b, c);
        let of_a = distances(assets, shape, fa, a, b, c);
        let of_b = distances(assets, shape, fb, a, b, c);
        let of_c = distances(assets, shape, fc, a, b, c);
        bound = bound.max(-greatest_minimum(near, of_a, of_b, of_c));
    }
    Bound { value: here.distance, bound }
}

#[cube]
fn put(
    pool: &mut Shared<[f32]>,
    faces: &mut Shared<[u32]>,
    at: u32,
    sa: f32,
    ta: f32,
    sb: f32,
    tb: f32,
    sc: f32,
    tc: f32,
    bound: f32,
    fa: u32,
    fb: u32,
    fc: u32,
) {
    let first = (7u32 * at) as usize;
    pool[first] = sa;
    pool[first + 1usize] = ta;
    pool[first + 2usize] = sb;
    pool[first + 3usize] = tb;
    pool[first + 4usize] = sc;
    pool[first + 5usize] = tc;
    pool[first + 6usize] = bound;
    let first = (3u32 * at) as usize;
    faces[first] = fa;
    faces[first + 1usize] = fb;
    faces[first + 2usize] = fc;
}

/// How many pieces the threads before this one keep, and all of them. All threads call it.
#[cube]
fn before(kept: u32, shared: &mut Shared<[u32]>) -> (u32, u32) {
    sync_cube();
    shared[UNIT_POS as usize] = kept;
    sync_cube();
    let mut mine = 0u32;
    let mut all = 0u32;
    let mut lane = 0u32;
    while lane < LANES {
        mine += select(lane < UNIT_POS, shared[lane as usize], 0u32);
        all += shared[lane as usize];
        lane += 1u32;
    }
    (mine, all)
}

/// A group for each polygon.
#[cube(launch, create_dummy_kernel)]
pub fn narrow_exact(
    assets: &Assets,
    directions: &[u32],
    maps: &[Vector<f32, Const<4>>],
    items: &[u32],
    weights: &[Vector<f32, Const<4>>],
    counters: &[Atomic<u32>],
    words: &mut [u32],
    rows: &mut [Vector<f32, Const<4>>],
    tolerances: &[f32],
    cos_theta: f32,
    most_items: u32,
    most: u32,
) {
    let mut exchange = Shared::<[f32]>::new_slice(comptime!(3 * LANES as usize));
    let mut kept_by = Shared::<[u32]>::new_slice(comptime!(LANES as usize));
    let mut pool = Shared::<[f32]>::new_slice(comptime!(7 * POOL as usize));
    let mut pool_faces = Shared::<[u32]>::new_slice(comptime!(3 * POOL as usize));
    let item = CUBE_POS as u32;
    let count = counters[products::POLYGONS as usize].load().min(most_items);
    if item < count {
        let first = (item * comptime!(POLYGON_WORDS as u32)) as usize;
        let d: Direction = direction(directions, maps, items[first]);
        let face_a = items[first + 1usize];
        let cell = items[first + 2usize];
        let n = items[first + 3usize];
        let surface: Part = part(assets, d, face_a);
        let up = normal(assets, d, face_a);
        let reach = d.reach + d.radius;
        let tolerance = tolerances[d.b as usize];
        let word = word_of(assets, d.shape_b, cell);
        let is_mesh = entry(assets, d.shape_b, KIND) == MESH;
        let ball = ball_around(surface, weights, item, n);
        let (center_s, center_t, radius) = (ball.s, ball.t, ball.distance);
        let mut i = 0u32;
        let center = at_weights(surface, center_s, center_t);
        let at_center = value_in_cell(assets, d.shape_b, word, center);
        let crossing = is_crossing(word);
        let all_inside = is_inside(word) || (crossing && at_center.distance < -radius - ROUNDING);
        let within = at_center.distance - radius <= reach + ROUNDING;
        let mut best = at_center.distance;
        let mut best_s = center_s;
        let mut best_t = center_t;
        let mut converged = true;
        let mut search = within && !(is_mesh && is_listed(word) && !all_inside);
        if within && is_mesh && is_listed(word) && !all_inside {
            let faces = list(assets, d.shape_b, offset(word));
            let mut mine = FAR.runtime();
            let mut s = center_s;
            let mut t = center_t;
            i = UNIT_POS;
            while i < faces.count {
                let position = list_face(assets, d.shape_b, faces, i);
                let at = (entry(assets, d.shape_b, RECORDS) + position * comptime!(ROWS as u32)) as usize;
                let apart =
                    polygon_to_face(surface, weights, item, n, up, center, radius, face(&assets.rows, at));
                let lower = apart.distance < mine;
                mine = select(lower, apart.distance, mine);
                s = select(lower, apart.s, s);
                t = select(lower, apart.t, t);
                i += LANES;
            }
            let nearest_point = lowest(mine, s, t, &mut exchange);
            best_s = nearest_point.y;
            best_t = nearest_point.z;
            best = value_in_cell(assets, d.shape_b, word, at_weights(surface, best_s, best_t)).distance;
            // It may cross the surface, or be all inside.
            search = crossing && (nearest_point.x <= CLEAR || best < 0.0f32);
        }
        if search {
            // A fan of triangles, one to each thread; what has no area is a triangle with equal corners.
            let triangles = select(n > 2u32, n - 2u32, 1u32);
            let mut value = FAR.runtime();
            let mut s = center_s;
            let mut t = center_t;
            let mut bound = FAR.runtime();
            let mut sa = 0.0f32;
            let mut ta = 0.0f32;
            let mut sb = 0.0f32;
            let mut tb = 0.0f32;
            let mut sc = 0.0f32;
            let mut tc = 0.0f32;
            let mut fa = 0u32;
            let mut fb = 0u32;
            let mut fc = 0u32;
            if UNIT_POS < triangles {
                let second = (UNIT_POS + 1u32).min(n - 1u32);
                let third = (UNIT_POS + 2u32).min(n - 1u32);
                sa = weight(weights, item, 0u32, 0usize);
                ta = weight(weights, item, 0u32, 1usize);
                sb = weight(weights, item, second, 0usize);
                tb = weight(weights, item, second, 1usize);
                sc = weight(weights, item, third, 0usize);
                tc = weight(weights, item, third, 1usize);
                let mut k = 0u32;
                while k < 3u32 {
                    let ws = select(k == 0u32, sa, select(k == 1u32, sb, sc));
                    let wt = select(k == 0u32, ta, select(k == 1u32, tb, tc));
                    let v = value_in_cell(assets, d.shape_b, word, at_weights(surface, ws, wt));
                    fa = select(k == 0u32, v.face, fa);
                    fb = select(k == 1u32, v.face, fb);
                    fc = select(k == 2u32, v.face, fc);
                    let lower = v.distance < value;
                    value = select(lower, v.distance, value);
                    s = select(lower, ws, s);
                    t = select(lower, wt, t);
                    k += 1u32;
                }
                let b = bound_of(
                    assets,
                    d,
                    word,
                    at_weights(surface, sa, ta),
                    at_weights(surface, sb, tb),
                    at_weights(surface, sc, tc),
                    fa,
                    fb,
                    fc,
                );
                bound = b.bound;
                let lower = b.value < value;
                value = select(lower, b.value, value);
                s = select(lower, 0.33333334f32 * (sa + sb + sc), s);
                t = select(lower, 0.33333334f32 * (ta + tb + tc), t);
                put(&mut pool, &mut pool_faces, UNIT_POS, sa, ta, sb, tb, sc, tc, bound, fa, fb, fc);
            }
            let found = lowest(value, s, t, &mut exchange);
            if found.x < best {
                best = found.x;
                best_s = found.y;
                best_t = found.z;
            }
            let mut waiting = triangles;
            let mut round = 0u32;
            while waiting > 0u32 && round < ROUNDS {
                sync_cube();
                // The youngest pieces, as many as their halves have room.
                let taken = waiting.min(LANES).min(POOL - waiting).max(1u32);
                let base = waiting - taken;
                let mut kept = 0u32;
                let mut first_kept = false;
                let mut second_kept = false;
                let mut first_bound = 0.0f32;
                let mut second_bound = 0.0f32;
                let mut sm = 0.0f32;
                let mut tm = 0.0f32;
                let mut fm = 0u32;
                value = FAR.runtime();
                s = best_s;
                t = best_t;
                if UNIT_POS < taken {
                    let at = base + UNIT_POS;
                    let from = (7u32 * at) as usize;
                    let own = pool[from + 6usize];
                    if own < best - tolerance && own <= reach {
                        let ids = (3u32 * at) as usize;
                        let (qsa, qta) = (pool[from], pool[from + 1usize]);
                        let (qsb, qtb) = (pool[from + 2usize], pool[from + 3usize]);
                        let (qsc, qtc) = (pool[from + 4usize], pool[from + 5usize]);
                        let (qfa, qfb, qfc) =
                            (pool_faces[ids], pool_faces[ids + 1usize], pool_faces[ids + 2usize]);
                        let pa = at_weights(surface, qsa, qta);
                        let pb = at_weights(surface, qsb, qtb);
                        let pc = at_weights(surface, qsc, qtc);
                        let ab = length(minus(pa, pb));
                        let bc = length(minus(pb, pc));
                        let ca = length(minus(pc, pa));
                        // The longest edge is from a to b.
                        let is_ab = ab >= bc && ab >= ca;
                        let is_bc = !is_ab && bc >= ca;
                        sa = select(is_ab, qsa, select(is_bc, qsb, qsc));
                        ta = select(is_ab, qta, select(is_bc, qtb, qtc));
                        fa = select(is_ab, qfa, select(is_bc, qfb, qfc));
                        sb = select(is_ab, qsb, select(is_bc, qsc, qsa));
                        tb = select(is_ab, qtb, select(is_bc, qtc, qta));
                        fb = select(is_ab, qfb, select(is_bc, qfc, qfa));
                        sc = select(is_ab, qsc, select(is_bc, qsa, qsb));
                        tc = select(is_ab, qtc, select(is_bc, qta, qtb));
                        fc = select(is_ab, qfc, select(is_bc, qfa, qfb));
                        sm = 0.5f32 * (sa + sb);
                        tm = 0.5f32 * (ta + tb);
                        let m = at_weights(surface, sm, tm);
                        let at_m = value_in_cell(assets, d.shape_b, word, m);
                        fm = at_m.face;
                        value = at_m.distance;
                        s = sm;
                        t = tm;
                        let mut half = 0u32;
                        while half < 2u32 {
                            let is_first = half == 0u32;
                            let ws = select(is_first, sa, sb);
                            let wt = select(is_first, ta, tb);
                            let wf = select(is_first, fa, fb);
                            let b = bound_of(
                                assets,
                                d,
                                word,
                                at_weights(surface, ws, wt),
                                m,
                                at_weights(surface, sc, tc),
                                wf,
                                fm,
                                fc,
                            );
                            let lower = b.value < value;
                            value = select(lower, b.value, value);
                            s = select(lower, 0.33333334f32 * (ws + sm + sc), s);
                            t = select(lower, 0.33333334f32 * (wt + tm + tc), t);
                            let open = b.bound < best - tolerance && b.bound <= reach;
                            first_kept = select(is_first, open, first_kept);
                            second_kept = select(is_first, second_kept, open);
                            first_bound = select(is_first, b.bound, first_bound);
                            second_bound = select(is_first, second_bound, b.bound);
                            half += 1u32;
                        }
                        kept = select(first_kept, 1u32, 0u32) + select(second_kept, 1u32, 0u32);
                    }
                }
                let (mine, all) = before(kept, &mut kept_by);
                let mut to_place = base + mine;
                if first_kept {
                    put(
                        &mut pool,
                        &mut pool_faces,
                        to_place,
                        sa,
                        ta,
                        sm,
                        tm,
                        sc,
                        tc,
                        first_bound,
                        fa,
                        fm,
                        fc,
                    );
                    to_place += 1u32;
                }
                if second_kept {
                    put(
                        &mut pool,
                        &mut pool_faces,
                        to_place,
                        sb,
                        tb,
                        sm,
                        tm,
                        sc,
                        tc,
                        second_bound,
                        fb,
                        fm,
                        fc,
                    );
                }
                let found = lowest(value, s, t, &mut exchange);
                if found.x < best {
                    best = found.x;
                    best_s = found.y;
                    best_t = found.z;
                }
                waiting = base + all;
                round += 1u32;
                if waiting >= POOL {
                    round = ROUNDS;
                }
            }
            converged = waiting == 0u32;
        }
        if within && best <= reach && UNIT_POS == 0u32 {
            let point = at_weights(surface, best_s, best_t);
            let v = value_in_cell(assets, d.shape_b, word, point);
            if v.distance <= reach {
                if surface.count == 3u32 && dot(v.gradient, up) > -cos_theta {
                    counters[products::FILTERED as usize].fetch_add(1u32);
                } else {
                    write(
                        counters,
                        words,
                        rows,
                        most,
                        d,
                        face_a,
                        named(word, cell),
                        0u32,
                        select(converged, 1u32, 0u32),
                        point,
                        v,
                    );
                }
            }
        }
        tell_if_broken_off(counters, select(count > 0u32, 2u32, 0u32));
    }
}
