//! The winding number of a point: the winding number at the centroid of its cell, plus the signed
//! crossings of the segment to the centroid with the listed faces.
use cubecl::prelude::*;
use tesdf::asset::layout;

use crate::kernels::geometry::vector::{V3, pick, same, v3};
use crate::kernels::query::locate::{Cell, Descent, axes, in_root, is_split, root};
use crate::kernels::scene::shape::{Field, FieldExpand, LISTS, SIDE};

const WINDING_BYTES: u32 = layout::WINDING_BYTES;

/// A cell and its centroid.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Centered {
    pub cell: Cell,
    pub centroid: V3,
}

/// One coordinate of each of the four corners of a cell.
#[derive(CubeType, Clone, Copy, Debug, PartialEq)]
#[expand(derive(Clone, Copy))]
pub struct Corners {
    pub c0: f32,
    pub c1: f32,
    pub c2: f32,
    pub c3: f32,
}

/// Coordinate `axis` of the corners of a root of the unit cube. A root that follows the axes i, j,
/// k has the corners 0, e_i, e_i + e_j and (1, 1, 1).
#[cube]
pub fn corners_of_root(root: u32, axis: u32) -> Corners {
    let (i, j, _k) = axes(root);
    Corners {
        c0: 0.0f32.runtime(),
        c1: select(axis == i, 1.0f32, 0.0f32),
        c2: select(axis == i || axis == j, 1.0f32, 0.0f32),
        c3: 1.0f32.runtime(),
    }
}

#[cube]
impl Corners {
    /// The corners of child 0 (or of child 1 when `second` is true) of a cell whose refinement edge
    /// ends at corner `k`, in the order of
    /// [`Cell::child_corners`](tesdf::domain::Cell::child_corners).
    pub fn of_child(self, k: u32, second: bool) -> Corners {
        let end = select(k == 3u32, self.c3, select(k == 2u32, self.c2, self.c1));
        let middle = 0.5f32 * (self.c0 + end);
        let shifted = second && k > 1u32;
        Corners {
            c0: select(second, self.c1, self.c0),
            c1: select(k == 1u32, middle, select(shifted, self.c2, self.c1)),
            c2: select(k == 2u32, middle, select(k == 3u32 && second, self.c3, self.c2)),
            c3: select(k == 3u32, middle, self.c3),
        }
    }

    fn sum(self) -> f32 {
        self.c0 + self.c1 + self.c2 + self.c3
    }
}

/// The corners of a cell, stored in memory to save registers: most evaluations need no winding
/// number.
#[derive(CubeType)]
struct CellCorners {
    coordinates: Array<f32>,
}

#[cube]
impl CellCorners {
    fn get(&self, axis: u32) -> Corners {
        let at = (4u32 * axis) as usize;
        Corners {
            c0: self.coordinates[at],
            c1: self.coordinates[at + 1usize],
            c2: self.coordinates[at + 2usize],
            c3: self.coordinates[at + 3usize],
        }
    }

    fn put(&mut self, axis: u32, corners: Corners) {
        let at = (4u32 * axis) as usize;
        self.coordinates[at] = corners.c0;
        self.coordinates[at + 1usize] = corners.c1;
        self.coordinates[at + 2usize] = corners.c2;
        self.coordinates[at + 3usize] = corners.c3;
    }

    fn start(&mut self, root: u32) {
        let mut axis = 0u32;
        while axis < 3u32 {
            self.put(axis, corners_of_root(root, axis));
            axis += 1u32;
        }
    }

    fn descend(&mut self, k: u32, second: bool) {
        let mut axis = 0u32;
        while axis < 3u32 {
            let below = self.get(axis).of_child(k, second);
            self.put(axis, below);
            axis += 1u32;
        }
    }
}

#[cube]
impl Field<'_> {
    /// The winding number of a point.
    ///
    /// This uses the cell that [`locate`](Self::locate) finds. At a border, the caller may have
    /// another cell, with another label and another centroid.
    pub fn winding(self, p: V3) -> i32 {
        let held = self.centered(p);
        let cell = held.cell;
        let mut sum = select(cell.is_inside(), 1i32, 0i32);
        if cell.is_crossing() {
            sum = self.winding_at_centroid(cell);
            let faces = self.list(cell.offset());
            let mut i = 0u32;
            while i < faces.count {
                let f = self.face(self.listed(faces, i));
                sum += crossing(p, held.centroid, f.corner(0u32), f.corner(1u32), f.corner(2u32));
                i += 1u32;
            }
        }
        sum
    }

    /// The winding number at the centroid of a crossing cell.
    pub fn winding_at_centroid(self, cell: Cell) -> i32 {
        let mut sum = cell.short_winding() as i32;
        if cell.has_long_winding() {
            let lists = self.entry(LISTS);
            let at = cell.offset() - WINDING_BYTES;
            sum = (self.half(lists, at) | (self.half(lists, at + 2u32) << 16u32)) as i32;
        }
        sum
    }

    /// The cell that [`locate`](Self::locate) finds for a point, with its centroid. A point that
    /// rounding has moved out of the cube is moved back into it.
    pub fn centered(self, p: V3) -> Centered {
        let free = self.in_cube(p);
        let u = v3(free.x.clamp(0.0f32, 1.0f32), free.y.clamp(0.0f32, 1.0f32), free.z.clamp(0.0f32, 1.0f32));
        let first = root(u);
        let cell = Cell { word: self.cell_word(first), number: first };
        let mut at = Descent { cell, lambda: in_root(u, first), k: 3u32 };
        let mut corners = CellCorners { coordinates: Array::<f32>::new(12usize) };
        corners.start(first);
        while is_split(at.cell.word) {
            let second = at.lambda.is_in_second(at.k);
            corners.descend(at.k, second);
            at.descend(self, second);
        }
        let quarter = 0.25f32 * self.number(SIDE);
        let half = 0.5f32 * self.number(SIDE);
        let sum = v3(corners.get(0u32).sum(), corners.get(1u32).sum(), corners.get(2u32).sum());
        Centered { cell: at.cell, centroid: sum * quarter - v3(half, half, half) }
    }
}

/// 1 when the segment from `p` to `q` leaves the solid through the triangle, −1 when it enters the
/// solid there, otherwise 0.
///
/// When both ends are on one side of the plane, a branch leaves out the edges. It also saves
/// registers: those of the plane are free for the edges.
#[cube]
pub fn crossing(p: V3, q: V3, a: V3, b: V3, c: V3) -> i32 {
    let normal = (b - a).cross(c - a);
    let p_over = normal.dot(p - a) >= 0.0f32;
    let q_over = normal.dot(q - a) >= 0.0f32;
    let mut sum = 0i32;
    if !same(p_over, q_over) && is_through(q - p, a - p, b - p, c - p) {
        sum = select(p_over, -1i32, 1i32);
    }
    sum
}

/// Whether the origin is on the same side of all three edges of a triangle, seen along `along`.
#[cube]
fn is_through(along: V3, a: V3, b: V3, c: V3) -> bool {
    let bc = is_left(along, b, c);
    same(is_left(along, a, b), bc) && same(bc, is_left(along, c, a))
}

/// Whether the origin is to the left of the segment from `a` to `b`, seen along `along`. For a
/// segment and its reverse, exactly one answer is true.
///
/// Two faces at a common edge ask for both directions. The same number must decide both answers.
/// Otherwise a segment through the edge could cross none of the faces, or both. When the number is
/// 0, as happens in symmetric bodies, the segment counts as shifted slightly in a fixed direction.
#[cube]
fn is_left(along: V3, a: V3, b: V3) -> bool {
    let swapped = b.x < a.x || (b.x == a.x && (b.y < a.y || (b.y == a.y && b.z < a.z)));
    let (first, second) = (pick(swapped, b, a), pick(swapped, a, b));
    let turn = along.dot(first.cross(second));
    let moved = v3(0.54f32, 0.21f32, 0.81f32);
    let tie = moved.cross(along).dot(second - first) >= 0.0f32;
    !same(select(turn == 0.0f32, tie, turn > 0.0f32), swapped)
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// The faces of a cube with corners at ±1, outward.
    pub fn cube() -> Vec<[V3; 3]> {
        let corner = |k: u32| [k & 1, k >> 1 & 1, k >> 2].map(|bit| bit as f32 * 2.0 - 1.0);
        let squares = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let faces = squares.map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).concat();
        faces.into_iter().map(|f| f.map(corner).map(|[x, y, z]| v3(x, y, z))).collect()
    }

    /// Segments through edges and corners of a cube, as symmetry produces them, enter it once and
    /// leave it once.
    #[test]
    fn a_segment_through_an_edge_or_a_corner_crosses_once() {
        let faces = cube();
        let sum = |p: V3, q: V3| -> i32 { faces.iter().map(|&[a, b, c]| crossing(p, q, a, b, c)).sum() };
        let steps = [-3.0, -2.0, -1.5, 0.0, 1.5, 2.0, 3.0f32];
        for x in steps {
            for y in steps {
                for z in steps {
                    if x == 0.0 && y == 0.0 && z == 0.0 {
                        continue;
                    }
                    let (out, middle) = (v3(x, y, z), v3(0.0, 0.0, 0.0));
                    assert_eq!((sum(out, middle), sum(middle, out)), (-1, 1), "{x} {y} {z}");
                    assert_eq!(sum(out, v3(-x, -y, -z)), 0, "{x} {y} {z}, to the other side");
                }
            }
        }
    }
}
