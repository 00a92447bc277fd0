use std::collections::HashSet;

use glam::DVec3;

use super::{
    MeshError, Severity, TriangleMesh, check,
    check::out_of_range,
    hairs::hairs,
    topology::{Topology, has_repeated_corner},
    weld::weld_within,
};

mod around_edge;
mod auto;
mod fill;
mod flat;
mod holes;
mod options;
mod orient;
mod pair;
mod report;
mod split;
mod tolerance;
mod triangulate;

pub use auto::{AutoRepaired, RepairMode, UnknownRepair, repair_auto};
pub use options::{RepairOptions, ShellOrientation};
pub use report::{FillMethod, FilledHole, HoleLeft, LeftReason, RepairReport, SplitEdge};
pub use tolerance::closing_tolerance;

/// The result of [`repair`].
#[derive(Clone, Debug, PartialEq)]
pub struct Repaired {
    /// The repaired mesh. It is encodable when the report says so.
    pub mesh: TriangleMesh,
    /// All changes, and the remaining defects.
    pub report: RepairReport,
}

/// Why [`repair`] gives no mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RepairError {
    /// A tolerance is not a finite positive number.
    #[error("the {name} is {value}; expected a finite number above 0")]
    Tolerance {
        /// Name of the tolerance.
        name: &'static str,
        /// The value found.
        value: f64,
    },
    /// A coordinate or the diagonal is out of range.
    #[error("{0}")]
    OutOfRange(String),
    /// No face is left.
    #[error(
        "no face is left: {collapsed} of {faces} faces have two equal corners or stand out without area; use a smaller weld tolerance, if any"
    )]
    NoFaceLeft {
        /// Faces dropped because two of their corners are equal, or because they have no area and
        /// stand out.
        collapsed: usize,
        /// Faces of the input mesh.
        faces: usize,
    },
    /// Splitting made more vertices or faces than 32-bit ids can name.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// A mesh under repair.
#[derive(Clone)]
struct Draft {
    vertices: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    /// For each face, the face of the input mesh that it comes from. For a face of a filled hole, a
    /// face beside the hole.
    origin: Vec<u32>,
}

/// Makes a mesh encodable, and reports every change. With the default options, it changes a mesh
/// only where this needs no guess.
///
/// The steps, in this order:
/// - Merge vertices within the weld tolerance, if one is given.
/// - Drop faces with two equal corners, and other faces without area that stand out of the surface.
/// - Drop faces that repeat another face with the same orientation. Duplicates stay when the mesh
///   is closed only with them, for example where a face is there twice and once reversed.
/// - Split faces at vertices that lie on their open edges. A collinear face vanishes when nothing
///   of it is left.
/// - Reverse faces so that the faces of a connected surface agree. With [`ShellOrientation::All`],
///   surfaces that meet in an edge with more than two faces agree as well.
/// - Fill holes, if [`RepairOptions::fill_holes`] says so. A flat hole gets triangles in its plane.
///   Any other hole gets its minimum-weight triangulation: the sharpest fold between neighbouring
///   faces is as small as possible, then the area (Liepa, Filling Holes in Meshes, 2003). No
///   vertices are added.
/// - Reverse closed shells: a shell inside an odd number of others faces inward, any other shell
///   outward. Shells that meet others are not reversed, because they could be meant as solids or as
///   cavities, unless [`ShellOrientation::All`] says so.
///
/// # Errors
/// [`RepairError`] when a tolerance or coordinate is out of range, or when no face would be left. A
/// mesh that is still not encodable is not an error here: [`RepairReport::remaining`] gives the
/// reasons.
pub fn repair(mesh: &TriangleMesh, options: &RepairOptions) -> Result<Repaired, RepairError> {
    close(mesh, options)?.finish(options)
}

/// A mesh after the steps that can close it.
struct Closed {
    draft: Draft,
    report: RepairReport,
    reversed: Vec<bool>,
}

/// The steps of [`repair`] that can close the mesh: all but the orientation of shells.
fn close(mesh: &TriangleMesh, options: &RepairOptions) -> Result<Closed, RepairError> {
    let (mut draft, mut report) = join(mesh, options)?;
    let orient::Agreed { mut reversed, one_sided } = orient::agree(&mut draft);
    if options.shells == ShellOrientation::All {
        report.paired_edges = pair::agree_across(&mut draft, &one_sided, &mut reversed);
    }
    if let Some(max_edges) = options.fill_holes {
        let beside = fill::fill(&mut draft, &one_sided, max_edges, &mut report);
        // A new face belongs to the face beside it, and counts as reversed with it.
        let new: Vec<bool> = beside.iter().map(|&face| reversed[face as usize]).collect();
        reversed.extend(new);
    }
    Ok(Closed { draft, report, reversed })
}

impl Closed {
    /// Orients the shells, and checks the result.
    fn finish(self, options: &RepairOptions) -> Result<Repaired, RepairError> {
        let Self { mut draft, mut report, reversed } = self;
        orient::orient(&mut draft, reversed, options.shells, &mut report);
        report.unused_vertices = draft.drop_unused() - report.welded_vertices.len();
        draft.check(report)
    }
}

/// The steps that join faces: all up to the splits at T-junctions.
fn join(mesh: &TriangleMesh, options: &RepairOptions) -> Result<(Draft, RepairReport), RepairError> {
    let tolerances = [
        ("weld tolerance", options.weld_tolerance),
        ("T-junction tolerance", Some(options.t_junction_tolerance)),
    ];
    for (name, value) in tolerances.into_iter().filter_map(|(name, value)| Some((name, value?))) {
        if !(value.is_finite() && value > 0.0) {
            return Err(RepairError::Tolerance { name, value });
        }
    }
    if let Some(defect) = out_of_range(mesh).first() {
        return Err(RepairError::OutOfRange(defect.message.clone()));
    }

    let mut report = RepairReport { weld_tolerance: options.weld_tolerance, ..RepairReport::default() };
    let mut draft = Draft::of(mesh);
    if let Some(tolerance) = options.weld_tolerance {
        report.welded_vertices = draft.weld(tolerance);
    }
    let of_hairs = hairs(&draft.vertices, &draft.faces).into_iter();
    let of_hairs: HashSet<u32> = of_hairs.map(|face| draft.origin[face as usize]).collect();
    report.collapsed_faces =
        draft.retain(|origin, corners| !has_repeated_corner(corners) && !of_hairs.contains(&origin));
    if draft.faces.is_empty() {
        let (collapsed, faces) = (report.collapsed_faces.len(), mesh.faces().len());
        return Err(RepairError::NoFaceLeft { collapsed, faces });
    }
    let with_duplicates = draft.clone();
    report.duplicate_faces = draft.drop_duplicates();
    if !report.duplicate_faces.is_empty() && with_duplicates.is_closed() && !draft.is_closed() {
        draft = with_duplicates;
        report.duplicate_faces.clear();
    }
    let relative = options.t_junction_tolerance * mesh.diagonal();
    split::split(&mut draft, relative.max(options.weld_tolerance.unwrap_or(0.0)), &mut report);
    if draft.faces.is_empty() {
        return Err(RepairError::NoFaceLeft { collapsed: 0, faces: mesh.faces().len() });
    }
    Ok((draft, report))
}

impl Draft {
    fn of(mesh: &TriangleMesh) -> Self {
        Self {
            vertices: mesh.vertices().to_vec(),
            faces: mesh.faces().to_vec(),
            origin: (0..mesh.faces().len() as u32).collect(),
        }
    }

    /// Merges vertices. Returns pairs of the merged vertex and the vertex that replaces it.
    fn weld(&mut self, tolerance: f64) -> Vec<[u32; 2]> {
        let target = weld_within(&self.vertices, tolerance);
        self.faces.iter_mut().flatten().for_each(|v| *v = target[*v as usize]);
        let pairs = (0..).zip(target).filter(|(v, to)| v != to);
        pairs.map(|(v, to)| [v, to]).collect()
    }

    fn is_closed(&self) -> bool {
        Topology::new(&self.faces).is_closed()
    }

    /// Corner positions of a face.
    fn triangle(&self, face: u32) -> [DVec3; 3] {
        self.faces[face as usize].map(|v| self.vertices[v as usize])
    }

    /// Checks the result.
    fn check(self, mut report: RepairReport) -> Result<Repaired, RepairError> {
        let mesh = TriangleMesh::new(self.vertices, self.faces)?;
        let found = check(&mesh);
        report.encodable = found.encodable;
        (report.remaining, report.warnings) =
            found.defects.into_iter().partition(|d| d.severity == Severity::Error);
        Ok(Repaired { mesh, report })
    }

    /// Keeps the faces that `keep` accepts. Returns the origins of the other faces.
    fn retain(&mut self, mut keep: impl FnMut(u32, [u32; 3]) -> bool) -> Vec<u32> {
        let kept: Vec<bool> = self.faces.iter().zip(&self.origin).map(|(&f, &o)| keep(o, f)).collect();
        let dropped = self.origin.iter().zip(&kept).filter(|(_, k)| !**k).map(|(&o, _)| o).collect();
        let mut flags = kept.iter();
        self.faces.retain(|_| flags.next() == Some(&true));
        let mut flags = kept.iter();
        self.origin.retain(|_| flags.next() == Some(&true));
        dropped
    }

    fn drop_duplicates(&mut self) -> Vec<[u32; 2]> {
        let mut first_with = std::collections::HashMap::with_capacity(self.faces.len());
        let mut duplicates = Vec::new();
        self.retain(|origin, corners| {
            // The rotation that begins with the lowest corner keeps the orientation.
            let lowest = (0..3).min_by_key(|&k| corners[k]).unwrap_or(0);
            let mut turned = corners;
            turned.rotate_left(lowest);
            let first = *first_with.entry(turned).or_insert(origin);
            if first != origin {
                duplicates.push([origin, first]);
            }
            first == origin
        });
        duplicates
    }

    /// Drops vertices that no face uses. Returns their number.
    fn drop_unused(&mut self) -> usize {
        let mut used = vec![false; self.vertices.len()];
        self.faces.iter().flatten().for_each(|&v| used[v as usize] = true);
        let mut new_id = vec![0; self.vertices.len()];
        let mut kept = Vec::with_capacity(self.vertices.len());
        for v in (0..used.len()).filter(|&v| used[v]) {
            new_id[v] = kept.len() as u32;
            kept.push(self.vertices[v]);
        }
        self.faces.iter_mut().flatten().for_each(|v| *v = new_id[*v as usize]);
        let dropped = self.vertices.len() - kept.len();
        self.vertices = kept;
        dropped
    }
}
