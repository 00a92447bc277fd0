//! `tesdf-lab record RUN`: keeps some poses of a run, for measurements on other machines.
use std::path::{Path, PathBuf};

use tesdf_sim::scene_file::LoadedScene;

use super::poses::{PoseFile, VERSION, pose};
use tesdf_cli::terminal::output::{self, Consent};
use tesdf_cli::terminal::report::{self, Failure, count};
use tesdf_cli::terminal::run_file;

/// Arguments of `tesdf-lab record`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Run (.tesrun)
    pub run: PathBuf,
    /// The scene file of the run
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Output file, JSON; an existing file is replaced, a pipe or device is written to
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// Number of frames, evenly spaced from the beginning to the end of the run
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub frames: u32,
}

/// Writes a file of poses with the bodies of a scene.
///
/// # Errors
/// A file cannot be read, or the bodies of the scene are not those of the run.
pub fn run(args: &Args) -> Result<(), Failure> {
    let output = output::open(&args.output, &[args.run.clone(), args.scene.clone()], args.consent)?;
    let record = run_file::open(&args.run)?;
    let loaded = LoadedScene::read(&args.scene).map_err(Failure::new)?;
    let names = loaded.scene.bodies.iter().map(|body| body.get_ref().name.as_str());
    if !names.eq(record.bodies.iter().map(String::as_str)) {
        let (scene, run) = (args.scene.display(), args.run.display());
        return Err(Failure::new(format!("{scene}: its bodies are not those of {run}"))
            .hint("give the scene file that the run was made with"));
    }
    let last = record.steps();
    let frames = u64::from(args.frames).min(last + 1);
    let step = |frame: u64| (frame * last / (frames - 1).max(1)) as usize;
    let poses_of = |step| {
        let poses = (0..record.bodies.len()).map(|body| record.pose(step, body));
        poses.map(|p| p.map(|p| pose(p.translation, p.rotation))).collect::<Option<Vec<_>>>()
    };
    let frames = (0..frames).map(step).map(poses_of).collect::<Option<Vec<_>>>();
    let frames = frames.ok_or_else(|| Failure::new(format!("{}: a pose is missing", args.run.display())))?;
    let file = PoseFile {
        tesdf_poses: VERSION,
        contact_distance: loaded.scene.detector.contact_distance.unwrap_or(0.0),
        scene: Some(relative(&args.scene, &args.output)?),
        bodies: Vec::new(),
        instances: Vec::new(),
        frames,
    };
    output::write(&output, &serde_json::to_vec(&file).map_err(Failure::new)?)?;
    let instances = count(record.bodies.len(), "instance");
    let frames = count(file.frames.len(), "frame");
    report::text(&format!("{}: {instances}, {frames}\n", args.output.display()))?;
    Ok(())
}

/// The path of a file, from the folder of another file.
fn relative(file: &Path, from: &Path) -> Result<PathBuf, Failure> {
    let absolute =
        |path: &Path| std::path::absolute(path).map_err(|e| Failure::new(format!("{}: {e}", path.display())));
    let (file, from) = (absolute(file)?, absolute(from)?);
    let common = file.components().zip(from.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(common + 1).map(|_| "..");
    Ok(up.collect::<PathBuf>().join(file.components().skip(common).collect::<PathBuf>()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_lead_from_file_to_file() {
        let path = |file: &str, from: &str| relative(Path::new(file), Path::new(from)).unwrap();
        assert_eq!(path("/a/scenes/s.toml", "/a/data/poses/s.json"), Path::new("../../scenes/s.toml"));
        assert_eq!(path("/a/s.toml", "/a/s.json"), Path::new("s.toml"));
    }
}
