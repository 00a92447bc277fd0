use tesdf::collide::CollideError;

use crate::robot::RobotError;

/// Why a robot cannot be read, or a question about it not be answered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanningError {
    /// The robot description cannot be read, or a link or joint is not one for planning.
    #[error("{0}")]
    Robot(String),
    /// A name, a configuration or an option: what was found, and what was expected.
    #[error("{0}")]
    Argument(String),
    /// A row of many.
    #[error("row {row}: {source}")]
    Row {
        /// Its number, from 0.
        row: usize,
        /// What was found and what was expected.
        source: Box<PlanningError>,
    },
    /// A shape or a pose of a body.
    #[error("{body}: {source}")]
    Body {
        /// Name of the body.
        body: String,
        /// What was found and what was expected.
        source: CollideError,
    },
    /// A search of two bodies.
    #[error(transparent)]
    Collide(#[from] CollideError),
    /// The encoding was cancelled.
    #[error("cancelled")]
    Cancelled,
}

impl From<RobotError> for PlanningError {
    fn from(RobotError(text): RobotError) -> Self {
        Self::Robot(text)
    }
}

impl PlanningError {
    /// The same, where `rows` are before those of the call.
    pub fn after_rows(self, rows: usize) -> Self {
        match self {
            Self::Row { row, source } => Self::Row { row: row + rows, source },
            e => e,
        }
    }
}
