/// A face whose longest edge is not longer than this is a point. Squares of smaller areas would
/// leave the range of 64-bit floats. Relative to a body of diagonal 1.
const POINT: f64 = 1e-70;

/// Whether three corners span only a segment or a point.
///
/// This is the only test for flat faces. Every kernel treats a flat face as its edges: the face has
/// no plane, its normal is zero or NaN, and the closest point lies on an edge.
///
/// `twice_area` is the length of the cross product of two edges. `longest` is the length of the
/// longest edge, in a frame where the body has a diagonal of about 1. `least_height` is the largest
/// height over the longest edge that the precision in use cannot distinguish from 0. Treating the
/// face as its edges changes distances by at most half of it.
///
/// Coinciding corners and numbers that are not finite count as flat too. For this reason the test
/// is not written as a single "less than".
pub fn is_flat(twice_area: f64, longest: f64, least_height: f64) -> bool {
    let spans = twice_area > least_height * longest && longest > POINT;
    !spans
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_without_height_are_flat() {
        assert!(!is_flat(1.0, 1.0, 0.5));
        assert!(is_flat(0.5, 1.0, 0.5), "as high as the least height");
        assert!(is_flat(0.5, 2.0, 0.4) && !is_flat(1.0, 2.0, 0.4));
        assert!(is_flat(0.0, 0.0, 1e-6), "a point");
        assert!(is_flat(f64::NAN, 1.0, 0.5));
        assert!(is_flat(1e-140, POINT, 0.0) && !is_flat(1e-140, POINT.next_up(), 0.0));
        assert!(is_flat(1e-145, 1e-72, 0.0), "its square is 0");
    }
}
