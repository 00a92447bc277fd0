//! Middle phase around conforming domains: finds the parts of a face outside of all tetrahedra. The
//! face tree answers queries at their points.
//!
//! Outside of a tetrahedron, a polygon has up to four convex parts. A thread walks through all
//! choices of parts, one tetrahedron after the other, and cuts each polygon from the face anew. So
//! it only stores one number per tetrahedron. A face near too many tetrahedra is divided into
//! quarters.
use cubecl::prelude::*;

use crate::kernels::bodies::corners::corners_in;
use crate::kernels::bodies::polygon::{Cut, CutExpand, Quarter, no_polygon, quarter_at};
use crate::kernels::counters::{self, Counters};
use crate::kernels::detect::candidates::{MAX_VERTICES, Polygons, Subject, subject_of};
use crate::kernels::detect::ordered_pair::{OrderedPairs, Part};
use crate::kernels::geometry::vector::{V3, zero};
use crate::kernels::narrow::exchange::LANES;
use crate::kernels::pairs::meshlets::{Blocks, ROUNDING, meshlet_work};
use crate::kernels::query::tetrahedra::{Around, OUT, around_of};
use crate::kernels::scene::shape::{Field, FieldExpand, NONE, Shapes, TREE_NODES};

/// Largest number of tetrahedra that a piece is cut by.
const MAX_NEAR: usize = 48;
/// A face near more tetrahedra than this is quartered, because the cost of cutting grows with the
/// square of the number.
const MANY: u32 = 8;
/// A face counts as covered when its uncovered area is below this fraction. Next to an omitted part
/// there is a cell. There the face is equally near, up to the width of the part, 1e-5 of the face.
const UNCOVERED: f32 = 1e-5;
/// Largest number of quarterings. The pieces are then 2^-12 of the face. A piece that still has
/// more than [`MAX_NEAR`] tetrahedra near it is not cut. This may give an additional contact, with
/// the correct distance to the surface, but misses none.
const QUARTERINGS: u32 = 12;
/// A part thinner than this (local frame) comes from rounding along the side that two tetrahedra
/// share. Such a part would extend along the plane of this side, out of the domain. A true part
/// that is equally thin has neighbours, in which the face is equally near up to this width. The
/// processor drops parts thinner than 1e-11 (`SLIVER` in `tesdf::collide::middle`), because it cuts
/// in `f64`.
const SLIVER: f32 = 2.0 * OUT;
/// Number of quartering levels that a group divides among its threads, and the number of quarters.
const SHARED_LEVELS: u32 = 3;
const SHARED: u32 = 64;

/// The tetrahedra near a piece of a face.
#[derive(CubeType)]
struct Near {
    roots: Array<u32>,
    /// Number of tetrahedra, also above the capacity.
    count: u32,
    /// Whether one tetrahedron holds the whole piece.
    held: bool,
    /// The part that was chosen for each tetrahedron: see [`Cut::keep`].
    choices: Array<u32>,
}

#[cube]
impl Near {
    /// Whether there are more tetrahedra than the capacity.
    fn is_full(&self) -> bool {
        self.count > comptime!(MAX_NEAR as u32)
    }

    /// Finds the tetrahedra near a piece.
    fn find(&mut self, field: Field<'_>, piece: Part, around: Around) {
        let nodes = field.entry(TREE_NODES);
        self.count = 0u32;
        self.held = false;
        let mut node = 0u32;
        while node < nodes {
            let step = field.visit(node, around);
            node = step.next;
            if step.tetrahedron != NONE {
                let root = field.tetrahedron(step.tetrahedron);
                let held = corners_in(root, piece);
                if !root.is_flat() && !held.is_separate() {
                    if self.count < comptime!(MAX_NEAR as u32) {
                        self.roots[self.count as usize] = step.tetrahedron;
                    }
                    self.count += 1u32;
                    self.held = self.held || held.is_within();
                    node = select(self.held, nodes, node);
                }
            }
        }
    }

    /// Whether the tetrahedra hold a quarter completely. Tetrahedra do not overlap, so their areas
    /// add up.
    fn cover(&self, field: Field<'_>, subject: Subject, quarter: Quarter, polygon: &mut Cut) -> bool {
        let whole = quarter.area();
        let mut covered = 0.0f32;
        let mut i = 0u32;
        while i < self.count {
            polygon.start(quarter, 3u32);
            polygon.keep(field, self.roots[i as usize], subject.part, 0u32);
            covered += polygon.area();
            i += 1u32;
        }
        // A covered area above the whole shows tetrahedra that are inside out. An area that counts
        // twice may hide a gap.
        covered >= (1.0f32 - UNCOVERED) * whole && covered <= (1.0f32 + UNCOVERED) * whole
    }
}

#[cube]
impl Cut {
    /// Cuts by a tetrahedron. `choice` 0 keeps the part inside. 1 to 4 keep the part that is
    /// outside of this side and inside all earlier sides.
    fn keep(&mut self, field: Field<'_>, root: u32, part: Part, choice: u32) {
        let held = corners_in(field.tetrahedron(root), part);
        let sides = select(choice == 0u32, 4u32, choice);
        let mut side = 0u32;
        while side < sides && self.count > 0u32 {
            self.cut(held.over(side), select(side + 1u32 == choice, -1.0f32, 1.0f32));
            side += 1u32;
        }
    }
}

#[cube]
impl Field<'_> {
    /// Whether no point of a piece that is outside of all tetrahedra can have a signed distance up
    /// to `reach`. This holds when the piece is farther away, or deep inside the solid.
    fn is_far(self, center: V3, radius: f32, reach: f32) -> bool {
        let inside = self.locate(center).is_inside();
        let limit = radius + select(inside, 0.0f32, reach) + ROUNDING;
        self.nearest_in_tree(center, limit * limit).face == NONE
    }
}

/// Writes the parts of faces around the domain of the field, with [`NONE`] as their cell. A group
/// takes a meshlet, and a thread takes a face. Faces that need quartering wait, and the whole group
/// then works on each.
#[cube(launch, create_dummy_kernel)]
pub fn outside_polygons(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    meshlets: &Blocks,
    counters: &Counters,
    polygons: &mut Polygons,
    prune: u32,
) {
    let mut waiting = Shared::<[u32]>::new_slice(LANES as usize);
    let item = CUBE_POS as u32;
    let count = counters.within(counters::MESHLETS, meshlets.room);
    if item < count {
        let work = meshlet_work(shapes, pairs, meshlets, item);
        let (pair, field) = (work.pair, work.field);
        let is_around = field.is_mesh() && field.is_conforming() && pair.part_reach() > 0.0f32;
        let faces = select(is_around, work.faces(), 0u32);
        // First each thread works on its own face. Then all threads work together on each waiting
        // face.
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
                let subject = subject_of(shapes, pairs, pair, work.face(number));
                let center = subject.part.center();
                let radius = subject.part.radius_around(center);
                if !field.is_beyond(center, radius, subject.reach, prune) {
                    waits = around(field, subject, alone, counters, polygons);
                }
            }
            if alone {
                waiting[UNIT_POS as usize] = waits;
            }
            turn += 1u32;
        }
        counters.tell_if_broken_off(count);
    }
}

/// A walk over the quarters of a face, or over a thread's share of the group's quarters.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Walk {
    path: u32,
    level: u32,
    top: u32,
    end: u32,
    open: bool,
}

#[cube]
impl Walk {
    fn down(&mut self) {
        self.path *= 4u32;
        self.level += 1u32;
    }

    /// Goes to the next quarter on the last level that has one.
    fn on(&mut self) {
        while self.level > self.top && self.path % 4u32 == 3u32 {
            self.path /= 4u32;
            self.level -= 1u32;
        }
        self.path += select(self.level > self.top, 1u32, LANES);
        self.open = self.level > self.top || self.path < self.end;
    }
}

#[cube]
fn walk_of(alone: bool) -> Walk {
    Walk {
        path: select(alone, 0u32, UNIT_POS),
        level: select(alone, 0u32, SHARED_LEVELS),
        top: select(alone, 0u32, SHARED_LEVELS),
        end: select(alone, 1u32, SHARED),
        open: true,
    }
}

/// Writes the parts of a face, quarter by quarter. With `alone`, the thread takes the whole face,
/// and otherwise its share of the group's quarters. Returns 1 when the thread is alone and the face
/// needs quartering; then nothing is written.
#[cube]
fn around(
    field: Field<'_>,
    subject: Subject,
    alone: bool,
    counters: &Counters,
    polygons: &mut Polygons,
) -> u32 {
    let part = subject.part;
    let is_face = part.count == 3u32;
    let face_plane = around_of(part.a, part.b, part.c);
    let mut polygon = no_polygon();
    let mut near = Near {
        roots: Array::<u32>::new(MAX_NEAR),
        count: 0u32,
        held: false,
        choices: Array::<u32>::new(MAX_NEAR),
    };
    let mut walk = walk_of(alone);
    let mut waits = 0u32;
    while walk.open {
        let quarter = quarter_at(walk.path, walk.level);
        let piece = part.quarter(quarter);
        let center = piece.center();
        let mut down = false;
        if !field.is_far(center, piece.radius_around(center), subject.reach) {
            near.find(field, piece, face_plane.part(piece.a, piece.b, piece.c));
            if !near.held && !near.is_full() && is_face {
                near.held = near.cover(field, subject, quarter, &mut polygon);
            }
            down = !near.held && near.count > MANY && walk.level < QUARTERINGS && is_face;
            if !near.held && !down {
                if near.is_full() {
                    polygon.start(quarter, part.count);
                    polygon.write(polygons, counters, subject, NONE);
                } else {
                    parts(field, subject, quarter, &mut near, &mut polygon, counters, polygons);
                }
            }
        }
        if down && alone {
            waits = 1u32;
            walk.open = false;
        } else if down {
            walk.down();
        } else {
            walk.on();
        }
    }
    waits
}

/// Writes the parts of a quarter outside of all tetrahedra near it.
#[cube]
fn parts(
    field: Field<'_>,
    subject: Subject,
    quarter: Quarter,
    near: &mut Near,
    polygon: &mut Cut,
    counters: &Counters,
    polygons: &mut Polygons,
) {
    let part = subject.part;
    let mut depth = 0u32;
    let mut choice = 0u32;
    let mut open = true;
    while open {
        polygon.start(quarter, part.count);
        let mut i = 0u32;
        while i <= depth && i < near.count {
            let mut chosen = choice;
            let mut cuts = true;
            if i < depth {
                chosen = near.choices[i as usize];
                cuts = chosen > 0u32;
            }
            if cuts {
                polygon.keep(field, near.roots[i as usize], part, chosen);
            }
            i += 1u32;
        }
        let mut back = false;
        let some = polygon.count > 0u32;
        if depth == near.count {
            if some {
                write_part(field, subject, polygon, near.count, counters, polygons);
            }
            back = true;
        } else if choice == 0u32 && some {
            // The tetrahedron holds a part: continue with the parts outside, side by side.
            choice = 1u32;
        } else if choice == 0u32 || some {
            near.choices[depth as usize] = choice;
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
                choice = near.choices[depth as usize] + 1u32;
                open = choice > 1u32 && choice <= 4u32;
            }
        }
    }
}

/// The size of a polygon.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Measure {
    /// The mean of the vertices.
    center: V3,
    /// Twice the area.
    area: f32,
    /// The greatest distance of a vertex from the first vertex.
    longest: f32,
}

#[cube]
impl Cut {
    fn measure(&self, part: Part) -> Measure {
        let first = part.at(self.s[0], self.t[0]);
        let mut sum_s = self.s[0];
        let mut sum_t = self.t[0];
        let mut longest = 0.0f32;
        let mut area = zero();
        let mut before = zero();
        let mut i = 1u32;
        while i < self.count {
            sum_s += self.s[i as usize];
            sum_t += self.t[i as usize];
            let here = part.at(self.s[i as usize], self.t[i as usize]) - first;
            area = area + before.cross(here);
            longest = longest.max(here.length());
            before = here;
            i += 1u32;
        }
        let n = self.count as f32;
        Measure { center: part.at(sum_s / n, sum_t / n), area: area.length(), longest }
    }
}

/// Appends a part, unless it is a sliver between two of the `cuts` tetrahedra that have cut it.
#[cube]
fn write_part(
    field: Field<'_>,
    subject: Subject,
    polygon: &mut Cut,
    cuts: u32,
    counters: &Counters,
    polygons: &mut Polygons,
) {
    let shape = polygon.measure(subject.part);
    // A part that no tetrahedron has cut is as thin as the face itself, and is kept.
    let is_sliver = cuts > 0u32 && subject.part.count == 3u32 && shape.area < SLIVER * shape.longest;
    if !is_sliver && field.locate(shape.center).number == NONE {
        polygon.write(polygons, counters, subject, NONE);
        // With more vertices than the capacity, a second polygon has the first vertex, the last one
        // written, and the others.
        let last = comptime!(MAX_VERTICES as u32 - 1).runtime();
        if polygon.count > last + 1u32 {
            let n = polygon.count;
            let mut k = last;
            while k < n {
                let (s, t) = (polygon.s[k as usize], polygon.t[k as usize]);
                polygon.put(k - last + 1u32, s, t);
                k += 1u32;
            }
            polygon.count = n - last + 1u32;
            polygon.write(polygons, counters, subject, NONE);
        }
    }
}
