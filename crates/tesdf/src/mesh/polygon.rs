//! Triangulates one polygon of a mesh file.
//!
//! Input: the positions of the polygon's corners in 3-D, in order. Output: triangles of corner
//! indices, oriented as the polygon.
//!
//! Every corner becomes a corner of some triangle, also a flat corner (on the line between its
//! neighbours). A neighbour face uses that corner, so dropping it would open a T-junction. For this
//! reason no earcut crate is used: `earcut` 0.4.8 and `earcutr` 0.5.0 remove flat corners before
//! they clip (`filter_points`), and leave it to the caller to check the result (`deviation`).
use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

/// The shape of a polygon, seen along its normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// Convex. When no corner next to the first is flat, the triangles are a fan around the first
    /// corner.
    Convex,
    /// Simple but not convex. Ear clipping gives triangles that do not overlap.
    Concave,
    /// The polygon has no area, its outline crosses itself, or it is so intricate that
    /// [`EarClipper`] reached its step limit. Some triangle is flat or flipped.
    Irregular,
}

/// Splits a polygon of three or more corners and appends its `corners.len() - 2` triangles.
///
/// Orientation is decided exactly (`robust`) on the coordinate plane most nearly parallel to the
/// polygon's Newell plane. Projecting by dropping a coordinate causes no rounding.
pub(super) fn triangulate(corners: &[DVec3], triangles: &mut Vec<[u32; 3]>) -> Shape {
    let n = corners.len();
    if n < 3 {
        return Shape::Irregular;
    }
    if n == 3 {
        triangles.push([0, 1, 2]);
        return Shape::Convex;
    }
    let flat = project(corners);
    let turn = |a: usize, b: usize, c: usize| orient(flat[a], flat[b], flat[c]);
    // The third condition excludes a locally convex outline that goes round more than once.
    let fan = (1..n - 1).all(|i| turn(0, i, i + 1) > 0.0)
        && (0..n).all(|i| turn(i, (i + 1) % n, (i + 2) % n) >= 0.0)
        && (2..n).all(|i| turn(0, 1, i) >= 0.0);
    if fan {
        triangles.extend((1..n as u32 - 1).map(|i| [0, i, i + 1]));
        return Shape::Convex;
    }
    let convex = (0..n).all(|i| turn(i, (i + 1) % n, (i + 2) % n) >= 0.0);
    let first = triangles.len();
    EarClipper::new(&flat).clip(triangles);
    let positive = triangles[first..].iter().all(|t| {
        let [a, b, c] = t.map(|v| v as usize);
        turn(a, b, c) > 0.0
    });
    // The oriented outlines of the triangles add up to the polygon's outline. So when all triangles
    // are positive, each point inside a simple polygon is covered once.
    match (positive, convex) {
        (false, _) => Shape::Irregular,
        (true, true) => Shape::Convex,
        (true, false) => Shape::Concave,
    }
}

/// Drops the coordinate in which the Newell normal is largest, and keeps counter-clockwise order.
pub(super) fn project(corners: &[DVec3]) -> Vec<DVec2> {
    let origin = corners[0];
    let mut normal = DVec3::ZERO;
    for (i, &p) in corners.iter().enumerate() {
        let q = corners[(i + 1) % corners.len()];
        normal += (p - origin).cross(q - origin);
    }
    let size = normal.abs();
    let (axis, sign) = if size.x >= size.y && size.x >= size.z {
        (0, normal.x)
    } else if size.y >= size.z {
        (1, normal.y)
    } else {
        (2, normal.z)
    };
    let pick = |p: &DVec3| match axis {
        0 => DVec2::new(p.y, p.z),
        1 => DVec2::new(p.z, p.x),
        _ => DVec2::new(p.x, p.y),
    };
    let turned = |p: &DVec3| {
        let q = pick(p);
        DVec2::new(q.y, q.x)
    };
    if sign < 0.0 { corners.iter().map(turned).collect() } else { corners.iter().map(pick).collect() }
}

/// Positive when the corners are counter-clockwise, 0 when they are on one line; exact.
pub(super) fn orient(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// The part of the outline that is not clipped yet, as a ring.
struct EarClipper<'a> {
    points: &'a [DVec2],
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Corners that were not strictly convex when last tested. Only these can block an ear.
    blockers: Vec<u32>,
    blocks: Vec<bool>,
    /// For each corner, the corner that was found inside its ear last.
    blocked_by: Vec<Option<u32>>,
    /// Steps left. At 0, every corner is clipped without a test.
    steps: u64,
}

/// Step limit per corner of a polygon. Ear clipping can take cubic time; the limit keeps hostile
/// files linear in their size. Combs and spirals of 30,000 corners, which are simple, stay below it
/// (1.1 s and 1.4 s). 30,000 random corners, which cross, reach it (4 s).
const STEPS_PER_CORNER: u64 = 1 << 16;

impl<'a> EarClipper<'a> {
    fn new(points: &'a [DVec2]) -> Self {
        let n = points.len() as u32;
        let mut ring = Self {
            points,
            next: (0..n).map(|i| (i + 1) % n).collect(),
            previous: (0..n).map(|i| (i + n - 1) % n).collect(),
            blockers: Vec::new(),
            blocks: vec![false; points.len()],
            blocked_by: vec![None; points.len()],
            steps: points.len() as u64 * STEPS_PER_CORNER,
        };
        for i in 0..n {
            if ring.turn(i) <= 0.0 {
                ring.blocks[i as usize] = true;
                ring.blockers.push(i);
            }
        }
        ring
    }

    fn turn(&self, i: u32) -> f64 {
        let [a, b, c] = self.ear(i).map(|v| self.points[v as usize]);
        orient(a, b, c)
    }

    fn ear(&self, i: u32) -> [u32; 3] {
        [self.previous[i as usize], i, self.next[i as usize]]
    }

    /// Whether no other corner lies in or on the ear at `i`. Corners at the position of one of the
    /// ear's own corners do not count: the two sides of a bridge to a hole coincide.
    fn is_free(&mut self, i: u32) -> bool {
        let ear = self.ear(i);
        let [a, b, c] = ear.map(|v| self.points[v as usize]);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let inside = |&v: &u32| {
            let p = self.points[v as usize];
            self.blocks[v as usize]
                && !ear.contains(&v)
                && p.cmpge(low).all()
                && p.cmple(high).all()
                && ![a, b, c].contains(&p)
                && orient(a, b, p) >= 0.0
                && orient(b, c, p) >= 0.0
                && orient(c, a, p) >= 0.0
        };
        // The corner that blocked this ear before usually still blocks it.
        if self.blocked_by[i as usize].as_ref().is_some_and(inside) {
            return false;
        }
        let blocker = self.blockers.iter().position(inside);
        self.blocked_by[i as usize] = blocker.map(|at| self.blockers[at]);
        self.steps = self.steps.saturating_sub(blocker.unwrap_or(self.blockers.len()) as u64);
        blocker.is_none()
    }

    fn clip(mut self, triangles: &mut Vec<[u32; 3]>) {
        let mut left = self.points.len();
        let mut at = 0;
        let mut tried = 0;
        while left > 3 {
            // An outline that crosses itself can have no free ear. Then any strictly convex corner
            // is clipped, or any corner when there is none.
            self.steps = self.steps.saturating_sub(1);
            let take = if self.steps == 0 {
                true
            } else if tried < left {
                self.turn(at) > 0.0 && self.is_free(at)
            } else {
                tried >= 2 * left || self.turn(at) > 0.0
            };
            if !take {
                tried += 1;
                at = self.next[at as usize];
                continue;
            }
            triangles.push(self.ear(at));
            let [before, _, after] = self.ear(at);
            self.next[before as usize] = after;
            self.previous[after as usize] = before;
            self.blocks[at as usize] = false;
            left -= 1;
            tried = 0;
            for v in [before, after] {
                if self.blocks[v as usize] && self.turn(v) > 0.0 {
                    self.blocks[v as usize] = false;
                } else if !self.blocks[v as usize] && self.turn(v) <= 0.0 {
                    self.blocks[v as usize] = true;
                    if !self.blockers.contains(&v) {
                        self.blockers.push(v);
                    }
                }
            }
            // Skipping two corners gives rounder triangles than a fan around `before`.
            at = self.next[after as usize];
            if left.is_multiple_of(64) {
                self.blockers.retain(|&v| self.blocks[v as usize]);
            }
        }
        triangles.push(self.ear(at));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lift(points: &[(f64, f64)]) -> Vec<DVec3> {
        points.iter().map(|&(x, y)| DVec3::new(x, 2.0 * x - y, y)).collect()
    }

    /// Triangles, their shape, and their summed area divided by the polygon's area.
    fn split(corners: &[DVec3]) -> (Vec<[u32; 3]>, Shape, f64) {
        let mut triangles = Vec::new();
        let shape = triangulate(corners, &mut triangles);
        let cross = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a);
        let sum: f64 = triangles
            .iter()
            .map(|t| t.map(|v| corners[v as usize]))
            .map(|[a, b, c]| cross(a, b, c).length())
            .sum();
        let whole: DVec3 =
            (1..corners.len() - 1).map(|i| cross(corners[0], corners[i], corners[i + 1])).sum();
        (triangles, shape, sum / whole.length())
    }

    #[test]
    fn convex_polygons_become_fans() {
        let (triangles, shape, _) = split(&lift(&[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]));
        assert_eq!((triangles, shape), (vec![[0, 1, 2], [0, 2, 3]], Shape::Convex));
    }

    #[test]
    fn flat_corners_are_kept_and_no_triangle_is_flat() {
        // Corners 1 and 2 lie on the first edge, 4 on the second.
        let corners = lift(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (4.0, 0.0), (2.0, 2.0), (0.0, 4.0)]);
        for start in 0..corners.len() {
            let mut turned = corners.clone();
            turned.rotate_left(start);
            let (triangles, shape, area) = split(&turned);
            assert_eq!(shape, Shape::Convex);
            assert_eq!(triangles.len(), 4);
            assert!((area - 1.0).abs() < 1e-12);
            for v in 0..6 {
                assert!(triangles.iter().flatten().any(|&c| c == v), "corner {v} is gone");
            }
        }
    }

    #[test]
    fn concave_polygons_keep_their_area_from_each_corner_and_in_both_directions() {
        let l = lift(&[(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)]);
        let dart = lift(&[(0.0, 0.0), (2.0, -1.0), (0.5, 0.0), (2.0, 1.0)]);
        let star: Vec<_> = (0..40)
            .map(|i| {
                let (radius, angle) = ([1.0, 0.2][i % 2], i as f64 * std::f64::consts::TAU / 40.0);
                (radius * angle.cos(), radius * angle.sin())
            })
            .collect();
        for corners in [l, dart, lift(&star)] {
            for start in 0..corners.len() {
                for reversed in [false, true] {
                    let mut turned = corners.clone();
                    turned.rotate_left(start);
                    if reversed {
                        turned.reverse();
                    }
                    let (triangles, shape, area) = split(&turned);
                    assert_eq!(shape, Shape::Concave);
                    assert_eq!(triangles.len(), corners.len() - 2);
                    assert!((area - 1.0).abs() < 1e-12, "area {area}");
                }
            }
        }
    }

    #[test]
    fn long_outlines_are_split_without_overlap() {
        let comb = (0..2000).map(|i| (f64::from(i), f64::from(i % 2))).chain([(2000.0, 5.0), (-1.0, 5.0)]);
        let turn = |i: u32, start: f64| {
            let angle = f64::from(i) * 0.05;
            let radius = angle + start;
            (radius * angle.cos(), radius * angle.sin())
        };
        let spiral = (0..1000).map(|i| turn(i, 3.0)).chain((0..1000).rev().map(|i| turn(i, 1.0)));
        for outline in [comb.collect::<Vec<_>>(), spiral.collect()] {
            let (triangles, shape, area) = split(&lift(&outline));
            assert_eq!((triangles.len(), shape), (outline.len() - 2, Shape::Concave));
            assert!((area - 1.0).abs() < 1e-9, "area {area}");
        }
    }

    #[test]
    fn a_hole_reached_by_a_bridge_is_left_out() {
        let corners = lift(&[
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 4.0),
            (0.0, 4.0),
            (0.0, 0.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (3.0, 3.0),
            (3.0, 1.0),
            (1.0, 1.0),
        ]);
        let (triangles, shape, area) = split(&corners);
        assert_eq!((triangles.len(), shape), (8, Shape::Concave));
        assert!((area - 1.0).abs() < 1e-12);
    }

    #[test]
    fn outlines_without_a_triangulation_are_named_irregular() {
        let bow = lift(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]);
        let line = lift(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (1.5, 0.0)]);
        let pentagram: Vec<_> = (0..5)
            .map(|i| (2.0 * std::f64::consts::TAU * i as f64 / 5.0).sin_cos())
            .map(|(y, x)| (x, y))
            .collect();
        for corners in [bow, line, lift(&pentagram), vec![DVec3::MAX; 5], vec![DVec3::ZERO; 4]] {
            let mut triangles = Vec::new();
            assert_eq!(triangulate(&corners, &mut triangles), Shape::Irregular);
            assert_eq!(triangles.len(), corners.len() - 2);
        }
    }
}
