//! The distance from a point to a face, as `tesdf`'s `f32` kernel computes it: the same record, the same formulas.
use cubecl::prelude::*;
use tesdf::asset::FaceRecord;

use super::vector::{V3, cross, dot, minus, pick, plus, plus_scaled, scaled, v3};

/// Rows of four `f32` that a face takes: corner a, b − a, c − a, unit normal (zero when the face is no more than its edges), inverse
/// squared lengths of b − a, c − a, c − b, and the bits of its hints. [`Images`](crate::Images) writes them.
pub const ROWS: usize = 4;

/// The low bits of a squared distance say which part of the face it is to: 0 the plane, 1 the edge a–b, 2 b–c, 3 c–a.
pub const PART: u32 = 3;

/// A face in the local frame, relative to the middle of the cube.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Face {
    pub a: V3,
    pub ab: V3,
    pub ac: V3,
    pub normal: V3,
    /// 1 / |ab|², 1 / |ac|², 1 / |bc|²; 0 for a length of zero.
    pub inverse: V3,
    pub hints: u32,
}

/// Faces of less height than this (local frame) are no more than their edges, as in `tesdf`.
const FLAT: f32 = FaceRecord::LEAST_HEIGHT as f32;

/// The unit normal of a face; zero for one that is no more than its edges.
///
/// It is that of the two shorter edges, where rounding is least, and made square to the longest edge, along which an error would count most.
#[cube]
pub fn normal_of(a: V3, b: V3, c: V3) -> V3 {
    let (ab, ac, bc) = (minus(b, a), minus(c, a), minus(c, b));
    let (u, v, w) = (dot(ab, ab), dot(ac, ac), dot(bc, bc));
    let ab_longest = u >= v && u >= w;
    let ac_longest = v >= w;
    // All three are (b − a) × (c − a).
    let by_ab = cross(ac, bc);
    let by_ac = cross(ab, bc);
    let by_bc = cross(ab, ac);
    let across = pick(ab_longest, by_ab, pick(ac_longest, by_ac, by_bc));
    let along = pick(ab_longest, ab, pick(ac_longest, ac, bc));
    let longest = u.max(v).max(w);
    let off = dot(across, along) / longest.max(1e-30f32);
    let across = plus_scaled(across, -off, along);
    let size = dot(across, across).sqrt();
    // Not "less": corners that coincide have neither size nor length.
    let spans = size > FLAT * longest.sqrt();
    scaled(select(spans, 1.0f32 / size.max(1e-30f32), 0.0f32), across)
}

/// The face of three corners, as `tesdf::asset::FaceRecord` makes it, without hints; in `f32` alone.
#[cube]
pub fn record_of(a: V3, b: V3, c: V3) -> Face {
    let (ab, ac, bc) = (minus(b, a), minus(c, a), minus(c, b));
    let inverse = v3(inverse(dot(ab, ab)), inverse(dot(ac, ac)), inverse(dot(bc, bc)));
    Face { a, ab, ac, normal: normal_of(a, b, c), inverse, hints: 0u32 }
}

#[cube]
fn inverse(squared: f32) -> f32 {
    select(squared > 1e-30f32, 1.0f32 / squared.max(1e-30f32), 0.0f32)
}

/// Reads a face; `at` is its first row.
#[cube]
pub fn face(rows: &[Vector<f32, Const<4>>], at: usize) -> Face {
    let (p, q, r, s) = (rows[at], rows[at + 1], rows[at + 2], rows[at + 3]);
    Face {
        a: v3(p.extract(0usize), p.extract(1usize), p.extract(2usize)),
        ab: v3(p.extract(3usize), q.extract(0usize), q.extract(1usize)),
        ac: v3(q.extract(2usize), q.extract(3usize), r.extract(0usize)),
        normal: v3(r.extract(1usize), r.extract(2usize), r.extract(3usize)),
        inverse: v3(s.extract(0usize), s.extract(1usize), s.extract(2usize)),
        hints: u32::reinterpret(s.extract(3usize)),
    }
}

/// Whether a face is no more than its edges: a segment or a point.
#[cube]
pub fn is_flat(f: Face) -> bool {
    dot(f.normal, f.normal) < 0.5f32
}

/// Where along an edge the foot of a point is: 0 at its start, 1 at its end.
#[cube]
fn foot(from: V3, along: V3, inverse: f32) -> f32 {
    dot(along, from) * inverse
}

/// Squared distance to the segment from the origin of `from` to `along`, by the foot.
#[cube]
fn to_edge(from: V3, along: V3, foot: f32) -> f32 {
    let to = plus_scaled(from, -foot.clamp(0.0f32, 1.0f32), along);
    dot(to, to)
}

/// Added to squared distances of flat faces, so that of a flat face and its neighbour, which are equally near, the one with a normal is
/// the nearest. It is that of 1e-7 (local frame), and only tells which face is meant.
const AFTER: f32 = 1e-14;

#[cube]
fn with_part(squared: f32, part: u32) -> f32 {
    f32::reinterpret((u32::reinterpret(squared) & 4294967292u32) | part)
}

/// Squared distances to the parts of a face.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Parts {
    /// Whether the point is over the face, so that the plane is nearest.
    pub inside: bool,
    pub to_plane: f32,
    pub to_ab: f32,
    pub to_bc: f32,
    pub to_ca: f32,
}

#[cube]
fn parts(f: Face, p: V3) -> Parts {
    let ap = minus(p, f.a);
    let bp = minus(ap, f.ab);
    let bc = minus(f.ac, f.ab);
    let on_ab = foot(ap, f.ab, f.inverse.x);
    let on_ac = foot(ap, f.ac, f.inverse.y);
    let on_bc = foot(bp, bc, f.inverse.z);
    // Beyond the tip of a needle its long sides are both within rounding of the point: there the longest edge tells.
    let ab_longest = f.inverse.x <= f.inverse.y && f.inverse.x <= f.inverse.z;
    let on_longest = select(ab_longest, on_ab, select(f.inverse.y <= f.inverse.z, on_ac, on_bc));
    let flat = is_flat(f);
    let turned = cross(ap, f.normal);
    let inside = dot(f.ab, turned) >= 0.0f32
        && dot(f.ac, turned) <= 0.0f32
        && dot(bc, cross(bp, f.normal)) >= 0.0f32
        && on_longest >= 0.0f32
        && on_longest <= 1.0f32
        && !flat;
    let height = dot(f.normal, ap);
    let after = select(flat, AFTER, 0.0f32);
    Parts {
        inside,
        to_plane: height * height,
        to_ab: to_edge(ap, f.ab, on_ab) + after,
        to_bc: to_edge(bp, bc, on_bc) + after,
        to_ca: to_edge(ap, f.ac, on_ac) + after,
    }
}

/// The squared distance, with the part of the face in its low bits.
#[cube]
pub fn distance_squared(f: Face, p: V3) -> f32 {
    let to = parts(f, p);
    let to_edges = with_part(to.to_ab, 1u32).min(with_part(to.to_bc, 2u32)).min(with_part(to.to_ca, 3u32));
    select(to.inside, with_part(to.to_plane, 0u32), to_edges)
}

/// Where a face is nearest to a point.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Closest {
    /// The nearest point.
    pub point: V3,
    /// From it to the query point.
    pub outward: V3,
    /// 0 the face, 1–3 its edges, 4–6 its corners.
    pub feature: u32,
    /// Height of the query point over the plane of the face.
    pub height: f32,
}

/// The nearest point of the part that [`distance_squared`] named.
#[cube]
pub fn closest(f: Face, p: V3, part: u32) -> Closest {
    let ap = minus(p, f.a);
    let height = dot(f.normal, ap);
    // Edge c–a runs from c, as its name says.
    let from = pick(part == 2u32, minus(ap, f.ab), pick(part == 3u32, minus(ap, f.ac), ap));
    let along = pick(part == 2u32, minus(f.ac, f.ab), pick(part == 3u32, scaled(-1.0f32, f.ac), f.ab));
    let inverse = select(part == 2u32, f.inverse.z, select(part == 3u32, f.inverse.y, f.inverse.x));
    let t = dot(along, from) * inverse;
    let next = select(part == 3u32, 4u32, part + 4u32);
    let of_edge = select(t <= 0.0f32, part + 3u32, select(t >= 1.0f32, next, part));
    let in_plane = part == 0u32;
    let outward =
        pick(in_plane, scaled(height, f.normal), plus_scaled(from, -t.clamp(0.0f32, 1.0f32), along));
    Closest { point: minus(p, outward), outward, feature: select(in_plane, 0u32, of_edge), height }
}

/// A unit vector across a flat face, more or less: the direction away from it of a point that is on it.
#[cube]
pub fn across(f: Face) -> V3 {
    let along = pick(f.inverse.x > 0.0f32, f.ab, f.ac);
    let flat_part = along.x * along.x + along.y * along.y;
    // Squares of less are no longer exact; a point has no direction to be square to.
    let is_steep = flat_part <= (0.01f32 * along.z * along.z).max(1e-30f32);
    let inverse = 1.0f32 / select(is_steep, 1.0f32, flat_part).sqrt();
    pick(is_steep, v3(1.0f32, 0.0f32, 0.0f32), v3(-inverse * along.y, inverse * along.x, 0.0f32))
}

/// Corner `k` of a face.
#[cube]
pub fn corner(f: Face, k: u32) -> V3 {
    pick(k == 1u32, plus(f.a, f.ab), pick(k == 2u32, plus(f.a, f.ac), f.a))
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use proptest::prelude::*;
    use tesdf::asset::layout::SignHints;
    use tesdf::geometry::Triangle;

    use super::*;
    use crate::images::without_nan;
    use crate::testing::{degenerate, exact};

    /// What `f32` promises of a body with a diagonal of 0.5, the least that there is: 1e-6 of it.
    const PROMISE: f64 = 5e-7;

    /// The face as an image of an asset has it, and as moved vertices make it.
    fn faces(corners: [DVec3; 3]) -> [Face; 2] {
        let record = FaceRecord::new(&Triangle::new(corners), DVec3::ZERO, SignHints::default());
        let r = without_nan(*record.as_array());
        let at = |k: usize| v3(r[k], r[k + 1], r[k + 2]);
        let image = Face { a: at(0), ab: at(3), ac: at(6), normal: at(9), inverse: at(12), hints: 0 };
        let [a, b, c] = corners.map(|p| v3(p.x as f32, p.y as f32, p.z as f32));
        [image, record_of(a, b, c)]
    }

    /// The squared distance and the part of the face that it is to, as [`distance_squared`] has them in one number, which takes a device.
    fn nearest(face: Face, p: V3) -> (f32, u32) {
        let to = parts(face, p);
        if to.inside {
            return (to.to_plane, 0);
        }
        let edges = [(to.to_ab, 1), (to.to_bc, 2), (to.to_ca, 3)];
        edges.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).expect("three edges")
    }

    /// The distance and the closest point are those of a triangle, a segment or a point.
    fn assert_exact(corners: [DVec3; 3], p: DVec3) -> Result<(), TestCaseError> {
        let squared = exact::squared_distance(p, corners);
        let at = v3(p.x as f32, p.y as f32, p.z as f32);
        for face in faces(corners) {
            let n = f64_of(face.normal);
            prop_assert!(n == DVec3::ZERO || (n.length() - 1.0).abs() < 1e-6, "{n}");
            let (found, part) = nearest(face, at);
            prop_assert!(exact::is_root(f64::from(found).sqrt(), &squared, PROMISE), "{found:e} of {n}");
            let there = closest(face, at, part);
            let (point, outward) = (f64_of(there.point), f64_of(there.outward));
            prop_assert!(exact::is_root(outward.length(), &squared, PROMISE), "{outward}");
            let off = exact::squared_distance(point, corners);
            prop_assert!(exact::is_root(0.0, &off, 2.0 * PROMISE), "{point} is off the face");
            let away = f64_of(across(face));
            prop_assert!((away.length() - 1.0).abs() < 1e-6, "{away}");
        }
        Ok(())
    }

    // Within a ball of a diameter of about 1, as bodies are.
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
                assert!(is_flat(flat));
                for p in [corner, side, 0.5 * side] {
                    let p = v3(p.x as f32, p.y as f32, p.z as f32);
                    assert!(nearest(neighbour, p).0 < nearest(flat, p).0);
                }
            }
        }
    }

    fn f64_of(v: V3) -> DVec3 {
        Vec3::new(v.x, v.y, v.z).as_dvec3()
    }

    /// The plane goes through all corners, needles and caps included, and looks the way that `tesdf` says.
    #[test]
    fn planes_of_faces_hold_their_corners() {
        let mut random = fastrand::Rng::with_seed(5);
        let mut in_cube = || DVec3::from_array(std::array::from_fn(|_| random.f64() - 0.5));
        let (mut faces, mut greatest) = (0, 0.0f64);
        for k in 0..20_000 {
            let [a, b, c] = [(); 3].map(|()| in_cube());
            // From well-shaped triangles to those a millionth as high as long: needles, then caps.
            let thin = 10f64.powf(-f64::from(k % 7));
            let c = if k % 2 == 0 { a + thin * (c - a) } else { 0.5 * (a + b) + thin * (c - a) };
            let [a, b, c] = [a, b, c].map(|p: DVec3| v3(p.x as f32, p.y as f32, p.z as f32));
            let record = record_of(a, b, c);
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
