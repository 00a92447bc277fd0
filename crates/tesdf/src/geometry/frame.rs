use glam::DVec3;

use super::Aabb;
use crate::base::elementary;

/// The frame of all computations: `local = (x − offset) · scale`, exact for every vertex.
///
/// A part of a few millimetres given in metres, a cube of edge 1e30 and a bracket 1000 km from the
/// origin all become bodies with a diagonal of 0.5 to 1 near the origin, without rounding:
/// - `scale` is a power of two.
/// - An axis on which the body spans `[lo, hi]` with `0 < lo`, `hi ≤ 2 lo` (or mirrored) is offset
///   by its middle, where subtraction is exact (Sterbenz). Any other axis has no offset: there the
///   coordinates are at most twice the body's extent, so they lose no precision relative to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFrame {
    /// Subtracted first; in the mesh's unit.
    pub offset: DVec3,
    /// Factor after the subtraction; a power of two.
    pub scale: f64,
    /// 1 / `scale`, exact.
    inverse: f64,
}

impl LocalFrame {
    /// The frame of a body with these bounds. `bounds` is in the mesh's unit.
    pub fn of(bounds: Aabb) -> Self {
        let axis = |lo: f64, hi: f64| {
            let (near, far) = if lo > 0.0 { (lo, hi) } else { (-hi, -lo) };
            if near > 0.0 && far <= 2.0 * near { lo + 0.5 * (hi - lo) } else { 0.0 }
        };
        let offset = DVec3::from_array(std::array::from_fn(|a| axis(bounds.min[a], bounds.max[a])));
        let (_, exponent) = frexp(bounds.extent().length());
        Self::new(offset, elementary::powi(2.0, -exponent))
    }

    /// A frame with the given offset and scale, as stored in an asset.
    pub fn new(offset: DVec3, scale: f64) -> Self {
        Self { offset, scale, inverse: 1.0 / scale }
    }

    /// From the mesh's unit to the local frame.
    pub fn to_local(self, p: DVec3) -> DVec3 {
        (p - self.offset) * self.scale
    }

    /// From the local frame to the mesh's unit.
    pub fn to_world(self, p: DVec3) -> DVec3 {
        p * self.inverse + self.offset
    }

    /// Mesh units per local unit. Exact, because the scale is a power of two.
    pub fn inverse_scale(self) -> f64 {
        self.inverse
    }
}

/// Splits `x` into `m · 2^e` with `m` in [0.5, 1). `x` must be finite, positive and normal.
fn frexp(x: f64) -> (f64, i32) {
    let e = ((x.to_bits() >> 52) & 0x7ff) as i32 - 1022;
    (x / elementary::powi(2.0, e), e)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_map_exactly() {
        for (center, size) in [(0.0, 0.02), (1e6, 0.02), (-1e6, 0.02), (0.0, 1e30), (0.0, 1e-30), (1.0, 1.5)]
        {
            let corners: Vec<DVec3> = (0..8)
                .map(|i| {
                    DVec3::splat(center)
                        + size * DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64)
                })
                .collect();
            let bounds = Aabb::of(&corners);
            let frame = LocalFrame::of(bounds);
            for &c in &corners {
                assert_eq!(frame.to_world(frame.to_local(c)), c);
            }
            let diagonal = bounds.extent().length() * frame.scale;
            assert!((0.5..1.0).contains(&diagonal), "{diagonal}");
        }
    }

    /// An axis is offset where its interval has one sign and the far end is at most twice the near
    /// one.
    #[test]
    fn the_offset_is_the_middle_of_an_interval_away_from_zero() {
        for (low, high, middle) in
            [(1.0, 2.0, 1.5), (1.0, 2.25, 0.0), (0.0, 1.0, 0.0), (-1.0, 1.0, 0.0), (3.0, 5.0, 4.0)]
        {
            let bounds = Aabb { min: DVec3::new(low, -high, 0.0), max: DVec3::new(high, -low, 1.0) };
            let frame = LocalFrame::of(bounds);
            assert_eq!(frame.offset, DVec3::new(middle, -middle, 0.0), "{low} {high}");
            assert_eq!(frame.inverse_scale() * frame.scale, 1.0);
            let moved = DVec3::new(low, -low, 0.5);
            assert_eq!(frame.to_local(moved), (moved - frame.offset) * frame.scale);
        }
        assert_eq!(
            [0.5, 0.75, 1.0, 3.0, 1e-300, 1e300].map(frexp).map(|(m, e)| m * elementary::powi(2.0, e)),
            [0.5, 0.75, 1.0, 3.0, 1e-300, 1e300]
        );
        assert_eq!([0.5, 0.75, 1.0, 3.0].map(frexp), [(0.5, 0), (0.75, 0), (0.5, 1), (0.75, 2)]);
    }
}
