//! Broad phase: finds the bounds of the instances, the pairs of instances whose bounds meet, and
//! the meshlets that can touch.
use super::buffers::ROW;
use super::pass::{GROUP, Pass};
use super::stages::launch;
use crate::GpuError;
use crate::device::spread;
use crate::kernels::broad::pairs::{BOUNDS_ROWS, InstancesLaunch, PairsLaunch};
use crate::kernels::broad::{meshlets, pairs};
use crate::kernels::counters;
use crate::kernels::narrow::exchange::LANES;

impl Pass<'_> {
    pub(super) fn broad(&mut self) -> Result<(), GpuError> {
        self.instance_pairs()?;
        self.meshlets()
    }

    /// Computes the bounds of all instances, and finds the pairs whose bounds meet.
    fn instance_pairs(&mut self) -> Result<(), GpuError> {
        let (device, shapes) = (&self.detector.device, &self.detector.shapes);
        let all = self.instances;
        let rows = self.placed.clone();
        let words = device.upload("words of instances", &all.words)?;
        let excluded = device.upload("excluded pairs", &all.excluded)?;
        let bounds = device.empty("bounds of instances", all.ids.len() * BOUNDS_ROWS as usize * ROW)?;
        self.sent += words.bytes() + excluded.bytes();
        let count = all.ids.len() as u32;
        let distance = self.options.contact_distance as f32;
        let instances = || InstancesLaunch::new(rows.rows(), words.words(), count, distance);
        let (counters, again) = (self.counters(), self.counters());
        let found = self.detector.buffers.found();
        launch!(
            self.stages,
            "instance bounds",
            spread(count.div_ceil(GROUP)),
            GROUP,
            pairs::instance_bounds(shapes.argument(), instances(), counters, bounds.rows())
        )?;
        if let Some(given) = &all.pairs {
            let given_words = device.upload("pairs", given)?;
            self.sent += given_words.bytes();
            let count = given.len() as u32 / 2;
            let given = PairsLaunch::new(given_words.words(), count);
            return launch!(
                self.stages,
                "instance pairs",
                spread(count.div_ceil(GROUP)),
                GROUP,
                pairs::given_pairs(shapes.argument(), instances(), given, again, found)
            );
        }
        let excluded = PairsLaunch::new(excluded.words(), all.excluded.len() as u32 / 2);
        launch!(
            self.stages,
            "instance pairs",
            spread(count.div_ceil(GROUP)),
            GROUP,
            pairs::instance_pairs(shapes.argument(), instances(), bounds.rows(), excluded, again, found)
        )
    }

    /// Finds the meshlets that can touch.
    fn meshlets(&mut self) -> Result<(), GpuError> {
        let (shapes, buffers) = (&self.detector.shapes, &self.detector.buffers);
        let per_block = self.groups_for(buffers.room.blocks, 1, counters::BLOCKS)?;
        let (pairs, blocks, meshlets) = (buffers.ordered_pairs(), buffers.blocks(), buffers.meshlets());
        let (counters, prune) = (self.counters(), self.prune());
        launch!(
            self.stages,
            "meshlets",
            per_block,
            LANES,
            meshlets::meshlets(shapes.argument(), pairs, blocks, counters, meshlets, prune)
        )
    }
}
