//! How far the points of a link can move while joints move.
//!
//! `docs/math.md`, section 20, has the proof.
use tesdf::collide::{Pose, Shape};
use tesdf::glam::DVec3;

use super::kinematics::Chain;

/// A body is within `radius` of the convex hull of points.
#[derive(Clone, Debug)]
pub(super) struct Hull {
    /// In the frame of a link.
    points: Vec<DVec3>,
    radius: f64,
}

impl Hull {
    /// The hull of a shape that has a pose in the frame of a link.
    pub fn new(shape: &Shape, pose: Pose) -> Self {
        let (points, radius) = match shape {
            Shape::Sphere { radius } => (vec![DVec3::ZERO], *radius),
            Shape::Capsule { half_height, radius } => {
                (vec![DVec3::new(0.0, 0.0, *half_height), DVec3::new(0.0, 0.0, -half_height)], *radius)
            }
            _ => {
                let bounds = shape.bounds();
                let corner = |k: usize| {
                    let side = |axis: usize| if k >> axis & 1 == 1 { bounds.max } else { bounds.min };
                    DVec3::new(side(0).x, side(1).y, side(2).z)
                };
                ((0..8).map(corner).collect(), 0.0)
            }
        };
        Self { points: points.into_iter().map(|p| pose.to_world(p)).collect(), radius }
    }

    /// The same, with its points in the world.
    pub fn placed(&self, pose: Pose) -> Self {
        Self { points: self.points.iter().map(|&p| pose.to_world(p)).collect(), ..*self }
    }

    /// The greatest value, on the body, of a convex function that changes by at most the distance.
    pub fn greatest(&self, of: impl Fn(DVec3) -> f64) -> f64 {
        self.points.iter().map(|&p| of(p)).fold(0.0, f64::max) + self.radius
    }
}

/// Bound of the way of all points of a body, relative to the frame before `joints`, while the
/// coordinate of each joint moves by at most `ways`. Links have `poses` at some moment of the motion,
/// and there the body has the `hull` in the world.
pub(super) fn way(
    chain: &Chain,
    poses: &[Pose],
    joints: &[usize],
    hull: &Hull,
    ways: impl Fn(usize) -> f64,
) -> f64 {
    let mut way = 0.0;
    // A point of the axis of the joint behind, and a bound of the distance of the body from it.
    let mut behind: Option<(DVec3, f64)> = None;
    for &joint in joints.iter().rev() {
        let axis = chain.axis(joint, poses);
        if chain.joints[joint].slides {
            way += ways(joint);
            behind = behind.map(|(p, reach)| (p, reach + ways(joint)));
            continue;
        }
        let mut from_axis = hull.greatest(|p| axis.distance(p)) + way;
        let mut from_point = hull.greatest(|p| axis.point.distance(p)) + way;
        if let Some((p, reach)) = behind {
            from_axis = from_axis.min(axis.distance(p) + reach);
            from_point = from_point.min(axis.point.distance(p) + reach);
        }
        way += ways(joint) * from_axis;
        behind = Some((axis.point, from_point));
    }
    way
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{Base, Link, Motion, Robot as Description, RobotJoint};
    use tesdf::glam::DQuat;

    /// A chain of joints in random places, each of which moves a link.
    fn chain(random: &mut fastrand::Rng, joints: usize) -> Chain {
        let mut vector = |size: f64| DVec3::from_array([0; 3].map(|_| size * (2.0 * random.f64() - 1.0)));
        let links = (0..=joints).map(|k| {
            let rotation = DQuat::from_rotation_arc(DVec3::Z, vector(1.0).normalize());
            let joint = RobotJoint {
                name: format!("{k}"),
                parent: k.saturating_sub(1),
                motion: if k % 3 == 2 { Motion::Slider } else { Motion::Hinge },
                pose: Pose { translation: vector(0.5), rotation },
                anchor: vector(0.2),
                axis: vector(1.0),
                limits: None,
                damping: 0.0,
                friction: 0.0,
                armature: 0.0,
                effort: None,
            };
            let root = Base::Root { pose: Pose::IDENTITY, is_fixed: Some(true) };
            Link {
                name: format!("{k}"),
                place: String::new(),
                base: if k == 0 { root } else { Base::Joint(joint) },
                mass: None,
                collisions: Vec::new(),
                friction: None,
                friction_torsional: None,
                groups: [1; 2],
            }
        });
        let file = Description { links: links.collect(), ..Description::default() };
        Chain::new(&file, Pose::IDENTITY, &[]).unwrap()
    }

    #[test]
    fn no_point_goes_farther_than_the_bound() {
        let mut random = fastrand::Rng::with_seed(2);
        let (mut most, mut greater) = (0.0_f64, 0);
        for case in 0..300 {
            let joints = 1 + case % 6;
            let chain = chain(&mut random, joints);
            let shape = Shape::Box { half_extents: DVec3::new(0.1, 0.05, 0.2) };
            let hull = Hull::new(&shape, Pose::at(DVec3::new(0.1, 0.0, 0.3)));
            let size = [0.01, 0.3, 3.0][case % 3];
            let mut number = |size: f64| size * (2.0 * random.f64() - 1.0);
            let middle: Vec<f64> = (0..joints).map(|_| number(3.0)).collect();
            let speed: Vec<f64> = (0..joints).map(|_| number(size)).collect();
            let poses = chain.poses(&middle);
            let placed = hull.placed(poses[joints]);
            let bound = way(&chain, &poses, &chain.above[joints], &placed, |k| speed[k].abs());
            let mut moved = 0.0_f64;
            for k in -40..=40 {
                let t = f64::from(k) / 40.0;
                let q: Vec<f64> = middle.iter().zip(&speed).map(|(q, v)| q + t * v).collect();
                let there = hull.placed(chain.poses(&q)[joints]);
                let ways = there.points.iter().zip(&placed.points).map(|(p, q)| p.distance(*q));
                moved = ways.fold(moved, f64::max);
            }
            assert!(moved <= bound * (1.0 + 1e-12), "{case}: {moved} {bound}");
            most = most.max(moved / bound);
            greater += usize::from(bound > 20.0 * moved);
        }
        // The bound is attained by one joint, and is never absurd.
        assert!(most > 0.99 && greater < 10, "{most} {greater}");
    }
}
