//! Middle phase: finds hidden overlaps, then the nodes with their cells, the polygons, or the
//! faces.
use cubecl::prelude::*;
use tesdf::collide::{HiddenSearch, Mode};

use super::pass::{Parts, Pass, parts};
use super::stages::launch;
use crate::GpuError;
use crate::device::spread;
use crate::kernels::bodies::{clip, faces, nodes, outside};
use crate::kernels::detect::hidden;
use crate::kernels::narrow::exchange::LANES;
use crate::kernels::report::reduce::members;

impl Pass<'_> {
    /// `per_meshlet` is the number of groups, of one or several for each meshlet.
    pub(super) fn bodies(&self, per_meshlet: &CubeCount) -> Result<(), GpuError> {
        if self.options.hidden == HiddenSearch::On {
            self.hidden(per_meshlet)?;
        }
        let buffers = self.buffers();
        let (shapes, counters, prune) = (self.shapes(), self.counters(), self.prune());
        let (pairs, meshlets, groups) = (buffers.ordered_pairs(), buffers.meshlets(), per_meshlet.clone());
        match parts(self.options) {
            Parts::Nodes => launch!(
                self.stages,
                "nodes",
                groups,
                LANES,
                nodes::nodes(shapes, pairs, meshlets, counters, buffers.items(), prune)
            ),
            Parts::Faces => launch!(
                self.stages,
                "faces",
                groups,
                LANES,
                faces::whole_faces(shapes, pairs, meshlets, counters, buffers.items(), prune)
            ),
            Parts::Polygons => {
                launch!(
                    self.stages,
                    "polygons",
                    groups,
                    LANES,
                    clip::clip_polygons(shapes, pairs, meshlets, counters, buffers.polygons(), prune)
                )?;
                self.outside(per_meshlet)
            }
        }
    }

    /// Finds overlaps that contacts need not show.
    fn hidden(&self, per_meshlet: &CubeCount) -> Result<(), GpuError> {
        let buffers = self.buffers();
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
            hidden::hidden(self.shapes(), pairs, meshlets, counters, depths.words(), by_faces)
        )
    }

    /// Finds the parts of faces outside of conforming domains.
    fn outside(&self, per_meshlet: &CubeCount) -> Result<(), GpuError> {
        if !self.detector.shapes.has_conforming() {
            return Ok(());
        }
        let buffers = self.buffers();
        let (pairs, meshlets, polygons) = (buffers.ordered_pairs(), buffers.meshlets(), buffers.polygons());
        let (counters, prune) = (self.counters(), self.prune());
        launch!(
            self.stages,
            "outside of domains",
            per_meshlet.clone(),
            LANES,
            outside::outside_polygons(self.shapes(), pairs, meshlets, counters, polygons, prune)
        )
    }
}
