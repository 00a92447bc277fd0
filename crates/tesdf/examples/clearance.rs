//! How far two bodies are apart, or how deep they are in each other: a cube that goes down on another.
//!
//! `cargo run --release --example clearance -- [MESH]`; the default is a cube with an edge of 20 mm about the origin.
use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

use tesdf::Progress;
use tesdf::asset::about::Source;
use tesdf::collide::{ClearanceOptions, Instance, Pose, Scene, clearance};
use tesdf::encode::{EncodeOptions, Preset, encode};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, read};

fn main() -> Result<(), Box<dyn Error>> {
    let cube = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/cube.obj");
    let given = std::env::args_os().nth(1);
    let solid = SolidMesh::new(read(&given.as_ref().map_or(PathBuf::from(cube), PathBuf::from))?.mesh)?;
    let height = solid.mesh().bounds().extent().z;
    let asset =
        encode(&solid, &Source::default(), &EncodeOptions::preset(Preset::Fast), &Progress::default())?;

    // Both instances share the encoded mesh. Lengths are in the mesh's unit.
    let mut scene = Scene::new();
    let shape = scene.add_shape(Arc::new(asset))?;
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
