//! Shapes on the device. Each shape is stored once, for any number of instances.
use tesdf::collide::Shape;

use super::movable::Moving;
use super::pack::{Packed, fans};
use crate::GpuError;
use crate::device::{Buffer, Device};
use crate::kernels::query::sign::{BY_CELLS, GENERALIZED};
use crate::kernels::scene::shape::{FansLaunch, RULE, Rules, STRIDE, ShapesLaunch, TURNED};

/// A list of shapes in the memory of a device.
#[derive(Clone)]
pub struct GpuShapes {
    pub(super) device: Device,
    pub(super) table: Buffer,
    words: Buffer,
    rows: Buffer,
    /// The fans of vertices, once a detection has needed them.
    fans: Option<Buffer>,
    pub(crate) shapes: Vec<Shape>,
    /// For each shape, the data to move its vertices; `None` for a shape without a conforming
    /// domain.
    pub(super) moving: Vec<Option<Moving>>,
    pub(super) moved: bool,
    /// The rules that the shapes need.
    pub(crate) rules: Rules,
}

/// The id of a shape in [`GpuShapes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GpuShapeId(pub(crate) u32);

/// Memory of shapes on the device, in bytes, by contents.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShapeBytes {
    /// Kind of each shape, and the start of its arrays.
    pub table: usize,
    /// Forests, lists, palettes, bounds of cells, children of face-tree nodes, vertices of faces.
    pub words: usize,
    /// Faces of vertices; 0 until contacts of faces have stayed on the device.
    pub fans: usize,
    /// Faces, boxes of the face trees, balls of the meshlets.
    pub rows: usize,
}

impl GpuShapes {
    /// Uploads shapes. [`ids`](Self::ids) returns their ids in the same order.
    ///
    /// # Errors
    /// [`GpuError::Shape`] for a shape that the kernels cannot read; [`GpuError::TooLarge`] for a
    /// buffer that is larger than the device can bind; [`GpuError::Device`] when the device fails,
    /// such as for lack of memory.
    pub fn upload(device: &Device, shapes: &[Shape]) -> Result<Self, GpuError> {
        let mut packed = Packed::default();
        for (number, shape) in shapes.iter().enumerate() {
            packed.add(shape).map_err(|reason| GpuError::Shape { number, reason })?;
        }
        let any = |is: fn(&[u32]) -> bool| packed.table.chunks(STRIDE as usize).any(is);
        let rules = Rules {
            at_points: any(|entry| entry[RULE as usize] != BY_CELLS),
            jumps: any(|entry| entry[RULE as usize] == GENERALIZED),
            turned: any(|entry| entry[TURNED as usize] == 1),
        };
        let uploaded = Self {
            device: device.clone(),
            table: device.upload("shapes", &packed.table)?,
            words: device.upload("words of shapes", &packed.words)?,
            rows: device.upload("rows of shapes", &packed.rows)?,
            fans: None,
            shapes: shapes.to_vec(),
            moving: packed.table.chunks(STRIDE as usize).zip(shapes).map(Moving::new).collect(),
            moved: false,
            rules,
        };
        device.check("uploading shapes", [&uploaded.table, &uploaded.words, &uploaded.rows])?;
        Ok(uploaded)
    }

    /// The buffers as an argument of kernels.
    pub(crate) fn argument(&self) -> ShapesLaunch {
        ShapesLaunch::new(self.table.words(), self.words.words(), self.rows.rows(), self.rules)
    }

    /// Uploads the fans of vertices, unless they are there.
    pub(crate) fn add_fans(&mut self) -> Result<(), GpuError> {
        if self.fans.is_none() {
            let fans = self.device.upload("faces of vertices", &fans(&self.shapes))?;
            self.device.check("uploading faces of vertices", [&fans])?;
            self.fans = Some(fans);
        }
        Ok(())
    }

    /// The fans as an argument of kernels, which are launched only after `add_fans`.
    pub(crate) fn fans(&self) -> FansLaunch {
        FansLaunch::new(self.fans.as_ref().unwrap_or(&self.words).words())
    }

    /// The device that holds the shapes.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// The ids of the shapes, in the order of the upload.
    pub fn ids(&self) -> Vec<GpuShapeId> {
        (0..self.shapes.len() as u32).map(GpuShapeId).collect()
    }

    /// Number of shapes.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Whether the list has no shapes.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Whether at least one shape has a conforming domain.
    pub(crate) fn has_conforming(&self) -> bool {
        self.moving.iter().any(Option::is_some)
    }

    /// Memory of the shapes on the device, in bytes.
    pub fn bytes(&self) -> ShapeBytes {
        ShapeBytes {
            table: self.table.bytes(),
            words: self.words.bytes(),
            rows: self.rows.bytes(),
            fans: self.fans.as_ref().map_or(0, Buffer::bytes),
        }
    }

    /// The buffers, for kernels that write shapes.
    pub(super) fn buffers(&self) -> [&Buffer; 3] {
        [&self.table, &self.words, &self.rows]
    }
}
