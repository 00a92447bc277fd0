/// A side of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Winding number 0.
    Outside,
    /// Winding number 1 or more.
    Inside,
}
