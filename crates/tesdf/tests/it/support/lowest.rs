//! Minimum of a function over a polygon from samples alone, and clipping by the four planes of a
//! tetrahedron.
use tesdf::geometry::Triangle;
use tesdf::glam::DVec3;

/// A convex polygon.
pub type Polygon = Vec<DVec3>;

/// The part of a triangle that lies in a tetrahedron, borders included; empty when there is none.
pub fn clip(triangle: [DVec3; 3], corners: &[DVec3; 4]) -> Polygon {
    let mut polygon = triangle.to_vec();
    for k in 0..4 {
        let [a, b, c] = [1, 2, 3].map(|i| corners[(k + i) % 4]);
        let normal = (b - a).cross(c - a);
        let inward = normal * normal.dot(corners[k] - a).signum();
        let height = |p: DVec3| inward.dot(p - a);
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for i in 0..polygon.len() {
            let (p, q) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (h, g) = (height(p), height(q));
            if h >= 0.0 {
                kept.push(p);
            }
            if (h > 0.0 && g < 0.0) || (h < 0.0 && g > 0.0) {
                kept.push(p + h / (h - g) * (q - p));
            }
        }
        polygon = kept;
    }
    polygon
}

pub fn area(polygon: &[DVec3]) -> f64 {
    let fan = |i: usize| 0.5 * (polygon[i] - polygon[0]).cross(polygon[i + 1] - polygon[0]);
    (1..polygon.len().saturating_sub(1)).map(fan).sum::<DVec3>().length()
}

/// The least value that the search finds, and its point. It samples a lattice over each triangle of
/// the polygon's fan, then searches around the best points in steps that halve, down to `finest` of
/// the size. The result is an upper bound of the minimum.
pub fn sampled(polygon: &[DVec3], lattice: usize, finest: f64, value: impl Fn(DVec3) -> f64) -> (f64, DVec3) {
    let mut best = (f64::INFINITY, DVec3::ZERO);
    let n = lattice.max(1);
    for k in 2..polygon.len().max(3) {
        let at = |i: usize| polygon[i.min(polygon.len() - 1)];
        let corners = [at(0), at(k - 1), at(k)];
        let point = |w: [f64; 3]| corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2];
        let mut samples = Vec::new();
        for i in 0..=n {
            for j in 0..=n - i {
                let w = [i, j, n - i - j].map(|x| x as f64 / n as f64);
                samples.push((value(point(w)), w));
            }
        }
        samples.sort_by(|x, y| x.0.total_cmp(&y.0));
        for &(mut least, mut w) in samples.iter().take(if finest < 1.0 { 2 } else { 1 }) {
            let mut step = 1.0 / n as f64;
            while step > finest {
                let tried = MOVES.map(|m| {
                    let moved = [0, 1, 2].map(|i| w[i] + step * m[i]);
                    let inside = moved.iter().all(|x| *x >= 0.0);
                    (if inside { value(point(moved)) } else { f64::INFINITY }, moved)
                });
                let found = tried.iter().min_by(|x, y| x.0.total_cmp(&y.0)).copied().unwrap_or((least, w));
                if found.0 < least {
                    (least, w) = found;
                } else {
                    step *= 0.5;
                }
            }
            if least < best.0 {
                best = (least, point(w));
            }
        }
    }
    best
}

/// Steps towards, away from and along the sides of a triangle, in barycentric coordinates.
const MOVES: [[f64; 3]; 12] = [
    [1.0, -1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [1.0, 0.0, -1.0],
    [-1.0, 0.0, 1.0],
    [0.0, 1.0, -1.0],
    [0.0, -1.0, 1.0],
    [1.0, -0.5, -0.5],
    [-1.0, 0.5, 0.5],
    [-0.5, 1.0, -0.5],
    [0.5, -1.0, 0.5],
    [-0.5, -0.5, 1.0],
    [0.5, 0.5, -1.0],
];

/// A part of a triangle that still needs work; the part with the lowest bound comes first.
struct Open {
    bound: f64,
    corners: [DVec3; 3],
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Open {}
impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Open {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        other.bound.total_cmp(&self.bound)
    }
}

/// Lower and upper bound of the least signed distance over a triangle, by branch and bound. They
/// differ by at most `tolerance`, unless `most` evaluations were not enough.
///
/// `nearest` gives the signed distance at a point and the nearest triangle. Two facts give the
/// bounds: the field is 1-Lipschitz, and it is nowhere deeper than the distance to any one
/// triangle, which is convex.
pub fn certified(
    triangle: [DVec3; 3],
    tolerance: f64,
    most: usize,
    nearest: impl Fn(DVec3) -> (f64, Triangle),
) -> [f64; 2] {
    let (mut best, mut evaluations) = (f64::INFINITY, 0);
    let mut open = std::collections::BinaryHeap::new();
    let mut add = |corners: [DVec3; 3], open: &mut std::collections::BinaryHeap<Open>| {
        let middle = corners.iter().sum::<DVec3>() / 3.0;
        let (value, face) = nearest(middle);
        best = best.min(value);
        evaluations += 1;
        let reach = corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max);
        let farthest = corners.iter().map(|c| face.closest(*c).distance).fold(0.0, f64::max);
        open.push(Open { bound: (value - reach).max(-farthest), corners });
        (best, evaluations)
    };
    add(triangle, &mut open);
    while let Some(Open { bound, corners: [a, b, c] }) = open.pop() {
        // Quarters the triangle, whereas the detector halves it.
        let [d, e, f] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        let mut now = (f64::INFINITY, 0);
        for part in [[a, d, f], [d, b, e], [f, e, c], [d, e, f]] {
            now = add(part, &mut open);
        }
        let bound = bound.max(open.peek().map_or(f64::INFINITY, |o| o.bound));
        if bound >= now.0 - tolerance || now.1 > most {
            return [bound.min(now.0), now.0];
        }
    }
    [best, best]
}
