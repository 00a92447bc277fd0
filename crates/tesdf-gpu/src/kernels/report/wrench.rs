//! Wrenches of unit forces, and their residuals. A residual is the vector from a point of the
//! convex hull to a wrench.
//!
//! A step replaces a residual by the shortest residual from a triangle: the triangle of the current
//! hull point and two vertices of the hull. With segments to a single vertex (Frank–Wolfe), steps
//! alternate between the vertices of a face. Where 64 contacts of a curved patch were kept, eight
//! such steps left a gap to the distances that was three times as large.
use cubecl::prelude::*;

use crate::kernels::geometry::vector::{LEAST_DIVISOR, V3, pick};

/// Force, and torque divided by a length; or the difference of two wrenches.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Wrench {
    pub force: V3,
    pub torque: V3,
}

/// A residual, and the largest rounding error of its length.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Residual {
    pub wrench: Wrench,
    pub rounding: f32,
}

/// Rounding error of a step, relative to the lengths that it adds: six operations for each
/// coordinate, with 6e-8 each.
const STEP_ROUNDING: f32 = 4e-7;
/// Two directions count as parallel when the sine squared of their angle is below this.
const PARALLEL: f32 = 1e-6;

#[cube]
impl Wrench {
    pub fn add(self, other: Wrench) -> Wrench {
        Wrench { force: self.force + other.force, torque: self.torque + other.torque }
    }

    pub fn sub(self, other: Wrench) -> Wrench {
        Wrench { force: self.force - other.force, torque: self.torque - other.torque }
    }

    pub fn mul(self, factor: f32) -> Wrench {
        Wrench { force: self.force * factor, torque: self.torque * factor }
    }

    pub fn dot(self, other: Wrench) -> f32 {
        self.force.dot(other.force) + self.torque.dot(other.torque)
    }
}

impl std::ops::Add for Wrench {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Wrench::add(self, other)
    }
}

impl std::ops::Sub for Wrench {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Wrench::sub(self, other)
    }
}

impl std::ops::Mul<f32> for Wrench {
    type Output = Self;

    fn mul(self, factor: f32) -> Self {
        Wrench::mul(self, factor)
    }
}

/// Returns `first` when the condition is true, otherwise `second`. This needs no branch.
#[cube]
pub fn pick_wrench(condition: bool, first: Wrench, second: Wrench) -> Wrench {
    Wrench {
        force: pick(condition, first.force, second.force),
        torque: pick(condition, first.torque, second.torque),
    }
}

#[cube]
impl Residual {
    /// The shortest residual from the triangle of the current hull point and the two vertices that
    /// `to_f` and `to_g` start from. Returns the current residual when that is not longer.
    pub fn shortened(self, to_f: Wrench, to_g: Wrench) -> Residual {
        let x = self.wrench;
        let along_f = x - to_f;
        let along_g = x - to_g;
        let ff = along_f.dot(along_f);
        let gg = along_g.dot(along_g);
        let fg = along_f.dot(along_g);
        let xf = x.dot(along_f);
        let xg = x.dot(along_g);
        let square = x.dot(x);
        let area = ff * gg - fg * fg;
        let inside_f = (xf * gg - xg * fg) / area.max(LEAST_DIVISOR);
        let inside_g = (xg * ff - xf * fg) / area.max(LEAST_DIVISOR);
        let is_inside = area > PARALLEL * ff * gg
            && inside_f >= 0.0f32
            && inside_g >= 0.0f32
            && inside_f + inside_g <= 1.0f32;
        // The nearest point on the side from x to f.
        let of_f = (xf / ff.max(LEAST_DIVISOR)).max(0.0f32).min(1.0f32);
        let of_f_square = square - 2.0f32 * of_f * xf + of_f * of_f * ff;
        // The nearest point on the side from g to f.
        let side = to_g - to_f;
        let side_square = side.dot(side);
        let of_g = to_g.dot(side);
        let from_g = (of_g / side_square.max(LEAST_DIVISOR)).max(0.0f32).min(1.0f32);
        let from_g_square = to_g.dot(to_g) - 2.0f32 * from_g * of_g + from_g * from_g * side_square;
        let on_side = !is_inside && from_g_square < of_f_square;
        let f = select(is_inside, inside_f, select(on_side, from_g, of_f));
        let g = select(is_inside, inside_g, select(on_side, 1.0f32 - from_g, 0.0f32));
        let rest = select(on_side, 0.0f32, (1.0f32 - f - g).max(0.0f32));
        let new = x * rest + (to_f * f + to_g * g);
        let lengths = rest * square.sqrt() + f * to_f.dot(to_f).sqrt() + g * to_g.dot(to_g).sqrt();
        let rounding = rest * self.rounding + STEP_ROUNDING * lengths;
        let is_shorter = new.dot(new) < square;
        Residual {
            wrench: pick_wrench(is_shorter, new, x),
            rounding: select(is_shorter, rounding, self.rounding),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use tesdf::collide::internal;

    use super::*;
    use crate::kernels::geometry::vector::v3;

    fn wrench([a, b, c, d, e, f]: [f32; 6]) -> Wrench {
        Wrench { force: v3(a, b, c), torque: v3(d, e, f) }
    }

    /// Vectors from three vertices to a wrench. The vertices may coincide, lie on a line or lie
    /// close to each other, and the wrench may be a vertex.
    fn triangle() -> impl Strategy<Value = [[f32; 6]; 3]> {
        let any = || prop::array::uniform6(-1.0..1.0f32);
        (any(), any(), any(), 0u8..7, -9.0..0.0f32, -0.5..1.5f32).prop_map(|(x, f, g, kind, size, share)| {
            let near = |p: [f32; 6], q: [f32; 6]| std::array::from_fn(|k| p[k] + 10f32.powf(size) * q[k]);
            match kind {
                0 => [x, x, x],
                1 => [x, f, f],
                2 => [x, f, near(f, g)],
                3 => [x, near(x, f), near(x, g)],
                4 => [x, f, std::array::from_fn(|k| x[k] + share * (f[k] - x[k]))],
                5 => [x, [0.0; 6], g],
                _ => [x, f, g],
            }
        })
    }

    fn length(w: &internal::Wrench) -> f64 {
        w.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        /// A step never lengthens a residual, and never shortens it below the distance to the
        /// triangle. It becomes the shortest one of the whole triangle when it was the shortest one
        /// of the side from the hull point to the third vertex.
        #[test]
        fn a_step_gives_the_shortest_residual_of_a_triangle(vectors in triangle()) {
            let start = Residual { wrench: wrench(vectors[0]), rounding: 0.0 };
            // First toward g, so that the residual is the shortest one of its side.
            let start = start.shortened(wrench(vectors[2]), wrench(vectors[2]));
            let found = start.shortened(wrench(vectors[1]), wrench(vectors[2]));
            let [before, after] = [start, found].map(|r| f64::from(r.wrench.dot(r.wrench).sqrt()));
            prop_assert!(after <= before);
            // The vertices as seen from the wrench.
            let Wrench { force, torque } = start.wrench;
            let x = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
            let vertices = [x, vectors[1], vectors[2]].map(|v| v.map(|a| -f64::from(a)));
            let distance = length(&internal::residual(&vertices, &[0.0; 6]));
            prop_assert!(after + f64::from(found.rounding) + 1e-6 >= distance, "{after} of {distance}");
            prop_assert!(after <= 1.001 * distance + 2e-3, "{after} of {distance}");
        }
    }
}
