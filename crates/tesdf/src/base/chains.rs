/// The links that rule C has made from a cell's root to the cell: the longest chain of each filter, added up.
///
/// A link replaces a face by another face that has the same edge or vertex. Rounding can make the new one a little farther:
/// `d²(x, h) ≤ d²(x, g) + 2Δ²`, where Δ is what the test for the region of the edge or vertex can be off by (docs/math.md, 9). So a link
/// has a weight, and the weights have a budget. Where it is used up, rule C drops nothing more, and lists get longer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Chains(u32);

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
    pub(crate) fn allow(self, weight: u32) -> bool {
        self.0 + weight <= Self::BUDGET
    }

    /// With the heaviest chain of one more filter.
    pub(crate) fn and(self, weight: u32) -> Self {
        Self(self.0 + weight)
    }

    /// The heavier of two proofs' chains; `None` where one of the two proves nothing.
    pub(crate) fn of_both(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        Some(a?.max(b?))
    }
}
