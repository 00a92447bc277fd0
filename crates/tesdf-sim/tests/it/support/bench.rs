//! Scene files that tests write: all that they do not say has the default of scene files.
use std::fmt::Write;
use std::ops::ControlFlow;

use tempfile::TempDir;
use tesdf::collide::{Pose, Velocity};
use tesdf::glam::DVec3;
use tesdf::mesh::{TriangleMesh, write};
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Moment, State, StepReport, simulate};

use super::meshes;

/// Time step of the scenes, s.
pub const STEP: f64 = 5e-3;

/// How a body is made.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    Mesh,
    Shape,
}

/// A body of a scene.
#[derive(Clone, Debug)]
pub struct Body {
    /// The line of the scene file that gives the geometry.
    pub geometry: String,
    /// kg; `None` for a fixed body.
    pub mass: Option<f64>,
    pub friction: f64,
    pub pose: Pose,
    pub velocity: Velocity,
}

impl Body {
    pub fn fixed(geometry: impl Into<String>) -> Self {
        let (pose, velocity) = (Pose::IDENTITY, Velocity::default());
        Self { geometry: geometry.into(), mass: None, friction: 0.0, pose, velocity }
    }

    pub fn free(geometry: impl Into<String>, mass: f64, pose: Pose) -> Self {
        Self { mass: Some(mass), pose, ..Self::fixed(geometry) }
    }

    /// The half space z ≤ 0.
    pub fn plane(friction: f64) -> Self {
        Self { friction, ..Self::fixed("shape = \"plane\"") }
    }

    pub fn moving(self, linear: DVec3) -> Self {
        Self { velocity: Velocity { linear, angular: DVec3::ZERO }, ..self }
    }
}

/// The geometry of a ball.
pub fn ball(radius: f64) -> String {
    format!("shape = {{ sphere = {{ radius = {radius:?} }} }}")
}

/// Runs scenes whose meshes are in a folder of its own.
pub struct Bench(TempDir);

impl Bench {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// The geometry of a mesh.
    pub fn mesh(&self, name: &str, mesh: &TriangleMesh) -> String {
        let file = format!("{name}.ply");
        write(self.0.path().join(&file), mesh).unwrap();
        format!("mesh = \"{file}\"")
    }

    /// The geometry of a box about the origin.
    pub fn cuboid(&self, kind: Kind, half: DVec3) -> String {
        match kind {
            Kind::Mesh => self.mesh(&format!("box {half}"), &meshes::cuboid(-half, half)),
            Kind::Shape => format!("shape = {{ box = {{ half_extents = {:?} }} }}", half.to_array()),
        }
    }

    /// The states of the bodies, at the start and after each step, of a run of `duration` seconds.
    /// `settings` are top keys of the scene file, which says of the engine nothing else.
    pub fn run(&self, settings: &str, bodies: &[Body], duration: f64) -> Vec<Vec<State>> {
        self.watch(settings, bodies, duration).0
    }

    /// The same with what each step reports.
    pub fn watch(
        &self,
        settings: &str,
        bodies: &[Body],
        duration: f64,
    ) -> (Vec<Vec<State>>, Vec<StepReport>) {
        let loaded = self.load(settings, bodies, duration);
        let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
        let mut reports = Vec::new();
        let see = |moment: &Moment<'_>| {
            reports.push(moment.report);
            ControlFlow::Continue(())
        };
        let (record, _) = simulate(&loaded.scene, &mut engine, see).unwrap();
        ((0..=record.steps() as usize).map(|step| record.states(step).unwrap()).collect(), reports)
    }

    /// The scene of these bodies, whose names are their numbers.
    pub fn load(&self, settings: &str, bodies: &[Body], duration: f64) -> LoadedScene {
        let mut text = format!("time_step = {STEP:?}\nduration = {duration:?}\n{settings}\n");
        for (k, body) in bodies.iter().enumerate() {
            let Body { geometry, mass, friction, pose, velocity } = body;
            let mass = mass.map_or("fixed = true".into(), |mass| format!("mass = {mass:?}"));
            writeln!(text, "[[bodies]]\nname = \"{k}\"\n{geometry}\n{mass}\nfriction = {friction:?}")
                .unwrap();
            for (key, value) in [
                ("translation", pose.translation),
                ("velocity", velocity.linear),
                ("angular_velocity", velocity.angular),
            ] {
                writeln!(text, "{key} = {:?}", value.to_array()).unwrap();
            }
            writeln!(text, "rotation = {:?}", pose.rotation.to_array()).unwrap();
        }
        LoadedScene::parse(text, self.0.path().join("scene.toml")).unwrap()
    }
}
