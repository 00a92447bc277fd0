//! Reports of contacts of a pair of instances that were kept while others were not found.
use glam::DVec3;

use super::ball;
use super::wrenches::wrench_of;
use crate::collide::report::contact::{Contact, PairReduction};
use crate::collide::report::hull::{Wrench, dot, residual};

/// Where contacts of a pair can be that were not found: a ball that contains them and all others.
#[derive(Clone, Copy, Debug)]
pub struct Unfound {
    /// The centre of the ball, in the world.
    pub center: DVec3,
    /// The radius of the ball.
    pub length: f64,
    /// None of them has a distance below this.
    pub above: f64,
}

/// The report of the contacts of a pair that were kept of `found` ones. Without `unfound`, they are
/// all that the pair has. No report without contacts.
pub fn report_of_kept(kept: &[Contact], found: usize, unfound: Option<Unfound>) -> Option<PairReduction> {
    let Contact { instance_a: a, instance_b: b, .. } = *kept.first()?;
    let (center, length) = match unfound {
        Some(Unfound { center, length, .. }) => (center, length),
        None => ball(kept.iter()),
    };
    let error = |_| greatest_error(&kept.iter().map(|c| wrench_of(c, center, length)).collect::<Vec<_>>());
    Some(PairReduction {
        instance_a: a.min(b),
        instance_b: a.max(b),
        contacts: found,
        kept: kept.len(),
        wrench_error: unfound.map_or(0.0, error),
        center,
        length,
        left_out_above: unfound.map(|unfound| unfound.above),
    })
}

/// Upper bound of the distance of any wrench from the hull: a unit force in any direction, at any
/// point of the ball. A wrench is at most √2 from 0, and 0 is as far from the hull as its nearest
/// point.
fn greatest_error(hull: &[Wrench]) -> f64 {
    let from_zero = residual(hull, &[0.0; 6]);
    std::f64::consts::SQRT_2 + dot(&from_zero, &from_zero).sqrt()
}
