//! A chain of light links holds a heavy end.

use tesdf_sim::newton::Newton;
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{Dynamics, Summary, System};

/// The chain of the repository for some tenths of a second, under a gravity that is turned by 17°.
fn chain(change: impl FnOnce(&mut LoadedScene)) -> Summary {
    let (loaded, system) = crate::support::scene("chain", |loaded| {
        loaded.scene.duration = 0.2;
        loaded.scene.gravity = [3.0, 0.0, -9.81];
        change(loaded);
    });
    crate::support::run(&loaded, system).1
}

#[test]
fn a_chain_holds_a_heavy_end_the_same_on_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut summary = pool.install(|| chain(|_| {}));
        (summary.detection_ms, summary.solution_ms) = (0.0, 0.0);
        summary
    };
    let summary = on(1);
    assert_eq!(summary.passed, Some(true), "{summary:?}");
    assert_eq!(summary.unconverged_steps, 0);
    // Vertices are kept out up to the jerk with which the slack ends.
    assert!(summary.deepest_penetration < 1e-5, "{summary:?}");
    // The end swings, and energy is not gained.
    assert!(summary.kinetic_energy > 0.1 && summary.kinetic_energy < summary.released_energy, "{summary:?}");
    assert_eq!(summary, on(2));
}

/// The only minimum of the distance between two links is the bottom of a bend. Without the contacts
/// of the faces beside it the links slip out of each other.
#[test]
fn a_chain_of_faces_holds_a_heavy_end_that_swings() {
    let summary = chain(|loaded| loaded.scene.detector.choose(DetectorMode::Exact));
    assert_eq!(summary.passed, Some(true), "{summary:?}");
    assert!(summary.kinetic_energy > 0.1 && summary.kinetic_energy < summary.released_energy, "{summary:?}");
}

#[test]
fn without_contacts_the_chain_falls_apart() {
    let summary = chain(|loaded| loaded.scene.detector.choose(DetectorMode::Off));
    assert_eq!(summary.passed, Some(false), "{summary:?}");
}

/// The engine of a scene whose four bodies are in a chain of ball joints.
fn jointed(bodies: &str) -> Newton {
    let loaded = LoadedScene::parse(format!("{bodies}{BALL_JOINTS}"), "scene.toml").expect("a scene");
    loaded.newton(loaded.system().expect("a system")).expect("an engine")
}

/// Bodies of 10 kg to 10 g in a chain of joints. Two of them begin in each other and in the floor.
/// A solution that has not converged may be far off, and later ones were compared with it.
#[test]
fn a_chain_of_very_unequal_links_does_not_fly_off() {
    let mut engine = jointed(UNEQUAL);
    let energy = |system: &System| system.kinetic_energy() + system.potential_energy();
    let begin = energy(engine.system());
    for step in 0..40 {
        engine.step(5e-3).expect("a step");
        let fastest = engine.system().states().iter().map(|state| state.linear.length()).fold(0.0, f64::max);
        assert!(fastest < 15.0, "step {step}: {fastest} m/s");
    }
    let end = energy(engine.system());
    assert!(end < begin, "{end} J of {begin} J");
}

/// Each problem is linear. With rigid joints in the matrix, rounding made the iterations grow to
/// 1e23 m/s.
#[test]
fn joints_of_very_unequal_bodies_converge() {
    let mut engine = jointed(FREE);
    for step in 0..40 {
        let report = engine.step(5e-3).expect("a step");
        assert!(report.converged, "step {step}: {report:?}");
    }
}

const FREE: &str = r#"time_step = 0.005
duration = 0.2
[[bodies]]
name = "0"
shape = { cylinder = { half_height = 0.06657495994506751, radius = 0.09999999999999999 } }
mass = 0.01
translation = [0.15, -0.15, 0.0]
rotation = [-0.3093718441736655, -0.618743688347331, 0.4652827909581874, -0.5522293315291082]
velocity = [-4.200122072175174, 5.0, 1.3491264209964138]
angular_velocity = [12.886854352635995, 20.0, -3.050278477149615]
[[bodies]]
name = "1"
shape = { cylinder = { half_height = 0.055, radius = 0.01 } }
mass = 1.7782794100389228
translation = [0.09869077592126342, -0.15, 0.3]
rotation = [-0.46748592624005564, 0.3043520909195332, -0.6087041818390664, -0.5641860797042215]
velocity = [0.0, -2.5, 2.5]
angular_velocity = [10.0, 20.0, -11.66308079652094]
[[bodies]]
name = "2"
shape = { box = { half_extents = [0.0775, 0.055, 0.01] } }
mass = 10.0
translation = [0.14210574502174414, 0.210771343556878, 0.3613366903181506]
rotation = [-0.9910044713901787, 0.1269774097240151, 0.0, -0.04227144549754725]
velocity = [0.0, 5.0, 0.0]
angular_velocity = [10.0, -10.0, -20.0]
[[bodies]]
name = "3"
shape = { cylinder = { half_height = 0.021761043717097736, radius = 0.0775 } }
mass = 0.01
translation = [-0.3, -0.3, 0.0]
rotation = [-0.20894635634935882, -0.20894635634935882, -0.20894635634935882, -0.9322147072992253]
velocity = [-5.0, -5.0, -5.0]
angular_velocity = [-20.0, -20.0, -20.0]
"#;

const UNEQUAL: &str = r#"time_step = 0.005
duration = 1.0
[[bodies]]
name = "floor"
shape = "plane"
fixed = true
friction = 0.0
[[bodies]]
name = "0"
shape = { cylinder = { half_height = 0.06657495994506751, radius = 0.09999999999999999 } }
mass = 10.0
friction = 0.4237430380712596
restitution = 0.0
translation = [0.15, -0.15, 0.15]
rotation = [0.562866623450097, -0.6448180989372112, -0.2681207476316321, 0.4421561355204091]
velocity = [-0.8806744487678342, -1.1167315175097277, -2.5]
angular_velocity = [20.0, 5.396505683985655, 12.886854352635995]
[[bodies]]
name = "1"
shape = { sphere = { radius = 0.055 } }
mass = 4.724348805132701
friction = 0.0
restitution = 1.0
translation = [0.21961547264820327, 0.14916456855115587, 0.15]
rotation = [0.4645929766230986, 0.7281730735176803, 0.2855469568372757, -0.4151870379928484]
velocity = [-5.0, 0.0, -2.5]
angular_velocity = [10.0, 10.0, 20.0]
[[bodies]]
name = "2"
shape = { cylinder = { half_height = 0.055, radius = 0.0775 } }
mass = 0.01
friction = 0.0
restitution = 0.0
translation = [-0.297958342870222, -0.3, 0.0]
rotation = [-0.20894635634935882, -0.20894635634935882, -0.20894635634935882, -0.9322147072992253]
velocity = [-5.0, -5.0, -5.0]
angular_velocity = [-20.0, -20.0, -20.0]
[[bodies]]
name = "3"
shape = { sphere = { radius = 0.01 } }
mass = 0.01
friction = 0.0
restitution = 0.0
translation = [-0.3, -0.3, 0.0]
rotation = [-0.20894635634935882, -0.20894635634935882, -0.20894635634935882, -0.9322147072992253]
velocity = [-5.0, -5.0, -5.0]
angular_velocity = [-20.0, -20.0, -20.0]
"#;

/// Of four bodies.
const BALL_JOINTS: &str = r#"[[joints]]
name = "joint 1"
kind = "ball"
parent = "0"
child = "1"
[[joints]]
name = "joint 2"
kind = "ball"
parent = "1"
child = "2"
[[joints]]
name = "joint 3"
kind = "ball"
parent = "2"
child = "3"
"#;
