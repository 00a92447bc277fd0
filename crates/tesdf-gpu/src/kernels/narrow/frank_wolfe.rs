//! Face-TES (Eq. 9): finds the least signed distance over a clipped polygon, and applies the cosine
//! filter (Eq. 10).
//!
//! The search is Frank–Wolfe, as in `tesdf`. It starts at the best of the center and the vertices,
//! and makes steps of 2 / (k + 2) towards the vertex that is lowest along the gradient. The result
//! is the best point seen.
//!
//! Mirrors `collide/narrow/frank_wolfe.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::counters::{self, Counters};
use crate::kernels::detect::candidates::{MAX_VERTICES, Polygons, Weights};
use crate::kernels::detect::ordered_pair::OrderedPairs;
use crate::kernels::geometry::polygon_distance::Polygon;
use crate::kernels::geometry::triangle::Face;
use crate::kernels::geometry::vector::{Row, V3, row_of, xyz};
use crate::kernels::narrow::exchange::{Exchange, LANES, Variant, exchange, width_for};
use crate::kernels::pairs::meshlets::ROUNDING;
use crate::kernels::query::list::List;
use crate::kernels::query::locate::Cell;
use crate::kernels::query::nearest::{FAR, Nearest, any_face};
use crate::kernels::query::value::Value;
use crate::kernels::report::contact::{Contacts, NO_CORNER, Touch};
use crate::kernels::scene::shape::{Field, Shapes};

/// Parameters of Face-TES.
#[derive(CubeType, CubeLaunch)]
pub struct Asked {
    /// Largest number of steps of Frank–Wolfe.
    pub iterations: u32,
    /// A contact is dropped when the cosine between its gradient and the face's normal is above
    /// minus this number.
    pub cos_theta: f32,
}

/// The list of a cell, shared by the threads of a group.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct SharedList {
    cell: Cell,
    faces: List,
    /// The face that this thread keeps in registers, and its index. A thread beyond the end of the
    /// list has no face of its own.
    own: Face,
    position: u32,
    /// Number of threads that share a point.
    width: u32,
    /// Number of points that the group evaluates at the same time.
    points: u32,
}

/// The number of a thread among those that share a polygon.
#[cube]
fn lane_of(#[comptime] lanes: u32) -> u32 {
    select(lanes == 1u32, 0u32, UNIT_POS)
}

#[cube]
fn share_list(field: Field<'_>, cell: Cell, #[comptime] variant: Variant) -> SharedList {
    let lanes = comptime!(variant.lanes);
    let listed = cell.is_listed();
    let faces = field.list(select(listed, cell.offset(), 0u32));
    let shared = width_for(select(listed, faces.count, 0u32));
    let lane = lane_of(lanes);
    let mut position = 0u32;
    if listed && lane % shared < faces.count {
        position = field.listed(faces, lane % shared);
    }
    SharedList {
        cell,
        faces,
        own: field.face(position),
        position,
        width: shared,
        points: select(lanes == 1u32, 1u32, LANES / shared),
    }
}

#[cube]
impl SharedList {
    /// The field at a point of the cell. `width` threads evaluate it together, and each such part
    /// of the group may have its own point.
    fn value(self, field: Field<'_>, p: V3, exchange: &mut Exchange) -> Value {
        let lanes = comptime!(exchange.variant.lanes);
        let cell = self.cell;
        let mut found = any_face();
        if self.is_shared(field) {
            let first = select(lanes == 1u32, 0u32, UNIT_POS % self.width);
            if first < self.faces.count {
                found = Nearest { squared: self.own.distance_squared(p), face: self.position };
            }
            found = found.or(field.nearest_in_list(self.faces, first + lanes, lanes, p));
            found = exchange.least(found, self.width);
        } else {
            found = field.nearest(cell, p);
        }
        field.value_near(cell, p, found)
    }

    /// Whether the threads share a list.
    fn is_shared(self, field: Field<'_>) -> bool {
        field.is_mesh() && self.cell.is_listed()
    }
}

/// The derivatives of the field along the two edges of a face that its weights follow.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Slope {
    s: f32,
    t: f32,
}

/// A point of the iteration.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Iterate {
    at: Weights,
    slope: Slope,
}

/// The state of a search. It evaluates the center, then the vertices, then the steps. One loop does
/// all of this, so that the long code of the field stands in the kernel once.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Search {
    /// Number of the next evaluation, and the number at which the search ends.
    evaluation: u32,
    end: u32,
    /// Number of vertices.
    n: u32,
    here: Iterate,
    /// The best point so far, and its distance.
    best: Weights,
    distance: f32,
    /// Evaluations by the group so far, and distances of points and faces in them.
    made: u32,
    distances: u32,
}

/// The next evaluation.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Next {
    at: Weights,
    /// The vertex that this thread evaluates; valid when `is_vertex` is true.
    vertex: u32,
    is_vertex: bool,
    is_step: bool,
    /// Whether the field is known at this point.
    is_known: bool,
    /// Whether the search ends.
    ends: bool,
}

#[cube]
impl Search {
    fn next(&self, list: SharedList, polygon: Polygon<'_>, lane: u32) -> Next {
        let is_step = self.evaluation > self.n;
        let is_vertex = self.evaluation >= 1u32 && !is_step;
        let mut next =
            Next { at: self.here.at, vertex: 0u32, is_vertex, is_step, is_known: false, ends: false };
        if is_vertex {
            next.vertex = (self.evaluation - 1u32 + lane / list.width).min(self.n - 1u32);
            next.at = polygon.vertex(next.vertex);
        }
        next
    }

    /// The vertex that is lowest along the gradient. Heights are relative to the first corner of
    /// the face.
    fn lowest(&self, polygon: Polygon<'_>) -> Target {
        let mut lowest = FAR.runtime();
        let mut to = Target { vertex: 0u32, at: Weights { s: 0.0f32, t: 0.0f32 } };
        let mut i = 0u32;
        while i < self.n {
            let v = polygon.vertex(i);
            let height = self.here.slope.s * v.s + self.here.slope.t * v.t;
            let lower = height < lowest;
            lowest = select(lower, height, lowest);
            to = Target {
                vertex: select(lower, i, to.vertex),
                at: Weights { s: select(lower, v.s, to.at.s), t: select(lower, v.t, to.at.t) },
            };
            i += 1u32;
        }
        to
    }

    /// A step towards a vertex.
    fn step(&self, next: &mut Next, to: Target) {
        let at = self.here.at;
        let step = 2.0f32 / ((self.evaluation - self.n - 1u32) as f32 + 2.0f32);
        next.at = Weights { s: at.s + step * (to.at.s - at.s), t: at.t + step * (to.at.t - at.t) };
        // When the current vertex is the target itself, all further steps stay there. Most minima
        // are of this kind.
        next.ends = to.at.s == at.s && to.at.t == at.t;
        next.is_known = next.ends;
    }

    /// Counts the evaluations, when the variant does.
    fn count(&self, counters: &Counters, #[comptime] variant: Variant) {
        let counting = comptime!(variant.counting);
        if counting && lane_of(comptime!(variant.lanes)) == 0u32 {
            counters.add(counters::EVALUATIONS, self.made);
            counters.add(counters::DISTANCES, self.distances);
        }
    }

    fn is_first_step(&self) -> bool {
        self.evaluation == self.n + 1u32
    }

    /// Takes the result of an evaluation.
    fn take(&mut self, next: Next, distance: f32, found: Iterate) {
        let lower = distance < self.distance;
        self.best =
            Weights { s: select(lower, found.at.s, self.best.s), t: select(lower, found.at.t, self.best.t) };
        self.distance = select(lower, distance, self.distance);
        // The steps start at the best of the center and the vertices.
        let moves = next.is_step || lower;
        let here = self.here;
        self.here = Iterate {
            at: Weights { s: select(moves, found.at.s, here.at.s), t: select(moves, found.at.t, here.at.t) },
            slope: Slope {
                s: select(moves, found.slope.s, here.slope.s),
                t: select(moves, found.slope.t, here.slope.t),
            },
        };
    }

    /// Goes to the next evaluation.
    fn on(&mut self, next: Next, points: u32) {
        let after_vertices = (self.evaluation + points).min(self.n + 1u32);
        let following = select(next.is_vertex, after_vertices, self.evaluation + 1u32);
        self.evaluation = select(next.ends, self.end, following);
    }
}

/// A vertex of a polygon.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Target {
    vertex: u32,
    at: Weights,
}

/// The field at the best point. Only the contact needs it, so it waits in shared memory and takes
/// no registers.
#[derive(CubeType)]
struct Best {
    rows: Shared<[Row]>,
    words: Shared<[u32]>,
}

#[cube]
impl Best {
    fn put(&mut self, at: u32, v: Value) {
        let at = (2u32 * at) as usize;
        self.rows[at] = row_of(v.gradient, 0.0f32);
        self.rows[at + 1usize] = row_of(v.point, 0.0f32);
        self.words[at] = v.face;
        self.words[at + 1usize] = v.feature;
    }

    fn get(&self, at: u32, distance: f32) -> Value {
        let at = (2u32 * at) as usize;
        Value {
            distance,
            gradient: xyz(self.rows[at]),
            point: xyz(self.rows[at + 1usize]),
            face: self.words[at],
            feature: self.words[at + 1usize],
        }
    }
}

/// The slopes of the field at the vertices. Each thread stores the slopes at the vertices that it
/// has evaluated.
#[derive(CubeType)]
struct Slopes {
    numbers: Array<f32>,
}

#[cube]
impl Slopes {
    fn put(&mut self, turn: u32, slope: Slope) {
        let at = (2u32 * turn) as usize;
        self.numbers[at] = slope.s;
        self.numbers[at + 1usize] = slope.t;
    }

    /// The slope at a vertex, from the thread that has evaluated it.
    fn get(&self, vertex: u32, list: SharedList, exchange: &mut Exchange) -> Slope {
        let at = (2u32 * (vertex / list.points)) as usize;
        let from = vertex % list.points * list.width;
        Slope {
            s: exchange.of_lane(self.numbers[at], from),
            t: exchange.of_lane(self.numbers[at + 1usize], from),
        }
    }
}

/// An evaluation, and the thread that has its value.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Found {
    distance: f32,
    iterate: Iterate,
    lane: u32,
}

/// The lowest of the vertices that the group has just evaluated.
#[cube]
fn lowest_of(mine: Found, search: Search, vertex: u32, list: SharedList, exchange: &mut Exchange) -> Found {
    let first = exchange.least(Nearest { squared: mine.distance, face: vertex }, LANES.runtime());
    let lane = ((first.face - (search.evaluation - 1u32)) * list.width).min(comptime!(LANES - 1));
    Found {
        distance: first.squared,
        iterate: Iterate {
            at: Weights {
                s: exchange.of_lane(mine.iterate.at.s, lane),
                t: exchange.of_lane(mine.iterate.at.t, lane),
            },
            slope: Slope {
                s: exchange.of_lane(mine.iterate.slope.s, lane),
                t: exchange.of_lane(mine.iterate.slope.t, lane),
            },
        },
        lane,
    }
}

/// Minimizes the field over a polygon. `best` gets the field at the best point.
#[cube]
fn minimize(
    field: Field<'_>,
    list: SharedList,
    polygon: Polygon<'_>,
    reach: f32,
    iterations: u32,
    exchange: &mut Exchange,
    best: &mut Best,
) -> Search {
    let lanes = comptime!(exchange.variant.lanes);
    let lane = lane_of(lanes);
    let held = select(lanes == 1u32, UNIT_POS, 0u32);
    let part = polygon.part;
    let n = polygon.count;
    let ball = polygon.ball();
    let mut slopes = Slopes { numbers: Array::<f32>::new(comptime!(2 * MAX_VERTICES)) };
    let mut search = Search {
        evaluation: 0u32,
        end: select(n > 1u32, 1u32 + n + iterations, 1u32),
        n,
        here: Iterate { at: ball.center, slope: Slope { s: 0.0f32, t: 0.0f32 } },
        best: ball.center,
        distance: FAR.runtime(),
        made: 0u32,
        distances: 0u32,
    };
    while search.evaluation < search.end {
        let mut next = search.next(list, polygon, lane);
        if next.is_step {
            let to = search.lowest(polygon);
            search.step(&mut next, to);
            if search.is_first_step() {
                // The first step ends at a vertex, where the field is known.
                next.is_known = true;
                search.here = Iterate { at: to.at, slope: slopes.get(to.vertex, list, exchange) };
            }
        }
        if !next.is_known {
            search.made += 1u32;
            let vertices = list.points.min(n + 1u32 - search.evaluation);
            let here = list.value(field, part.at(next.at.s, next.at.t), exchange);
            let faces = select(list.is_shared(field), list.faces.count, 0u32);
            search.distances += select(next.is_vertex, vertices, 1u32) * faces;
            let slope =
                Slope { s: here.gradient.dot(part.b - part.a), t: here.gradient.dot(part.c - part.a) };
            let iterate = Iterate { at: next.at, slope };
            let mut found = Found { distance: here.distance, iterate, lane: 0u32 };
            if next.is_vertex {
                slopes.put((search.evaluation - 1u32) / list.points, slope);
                if list.points > 1u32 {
                    found = lowest_of(found, search, next.vertex, list, exchange);
                }
            }
            if comptime!(lanes > 1) {
                // Another thread may have written the last one.
                sync_cube();
            }
            if found.distance < search.distance && lane == found.lane {
                best.put(held, here);
            }
            search.take(next, found.distance, found.iterate);
            // The center shows whether any point of the polygon can be within reach.
            next.ends = search.evaluation == 0u32 && found.distance - ball.radius > reach + ROUNDING;
        }
        search.on(next, list.points);
    }
    search
}

#[cube]
fn no_best(#[comptime] variant: Variant) -> Best {
    let held = comptime!(2 * (LANES / variant.lanes) as usize);
    Best { rows: Shared::<[Row]>::new_slice(held), words: Shared::<[u32]>::new_slice(held) }
}

/// Finds the contact of each polygon by Face-TES. With 32 lanes, a group takes a polygon. Each
/// thread keeps a face of the list in registers, and reads every 32nd of the other faces. With a
/// list of at most 16 faces, the group evaluates several vertices at the same time. With one lane,
/// a thread takes a polygon.
#[cube(launch, create_dummy_kernel)]
pub fn narrow_faces(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    polygons: &Polygons,
    counters: &Counters,
    contacts: &mut Contacts,
    asked: &Asked,
    #[comptime] variant: Variant,
) {
    let lanes = comptime!(variant.lanes);
    let mut exchange = exchange(variant);
    let mut best = no_best(variant);
    let number = select(lanes == 1u32, ABSOLUTE_POS as u32, CUBE_POS as u32);
    let count = counters.within(counters::POLYGONS, polygons.items.room);
    if number < count {
        let item = polygons.items.get(number);
        let pair = pairs.get(item.pair);
        let part = shapes.part(pair, item.face);
        let field = shapes.field(pair.shape_b);
        let cell = field.cell(item.cell);
        let list = share_list(field, cell, variant);
        let polygon = polygons.polygon(number, part);
        let reach = pairs.reach_of(pair, part);
        let search = minimize(field, list, polygon, reach, asked.iterations, &mut exchange, &mut best);
        if comptime!(lanes > 1) {
            // Another thread than the one that writes the contact may have found it.
            sync_cube();
        }
        let lane = lane_of(lanes);
        search.count(counters, variant);
        if search.distance <= reach && lane == 0u32 {
            let v = best.get(select(lanes == 1u32, UNIT_POS, 0u32), search.distance);
            let point = part.at(search.best.s, search.best.t);
            let cosine = v.gradient.dot(shapes.part_normal(pair, item.face));
            if pair.is_filtered(cosine, asked.cos_theta) {
                counters.append(counters::FILTERED);
            } else {
                // Nothing proves that no point is lower.
                let corner = NO_CORNER.runtime();
                contacts.append(
                    counters,
                    pair,
                    Touch { face: item.face, cell: cell.name(), corner, point, cosine },
                    v,
                );
            }
        }
        counters.tell_if_broken_off(count);
    }
}
