//! Triangulates a loop in space by its weight.
//!
//! Input: the positions of the loop, the unit normals of the faces around it, and which vertices
//! are connected already. Output: triangles of positions in the loop, oriented as the loop.
//!
//! The weight is that of P. Liepa, Filling Holes in Meshes (Symposium on Geometry Processing 2003):
//! the sharpest fold between neighbouring faces, then the area. Before these two comes the number
//! of flaws: triangles without area, and edges that the mesh has already, so that more than two
//! faces would meet there.
use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;

/// A triangle counts as flat when its height is less than this share of its longest edge.
const FLAT: f64 = 1e-9;

/// Largest number of ends of chords on each side of a piece that is cut.
const CHORDS: usize = 1000;

/// A loop that is to be filled.
pub(super) struct Loop<'a> {
    /// Positions of the vertices.
    pub points: &'a [DVec3],
    /// For each vertex, the unit normal of the face across the edge to the next vertex.
    pub normals: &'a [DVec3],
    /// Whether the mesh has an edge between two vertices of the loop.
    pub is_edge: &'a (dyn Fn(usize, usize) -> bool + Sync),
}

/// The weight of some triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Weight {
    flaws: u32,
    /// 1 less the cosine of the sharpest fold: 0 when flat, 2 when folded back.
    fold: f64,
    area: f64,
}

impl Weight {
    const NONE: Self = Self { flaws: 0, fold: 0.0, area: 0.0 };
    const WORST: Self = Self { flaws: u32::MAX, fold: f64::INFINITY, area: f64::INFINITY };

    fn and(self, other: Self) -> Self {
        Self {
            flaws: self.flaws.saturating_add(other.flaws),
            fold: self.fold.max(other.fold),
            area: self.area + other.area,
        }
    }

    fn order(&self, other: &Self) -> Ordering {
        let floats = |a: f64, b: f64| a.total_cmp(&b);
        self.flaws.cmp(&other.flaws).then(floats(self.fold, other.fold)).then(floats(self.area, other.area))
    }
}

/// 1 less the cosine of the angle between two unit normals. Without a normal there is no fold.
fn fold(a: DVec3, b: DVec3) -> f64 {
    if a == DVec3::ZERO || b == DVec3::ZERO { 0.0 } else { 1.0 - a.dot(b) }
}

impl Loop<'_> {
    /// A triangle of the loop: its weight without folds, and its unit normal.
    fn triangle(&self, corners: [usize; 3]) -> (Weight, DVec3) {
        let [a, b, c] = corners.map(|i| self.points[i]);
        let cross = (b - a).cross(c - a);
        let double = cross.length();
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        let flat = double.is_nan() || double <= FLAT * longest;
        let normal = if flat { DVec3::ZERO } else { cross / double };
        (Weight { flaws: u32::from(flat), fold: 0.0, area: 0.5 * double }, normal)
    }

    /// The triangulation of least weight, by dynamic programming over the chords from i to k. The
    /// time is cubic in the number of vertices.
    ///
    /// A chord keeps its best triangulation only. The fold at the chord itself depends on the
    /// triangle on the other side, so the sharpest fold may be a little sharper than the least
    /// possible one, as in the paper.
    pub(super) fn minimum_weight(&self) -> Vec<[u32; 3]> {
        let n = self.points.len();
        let at = |i: usize, k: usize| i * n + k;
        let mut best = vec![Weight::NONE; n * n];
        let mut apex = vec![0u32; n * n];
        let mut normals = vec![DVec3::ZERO; n * n];
        for i in 0..n - 1 {
            normals[at(i, i + 1)] = self.normals[i];
        }
        for gap in 2..n {
            for i in 0..n - gap {
                let k = i + gap;
                let closing = gap == n - 1;
                let doubled = Weight { flaws: u32::from(!closing && (self.is_edge)(i, k)), ..Weight::NONE };
                let (mut least, mut found) = (Weight::WORST, (i as u32 + 1, DVec3::ZERO));
                for m in i + 1..k {
                    let (mut weight, normal) = self.triangle([i, m, k]);
                    weight.fold = fold(normal, normals[at(i, m)]).max(fold(normal, normals[at(m, k)]));
                    if closing {
                        weight.fold = weight.fold.max(fold(normal, self.normals[n - 1]));
                    }
                    let sum = weight.and(best[at(i, m)]).and(best[at(m, k)]);
                    if sum.order(&least) == Ordering::Less {
                        (least, found) = (sum, (m as u32, normal));
                    }
                }
                best[at(i, k)] = least.and(doubled);
                (apex[at(i, k)], normals[at(i, k)]) = found;
            }
        }
        let mut triangles = Vec::with_capacity(n - 2);
        let mut todo = vec![(0, n - 1)];
        while let Some((i, k)) = todo.pop() {
            if k - i < 2 {
                continue;
            }
            let m = apex[at(i, k)] as usize;
            triangles.push([i as u32, m as u32, k as u32]);
            todo.extend([(m, k), (i, m)]);
        }
        triangles
    }

    /// Cuts the loop into pieces of at most `most` vertices along short chords, and gives each
    /// piece its triangulation of least weight. Folds at the chords are not looked at.
    pub(super) fn pieces(&self, most: usize) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(self.points.len() - 2);
        let mut todo: Vec<Vec<usize>> = vec![(0..self.points.len()).collect()];
        while let Some(piece) = todo.pop() {
            if piece.len() > most {
                let (i, k) = self.short_chord(&piece);
                todo.push(piece[i..=k].to_vec());
                todo.push([&piece[..=i], &piece[k..]].concat());
                continue;
            }
            let points: Vec<DVec3> = piece.iter().map(|&v| self.points[v]).collect();
            let across = |i: usize| {
                let (from, to) = (piece[i], piece[(i + 1) % piece.len()]);
                let is_side = (from + 1) % self.points.len() == to;
                if is_side { self.normals[from] } else { DVec3::ZERO }
            };
            let normals: Vec<DVec3> = (0..piece.len()).map(across).collect();
            let is_edge = |i: usize, k: usize| (self.is_edge)(piece[i], piece[k]);
            let part = Loop { points: &points, normals: &normals, is_edge: &is_edge };
            let named = |t: [u32; 3]| t.map(|corner| piece[corner as usize] as u32);
            triangles.extend(part.minimum_weight().into_iter().map(named));
        }
        triangles
    }

    /// The shortest chord with at least a quarter of the piece on either side, among at most a
    /// million chords that are evenly chosen.
    fn short_chord(&self, piece: &[usize]) -> (usize, usize) {
        let n = piece.len();
        let every = n.div_ceil(CHORDS);
        // A chord skips a vertex at least, so that both parts are smaller than the piece.
        let side = (n / 4).max(2);
        let mut best = (f64::INFINITY, 0, n / 2);
        for i in (0..n / 2).step_by(every) {
            for k in (i + side..(i + n + 1 - side).min(n)).step_by(every) {
                let length = self.points[piece[i]].distance_squared(self.points[piece[k]]);
                if length < best.0 && !(self.is_edge)(piece[i], piece[k]) {
                    best = (length, i, k);
                }
            }
        }
        (best.1, best.2)
    }

    /// Cuts off one triangle after the other, always the one of least weight. Time n log n.
    pub(super) fn ears(&self) -> Vec<[u32; 3]> {
        let n = self.points.len();
        let mut ring = Ring {
            next: (0..n).map(|i| (i + 1) % n).collect(),
            before: (0..n).map(|i| (i + n - 1) % n).collect(),
            normals: self.normals.to_vec(),
            version: vec![0; n],
        };
        let mut heap: BinaryHeap<Ear> = (0..n).map(|i| self.ear(&ring, i)).collect();
        let mut triangles = Vec::with_capacity(n - 2);
        while let Some(ear) = heap.pop() {
            let tip = ear.tip;
            if ear.version != ring.version[tip] {
                continue;
            }
            let (before, after) = (ring.before[tip], ring.next[tip]);
            triangles.push([before as u32, tip as u32, after as u32]);
            if triangles.len() == n - 2 {
                break;
            }
            ring.next[before] = after;
            ring.before[after] = before;
            ring.normals[before] = ear.normal;
            ring.version[tip] = u32::MAX;
            for v in [before, after] {
                ring.version[v] += 1;
                heap.push(self.ear(&ring, v));
            }
        }
        triangles
    }

    fn ear(&self, ring: &Ring, tip: usize) -> Ear {
        let (before, after) = (ring.before[tip], ring.next[tip]);
        let (mut weight, normal) = self.triangle([before, tip, after]);
        weight.flaws += u32::from((self.is_edge)(before, after));
        weight.fold = fold(normal, ring.normals[before]).max(fold(normal, ring.normals[tip]));
        Ear { weight, tip, version: ring.version[tip], normal }
    }
}

/// The part of the loop that is not filled yet.
struct Ring {
    next: Vec<usize>,
    before: Vec<usize>,
    /// For each vertex, the normal across the edge to the next vertex.
    normals: Vec<DVec3>,
    /// Number of changes next to each vertex.
    version: Vec<u32>,
}

/// The triangle at a vertex of the ring.
struct Ear {
    weight: Weight,
    tip: usize,
    version: u32,
    normal: DVec3,
}

impl Ord for Ear {
    /// The greatest ear is the one to cut first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.weight.order(&self.weight).then(other.tip.cmp(&self.tip)).then(self.version.cmp(&other.version))
    }
}

impl PartialOrd for Ear {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Ear {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Ear {}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// All triangulations of the polygon from `i` to `k`.
    fn all(i: u32, k: u32) -> Vec<Vec<[u32; 3]>> {
        if k - i < 2 {
            return vec![Vec::new()];
        }
        let mut found = Vec::new();
        for m in i + 1..k {
            for left in all(i, m) {
                for right in all(m, k) {
                    found.push([left.as_slice(), &right, &[[i, m, k]]].concat());
                }
            }
        }
        found
    }

    fn weight(of: &Loop, triangles: &[[u32; 3]]) -> Weight {
        let n = of.points.len();
        let normal_at = |t: [u32; 3]| of.triangle(t.map(|v| v as usize)).1;
        let mut sum = Weight::NONE;
        for &t in triangles {
            let (mut weight, normal) = of.triangle(t.map(|v| v as usize));
            for e in 0..3 {
                let (a, b) = (t[e], t[(e + 1) % 3]);
                let across = match (a as usize + 1) % n == b as usize {
                    true => of.normals[a as usize],
                    false => {
                        let other = triangles.iter().find(|u| u.contains(&a) && u.contains(&b) && **u != t);
                        normal_at(*other.expect("two triangles on each chord"))
                    }
                };
                weight.fold = weight.fold.max(fold(normal, across));
            }
            sum = sum.and(weight);
        }
        sum
    }

    proptest! {
        /// No triangulation has a smaller sharpest fold than dynamic programming may find; ears and
        /// dynamic programming give whole triangulations.
        #[test]
        fn folds_are_bounded_by_those_of_all_triangulations(points in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 4..9)) {
            let points: Vec<DVec3> = points.into_iter().map(DVec3::from_array).collect();
            let n = points.len();
            let normals = vec![DVec3::ZERO; n];
            let of = Loop { points: &points, normals: &normals, is_edge: &|_, _| false };
            let area = |t: &[[u32; 3]]| t.iter().map(|t| of.triangle(t.map(|v| v as usize)).0.area).sum::<f64>();
            let found = of.minimum_weight();
            prop_assert_eq!(found.len(), n - 2);
            let least_fold = all(0, n as u32 - 1).iter().map(|t| weight(&of, t).fold).fold(f64::INFINITY, f64::min);
            // A chord keeps its best triangulation, so the fold may be sharper than the least one.
            prop_assert!(weight(&of, &found).fold >= least_fold);
            prop_assert!(area(&found) > 0.0);
            prop_assert_eq!(of.ears().len(), n - 2);
            prop_assert_eq!(of.pieces(4).len(), n - 2);
        }
    }

    #[test]
    fn a_bent_square_is_folded_along_its_crease() {
        // Two sides of a roof, whose ridge is the chord from 0 to 2.
        let points = [DVec3::ZERO, DVec3::new(0.5, -3.0, -1.0), DVec3::X, DVec3::new(0.5, 3.0, -1.0)];
        let roof = [DVec3::new(0.0, -1.0, 3.0).normalize(), DVec3::new(0.0, 1.0, 3.0).normalize()];
        let normals = [roof[0], roof[0], roof[1], roof[1]];
        let of = Loop { points: &points, normals: &normals, is_edge: &|_, _| false };
        for triangles in [of.minimum_weight(), of.ears()] {
            let folded = triangles.iter().all(|t| t.contains(&0) && t.contains(&2));
            assert!(folded, "{triangles:?}");
            assert!((weight(&of, &triangles).fold - 0.2).abs() < 1e-12);
        }
        // An edge of the mesh along the ridge makes the other chord better.
        let of = Loop { points: &points, normals: &normals, is_edge: &|a, b| a + b == 2 };
        for triangles in [of.minimum_weight(), of.ears()] {
            assert!(triangles.iter().all(|t| t.contains(&1) && t.contains(&3)), "{triangles:?}");
        }
    }

    #[test]
    fn collinear_loops_and_triangles_without_area_are_filled_all_the_same() {
        let points: Vec<DVec3> = [0.0, 1.0, 2.0, 3.0, 1.5].map(|x| DVec3::new(x, 0.0, 0.0)).to_vec();
        let normals = [DVec3::Z; 5];
        let of = Loop { points: &points, normals: &normals, is_edge: &|_, _| false };
        assert_eq!((of.minimum_weight().len(), of.ears().len()), (3, 3));
        // A square with a vertex in the middle of a side: no triangle without area is needed.
        let points =
            [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let of = Loop { points: &points, normals: &normals, is_edge: &|_, _| false };
        for triangles in [of.minimum_weight(), of.ears()] {
            assert_eq!(weight(&of, &triangles).flaws, 0, "{triangles:?}");
        }
        // A short chord may run along the side.
        assert_eq!(of.pieces(4).len(), 3);
    }
}
