//! Buffers of a device, and the number of groups of a launch.
use cubecl::prelude::*;
use cubecl::server::Handle;

use crate::kernels::counters::MAX_GROUPS;

/// The number of groups of a launch. A dimension of a launch is limited, so more than
/// [`MAX_GROUPS`] groups are spread over two dimensions, and there may then be a few groups too
/// many.
pub(crate) fn spread(groups: u32) -> CubeCount {
    let wide = groups.clamp(1, MAX_GROUPS);
    CubeCount::Static(wide, groups.div_ceil(wide).max(1), 1)
}

/// A named block of memory on a device.
#[derive(Clone)]
pub(crate) struct Buffer {
    pub(super) name: &'static str,
    pub(super) handle: Handle,
    pub(super) bytes: usize,
}

impl Buffer {
    /// This buffer as an argument of a kernel, as elements of `size` bytes.
    pub fn argument(&self, size: usize) -> BufferArg {
        // SAFETY: the buffer has this number of elements, and every bit pattern is a valid number.
        unsafe { BufferArg::from_raw_parts(self.handle.clone(), self.bytes / size) }
    }

    /// This buffer as an argument of a kernel that takes `u32` or `f32`.
    pub fn words(&self) -> BufferArg {
        self.argument(4)
    }

    /// This buffer as an argument of a kernel that takes rows of four `f32`.
    pub fn rows(&self) -> BufferArg {
        self.argument(16)
    }

    /// This buffer as the number of groups of an indirect launch: x, y and z.
    pub fn count(&self) -> CubeCount {
        CubeCount::Dynamic(self.handle.clone().binding())
    }

    /// Name of the buffer: says what it contains.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}
