//! The convex hull of the wrenches that are kept, as a list of vertices that a group shares, and the way of another wrench to it.
use cubecl::prelude::*;

use super::vector::v3;
use super::wrench::{Way, Wrench, difference, product, set_way, set_wrench, shorter};

/// Vertices of the hull that ways are shortened towards, in shared memory; those kept beyond do it once, when they are new.
pub const VERTICES: u32 = 256;
/// Vertices that one turn of a loop looks at. The list is filled up with copies of its last.
pub const BLOCK: u32 = 8;
/// A way whose square may be this share above the least is short enough.
const SLACK: f32 = 0.02;
/// Steps of a way in a round.
const STEPS: u32 = 8;

/// Vertex `at` of a list of wrenches.
#[cube]
pub fn vertex(list: &Shared<[f32]>, at: u32) -> Wrench {
    let k = (6u32 * at) as usize;
    Wrench {
        force: v3(list[k], list[k + 1usize], list[k + 2usize]),
        torque: v3(list[k + 3usize], list[k + 4usize], list[k + 5usize]),
    }
}

#[cube]
pub fn put(list: &mut Shared<[f32]>, at: u32, w: Wrench) {
    let k = (6u32 * at) as usize;
    list[k] = w.force.x;
    list[k + 1usize] = w.force.y;
    list[k + 2usize] = w.force.z;
    list[k + 3usize] = w.torque.x;
    list[k + 4usize] = w.torque.y;
    list[k + 5usize] = w.torque.z;
}

/// The vertex, of the first `count`, that lies farthest along a way.
#[cube]
fn farthest_ahead(list: &Shared<[f32]>, count: u32, way: Wrench) -> u32 {
    let mut reach = product(vertex(list, 0u32), way);
    let mut farthest = 0u32;
    let mut at = 0u32;
    while at < count {
        #[unroll]
        for k in 0..BLOCK {
            let ahead = product(vertex(list, at + k), way);
            let more = ahead > reach;
            reach = select(more, ahead, reach);
            farthest = select(more, at + k, farthest);
        }
        at += BLOCK;
    }
    farthest
}

/// A way to `w`, shortened towards any of the first `count` vertices, of which `to_newest` comes from the last. Each step goes to the vertex
/// farthest ahead, from triangles with the two before it: with one before it steps got slow at a third above the least.
#[cube]
pub fn shortened(from: Way, w: Wrench, to_newest: Wrench, list: &Shared<[f32]>, count: u32) -> Way {
    let mut way = from;
    let mut to_g = to_newest;
    let mut to_h = to_newest;
    let mut step = 0u32;
    while step < STEPS {
        let here = way.way;
        let to_f = difference(w, vertex(list, farthest_ahead(list, count, here)));
        let square = product(here, here);
        // No point of the hull is closer than this tells.
        let is_short = square - product(here, to_f) <= SLACK * square;
        let new = shorter(shorter(shorter(way, to_f, to_g), to_f, to_h), to_g, to_h);
        let is_least = product(new.way, new.way) >= square;
        step = select(is_short || is_least, STEPS, step + 1u32);
        set_way(&mut way, new);
        set_wrench(&mut to_h, to_g);
        set_wrench(&mut to_g, to_f);
    }
    way
}
