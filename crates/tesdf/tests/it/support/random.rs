use tesdf::glam::DVec3;

/// SplitMix64, which gives the same points on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// `10^x` with `x` uniform between `low` and `high`, of either sign.
    pub fn power(&mut self, low: f64, high: f64) -> f64 {
        let size = 10f64.powf(self.between(low, high));
        if self.bits() & 1 == 0 { size } else { -size }
    }

    /// An index below `n`.
    pub fn index(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// A point of the cube [-1, 1)³.
    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.in_cube();
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    /// Barycentric weights, uniform over a simplex.
    pub fn weights<const N: usize>(&mut self) -> [f64; N] {
        let w: [f64; N] = std::array::from_fn(|_| -(1.0 - self.unit()).ln());
        let sum: f64 = w.iter().sum();
        w.map(|w| w / sum)
    }
}
