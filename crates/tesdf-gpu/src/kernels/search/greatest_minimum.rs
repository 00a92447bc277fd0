//! The greatest minimum of four linear functions over a triangle: the largest value that the
//! smallest function reaches. Each function is given by its values at the corners. The result
//! bounds the depth of a piece.
//!
//! Mirrors `collide/search/greatest_minimum.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::geometry::vector::{LEAST_DIVISOR, V3, v3};

/// Four linear functions over a triangle.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Functions {
    pub f: V3,
    pub g: V3,
    pub h: V3,
    pub k: V3,
}

#[cube]
impl Functions {
    /// The smallest of the four values at barycentric weights.
    fn least_at(self, w: V3) -> f32 {
        self.f.dot(w).min(self.g.dot(w)).min(self.h.dot(w).min(self.k.dot(w)))
    }

    /// Returns `least`, or the smallest of the four functions where two of them are equal on an
    /// edge, whichever is greater. `d` is the difference of these two.
    fn on_edges(self, least: f32, d: V3) -> f32 {
        let mut greatest = least;
        if d.x * d.y < 0.0f32 {
            let w = d.x / (d.x - d.y);
            greatest = greatest.max(self.least_at(v3(1.0f32 - w, w, 0.0f32)));
        }
        if d.y * d.z < 0.0f32 {
            let w = d.y / (d.y - d.z);
            greatest = greatest.max(self.least_at(v3(0.0f32, 1.0f32 - w, w)));
        }
        if d.z * d.x < 0.0f32 {
            let w = d.z / (d.z - d.x);
            greatest = greatest.max(self.least_at(v3(w, 0.0f32, 1.0f32 - w)));
        }
        greatest
    }

    /// The same where three functions are equal inside the triangle. `d` and `e` are two of their
    /// differences.
    fn inside(self, least: f32, d: V3, e: V3) -> f32 {
        let w = d.cross(e);
        let sum = w.x + w.y + w.z;
        let some = sum.abs() > LEAST_DIVISOR;
        let at = w * select(some, 1.0f32 / select(some, sum, 1.0f32), 0.0f32);
        let mut greatest = least;
        if some && at.x >= 0.0f32 && at.y >= 0.0f32 && at.z >= 0.0f32 {
            greatest = greatest.max(self.least_at(at));
        }
        greatest
    }

    /// The greatest minimum, as `greatest_minimum` of `tesdf` computes it for any number of
    /// functions. The processor adds a margin for the rounding of `f64`. Here rounding is within
    /// the smallest tolerance of the exact mode. It is at a corner, where two functions are equal
    /// on an edge, or where three are equal inside. The cases are written out, because loops over
    /// pairs and triples would take most of the iterations of a search.
    pub fn greatest_minimum(self) -> f32 {
        let (fg, fh, fk) = (self.f - self.g, self.f - self.h, self.f - self.k);
        let (gh, gk, hk) = (self.g - self.h, self.g - self.k, self.h - self.k);
        let mut greatest = self
            .least_at(v3(1.0f32, 0.0f32, 0.0f32))
            .max(self.least_at(v3(0.0f32, 1.0f32, 0.0f32)))
            .max(self.least_at(v3(0.0f32, 0.0f32, 1.0f32)));
        greatest = self.on_edges(greatest, fg);
        greatest = self.on_edges(greatest, fh);
        greatest = self.on_edges(greatest, fk);
        greatest = self.on_edges(greatest, gh);
        greatest = self.on_edges(greatest, gk);
        greatest = self.on_edges(greatest, hk);
        greatest = self.inside(greatest, fg, fh);
        greatest = self.inside(greatest, fg, fk);
        greatest = self.inside(greatest, fh, fk);
        self.inside(greatest, gh, gk)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use tesdf::collide::internal;

    use super::*;

    /// Values of one function: any, a plateau, nearly those of another function, or tiny.
    fn values() -> impl Strategy<Value = [f32; 3]> {
        let whole = prop::array::uniform3((0..4i8).prop_map(f32::from));
        let any = prop::array::uniform3(0.0..4.0f32);
        let plateau = (0.0..4.0f32).prop_map(|x| [x; 3]);
        let tiny = prop::array::uniform3(0.0..1e-22f32);
        prop_oneof![3 => any, 3 => whole, 1 => plateau, 1 => tiny]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        /// Also with equal functions, and with functions that differ by rounding.
        #[test]
        fn the_greatest_minimum_is_that_of_the_processor(
            values in prop::array::uniform4(values()), same in 0..4usize, of in 0..4usize, off in -1e-6..1e-6f32,
        ) {
            let mut values = values;
            values[same] = values[of].map(|x| x + if same == 0 { off } else { 0.0 });
            let [f, g, h, k] = values.map(|[x, y, z]| v3(x, y, z));
            let found = f64::from(Functions { f, g, h, k }.greatest_minimum());
            let expected = internal::greatest_minimum(values.map(|v| v.map(f64::from)));
            prop_assert!((found - expected).abs() < 2e-6 * 4.0, "{found} instead of {expected}");
        }
    }
}
