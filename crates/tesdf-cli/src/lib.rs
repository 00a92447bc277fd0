//! The command-line tool `tesdf` as a library: one module per command, and shared modules.
//!
//! Stdout carries only a command's result; notes, warnings, errors and progress go to stderr. With
//! `-o /dev/stdout`, stdout carries only the bytes of the output. The exit code is 0 when the
//! command did its work. It is 1 when a mesh or file has defects (`check`, `repair`, `verify`,
//! `encode-all`) or a run does not meet its criterion (`simulate`). It is 2 for bad usage or input,
//! an output that cannot be written, too little memory or no threads, and Ctrl-C.
#![warn(missing_docs)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::sync::LazyLock;

use clap::{Parser, Subcommand};
use rayon::ThreadPoolBuilder;

mod abort;
pub mod check;
pub mod clearance;
pub mod collide;
pub mod completions;
pub mod devices;
pub mod encode;
pub mod encode_all;
pub mod export;
pub mod import;
pub mod inspect;
pub mod man;
mod open_run;
pub mod part;
pub mod query;
pub mod render;
pub mod repair;
pub mod simulate;
pub mod slice;
pub mod terminal;
pub mod toi;
pub mod verify;
pub mod view;
pub mod why;

use crate::terminal::interrupt;
use crate::terminal::report::{self, Failure, Outcome};

/// The version, with the commit where `build.rs` knows it: `0.1.0 (1234567 2026-11-29)`.
static VERSION: LazyLock<String> = LazyLock::new(|| match option_env!("TESDF_COMMIT") {
    Some(commit) => format!("{} ({commit})", env!("CARGO_PKG_VERSION")),
    None => env!("CARGO_PKG_VERSION").into(),
});

/// Exact signed distances of triangle meshes.
#[derive(Parser, Debug)]
#[command(name = "tesdf", version = VERSION.as_str(), about, arg_required_else_help = true, max_term_width = 80)]
pub struct Cli {
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Report the defects of a mesh
    Check(check::Args),
    /// Repair defects of a mesh that have a unique repair, and report the changes
    Repair(repair::Args),
    /// Make the mesh of a machine part: bolt, nut, gear, shaft, …
    Part(part::Args),
    /// Encode a mesh into a .tesdf file
    Encode(encode::Args),
    /// Encode all meshes of a folder or a list, each into a .tesdf file
    EncodeAll(encode_all::Args),
    /// Make a .tesdf file of a JSON file of TES-Encoder, with its lists as they are
    Import(import::Args),
    /// Print signed distance, gradient and closest point at the points of a CSV file
    Query(query::Args),
    /// Print the contents of a .tesdf file
    Inspect(inspect::Args),
    /// Check the checksums of a .tesdf file, and its distances against brute force
    Verify(verify::Args),
    /// Find the contacts between two bodies
    Collide(collide::Args),
    /// Measure the distance between two bodies, or the depth of their overlap
    ///
    /// A positive clearance is the smallest distance between the two surfaces. A negative clearance
    /// means that the bodies overlap: its absolute value is the largest depth of a point of either
    /// surface inside the other body. Bodies whose surfaces only lie on each other have clearance
    /// 0; `overlap` in the JSON result, and the text, tell whether they share volume.
    Clearance(clearance::Args),
    /// Find the time at which two moving bodies first touch
    Toi(Box<toi::Args>),
    /// List the compute devices, with the numbers and names for --device
    Devices(devices::Args),
    /// Draw the signed distance on a plane as a PNG picture
    Slice(slice::Args),
    /// Simulate the bodies of a scene and write the run
    Simulate(simulate::Args),
    /// Draw a scene of one or more bodies as a PNG picture
    Render(render::Args),
    /// Write a page that plays a run in a browser, with its contacts
    View(view::Args),
    /// Write a run as an animated GLB file, or a .tesdf file as JSON of TES-Encoder
    Export(export::Args),
    /// Print a completion script for a shell
    Completions(completions::Args),
    /// Print a manual page, for man
    Man(man::Args),
}

/// Runs the command in the arguments of this process.
pub fn main() -> ExitCode {
    abort::give_exit_code();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            report::usage(&e);
            return ExitCode::from(u8::try_from(e.exit_code()).unwrap_or(2));
        }
    };
    if let Err(failure) = interrupt::install().and_then(|()| start_threads(&cli.command)) {
        report::error(&failure);
        return ExitCode::from(2);
    }
    // A panic is a bug in tesdf; the shell still gets a documented exit code.
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

/// Starts the threads that all commands share. Rayon would panic where it cannot start them.
fn start_threads(command: &Command) -> Result<(), Failure> {
    let asked = match command {
        Command::Encode(args) => args.threads,
        Command::EncodeAll(args) => args.threads,
        _ => None,
    };
    // 0: as many as processors, or as the environment says.
    let threads = ThreadPoolBuilder::new().num_threads(asked.map_or(0, usize::from));
    threads.build_global().map_err(report::no_threads)
}

fn run(command: &Command) -> Result<Outcome, Failure> {
    match command {
        Command::Check(args) => check::run(args),
        Command::Repair(args) => repair::run(args),
        Command::Part(args) => part::run(args),
        Command::Encode(args) => encode::run(args),
        Command::EncodeAll(args) => encode_all::run(args),
        Command::Import(args) => import::run(args),
        Command::Query(args) => query::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Collide(args) => collide::run(args),
        Command::Clearance(args) => clearance::run(args),
        Command::Toi(args) => toi::run(args),
        Command::Devices(args) => devices::run(args),
        Command::Slice(args) => slice::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Render(args) => render::run(args),
        Command::View(args) => view::run(args),
        Command::Export(args) => export::run(args),
        Command::Completions(args) => completions::run(args),
        Command::Man(args) => man::run(args),
    }
}

/// The programs of the documents compile.
#[cfg(all(doctest, feature = "gpu"))]
mod documents {
    #[doc = include_str!("../../../README.md")]
    struct Readme;

    #[doc = include_str!("../../../docs/gpu/using.md")]
    struct UsingAGpu;
}
