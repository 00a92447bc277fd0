//! `tesdf bench` and `tesdf evaluate`, which need the feature `bench`.
#[cfg(not(feature = "bench"))]
use tesdf_terminal::report::{Failure, Outcome};

#[cfg(feature = "bench")]
pub use tesdf_bench::{
    detection::{Args as BenchArgs, run as bench},
    evaluate::{Args as EvaluateArgs, run as evaluate},
};

/// Arguments of a command that this tool was built without.
#[cfg(not(feature = "bench"))]
#[derive(clap::Args, Debug)]
#[command(disable_help_flag = true)]
pub struct Unread {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _all: Vec<std::ffi::OsString>,
}

#[cfg(not(feature = "bench"))]
pub use self::{Unread as BenchArgs, Unread as EvaluateArgs};

/// Reports that this tool was built without measurements.
///
/// # Errors
/// Always. The message says how to build the tool with the feature `bench`.
#[cfg(not(feature = "bench"))]
pub fn bench(_: &BenchArgs) -> Result<Outcome, Failure> {
    Err(built_without("bench"))
}

/// Reports that this tool was built without measurements.
///
/// # Errors
/// Always. The message says how to build the tool with the feature `bench`.
#[cfg(not(feature = "bench"))]
pub fn evaluate(_: &EvaluateArgs) -> Result<Outcome, Failure> {
    Err(built_without("evaluate"))
}

#[cfg(not(feature = "bench"))]
fn built_without(command: &str) -> Failure {
    Failure::new(format!("`tesdf {command}` was not built into this tool"))
        .hint("build it in the repository with `cargo build --release --features bench --bin tesdf`")
}
