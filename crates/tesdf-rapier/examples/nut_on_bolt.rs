//! A frictionless M16 nut turns down its bolt in Rapier, with contacts from the encoded meshes.
//!
//! ```text
//! cargo run --release -p tesdf-rapier --example nut_on_bolt \
//!     [NUT [SECONDS [STEP_MS [MODE [CONTACTS [DISTANCE_MM [BOLT]]]]]]]
//! ```
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tesdf::collide::ModeName;
use tesdf::glam::DVec3;
use tesdf::{CollideOptions, Encoder, FaceOptions, Instance, Pose, Preset, Reduction, Shape, TeSdf};
use tesdf_rapier::{RapierEngine, RapierOptions};
use tesdf_sim::criterion::{ScrewCriterion, ScrewTracker, Tracker};
use tesdf_sim::{Dynamics, Mass, MassProperties, System};

/// Density of steel, kg/m³.
const STEEL: f64 = 7850.0;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |at: usize, default: &str| arguments.get(at).map_or(default, |a| a.as_str()).to_owned();
    let (nut, bolt) = (argument(0, "iso_m16_nut_c100"), argument(6, "iso_m16_bolt_6k"));
    let seconds: f64 = argument(1, "0.2").parse()?;
    let step = argument(2, "1").parse::<f64>()? * 1e-3;
    let mode = argument(3, "node").parse::<ModeName>()?.with(FaceOptions::default());
    let contact_distance = argument(5, "0.2").parse::<f64>()? * 1e-3;
    let reduction = match argument(4, "64").as_str() {
        "none" => Reduction::None,
        number => Reduction::PerPair(number.parse()?),
    };

    let mut system = System::new(DVec3::new(0.0, 0.0, -9.81));
    let (bolt_asset, nut_asset) = (asset(&bolt)?, asset(&nut)?);
    let bolt = system.add_shape(bolt_asset.clone())?;
    system.add("bolt", Instance::new(bolt, Pose::at(DVec3::ZERO)), Mass::Fixed)?;
    let mass = MassProperties::of_shape(&Shape::Mesh(nut_asset.clone()), 1.0, STEEL)?;
    let shape = system.add_shape(nut_asset.clone())?;
    // The nut starts four pitches up, where the threads mesh without a rotation.
    system.add("nut", Instance::new(shape, Pose::at(DVec3::new(0.0, 0.0, 8e-3))), Mass::Free(mass))?;

    let collide = CollideOptions { contact_distance, reduction, ..CollideOptions::with_mode(mode) };
    let mut engine = RapierEngine::new(system, collide, RapierOptions::default())?;
    let criterion = ScrewCriterion {
        body: "nut".into(),
        axis: [0.0, 0.0, -1.0],
        pitch: 2e-3,
        min_turns: 0.01,
        backlash: 2e-4,
        min_acceleration: 0.0,
        max_energy: 1.001,
    };
    let mut tracker = ScrewTracker::new(&criterion, engine.system())?;

    let steps = (seconds / step).round() as u64;
    let (mut contacts, mut depth, mut detection, mut solution) = (0, 0.0_f64, 0.0, 0.0);
    for k in 1..=steps {
        let report = engine.step(step)?;
        contacts += report.contacts;
        detection += report.detection.as_secs_f64();
        solution += report.solution.as_secs_f64();
        tracker.observe(engine.system(), step);
        if k % steps.div_ceil(10) == 0 {
            let pose = engine.system().states()[1].pose;
            depth = depth.max(penetration(&nut_asset, &bolt_asset, |p| pose.to_world(p)));
            depth = depth.max(penetration(&bolt_asset, &nut_asset, |p| pose.to_body(p)));
            println!(
                "{:6.3} s  {:8.5} mm  {:8.5} turns",
                k as f64 * step,
                tracker.travel() * 1e3,
                tracker.turns()
            );
        }
    }
    let report = tracker.report(engine.system());
    println!(
        "{nut}, steps of {} ms, {:.0} contacts: {:.4} mm, {:.4} turns, at most {:.1} µm from the pitch; penetration at most {:.2} \
         µm (vertices); {:.3} of the ideal screw's travel, {:.3} of its acceleration; energy {:.3}; {:.2} + {:.2} ms per step (detection + solution)",
        step * 1e3,
        contacts as f64 / steps as f64,
        report.travel * 1e3,
        report.turns,
        report.largest_pitch_error * 1e6,
        depth * 1e6,
        report.travel_of_analytic,
        report.acceleration / report.analytic_acceleration,
        report.energy,
        detection * 1e3 / steps as f64,
        solution * 1e3 / steps as f64,
    );
    match report.failures.is_empty() {
        true => Ok(()),
        false => Err(report.failures.join("; ").into()),
    }
}

/// The encoded mesh `name` of `data/procedural`, or of a file.
fn asset(name: &str) -> Result<Arc<TeSdf>, Box<dyn Error>> {
    let mut path = PathBuf::from(name);
    if path.extension().is_none() {
        path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../data/procedural/{name}.obj"));
    }
    Ok(Arc::new(Encoder::new().preset(Preset::Fast).encode_file(path)?))
}

/// The largest depth of a vertex of `a` in `b`, m.
fn penetration(a: &TeSdf, b: &TeSdf, to_b: impl Fn(DVec3) -> DVec3) -> f64 {
    (0..a.face_count())
        .flat_map(|face| a.face_corners(face))
        .map(|p| -b.signed_distance(to_b(p)))
        .fold(0.0, f64::max)
}
