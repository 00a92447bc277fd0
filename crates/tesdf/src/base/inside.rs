use std::fmt;

use serde::{Deserialize, Serialize};

/// Which points count as inside. `w` is the winding number of the mesh around a point.
///
/// The first three rules need a closed mesh: as many faces run along each edge in one direction as
/// in the other. Then `w` is an integer everywhere. The last two take any mesh. `docs/meshes.md`
/// says what becomes of each kind of defect under each rule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InsideRule {
    /// `w` is 1 or more. A place with a negative `w` is outside.
    #[default]
    Winding,
    /// `w` is not 0. A shell that is inside out counts as a solid.
    Nonzero,
    /// `w` is odd. Where two solids overlap is outside.
    Odd,
    /// The generalised winding number (Jacobson et al. 2013) is at least 1/2 or at most -1/2. For a
    /// closed mesh this is [`Nonzero`](Self::Nonzero). For an open mesh, the signed distance jumps
    /// in the holes, where the number is 1/2.
    Generalized,
    /// The points nearer to a face than half of a thickness. The signed distance is the distance to
    /// the nearest face less half of the thickness.
    Sheet {
        /// The thickness, in the unit of the mesh: a positive length.
        thickness: f64,
    },
}

impl InsideRule {
    /// Whether a place with this winding number is inside.
    ///
    /// It is `false` for a sheet, whose inside does not depend on winding numbers.
    pub fn holds(self, winding: i32) -> bool {
        match self {
            Self::Winding => winding >= 1,
            Self::Nonzero | Self::Generalized => winding != 0,
            Self::Odd => winding % 2 != 0,
            Self::Sheet { .. } => false,
        }
    }

    /// Whether the rule needs a closed mesh.
    pub fn needs_closed(self) -> bool {
        matches!(self, Self::Winding | Self::Nonzero | Self::Odd)
    }

    /// The name in options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Winding => "winding",
            Self::Nonzero => "nonzero",
            Self::Odd => "odd",
            Self::Generalized => "generalized",
            Self::Sheet { .. } => "sheet",
        }
    }

    /// The distance from the faces at which the surface of the solid lies: half of the thickness of
    /// a sheet, otherwise 0. In the unit of the mesh.
    pub fn half_thickness(self) -> f64 {
        if let Self::Sheet { thickness } = self { 0.5 * thickness } else { 0.0 }
    }
}

/// Which faces are the surface, to which distances refer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceFaces {
    /// All faces.
    #[default]
    All,
    /// The faces between inside and outside. A face that has the inside on both sides everywhere,
    /// or the outside on both sides everywhere, is left out.
    ///
    /// A face of which only a part lies between inside and outside stays as a whole, so distances
    /// inside may refer to its other part.
    Boundary,
}

crate::named!(SurfaceFaces {
    All: "all", "All faces";
    Boundary: "boundary", "Faces between inside and outside; faces within the solid are left out";
});

/// What is inside of a mesh, and which of its faces are the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inside {
    /// Which points count as inside.
    pub rule: InsideRule,
    /// Which faces are the surface.
    #[serde(default)]
    pub surface: SurfaceFaces,
}

impl Inside {
    /// A rule, with all faces as the surface.
    pub const fn new(rule: InsideRule) -> Self {
        Self { rule, surface: SurfaceFaces::All }
    }

    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl From<InsideRule> for Inside {
    fn from(rule: InsideRule) -> Self {
        Self::new(rule)
    }
}

impl fmt::Display for Inside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.rule {
            InsideRule::Winding => f.write_str("where the winding number is 1 or more")?,
            InsideRule::Nonzero => f.write_str("where the winding number is not 0")?,
            InsideRule::Odd => f.write_str("where the winding number is odd")?,
            InsideRule::Generalized => {
                f.write_str("where the generalised winding number is at least 1/2 or at most -1/2")?;
            }
            InsideRule::Sheet { thickness } => {
                write!(f, "nearer to a face than half of the thickness {thickness}")?;
            }
        }
        match self.surface {
            SurfaceFaces::All => Ok(()),
            SurfaceFaces::Boundary => f.write_str("; the surface is the faces between inside and outside"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_by_winding_number() {
        let table = [
            (InsideRule::Winding, [false, false, false, true, true]),
            (InsideRule::Nonzero, [true, true, false, true, true]),
            (InsideRule::Odd, [false, true, false, true, false]),
            (InsideRule::Generalized, [true, true, false, true, true]),
            (InsideRule::Sheet { thickness: 1.0 }, [false; 5]),
        ];
        for (rule, expected) in table {
            assert_eq!([-2, -1, 0, 1, 2].map(|w| rule.holds(w)), expected, "{rule:?}");
        }
    }
}
