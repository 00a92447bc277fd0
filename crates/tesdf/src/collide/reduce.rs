//! Keeps a few contacts of a pair of instances that can replace all of them.
//!
//! Input: contacts in the order of a detection. Output: the kept contacts in the same order, and a
//! bound of the loss for each pair.
//!
//! The wrench of a unit force at contact *i*, on the instance with the lower id, is `w_i = (n_i,
//! (p_i − c) × n_i / L)`. Here `c` is the centre of the box around the contact points, and `L` is
//! their largest distance from `c`, which makes force and torque comparable. With a total force
//! `F`, the pair can exert `F` times the convex hull of all `w_i`. So the kept contacts should span
//! a hull that is nearly as large. The kept contacts are
//!
//! 1. the deepest contact,
//! 2. the extremes of the contact points along both directions of three axes: the first axis leads
//!    to the point farthest from `c`, the second to the point farthest from the first axis, the
//!    third is normal to both,
//! 3. one by one, the contact whose wrench is farthest from the hull of the kept wrenches (Blum,
//!    Har-Peled, Raichel, Sparse approximation via generating point sets, 2016), until there are
//!    enough or the hull is complete.
//!
//! Several cells may clip one face and give several contacts. They need no special rule: equal
//! wrenches are in the hull once one of them is kept. The bound is proved in `docs/math.md`, "What
//! a reduction loses".

use crate::parallel::{self, *};
use glam::DVec3;

use super::hull::{ROUNDING, Wrench, dot, residual};
use super::{Contact, InstanceId, PairReduction, Reduction};

/// An axis along which the points extend less than this fraction of `L` gets no extremes. So a flat
/// patch has two axes, whatever the rounding of its points (1e-7 in `f32`).
pub const FLAT: f64 = 1e-3;
/// Number of contacts per block. For each block the maximum is kept up to date.
const BLOCK: usize = 512;
/// Limit, per contact, of the closest points on the hull that the selection computes. Beyond the
/// limit, upper bounds of the distances decide. Selecting 64 of 100,000 contacts needs 0.8 per
/// contact on a torus and 1.3 around a shaft.
const CHOICES: usize = 4;

/// Reduces the contacts of each pair of instances, in both orders together. Contacts keep their
/// order. The reports are sorted by instances, one for each pair that touches. [`Reduction::None`]
/// returns the contacts unchanged, without reports.
///
/// `PerPair(0)`, which [`CollideOptions::validate`](super::CollideOptions::validate) refuses,
/// counts as 1.
///
/// The same input gives the same output for any number of threads. To keep `n` of `N` contacts of a
/// pair takes `O(N n)` time and about 130 bytes per contact.
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

/// The loss when the contacts `kept`, however they were chosen, replace all `contacts` of a pair.
/// It is the greatest distance of a contact's wrench from the hull of the kept wrenches, as in
/// [`PairReduction::wrench_error`]. Torques are taken around `center` and divided by `length`. The
/// relative error is at most 1e-7.
///
/// All contacts must belong to one pair of instances, in either order. The result is 0 without
/// contacts, and infinite when none of them is kept.
pub fn wrench_error(contacts: &[Contact], kept: &[Contact], center: DVec3, length: f64) -> f64 {
    let hull: Vec<Wrench> = kept.iter().map(|c| wrench_of(c, center, length)).collect();
    let distance = |c: &Contact| {
        if hull.is_empty() {
            return f64::INFINITY;
        }
        let residual = residual(&hull, &wrench_of(c, center, length));
        dot(&residual, &residual).sqrt()
    };
    parallel::reduce(contacts.par_iter().map(distance), || 0.0, f64::max)
}

/// The wrench of a unit force on the instance with the lower id.
fn wrench_of(contact: &Contact, center: DVec3, length: f64) -> Wrench {
    let Contact { point_a, normal, instance_a: a, instance_b: b, .. } = *contact;
    let force = if a < b { normal } else { -normal };
    // A single point needs no scale, because its torques are 0.
    let torque = (point_a - center).cross(force) / if length > 0.0 { length } else { 1.0 };
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

/// Indices in `contacts` of the kept contacts of one pair.
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
    let deepest = first_max(pair.len(), |i| -contact(i).distance);
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
    // Updates all distances that can be the maximum, so that the maximum is a distance and not only
    // a bound.
    kept.farthest(&mut pair.len());
    report.wrench_error = kept.error();
    report.kept = kept.order.len();
    kept.order.sort_unstable();
    (kept.order.into_iter().map(|i| pair[i].2).collect(), report)
}

/// The first `i < n` with the greatest key.
fn first_max(n: usize, key: impl Fn(usize) -> f64) -> usize {
    // `max_by` returns the last of equal elements.
    (0..n).rev().map(|i| (key(i), i)).max_by(|x, y| x.0.total_cmp(&y.0)).map_or(0, |(_, i)| i)
}

/// Indices of the extremes of the points `at(i)`, which are relative to their centre and within
/// `radius` of it.
fn extremes(n: usize, radius: f64, at: impl Fn(usize) -> DVec3) -> Vec<usize> {
    let mut extremes = Vec::with_capacity(6);
    let mut axes = Vec::with_capacity(3);
    while axes.len() < 3 {
        let off = |p: DVec3| axes.iter().fold(p, |p, &axis| p - p.dot(axis) * axis);
        let reach = off(at(first_max(n, |i| off(at(i)).length_squared())));
        if reach.length() <= FLAT * radius {
            break;
        }
        let axis = reach.normalize();
        extremes.extend([axis, -axis].map(|axis| first_max(n, |i| at(i).dot(axis))));
        axes.push(axis);
    }
    extremes
}

/// All wrenches, each with its residual: the vector to it from a point of the hull of the kept
/// wrenches. The hull only grows, so this point stays in it, and the length of the residual remains
/// an upper bound of the distance.
struct Kept {
    wrenches: [Vec<f64>; 6],
    residuals: [Vec<f64>; 6],
    /// Squared lengths of the residuals.
    bounds: Vec<f64>,
    /// The greatest bound of each block.
    greatest: Vec<f64>,
    /// For each wrench, the number of kept contacts when its residual was last exact.
    exact: Vec<u32>,
    /// Kept contacts, in the order of their selection; `hull` has their wrenches.
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

    /// Adds wrench `i` to the hull. All residuals become shorter where a segment to the new wrench
    /// allows it.
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
            // From the point of the hull, w − r, to the new wrench.
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

    /// The contact whose wrench is farthest from the hull; `None` when all are in it up to
    /// rounding. Each computed distance uses one of `choices`; when none is left, the bounds
    /// decide.
    fn farthest(&mut self, choices: &mut usize) -> Option<usize> {
        let now = self.hull.len() as u32;
        loop {
            let block = first_max(self.greatest.len(), |b| self.greatest[b]);
            let bounds = &self.bounds[self.block(block)];
            let i = block * BLOCK + first_max(bounds.len(), |k| bounds[k]);
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

    /// Upper bound of the greatest distance from the hull.
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
