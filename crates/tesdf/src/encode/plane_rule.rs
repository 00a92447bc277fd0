//! Rule B of the filter: compares a linear lower bound of a face's distance with the chord of
//! another face, the rival.

use glam::DVec3;

use super::candidates::{Candidates, GRADIENT};
use super::doubles::{Doubles, GROUP, Vector, dispatch, visit_members};
use super::surface::{Surface, Touching};
use crate::domain::Cell;

/// A corner counts as lying on a face when its distance is below this share of the margin: the
/// rounding of the distance to a face that the corner lies on.
const TIE: f64 = 0.25;

/// The largest number of rivals that a candidate is compared with. The nearest faces are taken.
const MAX_RIVALS: usize = 96;

/// Buffers for the chords of chosen rivals.
#[derive(Debug, Default)]
pub struct Rivals {
    order: Vec<u32>,
    rows: [Vec<f64>; 4],
}

/// The chords that candidates are compared with: their values at the four corners, in rows.
#[derive(Clone, Copy)]
pub struct Chords<'a> {
    rows: [&'a [f64]; 4],
    /// The least value at each corner.
    least: [f64; 4],
}

impl Rivals {
    /// Chooses all candidates where there are few, and otherwise the [`MAX_RIVALS`] of those
    /// `alive` whose chords have the least sum.
    ///
    /// Where there are few, it does not matter that rule A has dropped some of them: the point that
    /// beats such a face belongs to a face whose chord lies lower at all corners.
    pub fn choose<'a>(&'a mut self, candidates: &Candidates<'a>, alive: &[u8]) -> Chords<'a> {
        let distances = candidates.seen.map(|rows| &rows[..candidates.stride]);
        let least = candidates.nearest.map(|h| h.distance);
        if candidates.stride <= MAX_RIVALS {
            return Chords { rows: distances, least };
        }
        self.order.clear();
        visit_members(alive, alive, |index, _| self.order.push(index as u32));
        if self.order.len() > MAX_RIVALS {
            let [a, b, c, d] = distances;
            let sum = |h: u32| a[h as usize] + b[h as usize] + c[h as usize] + d[h as usize];
            self.order.select_nth_unstable_by(MAX_RIVALS, |&a, &b| sum(a).total_cmp(&sum(b)).then(a.cmp(&b)));
            self.order.truncate(MAX_RIVALS);
        }
        for (row, from) in self.rows.iter_mut().zip(distances) {
            row.clear();
            row.extend(self.order.iter().map(|&h| from[h as usize]));
            row.resize(row.len().next_multiple_of(GROUP), f64::INFINITY);
        }
        let [a, b, c, d] = &self.rows;
        Chords { rows: [a, b, c, d], least }
    }
}

/// The result of the rule for each candidate.
#[derive(Debug, Default)]
pub struct Verdict {
    low: Vec<f64>,
    beaten: Vec<u8>,
}

impl Verdict {
    /// A lower bound of the candidate's distance in the whole cell, and whether a rival beats the
    /// candidate.
    pub fn of(&self, index: usize) -> (f64, bool) {
        (self.low[index], self.beaten[index / GROUP] >> (index % GROUP) & 1 == 1)
    }
}

/// All that the rule reads.
pub struct PlaneRule<'a> {
    /// The rows of the centroid and of the corners.
    seen: [&'a [f64]; 5],
    stride: usize,
    /// The vectors from the centroid and from each corner to the corners.
    offsets: [[DVec3; 4]; 5],
    margin: f64,
    /// The margin times the width of the cell.
    turn: f64,
    /// A face that is this near to a corner shares it. Negative where the rule leaves ties alone.
    tie: f64,
    rivals: Chords<'a>,
}

impl<'a> PlaneRule<'a> {
    /// The rule for a cell. `centroid` has the distances from its centroid.
    pub fn new(
        surface: &Surface,
        cell: &Cell,
        candidates: &Candidates<'a>,
        centroid: &'a [f64],
        rivals: Chords<'a>,
    ) -> Self {
        let [a, b, c, d] = cell.corners;
        let [seen_a, seen_b, seen_c, seen_d] = candidates.seen;
        Self {
            seen: [centroid, seen_a, seen_b, seen_c, seen_d],
            stride: candidates.stride,
            offsets: [cell.centroid(), a, b, c, d].map(|at| cell.corners.map(|c| c - at)),
            margin: surface.margin,
            turn: surface.margin * cell.width(),
            tie: match surface.touching {
                // Faces that touch the cell are listed whatever this rule says.
                Touching::Kept => -1.0,
                Touching::Ignored => TIE * surface.margin,
            },
            rivals,
        }
    }

    /// Judges the candidates that are `alive`, and also bounds those that are `near`.
    ///
    /// d(·, g) is convex, so it lies above its tangent at the centroid and at each corner. The
    /// slope has an error: the rounding of the closest point over the distance. So the bound is
    /// lowered by this error times the width of the cell, and once more by the margin that the rule
    /// asks for. A candidate is beaten when the chord of a rival lies below one of the candidate's
    /// tangents at all four corners.
    ///
    /// Where a corner of the cell lies on both faces, both distances are 0 there, so there can be
    /// no margin. The margin at the other corners is enough: the tangent may pass the shared corner
    /// at 0 (docs/math.md, 4).
    pub fn judge(&self, isa: crate::base::Isa, alive: &[u8], near: &[u8], verdict: &mut Verdict) {
        if verdict.low.len() < self.stride {
            verdict.low.resize(self.stride, 0.0);
            verdict.beaten.resize(self.stride / GROUP, 0);
        }
        judge(isa, self, alive, near, &mut verdict.low, &mut verdict.beaten);
    }
}

dispatch! {
    fn judge(rule: &PlaneRule, alive: &[u8], near: &[u8], low: &mut [f64], beaten: &mut [u8]) = judge_lanes
}

#[inline(always)]
fn judge_lanes<L: Doubles>(rule: &PlaneRule, alive: &[u8], near: &[u8], low: &mut [f64], beaten: &mut [u8]) {
    if rule.tie < 0.0 {
        judge_groups::<L, false>(rule, alive, near, low, beaten);
    } else {
        judge_groups::<L, true>(rule, alive, near, low, beaten);
    }
}

/// `TIES` says whether a corner can share faces.
#[inline(always)]
fn judge_groups<L: Doubles, const TIES: bool>(
    rule: &PlaneRule,
    alive: &[u8],
    near: &[u8],
    low: &mut [f64],
    beaten: &mut [u8],
) {
    let mut winner = 0;
    for group in 0..alive.len() {
        beaten[group] = 0;
        if alive[group] | near[group] == 0 {
            continue;
        }
        let mut lane = 0;
        while lane < GROUP {
            let in_question = alive[group] >> lane;
            let at = group * GROUP + lane;
            beaten[group] |= judge_at::<L, TIES>(rule, at, in_question, low, &mut winner) << lane;
            lane += L::LANES;
        }
    }
}

/// Computes the bounds of one vector of candidates. Returns which candidates of `in_question` are
/// beaten. `winner` is as for [`any_below`].
#[inline(always)]
fn judge_at<L: Doubles, const TIES: bool>(
    rule: &PlaneRule,
    at: usize,
    in_question: u8,
    low: &mut [f64],
    winner: &mut usize,
) -> u8 {
    let least = &rule.rivals.least;
    let margin = L::splat(rule.margin);
    let floor = L::splat(-rule.margin);
    let mut highest = L::splat(f64::NEG_INFINITY);
    let mut beaten = 0;
    for from in 0..5 {
        let rows = rule.seen[from];
        let distance = L::load(rows, at);
        let slope = Vector::<L>::load(&rows[GRADIENT * rule.stride..], rule.stride, at);
        let by_slope = L::splat(rule.turn).div(distance);
        let lowered = distance.sub(margin).sub(by_slope);
        let touching = margin.at_least(distance);
        let [to_a, to_b, to_c, to_d] = rule.offsets[from];
        let mut a = L::select(touching, floor, lowered.add(slope.dot(Vector::splat(to_a))));
        let mut b = L::select(touching, floor, lowered.add(slope.dot(Vector::splat(to_b))));
        let mut c = L::select(touching, floor, lowered.add(slope.dot(Vector::splat(to_c))));
        let mut d = L::select(touching, floor, lowered.add(slope.dot(Vector::splat(to_d))));
        highest = highest.max(a.min(b).min(c.min(d)));
        if TIES {
            let raised = margin.add(by_slope);
            a = at_tie(rule, at, 1, a, raised);
            b = at_tie(rule, at, 2, b, raised);
            c = at_tie(rule, at, 3, c, raised);
            d = at_tie(rule, at, 4, d, raised);
        }
        let first = L::both(a.at_least(L::splat(least[0])), b.at_least(L::splat(least[1])));
        let second = L::both(c.at_least(L::splat(least[2])), d.at_least(L::splat(least[3])));
        let mut open = L::bits(L::both(first, second)) & in_question & !beaten;
        if open != 0 {
            let mut values = [[0.0; GROUP]; 4];
            a.store(&mut values[0], 0);
            b.store(&mut values[1], 0);
            c.store(&mut values[2], 0);
            d.store(&mut values[3], 0);
            while open != 0 {
                let lane = open.trailing_zeros() as usize;
                open &= open - 1;
                let t = [values[0][lane], values[1][lane], values[2][lane], values[3][lane]];
                // A cell that is no thicker than the tie cannot tell faces apart.
                let tied = t[0] == rule.tie && t[1] == rule.tie && t[2] == rule.tie && t[3] == rule.tie;
                beaten |= u8::from(!tied && any_below::<L>(&rule.rivals.rows, t, winner)) << lane;
            }
        }
    }
    highest.store(low, at);
    beaten
}

/// The value of a tangent at a corner that may lie on the candidates. It is enough that the
/// tangent, before it was lowered, is not below 0 there.
#[inline(always)]
fn at_tie<L: Doubles>(rule: &PlaneRule, at: usize, corner: usize, value: L, lowered_by: L) -> L {
    let tie = L::splat(rule.tie);
    let shares = tie.at_least(L::load(rule.seen[corner], at));
    let passes = value.add(lowered_by).at_least(L::splat(-rule.margin));
    L::select(L::both(shares, passes), tie, value)
}

/// Whether some chord lies below all four values. The chords at `winner` are tried first; it
/// becomes the place of a chord that was found. Neighbouring candidates often have the same rival.
#[inline(always)]
fn any_below<L: Doubles>(chords: &[&[f64]; 4], t: [f64; 4], winner: &mut usize) -> bool {
    let t = [L::splat(t[0]), L::splat(t[1]), L::splat(t[2]), L::splat(t[3])];
    let count = chords[0].len();
    if *winner < count && group_below(chords, t, *winner) {
        return true;
    }
    let mut at = 0;
    while at < count {
        if group_below(chords, t, at) {
            *winner = at;
            return true;
        }
        at += GROUP;
    }
    false
}

/// Whether one of the [`GROUP`] chords at `at` lies below all four values.
#[inline(always)]
fn group_below<L: Doubles>(chords: &[&[f64]; 4], t: [L; 4], at: usize) -> bool {
    let mut below = 0;
    let mut lane = at;
    while lane < at + GROUP {
        let first = L::both(t[0].at_least(L::load(chords[0], lane)), t[1].at_least(L::load(chords[1], lane)));
        let second =
            L::both(t[2].at_least(L::load(chords[2], lane)), t[3].at_least(L::load(chords[3], lane)));
        below |= L::bits(L::both(first, second));
        lane += L::LANES;
    }
    below != 0
}
