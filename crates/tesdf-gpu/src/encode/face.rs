use tesdf::geometry::Triangle;
use tesdf::glam::DVec3;

use crate::kernels::encode::sampled::{self, Candidate, Entry, FACE_ROWS};
use crate::kernels::geometry::vector::V3;

/// The part of a face's data that does not depend on the cell.
pub struct CandidateFace {
    /// Unit normal; zero for a face that is degenerate to its edges.
    normal: DVec3,
    /// The edges, the longest first.
    edges: [Edge; 3],
}

struct Edge {
    from: DVec3,
    /// Unit direction; zero for an edge of length zero.
    along: DVec3,
    length: f64,
    /// Unit vector in the plane of the face, perpendicular to the edge, toward the inside of the
    /// face.
    inward: DVec3,
}

impl CandidateFace {
    pub fn new(triangle: &Triangle) -> Self {
        let mut edges = [0, 1, 2].map(|k| {
            let [from, to] = [k, (k + 1) % 3].map(|k| triangle.corners[k]);
            let along = (to - from).try_normalize().unwrap_or(DVec3::ZERO);
            Edge { from, along, length: to.distance(from), inward: triangle.normal.cross(along) }
        });
        edges.sort_by(|x, y| y.length.total_cmp(&x.length));
        Self { normal: triangle.normal, edges }
    }

    /// The face as rows for the kernel, relative to `center`. Differences are computed in `f64`
    /// before rounding, so the error in `f32` shrinks with the distance from `center`.
    pub fn rows(&self, center: DVec3) -> [[f32; 4]; FACE_ROWS] {
        let row = |v: DVec3, last: f64| [v.x as f32, v.y as f32, v.z as f32, last as f32];
        let mut rows = [[0.0; 4]; FACE_ROWS];
        let is_flat = self.normal == DVec3::ZERO;
        rows[0] = row(self.normal, self.normal.dot(self.edges[0].from - center));
        for (k, edge) in self.edges.iter().enumerate() {
            let from = edge.from - center;
            // A face without area has no points beside its edges; a height of 1 excludes them.
            let height = if is_flat { 1.0 } else { edge.inward.dot(from) };
            rows[1 + k] = row(edge.inward, height);
            let begin = edge.along.dot(from);
            rows[4 + 2 * k] = row(from - begin * edge.along, begin);
            rows[5 + 2 * k] = row(edge.along, begin + edge.length);
        }
        rows
    }

    /// The face as the kernel reads it, for tests and counts on the host.
    pub fn candidate(&self, center: DVec3) -> Candidate {
        let entry = |[x, y, z, number]: [f32; 4]| Entry { vector: V3 { x, y, z }, number };
        let [plane, side_0, side_1, side_2, begin_0, end_0, begin_1, end_1, begin_2, end_2] =
            self.rows(center).map(entry);
        let [edge_0, edge_1, edge_2] = [(begin_0, end_0), (begin_1, end_1), (begin_2, end_2)]
            .map(|(begin, end)| sampled::Edge { begin, end });
        Candidate { plane, side_0, side_1, side_2, edge_0, edge_1, edge_2 }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::kernels::encode::sampled::ROUNDING;
    use crate::testing::{degenerate, exact};

    /// Generates numbers from −1 to 1.
    struct Random(u64);

    impl Random {
        fn number(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }

        fn point(&mut self) -> DVec3 {
            DVec3::new(self.number(), self.number(), self.number())
        }
    }

    /// Half of the error that is allowed for the difference of two distances, minus the error from
    /// moving the sample.
    const DISTANCE: f64 = 22.0 / 64.0 * ROUNDING as f64;

    #[test]
    fn rounding_is_relative_to_cell_and_distance_however_large_or_thin_the_face() {
        let mut random = Random(1);
        let mut worst: f64 = 0.0;
        for round in 0..20_000 {
            let radius = 10f64.powf(-1.0 - 2.0 * random.number().abs());
            let center = random.point();
            let size = 10f64.powf(-3.0 * random.number().abs());
            let thin = [1.0, 1e-2, 1e-4, 1e-7, 0.0][round % 5];
            let a = center + size.max(radius) * random.point();
            let (along, aside) = (size * random.point(), size * random.point());
            let corners = [a, a + along, a + 0.4 * random.number() * along + thin * aside];
            let triangle = Triangle::new(corners);
            let face = CandidateFace::new(&triangle).candidate(center);
            for _ in 0..10 {
                let p = (radius * random.point() / 3f64.sqrt()).as_vec3();
                let found = face.squared_distance(V3 { x: p.x, y: p.y, z: p.z });
                let expected = triangle.closest(center + p.as_dvec3()).distance;
                let off = (f64::from(found).sqrt() - expected).abs() / (radius + expected);
                assert!(off <= DISTANCE, "{off} at {p} of {corners:?} from {center}");
                worst = worst.max(off);
            }
        }
        // Measured errors come close enough to the bound to test it.
        assert!(worst > DISTANCE / 40.0, "{worst}");
        println!("off by {:.2} ulp of R + d", worst * f64::from(1 << 24));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        /// Distances to degenerate faces keep the same bound, in cells of any size around the
        /// point.
        #[test]
        fn degenerate_faces_are_edges(
            (corners, p) in degenerate::face_and_point(), size in -6.0..0.0f64, way in prop::array::uniform3(-0.5..0.5f64),
        ) {
            let radius = 10f64.powf(size);
            let offset = (radius * DVec3::from_array(way)).as_vec3();
            let center = p - offset.as_dvec3();
            let face = CandidateFace::new(&Triangle::new(corners)).candidate(center);
            let squared = face.squared_distance(V3 { x: offset.x, y: offset.y, z: offset.z });
            let found = f64::from(squared).sqrt();
            let exact = exact::squared_distance(center + offset.as_dvec3(), corners);
            prop_assert!(exact::is_root(found, &exact, DISTANCE * (radius + found)), "{found}, cell of {radius}");
        }
    }
}
