//! `tesdf-lab record RUN`: keeps some poses of a run, for measurements on other machines.
use std::path::{Path, PathBuf};

use tesdf_sim::scene_file::LoadedScene;

use super::poses::{FileArgs, PoseFile, VERSION, pose};
use crate::scenes::criteria;
use tesdf_cli::terminal::report::Failure;
use tesdf_cli::terminal::run_file;

/// Arguments of `tesdf-lab record`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Run (.tesrun)
    pub run: PathBuf,
    /// The scene file of the run
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Where the poses go.
    #[command(flatten)]
    pub file: FileArgs,
}

/// Writes a file of poses with the bodies of a scene.
///
/// # Errors
/// A file cannot be read, or the bodies of the scene are not those of the run.
pub fn run(args: &Args) -> Result<(), Failure> {
    let output = args.file.open(&[args.run.clone(), args.scene.clone()])?;
    let record = run_file::open(&args.run)?;
    let loaded = LoadedScene::read_with(&args.scene, &criteria()).map_err(Failure::new)?;
    let names = loaded.scene.bodies.iter().map(|body| body.get_ref().name.as_str());
    if !names.eq(record.bodies.iter().map(String::as_str)) {
        let (scene, run) = (args.scene.display(), args.run.display());
        return Err(Failure::new(format!("{scene}: its bodies are not those of {run}"))
            .hint("give the scene file that the run was made with"));
    }
    let last = record.steps();
    let frames = u64::from(args.file.frames).min(last + 1);
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
        scene: Some(relative(&args.scene, &args.file.output)?),
        bodies: Vec::new(),
        instances: Vec::new(),
        frames,
    };
    args.file.write(&output, &file)
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
