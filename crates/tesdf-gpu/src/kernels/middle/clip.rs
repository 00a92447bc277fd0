//! Middle phase: which cells a face meets, and the polygon in each of them.
//!
//! A thread walks the bisection forest, from the roots of the cube or from the tetrahedra of a conforming domain, with
//! the barycentric coordinates of the three corners. It goes down one child and comes back for the other: for that it
//! keeps its path, a bit a level, and the words of the first children. A polygon is kept as weights of the face's
//! corners, in which the coordinates of all cells are linear.
use cubecl::prelude::*;

use super::super::broad::meshlets::Blocks;
use super::super::broad::ordered_pair::OrderedPairs;
use super::super::counters::{self, CANDIDATES, Counters};
use super::super::field::locate::{Cell, is_split};
use super::super::field::shapes::{BAND, Field, NONE, Shapes, TREE_NODES};
use super::super::field::tetrahedra::{Around, around_of};
use super::super::math::vector::v3;
use super::super::narrow::exchange::LANES;
use super::bits::{Bits, LEVELS, no_bits};
use super::corners::{Corners, corners_in};
use super::cut::{Cut, no_polygon, whole};
use super::items::{Polygons, Subject};

/// How the threads of a group share a face.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Share {
    /// This one's number.
    pub mine: u32,
    /// Number of threads: a power of two.
    pub threads: u32,
}

/// How many threads share a face of a meshlet of few faces, which may be large.
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
pub fn clip_polygons(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    meshlets: &Blocks,
    counters: &Counters,
    polygons: &mut Polygons,
    prune: u32,
) {
    let item = CUBE_POS as u32;
    let count = counters.within(counters::MESHLETS, meshlets.room);
    if item < count {
        let pair = pairs.get(meshlets.pair(item));
        let meshlet = meshlets.meshlet(item);
        let surface = shapes.field(pair.shape_a);
        let faces = surface.faces_of(meshlet);
        let threads = threads_per_face(faces);
        let share = Share { mine: UNIT_POS % threads, threads };
        if UNIT_POS / threads < faces {
            let face = surface.first_face(meshlet) + UNIT_POS / threads;
            let subject = Subject { pair, face, part: shapes.part(pair, face) };
            let center = subject.part.center();
            let field = shapes.field(pair.shape_b);
            let radius = subject.part.radius_around(center);
            if !field.is_beyond(center, radius, pair.part_reach(), prune) {
                if share.mine == 0u32 {
                    counters.append(CANDIDATES);
                }
                let mut polygon = no_polygon();
                if field.is_mesh() {
                    clip(field, subject, share, counters, polygons, &mut polygon, prune);
                } else if share.mine == 0u32 {
                    polygon.start(whole(), subject.part.count);
                    polygon.write(polygons, counters, subject, NONE);
                }
            }
        }
        counters.tell_if_broken_off(count);
    }
}

/// A face, and the cells that it may have polygons in.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Search {
    subject: Subject,
    /// Distances up to this are contacts.
    reach: f32,
    /// Whether points beyond the cells of the domain can be contacts.
    beyond: bool,
    /// 1 when cells are left out by their bounds.
    prune: u32,
}

/// Clips a face by all cells that it meets: this thread's share of them.
#[cube]
fn clip(
    field: Field<'_>,
    subject: Subject,
    share: Share,
    counters: &Counters,
    polygons: &mut Polygons,
    polygon: &mut Cut,
    prune: u32,
) {
    let reach = subject.pair.part_reach();
    let conforming = field.is_conforming();
    // Around a conforming domain `outside::outside_polygons` searches.
    let beyond = (conforming && reach > 0.0f32) || (!conforming && reach >= field.number(BAND));
    if beyond && !conforming && share.mine == 0u32 {
        outside_cube(field, subject, counters, polygons, polygon);
    }
    let search = Search { subject, reach, beyond, prune };
    let around = around_of(subject.part.a, subject.part.b, subject.part.c);
    let mut start = start_of(field, share);
    let mut path = no_bits();
    while start.number < start.end {
        let begin = start.next(field, around, share, &mut path);
        if begin.open {
            walk(field, search, begin, &mut path, counters, polygons, polygon);
        }
    }
}

/// Where a thread's walks start: at the six roots, or where several threads share a face at the cells three levels below;
/// in a conforming domain they take turns at the tetrahedra, and the number is a node of the tree that finds those.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Start {
    number: u32,
    end: u32,
    /// Levels below the root.
    levels: u32,
    /// Tetrahedra before this one.
    turn: u32,
}

/// A cell at which a walk starts.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Begin {
    root: u32,
    cell: u32,
    depth: u32,
    /// Whether the cell is this thread's.
    open: bool,
}

#[cube]
fn start_of(field: Field<'_>, share: Share) -> Start {
    let conforming = field.is_conforming();
    let levels = select(share.threads > 1u32 && !conforming, 3u32, 0u32);
    Start {
        number: select(conforming, 0u32, share.mine),
        end: select(conforming, field.entry(TREE_NODES), 6u32 << levels),
        levels,
        turn: 0u32,
    }
}

#[cube]
impl Start {
    /// The next cell at which a walk starts; its path goes to `path`.
    fn next(&mut self, field: Field<'_>, around: Around, share: Share, path: &mut Bits) -> Begin {
        let number = self.number;
        let mut root = number >> self.levels;
        let mut elsewhere = false;
        let mut next = number + share.threads;
        if field.is_conforming() {
            let step = field.visit(number, around);
            next = step.next;
            root = select(step.tetrahedron == NONE, 0u32, step.tetrahedron);
            elsewhere = step.tetrahedron == NONE
                || self.turn % share.threads != share.mine
                || field.tetrahedron(root).is_flat();
            self.turn += select(step.tetrahedron == NONE, 0u32, 1u32);
        }
        let mut depth = 0u32;
        let mut cell = root;
        let mut split = true;
        while depth < self.levels && split {
            let word = field.cell_word(cell);
            split = is_split(word);
            if split {
                let side = (number >> (self.levels - 1u32 - depth)) & 1u32;
                path.set(depth, side == 1u32);
                cell = word + side;
                depth += 1u32;
            }
        }
        // A cell above stands for all cells below it, once.
        let below = (1u32 << (self.levels - depth)) - 1u32;
        let repeated = depth < self.levels && (number & below) != 0u32;
        self.number = next;
        Begin { root, cell, depth, open: !elsewhere && !repeated }
    }
}

/// Walks the cells below one, and writes the polygons of a face in them.
#[cube]
fn walk(
    field: Field<'_>,
    search: Search,
    begin: Begin,
    path: &mut Bits,
    counters: &Counters,
    polygons: &mut Polygons,
    polygon: &mut Cut,
) {
    let part = search.subject.part;
    let root = corners_in(field.tetrahedron(begin.root), part);
    let mut held = path.follow(root, begin.depth);
    // The first child at each level, and whether its sibling is still to be visited.
    let mut children = Array::<u32>::new(LEVELS);
    let mut waiting = no_bits();
    waiting.clear();
    let mut cell = begin.cell;
    let mut depth = begin.depth;
    let mut open = true;
    while open {
        let word = field.cell_word(cell);
        let k = 3u32 - depth % 3u32;
        let mut down = false;
        let mut side = false;
        if !held.is_separate() && (search.prune == 0u32 || field.cell_bound(cell) <= search.reach) {
            if is_split(word) {
                let over = held.over_bisection(k);
                let above = over.greatest() > 0.0f32;
                let below = over.least() < 0.0f32;
                down = true;
                side = below && !above;
                children[depth as usize] = word;
                waiting.set(depth, above && below);
                path.set(depth, side);
            } else {
                let here = Cell { word, number: cell };
                if !here.is_out() || search.beyond {
                    polygon.start(whole(), part.count);
                    held.clip(polygon);
                    if polygon.count > 0u32 {
                        polygon.write(polygons, counters, search.subject, cell);
                    }
                }
            }
        }
        let next = held.in_child(k, side);
        if down {
            cell = word + select(side, 1u32, 0u32);
            depth += 1u32;
        } else {
            // Up to the last level whose sibling waits.
            depth = waiting.last();
            open = depth > 0u32;
            if open {
                waiting.set(depth - 1u32, false);
                path.set(depth - 1u32, true);
                cell = children[(depth - 1u32) as usize] + 1u32;
            }
        }
        let again = path.follow(root, select(down || !open, 0u32, depth));
        held = Corners::pick(down, next, again);
    }
}

/// The parts of a face outside of the cube, at most six.
#[cube]
fn outside_cube(
    field: Field<'_>,
    subject: Subject,
    counters: &Counters,
    polygons: &mut Polygons,
    polygon: &mut Cut,
) {
    let a = field.in_cube(subject.part.a);
    let b = field.in_cube(subject.part.b);
    let c = field.in_cube(subject.part.c);
    // The part behind the side, of the part before all sides that were before it.
    let mut side = 0u32;
    while side < 6u32 {
        polygon.start(whole(), subject.part.count);
        let mut before = 0u32;
        while before <= side && polygon.count > 0u32 {
            let axis = before / 2u32;
            let over = v3(a.at(axis), b.at(axis), c.at(axis));
            let is_low = before % 2u32 == 0u32;
            let heights = v3(
                select(is_low, over.x, 1.0f32 - over.x),
                select(is_low, over.y, 1.0f32 - over.y),
                select(is_low, over.z, 1.0f32 - over.z),
            );
            polygon.cut(heights, select(before == side, -1.0f32, 1.0f32));
            before += 1u32;
        }
        if polygon.count > 0u32 {
            polygon.write(polygons, counters, subject, NONE);
        }
        side += 1u32;
    }
}
