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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_never_raised_and_lose_little() {
        let mut lowered = 0;
        for greatest in (1_u8..=200).map(|k| f32::from(k) / 97.0) {
            // Bounds on a step, and beside it, are those that rounding could raise.
            let on_steps = (0..=255).map(|k| greatest * (k * k) as f32 / 65025.0);
            let mut bounds: Vec<f32> =
                on_steps.flat_map(|b| [b, b.next_up(), b.next_down().max(0.0)]).collect();
            bounds.retain(|b| *b <= greatest);
            bounds.push(greatest);
            let stored = CellBounds::of(&bounds);
            let unit = stored.bytes().1;
            for (word, &bound) in bounds.iter().enumerate() {
                let (least, bound) = (stored.least(word as u32), f64::from(bound));
                let step = (bound / unit).sqrt();
                assert!(least <= bound, "{least} is above {bound}, of at most {greatest}");
                assert!(least >= (step - 1.0 - 1e-9).max(0.0).powi(2) * unit, "{least} for {bound}");
                lowered += usize::from(step.floor() * step.floor() * unit > bound);
            }
            assert_eq!(stored.least(bounds.len() as u32), 0.0, "a word that is not there");
        }
        assert!(lowered > 0, "no rounded root was too large");
    }
}
