//! The launches that reduce the contacts of each pair, and what comes back of it.
use cubecl::prelude::*;
use tesdf::collide::{PairReduction, Reduction};

use super::Detector;
use super::buffers::{Members, Products};
use super::stages::Stages;
use crate::GpuError;
use crate::contacts::{Report, Touching, pair_reduction};
use crate::device::{Buffer, spread};
use crate::instances::Instances;
use crate::kernels::{choice, members, products, reduce};

/// Count, place, fill, reduce. `groups_for` makes the groups of a launch: most elements, how many to a group, product.
pub fn launch(
    stages: &mut Stages,
    groups_for: impl Fn(&mut Stages, u32, u32, u32) -> Result<CubeCount, GpuError>,
    client: &cubecl::client::Client,
    products: &Products,
    members: &Members,
    counters: &Buffer,
    per_pair: u32,
) -> Result<(), GpuError> {
    let Products { room, directions, maps, contact_words, contact_rows, .. } = products;
    let threads = CubeDim::new_1d(members::GROUP);
    let most_pairs = room.directions / 2;
    let per_pair_of_instances = spread(most_pairs.div_ceil(members::GROUP));
    stages.run("no members", || {
        members::clear::launch(
            client,
            per_pair_of_instances.clone(),
            threads,
            members.tallies.words(),
            most_pairs,
        );
    })?;
    let per_contact = groups_for(stages, room.contacts, members::GROUP, products::CONTACTS)?;
    stages.run("members counted", || {
        members::count::launch(
            client,
            per_contact.clone(),
            threads,
            contact_words.words(),
            counters.words(),
            members.tallies.words(),
            room.contacts,
        );
    })?;
    stages.run("members placed", || {
        members::place::launch(
            client,
            per_pair_of_instances,
            threads,
            directions.words(),
            counters.words(),
            members.tallies.words(),
            members.touching.words(),
            most_pairs,
        );
    })?;
    stages.run("members", || {
        members::fill::launch(
            client,
            per_contact,
            threads,
            directions.words(),
            maps.rows(),
            contact_words.words(),
            contact_rows.rows(),
            counters.words(),
            members.tallies.words(),
            members.numbers.words(),
            members.members.rows(),
            room.contacts,
        );
    })?;
    let per_touching = groups_for(stages, most_pairs, 1, products::TOUCHING)?;
    stages.run("reduction", || {
        reduce::reduce::launch(
            client,
            per_touching,
            CubeDim::new_1d(choice::GROUP),
            contact_words.words(),
            contact_rows.rows(),
            members.numbers.words(),
            counters.words(),
            members.touching.words(),
            members.members.rows(),
            members.reports.rows(),
            members.kept_words.words(),
            members.kept_rows.rows(),
            per_pair,
            most_pairs,
            room.kept,
        );
    })
}

impl Detector {
    /// What the last pass has lost, by pair of instances.
    pub(super) fn reductions(
        &mut self,
        instances: &Instances,
        reduction: Reduction,
    ) -> Result<Vec<PairReduction>, GpuError> {
        let (Reduction::PerPair(_), Some(members)) = (reduction, &self.products.members) else {
            return Ok(Vec::new());
        };
        let count = self.report.counts[products::TOUCHING as usize] as usize;
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
