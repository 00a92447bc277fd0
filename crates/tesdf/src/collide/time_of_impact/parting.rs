//! How long two parts of moving surfaces certainly stay apart, by a plane between them. Proof:
//! `docs/math.md`, section 17.
use std::iter::once;

use arrayvec::ArrayVec;
use glam::DVec3;

use crate::collide::time_of_impact::moving::{BodyAt, PartAt};
use crate::geometry::polygon_to_triangle;

/// What is known of two parts at a time.
#[derive(Clone, Copy, Debug)]
pub struct Parting {
    /// Lower bound of their distance. Of faces, the distance.
    pub distance: f64,
    /// For this time, they stay farther apart than the kept distance.
    pub free: f64,
    /// How far points of the one can move against points of the other in this time.
    pub way: f64,
}

/// Relative error of places and speeds, with a margin.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Number of halvings after which a free time is as good as the last one: what is left of a gap that
/// closes falls to an eighth at each look.
const HALVINGS: u32 = 3;

/// Two bodies at a time.
pub struct PairAt<'a> {
    /// The bodies. Only the second one can be a plane.
    pub bodies: [BodyAt<'a>; 2],
    /// The surfaces lie within this distance of their parts, both together.
    pub radius: f64,
    /// The time.
    pub time: f64,
}

impl PairAt<'_> {
    /// For how long two parts certainly stay farther apart than `kept`, of interest up to `horizon`.
    pub fn parting(&self, parts: &[PartAt; 2], kept: f64, horizon: f64) -> Parting {
        let [(speed_a, bend_a), (speed_b, bend_b)] = [0, 1].map(|k| self.bodies[k].rotation(&parts[k]));
        let [a, b] = &self.bodies;
        let bound = Bound {
            speed: ((a.drift() - b.drift()).length() + speed_a + speed_b) * (1.0 + 1e-12),
            bend: (bend_a + bend_b) * (1.0 + 1e-12),
        };
        let turned = self.time * (speed_a + speed_b);
        let rounding = ROUNDING * (a.size(&parts[0]) + b.size(&parts[1]) + turned);
        let mut found = Parting { distance: f64::NEG_INFINITY, free: 0.0, way: 0.0 };
        let mut best = None;
        let mut offer = |n: DVec3| {
            let gap = self.gap(parts, n);
            let now = gap.after(0.0);
            found.distance = found.distance.max(now);
            let free = bound.time(now - kept - rounding, gap.closing());
            if free > found.free {
                (found.free, best) = (free, Some(gap));
            }
            free
        };
        if let Some(normal) = b.plane_normal() {
            offer(normal);
        } else {
            let between = parts[0].center - parts[1].center;
            for n in parts[0].axes().chain(parts[1].axes()) {
                offer(towards(between, n));
            }
            match least_distance(parts) {
                Some((distance, n)) => {
                    if offer(n) == 0.0 {
                        across_edges(parts, n).for_each(|n| _ = offer(n));
                    }
                    found.distance = distance - self.radius;
                }
                None => _ = offer(between.normalize_or_zero()),
            }
        }
        if let Some(gap) = best.filter(|_| found.free < horizon) {
            let left = |t| gap.after(t) - kept - rounding - 0.5 * bound.bend * t * t;
            found.free = longest(found.free, horizon, left);
        }
        found.way = bound.speed * found.free;
        found
    }

    /// The direction along which the gap of two faces is greatest, from the second to the first. It
    /// is exact where they nearly touch. `None` of other parts, rounded ones and a plane.
    pub fn direction(&self, parts: &[PartAt; 2]) -> Option<DVec3> {
        if self.radius > 0.0 || self.bodies[1].plane_normal().is_some() {
            return None;
        }
        let (_, n) = least_distance(parts)?;
        let axes = parts[0].axes().chain(parts[1].axes());
        let axes = axes.map(|axis| towards(n, axis));
        let gap = |n: &DVec3| self.gap(parts, *n).after(0.0);
        once(n).chain(axes).chain(across_edges(parts, n)).max_by(|m, n| gap(m).total_cmp(&gap(n)))
    }

    /// The gap of two parts along `n`, which is about from the second to the first.
    fn gap<'a>(&self, parts: &'a [PartAt; 2], n: DVec3) -> Gap<'a> {
        let sides = [(0, n), (1, -n)];
        let turning = sides.map(|(k, n)| n.cross(self.bodies[k].spin(&parts[k])));
        let speeds = sides.map(|(k, n)| self.bodies[k].speed(&parts[k], n));
        let errors = [0, 1].map(|k| {
            let body = &self.bodies[k];
            ROUNDING * (body.drift().length() + body.rotation_rate() * body.size(&parts[k]))
        });
        Gap { parts, n, turning, speeds, errors, radius: self.radius }
    }
}

/// The gap between two parallel planes that `n` is perpendicular to: the first part is beyond the
/// one, the second part before the other.
struct Gap<'a> {
    parts: &'a [PartAt; 2],
    n: DVec3,
    /// By this, `n` and `-n` turn against each part per unit of time, at first.
    turning: [DVec3; 2],
    /// The speeds of the middles of the parts along `n` and `-n` now, and their errors.
    speeds: [f64; 2],
    errors: [f64; 2],
    radius: f64,
}

impl Gap<'_> {
    /// Lower bound after the time `t`, apart from accelerations. A concave function of the time, and
    /// the gap itself at 0.
    fn after(&self, t: f64) -> f64 {
        let Self { parts: [a, b], n, turning, .. } = self;
        let opening = (self.speeds[0] - self.errors[0]) + (self.speeds[1] - self.errors[1]);
        let widths = a.half_width(*n + t * turning[0]) + b.half_width(-*n + t * turning[1]);
        n.dot(a.center - b.center) + t * opening - widths - self.radius
    }

    /// Upper bound of the speed at which it closes now. Negative when it grows.
    fn closing(&self) -> f64 {
        let of_part = |k: usize| self.errors[k] + self.parts[k].half_width(self.turning[k]) - self.speeds[k];
        of_part(0) + of_part(1)
    }
}

/// A time up to `horizon`, and near the last one, until which `left` is not negative. It is concave
/// and positive at 0. Not less than `known`, a time of which the same is known.
fn longest(known: f64, horizon: f64, left: impl Fn(f64) -> f64) -> f64 {
    // With a margin for rounding.
    let is_free = |t: f64| left(t * (1.0 + 1e-12)) >= 0.0;
    if is_free(horizon) {
        return horizon;
    }
    let (mut free, mut beyond) = (known, 2.0 * known);
    while beyond < horizon && is_free(beyond) {
        (free, beyond) = (beyond, 2.0 * beyond);
    }
    beyond = beyond.min(horizon);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (free + beyond);
        if is_free(middle) {
            free = middle;
        } else {
            beyond = middle;
        }
    }
    free
}

/// The distance of two faces and the direction from the second to the first. `None` for other
/// parts.
fn least_distance(parts: &[PartAt; 2]) -> Option<(f64, DVec3)> {
    let [first, triangle] = [parts[0].triangle()?, parts[1].triangle()?];
    let points = parts[0].points()?;
    let (_, at) = polygon_to_triangle(points, first.normal, &triangle, f64::INFINITY)?;
    let closest = triangle.closest(at);
    Some((closest.distance, (at - closest.point).normalize_or_zero()))
}

/// Directions near `n`, the one between the nearest points of two faces, which is rough where these
/// are only some rounding errors apart. What faces hold between them is perpendicular to their
/// edges: to one from a vertex to an edge, to two between edges. Faces have their normals.
fn across_edges(parts: &[PartAt; 2], n: DVec3) -> impl Iterator<Item = DVec3> {
    let edges = [0, 1].map(|k| {
        let points = parts[k].points().unwrap_or_default();
        let edge = move |i: usize| (points[(i + 1) % points.len()] - points[i]).try_normalize();
        (0..points.len()).filter_map(edge).collect::<ArrayVec<DVec3, 3>>()
    });
    let [a, b] = edges.clone();
    let to_edge = edges.into_iter().flatten().map(move |edge| n.reject_from_normalized(edge));
    let between = a.into_iter().flat_map(move |a| b.clone().into_iter().map(move |b| a.cross(b)));
    let near = move |m: DVec3| {
        let m = towards(n, m.try_normalize()?);
        (m.dot(n) > NEAR).then_some(m)
    };
    to_edge.chain(between).filter_map(near)
}

/// `m` or `-m`, whichever does not look against `n`.
fn towards(n: DVec3, m: DVec3) -> DVec3 {
    if m.dot(n) < 0.0 { -m } else { m }
}

/// Cosine of the angle by which a rough direction may be off.
const NEAR: f64 = 0.99;

/// Bounds of the motion of the points of one part against those of another.
struct Bound {
    /// Their speed at any time.
    speed: f64,
    /// Their acceleration.
    bend: f64,
}

impl Bound {
    /// For how long a gap that closes at the speed `closing` now certainly does not close.
    fn time(&self, gap: f64, closing: f64) -> f64 {
        if gap.is_nan() || gap <= 0.0 {
            return 0.0;
        }
        // closing · t + bend / 2 · t² ≤ gap
        let root = (closing * closing + 2.0 * self.bend * gap).sqrt();
        let curved = if closing > 0.0 {
            2.0 * gap / (closing + root)
        } else if self.bend > 0.0 {
            (root - closing) / self.bend
        } else {
            f64::INFINITY
        };
        // With a margin for rounding.
        curved.max(gap / self.speed) * (1.0 - 1e-12)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::clearance::Body;
    use crate::collide::scene::Velocity;
    use crate::collide::scene::ids::InstanceId;
    use crate::collide::scene::motion::Motion;
    use crate::collide::scene::pose::{Placement, Pose};
    use crate::collide::scene::shape::Shape;
    use crate::collide::time_of_impact::moving::{MovingBody, MovingPart};
    use glam::DQuat;

    fn motions() -> [Motion; 5] {
        [
            Motion::Rest,
            Motion::Linear {
                velocity: Velocity { linear: DVec3::new(1.0, -0.7, 0.4), angular: DVec3::ZERO },
            },
            Motion::Linear {
                velocity: Velocity {
                    linear: DVec3::new(-0.4, 0.2, 0.5),
                    angular: DVec3::new(0.2, 0.7, -0.4),
                },
            },
            Motion::About {
                point: DVec3::new(1.0, 0.5, -0.3),
                velocity: Velocity {
                    linear: DVec3::new(0.3, -0.6, 0.1),
                    angular: DVec3::new(-0.5, 0.4, 0.6),
                },
            },
            Motion::Screw {
                point: DVec3::new(0.0, 1.0, 0.0),
                axis: DVec3::ONE,
                angular_speed: 1.5,
                pitch: 2.0,
            },
        ]
    }

    #[test]
    fn parts_stay_apart_for_the_time_that_is_told() {
        let shape = Shape::Box { half_extents: DVec3::new(1.0, 2.0, 0.5) };
        let places = [
            Pose { translation: DVec3::new(3.0, 0.5, 0.2), rotation: DQuat::from_rotation_y(1.1) },
            Pose { translation: DVec3::ZERO, rotation: DQuat::from_rotation_x(0.4) },
        ];
        let kept = 0.01;
        let (mut reached, mut told) = (0, 0);
        for [a, b] in motions().into_iter().flat_map(|a| motions().map(|b| [a, b])) {
            let [a, b] = [(0, a), (1, b)].map(|(k, motion)| {
                let placement = Placement { pose: places[k], scale: 0.8 };
                let body = Body { id: InstanceId(k as u32), shape: &shape, placement };
                MovingBody::new(&body, motion, DVec3::X, 1e-6).expect("a motion")
            });
            let pair = |time: f64| PairAt { bodies: [a.at(time), b.at(time)], radius: 0.1, time };
            for (first, second) in (0..12).flat_map(|i| (0..12).map(move |j| (i, j))) {
                for parts in [
                    [MovingPart::Face(first), MovingPart::Face(second)],
                    [MovingPart::Face(first), MovingPart::Whole],
                    [MovingPart::Whole, MovingPart::Whole],
                ] {
                    let start = 0.2;
                    let parting = |time: f64| {
                        let pair = pair(time);
                        pair.parting(&[0, 1].map(|k| pair.bodies[k].part(parts[k])), kept, 20.0)
                    };
                    let faces = |time: f64| {
                        let pair = pair(time);
                        let places = [MovingPart::Face(first), MovingPart::Face(second)];
                        let places = [0, 1].map(|k| pair.bodies[k].part(places[k]));
                        least_distance(&places).expect("faces").0 - pair.radius
                    };
                    let Parting { free, distance, .. } = parting(start);
                    assert!(distance <= faces(start) + 1e-12);
                    let until = free.min(20.0);
                    told += usize::from(free > 0.0);
                    for k in 0..=20 {
                        let gap = faces(start + until * f64::from(k) / 20.0);
                        assert!(gap >= kept - 1e-12, "{parts:?} {k} of {free}: {gap}");
                        reached += usize::from(k == 20 && free < 20.0 && gap < 4.0 * kept);
                    }
                }
            }
        }
        // Often, it is nearly the time at which they meet.
        assert!(told > 2000 && reached > 20, "{told} {reached}");
    }
}
