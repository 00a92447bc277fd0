//! Limits on the size of a scene.
use super::SceneFile;

/// Maximum number of bodies.
pub const MAX_BODIES: usize = 1 << 16;
/// Maximum number of steps.
pub const MAX_STEPS: u64 = 100_000_000;
/// Maximum size of the states of all bodies in the run file: 16 GiB.
pub const MAX_STATE_BYTES: u64 = 1 << 34;
/// Size of a body's pose and velocities, bytes.
const STATE: u64 = 13 * 8;

impl SceneFile {
    /// Number of steps of the whole duration.
    ///
    /// # Errors
    /// The time step or duration is not a positive number, the scene has too many bodies or steps,
    /// or the run would be too large.
    pub fn steps(&self) -> Result<u64, LimitError> {
        for (key, value) in [("time_step", self.time_step), ("duration", self.duration)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(LimitError::new(key, format!("{value}; expected a number of seconds above 0")));
            }
        }
        if self.bodies.len() > MAX_BODIES {
            let reason = format!("{}; expected at most {MAX_BODIES}: split the scene", self.bodies.len());
            return Err(LimitError::new("bodies", reason));
        }
        let steps = (self.duration / self.time_step).round().max(1.0);
        // The quotient of two finite numbers may be infinite.
        if steps > MAX_STEPS as f64 {
            let reason = format!(
                "{:?} s in steps of {:?} s; expected at most {MAX_STEPS} steps: give a larger time_step or a shorter duration",
                self.duration, self.time_step
            );
            return Err(LimitError::new("duration", reason));
        }
        let steps = steps as u64;
        let bytes = (steps + 1) * self.bodies.len() as u64 * STATE;
        if bytes > MAX_STATE_BYTES {
            let reason = format!(
                "{steps} steps of {} bodies make a run of {bytes} bytes; expected at most {MAX_STATE_BYTES}: give a larger time_step, a \
                 shorter duration, or fewer bodies",
                self.bodies.len()
            );
            return Err(LimitError::new("duration", reason));
        }
        Ok(steps)
    }
}

/// A scene that exceeds a limit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}: {reason}")]
pub struct LimitError {
    /// The field at fault.
    pub key: &'static str,
    /// What was found and what was expected.
    pub reason: String,
}

impl LimitError {
    pub(crate) fn memory(steps: u64, bodies: usize) -> Self {
        let reason = format!(
            "no memory is left for {steps} steps of {bodies} bodies: give a larger time_step, a shorter duration, or fewer bodies"
        );
        Self::new("duration", reason)
    }

    fn new(key: &'static str, reason: String) -> Self {
        Self { key, reason }
    }
}
