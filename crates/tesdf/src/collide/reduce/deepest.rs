//! Keeps the deepest contacts of a pair of instances.
use glam::DVec3;

use super::super::hull::{Wrench, dot, residual};
use super::super::{Contact, PairReduction};
use super::wrenches::wrench_of;
use super::{OfPair, Run, ball};
use crate::parallel::*;

/// Where contacts of a pair can be that were not found: a ball that contains them and all others.
#[derive(Clone, Copy, Debug)]
pub struct Unfound {
    /// The centre of the ball, in the world.
    pub center: DVec3,
    /// The radius of the ball.
    pub length: f64,
}

/// The deepest contacts of one pair, whose runs are given.
pub fn reduce(contacts: &[Contact], runs: &[Run], n: usize) -> OfPair {
    let places: Vec<usize> = runs.iter().flat_map(|run| run.start..run.end).collect();
    let of_pair: Vec<Contact> = places.iter().map(|&place| contacts[place]).collect();
    let (kept, report) = keep(&of_pair, n, None);
    let bytes = size_of_val(places.as_slice()) + size_of_val(of_pair.as_slice());
    OfPair { kept: kept.into_iter().map(|k| places[k]).collect(), report, bytes }
}

/// The deepest contacts of one pair, in the order of a detection, and the report; no report without
/// contacts. `unfound` says where other contacts can be, none of which is among the deepest.
pub fn deepest_of_pair(
    contacts: &[Contact],
    n: usize,
    unfound: Option<Unfound>,
) -> (Vec<Contact>, Option<PairReduction>) {
    if contacts.is_empty() {
        return (Vec::new(), None);
    }
    let (kept, report) = keep(contacts, n, unfound);
    (kept.into_iter().map(|k| contacts[k]).collect(), Some(report))
}

/// The report of contacts of a pair that were kept although others can be in the ball, none of them
/// with a distance below `left_out_above`.
pub fn report_of_kept(
    kept: &[Contact],
    found: usize,
    Unfound { center, length }: Unfound,
    left_out_above: f64,
) -> Option<PairReduction> {
    let Contact { instance_a: a, instance_b: b, .. } = *kept.first()?;
    let hull: Vec<Wrench> = kept.iter().map(|c| wrench_of(c, center, length)).collect();
    Some(PairReduction {
        instance_a: a.min(b),
        instance_b: a.max(b),
        contacts: found,
        kept: kept.len(),
        wrench_error: greatest_error(&hull),
        center,
        length,
        left_out_above: Some(left_out_above),
    })
}

/// The indices of the deepest contacts, ascending, and those of the others. Of equally deep
/// contacts, the first are among the deepest.
pub fn split_deepest(contacts: &[Contact], n: usize) -> (Vec<usize>, Vec<usize>) {
    let mut order: Vec<usize> = (0..contacts.len()).collect();
    let deeper =
        |&i: &usize, &j: &usize| contacts[i].distance.total_cmp(&contacts[j].distance).then(i.cmp(&j));
    let count = n.min(contacts.len());
    if count < contacts.len() {
        order.select_nth_unstable_by(count, deeper);
    }
    let others = order.split_off(count);
    order.sort_unstable();
    (order, others)
}

/// The indices of the deepest contacts, ascending, and the report.
fn keep(contacts: &[Contact], n: usize, unfound: Option<Unfound>) -> (Vec<usize>, PairReduction) {
    let (kept, others) = split_deepest(contacts, n);
    let (center, length) = match unfound {
        Some(Unfound { center, length }) => (center, length),
        None => ball(contacts.iter()),
    };
    let wrench = |&i: &usize| wrench_of(&contacts[i], center, length);
    let hull: Vec<Wrench> = kept.iter().map(wrench).collect();
    let wrench_error = match unfound {
        Some(_) => greatest_error(&hull),
        None => error(&hull, &others.iter().map(wrench).collect::<Vec<_>>()),
    };
    let is_all = others.is_empty() && unfound.is_none();
    let last = kept.iter().map(|&i| contacts[i].distance).fold(f64::NEG_INFINITY, f64::max);
    let Contact { instance_a: a, instance_b: b, .. } = contacts[0];
    let report = PairReduction {
        instance_a: a.min(b),
        instance_b: a.max(b),
        contacts: contacts.len(),
        kept: kept.len(),
        wrench_error,
        center,
        length,
        left_out_above: (!is_all).then_some(last),
    };
    (kept, report)
}

/// Upper bound of the distance of any wrench from the hull: a unit force in any direction, at any
/// point of the ball. A wrench is at most √2 from 0, and 0 is as far from the hull as its nearest
/// point.
fn greatest_error(hull: &[Wrench]) -> f64 {
    let from_zero = residual(hull, &[0.0; 6]);
    std::f64::consts::SQRT_2 + dot(&from_zero, &from_zero).sqrt()
}

/// The greatest distance of a wrench from the hull.
fn error(hull: &[Wrench], wrenches: &[Wrench]) -> f64 {
    let square = |w: &Wrench, v: &Wrench| (0..6).map(|c| (w[c] - v[c]).powi(2)).sum::<f64>();
    let to_point = |w: &Wrench| hull.iter().map(|v| square(w, v)).fold(f64::INFINITY, f64::min);
    // The distance from the points is at least that from the hull, and takes less time.
    let mut bounds: Vec<(f64, usize)> =
        wrenches.par_iter().enumerate().map(|(i, w)| (to_point(w), i)).collect();
    bounds.sort_unstable_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
    let mut greatest = 0.0f64;
    for (bound, i) in bounds {
        if bound <= greatest {
            break;
        }
        let from_hull = residual(hull, &wrenches[i]);
        greatest = greatest.max(dot(&from_hull, &from_hull));
    }
    greatest.sqrt()
}
