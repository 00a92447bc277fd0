//! Contacts of a mesh with the simple shapes: a floor, a box, a sphere and a capsule, each as field
//! and as surface.
//!
//! `cargo run --release --example shapes`
use std::error::Error;
use std::sync::Arc;

use tesdf::glam::DVec3;
use tesdf::{CollideOptions, Encoder, Instance, Pose, Preset, Scene, Shape, detect};

fn main() -> Result<(), Box<dyn Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/cube.obj");
    let cube = Arc::new(Encoder::new().preset(Preset::Fast).encode_file(path)?);

    // A cube of 20 mm around the origin. Each shape overlaps the cube's side x = 10 mm, or its
    // bottom, by 1 mm.
    let half_extents = DVec3::new(0.005, 0.003, 0.003);
    let shapes = [
        ("plane", Shape::Plane, DVec3::new(0.0, 0.0, -0.009)),
        ("box", Shape::Box { half_extents }, DVec3::new(0.014, 0.001, 0.002)),
        ("sphere", Shape::Sphere { radius: 0.004 }, DVec3::new(0.013, 0.001, 0.002)),
        ("capsule", Shape::Capsule { half_height: 0.003, radius: 0.004 }, DVec3::new(0.013, 0.001, 0.002)),
    ];
    for (name, shape, at) in shapes {
        let mut scene = Scene::new();
        let cube = scene.add_shape(cube.clone())?;
        let shape = scene.add_shape(shape)?;
        let cube = scene.add(Instance::new(cube, Pose::IDENTITY))?;
        scene.add(Instance::new(shape, Pose::at(at)))?;
        let found = detect(&scene, &CollideOptions::default())?;
        let deepest_of = |a| {
            let of_a = found.iter().filter(|c| (c.instance_a == cube) == a);
            of_a.map(|c| c.distance).fold(f64::INFINITY, f64::min)
        };
        let (as_field, as_surface) = (deepest_of(true), deepest_of(false));
        println!(
            "{name:<8} {:>4} contacts; deepest against its field {as_field:+.6}, of its surface {as_surface:+.6}",
            found.len()
        );
        assert!((as_surface + 0.001).abs() < 1e-8, "{name}: its surface is 1 mm inside the cube");
        assert!(as_field < 0.0, "{name}: the cube's surface is inside of it");
    }
    Ok(())
}
