/// Edges shorter than this share of the body are points: squares of their areas leave the range of 64-bit floats.
const POINT: f64 = 1e-70;

/// Whether three corners span no more than a segment or a point.
///
/// This is the one test for it. Every kernel then takes the face for its edges: it has no plane, so its normal is zero or NaN,
/// and the point that is closest lies on an edge.
///
/// `twice_area` is the length of the cross product of two edges and `longest` the length of the longest edge, in a frame where the
/// body has a diagonal of about 1. `least_height` is the greatest height over the longest edge that the precision at hand
/// cannot tell from 0. The distance to the edges is wrong by half of it at most.
///
/// Corners that coincide, and numbers that are not finite, make a flat face too: a comparison that asks for "less" would not see
/// them.
pub fn is_flat(twice_area: f64, longest: f64, least_height: f64) -> bool {
    let spans = twice_area > least_height * longest && longest > POINT;
    !spans
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_height_is_flat() {
        assert!(!is_flat(1.0, 1.0, 0.5));
        assert!(is_flat(0.5, 1.0, 0.5), "as high as the least height");
        assert!(is_flat(0.0, 0.0, 1e-6), "a point");
        assert!(is_flat(f64::NAN, 1.0, 0.5));
        assert!(is_flat(1e-145, 1e-72, 0.0), "its square is 0");
    }
}
