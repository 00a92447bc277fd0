//! Reduction: the launches that reduce the contacts of each pair, and the report.
use tesdf::collide::{PairReduction, Reduction};

use super::Detector;
use super::contacts::{Report, Touching, pair_reduction};
use super::pass::Pass;
use super::scene::instances::Instances;
use super::stages::launch;
use crate::GpuError;
use crate::device::spread;
use crate::kernels::counters;
use crate::kernels::report::reduce::{choice, members, selection};

impl Pass<'_> {
    /// Reduces the contacts of each pair, when the options ask for it. The launches are: count,
    /// allot, fill, reduce.
    pub(super) fn reduce(&self) -> Result<(), GpuError> {
        let buffers = self.buffers();
        let (Reduction::PerPair(per_pair), Some(own)) = (self.options.reduction, &buffers.members) else {
            return Ok(());
        };
        let pairs = buffers.room.ordered_pairs / 2;
        let per_pair_of_instances = spread(pairs.div_ceil(members::GROUP));
        launch!(
            self.stages,
            "clear tallies",
            per_pair_of_instances.clone(),
            members::GROUP,
            members::clear(own.tallies.words(), pairs)
        )?;
        let per_contact = self.groups_for(buffers.room.contacts, members::GROUP, counters::CONTACTS)?;
        launch!(
            self.stages,
            "members counted",
            per_contact.clone(),
            members::GROUP,
            members::count(buffers.contacts(), self.counters(), own.tallies.words())
        )?;
        let (ordered, tallies) = (|| buffers.ordered_pairs(), || own.tallies.words());
        launch!(
            self.stages,
            "members allotted",
            per_pair_of_instances,
            members::GROUP,
            members::allot(ordered(), self.counters(), tallies(), own.touching())
        )?;
        launch!(
            self.stages,
            "members",
            per_contact,
            members::GROUP,
            members::fill(ordered(), buffers.contacts(), self.counters(), tallies(), own.members())
        )?;
        let per_touching = self.groups_for(pairs, 1, counters::TOUCHING)?;
        let (contacts, counters) = (buffers.contacts(), self.counters());
        let (touching, reports) = (own.touching(), own.reports.rows());
        launch!(
            self.stages,
            "reduction",
            per_touching,
            choice::GROUP,
            selection::reduce(contacts, counters, touching, own.members(), reports, own.kept(), per_pair)
        )
    }
}

impl Detector {
    /// The loss of the last pass, for each pair of instances.
    pub(super) fn reductions(
        &mut self,
        instances: &Instances,
        reduction: Reduction,
    ) -> Result<Vec<PairReduction>, GpuError> {
        let (Reduction::PerPair(_), Some(members)) = (reduction, &self.buffers.members) else {
            return Ok(Vec::new());
        };
        let count = self.report.counts.touching as usize;
        let touching: Vec<Touching> = self.device.read(&members.touching, count)?;
        let reports: Vec<Report> = self.device.read(&members.reports, count)?;
        self.report.read += size_of_val(touching.as_slice()) + size_of_val(reports.as_slice());
        let mut reductions: Vec<PairReduction> = touching
            .iter()
            .zip(&reports)
            .map(|(touching, report)| pair_reduction(instances, touching, report))
            .collect();
        reductions.sort_unstable_by_key(|r| (r.instance_a, r.instance_b));
        Ok(reductions)
    }
}
