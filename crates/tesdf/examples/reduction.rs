//! Time and loss of a reduction: contacts of two bodies, and 100,000 random contacts.
//!
//! `cargo run --release -p tesdf --example reduction -- 64`
use std::error::Error;
use std::f64::consts::TAU;
use std::time::Instant;

use tesdf::collide::{Contact, FeatureB, FeatureId, InstanceId, reduce_pairs};
use tesdf::encode::EncodeFileError;
use tesdf::glam::DVec3;
use tesdf::{
    CollideOptions, ContactsPer, Encoder, Instance, Mode, Pose, Preset, Reduction, Scene, TeSdf, detect,
};

const RANDOM: u32 = 100_000;

fn load(name: &str) -> Result<TeSdf, EncodeFileError> {
    let path = format!("{}/../../data/procedural/{name}.obj", env!("CARGO_MANIFEST_DIR"));
    Encoder::new().preset(Preset::Fast).encode_file(path)
}

/// Contacts per cell, by Frank–Wolfe.
fn contacts(of: [&str; 2], at: DVec3, contact_distance: f64) -> Result<Vec<Contact>, Box<dyn Error>> {
    let mut scene = Scene::new();
    for (name, at) in [(of[0], at), (of[1], DVec3::ZERO)] {
        let shape = scene.add_shape(load(name)?)?;
        scene.add(Instance::new(shape, Pose::at(at)))?;
    }
    let contacts_per = ContactsPer::Cell;
    let options =
        CollideOptions { contact_distance, ..CollideOptions::with_mode(Mode::face().per(contacts_per)) };
    Ok(detect(&scene, &options)?.into_vec())
}

/// Contacts with points and normals of a surface, for two numbers below 1.
fn random(surface: impl Fn(f64, f64) -> (DVec3, DVec3)) -> Vec<Contact> {
    // Multiples of irrational numbers fill the square evenly.
    let at = |i: u32, step: f64| (f64::from(i) * step).fract();
    let contact = |i: u32| {
        let (point, normal) = surface(at(i, 0.754_877_666_246_693), at(i, 0.569_840_290_998_053));
        Contact {
            point_a: point,
            point_b: point,
            normal,
            distance: -at(i, 0.618_033_988_749_895),
            face_a: i,
            face_b: 0,
            tet_b: None,
            instance_a: InstanceId(0),
            instance_b: InstanceId(1),
            feature: FeatureId { a: i, b: FeatureB::Face(0) },
            converged: true,
        }
    };
    (0..RANDOM).map(contact).collect()
}

fn torus(u: f64, v: f64) -> (DVec3, DVec3) {
    let ((su, cu), (sv, cv)) = ((TAU * u).sin_cos(), (TAU * v).sin_cos());
    let normal = DVec3::new(cv * cu, cv * su, sv);
    (DVec3::new(cu, su, 0.0) + 0.3 * normal, normal)
}

fn shaft(u: f64, v: f64) -> (DVec3, DVec3) {
    let (sin, cos) = (TAU * u).sin_cos();
    (DVec3::new(cos, sin, 6.0 * v), DVec3::new(cos, sin, 0.0))
}

fn plate(u: f64, v: f64) -> (DVec3, DVec3) {
    (DVec3::new(u, v, 0.0), DVec3::Z)
}

fn main() -> Result<(), Box<dyn Error>> {
    let kept: u32 = std::env::args().nth(1).map_or(Ok(64), |n| n.parse())?;
    let nut = ["iso_m16_nut_c100", "iso_m16_bolt_24k"];
    let sets = [
        ("nut on bolt, 0.2 mm", contacts(nut, DVec3::new(0.0, 0.0, 0.00992), 2e-4)?),
        ("nut on bolt, 3 mm", contacts(nut, DVec3::new(0.0, 0.0, 0.00992), 3e-3)?),
        ("torus in torus", contacts(["torus_5k"; 2], DVec3::new(1e-4, 0.0, 2e-4), 2e-2)?),
        ("shaft in shaft", contacts(["shaft_keyway"; 2], DVec3::new(1e-4, 0.0, 1e-4), 1e-3)?),
        ("random, torus", random(torus)),
        ("random, shaft", random(shaft)),
        ("random, plate", random(plate)),
    ];
    println!("| contacts of | contacts | kept | wrench error | ms |\n|---|---:|---:|---:|---:|");
    for (name, all) in sets {
        let mut best = f64::INFINITY;
        for pass in 0..6 {
            let contacts = all.clone();
            let start = Instant::now();
            let (few, reports) = reduce_pairs(contacts, Reduction::PerPair(kept));
            best = best.min(start.elapsed().as_secs_f64());
            assert!(few.len() <= kept as usize);
            if pass == 5 {
                let (all, error) = (all.len(), reports[0].wrench_error);
                println!("| {name} | {all} | {} | {error:.4} | {:.1} |", few.len(), 1e3 * best);
            }
        }
    }
    Ok(())
}
