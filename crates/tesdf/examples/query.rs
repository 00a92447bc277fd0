//! All queries of an asset at a point: distance, gradient, closest point and face, inside or
//! outside, and rays.
//!
//! `cargo run --release --example query -- [MESH]`; the default is a cube with an edge of
//! 20 mm about the origin.
use std::error::Error;

use tesdf::TeSdf;
use tesdf::glam::DVec3;

fn main() -> Result<(), Box<dyn Error>> {
    let cube = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/cube.obj");
    let given = std::env::args_os().nth(1);
    let asset = TeSdf::encode_file(given.clone().unwrap_or(cube.into()))?;
    let bounds = asset.bounds();
    let diagonal = bounds.extent().length();

    // `query` is exact up to rounding. `query_f32` is faster, with errors below 1e-6 × diagonal.
    // Lengths are in the mesh's unit.
    let above = bounds.center() + DVec3::new(0.1, 0.2, 0.6) * bounds.extent();
    let exact = asset.query(above);
    let fast = asset.query_f32(above);
    println!("at {above}: {} from face {} at {}", exact.signed_distance, exact.face, exact.closest_point);
    println!("gradient {}, f32 off by {:e}", exact.gradient, fast.signed_distance - exact.signed_distance);
    assert!((fast.signed_distance - exact.signed_distance).abs() <= 1e-6 * diagonal);
    let along = exact.closest_point + exact.signed_distance * exact.gradient;
    assert!(along.distance(above) <= 1e-12 * diagonal, "the gradient leads from the closest point back");

    // Outside of the domain the answer comes from all faces and is exact, too. `query_in_domain`
    // returns `None` there, for uses that need a narrow band only.
    let far = bounds.max + 10.0 * diagonal;
    assert!(asset.query_in_domain(far).is_none());
    assert!(asset.signed_distance(far) > 9.0 * diagonal);
    assert!(!asset.is_inside(far));

    // A ray from there to the centre meets the surface on the way.
    let ray = bounds.center() - far;
    let hit = asset.ray_cast(far, ray, 1.0);
    if let Some(hit) = hit {
        println!("the ray meets face {} at {}", hit.face, hit.point);
        assert!(asset.signed_distance(hit.point).abs() <= 1e-9 * diagonal);
    }
    if given.is_none() {
        assert_eq!(exact.gradient, DVec3::Z);
        assert!((exact.signed_distance - 0.002).abs() < 1e-15);
        assert!(asset.is_inside(DVec3::ZERO) && hit.is_some());
    }
    Ok(())
}
