//! The two scenes of Table III, at each tolerance.
use tesdf_sim::criterion::{InsertionCriterion, ScrewCriterion};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};

use super::assets::Assets;
use super::{Args, Features};
use crate::tables::paper::{self, Table3};
use tesdf_cli::terminal::report::Failure;

/// A scene of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, clap::ValueEnum)]
pub enum Scenario {
    /// A nut turns down its bolt
    BoltNut,
    /// A peg slides into its hole
    PegInHole,
}

/// Least acceleration of the nut, as a fraction of that of an ideal screw. Contacts of faces reach
/// 0.66 to 1.02 (`docs/dynamics.md`).
const MIN_ACCELERATION: f64 = 0.5;

/// Duration of a quick run of the nut, s.
const QUICK: f64 = 0.06;

impl Scenario {
    /// Name in the rows.
    pub fn name(self) -> &'static str {
        match self {
            Self::BoltNut => "bolt-nut",
            Self::PegInHole => "peg-in-hole",
        }
    }

    /// Names of the moving and the fixed body.
    pub fn bodies(self) -> [&'static str; 2] {
        match self {
            Self::BoltNut => ["nut", "bolt"],
            Self::PegInHole => ["peg", "hole"],
        }
    }

    /// Name of the body that gives the fit its tolerance.
    pub fn fitted(self) -> &'static str {
        match self {
            Self::BoltNut => "nut",
            Self::PegInHole => "hole",
        }
    }

    /// Tolerances, µm: those of the paper, and a tighter one.
    pub fn tolerances(self) -> [u32; 4] {
        match self {
            Self::BoltNut => [100, 50, 25, 10],
            Self::PegInHole => [150, 100, 50, 20],
        }
    }

    /// Whether the paper's table has a tolerance, µm.
    fn has_paper(self, tolerance: u32) -> bool {
        self.tolerances()[..3].contains(&tolerance)
    }

    /// Whether the paper's table has a tolerance, µm, and a time step, ms.
    pub fn is_of_paper(self, tolerance: u32, time_step: f64) -> bool {
        self.has_paper(tolerance) && self.paper().rows.iter().any(|&(step, _)| step == time_step)
    }

    /// The paper's figures.
    pub fn paper(self) -> &'static Table3 {
        match self {
            Self::BoltNut => &paper::TABLE_3_NUT,
            Self::PegInHole => &paper::TABLE_3_PEG,
        }
    }

    /// The scene at a tolerance, µm, with its criterion. All its meshes become assets.
    ///
    /// # Errors
    /// The scene file cannot be read, or lacks a body or the criterion. A mesh cannot be encoded.
    pub fn scene(self, args: &Args, tolerance: u32, assets: &Assets) -> Result<LoadedScene, Failure> {
        let path = args.scenes.join(self.name()).with_extension("toml");
        let mut loaded = LoadedScene::read(&path)
            .map_err(|e| Failure::new(e).hint("give the folder `scenes` of the repository to --scenes"))?;
        let missing = |what: &str| Failure::new(format!("{}: it has no {what}", path.display()));
        let clearance = f64::from(tolerance) * 1e-6;
        let fitted = self.fitted();
        let mesh = match self {
            Self::BoltNut => format!("iso_m16_nut_c{tolerance}.obj"),
            Self::PegInHole => format!("lobed_hole_c{tolerance}.obj"),
        };
        if !loaded.scene.bodies.iter().any(|body| body.get_ref().name == fitted) {
            return Err(missing(&format!("body {fitted}")));
        }
        for k in 0..loaded.scene.bodies.len() {
            let body = loaded.scene.bodies[k].get_ref();
            let asset = match &body.mesh {
                None => continue,
                Some(_) if body.name == fitted && self.has_paper(tolerance) => {
                    assets.of_file(&args.scenes.join("../data/procedural").join(&mesh))?
                }
                Some(_) if body.name == fitted => assets.of_part(self, tolerance)?,
                Some(file) => assets.of_file(&args.scenes.join(file))?,
            };
            let body = loaded.scene.bodies[k].get_mut();
            (body.mesh, body.asset) = (None, Some(asset));
        }
        let scene = &mut loaded.scene;
        scene.record.contacts_every = 0;
        match self {
            Self::BoltNut => {
                let screw = scene.criterion.get::<ScrewCriterion>().cloned();
                let mut screw = screw.ok_or_else(|| missing("criterion.screw"))?;
                // The play along the axis is 1.155 times the tolerance, which is radial.
                screw.backlash = 1.16 * clearance;
                screw.min_acceleration = if args.quick { 0.0 } else { MIN_ACCELERATION };
                if args.quick {
                    // An ideal screw turns by the square of the time.
                    screw.min_turns *= (QUICK / scene.duration).powi(2);
                    scene.duration = QUICK;
                }
                scene.criterion.set(screw);
            }
            Self::PegInHole => {
                let insertion = scene.criterion.get::<InsertionCriterion>().cloned();
                let mut insertion = insertion.ok_or_else(|| missing("criterion.insertion"))?;
                let ratio = clearance / insertion.clearance;
                insertion.clearance = clearance;
                insertion.depth_tolerance *= ratio;
                insertion.max_tilt *= ratio;
                insertion.max_offset *= ratio;
                scene.criterion.set(insertion);
            }
        }
        Ok(loaded)
    }
}

/// Sets the features and the time step, ms.
pub fn set(loaded: &mut LoadedScene, features: Features, time_step: f64) {
    loaded.scene.time_step = time_step * 1e-3;
    loaded.scene.detector.choose(match features {
        Features::Node => DetectorMode::Node,
        Features::Face => DetectorMode::Face,
    });
}
