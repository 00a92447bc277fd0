//! Bodies that bounce.
use std::path::Path;

use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Dynamics, State};

const G: f64 = 9.81;

/// The states of the bodies at the start and after each step. `bodies` are tables of a scene file.
fn run(time_step: f64, steps: usize, gravity: f64, bodies: &str) -> Vec<Vec<State>> {
    let text =
        format!("time_step = {time_step:?}\nduration = 1.0\ngravity = [0, 0, {:?}]\n{bodies}", -gravity);
    let loaded = LoadedScene::parse(text, Path::new("bounce.toml")).unwrap();
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let mut states = vec![engine.system().states().to_vec()];
    for step in 0..steps {
        let report = engine.step(time_step).unwrap();
        assert!(report.converged, "step {step}: {report:?}");
        states.push(engine.system().states().to_vec());
    }
    states
}

fn floor(restitution: f64) -> String {
    format!("[[bodies]]\nname = \"floor\"\nshape = \"plane\"\nfixed = true\nrestitution = {restitution:?}\n")
}

fn ball(name: &str, radius: f64, at: [f64; 3], velocity: [f64; 3], restitution: f64) -> String {
    format!(
        "[[bodies]]\nname = \"{name}\"\nshape = {{ sphere = {{ radius = {radius:?} }} }}\nmass = 1.0\n\
         translation = {at:?}\nvelocity = {velocity:?}\nrestitution = {restitution:?}\n"
    )
}

/// A ball that falls by 0.5 m rises to e² of it, again and again, and comes to rest.
#[test]
fn a_ball_bounces_to_the_square_of_its_restitution() {
    for e in [0.2, 0.5, 0.9, 1.0] {
        let bodies = floor(e) + &ball("ball", 0.05, [0.0, 0.0, 0.55], [0.0; 3], e);
        let states = run(1e-3, 2000, G, &bodies);
        let heights: Vec<f64> = states.iter().map(|s| s[1].pose.translation.z - 0.05).collect();
        let is_top = |w: &[f64]| w[1] > w[0] && w[1] >= w[2] && w[1] > 0.01;
        let tops: Vec<f64> = heights.windows(3).filter(|w| is_top(w)).map(|w| w[1]).collect();
        assert!(!tops.is_empty(), "{e}: it never rose");
        let mut expected = 0.5;
        for (k, top) in tops.iter().enumerate().take(2) {
            expected *= e * e;
            assert!((top / expected - 1.0).abs() < 0.02, "{e}, bounce {k}: {top} m, not {expected} m");
        }
        if e < 0.6 {
            let end = &states[2000][1];
            assert!(end.linear.length() < 1e-6 && heights[2000].abs() < 1e-5, "{e}: {end:?}");
        }
        // Velocities are those of the middle of a step: off by m g h v / 2.
        let energy = |s: &[State]| 0.5 * s[1].linear.length_squared() + G * s[1].pose.translation.z;
        let (first, most) = (energy(&states[0]), states.iter().map(|s| energy(s)).fold(0.0, f64::max));
        assert!(most < first * (1.0 + 4e-3), "{e}: {most} J, from {first} J");
    }
}

/// Of five balls in a row, the first, or the first two, hand their momentum on to the last ones.
#[test]
fn a_cradle_hands_its_momentum_on() {
    for (gap, moving) in [(0.0, 1), (1e-6, 1), (0.0, 2), (2e-3, 1), (0.0, 3)] {
        let bodies = (0..5).map(|k| {
            let apart = if k < moving { -0.05 } else { 0.0 };
            let speed = if k < moving { 1.0 } else { 0.0 };
            let x = 0.1 * f64::from(k) + gap * f64::from(k) + apart;
            ball(&format!("{k}"), 0.05, [x, 0.0, 0.0], [speed, 0.0, 0.0], 1.0)
        });
        let states = run(2e-3, 100, 0.0, &bodies.collect::<String>());
        let speeds: Vec<f64> = states[100].iter().map(|s| s.linear.x).collect();
        for (k, speed) in speeds.iter().enumerate() {
            let expected = if k >= 5 - moving as usize { 1.0 } else { 0.0 };
            assert!((speed - expected).abs() < 1e-3, "{gap}, {moving} balls: {speeds:?}");
        }
        let momentum: f64 = speeds.iter().sum();
        assert!((momentum - f64::from(moving)).abs() < 1e-9, "{gap}, {moving}: {momentum}");
    }
}

/// Boxes that tumble and bounce with friction never gain energy, and come to rest.
#[test]
fn boxes_that_bounce_gain_no_energy() {
    let mut bodies = floor(0.8) + "friction = 0.6\n";
    for k in 0..4 {
        let turn = DQuat::from_scaled_axis(DVec3::new(0.4, 0.9, 0.3) * f64::from(k + 1));
        bodies += &format!(
            "[[bodies]]\nname = \"{k}\"\nshape = {{ box = {{ half_extents = [0.03, 0.02, 0.05] }} }}\nmass = 0.5\n\
             translation = [{:?}, 0.0, {:?}]\nrotation = {:?}\nangular_velocity = [5, -3, 4]\nfriction = 0.6\n\
             restitution = 0.8\n",
            0.03 * f64::from(k),
            0.2 + 0.12 * f64::from(k),
            turn.to_array()
        );
    }
    let text = format!("time_step = 2e-3\nduration = 1.0\n{bodies}");
    let loaded = LoadedScene::parse(text, Path::new("boxes.toml")).unwrap();
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let energy = |system: &tesdf_sim::System| system.kinetic_energy() + system.potential_energy();
    let mut least = energy(engine.system());
    let first = least;
    for step in 0..1500 {
        engine.step(2e-3).unwrap();
        let now = energy(engine.system());
        assert!(now < least + 2e-3 * first, "step {step}: {now} J after {least} J");
        least = least.min(now);
    }
    let fastest = engine.system().states()[1..].iter().map(|s| s.linear.length()).fold(0.0, f64::max);
    assert!(fastest < 0.02, "still at {fastest} m/s");
}

/// A rod that is hit at its end by a ball of restitution 1, on a hinge and free: energy and what the
/// joint leaves of the momentum stay.
#[test]
fn joints_hold_in_an_impact() {
    let rod = "[[bodies]]\nname = \"rod\"\nshape = { box = { half_extents = [0.2, 0.01, 0.01] } }\nmass = 2.0\n\
               restitution = 1\n[[joints]]\nname = \"axle\"\nkind = \"hinge\"\nchild = \"rod\"\naxis = [0, 1, 0]\n";
    let bodies = ball("ball", 0.02, [0.15, 0.0, 0.06], [0.0, 0.0, -1.0], 1.0) + rod;
    let states = run(1e-3, 100, 0.0, &bodies);
    let inertia = 2.0 * (0.4_f64.powi(2) + 0.02_f64.powi(2)) / 12.0;
    // m (v − v') r = I ω and the speed at which they part is that at which they met.
    let (m, r) = (1.0, 0.15);
    let spin = 2.0 * m * r / (inertia + m * r * r);
    let ball = -1.0 + inertia * spin / (m * r);
    let [hitting, hit] = [&states[100][0], &states[100][1]];
    assert!((hitting.linear.z - ball).abs() < 1e-3, "{hitting:?}, not {ball} m/s");
    assert!((hit.angular.y - spin).abs() < 1e-2 * spin, "{hit:?}, not {spin} rad/s");
    assert!(hit.linear.length() < 1e-6, "{hit:?}");
    let energy = 0.5 * hitting.linear.length_squared() + 0.5 * inertia * hit.angular.length_squared();
    assert!((energy - 0.5).abs() < 1e-3, "{energy} J");
}

/// A bat, which is kinematic, gives a ball twice its speed.
#[test]
fn a_bat_gives_twice_its_speed() {
    let bat = "[[bodies]]\nname = \"bat\"\nshape = { box = { half_extents = [0.01, 0.1, 0.1] } }\nkinematic = true\n\
               velocity = [1.5, 0, 0]\nrestitution = 1.0\n";
    let states =
        run(1e-3, 100, 0.0, &(bat.to_string() + &ball("ball", 0.02, [0.1, 0.0, 0.0], [0.0; 3], 1.0)));
    let speed = states[100][1].linear;
    assert!(speed.distance(3.0 * DVec3::X) < 1e-4, "{speed}");
}
