//! A thousand worlds, each with a gear and a floor: an instance costs its state only.
//!
//! `cargo run --release --example many_worlds -- [WORLDS]`
use std::error::Error;
use std::path::Path;
use std::time::Instant;

use tesdf::Progress;
use tesdf::asset::about::Source;
use tesdf::collide::{CollideOptions, Instance, Mode, Pose, Scene, Shape, detect};
use tesdf::encode::{EncodeOptions, Preset, encode};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, read};

fn main() -> Result<(), Box<dyn Error>> {
    let worlds: u32 = std::env::args().nth(1).map_or(Ok(1000), |n| n.parse())?;
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/chain_link.obj");
    let solid = SolidMesh::new(read(Path::new(path))?.mesh)?;
    let options = EncodeOptions::preset(Preset::Fast);
    let link = encode(&solid, &Source::default(), &options, &Progress::default())?;

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
        found.contacts.len(),
        1e3 * start.elapsed().as_secs_f64()
    );
    // Sorted by world: the last world's link is the deepest.
    let deepest =
        found.contacts.iter().min_by(|x, y| x.distance.total_cmp(&y.distance)).ok_or("no contact")?;
    assert_eq!(deepest.instance_a.0 / 2, worlds - 1);

    // Instances come and go; ids stay.
    scene.remove(&[ids.start])?;
    let without = detect(&scene, &CollideOptions::with_mode(Mode::Node))?;
    assert!(without.contacts.iter().all(|c| c.instance_a != ids.start && c.instance_b != ids.start));
    Ok(())
}
