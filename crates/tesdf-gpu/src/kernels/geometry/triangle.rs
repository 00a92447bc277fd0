//! The distance from a point to a face, with the face record and the formulas of `tesdf`'s `f32`
//! kernel.
//!
//! Mirrors `geometry/triangle.rs` of `tesdf`.
use cubecl::prelude::*;
use tesdf::asset::FaceRecord;
use tesdf::query::internal;

use crate::kernels::geometry::vector::{
    LEAST_DIVISOR, Row, V3, from_bits, last, pick, row, to_bits, v3, xyz,
};

/// Rows of a face, as `GpuShapes` writes them. They hold 16 numbers, one after the other: corner a,
/// b − a, c − a, unit normal (zero for a flat face), inverse squared lengths of b − a, c − a and c
/// − b, and the bits of the hints.
pub const ROWS: u32 = 4;

/// The low bits of a squared distance that name the nearest part of the face: 0 the plane, 1 the
/// edge a–b, 2 the edge b–c, 3 the edge c–a.
pub const PART: u32 = internal::PART;

/// Three corners.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Triangle {
    pub a: V3,
    pub b: V3,
    pub c: V3,
}

/// A face in the local frame, relative to the center of the cube.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Face {
    pub a: V3,
    pub ab: V3,
    pub ac: V3,
    /// Unit normal; zero for a flat face, which is a segment or a point.
    pub normal: V3,
    /// 1 / |ab|², 1 / |ac|², 1 / |bc|²; 0 for a length of zero.
    pub inverse: V3,
    pub hints: u32,
}

/// A face with a smaller height (local frame) is flat, as in `tesdf`.
const FLAT: f32 = FaceRecord::LEAST_HEIGHT as f32;

/// The unit normal of a face; zero for a flat face.
///
/// The cross product of the two shorter edges has the least rounding error. The result is made
/// perpendicular to the longest edge, because an error along this edge would have the largest
/// effect.
#[cube]
pub fn normal_of(a: V3, b: V3, c: V3) -> V3 {
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let (u, v, w) = (ab.dot(ab), ac.dot(ac), bc.dot(bc));
    let ab_longest = u >= v && u >= w;
    let ac_longest = v >= w;
    // Each of the three equals (b − a) × (c − a).
    let across = pick(ab_longest, ac.cross(bc), pick(ac_longest, ab.cross(bc), ab.cross(ac)));
    let along = pick(ab_longest, ab, pick(ac_longest, ac, bc));
    let longest = u.max(v).max(w);
    let off = across.dot(along) / longest.max(LEAST_DIVISOR);
    let square = across + along * -off;
    let size = square.length();
    // `>` and not `>=`: when all corners coincide, both sides are 0, and the face must be flat.
    let spans = size > FLAT * longest.sqrt();
    square * select(spans, 1.0f32 / size.max(LEAST_DIVISOR), 0.0f32)
}

/// The face with three corners, as [`FaceRecord`] makes it, but computed in `f32` and without
/// hints.
#[cube]
pub fn face_of(a: V3, b: V3, c: V3) -> Face {
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let inverse = v3(inverse_of(ab.dot(ab)), inverse_of(ac.dot(ac)), inverse_of(bc.dot(bc)));
    Face { a, ab, ac, normal: normal_of(a, b, c), inverse, hints: 0u32 }
}

#[cube]
fn inverse_of(squared: f32) -> f32 {
    select(squared > LEAST_DIVISOR, 1.0f32 / squared.max(LEAST_DIVISOR), 0.0f32)
}

/// Reads the face that begins at row `at`.
#[cube]
pub fn read_face(rows: &[Row], at: u32) -> Face {
    let at = at as usize;
    let (p, q, r, s) = (rows[at], rows[at + 1], rows[at + 2], rows[at + 3]);
    Face {
        a: xyz(p),
        ab: v3(last(p), q.extract(0usize), q.extract(1usize)),
        ac: v3(q.extract(2usize), last(q), r.extract(0usize)),
        normal: v3(r.extract(1usize), r.extract(2usize), last(r)),
        inverse: xyz(s),
        hints: to_bits(last(s)),
    }
}

/// Overwrites the face that begins at row `at`. The hints stay.
#[cube]
pub fn rewrite_face(rows: &mut [Row], at: u32, f: Face) {
    let at = at as usize;
    let hints = last(rows[at + 3]);
    rows[at] = row(f.a.x, f.a.y, f.a.z, f.ab.x);
    rows[at + 1] = row(f.ab.y, f.ab.z, f.ac.x, f.ac.y);
    rows[at + 2] = row(f.ac.z, f.normal.x, f.normal.y, f.normal.z);
    rows[at + 3] = row(f.inverse.x, f.inverse.y, f.inverse.z, hints);
}

/// Squared distance from a point to the segment from the origin to `along`. `foot` is the position
/// of the point's projection, as a fraction of `along`.
#[cube]
fn to_edge(point: V3, along: V3, foot: f32) -> f32 {
    let outward = point + along * -foot.clamp(0.0f32, 1.0f32);
    outward.dot(outward)
}

/// Added to squared distances of flat faces. When a flat face and its neighbour are equally near,
/// the neighbour, which has a normal, then counts as the nearest. The value is the square of 1e-7
/// (local frame), and only affects which face is named.
const AFTER: f32 = 1e-14;

#[cube]
fn with_part(squared: f32, part: u32) -> f32 {
    from_bits((to_bits(squared) & comptime!(!PART)) | part)
}

/// The part of a face that the low bits of a squared distance name.
#[cube]
pub fn part_of(squared: f32) -> u32 {
    to_bits(squared) & PART
}

/// Squared distances from a point to the parts of a face.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Parts {
    /// Whether the projection of the point lies in the face, so that the plane is the nearest part.
    pub inside: bool,
    pub to_plane: f32,
    pub to_ab: f32,
    pub to_bc: f32,
    pub to_ca: f32,
}

/// The nearest point of a face.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Closest {
    /// The nearest point, in the frame of the face.
    pub point: V3,
    /// The vector from the nearest point to the query point.
    pub outward: V3,
    /// The nearest feature: 0 the face, 1–3 its edges, 4–6 its corners.
    pub feature: u32,
    /// Height of the query point above the plane of the face.
    pub height: f32,
}

#[cube]
impl Face {
    /// Corner `k`.
    pub fn corner(self, k: u32) -> V3 {
        pick(k == 1u32, self.a + self.ab, pick(k == 2u32, self.a + self.ac, self.a))
    }

    /// All three corners.
    pub fn corners(self) -> Triangle {
        Triangle { a: self.a, b: self.corner(1u32), c: self.corner(2u32) }
    }

    /// Whether the face is a segment or a point.
    pub fn is_flat(self) -> bool {
        self.normal.dot(self.normal) < 0.5f32
    }

    fn parts(self, p: V3) -> Parts {
        let ap = p - self.a;
        let bp = ap - self.ab;
        let bc = self.ac - self.ab;
        // Position of the point's projection along each edge: 0 at the first corner, 1 at the
        // second.
        let on_ab = self.ab.dot(ap) * self.inverse.x;
        let on_ac = self.ac.dot(ap) * self.inverse.y;
        let on_bc = bc.dot(bp) * self.inverse.z;
        // Beyond the tip of a needle, rounding cannot tell on which side of the two long edges the
        // point lies. There the longest edge decides.
        let ab_longest = self.inverse.x <= self.inverse.y && self.inverse.x <= self.inverse.z;
        let on_longest = select(ab_longest, on_ab, select(self.inverse.y <= self.inverse.z, on_ac, on_bc));
        let flat = self.is_flat();
        let turned = ap.cross(self.normal);
        let inside = self.ab.dot(turned) >= 0.0f32
            && self.ac.dot(turned) <= 0.0f32
            && bc.dot(bp.cross(self.normal)) >= 0.0f32
            && on_longest >= 0.0f32
            && on_longest <= 1.0f32
            && !flat;
        let height = self.normal.dot(ap);
        let after = select(flat, AFTER, 0.0f32);
        Parts {
            inside,
            to_plane: height * height,
            to_ab: to_edge(ap, self.ab, on_ab) + after,
            to_bc: to_edge(bp, bc, on_bc) + after,
            to_ca: to_edge(ap, self.ac, on_ac) + after,
        }
    }

    /// The squared distance to a point. The low bits name the nearest part of the face.
    pub fn distance_squared(self, p: V3) -> f32 {
        let to = self.parts(p);
        let to_edges =
            with_part(to.to_ab, 1u32).min(with_part(to.to_bc, 2u32)).min(with_part(to.to_ca, 3u32));
        select(to.inside, with_part(to.to_plane, 0u32), to_edges)
    }

    /// The nearest point of the part that [`distance_squared`](Self::distance_squared) has named.
    pub fn closest(self, p: V3, part: u32) -> Closest {
        let ap = p - self.a;
        let height = self.normal.dot(ap);
        // Edge c–a starts at c.
        let from = pick(part == 2u32, ap - self.ab, pick(part == 3u32, ap - self.ac, ap));
        let along = pick(part == 2u32, self.ac - self.ab, pick(part == 3u32, self.ac.negated(), self.ab));
        let inverse =
            select(part == 2u32, self.inverse.z, select(part == 3u32, self.inverse.y, self.inverse.x));
        let t = along.dot(from) * inverse;
        let next = select(part == 3u32, 4u32, part + 4u32);
        let of_edge = select(t <= 0.0f32, part + 3u32, select(t >= 1.0f32, next, part));
        let in_plane = part == 0u32;
        let outward = pick(in_plane, self.normal * height, from + along * -t.clamp(0.0f32, 1.0f32));
        Closest { point: p - outward, outward, feature: select(in_plane, 0u32, of_edge), height }
    }

    /// The distance to a point.
    pub fn distance(self, p: V3) -> f32 {
        self.closest(p, part_of(self.distance_squared(p))).outward.length()
    }

    /// A unit vector roughly perpendicular to a flat face: the gradient at a point on the face.
    pub fn across(self) -> V3 {
        let along = pick(self.inverse.x > 0.0f32, self.ab, self.ac);
        let flat_part = along.x * along.x + along.y * along.y;
        // Below this, squares lose precision. A point has no direction, so any vector is
        // perpendicular to it.
        let is_steep = flat_part <= (0.01f32 * along.z * along.z).max(LEAST_DIVISOR);
        let inverse = 1.0f32 / select(is_steep, 1.0f32, flat_part).sqrt();
        pick(is_steep, v3(1.0f32, 0.0f32, 0.0f32), v3(-inverse * along.y, inverse * along.x, 0.0f32))
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use proptest::prelude::*;
    use tesdf::asset::layout::SignHints;
    use tesdf::geometry::Triangle;

    use super::*;
    use crate::collide::scene::pack::without_nan;
    use crate::testing::{degenerate, exact};

    /// Documented error of `f32` for a body with a diagonal of 0.5, the smallest diagonal in a
    /// local frame: 1e-6 of it.
    const PROMISE: f64 = 5e-7;

    /// The face as the record of an asset gives it, and as moved vertices give it.
    fn faces(corners: [DVec3; 3]) -> [Face; 2] {
        let record = FaceRecord::new(&Triangle::new(corners), DVec3::ZERO, SignHints::default());
        let r = without_nan(*record.as_array());
        let at = |k: usize| v3(r[k], r[k + 1], r[k + 2]);
        let image = Face { a: at(0), ab: at(3), ac: at(6), normal: at(9), inverse: at(12), hints: 0 };
        let [a, b, c] = corners.map(|p| v3(p.x as f32, p.y as f32, p.z as f32));
        [image, face_of(a, b, c)]
    }

    /// The distance and the closest point are those of the triangle, segment or point.
    fn assert_exact(corners: [DVec3; 3], p: DVec3) -> Result<(), TestCaseError> {
        let squared = exact::squared_distance(p, corners);
        let at = v3(p.x as f32, p.y as f32, p.z as f32);
        for face in faces(corners) {
            let n = f64_of(face.normal);
            prop_assert!(n == DVec3::ZERO || (n.length() - 1.0).abs() < 1e-6, "{n}");
            let found = face.distance_squared(at);
            prop_assert!(exact::is_root(f64::from(found).sqrt(), &squared, PROMISE), "{found:e} of {n}");
            let there = face.closest(at, part_of(found));
            let (point, outward) = (f64_of(there.point), f64_of(there.outward));
            prop_assert!(exact::is_root(outward.length(), &squared, PROMISE), "{outward}");
            let off = exact::squared_distance(point, corners);
            prop_assert!(exact::is_root(0.0, &off, 2.0 * PROMISE), "{point} is off the face");
            let away = f64_of(face.across());
            prop_assert!((away.length() - 1.0).abs() < 1e-6, "{away}");
        }
        Ok(())
    }

    // The points lie in a ball with a diameter of about 1, as bodies do.
    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        #[test]
        fn degenerate_faces_are_edges((corners, p) in degenerate::face_and_point()) {
            assert_exact(corners.map(|c| 0.25 * c), 0.25 * p)?;
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn tips_are_no_planes((corners, p) in degenerate::beyond_a_tip()) {
            assert_exact(corners.map(|c| 0.5 * c), 0.5 * p)?;
        }
    }

    #[test]
    fn of_a_flat_face_and_its_neighbour_the_neighbour_is_the_nearest() {
        let [corner, side] = [DVec3::ZERO, 0.3 * DVec3::X];
        let [neighbour, _] = faces([corner, side, 0.3 * DVec3::Y]);
        for flat in [[corner; 3], [corner, side, side], [side, corner, 0.5 * side]] {
            for flat in faces(flat) {
                assert!(flat.is_flat());
                for p in [corner, side, 0.5 * side] {
                    let p = v3(p.x as f32, p.y as f32, p.z as f32);
                    assert!(neighbour.distance_squared(p) < flat.distance_squared(p));
                }
            }
        }
    }

    fn f64_of(v: V3) -> DVec3 {
        Vec3::new(v.x, v.y, v.z).as_dvec3()
    }

    /// The plane passes through all corners, also for needles and caps, and the normal has the
    /// direction of `tesdf`'s normal.
    #[test]
    fn planes_of_faces_hold_their_corners() {
        let mut random = fastrand::Rng::with_seed(5);
        let mut in_cube = || DVec3::from_array(std::array::from_fn(|_| random.f64() - 0.5));
        let (mut faces, mut greatest) = (0, 0.0f64);
        for k in 0..20_000 {
            let [a, b, c] = [(); 3].map(|()| in_cube());
            // From well-shaped triangles to triangles with a height of a millionth of their length:
            // needles, then caps.
            let thin = 10f64.powf(-f64::from(k % 7));
            let c = if k % 2 == 0 { a + thin * (c - a) } else { 0.5 * (a + b) + thin * (c - a) };
            let [a, b, c] = [a, b, c].map(|p: DVec3| v3(p.x as f32, p.y as f32, p.z as f32));
            let record = face_of(a, b, c);
            let corners = [a, b, c].map(f64_of);
            let n = f64_of(record.normal);
            if n == DVec3::ZERO {
                let [a, b, c] = corners;
                let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
                let height = (b - a).cross(c - a).length() / longest.max(f64::MIN_POSITIVE);
                assert!(height < 2.0 * f64::from(FLAT), "a face of height {height} is flat");
                continue;
            }
            faces += 1;
            assert!((n.length() - 1.0).abs() < 1e-6);
            let off = corners.map(|p| (p - corners[0]).dot(n).abs()).into_iter().fold(0.0, f64::max);
            greatest = greatest.max(off);
            let expected = Triangle::new(corners).normal;
            assert!(n.dot(expected) > 0.9, "{n} instead of {expected}");
        }
        assert!(faces > 15_000, "{faces} faces");
        assert!(greatest < 4e-7, "a corner is {greatest} off its plane");
    }
}
