//! The deepest point of a polygon in the whole field of a mesh, by the search that clearances use.
//!
//! Besides distances from faces, the planes of faces bound the depth, also beyond the faces. Where
//! a prism is parallel to a hole, so that whole lines are equally deep, branch and bound by
//! distances alone divides such a line into thousands of parts.
use std::ops::ControlFlow;

use arrayvec::ArrayVec;
use glam::DVec3;

use super::Lowest;
use crate::TeSdf;
use crate::collide::bodies::field::{Field, FieldBody};
use crate::collide::bodies::polygon::{MAX_VERTICES, Polygon};
use crate::collide::search::piece::{Looks, Piece, Rest};
use crate::collide::search::queue::Queue;

/// Number of pieces after which a search gives up.
const MAX_PIECES: u32 = 10_000;

/// Whether the planes of a mesh's faces bound the depths that its lists give: the sign changes at
/// faces only, and no list lacks a face.
pub fn has_bounds_by_planes(asset: &TeSdf) -> bool {
    asset.jump().is_none() && asset.has_exact_lists()
}

/// The point with the least signed distance, within `tolerance`, if that distance is at most
/// `reach`. Otherwise the result is only the lowest point seen.
pub fn deepest(asset: &TeSdf, polygon: &Polygon, normal: DVec3, tolerance: f64, reach: f64) -> Lowest {
    let field = &FieldBody::in_own_frame(Field::Mesh(asset));
    // Values above the reach count as the lowest so far. Otherwise a polygon whose least value is
    // the reach, as that of another part of its face, is searched without a tolerance.
    let mut looks = Looks { field, tolerance, limit: f64::INFINITY, least: f64::INFINITY, lowest: None };
    let points: ArrayVec<DVec3, MAX_VERTICES> = polygon.points().collect();
    let triangles: ArrayVec<Piece, MAX_VERTICES> = match points.len() {
        ..=3 => std::iter::once(Piece::of_points(0, &points, normal, 0.0)).collect(),
        n => {
            (2..n).map(|k| Piece::of_points(0, &[points[0], points[k - 1], points[k]], normal, 0.0)).collect()
        }
    };
    // Most deepest points are corners.
    points.iter().for_each(|&corner| looks.corner(&triangles[0], corner));
    let mut open = Queue::new();
    let push = |rest: Rest, open: &mut Queue<Piece>| {
        if let Rest::Pieces(bound, pieces) = rest
            && bound <= reach
        {
            pieces.into_iter().for_each(|piece| open.push(bound, piece));
        }
    };
    triangles.into_iter().for_each(|piece| push(looks.first(piece, f64::NEG_INFINITY), &mut open));
    let mut pieces = 0;
    let converged = open.search(|open, bound, piece| {
        pieces += 1;
        if looks.is_closed(bound) || pieces > MAX_PIECES {
            return ControlFlow::Break(looks.is_closed(bound));
        }
        push(looks.look(piece, bound), open);
        ControlFlow::Continue(())
    });
    let point = looks.lowest.map_or(polygon.center(), |lowest| lowest.point);
    Lowest { point, converged: converged.unwrap_or(true), face: None }
}
