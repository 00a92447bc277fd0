//! Converts errors of the library to exceptions of `tesdf.errors` with the same text.
use std::io;
use std::path::PathBuf;

use pyo3::exceptions::{
    PyFileNotFoundError, PyIsADirectoryError, PyOSError, PyPermissionError, PyValueError,
};
use pyo3::prelude::*;
use pyo3::types::PyType;
use tesdf::asset::AssetError;
use tesdf::collide::CollideError;
use tesdf::deform::DeformError;
use tesdf::domain::ReadTetrahedraError;
use tesdf::encode::{ChoiceError, DomainError, EncodeError, ExportJsonError, ImportJsonError};
use tesdf::mesh::{MeshError, NotSolid, ReadError, RepairError};
use tesdf::save::SaveError;
use tesdf::verify::VerifyError;
use tesdf_playback::PlaybackError;
use tesdf_sim::planning::PlanningError;
use tesdf_sim::record::RecordError;
use tesdf_sim::scene_file::SceneError;
use tesdf_sim::{DynamicsError, MassError, SimulateError};

use crate::classes::{self, Checked};
use crate::wording::in_python;

/// Errors that occur while the interpreter's lock is released.
#[derive(Debug)]
pub enum Error {
    Read(PathBuf, ReadError),
    Mesh(MeshError),
    /// The path, if the mesh comes from a file.
    NotSolid(Option<PathBuf>, NotSolid),
    Repair(Option<PathBuf>, RepairError),
    Choice(ChoiceError),
    Domain(DomainError),
    Encode(Option<PathBuf>, EncodeError),
    Deform(DeformError),
    /// The path, if the asset comes from a file.
    Asset(Option<PathBuf>, AssetError),
    /// The JSON file.
    ImportJson(PathBuf, ImportJsonError),
    ExportJson(PathBuf, ExportJsonError),
    Verify(VerifyError),
    Collide(CollideError),
    /// The place in the arguments, such as `poses: row 3`.
    CollideAt(String, CollideError),
    Scene(SceneError),
    Simulate(SimulateError),
    Dynamics(DynamicsError),
    /// The world that refused a value or a step.
    World(usize, Box<Error>),
    /// Mass properties of a body, by its name, that cannot be.
    Mass(String, MassError),
    /// A simulation without a history was asked for it.
    NoHistory,
    /// The run file that cannot be read or written.
    Record(PathBuf, RecordError),
    Playback(PlaybackError),
    Planning(PlanningError),
    /// The run file, and a name that none of its bodies has.
    NoBody(PathBuf, String),
    Threads(rayon::ThreadPoolBuildError),
    /// The number of threads asked for, and the greatest one.
    TooManyThreads(usize, usize),
    #[cfg(feature = "gpu")]
    Device(tesdf_gpu::GpuError),
    /// This process was forked from one that has used a device.
    #[cfg(feature = "gpu")]
    ForkedWithDevice,
    /// The beginning of the message.
    #[cfg(not(feature = "gpu"))]
    BuiltWithoutGpu(String),
}

impl Error {
    /// The exception for this error.
    pub fn raise(self, py: Python<'_>) -> PyErr {
        match self {
            Self::Read(_, ReadError::Open { ref source, .. }) => system(source, self.text()),
            Self::Asset(_, AssetError::Io { ref source, .. }) => system(source, self.text()),
            Self::Asset(_, AssetError::Save(ref refused))
            | Self::ExportJson(_, ExportJsonError::Save(ref refused))
            | Self::Record(_, RecordError::Save(ref refused)) => match refused {
                SaveError::Io { source, .. } => system(source, self.text()),
                SaveError::ReadOnly { .. } => PyPermissionError::new_err(self.text()),
                SaveError::NoFolder { .. } => PyFileNotFoundError::new_err(self.text()),
                SaveError::IsFolder { .. } => PyIsADirectoryError::new_err(self.text()),
                _ => PyOSError::new_err(self.text()),
            },
            Self::Scene(SceneError::Read { ref source, .. })
            | Self::Record(_, RecordError::Read { ref source, .. }) => system(source, self.text()),
            Self::Scene(_) | Self::NoBody(..) | Self::Planning(PlanningError::Robot(_)) => {
                new(py, "SceneError", self.text())
            }
            Self::Simulate(_)
            | Self::Dynamics(_)
            | Self::World(..)
            | Self::Mass(..)
            | Self::NoHistory
            | Self::Record(..)
            | Self::Playback(_) => new(py, "SimulationError", self.text()),
            Self::Domain(DomainError::Read {
                source: ReadTetrahedraError::Open { ref source, .. }, ..
            }) => system(source, self.text()),
            Self::ImportJson(_, ImportJsonError::Read { ref source, .. }) => system(source, self.text()),
            Self::ImportJson(path, ImportJsonError::NotSolid(found)) => {
                Self::NotSolid(Some(path), found).raise(py)
            }
            Self::ImportJson(path, ImportJsonError::Encode(found)) => {
                Self::Encode(Some(path), found).raise(py)
            }
            Self::ImportJson(..) => new(py, "MeshError", self.text()),
            Self::ExportJson(..) => new(py, "EncodeError", self.text()),
            Self::Read(..) | Self::Mesh(_) | Self::Repair(..) | Self::Domain(DomainError::Read { .. }) => {
                new(py, "MeshError", self.text())
            }
            Self::NotSolid(_, ref found) => {
                match classes::report(py, "CheckReport", &Checked::of(found.report(), &[])) {
                    Ok(report) => new(py, "NotSolidError", (self.text(), report.unbind())),
                    Err(e) => e,
                }
            }
            Self::Choice(_) | Self::Domain(_) | Self::Encode(..) => new(py, "EncodeError", self.text()),
            Self::Deform(_) => new(py, "DeformError", self.text()),
            Self::Asset(..) | Self::Verify(_) => new(py, "AssetError", self.text()),
            Self::Collide(_) | Self::CollideAt(..) | Self::Planning(_) => {
                new(py, "CollideError", self.text())
            }
            Self::Threads(_) => PyOSError::new_err(self.text()),
            Self::TooManyThreads(..) => PyValueError::new_err(self.text()),
            #[cfg(feature = "gpu")]
            Self::Device(tesdf_gpu::GpuError::Collide(_)) => new(py, "CollideError", self.text()),
            #[cfg(feature = "gpu")]
            Self::Device(_) | Self::ForkedWithDevice => new(py, "DeviceError", self.text()),
            #[cfg(not(feature = "gpu"))]
            Self::BuiltWithoutGpu(_) => new(py, "DeviceError", self.text()),
        }
    }

    /// The message in Python's terms.
    fn text(&self) -> String {
        in_python(&self.message())
    }

    /// The library's message, with the path of the file in front if the message does not have it.
    fn message(&self) -> String {
        let at = |path: &Option<PathBuf>, e: &dyn std::fmt::Display| match path {
            Some(path) => format!("{}: {e}", path.display()),
            None => e.to_string(),
        };
        match self {
            Self::Read(path, e) => e.in_file(path),
            Self::Mesh(e) => e.to_string(),
            Self::NotSolid(path, e) => at(path, e),
            Self::Repair(path, e) => at(path, e),
            Self::Choice(e) => e.to_string(),
            Self::Domain(e) => e.to_string(),
            Self::Encode(path, e) => at(path, e),
            Self::Deform(e) => e.to_string(),
            Self::Asset(_, e @ (AssetError::Io { .. } | AssetError::Save(_))) => e.to_string(),
            Self::Asset(path, e) => at(path, e),
            Self::ImportJson(_, e @ ImportJsonError::Read { .. }) => e.to_string(),
            Self::ImportJson(path, e) => format!("{}: {e}", path.display()),
            Self::ExportJson(_, e @ ExportJsonError::Save(_)) => e.to_string(),
            Self::ExportJson(path, e) => format!("{}: {e}", path.display()),
            Self::Verify(e) => e.to_string(),
            Self::Collide(e) => e.to_string(),
            Self::CollideAt(at, e) => format!("{at}: {e}"),
            Self::Scene(e) => e.to_string(),
            Self::Simulate(e) => e.to_string(),
            Self::Dynamics(e) => e.to_string(),
            Self::World(world, e) => format!("world {world}: {}", e.message()),
            Self::Mass(body, e) => format!("body {body}: {e}"),
            Self::NoHistory => {
                "the simulation keeps no history; make it with history=True, the default".into()
            }
            Self::Record(_, e @ (RecordError::Save(_) | RecordError::Read { .. })) => e.to_string(),
            Self::Record(path, e) => format!("{}: {e}", path.display()),
            Self::Playback(e) => e.to_string(),
            Self::Planning(e) => e.to_string(),
            Self::NoBody(path, body) => format!("{}: there is no body {body}", path.display()),
            Self::Threads(e) => format!("cannot start threads: {e}"),
            Self::TooManyThreads(asked, most) => format!("threads: {asked}; expected at most {most}"),
            #[cfg(feature = "gpu")]
            Self::Device(e) => e.to_string(),
            #[cfg(feature = "gpu")]
            Self::ForkedWithDevice => {
                "this process was forked from one that has used a device, which does not work; start it with \
                 multiprocessing.get_context(\"spawn\")"
                    .into()
            }
            #[cfg(not(feature = "gpu"))]
            Self::BuiltWithoutGpu(asked) => format!(
                "{asked}this package was built without the GPU; build it in the repository with \
                 `pip install ./python -C build-args=\"--features gpu\"`; \"cpu\" is the processor"
            ),
        }
    }
}

/// An `OSError`. Python chooses a subclass, such as `FileNotFoundError`, by the system's error
/// number; without a number PyO3 chooses by the error's kind.
fn system(source: &io::Error, text: String) -> PyErr {
    match source.raw_os_error() {
        Some(number) => PyOSError::new_err((number, text)),
        None => io::Error::new(source.kind(), text).into(),
    }
}

fn new(py: Python<'_>, class: &str, arguments: impl pyo3::PyErrArguments + 'static) -> PyErr {
    let class = py.import("tesdf.errors").and_then(|module| module.getattr(class));
    match class.and_then(|class| Ok(class.cast_into::<PyType>()?)) {
        Ok(class) => PyErr::from_type(class, arguments),
        Err(e) => e,
    }
}

/// The exception for an invalid argument, with what was found and what was expected.
pub fn argument(name: &str, found: impl std::fmt::Display, expected: &str) -> PyErr {
    PyValueError::new_err(format!("{name}: {found}; expected {expected}"))
}

/// The type of an object, for messages.
pub fn kind_of(any: &Bound<'_, PyAny>) -> String {
    any.get_type().name().map_or("an object".into(), |name| name.to_string())
}
