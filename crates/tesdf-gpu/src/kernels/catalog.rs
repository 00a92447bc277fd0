//! The list of all kernels, in each variant that the host launches.
//!
//! Checks of all kernels, such as compiling them for CUDA, iterate over this list. A test fails
//! when a kernel is missing from it.
use std::sync::Arc;

use cubecl::ir::{DeviceProperties, TargetProperties};
use cubecl::prelude::*;
use cubecl::server::Handle;
use cubecl_common::device::{DeviceId, ServiceId};
use cubecl_environment::stream::StreamId;

use super::{GROUP, bodies, cones, deform, detect, encode, interior, narrow, pairs, query, report, scene};
use crate::kernels::counters::{self, CountersLaunch};
use crate::kernels::deform::bounds::MovingLaunch;
use crate::kernels::detect::candidates::{ItemsLaunch, PolygonsLaunch};
use crate::kernels::detect::ordered_pair::OrderedPairsLaunch;
use crate::kernels::encode::sampled::SamplesLaunch;
use crate::kernels::interior::problem::{MemoryLaunch, ProblemsLaunch};
use crate::kernels::narrow::exact::AskedExactLaunch;
use crate::kernels::narrow::exchange::{LANES, Variant};
use crate::kernels::narrow::frank_wolfe::AskedLaunch;
use crate::kernels::pairs::instance_pairs::{FoundLaunch, InstancesLaunch, PairsLaunch};
use crate::kernels::pairs::meshlets::BlocksLaunch;
use crate::kernels::query::batch;
use crate::kernels::report::contact::ContactsLaunch;
use crate::kernels::report::reduce::members::{MembersLaunch, TouchingLaunch};
use crate::kernels::report::world_contacts::WorldContactsLaunch;
use crate::kernels::scene::pose_arrays::PoseArraysLaunch;
use crate::kernels::scene::shape::{FansLaunch, Rules, ShapesLaunch};

/// Source of the number of blocks of a launch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Count {
    /// The host knows the number.
    Direct,
    /// A buffer on the device holds the number (an indirect dispatch).
    Indirect,
}

/// A kernel in one variant, ready to be compiled.
pub struct Named {
    /// Name of the kernel, with the comptime arguments of the variant.
    pub name: String,
    /// Source of the number of groups when the host launches it.
    pub count: Count,
    pub kernel: Box<dyn CubeKernel>,
}

/// Adds kernels to a list. For each kernel: the source of the number of groups, the function, the
/// threads per group, and the arguments of the Rust function. The text after `;` names the variant.
macro_rules! kernels {
    ($all:ident, $device:ident, $target:ident;
     $($count:ident $($path:ident)::+, $threads:expr, ($($argument:expr),* $(,)?) $(; $variant:expr)?;;)*) => {
        $($all.push(Named {
            count: Count::$count,
            name: [stringify!($($path)::+).replace(' ', ""), $(format!(" {}", $variant))?].concat(),
            kernel: Box::new($($path)::+::create_dummy_kernel(
                $device.clone(),
                $target.clone(),
                CubeCount::Static(1, 1, 1),
                CubeDim::new_1d($threads),
                $($argument),*
            )),
        });)*
    };
}

type Device = Arc<DeviceProperties>;
type Target = Arc<TargetProperties>;

/// All kernels in all variants.
pub fn kernels(device: &Device, target: &Target) -> Vec<Named> {
    let mut all = Vec::new();
    add_shapes(&mut all, device, target);
    add_pairs(&mut all, device, target);
    add_bodies(&mut all, device, target);
    add_narrow(&mut all, device, target);
    add_report(&mut all, device, target);
    add_islands(&mut all, device, target);
    all
}

/// Adds the kernels of queries, deformation and encoding.
fn add_shapes(all: &mut Vec<Named>, device: &Device, target: &Target) {
    let instances = || batch::InstancesLaunch::new(rows(), words());
    let answers = || batch::AnswersLaunch::new(rows(), words());
    let world = || batch::WorldAnswersLaunch::new(words(), words(), words(), words());
    let moving = || MovingLaunch::new(words(), words(), rows(), words(), rows(), 0);
    let samples = || SamplesLaunch::new(rows(), rows(), words(), words(), 1, 1);
    let batch = batch::BatchLaunch::new(1, 0, 1);
    let group = encode::sampled::GROUP as u32;
    kernels!(all, device, target;
        Direct query::batch::signed_distances, GROUP, (shapes(), instances(), rows(), answers(), batch);;
        Direct query::batch::world_distances, GROUP, (shapes(), instances(), words(), world(), 1, 1);;
        Direct deform::move_vertices::follow, GROUP, (moving());;
        Direct deform::refit::refit, deform::refit::GROUP, (moving());;
        Direct encode::sampled::sample, group, (samples(), words(), 0, 1);;
    );
}

/// Adds the kernels of the broad phase, and those that compute the number of groups of a launch.
fn add_pairs(all: &mut Vec<Named>, device: &Device, target: &Target) {
    let instances = || InstancesLaunch::new(rows(), words(), 1, 0.0);
    let some = || PairsLaunch::new(words(), 0);
    let found = || FoundLaunch::new(pairs(), blocks());
    let given = || PoseArraysLaunch::new(words(), words(), rows(), words(), 1, 1, 1.0);
    kernels!(all, device, target;
        Direct scene::pose_arrays::place, GROUP, (given(), counters(), rows());;
        Direct pairs::instance_pairs::instance_bounds, GROUP, (shapes(), instances(), counters(), rows());;
        Direct pairs::instance_pairs::instance_pairs, GROUP, (shapes(), instances(), rows(), some(), counters(), found());;
        Direct pairs::instance_pairs::given_pairs, GROUP, (shapes(), instances(), some(), counters(), found());;
        Indirect pairs::meshlets::meshlets, LANES, (shapes(), pairs(), blocks(), counters(), blocks(), 1);;
    );
    for counter in
        [counters::BLOCKS, counters::MESHLETS, counters::POLYGONS, counters::CONTACTS, counters::TOUCHING]
    {
        kernels!(all, device, target;
            Direct counters::groups_for, 1, (counters(), words(), 1, 1, 1, counter); counter;;
        );
    }
}

/// Adds the kernels of the middle phase: nodes, polygons and hidden overlaps.
fn add_bodies(all: &mut Vec<Named>, device: &Device, target: &Target) {
    kernels!(all, device, target;
        Indirect bodies::nodes::nodes, LANES, (shapes(), pairs(), blocks(), counters(), items(), 1);;
        Indirect bodies::faces::whole_faces, LANES, (shapes(), pairs(), blocks(), counters(), items(), 1);;
        Indirect bodies::clip::clip_polygons, LANES,
            (shapes(), pairs(), blocks(), counters(), polygons(), 1);;
        Indirect bodies::outside::outside_polygons, LANES,
            (shapes(), pairs(), blocks(), counters(), polygons(), 1);;
        Indirect detect::hidden::hidden, LANES, (shapes(), pairs(), blocks(), counters(), words(), 1);;
    );
}

/// Adds the kernels of the narrow phase.
fn add_narrow(all: &mut Vec<Named>, device: &Device, target: &Target) {
    let exact = || AskedExactLaunch::new(words(), 0.0);
    let fans = || FansLaunch::new(words());
    let at_points = Rules { at_points: true, ..Rules::default() };
    let asked = || AskedLaunch::new(1, 0.0);
    let in_world = || WorldContactsLaunch::new(words(), words(), words(), words(), words());
    kernels!(all, device, target;
        Direct report::order::begin, GROUP, (words(), 1);;
        Direct report::order::merge, GROUP, (contacts(), words(), words(), 1, 1);;
        Direct report::world_contacts::to_world, GROUP, (contacts(), words(), rows(), words(), in_world(), 1);;
        Indirect cones::contact::in_cones, GROUP, (shapes(), fans(), pairs(), words(), counters(), contacts());;
        Indirect narrow::nodes::narrow_nodes, GROUP, (shapes(), pairs(), items(), counters(), contacts());;
        Indirect narrow::exact::narrow_exact, LANES,
            (shapes(), pairs(), polygons(), counters(), contacts(), exact(), false);;
        Indirect narrow::exact::narrow_exact, LANES,
            (shapes(), pairs(), polygons(), counters(), contacts(), exact(), true); "counting";;
        Indirect narrow::exact_faces::narrow_exact_faces, LANES,
            (shapes(), pairs(), polygons(), counters(), contacts(), exact(), false);;
        Indirect narrow::exact_faces::narrow_exact_faces, LANES,
            (shapes(), pairs(), polygons(), counters(), contacts(), exact(), true); "counting";;
        Indirect narrow::exact_faces::narrow_exact_faces, LANES,
            (shapes_with(at_points), pairs(), polygons(), counters(), contacts(), exact(), false); "with rules";;
    );
    for counting in [false, true] {
        for lanes in [LANES, 1] {
            for subgroups in [true, false] {
                let variant = Variant { lanes, subgroups, counting };
                let exchange = if subgroups { "subgroups" } else { "shared memory" };
                let counting = if counting { ", counting" } else { "" };
                kernels!(all, device, target;
                    Indirect narrow::frank_wolfe::narrow_faces, LANES,
                        (shapes(), pairs(), polygons(), counters(), contacts(), asked(), variant);
                        format!("{lanes} lanes, {exchange}{counting}");;
                );
            }
        }
    }
}

/// Adds the kernels of the reduction.
fn add_report(all: &mut Vec<Named>, device: &Device, target: &Target) {
    let group = report::reduce::members::GROUP;
    let touching = || TouchingLaunch::new(words(), 1);
    let members = || MembersLaunch::new(words(), rows());
    kernels!(all, device, target;
        Direct report::reduce::members::clear, group, (words(), 1);;
        Indirect report::reduce::members::count, group, (contacts(), counters(), words());;
        Direct report::reduce::members::allot, group, (pairs(), counters(), words(), touching());;
        Indirect report::reduce::members::fill, group, (pairs(), contacts(), counters(), words(), members());;
        Indirect report::reduce::selection::reduce, report::reduce::choice::GROUP,
            (contacts(), counters(), touching(), members(), rows(), contacts(), 1);;
    );
}

/// Adds the kernel of the dynamics.
fn add_islands(all: &mut Vec<Named>, device: &Device, target: &Target) {
    let numbers = || buffer(2);
    let problems = ProblemsLaunch::new(words(), words(), numbers());
    let memory = MemoryLaunch::new(numbers(), numbers(), numbers(), numbers());
    kernels!(all, device, target;
        Direct interior::descend::descend, interior::problem::GROUP, (problems, memory);;
    );
}

fn shapes() -> ShapesLaunch {
    shapes_with(Rules::default())
}

fn shapes_with(rules: Rules) -> ShapesLaunch {
    ShapesLaunch::new(words(), words(), rows(), rules)
}

fn counters() -> CountersLaunch {
    CountersLaunch::new(words())
}

fn pairs() -> OrderedPairsLaunch {
    OrderedPairsLaunch::new(words(), rows(), 1)
}

fn blocks() -> BlocksLaunch {
    BlocksLaunch::new(words(), 1)
}

fn items() -> ItemsLaunch {
    ItemsLaunch::new(words(), 1)
}

fn polygons() -> PolygonsLaunch {
    PolygonsLaunch::new(items(), rows())
}

fn contacts() -> ContactsLaunch {
    ContactsLaunch::new(words(), rows(), 1)
}

/// A buffer of `u32` or `f32`.
fn words() -> BufferArg {
    buffer(4)
}

/// A buffer of rows of four `f32`.
fn rows() -> BufferArg {
    buffer(1)
}

/// A buffer of 16 bytes without memory. The text of a kernel does not depend on its buffers.
fn buffer(elements: usize) -> BufferArg {
    let nowhere = ServiceId::of::<Named>(DeviceId::new(0, 0));
    let handle = Handle::new(nowhere, StreamId::current(), 16);
    // SAFETY: no launch uses this buffer.
    unsafe { BufferArg::from_raw_parts(handle, elements) }
}
