//! Forces of rows within their bounds, on the central path of the interior point method: room ×
//! slack = ν for each bound.
use crate::newton::lanes::{Lanes, WIDTH, two};
use crate::newton::line::{Bundle, Forces};

/// The place between two bounds is found in so many rounds: exactly where ν is small, and near enough
/// to begin with where it is great.
const ROUNDS: u32 = 20;

/// The state of a bundle.
#[derive(Clone, Copy, Debug)]
pub struct State {
    pub force: Lanes,
    /// How far the force is within each bound. Beside a bound, the difference would have no digits.
    pub room: [Lanes; 2],
    /// What a gap is beyond zero where the force is at the bound.
    pub slack: [Lanes; 2],
    pub friction: [Lanes; 2],
}

/// Positive slack and room whose difference is `gap` and whose product is `centre`.
fn on_path(gap: f64, centre: f64) -> [f64; 2] {
    let root = (gap * gap + 4.0 * centre).sqrt();
    let slack = if gap > 0.0 { 0.5 * (gap + root) } else { 2.0 * centre / (root - gap) };
    [slack, centre / slack]
}

/// Force, room and slack of a row with this ν. Without bounds, `-gap` would be the force. A row
/// without bounds keeps its force.
fn on_path_between([low, high]: [f64; 2], gap: f64, centre: f64, kept: f64) -> (f64, [f64; 2], [f64; 2]) {
    match (low.is_finite(), high.is_finite()) {
        (true, false) => {
            let [slack, room] = on_path(gap, centre);
            (low + room, [room, f64::INFINITY], [slack, 0.0])
        }
        (false, true) => {
            let [slack, room] = on_path(-gap, centre);
            (high - room, [f64::INFINITY, room], [0.0, slack])
        }
        (true, true) => {
            // The room at the nearer bound, with the slack that the other bound adds.
            let (half, middle) = (0.5 * (high - low), 0.5 * (low + high));
            let (beyond, mut near) = ((middle + gap).abs() - half, half);
            for _ in 0..ROUNDS {
                near = on_path(beyond + centre / (2.0 * half - near), centre)[1].min(half);
            }
            let far = 2.0 * half - near;
            let (force, room) =
                if middle + gap > 0.0 { (low + near, [near, far]) } else { (high - near, [far, near]) };
            (force, room, room.map(|room| centre / room))
        }
        (false, false) => (kept, [f64::INFINITY; 2], [0.0; 2]),
    }
}

impl State {
    /// Of these forces, which are nearly right, at a relative velocity and ν.
    pub fn new(bundle: &Bundle, relative: &[f64; 6], centre: f64, kept: &Forces) -> Self {
        // The force comes out again where it leaves no gap.
        let gap = bundle.left(relative, kept.push) - kept.push;
        let (mut force, mut room, mut slack) = (Lanes::ZERO, [Lanes::ZERO; 2], [Lanes::ZERO; 2]);
        for lane in 0..WIDTH {
            let (bounds, push) = (bundle.bounds.map(|bound| bound.0[lane]), kept.push.0[lane]);
            let found = on_path_between(bounds, gap.0[lane], centre, push);
            force.0[lane] = found.0;
            for k in [0, 1] {
                (room[k].0[lane], slack[k].0[lane]) = (found.1[k], found.2[k]);
            }
        }
        Self { force, room, slack, friction: kept.friction }
    }

    /// Room × slack of each bound; zero without a bound.
    #[inline(always)]
    pub fn products(&self) -> [Lanes; 2] {
        two(|k| bounded(self.room[k], self.room[k] * self.slack[k]))
    }

    /// The forces that are reported. An open contact has none.
    pub fn forces(&self, bundle: &Bundle) -> Forces {
        let mut forces = Forces { push: self.force, friction: self.friction };
        for lane in 0..WIDTH {
            let is_at = |k: usize| bundle.has(k, lane) && self.room[k].0[lane] < self.slack[k].0[lane];
            if let Some(k) = (0..2).find(|&k| is_at(k)) {
                forces.push.0[lane] = bundle.bounds[k].0[lane];
                forces.friction.iter_mut().for_each(|friction| friction.0[lane] = 0.0);
            }
        }
        forces
    }
}

/// The values of rows with a bound, zero for others: where the room is infinite.
#[inline(always)]
pub fn bounded(room: Lanes, values: Lanes) -> Lanes {
    room.zip(values, |room, value| if room < f64::INFINITY { value } else { 0.0 })
}
