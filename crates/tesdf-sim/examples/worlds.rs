//! Many worlds of a scene on one thread and on more: how many steps a second they make.
//!
//! `cargo run --release -p tesdf-sim --example worlds -- [SCENE] [WORLDS] [STEPS] [THREADS]`
use std::error::Error;
use std::time::Instant;

use rayon::ThreadPoolBuilder;
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Dynamics, Mass, World, Worlds};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: usize| arguments.get(k).map_or(Ok(default), |text| text.parse());
    let peg = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/peg-in-hole.toml");
    let scene = LoadedScene::read(arguments.first().map_or(peg, String::as_str))?;
    let (count, steps, most) = (number(1, 256)?, number(2, 10)?, number(3, 2)?);

    let world = World::new(&scene.scene, scene.newton(scene.system()?)?)?;
    let mut worlds = Worlds::new(&world, count);
    // No two begin alike: free bodies move at up to 1 mm/s.
    for (k, world) in worlds.as_mut_slice().iter_mut().enumerate() {
        let mut states = world.first_states().to_vec();
        for (state, mass) in states.iter_mut().zip(world.first_masses()) {
            if matches!(mass, Mass::Free(_)) {
                state.linear.x += 1e-3 * k as f64 / count as f64;
            }
        }
        world.reset(Some(states))?;
    }
    let (mut single, mut last) = (None, None);
    for threads in [1, most] {
        let mut worlds = worlds.clone();
        let (start, processor) = (Instant::now(), processor_time());
        ThreadPoolBuilder::new().num_threads(threads).build()?.install(|| worlds.step(steps as u64))?;
        let (wall, used) = (start.elapsed().as_secs_f64(), processor_time() - processor);
        let rate = (count * steps) as f64 / wall;
        println!(
            "{count} worlds, {steps} steps, {threads} threads: {rate:.1} steps a second, {:.2} times that of one \
             thread; {:.3} ms of processor time a step",
            rate / *single.get_or_insert(rate),
            1e3 * used / (count * steps) as f64
        );
        // The same bytes on any number of threads.
        let states: Vec<_> =
            worlds.as_slice().iter().map(|world| world.engine().system().states().to_vec()).collect();
        assert!(last.replace(states.clone()).is_none_or(|before| before == states));
    }
    Ok(())
}

/// Of all threads of this process, s; 0 where the system does not tell it.
fn processor_time() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // In hundredths of a second, behind the name of the program.
    let fields = text.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}
