//! Middle phase: finds hidden overlaps, then the nodes with their cells, the polygons, or the
//! faces.
use cubecl::prelude::*;
use tesdf::collide::{HiddenSearch, Mode};

use super::pass::{Parts, Pass, parts};
use super::stages::launch;
use crate::GpuError;
use crate::device::spread;
use crate::kernels::middle::{clip, faces, hidden, nodes, outside};
use crate::kernels::narrow::exchange::LANES;
use crate::kernels::reduce::members;

impl Pass<'_> {
    pub(super) fn middle(&mut self, per_meshlet: &CubeCount) -> Result<(), GpuError> {
        if self.options.hidden == HiddenSearch::On {
            self.hidden(per_meshlet)?;
        }
        match parts(self.options) {
            Parts::Nodes => self.nodes(per_meshlet),
            Parts::Polygons => self.polygons(per_meshlet),
            Parts::Faces => self.faces(per_meshlet),
        }
    }

    /// Finds overlaps that contacts need not show.
    fn hidden(&mut self, per_meshlet: &CubeCount) -> Result<(), GpuError> {
        let (shapes, buffers) = (&self.detector.shapes, &self.detector.buffers);
        let (depths, count) = (&buffers.depths, buffers.room.ordered_pairs);
        let (pairs, meshlets, counters) = (buffers.ordered_pairs(), buffers.meshlets(), self.counters());
        let by_faces = u32::from(self.options.mode == Mode::Node);
        launch!(
            self.stages,
            "clear depths",
            spread(count.div_ceil(members::GROUP)),
            members::GROUP,
            members::clear(depths.words(), count)
        )?;
        launch!(
            self.stages,
            "hidden overlaps",
            per_meshlet.clone(),
            LANES,
            hidden::hidden(shapes.argument(), pairs, meshlets, counters, depths.words(), by_faces)
        )
    }

    /// Finds the nodes that can touch, with their cells.
    fn nodes(&mut self, per_meshlet: &CubeCount) -> Result<(), GpuError> {
        let (shapes, buffers) = (&self.detector.shapes, &self.detector.buffers);
        let (pairs, meshlets, items) = (buffers.ordered_pairs(), buffers.meshlets(), buffers.items());
        let (counters, prune) = (self.counters(), self.prune());
        launch!(
            self.stages,
            "nodes",
            per_meshlet.clone(),
            LANES,
            nodes::nodes(shapes.argument(), pairs, meshlets, counters, items, prune)
        )
    }

    /// Finds the faces that can touch.
    fn faces(&mut self, per_meshlet: &CubeCount) -> Result<(), GpuError> {
        let (shapes, buffers) = (&self.detector.shapes, &self.detector.buffers);
        let (pairs, meshlets, items) = (buffers.ordered_pairs(), buffers.meshlets(), buffers.items());
        let (counters, prune) = (self.counters(), self.prune());
        launch!(
            self.stages,
            "faces",
            per_meshlet.clone(),
            LANES,
            faces::whole_faces(shapes.argument(), pairs, meshlets, counters, items, prune)
        )
    }

    /// Clips faces by cells. For conforming domains, finds the parts of faces outside of the
    /// domain, too.
    fn polygons(&mut self, per_meshlet: &CubeCount) -> Result<(), GpuError> {
        let (shapes, buffers) = (&self.detector.shapes, &self.detector.buffers);
        let (pairs, meshlets, polygons) = (buffers.ordered_pairs(), buffers.meshlets(), buffers.polygons());
        let (counters, prune) = (self.counters(), self.prune());
        launch!(
            self.stages,
            "polygons",
            per_meshlet.clone(),
            LANES,
            clip::clip_polygons(shapes.argument(), pairs, meshlets, counters, polygons, prune)
        )?;
        if !shapes.has_conforming() {
            return Ok(());
        }
        let (pairs, meshlets, polygons) = (buffers.ordered_pairs(), buffers.meshlets(), buffers.polygons());
        let counters = self.counters();
        launch!(
            self.stages,
            "outside of domains",
            per_meshlet.clone(),
            LANES,
            outside::outside_polygons(shapes.argument(), pairs, meshlets, counters, polygons, prune)
        )
    }
}
