use std::num::NonZeroUsize;

use crate::PlaybackError;

/// Which steps of a run are played. The beginning and the end always are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Frames {
    /// Steps at equal intervals, at most this many and the end.
    AtMost(NonZeroUsize),
    /// Every step whose number is a multiple of this one.
    Every(NonZeroUsize),
    /// The steps nearest to this many equal times in each second of the run.
    PerSecond(f64),
}

impl Frames {
    /// Most frames by default: 16 s at 60 frames a second, or 1 s at a time step of 1 ms.
    pub const DEFAULT: NonZeroUsize = NonZeroUsize::new(1000).unwrap();

    /// The numbers of the steps, ascending. `times` has the time of each state, s, ascending.
    ///
    /// # Errors
    /// [`PlaybackError::NoStates`], or [`PlaybackError::Option`] for a rate that is not positive.
    pub fn steps(self, times: &[f64]) -> Result<Vec<usize>, PlaybackError> {
        let last = times.len().checked_sub(1).ok_or(PlaybackError::NoStates)?;
        let mut steps: Vec<usize> = match self {
            Self::AtMost(most) => (0..last).step_by(times.len().div_ceil(most.get()).max(1)).collect(),
            Self::Every(every) => (0..last).step_by(every.get()).collect(),
            Self::PerSecond(rate) => {
                if !(rate > 0.0 && rate.is_finite()) {
                    let expected = "a positive number of frames per second";
                    return Err(PlaybackError::Option { option: "fps", found: rate, expected });
                }
                // The number of the frame to which each step is nearest; of its steps, the nearest.
                let mut chosen: Vec<usize> = Vec::new();
                let at = |step: usize| (times[step] - times[0]) * rate;
                for step in 0..=last {
                    let off = |step: usize| (at(step) - at(step).round()).abs();
                    match chosen.last_mut() {
                        Some(before) if at(*before).round() == at(step).round() => {
                            if off(step) < off(*before) {
                                *before = step;
                            }
                        }
                        _ => chosen.push(step),
                    }
                }
                // The end takes the place of the frame beside it.
                if chosen.len() > 1 && chosen.last().is_some_and(|&c| at(c).round() == at(last).round()) {
                    chosen.pop();
                }
                chosen
            }
        };
        if steps.last() != Some(&last) {
            steps.push(last);
        }
        Ok(steps)
    }
}

impl Default for Frames {
    fn default() -> Self {
        Self::AtMost(Self::DEFAULT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(frames: Frames, count: usize, step: f64) -> Vec<usize> {
        let times: Vec<f64> = (0..count).map(|k| 3.0 + k as f64 * step).collect();
        frames.steps(&times).unwrap()
    }

    #[test]
    fn the_beginning_and_the_end_are_among_the_frames() {
        let number = |n| NonZeroUsize::new(n).unwrap();
        assert_eq!(of(Frames::Every(number(1)), 4, 0.1), [0, 1, 2, 3]);
        assert_eq!(of(Frames::Every(number(3)), 6, 0.1), [0, 3, 5]);
        assert_eq!(of(Frames::Every(number(9)), 1, 0.1), [0]);
        assert_eq!(of(Frames::AtMost(number(3)), 10, 0.1), [0, 4, 8, 9]);
        assert_eq!(of(Frames::AtMost(number(3)), 3, 0.1), [0, 1, 2]);
        assert_eq!(of(Frames::default(), 2000, 1e-3).len(), 1001);
        assert_eq!(of(Frames::PerSecond(10.0), 101, 1e-2), [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100]);
        assert_eq!(of(Frames::PerSecond(1e6), 4, 0.1), [0, 1, 2, 3], "no frame between two steps");
        assert_eq!(of(Frames::PerSecond(0.1), 4, 0.1), [0, 3]);
    }

    #[test]
    fn a_run_without_states_and_a_rate_of_zero_are_errors() {
        assert!(matches!(Frames::default().steps(&[]), Err(PlaybackError::NoStates)));
        for rate in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = Frames::PerSecond(rate).steps(&[0.0, 1.0]).unwrap_err();
            assert!(error.to_string().starts_with("fps is "), "{error}");
        }
    }
}
