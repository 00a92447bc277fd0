//! What rounding may cost rule C, counted.
use super::surface::{Part, Requirement, Surface, Touching};
use crate::domain::Cell;

/// The links that rule C has made from a cell's root to the cell: the longest chain of each filter, added up.
///
/// A link replaces a face by another face that has the same edge or vertex. Rounding can make the new one a little farther:
/// `d²(x, h) ≤ d²(x, g) + 2Δ²`, where Δ is what the test for the region of the edge or vertex can be off by (docs/math.md, 9). So a link
/// has a weight, and the weights have a budget. Where it is used up, rule C drops nothing more, and lists get longer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Chains(u32);

/// Weight of a link over an edge, or over a vertex at which the face has an angle up to 120°: Δ is two roundings.
const PLAIN: u32 = 1;
/// Weight of a link over a vertex with a larger angle: Δ is ten roundings.
const OBTUSE: u32 = 25;

impl Chains {
    /// None yet: at a root.
    pub const NONE: Self = Self(0);
    /// Where rule C stops. A rounding is 1.4e-15 of the side of the domain: √(2 · 400) · 2 · 1.4e-15 = 7.9e-14.
    pub const BUDGET: u32 = 400;

    /// As stored in a file.
    pub(crate) fn of_weight(used: u32) -> Self {
        Self(used)
    }

    /// What the links weigh.
    pub fn used(self) -> u32 {
        self.0
    }

    /// Whether the budget has room for so much more.
    pub(super) fn allow(self, weight: u32) -> bool {
        self.0 + weight <= Self::BUDGET
    }

    /// With the heaviest chain of one more filter.
    pub(super) fn and(self, weight: u32) -> Self {
        Self(self.0 + weight)
    }

    /// What a link weighs that drops `face` as all that the cell sees of it is one edge or vertex; `None` where Δ has no bound.
    pub(super) fn weight(surface: &Surface, cell: &Cell, requirement: Requirement, face: u32) -> Option<u32> {
        let Part::Vertex(vertex) = surface.part(requirement) else { return Some(PLAIN) };
        let corners = &surface.triangles[face as usize].corners;
        let k = surface.faces[face as usize].iter().position(|&v| v == vertex)?;
        let (u, v) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
        if u.dot(v) >= -0.5 * u.length() * v.length() {
            return Some(PLAIN);
        }
        // Cells of the bisection domain are all fat.
        (surface.touching == Touching::Kept || cell.is_fat()).then_some(OBTUSE)
    }
}
