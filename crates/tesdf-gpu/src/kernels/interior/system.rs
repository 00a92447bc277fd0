//! The linear system of an iteration: a dense matrix of all bodies of an island, which a group
//! factors with rows exchanged within bodies.
use cubecl::prelude::*;

use crate::kernels::interior::problem::{
    GROUP, INERTIA, Island, MASS, Memory, NONE, Pair, PairExpand, Problems, Six,
};

/// Most unknowns.
pub const UNKNOWNS: u32 = 6 * tesdf_sim::newton::internal::BODIES as u32;

/// Six numbers of each body, which a group shares.
pub type Bodies = Shared<[f64]>;

/// The place of the inertia of two axes among the numbers of a symmetric matrix.
#[cube]
fn place_of(i: u32, j: u32) -> u32 {
    select(i == j, i, i + j + 2u32)
}

/// `M v` of a body, its component `k`; `v` begins at `at`.
#[cube]
pub fn momentum(problems: &Problems, island: Island, body: u32, v: &Bodies, k: u32) -> f64 {
    let at = (6u32 * body) as usize;
    let mut value = problems.of_body(island, body, MASS) * v[at + k as usize];
    if k >= 3u32 {
        value = inertia_times(problems, island, body, INERTIA.runtime(), v, k - 3u32);
    }
    value
}

/// The component `i` of a symmetric matrix of a body times the angular part of `v`.
#[cube]
pub fn inertia_times(problems: &Problems, island: Island, body: u32, matrix: u32, v: &Bodies, i: u32) -> f64 {
    let at = (6u32 * body + 3u32) as usize;
    let mut sum = problems.of_body(island, body, matrix + place_of(i, 0u32)) * v[at];
    sum += problems.of_body(island, body, matrix + place_of(i, 1u32)) * v[at + 1];
    sum += problems.of_body(island, body, matrix + place_of(i, 2u32)) * v[at + 2];
    sum
}

#[cube]
impl Pair {
    /// The velocity that counts: `v − T v'` with `T (v, ω) = (v + ω × offset, ω)`.
    pub fn relative(self, v: &Bodies) -> Six {
        let at = (6u32 * self.body) as usize;
        let mut of = Six { a: v[at], b: v[at + 1], c: v[at + 2], d: v[at + 3], e: v[at + 4], f: v[at + 5] };
        if self.other != NONE {
            let at = (6u32 * self.other) as usize;
            let p = v[at + 3];
            let q = v[at + 4];
            let r = v[at + 5];
            of.a -= v[at] + (q * self.z - r * self.y);
            of.b -= v[at + 1] + (r * self.x - p * self.z);
            of.c -= v[at + 2] + (p * self.y - q * self.x);
            of.d -= p;
            of.e -= q;
            of.f -= r;
        }
        of
    }

    fn offset(self, axis: u32) -> f64 {
        select(axis == 0u32, self.x, select(axis == 1u32, self.y, self.z))
    }

    /// The factor of row `i` in column `column` of `T`, where `i` is a linear component and the
    /// column an angular one.
    fn turned(self, i: u32, column: u32) -> f64 {
        let j = column - 3u32;
        let next = (j + 1u32) % 3u32;
        let last = (j + 2u32) % 3u32;
        let mut factor = 0.0f64;
        if i == next {
            factor = -self.offset(last);
        }
        if i == last {
            factor = self.offset(next);
        }
        factor
    }

    /// An entry of `S T`, where `S` are the sums of the group.
    fn times_transport(self, memory: &mut Memory, island: Island, row: u32, column: u32) -> f64 {
        let mut sum = self.entry(memory, island, row, column);
        if column >= 3u32 {
            let mut i = 0u32;
            while i < 3u32 {
                sum += self.turned(i, column) * self.entry(memory, island, row, i);
                i += 1u32;
            }
        }
        sum
    }

    /// An entry of `Tᵀ S`.
    fn transported(self, memory: &mut Memory, island: Island, row: u32, column: u32) -> f64 {
        let mut sum = self.entry(memory, island, row, column);
        if row >= 3u32 {
            let mut i = 0u32;
            while i < 3u32 {
                sum += self.turned(i, row) * self.entry(memory, island, i, column);
                i += 1u32;
            }
        }
        sum
    }

    /// An entry of `Tᵀ S T`.
    fn both(self, memory: &mut Memory, island: Island, row: u32, column: u32) -> f64 {
        let mut sum = self.times_transport(memory, island, row, column);
        if row >= 3u32 {
            let mut i = 0u32;
            while i < 3u32 {
                sum += self.turned(i, row) * self.times_transport(memory, island, i, column);
                i += 1u32;
            }
        }
        sum
    }

    fn entry(self, memory: &mut Memory, island: Island, row: u32, column: u32) -> f64 {
        memory.sum(island, self.first_run, 6u32 * column + row)
    }

    /// What the momentum that begins at `from` of the sums of the group is for one of its bodies,
    /// its component `k`.
    pub fn of_momentum(self, memory: &mut Memory, island: Island, from: u32, is_other: bool, k: u32) -> f64 {
        let mut value = memory.sum(island, self.first_run, from + k);
        if is_other {
            if k >= 3u32 {
                let mut i = 0u32;
                while i < 3u32 {
                    value += self.turned(i, k) * memory.sum(island, self.first_run, from + i);
                    i += 1u32;
                }
            }
            value = -value;
        }
        value
    }
}

/// Adds the sums of the runs of each group up in its first run, from the sum `from` on.
#[cube]
pub fn add_up(problems: &Problems, memory: &mut Memory, island: Island, from: u32, count: u32) {
    sync_cube();
    let mut k = UNIT_POS;
    while k < count * island.groups {
        let pair = problems.pair(island, k / count);
        let place = from + k % count;
        let mut sum = memory.sum(island, pair.first_run, place);
        let mut run = 1u32;
        while run < pair.runs {
            sum += memory.sum(island, pair.first_run + run, place);
            run += 1u32;
        }
        memory.put_sum(island, pair.first_run, place, sum);
        k += GROUP;
    }
    sync_cube();
}

/// Adds what the momenta of all groups, which begin at `from` of their sums, are for the bodies.
#[cube]
pub fn act(problems: &Problems, memory: &mut Memory, island: Island, from: u32, to: &mut Bodies) {
    let mut k = UNIT_POS;
    while k < 6u32 * island.bodies {
        let body = k / 6u32;
        let mut sum = to[k as usize];
        let mut place = problems.first_of_body(island, body);
        let end = problems.first_of_body(island, body + 1u32);
        while place < end {
            let of = problems.of_bodies(island, place);
            let pair = problems.pair(island, of / 2u32);
            sum += pair.of_momentum(memory, island, from, of % 2u32 == 1u32, k % 6u32);
            place += 1u32;
        }
        to[k as usize] = sum;
        k += GROUP;
    }
    sync_cube();
}

/// Writes the matrix: inertia, and the sums of all groups.
#[cube]
pub fn assemble(problems: &Problems, memory: &mut Memory, island: Island) {
    let size = 6u32 * island.bodies;
    let mut k = UNIT_POS;
    while k < size * size {
        let row = k / size;
        let column = k % size;
        let body = row / 6u32;
        let beside = column / 6u32;
        let i = row % 6u32;
        let j = column % 6u32;
        let mut sum = 0.0f64;
        if body == beside {
            if i < 3u32 && i == j {
                sum = problems.of_body(island, body, MASS);
            }
            if i >= 3u32 && j >= 3u32 {
                sum = problems.of_body(island, body, INERTIA + place_of(i - 3u32, j - 3u32));
            }
        }
        let mut place = problems.first_of_body(island, body);
        let end = problems.first_of_body(island, body + 1u32);
        while place < end {
            let of = problems.of_bodies(island, place);
            let pair = problems.pair(island, of / 2u32);
            let is_other = of % 2u32 == 1u32;
            if body == beside {
                if is_other {
                    sum += pair.both(memory, island, i, j);
                } else {
                    sum += memory.sum(island, pair.first_run, 6u32 * j + i);
                }
            } else if is_other && pair.body == beside {
                sum -= pair.transported(memory, island, i, j);
            } else if !is_other && pair.other == beside {
                sum -= pair.times_transport(memory, island, i, j);
            }
            place += 1u32;
        }
        memory.put_entry(island, row, column, sum);
        k += GROUP;
    }
    sync_cube();
}

/// Factors the matrix in place: above and on the diagonal `U`, below it the numbers before they are
/// divided by the diagonal. `exchanged` are the rows that were exchanged. Returns whether there is
/// a factor.
#[cube]
pub fn factor(memory: &mut Memory, island: Island, exchanged: &mut Shared<[u32]>) -> bool {
    let size = 6u32 * island.bodies;
    let mut regular = true;
    let mut k = 0u32;
    while k < size {
        // The greatest number of the column, within the body.
        let end = k - k % 6u32 + 6u32;
        let mut pivot = k;
        let mut greatest = memory.entry(island, k, k).abs();
        let mut row = k + 1u32;
        while row < end {
            let other = memory.entry(island, row, k).abs();
            if other > greatest {
                greatest = other;
                pivot = row;
            }
            row += 1u32;
        }
        regular = regular && greatest > 0.0f64;
        sync_cube();
        if UNIT_POS == 0u32 {
            exchanged[k as usize] = pivot;
        }
        if pivot != k {
            let mut column = UNIT_POS;
            while column < size {
                let value = memory.entry(island, k, column);
                let other = memory.entry(island, pivot, column);
                memory.put_entry(island, k, column, other);
                memory.put_entry(island, pivot, column, value);
                column += GROUP;
            }
        }
        sync_cube();
        let rest = size - k - 1u32;
        let divisor = memory.entry(island, k, k);
        let mut at = UNIT_POS;
        while at < rest * rest {
            let row = k + 1u32 + at / rest;
            let column = k + 1u32 + at % rest;
            let factor = memory.entry(island, row, k) / divisor;
            let value = memory.entry(island, row, column) - factor * memory.entry(island, k, column);
            memory.put_entry(island, row, column, value);
            at += GROUP;
        }
        sync_cube();
        k += 1u32;
    }
    regular
}

/// Replaces a right-hand side by the solution.
#[cube]
pub fn solve(memory: &mut Memory, island: Island, exchanged: &Shared<[u32]>, x: &mut Bodies) {
    let size = 6u32 * island.bodies;
    sync_cube();
    if UNIT_POS == 0u32 {
        let mut k = 0u32;
        while k < size {
            let other = exchanged[k as usize] as usize;
            let value = x[k as usize];
            x[k as usize] = x[other];
            x[other] = value;
            k += 1u32;
        }
    }
    sync_cube();
    let mut k = 0u32;
    while k < size {
        let known = x[k as usize] / memory.entry(island, k, k);
        let mut row = k + 1u32 + UNIT_POS;
        while row < size {
            x[row as usize] -= memory.entry(island, row, k) * known;
            row += GROUP;
        }
        sync_cube();
        k += 1u32;
    }
    let mut left = size;
    while left > 0u32 {
        let k = left - 1u32;
        let known = x[k as usize] / memory.entry(island, k, k);
        sync_cube();
        if UNIT_POS == 0u32 {
            x[k as usize] = known;
        }
        let mut row = UNIT_POS;
        while row < k {
            x[row as usize] -= memory.entry(island, row, k) * known;
            row += GROUP;
        }
        sync_cube();
        left -= 1u32;
    }
}
