use glam::DVec3;

/// An axis-aligned bounding box. It is empty when `min > max` on some axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lowest corner.
    pub min: DVec3,
    /// Highest corner.
    pub max: DVec3,
}

impl Aabb {
    /// The empty box.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The smallest box around `points`.
    pub fn of(points: &[DVec3]) -> Self {
        points.iter().fold(Self::EMPTY, |b, &p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The smallest box around both boxes.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The box grown by `margin` on every side.
    pub fn grown(self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// Edge lengths.
    pub fn extent(self) -> DVec3 {
        self.max - self.min
    }

    /// Centre of the box.
    pub fn center(self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// The box in `f32`, relative to `middle` and rounded outward: lowest corner, then highest
    /// corner.
    pub fn rounded_from(self, middle: DVec3) -> [f32; 6] {
        let (low, high) = (self.min - middle, self.max - middle);
        std::array::from_fn(|k| match k {
            0..3 => (low[k] as f32).next_down(),
            _ => (high[k - 3] as f32).next_up(),
        })
    }

    /// The distance to another box along each axis, 0 where their intervals overlap.
    pub fn gap(self, other: Self) -> DVec3 {
        (self.min - other.max).max(other.min - self.max).max(DVec3::ZERO)
    }

    /// Whether the closed boxes share a point.
    pub fn overlaps(self, other: Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Whether the closed box contains `p`.
    pub fn contains(self, p: DVec3) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// Squared distance from `p` to the box, 0 inside.
    pub fn distance_squared(self, p: DVec3) -> f64 {
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_of_known_sizes() {
        let b = Aabb::of(&[DVec3::new(1.0, 6.0, 3.0), DVec3::new(2.0, 4.0, 8.0)]);
        assert_eq!((b.min, b.max), (DVec3::new(1.0, 4.0, 3.0), DVec3::new(2.0, 6.0, 8.0)));
        assert_eq!((b.extent(), b.center()), (DVec3::new(1.0, 2.0, 5.0), DVec3::new(1.5, 5.0, 5.5)));
        let grown = b.grown(0.5);
        assert_eq!((grown.min, grown.max), (b.min - 0.5, b.max + 0.5));
        assert_eq!(b.union(Aabb::of(&[DVec3::ZERO])), Aabb { min: DVec3::ZERO, max: b.max });
        assert_eq!(b.union(Aabb::EMPTY), b);
        assert_eq!(b.distance_squared(DVec3::new(0.0, 5.0, 10.0)), 5.0);
        assert_eq!(b.distance_squared(DVec3::new(4.0, 4.5, 3.0)), 4.0);
    }

    #[test]
    fn gaps_are_those_of_the_intervals() {
        let b = Aabb::of(&[DVec3::new(5.0, 6.0, 7.0), DVec3::new(6.0, 8.0, 10.0)]);
        let other = Aabb::of(&[DVec3::new(8.0, 7.5, 2.0), DVec3::new(9.0, 9.0, 3.0)]);
        assert_eq!((b.gap(other), other.gap(b)), (DVec3::new(2.0, 0.0, 4.0), DVec3::new(2.0, 0.0, 4.0)));
    }

    #[test]
    fn boxes_contain_and_overlap_on_their_sides() {
        let b = Aabb::of(&[DVec3::ZERO, DVec3::ONE]);
        for axis in 0..3 {
            let unit = DVec3::from_array(std::array::from_fn(|k| f64::from(k == axis)));
            for (step, beside) in [(1.0, true), (1.1, false), (-1.0, true), (-1.1, false)] {
                let moved = Aabb { min: b.min + step * unit, max: b.max + step * unit };
                assert_eq!((b.overlaps(moved), moved.overlaps(b)), (beside, beside), "{step} {unit}");
                let p = DVec3::splat(0.5) + (step - 0.5f64.copysign(step)) * unit;
                assert_eq!((b.contains(p), b.distance_squared(p) == 0.0), (beside, beside), "{p}");
            }
        }
        assert!(!b.contains(DVec3::NAN) && !b.overlaps(Aabb::EMPTY));
    }

    #[test]
    fn rounded_boxes_hold_the_box() {
        let middle = DVec3::new(0.1, -0.7, 1e6);
        for k in 0..100 {
            let low = DVec3::new(0.013, -0.171, 0.3) * f64::from(k);
            let b = Aabb { min: low, max: low + DVec3::new(0.0, 1e-9, 0.7) };
            let rounded = b.rounded_from(middle);
            for axis in 0..3 {
                let (low, high) = (b.min[axis] - middle[axis], b.max[axis] - middle[axis]);
                let (to_low, to_high) = (f64::from(rounded[axis]), f64::from(rounded[axis + 3]));
                assert!(to_low < low && high < to_high, "{k} {axis}");
                assert!(
                    low - to_low < 3e-7 * low.abs() + 1e-40 && to_high - high < 3e-7 * high.abs() + 1e-40,
                    "{k} {axis}"
                );
            }
        }
    }
}
