//! Keeps, of all contacts of a pair of instances, a few that can do what all can do.
//!
//! In: contacts in the order of a detection. Out: those kept, in the same order, and per pair a bound on what is lost.
//!
//! The wrench of a unit force at contact *i*, on the instance of the lower id, is `w_i = (n_i, (p_i − c) × n_i / L)`: `c` is the
//! middle of the box around the contact points and `L` their radius around it, so force and torque are comparable. What the pair can exert with
//! a total force `F` is `F` times the convex hull of all `w_i`, so the kept contacts should span a hull that is nearly as
//! large. Kept are
//!
//! 1. the deepest contact,
//! 2. the extremes of the contact points along both signs of three axes: the first leads to the point farthest from `c`,
//!    the second to the one farthest from the first, the third is normal to both,
//! 3. one by one, the contact whose wrench is farthest from the hull of those kept (Blum, Har-Peled, Raichel, Sparse
//!    approximation via generating point sets, 2016), until there are enough or the hull is complete.
//!
//! That several cells clip one face and give as many contacts needs no rule of its own: equal wrenches are in the hull once
//! one is kept. The bound is proved in `docs/math.md`, "What a reduction loses".

use glam::DVec3;
use rayon::prelude::*;

use super::hull::{ROUNDING, Wrench, dot, residual};
use super::{Contact, InstanceId, PairReduction, Reduction};

/// An axis along which the points reach less than this share of `L` has no extremes worth a contact: a flat patch
/// has two axes, whatever the rounding of its points (1e-7 in `f32`).
const FLAT: f64 = 1e-3;
/// Contacts per maximum that is kept up to date.
const BLOCK: usize = 512;
/// Closest points of the hull, per contact, that the choice may compute in all; what is beyond is chosen by upper bounds of the
/// distances. Choosing 64 of 100,000 contacts takes 0.8 on a torus, 1.3 around a shaft.
const CHOICES: usize = 4;

/// Reduces each pair of instances, in whichever direction their contacts are. Contacts keep their order; the reports are sorted by
/// instances, one for each pair that touches. [`Reduction::None`] returns the contacts as they are, without reports.
///
/// `PerPair(0)`, which [`CollideOptions::validate`](super::CollideOptions::validate) refuses, counts as 1.
///
/// The same input gives the same output on any number of threads; a pair of `N` contacts takes time `O(N n)` and some 130 bytes each.
pub fn reduce_pairs(contacts: Vec<Contact>, reduction: Reduction) -> (Vec<Contact>, Vec<PairReduction>) {
    let Reduction::PerPair(n) = reduction else { return (contacts, Vec::new()) };
    let mut by_pair: Vec<(InstanceId, InstanceId, usize)> = contacts
        .iter()
        .enumerate()
        .map(|(i, c)| (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b), i))
        .collect();
    by_pair.par_sort_unstable();
    let pairs: Vec<_> = by_pair.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)).collect();
    let reduced: Vec<_> = pairs.par_iter().map(|pair| reduce(&contacts, pair, (n as usize).max(1))).collect();
    let mut keep = vec![false; contacts.len()];
    for &i in reduced.iter().flat_map(|(kept, _)| kept) {
        keep[i] = true;
    }
    let kept = contacts.into_iter().zip(keep).filter_map(|(c, keep)| keep.then_some(c)).collect();
    (kept, reduced.into_iter().map(|(_, report)| report).collect())
}

/// What is lost when `kept` stand for all `contacts` of a pair, whoever chose them: the greatest distance of the wrench of a contact from the hull of
/// those of the kept ones, as [`PairReduction::wrench_error`], with torques around `center` and in units of `length`. To 1e-7 of it.
///
/// All contacts are of one pair of instances, in either direction. 0 without contacts, infinite where none of them is kept.
pub fn wrench_error(contacts: &[Contact], kept: &[Contact], center: DVec3, length: f64) -> f64 {
    let hull: Vec<Wrench> = kept.iter().map(|c| wrench_of(c, center, length)).collect();
    let distance = |c: &Contact| {
        if hull.is_empty() {
            return f64::INFINITY;
        }
        let residual = residual(&hull, &wrench_of(c, center, length));
        dot(&residual, &residual).sqrt()
    };
    contacts.par_iter().map(distance).reduce(|| 0.0, f64::max)
}

/// The wrench of a unit force on the instance of the lower id.
fn wrench_of(contact: &Contact, center: DVec3, length: f64) -> Wrench {
    let Contact { point_a, normal, instance_a: a, instance_b: b, .. } = *contact;
    let force = if a < b { normal } else { -normal };
    // A single point needs no scale: its torques are 0.
    let torque = (point_a - center).cross(force) / if length > 0.0 { length } else { 1.0 };
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

/// The places in `contacts` of those that are kept of one pair.
fn reduce(
    contacts: &[Contact],
    pair: &[(InstanceId, InstanceId, usize)],
    n: usize,
) -> (Vec<usize>, PairReduction) {
    let (instance_a, instance_b, _) = pair[0];
    let contact = |i: usize| &contacts[pair[i].2];
    let points = pair.iter().map(|p| contacts[p.2].point_a);
    let (low, high) = points
        .clone()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let center = 0.5 * (low + high);
    let length = points.map(|p| p.distance(center)).fold(0.0, f64::max);
    let mut report = PairReduction {
        instance_a,
        instance_b,
        contacts: pair.len(),
        kept: pair.len(),
        wrench_error: 0.0,
        center,
        length,
    };
    if pair.len() <= n {
        return (pair.iter().map(|p| p.2).collect(), report);
    }
    let mut kept = Kept::new(pair.len(), |i| wrench_of(contact(i), center, length));
    let deepest = first_most(pair.len(), |i| -contact(i).distance);
    for i in [deepest].into_iter().chain(extremes(pair.len(), length, |i| contact(i).point_a - center)) {
        if kept.order.len() < n && !kept.order.contains(&i) {
            kept.keep(i);
        }
    }
    let mut choices = CHOICES * pair.len();
    while kept.order.len() < n
        && let Some(i) = kept.farthest(&mut choices)
    {
        kept.keep(i);
    }
    // All that may matter is computed once more, so the maximum is that of the distances, not of their bounds.
    kept.farthest(&mut pair.len());
    report.wrench_error = kept.error();
    report.kept = kept.order.len();
    kept.order.sort_unstable();
    (kept.order.into_iter().map(|i| pair[i].2).collect(), report)
}

/// The first `i < n` of the greatest key.
fn first_most(n: usize, key: impl Fn(usize) -> f64) -> usize {
    // `max_by` returns the last of equals.
    (0..n).rev().map(|i| (key(i), i)).max_by(|x, y| x.0.total_cmp(&y.0)).map_or(0, |(_, i)| i)
}

/// The extremes of points `at(i)`, relative to their center, within `radius` of it.
fn extremes(n: usize, radius: f64, at: impl Fn(usize) -> DVec3) -> Vec<usize> {
    let mut extremes = Vec::with_capacity(6);
    let mut axes = Vec::with_capacity(3);
    while axes.len() < 3 {
        let off = |p: DVec3| axes.iter().fold(p, |p, &axis| p - p.dot(axis) * axis);
        let reach = off(at(first_most(n, |i| off(at(i)).length_squared())));
        if reach.length() <= FLAT * radius {
            break;
        }
        let axis = reach.normalize();
        extremes.extend([axis, -axis].map(|axis| first_most(n, |i| at(i).dot(axis))));
        axes.push(axis);
    }
    extremes
}

/// All wrenches, and for each its residual, the vector from a point of the hull of those that are kept. The hull only grows, so that
/// point stays in it, and the length of the residual stays an upper bound of the distance.
struct Kept {
    wrenches: [Vec<f64>; 6],
    residuals: [Vec<f64>; 6],
    /// Squared lengths of the residuals.
    bounds: Vec<f64>,
    /// The greatest of each block.
    greatest: Vec<f64>,
    /// How many were kept when the residual was last the shortest.
    exact: Vec<u32>,
    /// Kept contacts and their wrenches, in the order in which they were chosen.
    order: Vec<usize>,
    hull: Vec<Wrench>,
}

impl Kept {
    fn new(n: usize, wrench: impl Fn(usize) -> Wrench) -> Self {
        let mut wrenches: [Vec<f64>; 6] = std::array::from_fn(|_| Vec::with_capacity(n));
        for i in 0..n {
            wrenches.iter_mut().zip(wrench(i)).for_each(|(column, x)| column.push(x));
        }
        Self {
            wrenches,
            residuals: std::array::from_fn(|_| vec![0.0; n]),
            bounds: vec![f64::INFINITY; n],
            greatest: vec![f64::INFINITY; n.div_ceil(BLOCK)],
            exact: vec![0; n],
            order: Vec::new(),
            hull: Vec::new(),
        }
    }

    /// The hull grows by wrench `i`: all residuals are shortened by what the segments to it allow.
    fn keep(&mut self, i: usize) {
        let new = self.wrench(i);
        let n = self.bounds.len();
        if self.hull.is_empty() {
            for ((residual, wrench), x) in self.residuals.iter_mut().zip(&self.wrenches).zip(new) {
                *residual = wrench.iter().map(|w| w - x).collect();
            }
        }
        self.order.push(i);
        self.hull.push(new);
        let [w0, w1, w2, w3, w4, w5] = self.wrenches.each_ref().map(|column| &column[..n]);
        let [r0, r1, r2, r3, r4, r5] = self.residuals.each_mut().map(|column| &mut column[..n]);
        let bounds = &mut self.bounds[..n];
        for j in 0..n {
            let residual = [r0[j], r1[j], r2[j], r3[j], r4[j], r5[j]];
            let wrench = [w0[j], w1[j], w2[j], w3[j], w4[j], w5[j]];
            // From the point of the hull, w − r, to the new one.
            let to: Wrench = std::array::from_fn(|k| new[k] - wrench[k] + residual[k]);
            let step = (dot(&residual, &to) / dot(&to, &to).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            let residual: Wrench = std::array::from_fn(|k| residual[k] - step * to[k]);
            [r0[j], r1[j], r2[j], r3[j], r4[j], r5[j]] = residual;
            bounds[j] = dot(&residual, &residual);
        }
        for block in 0..self.greatest.len() {
            self.update_greatest(block);
        }
    }

    /// The contact whose wrench is farthest from the hull; `None` when all are in it, up to rounding. Takes one of `choices` for each
    /// distance that it computes, and without any left goes by the bounds.
    fn farthest(&mut self, choices: &mut usize) -> Option<usize> {
        let now = self.hull.len() as u32;
        loop {
            let block = first_most(self.greatest.len(), |b| self.greatest[b]);
            let bounds = &self.bounds[self.block(block)];
            let i = block * BLOCK + first_most(bounds.len(), |k| bounds[k]);
            if self.bounds[i] <= ROUNDING * ROUNDING {
                return None;
            }
            if self.exact[i] == now || *choices == 0 {
                return Some(i);
            }
            *choices -= 1;
            self.exact[i] = now;
            let residual = residual(&self.hull, &self.wrench(i));
            let square = dot(&residual, &residual);
            if square < self.bounds[i] {
                self.bounds[i] = square;
                self.residuals.iter_mut().zip(residual).for_each(|(column, x)| column[i] = x);
                self.update_greatest(block);
            }
        }
    }

    /// The greatest distance from the hull: an upper bound.
    fn error(&self) -> f64 {
        self.greatest.iter().copied().fold(0.0, f64::max).sqrt()
    }

    fn wrench(&self, i: usize) -> Wrench {
        std::array::from_fn(|k| self.wrenches[k][i])
    }

    fn block(&self, block: usize) -> std::ops::Range<usize> {
        block * BLOCK..self.bounds.len().min((block + 1) * BLOCK)
    }

    fn update_greatest(&mut self, block: usize) {
        self.greatest[block] = self.bounds[self.block(block)].iter().copied().fold(0.0, f64::max);
    }
}
