//! `tesdf-lab frank-wolfe`: the error of Frank–Wolfe iterations.
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use tesdf::base::Named as _;
use tesdf::encode::EncodeOptions;
use tesdf_cli::terminal::parse;

use fastrand::Rng;
use tesdf::collide::{CollideOptions, Contact, FaceOptions, Instance, Mode, Pose, Scene, detect};
use tesdf::glam::{DQuat, DVec3};

use super::input::{Input, Preset};
use super::{Failure, heading, output};

/// Arguments of `tesdf-lab frank-wolfe`.
#[derive(clap::Args)]
pub struct Args {
    /// Two mesh files in one frame, such as a bolt and its nut
    #[arg(num_args = 2, required = true)]
    meshes: Vec<PathBuf>,
    /// Preset of the encoder
    #[arg(long, value_parser = parse::named::<Preset>(), default_value_t = Preset::Default)]
    preset: Preset,
    /// Number of random poses of the second body
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    poses: u32,
    /// Maximum offset of a pose in each direction, in the meshes' unit
    #[arg(long, default_value_t = 3e-4)]
    aside: f64,
    /// Contacts up to this signed distance, in the meshes' unit
    #[arg(long, default_value_t = 1e-4)]
    contact_distance: f64,
    /// Seed of the random poses
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

const ITERATIONS: [u32; 5] = [4, 8, 16, 32, 64];
const COLUMNS: [&str; 8] =
    ["where", "K", "polygons", "p50", "p90", "p99", "largest", "beyond the contact distance"];

/// The instance of the face, the face and the cell.
type Key = (u32, u32, Option<u32>);

fn by_key(contacts: &[Contact]) -> BTreeMap<Key, f64> {
    contacts.iter().map(|c| ((c.instance_a.0, c.face_a, c.tet_b), c.distance)).collect()
}

pub fn run(args: &Args) -> Result<(), Failure> {
    heading::print()?;
    let inputs = args.meshes.iter().map(|path| Input::read(path)).collect::<Result<Vec<_>, _>>()?;
    let mut scene = Scene::new();
    let mut ids = Vec::new();
    for input in &inputs {
        let (asset, _) = input.encode(&EncodeOptions::preset(args.preset))?;
        let shape = scene.add_shape(Arc::new(asset))?;
        ids.push(scene.add(Instance::new(shape, Pose::IDENTITY))?);
    }
    output::line(&format!(
        "{} on {}, preset `{}`: {} poses, offset by up to {} in each coordinate and rotated by up to 0.01 rad, contact \
         distance {}, seed {}. A polygon is the part of a face in a cell. The table covers every polygon that the exact \
         mode reports. It shows by how much the least signed distance of K iterations exceeds the exact one, as a \
         fraction of the diagonal of the body with the field.\n\n\
         - *Inside*: the exact distance is negative.\n\
         - *Beyond the contact distance*: polygons whose distance after K iterations is above the contact distance, so \
         that they are not reported. The other columns leave them out.\n",
        inputs[1].name,
        inputs[0].name,
        args.preset.name(),
        args.poses,
        args.aside,
        args.contact_distance,
        args.seed
    ))?;
    let diagonals = [0, 1].map(|i| inputs[i].solid.mesh().diagonal());
    let mut random = Rng::with_seed(args.seed);
    let mut signed = || 2.0 * random.f64() - 1.0;
    // For exact distances outside and inside, and for each K: the errors, and the number of
    // polygons beyond the contact distance.
    let mut errors: [[(Vec<f64>, usize); 5]; 2] = Default::default();
    for _ in 0..args.poses {
        let translation = args.aside * DVec3::new(signed(), signed(), signed());
        let turn = 0.01 * DVec3::new(signed(), signed(), signed()) / 3f64.sqrt();
        let pose = Pose::new(translation, DQuat::from_scaled_axis(turn))?;
        scene.set_poses(&[(ids[1], pose)])?;
        let find = |mode| {
            let contact_distance = args.contact_distance;
            detect(&scene, &CollideOptions { contact_distance, ..CollideOptions::with_mode(mode) })
        };
        let exact = by_key(find(Mode::exact())?.as_slice());
        for (k, &iterations) in ITERATIONS.iter().enumerate() {
            let found = by_key(find(Mode::Face { iterations, faces: FaceOptions::default() })?.as_slice());
            for (key, least) in &exact {
                let (of, beyond) = &mut errors[usize::from(*least < 0.0)][k];
                match found.get(key) {
                    Some(distance) => of.push((distance - least) / diagonals[1 - key.0 as usize]),
                    None => *beyond += 1,
                }
            }
        }
    }
    output::head(&COLUMNS, 1)?;
    for (side, of_side) in ["outside", "inside"].iter().zip(&mut errors) {
        for ((all, beyond), iterations) in of_side.iter_mut().zip(ITERATIONS) {
            all.sort_by(f64::total_cmp);
            let at = |share: f64| {
                let place = ((all.len() as f64 * share) as usize).min(all.len().saturating_sub(1));
                all.get(place).map_or("none".into(), |e| format!("{:.1e}", e.max(0.0)))
            };
            output::row(&[
                (*side).into(),
                iterations.to_string(),
                (all.len() + *beyond).to_string(),
                at(0.5),
                at(0.9),
                at(0.99),
                at(1.0),
                beyond.to_string(),
            ])?;
        }
    }
    Ok(())
}
