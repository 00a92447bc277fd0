//! `tesdf encode-all FOLDER|LIST -o OUT`: encodes many meshes.
//!
//! The name of an asset is a hash of all that its bytes depend on. An asset that is there and whole
//! is therefore the right one, and the command may be interrupted and run again, also by several
//! processes on one folder.
pub(crate) mod file_names;
mod job;
mod manifest;
pub(crate) mod meshes;
mod shard;

use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::Serialize;
use tesdf::Progress;
use tesdf::encode::DomainChoice;

use crate::encode::choices::ChoiceArgs;
use crate::terminal::interrupt;
use crate::terminal::mesh_file::CadArgs;
use crate::terminal::output::{self, Consent};
use crate::terminal::parse;
use crate::terminal::progress::Bar;
use crate::terminal::report::{self, Failure, Outcome};
use job::{Done, Job, State};
use manifest::{Manifest, Times};
use meshes::Mesh;
pub use shard::Shard;

/// Arguments of `tesdf encode-all`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Folder of meshes, with its subfolders, or a text file with the path of one mesh on each
    /// line; STEP, IGES and BREP files are only taken from a list
    #[arg(value_name = "FOLDER|LIST", value_parser = parse::input())]
    pub meshes: PathBuf,
    /// Folder of the assets and the manifest; it is made if it does not exist
    #[arg(short, long, value_name = "FOLDER", value_parser = parse::folder())]
    pub output: PathBuf,
    /// The options of the encoder.
    #[command(flatten)]
    pub choices: ChoiceArgs,
    /// How finely CAD files become triangles.
    #[command(flatten)]
    pub cad: CadArgs,
    /// Encode only one of N parts of the meshes, number I from 1 to N; the path of a mesh decides
    /// its part
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Number of meshes that are in memory at the same time; the threads are divided among them
    /// [default: as many as threads]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Number of threads; the files do not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// The output of `--json`.
#[derive(Serialize)]
struct Report<'a> {
    manifest: String,
    times: String,
    encoded: usize,
    present: usize,
    failed: usize,
    bytes: u64,
    seconds: f64,
    failures: Vec<Broken<'a>>,
}

#[derive(Serialize)]
struct Broken<'a> {
    mesh: &'a str,
    error: &'a str,
}

/// Encodes all meshes whose assets are not there, and writes the manifest.
///
/// A mesh that cannot be encoded is listed in the manifest, and the exit code is 1.
///
/// # Errors
/// The meshes cannot be listed, options exclude each other, the output folder cannot be written, or
/// Ctrl-C was pressed. Assets that are complete stay.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let meshes = meshes::find(&args.meshes, args.shard, &args.cad)?;
    let batch = Batch {
        meshes,
        from: &args.meshes,
        output: &args.output,
        choices: &args.choices,
        cad: args.cad.clone(),
        shard: args.shard,
        jobs: args.jobs,
        threads: args.threads,
        json: args.json,
    };
    batch.run(Consent { force: false })
}

/// Meshes, and how they are encoded.
pub(crate) struct Batch<'a> {
    pub meshes: Vec<Mesh>,
    /// The folder, list, mesh file or robot description that names the meshes.
    pub from: &'a Path,
    /// Folder of the assets and the manifest.
    pub output: &'a Path,
    pub choices: &'a ChoiceArgs,
    pub cad: CadArgs,
    pub shard: Option<Shard>,
    /// Number of meshes that are in memory at the same time.
    pub jobs: Option<u16>,
    pub threads: Option<u16>,
    /// Whether the result is printed as JSON.
    pub json: bool,
}

impl Batch<'_> {
    /// Encodes all meshes whose assets are not there, and writes the manifest.
    ///
    /// # Errors
    /// Options exclude each other, the output folder cannot be written, or Ctrl-C was pressed.
    pub fn run(&self, consent: Consent) -> Result<Outcome, Failure> {
        if let DomainChoice::File(path) = &self.choices.domain {
            return Err(Failure::new(format!(
                "--domain {}: the tetrahedra of a file belong to one mesh; expected bisection or gmsh",
                path.display()
            ))
            .hint("`tesdf encode --domain FILE` encodes that mesh"));
        }
        let job = Job::new(self.choices, self.cad.clone(), self.output)?;
        let meshes = &self.meshes;
        fs::create_dir_all(self.output)
            .map_err(|e| Failure::new(format!("cannot make the folder {}: {e}", self.output.display())))?;
        let [manifest, times] =
            ["manifest", "times"].map(|name| self.output.join(manifest::file_name(name, self.shard)));
        let inputs = [self.from.to_path_buf()];
        let (to_manifest, to_times) =
            (output::open(&manifest, &inputs, consent)?, output::open(&times, &inputs, consent)?);

        let start = Instant::now();
        let threads = self.threads.map_or_else(cores, usize::from);
        let jobs = self.jobs.map_or(threads, usize::from).min(meshes.len()).max(1);
        let done = all(&job, meshes, &pools(threads, jobs)?)?;
        let (report, record) = Manifest::new(&job, self.shard, meshes, &done);
        output::write(&to_manifest, &manifest::to_json(&report)?)?;
        let seconds = start.elapsed().as_secs_f64();
        let spent = Times { seconds, threads, jobs, meshes: record };
        output::write(&to_times, &manifest::to_json(&spent)?)?;
        print(self, &report, &done, [&manifest, &times], seconds)
    }
}

fn cores() -> usize {
    thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

/// A pool for each mesh that is encoded at the same time. In one pool for all, a thread that waits
/// for a part of its mesh could begin another mesh, and would finish the first one later.
fn pools(threads: usize, jobs: usize) -> Result<Vec<ThreadPool>, Failure> {
    let of = |job: usize| (threads / jobs + usize::from(job < threads % jobs)).max(1);
    let pool = |job| ThreadPoolBuilder::new().num_threads(of(job)).build();
    let pools: Result<_, _> = (0..jobs).map(pool).collect();
    pools.map_err(report::no_threads)
}

/// Encodes the meshes, each in one of the pools.
///
/// # Errors
/// Ctrl-C was pressed, or no thread can be started. Where some cannot, the others do their work.
fn all(job: &Job, meshes: &[Mesh], pools: &[ThreadPool]) -> Result<Vec<Done>, Failure> {
    let interrupted = interrupt::flag();
    // The large ones first: the last mesh to end is then a small one, and few threads are idle.
    let mut order: Vec<_> = (0..meshes.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(meshes[i].bytes));
    let whole = meshes.iter().map(weight).sum::<u64>().max(1) as f64;
    // Encodings share it, and use only its request to stop.
    let stop = Progress::default();
    let (next, ended) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let found = Mutex::new((meshes.iter().map(|_| None).collect::<Vec<Option<Done>>>(), 0));
    let lock = || found.lock().unwrap_or_else(PoisonError::into_inner);
    let work = |pool: &ThreadPool| {
        while !interrupted.load(Ordering::Relaxed)
            && let Some(&i) = order.get(next.fetch_add(1, Ordering::Relaxed))
        {
            let done = pool.install(|| job.run(&meshes[i], &stop));
            // The error may be that it was asked to stop.
            if done.state == State::Failed && interrupted.load(Ordering::Relaxed) {
                break;
            }
            let mut found = lock();
            found.0[i] = Some(done);
            found.1 += weight(&meshes[i]);
        }
    };
    thread::scope(|scope| {
        let (main, mut started) = (thread::current(), 0);
        for pool in pools {
            let (work, ended, main) = (&work, &ended, main.clone());
            let of_pool = move || {
                work(pool);
                ended.fetch_add(1, Ordering::Release);
                main.unpark();
            };
            match thread::Builder::new().spawn_scoped(scope, of_pool) {
                Ok(_) => started += 1,
                Err(e) if started == 0 => return Err(report::no_threads(e)),
                Err(_) => break,
            }
        }
        let bar = Bar::new("encoding");
        while ended.load(Ordering::Acquire) < started {
            if interrupted.load(Ordering::Relaxed) {
                stop.cancel();
            }
            bar.set(lock().1 as f64 / whole);
            thread::park_timeout(Duration::from_millis(100));
        }
        Ok(())
    })?;
    let (found, _) = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    let count = found.iter().flatten().count();
    // Without Ctrl-C, all are done.
    found.into_iter().collect::<Option<_>>().ok_or_else(|| {
        Failure::new(format!("interrupted; {count} of {} meshes are done", meshes.len()))
            .hint("the same command encodes the others")
    })
}

/// The share of a mesh in the progress. An empty file counts, too.
fn weight(mesh: &Mesh) -> u64 {
    mesh.bytes + 1
}

/// Number of failures that are printed; the manifest has all.
const SHOWN: usize = 10;

fn print(
    batch: &Batch<'_>,
    manifest: &Manifest<'_>,
    done: &[Done],
    [path, times]: [&Path; 2],
    seconds: f64,
) -> Result<Outcome, Failure> {
    let count = |state| done.iter().filter(|done| done.state == state).count();
    let [encoded, present, failed] = [State::Encoded, State::Present, State::Failed].map(count);
    let outcome = if failed == 0 { Outcome::Good } else { Outcome::NotGood };
    let failures: Vec<_> = manifest.failures().map(|(mesh, error)| Broken { mesh, error }).collect();
    for failure in failures.iter().take(SHOWN) {
        report::warning(failure.error);
    }
    let path = path.display();
    if failed > SHOWN {
        report::warning(&format!("... {failed} in all; {path} lists them"));
    }
    let bytes = manifest.bytes();
    if batch.json {
        let (manifest, times) = (path.to_string(), times.display().to_string());
        report::json(&Report { manifest, times, encoded, present, failed, bytes, seconds, failures })?;
        return Ok(outcome);
    }
    report::table(&[
        ("meshes", format!("{} in {}", done.len(), batch.from.display())),
        ("encoded", format!("{encoded} now, {present} before")),
        ("failed", failed.to_string()),
        ("size", report::size(usize::try_from(bytes).unwrap_or(usize::MAX))),
        ("manifest", path.to_string()),
        ("time", format!("{seconds:.1} s")),
    ])?;
    Ok(outcome)
}
