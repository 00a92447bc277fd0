//! Couplings of joints against analytic cases.
use tesdf_sim::newton::Newton;
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Drive, Dynamics, Motor, State, WarningKind};

use crate::support::run;

const G: f64 = 9.81;

/// Couplings hold to this, rad or m.
const EXACT: f64 = 1e-9;

fn load(text: &str) -> LoadedScene {
    LoadedScene::parse(text.into(), "couplings.toml").unwrap()
}

fn engine(text: &str) -> Newton {
    let loaded = load(text);
    loaded.newton(loaded.system().unwrap()).unwrap()
}

fn begin(gravity: [f64; 3]) -> String {
    format!("time_step = 1e-3\nduration = 1\ngravity = {gravity:?}\n[detector]\nmode = \"off\"\n")
}

/// A bar of 0.2 m along x, 0.16 kg, with its inertia about its centre: those of a box.
fn bar(name: &str, at: [f64; 3]) -> String {
    format!(
        "[[bodies]]\nname = \"{name}\"\nmass = 0.16\ntranslation = {at:?}\n\
         shape = {{ box = {{ half_extents = [0.1, 0.01, 0.02] }} }}\n"
    )
}

const MASS: f64 = 0.16;
const HALF: f64 = 0.1;
/// About z, kg m².
const INERTIA: f64 = MASS * (0.04 + 0.0004) / 12.0;

fn joint(name: &str, kind: &str, child: &str, more: &str) -> String {
    format!("[[joints]]\nname = \"{name}\"\nkind = \"{kind}\"\nchild = \"{child}\"\n{more}\n")
}

fn couple(joint: &str, of: &str, ratio: f64, offset: f64) -> String {
    format!("[[couplings]]\njoint = \"{joint}\"\nof = \"{of}\"\nratio = {ratio:?}\noffset = {offset:?}\n")
}

/// How far the couplings are off, rad or m.
fn off(engine: &Newton) -> f64 {
    let system = engine.system();
    let coordinates = system.coordinates();
    let of = system.couplings().iter().map(|c| (coordinates[c.joint] - c.target(coordinates)).abs());
    of.fold(0.0, f64::max)
}

/// Steps, in each of which couplings hold and the solver comes to its end.
fn advance(engine: &mut Newton, steps: usize, h: f64, mut watch: impl FnMut(&Newton)) {
    for step in 0..steps {
        let report = engine.step(h).unwrap();
        assert!(report.converged, "step {step}: {report:?}");
        let off = off(engine);
        assert!(off < EXACT, "step {step}: {off:e}");
        watch(engine);
    }
}

/// Two wheels of which one turns n times as far: a torque on the other one feels I + n² I, and the
/// turns count, also where a wheel turns by more than half a turn in a step.
#[test]
fn a_torque_feels_the_inertia_through_the_ratio() {
    for n in [1.0, -3.0, 40.0, 0.2] {
        let motor = "motor = { drive = { force = 0.5 }, limit = 1 }";
        let text = begin([0.0; 3])
            + &bar("slow", [0.0; 3])
            + &bar("fast", [100.0, 0.0, 0.0])
            + &joint("b", "hinge", "slow", motor)
            + &joint("a", "hinge", "fast", "")
            + &couple("a", "b", n, 0.0);
        let mut engine = engine(&text);
        let (h, steps) = (5e-3, 600);
        advance(&mut engine, steps, h, |_| {});
        let rate = 0.5 / (INERTIA * (1.0 + n * n));
        let time = h * steps as f64;
        // A step moves by the velocity at its end.
        let angle = 0.5 * rate * time * (time + h);
        let [b, a] = engine.system().coordinates() else { panic!() };
        assert!((b / angle - 1.0).abs() < 1e-9, "{n}: {b}, not {angle}");
        assert!((a / (n * angle) - 1.0).abs() < 1e-9, "{n}: {a}");
        // What the coupling does to each wheel accelerates it.
        let forces = &engine.forces().unwrap().joints;
        let [of_b, of_a] = [0, 1].map(|k| forces[k].coupling);
        assert!((of_a / (n * rate * INERTIA) - 1.0).abs() < 1e-9, "{n}: {of_a}");
        assert!((of_b + n * of_a).abs() < 1e-12 * of_a.abs(), "{n}: {of_b} and {of_a}");
        assert!((forces[0].torque.z / (0.5 + of_b) - 1.0).abs() < 1e-12 && forces[0].motor == 0.5);
    }
}

/// A motor that lifts a bar through a gear of −2 feels twice its torque, and does the work that the
/// bar gains.
#[test]
fn a_motor_lifts_through_a_gear() {
    let motor = "anchor = [0, 0, 0]\nmotor = { drive = { velocity = -0.5 }, limit = 10 }";
    let text = begin([0.0, -G, 0.0])
        + &bar("crank", [0.0; 3])
        + &bar("arm", [1.0 + HALF, 0.0, 0.0])
        + &joint("crank", "hinge", "crank", motor)
        + &joint("arm", "hinge", "arm", "anchor = [1, 0, 0]")
        + &couple("arm", "crank", -2.0, 0.0);
    let mut engine = engine(&text);
    let (h, mut work) = (1e-3, 0.0f64);
    let mut before = 0.0;
    let mut start = None;
    advance(&mut engine, 1000, h, |engine| {
        let [crank, arm] = [0, 1].map(|k| engine.system().coordinates()[k]);
        let effort = engine.forces().unwrap().joints[0].motor;
        let energy = engine.system().potential_energy() + engine.system().kinetic_energy();
        if let Some(start) = start {
            work += effort * (crank - before);
            // The arm turns at 1 rad/s: its weight alone acts, at the beginning of the step.
            let weight = MASS * G * HALF * (arm - h).cos();
            assert!((effort / (-2.0 * weight) - 1.0).abs() < 1e-6, "{effort} N m, weight {weight}");
            let gained: f64 = energy - start;
            assert!((work - gained).abs() < 1e-3 * MASS * G * HALF, "{work} J, not {gained} J");
        } else {
            start = Some(energy);
        }
        before = crank;
    });
    assert!((engine.system().coordinates()[1] - 1.0).abs() < 1e-9);
    // Held, it is the static balance.
    let at = engine.system().coordinates()[0];
    engine.set_motor(0, Some(Motor { drive: Drive::Position(at), limit: 10.0 })).unwrap();
    advance(&mut engine, 3, h, |_| {});
    let effort = engine.forces().unwrap().joints[0].motor;
    let weight = MASS * G * HALF * 1.0_f64.cos();
    assert!((effort / (-2.0 * weight) - 1.0).abs() < 1e-6, "{effort} N m");
    // Too weak a motor lets it fall.
    engine.set_motor(0, Some(Motor { drive: Drive::Position(at), limit: 1.9 * weight })).unwrap();
    advance(&mut engine, 200, h, |_| {});
    assert!(engine.system().coordinates()[1] < 0.99);
}

/// A weight that hangs from a wheel by a rope: a slider that follows a hinge. It falls at
/// m g / (m + I / r²), and the other way round.
#[test]
fn a_weight_falls_by_the_inertia_of_its_wheel() {
    let radius = 0.05;
    for wheel_follows in [false, true] {
        let coupling = match wheel_follows {
            false => couple("weight", "wheel", -radius, 0.1),
            true => couple("wheel", "weight", -1.0 / radius, 0.1 / radius),
        };
        let text = begin([0.0, 0.0, -G])
            + &bar("wheel", [0.0; 3])
            + &bar("weight", [1.0, 0.0, 0.0])
            + &joint("wheel", "hinge", "wheel", "")
            + &joint("weight", "slider", "weight", "coordinate = 0.1")
            + &coupling;
        let mut engine = engine(&text);
        let (h, steps) = (1e-3, 500);
        advance(&mut engine, steps, h, |_| {});
        let acceleration = MASS * G / (MASS + INERTIA / (radius * radius));
        let time = h * steps as f64;
        let fallen = 0.5 * acceleration * time * (time + h);
        let [angle, height] = engine.system().coordinates() else { panic!() };
        assert!((0.1 - height - fallen).abs() < 1e-9 * fallen, "{height} m, not −{fallen} m");
        assert!((angle * radius - fallen).abs() < 1e-9);
    }
}

/// A gripper on an arm that swings: fingers on sliders that mirror each other, the palm on a hinge
/// of the arm, which falls. A motor moves one finger, a force pulls at the other.
fn gripper(more: &str) -> String {
    let slider = |name: &str, more: &str| {
        joint(name, "slider", name, &format!("parent = \"palm\"\naxis = [0, 1, 0]\n{more}"))
    };
    begin([0.0, 0.0, -G])
        + &bar("arm", [HALF, 0.0, 0.0])
        + &bar("palm", [3.0 * HALF, 0.0, 0.0])
        + &bar("left", [5.0 * HALF, 0.05, 0.0])
        + &bar("right", [5.0 * HALF, -0.05, 0.0])
        + &joint("shoulder", "hinge", "arm", "anchor = [0, 0, 0]\naxis = [0, 1, 0]")
        + &joint("wrist", "hinge", "palm", "parent = \"arm\"\nanchor = [0.2, 0, 0]\naxis = [1, 0, 0]")
        + &slider(
            "left",
            "motor = { drive = { spring = { rest = 0.02, stiffness = 400, damping = 8 } }, limit = 50 }",
        )
        + &slider("right", "")
        + &couple("right", "left", -1.0, 0.0)
        + more
}

#[test]
fn mimic_fingers_mirror_each_other_while_the_arm_swings() {
    for h in [1e-3, 5e-3] {
        let mut engine = engine(&gripper(""));
        let wrench = |force: f64| tesdf_sim::Wrench {
            force: tesdf::glam::DVec3::new(0.0, force, 0.3 * force),
            torque: tesdf::glam::DVec3::new(0.1, 0.0, 0.02),
        };
        let steps = (2.0 / h) as usize;
        let (mut widest, mut turned) = (0.0f64, 0.0f64);
        for k in 0..4 {
            engine.set_wrench(3, wrench(if k % 2 == 0 { 3.0 } else { -2.0 })).unwrap();
            advance(&mut engine, steps / 4, h, |engine| {
                let [shoulder, wrist, left, right] = engine.system().coordinates() else { panic!() };
                assert!((left + right).abs() < EXACT);
                widest = widest.max(left.abs());
                turned = turned.max(shoulder.abs()).max(wrist.abs());
            });
        }
        assert!(widest > 0.015 && turned > 1.0, "{widest} m, {turned} rad");
    }
}

/// Kinetic energy and momentum of an arm that swings with coupled fingers stay: couplings do no
/// work.
#[test]
fn couplings_keep_energy() {
    let mut engine = engine(&gripper("").replace("motor = {", "# motor = {"));
    let energy = |engine: &Newton| engine.system().kinetic_energy() + engine.system().potential_energy();
    let mut states: Vec<State> = engine.system().states().to_vec();
    states[2].linear.y = 0.4;
    states[3].linear.y = -0.4;
    for (body, state) in states.into_iter().enumerate() {
        engine.set_state(body, state).unwrap();
    }
    let start = energy(&engine);
    advance(&mut engine, 300, 1e-3, |_| {});
    let moved = engine.system().coordinates()[2];
    assert!(moved > 0.05, "{moved} m");
    let lost = (energy(&engine) - start).abs();
    assert!(lost < 1e-2 * 4.0 * MASS * G * HALF, "{lost} J");
}

/// A chain of couplings, and a body that is moved: what is kinematic drives both joints.
#[test]
fn a_kinematic_body_drives_a_train_of_gears() {
    let text = begin([0.0; 3])
        + "[[bodies]]\nname = \"shaft\"\nkinematic = true\nangular_velocity = [0, 0, 7]\nshape = { sphere = { radius = 0.01 } }\n"
        + &bar("frame", [0.5, 0.0, 0.0])
        + &bar("one", [1.0, 0.0, 0.0])
        + &bar("two", [2.0, 0.0, 0.0])
        + &joint("frame", "weld", "frame", "")
        + &joint("shaft", "hinge", "frame", "parent = \"shaft\"\nanchor = [0, 0, 0]")
        + &joint("two", "hinge", "two", "")
        + &joint("one", "hinge", "one", "")
        // The later one is given first.
        + &couple("two", "one", 1.5, 0.0)
        + &couple("one", "shaft", -2.0, 0.0);
    let mut engine = engine(&text);
    advance(&mut engine, 1000, 1e-3, |_| {});
    let [_, shaft, two, one] = engine.system().coordinates() else { panic!() };
    for (found, expected) in [(shaft, -7.0), (one, 14.0), (two, 21.0)] {
        assert!((found - expected).abs() < 1e-8, "{found}, not {expected}");
    }
}

/// An impact feels the mass through the ratio: v' = m (1 + e) u / (m + M) with M = m_b + r² m_a.
#[test]
fn an_impact_feels_the_mass_through_the_ratio() {
    for (ratio, e) in [(2.0, 1.0), (-0.5, 0.5)] {
        let ball = |name: &str, at: [f64; 3], speed: f64| {
            format!(
                "[[bodies]]\nname = \"{name}\"\nmass = 1\ntranslation = {at:?}\nvelocity = [{speed:?}, 0, 0]\n\
                 restitution = {e:?}\nshape = {{ sphere = {{ radius = 0.05 }} }}\n"
            )
        };
        let text = "time_step = 1e-3\nduration = 1\ngravity = [0, 0, 0]\n".to_string()
            + &ball("a", [0.0, 1.0, 0.0], 0.0)
            + &ball("b", [0.0, 0.0, 0.0], 0.0)
            + &ball("hits", [-0.2, 0.0, 0.0], 2.0)
            + &joint("a", "slider", "a", "axis = [1, 0, 0]")
            + &joint("b", "slider", "b", "axis = [1, 0, 0]")
            + &couple("a", "b", ratio, 0.0);
        let mut engine = engine(&text);
        advance(&mut engine, 100, 1e-3, |_| {});
        let speed = |body: usize| engine.system().states()[body].linear.x;
        let expected = (1.0 + e) * 2.0 / (2.0 + ratio * ratio);
        let left = 2.0 - expected * (1.0 + ratio * ratio);
        for (body, expected) in [(0, ratio * expected), (1, expected), (2, left)] {
            assert!((speed(body) - expected).abs() < 1e-3, "{body}: {}, not {expected}", speed(body));
        }
    }
}

/// Coupled bodies fall asleep and wake together.
#[test]
fn coupled_bodies_sleep_and_wake_together() {
    let text = begin([0.0; 3])
        + &bar("one", [0.0; 3])
        + &bar("two", [1.0, 0.0, 0.0])
        + &bar("apart", [2.0, 0.0, 0.0])
        + &joint("one", "hinge", "one", "motor = { drive = { force = 0 }, limit = 1 }")
        + &joint("two", "hinge", "two", "")
        + &joint("apart", "hinge", "apart", "")
        + &couple("two", "one", 3.0, 0.0);
    let mut engine = engine(&text);
    let mut asleep = 0;
    for _ in 0..600 {
        asleep = engine.step(1e-3).unwrap().asleep;
    }
    assert_eq!(asleep, 3);
    engine.set_motor(0, Some(Motor { drive: Drive::Force(0.01), limit: 1.0 })).unwrap();
    let report = engine.step(1e-3).unwrap();
    assert_eq!((report.asleep, report.islands), (1, 1), "{report:?}");
    let [one, two, _] = engine.system().coordinates() else { panic!() };
    assert!(*one > 0.0 && (two - 3.0 * one).abs() < EXACT, "{one} {two}");
}

/// Snapshots and resets go on with the same bytes, in turns that a hinge has made as well.
#[test]
fn snapshots_and_resets_keep_couplings() {
    let motor = "motor = { drive = { velocity = 30 }, limit = 10 }";
    let text = begin([0.0; 3])
        + &bar("one", [0.0; 3])
        + &bar("two", [1.0, 0.0, 0.0])
        + &joint("one", "hinge", "one", motor)
        + &joint("two", "hinge", "two", "")
        + &couple("two", "one", -2.5, 0.0);
    let mut engine = engine(&text);
    let start = engine.system().states().to_vec();
    let states = |engine: &mut Newton| {
        advance(engine, 100, 1e-3, |_| {});
        engine.system().states().to_vec()
    };
    let first = states(&mut engine);
    let after_a_turn = states(&mut engine);
    assert!(engine.system().coordinates()[0] > 5.0);
    advance(&mut engine, 200, 1e-3, |_| {});
    let snapshot = engine.snapshot();
    let after_two_turns = states(&mut engine);
    engine.restore(&snapshot).unwrap();
    assert_eq!(states(&mut engine), after_two_turns);
    engine.reset(start).unwrap();
    assert_eq!(states(&mut engine), first);
    // A reset forgets turns: two turns of the one are five of the other, and one is no whole
    // number.
    engine.reset(after_two_turns).unwrap();
    let [one, two] = engine.system().coordinates() else { panic!() };
    assert!((0.0..4.0).contains(one) && (two + 2.5 * one).abs() < EXACT, "{one} {two}");
    let before = engine.system().clone();
    let told = engine.reset(after_a_turn).unwrap_err().to_string();
    assert!(told.contains("joint two: its coordinate is") && told.contains("it follows one"), "{told}");
    assert_eq!(engine.system().states(), before.states());
    assert_eq!(engine.system().coordinates(), before.coordinates());
}

/// A motor of any force against a limit of the joint that is coupled to it.
#[test]
fn a_coupling_that_cannot_hold_is_told() {
    let text = begin([0.0; 3])
        + &bar("one", [0.0; 3])
        + &bar("two", [1.0, 0.0, 0.0])
        + &joint("driven", "slider", "one", "motor = { drive = { velocity = 5 }, limit = inf }")
        + &joint("stops", "slider", "two", "limits = [0, 0.1]")
        + &couple("driven", "stops", 1.0, 0.0);
    let told = |text: &str| {
        let loaded = load(&text.replace("duration = 1\n", "duration = 0.03\n"));
        let (_, summary) = run(&loaded, loaded.system().unwrap());
        summary.warnings.iter().map(|w| (w.kind, w.names.clone())).collect::<Vec<_>>()
    };
    assert!(told(&text).contains(&(WarningKind::Joint, vec!["driven".into()])), "{:?}", told(&text));
    assert_eq!(told(&text.replace("limits = [0, 0.1]", "")), []);
}

#[test]
fn couplings_that_cannot_be_are_refused() {
    let scene = begin([0.0; 3])
        + &bar("one", [0.0; 3])
        + &bar("two", [1.0, 0.0, 0.0])
        + &bar("three", [2.0, 0.0, 0.0])
        + &bar("four", [3.0, 0.0, 0.0])
        + &bar("five", [4.0, 0.0, 0.0])
        + &joint("a", "hinge", "one", "")
        + &joint("b", "slider", "two", "coordinate = 0.1")
        + &joint("c", "hinge", "three", "")
        + &joint("weld", "weld", "four", "")
        + &joint("ball", "ball", "five", "");
    let refusal = |couplings: &str| {
        let loaded = load(&(scene.clone() + couplings));
        loaded.system().map(drop).unwrap_err().to_string()
    };
    let many = couple("a", "c", 2.0, 0.0);
    for (couplings, expected) in [
        (couple("a", "x", 1.0, 0.0), "number 1: there is no joint x"),
        (couple("a", "weld", 1.0, 0.0), "joint weld: it is a weld; only hinges and sliders"),
        (couple("ball", "a", 1.0, 0.0), "joint ball: it is a ball; only hinges and sliders"),
        (couple("a", "a", 1.0, 0.0), "joint a: it follows itself"),
        (couple("a", "c", 0.0, 0.0), "joint a: it follows c with the ratio 0; expected a finite number"),
        (couple("a", "c", 1.0, 0.0).replace("ratio = 1.0", "ratio = inf"), "with the ratio inf"),
        (couple("a", "c", 1.0, 0.0).replace("offset = 0.0", "offset = nan"), "with the offset NaN"),
        (many.clone() + &couple("a", "b", 1.0, 0.0), "number 2: joint a: it follows both c and b"),
        (many.clone() + &couple("c", "a", 0.5, 0.0), "number 2: joint c: it follows a, which follows c"),
        (
            couple("a", "b", 1.0, 0.0),
            "joint a: its coordinate is 0; expected 0.1: it follows b, which is at 0.1",
        ),
    ] {
        let told = refusal(&couplings);
        assert!(told.contains(expected), "{told}\nexpected {expected}");
        assert!(told.starts_with("couplings.toml, line 56: couplings: "), "{told}");
    }
    assert!(load(&(scene + &couple("a", "b", 1.0, -0.1))).system().is_ok());
}
