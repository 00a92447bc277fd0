use std::{collections::BTreeMap, fmt};

use serde::Serialize;

use super::count::count;
use super::{Defect, DefectKind, Severity, Topology, TriangleMesh};

mod edges;
mod faces;
mod fans;
mod intersections;
mod range;
mod regions;
mod t_junctions;
mod winding;

pub(crate) use faces::face_flaws;
pub(crate) use intersections::self_intersections;
pub(crate) use range::{coordinate_in_range, out_of_range};
pub(crate) use t_junctions::{TJunctions, t_junctions};
pub(crate) use winding::height;

/// What [`check`] found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckReport {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of faces.
    pub faces: usize,
    /// Least corner of the bounds of the used vertices, in the mesh's unit.
    pub min: [f64; 3],
    /// Greatest corner.
    pub max: [f64; 3],
    /// Length of the diagonal of the bounds, in the mesh's unit.
    pub diagonal: f64,
    /// Number of pieces that are connected over edges.
    pub shells: usize,
    /// Open edges chained into loops, or paths where they do not close.
    pub boundary_loops: Vec<BoundaryLoop>,
    /// Least and greatest winding number found; `None` when it is not an integer everywhere, or was not tested.
    pub winding: Option<[i32; 2]>,
    /// Whether the mesh has a well-defined inside: there is no error.
    pub encodable: bool,
    /// All defects, by kind, then by place in the mesh.
    pub defects: Vec<Defect>,
}

/// A chain of edges where the surface is open.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoundaryLoop {
    /// Vertices in order, along the direction of the faces, 0-based.
    pub vertices: Vec<u32>,
    /// Whether the last vertex is connected to the first.
    pub closed: bool,
    /// Length, in the mesh's unit.
    pub length: f64,
}

/// A vertex closer than this to an open edge, relative to the diagonal, makes a T-junction.
pub(crate) const T_JUNCTION_TOLERANCE: f64 = 1e-9;

/// Finds everything that [`DefectKind`] names.
///
/// # What makes an error
/// The winding number is an integer everywhere exactly when the directed edges balance: for each two vertices a
/// and b, as many faces run from a to b as from b to a. (The winding number is the solid angle over 4 pi. A cone of
/// triangles from any point to all directed edges closes the surface, and its triangles cancel in pairs when the
/// edges balance; where they do not, the solid angle of what is left changes continuously with the point.) That
/// is a matter of counting: no tolerance. When the edges balance, self-intersections, non-manifold edges and
/// vertices, duplicate faces and faces without area are warnings, as they leave the inside (winding number
/// 1 or more) well defined; otherwise they are errors, like open edges. A negative winding number is a warning too:
/// such a place counts as outside. When no place has a winding number of 1 or more, that is an error.
///
/// # How far the winding number is tested
/// The winding number is constant on each side of a patch of faces that are connected over manifold edges and
/// meet no other face; one test per patch covers it. A face that meets others is cut by them into regions, and the
/// winding number is constant on each side of a region; a test in each region covers the face.
///
/// A test is exact for its point: the winding number there, and the side of the face that the point is on. The points are
/// rounded to 64-bit floats. So a test may miss a place, or say its winding number of another face, only where
/// two faces are as near to each other as rounding, some 1e-14 of the largest coordinate, or where a region is narrower.
/// There is a bound on the work: where more than 4096 faces cut a face, or cross each other more than once each on it, or where
/// there are more than 131072 regions in all, evenly chosen regions are tested.
///
/// When a value is [out of range](DefectKind::OutOfRange) nothing else is tested. When more than a million pairs of faces intersect, and
/// more than two for each face, that is an error, the pairs are not listed, and winding numbers are not tested.
pub fn check(mesh: &TriangleMesh) -> CheckReport {
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
        return report;
    }
    let closed = topology.is_closed();
    let lenient = if closed { Severity::Warning } else { Severity::Error };
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
    // With pairs missing, a patch of faces could be cut by others.
    if closed && pairs.len() < intersections::most_pairs(mesh) {
        let meetings = winding::Meetings { flaws: &flaws, intersections: &pairs, touching: &touching };
        let (range, found) = winding::winding_defects(mesh, &topology, &meetings);
        report.winding = Some(range);
        defects.extend(found);
    }
    defects.extend(range::scale_defects(mesh));
    defects.sort_by_key(|d| d.kind);
    report.boundary_loops = edges::boundary_loops(mesh, &topology);
    report.encodable = !report.defects.iter().any(|d| d.severity == Severity::Error);
    report
}

impl CheckReport {
    /// Defects of one severity.
    pub fn of_severity(&self, severity: Severity) -> impl Iterator<Item = &Defect> {
        self.defects.iter().filter(move |d| d.severity == severity)
    }

    /// Whether the surface is an embedded manifold: every edge has two faces that run along it in
    /// opposite directions, every used vertex one fan, no face lacks area or repeats, no two meet elsewhere than in
    /// shared corners and edges, and the winding number is 0 or 1 everywhere.
    pub fn is_simple(&self) -> bool {
        use DefectKind::*;
        self.encodable
            && self
                .defects
                .iter()
                .all(|d| matches!(d.kind, NeedleFace | FarFromOrigin | ExtremeScale | UnusedVertex))
    }
}

/// Defects of each kind that people see at first; the report has all.
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

/// The first few defects of each kind, with the total where there are more.
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
