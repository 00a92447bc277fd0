//! What an iteration knows of a row. Mirrors `newton/interior/iteration.rs` and `state.rs` of
//! `tesdf-sim`, whose names it has.
use cubecl::prelude::*;
use tesdf_sim::newton::internal::{self, constants};

use crate::kernels::interior::problem::{
    BOUNDS, COEFFICIENT, COMPLIANCE, DIRECTION, DIRECTIONS, FORCE, FRICTION, GAP, Island, Memory, NORMAL,
    Problems, ProblemsExpand, ROOM, SCALE, SLACK, SLIP_SCALE, Six, TANGENTS, WAY,
};

/// Bounds beyond are infinite.
const UNBOUNDED: f64 = 0.5 * internal::UNBOUNDED;
/// No step is longer.
pub const LONGEST: f64 = 1e300;
const PROXIMAL: f64 = constants::PROXIMAL;
/// The least limit of friction: the square of the rounding of `f64`.
const LEAST_LIMIT: f64 = 4.930380657631324e-32;
const ROUNDS: u32 = 20;

/// Gap and force that do not fit, and the decrease of the force with the gap.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Local {
    pub residual: f64,
    pub stiffness: f64,
}

/// What an iteration knows of a friction.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Slipping {
    pub slip_x: f64,
    pub slip_y: f64,
    pub limit: f64,
    pub width: f64,
    pub least: f64,
    pub length: f64,
    pub along_x: f64,
    pub along_y: f64,
    pub share_x: f64,
    pub share_y: f64,
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
    pub coefficient: f64,
}

/// The change of the friction when the velocities stay.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Standing {
    pub x: f64,
    pub y: f64,
}

/// The values of an iteration that all rows share.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Stage {
    /// ν of friction.
    pub centre: f64,
    /// The least width of friction, m.
    pub width: f64,
}

/// Room and slack.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct OnPath {
    pub slack: f64,
    pub room: f64,
}

/// Positive slack and room whose difference is `gap` and whose product is `centre`.
#[cube]
pub fn on_path(gap: f64, centre: f64) -> OnPath {
    let root = (gap * gap + 4.0f64 * centre).sqrt();
    let slack = select(gap > 0.0f64, 0.5f64 * (gap + root), 2.0f64 * centre / (root - gap));
    OnPath { slack, room: centre / slack }
}

/// The step at which a value becomes zero.
#[cube]
pub fn to_zero(value: f64, change: f64) -> f64 {
    select(change < 0.0f64, -value / change, LONGEST)
}

#[cube]
impl Problems {
    /// Whether a row has a bound.
    pub fn has(&self, island: Island, bound: u32, row: u32) -> bool {
        self.field(island, BOUNDS + bound, row).abs() < UNBOUNDED
    }

    /// Puts a row on the path, from the push and the friction of the guess.
    pub fn begin_row(
        &self,
        memory: &mut Memory,
        island: Island,
        row: u32,
        relative: Six,
        centre: f64,
        push: f64,
    ) {
        let gap = self.field(island, GAP, row)
            + self.six(island, NORMAL, row).dot(relative)
            + self.field(island, COMPLIANCE, row) * push
            - push;
        let low = self.field(island, BOUNDS, row);
        let high = self.field(island, BOUNDS + 1u32, row);
        let has_low = self.has(island, 0u32, row);
        let has_high = self.has(island, 1u32, row);
        let below = on_path(gap, centre);
        let above = on_path(-gap, centre);
        let mut force = push;
        let mut room_low = 1.0f64;
        let mut room_high = 1.0f64;
        let mut slack_low = 0.0f64;
        let mut slack_high = 0.0f64;
        if has_low {
            room_low = below.room;
            slack_low = below.slack;
            force = low + below.room;
        }
        if has_high {
            room_high = above.room;
            slack_high = above.slack;
            force = high - above.room;
        }
        if has_low && has_high {
            let half = 0.5f64 * (high - low);
            let middle = 0.5f64 * (low + high);
            let beyond = (middle + gap).abs() - half;
            let mut near = half;
            let mut round = 0u32;
            while round < ROUNDS {
                near = on_path(beyond + centre / (2.0f64 * half - near), centre).room.min(half);
                round += 1u32;
            }
            let far = 2.0f64 * half - near;
            let is_low = middle + gap > 0.0f64;
            force = select(is_low, low + near, high - near);
            room_low = select(is_low, near, far);
            room_high = select(is_low, far, near);
            slack_low = centre / room_low;
            slack_high = centre / room_high;
        }
        memory.put(island, FORCE, row, force);
        memory.put(island, ROOM, row, room_low);
        memory.put(island, ROOM + 1u32, row, room_high);
        memory.put(island, SLACK, row, slack_low);
        memory.put(island, SLACK + 1u32, row, slack_high);
    }

    /// What an iteration knows of the push of a row.
    pub fn local(&self, memory: &mut Memory, island: Island, row: u32, relative: Six) -> Local {
        let compliance = self.field(island, COMPLIANCE, row);
        let slack_low = memory.of_row(island, SLACK, row);
        let slack_high = memory.of_row(island, SLACK + 1u32, row);
        let bounds = slack_low / memory.of_row(island, ROOM, row)
            + slack_high / memory.of_row(island, ROOM + 1u32, row);
        let soft = compliance + bounds;
        let softness = select(bounds == 0.0f64, soft.max(PROXIMAL), soft);
        let gap = self.field(island, GAP, row) + self.six(island, NORMAL, row).dot(relative);
        let residual = gap + compliance * memory.of_row(island, FORCE, row) - slack_low + slack_high;
        Local { residual, stiffness: 1.0f64 / softness }
    }

    /// The change of the push of a row when the velocities stay, to these changes of the products.
    pub fn standing_push(
        &self,
        memory: &mut Memory,
        island: Island,
        row: u32,
        local: Local,
        low: f64,
        high: f64,
    ) -> f64 {
        let added = low / memory.of_row(island, ROOM, row) - high / memory.of_row(island, ROOM + 1u32, row);
        local.stiffness * (added - local.residual)
    }

    /// What an iteration knows of the friction of a row.
    pub fn slipping(
        &self,
        memory: &mut Memory,
        island: Island,
        row: u32,
        relative: Six,
        stage: Stage,
    ) -> Slipping {
        let x = self.six(island, TANGENTS, row).dot(relative);
        let y = self.six(island, TANGENTS + 6u32, row).dot(relative);
        let slip_x = self.field(island, WAY, row) + x;
        let slip_y = self.field(island, WAY + 1u32, row) + y;
        let coefficient = self.field(island, COEFFICIENT, row);
        let limit = self.limit(memory, island, row);
        let of_width = self.field(island, SLIP_SCALE, row) * stage.width;
        let least = of_width.max(limit * self.field(island, COMPLIANCE, row) * 0.5f64);
        let width = (stage.centre / limit).max(least);
        let length = (width * width + slip_x * slip_x + slip_y * slip_y).sqrt();
        let along_x = slip_x / length;
        let along_y = slip_y / length;
        let friction_x = memory.of_row(island, FRICTION, row);
        let friction_y = memory.of_row(island, FRICTION + 1u32, row);
        let size = (friction_x * friction_x + friction_y * friction_y).sqrt().max(limit);
        let share_x = -(friction_x / size);
        let share_y = -(friction_y / size);
        let k = limit / (width + length);
        Slipping {
            slip_x,
            slip_y,
            limit,
            width,
            least,
            length,
            along_x,
            along_y,
            share_x,
            share_y,
            xx: k * (1.0f64 - share_x * along_x),
            xy: k * (share_x * along_y + share_y * along_x) * -0.5f64,
            yy: k * (1.0f64 - share_y * along_y),
            coefficient,
        }
    }

    /// The change of the friction when the velocities stay, to ν of friction. `followed` is the
    /// change of the push that limits the friction.
    pub fn standing(&self, at: Slipping, followed: f64, centre: f64) -> Standing {
        let wider = (centre / at.limit).max(at.least) - at.width;
        let k = at.limit / (at.width + at.length);
        let widens = at.limit * wider / at.length;
        let follows = at.coefficient * followed;
        Standing {
            x: widens * at.share_x - k * at.slip_x - follows * at.along_x,
            y: widens * at.share_y - k * at.slip_y - follows * at.along_y,
        }
    }

    /// The step at which a row comes to a bound along the direction whose arrays begin at `to`.
    pub fn longest(&self, memory: &mut Memory, island: Island, row: u32, to: u32) -> f64 {
        let force = memory.of_row(island, to, row);
        let mut longest = LONGEST.runtime();
        if self.has(island, 0u32, row) {
            longest = longest
                .min(to_zero(memory.of_row(island, ROOM, row), force))
                .min(to_zero(memory.of_row(island, SLACK, row), memory.of_row(island, to + 1u32, row)));
        }
        if self.has(island, 1u32, row) {
            longest = longest.min(to_zero(memory.of_row(island, ROOM + 1u32, row), -force)).min(to_zero(
                memory.of_row(island, SLACK + 1u32, row),
                memory.of_row(island, to + 2u32, row),
            ));
        }
        longest
    }

    /// Product of room and slack of a bound, 0 where it is none.
    pub fn product(&self, memory: &mut Memory, island: Island, bound: u32, row: u32) -> f64 {
        memory.of_row(island, ROOM + bound, row) * memory.of_row(island, SLACK + bound, row)
    }

    /// The gap and force of a row that do not fit, m.
    pub fn open(&self, island: Island, row: u32, local: Local) -> f64 {
        local.residual.abs() / self.field(island, SCALE, row)
    }
}

/// Where the arrays of a direction begin: of the first or the second one.
#[cube]
pub fn direction(second: bool) -> u32 {
    DIRECTION + select(second, DIRECTIONS.runtime(), 0u32)
}

#[cube]
impl Problems {
    /// The limit of the friction of a row.
    pub fn limit(&self, memory: &mut Memory, island: Island, row: u32) -> f64 {
        let push = memory.of_row(island, FORCE, self.pushing(island, row));
        (self.field(island, COEFFICIENT, row) * push).max(LEAST_LIMIT)
    }

    /// Whether the push of a row is at a bound.
    pub fn is_at_bound(&self, memory: &mut Memory, island: Island, row: u32) -> bool {
        let low = self.has(island, 0u32, row)
            && memory.of_row(island, ROOM, row) < memory.of_row(island, SLACK, row);
        let high = self.has(island, 1u32, row)
            && memory.of_row(island, ROOM + 1u32, row) < memory.of_row(island, SLACK + 1u32, row);
        low || high
    }

    /// The push of a row that is reported: none of an open contact.
    pub fn reported(&self, memory: &mut Memory, island: Island, row: u32) -> f64 {
        let is_low = self.has(island, 0u32, row)
            && memory.of_row(island, ROOM, row) < memory.of_row(island, SLACK, row);
        let bound = select(is_low, self.field(island, BOUNDS, row), self.field(island, BOUNDS + 1u32, row));
        select(self.is_at_bound(memory, island, row), bound, memory.of_row(island, FORCE, row))
    }
}
