//! The edge at which the searches divide a triangle.
use glam::DVec3;

/// The longest edge, by the corner at which it starts; of equal edges, the first. Halves of other
/// edges, or quarters of a needle, would be as slender, and many more.
pub fn longest_edge([a, b, c]: [DVec3; 3]) -> usize {
    let (ab, bc, ca) = (a.distance_squared(b), b.distance_squared(c), c.distance_squared(a));
    match () {
        () if ab >= bc && ab >= ca => 0,
        () if bc >= ca => 1,
        () => 2,
    }
}
