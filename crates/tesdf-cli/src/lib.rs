//! The parts of the command-line tool `tesdf`: one module per command, and what they share.
//!
//! stdout carries only a command's result; notes, warnings, errors and progress go to stderr. With `-o /dev/stdout` it carries only the bytes
//! of the output. The exit code is 0 when the command did its work, 1 when a mesh or file is not good (`check`, `repair`, `verify`) or a run does
//! not meet its criterion (`simulate`), 2 for bad usage or input, an output that cannot be written, and Ctrl-C.
#![warn(missing_docs)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod abort;
pub mod check;
pub mod clearance;
pub mod collide;
pub mod completions;
pub mod devices;
pub mod encode;
pub mod inspect;
pub mod query;
pub mod render;
pub mod repair;
pub mod simulate;
pub mod slice;
pub mod toi;
pub mod verify;
pub mod why;

use tesdf_bench::{detection, evaluate};
use tesdf_terminal::report::{self, Failure, Outcome};

/// Exact signed distances of triangle meshes.
#[derive(Parser, Debug)]
#[command(name = "tesdf", version, about, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Subcommand, Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one of it")]
pub enum Command {
    /// Say what is wrong with a mesh
    Check(check::Args),
    /// Mend what can be mended without guessing, and say what was changed
    Repair(repair::Args),
    /// Encode a mesh into a .tesdf file
    Encode(encode::Args),
    /// Signed distance, gradient and closest point at the points of a CSV file
    Query(query::Args),
    /// Say what is in a .tesdf file
    Inspect(inspect::Args),
    /// Check a .tesdf file: its checksums, then its distances against brute force
    Verify(verify::Args),
    /// Contacts between two bodies
    Collide(collide::Args),
    /// How far two bodies are apart, or how deep they are in each other
    ///
    /// A positive clearance is the least distance between the two surfaces. A negative one says that the bodies overlap: its size is how
    /// deep the deepest point of either surface is inside of the other body. Bodies whose surfaces lie on each other have clearance 0;
    /// `overlap` in the JSON result, and the text, say whether they share volume.
    Clearance(clearance::Args),
    /// When two moving bodies first touch
    Toi(toi::Args),
    /// List the devices that can compute, by the numbers and names that --device takes
    Devices(devices::Args),
    /// Measure what detection costs on a device, stage by stage
    Bench(detection::Args),
    /// Draw the signed distance on a plane as a PNG picture
    Slice(slice::Args),
    /// Move the bodies of a scene and write the run
    Simulate(simulate::Args),
    /// Draw a scene of one or more bodies as a PNG picture
    Render(render::Args),
    /// Measure Table I or IV of the paper, beside the paper's figures
    Evaluate(evaluate::Args),
    /// Print a completion script for a shell
    Completions(completions::Args),
}

/// Runs the command that the arguments of this process ask for.
pub fn main() -> ExitCode {
    abort::give_exit_code();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            report::usage(&e);
            return ExitCode::from(u8::try_from(e.exit_code()).unwrap_or(2));
        }
    };
    // A panic is a bug of ours; the shell still gets a documented exit code.
    let outcome = catch_unwind(AssertUnwindSafe(|| run(&cli.command))).unwrap_or_else(|_| {
        Err(Failure::new("tesdf has a bug: the message above says where")
            .hint("please report it with the command and, if you may share it, the file"))
    });
    match outcome {
        Ok(Outcome::Good) => ExitCode::SUCCESS,
        Ok(Outcome::NotGood) => ExitCode::from(1),
        Err(failure) => {
            report::error(&failure);
            ExitCode::from(2)
        }
    }
}

fn run(command: &Command) -> Result<Outcome, Failure> {
    match command {
        Command::Check(args) => check::run(args),
        Command::Repair(args) => repair::run(args),
        Command::Encode(args) => encode::run(args),
        Command::Query(args) => query::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Collide(args) => collide::run(args),
        Command::Clearance(args) => clearance::run(args),
        Command::Toi(args) => toi::run(args),
        Command::Devices(args) => devices::run(args),
        Command::Bench(args) => detection::run(args),
        Command::Slice(args) => slice::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Render(args) => render::run(args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Completions(args) => completions::run(args),
    }
}
