use std::{collections::BTreeMap, fmt};

use serde::Serialize;

use crate::base::InsideRule;

use super::count::count;
use super::hairs::{COUNTS, hairs, tell_of_hairs};
use super::{Defect, DefectKind, Severity, Topology, TriangleMesh};

mod edges;
mod faces;
mod fans;
mod intersections;
mod range;
mod regions;
mod t_junctions;
mod winding;

pub(crate) use faces::{face_flaws, has_no_area};
pub(crate) use intersections::self_intersections;
pub(crate) use range::{coordinate_in_range, out_of_range};
pub(crate) use t_junctions::{TJunctions, t_junctions};
pub(crate) use winding::{FaceClass, Survey, height};

/// The result of [`check`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckReport {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of faces.
    pub faces: usize,
    /// Lowest corner of the bounds of the used vertices, in the mesh's unit.
    pub min: [f64; 3],
    /// Highest corner of these bounds.
    pub max: [f64; 3],
    /// Length of the diagonal of the bounds, in the mesh's unit.
    pub diagonal: f64,
    /// Number of connected components, where faces are connected over shared edges.
    pub shells: usize,
    /// Open edges, chained into closed loops or open paths.
    pub boundary_loops: Vec<BoundaryLoop>,
    /// Least and greatest winding number found; `None` when it is not an integer everywhere or was
    /// not tested.
    pub winding: Option<[i32; 2]>,
    /// Whether the mesh can be encoded: it has a well-defined inside, that is, no defect is an
    /// error.
    pub encodable: bool,
    /// All defects, sorted by kind.
    pub defects: Vec<Defect>,
}

/// A chain of edges where the surface is open.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoundaryLoop {
    /// Vertices in order, 0-based. The order follows the direction of the faces.
    pub vertices: Vec<u32>,
    /// Whether an edge connects the last vertex to the first.
    pub closed: bool,
    /// Length, in the mesh's unit.
    pub length: f64,
}

/// A vertex closer than this to an open edge makes a T-junction. Relative to the diagonal.
pub(crate) const T_JUNCTION_TOLERANCE: f64 = 1e-9;

/// Finds every defect that [`DefectKind`] names.
///
/// # Errors and warnings
/// The winding number is an integer everywhere exactly when the directed edges balance: for any two
/// vertices a and b, as many faces run from a to b as from b to a. This is a matter of counting and
/// needs no tolerance.
///
/// Why: the winding number is the solid angle divided by 4 pi. Triangles from any point to all
/// directed edges close the surface. Where the edges balance, these triangles cancel in pairs.
/// Where they do not, the solid angle of the remaining triangles changes continuously with the
/// point.
///
/// When the edges balance, the inside (winding number 1 or more) is well defined.
/// Self-intersections, non-manifold edges and vertices, duplicate faces and faces without area are
/// then warnings. Otherwise they are errors, like open edges. A negative winding number is a
/// warning too: such a place counts as outside. A mesh whose winding number is nowhere 1 or more is
/// an error.
///
/// # How far the winding number is tested
/// A patch is a set of faces that are connected over manifold edges and meet no other face. The
/// winding number is constant on each side of a patch, so one test covers it. A face that meets
/// other faces is cut by them into regions. The winding number is constant on each side of a
/// region, so one test in each region covers the face.
///
/// A test is exact for its point: it finds the winding number there and on which side of the face
/// the point lies. The points themselves are rounded to 64-bit floats. So a test may miss a place,
/// or report the winding number next to another face, only in two cases: two faces are nearer to
/// each other than the rounding error (some 1e-14 of the largest coordinate), or a region is
/// narrower than that.
///
/// The work is bounded. Only evenly chosen regions are tested in these cases: more than 4096 faces
/// cut one face; the cuts on a face cross each other so often that they form more than two pieces
/// per cut and 64 more; there are more than 131072 regions in all.
///
/// When a value is [out of range](DefectKind::OutOfRange), nothing else is tested. When more than a
/// million pairs of faces intersect, and more than two per face, the mesh gets one error without a
/// list of the pairs, and winding numbers are not tested.
pub fn check(mesh: &TriangleMesh) -> CheckReport {
    check_for(mesh, InsideRule::Winding)
}

/// As [`check`], for another rule of what is inside: whether the mesh can be encoded under it, and
/// on which side its warnings count.
///
/// [`Generalized`](InsideRule::Generalized) and [`Sheet`](InsideRule::Sheet) take any mesh whose
/// coordinates are in the accepted range. All other defects are warnings then.
pub fn check_for(mesh: &TriangleMesh, rule: InsideRule) -> CheckReport {
    let mut report = check_and_survey(mesh, rule).0;
    tell_of_hairs(&mut report.defects, &hairs(mesh.vertices(), mesh.faces()), COUNTS);
    report
}

/// As [`check_for`], with the winding numbers on the sides of all faces, where they were found.
pub(crate) fn check_and_survey(mesh: &TriangleMesh, rule: InsideRule) -> (CheckReport, Option<Survey>) {
    let topology = Topology::new(mesh.faces());
    let bounds = mesh.bounds();
    let mut report = CheckReport {
        vertices: mesh.vertices().len(),
        faces: mesh.faces().len(),
        min: bounds.min.to_array(),
        max: bounds.max.to_array(),
        diagonal: mesh.diagonal(),
        shells: topology.components(|_| true).1,
        boundary_loops: Vec::new(),
        winding: None,
        encodable: false,
        defects: out_of_range(mesh),
    };
    if !report.defects.is_empty() {
        return (report, None);
    }
    let closed = topology.is_closed();
    let strict = !closed && rule.needs_closed();
    let lenient = if strict { Severity::Error } else { Severity::Warning };
    let defects = &mut report.defects;

    let junctions = t_junctions(mesh.vertices(), &topology, T_JUNCTION_TOLERANCE * report.diagonal);
    defects.extend(junctions.defects(mesh, &topology));
    defects.extend(edges::edge_defects(mesh, &topology, lenient));
    defects.extend(edges::vertex_defects(mesh, &topology, lenient));
    let flaws = faces::face_flaws(mesh);
    defects.extend(flaws.defects(mesh, lenient));
    let junctions = junctions.with_collinear(mesh, &flaws.zero_area);
    let touching = junctions.touching(mesh, &topology);
    let pairs = self_intersections(mesh, &flaws.without_area(), &touching);
    defects.extend(intersections::defects(mesh, &pairs, lenient));
    // When pairs are missing, unknown faces could cut a patch.
    let is_sheet = matches!(rule, InsideRule::Sheet { .. });
    let mut survey = None;
    if closed && !is_sheet && pairs.len() < intersections::max_pairs(mesh) {
        let meetings = winding::Meetings { flaws: &flaws, intersections: &pairs, touching: &touching };
        let (range, found, sides) = winding::winding_defects(mesh, &topology, &meetings, rule);
        report.winding = Some(range);
        survey = Some(sides);
        defects.extend(found);
    }
    defects.extend(range::scale_defects(mesh));
    defects.sort_by_key(|d| d.kind);
    if !rule.needs_closed() {
        let any_mesh = defects.iter_mut().filter(|d| !matches!(d.kind, DefectKind::NoInside));
        any_mesh.filter(|d| d.severity == Severity::Error).for_each(|d| d.severity = Severity::Warning);
    }
    report.boundary_loops = edges::boundary_loops(mesh, &topology);
    report.encodable = !report.defects.iter().any(|d| d.severity == Severity::Error);
    (report, survey)
}

impl CheckReport {
    /// The defects of one severity.
    pub fn of_severity(&self, severity: Severity) -> impl Iterator<Item = &Defect> {
        self.defects.iter().filter(move |d| d.severity == severity)
    }

    /// Whether the surface is an embedded manifold. Then every edge has two faces that run along it
    /// in opposite directions, and the faces around every used vertex form one fan. No face lacks
    /// area or repeats another face. Faces meet only in shared corners and edges. The winding
    /// number is 0 or 1 everywhere.
    pub fn is_simple(&self) -> bool {
        use DefectKind::*;
        self.encodable
            && self
                .defects
                .iter()
                .all(|d| matches!(d.kind, NeedleFace | FarFromOrigin | ExtremeScale | UnusedVertex))
    }
}

/// Number of defects of each kind in the text for people. The report has all of them.
const SHOWN: usize = 5;

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}, {}, {}, diagonal {:.6e} (ids are 0-based)",
            count(self.faces, "face", "faces"),
            count(self.vertices, "vertex", "vertices"),
            count(self.shells, "shell", "shells"),
            self.diagonal
        )?;
        write_defects(f, &self.defects)?;
        for (i, chain) in self.boundary_loops.iter().enumerate().take(SHOWN) {
            let what = if chain.closed { "loop" } else { "path" };
            let n = chain.vertices.len() - usize::from(!chain.closed);
            let ids: Vec<_> = chain.vertices.iter().take(6).map(u32::to_string).collect();
            let more = if chain.vertices.len() > 6 { ", ..." } else { "" };
            let ids = ids.join(", ");
            let edges = count(n, "edge", "edges");
            writeln!(f, "boundary {what} {i}: {edges}, length {:.6e}, vertices {ids}{more}", chain.length)?;
        }
        if self.boundary_loops.len() > SHOWN {
            writeln!(f, "... {} boundary loops in all", self.boundary_loops.len())?;
        }
        let of = |s, one, many| count(self.of_severity(s).count(), one, many);
        let errors = of(Severity::Error, "error", "errors");
        let warnings = of(Severity::Warning, "warning", "warnings");
        match (self.encodable, self.of_severity(Severity::Warning).count()) {
            (true, 0) => write!(f, "ok: the inside is well defined"),
            (true, _) => write!(f, "ok: the inside is well defined ({warnings})"),
            (false, _) => write!(f, "not encodable: {errors}, {warnings}"),
        }
    }
}

/// Writes the first few defects of each kind, and the total where there are more.
pub(crate) fn write_defects(f: &mut fmt::Formatter<'_>, defects: &[Defect]) -> fmt::Result {
    let mut kinds: BTreeMap<(DefectKind, Severity), Vec<&Defect>> = BTreeMap::new();
    defects.iter().for_each(|d| kinds.entry((d.kind, d.severity)).or_default().push(d));
    for ((kind, severity), found) in kinds {
        found.iter().take(SHOWN).try_for_each(|defect| writeln!(f, "{defect}"))?;
        if found.len() > SHOWN {
            writeln!(f, "{severity}: ... {} {kind} in all", found.len())?;
        }
    }
    Ok(())
}
