//! `tesdf`: check, repair and encode meshes; query, inspect, verify and draw the result.
use std::process::ExitCode;

fn main() -> ExitCode {
    tesdf_cli::main()
}
