use serde::{Deserialize, Serialize};

use super::clearance::{Body, Pair};
use super::motion::{Motion, Twist, closing_speed};
use super::{Clearance, CollideError, InstanceId, Placement, Scene, Shape};
use crate::base::Length;

/// Definition of an impact, and limits of the search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeOfImpactOptions {
    /// Bodies within this distance touch: a fraction of the smaller body's diagonal, or a length in
    /// the world's unit.
    pub tolerance: Length,
    /// The motion is followed from time 0 to this time.
    pub end: f64,
    /// Largest number of steps, at most [`MAX_ITERATIONS`](Self::MAX_ITERATIONS). Each step
    /// computes one clearance.
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

/// The impact of two moving bodies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Impact {
    /// Time of the impact. Before it the bodies are apart.
    pub time: f64,
    /// Witness points, normal and distance at that time. When `touches`, the distance is within the
    /// tolerance. It is negative only at time 0, for bodies that penetrate from the start.
    #[serde(flatten)]
    pub clearance: Clearance,
    /// Number of steps taken.
    pub iterations: u32,
    /// Whether the bodies touch at `time`. False when the steps were used up, for example by bodies
    /// that slide along each other. Then the motion is known to be free up to `time`.
    pub touches: bool,
}

/// The first time at which two moving instances touch. `None` when they stay apart, by more than
/// half of the tolerance, until the end.
///
/// Conservative advancement (Mirtich 1996; for meshes that are not convex, Zhang, Lee and Kim
/// 2006). In a time t, the clearance shrinks by at most t times the greatest closing speed of any
/// two points. So the bodies can move on until the clearance minus half of the tolerance could be
/// used up. Nothing is sampled, so thin or fast bodies cannot pass through each other. The
/// velocities of the instances are not used; pass them as [`Motion::Linear`].
///
/// Bodies that penetrate at the start have time 0 and their negative distance. Bodies within the
/// tolerance have time 0.
///
/// An open mesh is touched where the surfaces touch: a body may pass through its holes.
///
/// ```
/// use tesdf::collide::{
///     Instance, Motion, Pose, Scene, Shape, TimeOfImpactOptions, Velocity, time_of_impact,
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
/// let impact = time_of_impact(&scene, ball, floor, down, Motion::Rest, &options)?;
/// assert!(impact.is_some_and(|i| (i.time - 0.5).abs() < 1e-6 && i.clearance.distance >= 0.0));
/// # Ok::<(), tesdf::collide::CollideError>(())
/// ```
///
/// # Errors
/// As [`clearance`](super::clearance()); also for a motion that is not finite, a rotating plane, or
/// an invalid option.
pub fn time_of_impact(
    scene: &Scene,
    a: InstanceId,
    b: InstanceId,
    motion_a: Motion,
    motion_b: Motion,
    options: &TimeOfImpactOptions,
) -> Result<Option<Impact>, CollideError> {
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
    let speed = closing_speed([moving(&start.a, motion_a)?, moving(&start.b, motion_b)?]);
    // Small relative to the half of the tolerance that is kept.
    let exactness = tolerance / 8.0;
    let mut now = start.clearance(exactness)?;
    if now.distance <= tolerance {
        return Ok(Some(Impact { time: 0.0, clearance: now, iterations: 0, touches: true }));
    }
    let mut time = 0.0;
    for iteration in 1..=options.iterations {
        let next = time + (now.distance - 0.5 * tolerance) / speed;
        // `next` is infinite when nothing moves.
        if next > options.end {
            return Ok(None);
        }
        time = next;
        let at = Pair { a: at_time(start.a, motion_a, time), b: at_time(start.b, motion_b, time) };
        // The bodies were apart at the start and have not touched since, so neither is inside the
        // other.
        now = at.apart(exactness)?;
        if now.distance <= tolerance {
            return Ok(Some(Impact { time, clearance: now, iterations: iteration, touches: true }));
        }
    }
    Ok(Some(Impact { time, clearance: now, iterations: options.iterations, touches: false }))
}

fn moving<'a>(body: &Body<'a>, motion: Motion) -> Result<(Twist, &'a Shape, Placement), CollideError> {
    let refuse = |reason| Err(CollideError::Instance { instance: body.id.0, reason });
    if let Err(reason) = motion.validate() {
        return refuse(reason);
    }
    let twist = motion.twist(body.placement.pose);
    if twist.rotates() && matches!(body.shape, Shape::Plane) {
        return refuse(
            "a plane that turns has points of any speed; expected a motion without turning".into(),
        );
    }
    Ok((twist, body.shape, body.placement))
}

fn at_time<'a>(body: Body<'a>, motion: Motion, time: f64) -> Body<'a> {
    let pose = motion.pose_at(body.placement.pose, time);
    Body { placement: Placement { pose, ..body.placement }, ..body }
}
