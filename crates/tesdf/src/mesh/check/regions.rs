//! Finds the regions into which other faces cut a face, with a sample point in each.
use std::collections::HashMap;
use std::ops::ControlFlow;

use glam::{DVec2, DVec3};

use crate::{
    geometry::{Aabb, AabbTree, normal_signs, orientation, self_overlaps},
    mesh::{TriangleMesh, topology::DisjointSets},
};

/// A point in a region of a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// The point. It lies on the face up to rounding.
    pub point: DVec3,
    /// Winding number behind the face minus winding number in front of it. It is 1 unless coplanar
    /// faces cover the point too.
    pub jump: i32,
}

/// Sample points in regions of a face.
#[derive(Debug, Default)]
pub(super) struct Samples {
    /// The points.
    pub samples: Vec<Sample>,
    /// Whether every region that is wider than the rounding has a point.
    pub is_complete: bool,
}

/// Largest number of faces that are used to cut a face. When there are more, evenly chosen faces
/// are used.
const CUTS: usize = 1 << 12;
/// Largest number of pieces of a face's segments, besides two per segment. When there are more,
/// evenly chosen pieces get samples.
const PIECES: usize = 64;
/// Largest number of segments in a leaf of the tree.
const LEAF_SIZE: usize = 4;

/// Sample points in the regions into which the faces `others` cut `face`.
///
/// The other faces meet the face in segments, and each segment ends a piece where another segment
/// crosses it. Every region other than the whole face has a piece on its border. So points on both
/// sides of every piece reach every region. Such a point lies halfway between the middle of the
/// piece and the next segment in the direction of an axis. Pieces in a chain, where no other piece
/// ends, have the same two regions. They share one point on each side.
///
/// The side of a plane on which a corner lies is decided exactly. Points of segments and samples
/// are rounded, so regions and pieces narrower than `rounding` get no sample. Not all regions get a
/// sample when more than 4096 faces cut the face, or when there are more than two pieces per
/// segment and 64 more.
pub(super) fn samples(mesh: &TriangleMesh, face: u32, others: &[u32], rounding: f64) -> Samples {
    let corners = mesh.triangle(face as usize);
    let Some(chart) = Chart::new(corners) else { return Samples::default() };
    let mut segments = Vec::new();
    let mut coplanar = Vec::new();
    for &other in others.iter().step_by(others.len().div_ceil(CUTS).max(1)) {
        match in_plane(corners, mesh.triangle(other as usize)) {
            InPlane::Triangle(triangle) => {
                let (flat, turn) = chart.flat_triangle(triangle);
                segments.extend(edges(flat));
                coplanar.push((flat, turn * chart.turn));
            }
            InPlane::Segment(ends) => segments.push(ends.map(|p| chart.flat(p))),
            InPlane::Nothing => {}
        }
    }
    let cuts: Vec<Segment> = segments.into_iter().filter_map(|s| chart.clip(s, rounding)).collect();
    let sample = |q: DVec2| {
        let jump = coplanar.iter().filter(|(t, _)| holds(t, q)).map(|(_, turn)| turn).sum::<i32>();
        Sample { point: chart.lift(q), jump: 1 + jump }
    };
    let (points, all_pieces) = beside_cuts(cuts, &chart, rounding);
    let is_complete = all_pieces && others.len() <= CUTS;
    let beside: Vec<Sample> = points.into_iter().map(sample).collect();
    let samples = if beside.is_empty() { vec![sample(chart.middle())] } else { beside };
    Samples { samples, is_complete }
}

/// The part of a triangle in the plane of another triangle.
enum InPlane {
    Triangle([DVec3; 3]),
    Segment([DVec3; 2]),
    /// Nothing, or only a corner.
    Nothing,
}

fn in_plane([a, b, c]: [DVec3; 3], other: [DVec3; 3]) -> InPlane {
    let signs = other.map(|p| orientation(a, b, c, p));
    if signs == [0; 3] {
        return InPlane::Triangle(other);
    }
    let normal = (b - a).cross(c - a);
    let height = other.map(|p| normal.dot(p - a).abs());
    let mut points = Vec::with_capacity(2);
    for k in 0..3 {
        let l = (k + 1) % 3;
        if signs[k] == 0 {
            points.push(other[k]);
        }
        if signs[k] * signs[l] < 0 {
            let share = height[k] / (height[k] + height[l]);
            // Both heights may be rounded to 0.
            let share = if share.is_finite() { share } else { 0.5 };
            points.push(other[k].lerp(other[l], share));
        }
    }
    match points[..] {
        [p, q] => InPlane::Segment([p, q]),
        _ => InPlane::Nothing,
    }
}

type Segment = [DVec2; 2];

fn edges<T: Copy>([a, b, c]: [T; 3]) -> [[T; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Whether a counter-clockwise triangle contains a point.
fn holds(triangle: &[DVec2; 3], q: DVec2) -> bool {
    edges(*triangle).iter().all(|&[a, b]| (b - a).perp_dot(q - a) >= 0.0)
}

/// The plane of a face, projected along the axis that is nearest to its normal.
struct Chart {
    corners: [DVec3; 3],
    /// The projected corners, counter-clockwise.
    flat: [DVec2; 3],
    /// The axis of the projection.
    along: usize,
    /// 1 when the projected face is counter-clockwise. -1 when two corners were swapped in
    /// `corners` and `flat`.
    turn: i32,
}

impl Chart {
    /// `None` when the area is 0 after rounding.
    fn new([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let normal = (b - a).cross(c - a);
        let along = normal.abs().max_position();
        let turn = normal_signs(a, b, c)[along];
        let corners = if turn > 0 { [a, b, c] } else { [a, c, b] };
        let chart = Self { corners, flat: [DVec2::ZERO; 3], along, turn };
        let chart = Self { flat: corners.map(|p| chart.flat(p)), ..chart };
        (chart.double_area() > 0.0).then_some(chart)
    }

    fn flat(&self, p: DVec3) -> DVec2 {
        DVec2::new(p[(self.along + 1) % 3], p[(self.along + 2) % 3])
    }

    /// Projects a triangle of the plane and makes it counter-clockwise. The sign is -1 when two
    /// corners were swapped.
    fn flat_triangle(&self, [a, b, c]: [DVec3; 3]) -> ([DVec2; 3], i32) {
        let turn = normal_signs(a, b, c)[self.along];
        let corners = if turn > 0 { [a, b, c] } else { [a, c, b] };
        (corners.map(|p| self.flat(p)), turn)
    }

    fn double_area(&self) -> f64 {
        let [a, b, c] = self.flat;
        (b - a).perp_dot(c - a)
    }

    /// The point of the face whose projection is `q`.
    fn lift(&self, q: DVec2) -> DVec3 {
        let ([a, b, c], [p, u, v]) = (self.flat, self.corners);
        let (s, t) = ((q - a).perp_dot(c - a), (b - a).perp_dot(q - a));
        p + (s * (u - p) + t * (v - p)) / self.double_area()
    }

    /// A point inside the face. It is not the centroid, because a corner of another face may touch
    /// the centroid.
    fn middle(&self) -> DVec2 {
        let [a, b, c] = self.flat;
        0.346 * a + 0.331 * b + 0.323 * c
    }

    /// The part of a segment that lies on the face; `None` when it is not longer than `rounding`.
    fn clip(&self, [p, q]: Segment, rounding: f64) -> Option<Segment> {
        let (mut from, mut to) = (0.0f64, 1.0f64);
        for [a, b] in edges(self.flat) {
            let (at_p, at_q) = ((b - a).perp_dot(p - a), (b - a).perp_dot(q - a));
            let crossing = at_p / (at_p - at_q);
            match (at_p < 0.0, at_q < 0.0) {
                (true, true) => return None,
                (true, false) => from = from.max(crossing),
                (false, true) => to = to.min(crossing),
                (false, false) => {}
            }
        }
        let clipped = [p.lerp(q, from), p.lerp(q, to)];
        (from < to && clipped[0].distance(clipped[1]) > rounding).then_some(clipped)
    }
}

/// A part of a segment that no other segment crosses.
#[derive(Clone, Copy)]
struct Piece {
    ends: Segment,
}

impl Piece {
    fn middle(&self) -> DVec2 {
        self.ends[0].midpoint(self.ends[1])
    }

    /// Directions to the left and to the right side, seen along the piece from its first end to its
    /// second.
    ///
    /// They are parallel to an axis, because the boxes of a tree that meet such a ray are found
    /// without rounding.
    fn across(&self) -> [DVec2; 2] {
        let along = self.ends[1] - self.ends[0];
        let left = match along.x.abs() >= along.y.abs() {
            true => DVec2::Y * along.x.signum(),
            false => DVec2::NEG_X * along.y.signum(),
        };
        [left, -left]
    }
}

/// Points on the face on both sides of the pieces, and whether these are all pieces.
fn beside_cuts(cuts: Vec<Segment>, chart: &Chart, rounding: f64) -> (Vec<DVec2>, bool) {
    let count = cuts.len();
    let mut segments = cuts;
    segments.extend(edges(chart.flat));
    let box_of = |[p, q]: &Segment| Aabb::of(&[p.extend(0.0), q.extend(0.0)]).grown(rounding);
    let boxes: Vec<Aabb> = segments.iter().map(box_of).collect();
    let tree = AabbTree::build(&boxes, LEAF_SIZE);
    let mut pieces = pieces(&segments, count, &tree, &boxes, rounding);
    let is_complete = pieces.len() <= PIECES + 2 * count;
    let chain = if is_complete {
        chains(&pieces, rounding)
    } else {
        let every = pieces.len().div_ceil(PIECES + count);
        pieces = pieces.into_iter().step_by(every).collect();
        (0..2 * pieces.len() as u32).collect()
    };
    // For each side of a chain, the point with the largest clearance.
    let mut best: Vec<Option<(f64, DVec2)>> = vec![None; chain.len()];
    for (i, piece) in pieces.iter().enumerate() {
        for (side, direction) in piece.across().into_iter().enumerate() {
            let middle = piece.middle();
            let known = &mut best[chain[2 * i + side] as usize];
            if let Some(free) = clearance(&tree, &boxes, &segments, middle, direction, rounding)
                && known.is_none_or(|(most, _)| free > most)
            {
                *known = Some((free, middle + 0.5 * free * direction));
            }
        }
    }
    (best.into_iter().flatten().map(|(_, point)| point).collect(), is_complete)
}

/// The first `count` segments, cut where other segments cross them.
fn pieces(segments: &[Segment], count: usize, tree: &AabbTree, boxes: &[Aabb], rounding: f64) -> Vec<Piece> {
    let mut crossings = vec![vec![0.0, 1.0]; count];
    // The closure never breaks off.
    let _ = self_overlaps(tree, boxes, |i, j| {
        let (i, j) = (i as usize, j as usize);
        if j < count
            && let Some([s, t]) = crossing(segments[i], segments[j], rounding)
        {
            crossings[i].push(s);
            crossings[j].push(t);
        }
        ControlFlow::Continue(())
    });
    let mut pieces = Vec::new();
    for (shares, [p, q]) in crossings.iter_mut().zip(segments) {
        shares.sort_unstable_by(f64::total_cmp);
        let ends = shares.windows(2).map(|w| [w[0], w[1]].map(|share| p.lerp(*q, share)));
        pieces.extend(ends.filter(|[a, b]| a.distance(*b) > rounding).map(|ends| Piece { ends }));
    }
    pieces
}

/// For the left side (index `2 i`) and the right side (`2 i + 1`) of each piece, the lowest index
/// among the sides on the same side of its chain.
fn chains(pieces: &[Piece], rounding: f64) -> Vec<u32> {
    // Ends at one point lie in one cell of the grid or in two cells that touch.
    let cell = |p: DVec2| (p / (8.0 * rounding)).round().to_array().map(|c| c as i64);
    let mut ends: HashMap<[i64; 2], Vec<(u32, usize)>> = HashMap::new();
    for (i, piece) in pieces.iter().enumerate() {
        for (end, &p) in piece.ends.iter().enumerate() {
            ends.entry(cell(p)).or_default().push((i as u32, end));
        }
    }
    let mut sides = DisjointSets::new(2 * pieces.len());
    for (i, piece) in pieces.iter().enumerate() {
        for (end, &p) in piece.ends.iter().enumerate() {
            let [x, y] = cell(p);
            let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [x + dx, y + dy]));
            let here: Vec<(u32, usize)> = around.filter_map(|c| ends.get(&c)).flatten().copied().collect();
            let others: Vec<_> = here.iter().filter(|e| **e != (i as u32, end)).collect();
            if let [&(j, other)] = others[..]
                && j != i as u32
            {
                // When an end meets a beginning, the left side continues as the left side.
                let turned = u32::from(end == other);
                (0..2).for_each(|side| sides.join(2 * i as u32 + side, 2 * j + (side ^ turned)));
            }
        }
    }
    (0..2 * pieces.len() as u32).map(|side| sides.find(side)).collect()
}

/// The point where two segments cross or touch, as fractions of both lengths; `None` for parallel
/// segments or when they do not meet.
fn crossing([p, q]: Segment, [r, s]: Segment, rounding: f64) -> Option<[f64; 2]> {
    let (along, other) = (q - p, s - r);
    let turn = along.perp_dot(other);
    let [t, u] = [(r - p).perp_dot(other) / turn, (r - p).perp_dot(along) / turn];
    let within = |share: f64, length: f64| -rounding <= share * length && (share - 1.0) * length <= rounding;
    let meet = turn != 0.0 && within(t, along.length()) && within(u, other.length());
    meet.then(|| [t.clamp(0.0, 1.0), u.clamp(0.0, 1.0)])
}

/// Distance from a point along an axis to the first segment beyond `rounding`; `None` when there is
/// none.
fn clearance(
    tree: &AabbTree,
    boxes: &[Aabb],
    segments: &[Segment],
    from: DVec2,
    direction: DVec2,
    rounding: f64,
) -> Option<f64> {
    let axis = direction.abs().max_position();
    let (sign, aside) = (direction[axis], 1 - axis);
    let at = from.extend(0.0);
    let ray = Aabb::of(&[at, at + direction.extend(0.0) * f64::MAX]);
    let mut nearest: Option<f64> = None;
    let mut meet = |[p, q]: Segment| {
        let width = q[aside] - p[aside];
        let share = (from[aside] - p[aside]) / width;
        let ahead = |at: DVec2| sign * (at[axis] - from[axis]);
        // A segment parallel to the ray is met at its nearer end.
        let distance = match share.is_finite() && width.abs() > rounding {
            true => ahead(p.lerp(q, share.clamp(0.0, 1.0))),
            false => ahead(p).min(ahead(q)),
        };
        if distance > rounding && nearest.is_none_or(|n| distance < n) {
            nearest = Some(distance);
        }
    };
    tree.visit(
        |bounds| bounds.overlaps(ray),
        |items| {
            let met = items.iter().map(|&i| i as usize).filter(|&i| boxes[i].overlaps(ray));
            met.for_each(|i| meet(segments[i]));
        },
    );
    nearest
}
