//! A few contacts of each pair of instances that are spread over the places that touch, in a time
//! that follows their number.
//!
//! The face trees of both bodies are divided from the top, the largest node first, into as many
//! regions as contacts are wanted. Nodes that cannot touch are dropped on the way. In each region a
//! dive goes to the child whose middle is lower in the field, down to a leaf. The deepest contact of
//! the leaf is kept. A dive that finds no contact goes on with the lowest node that it has passed, at
//! a few leaves at most.
//!
//! Every node that was passed has a lower bound of the distances of its contacts. The least of these
//! bounds says how deep a contact can be that was not found.
use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::few::{OfPair, unfound};
use super::found::{AtVertex, Found, contacts, one_per_vertex, order};
use super::ordered_pair::OrderedPair;
use super::reduce::{deepest_of_pair, report_of_kept};
use super::{Contact, Statistics};
use crate::asset::layout::TreeChild;
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
    /// Among equally large regions, those that were found first come first.
    serial: u64,
    order: usize,
    child: TreeChild,
    /// Lower bound of the distances of its contacts, in the world's unit.
    bound: f64,
}

impl PartialEq for Region {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Region {}
impl PartialOrd for Region {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Region {
    fn cmp(&self, other: &Self) -> Ordering {
        // The heap returns the largest first.
        self.radius.total_cmp(&other.radius).then(other.serial.cmp(&self.serial))
    }
}

/// What a dive into a region has found.
#[derive(Default)]
struct Dive {
    found: Found,
    candidates: usize,
    /// Lower bound of the distances of contacts that were not searched for; infinite without any.
    left: f64,
}

/// At most `count` contacts of a pair, whose two orders are given.
pub fn of_pair(orders: &[OrderedPair], count: usize) -> OfPair {
    let count = count.max(1);
    let regions = regions(orders, count);
    let dives: Vec<Dive> = match regions.len() {
        ..FEW => regions.iter().map(|region| dive(&orders[region.order], region)).collect(),
        _ => regions.par_iter().map(|region| dive(&orders[region.order], region)).collect(),
    };
    let mut statistics = Statistics::default();
    let mut left = f64::INFINITY;
    let mut own: Vec<Found> = orders.iter().map(|_| Found::default()).collect();
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
    for Found { contacts, at_vertices, .. } in own {
        let mut contacts = one_per_vertex(contacts, &at_vertices);
        contacts.sort_by_key(order);
        kept.extend(contacts);
    }
    let found = statistics.touching - statistics.filtered;
    if kept.len() > count {
        // Each order has a region.
        let (deepest, cut) = split_deepest(&kept, count);
        left = cut.iter().map(|c| c.distance).fold(left, f64::min);
        kept = deepest;
    }
    statistics.reduced = found - kept.len();
    statistics.unconverged = kept.iter().filter(|c| !c.converged).count();
    statistics.bytes = size_of_val(regions.as_slice()) + size_of_val(kept.as_slice());
    let report = match left {
        f64::INFINITY => deepest_of_pair(&kept, kept.len(), None).1,
        _ => report_of_kept(&kept, found, unfound(&orders[0]), left),
    };
    OfPair { contacts: kept, report, statistics }
}

/// The deepest contacts in their order, and the others.
fn split_deepest(contacts: &[Contact], count: usize) -> (Vec<Contact>, Vec<Contact>) {
    let mut by_depth: Vec<usize> = (0..contacts.len()).collect();
    by_depth.sort_by(|&i, &j| contacts[i].distance.total_cmp(&contacts[j].distance));
    let (kept, cut) = by_depth.split_at_mut(count);
    kept.sort_unstable();
    let of = |indices: &[usize]| indices.iter().map(|&i| contacts[i]).collect();
    (of(kept), of(cut))
}

/// The children of a node that can have contacts.
fn children(pair: &OrderedPair, order: usize, node: u32, bound: f64, serial: &mut u64) -> Vec<Region> {
    let OrderedPair { surface, field, search, .. } = pair;
    let mut regions = Vec::with_capacity(2);
    for branch in surface.halves(node).into_iter().flatten() {
        if let Some(least) = field.least_contact(branch.center, branch.radius, search.reach) {
            *serial += 1;
            let radius = branch.radius * field.unit();
            let bound = bound.max(least * field.unit());
            regions.push(Region { radius, serial: *serial, order, child: branch.child, bound });
        }
    }
    regions
}

/// The regions: at most `count`, and at least one for each order where it can have contacts.
fn regions(orders: &[OrderedPair], count: usize) -> Vec<Region> {
    let whole = |(order, pair): (usize, &OrderedPair)| Region {
        radius: f64::INFINITY,
        serial: 0,
        order,
        child: pair.surface.whole(),
        bound: f64::NEG_INFINITY,
    };
    let mut open: BinaryHeap<Region> = orders.iter().enumerate().map(whole).collect();
    let mut leaves = Vec::new();
    let mut serial = 0;
    while open.len() + leaves.len() < count
        && let Some(largest) = open.pop()
    {
        match largest.child {
            TreeChild::Node(node) => {
                let Region { order, bound, .. } = largest;
                open.extend(children(&orders[order], order, node, bound, &mut serial));
            }
            TreeChild::Leaf(..) => leaves.push(largest),
        }
    }
    leaves.extend(open.into_sorted_vec());
    leaves
}

/// Goes down to a leaf of a region where the surface is low.
fn dive(pair: &OrderedPair, region: &Region) -> Dive {
    let mut dive = Dive { left: f64::INFINITY, ..Dive::default() };
    let (mut serial, mut leaves) = (0, 0);
    let mut open = vec![*region];
    // The middle of a region is its radius above its bound.
    let lower = |x: &Region, y: &Region| {
        (x.bound + x.radius).total_cmp(&(y.bound + y.radius)).then(x.serial.cmp(&y.serial))
    };
    while leaves < LEAVES
        && dive.found.contacts.is_empty()
        && let Some(at) = (0..open.len()).min_by(|&i, &j| lower(&open[i], &open[j]))
    {
        let lowest = open.swap_remove(at);
        match lowest.child {
            TreeChild::Node(node) => {
                open.extend(children(pair, lowest.order, node, lowest.bound, &mut serial));
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
    dive.left = open.iter().map(|region| region.bound).fold(dive.left, f64::min);
    dive
}
