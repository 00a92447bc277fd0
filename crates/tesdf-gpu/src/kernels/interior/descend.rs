//! Solves the problems of islands. A group takes one.
//!
//! Mirrors `newton/interior/iteration.rs` of `tesdf-sim` for Coulomb's friction: from the guess, if
//! there is one, then from no forces. Friction with lagged limits is left to the processor.
use cubecl::prelude::*;
use tesdf_sim::newton::internal::constants;

use crate::kernels::interior::problem::{
    ACTING, AIMS, BEGINS, BROUGHT, COMPLIANCE, DIRECTION, FORCE, FRICTION, GAP, GROUP, GUESS, INVERSE,
    INVERSE_MASS, Island, LEVER, Memory, NORMAL, Problems, ROOM, SLACK, SLIP_SCALE, SUMS, Six, TANGENTS,
    TARGET, WAY,
};
use crate::kernels::interior::row::{LONGEST, Stage, direction};
use crate::kernels::interior::system::{
    Bodies, UNKNOWNS, act, add_up, assemble, factor, inertia_times, momentum, solve,
};

const PROXIMAL: f64 = constants::PROXIMAL;
const CLOSED: f64 = constants::CLOSED;
const FEW: f64 = constants::FEW;
const FIRST: f64 = constants::FIRST;
const FINE: u32 = constants::FINE;
const LEAST_CENTRING: f64 = constants::LEAST_CENTRING;
const SHORTER: f64 = constants::SHORTER;
const SHORT: f64 = constants::SHORT;
const LONG: f64 = constants::LONG;
const LENGTHENS: f64 = constants::LENGTHENS;
const COARSE_WIDTH: f64 = constants::WIDTHS[0];
const FINE_WIDTH: f64 = constants::WIDTHS[1];
const WARM_ITERATIONS: u32 = constants::WARM.iterations;
const WARM_SHORT: u32 = constants::WARM.short_steps;
const WARM_SETTLED: f64 = constants::WARM.settled;
const COLD_ITERATIONS: u32 = constants::COLD.iterations;
const COLD_SHORT: u32 = constants::COLD.short_steps;
const COLD_SETTLED: f64 = constants::COLD.settled;
const CONVEX_ITERATIONS: u32 = constants::CONVEX.iterations;

/// What a group shares.
#[derive(CubeType)]
struct GroupMemory {
    velocity: Bodies,
    /// The momentum that velocities and forces leave.
    momentum: Bodies,
    /// The change of the velocity of the first and of the second direction.
    first: Bodies,
    second: Bodies,
    /// A number of each thread.
    numbers: Shared<[f64]>,
    /// Rows that the factorisation exchanged.
    exchanged: Shared<[u32]>,
}

#[cube]
impl GroupMemory {
    fn of_group() -> GroupMemory {
        GroupMemory {
            velocity: Shared::<[f64]>::new_slice(UNKNOWNS as usize),
            momentum: Shared::<[f64]>::new_slice(UNKNOWNS as usize),
            first: Shared::<[f64]>::new_slice(UNKNOWNS as usize),
            second: Shared::<[f64]>::new_slice(UNKNOWNS as usize),
            numbers: Shared::<[f64]>::new_slice(GROUP as usize),
            exchanged: Shared::<[u32]>::new_slice(UNKNOWNS as usize),
        }
    }

    /// The greatest number of all threads.
    fn greatest(&mut self, mine: f64) -> f64 {
        sync_cube();
        self.numbers[UNIT_POS as usize] = mine;
        sync_cube();
        let mut apart = comptime!(GROUP / 2).runtime();
        while apart > 0u32 {
            if UNIT_POS < apart {
                let at = UNIT_POS as usize;
                let other = self.numbers[(UNIT_POS + apart) as usize];
                self.numbers[at] = self.numbers[at].max(other);
            }
            apart /= 2u32;
            sync_cube();
        }
        self.numbers[0]
    }

    /// The sum of the numbers of all threads.
    fn sum(&mut self, mine: f64) -> f64 {
        sync_cube();
        self.numbers[UNIT_POS as usize] = mine;
        sync_cube();
        let mut apart = comptime!(GROUP / 2).runtime();
        while apart > 0u32 {
            if UNIT_POS < apart {
                let at = UNIT_POS as usize;
                let other = self.numbers[(UNIT_POS + apart) as usize];
                self.numbers[at] += other;
            }
            apart /= 2u32;
            sync_cube();
        }
        self.numbers[0]
    }
}

/// Adds `j` times a force.
#[cube]
fn add_force(sums: &mut Array<f64>, at: u32, j: Six, force: f64) {
    let k = at as usize;
    sums[k] += j.a * force;
    sums[k + 1] += j.b * force;
    sums[k + 2] += j.c * force;
    sums[k + 3] += j.d * force;
    sums[k + 4] += j.e * force;
    sums[k + 5] += j.f * force;
}

/// Adds `rows columnsᵀ`.
#[cube]
fn add_product(sums: &mut Array<f64>, rows: Six, columns: Six) {
    add_force(sums, 0u32, rows, columns.a);
    add_force(sums, 6u32, rows, columns.b);
    add_force(sums, 12u32, rows, columns.c);
    add_force(sums, 18u32, rows, columns.d);
    add_force(sums, 24u32, rows, columns.e);
    add_force(sums, 30u32, rows, columns.f);
}

#[cube]
fn times(j: Six, factor: f64) -> Six {
    Six {
        a: factor * j.a,
        b: factor * j.b,
        c: factor * j.c,
        d: factor * j.d,
        e: factor * j.e,
        f: factor * j.f,
    }
}

#[cube]
fn plus(i: Six, j: Six) -> Six {
    Six { a: i.a + j.a, b: i.b + j.b, c: i.c + j.c, d: i.d + j.d, e: i.e + j.e, f: i.f + j.f }
}

#[cube]
fn no_sums() -> Array<f64> {
    let mut sums = Array::<f64>::new(SUMS as usize);
    #[unroll]
    for k in 0..SUMS {
        sums[k as usize] = 0.0f64;
    }
    sums
}

/// Writes the sums of a run from `from` on.
#[cube]
fn put_sums(memory: &mut Memory, island: Island, run: u32, sums: &Array<f64>, #[comptime] from: u32) {
    #[unroll]
    for k in from..SUMS {
        memory.put_sum(island, run, k, sums[k as usize]);
    }
}

/// Sums up springs of all rows, as which the velocities begin that no guess gives.
#[cube]
fn springs(problems: &Problems, memory: &mut Memory, island: Island) {
    let mut k = UNIT_POS;
    while k < island.runs {
        let run = problems.run(island, k);
        let mut sums = no_sums();
        let mut row = run.first;
        while row < run.end {
            let normal = problems.six(island, NORMAL, row);
            let mut stiffness = 1.0f64;
            if !problems.has(island, 0u32, row) && !problems.has(island, 1u32, row) {
                stiffness = 1.0f64 / problems.field(island, COMPLIANCE, row).max(PROXIMAL);
            }
            add_force(&mut sums, ACTING.runtime(), normal, -(stiffness * problems.field(island, GAP, row)));
            add_product(&mut sums, normal, times(normal, stiffness));
            if run.slips {
                let x = problems.six(island, TANGENTS, row);
                let y = problems.six(island, TANGENTS + 6u32, row);
                add_force(&mut sums, ACTING.runtime(), x, -problems.field(island, WAY, row));
                add_force(&mut sums, ACTING.runtime(), y, -problems.field(island, WAY + 1u32, row));
                add_product(&mut sums, x, x);
                add_product(&mut sums, y, y);
            }
            row += 1u32;
        }
        put_sums(memory, island, k, &sums, 0u32);
        k += GROUP;
    }
}

/// Puts all rows on the path of ν = `centre`, with the forces of the guess or none.
#[cube]
fn begin_rows(
    problems: &Problems,
    memory: &mut Memory,
    island: Island,
    shares: &mut GroupMemory,
    centre: f64,
    guessed: bool,
) {
    let mut k = UNIT_POS;
    while k < island.runs {
        let run = problems.run(island, k);
        let relative = problems.pair(island, run.group).relative(&shares.velocity);
        let mut row = run.first;
        while row < run.end {
            let kept = select(guessed, 1.0f64, 0.0f64);
            let push = kept * problems.field(island, GUESS, row);
            problems.begin_row(memory, island, row, relative, centre, push);
            memory.put(island, FRICTION, row, kept * problems.field(island, GUESS + 1u32, row));
            memory.put(island, FRICTION + 1u32, row, kept * problems.field(island, GUESS + 2u32, row));
            row += 1u32;
        }
        k += GROUP;
    }
}

/// Sums up what the matrix and the momenta have of all rows, and aims at ν = `least`. Returns the
/// greatest gap and force of this thread that do not fit, m.
#[cube]
fn linearise(
    problems: &Problems,
    memory: &mut Memory,
    island: Island,
    shares: &mut GroupMemory,
    stage: Stage,
    least: f64,
) -> f64 {
    let mut open = 0.0f64;
    let mut k = UNIT_POS;
    while k < island.runs {
        let run = problems.run(island, k);
        let relative = problems.pair(island, run.group).relative(&shares.velocity);
        let mut sums = no_sums();
        let mut row = run.first;
        while row < run.end {
            let local = problems.local(memory, island, row, relative);
            open = open.max(problems.open(island, row, local));
            let low = -problems.product(memory, island, 0u32, row);
            let high = -problems.product(memory, island, 1u32, row);
            memory.put(island, AIMS, row, low);
            memory.put(island, AIMS + 1u32, row, high);
            let push = problems.standing_push(memory, island, row, local, low, high);
            let normal = problems.six(island, NORMAL, row);
            add_force(&mut sums, ACTING.runtime(), normal, memory.of_row(island, FORCE, row));
            add_force(&mut sums, BROUGHT.runtime(), normal, push);
            add_product(&mut sums, normal, times(normal, local.stiffness));
            if run.slips {
                let at = problems.slipping(memory, island, row, relative, stage);
                let friction_x = -(at.limit * at.share_x);
                let friction_y = -(at.limit * at.share_y);
                memory.put(island, FRICTION, row, friction_x);
                memory.put(island, FRICTION + 1u32, row, friction_y);
                let of = problems.pushing(island, row);
                let mut followed = push;
                let mut stiffness = local.stiffness;
                if of != row {
                    let pushing = problems.local(memory, island, of, relative);
                    let low = -problems.product(memory, island, 0u32, of);
                    let high = -problems.product(memory, island, 1u32, of);
                    followed = problems.standing_push(memory, island, of, pushing, low, high);
                    stiffness = pushing.stiffness;
                }
                let standing = problems.standing(at, followed, least);
                let x = problems.six(island, TANGENTS, row);
                let y = problems.six(island, TANGENTS + 6u32, row);
                add_force(&mut sums, ACTING.runtime(), x, friction_x);
                add_force(&mut sums, ACTING.runtime(), y, friction_y);
                add_force(&mut sums, BROUGHT.runtime(), x, standing.x - friction_x);
                add_force(&mut sums, BROUGHT.runtime(), y, standing.y - friction_y);
                // The limit follows the push.
                let follows = -(at.coefficient * stiffness);
                let normal_of = problems.six(island, NORMAL, of);
                let of_x = plus(times(x, at.xx), times(y, at.xy));
                let of_y = plus(times(x, at.xy), times(y, at.yy));
                add_product(&mut sums, x, plus(times(normal_of, follows * at.along_x), of_x));
                add_product(&mut sums, y, plus(times(normal_of, follows * at.along_y), of_y));
            }
            row += 1u32;
        }
        put_sums(memory, island, k, &sums, 0u32);
        k += GROUP;
    }
    open
}

/// The change of the push that limits the friction of a row, where velocities stay.
#[cube]
fn followed(problems: &Problems, memory: &mut Memory, island: Island, row: u32, relative: Six) -> f64 {
    let local = problems.local(memory, island, row, relative);
    let low = memory.of_row(island, AIMS, row);
    let high = memory.of_row(island, AIMS + 1u32, row);
    problems.standing_push(memory, island, row, local, low, high)
}

/// Sums up the momentum that the changes of forces bring, to the aims and to ν = `centre`.
#[cube]
fn bring(
    problems: &Problems,
    memory: &mut Memory,
    island: Island,
    shares: &mut GroupMemory,
    stage: Stage,
    centre: f64,
) {
    let mut k = UNIT_POS;
    while k < island.runs {
        let run = problems.run(island, k);
        let relative = problems.pair(island, run.group).relative(&shares.velocity);
        let mut sums = no_sums();
        let mut row = run.first;
        while row < run.end {
            let push = followed(problems, memory, island, row, relative);
            let normal = problems.six(island, NORMAL, row);
            add_force(&mut sums, BROUGHT.runtime(), normal, push);
            if run.slips {
                let at = problems.slipping(memory, island, row, relative, stage);
                let of = followed(problems, memory, island, problems.pushing(island, row), relative);
                let standing = problems.standing(at, of, centre);
                let x = problems.six(island, TANGENTS, row);
                let y = problems.six(island, TANGENTS + 6u32, row);
                let change_x = standing.x - memory.of_row(island, FRICTION, row);
                let change_y = standing.y - memory.of_row(island, FRICTION + 1u32, row);
                add_force(&mut sums, BROUGHT.runtime(), x, change_x);
                add_force(&mut sums, BROUGHT.runtime(), y, change_y);
            }
            row += 1u32;
        }
        put_sums(memory, island, k, &sums, BROUGHT);
        k += GROUP;
    }
}

/// Writes the changes of all rows with a change of the velocities. Returns the step at which the
/// first row of this thread comes to a bound.
#[cube]
fn follow(
    problems: &Problems,
    memory: &mut Memory,
    island: Island,
    shares: &mut GroupMemory,
    stage: Stage,
    centre: f64,
    second: bool,
) -> f64 {
    let to = direction(second);
    let mut longest = LONGEST.runtime();
    let mut k = UNIT_POS;
    while k < island.runs {
        let run = problems.run(island, k);
        let pair = problems.pair(island, run.group);
        let relative = pair.relative(&shares.velocity);
        let mut change = pair.relative(&shares.first);
        if second {
            let of_second = pair.relative(&shares.second);
            change.a = of_second.a;
            change.b = of_second.b;
            change.c = of_second.c;
            change.d = of_second.d;
            change.e = of_second.e;
            change.f = of_second.f;
        }
        let mut row = run.first;
        while row < run.end {
            let local = problems.local(memory, island, row, relative);
            let low = memory.of_row(island, AIMS, row);
            let high = memory.of_row(island, AIMS + 1u32, row);
            let push = problems.standing_push(memory, island, row, local, low, high);
            let yields = local.stiffness * problems.six(island, NORMAL, row).dot(change);
            let force = push - yields;
            let slack_low = low - memory.of_row(island, SLACK, row) * force;
            let slack_high = high + memory.of_row(island, SLACK + 1u32, row) * force;
            memory.put(island, to, row, force);
            memory.put(island, to + 1u32, row, slack_low / memory.of_row(island, ROOM, row));
            memory.put(island, to + 2u32, row, slack_high / memory.of_row(island, ROOM + 1u32, row));
            longest = longest.min(problems.longest(memory, island, row, to));
            if run.slips {
                let at = problems.slipping(memory, island, row, relative, stage);
                let of = problems.pushing(island, row);
                let mut of_push = push;
                let mut of_yields = yields;
                if of != row {
                    let pushing = problems.local(memory, island, of, relative);
                    of_push = followed(problems, memory, island, of, relative);
                    of_yields = pushing.stiffness * problems.six(island, NORMAL, of).dot(change);
                }
                let standing = problems.standing(at, of_push, centre);
                let x = problems.six(island, TANGENTS, row).dot(change);
                let y = problems.six(island, TANGENTS + 6u32, row).dot(change);
                let follows = at.coefficient * of_yields;
                let friction_x = standing.x - (at.xx * x + at.xy * y) + follows * at.along_x;
                let friction_y = standing.y - (at.xy * x + at.yy * y) + follows * at.along_y;
                memory.put(island, to + 3u32, row, friction_x);
                memory.put(island, to + 4u32, row, friction_y);
            }
            row += 1u32;
        }
        k += GROUP;
    }
    longest
}

/// The sum of room × slack over the rows of this thread.
#[cube]
fn products(problems: &Problems, memory: &mut Memory, island: Island) -> f64 {
    let mut sum = 0.0f64;
    let mut row = UNIT_POS;
    while row < island.rows {
        sum += problems.product(memory, island, 0u32, row) + problems.product(memory, island, 1u32, row);
        row += GROUP;
    }
    sum
}

/// Aims at ν = `centre` with what the predictor, the first direction, leaves out.
#[cube]
fn correct(problems: &Problems, memory: &mut Memory, island: Island, centre: f64) {
    let mut row = UNIT_POS;
    while row < island.rows {
        let force = memory.of_row(island, DIRECTION, row);
        if problems.has(island, 0u32, row) {
            let off = memory.of_row(island, DIRECTION + 1u32, row) * force;
            let aim = memory.of_row(island, AIMS, row);
            memory.put(island, AIMS, row, centre + aim - off);
        }
        if problems.has(island, 1u32, row) {
            let off = memory.of_row(island, DIRECTION + 2u32, row) * force;
            let aim = memory.of_row(island, AIMS + 1u32, row);
            memory.put(island, AIMS + 1u32, row, centre + aim + off);
        }
        row += GROUP;
    }
}

/// How far the product of a bound, `farther` along the first direction, is from ν = `centre`.
#[cube]
fn missing(memory: &mut Memory, island: Island, row: u32, bound: u32, centre: f64, farther: f64) -> f64 {
    let force = memory.of_row(island, DIRECTION, row);
    let opens = select(bound == 0u32, force, -force);
    let room = memory.of_row(island, ROOM + bound, row) + opens * farther;
    let change = memory.of_row(island, DIRECTION + 1u32 + bound, row);
    let product = room * (memory.of_row(island, SLACK + bound, row) + change * farther);
    (product.max(0.1f64 * centre).min(10.0f64 * centre) - product).max(-10.0f64 * centre)
}

/// Aims at products that are alike `farther` along the first direction.
#[cube]
fn even_out(problems: &Problems, memory: &mut Memory, island: Island, centre: f64, farther: f64) {
    let mut row = UNIT_POS;
    while row < island.rows {
        if problems.has(island, 0u32, row) {
            let aim = memory.of_row(island, AIMS, row);
            let more = missing(memory, island, row, 0u32, centre, farther);
            memory.put(island, AIMS, row, aim + more);
        }
        if problems.has(island, 1u32, row) {
            let aim = memory.of_row(island, AIMS + 1u32, row);
            let more = missing(memory, island, row, 1u32, centre, farther);
            memory.put(island, AIMS + 1u32, row, aim + more);
        }
        row += GROUP;
    }
}

/// Goes along a direction, but for friction.
#[cube]
fn advance(problems: &Problems, memory: &mut Memory, island: Island, second: bool, step: f64) {
    let from = direction(second);
    let mut row = UNIT_POS;
    while row < island.rows {
        let force = step * memory.of_row(island, from, row);
        let was = memory.of_row(island, FORCE, row);
        memory.put(island, FORCE, row, was + force);
        if problems.has(island, 0u32, row) {
            let room = memory.of_row(island, ROOM, row);
            let slack = memory.of_row(island, SLACK, row);
            memory.put(island, ROOM, row, room + force);
            memory.put(island, SLACK, row, slack + step * memory.of_row(island, from + 1u32, row));
        }
        if problems.has(island, 1u32, row) {
            let room = memory.of_row(island, ROOM + 1u32, row);
            let slack = memory.of_row(island, SLACK + 1u32, row);
            memory.put(island, ROOM + 1u32, row, room - force);
            memory.put(island, SLACK + 1u32, row, slack + step * memory.of_row(island, from + 2u32, row));
        }
        row += GROUP;
    }
}

/// Goes along a direction with friction, after all pushes. Returns the greatest way that friction
/// of this thread would bring beyond its limit, m.
#[cube]
fn advance_friction(
    problems: &Problems,
    memory: &mut Memory,
    island: Island,
    second: bool,
    step: f64,
) -> f64 {
    let from = direction(second);
    let mut beyond = 0.0f64;
    let mut k = UNIT_POS;
    while k < island.runs {
        let run = problems.run(island, k);
        let mut row = run.first;
        if !run.slips {
            row = run.end;
        }
        while row < run.end {
            let limit = problems.limit(memory, island, row);
            let was_x = memory.of_row(island, FRICTION, row);
            let was_y = memory.of_row(island, FRICTION + 1u32, row);
            let x = was_x + (memory.of_row(island, from + 3u32, row) - was_x) * step;
            let y = was_y + (memory.of_row(island, from + 4u32, row) - was_y) * step;
            let size = (x * x + y * y).sqrt();
            let share = select(size > limit, limit / size, 1.0f64);
            memory.put(island, FRICTION, row, x * share);
            memory.put(island, FRICTION + 1u32, row, y * share);
            beyond = beyond.max((size - limit) / problems.field(island, SLIP_SCALE, row));
            row += 1u32;
        }
        k += GROUP;
    }
    beyond
}

/// The way of a point of this thread's body in the step, m; without end where it is no number.
#[cube]
fn way(problems: &Problems, island: Island, velocity: &Bodies) -> f64 {
    let mut way = 0.0f64;
    if UNIT_POS < island.bodies {
        let k = (6u32 * UNIT_POS) as usize;
        let linear =
            velocity[k] * velocity[k] + velocity[k + 1] * velocity[k + 1] + velocity[k + 2] * velocity[k + 2];
        let angular = velocity[k + 3] * velocity[k + 3]
            + velocity[k + 4] * velocity[k + 4]
            + velocity[k + 5] * velocity[k + 5];
        let lever = problems.of_body(island, UNIT_POS, LEVER.runtime());
        let of_body = problems.scalar(island, 0u32) * (linear.sqrt() + lever * angular.sqrt());
        way = select(of_body < LONGEST, of_body, LONGEST.runtime());
    }
    way
}

/// Writes the velocities and the forces as the solution.
#[cube]
fn report(problems: &Problems, memory: &mut Memory, island: Island, shares: &mut GroupMemory) {
    let velocities = island.results_at + REPORT;
    let mut k = UNIT_POS;
    while k < 6u32 * island.bodies {
        memory.results[(velocities + k) as usize] = shares.velocity[k as usize];
        k += GROUP;
    }
    let forces = velocities + 6u32 * island.bodies;
    let mut row = UNIT_POS;
    while row < island.rows {
        let push = problems.reported(memory, island, row);
        // An open contact has no friction.
        let is_open = problems.is_at_bound(memory, island, problems.pushing(island, row));
        let share = select(is_open, 0.0f64, 1.0f64);
        let at = forces + row;
        memory.results[at as usize] = push;
        memory.results[(at + island.rows) as usize] = share * memory.of_row(island, FRICTION, row);
        memory.results[(at + 2u32 * island.rows) as usize] =
            share * memory.of_row(island, FRICTION + 1u32, row);
        row += GROUP;
    }
}

const REPORT: u32 = tesdf_sim::newton::internal::REPORT as u32;

/// The velocities that springs of all rows would lead to; those without rows where there are none.
#[cube]
fn begin_cold(problems: &Problems, memory: &mut Memory, island: Island, shares: &mut GroupMemory) {
    springs(problems, memory, island);
    add_up(problems, memory, island, 0u32, SUMS.runtime());
    let mut k = UNIT_POS;
    while k < 6u32 * island.bodies {
        shares.velocity[k as usize] = problems.of_body(island, k / 6u32, TARGET + k % 6u32);
        k += GROUP;
    }
    sync_cube();
    k = UNIT_POS;
    while k < 6u32 * island.bodies {
        shares.first[k as usize] = momentum(problems, island, k / 6u32, &shares.velocity, k % 6u32);
        k += GROUP;
    }
    sync_cube();
    act(problems, memory, island, ACTING.runtime(), &mut shares.first);
    assemble(problems, memory, island);
    let regular = factor(memory, island, &mut shares.exchanged);
    solve(memory, island, &shares.exchanged, &mut shares.first);
    if regular {
        k = UNIT_POS;
        while k < 6u32 * island.bodies {
            shares.velocity[k as usize] = shares.first[k as usize];
            k += GROUP;
        }
    }
    sync_cube();
}

/// Copies the momentum that velocities and forces leave to a direction, and adds what the changes
/// of forces bring.
#[cube]
fn momentum_brought(
    problems: &Problems,
    memory: &mut Memory,
    island: Island,
    momentum: &Bodies,
    to: &mut Bodies,
) {
    let mut k = UNIT_POS;
    while k < 6u32 * island.bodies {
        to[k as usize] = momentum[k as usize];
        k += GROUP;
    }
    sync_cube();
    act(problems, memory, island, BROUGHT.runtime(), to);
}

/// The momentum that velocities and forces leave.
#[cube]
fn momentum_left(problems: &Problems, memory: &mut Memory, island: Island, shares: &mut GroupMemory) {
    let mut k = UNIT_POS;
    while k < 6u32 * island.bodies {
        let target = problems.of_body(island, k / 6u32, TARGET + k % 6u32);
        shares.first[k as usize] = target - shares.velocity[k as usize];
        k += GROUP;
    }
    sync_cube();
    k = UNIT_POS;
    while k < 6u32 * island.bodies {
        shares.momentum[k as usize] = momentum(problems, island, k / 6u32, &shares.first, k % 6u32);
        k += GROUP;
    }
    sync_cube();
    act(problems, memory, island, ACTING.runtime(), &mut shares.momentum);
}

/// The way that the momentum gives, m.
#[cube]
fn way_of_momentum(problems: &Problems, island: Island, shares: &mut GroupMemory) -> f64 {
    sync_cube();
    let mut k = UNIT_POS;
    while k < 6u32 * island.bodies {
        let body = k / 6u32;
        let axis = k % 6u32;
        let mut rate = problems.of_body(island, body, INVERSE_MASS.runtime()) * shares.momentum[k as usize];
        if axis >= 3u32 {
            rate = inertia_times(problems, island, body, INVERSE.runtime(), &shares.momentum, axis - 3u32);
        }
        shares.second[k as usize] = rate;
        k += GROUP;
    }
    sync_cube();
    let mine = way(problems, island, &shares.second);
    shares.greatest(mine)
}

/// Where an iteration goes.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Heading {
    /// Along the second direction in place of the first one.
    second: bool,
    step: f64,
    /// ν of friction after a whole step.
    centre: f64,
}

/// Finds where an iteration goes, with the momentum that the predictor brings as the first
/// direction: predictor, corrector, and a second correction where that goes farther.
#[cube]
fn find_heading(
    problems: &Problems,
    memory: &mut Memory,
    island: Island,
    shares: &mut GroupMemory,
    stage: Stage,
) -> Heading {
    let bounds = problems.scalar(island, 1u32);
    let least = problems.scalar(island, 2u32);
    // The predictor.
    solve(memory, island, &shares.exchanged, &mut shares.first);
    let mine = follow(problems, memory, island, shares, stage, least, false);
    let mut longest = -shares.greatest(-mine);
    let mut step = 1.0f64;
    let mut aimed = stage.centre;
    let mut second = false;
    if bounds > 0.0f64 {
        let affine = longest.min(1.0f64);
        let mine = products(problems, memory, island);
        let product = shares.sum(mine) / bounds;
        let rest = 1.0f64 - affine;
        let centring = (rest * rest * rest).max(LEAST_CENTRING);
        aimed = (centring * product).max(least).min(product.max(least));
        correct(problems, memory, island, aimed);
        sync_cube();
        bring(problems, memory, island, shares, stage, aimed);
        add_up(problems, memory, island, BROUGHT.runtime(), 6u32);
        momentum_brought(problems, memory, island, &shares.momentum, &mut shares.first);
        solve(memory, island, &shares.exchanged, &mut shares.first);
        let mine = follow(problems, memory, island, shares, stage, aimed, false);
        longest = -shares.greatest(-mine);
        if longest < 1.0f64 / LENGTHENS {
            let farther = (1.5f64 * longest + 0.1f64).min(1.0f64);
            even_out(problems, memory, island, aimed, farther);
            sync_cube();
            bring(problems, memory, island, shares, stage, aimed);
            add_up(problems, memory, island, BROUGHT.runtime(), 6u32);
            momentum_brought(problems, memory, island, &shares.momentum, &mut shares.second);
            solve(memory, island, &shares.exchanged, &mut shares.second);
            let mine = follow(problems, memory, island, shares, stage, aimed, true);
            let again = -shares.greatest(-mine);
            if again.min(1.0f64) >= LENGTHENS * longest {
                second = true;
                longest = again;
            }
        }
        let shorter = SHORTER * (100.0f64 * (1.0f64 - affine)).max(1e-4f64).min(1.0f64);
        step = ((1.0f64 - shorter) * longest).min(1.0f64);
    }
    Heading { second, step, centre: aimed }
}

/// Goes there. Returns the greatest way that friction would bring beyond its limit, m.
#[cube]
fn go(
    problems: &Problems,
    memory: &mut Memory,
    island: Island,
    shares: &mut GroupMemory,
    heading: Heading,
) -> f64 {
    let mut k = UNIT_POS;
    while k < 6u32 * island.bodies {
        let change = select(heading.second, shares.second[k as usize], shares.first[k as usize]);
        shares.first[k as usize] = change;
        shares.velocity[k as usize] += heading.step * change;
        k += GROUP;
    }
    advance(problems, memory, island, heading.second, heading.step);
    sync_cube();
    let mine = advance_friction(problems, memory, island, heading.second, heading.step);
    shares.greatest(mine)
}

/// Solves the problem of each island.
#[cube(launch, create_dummy_kernel)]
pub fn descend(problems: &Problems, memory: &mut Memory) {
    let island = problems.island(CUBE_POS as u32);
    let mut shares = GroupMemory::of_group();
    let bounds = problems.scalar(island, 1u32);
    let least = problems.scalar(island, 2u32);
    let balanced = problems.scalar(island, 5u32);
    let mut converged = false;
    let mut iterations = 0u32;
    let mut attempt = select(island.has_guess, 0u32, 1u32);
    while attempt < 2u32 {
        let is_warm = attempt == 0u32;
        let mut centre = problems.scalar(island, 4u32);
        if is_warm {
            let mut k = UNIT_POS;
            while k < 6u32 * island.bodies {
                shares.velocity[k as usize] = problems.of_body(island, k / 6u32, BEGINS + k % 6u32);
                k += GROUP;
            }
            sync_cube();
        } else {
            begin_cold(problems, memory, island, &mut shares);
            iterations += 1u32;
            let first = FIRST * problems.scalar(island, 3u32);
            centre = (first * first).max(least);
        }
        begin_rows(problems, memory, island, &mut shares, centre, is_warm);
        sync_cube();
        let mut left_iterations = WARM_ITERATIONS.runtime();
        let mut most_short = WARM_SHORT.runtime();
        let mut settled = WARM_SETTLED.runtime();
        if !is_warm {
            left_iterations = select(island.has_friction, COLD_ITERATIONS, CONVEX_ITERATIONS);
            most_short = select(island.has_friction, COLD_SHORT, 0xFFFF_FFFFu32);
            settled = COLD_SETTLED.runtime();
        }
        let mut is_fine = is_warm;
        let mut short_steps = 0u32;
        while left_iterations > 0u32 && short_steps < most_short {
            left_iterations -= 1u32;
            let stage = Stage { centre, width: select(is_fine, FINE_WIDTH, COARSE_WIDTH) };
            let mine = linearise(problems, memory, island, &mut shares, stage, least);
            let open = shares.greatest(mine);
            add_up(problems, memory, island, 0u32, SUMS.runtime());
            momentum_left(problems, memory, island, &mut shares);
            momentum_brought(problems, memory, island, &shares.momentum, &mut shares.first);
            assemble(problems, memory, island);
            if factor(memory, island, &mut shares.exchanged) {
                iterations += 1u32;
                let heading = find_heading(problems, memory, island, &mut shares, stage);
                let beyond = go(problems, memory, island, &mut shares, heading);
                let step = heading.step;
                centre = (centre + step * (heading.centre - centre)).max(least);
                let mine = way(problems, island, &shares.first);
                let moved = shares.greatest(mine);
                short_steps = select(step < SHORT, short_steps + 1u32, 0u32);
                if moved >= LONGEST {
                    left_iterations = 0u32;
                } else if step > LONG && moved < settled {
                    let off = way_of_momentum(problems, island, &mut shares);
                    let is_balanced = !island.has_friction || off < balanced;
                    let mine = products(problems, memory, island);
                    let product = shares.sum(mine) / bounds.max(1.0f64);
                    let is_closed = open * (1.0f64 - step) < CLOSED && product <= FEW * least;
                    if is_closed && is_balanced && beyond < balanced {
                        report(problems, memory, island, &mut shares);
                        sync_cube();
                        converged = true;
                        left_iterations = select(is_fine || !island.has_friction, 0u32, FINE);
                        is_fine = true;
                        short_steps = 0u32;
                    }
                }
            } else {
                left_iterations = 0u32;
            }
        }
        attempt = select(converged, 2u32, attempt + 1u32);
    }
    if UNIT_POS == 0u32 {
        memory.results[island.results_at as usize] = f64::cast_from(iterations);
        memory.results[(island.results_at + 1u32) as usize] = select(converged, 1.0f64, 0.0f64);
    }
}
