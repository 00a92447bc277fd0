//! `tesdf completions SHELL`: prints a completion script.
use clap::CommandFactory;
use clap_complete::Shell;

use crate::terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf completions`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The shell
    #[arg(value_enum)]
    pub shell: Shell,
}

/// Prints the script.
///
/// # Errors
/// Stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut crate::Cli::command(), "tesdf", &mut script);
    report::result(&script)?;
    Ok(Outcome::Good)
}
