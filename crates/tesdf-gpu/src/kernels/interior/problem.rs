//! The problems of islands, and the memory in which a group solves one.
use cubecl::prelude::*;
use tesdf_sim::newton::internal::{self, field};

/// Threads of a group.
pub const GROUP: u32 = 128;

pub const NONE: u32 = internal::NONE;
const HEADER: u32 = internal::HEADER as u32;
const SCALARS: u32 = internal::SCALARS as u32;
const BODY: u32 = internal::BODY as u32;
const GROUP_WORDS: u32 = internal::GROUP as u32;
const RUN_WORDS: u32 = internal::RUN as u32;

pub const NORMAL: u32 = field::NORMAL as u32;
pub const GAP: u32 = field::GAP as u32;
pub const COMPLIANCE: u32 = field::COMPLIANCE as u32;
pub const BOUNDS: u32 = field::BOUNDS as u32;
pub const SCALE: u32 = field::SCALE as u32;
pub const TANGENTS: u32 = field::TANGENTS as u32;
pub const WAY: u32 = field::WAY as u32;
pub const COEFFICIENT: u32 = field::COEFFICIENT as u32;
pub const SLIP_SCALE: u32 = field::SLIP_SCALE as u32;
pub const GUESS: u32 = field::GUESS as u32;

/// Places of the numbers of a body.
pub const MASS: u32 = 0;
pub const INERTIA: u32 = 1;
pub const INVERSE: u32 = 7;
pub const INVERSE_MASS: u32 = 13;
pub const TARGET: u32 = 14;
pub const BEGINS: u32 = 20;
pub const LEVER: u32 = 26;

/// Arrays over the rows of an island in the memory.
pub const FORCE: u32 = 0;
pub const ROOM: u32 = 1;
pub const SLACK: u32 = 3;
pub const FRICTION: u32 = 5;
/// For each bound, the change of room × slack that an iteration aims at.
pub const AIMS: u32 = 7;
/// Changes of a direction: of the force, and of two slacks; the friction after a whole step.
pub const DIRECTION: u32 = 9;
pub const DIRECTIONS: u32 = 5;
/// Number of these arrays, with two directions.
pub const STATE: u32 = 19;

/// Sums over the rows of a run: a matrix of six columns, and two momenta.
pub const SUMS: u32 = 48;
/// The momentum of the forces among the sums.
pub const ACTING: u32 = 36;
/// The momentum that a change of the forces brings.
pub const BROUGHT: u32 = 42;

/// Six numbers: of a velocity, linear then angular, or derivatives by one.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Six {
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub d: f64,
    pub e: f64,
    pub f: f64,
}

#[cube]
impl Six {
    pub fn dot(self, v: Six) -> f64 {
        (self.a * v.a + self.b * v.b + self.c * v.c) + (self.d * v.d + self.e * v.e + self.f * v.f)
    }
}

#[cube]
pub fn six_zeros() -> Six {
    Six { a: 0.0f64, b: 0.0f64, c: 0.0f64, d: 0.0f64, e: 0.0f64, f: 0.0f64 }
}

/// The problems, as `tesdf_sim::newton::internal::Packed` lays them out.
#[derive(CubeType, CubeLaunch)]
pub struct Problems {
    pub headers: Box<[u32]>,
    pub words: Box<[u32]>,
    pub numbers: Box<[f64]>,
}

/// What the groups write.
#[derive(CubeType, CubeLaunch)]
pub struct Memory {
    /// [`STATE`] numbers of each row.
    pub rows: Box<[f64]>,
    /// [`SUMS`] of each run. Those of a group are then in its first run.
    pub sums: Box<[f64]>,
    /// A matrix for each island.
    pub matrices: Box<[f64]>,
    /// What is read back.
    pub results: Box<[f64]>,
}

/// An island, and where its arrays begin.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Island {
    pub bodies: u32,
    pub groups: u32,
    pub runs: u32,
    pub rows: u32,
    pub has_guess: bool,
    pub has_friction: bool,
    /// In the words.
    starts_at: u32,
    groups_at: u32,
    runs_at: u32,
    pushing_at: u32,
    of_bodies_at: u32,
    /// In the numbers.
    scalars_at: u32,
    bodies_at: u32,
    offsets_at: u32,
    fields_at: u32,
    /// In the memory.
    pub rows_at: u32,
    pub sums_at: u32,
    pub matrix_at: u32,
    pub results_at: u32,
}

/// Rows of a batch that one thread sums up.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Run {
    pub first: u32,
    pub end: u32,
    pub slips: bool,
    pub group: u32,
}

/// A body whose velocity counts relative to that of another one.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Pair {
    pub body: u32,
    /// Or [`NONE`].
    pub other: u32,
    pub first_run: u32,
    pub runs: u32,
    /// From the centre of mass of the other body to that of `body`, m.
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

#[cube]
impl Problems {
    pub fn island(&self, k: u32) -> Island {
        let at = (k * HEADER) as usize;
        let words = self.headers[at];
        let numbers = self.headers[at + 1];
        let bodies = self.headers[at + 3];
        let groups = self.headers[at + 4];
        let runs = self.headers[at + 5];
        let rows = self.headers[at + 6];
        let groups_at = words + bodies + 1u32;
        let runs_at = groups_at + GROUP_WORDS * groups;
        let pushing_at = runs_at + RUN_WORDS * runs;
        let bodies_at = numbers + SCALARS;
        let offsets_at = bodies_at + BODY * bodies;
        Island {
            bodies,
            groups,
            runs,
            rows,
            has_guess: self.headers[at + 7] == 1u32,
            has_friction: self.headers[at + 8] == 1u32,
            starts_at: words,
            groups_at,
            runs_at,
            pushing_at,
            of_bodies_at: pushing_at + rows,
            scalars_at: numbers,
            bodies_at,
            offsets_at,
            fields_at: offsets_at + 3u32 * groups,
            rows_at: STATE * self.headers[at + 10],
            sums_at: SUMS * self.headers[at + 9],
            matrix_at: self.headers[at + 11],
            results_at: self.headers[at + 2],
        }
    }

    /// A number of an island.
    pub fn scalar(&self, island: Island, k: u32) -> f64 {
        self.numbers[(island.scalars_at + k) as usize]
    }

    pub fn of_body(&self, island: Island, body: u32, k: u32) -> f64 {
        self.numbers[(island.bodies_at + BODY * body + k) as usize]
    }

    pub fn field(&self, island: Island, k: u32, row: u32) -> f64 {
        self.numbers[(island.fields_at + k * island.rows + row) as usize]
    }

    /// Six fields, from this one on.
    pub fn six(&self, island: Island, k: u32, row: u32) -> Six {
        Six {
            a: self.field(island, k, row),
            b: self.field(island, k + 1u32, row),
            c: self.field(island, k + 2u32, row),
            d: self.field(island, k + 3u32, row),
            e: self.field(island, k + 4u32, row),
            f: self.field(island, k + 5u32, row),
        }
    }

    /// The row whose push limits the friction of this one.
    pub fn pushing(&self, island: Island, row: u32) -> u32 {
        self.words[(island.pushing_at + row) as usize]
    }

    pub fn run(&self, island: Island, k: u32) -> Run {
        let at = (island.runs_at + RUN_WORDS * k) as usize;
        Run {
            first: self.words[at],
            end: self.words[at + 1],
            slips: self.words[at + 2] == 1u32,
            group: self.words[at + 3],
        }
    }

    pub fn pair(&self, island: Island, k: u32) -> Pair {
        let at = (island.groups_at + GROUP_WORDS * k) as usize;
        let offset = (island.offsets_at + 3u32 * k) as usize;
        Pair {
            body: self.words[at],
            other: self.words[at + 1],
            first_run: self.words[at + 2],
            runs: self.words[at + 3],
            x: self.numbers[offset],
            y: self.numbers[offset + 1],
            z: self.numbers[offset + 2],
        }
    }

    /// The place of the first group of a body, and of the first one of the next body.
    pub fn first_of_body(&self, island: Island, body: u32) -> u32 {
        self.words[(island.starts_at + body) as usize]
    }

    /// Twice the number of a group of a body, and 1 more where the body is the other one.
    pub fn of_bodies(&self, island: Island, place: u32) -> u32 {
        self.words[(island.of_bodies_at + place) as usize]
    }
}

#[cube]
impl Memory {
    /// A number of a row.
    pub fn of_row(&self, island: Island, array: u32, row: u32) -> f64 {
        self.rows[(island.rows_at + array * island.rows + row) as usize]
    }

    pub fn put(&mut self, island: Island, array: u32, row: u32, value: f64) {
        self.rows[(island.rows_at + array * island.rows + row) as usize] = value;
    }

    pub fn sum(&self, island: Island, run: u32, k: u32) -> f64 {
        self.sums[(island.sums_at + SUMS * run + k) as usize]
    }

    pub fn put_sum(&mut self, island: Island, run: u32, k: u32, value: f64) {
        self.sums[(island.sums_at + SUMS * run + k) as usize] = value;
    }

    pub fn entry(&self, island: Island, row: u32, column: u32) -> f64 {
        self.matrices[(island.matrix_at + row * 6u32 * island.bodies + column) as usize]
    }

    pub fn put_entry(&mut self, island: Island, row: u32, column: u32, value: f64) {
        self.matrices[(island.matrix_at + row * 6u32 * island.bodies + column) as usize] = value;
    }
}
