use glam::{DVec2, DVec3};

use crate::collide::scene::shape::Shape;
use crate::geometry::NearRay;

/// The first point at which a ray meets the surface of a shape, in the shape's frame and unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeHit {
    /// Distance along the ray, in lengths of its direction.
    pub t: f64,
    /// Outward unit normal of the surface.
    pub normal: DVec3,
    /// The face of an encoded mesh, by its id in the source mesh; `None` for other shapes.
    pub face: Option<u32>,
}

impl Shape {
    /// The first point of the surface that `origin + t · direction` meets for `t` in `[0, limit]`,
    /// from either side. In the shape's frame and unit.
    ///
    /// `None` when the ray meets nothing, is not finite or has no direction, or when `t` would be
    /// above [`f64::MAX`]. As in [`TeSdf::ray_cast`](crate::TeSdf::ray_cast), a ray that begins far
    /// out is first moved to where it comes near the shape.
    pub fn ray_cast(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<ShapeHit> {
        if let Self::Mesh(asset) = self {
            let hit = asset.ray_cast(origin, direction, limit)?;
            return Some(ShapeHit { t: hit.t, normal: hit.normal, face: Some(hit.face) });
        }
        if !origin.is_finite() || !direction.is_finite() || direction == DVec3::ZERO {
            return None;
        }
        if matches!(self, Self::Plane) {
            let t = -origin.z / direction.z;
            return (t.is_finite() && (0.0..=limit).contains(&t)).then_some(ShapeHit {
                t,
                normal: DVec3::Z,
                face: None,
            });
        }
        // From a near origin, squares of coordinates do not overflow.
        let ray = NearRay::new(origin, direction, DVec3::ZERO, self.diagonal())?;
        // The simple shapes are convex, so the ray's line is inside over one interval.
        let [enter, leave] = self.inside_of_line(ray.origin, ray.direction)?;
        let rest = ray.rest_of(limit);
        let t = [enter, leave].into_iter().find(|t| (0.0..=rest).contains(t))?;
        let normal = self.normal_at(ray.origin + t * ray.direction);
        Some(ShapeHit { t: ray.total(t)?, normal, face: None })
    }

    /// The parameters at which the line enters and leaves a shape.
    fn inside_of_line(&self, from: DVec3, along: DVec3) -> Option<[f64; 2]> {
        match *self {
            Self::Mesh(_) | Self::Plane => None,
            Self::Box { half_extents: h } => (0..3)
                .map(|a| slab(from[a], along[a], -h[a], h[a]))
                .try_fold([f64::NEG_INFINITY, f64::INFINITY], |a, b| common(a, b?)),
            Self::Sphere { radius } => {
                quadratic(along.length_squared(), from.dot(along), from.length_squared() - radius * radius)
            }
            Self::Cylinder { half_height, radius } => {
                let (f, a): (DVec2, DVec2) = (from.truncate(), along.truncate());
                let round = quadratic(a.length_squared(), f.dot(a), f.length_squared() - radius * radius)?;
                common(round, slab(from.z, along.z, -half_height, half_height)?)
            }
            Self::Capsule { half_height, radius } => {
                let ends = [-half_height, half_height]
                    .map(|z| Self::Sphere { radius }.inside_of_line(from - DVec3::new(0.0, 0.0, z), along));
                let barrel = Self::Cylinder { half_height, radius }.inside_of_line(from, along);
                ends.into_iter().chain([barrel]).flatten().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
            }
        }
    }

    /// Outward unit normal of a simple shape at a point of its surface.
    fn normal_at(&self, p: DVec3) -> DVec3 {
        match *self {
            Self::Mesh(_) | Self::Plane => DVec3::Z,
            Self::Box { half_extents } => {
                let q = p.abs() - half_extents;
                let axis = DVec3::AXES[(0..3).fold(0, |best, a| if q[a] > q[best] { a } else { best })];
                axis * p.dot(axis).signum()
            }
            Self::Cylinder { half_height, radius } => {
                let beside = p.with_z(0.0);
                match p.z.abs() - half_height > beside.length() - radius {
                    true => DVec3::Z * p.z.signum(),
                    false => beside.normalize_or(DVec3::X),
                }
            }
            Self::Sphere { .. } => p.normalize_or(DVec3::Z),
            Self::Capsule { half_height, .. } => {
                (p - DVec3::new(0.0, 0.0, p.z.clamp(-half_height, half_height))).normalize_or(DVec3::Z)
            }
        }
    }
}

/// The interval of `t` where `from + t · along` lies between `low` and `high`.
fn slab(from: f64, along: f64, low: f64, high: f64) -> Option<[f64; 2]> {
    if along == 0.0 {
        return (low..=high).contains(&from).then_some([f64::NEG_INFINITY, f64::INFINITY]);
    }
    let (s, t) = ((low - from) / along, (high - from) / along);
    Some([s.min(t), s.max(t)])
}

/// The interval of `t` where `a t² + 2 b t + c` is at most 0. `a` must not be negative.
fn quadratic(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    if a == 0.0 {
        return (c <= 0.0).then_some([f64::NEG_INFINITY, f64::INFINITY]);
    }
    let root = (b * b - a * c).sqrt();
    (!root.is_nan()).then(|| [(-b - root) / a, (-b + root) / a])
}

fn common(a: [f64; 2], b: [f64; 2]) -> Option<[f64; 2]> {
    let both = [a[0].max(b[0]), a[1].min(b[1])];
    (both[0] <= both[1]).then_some(both)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;

    #[test]
    fn ray_hits_equal_those_of_ray_marching() {
        let mut random = Random::new(7, 0);
        let mut hits = 0;
        for shape in [
            Shape::Plane,
            Shape::Box { half_extents: DVec3::new(0.5, 1.0, 0.25) },
            Shape::Sphere { radius: 0.7 },
            Shape::Capsule { half_height: 0.6, radius: 0.3 },
            Shape::Cylinder { half_height: 0.6, radius: 0.4 },
        ] {
            for _ in 0..2000 {
                let mut vector = || DVec3::from_array(std::array::from_fn(|_| random.between(-1.0, 1.0)));
                let (origin, along) = (2.0 * vector(), vector());
                let at = |t: f64| shape.signed_distance(origin + t * along);
                // The absolute distance is a lower bound of the path length to the surface, also
                // from inside.
                let mut t = 0.0;
                while t < 50.0 && at(t).abs() > 1e-9 {
                    t += at(t).abs() / along.length();
                }
                let hit = shape.ray_cast(origin, along, 50.0);
                assert_eq!(hit.is_some(), t < 50.0, "{shape:?} {origin} {along}");
                let Some(hit) = hit else { continue };
                hits += 1;
                assert!(at(hit.t).abs() < 1e-9, "{shape:?}: {} off the surface", at(hit.t));
                // Grazing rays end up to sqrt(tolerance) early.
                assert!((hit.t - t).abs() * along.length() < 1e-4, "{shape:?}: {} for {t}", hit.t);
                let out = shape.signed_distance(origin + hit.t * along + 1e-4 * hit.normal);
                assert!((out - 1e-4).abs() < 1e-8, "{shape:?}: {} {out}", hit.normal);
                assert_eq!(shape.ray_cast(origin, along, hit.t * 0.999), None);
                assert_eq!(shape.contains(origin), at(0.0) < 0.0);
            }
            assert_eq!(shape.ray_cast(DVec3::ONE, DVec3::ZERO, 1.0), None);
            assert_eq!(shape.ray_cast(DVec3::NAN, DVec3::Z, 1.0), None);
            assert!(shape.signed_distance(DVec3::NAN).is_nan());
        }
        assert!(hits > 1000, "{hits}");
    }
}
