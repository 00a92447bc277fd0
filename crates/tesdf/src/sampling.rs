//! Random points that are the same on every machine and for any number of threads.
use glam::DVec3;

use crate::base::elementary;
use crate::geometry::Aabb;

/// Random number generator of one sample. Its numbers depend on the seed and the index of the
/// sample alone.
///
/// SplitMix64 (Steele, Lea, Flood 2014).
#[derive(Clone, Debug)]
pub(crate) struct Random(u64);

impl Random {
    /// The generator of sample `index`.
    pub(crate) fn new(seed: u64, index: u64) -> Self {
        let mut random = Self(seed ^ index.wrapping_mul(0xd1b5_4a32_d192_ed03));
        // Neighbouring states give unrelated numbers only after one scramble.
        Self(random.bits())
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Between `low` and `high`, uniform in the logarithm.
    pub(crate) fn log_between(&mut self, low: f64, high: f64) -> f64 {
        elementary::exp(self.between(elementary::ln(low), elementary::ln(high)))
    }

    /// -1 or 1.
    pub(crate) fn sign(&mut self) -> f64 {
        if self.bits() >> 63 == 0 { 1.0 } else { -1.0 }
    }

    /// Uniform integer from 0 to `count` - 1; `count` is at least 1.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.bits()) * count as u128) >> 64) as usize
    }

    /// Uniform in a box.
    pub(crate) fn in_box(&mut self, bounds: Aabb) -> DVec3 {
        let share = DVec3::new(self.unit(), self.unit(), self.unit());
        bounds.min + share * bounds.extent()
    }

    /// Uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = elementary::sin_cos(self.between(0.0, std::f64::consts::TAU));
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }

    /// Barycentric weights of a point that is uniform in a simplex of `N` corners. Their sum is 1.
    pub(crate) fn weights<const N: usize>(&mut self) -> [f64; N] {
        // Normalised gaps of a Poisson process are uniform on the simplex.
        let gaps: [f64; N] = std::array::from_fn(|_| -elementary::ln(1.0 - self.unit()));
        let sum: f64 = gaps.iter().sum();
        if sum > 0.0 { gaps.map(|g| g / sum) } else { [1.0 / N as f64; N] }
    }

    /// A point that is uniform in the simplex of these corners.
    pub(crate) fn in_simplex<const N: usize>(&mut self, corners: &[DVec3; N]) -> DVec3 {
        let weights = self.weights::<N>();
        // Computed relative to the first corner, which keeps precision far from the origin.
        let [first, ..] = corners.as_slice() else { return DVec3::ZERO };
        *first + corners.iter().zip(weights).map(|(c, w)| w * (*c - *first)).sum::<DVec3>()
    }
}

/// Picks indices with probabilities proportional to their weights.
#[derive(Clone, Debug)]
pub(crate) struct Weighted {
    sums: Vec<f64>,
}

impl Weighted {
    /// `weights` must not be negative.
    pub(crate) fn new(weights: impl Iterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        Self {
            sums: weights
                .map(|w| {
                    sum += w;
                    sum
                })
                .collect(),
        }
    }

    /// A random index; `None` when all weights are 0.
    pub(crate) fn pick(&self, random: &mut Random) -> Option<usize> {
        let total = self.total();
        let at = random.unit() * total;
        (total > 0.0).then(|| self.sums.partition_point(|&s| s <= at).min(self.sums.len() - 1))
    }

    /// Sum of the weights.
    pub(crate) fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_uniform_and_repeatable() {
        let n = 20_000;
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let (mut mean, mut inside, mut around) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        let weighted = Weighted::new([1.0, 0.0, 3.0].into_iter());
        let mut picked = [0; 3];
        for index in 0..n {
            let mut random = Random::new(7, index);
            mean += random.in_box(Aabb { min: DVec3::ZERO, max: DVec3::ONE });
            inside += random.in_simplex(&corners);
            around += random.direction();
            picked[weighted.pick(&mut random).unwrap()] += 1;
            assert!(random.below(3) < 3);
            assert_eq!(Random::new(7, index).bits(), Random::new(7, index).bits());
        }
        let n = n as f64;
        assert!((mean / n - 0.5).abs().max_element() < 0.01);
        assert!((inside / n - 0.25).abs().max_element() < 0.01);
        assert!((around / n).abs().max_element() < 0.02);
        assert!(picked[1] == 0 && (f64::from(picked[2]) / n - 0.75).abs() < 0.01, "{picked:?}");
        assert_eq!(Weighted::new([0.0].into_iter()).pick(&mut Random::new(0, 0)), None);
    }
}
