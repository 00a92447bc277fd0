//! How long two parts of moving surfaces certainly stay apart, by a plane between them. Proof:
//! `docs/math.md`, section 17.
use std::iter::once;

use glam::DVec3;

use crate::collide::time_of_impact::gjk::separation;
use crate::collide::time_of_impact::moving::{BodyAt, PartAt};
use crate::geometry::polygon_to_triangle;

/// What is known of two parts at a time.
#[derive(Clone, Copy, Debug)]
pub struct Parting {
    /// Lower bound of their distance. Of faces, the distance; beside a simple shape, at most
    /// [`RELATIVE_ERROR`](crate::collide::time_of_impact::gjk::RELATIVE_ERROR) of it more.
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
            match least_distance(parts, self.radius) {
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
        let (_, n) = least_distance(parts, 0.0)?;
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

/// The distance of two parts and the direction from the second to the first: of faces exact, beside a
/// simple shape nearly. `None` of others, and of simple shapes that touch.
fn least_distance(parts: &[PartAt; 2], radius: f64) -> Option<(f64, DVec3)> {
    let [a, b] = parts;
    if let (Some(points), Some(first), Some(second)) = (a.points(), a.triangle(), b.triangle()) {
        let (_, at) = polygon_to_triangle(points, first.normal, &second, f64::INFINITY)?;
        let closest = second.closest(at);
        return Some((closest.distance, (at - closest.point).normalize_or_zero()));
    }
    if !(a.is_simple || b.is_simple) {
        return None;
    }
    separation(radius, |m| a.support(m) - b.support(-m))
}

/// Directions near `n`, the one between the nearest points of two faces, which is rough where these
/// are only some rounding errors apart. What faces hold between them is perpendicular to their
/// edges: to one from a vertex to an edge, to two between edges. Faces have their normals.
fn across_edges(parts: &[PartAt; 2], n: DVec3) -> impl Iterator<Item = DVec3> {
    let [a, b] = [0, 1].map(|k| parts[k].edges());
    let to_edge = a.clone().into_iter().chain(b.clone()).map(move |edge| n.reject_from_normalized(edge));
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
    use std::sync::Arc;

    use super::*;
    use crate::TeSdf;
    use crate::collide::clearance::{Body, Pair};
    use crate::collide::scene::Velocity;
    use crate::collide::scene::ids::InstanceId;
    use crate::collide::scene::motion::Motion;
    use crate::collide::scene::pose::{Placement, Pose};
    use crate::collide::scene::shape::Shape;
    use crate::collide::time_of_impact::gjk::RELATIVE_ERROR;
    use crate::collide::time_of_impact::moving::{MovingBody, MovingPart};
    use crate::encode::{Encoder, Preset};
    use crate::mesh::{MeshFormat, SolidMesh, read_bytes};
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

    const KEPT: f64 = 0.01;

    /// How often a free time was told, and how often it was nearly that until the parts are near.
    #[derive(Default)]
    struct Told {
        free: u32,
        reached: u32,
    }

    impl Told {
        /// Compares what is told of two parts with their distance, of which `None` is not known.
        fn check(
            &mut self,
            bodies: &[MovingBody; 2],
            parts: [MovingPart; 2],
            distance: impl Fn(f64) -> Option<f64>,
        ) {
            let start = 0.2;
            let pair = PairAt { bodies: [0, 1].map(|k| bodies[k].at(start)), radius: RADIUS, time: start };
            let places = [0, 1].map(|k| pair.bodies[k].part(parts[k]));
            let found = pair.parting(&places, KEPT, 20.0);
            let until = found.free.min(20.0);
            self.free += u32::from(found.free > 0.0);
            for k in 0..=20 {
                let Some(now) = distance(start + until * f64::from(k) / 20.0) else { continue };
                assert!(
                    k > 0 || found.distance <= now + RELATIVE_ERROR * now.abs() + EXACT,
                    "{parts:?}: {now}, {found:?}"
                );
                assert!(found.free == 0.0 || now >= KEPT - EXACT, "{parts:?}, {k}: {now}, {found:?}");
                self.reached += u32::from(k == 20 && found.free < 20.0 && now < 4.0 * KEPT);
            }
        }
    }

    const RADIUS: f64 = 0.1;
    const EXACT: f64 = 1e-9;
    const SCALE: f64 = 0.8;

    const BOX: DVec3 = DVec3::new(1.0, 2.0, 0.5);

    fn places() -> [Pose; 2] {
        [
            Pose { translation: DVec3::new(3.0, 0.5, 0.2), rotation: DQuat::from_rotation_y(1.1) },
            Pose { translation: DVec3::ZERO, rotation: DQuat::from_rotation_x(0.4) },
        ]
    }

    fn placed(shape: &Shape, k: usize, pose: Pose) -> Body<'_> {
        Body { id: InstanceId(k as u32), shape, placement: Placement { pose, scale: SCALE } }
    }

    /// The faces of a box of side 2.
    fn cube() -> TeSdf {
        let obj = "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n\
                   f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
        let mesh = read_bytes(obj.as_bytes(), MeshFormat::Obj).expect("a mesh").mesh;
        let solid = SolidMesh::new(mesh).expect("a solid");
        Encoder::new().preset(Preset::Fast).encode(&solid).expect("an asset")
    }

    #[test]
    fn parts_stay_apart_for_the_time_that_is_told() {
        let mesh = Shape::Mesh(Arc::new(cube()));
        let mut told = Told::default();
        for motions in motions().into_iter().flat_map(|a| motions().map(|b| [a, b])) {
            let bodies = [0, 1].map(|k| {
                MovingBody::new(&placed(&mesh, k, places()[k]), motions[k], DVec3::X).expect("a motion")
            });
            for (first, second) in (0..12).flat_map(|i| (0..12).map(move |j| (i, j))) {
                let [first, second] = [first, second].map(MovingPart::Face);
                let distance = |time: f64| {
                    let places = [bodies[0].at(time).part(first), bodies[1].at(time).part(second)];
                    Some(least_distance(&places, 0.0)?.0 - RADIUS)
                };
                for parts in
                    [[first, second], [first, MovingPart::Whole], [MovingPart::Whole, MovingPart::Whole]]
                {
                    told.check(&bodies, parts, distance);
                }
            }
        }
        // Often, it is nearly the time at which they meet.
        assert!(told.free > 2000 && told.reached > 20, "{} {}", told.free, told.reached);
    }

    #[test]
    fn simple_shapes_stay_apart_for_the_time_that_is_told() {
        let shapes = [
            Shape::Box { half_extents: BOX },
            Shape::Cylinder { half_height: 0.1, radius: 1.5 },
            Shape::Cylinder { half_height: 2.0, radius: 0.3 },
            Shape::Mesh(Arc::new(cube())),
        ];
        let mut told = Told::default();
        for motions in motions().into_iter().flat_map(|a| motions().map(|b| [a, b])) {
            for (first, second) in (0..3).flat_map(|i| (0..4).map(move |j| (i, j))) {
                let at = |time: f64| {
                    [(0, first), (1, second)].map(|(k, shape): (usize, usize)| {
                        placed(&shapes[shape], k, motions[k].pose_at(places()[k], time))
                    })
                };
                let bodies = at(0.0)
                    .each_ref()
                    .map(|body| MovingBody::new(body, motions[body.id.0 as usize], DVec3::X));
                let bodies = bodies.map(|body| body.expect("a motion"));
                // The surface of a mesh may be inside, where nothing is told.
                let distance = |time: f64| {
                    let [a, b] = at(time);
                    Some(Pair { a, b }.apart(1e-10).ok()?.distance - RADIUS)
                };
                told.check(&bodies, [MovingPart::Simple, bodies[1].whole()], distance);
            }
        }
        assert!(told.free > 150 && told.reached > 5, "{} {}", told.free, told.reached);
    }
}
