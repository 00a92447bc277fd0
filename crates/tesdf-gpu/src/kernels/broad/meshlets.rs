//! Broad phase: which meshlets, and then which faces, can come within reach of a field. Nothing within `r` of a point can
//! have a lower signed distance than the point less `r`.
use cubecl::prelude::*;

use super::super::counters::{self, Counters};
use super::super::field::shapes::{Field, FieldExpand, HIGH, LOW, MESHLET_COUNT, NONE, Shapes};
use super::super::math::vector::{V3, outside_box};
use super::ordered_pair::OrderedPairs;

/// The possible error of a distance, in the frame of a mesh: twice what is promised for queries.
pub const ROUNDING: f32 = 4e-6;

/// Meshlets of a block: one for each thread of a group.
pub const MESHLETS_OF_BLOCK: u32 = 32;

/// Runs of meshlets of ordered pairs.
#[derive(CubeType, CubeLaunch)]
pub struct Blocks {
    /// Two words each: ordered pair, first meshlet.
    pub words: Box<[u32]>,
    /// Room for so many.
    pub room: u32,
}

/// Words of a block, and of a meshlet of an ordered pair.
pub const WORDS: u32 = 2;

#[cube]
impl Blocks {
    /// Writes a block, or a meshlet, where there is room.
    pub fn put(&mut self, at: u32, pair: u32, meshlet: u32) {
        if at < self.room {
            self.words[(at * WORDS) as usize] = pair;
            self.words[(at * WORDS + 1u32) as usize] = meshlet;
        }
    }

    /// The ordered pair of a block or meshlet.
    pub fn pair(&self, at: u32) -> u32 {
        self.words[(at * WORDS) as usize]
    }

    /// The meshlet, or the first meshlet of a block.
    pub fn meshlet(&self, at: u32) -> u32 {
        self.words[(at * WORDS + 1u32) as usize]
    }
}

#[cube]
impl Field<'_> {
    /// Whether no point within `radius` of `p` can have a signed distance up to `reach`. May be false where it is so:
    /// with `prune` 0 only points out of the bounds are beyond.
    pub fn is_beyond(self, p: V3, radius: f32, reach: f32, prune: u32) -> bool {
        let limit = radius + reach;
        if self.is_mesh() {
            self.mesh_is_beyond(p, limit, prune)
        } else {
            let distance = self.simple_value(p).distance;
            distance > limit + 1e-6f32 * (p.abs().greatest() + distance.abs())
        }
    }

    fn mesh_is_beyond(self, p: V3, limit: f32, prune: u32) -> bool {
        let out = outside_box(p, self.vector(LOW), self.vector(HIGH));
        let far = limit.max(0.0f32) + ROUNDING;
        let mut beyond = out.dot(out) > far * far;
        if !beyond && prune == 1u32 {
            let cell = self.locate(p);
            let listed = cell.is_listed();
            let out = cell.is_out();
            beyond = out && self.cell_bound(cell.number) > far;
            if !beyond {
                // Distances of lists that are not exact rule nothing out: then the face tree answers.
                let by_tree = out || (listed && !self.has_exact_lists());
                let mut none = false;
                if by_tree && !cell.is_inside() {
                    none = self.nearest_in_tree(p, far * far).face == NONE;
                }
                beyond = none && !listed;
                if !by_tree || (none && listed) {
                    let v = self.mesh_value(cell, p, self.nearest(cell, p));
                    beyond = v.distance > select(none, 0.0f32, limit + ROUNDING);
                }
            }
        }
        beyond
    }
}

/// A group for each block, a thread for each meshlet: those that can touch are written.
#[cube(launch, create_dummy_kernel)]
pub fn meshlets(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    blocks: &Blocks,
    counters: &Counters,
    meshlets: &mut Blocks,
    prune: u32,
) {
    let block = CUBE_POS as u32;
    if block < counters.within(counters::BLOCKS, blocks.room) {
        let pair = pairs.get(blocks.pair(block));
        let surface = shapes.field(pair.shape_a);
        let meshlet = blocks.meshlet(block) + UNIT_POS;
        if meshlet < surface.entry(MESHLET_COUNT) {
            let mut kept = true;
            if surface.is_mesh() {
                let ball = surface.meshlet_ball(meshlet);
                let field = shapes.field(pair.shape_b);
                let center = pair.to_field(ball.center);
                kept = !field.is_beyond(center, pair.scale * ball.radius, pair.reach, prune);
            }
            if kept {
                let at = counters.append(counters::MESHLETS);
                meshlets.put(at, pair.number, meshlet);
            }
        }
    }
}
