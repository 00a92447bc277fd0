//! Pairs of instances of one world whose bounds meet, as `tesdf::collide::instance_pairs` finds
//! them.
use cubecl::prelude::*;

use crate::kernels::counters::{BADLY_MOVED, BLOCKS, Counters, ORDERED_PAIRS};
use crate::kernels::detect::ordered_pair::{OrderedPair, OrderedPairs};
use crate::kernels::geometry::vector::{Row, V3, row_of, v3, xyz};
use crate::kernels::pairs::ahead::{self, Ahead, Approach, ROWS as MOTION_ROWS};
use crate::kernels::pairs::meshlets::{Blocks, MESHLETS_OF_BLOCK};
use crate::kernels::query::nearest::FAR;
use crate::kernels::scene::pose::{FarPoint, Pose, ROWS as POSE_ROWS, pose};
use crate::kernels::scene::shape::{BAD_VERTEX, KIND, MESHLET_COUNT, NONE, PLANE, ROUND, SIZES, Shapes};

/// The instances of a scene. The instances of a world are consecutive.
#[derive(CubeType, CubeLaunch)]
pub struct Instances {
    /// A pose for each instance, then a motion for each.
    pub rows: Box<[Row]>,
    /// [`INSTANCE_WORDS`] words for each: shape, end of the world, memberships, filter, 1 when it
    /// is still.
    pub words: Box<[u32]>,
    pub count: u32,
    pub contact_distance: f32,
}

/// Rows of an instance.
pub const INSTANCE_ROWS: u32 = POSE_ROWS + MOTION_ROWS;
/// Words of an instance.
pub const INSTANCE_WORDS: u32 = 5;
/// Rows of an instance's bounds: center as high and low `f32`, half extents.
pub const BOUNDS_ROWS: u32 = 3;

/// Pairs of instances, two words each, sorted.
#[derive(CubeType, CubeLaunch)]
pub struct Pairs {
    pub words: Box<[u32]>,
    pub count: u32,
}

/// The buffers for pairs of instances and their blocks.
#[derive(CubeType, CubeLaunch)]
pub struct Found {
    pub pairs: OrderedPairs,
    pub blocks: Blocks,
}

/// The collision groups of an instance.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Groups {
    memberships: u32,
    filter: u32,
}

#[cube]
impl Groups {
    fn meet(self, other: Groups) -> bool {
        (self.memberships & other.filter) != 0u32 && (other.memberships & self.filter) != 0u32
    }
}

#[cube]
impl Instances {
    fn shape(&self, instance: u32) -> u32 {
        self.words[(instance * INSTANCE_WORDS) as usize]
    }

    /// The index after the last instance of this instance's world.
    fn end_of_world(&self, instance: u32) -> u32 {
        self.words[(instance * INSTANCE_WORDS + 1u32) as usize]
    }

    fn groups(&self, instance: u32) -> Groups {
        let at = (instance * INSTANCE_WORDS) as usize;
        Groups { memberships: self.words[at + 2], filter: self.words[at + 3] }
    }

    /// Whether two instances are still, so that they are no pair.
    fn are_still(&self, i: u32, j: u32) -> bool {
        let (first, second) = ((i * INSTANCE_WORDS + 4u32) as usize, (j * INSTANCE_WORDS + 4u32) as usize);
        self.words[first] == 1u32 && self.words[second] == 1u32
    }

    fn pose(&self, instance: u32) -> Pose {
        pose(&self.rows, instance)
    }

    /// The row of an instance's motion.
    fn row_of_motion(&self, instance: u32) -> u32 {
        self.count * POSE_ROWS + instance * MOTION_ROWS
    }

    fn ahead(&self, instance: u32) -> Ahead {
        ahead::ahead(&self.rows, self.row_of_motion(instance), self.pose(instance))
    }

    /// The greatest distance that the velocity can move a point of an instance.
    fn motion(&self, instance: u32) -> f32 {
        ahead::motion(&self.rows, self.row_of_motion(instance))
    }

    /// The contact distance of a pair.
    fn contact_distance_of(&self, i: u32, j: u32) -> f32 {
        self.contact_distance + self.ahead(i).closing(self.ahead(j))
    }

    /// The motion of the points of `a` as `b` sees it, in its field's frame. Its rest contains the
    /// contact distance.
    fn approach(&self, a: u32, b: u32) -> Approach {
        let to = self.pose(b);
        let found = self.ahead(a).approach(self.ahead(b), to);
        Approach {
            way: found.way,
            turn: found.turn,
            rest: found.rest + self.contact_distance / to.unit,
            is_over_plane: found.is_over_plane,
        }
    }
}

#[cube]
impl Pairs {
    /// Whether the list has this pair.
    fn contain(&self, a: u32, b: u32) -> bool {
        let mut low = 0u32;
        let mut high = self.count;
        let mut found = false;
        while low < high {
            let middle = (low + high) / 2u32;
            let x = self.words[(2u32 * middle) as usize];
            let y = self.words[(2u32 * middle + 1u32) as usize];
            let is_less = x < a || (x == a && y < b);
            found = found || (x == a && y == b);
            low = select(is_less, middle + 1u32, low);
            high = select(is_less, high, middle);
        }
        found
    }
}

/// Half extent of a plane.
const ENDLESS: f32 = FAR;

/// Bounds grow by this fraction, relative to their half extents and to the vector from the origin
/// of the field to the center. This is more than the rounding error in `f32`. The processor grows
/// its bounds by 8 ulps of `f64` (`ULPS` in `tesdf::collide::instance_pairs`).
const GROWN: f32 = 2e-6;

/// Computes the bounds of an instance per thread, in the world. Counts the instances of shapes with
/// a vertex that was moved to an invalid position.
#[cube(launch, create_dummy_kernel)]
pub fn instance_bounds(shapes: &Shapes, instances: &Instances, counters: &Counters, bounds: &mut [Row]) {
    let i = ABSOLUTE_POS as u32;
    if i < instances.count {
        let field = shapes.field(instances.shape(i));
        let own = field.bounds();
        let half = (own.high - own.low) * 0.5f32;
        let at = instances.pose(i);
        let off = at.rotation.rotate(((own.low + own.high) * 0.5f32) * at.unit);
        let x = at.rotation.rotate(v3(at.unit * half.x, 0.0f32, 0.0f32));
        let y = at.rotation.rotate(v3(0.0f32, at.unit * half.y, 0.0f32));
        let z = at.rotation.rotate(v3(0.0f32, 0.0f32, at.unit * half.z));
        let reach = (x.abs() + y.abs()) + z.abs();
        let more = GROWN * (off.length() + reach.length());
        let endless = field.entry(KIND) == PLANE;
        let to = (i * BOUNDS_ROWS) as usize;
        bounds[to] = row_of(at.origin.high, 0.0f32);
        bounds[to + 1] = row_of(at.origin.low + off, 0.0f32);
        let grown = v3(
            select(endless, ENDLESS, reach.x + more),
            select(endless, ENDLESS, reach.y + more),
            select(endless, ENDLESS, reach.z + more),
        );
        bounds[to + 2] = row_of(grown, 0.0f32);
        if field.entry(BAD_VERTEX) != NONE {
            counters.append(BADLY_MOVED);
        }
    }
}

/// Bounds in the world frame.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct WorldBounds {
    center: FarPoint,
    half: V3,
}

#[cube]
impl WorldBounds {
    /// The greatest gap between the bounds along an axis; negative when they overlap.
    fn gap(self, other: WorldBounds) -> f32 {
        (other.center.from(self.center).abs() - (self.half + other.half)).greatest()
    }
}

#[cube]
fn world_bounds(rows: &[Row], instance: u32) -> WorldBounds {
    let at = (instance * BOUNDS_ROWS) as usize;
    WorldBounds { center: FarPoint { high: xyz(rows[at]), low: xyz(rows[at + 1]) }, half: xyz(rows[at + 2]) }
}

/// Tests the bounds of one instance per thread against all later instances of its world. Two are a
/// pair when their bounds are within their contact distance.
#[cube(launch, create_dummy_kernel)]
pub fn instance_pairs(
    shapes: &Shapes,
    instances: &Instances,
    bounds: &[Row],
    excluded: &Pairs,
    counters: &Counters,
    found: &mut Found,
) {
    let i = ABSOLUTE_POS as u32;
    if i < instances.count {
        let is_plane = shapes.field(instances.shape(i)).entry(KIND) == PLANE;
        let groups = instances.groups(i);
        let own = world_bounds(bounds, i);
        let widest = instances.contact_distance + instances.motion(i);
        let end = instances.end_of_world(i);
        let mut j = i + 1u32;
        while j < end {
            let other = world_bounds(bounds, j);
            let gap = own.gap(other);
            let meet = groups.meet(instances.groups(j)) && !instances.are_still(i, j);
            let planes = is_plane && shapes.field(instances.shape(j)).entry(KIND) == PLANE;
            // Only bodies that are near each other are worth the bound of their relative motion.
            if gap <= widest + instances.motion(j) && meet && !planes && !excluded.contain(i, j) {
                let distance = instances.contact_distance_of(i, j);
                if gap <= distance {
                    write_pair(shapes, instances, counters, found, distance, i, j);
                }
            }
            j += 1u32;
        }
    }
}

/// Takes over one pair of instances per thread from the list that the processor found.
#[cube(launch, create_dummy_kernel)]
pub fn given_pairs(
    shapes: &Shapes,
    instances: &Instances,
    pairs: &Pairs,
    counters: &Counters,
    found: &mut Found,
) {
    let pair = ABSOLUTE_POS as u32;
    if pair < pairs.count {
        let i = pairs.words[(2u32 * pair) as usize];
        let j = pairs.words[(2u32 * pair + 1u32) as usize];
        let distance = instances.contact_distance_of(i, j);
        write_pair(shapes, instances, counters, found, distance, i, j);
    }
}

/// Writes both ordered pairs of two instances, with their blocks. Signed distances up to `distance`
/// are contacts.
#[cube]
fn write_pair(
    shapes: &Shapes,
    instances: &Instances,
    counters: &Counters,
    found: &mut Found,
    distance: f32,
    i: u32,
    j: u32,
) {
    let at = counters.add(ORDERED_PAIRS, 2u32);
    if at + 2u32 <= found.pairs.room {
        let first = ordered_pair(shapes, instances, distance, at, i, j);
        found.pairs.put(first, instances.approach(i, j));
        let second = ordered_pair(shapes, instances, distance, at + 1u32, j, i);
        found.pairs.put(second, instances.approach(j, i));
        write_blocks(shapes, counters, &mut found.blocks, at, instances.shape(i));
        write_blocks(shapes, counters, &mut found.blocks, at + 1u32, instances.shape(j));
    }
}

#[cube]
fn write_blocks(shapes: &Shapes, counters: &Counters, blocks: &mut Blocks, pair: u32, shape: u32) {
    let meshlets = shapes.field(shape).entry(MESHLET_COUNT);
    let count = (meshlets + MESHLETS_OF_BLOCK - 1u32) / MESHLETS_OF_BLOCK;
    let first = counters.add(BLOCKS, count);
    let mut k = 0u32;
    while k < count {
        blocks.put(first + k, pair, k * MESHLETS_OF_BLOCK);
        k += 1u32;
    }
}

/// The ordered pair of the surface of `a` and the field of `b`: point in the field = linear · p +
/// shift. Signed distances up to `distance` are contacts.
#[cube]
fn ordered_pair(
    shapes: &Shapes,
    instances: &Instances,
    distance: f32,
    number: u32,
    a: u32,
    b: u32,
) -> OrderedPair {
    let (from, to) = (instances.pose(a), instances.pose(b));
    let scale = from.unit / to.unit;
    let x = column(from, to, scale, v3(1.0f32, 0.0f32, 0.0f32));
    let y = column(from, to, scale, v3(0.0f32, 1.0f32, 0.0f32));
    let z = column(from, to, scale, v3(0.0f32, 0.0f32, 1.0f32));
    let surface = shapes.field(instances.shape(a));
    let is_round = surface.entry(KIND) == ROUND;
    let around = select(is_round, surface.number(comptime!(SIZES + 1)), surface.half_thickness());
    OrderedPair {
        number,
        a,
        b,
        shape_a: instances.shape(a),
        shape_b: instances.shape(b),
        x: v3(x.x, y.x, z.x),
        y: v3(x.y, y.y, z.y),
        z: v3(x.z, y.z, z.z),
        shift: to.to_local(from.origin),
        scale,
        reach: distance / to.unit,
        radius: scale * around + shapes.field(instances.shape(b)).half_thickness(),
        own_radius: scale * around,
    }
}

/// Transforms a unit vector from the frame of `from` to the frame of `to`.
#[cube]
fn column(from: Pose, to: Pose, scale: f32, axis: V3) -> V3 {
    to.rotation.rotate_back(from.rotation.rotate(axis)) * scale
}
