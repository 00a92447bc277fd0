//! Scenes of the paper in `lab/scenes`, and what the house does not have for them: their criteria, and
//! a planner of grippers.
mod assembly;
mod hoist;
mod linking;
mod plan;
mod transmission;

use std::path::{Path, PathBuf};

use tesdf_cli::simulate;
use tesdf_cli::terminal::report::{Failure, Outcome};
use tesdf_sim::criterion::Criteria;
use tesdf_sim::scene_file::LoadedScene;

pub use assembly::{AssemblyCriterion, AssemblyReport, AssemblyTracker, NutGroup, PartReport, PegGroup};
pub use hoist::{HoistChain, HoistCriterion, HoistLink, HoistReport, HoistTracker};
pub use plan::{Action, Gripper, Plan, Task};
pub use transmission::{
    EngagedGear, EngagedReport, TransmissionCriterion, TransmissionReport, TransmissionTracker,
};

/// Arguments of `tesdf-lab simulate`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Those of `tesdf simulate`.
    #[command(flatten)]
    pub simulate: simulate::Args,
    /// Tasks of grippers, TOML, which become scripts of the scene
    #[arg(long, value_name = "FILE", requires = "scene")]
    pub plan: Option<PathBuf>,
}

/// Simulates a scene, as `tesdf simulate` does.
///
/// # Errors
/// The same errors as those of [`tesdf_cli::simulate::run`], and a plan that does not fit the scene.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    simulate::run_with(&args.simulate, &criteria(), |loaded| match &args.plan {
        Some(plan) => add_plan(loaded, plan),
        None => Ok(()),
    })
}

/// The criteria of the house and of the scenes.
pub fn criteria() -> Criteria {
    Criteria::standard().with::<AssemblyCriterion>().with::<HoistCriterion>().with::<TransmissionCriterion>()
}

fn add_plan(loaded: &mut LoadedScene, file: &Path) -> Result<(), Failure> {
    let scripts = Plan::read(file)?.scripts(&loaded.scene);
    loaded.scene.scripts.extend(scripts.map_err(|e| Failure::new(format!("{}: {e}", file.display())))?);
    Ok(())
}
