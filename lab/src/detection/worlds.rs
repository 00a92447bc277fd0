//! `tesdf-lab worlds`: many scenes of two bodies at once, for `lab/scripts/python_worlds.py`, which
//! does the same in Python.
use std::path::PathBuf;
use std::time::Instant;

use rayon::ThreadPoolBuilder;
use serde_json::json;
use tesdf::collide::{
    CollideError, CollideOptions, FaceOptions, Instance, InstanceId, ModeName, Pose, Scene, detect,
};
use tesdf::glam::{DQuat, DVec3};
use tesdf_cli::terminal::report::{self, Failure};
use tesdf_cli::terminal::{asset_file, parse};

/// Arguments of `tesdf-lab worlds`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The .tesdf file of the body that rests in each world
    pub fixed: PathBuf,
    /// The .tesdf file of the body that moves in each world
    pub moving: PathBuf,
    /// File of the poses of the moving bodies, one for each world: x y z qx qy qz qw as
    /// little-endian f64
    #[arg(long, value_name = "FILE")]
    pub poses: PathBuf,
    /// Features that are tested
    #[arg(long, value_parser = parse::named::<ModeName>(), default_value_t = ModeName::Node)]
    pub mode: ModeName,
    /// Contacts are detected up to this signed distance
    #[arg(long, value_name = "D", value_parser = parse::length, default_value_t = 0.0)]
    pub contact_distance: f64,
    /// Number of passes; the fastest one counts
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub passes: u32,
    /// Number of threads
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,
}

/// Places the bodies and finds the contacts of all worlds. Prints the seconds of the fastest pass,
/// the number of contacts and the least distance, as JSON.
///
/// # Errors
/// A file cannot be read, or it has no poses.
pub fn run(args: &Args) -> Result<(), Failure> {
    let poses = poses(args)?;
    let mut scene = Scene::new();
    let mut shape =
        |path| -> Result<_, Failure> { scene.add_shape(asset_file::open(path)?).map_err(Failure::new) };
    let shapes = [shape(&args.fixed)?, shape(&args.moving)?];
    let worlds = 0..poses.len() as u32;
    let of =
        |shape| worlds.clone().map(move |world| Instance { world, ..Instance::new(shape, Pose::IDENTITY) });
    let all: Vec<_> = of(shapes[0]).chain(of(shapes[1])).collect();
    let ids = scene.add_many(&all).map_err(Failure::new)?;
    let moving = (ids.start.0 + worlds.end..).map(InstanceId);
    let placed: Vec<_> = moving.zip(poses).collect();

    let mut options = CollideOptions::with_mode(args.mode.with(FaceOptions::default()));
    options.contact_distance = args.contact_distance;
    let pool = ThreadPoolBuilder::new().num_threads(args.threads.into()).build();
    let pool = pool.map_err(|e| Failure::new(format!("cannot start threads: {e}")))?;
    let mut pass = || -> Result<_, CollideError> {
        let start = Instant::now();
        scene.set_poses(&placed)?;
        let found = detect(&scene, &options)?;
        Ok((start.elapsed().as_secs_f64(), found))
    };
    let (mut seconds, mut found) = pool.install(&mut pass).map_err(Failure::new)?;
    for _ in 1..args.passes {
        let again = pool.install(&mut pass).map_err(Failure::new)?;
        (seconds, found) = (seconds.min(again.0), again.1);
    }
    let least = found.iter().map(|contact| contact.distance).fold(f64::INFINITY, f64::min);
    report::json(&json!({ "seconds": seconds, "contacts": found.len(), "least": least }))?;
    Ok(())
}

fn poses(args: &Args) -> Result<Vec<Pose>, Failure> {
    let at = |e: &dyn std::fmt::Display| Failure::new(format!("{}: {e}", args.poses.display()));
    let bytes = std::fs::read(&args.poses).map_err(|e| at(&e))?;
    let (rows, rest) = bytes.as_chunks::<56>();
    if !rest.is_empty() || rows.is_empty() {
        return Err(at(&format!("{} bytes; expected a multiple of 56, seven f64 per pose", bytes.len())));
    }
    rows.iter()
        .map(|row| {
            let number = |k: usize| f64::from_le_bytes(std::array::from_fn(|i| row[8 * k + i]));
            let rotation = DQuat::from_xyzw(number(3), number(4), number(5), number(6));
            Pose::new(DVec3::new(number(0), number(1), number(2)), rotation).map_err(|e| at(&e))
        })
        .collect()
}
