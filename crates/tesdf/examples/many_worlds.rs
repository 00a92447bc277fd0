//! A thousand worlds, each with a gear and a floor: an instance costs its state only.
//!
//! `cargo run --release --example many_worlds -- [WORLDS]`
use std::error::Error;
use std::time::Instant;

use tesdf::glam::DVec3;
use tesdf::{CollideOptions, Encoder, Instance, Mode, Pose, Preset, Scene, Shape, detect};

fn main() -> Result<(), Box<dyn Error>> {
    let worlds: u32 = std::env::args().nth(1).map_or(Ok(1000), |n| n.parse())?;
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/chain_link.obj");
    let link = Encoder::new().preset(Preset::Fast).encode_file(path)?;

    let mut scene = Scene::new();
    let low = link.bounds().min.z;
    let (link, floor) = (scene.add_shape(link)?, scene.add_shape(Shape::Plane)?);
    // Each link is sunk a little deeper into its floor than the one before.
    let sunk = |world: u32| Pose::at(DVec3::Z * (-low - 1e-3 * f64::from(world) / f64::from(worlds)));
    let of_world = |world| {
        [Instance::new(link, sunk(world)), Instance::new(floor, Pose::IDENTITY)]
            .map(|instance| Instance { world, ..instance })
    };
    let ids = scene.add_many(&(0..worlds).flat_map(of_world).collect::<Vec<_>>())?;

    let start = Instant::now();
    let found = detect(&scene, &CollideOptions::with_mode(Mode::Node))?;
    println!(
        "{} instances in {worlds} worlds, {} bytes of state: {} contacts in {:.1} ms",
        2 * worlds,
        scene.instance_bytes(),
        found.len(),
        1e3 * start.elapsed().as_secs_f64()
    );
    // Sorted by world: the last world's link is the deepest.
    let deepest = found.iter().min_by(|x, y| x.distance.total_cmp(&y.distance)).ok_or("no contact")?;
    assert_eq!(deepest.instance_a.0 / 2, worlds - 1);

    // Instances come and go; ids stay.
    scene.remove(&[ids.start])?;
    let without = detect(&scene, &CollideOptions::with_mode(Mode::Node))?;
    assert!(without.iter().all(|c| c.instance_a != ids.start && c.instance_b != ids.start));
    Ok(())
}
