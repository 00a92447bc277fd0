//! The time at which two moving bodies first touch.
mod first_touch;
mod gjk;
mod moving;
mod parting;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::base::Length;
use crate::collide::clearance::Clearance;
use crate::collide::clearance::{Body, Pair};
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::collide::scene::motion::Motion;
use crate::collide::scene::pose::Placement;
use crate::collide::time_of_impact::first_touch::{FirstTouch, Limits, Outcome, first_touch};
use crate::collide::time_of_impact::moving::MovingBody;

/// Definition of an impact, and limits of the search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeOfImpactOptions {
    /// Bodies within this distance touch: a fraction of the smaller body's diagonal, or a length in
    /// the world's unit.
    pub tolerance: Length,
    /// The motion is followed from time 0 to this time.
    pub end: f64,
    /// Largest number of steps of a pair of parts of the two surfaces, at most
    /// [`MAX_ITERATIONS`](Self::MAX_ITERATIONS). A step takes a pair on to a later time, up to
    /// which it is free.
    pub iterations: u32,
}

impl TimeOfImpactOptions {
    /// Largest accepted value of `iterations`.
    pub const MAX_ITERATIONS: u32 = 1_000_000;
}

impl Default for TimeOfImpactOptions {
    /// 1e-6 of the smaller diagonal, up to time 1, in at most 1000 steps.
    fn default() -> Self {
        Self { tolerance: Length::OfDiagonal(1e-6), end: 1.0, iterations: 1000 }
    }
}

/// Whether two moving bodies touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeOfImpact {
    /// They touch.
    Impact(Impact),
    /// They stay apart, by more than half of the tolerance, until the end of the motion.
    Free {
        /// The end of the motion.
        end: f64,
        /// The most steps that a pair of parts took.
        iterations: u32,
    },
    /// They are free up to a time, and what comes then is not known.
    Undecided(FreeUntil),
}

/// The first impact of two moving bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Time of the impact. Before it the bodies are apart.
    pub time: f64,
    /// Witness points, normal and distance at that time. The distance is within the tolerance. It
    /// is negative only at time 0, for bodies that penetrate from the start. The normal is exact also
    /// where two edges nearly touch.
    pub clearance: Clearance,
    /// The most steps that a pair of parts took.
    pub iterations: u32,
}

/// A part of a motion that is known to be free. The rest is not known, because the steps were used
/// up, or because rounding of the places is not small relative to the tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeUntil {
    /// The bodies are apart up to this time.
    pub time: f64,
    /// Witness points, normal and distance at that time. The distance is the gap that is left.
    pub clearance: Clearance,
    /// The most steps that a pair of parts took.
    pub iterations: u32,
}

impl TimeOfImpact {
    /// The impact, if they touch.
    pub fn impact(&self) -> Option<&Impact> {
        if let Self::Impact(impact) = self { Some(impact) } else { None }
    }

    /// Whether they stay apart until the end.
    pub fn is_free(&self) -> bool {
        matches!(self, Self::Free { .. })
    }

    /// The bodies are apart before this time: that of the impact, the end of the motion, or that
    /// up to which is known.
    pub fn free_until(&self) -> f64 {
        match self {
            Self::Impact(Impact { time, .. }) | Self::Undecided(FreeUntil { time, .. }) => *time,
            Self::Free { end, .. } => *end,
        }
    }

    /// The clearance at [`free_until`](Self::free_until); `None` of bodies that stay apart.
    pub fn clearance(&self) -> Option<&Clearance> {
        match self {
            Self::Impact(Impact { clearance, .. }) | Self::Undecided(FreeUntil { clearance, .. }) => {
                Some(clearance)
            }
            Self::Free { .. } => None,
        }
    }

    /// The most steps that a pair of parts took.
    pub fn iterations(&self) -> u32 {
        match self {
            Self::Impact(Impact { iterations, .. })
            | Self::Free { iterations, .. }
            | Self::Undecided(FreeUntil { iterations, .. }) => *iterations,
        }
    }

    /// The name of the verdict: `impact`, `free` or `undecided`.
    pub fn verdict(&self) -> &'static str {
        match self {
            Self::Impact(_) => "impact",
            Self::Free { .. } => "free",
            Self::Undecided(_) => "undecided",
        }
    }
}

/// The first time at which two moving instances touch, or that they stay apart.
///
/// A best-first search over pairs of nodes of the face trees and of faces, in the order of time. A
/// pair goes on as long as a plane between its two parts certainly separates them. That takes into
/// account how fast they come nearer perpendicular to the plane, not along it. So surfaces that
/// slide past each other at a small gap take few steps. It is conservative advancement (Mirtich
/// 1996; with face trees, Tang, Kim and Manocha 2009), for each pair of parts. Nothing is sampled,
/// so thin or fast bodies cannot pass through each other. Simple shapes are one part. Proof:
/// `docs/math.md`, section 17.
///
/// The velocities of the instances are not used; pass them as [`Motion::Linear`].
///
/// Bodies that penetrate at the start have time 0 and their negative distance. Bodies within the
/// tolerance have time 0.
///
/// An open mesh is touched where the surfaces touch: a body may pass through its holes.
///
/// ```
/// use tesdf::collide::{
///     Instance, Motion, Pose, Scene, Shape, TimeOfImpact, TimeOfImpactOptions, Velocity,
///     time_of_impact,
/// };
/// use tesdf::glam::DVec3;
///
/// let mut scene = Scene::new();
/// let floor = scene.add_shape(Shape::Plane)?;
/// let ball = scene.add_shape(Shape::Sphere { radius: 1.0 })?;
/// let floor = scene.add(Instance::new(floor, Pose::IDENTITY))?;
/// let ball = scene.add(Instance::new(ball, Pose::at(DVec3::new(0.0, 0.0, 5.0))))?;
/// let velocity = Velocity { linear: DVec3::new(0.0, 0.0, -8.0), ..Velocity::default() };
/// let down = Motion::Linear { velocity };
/// let options = TimeOfImpactOptions::default();
/// match time_of_impact(&scene, ball, floor, down, Motion::Rest, &options)? {
///     TimeOfImpact::Impact(impact) => assert!((impact.time - 0.5).abs() < 1e-6),
///     TimeOfImpact::Free { .. } | TimeOfImpact::Undecided(_) => panic!("it lands"),
/// }
/// # Ok::<(), tesdf::collide::CollideError>(())
/// ```
///
/// # Errors
/// As [`clearance`](crate::collide::clearance()); also for a motion that is not finite, a rotating
/// plane, or an invalid option.
pub fn time_of_impact(
    scene: &Scene,
    a: InstanceId,
    b: InstanceId,
    motion_a: Motion,
    motion_b: Motion,
    options: &TimeOfImpactOptions,
) -> Result<TimeOfImpact, CollideError> {
    let start = Pair::new(scene, a, b)?;
    let tolerance = start.tolerance(options.tolerance)?;
    if !(options.end >= 0.0 && options.end.is_finite()) {
        let (option, expected) = ("end", "a finite time, 0 or greater");
        return Err(CollideError::Option { option, found: options.end.to_string(), expected });
    }
    if options.iterations > TimeOfImpactOptions::MAX_ITERATIONS {
        let (option, expected) = ("iterations", "at most 1000000");
        return Err(CollideError::Option { option, found: options.iterations.to_string(), expected });
    }
    let origin = start.b.placement.pose.translation;
    let moving = |body, motion| MovingBody::new(body, motion, origin);
    let mut bodies = [moving(&start.a, motion_a)?, moving(&start.b, motion_b)?];
    // Small relative to the part of the tolerance that is kept.
    let exactness = tolerance / 8.0;
    let clearance = start.clearance(exactness)?;
    if clearance.distance <= tolerance {
        return Ok(TimeOfImpact::Impact(Impact { time: 0.0, clearance, iterations: 0 }));
    }
    if bodies[0].is_plane() {
        bodies.swap(0, 1);
    }
    // The bodies are apart at the start. They stay so until their surfaces touch.
    let limits = Limits {
        touching: 0.75 * tolerance,
        kept: 0.5 * tolerance,
        end: options.end,
        steps: options.iterations,
    };
    let FirstTouch { outcome, steps: iterations } = first_touch(&bodies, &limits);
    let (time, direction) = match outcome {
        Outcome::Touch(time, direction) => (time, direction),
        Outcome::Unknown(time) => (time, None),
        Outcome::Free => return Ok(TimeOfImpact::Free { end: options.end, iterations }),
    };
    let at = Pair { a: at_time(start.a, motion_a, time), b: at_time(start.b, motion_b, time) };
    let mut clearance = at.apart(exactness)?;
    // On its surface, the gradient of a field is the normal of a face. Between two edges it is not.
    let gap = |n: DVec3| n.dot(clearance.point_a - clearance.point_b);
    if let Some(n) = direction.filter(|&n| gap(n) > gap(clearance.normal)) {
        clearance.normal = n;
    }
    Ok(if clearance.distance <= tolerance {
        TimeOfImpact::Impact(Impact { time, clearance, iterations })
    } else {
        TimeOfImpact::Undecided(FreeUntil { time, clearance, iterations })
    })
}

fn at_time<'a>(body: Body<'a>, motion: Motion, time: f64) -> Body<'a> {
    let pose = motion.pose_at(body.placement.pose, time);
    Body { placement: Placement { pose, ..body.placement }, ..body }
}
