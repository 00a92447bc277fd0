//! The pile of shafts, with other encodings of the shaft.
use std::sync::Arc;

use tesdf::TeSdf;
use tesdf::collide::{Instance, Mode, Shape, ShapeId};
use tesdf_sim::criterion::SeparationCriterion;
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{PartialRun, RunRecord, Summary, System, simulate_from};

use super::PileArgs;
use crate::tables::detector::Shared;
use tesdf_cli::terminal::progress::Bar;
use tesdf_cli::terminal::report::Failure;

/// Name of the scene's file, without its extension.
const NAME: &str = "pile-of-shafts";

/// Number of iterations of Frank–Wolfe. With 16, it misses minima, and 15 µm remain at the end.
const ITERATIONS: u32 = 32;

/// Number of shafts and of frames with `--quick`.
const QUICK: (usize, u32) = (24, 10);

/// The scene, and its bodies with exact fields.
pub struct Pile {
    pub loaded: LoadedScene,
    /// The bodies with full lists, as the scene file has them.
    pub exact: System,
    /// The scene's folder, for the run files.
    folder: String,
}

impl Pile {
    /// Reads the scene, and encodes its meshes.
    ///
    /// # Errors
    /// The scene or its mesh cannot be read.
    pub fn read(args: &PileArgs) -> Result<Self, Failure> {
        let path = args.scenes.join(NAME).with_extension("toml");
        let path = std::path::absolute(&path).map_err(Failure::new)?;
        let mut loaded = LoadedScene::read(&path)
            .map_err(|e| Failure::new(e).hint("give the folder `scenes` of the repository to --scenes"))?;
        if args.quick {
            shorten(&mut loaded);
        }
        let (shafts, _) = QUICK;
        if let Some(shafts) = args.shafts.map(usize::from).or(args.quick.then_some(shafts)) {
            keep_nearest(&mut loaded, shafts);
        }
        let exact = loaded.system().map_err(Failure::new)?;
        let folder = path.parent().unwrap_or(&path).to_string_lossy().into_owned();
        Ok(Self { loaded, exact, folder })
    }

    /// The bodies, with `shaft` in place of every mesh.
    ///
    /// # Errors
    /// Never for a system that was built from a scene.
    pub fn with(&self, shaft: TeSdf) -> Result<System, Failure> {
        let mut system = System::new(self.exact.gravity);
        let mesh = system.add_shape(Arc::new(shaft)).map_err(Failure::new)?;
        for body in self.exact.bodies() {
            let before = *self.exact.scene().instance(body.instance).map_err(Failure::new)?;
            let shape = match self.exact.scene().shape(before.shape).map_err(Failure::new)? {
                Shape::Mesh(_) => mesh,
                simple => self.add(&mut system, simple.clone())?,
            };
            let added = system.add(&body.name, Instance { shape, ..before }, body.mass);
            let number = added.map_err(Failure::new)?;
            system.set_friction(number, body.friction).map_err(Failure::new)?;
        }
        Ok(system)
    }

    fn add(&self, system: &mut System, shape: Shape) -> Result<ShapeId, Failure> {
        system.add_shape(shape).map_err(Failure::new)
    }

    /// Simulates the pile. The criterion of the scene is not measured on the way, because the
    /// fields of `system` may be truncated.
    ///
    /// # Errors
    /// A step fails.
    pub fn simulate(
        &self,
        system: System,
        mode: DetectorMode,
        detector: Shared,
        bar: &Bar,
    ) -> Result<(RunRecord, Summary), Failure> {
        let mut loaded = self.loaded.clone();
        loaded.scene.detector.choose(mode);
        if let Some(Mode::Face { iterations, .. }) = &mut loaded.scene.detector.mode {
            *iterations = ITERATIONS;
        }
        let run = PartialRun::new(&loaded.scene, &system, self.folder.clone());
        loaded.scene.criterion.remove::<SeparationCriterion>();
        let mut engine = loaded.newton_with(system, detector).map_err(Failure::new)?;
        simulate_from(&loaded.scene, &mut engine, run, |moment| {
            bar.set(moment.step as f64 / moment.steps as f64);
            std::ops::ControlFlow::Continue(())
        })
        .map_err(Failure::new)
    }
}

/// Simulates the first frames, with the limits of the criterion within them.
fn shorten(loaded: &mut LoadedScene) {
    let (_, frames) = QUICK;
    let scene = &mut loaded.scene;
    scene.duration = f64::from(frames) * scene.time_step;
    let duration = scene.duration;
    scene.criterion.edit(|of: &mut SeparationCriterion| of.limits.retain(|[time, _]| *time <= duration));
}

/// Keeps the shafts that are nearest to the middle, which overlap as deeply as all of them.
fn keep_nearest(loaded: &mut LoadedScene, shafts: usize) {
    let scene = &mut loaded.scene;
    let distance = |t: [f64; 3]| t.iter().map(|x| x * x).sum::<f64>();
    let moving = scene.bodies.iter().map(|b| b.get_ref()).filter(|b| !b.fixed);
    let mut distances: Vec<f64> = moving.map(|b| distance(b.translation)).collect();
    distances.sort_by(f64::total_cmp);
    if let Some(&beyond) = distances.get(shafts) {
        scene.bodies.retain(|b| b.get_ref().fixed || distance(b.get_ref().translation) < beyond);
    }
}
