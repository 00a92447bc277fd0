use glam::DVec3;

use super::is_flat;

/// A feature of a triangle: its interior, an edge or a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// The triangle itself.
    Face,
    /// Edge `k`, from corner `k` to corner `k + 1` (mod 3).
    Edge(u8),
    /// Corner `k`.
    Vertex(u8),
}

/// A set of features whose closed regions contain a point. Bit 0 is the face, bits 1–3 are the
/// edges, bits 4–6 the corners.
///
/// The region of a feature is the set of points whose closest point of the triangle lies on the
/// feature. Each region is convex: a prism for the face, a wedge for an edge, a cone for a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Regions(pub u8);

impl Regions {
    /// Only the face. Used for triangles without area, whose features are not distinguished.
    pub const FACE: Self = Self(1);

    /// The regions that contain both points. As regions are convex, they also contain the segment
    /// between the points.
    pub fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// The lowest-dimensional feature: a corner if the set has one, else an edge, else `Face`.
    pub fn least(self) -> Feature {
        match (self.0 >> 4, (self.0 >> 1) & 7) {
            (0, 0) => Feature::Face,
            (0, edges) => Feature::Edge(edges.trailing_zeros() as u8),
            (corners, _) => Feature::Vertex(corners.trailing_zeros() as u8),
        }
    }
}

/// The point of a triangle that is closest to a query point.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    /// Distance from the query point.
    pub distance: f64,
    /// The closest point.
    pub point: DVec3,
    /// The feature on which the closest point lies.
    pub feature: Feature,
}

/// A triangle with its unit normal, ready for distance queries.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Corner positions.
    pub corners: [DVec3; 3],
    /// Unit normal by the right-hand rule. Zero when the triangle has no area within rounding.
    pub normal: DVec3,
    /// Whether the triangle is so narrow that deciding the side of an edge needs care. True when
    /// this is not known.
    is_needle: bool,
}

/// Below this sine of the angle at the first corner, the normal is computed with twice the digits.
/// Above it, heights have an error of at most 1e-16 / 1e-3 of the triangle's size.
const NEEDLE: f64 = 1e-3;

/// Up to this height, relative to the longest edge, the sides are tested again from their nearer
/// ends.
const TIP: f64 = 0.1;

/// Up to this height, relative to the longest edge, a triangle counts as its edges: rounding would
/// decide on which side of them a point is.
const FLAT: f64 = 16.0 * f64::EPSILON;

/// `(b - a) × (c - a)`. Products and differences are exact pairs; only the last sums are rounded.
fn cross_of_differences(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let (u, v) = ([0, 1, 2].map(|k| difference(b[k], a[k])), [0, 1, 2].map(|k| difference(c[k], a[k])));
    DVec3::from_array([(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
        let (first, second) = (product(u[i].0, v[j].0), product(u[j].0, v[i].0));
        let small = u[i].0 * v[j].1 + u[i].1 * v[j].0 - (u[j].0 * v[i].1 + u[j].1 * v[i].0);
        let leading = difference(first.0, second.0);
        leading.0 + (leading.1 + (first.1 - second.1) + small)
    }))
}

/// `x - y` as a rounded difference and its error (Knuth).
fn difference(x: f64, y: f64) -> (f64, f64) {
    let d = x - y;
    let t = d - x;
    (d, (x - (d - t)) - (y + t))
}

/// `x y` as a rounded product and its error.
fn product(x: f64, y: f64) -> (f64, f64) {
    let p = x * y;
    (p, x.mul_add(y, -p))
}

impl Triangle {
    /// Creates the triangle and computes its normal.
    pub fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let (u, v) = (b - a, c - a);
        let mut normal = u.cross(v);
        // The cross product has an error of some ulps of |u| |v| in any direction. For a needle
        // this error would dominate: the normal would not even be perpendicular, and heights over
        // its plane would be wrong by as much as the needle's length.
        if normal.length_squared() < NEEDLE * NEEDLE * u.length_squared() * v.length_squared() {
            normal = cross_of_differences(a, b, c);
        }
        let longest = [v, v - u]
            .into_iter()
            .fold(u, |l, e| if e.length_squared() > l.length_squared() { e } else { l });
        let longest_squared = longest.length_squared();
        // A remaining component along the longest edge would be multiplied by that edge's length in
        // heights over the plane.
        normal -= longest * (normal.dot(longest) / longest_squared.max(f64::MIN_POSITIVE));
        let (twice_area, longest) = (normal.length(), longest_squared.sqrt());
        let flat = is_flat(twice_area, longest, FLAT * longest);
        let is_needle = is_flat(twice_area, longest, TIP * longest);
        let normal = if flat { DVec3::ZERO } else { normal.try_normalize().unwrap_or(DVec3::ZERO) };
        Self { corners, normal, is_needle }
    }

    /// Creates a triangle whose normal is already known.
    #[inline]
    pub fn with_normal(corners: [DVec3; 3], normal: DVec3) -> Self {
        Self { corners, normal, is_needle: true }
    }

    /// The triangle that [`new`](Self::new) gives for these corners, from its normal and
    /// [`is_needle`](Self::is_needle).
    #[inline]
    pub(crate) fn from_parts(corners: [DVec3; 3], normal: DVec3, is_needle: bool) -> Self {
        Self { corners, normal, is_needle }
    }

    /// Whether the triangle is so narrow that [`closest`](Self::closest) tests its sides twice.
    pub(crate) fn is_needle(&self) -> bool {
        self.is_needle
    }

    /// The point of the triangle closest to `p`.
    ///
    /// Inside the prism over the face, the distance is that to the plane. Elsewhere it is the least
    /// distance to the three edges. Both are accurate to a few ulp, also for slivers: the prism is
    /// decided by distances to its sides, never by a quotient of areas. A needle of aspect 1e7
    /// would lose seven digits there.
    #[inline]
    pub fn closest(&self, p: DVec3) -> Closest {
        self.closest_seen(p, &Relative::new(self, p))
    }

    /// [`closest`](Self::closest) and [`regions`](Self::regions) of the same point.
    #[inline]
    pub(crate) fn closest_and_regions(&self, p: DVec3) -> (Closest, Regions) {
        let relative = Relative::new(self, p);
        (self.closest_seen(p, &relative), self.regions_seen(&relative))
    }

    #[inline]
    fn closest_seen(&self, p: DVec3, relative: &Relative) -> Closest {
        if relative.over_face {
            return self.closest_in_plane(p);
        }
        // Squares are compared, so that there is one root.
        let mut nearest = self.on_edge(0, relative.start(0), relative.end(0));
        let mut least = p.distance_squared(nearest.0);
        for k in 1..3 {
            let edge = self.on_edge(k, relative.start(k), relative.end(k));
            let squared = p.distance_squared(edge.0);
            if squared < least {
                (nearest, least) = (edge, squared);
            }
        }
        Closest { distance: least.sqrt(), point: nearest.0, feature: nearest.1 }
    }

    /// The point of the triangle's plane closest to `p`.
    #[inline]
    pub fn closest_in_plane(&self, p: DVec3) -> Closest {
        let height = self.normal.dot(p - self.corners[0]);
        Closest { distance: height.abs(), point: p - height * self.normal, feature: Feature::Face }
    }

    /// The point of edge `k` closest to `p`.
    #[inline]
    pub fn closest_on_edge(&self, k: usize, p: DVec3) -> Closest {
        let next = (k + 1) % 3;
        let along = self.corners[next] - self.corners[k];
        let (start, end) = (along.dot(p - self.corners[k]), along.dot(p - self.corners[next]));
        let (point, feature) = self.on_edge(k, start, end);
        Closest { distance: p.distance(point), point, feature }
    }

    /// The point of edge `k` that is closest to a point whose positions along the edge from its
    /// start and from its end are known, and its feature.
    #[inline]
    fn on_edge(&self, k: usize, start: f64, end: f64) -> (DVec3, Feature) {
        let next = (k + 1) % 3;
        if start <= 0.0 {
            (self.corners[k], Feature::Vertex(k as u8))
        } else if end >= 0.0 {
            (self.corners[next], Feature::Vertex(next as u8))
        } else {
            let along = self.corners[next] - self.corners[k];
            (self.corners[k] + start / (start - end) * along, Feature::Edge(k as u8))
        }
    }

    /// The features whose closed regions contain `p`.
    #[doc(hidden)]
    #[inline]
    pub fn regions(&self, p: DVec3) -> Regions {
        self.regions_seen(&Relative::new(self, p))
    }

    #[inline]
    fn regions_seen(&self, relative: &Relative) -> Regions {
        if self.normal == DVec3::ZERO {
            return Regions::FACE;
        }
        let (start, end) = ([0, 1, 2].map(|k| relative.start(k)), [0, 1, 2].map(|k| relative.end(k)));
        let mut regions = u8::from(relative.over_face);
        for k in 0..3 {
            regions |= u8::from(relative.side[k] <= 0.0 && start[k] >= 0.0 && end[k] <= 0.0) << (1 + k);
            regions |= u8::from(start[k] <= 0.0 && end[(k + 2) % 3] >= 0.0) << (4 + k);
        }
        // Rounding gives different sides of an edge from its two ends.
        if regions == 0 { Regions::FACE } else { Regions(regions) }
    }
}

/// The position of a point relative to a triangle.
struct Relative {
    /// Vectors from each corner to the point.
    from: [DVec3; 3],
    /// Vectors from each corner to the next.
    along: [DVec3; 3],
    /// In-plane distance from each edge times the edge's length. Positive on the face's side.
    side: [f64; 3],
    /// Whether the point is inside the prism over the face.
    over_face: bool,
}

impl Relative {
    #[inline]
    fn new(triangle: &Triangle, p: DVec3) -> Self {
        let [a, b, c] = triangle.corners;
        let from = [p - a, p - b, p - c];
        let along = [b - a, c - b, a - c];
        let turned = from[0].cross(triangle.normal);
        let turned_b = from[1].cross(triangle.normal);
        let side = [along[0].dot(turned), along[1].dot(turned_b), along[2].dot(turned)];
        let inside = side[0] >= 0.0 && side[1] >= 0.0 && side[2] >= 0.0 && triangle.normal != DVec3::ZERO;
        let over_face =
            inside && (!triangle.is_needle || seen_from_nearer_ends(&from, &along, triangle.normal));
        Self { from, along, side, over_face }
    }

    /// Position of the point along edge `k` from its start; negative before the start.
    #[inline]
    fn start(&self, k: usize) -> f64 {
        self.along[k].dot(self.from[k])
    }

    /// Position of the point along edge `k` from its end; positive beyond the end.
    #[inline]
    fn end(&self, k: usize) -> f64 {
        self.along[k].dot(self.from[(k + 1) % 3])
    }
}

/// Tests the sides from the nearer end of each edge. Beyond the tip of a needle, only rounding
/// decides the sides as seen from the other end.
#[cold]
fn seen_from_nearer_ends(from: &[DVec3; 3], along: &[DVec3; 3], normal: DVec3) -> bool {
    (0..3).all(|k| {
        let next = (k + 1) % 3;
        let nearer = if from[k].length_squared() <= from[next].length_squared() { k } else { next };
        along[k].dot(from[nearer].cross(normal)) >= 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{degenerate, exact, random};
    use proptest::prelude::*;

    /// Largest accepted error of a distance, for coordinates up to 2. A face that counts as its
    /// edges has an error of 1.8e-15 (half of 16 ε) times its length of up to 3.5.
    const ROUNDING: f64 = 8e-15;

    fn point() -> impl Strategy<Value = DVec3> {
        // A coarse lattice, so that ties and degenerate triangles are common.
        (-3i32..4, -3i32..4, -3i32..4).prop_map(|(x, y, z)| DVec3::new(x as f64, y as f64, z as f64))
    }

    #[test]
    fn rounding_leaves_no_point_without_a_region() {
        let a = DVec3::new(0.5, -2.4999999999999997e-34, 0.0);
        let (b, c) = (DVec3::new(0.75, 1e-19, 5e-36), DVec3::new(-0.5, -0.25, -2.5e-19));
        assert_ne!(Triangle::new([a, b, c]).regions(DVec3::new(0.0, -0.15, -0.9)).0, 0);
        assert_eq!(Triangle::new([a, b, b]).regions(DVec3::ONE), Regions::FACE, "of a face without area");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::rotation::cases(4000)))]
        #[test]
        fn degenerate_faces_are_exact((corners, p) in degenerate::face_and_point()) {
            let triangle = Triangle::new(corners);
            let found = triangle.closest(p);
            let squared = exact::squared_distance(p, corners);
            prop_assert!(exact::is_root(found.distance, &squared, ROUNDING), "{found:?} {triangle:?}");
            prop_assert!((p.distance(found.point) - found.distance).abs() <= ROUNDING, "{found:?}");
            let to_face = exact::squared_distance(found.point, corners);
            prop_assert!(exact::is_root(0.0, &to_face, ROUNDING), "{found:?} is off the face");
            prop_assert!(triangle.normal == DVec3::ZERO || (triangle.normal.length() - 1.0).abs() < 1e-15);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::rotation::cases(20_000)))]
        #[test]
        fn points_beyond_a_tip_are_exact((corners, p) in degenerate::beyond_a_tip()) {
            let found = Triangle::new(corners).closest(p);
            let squared = exact::squared_distance(p, corners);
            prop_assert!(exact::is_root(found.distance, &squared, 2e-15), "{found:?} {:?}", corners);
        }
    }

    proptest! {
        #[test]
        fn regions_are_those_of_the_closest_features(a in point(), b in point(), c in point(), p in point()) {
            let (u, v) = (b - a, c - a);
            prop_assume!(u.cross(v) != DVec3::ZERO);
            let to = |corners: [DVec3; 3]| exact::squared_distance(p, corners);
            let least = to([a, b, c]);
            // The plane and the lines of the edges, as far as it matters.
            let plane = [a - 999.0 * (u + v), a + 2999.0 * u - 999.0 * v, a - 999.0 * u + 2999.0 * v];
            let mut expected = u8::from(to(plane) == least);
            for (k, [from, end]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
                let (edge, way) = (to([from, end, end]), 999.0 * (end - from));
                expected |= u8::from(edge == least && to([from - way, end + way, end]) == edge) << (1 + k);
                expected |= u8::from(to([from; 3]) == least) << (4 + k);
            }
            let found = Triangle::new([a, b, c]).regions(p).0;
            // Beside the prism over the face, rounding decides.
            let either = expected & 1 == 1 && found != 0 && found & !expected == 0;
            prop_assert!(found == expected || either, "{found:b} {expected:b}");
        }

        #[test]
        fn no_sample_of_the_triangle_is_closer(a in point(), b in point(), c in point(), p in point()) {
            let triangle = Triangle::new([a, b, c]);
            let found = triangle.closest(p);
            let mut least = f64::INFINITY;
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let (u, v) = (i as f64 / 60.0, j as f64 / 60.0);
                    least = least.min(p.distance(a + u * (b - a) + v * (c - a)));
                }
            }
            prop_assert!(found.distance <= least + 1e-12);
            prop_assert!((found.point.distance(p) - found.distance).abs() <= 1e-12);
            prop_assert!(least <= found.distance + 0.1);
            prop_assert!(triangle.regions(p).0 != 0);
            for (k, [a, b]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
                let on_edge = triangle.closest_on_edge(k, p);
                prop_assert!(exact::is_root(on_edge.distance, &exact::squared_distance(p, [a, b, b]), 1e-14));
                prop_assert!((on_edge.point.distance(p) - on_edge.distance).abs() <= 1e-14);
            }
        }
    }

    /// Corners are integers of up to 53 bits whose differences round. Their cross product cancels by
    /// half of its digits, and is exact in 128 bits.
    #[test]
    fn cross_products_of_needles_keep_their_digits() {
        let mut state = 9;
        for k in 0..3000 {
            let mut vector = |bits: f64| {
                [0; 3]
                    .map(|_| ((random(&mut state) - 0.5) * 2f64.powf(bits)) as i64 + (state >> 40 & 1) as i64)
            };
            let (a, beside) = (vector(53.98), [vector(f64::from(k % 40)), vector(f64::from(k / 5 % 45))]);
            let [b, c] = beside.map(|beside| [0, 1, 2].map(|i| beside[i] - a[i]));
            let away = |p: [i64; 3]| [0, 1, 2].map(|i| i128::from(p[i]) - i128::from(a[i]));
            let (u, v) = (away(b), away(c));
            let [a, b, c] = [a, b, c].map(|p| DVec3::from_array(p.map(|x| x as f64)));
            let found = cross_of_differences(a, b, c);
            for (i, j, l) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
                let exact = (u[j] * v[l] - u[l] * v[j]) as f64;
                let error = (found[i] - exact).abs();
                assert!(error <= f64::EPSILON * exact.abs() + 64.0, "{a} {b} {c}: {error:e} of {exact:e}");
            }
        }
    }

    #[test]
    fn narrow_triangles_and_those_of_a_given_normal_are_needles() {
        for (height, is_needle) in [(1.0, false), (0.2, false), (0.05, true), (0.0, true)] {
            let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, height, 0.0)];
            let found = Triangle::new(corners);
            let again = Triangle::from_parts(corners, found.normal, found.is_needle());
            assert_eq!((found.is_needle(), again.is_needle()), (is_needle, is_needle), "{height}");
            assert!(Triangle::with_normal(corners, found.normal).is_needle());
        }
    }

    #[test]
    fn sets_of_regions_are_intersected_and_have_a_least_feature() {
        for bits in 1..128u8 {
            let has = |k: u8| bits >> k & 1 == 1;
            let corner = (0..3).find(|&k| has(4 + k)).map(Feature::Vertex);
            let edge = (0..3).find(|&k| has(1 + k)).map(Feature::Edge);
            assert_eq!(Regions(bits).least(), corner.or(edge).unwrap_or(Feature::Face), "{bits}");
            for k in 0..7 {
                assert_eq!(Regions(bits).and(Regions(1 << k)).0 != 0, has(k), "{bits} {k}");
            }
        }
    }
}
