//! Detections that do not find all contacts of a pair of instances.
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

use super::field::ROUNDING;
use super::ordered_pair::OrderedPair;
use super::reduce::Unfound;
use super::{CollideOptions, Contact, Contacts, PairReduction, Statistics, hidden};
use crate::geometry::Aabb;
use crate::parallel::*;

/// The contacts of ordered pairs, by a search in each pair of instances. The two orders of a pair
/// must be adjacent. Once `stop` is set, contacts are missing.
pub fn of_pairs(
    pairs: &[OrderedPair],
    options: &CollideOptions,
    stop: &AtomicBool,
    search: impl Fn(&[OrderedPair]) -> OfPair + Sync + Send,
) -> Contacts {
    let search =
        |pair: &[OrderedPair]| if stop.load(Ordering::Relaxed) { OfPair::default() } else { search(pair) };
    let found: Vec<OfPair> = pairs.par_chunks(2).map(search).collect();
    let mut all = Vec::with_capacity(found.iter().map(|f| f.contacts.len()).sum());
    let mut reports = Vec::new();
    let mut statistics = Statistics { instance_pairs: pairs.len(), ..Statistics::default() };
    for OfPair { contacts, report, statistics: own } in found {
        statistics.candidates += own.candidates;
        statistics.polygons += own.polygons;
        statistics.touching += own.touching;
        statistics.filtered += own.filtered;
        statistics.reduced += own.reduced;
        statistics.unconverged += own.unconverged;
        statistics.bytes += own.bytes;
        all.extend(contacts);
        reports.extend(report);
    }
    statistics.bytes += size_of_val(pairs) + size_of_val(all.as_slice());
    reports.sort_unstable_by_key(|r| (r.instance_a, r.instance_b));
    let hidden = hidden::among(pairs, options, &all, stop);
    Contacts::new(all, statistics, reports, hidden)
}

/// The contacts of a pair that are kept.
#[derive(Default)]
pub struct OfPair {
    /// The contacts, in the order of a detection.
    pub contacts: Vec<Contact>,
    /// Where there is a contact.
    pub report: Option<PairReduction>,
    /// What was looked at and found.
    pub statistics: Statistics,
}

/// A ball around all points that both bodies can have within the contact distance.
pub fn unfound(pair: &OrderedPair) -> Unfound {
    let OrderedPair { surface, field, search, .. } = pair;
    let bounds = [field.bounds(), surface.bounds()];
    // A plane is infinite.
    let size = bounds.map(|b| b.extent().max_element()).into_iter().fold(f64::INFINITY, f64::min);
    let [x, y] = bounds.map(|b| b.grown(search.reach.max(0.0) + ROUNDING * size));
    let common = Aabb { min: x.min.max(y.min), max: x.max.min(y.max) };
    let length = 0.5 * common.extent().max(DVec3::ZERO).length() * field.unit();
    Unfound { center: field.to_world(common.center()), length }
}
