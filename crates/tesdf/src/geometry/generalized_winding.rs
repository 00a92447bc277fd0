use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec3;

use super::{Aabb, WindingNumber, perturbed_orientation, signed_crossing};
use crate::base::elementary;

/// The generalised winding number (Jacobson et al. 2013) of any triangles: the sum of their solid
/// angles divided by 4 pi.
///
/// It takes O(log F) for `F` faces and O(B) for `B` edges at which the mesh is open. Triangles from
/// an *apex* to these edges close the mesh. The closed mesh has an integer winding number, which
/// exact predicates count. The solid angles of the added triangles are taken away again:
///
/// ```text
/// w(x) = N(x) - C(x)      N: winding number of faces and added triangles, exact
///                         C: solid angles of the added triangles / 4 pi
/// ```
///
/// `N` and `C` jump at an added triangle, `w` does not. So both are taken at the same point `x +
/// (e, e^2, e^3)` with an infinitesimal `e > 0`: the sign of the solid angle of a triangle that has
/// `x` in its plane is that of [`perturbed_orientation`].
///
/// Near an edge of an added triangle its solid angle is badly conditioned. Then another apex is
/// taken; only near an open edge of the mesh all of them are badly conditioned.
#[derive(Clone, Debug)]
pub struct GeneralizedWinding {
    faces: WindingNumber,
    bounds: Aabb,
    /// The area of all faces.
    area: f64,
    /// Open edges, with the number of times that the closing triangles use them.
    edges: Vec<([DVec3; 2], f64)>,
    /// The closing triangles for each apex, from outside of their solid angles to be taken away,
    /// with the number of times that each is needed.
    cones: [Vec<([DVec3; 3], i32)>; APEXES],
}

const APEXES: usize = 4;
/// Where the apexes lie: from the mean of the vertices of open edges towards a corner of the bounds
/// by these shares along x, y, z. The apexes are in general position to each other.
const TOWARDS: [[f64; 3]; APEXES] =
    [[0.0, 0.0, 0.0], [0.31, 0.17, 0.23], [0.13, -0.29, 0.19], [-0.27, 0.11, -0.37]];
/// A cone whose worst triangle is better conditioned than this is taken at once.
const GOOD: f64 = 1e-2;

/// A value of the generalised winding number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Generalized {
    /// The number.
    pub value: f64,
    /// A bound of its rounding error. It is infinite on an open edge of the mesh, where the number
    /// depends on the direction.
    pub error: f64,
}

/// The generalised winding number around a point, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearWinding {
    /// The number at the point.
    pub value: f64,
    /// Its gradient.
    pub gradient: DVec3,
    /// A bound of the error of the linear function, rounding included.
    pub error: f64,
}

impl GeneralizedWinding {
    /// Builds the tree over the faces, and finds the edges that close the mesh. `position` gives
    /// the position of a vertex.
    pub fn new(faces: &[[u32; 3]], position: impl Fn(u32) -> DVec3) -> Self {
        let triangles: Vec<[DVec3; 3]> = faces.iter().map(|f| f.map(&position)).collect();
        let bounds = triangles.iter().map(|t| Aabb::of(t)).fold(Aabb::EMPTY, Aabb::union);
        let area = triangles.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum();
        // How many more faces run along an edge from the lower vertex to the higher than back.
        let mut balance: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for corners in faces {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                if a != b {
                    *balance.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
                }
            }
        }
        // The closing triangles run against the faces.
        let against =
            |([a, b], times): ([u32; 2], i32)| (if times > 0 { [b, a] } else { [a, b] }, times.abs());
        let (open, times): (Vec<[u32; 2]>, Vec<i32>) =
            balance.into_iter().filter(|&(_, times)| times != 0).map(against).unzip();
        let cones = TOWARDS.map(|share| {
            let mut cone = Vec::with_capacity(open.len());
            for part in connected(&open) {
                let corners = part.iter().flat_map(|&e| open[e].map(|v| f64::from(times[e]) * position(v)));
                let all: f64 = part.iter().map(|&e| 2.0 * f64::from(times[e])).sum();
                let apex = moved(corners.sum::<DVec3>() / all, bounds, share);
                cone.extend(part.iter().map(|&e| {
                    let [a, b] = open[e].map(&position);
                    ([a, b, apex], times[e])
                }));
            }
            cone
        });
        let edges = open.iter().zip(times).map(|(e, times)| (e.map(&position), f64::from(times))).collect();
        Self { faces: WindingNumber::of_triangles(triangles), bounds, area, edges, cones }
    }

    /// Whether the mesh is closed, so that the number is an integer everywhere.
    pub fn is_closed(&self) -> bool {
        self.edges.is_empty()
    }

    /// Largest number of solid angles that [`at`](Self::at) computes.
    pub(crate) fn angles_per_point(&self) -> usize {
        self.cones.iter().map(Vec::len).sum()
    }

    /// Triangles that close the mesh. Their first two corners are an open edge. The third one, an
    /// apex, lies aside of the means of the edges, in which the mesh may be symmetric. A triangle
    /// that is needed several times is repeated.
    pub fn closing(&self) -> Vec<[DVec3; 3]> {
        let repeated = |&(triangle, times): &_| std::iter::repeat_n(triangle, times as usize);
        self.cones[1].iter().flat_map(repeated).collect()
    }

    /// The winding number of the faces, which is that of the mesh where it is closed.
    pub fn into_faces(self) -> WindingNumber {
        self.faces
    }

    /// The generalised winding number at `x + (e, e^2, e^3)` with an infinitesimal `e > 0`. It is 0
    /// for NaN.
    pub fn at(&self, x: DVec3) -> Generalized {
        if !x.is_finite() {
            return Generalized { value: 0.0, error: 0.0 };
        }
        let mut best = Generalized { value: 0.0, error: f64::INFINITY };
        // The crossings of the faces depend on the segment only, not on the cone.
        let crossings = self.faces.at_perturbed(x);
        let far = self.bounds.contains(x).then(|| self.faces.far_point(x));
        for cone in &self.cones {
            let mut integer = crossings;
            let (mut angles, mut roundings, mut worst) = (0.0, 1.0, 1.0f64);
            for &(triangle, times) in cone {
                if let Some(far) = far {
                    integer -= times * signed_crossing(far, x, triangle);
                }
                let (angle, condition) = solid_angle(triangle, x);
                let times = f64::from(times);
                angles += times * angle;
                // The rounding of the sum is that of a number up to all angles so far.
                roundings += times / condition + angles.abs();
                worst = worst.min(condition);
            }
            let error = ROUNDING * roundings;
            if error < best.error || !best.error.is_finite() {
                best = Generalized { value: f64::from(integer) - angles / (4.0 * PI), error };
            }
            if worst > GOOD {
                break;
            }
        }
        best
    }

    /// Whether the number at `x` is at least 1/2 or at most -1/2. Nearer to 1/2 than the rounding
    /// error, the answer is the same for the same point, and may be either.
    pub fn is_inside(&self, x: DVec3) -> bool {
        // The solid angle of a face seen from the distance `d` is at most its area / d².
        let squared = self.bounds.distance_squared(x);
        if self.area < 0.9 * 2.0 * PI * squared {
            return false;
        }
        self.at(x).value.abs() >= 0.5
    }

    /// The number within `radius` of `x`, at points that can be reached straight from `x` without
    /// passing through a face. `None` where an open edge comes as near.
    ///
    /// The gradient is a sum over the open edges (Biot and Savart). Of second order, an edge adds
    /// at most the integral of `dl / r³` times the squared radius.
    pub fn near(&self, x: DVec3, radius: f64) -> Option<NearWinding> {
        let Generalized { value, error } = self.at(x);
        let (mut gradient, mut bend) = (DVec3::ZERO, 0.0);
        for &([a, b], times) in &self.edges {
            let (along, from, to) = (b - a, x - a, x - b);
            let apart = apart_from_edge(x, [a, b]);
            if apart <= radius {
                return None;
            }
            let (around, lengths, dot) = (along.cross(from), from.length() * to.length(), from.dot(to));
            // 1 / (lengths + dot), of which the sum has no digits beside the edge.
            let over = match dot < 0.0 {
                true => (lengths - dot) / around.length_squared(),
                false => 1.0 / (lengths + dot),
            };
            gradient -= times * around * ((from.length() + to.length()) / lengths * over);
            // Points of the edge at the way s from the nearest one are at least √(s² + apart²)
            // away.
            let of_edge = (along.length() / apart).min(2.0) / (apart * apart);
            bend += times * of_edge / elementary::powi(1.0 - radius / apart, 3);
        }
        let error = 1.000_001 * radius * radius * bend / (4.0 * PI) + error + DECIDED;
        let is_known = error.is_finite() && gradient.is_finite();
        is_known.then_some(NearWinding { value, gradient: gradient / (4.0 * PI), error })
    }

    /// Whether all points within `radius` of `x` are certainly outside. No face may come as near.
    pub fn is_outside_within(&self, x: DVec3, radius: f64) -> bool {
        let apart = self.bounds.distance_squared(x).sqrt() - radius;
        apart > self.reach_beyond() || self.side_within(x, radius) == Some(false)
    }

    /// Points that are farther than this from the bounds of the faces are outside: the solid angle
    /// of a face seen from the distance `d` is at most its area / d².
    pub fn reach_beyond(&self) -> f64 {
        (self.area / (0.9 * 2.0 * PI)).sqrt()
    }

    /// The side of all points within `radius` of `x`; `None` when it is not certain that they are
    /// on one side. No face may come within `radius` of `x`.
    ///
    /// The gradient of the solid angle of a loop is at most the integral of `dl / r²` along the
    /// loop (Biot and Savart).
    pub fn side_within(&self, x: DVec3, radius: f64) -> Option<bool> {
        let Generalized { value, error } = self.at(x);
        let mut change = 0.0;
        for &([a, b], times) in &self.edges {
            let apart = apart_from_edge(x, [a, b]) - radius;
            if apart <= 0.0 {
                return None;
            }
            change += times * (b - a).length() / (apart * apart);
        }
        let change = 1.000_001 * radius * change / (4.0 * PI) + error + DECIDED;
        let beyond = value.abs() - 0.5;
        (beyond.abs() > change).then_some(beyond > 0.0)
    }
}

/// Bound of the rounding of a solid angle with the condition 1: a dozen roundings of a 64-bit
/// float, divided by 4 pi, and a factor for safety.
const ROUNDING: f64 = 4e-15;
/// A cell is on one side only where the number differs from 1/2 by more than this.
const DECIDED: f64 = 1e-9;

/// The distance of a point from an edge, less the rounding of one that is more than 1e-4 of the
/// coordinates.
fn apart_from_edge(x: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let along = b - a;
    let t = ((x - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (a + t * along).distance(x) * (1.0 - 1e-12)
}

/// The solid angle of a triangle from `x + (e, e^2, e^3)` (Van Oosterom and Strackee 1983):
/// positive where the point is behind the triangle. Also its condition, 0 to 1: the error is some
/// roundings divided by the condition.
fn solid_angle(triangle: [DVec3; 3], x: DVec3) -> (f64, f64) {
    // Triangles without area have no solid angle.
    let side = perturbed_orientation(triangle, x);
    if side == 0 {
        return (0.0, 1.0);
    }
    let [a, b, c] = triangle.map(|v| v - x);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let sine = a.dot(b.cross(c)).abs();
    let cosine = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    let condition = elementary::hypot(sine, cosine) / (la * lb * lc);
    if condition.is_nan() {
        return (0.0, 0.0);
    }
    (f64::from(side) * 2.0 * elementary::atan2(sine, cosine), condition.min(1.0))
}

/// A point moved towards the bounds, so that it stays within them.
fn moved(p: DVec3, bounds: Aabb, share: [f64; 3]) -> DVec3 {
    let along = |k: usize| {
        let to = if share[k] > 0.0 { bounds.max[k] } else { bounds.min[k] };
        (p[k] + share[k].abs() * (to - p[k])).clamp(bounds.min[k], bounds.max[k])
    };
    DVec3::new(along(0), along(1), along(2))
}

/// The connected parts of a chain of edges, as the numbers of their edges. Parts are ordered by
/// their first edge.
fn connected(edges: &[[u32; 2]]) -> Vec<Vec<usize>> {
    let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (e, ends) in edges.iter().enumerate() {
        ends.iter().for_each(|&v| at.entry(v).or_default().push(e));
    }
    let mut seen = vec![false; edges.len()];
    let mut parts = Vec::new();
    for first in 0..edges.len() {
        if seen[first] {
            continue;
        }
        seen[first] = true;
        let mut part = vec![first];
        let mut next = 0;
        while next < part.len() {
            for v in edges[part[next]] {
                // Each vertex is looked at once.
                for e in at.remove(&v).unwrap_or_default() {
                    if !seen[e] {
                        seen[e] = true;
                        part.push(e);
                    }
                }
            }
            next += 1;
        }
        part.sort_unstable();
        parts.push(part);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{exact, random};

    const POINTS: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    const CORNER: [[u32; 3]; 3] = [[0, 2, 1], [0, 1, 3], [2, 0, 3]];

    /// Three of the faces of a tetrahedron, at such places.
    fn corner(at: impl Fn(DVec3) -> DVec3) -> GeneralizedWinding {
        GeneralizedWinding::new(&CORNER, |v| at(POINTS[v as usize]))
    }

    /// The sum of the solid angles of all faces / 4 pi.
    fn by_angles(faces: &[[u32; 3]], vertices: &[DVec3], x: DVec3) -> f64 {
        let angle = |f: &[u32; 3]| solid_angle(f.map(|v| vertices[v as usize]), x).0;
        faces.iter().map(angle).sum::<f64>() / (4.0 * PI)
    }

    fn assert_equal(faces: &[[u32; 3]], vertices: &[DVec3], x: DVec3) {
        // On an edge the angle of a face has no value.
        let edges = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let beside = |ends: [u32; 2]| {
            let [a, b] = ends.map(|v| vertices[v as usize]);
            let t = ((x - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            (a + t * (b - a)).distance(x)
        };
        if edges.map(beside).fold(f64::INFINITY, f64::min) < 1e-12 {
            return;
        }
        let winding = GeneralizedWinding::new(faces, |v| vertices[v as usize]);
        let (found, expected) = (winding.at(x), by_angles(faces, vertices, x));
        let Generalized { value, error } = found;
        assert!((value - expected).abs() <= 1e-12 + 2.0 * error.min(1.0), "{x}: {found:?} {expected}");
    }

    /// Bowls, strips, soups, edges of many faces, by points near and far, in planes of faces and of
    /// closing triangles.
    #[test]
    fn the_number_is_the_sum_of_all_solid_angles() {
        let meshes: [&[[u32; 3]]; 7] = [
            &[[0, 1, 2]],
            &[[0, 1, 2], [0, 2, 3]],
            &[[0, 1, 2], [0, 1, 3], [0, 1, 4]],
            &[[0, 1, 2], [3, 4, 5]],
            &[[0, 1, 2], [0, 1, 2], [2, 1, 3], [5, 0, 3]],
            &[[0, 1, 2], [0, 1, 2], [0, 1, 2], [1, 0, 4], [0, 3, 4]],
            &[[0, 2, 1], [0, 1, 3], [1, 2, 3]],
        ];
        let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        let vertices: Vec<DVec3> = (0..6).map(corner).collect();
        for faces in meshes {
            for k in 0..343 {
                let lattice = DVec3::new(f64::from(k % 7), f64::from(k / 7 % 7), f64::from(k / 49));
                let x = 0.25 * lattice - 0.25;
                for x in [x, x + 1e-5 * DVec3::ONE, x + DVec3::new(0.013, -0.0171, 0.0093)] {
                    assert_equal(faces, &vertices, x);
                }
            }
        }
    }

    /// No point of a ball is on another side than the ball.
    #[test]
    fn balls_with_a_side_are_on_it() {
        let winding = corner(|p| p);
        let (mut decided, mut open) = ([0, 0], 0);
        for k in 0..1000 {
            let lattice = DVec3::new(f64::from(k % 10), f64::from(k / 10 % 10), f64::from(k / 100));
            let center = 0.13 * lattice + 0.031;
            // No face comes nearer: they lie in the planes of the axes.
            let radius = 0.5 * center.min_element();
            match winding.side_within(center, radius) {
                None => open += 1,
                Some(inside) => {
                    decided[usize::from(inside)] += 1;
                    for j in 0..8 {
                        let corner = DVec3::new(f64::from(j & 1), f64::from(j >> 1 & 1), f64::from(j >> 2));
                        let p = center + radius * (2.0 * corner - 1.0) / 3f64.sqrt();
                        assert_eq!(winding.is_inside(p), inside, "{center} {radius} {p}");
                        assert_eq!(by_angles(&CORNER, &POINTS, p).abs() >= 0.5, inside, "{p}");
                    }
                }
            }
        }
        assert!(decided.iter().all(|&n| n > 5) && open > 5, "{decided:?} {open}");
    }

    /// Within a ball that no face comes near, the number is the linear function up to its error,
    /// and the error shrinks with the square of the radius.
    #[test]
    fn the_number_near_a_point_is_linear() {
        let winding = corner(|p| p);
        let mut known = 0;
        for k in 0..1000 {
            let lattice = DVec3::new(f64::from(k % 10), f64::from(k / 10 % 10), f64::from(k / 100));
            let center = 0.13 * lattice + 0.031;
            let radius = 0.4 * center.min_element();
            let Some(near) = winding.near(center, radius) else { continue };
            known += 1;
            for j in 0..8 {
                let corner = DVec3::new(f64::from(j & 1), f64::from(j >> 1 & 1), f64::from(j >> 2));
                let way = radius * (2.0 * corner - 1.0) / 3f64.sqrt();
                let error = by_angles(&CORNER, &POINTS, center + way) - near.value - near.gradient.dot(way);
                assert!(error.abs() <= near.error, "{center}: {error:e} {:e}", near.error);
                let fine = 1e-3 * way;
                let moved = by_angles(&CORNER, &POINTS, center + fine) - near.value;
                let slope = near.gradient.dot(fine);
                assert!((moved - slope).abs() <= 1e-6 * near.error + 1e-13, "{center}: {moved:e} {slope:e}");
            }
        }
        assert!(known > 500, "{known}");
    }

    /// The time of a query follows the edges, not how often faces repeat them.
    #[test]
    fn faces_that_coincide_close_with_one_triangle_for_each_edge() {
        let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let winding = GeneralizedWinding::new(&[[0, 1, 2]; 100_000], |v| vertices[v as usize]);
        assert_eq!((winding.angles_per_point(), winding.closing().len()), (12, 300_000));
        let (found, one) =
            (winding.at(DVec3::ONE), GeneralizedWinding::new(&[[0, 1, 2]], |v| vertices[v as usize]));
        assert!((found.value - 1e5 * one.at(DVec3::ONE).value).abs() <= found.error, "{found:?}");
        assert!(found.error < 1e-8, "{found:?}");
    }

    #[test]
    fn the_number_of_a_triangle_beside_its_edge() {
        let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y];
        for faces in [&[[0, 1, 2]][..], &[[0, 1, 2], [0, 1, 2]], &[[0, 1, 2], [0, 0, 1]]] {
            for x in [
                DVec3::new(0.78, 2.7e-10, -8.6e-10),
                DVec3::new(0.3, -1e-9, 1e-9),
                DVec3::new(0.2, 0.2, -1e-7),
            ] {
                assert_equal(faces, &vertices, x);
            }
        }
    }

    #[test]
    fn nothing_is_certain_on_an_open_edge() {
        let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let winding = GeneralizedWinding::new(&[[0, 1, 2]], |v| vertices[v as usize]);
        assert_eq!(winding.at(DVec3::NAN), Generalized { value: 0.0, error: 0.0 });
        for x in vertices {
            assert_eq!(winding.at(x).error, f64::INFINITY, "{x}");
        }
        let beside = DVec3::new(0.5, -0.1, 0.0);
        assert!(winding.near(beside, 0.09).is_some() && winding.near(beside, 0.11).is_none());
        assert_eq!(
            (winding.side_within(beside, 0.02), winding.side_within(beside, 0.11)),
            (Some(false), None)
        );
        assert!(winding.is_outside_within(beside, 0.02) && !winding.is_outside_within(beside, 0.11));
        assert_eq!(winding.near(DVec3::new(0.5, -1e-200, 0.0), 0.0), None, "its gradient is infinite");
    }

    /// That of a wire, 1 / (2 pi times the distance).
    #[test]
    fn the_gradient_beside_an_edge_keeps_its_digits() {
        let vertices = [DVec3::NEG_X, DVec3::X, DVec3::Y];
        let winding = GeneralizedWinding::new(&[[0, 1, 2]], |v| vertices[v as usize]);
        for k in 1..=100 {
            let apart = elementary::powi(0.8, k);
            for along in [0.0, 0.1, -0.7] {
                for side in [DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
                    let x = along * DVec3::X + apart * side;
                    let gradient = winding.near(x, 0.0).unwrap().gradient;
                    let off = (2.0 * PI * apart * gradient.length() - 1.0).abs();
                    assert!(off <= 8.0 * apart + 1e-14, "{x}: {off:e}");
                }
            }
        }
    }

    /// A face that is repeated looks like a large area from far above.
    #[test]
    fn far_points_are_outside_where_the_area_is_small() {
        let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y];
        for size in [1e-3, 1.0, 1e3] {
            let repeated = |n| GeneralizedWinding::new(&vec![[0, 1, 2]; n], |v| size * vertices[v as usize]);
            let (small, large) = (repeated(1200), repeated(1400));
            let above = |height: f64| size * DVec3::new(0.3, 0.3, height);
            // The number is about the area / (4 pi height²), which is 0.48 and 0.56.
            assert_eq!((small.is_inside(above(10.0)), large.is_inside(above(10.0))), (false, true), "{size}");
            let least = size * (700.0 / (2.0 * PI)).sqrt();
            assert!((1.0..1.1).contains(&(large.reach_beyond() / least)), "{size}");
            // A ball that reaches points inside, at the height of 10.5.
            let is_outside = |radius: f64| large.is_outside_within(above(15.0), size * radius);
            assert_eq!([0.5, 1.0, 3.0, 5.0].map(is_outside), [true, true, true, false], "{size}");
        }
    }

    /// Beside a long edge the number is an angle, whose second order is half of the bound.
    #[test]
    fn the_error_beside_an_edge_is_a_bound_and_not_a_wide_one() {
        let (faces, vertices) = ([[0, 1, 2]], [DVec3::NEG_X, DVec3::X, DVec3::Y]);
        let winding = GeneralizedWinding::new(&faces, |v| vertices[v as usize]);
        let (apart, center) = (1e-2, DVec3::new(0.1, -1e-2, 0.0));
        for (part, wide) in [(0.02, 2.5), (0.5, 14.0), (0.99, f64::INFINITY)] {
            let near = winding.near(center, part * apart).unwrap();
            let error = |k: i32| {
                let (s, c) = (f64::from(k) * PI / 360.0).sin_cos();
                let way = part * apart * DVec3::new(0.0, c, s);
                (by_angles(&faces, &vertices, center + way) - near.value - near.gradient.dot(way)).abs()
            };
            let ratio = near.error / (0..720).map(error).fold(0.0, f64::max);
            assert!((1.0..wide).contains(&ratio), "{part}: {ratio}");
        }
        for beside in [1e-2, 1e-7].map(|apart| DVec3::new(0.1, -apart, 0.0)) {
            assert!(winding.near(beside, 0.0).unwrap().error >= winding.at(beside).error, "{beside}");
        }
    }

    #[test]
    fn the_number_depends_on_neither_the_unit_of_length_nor_the_origin() {
        let one = corner(|p| p);
        for (unit, at) in [(2f64.powi(-30), 0.0), (2f64.powi(30), 0.0), (1.0, 8.0)] {
            let other = corner(|p| unit * p + at);
            for k in 0..216 {
                let lattice = DVec3::new(f64::from(k % 6), f64::from(k / 6 % 6), f64::from(k / 36));
                let (center, radius) = (0.23 * lattice + 0.031, 0.03);
                let (there, there_radius) = (unit * center + at, unit * radius);
                assert_eq!(
                    other.side_within(there, there_radius),
                    one.side_within(center, radius),
                    "{there}"
                );
                let (near, found) = (one.near(center, radius), other.near(there, there_radius));
                assert_eq!(near.is_some(), found.is_some(), "{there}");
                for (near, found) in near.into_iter().zip(found) {
                    assert!(near.gradient.distance(unit * found.gradient) < 1e-9, "{there}");
                    assert!((near.value - found.value).abs() < 1e-12, "{there}");
                    assert!((near.error / found.error - 1.0).abs() < 1e-6, "{there}");
                }
            }
        }
    }

    /// The bound is that of the best of all closings, or of a good one.
    #[test]
    fn the_best_closing_is_taken() {
        let winding = corner(|p| p);
        let corners =
            winding.cones.iter().flatten().flat_map(|&([a, b, apex], _)| {
                [apex, 0.5 * (a + apex), 0.4 * a + 0.6 * b, (a + b + apex) / 3.0]
            });
        let mut bad = 0;
        for x in corners.flat_map(|p| [1e-1, 1e-3, 1e-5, 1e-7].map(|d| p + d * DVec3::new(0.3, 0.5, -0.2))) {
            let alone = |cone: &Vec<_>| {
                let cones = [(); APEXES].map(|()| cone.clone());
                GeneralizedWinding { cones, ..winding.clone() }.at(x)
            };
            let least = winding.cones.iter().map(|cone| alone(cone).error).fold(f64::INFINITY, f64::min);
            // Of three triangles with the condition 1/100.
            let good = ROUNDING * (1.0 + 3.0 * 100.0 + 6.0 * 2.0 * PI);
            let found = winding.at(x);
            assert!((ROUNDING..=least.max(good)).contains(&found.error), "{x}: {found:?} {least:e}");
            assert!((found.value - by_angles(&CORNER, &POINTS, x)).abs() <= 2.0 * found.error, "{x}");
            bad += usize::from(least > good);
        }
        assert!(bad > 10, "{bad}");
    }

    /// In the opening of a cone the gradient is the bound. In its plane the number is 1/2.
    #[test]
    fn the_side_in_an_opening_is_known_up_to_the_plane() {
        let rim =
            |k: u32| DVec3::new((f64::from(k) * PI / 12.0).cos(), (f64::from(k) * PI / 12.0).sin(), 0.0);
        let faces: Vec<[u32; 3]> = (0..24).map(|k| [(k + 1) % 24, k, 24]).collect();
        let winding = GeneralizedWinding::new(&faces, |v| if v < 24 { rim(v) } else { DVec3::NEG_Z });
        for (height, inside) in [(-0.1, true), (0.1, false)] {
            let side = |radius| winding.side_within(DVec3::Z * height, radius);
            assert_eq!([0.0, 0.08, 0.101].map(side), [Some(inside), Some(inside), None], "{height}");
        }
        // In the plane, at a point and beside an edge, where the number rounds badly.
        let of_corner = corner(|p| p);
        for (x, step) in [
            (DVec3::new(0.25, 0.25, 0.5), 1e-5),
            (DVec3::new(0.5, 0.5 - 1e-7, 1e-7), 1e-8),
            (DVec3::new(0.3 - 1e-8, 1e-8, 0.7), 1e-9),
        ] {
            let side = |height: f64| of_corner.side_within(x + height * DVec3::ONE, 0.0);
            assert_eq!([-step, 0.0, step].map(side), [Some(true), None, Some(false)], "{x}");
        }
    }

    #[test]
    fn distances_of_edges_are_lower_bounds() {
        let mut state = 3;
        let mut point = || DVec3::from_array([0; 3].map(|_| random(&mut state)));
        for k in 0..600 {
            let a = point();
            let b = if k % 50 == 0 { a } else { point() };
            let x = a + (1.5 * point().x - 0.25) * (b - a) + 10f64.powi(-k % 3) * point();
            let (found, squared) = (apart_from_edge(x, [a, b]), exact::squared_distance(x, [a, b, b]));
            assert!(found < 1e-3 || exact::is_between(found, &squared, found * (1.0 + 3e-12)), "{x} {a} {b}");
        }
    }

    #[test]
    fn apexes_move_by_their_shares() {
        let bounds = Aabb { min: DVec3::ZERO, max: DVec3::splat(8.0) };
        let (p, share) = (DVec3::new(2.0, 4.0, 5.0), [0.5, -0.25, 0.0]);
        assert_eq!(moved(p, bounds, share), DVec3::new(5.0, 3.0, 5.0));
    }

    #[test]
    fn closed_meshes_have_a_whole_number() {
        let faces = [CORNER[0], CORNER[1], CORNER[2], [1, 2, 3]];
        let closed = GeneralizedWinding::new(&faces, |v| POINTS[v as usize]);
        assert!(closed.is_closed() && !corner(|p| p).is_closed());
        assert_eq!((closed.angles_per_point(), closed.closing().len()), (0, 0));
        for (x, inside) in [(DVec3::splat(0.1), true), (DVec3::splat(0.4), false), (DVec3::NEG_X, false)] {
            assert_eq!((closed.at(x).value, closed.is_inside(x)), (f64::from(inside), inside), "{x}");
        }
    }
}
