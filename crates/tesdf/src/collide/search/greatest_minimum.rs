//! The greatest minimum of linear functions over a triangle. Each function is given by its values
//! at the corners, a place by its barycentric coordinates.
use glam::DVec3;

/// The value of a linear function at a place.
pub fn value(at: &[f64; 3], weights: [f64; 3]) -> f64 {
    at[0] * weights[0] + at[1] * weights[1] + at[2] * weights[2]
}

/// The corners.
pub const CORNERS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The places on the edges where two functions with the difference `d` are equal.
pub fn equal_on_edges(d: [f64; 3]) -> impl Iterator<Item = [f64; 3]> {
    (0..3).filter_map(move |i| {
        let j = (i + 1) % 3;
        let t = d[i] / (d[i] - d[j]);
        let mut weights = [0.0; 3];
        (weights[i], weights[j]) = (1.0 - t, t);
        (0.0..=1.0).contains(&t).then_some(weights)
    })
}

/// The place in the triangle where three functions are equal. `d` and `e` are the differences of
/// two of them from the third.
pub fn equal_inside(d: [f64; 3], e: [f64; 3]) -> Option<[f64; 3]> {
    // Weights of sum 1 at which both differences are 0.
    let w = DVec3::from(d).cross(DVec3::from(e));
    let weights = (w / (w.x + w.y + w.z)).to_array();
    weights.iter().all(|w| (0.0..=1.0).contains(w)).then_some(weights)
}

/// Margin for the rounding of a greatest minimum of functions with these values at the corners.
pub fn margin<'a>(values: impl Iterator<Item = &'a [f64; 3]>) -> f64 {
    1e-15 * values.flatten().fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// Upper bound, over a triangle, of the minimum of convex functions with these values at the
/// corners: the greatest minimum of the linear functions with the same values.
///
/// It is attained at a corner, on an edge where two functions are equal, or inside where three are
/// equal; all these points are tested. Near one face, or between two or three, the error is only
/// the curvature of the distances. So a search converges even when the minimum extends along a
/// whole line.
pub fn greatest_minimum<const N: usize>(values: [[f64; 3]; N]) -> f64 {
    summit(&values).0
}

/// As [`greatest_minimum`], with the place where it is attained.
pub fn summit(values: &[[f64; 3]]) -> (f64, [f64; 3]) {
    let mut greatest = (f64::NEG_INFINITY, CORNERS[0]);
    let mut offer = |weights: [f64; 3]| {
        let least = values.iter().map(|at| value(at, weights)).fold(f64::INFINITY, f64::min);
        if least > greatest.0 {
            greatest = (least, weights);
        }
    };
    CORNERS.into_iter().for_each(&mut offer);
    for k in 0..values.len() {
        for l in k + 1..values.len() {
            let d = difference(values[k], values[l]);
            equal_on_edges(d).for_each(&mut offer);
            for third in &values[l + 1..] {
                equal_inside(d, difference(values[k], *third)).into_iter().for_each(&mut offer);
            }
        }
    }
    (greatest.0 + margin(values.iter()), greatest.1)
}

/// The difference of two functions.
pub fn difference(f: [f64; 3], g: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| f[i] - g[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greatest_minimum_is_that_of_dense_samples() {
        // Numbers without a pattern.
        let number = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65536.0;
        for case in 0..200u32 {
            let values: [[f64; 3]; 4] =
                std::array::from_fn(|k| std::array::from_fn(|i| number(case * 12 + 3 * k as u32 + i as u32)));
            const N: u32 = 60;
            let mut sampled = f64::NEG_INFINITY;
            for i in 0..=N {
                for j in 0..=N - i {
                    let w = [i, j, N - i - j].map(|n| f64::from(n) / f64::from(N));
                    let at = |u: &[f64; 3]| (0..3).map(|c| w[c] * u[c]).sum::<f64>();
                    sampled = sampled.max(values.iter().map(at).fold(f64::INFINITY, f64::min));
                }
            }
            let exact = greatest_minimum(values);
            assert!(exact >= sampled && exact <= sampled + 2.0 / f64::from(N), "{exact} {sampled}");
        }
    }
}
