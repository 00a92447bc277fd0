//! Restitution: bodies that meet fast part again.
//!
//! A part of a step ends where such bodies meet, and the next one begins with their impact, which
//! takes no time. Impacts go in rounds: those that close bounce together, and what they drive into
//! others bounces in the next round. So a row of balls hands a momentum on to its last one, where one
//! minimisation over all contacts would spread it over all balls (Smith, Kaufman, Vouga, Tamstorf and
//! Grinspun, *Reflections on simultaneous impact*, 2012).
//!
//! A round has two minimisations, with friction and joints: to velocities `w` at which nothing closes,
//! and to velocities at which contacts open by their restitution times the speed at which they closed
//! (Newton's law). The way from `w` to these is at most as long as that to `w`, in the norm of the
//! inertia: so no impact brings energy, whatever friction and unequal coefficients ask for.
use glam::DVec3;
use nalgebra::{Matrix6, Vector6};
use tesdf::collide::Contact;

use super::Newton;
use super::far_contacts::Reach;
use super::gaps::Found;
use super::geometric::Motion;
use super::integrate::{pack, unpack, velocity};
use super::joints::impact_rows;
use super::rows::{FreeBody, Gap, Row, RowForce};
use super::solve::{Guess, from_last};
use super::step::Step;
use crate::forces::Forces;
use crate::{DynamicsError, Mass, StepReport};

/// Bodies that close more slowly than gravity makes them in this many steps come to rest, ...
const OF_GRAVITY: f64 = 2.0;

/// ... and those below this speed, m/s.
const SLOW: f64 = 1e-3;

/// Bodies that meet within this share of a step touch now.
const AT_ONCE: f64 = 1.0 / 16.0;

/// Maximum number of impacts, and of parts that end at one, in a step. What meets after them stops.
const MOST: u32 = 64;

/// Maximum number of rounds of an impact. A row of balls needs one for each.
const ROUNDS: u32 = 64;

/// Contacts that close more slowly than this, m/s, or this share of the fastest one, do not close.
const STOPPED: f64 = 1e-5;
const STOPPED_OF_FASTEST: f64 = 1e-6;

/// What bodies with restitution have done in a step so far.
pub struct Bounces {
    /// How many more impacts and parts they may make.
    pub left: u32,
    /// The forces of the impacts.
    pub forces: Forces,
    /// What is reported of them.
    pub report: StepReport,
}

impl Bounces {
    /// In a step of a system with this many joints.
    pub fn new(joints: usize) -> Self {
        Self { left: MOST, forces: Forces::none(joints), report: StepReport::begun() }
    }
}

/// What is next for bodies with restitution.
pub enum Meeting {
    /// They do not meet fast in this part.
    None,
    /// They have parted: the states have other velocities.
    Parted,
    /// They meet after this time, s.
    After(f64),
}

/// A contact with its row, whose gap is that above the skin.
struct Place<'a> {
    found: &'a Found<'a>,
    row: Row,
    restitution: f64,
}

impl Place<'_> {
    /// The speed at which it closes at the velocities of free bodies, m/s.
    fn approach(&self, velocities: &[Vector6<f64>], h: f64) -> f64 {
        -self.row.rate(velocities) - self.found.carried() / h
    }
}

impl Newton {
    /// Lets bodies that meet fast at the beginning of a part bounce, or tells when they meet in it.
    pub(super) fn meet(
        &mut self,
        step: &mut Step,
        contacts: &[Contact],
        bounces: &mut Bounces,
    ) -> Result<Meeting, DynamicsError> {
        if bounces.left == 0 || !self.system.has_restitution() {
            return Ok(Meeting::None);
        }
        let (found, rows, _) = self.gaps(step).find(contacts, &step.poses, Reach::All, step.h);
        let places = found.iter().zip(rows).map(|(found, row)| {
            let [a, b] =
                [found.contact.instance_a, found.contact.instance_b].map(|id| self.system.body_of(id));
            let restitution = match (a, b) {
                (Some(a), Some(b)) if !self.is_deep(found.contact) => self.system.restitution(a, b),
                _ => 0.0,
            };
            Place { found, row, restitution }
        });
        let places: Vec<Place<'_>> = places.collect();
        // Bodies move by the velocities at the ends of steps: where they are, these lack half of
        // what gravity gives in a step. With it, a ball of restitution 1 comes back to its height.
        let lag = pack(0.5 * step.whole * self.system.gravity, DVec3::ZERO);
        let now = |free: &FreeBody| velocity(&self.system.states()[free.body]) + lag;
        let start: Vec<_> = step.free.iter().map(now).collect();
        let (h, slow) = (step.h, SLOW + OF_GRAVITY * step.whole * self.system.gravity.length());
        let shortest = AT_ONCE * step.whole;
        let bounces_now = |place: &Place<'_>| {
            let approach = place.approach(&start, h);
            place.restitution > 0.0 && approach > slow && place.row.gap <= approach * shortest
        };
        if !places.iter().any(bounces_now) {
            let when = |place: &Place<'_>| {
                let approach = place.approach(&step.target, h);
                (place.restitution > 0.0 && approach > slow).then(|| (place.row.gap / approach).max(shortest))
            };
            let soonest = places.iter().filter_map(when).fold(f64::INFINITY, f64::min);
            if soonest >= 0.999 * h {
                return Ok(Meeting::None);
            }
            bounces.left -= 1;
            return Ok(Meeting::After(soonest));
        }
        let (velocities, forces) = self.impact(step, &places, &start, slow)?;
        bounces.forces.add(&forces, h / step.whole);
        bounces.report.add(&step.report);
        bounces.left -= 1;
        let mut states = self.system.states().to_vec();
        for ((free, before), after) in step.free.iter().zip(&start).zip(&velocities) {
            let (linear, angular) = unpack(&(after - before));
            states[free.body].linear += linear;
            states[free.body].angular += angular;
        }
        self.system.set_states(states)?;
        Ok(Meeting::Parted)
    }

    /// The velocities after the impact of bodies with the velocities `start`, and its forces, as if it
    /// took the whole part.
    fn impact(
        &self,
        step: &mut Step,
        places: &[Place<'_>],
        start: &[Vector6<f64>],
        slow: f64,
    ) -> Result<(Vec<Vector6<f64>>, Forces), DynamicsError> {
        let (h, shortest) = (step.h, AT_ONCE * step.whole);
        let free: Vec<FreeBody> =
            step.free.iter().filter_map(|free| self.at_start(step, free.body)).collect();
        let joints = impact_rows(&self.gaps(step).bodies(), h);
        let mut all = Forces::none(self.system.joints().len());
        let mut velocities = start.to_vec();
        let fastest = places.iter().map(|place| place.approach(start, h)).fold(0.0, f64::max);
        let stopped = STOPPED.max(STOPPED_OF_FASTEST * fastest);
        for _ in 0..ROUNDS {
            let closing = |place: &&Place<'_>| {
                let approach = place.approach(&velocities, h);
                approach > stopped && place.row.gap <= approach * shortest
            };
            let hit: Vec<&Place<'_>> = places.iter().filter(closing).collect();
            if hit.is_empty() {
                break;
            }
            let rows = |opening: &dyn Fn(&Place<'_>) -> f64| -> Vec<Row> {
                let row = |place: &&Place<'_>| {
                    let gap = place.found.carried() - h * opening(place);
                    Row { gap, relaxed_gap: gap, ..place.row.clone() }
                };
                hit.iter().map(row).chain(joints.iter().cloned()).collect()
            };
            let motion = Motion::new(&free, &velocities);
            let guess = Guess { velocities: &velocities, forces: None, known: None };
            let stopping = rows(&|_| 0.0);
            let (stopped, compressing) = self.solve(step, &motion, &stopping, Gap::Position, guess)?;
            let opening = rows(&|place| match place.approach(&velocities, h) {
                approach if approach > slow => place.restitution * approach,
                _ => 0.0,
            });
            let (parted, opening) =
                self.solve(step, &motion, &opening, Gap::Position, from_last(&stopped, &compressing))?;
            let share = (way(&motion, &velocities, &stopped) / way(&motion, &stopped, &parted)).min(1.0);
            let between = |(w, u): (&Vector6<f64>, &Vector6<f64>)| w + share * (u - w);
            velocities = stopped.iter().zip(&parted).map(between).collect();
            let forces = compressing.iter().zip(&opening).map(|(w, u)| RowForce {
                along: w.along + share * (u.along - w.along),
                friction: w.friction + share * (u.friction - w.friction),
                torsion: w.torsion + share * (u.torsion - w.torsion),
            });
            all.add(&self.reactions(&stopping, &forces.collect::<Vec<_>>(), hit.len()), 1.0);
        }
        Ok((velocities, all))
    }

    /// A free body in its orientation at the beginning of the step.
    fn at_start(&self, step: &Step, body: usize) -> Option<FreeBody> {
        match self.system.bodies()[body].mass {
            Mass::Free(mass) => Some(FreeBody::new(body, &mass, step.poses[body].rotation)),
            Mass::Fixed | Mass::Kinematic => None,
        }
    }
}

/// The way between velocities in the norm of the inertia; not 0.
fn way(motion: &Motion, from: &[Vector6<f64>], to: &[Vector6<f64>]) -> f64 {
    let square = |((a, b), m): ((&Vector6<f64>, &Vector6<f64>), &Matrix6<f64>)| {
        let change = b - a;
        change.dot(&(m * change))
    };
    let sum: f64 = from.iter().zip(to).zip(&motion.inertia).map(square).sum();
    sum.sqrt().max(f64::MIN_POSITIVE)
}
