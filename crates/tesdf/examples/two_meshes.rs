//! Contacts between a nut and its bolt, by nodes, by Frank–Wolfe and exactly.
//!
//! `cargo run --release --example two_meshes`
use std::error::Error;

use tesdf::encode::EncodeFileError;
use tesdf::glam::DVec3;
use tesdf::{CollideOptions, Encoder, Instance, Mode, Pose, Preset, Reduction, Scene, TeSdf, detect};

fn load(name: &str) -> Result<TeSdf, EncodeFileError> {
    let path = format!("{}/../../data/procedural/{name}.obj", env!("CARGO_MANIFEST_DIR"));
    Encoder::new().preset(Preset::Fast).encode_file(path)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut scene = Scene::new();
    let nut = scene.add_shape(load("iso_m16_nut_c100")?)?;
    let bolt = scene.add_shape(load("iso_m16_bolt_6k")?)?;
    // The nut is two pitches up the thread and lowered by 0.08 mm. The flanks were 0.05 mm apart;
    // now they overlap.
    let nut = scene.add(Instance::new(nut, Pose::at(DVec3::new(0.0, 0.0, 0.00992))))?;
    let bolt = scene.add(Instance::new(bolt, Pose::IDENTITY))?;

    let mut deepest = Vec::new();
    for (name, mode) in [("node", Mode::Node), ("face", Mode::face()), ("exact", Mode::exact())] {
        let found = detect(&scene, &CollideOptions::with_mode(mode))?;
        let least = found.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
        println!("{name:<5} {} contacts, deepest {least:e} m, {:?}", found.len(), found.statistics);
        deepest.push(least);
    }
    // Faces hold their nodes, and nothing is below the exact minimum.
    assert!(deepest[2] <= deepest[1] + 1e-9 && deepest[1] <= deepest[0] + 1e-9);
    assert!(deepest[2] < 0.0);

    let few = CollideOptions { reduction: Reduction::PerPair(16), ..CollideOptions::default() };
    let found = detect(&scene, &few)?;
    println!("{} contacts are kept, the wrench is within {:?}", found.len(), found.reductions);
    assert!(found.len() <= 16);
    assert!(found.iter().all(|c| [nut, bolt].contains(&c.instance_a)));
    Ok(())
}
