//! The list of all kernels, in each variant that the host launches.
//!
//! What has to be done to every kernel, such as compiling it for CUDA, is done to this list. A test fails for a kernel that is not on it.
use std::sync::Arc;

use cubecl::ir::{DeviceProperties, TargetProperties};
use cubecl::prelude::*;
use cubecl::server::Handle;
use cubecl_common::device::{DeviceId, ServiceId};
use cubecl_environment::stream::StreamId;

use super::assets::AssetsLaunch;
use super::{
    broad, choice, clip, deform, exact, hidden, members, narrow, outside, pairs, products, query, reduce,
    sample,
};

use crate::cuda::Count;

/// A kernel that can be compiled.
pub struct Named {
    /// Its name, with the comptime arguments of the variant.
    pub name: String,
    /// How the host launches it.
    pub count: Count,
    pub kernel: Box<dyn CubeKernel>,
}

/// All of them.
pub fn kernels(device: &Arc<DeviceProperties>, target: &Arc<TargetProperties>) -> Vec<Named> {
    let mut all = Vec::new();
    /// How it is launched, kernel, threads of a group, arguments as in the Rust function; what follows `;` tells variants apart.
    macro_rules! kernel {
        ($count:ident $($path:ident)::+, $threads:expr, ($($argument:expr),* $(,)?) $(; $variant:expr)?) => {
            all.push(Named {
                count: Count::$count,
                name: [stringify!($($path)::+).replace(' ', ""), $(format!(" {}", $variant))?].concat(),
                kernel: Box::new($($path)::+::create_dummy_kernel(
                    device.clone(),
                    target.clone(),
                    CubeCount::Static(1, 1, 1),
                    CubeDim::new_1d($threads),
                    $($argument),*
                )),
            })
        };
    }
    let counted =
        [products::BLOCKS, products::MESHLETS, products::POLYGONS, products::CONTACTS, products::TOUCHING];
    kernel!(Direct pairs::instance_bounds, 64, (assets(), rows(), words(), words(), rows(), 1, 0.0));
    kernel!(
        Direct pairs::instance_pairs,
        64,
        (assets(), rows(), rows(), words(), words(), words(), words(), rows(), words(), 1, 0, 0.0, 1, 1)
    );
    kernel!(
        Direct pairs::given_pairs,
        64,
        (assets(), rows(), words(), words(), words(), words(), rows(), words(), 1, 0.0, 1, 1)
    );
    kernel!(Direct deform::follow, 64, (words(), words(), rows(), words(), rows(), 0));
    kernel!(Direct deform::refit, deform::GROUP, (words(), words(), rows(), words(), rows(), 0));
    for product in counted {
        kernel!(Direct products::groups_for, 1, (words(), words(), 1, 1, product); product);
    }
    let group = narrow::LANES;
    kernel!(Indirect broad::meshlets, group, (assets(), words(), rows(), words(), words(), words(), 1, 1, 1));
    kernel!(Indirect clip::nodes, group, (assets(), words(), rows(), words(), words(), words(), 1, 1, 1));
    kernel!(
        Indirect clip::polygons,
        group,
        (assets(), words(), rows(), words(), words(), words(), rows(), 1, 1, 1)
    );
    kernel!(
        Indirect hidden::hidden,
        group,
        (assets(), words(), rows(), words(), words(), words(), 1, 1)
    );
    kernel!(
        Indirect outside::outside_polygons,
        group,
        (assets(), words(), rows(), words(), words(), words(), rows(), 1, 1, 1)
    );
    kernel!(
        Indirect narrow::narrow_nodes,
        64,
        (assets(), words(), rows(), words(), words(), words(), rows(), 1, 1)
    );
    for (lanes, planes, counting) in [
        (group, true, false),
        (group, false, false),
        (1, true, false),
        (1, false, false),
        (group, true, true),
        (group, false, true),
        (1, true, true),
        (1, false, true),
    ] {
        kernel!(
            Indirect narrow::narrow_faces, group,
            (assets(), words(), rows(), words(), rows(), words(), words(), rows(), 1, 0.0, 1, 1, lanes, planes, counting);
            format!(
                "{lanes} lanes, {}{}",
                if planes { "planes" } else { "shared memory" },
                if counting { ", counting" } else { "" }
            )
        );
    }
    kernel!(
        Indirect exact::narrow_exact,
        group,
        (assets(), words(), rows(), words(), rows(), words(), words(), rows(), words(), 0.0, 1, 1)
    );
    kernel!(Direct members::clear, members::GROUP, (words(), 1));
    kernel!(Indirect members::count, members::GROUP, (words(), words(), words(), 1));
    kernel!(Direct members::place, members::GROUP, (words(), words(), words(), words(), 1));
    kernel!(
        Indirect members::fill,
        members::GROUP,
        (words(), rows(), words(), rows(), words(), words(), words(), rows(), 1)
    );
    kernel!(
        Indirect reduce::reduce,
        choice::GROUP,
        (words(), rows(), words(), words(), words(), rows(), rows(), words(), rows(), 1, 1, 1)
    );
    kernel!(Direct query::signed_distances, 64, (assets(), rows(), words(), rows(), rows(), words(), 1, 0, 1));
    kernel!(
        Direct query::world_distances,
        64,
        (assets(), rows(), words(), words(), words(), words(), words(), words(), 1, 1)
    );
    kernel!(
        Direct sample::sample,
        sample::GROUP as u32,
        (rows(), rows(), words(), words(), words(), 1, 1, 0, 1)
    );
    all
}

fn assets() -> AssetsLaunch {
    AssetsLaunch::new(words(), words(), rows())
}

/// A buffer of words or `f32`.
fn words() -> BufferArg {
    buffer(4)
}

/// A buffer of rows of four `f32`.
fn rows() -> BufferArg {
    buffer(1)
}

/// A buffer of 16 bytes that is nowhere: a kernel's text does not depend on it.
fn buffer(elements: usize) -> BufferArg {
    let nowhere = ServiceId::of::<Named>(DeviceId::new(0, 0));
    let handle = Handle::new(nowhere, StreamId::current(), 16);
    // SAFETY: nothing is launched with it.
    unsafe { BufferArg::from_raw_parts(handle, elements) }
}
