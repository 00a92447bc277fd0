//! What a run cannot obey is told, and nothing else is.
use std::ops::ControlFlow;

use tesdf::collide::{Contact, HiddenOverlap};
use tesdf_sim::newton::Newton;
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{
    Dynamics, DynamicsError, Motor, State, StepReport, Summary, System, Warning, WarningKind, Wrench,
    simulate,
};

use crate::support;

const BOX: &str = "shape = { box = { half_extents = [0.05, 0.05, 0.05] } }";

fn load(text: &str) -> LoadedScene {
    LoadedScene::parse(text.into(), "scene.toml").unwrap()
}

fn summary(text: &str) -> Summary {
    let loaded = load(text);
    support::run(&loaded, loaded.system().unwrap()).1
}

fn of(kind: WarningKind, summary: &Summary) -> &Warning {
    let found = summary.warnings.iter().find(|warning| warning.kind == kind);
    found.unwrap_or_else(|| panic!("no {kind:?} in {:?}", summary.warnings))
}

/// A box on a plane, and what else there is.
fn on_a_plane(height: f64, duration: f64, more: &str) -> String {
    format!(
        "time_step = 0.005\nduration = {duration}\n{more}\n[[bodies]]\nname = \"plane\"\nshape = \"plane\"\nfixed = \
         true\n[[bodies]]\nname = \"box\"\n{BOX}\nmass = 1.0\ntranslation = [0, 0, {height:?}]\n"
    )
}

#[test]
fn bodies_that_rest_fall_or_come_apart_give_no_warning() {
    for height in [0.05, 0.15, 0.03] {
        assert_eq!(summary(&on_a_plane(height, 0.3, "")).warnings, [], "{height}");
    }
}

/// The press goes to 8 cm above the plane, less half of its thickness: it crushes the box by 4 cm.
#[test]
fn a_press_that_crushes_is_told() {
    let press = r#"
[[bodies]]
name = "press"
shape = { box = { half_extents = [0.1, 0.1, 0.02] } }
kinematic = true
translation = [0, 0, 0.121]

[[scripts]]
body = "press"
keyframes = [{ time = 0.1 }, { time = 0.5, translation = [0, 0, 0.08] }]
"#;
    let told = summary(&(on_a_plane(0.05, 0.5, "") + press));
    let overlap = of(WarningKind::Overlap, &told);
    assert!(overlap.names.contains(&"box".into()), "{overlap:?}");
    assert!((0.01..0.05).contains(&overlap.value), "{overlap:?}");
    assert!(overlap.message.contains("at the end"), "{overlap:?}");
}

#[test]
fn overlaps_without_detection_are_no_warning() {
    let text = on_a_plane(0.05, 0.1, "gravity = [0, 0, -9.81]") + "[detector]\nmode = \"off\"\n";
    assert_eq!(summary(&text).warnings, []);
}

/// Both welds hold one box, and one of their other ends goes away by 25 cm.
#[test]
fn joints_that_contradict_each_other_are_told() {
    let text = format!(
        r#"
time_step = 0.005
duration = 0.4

[[bodies]]
name = "p"
{BOX}
kinematic = true
translation = [-0.2, 0, 0.5]

[[bodies]]
name = "q"
{BOX}
kinematic = true
translation = [0.2, 0, 0.5]

[[bodies]]
name = "b"
{BOX}
mass = 1.0
translation = [0, 0, 0.5]

[[joints]]
name = "u"
kind = "weld"
parent = "p"
child = "b"
anchor = [-0.05, 0, 0.5]

[[joints]]
name = "v"
kind = "weld"
parent = "q"
child = "b"
anchor = [0.05, 0, 0.5]

[[scripts]]
body = "q"
keyframes = [{{ time = 0.1 }}, {{ time = 0.4, translation = [0.45, 0, 0.5] }}]
"#
    );
    let told = summary(&text);
    let joint = of(WarningKind::Joint, &told);
    let drift = told.joint_drift.unwrap().distance;
    assert_eq!((joint.value, joint.count), (drift, 2), "{joint:?}");
    assert!(drift > 0.1 && (joint.names == ["u"] || joint.names == ["v"]), "{joint:?}");
}

/// Makes bodies faster by this factor in each step.
struct Pushed(Newton, f64, Ending);

/// What a step says of its solution.
#[derive(Clone, Copy, PartialEq)]
enum Ending {
    Converged,
    Unconverged,
}

impl Dynamics for Pushed {
    fn system(&self) -> &System {
        self.0.system()
    }

    fn set_state(&mut self, body: usize, state: State) -> Result<(), DynamicsError> {
        self.0.set_state(body, state)
    }

    fn set_motor(&mut self, joint: usize, motor: Option<Motor>) -> Result<(), DynamicsError> {
        self.0.set_motor(joint, motor)
    }

    fn set_wrench(&mut self, body: usize, wrench: Wrench) -> Result<(), DynamicsError> {
        self.0.set_wrench(body, wrench)
    }

    fn step(&mut self, time_step: f64) -> Result<StepReport, DynamicsError> {
        let report = self.0.step(time_step)?;
        let converged = report.converged && self.2 == Ending::Converged;
        for (body, state) in self.0.system().states().to_vec().into_iter().enumerate() {
            let linear = self.1 * state.linear;
            self.0.set_state(body, State { linear, ..state })?;
        }
        Ok(StepReport { converged, ..report })
    }

    fn contacts(&self) -> &[Contact] {
        self.0.contacts()
    }

    fn hidden(&self) -> &[HiddenOverlap] {
        self.0.hidden()
    }
}

#[test]
fn energy_from_nowhere_is_told() {
    let loaded = load(&on_a_plane(10.0, 0.5, ""));
    let told = |factor: f64| {
        let engine = loaded.newton(loaded.system().unwrap()).unwrap();
        simulate(&loaded.scene, &mut Pushed(engine, factor, Ending::Converged), |_| ControlFlow::Continue(()))
            .unwrap()
            .1
    };
    assert_eq!(told(1.0).warnings, []);
    let summary = told(1.01);
    let gain = of(WarningKind::Energy, &summary).value;
    // What the body has beyond what gravity gave it.
    let right = summary.kinetic_energy - summary.released_energy;
    assert!((gain / right - 1.0).abs() < 0.1, "{gain} J, not {right} J");
}

#[test]
fn steps_that_do_not_converge_are_told() {
    let loaded = load(&on_a_plane(0.05, 0.1, ""));
    let mut engine = Pushed(loaded.newton(loaded.system().unwrap()).unwrap(), 1.0, Ending::Unconverged);
    let summary = simulate(&loaded.scene, &mut engine, |_| ControlFlow::Continue(())).unwrap().1;
    assert_eq!(summary.unconverged_steps, 20);
    let told = of(WarningKind::NotConverged, &summary);
    assert_eq!((told.count, told.value), (20, 1.0));
    // No solve leaves anything, so what did not converge is the motion of a fast pair.
    assert!(told.message.contains("fast bodies may have passed into each other"), "{}", told.message);
}
