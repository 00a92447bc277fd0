/// For every word of the forest a lower bound of the signed distances in its cell, made when a detection first wants it.
///
/// A byte each: the square root of the bound, as a share of that of the greatest one, rounded down.
#[derive(Clone, Debug)]
pub(crate) struct CellBounds {
    bytes: Vec<u8>,
    /// Squared steps to lengths of the local frame.
    unit: f64,
}

const STEPS: f64 = 255.0;

impl CellBounds {
    /// That of no cell is known.
    pub fn none() -> Self {
        Self { bytes: Vec::new(), unit: 0.0 }
    }

    /// Rounds the bounds of all words, in the local frame.
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

    /// The bytes, and what a squared one is worth.
    pub fn bytes(&self) -> (&[u8], f64) {
        (&self.bytes, self.unit)
    }

    /// No point of the cell has a signed distance below this (local frame); 0 where the solid may be.
    #[inline]
    pub fn least(&self, word: u32) -> f64 {
        let step = f64::from(self.bytes.get(word as usize).copied().unwrap_or(0));
        step * step * self.unit
    }
}
