//! The point of a convex hull that is closest to a given point, in the space of wrenches.
//!
//! Input: the points that span the hull, and a target. Output: the target minus a point of the
//! hull. This point is a convex combination of the given points, whatever the rounding. So the
//! length of the output is an upper bound of the distance.

/// Coordinates of a wrench: force, then torque divided by a length.
pub type Wrench = [f64; 6];

/// Largest number of points in the combination; seven points span the space.
const ACTIVE: usize = 7;
/// A shorter distance is rounding, as the coordinates are of size 1.
pub(super) const ROUNDING: f64 = 1e-12;
/// Accepted relative error of the squared distance.
const SLACK: f64 = 1e-7;
/// Limit of the steps. The algorithm usually ends in fewer than ten; the limit guards against
/// rounding.
const STEPS: usize = 64;

pub(super) fn dot(a: &Wrench, b: &Wrench) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// `a + scale · b`.
fn plus(a: &Wrench, scale: f64, b: &Wrench) -> Wrench {
    std::array::from_fn(|k| a[k] + scale * b[k])
}

/// A convex combination of points of the hull, each minus the target.
struct Combination {
    points: [Wrench; ACTIVE],
    weights: [f64; ACTIVE],
    count: usize,
}

/// `target − q`, where `q` is the point of the hull of `points` that is closest to `target`. P.
/// Wolfe's algorithm (Finding the nearest point in a polytope, 1976): a face of the hull grows by
/// the point that lies farthest on the target's side. It shrinks until the closest point of its
/// affine span is inside it.
///
/// `points` must not be empty.
pub fn residual(points: &[Wrench], target: &Wrench) -> Wrench {
    let shifted = |p: &Wrench| plus(p, -1.0, target);
    let nearest = least(points, |p| dot(&shifted(p), &shifted(p)));
    let mut x = shifted(&points[nearest]);
    let mut face = Combination { points: [x; ACTIVE], weights: [1.0; ACTIVE], count: 1 };
    for _ in 0..STEPS {
        let square = dot(&x, &x);
        let v = shifted(&points[least(points, |p| dot(p, &x))]);
        let gap = square - dot(&v, &x);
        if square <= ROUNDING * ROUNDING || gap.is_nan() || gap <= SLACK * square || face.count == ACTIVE {
            break;
        }
        face.points[face.count] = v;
        face.weights[face.count] = 0.0;
        face.count += 1;
        let next = face.settle();
        if dot(&next, &next) >= square {
            // Only rounding is left, so the search ends.
            break;
        }
        x = next;
    }
    x.map(|x| -x)
}

/// Index of the first point with the least key.
fn least(points: &[Wrench], key: impl Fn(&Wrench) -> f64) -> usize {
    let mut best = (f64::INFINITY, 0);
    for (j, p) in points.iter().enumerate() {
        let value = key(p);
        if value < best.0 {
            best = (value, j);
        }
    }
    best.1
}

impl Combination {
    /// Moves towards the point of the affine span that is closest to the origin, and drops points
    /// whose weights reach 0. Returns the resulting point.
    fn settle(&mut self) -> Wrench {
        loop {
            let goal = self.affine_minimum();
            let weights = &mut self.weights;
            let mut stop = (1.0, None);
            for k in (0..self.count).filter(|&k| goal[k] <= 0.0) {
                let step = weights[k] / (weights[k] - goal[k]).max(f64::MIN_POSITIVE);
                if step < stop.0 {
                    stop = (step, Some(k));
                }
            }
            for k in 0..self.count {
                weights[k] = (weights[k] + stop.0 * (goal[k] - weights[k])).max(0.0);
            }
            // Set to exactly 0, so that the face loses a point in every iteration.
            if let Some(k) = stop.1 {
                weights[k] = 0.0;
            }
            self.drop_unused();
            if stop.1.is_none() {
                return self.point();
            }
        }
    }

    /// Weights of the point of the affine span that is closest to the origin. Their sum is 1; they
    /// may be negative. Least squares by modified Gram–Schmidt on the differences to the first
    /// point.
    fn affine_minimum(&self) -> [f64; ACTIVE] {
        let (first, n) = (self.points[0], self.count - 1);
        let mut q: [Wrench; ACTIVE - 1] = std::array::from_fn(|k| plus(&self.points[k + 1], -1.0, &first));
        let mut r = [[0.0; ACTIVE]; ACTIVE - 1];
        let mut rest = first;
        for k in 0..n {
            let length = dot(&q[k], &q[k]).sqrt();
            // A difference in the span of the others adds nothing, so its weight is 0.
            if length <= ROUNDING {
                continue;
            }
            q[k] = q[k].map(|x| x / length);
            r[k][k] = length;
            for j in k + 1..n {
                r[k][j] = dot(&q[k], &q[j]);
                q[j] = plus(&q[j], -r[k][j], &q[k]);
            }
            r[k][ACTIVE - 1] = dot(&q[k], &rest);
            rest = plus(&rest, -r[k][ACTIVE - 1], &q[k]);
        }
        let mut weights = [0.0; ACTIVE];
        for k in (0..n).rev().filter(|&k| r[k][k] > 0.0) {
            let known: f64 = (k + 1..n).map(|j| r[k][j] * weights[j + 1]).sum();
            weights[k + 1] = (-r[k][ACTIVE - 1] - known) / r[k][k];
        }
        weights[0] = 1.0 - weights[1..].iter().sum::<f64>();
        weights
    }

    fn drop_unused(&mut self) {
        let mut count = 0;
        for k in 0..self.count {
            if self.weights[k] > 0.0 {
                self.points[count] = self.points[k];
                self.weights[count] = self.weights[k];
                count += 1;
            }
        }
        // Weights of sum 1 are never all 0. With NaN, none may be positive.
        self.count = count.max(1);
        let sum: f64 = self.weights[..self.count].iter().sum();
        self.weights[..self.count].iter_mut().for_each(|w| *w /= sum);
    }

    fn point(&self) -> Wrench {
        let terms = self.points[..self.count].iter().zip(&self.weights);
        terms.fold([0.0; 6], |sum, (p, &w)| plus(&sum, w, p))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn wrench(size: f64) -> impl Strategy<Value = Wrench> {
        proptest::array::uniform6(-size..size)
    }

    /// Points in a subspace of up to six dimensions. Some are equal to others or midway between
    /// others.
    fn points() -> impl Strategy<Value = Vec<Wrench>> {
        (prop::collection::vec(wrench(1.0), 1..65), 1..7usize, any::<u64>()).prop_map(
            |(mut points, rank, seed)| {
                for p in &mut points {
                    p[rank..].fill(0.25);
                }
                for k in 2..points.len() {
                    match seed.rotate_left(k as u32) % 8 {
                        0 => points[k] = points[k - 2],
                        1 => points[k] = std::array::from_fn(|i| 0.5 * (points[k - 1][i] + points[k - 2][i])),
                        _ => {}
                    }
                }
                points
            },
        )
    }

    proptest! {
        /// x is the point of a convex set closest to the origin exactly when no point v of the set
        /// has v·x < |x|².
        #[test]
        fn no_point_of_the_hull_is_closer(points in points(), target in wrench(1.5), inside in any::<bool>()) {
            let mean = std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64);
            let target = if inside { mean } else { target };
            let x = residual(&points, &target);
            let square = dot(&x, &x);
            let reach = points.iter().map(|p| dot(&plus(&target, -1.0, p), &x)).fold(f64::INFINITY, f64::min);
            prop_assert!(reach >= square * (1.0 - 2.0 * SLACK) - 1e-12, "{square} {reach}");
            prop_assert!(!inside || square.sqrt() < 1e-10, "{square}");
        }
    }

    #[test]
    fn nan_terminates() {
        let points = [[f64::NAN; 6], [1.0; 6]];
        assert!(residual(&points, &[f64::NAN; 6])[0].is_nan());
        residual(&points, &[0.0; 6]);
    }
}
