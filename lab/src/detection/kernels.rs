//! `tesdf-lab kernels`: compiles all kernels with NVRTC.
use std::fmt::Write as _;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;
use tesdf_gpu::GpuError;
use tesdf_gpu::cuda::{self, CudaSource, Resources};
use tesdf_cli::terminal::report::{self, Failure};

/// Arguments of `tesdf-lab kernels`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Architecture to compile for: that of the device, such as sm_90
    #[arg(long, value_name = "sm_…", default_value = "sm_90")]
    pub architecture: String,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// What the machine code of a kernel takes.
#[derive(Serialize)]
struct Row {
    kernel: String,
    threads: u32,
    registers: u32,
    warps: u32,
    stack_bytes: u32,
    spilled_bytes: u32,
    shared_bytes: usize,
    compile_seconds: f64,
}

/// Compiles on all threads, and prints a row for each kernel.
///
/// # Errors
/// NVRTC is missing or refuses a kernel.
pub fn run(args: &Args) -> Result<(), Failure> {
    let sources = cuda::sources().map_err(Failure::new)?;
    let rows: Result<Vec<Row>, _> = sources.par_iter().map(|s| row(s, &args.architecture)).collect();
    let rows = rows.map_err(Failure::new)?;
    if args.json {
        report::json(&rows)?;
        return Ok(());
    }
    let mut text = format!(
        "{:64} threads registers warps stack spilled shared seconds\n",
        format!("kernel ({})", args.architecture)
    );
    for r in &rows {
        let Row { kernel, threads, registers, warps, stack_bytes, spilled_bytes, shared_bytes, .. } = r;
        let _ = writeln!(
            text,
            "{kernel:64} {threads:7} {registers:9} {warps:5} {stack_bytes:5} {spilled_bytes:7} {shared_bytes:6} {:7.2}",
            r.compile_seconds
        );
    }
    report::text(&text)?;
    Ok(())
}

fn row(source: &CudaSource, architecture: &str) -> Result<Row, GpuError> {
    let start = Instant::now();
    let compiled = cuda::compile_ahead(source, architecture)?;
    let compile_seconds = start.elapsed().as_secs_f64();
    let found = compiled.resources.unwrap_or_default();
    let Resources { registers, stack_bytes, spilled_bytes: (stores, loads), .. } = found;
    Ok(Row {
        kernel: source.kernel.clone(),
        threads: source.threads.0,
        registers,
        warps: found.warps(source.threads.0),
        stack_bytes,
        spilled_bytes: stores + loads,
        shared_bytes: source.shared_bytes + found.shared_bytes as usize,
        compile_seconds,
    })
}
