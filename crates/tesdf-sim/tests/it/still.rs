//! Bodies at rest stay bit for bit also where nothing sleeps, and move as soon as something acts on
//! them.
use tesdf::glam::DVec3;
use tesdf_sim::newton::Newton;
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Dynamics, State, Wrench};

/// s
const STEP: f64 = 5e-3;

/// Steps after which a step begins without the forces of the last one.
const FORGETS: usize = 16;

/// Boxes of side 0.1 m and 1 kg on a plane, `stacks` times `boxes` on each other, which never
/// sleep.
fn stacks(stacks: usize, boxes: usize, friction: f64) -> Newton {
    let body = |k: usize| {
        let [x, z] = [k / boxes, k % boxes].map(|k| k as f64);
        format!(
            "{{ name = \"box{k}\", mass = 1, friction = {friction:?}, \
             shape = {{ box = {{ half_extents = [0.05, 0.05, 0.05] }} }}, translation = [{:?}, 0, {:?}] }},",
            0.3 * x,
            0.05 + 0.1 * z
        )
    };
    let bodies: String = (0..stacks * boxes).map(body).collect();
    let text = format!(
        "time_step = {STEP:?}\nduration = 1\nsolver.sleep = 0\n\
         bodies = [{{ name = \"floor\", shape = \"plane\", fixed = true, friction = {friction:?} }}, {bodies}]"
    );
    let loaded = LoadedScene::parse(text, "scene.toml").unwrap();
    loaded.newton(loaded.system().unwrap()).unwrap()
}

fn run(engine: &mut Newton, steps: usize) {
    for _ in 0..steps {
        engine.step(STEP).unwrap();
    }
}

/// Nothing is solved again but where forces are forgotten, and the forces stay.
#[test]
fn bodies_at_rest_stay_bit_for_bit() {
    for friction in [0.0, 0.5] {
        let mut engine = stacks(3, 3, friction);
        run(&mut engine, 2 * FORGETS);
        let before = engine.system().states().to_vec();
        assert!(before.iter().all(|state| *state == State::at_rest(state.pose)));
        for step in 0..2 * FORGETS {
            let report = engine.step(STEP).unwrap();
            assert_eq!(engine.system().states(), before);
            assert_eq!(report.iterations > 0, step % FORGETS == 0, "step {step}: {}", report.iterations);
            let total: f64 = engine.forces().unwrap().contacts.iter().map(|force| force.normal_force).sum();
            assert!((total - 3.0 * 6.0 * 9.81).abs() < 1e-6, "step {step}: {total} N");
        }
    }
}

/// A box on a plane without friction, under 1e-9 of its weight.
#[test]
fn a_billionth_of_its_weight_moves_a_body() {
    let mut engine = stacks(2, 1, 0.0);
    run(&mut engine, 20);
    let force = DVec3::X * 9.81e-9;
    engine.set_wrench(1, Wrench { force, ..Wrench::default() }).unwrap();
    run(&mut engine, 200);
    let [pushed, other] = [1, 2].map(|body| engine.system().states()[body]);
    assert!((pushed.linear.x / 9.81e-9 - 1.0).abs() < 1e-3, "{} m/s", pushed.linear.x);
    assert_eq!(other, State::at_rest(other.pose));
}

/// A stack of which the lowest box is pushed falls as one that has just been built.
#[test]
fn a_push_moves_what_has_been_at_rest() {
    let [new, old] = [0, 40].map(|steps| {
        let mut engine = stacks(2, 3, 0.5);
        run(&mut engine, steps);
        engine.set_wrench(1, Wrench { force: DVec3::X * 40.0, ..Wrench::default() }).unwrap();
        run(&mut engine, 20);
        engine.system().states().to_vec()
    });
    for (body, (new, old)) in new.iter().zip(&old).enumerate() {
        let apart = new.pose.translation.distance(old.pose.translation);
        assert!(apart < 1e-4, "body {body}: {apart:e} m");
    }
    assert!(old[1].pose.translation.x > 0.05, "{}", old[1].pose.translation);
}
