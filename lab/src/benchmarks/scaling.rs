//! `tesdf-lab scaling`: time of a detection as a scene grows.
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use tesdf::encode::EncodeOptions;

use tesdf::collide::{CollideOptions, Contacts, Instance, Mode, Pose, Scene, Shape, detect};
use tesdf::glam::DVec3;

use super::input::{Input, Preset};
use super::{Failure, heading, output};

/// Arguments of `tesdf-lab scaling`.
#[derive(clap::Args)]
pub struct Args {
    /// The mesh of the row; each instance touches the next one
    #[arg(long, default_value = "data/procedural/chain_link.obj")]
    link: PathBuf,
    /// The nut of each world
    #[arg(long, default_value = "data/procedural/iso_m16_nut_c50.obj")]
    nut: PathBuf,
    /// The bolt of each world
    #[arg(long, default_value = "data/procedural/iso_m16_bolt_24k.obj")]
    bolt: PathBuf,
    /// Number of repetitions; the fastest one counts
    #[arg(long, default_value_t = 5)]
    repeats: usize,
    /// Leave out scenes of more instances
    #[arg(long, value_name = "N", default_value_t = 2048)]
    max_instances: usize,
}

const COLUMNS: [&str; 7] = [
    "scene",
    "instances",
    "contacts",
    "ms",
    "µs per contact",
    "time per contact, against the smallest scene",
    "instances, pipeline buffers and contacts, MB",
];

/// Numbers of instances in a row.
const ROWS: [usize; 4] = [2, 16, 128, 1024];
/// Numbers of worlds in node mode and in exact mode. In exact mode 64 worlds have 3 million
/// contacts.
const WORLDS: [[u32; 4]; 2] = [[1, 16, 128, 1024], [1, 4, 16, 64]];
/// Position of the nut on the bolt, and the contact distance, m.
const NUT_AT: DVec3 = DVec3::new(0.0, 0.0, 0.01);
const CONTACT_DISTANCE: f64 = 5e-5;

pub fn run(args: &Args) -> Result<(), Failure> {
    let load = |path| -> Result<Shape, Failure> {
        Ok(Shape::Mesh(Arc::new(Input::read(path)?.encode(&EncodeOptions::preset(Preset::Fast))?.0)))
    };
    let (link, nut, bolt) = (load(&args.link)?, load(&args.nut)?, load(&args.bolt)?);
    heading::print()?;
    output::line(
        "*Row*: instances of one mesh in a row, each overlapping the next by a fiftieth of its length. *Worlds*: a nut on \
         its bolt in each world. Nodes and exact minima are measured; the time is that of the fastest repetition.\n",
    )?;
    output::head(&COLUMNS, 1)?;
    let modes = [("node", Mode::Node), ("exact", Mode::exact())];
    for (name, mode) in modes {
        let options = CollideOptions::with_mode(mode);
        let scenes = ROWS.map(|n| (n, n));
        print(&format!("row, {name}"), args, &options, scenes, |n| row(&link, n))?;
    }
    for ((name, mode), worlds_of_mode) in modes.into_iter().zip(WORLDS) {
        let options =
            CollideOptions { contact_distance: CONTACT_DISTANCE, ..CollideOptions::with_mode(mode) };
        let scenes = worlds_of_mode.map(|n| (2 * n as usize, n));
        print(&format!("worlds, {name}"), args, &options, scenes, |n| worlds(&nut, &bolt, n))?;
    }
    Ok(())
}

/// `sizes` are numbers of instances, and what `make` makes such a scene from.
fn print<Size>(
    name: &str,
    args: &Args,
    options: &CollideOptions,
    sizes: [(usize, Size); 4],
    make: impl Fn(Size) -> Result<Scene, Failure>,
) -> Result<(), Failure> {
    let mut smallest = None;
    for (instances, size) in sizes.into_iter().filter(|(instances, _)| *instances <= args.max_instances) {
        let scene = make(size)?;
        let (contacts, seconds) = quickest(&scene, options, args.repeats)?;
        let each = seconds / contacts.len().max(1) as f64;
        let first = *smallest.get_or_insert(each);
        output::row(&[
            name.into(),
            instances.to_string(),
            contacts.len().to_string(),
            format!("{:.2}", 1e3 * seconds),
            format!("{:.2}", 1e6 * each),
            format!("{:.2}", each / first),
            format!("{:.2}", (scene.instance_bytes() + contacts.statistics.bytes) as f64 / 1e6),
        ])?;
    }
    Ok(())
}

fn quickest(scene: &Scene, options: &CollideOptions, repeats: usize) -> Result<(Contacts, f64), Failure> {
    // The first detection also builds data that an asset builds on first use.
    let mut found = detect(scene, options)?;
    let mut seconds = f64::INFINITY;
    for _ in 0..repeats.max(1) {
        let start = Instant::now();
        found = detect(scene, options)?;
        seconds = seconds.min(start.elapsed().as_secs_f64());
    }
    Ok((found, seconds))
}

fn row(shape: &Shape, n: usize) -> Result<Scene, Failure> {
    let mut scene = Scene::new();
    let id = scene.add_shape(shape.clone())?;
    let step = 0.98 * shape.bounds().extent().x;
    let at = |i: usize| Instance::new(id, Pose::at(DVec3::X * (step * i as f64)));
    scene.add_many(&(0..n).map(at).collect::<Vec<_>>())?;
    Ok(scene)
}

fn worlds(nut: &Shape, bolt: &Shape, n: u32) -> Result<Scene, Failure> {
    let mut scene = Scene::new();
    let (nut, bolt) = (scene.add_shape(nut.clone())?, scene.add_shape(bolt.clone())?);
    let of_world = |world| {
        [(nut, Pose::at(NUT_AT)), (bolt, Pose::IDENTITY)]
            .map(|(shape, pose)| Instance { world, ..Instance::new(shape, pose) })
    };
    scene.add_many(&(0..n).flat_map(of_world).collect::<Vec<_>>())?;
    Ok(scene)
}
