//! An encoded mesh in Rapier's own world: a cube falls onto a plane, and a ball falls onto the
//! cube.
use std::error::Error;
use std::sync::Arc;

use tesdf::{CollideOptions, Mode, TeSdf};
use tesdf_rapier::rapier3d_f64::prelude::*;
use tesdf_rapier::{RapierOptions, TesdfShape, query_dispatcher};

fn main() -> Result<(), Box<dyn Error>> {
    let asset = TeSdf::encode_file(concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/cube.obj"))?;
    let bounds = asset.bounds();
    let (height, top) = (bounds.extent().z, bounds.max.z);
    let cube = TesdfShape::new(Arc::new(asset));

    let mut world = PhysicsWorld { gravity: Vector::new(0.0, 0.0, -9.81), ..PhysicsWorld::default() };
    // Node mode suffices here: the corners of the cube and the centre of the ball touch first.
    world.narrow_phase.set_query_dispatcher(query_dispatcher(CollideOptions::with_mode(Mode::Node)));
    // Steps of 2 ms, and contacts up to 1 % of the cube's height.
    world.integration_parameters =
        RapierOptions { length_unit: height, ..RapierOptions::default() }.parameters(2e-3, 0.01 * height);

    world.insert_collider(ColliderBuilder::new(SharedShape::new(HalfSpace::new(Vector::Z))), None);
    let above = |z: f64| RigidBodyBuilder::dynamic().translation(Vector::Z * z).soft_ccd_prediction(height);
    let cube_body = world.insert_body(above(0.05 * height - bounds.min.z));
    world.insert_collider(ColliderBuilder::new(SharedShape::new(cube)).density(1000.0), Some(cube_body));
    let radius = 0.25 * height;
    let ball_body = world.insert_body(above(0.05 * height - bounds.min.z + top + 1.2 * radius));
    world.insert_collider(ColliderBuilder::ball(radius).density(1000.0), Some(ball_body));

    let mut heights = (0.0, 0.0);
    for step in 1..=200 {
        world.step();
        let [cube, ball] = [cube_body, ball_body].map(|body| world.bodies[body].translation().z);
        heights = (cube + bounds.min.z, ball - radius - cube - top);
        if step % 50 == 0 {
            println!(
                "{:.1} s: the cube is {:9.2e} above the plane, the ball {:9.2e} above the cube",
                step as f64 * 2e-3,
                heights.0,
                heights.1
            );
        }
    }
    match heights.0.abs().max(heights.1.abs()) < 1e-3 * height {
        true => Ok(()),
        false => Err(format!("they do not rest: {heights:?}").into()),
    }
}
