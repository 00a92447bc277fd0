//! Shapes as the device holds them: each once, whatever the number of its instances.
use tesdf::collide::Shape;

use super::moving::Moving;
use super::pack::Packed;
use crate::GpuError;
use crate::device::{Buffer, Device};
use crate::kernels::field::shapes::{STRIDE, ShapesLaunch};

/// Shapes on a device.
#[derive(Clone)]
pub struct GpuShapes {
    pub(super) device: Device,
    pub(super) table: Buffer,
    words: Buffer,
    rows: Buffer,
    pub(crate) shapes: Vec<Shape>,
    /// Of each shape; `None` for shapes whose cells do not follow the surface.
    pub(super) moving: Vec<Option<Moving>>,
    pub(super) moved: bool,
}

/// A shape of [`GpuShapes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GpuShapeId(pub(crate) u32);

/// Bytes of shapes on the device, by what they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShapeBytes {
    /// Kinds of the shapes, and where their arrays begin.
    pub table: usize,
    /// Forests, lists, palettes, cell bounds, children of the face trees.
    pub words: usize,
    /// Faces, boxes of the face trees, balls of the meshlets.
    pub rows: usize,
}

impl GpuShapes {
    /// Uploads shapes. [`ids`](Self::ids) names them, in the same order.
    ///
    /// # Errors
    /// [`GpuError::Shape`] for a shape that the device cannot hold, [`GpuError::TooLarge`].
    pub fn upload(device: &Device, shapes: &[Shape]) -> Result<Self, GpuError> {
        let mut packed = Packed::default();
        for (number, shape) in shapes.iter().enumerate() {
            packed.add(shape).map_err(|reason| GpuError::Shape { number, reason })?;
        }
        Ok(Self {
            device: device.clone(),
            table: device.upload("shapes", &packed.table)?,
            words: device.upload("words of shapes", &packed.words)?,
            rows: device.upload("rows of shapes", &packed.rows)?,
            shapes: shapes.to_vec(),
            moving: packed.table.chunks(STRIDE as usize).zip(shapes).map(Moving::new).collect(),
            moved: false,
        })
    }

    /// For a kernel.
    pub(crate) fn argument(&self) -> ShapesLaunch {
        ShapesLaunch::new(self.table.words(), self.words.words(), self.rows.rows())
    }

    /// The device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// The shapes, in the order in which they were uploaded.
    pub fn ids(&self) -> Vec<GpuShapeId> {
        (0..self.shapes.len() as u32).map(GpuShapeId).collect()
    }

    /// Number of shapes.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Whether there is no shape.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Whether a shape has a conforming domain.
    pub(crate) fn has_conforming(&self) -> bool {
        self.moving.iter().any(Option::is_some)
    }

    /// Size on the device.
    pub fn bytes(&self) -> ShapeBytes {
        ShapeBytes { table: self.table.bytes(), words: self.words.bytes(), rows: self.rows.bytes() }
    }

    /// For a kernel that writes shapes.
    pub(super) fn buffers(&self) -> [&Buffer; 3] {
        [&self.table, &self.words, &self.rows]
    }
}
