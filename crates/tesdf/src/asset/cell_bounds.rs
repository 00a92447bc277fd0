/// A lower bound of the signed distances in each cell, for every word of the forest. Made when a
/// detection first asks for it.
///
/// A bound takes one byte: the square root of its share of the greatest bound, rounded down.
#[derive(Clone, Debug)]
pub(crate) struct CellBounds {
    bytes: Vec<u8>,
    /// Lengths of the local frame per squared step.
    unit: f64,
}

const STEPS: f64 = 255.0;

impl CellBounds {
    /// The bounds when none is known.
    pub fn none() -> Self {
        Self { bytes: Vec::new(), unit: 0.0 }
    }

    /// Rounds the bounds of all words down. They are in the local frame.
    pub fn of(bounds: &[f32]) -> Self {
        let greatest = bounds.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let unit = f64::from(greatest) / (STEPS * STEPS);
        let byte = |b: &f32| {
            let mut step = (f64::from(*b) / unit).sqrt().floor().min(STEPS);
            while step > 0.0 && step * step * unit > f64::from(*b) {
                step -= 1.0;
            }
            step as u8
        };
        Self { bytes: bounds.iter().map(byte).collect(), unit }
    }

    /// The bytes, and the length that a squared byte stands for.
    pub fn bytes(&self) -> (&[u8], f64) {
        (&self.bytes, self.unit)
    }

    /// No point of the cell has a signed distance below this (local frame). It is 0 where the solid
    /// may be.
    #[inline]
    pub fn least(&self, word: u32) -> f64 {
        let step = f64::from(self.bytes.get(word as usize).copied().unwrap_or(0));
        step * step * self.unit
    }
}
