//! A few contacts of each pair of instances that are spread over the places that touch, in a time
//! that follows their number.
//!
//! The face trees of both bodies are divided from the top, the largest node first, into as many
//! regions as contacts are wanted. Nodes that cannot touch are dropped on the way. In each region a
//! dive goes to the child whose middle is lower in the field, down to a leaf. The deepest contact
//! of the leaf is kept. A dive that finds no contact goes on with the lowest node that it has
//! passed, at a few leaves at most.
//!
//! Every node that was passed has a lower bound of the distances of its contacts. The least of
//! these bounds says how deep a contact can be that was not found.
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

use crate::asset::layout::TreeChild;
use crate::collide::bodies::field::ROUNDING;
use crate::collide::detect::candidate_contacts::{
    AtVertex, CandidateContacts, contacts, one_per_vertex, order,
};
use crate::collide::detect::hidden;
use crate::collide::detect::ordered_pair::OrderedPair;
use crate::collide::options::CollideOptions;
use crate::collide::report::contact::{Contact, Contacts, PairReduction, Statistics};
use crate::collide::report::reduce::{Unfound, report_of_kept};
use crate::collide::search::queue::Queue;
use crate::geometry::Aabb;
use crate::parallel::*;

/// Number of leaves after which a dive without a contact ends.
const LEAVES: usize = 4;
/// Fewer regions are searched on one thread.
const FEW: usize = 8;

/// A node or leaf of the face tree of a body.
#[derive(Clone, Copy)]
struct Region {
    /// Its radius, in the world's unit.
    radius: f64,
    order: usize,
    child: TreeChild,
    /// Lower bound of the distances of its contacts, in the world's unit.
    bound: f64,
}

/// What a dive into a region has found.
#[derive(Default)]
struct Dive {
    found: CandidateContacts,
    candidates: usize,
    /// Lower bound of the distances of contacts that were not searched for; infinite without any.
    left: f64,
}

/// The contacts of a pair that are kept.
#[derive(Default)]
struct OfPair {
    /// The contacts, in the order of a detection.
    contacts: Vec<Contact>,
    /// Where there is a contact.
    report: Option<PairReduction>,
    /// What was looked at and found.
    statistics: Statistics,
}

/// At most `count` contacts of each pair of instances. The two orders of a pair must be adjacent. Once
/// `stop` is set, contacts are missing.
pub fn of_pairs(
    pairs: &[OrderedPair],
    options: &CollideOptions,
    stop: &AtomicBool,
    count: usize,
) -> Contacts {
    let of_pair = |pair: &[OrderedPair]| match stop.load(Ordering::Relaxed) {
        true => OfPair::default(),
        false => of_pair(pair, count),
    };
    let found: Vec<OfPair> = pairs.par_chunks(2).map(of_pair).collect();
    let mut all = Vec::with_capacity(found.iter().map(|f| f.contacts.len()).sum());
    let mut reports = Vec::new();
    let mut statistics = Statistics { instance_pairs: pairs.len(), ..Statistics::default() };
    for OfPair { contacts, report, statistics: own } in found {
        statistics += own;
        all.extend(contacts);
        reports.extend(report);
    }
    statistics.bytes += size_of_val(pairs) + size_of_val(all.as_slice());
    reports.sort_unstable_by_key(|r| (r.instance_a, r.instance_b));
    let hidden = hidden::among(pairs, options, &all, stop);
    Contacts::new(all, statistics, reports, hidden)
}

/// At most `count` contacts of a pair, whose two orders are given.
fn of_pair(orders: &[OrderedPair], count: usize) -> OfPair {
    let count = count.max(1);
    let regions = regions(orders, count);
    let dives: Vec<Dive> = match regions.len() {
        ..FEW => regions.iter().map(|region| dive(&orders[region.order], region)).collect(),
        _ => regions.par_iter().map(|region| dive(&orders[region.order], region)).collect(),
    };
    let mut statistics = Statistics::default();
    let mut left = f64::INFINITY;
    let mut own: Vec<CandidateContacts> = orders.iter().map(|_| CandidateContacts::default()).collect();
    for (region, dive) in regions.iter().zip(dives) {
        let Dive { found, candidates, left: of_dive } = dive;
        statistics.candidates += candidates;
        statistics.polygons += found.polygons;
        statistics.filtered += found.filtered;
        statistics.touching += found.contacts.len() + found.filtered;
        left = left.min(of_dive);
        // Of equally deep contacts, the first is kept.
        let deepest = (0..found.contacts.len())
            .min_by(|&i, &j| found.contacts[i].distance.total_cmp(&found.contacts[j].distance));
        let Some(deepest) = deepest else { continue };
        let cut = found.contacts.iter().enumerate().filter(|&(i, _)| i != deepest);
        left = cut.map(|(_, c)| c.distance).fold(left, f64::min);
        let kept = &mut own[region.order];
        let index = kept.contacts.len();
        let at_vertex = found.at_vertices.into_iter().filter(|v| v.index == deepest);
        kept.at_vertices.extend(at_vertex.map(|v| AtVertex { index, ..v }));
        kept.contacts.push(found.contacts[deepest]);
    }
    let mut kept: Vec<Contact> = Vec::new();
    for CandidateContacts { contacts, at_vertices, .. } in own {
        let mut contacts = one_per_vertex(contacts, &at_vertices);
        contacts.sort_by_key(order);
        kept.extend(contacts);
    }
    let found = statistics.touching - statistics.filtered;
    if kept.len() > count {
        // Each order has a region. Of equally deep contacts, the first stay.
        let mut by_depth: Vec<usize> = (0..kept.len()).collect();
        by_depth.sort_by(|&i, &j| kept[i].distance.total_cmp(&kept[j].distance));
        let mut deepest = by_depth[..count].to_vec();
        deepest.sort_unstable();
        left = by_depth[count..].iter().map(|&i| kept[i].distance).fold(left, f64::min);
        kept = deepest.into_iter().map(|i| kept[i]).collect();
    }
    statistics.reduced = found - kept.len();
    statistics.unconverged = kept.iter().filter(|c| !c.converged).count();
    statistics.bytes = size_of_val(regions.as_slice()) + size_of_val(kept.as_slice());
    let is_all = left == f64::INFINITY;
    let report = report_of_kept(&kept, found, (!is_all).then(|| unfound(&orders[0], left)));
    OfPair { contacts: kept, report, statistics }
}

/// All points that both bodies can have within the contact distance, where contacts `above` a
/// distance were not found.
fn unfound(pair: &OrderedPair, above: f64) -> Unfound {
    let OrderedPair { surface, field, search, .. } = pair;
    let bounds = [field.bounds(), surface.bounds()];
    // A plane is infinite.
    let size = bounds.map(|b| b.extent().max_element()).into_iter().fold(f64::INFINITY, f64::min);
    let [x, y] = bounds.map(|b| b.grown(search.reach.max(0.0) + ROUNDING * size));
    let common = Aabb { min: x.min.max(y.min), max: x.max.min(y.max) };
    let length = 0.5 * common.extent().max(DVec3::ZERO).length() * field.unit();
    Unfound { center: field.to_world(common.center()), length, above }
}

/// The children of a node that can have contacts.
fn children(pair: &OrderedPair, order: usize, node: u32, bound: f64) -> impl Iterator<Item = Region> {
    let OrderedPair { surface, field, reach, .. } = pair;
    surface.halves(node).into_iter().flatten().filter_map(move |branch| {
        let least = branch.least_contact(field, reach)?;
        let (radius, bound) = (branch.radius * field.unit(), bound.max(least * field.unit()));
        Some(Region { radius, order, child: branch.child, bound })
    })
}

/// The regions: at most `count`, and at least one for each order where it can have contacts.
fn regions(orders: &[OrderedPair], count: usize) -> Vec<Region> {
    // The largest come first.
    let mut open = Queue::new();
    for (order, pair) in orders.iter().enumerate() {
        let (radius, bound) = (f64::INFINITY, f64::NEG_INFINITY);
        open.push(-radius, Region { radius, order, child: pair.surface.whole(), bound });
    }
    let mut leaves = Vec::new();
    while open.len() + leaves.len() < count
        && let Some((_, largest)) = open.pop()
    {
        let Region { order, child, bound, .. } = largest;
        match child {
            TreeChild::Node(node) => children(&orders[order], order, node, bound)
                .for_each(|region| open.push(-region.radius, region)),
            TreeChild::Leaf(..) => leaves.push(largest),
        }
    }
    leaves.extend(open.into_items());
    leaves
}

/// Goes down to a leaf of a region where the surface is low.
fn dive(pair: &OrderedPair, region: &Region) -> Dive {
    let mut dive = Dive { left: f64::INFINITY, ..Dive::default() };
    let mut leaves = 0;
    let mut open = Queue::new();
    // The middle of a region is its radius above its bound.
    let middle = |region: &Region| region.bound + region.radius;
    open.push(middle(region), *region);
    while leaves < LEAVES
        && dive.found.contacts.is_empty()
        && let Some((_, Region { order, child, bound, .. })) = open.pop()
    {
        match child {
            TreeChild::Node(node) => {
                children(pair, order, node, bound).for_each(|region| open.push(middle(&region), region));
            }
            TreeChild::Leaf(start, count) => {
                leaves += 1;
                let candidates = pair.surface.of_leaf(start, count, pair.mode());
                dive.candidates += candidates.len();
                let found = contacts(pair, &candidates);
                dive.found.polygons += found.polygons;
                dive.found.filtered += found.filtered;
                dive.found.contacts = found.contacts;
                dive.found.at_vertices = found.at_vertices;
            }
        }
    }
    dive.left = open.into_items().map(|region| region.bound).fold(dive.left, f64::min);
    dive
}
