//! Broad phase: which meshlets, and then which faces, can come within reach of a field. Nothing within `r` of a point can have a lower signed
//! distance than the point less `r`.
use cubecl::prelude::*;

use super::assets::{
    Assets, BOUND_UNIT, BOUNDS, EXACT_LISTS, HIGH, KIND, LOW, MESH, MESHLET_COUNT, MESHLETS, NONE, byte,
    entry, number, vector,
};
use super::field::{is_listed, nearest, simple_value, value_of};
use super::locate::{code, is_inside, place};
use super::nearest::nearest_in_tree;
use super::products::{self, PAIR_WORDS, append};
use super::surface::{Direction, direction, to_field};
use super::vector::{V3, dot, v3};

/// What a distance may be off by, in the frame of a mesh: twice what is promised for queries.
pub const ROUNDING: f32 = 4e-6;

/// No point of the cell has a signed distance below this; 0 where the solid may be.
#[cube]
pub fn cell_bound(assets: &Assets, shape: u32, at: u32) -> f32 {
    let mut least = 0.0f32;
    if at != NONE {
        let step = byte(&assets.words, entry(assets, shape, BOUNDS), at) as f32;
        least = step * step * number(assets, shape, BOUND_UNIT);
    }
    least
}

/// Whether no point within `radius` of `p` can have a signed distance up to `reach`. May say no where it is so: with `prune` 0 only what is out of
/// the bounds is beyond.
#[cube]
pub fn is_beyond(assets: &Assets, shape: u32, p: V3, radius: f32, reach: f32, prune: u32) -> bool {
    let limit = radius + reach;
    let mut beyond = false;
    if entry(assets, shape, KIND) == MESH {
        let low = vector(assets, shape, LOW);
        let high = vector(assets, shape, HIGH);
        let out = v3(
            (low.x - p.x).max(p.x - high.x).max(0.0f32),
            (low.y - p.y).max(p.y - high.y).max(0.0f32),
            (low.z - p.z).max(p.z - high.z).max(0.0f32),
        );
        let far = limit.max(0.0f32) + ROUNDING;
        beyond = dot(out, out) > far * far;
        if !beyond && prune == 1u32 {
            let held = place(assets, shape, p);
            let listed = is_listed(held.word);
            let out = code(held.word) == 7u32;
            beyond = out && cell_bound(assets, shape, held.at) > far;
            if !beyond {
                // Between listed distances and true ones nothing can be ruled out: then the face tree answers for the distance.
                let by_tree = out || (listed && entry(assets, shape, EXACT_LISTS) == 0u32);
                let inside = is_inside(held.word);
                let mut none = false;
                if by_tree && !inside {
                    none = nearest_in_tree(assets, shape, p, far * far).face == NONE;
                }
                beyond = none && !listed;
                if !by_tree || (none && listed) {
                    let v = value_of(assets, shape, held.word, p, nearest(assets, shape, held.word, p));
                    beyond = v.distance > select(none, 0.0f32, limit + ROUNDING);
                }
            }
        }
    } else {
        let size = p.x.abs().max(p.y.abs()).max(p.z.abs());
        let distance = simple_value(assets, shape, p).distance;
        beyond = distance > limit + 1e-6f32 * (size + distance.abs());
    }
    beyond
}

/// A group for each block, a thread for each meshlet.
#[cube(launch, create_dummy_kernel)]
pub fn meshlets(
    assets: &Assets,
    directions: &[u32],
    maps: &[Vector<f32, Const<4>>],
    blocks: &[u32],
    counters: &[Atomic<u32>],
    out: &mut [u32],
    most_blocks: u32,
    most_meshlets: u32,
    prune: u32,
) {
    let block = CUBE_POS as u32;
    let count = counters[products::BLOCKS as usize].load().min(most_blocks);
    if block < count {
        let at = blocks[(block * comptime!(PAIR_WORDS as u32)) as usize];
        let meshlet = blocks[(block * comptime!(PAIR_WORDS as u32) + 1u32) as usize] + UNIT_POS;
        let d: Direction = direction(directions, maps, at);
        if meshlet < entry(assets, d.shape_a, MESHLET_COUNT) {
            let mut kept = true;
            if entry(assets, d.shape_a, KIND) == MESH {
                let ball = assets.rows[(entry(assets, d.shape_a, MESHLETS) + meshlet) as usize];
                let center =
                    to_field(d, v3(ball.extract(0usize), ball.extract(1usize), ball.extract(2usize)));
                kept = !is_beyond(assets, d.shape_b, center, d.scale * ball.extract(3usize), d.reach, prune);
            }
            if kept {
                let slot = append(counters, products::MESHLETS);
                if slot < most_meshlets {
                    out[(slot * comptime!(PAIR_WORDS as u32)) as usize] = at;
                    out[(slot * comptime!(PAIR_WORDS as u32) + 1u32) as usize] = meshlet;
                }
            }
        }
    }
}
