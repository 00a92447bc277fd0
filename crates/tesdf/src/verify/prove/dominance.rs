//! Tests whether the list is nearer than a part of the surface everywhere on a piece: the ball
//! rule, the point rule and the plane rule.
use arrayvec::ArrayVec;
use glam::DVec3;

use super::parts::{Bound, Face, Part};
use super::piece::Piece;

/// A face of the list with its distance bounds at the corners of a piece.
#[derive(Clone, Copy, Debug)]
pub struct Rival {
    /// Its index in the list.
    pub at: u32,
    /// Upper bounds of its distance from each corner.
    pub high: [f64; 4],
}

/// The face of the list that is nearest to a point.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Its index in the list.
    pub at: u32,
    /// Upper bound of its distance.
    pub high: f64,
    /// Its nearest point, up to rounding.
    pub point: DVec3,
}

impl Nearest {
    /// Farther than every face.
    pub const NONE: Self = Self { at: 0, high: f64::INFINITY, point: DVec3::INFINITY };

    /// The nearer one of `self` and face `at`, which has the bound `high` at `x`.
    pub fn or(self, at: u32, x: DVec3, high: Bound) -> Self {
        if high.distance < self.high {
            Self { at, high: high.distance, point: x - high.offset }
        } else {
            self
        }
    }
}

/// Fraction of `delta` that each of the three rules may cost.
pub const COST: f64 = 0.5;
/// Fraction of `delta` by which the part may be nearer at the corners in the point rule.
const POINT_SLACK: f64 = 0.125;

/// A point of a face of the list, seen from the corners of a piece.
struct Target {
    /// Upper bounds of its distance from each corner.
    high: [f64; 4],
    /// The part may be nearer than these bounds at a corner by this much.
    slack: f64,
}

/// Data of a piece for the three rules.
pub struct Dominance {
    center: DVec3,
    radius: f64,
    /// Upper bound of the distance of the list from the centre.
    high: f64,
    error: f64,
    cost: f64,
    /// Corners, relative to the centre.
    corners: [DVec3; 4],
    at_corners: [DVec3; 4],
    rivals: Vec<Rival>,
    targets: ArrayVec<Target, 9>,
    /// Unit normals, towards the centre, of the faces of the list that are nearest to the corners
    /// and to the centre.
    normals: ArrayVec<DVec3, 5>,
}

impl Dominance {
    /// `nearest` has the nearest faces of the four corners, then that of the centre.
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

    /// Lower bound of the part's distance from the centre; `None` when the ball rule proves that
    /// the list is nearer than the part everywhere on the piece.
    pub fn unless_by_ball(&self, part: Part) -> Option<Bound> {
        let low = part.low(self.center, self.error);
        let is_nearer = self.high + 2.0 * self.radius <= low.distance + self.cost;
        (!is_nearer).then_some(low)
    }

    /// Whether the point rule or the plane rule proves that the list is nearer than a part
    /// everywhere on the piece, up to [`COST`]. `low` are lower bounds of the part's distance from
    /// the corners, `center` is the bound at the centre.
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
