//! `tesdf-lab encode`: time, memory and hash of one encode.
use std::fs;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Instant;
use tesdf::base::Named as _;
use tesdf::encode::EncodeOptions;
use tesdf_cli::terminal::parse;

use rayon::ThreadPoolBuilder;

use super::input::{Input, Preset};
use super::output::mb;
use super::{Failure, heading, output};

/// Arguments of `tesdf-lab encode`.
#[derive(clap::Args)]
pub struct Args {
    /// A mesh file; it is repaired first if necessary
    mesh: PathBuf,
    /// Preset of the encoder
    #[arg(long, value_parser = parse::named::<Preset>(), default_value_t = Preset::Default)]
    preset: Preset,
    /// Number of threads [default: one per core]
    #[arg(long, value_name = "T")]
    threads: Option<NonZeroUsize>,
}

const COLUMNS: [&str; 9] = [
    "mesh",
    "preset",
    "threads",
    "faces",
    "read and check, s",
    "encode, s",
    "peak resident, MiB",
    "file, MB",
    "BLAKE3 of the file",
];

pub fn run(args: &Args) -> Result<(), Failure> {
    let mut pool = ThreadPoolBuilder::new();
    if let Some(threads) = args.threads {
        pool = pool.num_threads(threads.get());
    }
    let pool = pool.build()?;
    let start = Instant::now();
    // A `Failure` cannot cross threads here, but its text can.
    let input = pool.install(|| Input::read(&args.mesh).map_err(|e| e.to_string()))?;
    let read = start.elapsed().as_secs_f64();
    heading::print()?;
    output::line(
        "One process, one encode. *Peak resident*: the most memory that the process had at any time (VmHWM), reading and \
         checking the mesh included. Equal hashes are equal files.\n",
    )?;
    output::head(&COLUMNS, 2)?;
    let (asset, seconds) =
        pool.install(|| input.encode(&EncodeOptions::preset(args.preset)).map_err(|e| e.to_string()))?;
    let peak = peak_resident_kib()?;
    output::row(&[
        input.name.clone(),
        args.preset.name().into(),
        pool.current_num_threads().to_string(),
        asset.face_count().to_string(),
        format!("{read:.2}"),
        format!("{seconds:.2}"),
        format!("{:.0}", peak as f64 / 1024.0),
        mb(asset.as_bytes().len()),
        format!("`{}`", blake3::hash(asset.as_bytes()).to_hex()),
    ])
}

/// Largest resident size of this process since its start, or since the last reset, KiB.
pub fn peak_resident_kib() -> Result<u64, Failure> {
    let path = "/proc/self/status";
    let text = fs::read_to_string(path).map_err(|e| format!("cannot read {path}, which Linux has: {e}"))?;
    let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let size = line.and_then(|l| l.trim().strip_suffix("kB")).and_then(|n| n.trim().parse().ok());
    size.ok_or_else(|| format!("{path} has no line `VmHWM: … kB`").into())
}
