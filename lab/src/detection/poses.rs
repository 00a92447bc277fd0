//! Files of poses: bodies, and the poses of their instances in each frame.
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use tesdf::glam::{DQuat, DVec3};
use tesdf::save::Destination;

use tesdf_cli::terminal::output::{self, Consent};
use tesdf_cli::terminal::parse;
use tesdf_cli::terminal::report::{self, Failure, count};

/// The version that this build writes and reads.
pub const VERSION: u32 = 1;

/// A file of poses, in JSON. Lengths are in the unit of the meshes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseFile {
    /// [`VERSION`].
    pub tesdf_poses: u32,
    /// Contacts are detected up to this signed distance.
    pub contact_distance: f64,
    /// The scene file whose bodies these poses are of, relative to the folder of this file. Then
    /// `bodies` and `instances` are empty.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<PathBuf>,
    /// The bodies: mesh files or `.tesdf` files, relative to the folder of this file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<PathBuf>,
    /// For each instance, its body and its world.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instances: Vec<(usize, u32)>,
    /// For each frame and instance: the translation and the unit quaternion x y z w.
    pub frames: Vec<Vec<[f64; 7]>>,
}

/// Scenes of the generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scene {
    /// A nut on its bolt, within the clearance of 50 µm
    BoltNut,
    /// A lobed peg that enters its hole, with 100 µm of clearance
    PegHole,
    /// 128 shafts in random poses, with deep overlaps
    Shafts,
    /// The same shafts in a fifth of the space, like the start of a pile
    Pile,
}

/// Arguments of `tesdf-lab poses`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The scene
    #[arg(value_enum)]
    pub scene: Scene,
    /// Where the poses go.
    #[command(flatten)]
    pub file: FileArgs,
    /// Seed of the random poses
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    pub seed: u64,
    /// Contacts are detected up to this signed distance [default: 0.2 mm, for shafts and a pile 0]
    #[arg(long, value_name = "D", value_parser = parse::length)]
    pub contact_distance: Option<f64>,
    /// Folder of the meshes
    #[arg(long, value_name = "FOLDER", default_value = "data/procedural")]
    pub data: PathBuf,
}

/// A file of poses that is written.
#[derive(clap::Args, Debug)]
pub struct FileArgs {
    /// Output file, JSON; an existing file is replaced, a pipe or device is written to
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// Number of frames; those of a run are evenly spaced from its beginning to its end
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub frames: u32,
}

impl FileArgs {
    /// Opens the output, which is none of the `inputs`.
    ///
    /// # Errors
    /// It cannot be written, or is an input.
    pub fn open(&self, inputs: &[PathBuf]) -> Result<Destination, Failure> {
        output::open(&self.output, inputs, self.consent)
    }

    /// Writes the poses, and prints how many they are.
    ///
    /// # Errors
    /// The output or stdout cannot be written.
    pub fn write(&self, destination: &Destination, file: &PoseFile) -> Result<(), Failure> {
        output::write(destination, &serde_json::to_vec(file).map_err(Failure::new)?)?;
        let instances = count(file.frames.first().map_or(0, Vec::len), "instance");
        let frames = count(file.frames.len(), "frame");
        report::text(&format!("{}: {instances}, {frames}\n", self.output.display()))
    }
}

/// Writes a file of poses.
///
/// # Errors
/// The file cannot be written, or there is no current folder.
pub fn run(args: &Args) -> Result<(), Failure> {
    let data =
        std::path::absolute(&args.data).map_err(|e| Failure::new(format!("{}: {e}", args.data.display())))?;
    let mut file =
        args.scene.poses(&data, args.file.frames as usize, &mut fastrand::Rng::with_seed(args.seed));
    file.contact_distance = args.contact_distance.unwrap_or(file.contact_distance);
    args.file.write(&args.file.open(&file.bodies)?, &file)
}

impl Scene {
    fn poses(self, data: &Path, frames: usize, random: &mut fastrand::Rng) -> PoseFile {
        let file = |bodies: &[&str], instances, contact_distance, frames| PoseFile {
            tesdf_poses: VERSION,
            contact_distance,
            scene: None,
            bodies: bodies.iter().map(|name| data.join(name)).collect(),
            instances,
            frames,
        };
        let still = pose(DVec3::ZERO, DQuat::IDENTITY);
        match self {
            Self::BoltNut => {
                // A shift along the axis rotates the nut according to the pitch of 2 mm.
                let frame = |_| {
                    let z = random.f64() * 0.01;
                    let angle = z / 0.002 * std::f64::consts::TAU;
                    let aside = 2e-5 * (in_cube(random) * DVec3::new(1.0, 1.0, 0.5));
                    vec![still, pose(DVec3::Z * (0.004 + z) + aside, DQuat::from_rotation_z(angle))]
                };
                let bodies = ["iso_m16_bolt_24k.obj", "iso_m16_nut_c50.obj"];
                let frames = (0..frames).map(frame).collect();
                file(&bodies, vec![(0, 0), (1, 0)], 2e-4, frames)
            }
            Self::PegHole => {
                // On the floor of the hole the peg stands 5 mm up.
                let frame = |_| {
                    let aside = 4e-5 * (in_cube(random) * DVec3::new(1.0, 1.0, 0.0));
                    vec![still, pose(aside + DVec3::Z * (0.006 + 0.02 * random.f64()), DQuat::IDENTITY)]
                };
                let bodies = ["lobed_hole_c100.obj", "lobed_peg.obj"];
                let frames = (0..frames).map(frame).collect();
                file(&bodies, vec![(0, 0), (1, 0)], 2e-4, frames)
            }
            Self::Shafts | Self::Pile => {
                let half = if self == Self::Pile { PILE } else { SHAFTS };
                let frame =
                    |_| (0..128).map(|_| pose(half * in_cube(random), rotation(random))).collect::<Vec<_>>();
                let instances = vec![(0, 0); 128];
                let frames = (0..frames).map(frame).collect();
                file(&["shaft_keyway.obj"], instances, 0.0, frames)
            }
        }
    }
}

/// Half of the side of the cube that contains the centres of the 128 shafts, m.
const SHAFTS: f64 = 0.24;
/// The same for a pile.
const PILE: f64 = 0.144;

/// A pose as the file has it.
pub fn pose(p: DVec3, q: DQuat) -> [f64; 7] {
    [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
}

/// A point that is uniform in the cube from -1 to 1.
pub fn in_cube(random: &mut fastrand::Rng) -> DVec3 {
    let mut between = || 2.0 * random.f64() - 1.0;
    DVec3::new(between(), between(), between())
}

/// A rotation that is uniform over all rotations.
pub fn rotation(random: &mut fastrand::Rng) -> DQuat {
    loop {
        let v = in_cube(random);
        let q = DQuat::from_xyzw(v.x, v.y, v.z, 2.0 * random.f64() - 1.0);
        if (0.01..1.0).contains(&q.length_squared()) {
            return q.normalize();
        }
    }
}
