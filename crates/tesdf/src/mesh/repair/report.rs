use std::fmt;

use serde::Serialize;

use crate::mesh::{Defect, check::write_defects, count::count};

/// All changes that [`repair`](super::repair) made, in the order in which it makes them.
///
/// Ids are 0-based. They are ids of the input mesh, except in `remaining` and `warnings`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RepairReport {
    /// The weld tolerance, in the mesh's unit; `None` when vertices were not merged by a tolerance.
    pub weld_tolerance: Option<f64>,
    /// Merged vertices: [merged vertex, vertex that replaces it].
    pub welded_vertices: Vec<[u32; 2]>,
    /// Faces dropped because two of their corners are equal, or because they have no area and stand
    /// out of the surface.
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
    /// Edges with more than two faces, whose faces were paired by their angle to orient the
    /// surfaces around the edge.
    pub paired_edges: Vec<[u32; 2]>,
    /// Holes that were filled.
    pub filled_holes: Vec<FilledHole>,
    /// Holes that were to be filled, and stay open.
    pub holes_left: Vec<HoleLeft>,
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
    /// Whether nothing was changed.
    pub fn is_unchanged(&self) -> bool {
        self.welded_vertices.is_empty()
            && self.collapsed_faces.is_empty()
            && self.duplicate_faces.is_empty()
            && self.split_edges.is_empty()
            && self.vanished_faces.is_empty()
            && self.reversed_faces.is_empty()
            && self.filled_holes.is_empty()
            && self.unused_vertices == 0
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

/// A hole that was filled with triangles between its vertices. No vertex is added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FilledHole {
    /// The loops of open edges around the hole, against the direction of the faces along them. A
    /// flat hole may have islands: the first loop is its outline, and the others are inside.
    pub loops: Vec<Vec<u32>>,
    /// Number of triangles.
    pub faces: usize,
    /// Their area, in the mesh's unit squared.
    pub area: f64,
    /// How the triangles were chosen.
    pub method: FillMethod,
}

/// How the triangles of a [`FilledHole`] were chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FillMethod {
    /// The hole is a flat polygon, and its triangles lie in its plane.
    Flat,
    /// The triangulation with the smallest of its sharpest folds and then the least area, found by
    /// dynamic programming.
    MinimumWeight,
    /// The hole has more than 300 edges. It was cut along short chords into pieces, and each piece
    /// has its triangulation of minimum weight.
    Pieces,
    /// One triangle after the other, always the one with the smallest fold, as the holes have too
    /// many edges in all for dynamic programming.
    Ears,
}

impl fmt::Display for FillMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Flat => "flat",
            Self::MinimumWeight => "minimum weight",
            Self::Pieces => "minimum weight in pieces",
            Self::Ears => "ear by ear",
        })
    }
}

/// A hole that stays open.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HoleLeft {
    /// Its loop of vertices. For a one-sided surface, the ends of an edge where two of its faces
    /// disagree.
    pub vertices: Vec<u32>,
    /// Why it stays open.
    pub reason: LeftReason,
}

/// Why a hole stays open.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LeftReason {
    /// It has more edges than were to be filled.
    TooManyEdges,
    /// The surface around it is one-sided, as a Moebius strip is, so no filling gives it an inside.
    OneSided,
}

impl fmt::Display for LeftReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooManyEdges => "more edges than were to be filled",
            Self::OneSided => {
                "the surface is one-sided, as a Moebius strip is: no filling gives it an inside"
            }
        })
    }
}

/// Number of ids in the text for people. The report has all of them.
const SHOWN: usize = 8;
/// Number of vertices of a loop in the text for people.
const SHOWN_OF_LOOP: usize = 4;

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
        if let Some(tolerance) = self.weld_tolerance {
            writeln!(f, "weld tolerance {tolerance:e}")?;
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
                "face with two equal corners, or without area off the surface, dropped (0-based)",
                "faces with two equal corners, or without area off the surface, dropped (0-based)",
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
        list(
            f,
            [
                "edge with more than two faces paired by angle (0-based)",
                "edges with more than two faces paired by angle (0-based)",
            ],
            &mut pairs(&self.paired_edges, "-"),
        )?;
        list(
            f,
            ["hole filled (0-based)", "holes filled (0-based)"],
            &mut self.filled_holes.iter().map(filled_text),
        )?;
        list(
            f,
            ["hole left open (0-based)", "holes left open (0-based)"],
            &mut self.holes_left.iter().map(|hole| format!("{} ({})", ids(&hole.vertices), hole.reason)),
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

/// The first few ids.
fn ids(vertices: &[u32]) -> String {
    let named: Vec<_> = vertices.iter().take(SHOWN_OF_LOOP).map(u32::to_string).collect();
    format!("{}{}", named.join(" "), if vertices.len() > SHOWN_OF_LOOP { " ..." } else { "" })
}

fn filled_text(hole: &FilledHole) -> String {
    let edges: usize = hole.loops.iter().map(Vec::len).sum();
    let islands = match hole.loops.len() {
        0 | 1 => String::new(),
        n => format!(" in {n} loops"),
    };
    let first = hole.loops.first().map_or(String::new(), |first| ids(first));
    format!("{first} ({edges} edges{islands}, {}, area {:.3e})", hole.method, hole.area)
}
