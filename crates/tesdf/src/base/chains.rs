/// The weight of the links that rule C has made on the way from a root to a cell: the sum of the
/// heaviest chain of each filter.
///
/// A link replaces a face by another face that has the same edge or vertex. By rounding, the new
/// face can be a little farther: `d²(x, h) ≤ d²(x, g) + 2Δ²`, where Δ bounds the error of the test
/// for the region of the edge or vertex (docs/math.md, 9). So a link has a weight, and the weights
/// have a budget. Where it is used up, rule C drops nothing more, and lists get longer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Chains(u32);

impl Chains {
    /// No links: at a root.
    pub const NONE: Self = Self(0);
    /// The budget. A rounding is 1.4e-15 of the side of the domain: √(2 · 400) · 2 · 1.4e-15 =
    /// 7.9e-14.
    pub const BUDGET: u32 = 400;

    /// The weight that a file stores.
    pub(crate) fn of_weight(used: u32) -> Self {
        Self(used)
    }

    /// The weight of the links.
    pub fn used(self) -> u32 {
        self.0
    }

    /// Whether the budget allows this further weight.
    pub(crate) fn allow(self, weight: u32) -> bool {
        self.0 + weight <= Self::BUDGET
    }

    /// Adds the heaviest chain of a further filter.
    pub(crate) fn and(self, weight: u32) -> Self {
        Self(self.0 + weight)
    }

    /// The heavier chains of two proofs. `None` where one of the two proves nothing.
    pub(crate) fn of_both(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        Some(a?.max(b?))
    }
}
