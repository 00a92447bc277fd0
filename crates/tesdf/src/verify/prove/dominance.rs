//! Whether the list is nearer than a part of the surface all over a piece: the ball, the point and the plane.
use arrayvec::ArrayVec;
use glam::DVec3;

use super::parts::{Bound, Face, Part};
use super::piece::Piece;

/// A face of the list, with what the corners of a piece see of it.
#[derive(Clone, Copy, Debug)]
pub struct Rival {
    /// Its place in the list.
    pub at: u32,
    /// At least its distance from each corner.
    pub high: [f64; 4],
}

/// The face of the list that a corner is nearest to.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Its place in the list.
    pub at: u32,
    /// At least its distance.
    pub high: f64,
    /// The point of it that is nearest, nearly.
    pub point: DVec3,
}

impl Nearest {
    /// Farther than everything.
    pub const NONE: Self = Self { at: 0, high: f64::INFINITY, point: DVec3::INFINITY };

    /// The nearer of both.
    pub fn or(self, at: u32, x: DVec3, high: Bound) -> Self {
        if high.distance < self.high {
            Self { at, high: high.distance, point: x - high.offset }
        } else {
            self
        }
    }
}

/// Share of `delta` that each of the three tests may cost.
pub const COST: f64 = 0.5;
/// Share of `delta` that the corners may be nearer by in the point test.
const POINT_SLACK: f64 = 0.125;

/// A point of a face of the list, as the corners of a piece see it.
struct Target {
    /// At least the distance from each corner.
    high: [f64; 4],
    /// How much nearer than that the part may be at a corner.
    slack: f64,
}

/// What the three tests need of a piece.
pub struct Dominance {
    center: DVec3,
    radius: f64,
    /// At least the distance of the list from the centre.
    high: f64,
    error: f64,
    cost: f64,
    /// Corners, relative to the centre.
    corners: [DVec3; 4],
    at_corners: [DVec3; 4],
    rivals: Vec<Rival>,
    targets: ArrayVec<Target, 9>,
    /// Normals of the faces of the list that the corners and the centre are nearest to, towards the centre.
    normals: ArrayVec<DVec3, 5>,
}

impl Dominance {
    /// `nearest` are those of the corners, then that of the centre.
    pub fn new(
        piece: &Piece,
        rivals: Vec<Rival>,
        list: &[Face],
        nearest: &[Nearest; 5],
        error: f64,
        delta: f64,
    ) -> Self {
        let (center, radius) = piece.ball();
        let own = &list[nearest[4].at as usize];
        let points = nearest.iter().map(|n| n.point);
        let points = points.chain(piece.corners.iter().map(|&c| c - own.high(c, error).offset));
        let target = |q: DVec3| {
            let high = piece.corners.map(|c| c.distance(q) + error);
            let farthest = high.iter().fold(0.0, |most: f64, &h| most.max(h));
            let slack = if farthest >= 4.0 * radius { POINT_SLACK * delta } else { 0.0 };
            Target { high, slack }
        };
        let towards = |face: &Face| {
            let normal = face.normal()?;
            Some(if normal.dot(center - face.corners[0]) >= 0.0 { normal } else { -normal })
        };
        let mut normals = ArrayVec::new();
        for normal in nearest.iter().filter_map(|n| towards(&list[n.at as usize])) {
            if !normals.contains(&normal) {
                normals.push(normal);
            }
        }
        Self {
            center,
            radius,
            high: nearest[4].high,
            error,
            cost: COST * delta,
            corners: piece.corners.map(|c| c - center),
            at_corners: piece.corners,
            rivals,
            targets: points.map(target).collect(),
            normals,
        }
    }

    /// What the centre sees of a part, unless the list is nearer than the part all over the piece as the ball shows.
    pub fn unless_by_ball(&self, part: Part) -> Option<Bound> {
        let low = part.low(self.center, self.error);
        let is_nearer = self.high + 2.0 * self.radius <= low.distance + self.cost;
        (!is_nearer).then_some(low)
    }

    /// Whether the list is nearer than a part, up to [`COST`], all over the piece, as the point or the plane shows. `low` are
    /// bounds of the part's distance from the corners, `center` is what the centre sees of it.
    pub fn is_nearer(&self, part: Part, low: &[f64; 4], center: Bound) -> bool {
        self.by_point(low) || self.by_plane(part, center)
    }

    fn by_point(&self, low: &[f64; 4]) -> bool {
        self.targets.iter().any(|t| (0..4).all(|k| low[k] + t.slack >= t.high[k]))
    }

    fn by_plane(&self, part: Part, center: Bound) -> bool {
        let corners = part.corners();
        let shows = |direction: DVec3| {
            let Some(s) = direction.try_normalize() else { return false };
            let front = corners.iter().map(|&z| s.dot(z - self.center)).fold(f64::NEG_INFINITY, f64::max);
            let low = self.corners.map(|c| s.dot(c) - front - self.error + self.cost);
            self.rivals.iter().any(|r| (0..4).all(|k| r.high[k] <= low[k]))
        };
        let own = part.normal().map(|n| if n.dot(center.offset) >= 0.0 { n } else { -n });
        shows(center.offset)
            || own.is_some_and(shows)
            || self.at_corners.iter().any(|&c| shows(part.low(c, self.error).offset))
            || self.normals.iter().any(|&n| shows(n))
    }
}
