//! The extension module `tesdf._native` of the Python package `tesdf`. Meshes and points are passed
//! in as numpy arrays, answers are returned as numpy arrays, and the sections of an asset as views.
//!
//! Classes that only hold data (reports, errors, named results) are written in Python, in
//! `tesdf/*.py`, and created from here. The interpreter's lock is released while the library
//! computes.
mod arrays;
mod asset;
mod classes;
mod contacts;
mod detection;
mod device;
mod encode;
mod errors;
mod forces;
mod instance_columns;
mod interrupt;
mod kept_assets;
mod kept_pairs;
mod mesh;
mod mujoco;
mod opening;
mod pairs;
mod patches;
mod playback;
mod polygons;
mod pool;
mod poses;
mod robot;
mod scene;
mod settings;
mod shapes;
mod simulation;
mod whole;
mod why_report;
mod wording;
mod worlds;

/// The compiled part of the package `tesdf`.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use super::asset::{Asset, import_json};
    #[pymodule_export]
    use super::device::{DeviceArray, devices};
    #[pymodule_export]
    use super::encode::encode;
    #[pymodule_export]
    use super::kept_assets::asset_of;
    #[pymodule_export]
    use super::kept_pairs::InstancePairs;
    #[pymodule_export]
    use super::mesh::{check, repair};
    #[pymodule_export]
    use super::mujoco::{contact_frames, fill_mujoco_contacts};
    #[pymodule_export]
    use super::patches::PatchTracker;
    #[pymodule_export]
    use super::playback::{export, view};
    #[pymodule_export]
    use super::polygons::polygons;
    #[pymodule_export]
    use super::robot::Robot;
    #[pymodule_export]
    use super::scene::Scene;
    #[pymodule_export]
    use super::scene::pair;
    #[pymodule_export]
    use super::simulation::{Simulation, Snapshot};
    #[pymodule_export]
    use super::worlds::Worlds;

    /// The face in the answer of a point that is not finite, and of a ray that meets no face.
    #[pymodule_export]
    const NO_FACE: u32 = tesdf::query::Answer::NO_FACE;

    /// The cell of a contact where the face tree or a formula answered.
    #[pymodule_export]
    const NO_CELL: u32 = super::contacts::NO_CELL;

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
