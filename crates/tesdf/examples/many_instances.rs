//! Many instances of a few shapes: what they cost, and that only those that touch do.
//!
//! `cargo run --release -p tesdf --example many_instances -- 1000000`
use tesdf::glam::DVec3;
use tesdf::{CollideOptions, Instance, Pose, Scene, Shape, detect};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let count: u32 = std::env::args().nth(1).map_or(Ok(100_000), |n| n.parse())?;
    let mut scene = Scene::new();
    let shapes = [
        scene.add_shape(Shape::Sphere { radius: 0.5 })?,
        scene.add_shape(Shape::Box { half_extents: DVec3::splat(0.5) })?,
    ];
    // A grid; every thousandth instance touches the one before it.
    let side = f64::from(count).cbrt().ceil() as u32;
    let instance = |k: u32| {
        let [x, y, z] = [k % side, k / side % side, k / side / side].map(f64::from);
        let nudge = if k % 1000 == 1 { 1.2 } else { 0.0 };
        Instance::new(shapes[k as usize / 1000 % 2], Pose::at(2.0 * DVec3::new(x, y, z) - DVec3::X * nudge))
    };
    scene.add_many(&(0..count).map(instance).collect::<Vec<_>>())?;

    let found = detect(&scene, &CollideOptions::default())?;
    println!("{count} instances, {} bytes", scene.instance_bytes());
    println!("{} contacts of {} ordered pairs", found.len(), found.statistics.instance_pairs);
    println!("{} bytes of contacts and what led to them", found.statistics.bytes);
    Ok(())
}
