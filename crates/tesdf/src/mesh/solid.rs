use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use super::count::count;
use super::{
    AutoRepaired, CadOptions, CheckReport, Defect, DefectKind, LoadReport, LoadedMesh, MeshError, ReadError,
    RepairMode, RepairOptions, Severity, Survey, TriangleMesh, check_and_survey,
    hairs::{COUNTS, LEFT_OUT, hairs, tell_of_hairs},
    other_rules,
    presented::{Presentation, Presented},
    read_with, repair_auto,
};
use crate::base::{Inside, InsideRule};

/// A mesh with a well-defined inside. The encoder accepts only this type, and every value of it is
/// valid.
///
/// A mesh and a rule ([`InsideRule`]) make a solid. Without a rule the inside is where the winding
/// number is 1 or more:
///
/// - Every coordinate and the diagonal are in the accepted range.
/// - Every directed edge is used as often as its reverse, so the winding number is an integer
///   everywhere.
/// - The winding number is 1 or more somewhere.
///
/// [`with_inside`](Self::with_inside) takes another rule. Then the last two follow from the rule:
/// the generalised winding number and a sheet take any mesh. The surface may intersect or touch
/// itself, be inside out in places, and have faces without area; [`warnings`](Self::warnings) lists
/// such places.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidMesh {
    mesh: TriangleMesh,
    warnings: Vec<Defect>,
    simple: bool,
    inside: Inside,
    presentation: Presentation,
}

impl SolidMesh {
    /// Reads the mesh file at `path` and checks the mesh: [`load`](Self::load) with the defaults.
    ///
    /// # Errors
    /// [`ReadSolidError`] names the file. It says why the file cannot be read, or why its mesh has
    /// no well-defined inside.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::SolidMesh;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let folder = tempfile::tempdir()?;
    /// # let path = folder.path().join("part.obj");
    /// # std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")?;
    /// let solid = SolidMesh::read(&path)?; // STL, OBJ, PLY, OFF, glTF or GLB
    /// assert!(solid.warnings().is_empty());
    /// # Ok(())
    /// # }
    /// ```
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ReadSolidError> {
        Ok(Self::load(path, &SolidOptions::default())?.solid)
    }

    /// Reads the mesh file at `path`, [`read_with`](super::read_with()), and makes a solid of the
    /// mesh, [`with_repair`](Self::with_repair). Returns the changes made on the way, too.
    ///
    /// # Errors
    /// The same as for [`read`](Self::read).
    pub fn load(path: impl AsRef<Path>, options: &SolidOptions) -> Result<LoadedSolid, ReadSolidError> {
        let path = path.as_ref().to_owned();
        let LoadedMesh { mesh, report, .. } = match read_with(&path, &options.cad) {
            Ok(loaded) => loaded,
            Err(source) => return Err(ReadSolidError::Read { path, source }),
        };
        match Self::with_repair(mesh, options.inside, options.repair) {
            Ok((solid, repaired)) => Ok(LoadedSolid { path, solid, report, repaired }),
            Err(source) => Err(ReadSolidError::NotSolid { path, source }),
        }
    }

    /// Checks the mesh with [`check`](super::check()).
    ///
    /// # Errors
    /// [`NotSolid`] has all errors, and the options of the repair that would help, if one does.
    /// Only a mesh that is refused costs the time of trying them.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::glam::DVec3;
    /// use tesdf::{SolidMesh, TriangleMesh};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    /// let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    /// let solid = SolidMesh::new(TriangleMesh::new(vertices, faces)?)?;
    /// assert!(solid.is_simple());
    ///
    /// let open = TriangleMesh::new(solid.mesh().vertices().to_vec(), vec![[0, 2, 1]])?;
    /// let error = SolidMesh::new(open).unwrap_err();
    /// assert_eq!(error.report().boundary_loops.len(), 1);
    /// # Ok(())
    /// # }
    /// ```
    pub fn new(mesh: TriangleMesh) -> Result<Self, NotSolid> {
        Self::with_inside(mesh, Inside::default())
    }

    /// As [`new`](Self::new), with a rule for what is inside, and which faces are the surface.
    ///
    /// # Errors
    /// [`NotSolid`] has all errors that the mesh has under this rule, and names the rules and the
    /// repairs that would make it a solid.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::base::{Inside, InsideRule};
    /// use tesdf::glam::DVec3;
    /// use tesdf::{Encoder, SolidMesh, TriangleMesh};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // A square, which has no inside by any winding number.
    /// let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    /// let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]])?;
    /// let plate = SolidMesh::with_inside(mesh, Inside::new(InsideRule::Sheet { thickness: 0.2 }))?;
    /// let asset = Encoder::new().encode(&plate)?;
    /// assert!((asset.signed_distance(DVec3::new(0.5, 0.5, 0.5)) - 0.4).abs() < 1e-12);
    /// assert!((asset.signed_distance(DVec3::new(0.5, 0.5, 0.0)) + 0.1).abs() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    pub fn with_inside(mesh: TriangleMesh, inside: Inside) -> Result<Self, NotSolid> {
        let (report, survey) = check_and_survey(&mesh, inside.rule);
        if report.encodable {
            return Ok(Self::checked(mesh, inside, report, survey));
        }
        let found = repair_auto(&mesh).ok().flatten();
        Err(NotSolid::new(&mesh, report, found.and_then(|found| found.options)))
    }

    /// The solid of a mesh that its report says is encodable under the rule.
    fn checked(mesh: TriangleMesh, inside: Inside, report: CheckReport, survey: Option<Survey>) -> Self {
        let simple = report.is_simple();
        let (mut warnings, winding) = (report.defects, report.winding);
        let hairs = hairs(mesh.vertices(), mesh.faces());
        let presentation = Presentation::new(&mesh, inside, winding, survey, &hairs);
        // The presentation has all of them or none.
        let are_left_out = hairs.first().is_some_and(|&face| !presentation.has_face(face));
        tell_of_hairs(&mut warnings, &hairs, if are_left_out { LEFT_OUT } else { COUNTS });
        warnings.extend(presentation.partly_buried(&mesh));
        Self { mesh, warnings, simple, inside, presentation }
    }

    /// What is inside, and which faces are the surface.
    pub fn inside(&self) -> &Inside {
        &self.inside
    }

    /// The faces of the surface, and what tells their sides.
    pub(crate) fn presented(&self) -> Result<Presented<'_>, MeshError> {
        self.presentation.of(&self.mesh, self.simple)
    }

    /// As [`with_inside`](Self::with_inside). With [`RepairMode::Auto`], a mesh that is refused, or
    /// has faces without area that stand out of the surface, is repaired first, by
    /// [`repair_auto`](super::repair_auto()). Returns what was changed as well, or `None` when the
    /// mesh is a solid as it is.
    ///
    /// # Errors
    /// [`NotSolid`] when no repair makes the mesh a solid.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::base::Inside;
    /// use tesdf::glam::DVec3;
    /// use tesdf::mesh::RepairMode;
    /// use tesdf::{SolidMesh, TriangleMesh};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // A tetrahedron without one of its faces.
    /// let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    /// let open = TriangleMesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3]])?;
    /// let (solid, changes) = SolidMesh::with_repair(open, Inside::default(), RepairMode::Auto)?;
    /// assert_eq!(solid.mesh().faces().len(), 4);
    /// assert_eq!(changes.unwrap().repaired.report.filled_holes.len(), 1);
    /// # Ok(())
    /// # }
    /// ```
    pub fn with_repair(
        mesh: TriangleMesh,
        inside: Inside,
        repair: RepairMode,
    ) -> Result<(Self, Option<AutoRepaired>), NotSolid> {
        if repair == RepairMode::Never {
            return Ok((Self::with_inside(mesh, inside)?, None));
        }
        let (report, survey) = check_and_survey(&mesh, inside.rule);
        let is_clean = !inside.rule.needs_closed() || hairs(mesh.vertices(), mesh.faces()).is_empty();
        if report.encodable && is_clean {
            return Ok((Self::checked(mesh, inside, report, survey), None));
        }
        match repair_auto(&mesh) {
            Ok(Some(found)) if found.options.is_some() || !report.encodable => {
                let solid = Self::with_inside(found.repaired.mesh.clone(), inside)?;
                let is_changed = found.options.is_some();
                Ok((solid, is_changed.then_some(found)))
            }
            // Faces without area that no repair takes away.
            _ if report.encodable => Ok((Self::checked(mesh, inside, report, survey), None)),
            _ => Err(NotSolid::new(&mesh, report, None)),
        }
    }

    /// The mesh.
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// Warnings and notes of the check. The inside is well defined nevertheless.
    pub fn warnings(&self) -> &[Defect] {
        &self.warnings
    }

    /// Whether the surface is an embedded manifold with winding number 0 or 1 everywhere; see
    /// [`CheckReport::is_simple`].
    pub fn is_simple(&self) -> bool {
        self.simple
    }

    /// Returns the mesh itself.
    pub fn into_mesh(self) -> TriangleMesh {
        self.mesh
    }
}

/// How [`SolidMesh::load`] makes a solid of a mesh file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SolidOptions {
    /// What is inside, and which faces are the surface.
    pub inside: Inside,
    /// Whether the mesh is repaired.
    pub repair: RepairMode,
    /// How finely the surfaces of a CAD file become triangles.
    pub cad: CadOptions,
}

/// The solid of a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedSolid {
    /// The file.
    pub path: PathBuf,
    /// The solid.
    pub solid: SolidMesh,
    /// What the file has, and the changes made while reading.
    pub report: LoadReport,
    /// What a repair changed. `None` when the mesh is a solid as it is.
    pub repaired: Option<AutoRepaired>,
}

/// Why a mesh file does not give a [`SolidMesh`]. The message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadSolidError {
    /// The file cannot be read as a mesh.
    #[error("{}", source.in_file(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: ReadError,
    },
    /// The mesh has no well-defined inside.
    #[error("{}: {source}", path.display())]
    NotSolid {
        /// The file.
        path: PathBuf,
        /// All defects.
        source: NotSolid,
    },
}

impl ReadSolidError {
    /// The file.
    pub fn path(&self) -> &Path {
        match self {
            Self::Read { path, .. } | Self::NotSolid { path, .. } => path,
        }
    }
}

/// Why a mesh is not a [`SolidMesh`].
#[derive(Clone, Debug, PartialEq)]
pub struct NotSolid {
    report: Box<CheckReport>,
    suggestion: Option<RepairOptions>,
    rules: Vec<InsideRule>,
}

impl NotSolid {
    fn new(mesh: &TriangleMesh, report: CheckReport, suggestion: Option<RepairOptions>) -> Self {
        Self { rules: other_rules(mesh, &report), report: Box::new(report), suggestion }
    }

    /// The full report of the check.
    pub fn report(&self) -> &CheckReport {
        &self.report
    }

    /// The options with which [`repair`](super::repair()) makes the mesh a solid, found by trying:
    /// [`repair_auto`](super::repair_auto()).
    pub fn suggestion(&self) -> Option<&RepairOptions> {
        self.suggestion.as_ref()
    }

    /// The rules under which the mesh can be encoded as it is: [`other_rules`].
    pub fn rules(&self) -> &[InsideRule] {
        &self.rules
    }
}

impl std::error::Error for NotSolid {}

/// Largest number of kinds of errors in the message, and of errors per kind.
const NAMED: [usize; 2] = [3, 2];

impl fmt::Display for NotSolid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut kinds: BTreeMap<DefectKind, Vec<&str>> = BTreeMap::new();
        for error in self.report.of_severity(Severity::Error) {
            kinds.entry(error.kind).or_default().push(&error.message);
        }
        let total: usize = kinds.values().map(Vec::len).sum();
        let errors = count(total, "error", "errors");
        write!(f, "the mesh has no well-defined inside ({errors}; ids are 0-based): ")?;
        for (i, (kind, messages)) in kinds.iter().take(NAMED[0]).enumerate() {
            let named = messages[..messages.len().min(NAMED[1])].join("; ");
            let separator = if i > 0 { "; " } else { "" };
            match messages.len() {
                n if n > NAMED[1] => write!(f, "{separator}{n} {kind}: {named}; ...")?,
                _ => write!(f, "{separator}{named}")?,
            }
        }
        if kinds.len() > NAMED[0] {
            f.write_str("; and other defects")?;
        }
        match &self.suggestion {
            Some(_) => f.write_str(". The repair `auto` makes it encodable")?,
            None => f.write_str(". No repair makes it encodable")?,
        }
        self.rules.iter().try_for_each(|rule| write_way_on(f, *rule))
    }
}

/// How a rule, by the name that it has everywhere, treats a mesh that is refused under another one.
fn write_way_on(f: &mut fmt::Formatter<'_>, rule: InsideRule) -> fmt::Result {
    match rule {
        InsideRule::Winding | InsideRule::Odd => Ok(()),
        InsideRule::Nonzero => f.write_str(". The rule `nonzero` takes shells that are inside out as solids"),
        InsideRule::Generalized => f.write_str(
            ". The rule `generalized` takes it as the solid that its faces enclose for the most part (generalised \
             winding number)",
        ),
        InsideRule::Sheet { thickness } => write!(
            f,
            ". The rule `sheet` takes its faces as sheets of a thickness: {thickness} is some 1 % of its diagonal"
        ),
    }
}
