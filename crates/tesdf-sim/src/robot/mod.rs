//! Robot descriptions in URDF and MJCF.
//!
//! `mjcf-rs`, of the makers of Rapier, reads MJCF: it resolves classes of defaults and folders. It
//! recurses, so what it reads is [bounded](expand) before. URDF is read here with `roxmltree`:
//! `urdf-rs` 0.10.0 names no line in its errors, refuses a file because of parts that have no mesh,
//! and depends on two XML parsers that nobody maintains.
mod bounds;
mod description;
mod include;
mod mjcf;
mod packages;
mod solids;
mod urdf;
mod xml;

use std::path::{Path, PathBuf};

use tesdf::input;

pub use description::{
    Base, Collision, Geometry, Link, Motion, Robot, RobotCoupling, RobotJoint, Unread, composed,
};
pub use include::expand;
pub use packages::Packages;
pub use urdf::mesh_reference;
pub use xml::parse;

/// Formats of robot descriptions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RobotFormat {
    /// Of ROS.
    Urdf,
    /// Of MuJoCo.
    Mjcf,
}

/// Why a robot description cannot be read: the file and the line, what was found there, and what
/// was expected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RobotError(pub String);

impl RobotError {
    fn in_file(path: &Path, found: impl std::fmt::Display) -> Self {
        Self(format!("{}: {found}", path.display()))
    }

    fn in_line(path: &Path, line: u32, found: impl std::fmt::Display) -> Self {
        Self(format!("{}, line {line}: {found}", path.display()))
    }
}

impl RobotFormat {
    /// The format of a file, by its extension and, of `.xml`, its first element. `None` for files
    /// that are no robot descriptions.
    ///
    /// # Errors
    /// It has the extension of one, and is none that is read.
    pub fn of_path(path: &Path) -> Result<Option<Self>, RobotError> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match extension.as_str() {
            "urdf" => Ok(Some(Self::Urdf)),
            "mjcf" => Ok(Some(Self::Mjcf)),
            "xacro" => Err(RobotError::in_file(
                path,
                "xacro files are programs that print URDF; `xacro FILE > robot.urdf` makes the file that is read",
            )),
            "xml" => {
                let text = read(path)?;
                let document = parse(path, &text)?;
                match document.root_element().tag_name().name() {
                    "mujoco" | "mujocoinclude" => Ok(Some(Self::Mjcf)),
                    "robot" => Ok(Some(Self::Urdf)),
                    other => Err(RobotError::in_file(
                        path,
                        format!(
                            "the first element is <{other}>; expected <mujoco> of MJCF or <robot> of URDF"
                        ),
                    )),
                }
            }
            _ => Ok(None),
        }
    }
}

impl Robot {
    /// Reads the robot description at `path`. Meshes of URDF are found in `packages`, by their
    /// names, and where [`Packages`] looks.
    ///
    /// # Errors
    /// It cannot be read, or links and joints are no tree.
    pub fn read(path: &Path, packages: &[(String, PathBuf)]) -> Result<Self, RobotError> {
        match RobotFormat::of_path(path)? {
            Some(RobotFormat::Urdf) => urdf::read_urdf(path, &Packages::new(path, packages)),
            Some(RobotFormat::Mjcf) if !packages.is_empty() => {
                Err(RobotError::in_file(path, "packages are of URDF files; MJCF names files without them"))
            }
            Some(RobotFormat::Mjcf) => mjcf::read_mjcf(path),
            None => Err(RobotError::in_file(path, "expected a robot description: .urdf, .xml or .mjcf")),
        }
    }
}

/// The text of a file. It is a regular one, because it is read twice.
///
/// # Errors
/// It cannot be read.
pub fn read(path: &Path) -> Result<String, RobotError> {
    let text = input::check_regular(path).and_then(|()| input::read_to_string(path));
    text.map_err(|e| RobotError(format!("cannot read {}: {e}", path.display())))
}
