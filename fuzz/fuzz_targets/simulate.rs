//! Runs arbitrary small scenes with all defaults: a floor, some bodies, joints between them. Nothing
//! panics, all numbers stay finite, and a run that begins without overlaps and whose steps converge
//! gains no energy and has no deep overlap.
#![no_main]

use std::fmt::Write;
use std::sync::LazyLock;

use glam::{DQuat, DVec3};
use libfuzzer_sys::arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use tempfile::TempDir;
use tesdf_sim::{Dynamics, Mass};
use tesdf_sim::scene_file::LoadedScene;

const STEP: f64 = 5e-3;
const STEPS: usize = 40;
const G: f64 = 9.81;

/// The folder of the scenes, with a tetrahedron.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let text = "v -0.05 -0.05 -0.05\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    std::fs::write(folder.path().join("tetra.obj"), text).expect("room for a file");
    folder
});

/// A number from 0 to 1, often a round one.
fn share(bytes: &mut Unstructured) -> Result<f64> {
    Ok(match bytes.arbitrary::<bool>()? {
        true => f64::from(bytes.int_in_range(0u8..=4)?) / 4.0,
        false => f64::from(bytes.arbitrary::<u16>()?) / 65535.0,
    })
}

fn vector(bytes: &mut Unstructured, size: f64) -> Result<DVec3> {
    let mut number = || Ok(size * (2.0 * share(bytes)? - 1.0));
    Ok(DVec3::new(number()?, number()?, number()?))
}

/// The text of a scene, and the numbers of its free bodies.
fn scene(bytes: &mut Unstructured) -> Result<String> {
    let mut text = format!("time_step = {STEP:?}\nduration = 1.0\n[[bodies]]\nname = \"floor\"\nshape = \"plane\"\nfixed = true\n");
    let friction = share(bytes)?;
    writeln!(text, "friction = {friction:?}").expect("a string");
    let count = bytes.int_in_range(1usize..=4)?;
    for k in 0..count {
        let [a, b, c] = [0; 3].map(|_| share(bytes).map(|x| 0.01 + 0.09 * x));
        let (a, b, c) = (a?, b?, c?);
        let shape = match bytes.int_in_range(0u8..=4)? {
            0 => format!("shape = {{ sphere = {{ radius = {a:?} }} }}"),
            1 => format!("shape = {{ box = {{ half_extents = [{a:?}, {b:?}, {c:?}] }} }}"),
            2 => format!("shape = {{ capsule = {{ half_height = {a:?}, radius = {b:?} }} }}"),
            3 => format!("shape = {{ cylinder = {{ half_height = {a:?}, radius = {b:?} }} }}"),
            _ => "mesh = \"tetra.obj\"".into(),
        };
        let at = vector(bytes, 0.3)? + DVec3::Z * 0.3;
        let turn = DQuat::from_scaled_axis(vector(bytes, 3.2)?).to_array();
        let [velocity, angular] = [vector(bytes, 5.0)?, vector(bytes, 20.0)?].map(|v| v.to_array());
        let (mass, friction, restitution) =
            (10f64.powf(3.0 * share(bytes)? - 2.0), share(bytes)?, share(bytes)?);
        writeln!(
            text,
            "[[bodies]]\nname = \"{k}\"\n{shape}\nmass = {mass:?}\nfriction = {friction:?}\nrestitution = {restitution:?}\n\
             translation = {:?}\nrotation = {turn:?}\nvelocity = {velocity:?}\nangular_velocity = {angular:?}",
            at.to_array()
        )
        .expect("a string");
    }
    for k in 1..count {
        let kind = match bytes.int_in_range(0u8..=8)? {
            0 => "ball",
            1 => "hinge",
            2 => "slider",
            3 => "weld",
            _ => continue,
        };
        writeln!(
            text,
            "[[joints]]\nname = \"joint {k}\"\nkind = \"{kind}\"\nparent = \"{}\"\nchild = \"{k}\"",
            k - 1
        )
        .expect("a string");
    }
    Ok(text)
}

fuzz_target!(|data: &[u8]| {
    let Ok(text) = scene(&mut Unstructured::new(data)) else { return };
    let loaded = match LoadedScene::parse(text.clone(), FOLDER.path().join("scene.toml")) {
        Ok(loaded) => loaded,
        Err(e) => panic!("{e}\n{text}"),
    };
    // Joints whose frames are apart, and the like, are refused.
    let Ok(mut engine) = loaded.system().and_then(|system| loaded.newton(system)) else { return };
    let energy = |system: &tesdf_sim::System| system.kinetic_energy() + system.potential_energy();
    let begin = energy(engine.system());
    let weights: f64 = engine.system().bodies().iter().filter_map(|b| if let Mass::Free(mass) = b.mass { Some(mass.mass * G) } else { None }).sum();
    let mut is_regular = true;
    for step in 0..STEPS {
        let Ok(report) = engine.step(STEP) else { return };
        for state in engine.system().states() {
            assert!(state.is_finite(), "step {step}: {state:?}\n{text}");
        }
        if step == 0 {
            is_regular = report.deepest.is_none_or(|deepest| deepest > -1e-6) && engine.hidden().is_empty();
        }
        is_regular &= report.converged;
        if is_regular {
            let now = energy(engine.system());
            let fastest = engine.system().states().iter().map(|s| s.linear.length()).fold(0.0, f64::max);
            // Velocities are those of the middle of a step.
            let slack = 0.02 * begin.abs() + weights * STEP * fastest + 1e-6;
            assert!(now <= begin + slack, "step {step}: {now} J of {begin} J, {report:?}\n{text}");
            let deepest = report.deepest.unwrap_or(0.0);
            assert!(deepest > -1e-3, "step {step}: {deepest} m, {report:?}\n{text}");
        }
    }
});
