//! Pairs the faces around an edge with more than two faces.
use glam::DVec3;

use super::{Draft, holes::around};
use crate::mesh::topology::{Edge, EdgeUse};

/// Directions around an edge that differ by less than this are the same up to rounding.
const SAME_ANGLE: f64 = 1e-9;

/// Pairs of neighbours around an edge. There are two ways to pair them. The faces agree best in
/// the chosen way; if they agree equally well in both, the angles within its pairs are smaller.
/// `None` when a face has no area, or the number of faces is odd.
pub(super) fn pairs(draft: &Draft, edge: &Edge, uses: &[EdgeUse]) -> Option<Vec<[EdgeUse; 2]>> {
    if !uses.len().is_multiple_of(2) {
        return None;
    }
    let [a, b] = edge.vertices.map(|v| draft.vertices[v as usize]);
    let axis = (b - a).try_normalize()?;
    let across = |u: &EdgeUse| {
        let apex = draft.faces[u.face as usize].into_iter().find(|v| !edge.vertices.contains(v))?;
        (draft.vertices[apex as usize] - a).reject_from_normalized(axis).try_normalize()
    };
    let first = across(uses.first()?)?;
    let side: DVec3 = axis.cross(first);
    let mut turned: Vec<(f64, EdgeUse)> = Vec::with_capacity(uses.len());
    for u in uses {
        let direction = across(u)?;
        turned.push((around(first.dot(direction), side.dot(direction)), *u));
    }
    turned.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.face.cmp(&y.1.face)));
    // Faces that lie on each other are ordered as if each were a little above the next one, seen
    // along the normal of the first. So their order is the same at all of their edges.
    let mut from = 0;
    while from < turned.len() {
        let alike = turned[from..].iter().take_while(|t| t.0 - turned[from].0 < SAME_ANGLE).count();
        let run = &mut turned[from..from + alike];
        run.sort_by_key(|t| t.1.face);
        let mut corners = draft.faces[run[0].1.face as usize];
        corners.sort_unstable();
        let [p, q, r] = corners.map(|v| draft.vertices[v as usize]);
        let direction = across(&run[0].1)?;
        if (q - p).cross(r - p).dot(axis.cross(direction)) > 0.0 {
            run.reverse();
        }
        from += alike;
    }
    let way = |from: usize| {
        let n = turned.len();
        let pair = |k: usize| [turned[(from + 2 * k) % n], turned[(from + 2 * k + 1) % n]];
        let pairs: Vec<[(f64, EdgeUse); 2]> = (0..n / 2).map(pair).collect();
        let agreeing = pairs.iter().filter(|[u, v]| u.1.forward != v.1.forward).count();
        let angles: f64 = pairs.iter().map(|[u, v]| (v.0 - u.0).rem_euclid(4.0)).sum();
        (agreeing, angles, pairs.into_iter().map(|pair| pair.map(|(_, u)| u)).collect())
    };
    let (one, other): ((usize, f64, Vec<_>), _) = (way(0), way(1));
    let better = other.0 > one.0 || other.0 == one.0 && other.1 < one.1;
    Some(if better { other.2 } else { one.2 })
}
