//! Converts couplings of joints to rows of the convex problem.
//!
//! A coupling is a row like those of joints (`joints.rs`), with the bodies of both joints. It has
//! nothing to do with the velocity of one body relative to another one, so it has a group of its
//! own (`group.rs`).
use glam::DVec3;
use nalgebra::Vector6;
use tesdf::collide::Pose;

use super::integrate::pack;
use super::rows::{Bodies, Resistance, Row, RowId, Stiffness};
use crate::joint::{axes, nearest_turn};
use crate::{Coupling, Joint, JointKind, Mass, State, System};

/// A derivative that is smaller by this factor than what it is the sum of is zero: of a body about
/// whose axis both joints turn.
const NOTHING: f64 = 1e-12;

/// The rows of all couplings, at the poses of the beginning of the step.
pub fn coupling_rows(bodies: &Bodies<'_>, h: f64) -> Vec<Row> {
    let system = bodies.system;
    let row = |coupling: &Coupling| {
        let coordinates = system.coordinates();
        row(coupling, coordinates[coupling.joint] - coupling.target(coordinates), bodies, h)
    };
    system.couplings().iter().map(row).collect()
}

/// Sets the gaps of `rows`, which are those of all couplings, to the errors at the `states` that
/// `velocities` lead to.
pub fn predict_couplings(
    rows: &mut [Row],
    bodies: &Bodies<'_>,
    states: &[State],
    velocities: &[Vector6<f64>],
    h: f64,
) {
    for (row, error) in rows.iter_mut().zip(coupling_errors(bodies.system, states, h)) {
        row.gap = error - h * row.rate(velocities);
        row.relaxed_gap = row.gap;
    }
}

/// How far each coupling is from holding at `states`, rad or m, after a motion of `time` seconds
/// from the states of the system with the velocities of `states`.
pub fn coupling_errors(system: &System, states: &[State], time: f64) -> impl Iterator<Item = f64> {
    let coordinate = move |k: usize| {
        let joint = &system.joints()[k];
        let coordinate = joint.coordinate(System::poses_of(joint, states));
        match joint.kind {
            JointKind::Hinge => {
                let near = system.coordinates()[k] + time * system.rate_of(joint, states);
                nearest_turn(coordinate, near)
            }
            JointKind::Slider | JointKind::Weld | JointKind::Ball => coordinate,
        }
    };
    let error = move |coupling: &Coupling| {
        let Coupling { joint, of, ratio, offset } = *coupling;
        coordinate(joint) - ratio * coordinate(of) - offset
    };
    system.couplings().iter().map(error)
}

fn row(coupling: &Coupling, error: f64, bodies: &Bodies<'_>, h: f64) -> Row {
    let Bodies { system, free_of, .. } = *bodies;
    // The rate that kinematic bodies add.
    let mut rate = 0.0;
    let mut coupled: Vec<(usize, Vector6<f64>)> = Vec::with_capacity(4);
    let mut greatest = 0.0;
    for (joint, share) in [(coupling.joint, 1.0), (coupling.of, -coupling.ratio)] {
        let joint = &system.joints()[joint];
        for (body, sign) in [(Some(joint.child), share), (joint.parent, -share)] {
            let Some(body) = body else { continue };
            let state = &system.states()[body];
            match system.bodies()[body].mass {
                Mass::Fixed => {}
                Mass::Kinematic => {
                    let jacobian = sign * derivative(joint, system, state.pose.translation);
                    rate += jacobian.dot(&pack(state.linear, state.angular));
                }
                Mass::Free(mass) => {
                    let Some(free) = free_of[body] else { continue };
                    let jacobian = sign * derivative(joint, system, state.pose.to_world(mass.center));
                    greatest = f64::max(greatest, jacobian.norm());
                    match coupled.iter_mut().find(|(other, _)| *other == free) {
                        Some((_, sum)) => *sum += jacobian,
                        None => coupled.push((free, jacobian)),
                    }
                }
            }
        }
    }
    coupled.retain(|(_, jacobian)| jacobian.norm() > NOTHING * greatest);
    coupled.sort_by_key(|(free, _)| *free);
    let gap = error + h * rate;
    Row {
        id: RowId::Joint(0),
        sides: [None; 2],
        coupled,
        point: DVec3::ZERO,
        arms: [DVec3::ZERO; 2],
        gap,
        relaxed_gap: gap,
        stiffness: Stiffness::Absolute(0.0),
        bounds: [f64::NEG_INFINITY, f64::INFINITY],
        resistance: Resistance::Rigid,
        friction: None,
    }
}

/// The derivative of the coordinate of a joint by the velocity of its child with this centre of
/// mass; by that of its parent, it is the opposite.
fn derivative(joint: &Joint, system: &System, center: DVec3) -> Vector6<f64> {
    let [parent, child]: [Pose; 2] = joint.frames_in_world(System::poses_of(joint, system.states()));
    let [_, _, z] = axes(parent);
    match joint.kind {
        JointKind::Slider => pack(z, (child.translation - center).cross(z)),
        JointKind::Hinge | JointKind::Weld | JointKind::Ball => pack(DVec3::ZERO, z),
    }
}
