use tesdf::glam::{DVec3, USizeVec3};

/// Voxels along an edge of a block.
pub(super) const BLOCK: usize = 8;
/// Samples along an edge of a block.
pub(super) const SIDE: usize = BLOCK + 1;
/// Samples of a block.
pub(super) const SAMPLES: usize = SIDE * SIDE * SIDE;
/// Slot of a block without samples of its own.
pub(super) const NO_SLOT: u32 = u32::MAX;

/// Signed distances of a mesh at the corners of cubic voxels, in the unit and frame of the mesh.
///
/// ```text
///  ┌───────────────┬───────────────┐   coarse samples: at the corners of all blocks
///  │               │ ┼─┼─┼─┼─┼─┼─┼─│   fine samples: at the corners of the 8³ voxels of a block
///  │   far block   │ ┼─near block┼─┼─│                 that comes near the surface
///  │               │ ┼─┼─┼─┼─┼─┼─┼─│
///  └───────────────┴───────────────┘
/// ```
///
/// This is the layout of PhysX, which Isaac Sim uses: a background grid, and blocks of 8³ voxels
/// with their own 9³ samples where the surface is nearer than the *narrow band*. Within the narrow
/// band every value equals that of a dense grid. Beyond it a value is interpolated between the
/// exact distances at the corners of the block, so it has the error of a grid of eight times the
/// spacing. A [dense](Self::dense_bytes) grid would be as fine there as near the surface.
///
/// Samples are exact distances, rounded to `f32`. Outside the grid, the value is that of the
/// nearest point of the grid plus the distance from it, which is an upper bound of the distance up
/// to interpolation.
#[derive(Clone, Debug)]
pub struct VoxelGrid {
    pub(super) origin: DVec3,
    pub(super) voxel: f64,
    /// Voxels along each axis; a part of the last blocks may lie beyond them.
    pub(super) voxels: USizeVec3,
    pub(super) blocks: USizeVec3,
    pub(super) narrow_band: f64,
    /// Values at the corners of the blocks, x fastest.
    pub(super) coarse: Vec<f32>,
    /// For each block the number of its samples in `fine`, or [`NO_SLOT`].
    pub(super) slots: Vec<u32>,
    pub(super) fine: Vec<f32>,
}

/// The value of a grid at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelValue {
    /// Interpolated signed distance.
    pub distance: f64,
    /// Gradient of the interpolated distance; not of unit length.
    pub gradient: DVec3,
    /// Upper bound of the difference between [`distance`](Self::distance) and the exact distance.
    pub slack: f64,
    /// Number of the block in which the point lies, or the nearest block.
    pub block: u32,
}

impl VoxelGrid {
    /// Edge of a voxel.
    pub fn voxel(&self) -> f64 {
        self.voxel
    }

    /// Up to this distance from the surface, values are those of a dense grid.
    pub fn narrow_band(&self) -> f64 {
        self.narrow_band
    }

    /// Samples along each axis of the dense grid.
    pub fn samples(&self) -> [u64; 3] {
        self.voxels.to_array().map(|n| n as u64 + 1)
    }

    /// Memory of a dense grid with a 32-bit float for each sample, in bytes.
    pub fn dense_bytes(&self) -> u64 {
        size_of::<f32>() as u64 * self.samples().iter().product::<u64>()
    }

    /// Memory of this grid, in bytes: coarse samples, samples of near blocks, and a word for each
    /// block.
    pub fn sparse_bytes(&self) -> u64 {
        let all = size_of_val(&self.coarse[..]) + size_of_val(&self.slots[..]) + size_of_val(&self.fine[..]);
        all as u64
    }

    /// The value at any point.
    pub fn value(&self, point: DVec3) -> VoxelValue {
        let top = self.origin + self.voxel * self.voxels.as_dvec3();
        let inside = point.clamp(self.origin, top);
        let at = (inside - self.origin) / self.voxel;
        let block = (at / BLOCK as f64).floor().as_usizevec3().min(self.blocks - 1);
        let number = (block.z * self.blocks.y + block.y) * self.blocks.x + block.x;
        let in_block = at - (BLOCK * block).as_dvec3();
        let (distance, gradient, edge) = match self.slots[number] {
            NO_SLOT => {
                let row = self.blocks + 1;
                let first = (block.z * row.y + block.y) * row.x + block.x;
                let corners = corners(&self.coarse, first, row.x, row.x * row.y);
                let (distance, gradient) = trilinear(corners, in_block / BLOCK as f64);
                (distance, gradient, BLOCK as f64 * self.voxel)
            }
            slot => {
                let voxel = in_block.floor().as_usizevec3().min(USizeVec3::splat(BLOCK - 1));
                let first = slot as usize * SAMPLES + (voxel.z * SIDE + voxel.y) * SIDE + voxel.x;
                let corners = corners(&self.fine, first, SIDE, SIDE * SIDE);
                let (distance, gradient) = trilinear(corners, in_block - voxel.as_dvec3());
                (distance, gradient, self.voxel)
            }
        };
        let value = VoxelValue {
            distance,
            gradient: gradient / edge,
            slack: 3.0_f64.sqrt() * edge,
            block: number as u32,
        };
        value.moved_out(point - inside)
    }

    /// Upper bound of the difference between value and exact distance, where the value is at most
    /// `distance` and the point is in the grid. Negative values beyond the narrow band do not
    /// count.
    pub(super) fn slack_within(&self, distance: f64) -> f64 {
        let edge = if distance < self.narrow_band { self.voxel } else { BLOCK as f64 * self.voxel };
        3.0_f64.sqrt() * edge
    }

    /// Origin of a block: its sample with the lowest coordinates.
    pub(super) fn block_origin(&self, number: usize) -> DVec3 {
        let (x, rest) = (number % self.blocks.x, number / self.blocks.x);
        let block = USizeVec3::new(x, rest % self.blocks.y, rest / self.blocks.y);
        self.origin + self.voxel * (BLOCK * block).as_dvec3()
    }
}

impl VoxelValue {
    /// The value at a point outside the grid, `way` from the point of the grid that is nearest to
    /// it.
    fn moved_out(self, way: DVec3) -> Self {
        let length = way.length();
        if length == 0.0 {
            return self;
        }
        // Along an axis in which the point lies outside, the nearest point does not move.
        let along = DVec3::select(way.cmpeq(DVec3::ZERO), self.gradient, DVec3::ZERO);
        Self {
            distance: self.distance + length,
            gradient: along + way / length,
            slack: self.slack + 2.0 * length,
            ..self
        }
    }
}

/// The eight samples around a point, x fastest.
fn corners(samples: &[f32], first: usize, row: usize, slab: usize) -> [f64; 8] {
    std::array::from_fn(|k| {
        let (x, y, z) = (k & 1, k >> 1 & 1, k >> 2);
        f64::from(samples[first + z * slab + y * row + x])
    })
}

/// Value and gradient at `t` in the unit cube whose corners have these values.
fn trilinear(c: [f64; 8], t: DVec3) -> (f64, DVec3) {
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let x = [mix(c[0], c[1], t.x), mix(c[2], c[3], t.x), mix(c[4], c[5], t.x), mix(c[6], c[7], t.x)];
    let y = [mix(x[0], x[1], t.y), mix(x[2], x[3], t.y)];
    let along_x = mix(mix(c[1] - c[0], c[3] - c[2], t.y), mix(c[5] - c[4], c[7] - c[6], t.y), t.z);
    let along_y = mix(x[1] - x[0], x[3] - x[2], t.z);
    (mix(y[0], y[1], t.z), DVec3::new(along_x, along_y, y[1] - y[0]))
}
