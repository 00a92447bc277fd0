//! The heading of a table.
use crate::heading::{command, load, processor, version_and_date};
use tesdf::base::Isa;

use super::{Failure, output};

/// Prints the command, the date, the processor, and the instruction sets of the build.
pub fn print() -> Result<(), Failure> {
    output::line(&format!("`{}`\n", command()))?;
    output::line(&format!("- {}", version_and_date()))?;
    let load = load().map_or("unknown".into(), |[one, _]| one);
    output::line(&format!("- {}, load at the start {load}", processor()))?;
    output::line(&format!("- compiled for {}; tesdf used {:?}\n", target(), Isa::detect()))
}

/// The instruction sets that the whole program, including the peers, was compiled for.
fn target() -> String {
    let mut all = vec![std::env::consts::ARCH];
    for (has, name) in [
        (cfg!(target_feature = "avx2"), "AVX2"),
        (cfg!(target_feature = "fma"), "FMA"),
        (cfg!(target_feature = "avx512f"), "AVX-512"),
    ] {
        if has {
            all.push(name);
        }
    }
    if all.len() == 1 {
        all.push("baseline");
    }
    all.join(" ")
}
