//! The extension module `tesdf._native` of the Python package `tesdf`: meshes and points come in as numpy arrays, answers
//! go out as numpy arrays, the sections of an asset as views.
//!
//! What is data alone (reports, errors, named results) is Python, in `tesdf/*.py`, and made from here. The interpreter's lock is
//! free while the library computes.
mod arrays;
mod asset;
mod classes;
mod encode;
mod errors;
mod interrupt;
mod mesh;
mod pool;

/// The compiled part of the package `tesdf`.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use super::asset::Asset;
    #[pymodule_export]
    use super::encode::encode;
    #[pymodule_export]
    use super::mesh::{check, repair};

    /// The face of a point that has no answer and of a ray that meets nothing.
    #[pymodule_export]
    const NO_FACE: u32 = tesdf::query::Answer::NO_FACE;

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
