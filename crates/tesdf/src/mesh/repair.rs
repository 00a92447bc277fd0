use std::fmt;

use glam::DVec3;
use serde::Serialize;

use super::count::count;
use super::{
    Defect, MeshError, Severity, TriangleMesh, check,
    check::{T_JUNCTION_TOLERANCE, out_of_range, write_defects},
    topology::{Topology, has_repeated_corner},
};

mod orient;
mod split;
mod weld;

/// Changes that [`repair`] may make although they move the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepairOptions {
    /// Merge vertices up to this far apart, and treat a vertex up to this far from an open edge as
    /// lying on it; a length in the mesh's unit. With `None`, no vertices are merged, and
    /// `t_junction_tolerance` alone applies.
    pub weld_tolerance: Option<f64>,
    /// Largest distance between an open edge and a vertex that is treated as lying on it, relative
    /// to the diagonal.
    pub t_junction_tolerance: f64,
}

impl RepairOptions {
    /// No welding; T-junctions to a billionth of the diagonal, which is about the rounding error.
    pub const DEFAULT: Self = Self { weld_tolerance: None, t_junction_tolerance: T_JUNCTION_TOLERANCE };
}

impl Default for RepairOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// The result of [`repair`].
#[derive(Clone, Debug, PartialEq)]
pub struct Repaired {
    /// The repaired mesh. It is encodable when the report says so.
    pub mesh: TriangleMesh,
    /// All changes, and the remaining defects.
    pub report: RepairReport,
}

/// All changes that [`repair`] made, in the order in which it makes them.
///
/// Ids are 0-based. They are ids of the input mesh, except in `remaining` and `warnings`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RepairReport {
    /// Merged vertices: [merged vertex, vertex that replaces it].
    pub welded_vertices: Vec<[u32; 2]>,
    /// Faces dropped because two of their corners are equal.
    pub collapsed_faces: Vec<u32>,
    /// Faces dropped because they repeat an earlier face with the same orientation: [dropped face,
    /// earlier face].
    pub duplicate_faces: Vec<[u32; 2]>,
    /// Open edges split at the vertices that lie on them.
    pub split_edges: Vec<SplitEdge>,
    /// Collinear faces of which nothing was left after the splits.
    pub vanished_faces: Vec<u32>,
    /// Faces reversed because they disagreed with their neighbours or their shell was inside out.
    pub reversed_faces: Vec<u32>,
    /// Pairs of shells that meet, so their orientation was not changed: one face of each shell.
    pub crossing_shells: Vec<[u32; 2]>,
    /// Number of vertices dropped because no face uses them.
    pub unused_vertices: usize,
    /// Whether the repaired mesh is encodable.
    pub encodable: bool,
    /// Remaining errors. Ids are those of the repaired mesh.
    pub remaining: Vec<Defect>,
    /// Warnings about the repaired mesh; ids are those of the repaired mesh.
    pub warnings: Vec<Defect>,
}

impl RepairReport {
    /// Whether the repaired mesh differs from the input mesh.
    pub fn changes_something(&self) -> bool {
        !(self.welded_vertices.is_empty()
            && self.collapsed_faces.is_empty()
            && self.duplicate_faces.is_empty()
            && self.split_edges.is_empty()
            && self.vanished_faces.is_empty()
            && self.reversed_faces.is_empty()
            && self.unused_vertices == 0)
    }
}

/// An edge that was split at vertices.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SplitEdge {
    /// Its two ends.
    pub edge: [u32; 2],
    /// The vertices on it, from the first end to the second.
    pub at: Vec<u32>,
    /// Faces that were split.
    pub faces: Vec<u32>,
    /// Largest distance of the vertices from the edge, in the mesh's unit.
    pub distance: f64,
}

/// Why [`repair`] gives no mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
        "no face is left: {collapsed} of {faces} faces have two equal corners; use a smaller weld tolerance, if any"
    )]
    NoFaceLeft {
        /// Faces dropped because two of their corners are equal.
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
    /// For each face, the face of the input mesh that it comes from.
    origin: Vec<u32>,
}

/// Makes a mesh encodable where this needs no guess, and reports every change.
///
/// The steps, in this order:
/// - Merge vertices within the weld tolerance, if one is given.
/// - Drop faces with two equal corners.
/// - Drop faces that repeat another face with the same orientation. Duplicates stay when the mesh
///   is closed only with them, for example where a face is there twice and once reversed.
/// - Split faces at vertices that lie on their open edges. A collinear face vanishes when nothing
///   of it is left.
/// - Reverse faces so that the faces of a connected surface agree.
/// - Reverse closed shells: a shell inside an odd number of others faces inward, any other shell
///   outward. Shells that meet others are not reversed, because they could be meant as solids or as
///   cavities.
///
/// # Errors
/// [`RepairError`] when a tolerance or coordinate is out of range, or when no face would be left. A
/// mesh that is still not encodable is not an error here: [`RepairReport::remaining`] gives the
/// reasons.
pub fn repair(mesh: &TriangleMesh, options: &RepairOptions) -> Result<Repaired, RepairError> {
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

    let mut report = RepairReport::default();
    let mut draft = Draft {
        vertices: mesh.vertices().to_vec(),
        faces: mesh.faces().to_vec(),
        origin: (0..mesh.faces().len() as u32).collect(),
    };
    if let Some(tolerance) = options.weld_tolerance {
        report.welded_vertices = weld::weld(&mut draft, tolerance);
    }
    let collapsed = draft.retain(|_, corners| !has_repeated_corner(corners));
    report.collapsed_faces = collapsed;
    if draft.faces.is_empty() {
        let (collapsed, faces) = (report.collapsed_faces.len(), mesh.faces().len());
        return Err(RepairError::NoFaceLeft { collapsed, faces });
    }
    let with_duplicates = draft.clone();
    report.duplicate_faces = draft.drop_duplicates();
    let is_closed = |draft: &Draft| Topology::new(&draft.faces).is_closed();
    if !report.duplicate_faces.is_empty() && is_closed(&with_duplicates) && !is_closed(&draft) {
        draft = with_duplicates;
        report.duplicate_faces.clear();
    }
    let relative = options.t_junction_tolerance * mesh.diagonal();
    split::split(&mut draft, relative.max(options.weld_tolerance.unwrap_or(0.0)), &mut report);
    if draft.faces.is_empty() {
        return Err(RepairError::NoFaceLeft { collapsed: 0, faces: mesh.faces().len() });
    }
    orient::orient(&mut draft, &mut report);
    report.unused_vertices = draft.drop_unused() - report.welded_vertices.len();

    let mesh = TriangleMesh::new(draft.vertices, draft.faces)?;
    let found = check(&mesh);
    report.encodable = found.encodable;
    (report.remaining, report.warnings) =
        found.defects.into_iter().partition(|d| d.severity == Severity::Error);
    Ok(Repaired { mesh, report })
}

impl Draft {
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

impl RepairReport {
    /// Whether nothing was changed.
    pub fn is_unchanged(&self) -> bool {
        self.welded_vertices.is_empty()
            && self.collapsed_faces.is_empty()
            && self.duplicate_faces.is_empty()
            && self.split_edges.is_empty()
            && self.vanished_faces.is_empty()
            && self.reversed_faces.is_empty()
            && self.unused_vertices == 0
    }
}

/// Number of ids in the text for people. The report has all of them.
const SHOWN: usize = 8;

impl fmt::Display for RepairReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |f: &mut fmt::Formatter<'_>,
                    [one, many]: [&str; 2],
                    ids: &mut dyn ExactSizeIterator<Item = String>| {
            let n = ids.len();
            if n == 0 {
                return Ok(());
            }
            let named = ids.take(SHOWN).collect::<Vec<_>>().join(", ");
            writeln!(f, "{}: {named}{}", count(n, one, many), if n > SHOWN { ", ..." } else { "" })
        };
        if self.is_unchanged() {
            writeln!(f, "nothing to repair")?;
        }
        let pairs = |pairs: &[[u32; 2]], word: &'static str| {
            pairs.iter().map(move |[a, b]| format!("{a} {word} {b}")).collect::<Vec<_>>().into_iter()
        };
        list(
            f,
            ["vertex merged (0-based)", "vertices merged (0-based)"],
            &mut pairs(&self.welded_vertices, "into"),
        )?;
        list(
            f,
            [
                "face with two equal corners dropped (0-based)",
                "faces with two equal corners dropped (0-based)",
            ],
            &mut self.collapsed_faces.iter().map(u32::to_string),
        )?;
        list(
            f,
            ["duplicate face dropped (0-based)", "duplicate faces dropped (0-based)"],
            &mut pairs(&self.duplicate_faces, "repeats"),
        )?;
        let split = |s: &SplitEdge| {
            let [a, b] = s.edge;
            let at = s.at.iter().map(u32::to_string).collect::<Vec<_>>().join(" ");
            let faces = s.faces.iter().map(u32::to_string).collect::<Vec<_>>().join(" ");
            format!("{a}-{b} at {at} (face {faces}, {:.1e} off)", s.distance)
        };
        list(
            f,
            ["edge split at T-junctions (0-based)", "edges split at T-junctions (0-based)"],
            &mut self.split_edges.iter().map(split),
        )?;
        list(
            f,
            ["collinear face dropped (0-based)", "collinear faces dropped (0-based)"],
            &mut self.vanished_faces.iter().map(u32::to_string),
        )?;
        list(
            f,
            ["face reversed (0-based)", "faces reversed (0-based)"],
            &mut self.reversed_faces.iter().map(u32::to_string),
        )?;
        let crossing = pairs(&self.crossing_shells, "meets");
        list(
            f,
            [
                "pair of shells meets and keeps its orientation, by faces (0-based)",
                "pairs of shells meet and keep their orientation, by faces (0-based)",
            ],
            &mut { crossing },
        )?;
        if self.unused_vertices > 0 {
            writeln!(f, "{} dropped", count(self.unused_vertices, "unused vertex", "unused vertices"))?;
        }
        write_defects(f, &self.warnings)?;
        write_defects(f, &self.remaining)?;
        match self.remaining.len() {
            0 => write!(f, "ok: encodable"),
            n => write!(f, "not encodable: {} left", count(n, "error", "errors")),
        }
    }
}
