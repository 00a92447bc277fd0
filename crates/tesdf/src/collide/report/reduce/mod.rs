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
//! With many contacts, the third step looks at a few of them only. Contacts are put into bins,
//! which are boxes of equal size in the space of wrenches: contacts of a bin have nearly the same
//! direction and place. A bin is represented by its deepest contact and three extremes. The loss
//! that is reported is that of all contacts.
//!
//! Several cells may clip one face and give several contacts. They need no special rule: equal
//! wrenches are in the hull once one of them is kept. The bound is proved in `docs/math.md`, "What
//! a reduction loses".

mod bins;
mod loss;
mod report;
mod selection;
mod survivors;
mod wrenches;

use crate::base::Isa;
use crate::parallel::{self, *};

use glam::DVec3;

use crate::collide::options::Reduction;
use crate::collide::report::contact::{Contact, PairReduction};
use crate::collide::report::hull::{Wrench, dot, residual};
use crate::collide::scene::ids::InstanceId;
use bins::{Bins, sort_bytes};
use loss::{Loss, Projected};
pub use report::{Unfound, report_of_kept};
use selection::Selection;
use survivors::{PER_BIN, Survivors};
pub use wrenches::FLAT;
use wrenches::{Wrenches, wrench_of};

/// Least number of bins, if there are so many contacts.
const BINS: usize = 512;
/// Least number of bins per kept contact.
const BINS_PER_KEPT: usize = 4;

/// Reduces the contacts of each pair of instances, in both orders together. Contacts keep their
/// order. The reports are sorted by instances, one for each pair that touches. [`Reduction::None`]
/// returns the contacts unchanged, without reports.
///
/// [`Reduction::Spread`] keeps those of [`Reduction::PerPair`].
///
/// A number of 0, which [`CollideOptions::validate`](crate::collide::CollideOptions::validate) refuses,
/// counts as 1.
///
/// The same input gives the same output for any number of threads. To keep `n` of `N` contacts of a
/// pair takes `O(N + n²)` time and about 72 bytes per contact.
pub fn reduce_pairs(contacts: Vec<Contact>, reduction: Reduction) -> (Vec<Contact>, Vec<PairReduction>) {
    let Reduced { contacts, reports, .. } = reduced(contacts, reduction);
    (contacts, reports)
}

/// The result of a reduction.
pub struct Reduced {
    pub contacts: Vec<Contact>,
    pub reports: Vec<PairReduction>,
    /// The largest number of bytes that the reduction held besides `contacts`, when all pairs are
    /// reduced at the same time.
    pub bytes: usize,
}

/// As [`reduce_pairs`], with the bytes.
pub fn reduced(mut contacts: Vec<Contact>, reduction: Reduction) -> Reduced {
    let n = match reduction {
        Reduction::None => return Reduced { contacts, reports: Vec::new(), bytes: 0 },
        Reduction::PerPair(n) | Reduction::Spread(n) => n,
    };
    let mut runs = runs(&contacts);
    runs.sort_unstable();
    let pairs: Vec<&[Run]> = runs.chunk_by(|x, y| x.pair == y.pair).collect();
    let of_pairs: Vec<OfPair> =
        pairs.par_iter().map(|runs| reduce(&contacts, runs, (n as usize).max(1))).collect();
    let mut bytes: usize = of_pairs.iter().map(|pair| pair.bytes).sum();
    let kept: usize = of_pairs.iter().map(|pair| pair.report.kept).sum();
    let reports = of_pairs.iter().map(|pair| pair.report).collect();
    if kept == contacts.len() {
        return Reduced { contacts, reports, bytes };
    }
    let mut kept: Vec<usize> = of_pairs.into_iter().flat_map(|pair| pair.kept).collect();
    kept.sort_unstable();
    bytes = bytes.max(2 * size_of_val(kept.as_slice())) + size_of_val(runs.as_slice());
    for (to, &from) in kept.iter().enumerate() {
        contacts[to] = contacts[from];
    }
    contacts.truncate(kept.len());
    Reduced { contacts, reports, bytes }
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

/// Contacts of an ordered pair of instances that follow each other.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Run {
    /// The lower id first.
    pair: (InstanceId, InstanceId),
    start: usize,
    end: usize,
}

fn runs(contacts: &[Contact]) -> Vec<Run> {
    let mut start = 0;
    contacts
        .chunk_by(|x, y| (x.instance_a, x.instance_b) == (y.instance_a, y.instance_b))
        .map(|run| {
            let Contact { instance_a: a, instance_b: b, .. } = run[0];
            start += run.len();
            Run { pair: (a.min(b), a.max(b)), start: start - run.len(), end: start }
        })
        .collect()
}

/// The middle of the box around points.
fn center_of(points: impl Iterator<Item = DVec3>) -> DVec3 {
    let (low, high) =
        points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    0.5 * (low + high)
}

/// The centre of contact points, and the greatest distance of one from it.
fn ball<'a>(contacts: impl Iterator<Item = &'a Contact> + Clone) -> (DVec3, f64) {
    let center = center_of(contacts.clone().map(|c| c.point_a));
    (center, contacts.map(|c| c.point_a.distance(center)).fold(0.0, f64::max))
}

/// The reduction of one pair of instances.
struct OfPair {
    /// Indices of the kept contacts.
    kept: Vec<usize>,
    report: PairReduction,
    bytes: usize,
}

/// Reduces the contacts of one pair, whose runs are given.
fn reduce(contacts: &[Contact], runs: &[Run], n: usize) -> OfPair {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn avx2(contacts: &[Contact], runs: &[Run], n: usize) -> OfPair {
        reduce_any(contacts, runs, n)
    }
    match Isa::detect() {
        Isa::Baseline => reduce_any(contacts, runs, n),
        // SAFETY: `detect` found the features.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 | Isa::Avx512 => unsafe { avx2(contacts, runs, n) },
    }
}

/// As [`reduce`], for the instruction set of the caller. No operations are fused, so the result is
/// the same for all.
#[inline(always)]
fn reduce_any(contacts: &[Contact], runs: &[Run], n: usize) -> OfPair {
    let of_pair = || runs.iter().flat_map(|run| &contacts[run.start..run.end]);
    // The place in the pair of the first contact of each run.
    let mut places = Vec::with_capacity(runs.len());
    let mut count = 0;
    for run in runs {
        places.push(count);
        count += run.end - run.start;
    }
    let (instance_a, instance_b) = runs[0].pair;
    let report = |kept, wrench_error, center, length| PairReduction {
        instance_a,
        instance_b,
        contacts: count,
        kept,
        wrench_error,
        center,
        length,
        left_out_above: None,
    };
    if count <= n {
        let (center, length) = ball(of_pair());
        let kept: Vec<usize> = runs.iter().flat_map(|run| run.start..run.end).collect();
        return OfPair {
            bytes: size_of_val(kept.as_slice()),
            kept,
            report: report(count, 0.0, center, length),
        };
    }
    let wrenches = Wrenches::new(count, of_pair());
    let (center, length) = (wrenches.center, wrenches.length);
    let bins = BINS.max(BINS_PER_KEPT * n);
    let mut choice =
        if count <= PER_BIN * bins { among_all(wrenches, n) } else { by_bins(wrenches, bins, n) };
    choice.places.sort_unstable();
    let kept = choice.places.into_iter().map(|place| {
        let run = places.partition_point(|&first| first <= place) - 1;
        runs[run].start + place - places[run]
    });
    let kept: Vec<usize> = kept.collect();
    let report = report(kept.len(), choice.error, center, length);
    OfPair { kept, report, bytes: choice.bytes + size_of_val(places.as_slice()) }
}

/// The kept contacts of a pair.
struct Choice {
    /// Their places among the contacts of the pair.
    places: Vec<usize>,
    error: f64,
    bytes: usize,
}

/// Selects among all contacts of a pair.
#[inline(always)]
fn among_all(wrenches: Wrenches, n: usize) -> Choice {
    let mut selection = Selection::new((0..wrenches.len()).map(|i| wrenches.get(i)), &wrenches.seeds, n);
    selection.grow(n);
    let bytes = wrenches.bytes() + selection.bytes();
    Choice { places: selection.order().to_vec(), error: selection.square().sqrt(), bytes }
}

/// Selects among the contacts that represent their bins. Where this leaves contacts to be kept,
/// also among the contacts that are found to be farther from the hull.
#[inline(always)]
fn by_bins(mut wrenches: Wrenches, bins: usize, n: usize) -> Choice {
    let (bins, order) = Bins::new(&wrenches, bins);
    wrenches.reorder(&order);
    let mut squares = vec![f64::INFINITY; wrenches.len()];
    let survivors = Survivors::new(&wrenches, &bins, &mut squares);
    let first = wrenches.seeds.len();
    let mut contacts: Vec<usize> = wrenches.seeds.iter().chain(&survivors.contacts).copied().collect();
    let seeds: Vec<usize> = (0..first).collect();
    let mut selection = Selection::new(contacts.iter().map(|&i| wrenches.get(i)), &seeds, n);
    selection.grow(n);
    squares.fill(f64::INFINITY);
    let mut loss = Loss { wrenches: &wrenches, bins: &bins, survivors: &survivors, squares };
    let error = loop {
        let beyond = loss.beyond(&selection, first);
        let lengths = beyond.iter().map(|b| dot(&b.residual, &b.residual));
        let greatest = lengths.fold(selection.square(), f64::max);
        if selection.order().len() == n || beyond.is_empty() {
            break greatest.sqrt();
        }
        for Projected { contact, nearest, residual } in beyond {
            contacts.push(contact);
            selection.add(wrenches.get(contact), nearest, residual);
        }
        selection.grow(n);
    };
    let kept = selection.order().iter().map(|&k| order[contacts[k]] as usize).collect();
    let held = size_of_val(order.as_slice())
        + size_of_val(loss.squares.as_slice())
        + contacts.capacity() * size_of::<usize>()
        + bins.bytes()
        + survivors.bytes()
        + selection.bytes();
    Choice { places: kept, error, bytes: wrenches.bytes() + held.max(sort_bytes(order.len())) }
}
