//! Squared distances from one point to the faces of a list, several faces at once.
//!
//! One source is compiled per instruction set; the set is chosen when an asset is opened. No
//! operations are fused, so all sets give the same bits.

use glam::Vec3;

use super::lanes::Lanes;
use super::polygon::PolygonAxes;

use crate::asset::FaceRecord;
use crate::base::Isa;

/// The low bits of a squared distance say which part of the face is nearest. They change the
/// squared distance by a factor of 2^-22, the distance by half of that, and need no register.
pub const PART: u32 = 3;

/// The nearest face so far.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Squared distance, with the part in its low bits.
    pub distance_squared: f32,
    /// Index of the face among the records.
    pub face: u32,
}

impl Nearest {
    /// No face yet.
    pub const NONE: Self = Self { distance_squared: f32::INFINITY, face: u32::MAX };

    /// Part of the face: 0 its plane, 1 the edge a–b, 2 the edge b–c, 3 the edge c–a.
    #[inline]
    pub fn part(self) -> u32 {
        self.distance_squared.to_bits() & PART
    }
}

/// Lanes of the widest kernel. Lists are padded to a multiple of this by repeating their last face.
pub const LANES: usize = 8;

/// Improves `best` by `faces`, whose number is positive and a multiple of [`LANES`]. Among equally
/// near faces of a lane, the first wins.
#[inline]
pub fn nearest(isa: Isa, records: &[FaceRecord], faces: &[[u32; LANES]], p: Vec3, best: Nearest) -> Nearest {
    match isa {
        Isa::Baseline => nearest_lanes::<[f32; LANES], LANES>(records, faces, p, best),
        // SAFETY: `detect` found the features.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => unsafe { nearest_avx2(records, faces, p, best) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => unsafe { nearest_avx512(records, faces, p, best) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn nearest_avx2(records: &[FaceRecord], faces: &[[u32; LANES]], p: Vec3, best: Nearest) -> Nearest {
    nearest_lanes::<std::arch::x86_64::__m256, LANES>(records, faces, p, best)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn nearest_avx512(records: &[FaceRecord], faces: &[[u32; LANES]], p: Vec3, best: Nearest) -> Nearest {
    nearest_lanes::<std::arch::x86_64::__m256, LANES>(records, faces, p, best)
}

/// Writes the squared distances of `faces`, as [`Nearest::distance_squared`], and returns the
/// least. The distance to a face whose numbers overflow is NaN, and does not count. `out` has the
/// length of `faces`.
#[inline]
pub fn distances(
    isa: Isa,
    records: &[FaceRecord],
    faces: &[[u32; LANES]],
    p: Vec3,
    out: &mut [[f32; LANES]],
) -> f32 {
    match isa {
        Isa::Baseline => distances_lanes::<[f32; LANES], LANES>(records, faces, p, out),
        // SAFETY: `detect` found the features.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => unsafe { distances_avx2(records, faces, p, out) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => unsafe { distances_avx512(records, faces, p, out) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn distances_avx2(records: &[FaceRecord], faces: &[[u32; LANES]], p: Vec3, out: &mut [[f32; LANES]]) -> f32 {
    distances_lanes::<std::arch::x86_64::__m256, LANES>(records, faces, p, out)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn distances_avx512(
    records: &[FaceRecord],
    faces: &[[u32; LANES]],
    p: Vec3,
    out: &mut [[f32; LANES]],
) -> f32 {
    distances_lanes::<std::arch::x86_64::__m256, LANES>(records, faces, p, out)
}

#[inline(always)]
fn distances_lanes<L: Lanes<N>, const N: usize>(
    records: &[FaceRecord],
    faces: &[[u32; N]],
    p: Vec3,
    out: &mut [[f32; N]],
) -> f32 {
    let p = V([L::splat(p.x), L::splat(p.y), L::splat(p.z)]);
    let mut least = L::splat(f32::INFINITY);
    for (faces, out) in faces.iter().zip(out) {
        let mut rows = [records[0].as_array(); N];
        for l in 0..N {
            rows[l] = records[faces[l] as usize].as_array();
        }
        let d = distance_squared(L::load(rows), p);
        least = d.min(least);
        *out = d.to_array();
    }
    least.least().to_array()[0]
}

/// Lower bounds of the distances between a polygon and faces, up to rounding: how far they are
/// apart along the normals of both and out of the sides of the polygon.
#[inline]
pub fn apart(isa: Isa, records: &[FaceRecord], faces: &[u32; LANES], axes: &PolygonAxes) -> [f32; LANES] {
    match isa {
        Isa::Baseline => apart_lanes::<[f32; LANES], LANES>(records, faces, axes),
        // SAFETY: `detect` found the features.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 | Isa::Avx512 => unsafe { apart_avx2(records, faces, axes) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn apart_avx2(records: &[FaceRecord], faces: &[u32; LANES], axes: &PolygonAxes) -> [f32; LANES] {
    apart_lanes::<std::arch::x86_64::__m256, LANES>(records, faces, axes)
}

#[inline(always)]
fn apart_lanes<L: Lanes<N>, const N: usize>(
    records: &[FaceRecord],
    faces: &[u32; N],
    axes: &PolygonAxes,
) -> [f32; N] {
    let mut rows = [records[0].as_array(); N];
    for l in 0..N {
        rows[l] = records[faces[l] as usize].as_array();
    }
    let v = L::load(rows);
    let (a, ab) = (V([v[0], v[1], v[2]]), V([v[3], v[4], v[5]]));
    let (ac, n) = (V([v[6], v[7], v[8]]), V([v[9], v[10], v[11]]));
    let zero = L::splat(0.0);
    // Heights of the polygon's points over the faces. They are NaN for a face without a normal, and
    // then do not count.
    let (mut lowest, mut highest) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
    for p in axes.points() {
        let height = V([L::splat(p.x), L::splat(p.y), L::splat(p.z)]).minus(a).dot(n);
        (lowest, highest) = (lowest.min(height), highest.max(height));
    }
    let mut bound = zero.sub(highest).max(lowest.max(zero));
    // Heights of the faces' corners over the polygon and over its sides.
    for k in 0..4 {
        let (u, height) = if k == 3 { (axes.normal, axes.height) } else { (axes.outward[k], axes.sides[k]) };
        let u = V([L::splat(u.x), L::splat(u.y), L::splat(u.z)]);
        let first = a.dot(u).sub(L::splat(height));
        let (second, third) = (first.add(ab.dot(u)), first.add(ac.dot(u)));
        bound = first.min(second).min(third).max(bound);
        if k == 3 {
            bound = zero.sub(first.max(second).max(third)).max(bound);
        }
    }
    bound.to_array()
}

/// Lower bounds of the distances between a polygon and boxes, up to rounding: as
/// [`PolygonAxes::to_box`]. `boxes` has the coordinates of the lowest corners, then of the highest.
#[inline]
pub fn boxes_apart(isa: Isa, boxes: &[[f32; LANES]; 6], axes: &PolygonAxes) -> [f32; LANES] {
    match isa {
        Isa::Baseline => boxes_apart_lanes::<[f32; LANES], LANES>(boxes, axes),
        // SAFETY: `detect` found the features.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 | Isa::Avx512 => unsafe { boxes_apart_avx2(boxes, axes) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn boxes_apart_avx2(boxes: &[[f32; LANES]; 6], axes: &PolygonAxes) -> [f32; LANES] {
    boxes_apart_lanes::<std::arch::x86_64::__m256, LANES>(boxes, axes)
}

#[inline(always)]
fn boxes_apart_lanes<L: Lanes<N>, const N: usize>(boxes: &[[f32; N]; 6], axes: &PolygonAxes) -> [f32; N] {
    let row = |k: usize| L::from_bits(boxes[k].map(f32::to_bits));
    let (zero, half) = (L::splat(0.0), L::splat(0.5));
    let mut centers = [zero; 3];
    let mut halves = [zero; 3];
    let mut squared = zero;
    for k in 0..3 {
        let (low, high) = (row(k), row(3 + k));
        // Halved before the sum, which then cannot overflow.
        centers[k] = low.mul(half).add(high.mul(half));
        halves[k] = high.mul(half).sub(low.mul(half));
        let apart = low.sub(L::splat(axes.high[k])).max(L::splat(axes.low[k]).sub(high)).max(zero);
        squared = apart.mul(apart).add(squared);
    }
    let mut bound = zero;
    for k in 0..4 {
        let (u, height) = if k == 3 { (axes.normal, axes.height) } else { (axes.outward[k], axes.sides[k]) };
        let center = V(centers).dot(V([L::splat(u.x), L::splat(u.y), L::splat(u.z)])).sub(L::splat(height));
        let u = u.abs();
        let half = V(halves).dot(V([L::splat(u.x), L::splat(u.y), L::splat(u.z)]));
        bound = center.sub(half).max(bound);
        if k == 3 {
            bound = zero.sub(center).sub(half).max(bound);
        }
    }
    let (squared, bound) = (squared.to_array(), bound.to_array());
    std::array::from_fn(|l| bound[l].max(squared[l].sqrt()))
}

#[inline(always)]
fn nearest_lanes<L: Lanes<N>, const N: usize>(
    records: &[FaceRecord],
    faces: &[[u32; N]],
    p: Vec3,
    best: Nearest,
) -> Nearest {
    let p = V([L::splat(p.x), L::splat(p.y), L::splat(p.z)]);
    let mut least = L::splat(best.distance_squared);
    let mut nearest = L::from_bits([best.face; N]);
    for faces in faces {
        let mut rows = [records[0].as_array(); N];
        for l in 0..N {
            rows[l] = records[faces[l] as usize].as_array();
        }
        let d = distance_squared(L::load(rows), p);
        let closer = d.less(least);
        least = closer.select(d, least);
        nearest = closer.select(L::from_bits(*faces), nearest);
    }
    // One comparison after the other would take as long as eight faces.
    let lane = least.least().at_least(least).bits().trailing_zeros() as usize % N;
    Nearest { distance_squared: least.to_array()[lane], face: nearest.to_array()[lane].to_bits() }
}

// No closures and no iterators over lanes below. The compiler would build them without the caller's
// instruction set, and each operation would become a call (measured: ten times slower).

/// As [`Triangle::closest`](crate::geometry::Triangle::closest), but without branches: the squared
/// distance, with the part of the face in its low bits.
#[inline(always)]
fn distance_squared<L: Lanes<N>, const N: usize>(v: [L; 16], p: V<L>) -> L {
    let (a, ab) = (V([v[0], v[1], v[2]]), V([v[3], v[4], v[5]]));
    let (ac, n) = (V([v[6], v[7], v[8]]), V([v[9], v[10], v[11]]));
    let zero = L::splat(0.0);
    let ap = p.minus(a);
    let bp = ap.minus(ab);
    let bc = ac.minus(ab);
    let turned = ap.cross(n);
    let inside = ab.dot(turned).at_least(zero).and(zero.at_least(ac.dot(turned)));
    let inside = inside.and(bc.dot(bp.cross(n)).at_least(zero));
    let height = n.dot(ap);
    let (at_ab, at_bc, at_ca) = (ab.dot(ap).mul(v[12]), bc.dot(bp).mul(v[14]), ac.dot(ap).mul(v[13]));
    // Beyond the tip of a narrow face, both long sides differ only by rounding. A point over the
    // face is also beside its longest edge.
    let at_longest = v[14].less(v[12]).select(at_bc, at_ab);
    let at_longest = v[13].less(v[12].min(v[14])).select(at_ca, at_longest);
    let inside = inside.and(at_longest.at_least(zero)).and(L::splat(1.0).at_least(at_longest));
    let keep = L::from_bits([!PART; N]);
    let to_ab = to_edge(ap, ab, at_ab).and(keep).or(L::from_bits([1; N]));
    let to_bc = to_edge(bp, bc, at_bc).and(keep).or(L::from_bits([2; N]));
    let to_ca = to_edge(ap, ac, at_ca).and(keep).or(L::from_bits([3; N]));
    inside.select(height.mul(height).and(keep), to_ab.min(to_bc).min(to_ca))
}

/// Squared distance to the segment from 0 to `along`, from a point at `from`. The nearest point of
/// the line is `at` · `along`.
#[inline(always)]
fn to_edge<L: Lanes<N>, const N: usize>(from: V<L>, along: V<L>, at: L) -> L {
    let t = at.max(L::splat(0.0)).min(L::splat(1.0));
    let ([x, y, z], [u, v, w]) = (along.0, from.0);
    let to = V([u.sub(x.mul(t)), v.sub(y.mul(t)), w.sub(z.mul(t))]);
    to.dot(to)
}

#[derive(Clone, Copy)]
struct V<L>([L; 3]);

impl<L> V<L> {
    #[inline(always)]
    fn minus<const N: usize>(self, o: Self) -> Self
    where
        L: Lanes<N>,
    {
        Self([self.0[0].sub(o.0[0]), self.0[1].sub(o.0[1]), self.0[2].sub(o.0[2])])
    }

    #[inline(always)]
    fn dot<const N: usize>(self, o: Self) -> L
    where
        L: Lanes<N>,
    {
        self.0[2].mul(o.0[2]).add(self.0[1].mul(o.0[1]).add(self.0[0].mul(o.0[0])))
    }

    #[inline(always)]
    fn cross<const N: usize>(self, o: Self) -> Self
    where
        L: Lanes<N>,
    {
        let ([a, b, c], [x, y, z]) = (self.0, o.0);
        Self([b.mul(z).sub(c.mul(y)), c.mul(x).sub(a.mul(z)), a.mul(y).sub(b.mul(x))])
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::asset::layout::SignHints;
    use crate::geometry::Triangle;
    use crate::testing::{degenerate, exact};

    /// Error bound of `f32` for the smallest possible diagonal, 0.5: 1e-6 of the diagonal.
    const PROMISE: f64 = 5e-7;

    /// Every kernel finds the distance to a face.
    fn assert_exact(corners: [DVec3; 3], p: DVec3) -> Result<(), TestCaseError> {
        let record = FaceRecord::new(&Triangle::new(corners), DVec3::ZERO, SignHints::default());
        let squared = exact::squared_distance(p, corners);
        for &isa in Isa::of_processor() {
            let found = nearest(isa, &[record], &[[0; LANES]], p.as_vec3(), Nearest::NONE);
            let distance = f64::from(found.distance_squared).sqrt();
            prop_assert!(exact::is_root(distance, &squared, PROMISE), "{isa:?}: {found:?} {record:?}");
            let triangle = record.triangle();
            let closest = match found.part() {
                0 => triangle.closest_in_plane(p),
                edge => triangle.closest_on_edge(edge as usize - 1, p),
            };
            prop_assert!(exact::is_root(closest.distance, &squared, PROMISE), "{isa:?}: {closest:?}");
            let mut all = [[0.0; LANES]];
            let least = distances(isa, &[record], &[[0; LANES]], p.as_vec3(), &mut all);
            prop_assert_eq!((least, all), (found.distance_squared, [[found.distance_squared; LANES]]));
        }
        Ok(())
    }

    // Points are within a ball with a diameter of about 1, as bodies are.
    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::rotation::cases(4000)))]
        #[test]
        fn degenerate_faces_are_exact((corners, p) in degenerate::face_and_point()) {
            assert_exact(corners.map(|c| 0.25 * c), 0.25 * p)?;
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::rotation::cases(20_000)))]
        #[test]
        fn points_beyond_a_tip_are_exact((corners, p) in degenerate::beyond_a_tip()) {
            assert_exact(corners.map(|c| 0.5 * c), 0.5 * p)?;
        }
    }
}
