//! The point of a segment or triangle that is lowest in the field of a cylinder.
//!
//! The gradient of this field is in the plane through the axis and the point. At a lowest point
//! within a triangle it is along the normal, so the normal is in this plane, too: the point is on
//! the line in the triangle that the plane through the axis and the normal cuts out. So the lowest
//! point of a triangle is that of one of four segments. Along a segment, the field is convex.
use glam::DVec3;

use crate::collide::scene::cylinder::Cylinder;

/// A field with a smaller slope is level, up to rounding.
const LEVEL: f64 = 1e-14;

/// A bound of the halvings of a segment: the numbers of a double between 0 and 1 that are not tiny.
const HALVINGS: usize = 64;

/// Offers points of one to three points and what is between them, one of which is lowest. The first
/// ones are the points themselves. `normal` is that of a triangle; zero where it has no area.
pub fn offer_lowest(cylinder: &Cylinder, points: &[DVec3], normal: DVec3, offer: &mut impl FnMut(DVec3)) {
    points.iter().for_each(|&p| offer(p));
    let mut between = |from: DVec3, to: DVec3| {
        if let Some(p) = lowest_between(cylinder, from, to) {
            offer(p);
        }
    };
    match *points {
        [a, b] => between(a, b),
        [a, b, c] => {
            [(a, b), (b, c), (c, a)].into_iter().for_each(|(from, to)| between(from, to));
            if let Some([from, to]) = steepest_chord([a, b, c], normal) {
                between(from, to);
            }
        }
        _ => {}
    }
}

/// The part of a triangle in the plane through the z axis and the normal.
fn steepest_chord(corners: [DVec3; 3], normal: DVec3) -> Option<[DVec3; 2]> {
    if normal == DVec3::ZERO {
        return None;
    }
    // Of a horizontal triangle, any line through the axis holds the point that is nearest to it.
    let across = normal.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::Y);
    let heights = corners.map(|p| across.dot(p));
    let mut ends = (0..3).filter_map(|k| {
        let l = (k + 1) % 3;
        let (from, to) = (heights[k], heights[l]);
        (from * to < 0.0).then(|| corners[k].lerp(corners[l], from / (from - to)))
    });
    let on_line = || (0..3).find(|&k| heights[k] == 0.0).map(|k| corners[k]);
    let from = ends.next()?;
    Some([from, ends.next().or_else(on_line)?])
}

/// The lowest point between two points; `None` where it is one of them.
fn lowest_between(cylinder: &Cylinder, from: DVec3, to: DVec3) -> Option<DVec3> {
    let way = to - from;
    let level = LEVEL * way.length();
    let slope = |t: f64| cylinder.value(from.lerp(to, t)).1.dot(way);
    let (mut low, mut high) = ((0.0, slope(0.0)), (1.0, slope(1.0)));
    if !(low.1 < 0.0 && high.1 > 0.0) {
        return None;
    }
    for k in 0..2 * HALVINGS {
        // Where the slope changes smoothly, the secant is much nearer than the middle.
        let t = match k % 2 {
            0 => low.0 + (high.0 - low.0) * (low.1 / (low.1 - high.1)),
            _ => 0.5 * (low.0 + high.0),
        };
        if !(t > low.0 && t < high.0) {
            break;
        }
        let at = (t, slope(t));
        if at.1.abs() <= level {
            return Some(from.lerp(to, t));
        }
        *(if at.1 < 0.0 { &mut low } else { &mut high }) = at;
    }
    // Where the slope jumps, both ends are next to it.
    let [p, q] = [low.0, high.0].map(|t| from.lerp(to, t));
    Some(if cylinder.value(q).0 < cylinder.value(p).0 { q } else { p })
}
