//! Contacts in a loop of frames: a mesh of `f32` vertices, instances that move in each frame, and
//! pairs that are kept from frame to frame.
//!
//! `cargo run --release --example game_loop`
use std::error::Error;

use tesdf::glam::{DVec3, Vec3};
use tesdf::{
    CollideOptions, Encoder, Instance, InstanceId, InstancePairs, Pose, Preset, Scene, Shape, SolidMesh,
    TriangleMesh, detect, detect_with,
};

fn main() -> Result<(), Box<dyn Error>> {
    // As an engine stores it: a pyramid of height 1 on a square of 2; faces are counter-clockwise
    // from outside.
    let vertices: [[f32; 3]; 5] =
        [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces: [[u32; 3]; 6] = [[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
    let vertices = vertices.iter().map(|&v| Vec3::from_array(v).as_dvec3()).collect();
    let solid = SolidMesh::new(TriangleMesh::new(vertices, faces.to_vec())?)?;

    let mut scene = Scene::new();
    let pyramid = scene.add_shape(Encoder::new().preset(Preset::Fast).encode(&solid)?)?;
    let floor = scene.add_shape(Shape::Plane)?;
    scene.add(Instance::new(floor, Pose::IDENTITY))?;
    let bodies: Vec<Instance> = (0..20).map(|k| Instance::new(pyramid, pose(k, 0))).collect();
    let added = scene.add_many(&bodies)?;
    let ids: Vec<InstanceId> = (added.start.0..added.end.0).map(InstanceId).collect();

    let options = CollideOptions::default();
    let (mut pairs, mut moved) = (InstancePairs::new(), Vec::with_capacity(ids.len()));
    for frame in 0..60 {
        moved.clear();
        moved.extend(ids.iter().zip(0..).map(|(&id, k)| (id, pose(k, frame))));
        scene.set_poses(&moved)?;
        let contacts = detect_with(&mut pairs, &scene, &options)?;
        let deepest = contacts.iter().map(|c| c.distance).fold(0.0, f64::min);
        if frame % 20 == 0 {
            println!(
                "frame {frame}: {} pairs, {} contacts, deepest {deepest}",
                pairs.pairs().len(),
                contacts.len()
            );
        }
        // The same as without pairs that are kept.
        assert_eq!(contacts.len(), detect(&scene, &options)?.len());
        // Each body sinks by 0.01 a frame, and reaches the floor in frame 30.
        let expected = f64::min(0.3 - 0.01 * f64::from(frame), 0.0);
        assert!((deepest - expected).abs() < 1e-6, "frame {frame}: {deepest}");
    }
    Ok(())
}

/// The pose of a body in a frame.
fn pose(body: u32, frame: u32) -> Pose {
    Pose::at(DVec3::new(3.0 * f64::from(body), 0.0, 0.3 - 0.01 * f64::from(frame)))
}
