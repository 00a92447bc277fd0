//! Distances in exact rational arithmetic.
use glam::DVec3;
use num_rational::BigRational;

type Point = [BigRational; 3];

fn number(x: f64) -> BigRational {
    BigRational::from_float(x).expect("coordinates are finite")
}

fn point(p: DVec3) -> Point {
    p.to_array().map(number)
}

fn minus(a: &Point, b: &Point) -> Point {
    std::array::from_fn(|k| &a[k] - &b[k])
}

fn dot(a: &Point, b: &Point) -> BigRational {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

fn cross(a: &Point, b: &Point) -> Point {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| &a[i] * &b[j] - &a[j] * &b[i])
}

/// The exact squared distance between a point and a triangle of any shape.
pub fn squared_distance(p: DVec3, corners: [DVec3; 3]) -> BigRational {
    let p = point(p);
    let corners = corners.map(point);
    let zero = number(0.0);
    let edges: [Point; 3] = std::array::from_fn(|k| minus(&corners[(k + 1) % 3], &corners[k]));
    let normal = cross(&edges[0], &edges[1]);
    let area = dot(&normal, &normal);
    let from: [Point; 3] = std::array::from_fn(|k| minus(&p, &corners[k]));
    let is_over = |k: usize| dot(&cross(&edges[k], &from[k]), &normal) >= zero;
    if area > zero && (0..3).all(is_over) {
        let height = dot(&normal, &from[0]);
        return &height * &height / area;
    }
    let to_edge = |k: usize| {
        let (along, length) = (dot(&edges[k], &from[k]), dot(&edges[k], &edges[k]));
        let start = dot(&from[k], &from[k]);
        if along <= zero {
            start
        } else if along >= length {
            let end = minus(&from[k], &edges[k]);
            dot(&end, &end)
        } else {
            start - &along * &along / length
        }
    };
    (0..3).map(to_edge).min().unwrap_or(zero)
}

/// The change of the winding number on the way from `x` to `p + (e, e², e³)` through a triangle,
/// from the point where the way crosses the plane. `e` is 2^-20, which is little beside small
/// integers.
pub fn crossing(x: DVec3, p: DVec3, corners: [DVec3; 3]) -> i32 {
    let (x, p, corners, zero) = (point(x), point(p), corners.map(point), number(0.0));
    let p: Point = std::array::from_fn(|k| &p[k] + number(2f64.powi(-20 * (k as i32 + 1))));
    let edges: [Point; 3] = std::array::from_fn(|k| minus(&corners[(k + 1) % 3], &corners[k]));
    let normal = cross(&edges[0], &edges[1]);
    let height = |of: &Point| dot(&normal, &minus(of, &corners[0]));
    let (start, end) = (height(&x), height(&p));
    if &start * &end >= zero {
        return 0;
    }
    let (share, way) = (&start / (&start - &end), minus(&p, &x));
    let at: Point = std::array::from_fn(|k| &x[k] + &share * &way[k]);
    let is_within = |k: usize| dot(&cross(&edges[k], &minus(&at, &corners[k])), &normal) > zero;
    if (0..3).all(is_within) { if end > start { 1 } else { -1 } } else { 0 }
}

/// Whether `distance` is the square root of `squared` up to `tolerance`.
pub fn is_root(distance: f64, squared: &BigRational, tolerance: f64) -> bool {
    if !(distance.is_finite() && distance >= 0.0) {
        return false;
    }
    let (distance, tolerance) = (number(distance), number(tolerance));
    let low = (&distance - &tolerance).max(number(0.0));
    let high = distance + tolerance;
    &low * &low <= *squared && *squared <= &high * &high
}

/// Whether `low` ≤ √`squared` ≤ `high`.
pub fn is_between(low: f64, squared: &BigRational, high: f64) -> bool {
    let square = |x: f64| {
        let x = number(x.max(0.0));
        &x * &x
    };
    square(low) <= *squared && *squared <= square(high)
}
