//! Where, when and how a table was made.
use std::fs;
use std::path::Path;

use tesdf::query::Isa;

use crate::{Failure, output};

/// Prints the command, the date, the processor and what the build uses of it.
pub fn print() -> Result<(), Failure> {
    let mut words = std::env::args();
    let program = words.next().unwrap_or_default();
    let name = Path::new(&program).file_name().unwrap_or_default().to_string_lossy().into_owned();
    let command: Vec<String> = std::iter::once(name).chain(words.map(|w| quoted(&w))).collect();
    output::line(&format!("`{}`\n", command.join(" ")))?;
    output::line(&format!("- {} UTC, tesdf {}", now(), env!("CARGO_PKG_VERSION")))?;
    let cores = std::thread::available_parallelism().map_or("unknown".into(), |n| n.to_string());
    let load = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load = load.split(' ').next().filter(|l| !l.is_empty()).unwrap_or("unknown").to_string();
    output::line(&format!("- {}; {cores} cores, load at the start {load}", processor()))?;
    output::line(&format!("- compiled for {}; tesdf chose {:?} at run time\n", target(), Isa::detect()))
}

/// The instruction sets that the whole program, peers included, was compiled for.
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

fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find(|l| l.starts_with("model name")).and_then(|l| l.split_once(':'));
    model.map_or("processor unknown".into(), |(_, name)| name.trim().into())
}

fn now() -> String {
    jiff::Timestamp::now().strftime("%Y-%m-%d %H:%M").to_string()
}

fn quoted(word: &str) -> String {
    if word.is_empty() || word.contains(char::is_whitespace) { format!("'{word}'") } else { word.into() }
}
