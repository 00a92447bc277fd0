//! Overlaps that no contact showed, as a run keeps them.
use std::collections::BTreeMap;

use serde::Serialize;
use tesdf::collide::HiddenOverlap;

use super::RunRecord;
use crate::System;

/// Two bodies that overlapped although no contact showed it, during a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HiddenPair {
    /// Names of the bodies.
    pub bodies: [String; 2],
    /// The first step at whose beginning they did, from 0.
    pub first_step: u64,
    /// The number of such steps.
    pub steps: u64,
    /// The greatest depth, m, at least.
    pub depth: f64,
}

impl HiddenPair {
    /// A sentence for people.
    pub fn message(&self) -> String {
        let Self { bodies: [a, b], first_step, depth, .. } = self;
        format!(
            "bodies {a} and {b} overlapped by {depth:.3e} m or more, first at step {first_step}, and no contact showed it"
        )
    }
}

/// All that a record keeps, a row for each step and pair; steps ascend.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct HiddenRows {
    pub steps: Vec<u64>,
    /// Numbers of the bodies.
    pub ids: Vec<[u32; 2]>,
    /// m, at least.
    pub depths: Vec<f64>,
}

impl HiddenRows {
    /// The rows of a step.
    pub fn of_step(&self, step: u64) -> std::ops::Range<usize> {
        self.steps.partition_point(|&s| s < step)..self.steps.partition_point(|&s| s <= step)
    }

    /// Whether they are of one length, of steps and bodies that there are.
    pub fn fit(&self, steps: u64, bodies: usize) -> bool {
        [self.ids.len(), self.depths.len()] == [self.steps.len(); 2]
            && self.steps.is_sorted()
            && self.steps.last().is_none_or(|&step| step < steps)
            && self.ids.as_flattened().iter().all(|&body| (body as usize) < bodies)
    }
}

impl RunRecord {
    /// Adds the pairs that overlapped at the beginning of a step although no contact showed it; steps ascend.
    pub fn push_hidden(&mut self, step: u64, overlaps: &[HiddenOverlap], system: &System) {
        for overlap in overlaps {
            let bodies = [overlap.instance_a, overlap.instance_b].map(|instance| system.body_of(instance));
            if let [Some(a), Some(b)] = bodies {
                self.hidden.steps.push(step);
                self.hidden.ids.push([a as u32, b as u32]);
                self.hidden.depths.push(overlap.depth);
            }
        }
    }

    /// The pairs of bodies that overlapped at the beginning of some step although no contact showed it, sorted by the numbers of the bodies.
    pub fn hidden_pairs(&self) -> Vec<HiddenPair> {
        let mut pairs: BTreeMap<[u32; 2], HiddenPair> = BTreeMap::new();
        let rows = &self.hidden;
        for ((&step, &ids), &depth) in rows.steps.iter().zip(&rows.ids).zip(&rows.depths) {
            let pair = pairs.entry(ids).or_insert_with(|| {
                let bodies = ids.map(|body| self.bodies.get(body as usize).cloned().unwrap_or_default());
                HiddenPair { bodies, first_step: step, steps: 0, depth }
            });
            pair.steps += 1;
            pair.depth = pair.depth.max(depth);
        }
        pairs.into_values().collect()
    }
}
