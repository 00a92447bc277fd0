//! How far apart two bodies are, or how deep they overlap: a cube moves down onto another cube.
//!
//! `cargo run --release --example clearance -- [MESH]`; the default is a cube with an edge of
//! 20 mm about the origin.
use std::error::Error;

use tesdf::glam::DVec3;
use tesdf::{ClearanceOptions, Encoder, Instance, Pose, Preset, Scene, clearance};

fn main() -> Result<(), Box<dyn Error>> {
    let cube = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/cube.obj");
    let given = std::env::args_os().nth(1);
    let path = given.clone().unwrap_or(cube.into());
    let asset = Encoder::new().preset(Preset::Fast).encode_file(path)?;
    let height = asset.bounds().extent().z;

    // Both instances share the encoded mesh. Lengths are in the mesh's unit.
    let mut scene = Scene::new();
    let shape = scene.add_shape(asset)?;
    let below = scene.add(Instance::new(shape, Pose::IDENTITY))?;
    let above = scene.add(Instance::new(shape, Pose::IDENTITY))?;
    for gap in [0.5, 0.1, 0.0, -0.1, -0.25] {
        scene.set_poses(&[(above, Pose::at(DVec3::new(0.0, 0.0, (1.0 + gap) * height)))])?;
        let found = clearance(&scene, above, below, &ClearanceOptions::default())?;
        println!(
            "clearance {:e}: face {} at {} over face {} at {}",
            found.distance, found.face_a, found.point_a, found.face_b, found.point_b
        );
        // The witnesses are that far apart, along the normal from the second body to the first.
        let along = found.point_b + found.distance * found.normal;
        assert!(along.distance(found.point_a) <= 1e-9 * height);
        if given.is_none() {
            assert!((found.distance - gap * height).abs() <= 2e-8 * height);
        }
    }
    Ok(())
}
