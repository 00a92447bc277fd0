use crate::mesh::check::T_JUNCTION_TOLERANCE;

/// Changes that [`repair`](super::repair) may make although they move the surface, add to it or
/// choose between readings of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepairOptions {
    /// Merge vertices up to this far apart, and treat a vertex up to this far from an open edge as
    /// lying on it; a length in the mesh's unit. With `None`, no vertices are merged, and
    /// `t_junction_tolerance` alone applies. [`closing_tolerance`](super::closing_tolerance) finds
    /// the least length that closes the cracks of a mesh.
    pub weld_tolerance: Option<f64>,
    /// Largest distance between an open edge and a vertex that is treated as lying on it, relative
    /// to the diagonal.
    pub t_junction_tolerance: f64,
    /// Which shells are turned.
    pub shells: ShellOrientation,
    /// Fill holes with at most this number of edges. With `None`, no hole is filled; with
    /// `Some(u32::MAX)`, each one is.
    pub fill_holes: Option<u32>,
}

/// The shells that [`repair`](super::repair) turns outward or inward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShellOrientation {
    /// Shells that meet no other shell. Nothing is guessed.
    #[default]
    Separate,
    /// All closed shells. A shell that meets others counts as a solid of its own, or as a cavity
    /// if it is inside an odd number of the shells that it does not meet. Surfaces that are
    /// connected only over edges with more than two faces agree with each other, too: the faces
    /// around such an edge are paired by their angle.
    All,
}

impl RepairOptions {
    /// No welding; T-junctions to a billionth of the diagonal, which is about the rounding error;
    /// shells that meet others keep their orientation, and holes stay open.
    pub const DEFAULT: Self = Self {
        weld_tolerance: None,
        t_junction_tolerance: T_JUNCTION_TOLERANCE,
        shells: ShellOrientation::Separate,
        fill_holes: None,
    };
}

impl Default for RepairOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}
