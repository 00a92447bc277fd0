use tesdf::collide::CollideError;

/// Why a run cannot be played.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlaybackError {
    /// The run has no states.
    #[error("the run has no states; simulate the scene again")]
    NoStates,
    /// The bodies of the run and of the scene differ.
    #[error("the run has {found} bodies, the scene {expected}; open the scene that is stored in the run")]
    Bodies {
        /// Number of bodies in the run.
        found: usize,
        /// Number of bodies in the scene.
        expected: usize,
    },
    /// An option is out of range.
    #[error("{option} is {found}; expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        found: f64,
        /// The range.
        expected: &'static str,
    },
    /// A state is not a pose, or too far away for a file of 32-bit floats.
    #[error("body {body} after {step} steps: {reason}; expected a pose within 1e30 m of the origin")]
    State {
        /// Name of the body.
        body: String,
        /// Number of steps.
        step: usize,
        /// What is wrong.
        reason: String,
    },
    /// The result does not fit into its format.
    #[error("the result has {bytes} bytes; {format} has at most {most}: {hint}")]
    Size {
        /// Bytes of the result.
        bytes: u64,
        /// Name of the format.
        format: &'static str,
        /// Most bytes of the format.
        most: u64,
        /// How to get a smaller one.
        hint: &'static str,
    },
    /// A page cannot be served on this machine.
    #[error("a page cannot be served on the loopback interface: {0}")]
    Serve(String),
    /// The result cannot be encoded.
    #[error("the result cannot be encoded: {0}")]
    Encode(String),
    /// The geometry of a body cannot be read.
    #[error(transparent)]
    Collide(#[from] CollideError),
}
