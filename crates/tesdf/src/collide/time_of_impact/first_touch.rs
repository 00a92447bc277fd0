//! The time at which the surfaces of two moving bodies first come together, by a best-first search
//! over pairs of parts of them.
use std::ops::ControlFlow;

use glam::DVec3;

use crate::collide::search::queue::Queue;
use crate::collide::time_of_impact::moving::{MovingBody, MovingPart, PartAt};
use crate::collide::time_of_impact::parting::PairAt;

/// What a search found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstTouch {
    /// The outcome.
    pub outcome: Outcome,
    /// The most steps that one pair of parts took.
    pub steps: u32,
}

/// The outcome of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// Two faces are within the distance that counts as touching at this time, and none before. With
    /// the direction from that of the second body to that of the first, if it is known exactly.
    Touch(f64, Option<DVec3>),
    /// No faces are, up to the end.
    Free,
    /// No faces are before this time. What comes then is not known.
    Unknown(f64),
}

/// Limits of a search.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Faces this near touch.
    pub touching: f64,
    /// Faces that do not touch are known to be farther apart than this.
    pub kept: f64,
    /// The last time of the motion.
    pub end: f64,
    /// Largest number of steps of a pair of parts.
    pub steps: u32,
}

/// A pair of parts. Its bound in the queue is the time up to which it is free.
#[derive(Clone, Copy, Debug)]
struct Open {
    parts: [MovingPart; 2],
    steps: u32,
}

/// Number of looks at pairs of parts after which a search stops. Each takes about a microsecond.
const MAX_LOOKS: u64 = 1 << 24;

/// A pair of parts goes on in time, instead of being divided, if its points can move by this share
/// of its size until then.
const SHARE: f64 = 0.25;

/// The first touch of two bodies that are apart at time 0. Only the second one can be a plane.
///
/// Each pair of parts has a time up to which it is free. The pair whose time is least is next. It
/// goes on to a later time, or is divided. So when two faces touch, everything is free up to then.
pub fn first_touch(bodies: &[MovingBody; 2], limits: &Limits) -> FirstTouch {
    let mut open = Queue::new();
    open.push(0.0, Open { parts: [0, 1].map(|k| bodies[k].whole()), steps: 0 });
    let radius = bodies[0].radius + bodies[1].radius;
    let (mut looks, mut most) = (0, 0);
    let touch = open.search(|open, time, Open { parts, steps }| {
        let end = |outcome| ControlFlow::Break(FirstTouch { outcome, steps: most.max(steps) });
        looks += 1;
        if looks > MAX_LOOKS {
            return end(Outcome::Unknown(time));
        }
        let pair = PairAt { bodies: [bodies[0].at(time), bodies[1].at(time)], radius, time };
        let places = [0, 1].map(|k| pair.bodies[k].part(parts[k]));
        let found = pair.parting(&places, limits.kept, limits.end - time);
        let are_faces = parts.iter().all(MovingPart::is_face);
        if are_faces && found.distance <= limits.touching {
            return end(Outcome::Touch(time, pair.direction(&places)));
        }
        let next = time + found.free;
        if next >= limits.end {
            most = most.max(steps);
            return ControlFlow::Continue(());
        }
        // A simple shape cannot be divided.
        let size: f64 = places.iter().filter(|place| !place.is_simple).map(PartAt::reach).sum();
        if are_faces || found.way >= SHARE * size {
            // Faces whose time does not grow are nearer than rounding can tell.
            if steps == limits.steps || next.is_nan() || next <= time {
                return end(Outcome::Unknown(time));
            }
            open.push(next, Open { parts, steps: steps + 1 });
            return ControlFlow::Continue(());
        }
        let is_first = match parts.map(|part| part.is_face()) {
            [true, _] => false,
            [_, true] => true,
            _ => places[0].reach() >= places[1].reach(),
        };
        let next = next.max(time);
        for part in bodies[usize::from(!is_first)].parts_of(parts[usize::from(!is_first)]) {
            let parts = if is_first { [part, parts[1]] } else { [parts[0], part] };
            open.push(next, Open { parts, steps });
        }
        ControlFlow::Continue(())
    });
    touch.unwrap_or(FirstTouch { outcome: Outcome::Free, steps: most })
}
