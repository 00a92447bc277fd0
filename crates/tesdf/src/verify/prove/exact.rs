//! Arithmetic with known errors: differences and products with their rounding errors, and unit
//! normals of needles.
use glam::DVec3;

use crate::base::elementary;

/// Largest relative error of one rounded operation.
pub const U: f64 = f64::EPSILON / 2.0;

/// A triangle whose height over its longest edge is at most this fraction of the edge has no
/// [`unit_normal`].
pub const FLAT: f64 = 1.0 / (1u64 << 48) as f64;

/// `x - y` rounded, and the rounding error (Knuth).
pub fn difference(x: f64, y: f64) -> (f64, f64) {
    let rounded = x - y;
    let back = rounded - x;
    (rounded, (x - (rounded - back)) - (y + back))
}

/// `x y` rounded, and the rounding error.
fn product(x: f64, y: f64) -> (f64, f64) {
    let rounded = x * y;
    (rounded, x.mul_add(y, -rounded))
}

/// `(b - a) × (c - a)`. The error of each component is at most 16 U² |b - a| |c - a| plus one
/// rounding of the component.
fn cross(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| difference(p[k], a[k])));
    DVec3::from_array([(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
        let (plus, minus) = (product(u[i].0, v[j].0), product(u[j].0, v[i].0));
        let tails = (u[i].0 * v[j].1 + u[i].1 * v[j].0) - (u[j].0 * v[i].1 + u[j].1 * v[i].0);
        let leading = difference(plus.0, minus.0);
        leading.0 + (leading.1 + (plus.1 - minus.1) + tails)
    }))
}

/// The unit normal of a triangle, with an error of at most 8 U, and the height over the longest
/// edge, rounded.
///
/// `None` when the height is at most [`FLAT`] times the longest edge. Corners may be about 2^7 from
/// the origin at most.
pub fn unit_normal([a, b, c]: [DVec3; 3]) -> Option<(DVec3, f64)> {
    let opposite = [b.distance(c), c.distance(a), a.distance(b)];
    let longest = opposite[0].max(opposite[1]).max(opposite[2]);
    // Computed at the widest angle, where the cross product is largest relative to the lengths of
    // its edges.
    let normal = if opposite[0] == longest {
        cross(a, b, c)
    } else if opposite[1] == longest {
        cross(b, c, a)
    } else {
        cross(c, a, b)
    };
    let largest = normal.abs().max_element();
    // A smaller product may have lost digits to underflow. Such triangles are below 2^-200 in
    // height or length.
    if largest.is_nan() || largest <= elementary::powi(2.0, -400) {
        return None;
    }
    let scaled = normal / largest;
    let length = scaled.length();
    let height = length * largest / longest;
    (height > FLAT * longest).then(|| (scaled / length, height))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A needle in no special position, with exact coordinates. Its normal is known from integers.
    #[test]
    fn normals_of_needles_are_accurate() {
        // a, b, c = a + (b - a) / 2 + e with e = (0, 0, 2^-40): all exact.
        let a = DVec3::new(0.3125, -0.71875, 0.15625);
        let b = DVec3::new(0.8125, 0.28125, -0.09375);
        let e = 2f64.powi(-40);
        let c = 0.5 * (a + b) + DVec3::new(0.0, 0.0, e);
        // (b - a) × (0, 0, e) = e (1, -0.5, 0).
        let expected = DVec3::new(1.0, -0.5, 0.0) / 1.25f64.sqrt();
        let (normal, height) = unit_normal([a, b, c]).expect("an area");
        assert!(normal.distance(expected) <= 8.0 * U, "{}", normal.distance(expected));
        let exact = e * 1.25f64.sqrt() / a.distance(b);
        assert!((height / exact - 1.0).abs() < 1e-14);
        assert!(unit_normal([a, b, 0.5 * (a + b)]).is_none() && unit_normal([a, a, b]).is_none());
        assert!(unit_normal([a; 3]).is_none());
    }

    #[test]
    fn differences_include_their_rounding_error() {
        let (rounded, lost) = difference(1.0, 2f64.powi(-60));
        assert_eq!((rounded, lost), (1.0, -2f64.powi(-60)));
    }
}
