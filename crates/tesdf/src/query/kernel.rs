//! Squared distances from one point to the faces of a list, several faces at once.
//!
//! One source, compiled per instruction set and chosen when an asset is opened. No fused multiply-add
//! anywhere, so that every machine gives the same bits.

use glam::{DVec3, Vec3};

use crate::geometry::Triangle;

/// A face in `f32`, relative to the middle of the cube: corner a, b − a, c − a, unit normal.
///
/// Without area the normal is NaN, which fails the test for the prism over the face: only edges count.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct FaceRecord([f32; 12]);

impl FaceRecord {
    /// Rounds a triangle of the local frame.
    pub fn new(triangle: &Triangle, middle: DVec3) -> Self {
        let [a, b, c] = triangle.corners.map(|p| (p - middle).as_vec3());
        let n = triangle.normal.as_vec3();
        let n = if n == Vec3::ZERO { Vec3::NAN } else { n };
        let mut record = [0.0; 12];
        for (k, v) in [a, b - a, c - a, n].into_iter().enumerate() {
            record[3 * k..3 * k + 3].copy_from_slice(&v.to_array());
        }
        Self(record)
    }

    /// The face in `f64`, relative to the middle of the cube.
    #[inline]
    pub fn triangle(&self) -> Triangle {
        let v = |k: usize| Vec3::from_slice(&self.0[3 * k..]).as_dvec3();
        let normal = v(3);
        let normal = if normal.is_nan() { DVec3::ZERO } else { normal };
        Triangle { corners: [v(0), v(0) + v(1), v(0) + v(2)], normal }
    }
}

/// The nearest face so far.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Squared distance.
    pub distance_squared: f32,
    /// Position of the face among the records.
    pub face: u32,
}

impl Nearest {
    /// Nothing yet.
    pub const NONE: Self = Self { distance_squared: f32::INFINITY, face: u32::MAX };
}

/// Instruction set that the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Isa {
    /// Whatever the build targets.
    Baseline,
    /// AVX2: eight lanes.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512: sixteen lanes.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Isa {
    /// The widest that this processor has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx512f") && std::arch::is_x86_feature_detected!("avx512vl") {
                return Self::Avx512;
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Baseline
    }
}

/// Improves `best` by the faces `ids`; of equally near ones the first wins.
#[inline]
pub fn nearest(isa: Isa, records: &[FaceRecord], ids: impl Ids, p: Vec3, best: Nearest) -> Nearest {
    match isa {
        Isa::Baseline => nearest_lanes::<4>(records, ids, p, best),
        // SAFETY: `detect` found the features.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => unsafe { nearest_avx2(records, ids, p, best) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => unsafe { nearest_avx512(records, ids, p, best) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn nearest_avx2(records: &[FaceRecord], ids: impl Ids, p: Vec3, best: Nearest) -> Nearest {
    nearest_lanes::<8>(records, ids, p, best)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl")]
fn nearest_avx512(records: &[FaceRecord], ids: impl Ids, p: Vec3, best: Nearest) -> Nearest {
    nearest_lanes::<16>(records, ids, p, best)
}

/// Where the faces of a list are named.
pub trait Ids: Copy {
    /// Number of faces.
    fn len(self) -> usize;
    /// Position of face `i`, for `i < len`.
    fn get(self, i: usize) -> u32;
}

#[inline(always)]
fn nearest_lanes<const N: usize>(records: &[FaceRecord], ids: impl Ids, p: Vec3, mut best: Nearest) -> Nearest {
    let count = ids.len();
    let mut first = 0;
    while first < count {
        // The last chunk is filled up with its last face: equal distances never replace an earlier one.
        let faces: [u32; N] = std::array::from_fn(|l| ids.get((first + l).min(count - 1)));
        let d = distances_squared(records, &faces, p);
        let least = d.iter().copied().fold(f32::INFINITY, f32::min);
        if least < best.distance_squared {
            let lane = d.iter().position(|&d| d == least).unwrap_or(0);
            best = Nearest { distance_squared: least, face: faces[lane] };
        }
        first += N;
    }
    best
}

#[inline(always)]
fn distances_squared<const N: usize>(records: &[FaceRecord], faces: &[u32; N], p: Vec3) -> [f32; N] {
    let mut v = [[0.0f32; N]; 12];
    for l in 0..N {
        let record = &records[faces[l] as usize].0;
        for (c, v) in v.iter_mut().enumerate() {
            v[l] = record[c];
        }
    }
    let mut d = [0.0f32; N];
    for l in 0..N {
        let at = |c: usize| [v[c][l], v[c + 1][l], v[c + 2][l]];
        d[l] = distance_squared(at(0), at(3), at(6), at(9), p);
    }
    d
}

/// As [`Triangle::closest`], but branch-free and of the squared distance alone.
#[inline(always)]
fn distance_squared(a: [f32; 3], ab: [f32; 3], ac: [f32; 3], n: [f32; 3], p: Vec3) -> f32 {
    let [a, ab, ac, n] = [a, ab, ac, n].map(V);
    let ap = V(p.to_array()).minus(a);
    let bp = ap.minus(ab);
    let bc = ac.minus(ab);
    let turned = ap.cross(n);
    let inside = ab.dot(turned) >= 0.0 && ac.dot(turned) <= 0.0 && bc.dot(bp.cross(n)) >= 0.0;
    let height = n.dot(ap);
    let edge = |from: V, along: V| {
        let t = (along.dot(from) / along.dot(along).max(f32::MIN_POSITIVE)).max(0.0).min(1.0);
        let to = V([from.0[0] - t * along.0[0], from.0[1] - t * along.0[1], from.0[2] - t * along.0[2]]);
        to.dot(to)
    };
    let edges = edge(ap, ab).min(edge(ap, ac)).min(edge(bp, bc));
    if inside { height * height } else { edges }
}

#[derive(Clone, Copy)]
struct V([f32; 3]);

impl V {
    #[inline(always)]
    fn minus(self, o: Self) -> Self {
        Self([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }

    #[inline(always)]
    fn dot(self, o: Self) -> f32 {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }

    #[inline(always)]
    fn cross(self, o: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, o.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }
}
