//! `tesdf-lab heap`: the cost of finding the pairs of a heap of bodies, step by step.
use std::fmt::Write as _;
use std::time::Instant;

use tesdf::collide::{
    CollideError, CollideOptions, Instance, InstanceId, InstancePairs, Pose, Scene, Shape, detect,
    detect_with, instance_pairs,
};
use tesdf::glam::DVec3;
use tesdf_cli::terminal::report::{self, Failure};

use super::poses::{in_cube, rotation};
use super::report::ms;
use crate::heading;

/// Arguments of `tesdf-lab heap`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Numbers of bodies
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "1000,10000,100000", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub bodies: Vec<u32>,
    /// Number of steps; the fastest one counts
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub steps: u32,
    /// Seed of the places and motions
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    pub seed: u64,
}

/// The motion of the bodies from step to step.
#[derive(Clone, Copy)]
enum Motion {
    /// No body moves.
    Still,
    /// Every body trembles by a millionth of its size.
    Tremble,
    /// One body in a hundred moves by a hundredth of its size.
    Some,
    /// Every body moves by a hundredth of its size.
    All,
}

const MOTIONS: [(&str, Motion); 4] = [
    ("none moves", Motion::Still),
    ("all tremble", Motion::Tremble),
    ("1 % move", Motion::Some),
    ("all move", Motion::All),
];

/// The size of a body, and the distance of neighbours in the heap.
const SIZE: f64 = 0.1;

/// Measures the search for pairs and prints a table.
///
/// # Errors
/// Stdout cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut text = heading::lines();
    text += "\n| bodies | motion | pairs | ms, pairs anew | kept | kept, moved ones named | ms, detection anew | with kept pairs |\n\
             |---:|---|---:|---:|---:|---:|---:|---:|\n";
    for &bodies in &args.bodies {
        for (name, motion) in MOTIONS {
            let mut random = fastrand::Rng::with_seed(args.seed);
            let Times { pairs, pairs_anew, kept, named, detection, with_kept } =
                measure(bodies, motion, args.steps, &mut random).map_err(Failure::new)?;
            let _ = writeln!(
                text,
                "| {bodies} | {name} | {pairs} | {pairs_anew:.3} | {kept:.3} | {named:.3} | {detection:.3} | {with_kept:.3} |"
            );
        }
    }
    report::text(&text)?;
    Ok(())
}

/// Times of the fastest step, ms.
struct Times {
    pairs: usize,
    pairs_anew: f64,
    kept: f64,
    named: f64,
    detection: f64,
    with_kept: f64,
}

fn measure(
    bodies: u32,
    motion: Motion,
    steps: u32,
    random: &mut fastrand::Rng,
) -> Result<Times, CollideError> {
    let mut scene = heap(bodies, random)?;
    let options = CollideOptions::default();
    let infinite = f64::INFINITY;
    let mut times = Times {
        pairs: 0,
        pairs_anew: infinite,
        kept: infinite,
        named: infinite,
        detection: infinite,
        with_kept: infinite,
    };
    let [mut kept, mut named, mut with_kept] = [(); 3].map(|()| InstancePairs::new());
    for pairs in [&mut kept, &mut named, &mut with_kept] {
        pairs.update(&scene, &options)?;
    }
    for _ in 0..steps {
        let moved = moved(&scene, motion, random);
        scene.set_poses(&moved)?;
        let ids: Vec<InstanceId> = moved.iter().map(|(id, _)| *id).collect();
        let fewer = |least: &mut f64, work: &mut dyn FnMut() -> Result<usize, CollideError>| {
            let start = Instant::now();
            let found = work()?;
            *least = least.min(ms(start.elapsed()));
            Ok(found)
        };
        times.pairs = fewer(&mut times.pairs_anew, &mut || Ok(instance_pairs(&scene, 0.0, 0.0)?.len()))?;
        fewer(&mut times.kept, &mut || kept.update(&scene, &options).map(|()| 0))?;
        fewer(&mut times.named, &mut || named.update_moved(&scene, &options, &ids).map(|()| 0))?;
        fewer(&mut times.detection, &mut || Ok(detect(&scene, &options)?.len()))?;
        fewer(&mut times.with_kept, &mut || Ok(detect_with(&mut with_kept, &scene, &options)?.len()))?;
    }
    Ok(times)
}

/// Spheres and boxes near the points of a grid, some of which touch.
fn heap(bodies: u32, random: &mut fastrand::Rng) -> Result<Scene, CollideError> {
    let mut scene = Scene::new();
    let ball = scene.add_shape(Shape::Sphere { radius: 0.5 * SIZE })?;
    let cuboid = scene.add_shape(Shape::Box { half_extents: DVec3::new(0.3, 0.25, 0.2) * SIZE })?;
    let side = f64::from(bodies).cbrt().ceil() as u32;
    let place = |k: u32| {
        let at = DVec3::new(f64::from(k % side), f64::from(k / side % side), f64::from(k / side / side));
        let translation = SIZE * (at + 0.05 * in_cube(random));
        let shape = if random.bool() { ball } else { cuboid };
        Ok(Instance::new(shape, Pose::new(translation, rotation(random))?))
    };
    let instances = (0..bodies).map(place).collect::<Result<Vec<_>, CollideError>>()?;
    scene.add_many(&instances)?;
    Ok(scene)
}

fn moved(scene: &Scene, motion: Motion, random: &mut fastrand::Rng) -> Vec<(InstanceId, Pose)> {
    let (one_in, by) = match motion {
        Motion::Still => return Vec::new(),
        Motion::Tremble => (1, 1e-6),
        Motion::Some => (100, 1e-2),
        Motion::All => (1, 1e-2),
    };
    let mut moved = Vec::new();
    for (id, instance) in scene.instances() {
        if random.u32(..one_in) == 0 {
            let translation = instance.pose.translation + by * SIZE * in_cube(random);
            moved.push((id, Pose { translation, ..instance.pose }));
        }
    }
    moved
}
