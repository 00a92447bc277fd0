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
