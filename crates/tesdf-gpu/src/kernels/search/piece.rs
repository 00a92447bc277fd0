//! Pieces of a polygon that wait in the branch and bound of the exact mode.
//!
//! Mirrors `collide/search/piece.rs` of `tesdf`.
use cubecl::prelude::*;
use tesdf::collide::ContactsPer;

use crate::kernels::detect::candidates::Weights;
use crate::kernels::detect::ordered_pair::Part;
use crate::kernels::geometry::vector::{THIRD, V3, centroid, v3};
use crate::kernels::narrow::exchange::LANES;
use crate::kernels::narrow::operations::{Work, no_work};
use crate::kernels::query::locate::{Cell, no_cell};
use crate::kernels::query::value::Value;
use crate::kernels::scene::shape::Field;
use crate::kernels::search::greatest_minimum::Functions;

/// Capacity of the pool of waiting pieces.
pub const POOL: u32 = 128;

/// A triangle of a polygon, with the nearest face at each corner. No point of the triangle has a
/// signed distance below `bound`.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Piece {
    pub a: Weights,
    pub b: Weights,
    pub c: Weights,
    pub face_a: u32,
    pub face_b: u32,
    pub face_c: u32,
    pub bound: f32,
}

/// A signed distance, and the point that has it.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Lowest {
    pub distance: f32,
    pub at: Weights,
}

/// A part of a surface in a cell of a field, or in all cells.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Region<'a> {
    pub field: Field<'a>,
    /// Not used where the part is in all cells.
    pub cell: Cell,
    pub part: Part,
    #[cube(comptime)]
    per: ContactsPer,
}

/// A part of a surface in a cell.
#[cube]
pub fn region<'a>(field: Field<'a>, cell: Cell, part: Part) -> Region<'a> {
    Region::<'a> { field, cell, part, per: comptime!(ContactsPer::Cell) }
}

/// A part of a surface in all cells.
#[cube]
pub fn everywhere<'a>(field: Field<'a>, part: Part) -> Region<'a> {
    Region::<'a> { field, cell: no_cell(), part, per: comptime!(ContactsPer::Face) }
}

#[cube]
impl Lowest {
    /// The lower of two distances. At equal distances, the first.
    pub fn or(self, distance: f32, at: Weights) -> Lowest {
        let lower = distance < self.distance;
        Lowest {
            distance: select(lower, distance, self.distance),
            at: Weights { s: select(lower, at.s, self.at.s), t: select(lower, at.t, self.at.t) },
        }
    }
}

/// A corner of a piece, and the nearest face there.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct PieceCorner {
    pub at: Weights,
    pub face: u32,
}

#[cube]
fn pick_corner(condition: bool, first: PieceCorner, second: PieceCorner) -> PieceCorner {
    PieceCorner {
        at: Weights {
            s: select(condition, first.at.s, second.at.s),
            t: select(condition, first.at.t, second.at.t),
        },
        face: select(condition, first.face, second.face),
    }
}

#[cube]
impl Piece {
    /// The mean of the corners.
    pub fn center(self) -> Weights {
        Weights { s: THIRD * (self.a.s + self.b.s + self.c.s), t: THIRD * (self.a.t + self.b.t + self.c.t) }
    }

    /// The same piece, with its corners rotated so that the longest edge goes from a to b.
    pub fn turned(self, part: Part) -> Piece {
        let a = PieceCorner { at: self.a, face: self.face_a };
        let b = PieceCorner { at: self.b, face: self.face_b };
        let c = PieceCorner { at: self.c, face: self.face_c };
        let pa = part.at(a.at.s, a.at.t);
        let pb = part.at(b.at.s, b.at.t);
        let pc = part.at(c.at.s, c.at.t);
        let ab = (pa - pb).length();
        let bc = (pb - pc).length();
        let ca = (pc - pa).length();
        let is_ab = ab >= bc && ab >= ca;
        let is_bc = !is_ab && bc >= ca;
        let first = pick_corner(is_ab, a, pick_corner(is_bc, b, c));
        let second = pick_corner(is_ab, b, pick_corner(is_bc, c, a));
        let third = pick_corner(is_ab, c, pick_corner(is_bc, a, b));
        Piece {
            a: first.at,
            b: second.at,
            c: third.at,
            face_a: first.face,
            face_b: second.face,
            face_c: third.face,
            bound: self.bound,
        }
    }

    /// The half with corner a (or with corner b when `with_a` is false). Its bound is still the
    /// bound of the whole piece.
    pub fn half(self, with_a: bool, middle: Weights, face: u32) -> Piece {
        let a = PieceCorner { at: self.a, face: self.face_a };
        let b = PieceCorner { at: self.b, face: self.face_b };
        let kept = pick_corner(with_a, a, b);
        Piece {
            a: kept.at,
            b: middle,
            c: self.c,
            face_a: kept.face,
            face_b: face,
            face_c: self.face_c,
            bound: self.bound,
        }
    }
}

/// The corners of a piece in the field's frame.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Points {
    a: V3,
    b: V3,
    c: V3,
}

#[cube]
impl Region<'_> {
    /// The field at a point of the part. It counts as work if it `is_own`: if no other thread looks
    /// at the same point.
    pub fn value(self, at: Weights, is_own: bool, work: &mut Work) -> Value {
        let p = self.part.at(at.s, at.t);
        if comptime!(work.counting) {
            work.evaluate(self.distances_at(p), is_own);
        }
        if comptime!(self.per == ContactsPer::Face) {
            self.field.exact_value(p)
        } else {
            self.field.value_in_cell(self.cell, p)
        }
    }

    /// How many distances of a point and a face an evaluation takes.
    fn distances_at(self, p: V3) -> u32 {
        if comptime!(self.per == ContactsPer::Face) {
            self.field.exact_distances(self.field.cell_at(p), p)
        } else {
            self.field.distances(self.cell, p)
        }
    }

    /// Distances from three points to a face.
    fn distances(self, face: u32, points: Points) -> V3 {
        let f = self.field.face(face);
        v3(
            f.distance_squared(points.a).sqrt(),
            f.distance_squared(points.b).sqrt(),
            f.distance_squared(points.c).sqrt(),
        )
    }

    /// Functions that are linear over a piece of a mesh's field. Inside the solid, the depth is at
    /// most the distance to any face. The distance to one face is convex, so over a triangle it is
    /// at most the linear function with the same values at the corners.
    fn distances_to_faces(self, piece: Piece, points: Points, face: u32) -> Functions {
        Functions {
            f: self.distances(face, points),
            g: self.distances(piece.face_a, points),
            h: self.distances(piece.face_b, points),
            k: self.distances(piece.face_c, points),
        }
    }

    /// The depths at three points by the tangent of the field at `p`.
    fn tangent(self, p: V3, points: Points) -> V3 {
        let v = self.field.simple_value(p);
        v3(
            -(v.distance + v.gradient.dot(points.a - p)),
            -(v.distance + v.gradient.dot(points.b - p)),
            -(v.distance + v.gradient.dot(points.c - p)),
        )
    }

    /// The same for a simple shape. Its field is convex, so it lies above its tangents.
    fn tangents(self, points: Points, middle: V3) -> Functions {
        Functions {
            f: self.tangent(middle, points),
            g: self.tangent(points.a, points),
            h: self.tangent(points.b, points),
            k: self.tangent(points.c, points),
        }
    }

    /// The bound of a piece, with the field at its center: the value there minus the radius, or
    /// minus the greatest minimum of four functions that the depth does not exceed, whichever is
    /// greater.
    pub fn bound(self, piece: Piece, here: Value, work: &mut Work) -> f32 {
        let points = Points {
            a: self.part.at(piece.a.s, piece.a.t),
            b: self.part.at(piece.b.s, piece.b.t),
            c: self.part.at(piece.c.s, piece.c.t),
        };
        let middle = centroid(points.a, points.b, points.c);
        let radius =
            (points.a - middle).length().max((points.b - middle).length()).max((points.c - middle).length());
        let mut bound = here.distance - radius;
        let is_mesh = self.field.is_mesh();
        if !is_mesh || bound < 0.0f32 {
            if comptime!(work.counting) {
                // Of three points and four faces.
                work.measure(select(is_mesh, 12u32, 0u32));
            }
            let functions = if is_mesh {
                self.distances_to_faces(piece, points, here.face)
            } else {
                self.tangents(points, middle)
            };
            bound = bound.max(-functions.greatest_minimum());
        }
        bound
    }
}

/// The waiting pieces of a group, and shared memory for exchanges.
#[derive(CubeType)]
pub struct Pool {
    numbers: Shared<[f32]>,
    faces: Shared<[u32]>,
    /// The lowest value of each thread, with the two weights of its point.
    found: Shared<[f32]>,
    /// A word of each thread, such as the number of pieces that it keeps.
    kept: Shared<[u32]>,
    /// The work of this thread.
    pub work: Work,
}

/// Number of pieces that the threads before this one keep, and that all threads keep.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Kept {
    pub before: u32,
    pub all: u32,
}

#[cube]
pub fn empty_pool(#[comptime] counting: bool) -> Pool {
    Pool {
        numbers: Shared::<[f32]>::new_slice(comptime!(7 * POOL as usize)),
        faces: Shared::<[u32]>::new_slice(comptime!(3 * POOL as usize)),
        found: Shared::<[f32]>::new_slice(comptime!(3 * LANES as usize)),
        kept: Shared::<[u32]>::new_slice(comptime!(LANES as usize)),
        work: no_work(counting),
    }
}

#[cube]
impl Pool {
    pub fn put(&mut self, at: u32, piece: Piece) {
        let first = (7u32 * at) as usize;
        self.numbers[first] = piece.a.s;
        self.numbers[first + 1usize] = piece.a.t;
        self.numbers[first + 2usize] = piece.b.s;
        self.numbers[first + 3usize] = piece.b.t;
        self.numbers[first + 4usize] = piece.c.s;
        self.numbers[first + 5usize] = piece.c.t;
        self.numbers[first + 6usize] = piece.bound;
        let first = (3u32 * at) as usize;
        self.faces[first] = piece.face_a;
        self.faces[first + 1usize] = piece.face_b;
        self.faces[first + 2usize] = piece.face_c;
    }

    pub fn bound(&self, at: u32) -> f32 {
        self.numbers[(7u32 * at + 6u32) as usize]
    }

    pub fn get(&self, at: u32) -> Piece {
        let n = (7u32 * at) as usize;
        let f = (3u32 * at) as usize;
        Piece {
            a: Weights { s: self.numbers[n], t: self.numbers[n + 1usize] },
            b: Weights { s: self.numbers[n + 2usize], t: self.numbers[n + 3usize] },
            c: Weights { s: self.numbers[n + 4usize], t: self.numbers[n + 5usize] },
            face_a: self.faces[f],
            face_b: self.faces[f + 1usize],
            face_c: self.faces[f + 2usize],
            bound: self.numbers[n + 6usize],
        }
    }

    /// The lowest value of all threads. At equal values, that of the first thread. All threads of
    /// the group must call it.
    pub fn lowest(&mut self, mine: Lowest) -> Lowest {
        self.lowest_of_every(mine, 0u32, 1u32)
    }

    /// The same for every `step`-th thread from `first` on.
    pub fn lowest_of_every(&mut self, mine: Lowest, first: u32, step: u32) -> Lowest {
        sync_cube();
        let own = (3u32 * UNIT_POS) as usize;
        self.found[own] = mine.distance;
        self.found[own + 1usize] = mine.at.s;
        self.found[own + 2usize] = mine.at.t;
        sync_cube();
        let mut lowest = self.found_by(first);
        let mut lane = first + step;
        while lane < LANES {
            let other = self.found_by(lane);
            lowest = lowest.or(other.distance, other.at);
            lane += step;
        }
        lowest
    }

    fn found_by(&self, lane: u32) -> Lowest {
        let at = (3u32 * lane) as usize;
        Lowest {
            distance: self.found[at],
            at: Weights { s: self.found[at + 1usize], t: self.found[at + 2usize] },
        }
    }

    /// Shows a word of each thread to the others. All threads of the group must call it.
    pub fn exchange(&mut self, mine: u32) {
        sync_cube();
        self.kept[UNIT_POS as usize] = mine;
        sync_cube();
    }

    /// The word that a thread has shown last.
    pub fn exchanged(&self, lane: u32) -> u32 {
        self.kept[lane as usize]
    }

    /// Counts the pieces that the threads keep. All threads of the group must call it.
    pub fn count(&mut self, mine: u32) -> Kept {
        self.exchange(mine);
        let mut before = 0u32;
        let mut all = 0u32;
        let mut lane = 0u32;
        while lane < LANES {
            before += select(lane < UNIT_POS, self.kept[lane as usize], 0u32);
            all += self.kept[lane as usize];
            lane += 1u32;
        }
        Kept { before, all }
    }
}
