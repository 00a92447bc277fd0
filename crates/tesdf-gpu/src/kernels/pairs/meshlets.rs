//! Broad phase: finds the meshlets, and then the faces, that can come within reach of a field. A
//! signed distance is 1-Lipschitz: within a radius `r` of a point it is at least the value at the
//! point minus `r`.
use cubecl::prelude::*;
use tesdf::collide::internal;

use crate::kernels::counters::{self, Counters};
use crate::kernels::detect::ordered_pair::{OrderedPair, OrderedPairs};
use crate::kernels::geometry::vector::{V3, outside_box};
use crate::kernels::narrow::exchange::LANES;
use crate::kernels::scene::shape::{Field, FieldExpand, HIGH, LOW, MESHLET_COUNT, NONE, Shapes};

/// Largest error of a distance in the frame of a mesh. It is twice the error on the processor,
/// because poses and points are in `f32`, too.
pub const ROUNDING: f32 = 2.0 * internal::ROUNDING as f32;

/// Error of a distance to a simple shape, relative to the numbers that it is computed from. On the
/// processor it is 1e-12 (`FAR` in `tesdf::collide::field`), because simple shapes are in `f64`.
const SIMPLE_ROUNDING: f32 = 1e-6;

/// Meshlets per block: one for each thread of a group.
pub const MESHLETS_OF_BLOCK: u32 = LANES;
/// Largest number of faces of a meshlet: one for each thread of a group.
pub const FACES_OF_MESHLET: u32 = LANES;

/// A list of blocks, or of meshlets, of ordered pairs.
#[derive(CubeType, CubeLaunch)]
pub struct Blocks {
    /// Two words for each: ordered pair, first meshlet.
    pub words: Box<[u32]>,
    /// Capacity of the list.
    pub room: u32,
}

/// Words of a block, and of a meshlet of an ordered pair.
pub const WORDS: u32 = 2;

#[cube]
impl Blocks {
    /// Writes a block or a meshlet, when there is room.
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

/// The work of a group after the broad phase: the faces of a meshlet, in the field of the other
/// instance. Each thread takes a face.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct MeshletWork<'a> {
    pub pair: OrderedPair,
    pub meshlet: u32,
    /// The shape that has the meshlet.
    pub surface: Field<'a>,
    /// The shape in whose field the faces are tested.
    pub field: Field<'a>,
}

/// Reads the meshlet at index `item` of a list.
#[cube]
pub fn meshlet_work<'a>(
    shapes: &'a Shapes,
    pairs: &OrderedPairs,
    meshlets: &Blocks,
    item: u32,
) -> MeshletWork<'a> {
    let pair = pairs.get(meshlets.pair(item));
    MeshletWork::<'a> {
        pair,
        meshlet: meshlets.meshlet(item),
        surface: shapes.field(pair.shape_a),
        field: shapes.field(pair.shape_b),
    }
}

#[cube]
impl MeshletWork<'_> {
    /// Number of faces of the meshlet.
    pub fn faces(self) -> u32 {
        self.surface.faces_of(self.meshlet)
    }

    /// Face `number` of the meshlet.
    pub fn face(self, number: u32) -> u32 {
        self.surface.first_face(self.meshlet) + number
    }
}

#[cube]
impl Field<'_> {
    /// Whether each point within `radius` of `p` has a signed distance above `reach`. The test may
    /// miss such cases. With `prune` 0 it finds only points outside of the bounds.
    pub fn is_beyond(self, p: V3, radius: f32, reach: f32, prune: u32) -> bool {
        let limit = radius + reach;
        if self.is_mesh() {
            self.mesh_is_beyond(p, limit, prune)
        } else {
            let distance = self.simple_value(p).distance;
            distance > limit + SIMPLE_ROUNDING * (p.abs().greatest() + distance.abs())
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
                // Distances to truncated lists rule nothing out. There the face tree answers.
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

/// Finds the meshlets that can touch. A group takes a block, and a thread takes a meshlet.
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
                let radius = pair.scale * ball.radius;
                kept = !field.is_beyond(center, radius, pairs.reach_around(pair, center, radius), prune);
            }
            if kept {
                let at = counters.append(counters::MESHLETS);
                meshlets.put(at, pair.number, meshlet);
            }
        }
    }
}
