use std::fmt;

use glam::DVec3;
use serde::Serialize;

/// A property of a mesh that a person may want to know, with its place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Defect {
    /// The kind of defect.
    pub kind: DefectKind,
    /// The consequence for the mesh as a solid.
    pub severity: Severity,
    /// Faces concerned, 0-based.
    pub faces: Vec<u32>,
    /// Vertices concerned, 0-based. For an edge, its two ends.
    pub vertices: Vec<u32>,
    /// A point at the defect, in the mesh's unit.
    pub place: [f64; 3],
    /// One line for people, with 0-based ids.
    pub message: String,
}

/// The consequence of a defect for the mesh as a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The mesh has no well-defined inside, so it cannot be encoded.
    Error,
    /// The inside is well defined, but the place is worth a look.
    Warning,
    /// No consequence.
    Note,
}

/// Kinds of defects, in the order in which reports list them: causes before consequences.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum DefectKind {
    /// A coordinate or the size of the mesh is outside the range in which computations are exact.
    OutOfRange,
    /// A face with the corners of another face, in the same orientation.
    DuplicateFace,
    /// A face with the corners of another face, in the opposite orientation.
    ReversedDuplicateFace,
    /// A vertex lies on an open edge of a face that does not use it.
    TJunction,
    /// An edge with a single face.
    OpenEdge,
    /// An edge with two faces that run along it in the same direction.
    InconsistentOrientation,
    /// A one-sided surface, such as a Moebius strip.
    NonOrientable,
    /// An edge with more than two faces.
    NonManifoldEdge,
    /// A vertex where parts of the surface touch that share no edge there.
    NonManifoldVertex,
    /// A face with two equal corners.
    RepeatedCorner,
    /// A face with three different corners that lie exactly on one line.
    ZeroArea,
    /// Two faces that meet in more than the corner or edge that they share.
    SelfIntersection,
    /// A place with a negative winding number: the surface is inside out there.
    NegativeWinding,
    /// No place has a positive winding number.
    NoInside,
    /// A place with a winding number above 1: solids overlap, or a cavity is inside out.
    WindingAboveOne,
    /// A face that is a part of the surface, and lies partly within the solid.
    PartlyBuried,
    /// A face whose height is less than a millionth of its longest edge.
    NeedleFace,
    /// The mesh is so far from the origin that 32-bit floats would move its vertices by more than
    /// 1e-6 of the diagonal.
    FarFromOrigin,
    /// The mesh is so large or so small that the square of its diagonal leaves the range of 32-bit
    /// floats.
    ExtremeScale,
    /// A vertex that no face uses.
    UnusedVertex,
}

impl Defect {
    pub(crate) fn new(kind: DefectKind, severity: Severity, place: DVec3, message: String) -> Self {
        let place = place.to_array();
        Self { kind, severity, faces: Vec::new(), vertices: Vec::new(), place, message }
    }

    pub(crate) fn faces(mut self, faces: impl Into<Vec<u32>>) -> Self {
        self.faces = faces.into();
        self
    }

    pub(crate) fn vertices(mut self, vertices: impl Into<Vec<u32>>) -> Self {
        self.vertices = vertices.into();
        self
    }
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.place;
        write!(f, "{}: {} at ({x:.9e}, {y:.9e}, {z:.9e})", self.severity, self.message)
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        })
    }
}

impl fmt::Display for DefectKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OutOfRange => "values out of range",
            Self::TJunction => "T-junctions",
            Self::OpenEdge => "open edges",
            Self::InconsistentOrientation => "edges with inconsistent orientation",
            Self::NonOrientable => "non-orientable surfaces",
            Self::NonManifoldEdge => "non-manifold edges",
            Self::NonManifoldVertex => "non-manifold vertices",
            Self::DuplicateFace => "duplicate faces",
            Self::ReversedDuplicateFace => "reversed duplicate faces",
            Self::RepeatedCorner => "faces with two equal corners",
            Self::ZeroArea => "zero-area faces",
            Self::SelfIntersection => "self-intersections",
            Self::NegativeWinding => "places with a negative winding number",
            Self::NoInside => "meshes without an inside",
            Self::WindingAboveOne => "places with a winding number above 1",
            Self::PartlyBuried => "faces partly within the solid",
            Self::NeedleFace => "needle faces",
            Self::FarFromOrigin => "meshes far from the origin",
            Self::ExtremeScale => "meshes of extreme scale",
            Self::UnusedVertex => "unused vertices",
        })
    }
}
