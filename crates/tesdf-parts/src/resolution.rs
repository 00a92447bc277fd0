use std::f64::consts::TAU;

use tesdf::base::elementary;

use crate::error::{Mm, PartError, count};

/// How finely curves become chords.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// Segments of a full turn.
    Segments(usize),
    /// Largest distance of a chord from its arc, in metres.
    Deviation(f64),
}

/// Fewest segments of a full turn. Each hexagon has its corners at multiples of 30°.
const FEWEST: usize = 12;
/// Most segments of a full turn: the deviation is then 3e-7 of the radius.
const MOST: usize = 4096;

impl Resolution {
    /// 96 segments for a turn: the deviation is 5.4e-4 of the radius, 4 µm on an M16 thread.
    pub const DEFAULT: Self = Self::Segments(96);

    /// Checks the value for a part whose largest circle has this radius.
    pub(crate) fn check(self, radius: f64) -> Result<(), PartError> {
        match self {
            Self::Segments(segments) => count("number of segments", segments, FEWEST..=MOST)?,
            Self::Deviation(deviation) => {
                let least = radius * (1.0 - elementary::cos(TAU / 2.0 / MOST as f64));
                if !(deviation > 0.0 && deviation.is_finite()) || deviation < least {
                    // Rounded up to the last digit that is printed.
                    let least = Mm((least * 1e9).ceil() * 1e-9);
                    return Err(PartError::Parameter {
                        name: "deviation",
                        found: Mm(deviation).to_string(),
                        expected: format!(
                            "at least {least}, which takes {MOST} segments of the largest circle"
                        ),
                    });
                }
            }
        }
        Ok(())
    }

    /// Segments of a full turn of this radius, rounded up to a multiple of `multiple`.
    pub(crate) fn turn(self, radius: f64, multiple: usize) -> usize {
        let segments = match self {
            Self::Segments(segments) => segments,
            // The distance of a chord of angle 2a from its arc is r (1 - cos a).
            Self::Deviation(deviation) if deviation < radius => {
                (TAU / 2.0 / elementary::acos(1.0 - deviation / radius)).ceil() as usize
            }
            Self::Deviation(_) => FEWEST,
        };
        segments.clamp(FEWEST, MOST).next_multiple_of(multiple)
    }

    /// Segments of an arc of this radius and angle.
    pub(crate) fn arc(self, radius: f64, angle: f64) -> usize {
        ((self.turn(radius, 1) as f64 * angle.abs() / TAU - 1e-9).ceil() as usize).max(1)
    }
}

impl Default for Resolution {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chords_stay_within_the_deviation() {
        for (radius, deviation) in [(0.008, 1e-5), (0.1, 1e-6), (0.001, 5e-4)] {
            let n = Resolution::Deviation(deviation).turn(radius, 12);
            assert_eq!(n % 12, 0);
            assert!(radius * (1.0 - (TAU / 2.0 / n as f64).cos()) <= deviation, "{n} segments");
        }
        assert_eq!(Resolution::DEFAULT.arc(1.0, TAU / 4.0), 24);
        assert!(
            Resolution::Segments(11).check(0.01).is_err() && Resolution::Deviation(0.0).check(0.0).is_err()
        );
        let error = Resolution::Deviation(1e-9).check(0.01).unwrap_err().to_string();
        assert!(
            error.starts_with("the deviation is 0.000001 mm; expected at least 0.000003 mm, "),
            "{error}"
        );
        Resolution::Deviation(3e-9).check(0.01).unwrap();
    }
}
