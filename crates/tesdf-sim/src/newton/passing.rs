//! Whether fast pairs pass into each other in the solved motion of a part of a step.
//!
//! A contact is a plane, and holds a point as far as the motion is straight and the surface flat. Of
//! slow pairs what is beyond that is small. The motion of a fast pair is followed by its time of impact,
//! so it is free to its end, ends at a small depth, or is solved again in shorter parts.
//! `docs/math.md`, section 19.
use std::collections::BTreeSet;

use glam::DVec3;
use tesdf::Length;
use tesdf::base::elementary;
use tesdf::collide::internal::Ahead;
use tesdf::collide::{
    ClearanceOptions, InstanceId, InstancePair, Motion, TimeOfImpactOptions, Velocity, clearance,
    instance_pairs, time_of_impact,
};

use super::Newton;
use super::impacts::FAR;
use super::integrate::{unpack, velocity};
use super::step::{Step, set_velocities};
use crate::{Body, DynamicsError, Mass, State};

/// A fast pair ends a part at most this deep, as part of the smaller diagonal, unless it was deeper
/// at the beginning.
const DEPTH: f64 = 5e-4;

/// Error of a depth, as part of the small depth.
const EXACT: f64 = 0.1;

/// Pairs that touch before this share of a part touch at its beginning, and those that touch after
/// the rest of it at its end: to divide there would be of no use.
const AT_ONCE: f64 = 0.02;

/// Most looks at the depth of a pair that touches at the end.
const MOST_DEPTHS: u32 = 64;

/// Bodies that touch at the beginning may turn a little more than those that a step begins with.
const TURNS: f64 = 1.5 * MOST_TURN;

/// A step is divided so that no body that may meet another one turns by more than this in a part, rad.
pub const MOST_TURN: f64 = 1.0;

/// What passes in a part.
#[derive(Clone, Copy, Debug)]
pub struct Passing {
    /// When a pair is hit, s, up to which the part is to be solved; `None` if a half of it is.
    pub hit: Option<f64>,
    /// Number of pairs that pass.
    pub pairs: u32,
}

/// A pair of bodies that closes fast.
struct Fast {
    ids: [InstanceId; 2],
    bodies: [usize; 2],
    /// The diagonal of the smaller one, m.
    size: f64,
    /// Bound of the change of distances in the part, m.
    way: f64,
}

/// What a fast pair does in a part.
enum Course {
    /// It is free, or goes on by less than the small depth after it touches.
    Free,
    /// It touches at the beginning, at this depth, m.
    Touching(f64),
    /// It touches later.
    Hit(Hit),
}

/// A pair that touches in a part, and not at its beginning.
struct Hit {
    /// When it touches, s.
    touches: f64,
    /// When the part is to be divided, s.
    divides: f64,
}

impl Newton {
    /// The fast pairs that pass when the bodies move from their states to `moved`, whose velocities
    /// are those of this motion.
    pub(super) fn passing(
        &mut self,
        step: &mut Step,
        moved: &[State],
    ) -> Result<Option<Passing>, DynamicsError> {
        if !self.detector.holds_all(&self.collide) {
            return Ok(None);
        }
        let pairs = self.fast_pairs(step, moved)?;
        step.report.followed += pairs.len() as u32;
        let mut touching: Vec<(Fast, f64)> = Vec::new();
        let mut hits: Vec<(Fast, Hit)> = Vec::new();
        for pair in pairs {
            match self.course(step, &pair, moved) {
                Course::Free => {}
                Course::Touching(depth) => touching.push((pair, depth)),
                Course::Hit(hit) => hits.push((pair, hit)),
            }
        }
        let mut divides: Vec<f64> = Vec::new();
        for (pair, hit) in hits {
            let is_late = hit.touches > (1.0 - AT_ONCE) * step.h;
            if !is_late || !self.stays_shallow(step, &pair, hit.touches, moved)? {
                divides.push(hit.divides);
            }
        }
        if !touching.is_empty() {
            self.system.scene_at(moved)?;
        }
        let is_lost = |(pair, before): &&(Fast, f64)| {
            let small = DEPTH * pair.size;
            self.turns(step, pair, moved) || self.depth(pair, EXACT) > small.max(before + EXACT * small)
        };
        let lost = touching.iter().filter(is_lost).count();
        // Half of the part has still to be solved where that is less.
        let half = if lost > 0 { 0.5 * step.h } else { step.h };
        let hit = divides.iter().copied().reduce(f64::min).filter(|hit| *hit < half);
        let pairs = (lost + divides.len()) as u32;
        Ok((pairs > 0).then_some(Passing { hit, pairs }))
    }

    /// The pairs that may meet in the part, and of which the way in the whole step would be more
    /// than [`FAR`] of the smaller size, with or without contacts. Pairs that overlap deeply are
    /// pushed apart otherwise.
    fn fast_pairs(&mut self, step: &Step, moved: &[State]) -> Result<Vec<Fast>, DynamicsError> {
        let at_begin = |velocities: &[State]| -> Vec<State> {
            let begin = self.system.states().iter().zip(velocities);
            begin.map(|(begin, moved)| State { pose: begin.pose, ..*moved }).collect()
        };
        let solved = at_begin(moved);
        let mut free = solved.clone();
        set_velocities(&mut free, &step.free, &step.target);
        let fastest =
            free.iter().chain(&solved).enumerate().map(|(k, state)| self.speed(k % free.len(), state));
        let smallest = self.sizes.iter().copied().fold(f64::INFINITY, f64::min);
        if 2.0 * step.whole * fastest.fold(0.0, f64::max) <= FAR * smallest {
            return Ok(Vec::new());
        }
        let without = self.pairs_that_meet(step, &free)?;
        let is_fast = |pair: &Fast| step.whole * pair.way > step.h * FAR * pair.size;
        let are_fast: BTreeSet<_> =
            without.iter().filter(|pair| is_fast(pair)).map(|pair| pair.ids).collect();
        let mut pairs = self.pairs_that_meet(step, &solved)?;
        pairs.retain(|pair| is_fast(pair) || are_fast.contains(&pair.ids));
        Ok(pairs)
    }

    /// Bound of the speed of the points of a body, m/s.
    fn speed(&self, body: usize, state: &State) -> f64 {
        if self.system.bodies()[body].mass == Mass::Fixed {
            return 0.0;
        }
        // Planes are infinite.
        let turning =
            if state.angular == DVec3::ZERO { 0.0 } else { self.sizes[body] * state.angular.length() };
        state.linear.length() + turning
    }

    /// The pairs that these states let meet in the part, but those that overlap deeply.
    fn pairs_that_meet(&mut self, step: &Step, states: &[State]) -> Result<Vec<Fast>, DynamicsError> {
        // Instances look ahead with straight ways of their origins, but centres of mass move
        // straight.
        let bend = |(body, state): (&Body, &State)| match body.mass {
            Mass::Free(mass) => elementary::powi(step.h * state.angular.length(), 2) * mass.center.length(),
            Mass::Fixed | Mass::Kinematic => 0.0,
        };
        let bend = self.system.bodies().iter().zip(states).map(bend).fold(0.0, f64::max);
        let pairs = instance_pairs(self.system.scene_at(states)?, bend, step.h)?;
        let of_pair = |InstancePair { first, second, .. }| {
            let bodies = [self.system.body_of(first)?, self.system.body_of(second)?];
            let size = bodies.map(|body| self.sizes[body]).into_iter().fold(f64::INFINITY, f64::min);
            // Along a plane, too, motion says how far a straight way is from the real one.
            let [a, b] = match Ahead::of_both(self.system.scene(), [first, second], step.h) {
                Ok(both) => both,
                Err(e) => return Some(Err(e.into())),
            };
            let way = bend + a.change(&b);
            let is_deep = |body: usize| step.free_of[body].is_some_and(|k| step.deep[k]);
            let is_any_deep = bodies.into_iter().any(is_deep);
            (!is_any_deep).then_some(Ok(Fast { ids: [first, second], bodies, size, way }))
        };
        pairs.into_iter().filter_map(of_pair).collect()
    }

    /// What a pair does in a part. The scene is at its beginning.
    fn course(&self, step: &Step, pair: &Fast, moved: &[State]) -> Course {
        let solved = pair.bodies.map(|body| self.motion(body, &moved[body]));
        // Contacts end at the skin.
        let skin = self.options.skin * pair.size;
        let Some((touches, clearance)) = self.touch(pair, solved, 0.5 * skin, step.h) else {
            return Course::Free;
        };
        // The speed at its end is at most twice that bound.
        if 2.0 * pair.way * (1.0 - touches / step.h) <= DEPTH * pair.size {
            return Course::Free;
        }
        if touches == 0.0 {
            return Course::Touching((-clearance).max(0.0));
        }
        // Contacts that are not closed yet have pushed it, so it is hit where it would be without
        // them.
        let free = pair.bodies.map(|body| {
            let velocity = step.free_of[body].map(|k| unpack(&step.target[k]));
            let (linear, angular) = velocity.unwrap_or((moved[body].linear, moved[body].angular));
            self.motion(body, &State { linear, angular, ..moved[body] })
        });
        let divides = self.touch(pair, free, 2.0 * skin, step.h).map_or(touches, |(time, _)| time);
        let is_at_once = divides < AT_ONCE * step.h;
        if is_at_once { Course::Touching(0.0) } else { Course::Hit(Hit { touches, divides }) }
    }

    /// The time at which a pair touches or is no longer known to be free, and the clearance then;
    /// `None` if it is free to the end.
    fn touch(&self, pair: &Fast, motions: [Motion; 2], tolerance: f64, end: f64) -> Option<(f64, f64)> {
        let ([a, b], [of_a, of_b]) = (pair.ids, motions);
        let tolerance = if tolerance > 0.0 { Length::Absolute(tolerance) } else { Length::OfDiagonal(1e-6) };
        let options = TimeOfImpactOptions { tolerance, end, ..TimeOfImpactOptions::default() };
        match time_of_impact(self.system.scene(), a, b, of_a, of_b, &options) {
            Ok(found) => Some((found.free_until(), found.clearance()?.distance)),
            // Of a plane that turns nothing is known.
            Err(_) => Some((0.0, 0.0)),
        }
    }

    /// Whether a pair that is free until `time` is never deeper than twice the small depth, and ends
    /// at most [`EXACT`] of it deep.
    fn stays_shallow(
        &mut self,
        step: &Step,
        pair: &Fast,
        mut time: f64,
        moved: &[State],
    ) -> Result<bool, DynamicsError> {
        let (small, mut depth) = (DEPTH * pair.size, 0.0);
        for _ in 0..MOST_DEPTHS {
            // The depth changes by at most `2 way` in the duration of the part.
            time = step.h.min(time + step.h * (3.0 * small - depth) / (2.0 * pair.way));
            let then = pair.bodies.map(|body| {
                let pose = self.pose_after(step, body, &velocity(&moved[body]), time);
                (body, State { pose, ..moved[body] })
            });
            self.system.scene_with(then)?;
            if time >= step.h {
                return Ok(self.depth(pair, EXACT * EXACT) <= EXACT * small);
            }
            depth = self.depth(pair, EXACT);
            if depth > small {
                return Ok(false);
            }
        }
        Ok(false)
    }

    /// The motion of a body in a part of a step, at the velocities of `state`.
    fn motion(&self, body: usize, state: &State) -> Motion {
        let pose = self.system.states()[body].pose;
        let point = match self.system.bodies()[body].mass {
            Mass::Fixed => return Motion::Rest,
            Mass::Kinematic => pose.translation,
            Mass::Free(mass) => pose.to_world(mass.center),
        };
        let velocity = Velocity { linear: state.linear, angular: state.angular };
        Motion::About { point, velocity }
    }

    /// Whether a body of a pair turns so far that what holds it at the beginning says little of the
    /// end.
    fn turns(&self, step: &Step, pair: &Fast, moved: &[State]) -> bool {
        pair.bodies.iter().any(|&body| {
            let is_fixed = self.system.bodies()[body].mass == Mass::Fixed;
            !is_fixed && !self.is_ball(body) && step.h * moved[body].angular.length() > TURNS
        })
    }

    /// How deep a pair is, m, where the scene is, up to this share of the small depth. As deep as can
    /// be if that is not known.
    fn depth(&self, pair: &Fast, error: f64) -> f64 {
        let options = ClearanceOptions { tolerance: Length::Absolute(error * DEPTH * pair.size) };
        let [a, b] = pair.ids;
        clearance(self.system.scene(), a, b, &options).map_or(f64::INFINITY, |found| -found.lower_bound)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector6;

    use super::*;
    use crate::newton::integrate::pack;
    use crate::scene_file::LoadedScene;

    /// The duration of a part, s, and the turn of the blade in it, rad.
    const H: f64 = 5e-3;
    const TURN: f64 = 2.6;
    /// Half of the length and of the width of the blade, m.
    const BLADE: [f64; 2] = [0.1, 0.02];

    /// A blade that turns beside a wall, the part, and the states at its end. At the share `at` of the
    /// part a corner of the blade is as deep in the wall as it comes: by `deep` of the small depth.
    fn graze(at: f64, deep: f64) -> (Newton, Step, Vec<State>) {
        let [length, width] = BLADE;
        let (reach, corner) = (elementary::hypot(length, width), (width / length).atan());
        let small = DEPTH * 2.0 * (length * length + 2.0 * width * width).sqrt();
        let (wall, half_turn) = (0.5 + reach - deep * small, 0.5 * (-corner - at * TURN));
        let [sin, cos] = [elementary::sin(half_turn), elementary::cos(half_turn)];
        let text = format!(
            "time_step = {H:?}\nduration = 1\n[[bodies]]\nname = \"wall\"\nfixed = true\n\
             shape = {{ box = {{ half_extents = [0.5, 0.5, 0.5] }} }}\ntranslation = [{wall:?}, 0, 0]\n\
             [[bodies]]\nname = \"blade\"\nmass = 1\nshape = {{ box = {{ half_extents = [{length:?}, {width:?}, \
             {width:?}] }} }}\nrotation = [0, 0, {sin:?}, {cos:?}]\nangular_velocity = [0, 0, {:?}]\n",
            TURN / H,
        );
        let loaded = LoadedScene::parse(text, "scene.toml").unwrap();
        let engine = loaded.newton(loaded.system().unwrap()).unwrap();
        let step = engine.begin(H, H);
        let velocity: Vector6<f64> = pack(DVec3::ZERO, DVec3::new(0.0, 0.0, TURN / H));
        let moved = engine.moved(&step, &[velocity]);
        (engine, step, moved)
    }

    #[test]
    fn a_pair_that_grazes_stays_shallow_and_one_that_goes_deep_or_ends_deep_does_not() {
        let cases = [(0.985, 0.5, true), (0.985, 3.0, false), (1.0, 0.05, true), (1.0, 0.5, false)];
        for (at, deep, expected) in cases {
            let (mut engine, step, moved) = graze(at, deep);
            let pair = engine.fast_pairs(&step, &moved).unwrap().remove(0);
            let found = engine.stays_shallow(&step, &pair, (at - 0.015) * H, &moved).unwrap();
            assert_eq!(found, expected, "{deep} of the small depth at {at} of the part");
        }
    }

    #[test]
    fn a_part_is_not_divided_where_a_pair_grazes_late() {
        for (at, deep, passes) in [(0.991, 0.2, 0), (0.991, 3.0, 1), (0.6, 0.5, 1)] {
            let (mut engine, mut step, moved) = graze(at, deep);
            let passing = engine.passing(&mut step, &moved).unwrap();
            assert_eq!(step.report.followed, 1);
            assert_eq!(
                passing.map_or(0, |passing| passing.pairs),
                passes,
                "{deep} of the small depth at {at}"
            );
        }
    }
}
