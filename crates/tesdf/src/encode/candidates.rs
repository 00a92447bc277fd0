//! The faces that can be in the list of a cell, stored in rows, with the distances from the corners
//! of the cell.
//!
//! A bisection makes one new corner. The rows of the four old corners are passed on to the
//! children. The new corner is computed once, and both children read the same rows.

use glam::DVec3;

use super::doubles::{Doubles, GROUP, Vector, dispatch};
use super::surface::{Requirement, Surface};
use crate::domain::Cell;
use crate::geometry::{Feature, Regions, Triangle};

/// Rows of a shape: corners a, b, c, the unit normal, and 1 for a needle.
const SHAPE: usize = 13;
const NORMAL: usize = 9;
const NEEDLE: usize = 12;

/// Rows for one point that are passed on to children: the distance, its gradient, and the regions
/// as a number.
pub(super) const SEEN: usize = 5;
pub(super) const GRADIENT: usize = 1;
const REGIONS: usize = 4;
/// The first row that is not passed on: the closest points.
const POINT: usize = 5;
/// Rows that [`look`] writes.
pub(super) const LOOK: usize = 8;

/// The face that is closest to a point. Of several equally close faces it is the first.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Index among the candidates.
    pub index: u32,
    /// Distance.
    pub distance: f64,
    /// The closest point of the face.
    pub point: DVec3,
    /// The part of the face that the closest point lies on. If it lies on several parts, it is the
    /// least of them.
    pub feature: Feature,
}

impl Nearest {
    const NONE: Self =
        Self { index: 0, distance: f64::INFINITY, point: DVec3::INFINITY, feature: Feature::Face };
}

/// The candidates of a cell.
#[derive(Clone, Copy, Debug)]
pub struct Candidates<'a> {
    /// Face ids.
    pub faces: &'a [u32],
    /// Length of a row: a multiple of [`GROUP`]. The last face is repeated to fill the row.
    pub(super) stride: usize,
    shape: &'a [f64],
    /// The rows of the four corners, as [`look`] writes them.
    pub(super) seen: [&'a [f64]; 4],
    /// The closest candidate of each corner.
    pub nearest: [Nearest; 4],
}

impl Candidates<'_> {
    /// The part of candidate `index` that is closest in the whole cell. It is the whole face,
    /// unless all corners have the same edge or vertex of the face as the closest part.
    pub(super) fn feature(&self, index: usize) -> Feature {
        let seen_from = |k: usize| Regions(self.seen[k][REGIONS * self.stride + index] as u8);
        seen_from(0).and(seen_from(1)).and(seen_from(2)).and(seen_from(3)).least()
    }

    /// Computes the distances of all candidates from `p` into `out`.
    pub(super) fn look_from(&self, surface: &Surface, p: DVec3, out: &mut Vec<f64>) -> Nearest {
        grow(out, LOOK * self.stride);
        look(surface.isa, &surface.triangles, self.faces, self.shape, p, out);
        nearest_seen(self.faces.len(), self.stride, out)
    }
}

/// A candidate that the rules did not drop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Survivor {
    /// Index among the candidates.
    pub index: u32,
    /// The part of the face that the cell needs.
    pub requirement: Requirement,
    /// Whether the face comes within [`PAD`](super::filter::PAD) of the cell.
    pub meets: bool,
}

/// Memory for candidates and for what up to five points see of them: the corners of a cell, and the
/// midpoint of the edge at which the cell is bisected.
#[derive(Debug, Default)]
pub struct Pool {
    faces: Vec<u32>,
    stride: usize,
    /// The shapes, the rows of each corner, the rows of the midpoint. Where
    /// [`is_shared`](Self::is_shared) is set, it has only the rows of the midpoint.
    rows: Vec<f64>,
    nearest: Vec<Nearest>,
    /// Whether all candidates survived. Then their other rows are read where they are.
    is_shared: bool,
}

impl Pool {
    /// All of `faces`, seen from the corners of `cell`.
    pub fn new(surface: &Surface, faces: &[u32], cell: &Cell) -> Self {
        let mut pool = Self::default();
        pool.fill(surface, faces, cell);
        pool
    }

    /// Does the same as [`new`](Self::new), in the memory of this pool.
    pub fn fill(&mut self, surface: &Surface, faces: &[u32], cell: &Cell) {
        self.start(faces.iter().copied());
        let stride = self.stride;
        let (shape, seen) = self.rows.split_at_mut(SHAPE * stride);
        for (at, &face) in faces.iter().enumerate() {
            let t = &surface.triangles[face as usize];
            let [a, b, c] = t.corners;
            for (k, v) in [a, b, c, t.normal].into_iter().enumerate() {
                for axis in 0..3 {
                    shape[(3 * k + axis) * stride + at] = v[axis];
                }
            }
            shape[NEEDLE * stride + at] = f64::from(u8::from(t.is_needle()));
        }
        if let Some(last) = faces.len().checked_sub(1) {
            shape.chunks_exact_mut(stride).for_each(|row| {
                let value = row[last];
                row[last..].fill(value);
            });
        }
        for (k, &corner) in cell.corners.iter().enumerate() {
            let out = &mut seen[k * SEEN * stride..][..LOOK * stride];
            look(surface.isa, &surface.triangles, faces, shape, corner, out);
            self.nearest.push(nearest_seen(faces.len(), stride, out));
        }
    }

    /// The candidates of the cell that [`fill`](Self::fill) was called with.
    pub fn candidates(&self) -> Candidates<'_> {
        self.seen_from([0, 1, 2, 3])
    }

    /// Fills the pool with the survivors among the candidates of a cell, as seen from its corners
    /// and from its midpoint.
    pub fn narrow(&mut self, surface: &Surface, cell: &Cell, from: &Candidates, survivors: &[Survivor]) {
        let midpoint = cell.midpoint();
        if survivors.len() == from.faces.len() && (0..).zip(survivors).all(|(i, s)| s.index == i) {
            self.is_shared = true;
            self.nearest.clear();
            self.nearest.extend(from.nearest);
            self.nearest.push(from.look_from(surface, midpoint, &mut self.rows));
            return;
        }
        self.start(survivors.iter().map(|s| from.faces[s.index as usize]));
        let stride = self.stride;
        let (shape, seen) = self.rows.split_at_mut(SHAPE * stride);
        pick_rows(shape, stride, from.shape, from.stride, survivors);
        for (k, &corner) in cell.corners.iter().enumerate() {
            let rows = &mut seen[k * SEEN * stride..][..SEEN * stride];
            pick_rows(rows, stride, from.seen[k], from.stride, survivors);
            let (index, distance) = least(&rows[..survivors.len()]);
            let old = &from.nearest[k];
            let nearest = match survivors.get(index) {
                Some(s) if s.index == old.index => Nearest { index: index as u32, ..*old },
                Some(_) => {
                    let triangle = &surface.triangles[self.faces[index] as usize];
                    let (closest, regions) = triangle.closest_and_regions(corner);
                    let (point, feature) = (closest.point, regions.least());
                    Nearest { index: index as u32, distance, point, feature }
                }
                None => Nearest::NONE,
            };
            self.nearest.push(nearest);
        }
        let out = &mut seen[4 * SEEN * stride..][..LOOK * stride];
        look(surface.isa, &surface.triangles, &self.faces, shape, midpoint, out);
        self.nearest.push(nearest_seen(self.faces.len(), stride, out));
    }

    /// The candidates of a child. `from` are the candidates of its parent, for which
    /// [`narrow`](Self::narrow) was called. `corners` are the corners of the child: 0 to 3 are
    /// those of the parent, 4 is the midpoint.
    pub fn of_child<'a>(&'a self, from: &Candidates<'a>, corners: [usize; 4]) -> Candidates<'a> {
        if !self.is_shared {
            return self.seen_from(corners);
        }
        Candidates {
            seen: corners.map(|k| from.seen.get(k).copied().unwrap_or(&self.rows)),
            nearest: corners.map(|k| self.nearest[k]),
            ..*from
        }
    }

    fn seen_from(&self, points: [usize; 4]) -> Candidates<'_> {
        let (shape, seen) = self.rows.split_at(SHAPE * self.stride);
        Candidates {
            faces: &self.faces,
            stride: self.stride,
            shape,
            seen: points.map(|k| &seen[k * SEEN * self.stride..][..SEEN * self.stride]),
            nearest: points.map(|k| self.nearest[k]),
        }
    }

    fn start(&mut self, faces: impl Iterator<Item = u32>) {
        self.is_shared = false;
        self.nearest.clear();
        self.faces.clear();
        self.faces.extend(faces);
        self.stride = self.faces.len().next_multiple_of(GROUP).max(GROUP);
        grow(&mut self.rows, (SHAPE + 4 * SEEN + LOOK) * self.stride);
    }
}

/// Makes room for rows that are written before they are read.
fn grow(rows: &mut Vec<f64>, length: usize) {
    if rows.len() < length {
        rows.resize(length, 0.0);
    }
}

fn pick_rows(to: &mut [f64], to_stride: usize, from: &[f64], from_stride: usize, survivors: &[Survivor]) {
    for (to, from) in to.chunks_exact_mut(to_stride).zip(from.chunks_exact(from_stride)) {
        let (kept, padding) = to.split_at_mut(survivors.len());
        for (to, s) in kept.iter_mut().zip(survivors) {
            *to = from[s.index as usize];
        }
        padding.fill(kept.last().copied().unwrap_or(0.0));
    }
}

/// The index of the least distance, and the distance. Of equal distances it is the first.
fn least(distances: &[f64]) -> (usize, f64) {
    let first = |best: (usize, f64), (i, &d): (usize, &f64)| if d < best.1 { (i, d) } else { best };
    distances.iter().enumerate().fold((0, f64::INFINITY), first)
}

fn nearest_seen(n: usize, stride: usize, rows: &[f64]) -> Nearest {
    let (index, distance) = least(&rows[..n]);
    let at = |row: usize| rows[row * stride + index];
    Nearest {
        index: index as u32,
        distance,
        point: DVec3::new(at(POINT), at(POINT + 1), at(POINT + 2)),
        feature: Regions(at(REGIONS) as u8).least(),
    }
}

dispatch! {
    /// Computes what `p` sees of each face, with the same bits as
    /// [`Triangle::closest_and_regions`].
    fn look(triangles: &[Triangle], faces: &[u32], shape: &[f64], p: DVec3, out: &mut [f64]) = look_lanes
}

#[inline(always)]
fn look_lanes<L: Doubles>(triangles: &[Triangle], faces: &[u32], shape: &[f64], p: DVec3, out: &mut [f64]) {
    let stride = shape.len() / SHAPE;
    let at_point = Vector::<L>::splat(p);
    let mut at = 0;
    while at < stride {
        let needles = look_at::<L>(shape, stride, at_point, out, at);
        if needles != 0 {
            look_at_needles(triangles, faces, needles, p, stride, out, at);
        }
        at += L::LANES;
    }
}

/// Handles needles by the scalar code, which measures their sides again from the nearer ends.
#[cold]
#[inline(never)]
fn look_at_needles(
    triangles: &[Triangle],
    faces: &[u32],
    needles: u8,
    p: DVec3,
    stride: usize,
    out: &mut [f64],
    at: usize,
) {
    for lane in (0..GROUP).filter(|lane| needles >> lane & 1 == 1) {
        let Some(&face) = faces.get(at + lane).or(faces.last()) else { return };
        let (closest, regions) = triangles[face as usize].closest_and_regions(p);
        let gradient = (p - closest.point) / closest.distance;
        let point = closest.point;
        let seen = [
            closest.distance,
            gradient.x,
            gradient.y,
            gradient.z,
            f64::from(regions.0),
            point.x,
            point.y,
            point.z,
        ];
        for (row, value) in seen.into_iter().enumerate() {
            out[row * stride + at + lane] = value;
        }
    }
}

/// Computes one vector of faces. Returns which of them are needles that `p` seems to be over.
#[inline(always)]
fn look_at<L: Doubles>(shape: &[f64], stride: usize, p: Vector<L>, out: &mut [f64], at: usize) -> u8 {
    let zero = L::splat(0.0);
    let a = Vector::<L>::load(shape, stride, at);
    let b = Vector::<L>::load(&shape[3 * stride..], stride, at);
    let c = Vector::<L>::load(&shape[6 * stride..], stride, at);
    let normal = Vector::<L>::load(&shape[NORMAL * stride..], stride, at);
    let corners = [a, b, c];
    let from = [p.minus(a), p.minus(b), p.minus(c)];
    let along = [b.minus(a), c.minus(b), a.minus(c)];
    let (turned, turned_b) = (from[0].cross(normal), from[1].cross(normal));
    let side = [along[0].dot(turned), along[1].dot(turned_b), along[2].dot(turned)];
    let start = [along[0].dot(from[0]), along[1].dot(from[1]), along[2].dot(from[2])];
    let end = [along[0].dot(from[1]), along[1].dot(from[2]), along[2].dot(from[0])];

    // A zero normal makes all sides zero. Such a face counts as its edges alone.
    let n = normal.0;
    let has_area = L::less(zero, n[0].abs().max(n[1].abs()).max(n[2].abs()));
    let inside = L::both(side[0].at_least(zero), side[1].at_least(zero));
    let inside = L::both(inside, L::both(side[2].at_least(zero), has_area));
    let needle = L::less(zero, L::load(&shape[NEEDLE * stride..], at));

    // The closest edge. Of equally close edges it is the first.
    let mut point = edge_point(corners[0], corners[1], along[0], start[0], end[0]);
    let mut squared = length_squared(p.minus(point));
    let point_1 = edge_point(corners[1], corners[2], along[1], start[1], end[1]);
    let squared_1 = length_squared(p.minus(point_1));
    let nearer = squared_1.less(squared);
    squared = L::select(nearer, squared_1, squared);
    point = Vector::select(nearer, point_1, point);
    let point_2 = edge_point(corners[2], corners[0], along[2], start[2], end[2]);
    let squared_2 = length_squared(p.minus(point_2));
    let nearer = squared_2.less(squared);
    squared = L::select(nearer, squared_2, squared);
    point = Vector::select(nearer, point_2, point);

    let height = normal.dot(from[0]);
    let distance = L::select(inside, height.abs(), squared.sqrt());
    point = Vector::select(inside, p.minus(normal.times(height)), point);
    let gradient = p.minus(point).over(distance);

    let mut regions = bit::<L>(inside, 1.0);
    for k in 0..3 {
        let beside = L::both(zero.at_least(side[k]), L::both(start[k].at_least(zero), zero.at_least(end[k])));
        let beyond = L::both(zero.at_least(start[k]), end[(k + 2) % 3].at_least(zero));
        regions =
            regions.add(bit::<L>(beside, f64::from(2u8 << k))).add(bit::<L>(beyond, f64::from(16u8 << k)));
    }
    // Rounding gives different sides of an edge from its two ends, and then no region at all.
    let is_known = L::both(has_area, L::less(zero, regions));
    regions = L::select(is_known, regions, L::splat(f64::from(Regions::FACE.0)));

    distance.store(out, at);
    gradient.store(&mut out[GRADIENT * stride..], stride, at);
    regions.store(&mut out[REGIONS * stride..], at);
    point.store(&mut out[POINT * stride..], stride, at);
    L::bits(L::both(inside, needle))
}

#[inline(always)]
fn edge_point<L: Doubles>(from: Vector<L>, to: Vector<L>, along: Vector<L>, start: L, end: L) -> Vector<L> {
    let zero = L::splat(0.0);
    let between = from.plus(along.times(start.div(start.sub(end))));
    let beyond = Vector::select(end.at_least(zero), to, between);
    Vector::select(zero.at_least(start), from, beyond)
}

#[inline(always)]
fn bit<L: Doubles>(mask: L::Mask, value: f64) -> L {
    L::select(mask, L::splat(value), L::splat(0.0))
}

#[inline(always)]
fn length_squared<L: Doubles>(v: Vector<L>) -> L {
    v.dot(v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Isa;
    use crate::encode::surface::Touching;
    use crate::mesh::TriangleMesh;
    use crate::testing::degenerate;
    use proptest::prelude::*;

    fn coordinate() -> impl Strategy<Value = f64> {
        // A coarse lattice makes ties and degenerate triangles common. Needles are added to it.
        prop_oneof![3 => (-3i32..4).prop_map(f64::from), 1 => -3.0..3.0f64, 1 => (0i32..4).prop_map(|x| 1e-3 * f64::from(x))]
    }

    proptest! {
        /// Checks degenerate faces: the bits are those of the scalar code, which is exact.
        #[test]
        fn degenerate_faces_equal_the_scalar_code(
            corners in prop::collection::vec(degenerate::face(), 1..20),
            p in degenerate::face().prop_map(|corners| corners[0]),
        ) {
            let vertices: Vec<DVec3> = corners.into_iter().flatten().collect();
            compare(vertices, p)?;
        }

        /// Checks that every instruction set gives the bits of the scalar code.
        #[test]
        fn every_instruction_set_equals_the_scalar_code(
            corners in prop::collection::vec([coordinate(), coordinate(), coordinate()], 9..40),
            p in [coordinate(), coordinate(), coordinate()],
        ) {
            compare(corners.into_iter().map(DVec3::from).collect(), DVec3::from(p))?;
        }
    }

    fn compare(vertices: Vec<DVec3>, p: DVec3) -> Result<(), TestCaseError> {
        let faces = (0..vertices.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let mut surface = Surface::new(&TriangleMesh::new(vertices, faces).unwrap(), 1.0, Touching::Kept);
        let cell = Cell { corners: [p, p + DVec3::X, p + DVec3::Y, p + DVec3::Z], depth: 0 };
        let all: Vec<u32> = (0..surface.faces.len() as u32).collect();
        for &isa in Isa::of_processor() {
            surface.isa = isa;
            let pool = Pool::new(&surface, &all, &cell);
            let mut rows = Vec::new();
            pool.candidates().look_from(&surface, p, &mut rows);
            for (i, triangle) in surface.triangles.iter().enumerate() {
                let (closest, regions) = triangle.closest_and_regions(p);
                let at = |row: usize| rows[row * pool.stride + i];
                let point = DVec3::new(at(POINT), at(POINT + 1), at(POINT + 2));
                prop_assert_eq!((at(0), point), (closest.distance, closest.point), "{:?}", isa);
                prop_assert_eq!(at(REGIONS), f64::from(regions.0), "{:?}", isa);
                let gradient = DVec3::new(at(GRADIENT), at(GRADIENT + 1), at(GRADIENT + 2));
                let expected = (p - closest.point) / closest.distance;
                prop_assert!(closest.distance == 0.0 || gradient == expected, "{:?}", isa);
            }
        }
        Ok(())
    }

    /// The rows of a pool still have the shapes of the faces before.
    #[test]
    fn no_candidates_have_no_nearest_face_whatever_the_pool_had_before() {
        let needle = vec![DVec3::ZERO, DVec3::X, DVec3::new(0.5, 1e-7, 0.0)];
        let mesh = TriangleMesh::new(needle, vec![[0, 1, 2]]).expect("valid ids");
        let mut surface = Surface::new(&mesh, 1.0, Touching::Kept);
        assert!(surface.triangles[0].is_needle());
        let over = DVec3::new(0.5, 5e-8, 0.25);
        let cell = Cell { corners: [over, over + DVec3::X, over + DVec3::Y, over + DVec3::Z], depth: 0 };
        for &isa in Isa::of_processor() {
            surface.isa = isa;
            let mut pool = Pool::new(&surface, &[0], &cell);
            assert!((pool.candidates().nearest[0].distance - 0.25).abs() < 1e-12, "{isa:?}");
            pool.fill(&surface, &[], &cell);
            let candidates = pool.candidates();
            assert!(candidates.faces.is_empty());
            assert!(candidates.nearest.iter().all(|nearest| nearest.distance == f64::INFINITY), "{isa:?}");
        }
    }
}
