//! Rays and vectors with coordinates up to the limits of `f64`.
use glam::DVec3;

/// A ray that begins near a body. Its direction has a length of 1 to 4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearRay {
    /// Start of the ray.
    pub origin: DVec3,
    /// The direction of the original ray, divided by `unit`.
    pub direction: DVec3,
    /// Scale of the original direction; a power of two.
    pub unit: f64,
    /// Position of `origin` along the original ray, in lengths of `direction`.
    pub skipped: f64,
}

/// A ray that begins within this many body sizes of the body is not moved.
const NEAR: f64 = 4.0;
/// Other rays are moved to this many body sizes before they pass the middle.
const BEFORE: f64 = 2.0;
/// Largest number of moves along a ray. The error of a move is the rounding of its length, so a few
/// moves are enough.
const MOVES: usize = 40;

impl NearRay {
    /// Moves the ray `origin + t · direction`, of finite numbers, to where it comes near the ball
    /// of radius `size` around `middle`. `None` when the ray never comes near.
    ///
    /// A point of the ray is rounded once per move and coordinate. So the position where the ray
    /// passes the body has an error of 1e-16 of the distance from the original start. There is no
    /// error across an axis that the ray is parallel to.
    pub fn new(origin: DVec3, direction: DVec3, middle: DVec3, size: f64) -> Option<Self> {
        let unit = power_of_two_below(direction.abs().max_element());
        let mut ray = Self { origin, direction: direction / unit, unit, skipped: 0.0 };
        if ray.is_within(middle, NEAR * size) {
            return Some(ray);
        }
        let before = BEFORE * size / ray.direction.length();
        for _ in 0..MOVES {
            let to_middle = middle - ray.origin;
            // Squares of large numbers would overflow.
            let largest = to_middle.abs().max_element().max(f64::MIN_POSITIVE);
            let along = (to_middle / largest).dot(ray.direction) / ray.direction.length_squared() * largest;
            let step = along - before;
            if ray.skipped == 0.0 && step <= 0.0 {
                return None;
            }
            let moved = |axis: usize| step.mul_add(ray.direction[axis], ray.origin[axis]);
            ray.origin = DVec3::new(moved(0), moved(1), moved(2));
            ray.skipped += step;
            if step.abs() <= before {
                break;
            }
        }
        ray.is_within(middle, NEAR * size).then_some(ray)
    }

    fn is_within(&self, middle: DVec3, reach: f64) -> bool {
        // The comparison is false for NaN.
        (self.origin - middle).abs().cmple(DVec3::splat(reach)).all()
    }

    /// Converts `limit` to a limit that is measured from `origin` in lengths of `direction`.
    /// `limit` is measured along the original ray in lengths of its direction.
    pub fn rest_of(&self, limit: f64) -> f64 {
        limit * self.unit - self.skipped
    }

    /// Converts a parameter of this ray to a parameter of the original ray; `None` above
    /// [`f64::MAX`].
    pub fn total(&self, t: f64) -> Option<f64> {
        Some((self.skipped + t) / self.unit).filter(|t| t.is_finite())
    }
}

/// The length of a vector, at most [`f64::MAX`], and its direction. Squares of its coordinates may
/// overflow.
pub fn length_and_direction(v: DVec3) -> (f64, DVec3) {
    let largest = v.abs().max_element();
    let scaled = v / largest;
    ((scaled.length() * largest).min(f64::MAX), scaled.normalize())
}

/// The largest power of two that is not above `x`, which must be finite and positive.
fn power_of_two_below(x: f64) -> f64 {
    let bits = x.to_bits();
    match x.is_normal() {
        true => f64::from_bits(bits & 0x7ff0_0000_0000_0000),
        false => f64::from_bits(1 << (63 - bits.leading_zeros())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::strategy::point;
    use proptest::prelude::*;

    #[test]
    fn power_of_two_below_is_the_largest() {
        for (x, expected) in [(1.0, 1.0), (1.99, 1.0), (0.75, 0.5), (1e300, 2f64.powi(996)), (5e-324, 5e-324)]
        {
            assert_eq!(power_of_two_below(x), expected, "{x}");
        }
        assert!(power_of_two_below(f64::MAX) > f64::MAX / 2.0 && power_of_two_below(1.7e-308).is_subnormal());
    }

    #[test]
    fn rays_along_an_axis_keep_the_other_coordinates() {
        for distance in [5.0, 1e3, 1e20, 1e200, 1e308] {
            for unit in [1.0, 3.0, 1e-200, 1e200] {
                let origin = DVec3::new(0.3, distance, -0.7);
                let ray = NearRay::new(origin, DVec3::new(0.0, -unit, 0.0), DVec3::ZERO, 1.0).unwrap();
                assert_eq!((ray.origin.x, ray.origin.z), (0.3, -0.7));
                assert!((1.0..=NEAR).contains(&ray.origin.y), "{distance} {unit}: {ray:?}");
                let away = NearRay::new(origin, DVec3::new(0.0, unit, 0.0), DVec3::ZERO, 1.0);
                assert_eq!(away.is_some(), distance <= NEAR, "{distance}");
                assert_eq!(NearRay::new(origin, DVec3::X, DVec3::ZERO, 1.0), None);
            }
        }
    }

    #[test]
    fn rays_with_a_near_origin_are_unchanged() {
        let (origin, direction) = (DVec3::new(0.1, 3.0, -0.3), DVec3::new(1e-3, 7e-3, -2e-3));
        let ray = NearRay::new(origin, direction, DVec3::ZERO, 1.0).unwrap();
        assert_eq!((ray.origin, ray.skipped, ray.direction * ray.unit), (origin, 0.0, direction));
        assert_eq!(ray.total(ray.rest_of(0.7)), Some(0.7));
    }

    proptest! {
        /// The ray passes the body at `beside` from the middle, and begins far before.
        #[test]
        fn rays_are_moved_along_themselves(
            direction in point(), side in point(), beside in 0.0..3.0f64, power in 0i32..12, unit in -100i32..100
        ) {
            prop_assume!(direction.length() > 0.1 && side.cross(direction).length() > 0.01);
            let (middle, size) = (DVec3::new(3.0, -7.0, 2.0), 0.5);
            let across = side.cross(direction).normalize();
            let (far, scale) = (10f64.powi(power), 10f64.powi(unit));
            let origin = middle + size * beside * across - far * direction;
            let ray = NearRay::new(origin, direction * scale, middle, size);
            let Some(ray) = ray else { return Err(TestCaseError::fail("never near")) };
            let rounding = 1e-15 * (far + 10.0);
            prop_assert!((ray.origin - middle).abs().max_element() <= NEAR * size);
            prop_assert!((1.0..4.0).contains(&ray.direction.length()));
            for t in [0.0, 1.0, 7.0] {
                // As a multiple of the original direction.
                let total = ray.total(t).unwrap() * scale;
                let (p, q) = (ray.origin + t * ray.direction, origin + total * direction);
                prop_assert!(p.distance(q) <= 16.0 * rounding, "{} {}", p, q);
                prop_assert!((ray.rest_of(ray.total(t).unwrap()) - t).abs() <= 64.0 * rounding);
            }
            // Behind the start, and at a greater distance, the ray misses the body.
            let away = 100.0 + far;
            prop_assert_eq!(NearRay::new(middle + away * direction, direction * scale, middle, size), None);
            let aside = middle + 10.0 * size * across - away * direction;
            prop_assert_eq!(NearRay::new(aside, direction * scale, middle, size), None);
        }
    }

    #[test]
    fn lengths_are_bounded_by_the_largest_number() {
        let (length, direction) = length_and_direction(DVec3::new(3e300, 0.0, -4e300));
        assert!(length == 5e300 && direction.distance(DVec3::new(0.6, 0.0, -0.8)) < 1e-15);
        assert_eq!(length_and_direction(DVec3::MAX), (f64::MAX, DVec3::ONE.normalize()));
        let ray = NearRay::new(DVec3::ZERO, DVec3::X * 1e-300, DVec3::ZERO, 1.0).unwrap();
        assert_eq!((ray.total(1e9), ray.total(1.0).is_some()), (None, true));
    }
}
