//! Hidden overlaps in a run. An overlap of two bodies is hidden when no contact shows it.
use std::collections::BTreeMap;

use serde::Serialize;
use tesdf::collide::HiddenOverlap;

use super::RunRecord;
use crate::System;

/// Two bodies that overlapped during a run without a contact that shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HiddenPair {
    /// Names of the bodies.
    pub bodies: [String; 2],
    /// The first step, from 0, at whose beginning the overlap was hidden.
    pub first_step: u64,
    /// Number of steps with a hidden overlap of this pair.
    pub steps: u64,
    /// Lower bound of the greatest depth, m.
    pub depth: f64,
}

impl HiddenPair {
    /// A message for users.
    pub fn message(&self) -> String {
        let Self { bodies: [a, b], first_step, depth, .. } = self;
        format!(
            "bodies {a} and {b} overlapped by {depth:.3e} m or more, first at step {first_step}, and no contact showed it"
        )
    }
}

/// The pairs of bodies with a hidden overlap, by their numbers, with the first step, the number of
/// steps and the greatest depth.
#[derive(Clone, Debug, Default)]
pub(crate) struct HiddenPairs(BTreeMap<[u32; 2], (u64, u64, f64)>);

impl HiddenPairs {
    /// Adds an overlap at the beginning of a step. The steps ascend.
    fn note(&mut self, step: u64, ids: [u32; 2], depth: f64) {
        let (_, steps, deepest) = self.0.entry(ids).or_insert((step, 0, depth));
        *steps += 1;
        *deepest = deepest.max(depth);
    }

    /// Adds the overlaps at the beginning of a step. The steps ascend.
    pub fn add(&mut self, step: u64, overlaps: &[HiddenOverlap], system: &System) {
        for (ids, depth) in of_bodies(overlaps, system) {
            self.note(step, ids, depth);
        }
    }

    /// The pairs, sorted by the numbers of their bodies, which have these names.
    pub fn pairs(&self, name: impl Fn(usize) -> String) -> Vec<HiddenPair> {
        let pair = |(&ids, &(first_step, steps, depth)): (&[u32; 2], &(u64, u64, f64))| HiddenPair {
            bodies: ids.map(|body| name(body as usize)),
            first_step,
            steps,
            depth,
        };
        self.0.iter().map(pair).collect()
    }
}

/// The numbers of the bodies of overlaps, and the depths.
fn of_bodies<'a>(
    overlaps: &'a [HiddenOverlap],
    system: &'a System,
) -> impl Iterator<Item = ([u32; 2], f64)> + 'a {
    overlaps.iter().filter_map(|overlap| {
        let [a, b] = [overlap.instance_a, overlap.instance_b].map(|instance| system.body_of(instance));
        Some(([a? as u32, b? as u32], overlap.depth))
    })
}

/// All hidden overlaps of a record, one row per step and pair. Steps ascend.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct HiddenRows {
    pub steps: Vec<u64>,
    /// Numbers of the two bodies.
    pub ids: Vec<[u32; 2]>,
    /// Lower bounds of the depths, m.
    pub depths: Vec<f64>,
}

impl HiddenRows {
    /// The rows of one step.
    pub fn of_step(&self, step: u64) -> std::ops::Range<usize> {
        self.steps.partition_point(|&s| s < step)..self.steps.partition_point(|&s| s <= step)
    }

    /// Whether all columns have the same length and refer to existing steps and bodies.
    pub fn fit(&self, steps: u64, bodies: usize) -> bool {
        [self.ids.len(), self.depths.len()] == [self.steps.len(); 2]
            && self.steps.is_sorted()
            && self.steps.last().is_none_or(|&step| step < steps)
            && self.ids.as_flattened().iter().all(|&body| (body as usize) < bodies)
    }
}

impl RunRecord {
    /// Appends the hidden overlaps at the beginning of `step`. The steps of successive calls must
    /// ascend.
    pub fn push_hidden(&mut self, step: u64, overlaps: &[HiddenOverlap], system: &System) {
        for (ids, depth) in of_bodies(overlaps, system) {
            self.hidden.steps.push(step);
            self.hidden.ids.push(ids);
            self.hidden.depths.push(depth);
        }
    }

    /// The pairs of bodies with a hidden overlap at the beginning of some step, sorted by their
    /// numbers.
    pub fn hidden_pairs(&self) -> Vec<HiddenPair> {
        let (mut pairs, rows) = (HiddenPairs::default(), &self.hidden);
        for ((&step, &ids), &depth) in rows.steps.iter().zip(&rows.ids).zip(&rows.depths) {
            pairs.note(step, ids, depth);
        }
        pairs.pairs(|body| self.bodies.get(body).cloned().unwrap_or_default())
    }
}
