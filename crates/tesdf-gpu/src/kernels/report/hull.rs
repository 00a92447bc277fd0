//! The convex hull of the kept wrenches, as a list of vertices that a group shares, and the
//! residual of another wrench from this hull.
//!
//! Mirrors `collide/report/hull.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::geometry::vector::v3;
use crate::kernels::report::wrench::{Residual, Wrench};

/// Vertices of the hull in shared memory; residuals are shortened toward them repeatedly. A vertex
/// beyond this number shortens residuals once, when it is new.
pub const VERTICES: u32 = 256;
/// Vertices that one iteration of a loop compares. Copies of the last vertex fill the list to a
/// multiple.
const BLOCK: u32 = 8;
// The processor uses 1e-7 and 64 (`SLACK` and `STEPS` in `tesdf::collide::hull`), because it
// computes the nearest point of the hull. Here residuals are only shortened, all members at once.
/// A residual is short enough when the square of its length is within this fraction of the minimum.
const SLACK: f32 = 0.02;
/// Steps per round for a residual.
const STEPS: u32 = 8;

/// Wrenches of six numbers each. The newest wrench also stands behind the others.
#[derive(CubeType)]
pub struct Hull {
    vertices: Shared<[f32]>,
    newest: Shared<[f32]>,
}

#[cube]
pub fn empty_hull() -> Hull {
    Hull {
        vertices: Shared::<[f32]>::new_slice(comptime!(6 * VERTICES as usize)),
        newest: Shared::<[f32]>::new_slice(6usize),
    }
}

#[cube]
fn read(list: &Shared<[f32]>, at: u32) -> Wrench {
    let k = (6u32 * at) as usize;
    Wrench {
        force: v3(list[k], list[k + 1usize], list[k + 2usize]),
        torque: v3(list[k + 3usize], list[k + 4usize], list[k + 5usize]),
    }
}

#[cube]
fn write(list: &mut Shared<[f32]>, at: u32, w: Wrench) {
    let k = (6u32 * at) as usize;
    list[k] = w.force.x;
    list[k + 1usize] = w.force.y;
    list[k + 2usize] = w.force.z;
    list[k + 3usize] = w.torque.x;
    list[k + 4usize] = w.torque.y;
    list[k + 5usize] = w.torque.z;
}

#[cube]
impl Hull {
    /// Adds a vertex to the first `count` vertices. Only one thread may call it.
    pub fn add(&mut self, count: u32, w: Wrench) {
        write(&mut self.newest, 0u32, w);
        let mut k = count;
        while count < VERTICES && (k == count || k % BLOCK != 0u32) {
            write(&mut self.vertices, k, w);
            k += 1u32;
        }
    }

    pub fn newest(&self) -> Wrench {
        read(&self.newest, 0u32)
    }

    fn vertex(&self, at: u32) -> Wrench {
        read(&self.vertices, at)
    }

    /// The vertex, among the first `count`, that is farthest along a residual.
    fn farthest_along(&self, count: u32, x: Wrench) -> u32 {
        let mut reach = self.vertex(0u32).dot(x);
        let mut farthest = 0u32;
        let mut at = 0u32;
        while at < count {
            #[unroll]
            for k in 0..BLOCK {
                let ahead = self.vertex(at + k).dot(x);
                let more = ahead > reach;
                reach = select(more, ahead, reach);
                farthest = select(more, at + k, farthest);
            }
            at += BLOCK;
        }
        farthest
    }

    /// Shortens a residual of `w` toward the first `count` vertices. `to_newest` is the vector from
    /// the newest vertex to `w`. Each step takes the vertex farthest along the residual, and tests
    /// the triangles with the two vertices before it. With only one earlier vertex, steps became
    /// slow at a third above the minimum.
    pub fn shortened(&self, from: Residual, w: Wrench, to_newest: Wrench, count: u32) -> Residual {
        let mut x = from;
        let mut to_g = to_newest;
        let mut to_h = to_newest;
        let mut step = 0u32;
        while step < STEPS {
            let to_f = w - self.vertex(self.farthest_along(count, x.wrench));
            let square = x.wrench.dot(x.wrench);
            // A lower bound of the distance to the hull shows that this residual is short enough.
            let is_short = square - x.wrench.dot(to_f) <= SLACK * square;
            let new = x.shortened(to_f, to_g).shortened(to_f, to_h).shortened(to_g, to_h);
            let is_least = new.wrench.dot(new.wrench) >= square;
            step = select(is_short || is_least, STEPS, step + 1u32);
            x = new;
            to_h = to_g;
            to_g = to_f;
        }
        x
    }
}
