//! When two moving bodies first touch: a cube thrown at the floor, spinning.
//!
//! `cargo run --release --example time_of_impact -- [MESH]`; the default is a cube with an edge of
//! 20 mm about the origin.
use std::error::Error;

use tesdf::glam::DVec3;
use tesdf::{
    ClearanceOptions, Encoder, Instance, Motion, Pose, Preset, Scene, Shape, TimeOfImpact,
    TimeOfImpactOptions, Velocity, clearance, time_of_impact,
};

fn main() -> Result<(), Box<dyn Error>> {
    let cube = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/cube.obj");
    let path = std::env::args_os().nth(1).unwrap_or(cube.into());
    let asset = Encoder::new().preset(Preset::Fast).encode_file(path)?;
    let diagonal = asset.bounds().extent().length();

    let mut scene = Scene::new();
    let (mesh, plane) = (scene.add_shape(asset)?, scene.add_shape(Shape::Plane)?);
    let start = Pose::at(DVec3::new(0.0, 0.0, 3.0 * diagonal));
    let body = scene.add(Instance::new(mesh, start))?;
    let floor = scene.add(Instance::new(plane, Pose::IDENTITY))?;
    let thrown = Motion::Linear {
        velocity: Velocity {
            linear: DVec3::new(2.0, 0.0, -5.0) * diagonal,
            angular: DVec3::new(3.0, 7.0, 0.0),
        },
    };
    let options = TimeOfImpactOptions::default();
    let impact = match time_of_impact(&scene, body, floor, thrown, Motion::Rest, &options)? {
        TimeOfImpact::Impact(impact) => impact,
        TimeOfImpact::Free { end, .. } => return Err(format!("nothing is met up to time {end}").into()),
        TimeOfImpact::Undecided(free) => return Err(format!("free up to time {}", free.time).into()),
    };
    println!(
        "face {} touches at time {}, at {}, found in {} steps",
        impact.clearance.face_a, impact.time, impact.clearance.point_a, impact.iterations
    );
    assert!(impact.clearance.distance <= 1e-6 * diagonal);

    // Up to then it is free: the clearance at times before is positive.
    for k in 0..10 {
        let pose = thrown.pose_at(start, impact.time * f64::from(k) / 10.0);
        scene.set_poses(&[(body, pose)])?;
        assert!(clearance(&scene, body, floor, &ClearanceOptions::default())?.distance > 0.0);
    }
    Ok(())
}
