//! A beam that bends over a ball: its vertices move, stale lists are encoded again, and contacts
//! follow the new shape.
//!
//! `cargo run --release --example deformable`
use std::error::Error;

use tesdf::domain::{ConformingMesh, read_tetrahedra};
use tesdf::encode::{Deformation, Refinement};
use tesdf::glam::DVec3;
use tesdf::{
    CollideOptions, Domain, EncodeOptions, Encoder, Instance, Pose, Scene, Shape, SolidMesh, detect,
};

fn main() -> Result<(), Box<dyn Error>> {
    // A mesh for finite elements: its own surface is what is encoded, so that the two conform.
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/beam.ele");
    let tetrahedra = read_tetrahedra(path)?;
    let solid = SolidMesh::new(tetrahedra.surface()?)?;
    let domain = ConformingMesh::new(&solid, &tetrahedra)?;
    let options = EncodeOptions {
        deformation: Deformation::Expected,
        refinement: Refinement::None,
        ..EncodeOptions::default()
    };
    let asset = Encoder::new().options(options).domain(Domain::Conforming(&domain)).encode(&solid)?;
    let (bounds, diagonal) = (asset.bounds(), solid.mesh().diagonal());

    let mut scene = Scene::new();
    let beam = scene.add_shape(asset)?;
    let ball = scene.add_shape(Shape::Sphere { radius: 0.1 * diagonal })?;
    scene.add(Instance::new(beam, Pose::IDENTITY))?;
    let below = bounds.center() - DVec3::Z * (0.5 * bounds.extent().z + 0.12 * diagonal);
    scene.add(Instance::new(ball, Pose::at(below)))?;

    let touching = |scene: &Scene| -> Result<usize, Box<dyn Error>> {
        let contacts = detect(scene, &CollideOptions::default())?;
        let deepest = contacts.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
        println!("{} contacts, deepest {deepest:e}", contacts.len());
        Ok(contacts.len())
    };
    assert_eq!(touching(&scene)?, 0);

    // The middle sags.
    let (low, length) = (bounds.min.x, bounds.extent().x);
    let sag = |p: DVec3| p - DVec3::Z * 0.04 * diagonal * (std::f64::consts::PI * (p.x - low) / length).sin();
    let moves: Vec<(u32, DVec3)> = (0..).zip(domain.vertices()).map(|(id, &p)| (id, sag(p))).collect();
    let mesh = scene.mesh_mut(beam)?;
    let moved = mesh.move_vertices(&moves)?;
    println!(
        "{} faces and {} tetrahedra moved, {} inverted",
        moved.faces,
        moved.tetrahedra,
        moved.inverted.len()
    );
    let reencoded = mesh.reencode_stale()?;
    println!("{} of {} lists are made anew", reencoded.stale.len(), reencoded.cells);
    assert!(touching(&scene)? > 0);
    Ok(())
}
