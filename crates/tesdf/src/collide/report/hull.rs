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
pub(super) const SLACK: f64 = 1e-7;
/// Limit of the steps. The algorithm usually ends in fewer than ten; the limit guards against
/// rounding.
const STEPS: usize = 64;
/// Number of targets that [`Simplex::squares`] takes at a time.
pub const LANES: usize = 4;

#[inline(always)]
pub(super) fn dot(a: &Wrench, b: &Wrench) -> f64 {
    (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) + (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
}

/// `a + scale · b`.
pub(super) fn plus(a: &Wrench, scale: f64, b: &Wrench) -> Wrench {
    std::array::from_fn(|k| a[k] + scale * b[k])
}

/// `target − q`, where `q` is the point of the hull of `points` that is closest to `target`.
///
/// `points` must not be empty.
pub fn residual(points: &[Wrench], target: &Wrench) -> Wrench {
    let distance = |p: &Wrench| {
        let way = plus(p, -1.0, target);
        dot(&way, &way)
    };
    Combination::of(least(points, distance).0).approach(points, target)
}

/// Index of the first point with the least key, and the key.
fn least(points: &[Wrench], key: impl Fn(&Wrench) -> f64) -> (usize, f64) {
    let mut best = (0, f64::INFINITY);
    for (j, p) in points.iter().enumerate() {
        let value = key(p);
        if value < best.1 {
            best = (j, value);
        }
    }
    best
}

/// A point of a hull: a convex combination of a few of the points that span the hull.
#[derive(Clone, Copy, Debug)]
pub struct Combination {
    /// Indices of the points.
    points: [u32; ACTIVE],
    weights: [f64; ACTIVE],
    count: usize,
}

impl Combination {
    /// A point that spans the hull.
    pub fn of(point: usize) -> Self {
        let mut weights = [0.0; ACTIVE];
        weights[0] = 1.0;
        Self { points: [point as u32; ACTIVE], weights, count: 1 }
    }

    /// Moves to the point of the hull that is closest to `target`, and returns the way from there
    /// to the target. `points` span the hull.
    ///
    /// P. Wolfe's algorithm (Finding the nearest point in a polytope, 1976): a face of the hull
    /// grows by the point that lies farthest on the target's side. It shrinks until the closest
    /// point of its affine span is inside it. A combination that is already close saves most steps.
    #[inline(always)]
    pub fn approach(&mut self, points: &[Wrench], target: &Wrench) -> Wrench {
        let x = self.settle(points, target);
        self.descend(points, target, x, 0)
    }

    /// As [`approach`](Self::approach), for a combination that was closest to `target` in the hull
    /// of the first `seen` points.
    #[inline(always)]
    pub fn approach_again(&mut self, points: &[Wrench], target: &Wrench, seen: usize) -> Wrench {
        let x = self.way(points, target);
        self.descend(points, target, x, seen)
    }

    /// `x` is the point minus the target. Of the first `seen` points none is on the target's side.
    #[inline(always)]
    fn descend(&mut self, points: &[Wrench], target: &Wrench, mut x: Wrench, mut seen: usize) -> Wrench {
        for _ in 0..STEPS {
            let square = dot(&x, &x);
            let (j, value) = least(&points[seen..], |p| dot(p, &x));
            let gap = square - (value - dot(target, &x));
            if square <= ROUNDING * ROUNDING || gap.is_nan() || gap <= SLACK * square || self.count == ACTIVE
            {
                break;
            }
            let before = *self;
            self.points[self.count] = (seen + j) as u32;
            self.weights[self.count] = 0.0;
            self.count += 1;
            let next = self.settle(points, target);
            if dot(&next, &next) >= square {
                // Only rounding is left, so the search ends.
                *self = before;
                break;
            }
            (x, seen) = (next, 0);
        }
        x.map(|x| -x)
    }

    /// Moves towards the point of the affine span that is closest to the target, and drops points
    /// whose weights reach 0. Returns the resulting point minus the target.
    #[inline(always)]
    fn settle(&mut self, points: &[Wrench], target: &Wrench) -> Wrench {
        loop {
            let corners = self.corners(points);
            let goal = Basis::new(&corners[..self.count]).weights(target);
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
                return self.way(points, target);
            }
        }
    }

    /// The point minus the target.
    fn way(&self, points: &[Wrench], target: &Wrench) -> Wrench {
        let terms = self.points[..self.count].iter().zip(&self.weights);
        terms.fold([0.0; 6], |sum, (&j, &w)| plus(&sum, w, &plus(&points[j as usize], -1.0, target)))
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

    fn corners(&self, points: &[Wrench]) -> [Wrench; ACTIVE] {
        let mut corners = [[0.0; 6]; ACTIVE];
        for k in 0..self.count {
            corners[k] = points[self.points[k] as usize];
        }
        corners
    }
}

/// An orthonormal basis of the differences of points to the first of them, by modified
/// Gram–Schmidt.
struct Basis {
    first: Wrench,
    q: [Wrench; ACTIVE - 1],
    /// Upper triangular: difference k is the sum of `r[j][k] q[j]`. A diagonal element is 0 where
    /// the difference lies in the span of those before it.
    r: [[f64; ACTIVE - 1]; ACTIVE - 1],
    /// Number of differences.
    count: usize,
}

impl Basis {
    fn new(points: &[Wrench]) -> Self {
        let (first, count) = (points[0], points.len() - 1);
        let mut q = [[0.0; 6]; ACTIVE - 1];
        let mut r = [[0.0; ACTIVE - 1]; ACTIVE - 1];
        for k in 0..count {
            q[k] = plus(&points[k + 1], -1.0, &first);
        }
        for k in 0..count {
            let length = dot(&q[k], &q[k]).sqrt();
            if length <= ROUNDING {
                continue;
            }
            q[k] = q[k].map(|x| x / length);
            r[k][k] = length;
            for j in k + 1..count {
                r[k][j] = dot(&q[k], &q[j]);
                q[j] = plus(&q[j], -r[k][j], &q[k]);
            }
        }
        Self { first, q, r, count }
    }

    /// Weights of the point of the affine span that is closest to `target`. Their sum is 1; they
    /// may be negative. A point in the span of those before it has the weight 0.
    fn weights(&self, target: &Wrench) -> [f64; ACTIVE] {
        let mut rest = plus(target, -1.0, &self.first);
        let mut along = [0.0; ACTIVE - 1];
        for ((along, q), r) in along.iter_mut().zip(&self.q).zip(self.diagonal()) {
            if r > 0.0 {
                *along = dot(q, &rest);
                rest = plus(&rest, -*along, q);
            }
        }
        let mut weights = [0.0; ACTIVE];
        for k in (0..self.count).rev().filter(|&k| self.r[k][k] > 0.0) {
            let known: f64 = (k + 1..self.count).map(|j| self.r[k][j] * weights[j + 1]).sum();
            weights[k + 1] = (along[k] - known) / self.r[k][k];
        }
        weights[0] = 1.0 - weights[1..].iter().sum::<f64>();
        weights
    }

    fn diagonal(&self) -> impl Iterator<Item = f64> {
        (0..self.count).map(|k| self.r[k][k])
    }

    /// The gradients of all weights but the first one, which are linear functions of the target.
    fn gradients(&self) -> [Wrench; ACTIVE - 1] {
        let mut rows = [[0.0; 6]; ACTIVE - 1];
        for k in (0..self.count).rev().filter(|&k| self.r[k][k] > 0.0) {
            let known = (k + 1..self.count).fold(self.q[k], |row, j| plus(&row, -self.r[k][j], &rows[j]));
            rows[k] = known.map(|x| x / self.r[k][k]);
        }
        rows
    }
}

/// The simplex that a combination spans. It takes one point of itself for each target, which is the
/// closest point where the target lies opposite of the simplex.
pub struct Simplex {
    corners: [Wrench; ACTIVE],
    /// The gradients of the weights of all corners but the first one.
    gradients: [Wrench; ACTIVE - 1],
    count: usize,
}

impl Simplex {
    /// `points` span the hull.
    pub fn new(points: &[Wrench], combination: &Combination) -> Self {
        let (corners, count) = (combination.corners(points), combination.count);
        Self { corners, gradients: Basis::new(&corners[..count]).gradients(), count }
    }

    /// For each target, the squared distance from the point of the simplex whose weights are those
    /// of the closest point of the affine span, without the negative ones. `targets` has a row for
    /// each coordinate.
    #[inline(always)]
    pub fn squares(&self, targets: &[[f64; LANES]; 6]) -> [f64; LANES] {
        let mut weights = [[0.0; LANES]; ACTIVE];
        let mut first = [1.0; LANES];
        let mut sum = [0.0; LANES];
        let (origin, others) = (&self.corners[0], 1..self.count);
        for (weights, gradient) in weights[others].iter_mut().zip(&self.gradients) {
            let mut weight = [0.0; LANES];
            for ((row, slope), origin) in targets.iter().zip(gradient).zip(origin) {
                for l in 0..LANES {
                    weight[l] += slope * (row[l] - origin);
                }
            }
            for l in 0..LANES {
                first[l] -= weight[l];
                weights[l] = weight[l].max(0.0);
                sum[l] += weights[l];
            }
        }
        for l in 0..LANES {
            weights[0][l] = first[l].max(0.0);
            // At least 1 up to rounding, because leaving out negative weights increases it.
            sum[l] = 1.0 / (sum[l] + weights[0][l]);
        }
        let mut squares = [0.0; LANES];
        for (c, row) in targets.iter().enumerate() {
            let mut point = [0.0; LANES];
            for (weights, corner) in weights.iter().zip(&self.corners[..self.count]) {
                for l in 0..LANES {
                    point[l] += weights[l] * corner[c];
                }
            }
            for l in 0..LANES {
                let way = row[l] - point[l] * sum[l];
                squares[l] += way * way;
            }
        }
        squares
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

    proptest! {
        /// From any start, the closest point is the same, and all targets are at least as far from
        /// the simplex of the closest point as from the hull.
        #[test]
        fn a_simplex_bounds_the_distance(points in points(), targets in prop::array::uniform4(wrench(1.5)), start in any::<prop::sample::Index>()) {
            let length = |x: &Wrench| dot(x, x).sqrt();
            let exact = targets.map(|t| length(&residual(&points, &t)));
            let mut near = Combination::of(start.index(points.len()));
            let distance = length(&near.approach(&points, &targets[0]));
            prop_assert!((distance - exact[0]).abs() <= 1e-6 * exact[0] + 1e-10, "{distance} {}", exact[0]);
            let rows = std::array::from_fn(|c| targets.map(|t| t[c]));
            let bounds = Simplex::new(&points, &near).squares(&rows).map(f64::sqrt);
            // Opposite of the simplex the bound is the distance.
            prop_assert!((bounds[0] - distance).abs() <= 1e-6 * distance + 1e-9, "{} {distance}", bounds[0]);
            for (bound, exact) in bounds.into_iter().zip(exact) {
                prop_assert!(bound >= exact * (1.0 - 1e-6) - 1e-10, "{bound} {exact}");
            }
        }
    }

    #[test]
    fn nan_terminates() {
        let points = [[f64::NAN; 6], [1.0; 6]];
        assert!(residual(&points, &[f64::NAN; 6])[0].is_nan());
        residual(&points, &[0.0; 6]);
    }
}
