//! Converts joints and their couplings to rows of the convex problem.
//!
//! The rows keep the directions that they have at the beginning of the step, also when the bodies
//! were predicted; only the gaps follow, as in SHAKE (Ryckaert, Ciccotti and Berendsen 1977). With
//! the directions of the predicted poses, a pendulum loses nine tenths of its energy.
use glam::DVec3;
use nalgebra::Vector6;
use tesdf::collide::Pose;

use super::couplings::{coupling_errors, coupling_rows, predict_couplings};
use super::integrate::pack;
use super::rows::{Bodies, PUSHES, Resistance, Row, RowId, Stiffness};
use crate::joint::{JointResistance, axes, nearest_turn, rotation_between, swing, wrapped};
use crate::{Drive, Joint, JointKind, Mass, State, System};

/// A direction in which a joint measures an error: of the translation at a point, or of the
/// rotation.
#[derive(Clone, Copy, Debug)]
enum Direction {
    Along(DVec3),
    About(DVec3),
}

/// Of a row that holds in both directions, whatever it takes.
const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// A row of a joint, before its bodies are known.
#[derive(Clone, Copy, Debug)]
struct Measure {
    direction: Direction,
    error: Error,
    /// Least and greatest force; positive forces raise the coordinate.
    bounds: [f64; 2],
    /// Stiffness of a spring, N/m or N m/rad; `None` where the row is rigid.
    stiffness: Option<f64>,
    resistance: Resistance,
}

/// What the row brings to zero at the end of the step.
#[derive(Clone, Copy, Debug)]
enum Error {
    /// This error of the poses, m or rad.
    Position(f64),
    /// The difference of the rate from this one, m/s or rad/s.
    Rate(f64),
}

/// The rows of all joints, then those of all couplings, at the poses of the beginning of the step.
pub fn joint_rows(bodies: &Bodies<'_>, h: f64) -> Vec<Row> {
    rows(bodies, h, |measure| measure, coupling_rows(bodies, h))
}

/// The same for an impact, which takes no time: what must hold, whatever it takes, stops to move,
/// and all else, such as limits, springs and motors of limited force, does nothing.
pub fn impact_rows(bodies: &Bodies<'_>, h: f64) -> Vec<Row> {
    let change = |measure| match measure {
        Measure { error: Error::Position(_), bounds: FREE, .. } => {
            Measure { error: Error::Position(0.0), ..measure }
        }
        _ => Measure { bounds: [0.0; 2], ..measure },
    };
    let mut couplings = coupling_rows(bodies, h);
    let holding = coupling_errors(bodies.system, bodies.system.states(), 0.0);
    for (row, error) in couplings.iter_mut().zip(holding) {
        row.gap -= error;
        row.relaxed_gap = row.gap;
    }
    rows(bodies, h, change, couplings)
}

fn rows(bodies: &Bodies<'_>, h: f64, change: impl Fn(Measure) -> Measure, couplings: Vec<Row>) -> Vec<Row> {
    let of_joint = |(joint, &near): (&Joint, &f64)| {
        let states = bodies.system.states();
        let poses = System::poses_of(joint, states);
        let point = joint.frames_in_world(poses)[1].translation;
        let row = |measure: Measure| row(joint, change(measure), point, bodies, h);
        measures(joint, poses, near, bodies.system.rate_of(joint, states), h)
            .into_iter()
            .map(row)
            .collect::<Vec<_>>()
    };
    let rows = bodies.system.joints().iter().zip(bodies.system.coordinates()).flat_map(of_joint);
    rows.chain(couplings).enumerate().map(|(k, row)| Row { id: RowId::Joint(k), ..row }).collect()
}

/// Sets the gaps of `rows`, which are those of all joints and couplings, to the errors at the
/// `states` that `velocities` lead to.
pub fn predict(rows: &mut [Row], bodies: &Bodies<'_>, states: &[State], velocities: &[Vector6<f64>], h: f64) {
    let of_joint = |(joint, &near): (&Joint, &f64)| {
        // The rate matters for no position.
        measures(joint, System::poses_of(joint, states), near, 0.0, h)
    };
    let (joints, couplings) = rows.split_at_mut(rows.len() - bodies.system.couplings().len());
    let measures = bodies.system.joints().iter().zip(bodies.system.coordinates()).flat_map(of_joint);
    for (row, measure) in joints.iter_mut().zip(measures) {
        if let Error::Position(error) = measure.error {
            row.gap = error - h * row.rate(velocities);
            row.relaxed_gap = row.gap;
        }
    }
    predict_couplings(couplings, bodies, states, velocities, h);
}

/// The number of rows of a joint; that of its motor is the last one.
pub fn row_count(joint: &Joint) -> usize {
    let held = match joint.kind {
        JointKind::Weld => 6,
        JointKind::Ball => 3,
        JointKind::Hinge | JointKind::Slider => 5,
    };
    let limits = match (joint.limits, joint.kind) {
        (None, _) => 0,
        (Some(_), JointKind::Ball) => 1,
        (Some(_), _) => 2,
    };
    let JointResistance { damping, friction, armature } = joint.resistance;
    let resisting = [damping, friction, armature].into_iter().filter(|part| *part > 0.0).count();
    held + limits + resisting + usize::from(joint.motor.is_some())
}

/// The measures of a joint. Their number depends on the joint alone. The angle of a hinge is the
/// one of all turns that is nearest to `near`. `before` is the rate of its coordinate at the
/// beginning of the step.
fn measures(joint: &Joint, poses: [Pose; 2], near: f64, before: f64, h: f64) -> Vec<Measure> {
    let [a, b] = joint.frames_in_world(poses);
    let [x, y, z] = axes(a);
    let (way, turn) = (b.translation - a.translation, rotation_between(a, b));
    let rigid = |direction, error| Measure {
        direction,
        error: Error::Position(error),
        bounds: FREE,
        stiffness: None,
        resistance: Resistance::Rigid,
    };
    let along = |d: DVec3| rigid(Direction::Along(d), d.dot(way));
    let about = |d: DVec3, turn: DVec3| rigid(Direction::About(d), d.dot(turn));
    let mut found = match joint.kind {
        JointKind::Weld => vec![along(x), along(y), along(z), about(x, turn), about(y, turn), about(z, turn)],
        JointKind::Ball => vec![along(x), along(y), along(z)],
        JointKind::Hinge => {
            let swing = swing(a, b);
            vec![along(x), along(y), along(z), about(x, swing), about(y, swing)]
        }
        JointKind::Slider => vec![along(x), along(y), about(x, turn), about(y, turn), about(z, turn)],
    };
    let coordinate = match joint.kind {
        JointKind::Hinge => nearest_turn(joint.coordinate(poses), near),
        _ => joint.coordinate(poses),
    };
    let axis = match joint.kind {
        JointKind::Slider => Direction::Along(z),
        JointKind::Hinge | JointKind::Weld => Direction::About(z),
        JointKind::Ball => Direction::About(swing(a, b).try_normalize().unwrap_or(x)),
    };
    if let Some([low, high]) = joint.limits {
        let push = |error, bounds| Measure { bounds, ..rigid(axis, error) };
        if joint.kind != JointKind::Ball {
            found.push(push(coordinate - low, PUSHES));
        }
        found.push(push(coordinate - high, [f64::NEG_INFINITY, 0.0]));
    }
    let JointResistance { damping, friction, armature } = joint.resistance;
    let resists = |error, bounds, stiffness, resistance| {
        let error = Error::Rate(error);
        Measure { direction: axis, error, bounds, stiffness, resistance }
    };
    if damping > 0.0 {
        found.push(resists(0.0, FREE, Some(damping / h), Resistance::Spring));
    }
    if friction > 0.0 {
        found.push(resists(0.0, [-friction, friction], None, Resistance::Rigid));
    }
    if armature > 0.0 {
        // Its force a (q̇₀ − q̇) / h is that of a damper that aims at the rate at the beginning.
        found.push(resists(before, FREE, Some(armature / (h * h)), Resistance::Spring));
    }
    if let Some(motor) = joint.motor {
        let limit = [-motor.limit, motor.limit];
        let from = |target: f64| match joint.kind {
            JointKind::Hinge => wrapped(coordinate - target),
            _ => coordinate - target,
        };
        let (error, bounds, stiffness, resistance) = match motor.drive {
            Drive::Velocity(rate) => (Error::Rate(rate), limit, None, Resistance::Rigid),
            Drive::Position(target) => (Error::Position(from(target)), limit, None, Resistance::Rigid),
            Drive::Force(force) => {
                let force = force.clamp(-motor.limit, motor.limit);
                (Error::Rate(0.0), [force; 2], None, Resistance::Rigid)
            }
            // k (x + h ẋ) + d (ẋ − u) − f = (k h + d) (ẋ + (k x − d u − f) / (k h + d)), at the end
            // of the step.
            Drive::Spring { rest, stiffness: k, damping: d, velocity, force } => {
                let rate = (d * velocity + force - k * from(rest)) / (k * h + d);
                (Error::Rate(rate), limit, Some(k + d / h), Resistance::Spring)
            }
        };
        found.push(Measure { direction: axis, error, bounds, stiffness, resistance });
    }
    found
}

fn row(joint: &Joint, measure: Measure, point: DVec3, bodies: &Bodies<'_>, h: f64) -> Row {
    let Bodies { system, free_of, .. } = *bodies;
    let jacobian = |center: DVec3| match measure.direction {
        Direction::Along(d) => pack(d, (point - center).cross(d)),
        Direction::About(d) => pack(DVec3::ZERO, d),
    };
    // The rate that kinematic bodies add.
    let (mut rate, mut arms) = (0.0, [DVec3::ZERO; 2]);
    let sides = [(0, Some(joint.child), 1.0), (1, joint.parent, -1.0)].map(|(k, body, sign)| {
        let body = body?;
        let state = &system.states()[body];
        match system.bodies()[body].mass {
            Mass::Fixed => None,
            Mass::Kinematic => {
                let velocity = pack(state.linear, state.angular);
                rate += sign * jacobian(state.pose.translation).dot(&velocity);
                None
            }
            Mass::Free(mass) => {
                let center = state.pose.to_world(mass.center);
                arms[k] = point - center;
                Some((free_of[body]?, sign * jacobian(center)))
            }
        }
    });
    let gap = match measure.error {
        Error::Position(error) => error + h * rate,
        Error::Rate(target) => h * (rate - target),
    };
    Row {
        id: RowId::Joint(0),
        sides,
        coupled: Vec::new(),
        point,
        arms,
        gap,
        relaxed_gap: gap,
        stiffness: Stiffness::Absolute(measure.stiffness.unwrap_or(0.0)),
        bounds: measure.bounds,
        resistance: measure.resistance,
        friction: None,
    }
}
