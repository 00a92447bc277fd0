//! Lower bounds of a clearance from boxes, before surfaces are searched.
use arrayvec::ArrayVec;
use glam::DVec3;

use crate::collide::bodies::field::FieldBody;
use crate::collide::clearance::{Body, Pair};
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::collide::scene::shape::Shape;

/// The box of a body, in the world.
#[derive(Clone, Copy)]
struct Boxed {
    center: DVec3,
    /// Unit vectors.
    axes: [DVec3; 3],
    half: [f64; 3],
}

/// Largest number of distances for a bound.
const MOST: usize = 32;
/// A part of a box is not divided further when its radius is this share of that of the box.
const SMALL: f64 = 0.05;
/// A bound that is this share of the distance of the centre of the box is good enough. That distance is
/// rarely below the clearance, so what is asked for may be out of reach; certified motions that are
/// long take a third of the time so (`examples/planning.rs` of `tesdf-sim`).
const NEAR: f64 = 0.5;

impl Boxed {
    /// `None` for a plane.
    fn new(Body { shape, placement, .. }: &Body) -> Option<Self> {
        if matches!(shape, Shape::Plane) {
            return None;
        }
        let bounds = shape.bounds();
        let center = placement.to_world(bounds.center());
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| placement.pose.rotation * axis);
        Some(Self { center, axes, half: (0.5 * placement.scale * bounds.extent()).to_array() })
    }

    /// Half of its extent along a unit vector.
    fn reach(&self, n: DVec3) -> f64 {
        (0..3).map(|k| self.half[k] * self.axes[k].dot(n).abs()).sum()
    }

    fn radius(&self) -> f64 {
        DVec3::from_array(self.half).length()
    }

    /// Distance of a point.
    fn distance(&self, p: DVec3) -> f64 {
        let beyond = |k: usize| (self.axes[k].dot(p - self.center).abs() - self.half[k]).max(0.0);
        DVec3::new(beyond(0), beyond(1), beyond(2)).length()
    }

    fn halves(&self) -> [Self; 2] {
        let most = |a: usize, b: usize| if self.half[b] > self.half[a] { b } else { a };
        let k = most(most(0, 1), 2);
        [-0.5, 0.5].map(|side| {
            let mut half = *self;
            half.center += side * self.half[k] * self.axes[k];
            half.half[k] *= 0.5;
            half
        })
    }

    /// Lower bound of the signed distances of its points in a field.
    fn least_in(&self, field: &FieldBody) -> f64 {
        let unit = field.unit();
        let center = field.to_field(self.center);
        unit * (field.least_within(center, self.radius() / unit) - field.half_thickness())
    }
}

impl Pair<'_> {
    /// Lower bound of the clearance from the boxes of the bodies; minus infinity where they overlap.
    pub(super) fn gap(&self) -> f64 {
        let gap = match (Boxed::new(&self.a), Boxed::new(&self.b)) {
            (Some(a), Some(b)) => {
                let between = b.center - a.center;
                let across = a.axes.iter().chain(&b.axes);
                let planes = across.map(|&n| n.dot(between).abs() - a.reach(n) - b.reach(n));
                let balls = [a.distance(b.center) - b.radius(), b.distance(a.center) - a.radius()];
                planes.chain(balls).fold(f64::NEG_INFINITY, f64::max)
            }
            (Some(body), None) => height(&self.b, &body),
            (None, Some(body)) => height(&self.a, &body),
            (None, None) => f64::NEG_INFINITY,
        };
        if gap > 0.0 { gap } else { f64::NEG_INFINITY }
    }

    /// Lower bound of the clearance from the box of one body in the field of the other one. It is
    /// refined until it is at least `enough`, or about half of the clearance. Minus infinity where it
    /// would not be above 0.
    pub(super) fn rough_bound(&self, enough: f64) -> f64 {
        // No point of one solid is near the other one, so none of its surface, and no surface of the
        // other one is within it.
        let first = self.with_fewer_faces();
        let Some(whole) = Boxed::new(self.body(first)) else { return f64::NEG_INFINITY };
        let field = self.field(first);
        let small = SMALL * whole.radius();
        let mut open: ArrayVec<(f64, Boxed), MOST> = ArrayVec::new();
        let least = whole.least_in(&field);
        let enough = enough.min(NEAR * (least + whole.radius()));
        open.push((least, whole));
        loop {
            let nearest = (0..open.len()).min_by(|&i, &j| open[i].0.total_cmp(&open[j].0)).unwrap_or(0);
            let (least, part) = open[nearest];
            if least >= enough || open.is_full() || part.radius() <= small {
                return if least > 0.0 { least } else { f64::NEG_INFINITY };
            }
            let [one, other] = part.halves();
            open[nearest] = (one.least_in(&field).max(least), one);
            open.push((other.least_in(&field).max(least), other));
        }
    }
}

/// A lower bound of the clearance of two instances, from boxes around parts of one of them, in some
/// microseconds. It is refined no further when it is at least `enough`, or about half of the clearance.
/// Minus infinity where nothing is known, as for bodies that touch.
///
/// # Errors
/// As [`clearance`](crate::collide::clearance()).
pub fn clearance_bound(
    scene: &Scene,
    a: InstanceId,
    b: InstanceId,
    enough: f64,
) -> Result<f64, CollideError> {
    let pair = Pair::new(scene, a, b)?;
    let gap = pair.gap();
    if gap >= enough {
        return Ok(gap);
    }
    pair.check_distances()?;
    Ok(gap.max(pair.rough_bound(enough)))
}

/// Height of a box over a plane.
fn height(Body { placement, .. }: &Body, body: &Boxed) -> f64 {
    let up = placement.pose.rotation * DVec3::Z;
    up.dot(body.center - placement.pose.translation) - body.reach(up)
}
