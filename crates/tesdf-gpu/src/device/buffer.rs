//! Buffers of a device, and launches over them.
use cubecl::prelude::*;
use cubecl::server::Handle;

/// Groups of a launch, in two dimensions where they are more than one holds.
pub(crate) fn spread(groups: u32) -> CubeCount {
    let wide = groups.clamp(1, 32768);
    CubeCount::Static(wide, groups.div_ceil(wide).max(1), 1)
}

/// Memory of a device.
#[derive(Clone)]
pub(crate) struct Buffer {
    pub(super) name: &'static str,
    pub(super) handle: Handle,
    pub(super) bytes: usize,
}

impl Buffer {
    /// For a kernel, as elements of `size` bytes.
    pub fn argument(&self, size: usize) -> BufferArg {
        // SAFETY: the buffer has that many elements, of plain numbers.
        unsafe { BufferArg::from_raw_parts(self.handle.clone(), self.bytes / size) }
    }

    /// For a kernel that takes words or `f32`.
    pub fn words(&self) -> BufferArg {
        self.argument(4)
    }

    /// For a kernel that takes rows of four `f32`.
    pub fn rows(&self) -> BufferArg {
        self.argument(16)
    }

    /// As the number of groups of a launch: x, y, z.
    pub fn count(&self) -> CubeCount {
        CubeCount::Dynamic(self.handle.clone().binding())
    }

    /// Its contents.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}
