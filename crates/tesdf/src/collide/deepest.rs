//! The deepest contacts of each pair of instances, without finding the others.
//!
//! Both orders of a pair are searched together, best-first. One queue holds the nodes and leaves of
//! both face trees, by a lower bound of the signed distances of their contacts. As soon as enough
//! contacts are known, the distance of the last of them is the limit: faces whose least signed
//! distance is above it are not searched for contacts, and the search ends where the first bound of
//! the queue is above it.
//!
//! The result is exact: the contacts are those that a detection without reduction finds, cut to the
//! deepest. Where bounds cannot tell depths apart, as between two flanks of a thread that are
//! nearly parallel, every face that touches is still compared with the limit.
use std::collections::BTreeMap;

use super::branch::Branch;
use super::few::{OfPair, unfound};
use super::found::{AtVertex, Found, contacts, one_per_vertex, order};
use super::ordered_pair::OrderedPair;
use super::queue::Queue;
use super::reduce::deepest_of_pair;
use super::surface::Part;
use super::{Contact, Mode, Statistics};
use crate::asset::layout::{TREE_LEAF, TreeChild};
use crate::parallel::*;

/// Largest number of nodes and leaves that are searched in parallel.
const BATCH: usize = 128;
/// Fewer are searched on one thread.
const FEW: usize = 16;
/// One in this number of open nodes and leaves is searched at a time.
const SHARE: usize = 8;

/// A node or leaf that is still to be searched.
struct Open {
    /// Lower bound of the distances of its contacts, in the world's unit.
    bound: f64,
    order: usize,
    child: TreeChild,
}

/// What a node or leaf has become.
enum Searched {
    /// The children of a node that can have contacts, with their bounds.
    Node(Vec<(f64, TreeChild)>),
    /// The contacts of a leaf, and the number of its candidates that were searched and that the
    /// limit ruled out.
    Leaf { found: Found, searched: usize, ruled_out: usize },
}

/// The deepest contacts of a pair, whose two orders are given.
pub fn of_pair(orders: &[OrderedPair], count: usize) -> OfPair {
    Search::new(orders, count.max(1)).run()
}

struct Search<'a> {
    orders: &'a [OrderedPair<'a>],
    count: usize,
    open: Queue<Open>,
    /// The contacts of each order.
    found: Vec<Found>,
    /// Distances of contacts that are not at a vertex.
    alone: Vec<f64>,
    /// For each vertex of an order, the greatest distance of a contact there. One of these contacts
    /// remains.
    at_vertices: BTreeMap<(usize, [u64; 3]), f64>,
    /// Contacts above this are not among the deepest.
    limit: f64,
    /// Whether the limit has ruled out a part of a surface.
    has_left: bool,
    statistics: Statistics,
}

impl<'a> Search<'a> {
    fn new(orders: &'a [OrderedPair<'a>], count: usize) -> Self {
        Self {
            orders,
            count,
            open: Queue::new(),
            found: orders.iter().map(|_| Found::default()).collect(),
            alone: Vec::new(),
            at_vertices: BTreeMap::new(),
            limit: f64::INFINITY,
            has_left: false,
            statistics: Statistics::default(),
        }
    }

    fn run(mut self) -> OfPair {
        for (order, pair) in self.orders.iter().enumerate() {
            self.push(f64::NEG_INFINITY, order, pair.surface.whole());
        }
        loop {
            let batch = self.batch();
            if batch.is_empty() {
                break;
            }
            let searched: Vec<Searched> = match batch.len() {
                ..FEW => batch.iter().map(|open| self.search(open)).collect(),
                _ => batch.par_iter().map(|open| self.search(open)).collect(),
            };
            let before = self.slots();
            batch.into_iter().zip(searched).for_each(|(open, searched)| self.take(&open, searched));
            if self.slots() > before {
                self.lower_limit();
            }
        }
        self.finish()
    }

    fn push(&mut self, bound: f64, order: usize, child: TreeChild) {
        self.open.push(bound, Open { bound, order, child });
    }

    /// Number of contacts, those at one vertex counted once.
    fn slots(&self) -> usize {
        self.alone.len() + self.at_vertices.len()
    }

    /// The nodes and leaves that are searched next. Their number does not depend on threads.
    fn batch(&mut self) -> Vec<Open> {
        let missing = self.count.saturating_sub(self.slots()) / TREE_LEAF;
        let most = if self.limit == f64::INFINITY { missing.clamp(1, BATCH) } else { BATCH };
        let size = (self.open.len() / SHARE).clamp(1, most);
        let mut batch = Vec::with_capacity(size);
        while batch.len() < size
            && let Some(open) = self.open.pop()
        {
            if open.bound > self.limit {
                // So are all others.
                self.has_left = true;
                self.open.clear();
                break;
            }
            batch.push(open);
        }
        batch
    }

    fn search(&self, open: &Open) -> Searched {
        let pair = &self.orders[open.order];
        let OrderedPair { surface, field, search, reach, .. } = pair;
        let (start, count) = match open.child {
            TreeChild::Node(node) => {
                let bound = |branch: Branch| {
                    let least = branch.least_contact(field, reach)?;
                    Some(((least - field.rounding()) * field.unit(), branch.child))
                };
                let branches = surface.halves(node).into_iter().flatten();
                return Searched::Node(branches.filter_map(bound).collect());
            }
            TreeChild::Leaf(start, count) => (start, count),
        };
        let mut candidates = surface.of_leaf(start, count, pair.mode());
        let all = candidates.len();
        if self.limit < f64::INFINITY && pair.mode() != Mode::Node {
            let limit = self.limit / field.unit() + field.rounding();
            let limited = search.of_whole_faces(field, limit);
            let parts: Vec<Part> = candidates.iter().map(|&c| pair.part(c).0).collect();
            let around = limited.surroundings(field, parts.iter());
            let mut parts = parts.iter();
            candidates
                .retain(|_| parts.next().is_none_or(|part| limited.may_reach(field, part, around.as_ref())));
        }
        let searched = candidates.len();
        Searched::Leaf { found: contacts(pair, &candidates), searched, ruled_out: all - searched }
    }

    fn take(&mut self, open: &Open, searched: Searched) {
        let (found, searched, ruled_out) = match searched {
            Searched::Node(children) => {
                for (bound, child) in children {
                    self.push(bound.max(open.bound), open.order, child);
                }
                return;
            }
            Searched::Leaf { found, searched, ruled_out } => (found, searched, ruled_out),
        };
        self.statistics.candidates += searched + ruled_out;
        self.statistics.polygons += found.polygons;
        self.statistics.filtered += found.filtered;
        self.has_left |= ruled_out > 0;
        let mut vertices = found.at_vertices.iter().peekable();
        for (index, contact) in found.contacts.iter().enumerate() {
            match vertices.next_if(|v| v.index == index) {
                Some(v) => {
                    let greatest = self.at_vertices.entry((open.order, v.vertex)).or_insert(contact.distance);
                    *greatest = greatest.max(contact.distance);
                }
                None => self.alone.push(contact.distance),
            }
        }
        let own = &mut self.found[open.order];
        let before = own.contacts.len();
        own.at_vertices
            .extend(found.at_vertices.into_iter().map(|v| AtVertex { index: before + v.index, ..v }));
        own.contacts.extend(found.contacts);
    }

    /// The limit is the distance of the last of the deepest contacts so far.
    fn lower_limit(&mut self) {
        let mut distances: Vec<f64> = self.alone.iter().chain(self.at_vertices.values()).copied().collect();
        if distances.len() >= self.count {
            let (_, last, _) = distances.select_nth_unstable_by(self.count - 1, f64::total_cmp);
            self.limit = self.limit.min(*last);
        }
    }

    fn finish(self) -> OfPair {
        let mut statistics = self.statistics;
        let mut all: Vec<Contact> = Vec::new();
        for Found { contacts, at_vertices, .. } in self.found {
            statistics.bytes += size_of_val(contacts.as_slice()) + size_of_val(at_vertices.as_slice());
            let mut contacts = one_per_vertex(contacts, &at_vertices);
            contacts.sort_by_key(order);
            all.extend(contacts);
        }
        let unfound = self.has_left.then(|| unfound(&self.orders[0]));
        let (contacts, report) = deepest_of_pair(&all, self.count, unfound);
        statistics.touching = all.len() + statistics.filtered;
        statistics.reduced = all.len() - contacts.len();
        statistics.unconverged = contacts.iter().filter(|c| !c.converged).count();
        OfPair { contacts, report, statistics }
    }
}
