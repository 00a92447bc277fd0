//! `tesdf-lab`: measurements of tesdf. `tesdf-lab --help` lists them.
fn main() -> std::process::ExitCode {
    tesdf_lab::main()
}
