//! Middle phase: finds the cells that a face meets, and the polygon of the face in each cell.
//!
//! A thread walks the bisection forest with the barycentric coordinates of the face's three
//! corners. It starts from the roots of the cube, or from the tetrahedra of a conforming domain. It
//! descends into one child and returns later for the other. For this it stores its path, one bit
//! per level, the node words of the first children, and the coordinates at each third level. A
//! polygon is stored as weights of the face's corners, because the coordinates in each cell are
//! linear in these weights.
//!
//! Faces meet from one to thousands of cells. So every [`ROUND`] steps threads without work take
//! branches of the others' walks.
//!
//! Mirrors `collide/bodies/clip.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::bodies::branches::no_branches;
use crate::kernels::bodies::cell_walk::{Walk, no_walk};
use crate::kernels::bodies::corners::corners_in;
use crate::kernels::bodies::polygon::{Cut, no_polygon, whole};
use crate::kernels::counters::{self, CANDIDATES, Counters};
use crate::kernels::detect::candidates::{Polygons, Subject, subject_of};
use crate::kernels::detect::ordered_pair::OrderedPairs;
use crate::kernels::geometry::vector::v3;
use crate::kernels::narrow::exchange::LANES;
use crate::kernels::pairs::meshlets::{Blocks, meshlet_work};
use crate::kernels::query::locate::{Cell, is_split};
use crate::kernels::query::tetrahedra::{Around, around_of};
use crate::kernels::scene::shape::{BAND, Field, HIGH, LOW, NONE, Shapes, TREE_NODES};

/// Steps of a walk between two exchanges of branches. An exchange takes about as long as a step.
const ROUND: u32 = 16;
/// Groups of threads that share the large faces of a meshlet.
pub const GROUPS_PER_MESHLET: u32 = 8;
/// A face is large when its radius is more than this share of the domain's extent.
const LARGE: f32 = 0.25;

/// The share of a thread in a face that several threads work on.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Share {
    /// Number of this thread.
    pub mine: u32,
    /// Number of threads per face: a power of two.
    pub threads: u32,
}

/// Number of threads of a group that share a face. It is more than one in a meshlet with few faces,
/// because these may be large.
#[cube]
fn threads_per_face(faces: u32) -> u32 {
    let mut threads = 1u32;
    while 2u32 * threads * faces <= LANES {
        threads *= 2u32;
    }
    threads
}

/// Clips faces. The groups of a slab in z take a meshlet each. A face has one thread, or several
/// where the meshlet has few faces. Large faces have threads in every slab, and the others in the
/// first.
#[cube(launch, create_dummy_kernel)]
pub fn clip_polygons(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    meshlets: &Blocks,
    counters: &Counters,
    polygons: &mut Polygons,
    prune: u32,
) {
    let mut branches = no_branches();
    let item = CUBE_POS_X + CUBE_POS_Y * CUBE_COUNT_X;
    let count = counters.within(counters::MESHLETS, meshlets.room);
    if item < count {
        let work = meshlet_work(shapes, pairs, meshlets, item);
        let (pair, field) = (work.pair, work.field);
        let faces = work.faces();
        let threads = threads_per_face(faces);
        let mut walk = no_walk();
        let mut start = Start { number: 0u32, end: 0u32, levels: 0u32, turn: 0u32 };
        let mut share = Share { mine: 0u32, threads: 1u32 };
        let mut polygon = no_polygon();
        if UNIT_POS / threads < faces {
            let subject = subject_of(shapes, pairs, pair, work.face(UNIT_POS / threads));
            let center = subject.part.center();
            let radius = subject.part.radius_around(center);
            let extent = (field.vector(HIGH) - field.vector(LOW)).greatest();
            let slabs = select(field.is_mesh() && radius > LARGE * extent, CUBE_COUNT_Z, 1u32);
            share = Share { mine: UNIT_POS % threads * slabs + CUBE_POS_Z, threads: threads * slabs };
            if CUBE_POS_Z < slabs && !field.is_beyond(center, radius, subject.reach, prune) {
                if share.mine == 0u32 {
                    counters.append(CANDIDATES);
                }
                if field.is_mesh() {
                    if share.mine == 0u32 && !field.is_conforming() && reaches_out(field, subject) {
                        outside_cube(field, subject, counters, polygons, &mut polygon);
                    }
                    walk.face = subject.face;
                    start = start_of(field, share);
                } else if share.mine == 0u32 {
                    polygon.start(whole(), subject.part.count);
                    polygon.write(polygons, counters, subject, NONE);
                }
            }
        }
        let mut going = true;
        while going {
            if walk.open || start.number < start.end {
                let subject = subject_of(shapes, pairs, pair, walk.face);
                let part = subject.part;
                let search = Search { subject, beyond: reaches_out(field, subject), prune };
                let around = around_of(part.a, part.b, part.c);
                while !walk.open && start.number < start.end {
                    start.next(field, around, share, &mut walk);
                }
                if walk.open {
                    go_on(field, search, &mut walk, counters, polygons, &mut polygon);
                }
            }
            let is_free = !walk.open && start.number >= start.end;
            going = branches.exchange(is_free, &mut walk);
        }
        counters.tell_if_broken_off(count);
    }
}

/// Whether points of a face outside of the cells can be contacts. Around a conforming domain,
/// `outside::outside_polygons` finds them.
#[cube]
fn reaches_out(field: Field<'_>, subject: Subject) -> bool {
    let conforming = field.is_conforming();
    (conforming && subject.reach > 0.0f32) || (!conforming && subject.reach >= field.number(BAND))
}

/// A face, and the cells in which it may have polygons.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Search {
    subject: Subject,
    /// Whether points outside of the cells can be contacts.
    beyond: bool,
    /// 1 when cells may be skipped by their bounds, otherwise 0.
    prune: u32,
}

/// The starting cell of a thread's next walk. In the bisection domain it is one of the six roots.
/// When several threads share a face, it is a cell some levels below. In a conforming domain, the
/// threads take the tetrahedra in turns, and `number` is a node of the tree over tetrahedra.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Start {
    number: u32,
    end: u32,
    /// Levels of the starting cells below the roots.
    levels: u32,
    /// Number of tetrahedra before this one.
    turn: u32,
}

#[cube]
fn start_of(field: Field<'_>, share: Share) -> Start {
    let conforming = field.is_conforming();
    let few = select(share.threads > 1u32, 3u32, 0u32);
    let levels = select(conforming, 0u32, select(share.threads > 8u32, 6u32, few));
    Start {
        number: select(conforming, 0u32, share.mine),
        end: select(conforming, field.entry(TREE_NODES), 6u32 << levels),
        levels,
        turn: 0u32,
    }
}

#[cube]
impl Start {
    /// Begins the walk at the next starting cell, and writes its path, unless another thread does.
    fn next(&mut self, field: Field<'_>, around: Around, share: Share, walk: &mut Walk) {
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
                walk.path.set(depth, side == 1u32);
                cell = word + side;
                depth += 1u32;
            }
        }
        // A cell above the starting level stands for all starting cells below it, and is walked
        // once.
        let below = (1u32 << (self.levels - depth)) - 1u32;
        let repeated = depth < self.levels && (number & below) != 0u32;
        self.number = next;
        walk.root = root;
        walk.cell = cell;
        walk.depth = depth;
        walk.open = !elsewhere && !repeated;
        walk.is_new = true;
    }
}

/// The third level at or above a level.
#[cube]
fn third(depth: u32) -> u32 {
    depth / 3u32 * 3u32
}

/// Goes on with a walk, by [`ROUND`] steps at most, and writes the polygons of the face in its
/// cells.
#[cube]
fn go_on(
    field: Field<'_>,
    search: Search,
    walk: &mut Walk,
    counters: &Counters,
    polygons: &mut Polygons,
    polygon: &mut Cut,
) {
    let part = search.subject.part;
    let mut cell = walk.cell;
    let mut depth = walk.depth;
    let base = third(depth);
    if walk.is_new {
        let root = corners_in(field.tetrahedron(walk.root), part);
        let corners = walk.path.follow(root, base);
        walk.keep(base, corners);
        walk.is_new = false;
    }
    let mut held = walk.corners(base, depth);
    let mut open = true;
    let mut steps = 0u32;
    while open && steps < ROUND {
        steps += 1u32;
        let word = field.cell_word(cell);
        let k = 3u32 - depth % 3u32;
        let mut down = false;
        let mut side = false;
        if !held.is_separate() && (search.prune == 0u32 || field.cell_bound(cell) <= search.subject.reach) {
            if is_split(word) {
                let over = held.over_bisection(k);
                let above = over.greatest() > 0.0f32;
                let below = over.least() < 0.0f32;
                down = true;
                side = below && !above;
                walk.children[depth as usize] = word;
                walk.waiting.set(depth, above && below);
                walk.path.set(depth, side);
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
        if down {
            cell = word + select(side, 1u32, 0u32);
            depth += 1u32;
            held = held.in_child(k, side);
            walk.keep(depth, held);
        } else {
            // Return to the last level with a sibling to visit.
            depth = walk.waiting.last();
            open = depth > 0u32;
            if open {
                walk.waiting.set(depth - 1u32, false);
                walk.path.set(depth - 1u32, true);
                cell = walk.children[(depth - 1u32) as usize] + 1u32;
                // The sibling's corners were kept at its own level.
                held = walk.corners(third(depth - 1u32), depth);
                walk.keep(depth, held);
            }
        }
    }
    walk.cell = cell;
    walk.depth = depth;
    walk.open = open;
}

/// Writes the parts of a face outside of the cube, at most six.
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
    // The part outside of this side, cut from the rest that lies inside all earlier sides.
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
