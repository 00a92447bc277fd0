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
