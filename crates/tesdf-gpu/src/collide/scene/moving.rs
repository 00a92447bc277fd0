//! Moves the vertices of conforming domains on the device.
use cubecl::prelude::*;

use super::{GpuShapeId, GpuShapes};
use crate::GpuError;
use crate::device::{DeviceArray, spread};
use crate::kernels::GROUP;
use crate::kernels::deform::bounds::MovingLaunch;
use crate::kernels::deform::move_vertices::follow;
use crate::kernels::deform::refit;
use crate::kernels::scene::shape::{BAD_VERTEX, NONE, STRIDE};

impl GpuShapes {
    /// Moves all vertices of a shape with a conforming domain (Sec. V-D of the paper).
    ///
    /// `positions` has x, y, z of each vertex in the shape's frame and unit: first the mesh's
    /// vertices, then the domain's other vertices, as
    /// [`ConformingMesh::vertices`](tesdf::domain::ConformingMesh::vertices) numbers them. The
    /// array may wrap memory of another library ([`DeviceArray::from_raw_ptr`]). Later launches see
    /// the new positions.
    ///
    /// Faces, tetrahedra and the trees over them follow the vertices. Connectivity, lists and
    /// labels stay, as with [`TeSdf::move_vertices`](tesdf::TeSdf::move_vertices). So distances in
    /// the domain are those to the listed faces, and distances outside of the domain are exact up
    /// to rounding.
    ///
    /// A move takes two launches, for any number of vertices. The next detection fails when a
    /// vertex is not finite, or is farther from the center of the cube than two sides of the cube.
    ///
    /// # Errors
    /// [`GpuError::Shape`] for a shape that was not uploaded here or has no conforming domain;
    /// [`GpuError::Length`] for a wrong number of positions.
    pub fn move_vertices(&mut self, shape: GpuShapeId, positions: &DeviceArray<f32>) -> Result<(), GpuError> {
        let (count, number) = (self.len(), shape.0 as usize);
        let refused = |reason: String| GpuError::Shape { number, reason };
        let moving = self.moving.get(number).ok_or_else(|| refused(format!("expected one of {count}")))?;
        let moving = moving.as_ref().ok_or_else(|| {
            refused("its cells do not follow the surface; encode the mesh in a conforming domain".into())
        })?;
        if positions.len() != 3 * moving.vertices {
            let expected = format!("{}: x y z of each vertex", 3 * moving.vertices);
            return Err(GpuError::Length { array: "positions", found: positions.len(), expected });
        }
        let frame = self.device.upload("frame of a shape", &moving.frame)?;
        let threads = moving.faces + moving.tree_nodes;
        let [table, words, rows] = self.buffers();
        let positions = positions.buffer();
        let argument = || {
            let (table, words, rows) = (table.words(), words.words(), rows.rows());
            MovingLaunch::new(table, words, rows, positions.words(), frame.rows(), shape.0)
        };
        let (client, groups) = (self.device.client(), spread(threads.div_ceil(GROUP)));
        follow::launch(client, groups, CubeDim::new_1d(GROUP), argument());
        refit::refit::launch(client, CubeCount::Static(1, 1, 1), CubeDim::new_1d(refit::GROUP), argument());
        self.moved = true;
        Ok(())
    }

    /// The error for the first shape with a vertex that was moved to an invalid position.
    pub(crate) fn badly_moved(&self) -> Result<GpuError, GpuError> {
        let table: Vec<u32> = self.device.read(&self.table, self.len() * STRIDE as usize)?;
        let bad = |row: &[u32]| Some(row[BAD_VERTEX as usize]).filter(|&vertex| vertex != NONE);
        let first = table.chunks(STRIDE as usize).enumerate().find_map(|(n, row)| Some((n, bad(row)?)));
        let (number, vertex) = first.unwrap_or_default();
        let reason = format!(
            "vertex {vertex} was moved to where none can be; expected finite numbers within two sides of the cube of its \
             middle. Move it again"
        );
        Ok(GpuError::Shape { number, reason })
    }

    /// Whether vertices have moved on the device since the upload.
    pub(crate) fn have_moved(&self) -> bool {
        self.moved
    }
}
