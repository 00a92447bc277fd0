//! What is known of a step before its contacts.
use nalgebra::Vector6;
use tesdf::collide::Pose;

use super::rows::FreeBody;
use crate::StepReport;

/// Values that are constant during a step.
pub struct Step {
    /// Its duration, s.
    pub h: f64,
    /// The duration of the whole step that this is a part of, s.
    pub whole: f64,
    /// Poses at the beginning of the step.
    pub poses: Vec<Pose>,
    /// The free bodies.
    pub free: Vec<FreeBody>,
    /// For each body its index in `free`, or `None` when it is fixed.
    pub free_of: Vec<Option<usize>>,
    /// Velocities at the end of the step without contacts.
    pub target: Vec<Vector6<f64>>,
    /// For each free body: whether a body of its island penetrates too deeply for a linear
    /// prediction.
    pub deep: Vec<bool>,
    /// What is reported of it.
    pub report: StepReport,
}
