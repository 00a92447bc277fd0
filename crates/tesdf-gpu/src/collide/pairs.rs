//! Broad phase: finds the bounds of the instances, the pairs of instances whose bounds meet, and
//! the meshlets that can touch.
use super::buffers::ROW;
use super::pass::{GROUP, Pass};
use super::stages::launch;
use crate::GpuError;
use crate::device::spread;
use crate::kernels::counters;
use crate::kernels::narrow::exchange::LANES;
use crate::kernels::pairs::instance_pairs::{BOUNDS_ROWS, InstancesLaunch, PairsLaunch};
use crate::kernels::pairs::{instance_pairs, meshlets};

impl Pass<'_> {
    pub(super) fn pairs(&self) -> Result<(), GpuError> {
        self.instance_pairs()?;
        self.meshlets()
    }

    /// Computes the bounds of all instances, and finds the pairs whose bounds meet.
    fn instance_pairs(&self) -> Result<(), GpuError> {
        let all = self.instances;
        let words = self.upload("words of instances", &all.words)?;
        let bounds = all.ids.len() * BOUNDS_ROWS as usize * ROW;
        let bounds = self.detector.device.empty("bounds of instances", bounds)?;
        let (count, distance) = (all.ids.len() as u32, self.options.contact_distance as f32);
        let instances = || InstancesLaunch::new(self.placed.rows(), words.words(), count, distance);
        let (counters, found) = (self.counters(), self.buffers().found());
        launch!(
            self.stages,
            "instance bounds",
            spread(count.div_ceil(GROUP)),
            GROUP,
            instance_pairs::instance_bounds(self.shapes(), instances(), self.counters(), bounds.rows())
        )?;
        let listed = all.pairs.as_ref().unwrap_or(&all.excluded);
        let uploaded = self.upload("listed pairs", listed)?;
        let pairs = PairsLaunch::new(uploaded.words(), listed.len() as u32 / 2);
        if all.pairs.is_some() {
            return launch!(
                self.stages,
                "instance pairs",
                spread((listed.len() as u32 / 2).div_ceil(GROUP)),
                GROUP,
                instance_pairs::given_pairs(self.shapes(), instances(), pairs, counters, found)
            );
        }
        launch!(
            self.stages,
            "instance pairs",
            spread(count.div_ceil(GROUP)),
            GROUP,
            instance_pairs::instance_pairs(self.shapes(), instances(), bounds.rows(), pairs, counters, found)
        )
    }

    /// Finds the meshlets that can touch.
    fn meshlets(&self) -> Result<(), GpuError> {
        let buffers = self.buffers();
        let per_block = self.groups_for(buffers.room.blocks, 1, counters::BLOCKS)?;
        let (pairs, blocks, found) = (buffers.ordered_pairs(), buffers.blocks(), buffers.meshlets());
        launch!(
            self.stages,
            "meshlets",
            per_block,
            LANES,
            meshlets::meshlets(self.shapes(), pairs, blocks, self.counters(), found, self.prune())
        )
    }
}
