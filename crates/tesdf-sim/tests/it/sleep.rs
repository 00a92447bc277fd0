//! Bodies at rest sleep until something touches or drives them, and nothing is lost by that.
use std::ops::ControlFlow;

use rayon::ThreadPoolBuilder;
use tesdf::collide::{Contact, Pose};
use tesdf::glam::{DQuat, DVec3};
use tesdf::save::{Destination, SaveOptions};
use tesdf_sim::newton::Newton;
use tesdf_sim::record::{InterruptedRun, RunJournal, RunOrigin, RunRecord};
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Drive, Dynamics, Motor, PartialRun, SimulateError, State, Wrench, simulate, simulate_from};

/// Time step, s.
const STEP: f64 = 5e-3;

/// How far runs with and without sleep may be apart, m.
const TOLERANCE: f64 = 1e-6;

/// The same some steps after a hit of 2 m/s, m: the corners of flush faces are known to 1e-6 of a
/// body, 0.1 µm, and at other corners the hit turns a box by some mrad/s more.
const AFTER_HIT: f64 = 2e-4;

/// A kinematic plate of 1 m² whose top is at z = 0.
const PLATE: &str = r#"
[[bodies]]
name = "plate"
shape = { box = { half_extents = [0.5, 0.5, 0.05] } }
kinematic = true
friction = 0.5
translation = [0, 0, -0.05]
"#;

/// Boxes of side 0.1 m that stand on each other at `x`.
fn stack(x: f64, boxes: usize, friction: f64) -> String {
    let body = |k: usize| {
        format!(
            "[[bodies]]\nname = \"box {x} {k}\"\nmass = 1\nfriction = {friction:?}\n\
             shape = {{ box = {{ half_extents = [0.05, 0.05, 0.05] }} }}\n\
             translation = [{x:?}, 0, {:?}]\n",
            0.05 + 0.1 * k as f64
        )
    };
    (0..boxes).map(body).collect()
}

/// A door of 1 m on a hinge at the z axis, which hangs in the air.
const DOOR: &str = r#"
[[bodies]]
name = "door"
shape = { box = { half_extents = [0.5, 0.02, 1] } }
mass = 10
translation = [0.5, 0, 3]

[[joints]]
name = "hinge"
kind = "hinge"
child = "door"
axis = [0, 0, 1]
anchor = [0, 0, 3]
"#;

fn load(bodies: &str, sleep: f64, duration: f64) -> LoadedScene {
    let text = format!(
        "time_step = {STEP:?}\nduration = {duration:?}\n[record]\ncontacts_every = 1\n\
         [solver]\nsleep = {sleep:?}\n{bodies}"
    );
    LoadedScene::parse(text, "scene.toml").unwrap()
}

/// A scene with and without sleep.
struct Two([Newton; 2]);

impl Two {
    fn new(bodies: &str) -> Self {
        Self([0.5, 0.0].map(|sleep| {
            let loaded = load(bodies, sleep, 1.0);
            loaded.newton(loaded.system().unwrap()).unwrap()
        }))
    }

    /// Both after a second, in which all `free` bodies of the first have fallen asleep.
    fn at_rest(bodies: &str, free: usize) -> Self {
        let mut this = Self::new(bodies);
        assert_eq!(this.run(1.0), [free, 0]);
        this
    }

    fn set(&mut self, change: impl Fn(&mut Newton)) {
        self.0.iter_mut().for_each(change);
    }

    /// The numbers of bodies that are asleep after some seconds.
    fn run(&mut self, seconds: f64) -> [usize; 2] {
        self.0.each_mut().map(|engine| {
            let steps = (seconds / STEP).round() as usize;
            (0..steps).map(|_| engine.step(STEP).unwrap().asleep).last().unwrap()
        })
    }

    /// Checks that the bodies are within the tolerance after each of some steps.
    fn agree(&mut self, steps: usize) {
        self.agree_within(TOLERANCE, steps);
    }

    fn agree_within(&mut self, tolerance: f64, steps: usize) {
        for step in 0..steps {
            self.run(STEP);
            let far = apart(self.states(), self.0[1].system().states());
            assert!(far < tolerance, "{far:e} m after {} steps", step + 1);
        }
    }

    /// The states of the bodies that sleep.
    fn states(&self) -> &[State] {
        self.0[0].system().states()
    }
}

/// The greatest distance between places of bodies, and between ends of their axes of 1 m.
fn apart(a: &[State], b: &[State]) -> f64 {
    let points = |pose: Pose| [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| pose.to_world(p));
    let of_poses = |a: Pose, b: Pose| points(a).into_iter().zip(points(b)).map(|(p, q)| p.distance(q));
    a.iter().zip(b).flat_map(|(a, b)| of_poses(a.pose, b.pose)).fold(0.0, f64::max)
}

#[test]
fn a_stack_at_rest_falls_asleep_and_stays_bit_for_bit() {
    let mut two = Two::new(&[PLATE, &stack(0.0, 4, 0.0)].concat());
    assert_eq!(two.run(0.45), [0, 0]);
    assert_eq!(two.run(0.1), [4, 0]);
    let before = two.states().to_vec();
    two.agree(100);
    assert_eq!(two.states(), before);
    assert!(before.iter().all(|state| *state == State::at_rest(state.pose)));
    // Its contacts are still told. Where edges are flush, rounding decides which parts of a pair
    // touch.
    let [asleep, awake] = two.0.each_ref().map(|engine| {
        let ids = |c: &Contact| (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b));
        let mut pairs: Vec<_> = engine.contacts().iter().map(ids).collect();
        assert!(pairs.len() >= 4 * 4 && pairs.is_sorted());
        pairs.dedup();
        pairs
    });
    assert_eq!(asleep, awake);
    assert_eq!(asleep.len(), 4);
}

/// The plate moves up at once. All boxes move with it in the same step.
#[test]
fn a_stack_that_is_hit_from_below_passes_the_push_on_at_once() {
    let mut two = Two::at_rest(&[PLATE, &stack(0.0, 4, 0.0)].concat(), 4);
    let before = two.states().to_vec();
    let lift = |speed: f64| {
        move |engine: &mut Newton| {
            let state = engine.system().states()[0];
            engine.set_state(0, State { linear: speed * DVec3::Z, ..state }).unwrap();
        }
    };
    two.set(lift(0.2));
    two.agree(1);
    for (state, before) in two.states().iter().zip(&before) {
        let way = state.pose.translation.z - before.pose.translation.z;
        assert!((way - 0.2 * STEP).abs() < TOLERANCE, "{way}");
    }
    two.agree(20);
    // It goes down from under them.
    two.set(lift(0.0));
    assert_eq!(two.run(1.5), [4, 0]);
    two.set(lift(-0.2));
    two.agree(40);
}

/// A ball slides against the lowest box of a stack, and a box falls on another stack.
#[test]
fn a_stack_that_is_hit_by_free_bodies_wakes() {
    let ball = "[[bodies]]\nname = \"ball\"\nmass = 2\nshape = { sphere = { radius = 0.04 } }\n\
                translation = [-0.3, 0, 0.04]\n";
    for friction in [0.0, 0.5] {
        let scene = [PLATE, &stack(0.0, 3, friction), &stack(0.3, 2, friction), ball].concat();
        let mut two = Two::at_rest(&scene, 6);
        let fast = |engine: &mut Newton| {
            let state = engine.system().states()[6];
            engine.set_state(6, State { linear: 2.0 * DVec3::X, ..state }).unwrap();
        };
        two.set(fast);
        // The other stack sleeps on: two boxes.
        assert_eq!(two.run(STEP), [5, 0]);
        // It hits after 0.105 s.
        two.agree(20);
        two.agree_within(AFTER_HIT, 4);
        let states = two.states();
        let [ball, moved] = [6, 1].map(|body| states[body].linear.x);
        assert!(moved > 0.1 && ball < 1.5, "{moved} {ball}");
        assert_eq!(two.run(STEP), [2, 0]);
    }
}

/// A body that comes to rest on others that sleep joins them, and nobody wakes again.
#[test]
fn a_body_that_lands_on_a_stack_sleeps_with_it() {
    let mut two = Two::at_rest(&[PLATE, &stack(0.0, 3, 0.5)].concat(), 3);
    let raise = |engine: &mut Newton| {
        let State { pose, .. } = engine.system().states()[3];
        let pose = Pose { translation: pose.translation + 0.02 * DVec3::Z, ..pose };
        engine.set_state(3, State::at_rest(pose)).unwrap();
    };
    two.set(raise);
    assert_eq!(two.run(STEP), [0, 0]);
    two.agree(100);
    assert_eq!(two.run(1.0), [3, 0]);
    for _ in 0..100 {
        assert_eq!(two.run(STEP), [3, 0]);
    }
}

#[test]
fn bodies_fall_when_what_they_lie_on_is_taken_away() {
    let mut two = Two::at_rest(&[PLATE, &stack(0.0, 3, 0.5)].concat(), 3);
    let away = |engine: &mut Newton| {
        engine.set_state(0, State::at_rest(Pose::at(-9.0 * DVec3::Z))).unwrap();
    };
    two.set(away);
    two.agree(20);
    let falls = two.states()[3].linear.z;
    // The solver leaves 0.1 nm a step at most.
    assert!((falls + 9.81 * 20.0 * STEP).abs() < 1e-10 / STEP, "{falls}");
}

#[test]
fn a_door_at_rest_opens_when_a_motor_or_a_wrench_is_set() {
    let motor = Motor { drive: Drive::Velocity(1.0), limit: 100.0 };
    let wrench = Wrench { torque: 5.0 * DVec3::Z, ..Wrench::default() };
    let drives: [&dyn Fn(&mut Newton); 2] =
        [&|engine| engine.set_motor(0, Some(motor)).unwrap(), &|engine| {
            engine.set_wrench(0, wrench).unwrap()
        }];
    for drive in drives {
        let mut two = Two::at_rest(DOOR, 1);
        two.set(drive);
        assert_eq!(two.run(STEP), [0, 0]);
        two.agree(100);
        let turned = two.states()[0].pose.rotation.angle_between(DQuat::IDENTITY);
        assert!(turned > 0.1, "{turned}");
        // What is set again to the same value drives nothing: a door that a motor holds sleeps.
        two.set(|engine| {
            engine.set_motor(0, Some(Motor { drive: Drive::Velocity(0.0), limit: 100.0 })).unwrap();
            engine.set_wrench(0, Wrench::default()).unwrap();
        });
        assert_eq!(two.run(1.0), [1, 0]);
        two.set(|engine| engine.set_wrench(0, Wrench::default()).unwrap());
        assert_eq!(two.run(STEP), [1, 0]);
        two.set(|engine| engine.set_motor(0, None).unwrap());
        assert_eq!(two.run(STEP), [0, 0]);
    }
}

#[test]
fn bodies_wake_when_gravity_turns() {
    let mut two = Two::at_rest(&[PLATE, &stack(0.0, 2, 0.0)].concat(), 2);
    two.set(|engine| engine.set_gravity(DVec3::new(1.0, 0.0, -9.7)).unwrap());
    two.agree(20);
    let slides = two.states()[1].linear.x;
    assert!((slides - 20.0 * STEP).abs() < 1e-6, "{slides}");
}

/// It stands still for a moment at each end of its way, and at the beginning.
#[test]
fn a_pendulum_never_sleeps_and_bodies_that_are_let_go_fall() {
    let pendulum = DOOR.replace("axis = [0, 0, 1]", "axis = [0, 1, 0]");
    let ball = "[[bodies]]\nname = \"ball\"\nmass = 2\nshape = { sphere = { radius = 0.04 } }\n\
                translation = [0, 9, 0]\n";
    let loaded = load(&[ball, &pendulum].concat(), 0.5, 1.0);
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    for _ in 0..1000 {
        assert_eq!(engine.step(STEP).unwrap().asleep, 0);
    }
    let falls = engine.system().states()[0].linear.z;
    assert!((falls + 9.81 * 5.0).abs() < 1e-9, "{falls}");
}

/// A plate lifts a stack and stops, a wrench pushes another one, and a motor opens a door; all begin
/// and end at rest.
fn scripted(sleep: f64) -> LoadedScene {
    let scripts = r#"
[[scripts]]
body = "plate"
keyframes = [{ time = 1 }, { time = 1.2, translation = [0, 0, -0.03] }]

[[scripts]]
body = "box 0.3 1"
interpolation = "step"
keyframes = [{ time = 0 }, { time = 1.9, force = [8, 0, 0] }, { time = 1.95, force = [0, 0, 0] }]

[[scripts]]
joint = "hinge"
interpolation = "step"
keyframes = [{ time = 0, target = 0 }, { time = 0.8, target = 1 }, { time = 1, target = 0 }]
"#;
    let motor = "motor = { drive = { velocity = 0 }, limit = 1000 }\n";
    let scene = [PLATE, &stack(0.0, 3, 0.5), &stack(0.3, 2, 0.5), DOOR, motor, scripts].concat();
    load(&scene, sleep, 2.6)
}

/// The record of a scene, and the numbers of bodies that are asleep after each step.
fn record(loaded: &LoadedScene) -> (RunRecord, Vec<usize>) {
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let mut asleep = Vec::new();
    let see = |moment: &tesdf_sim::Moment<'_>| {
        asleep.push(moment.report.asleep);
        ControlFlow::Continue(())
    };
    let (record, summary) = simulate(&loaded.scene, &mut engine, see).unwrap();
    assert_eq!(Some(&summary.asleep), asleep.last());
    (record, asleep)
}

#[test]
fn a_run_in_which_bodies_sleep_and_wake_is_that_in_which_they_do_not() {
    let ((slept, asleep), (awake, none)) = (record(&scripted(0.5)), record(&scripted(0.0)));
    assert!(none.iter().all(|&count| count == 0));
    // Before the door opens, while the plate moves, after that, and at the end.
    assert_eq!([0.7, 1.1, 1.85, 2.6].map(|time: f64| asleep[(time / STEP) as usize - 1]), [6, 0, 6, 6]);
    for step in 0..=slept.steps() as usize {
        let far = apart(&slept.states(step).unwrap(), &awake.states(step).unwrap());
        assert!(far < TOLERANCE, "{far:e} m apart after {step} steps");
    }
}

#[test]
fn threads_do_not_change_the_bytes_of_a_run_with_sleep() {
    let loaded = scripted(0.5);
    let bytes = [1, 2, 8].map(|threads| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| record(&loaded).0.to_bytes().unwrap())
    });
    assert!(bytes[0] == bytes[1] && bytes[0] == bytes[2]);
}

/// Interrupted while bodies are awake, asleep, and in the steps in which some wake and fall asleep.
#[test]
fn a_run_that_is_resumed_sleeps_as_before() {
    let loaded = scripted(0.5);
    let (whole, asleep) = record(&loaded);
    let changes = (1..asleep.len()).filter(|&k| asleep[k] != asleep[k - 1]);
    let mut ends: Vec<u64> = changes.flat_map(|k| [k as u64, k as u64 + 1]).collect();
    ends.extend([3, 130, 230, 500]);
    ends.sort_unstable();
    ends.dedup();
    assert!(ends.len() > 8, "{ends:?}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let destination = Destination::new(path.clone(), &SaveOptions::default()).unwrap();
    let origin = RunOrigin::of(&loaded.system().unwrap(), "cpu").unwrap();
    // Each run goes on from the one before it.
    let mut cut: Option<InterruptedRun> = None;
    for until in ends.into_iter().map(Some).chain([None]) {
        let mut system = loaded.system().unwrap();
        let begun = match &cut {
            Some(cut) => {
                cut.run.restore(&mut system).unwrap();
                cut.run.clone()
            }
            None => PartialRun::new(&loaded.scene, &system, String::new()),
        };
        let mut engine = loaded.newton(system).unwrap();
        let mut journal = cut.map(|cut| RunJournal::resume(&destination, &cut).unwrap().unwrap());
        let ended = simulate_from(&loaded.scene, &mut engine, begun, |moment| {
            let begin = || RunJournal::begin(&destination, moment.record, &origin).unwrap().unwrap();
            journal.get_or_insert_with(begin).push(moment.record, &moment.report).unwrap();
            assert_eq!(moment.report.asleep, asleep[moment.step as usize - 1], "step {}", moment.step);
            match Some(moment.step) == until {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        });
        match (ended, until) {
            (Ok((record, _)), None) => assert!(record.to_bytes().unwrap() == whole.to_bytes().unwrap()),
            (Err(SimulateError::Interrupted { .. }), Some(_)) => {}
            (ended, _) => panic!("{ended:?}"),
        }
        cut = InterruptedRun::open(&path).ok();
    }
}
