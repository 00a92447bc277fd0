//! The distance from which on a cell needs each face of its list: Eq. (7), by bounds.
use super::candidates::{Candidates, GRADIENT};
use super::filter::{Scratch, filter};
use super::surface::{Requirement, Surface};
use crate::base::Chains;
use crate::domain::Cell;

/// A face of a list, with the numbers that truncation uses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranked {
    /// The face.
    pub face: u32,
    /// Faces with a lower order come first.
    pub order: f64,
    /// At points nearer to the surface than this (local frame), the cell does not need the face.
    pub distance: f64,
}

/// How many bisections below a cell the ranking makes.
const LEVELS: u32 = 8;
/// A sub-cell is not bisected on when its size is below this share of its distance from the
/// surface: its bounds are sharp enough.
const SMALL: f64 = 0.02;

/// Finds for each face of a list a lower bound of d_f, Eq. (7): the least distance over the
/// sub-cells in which the face survives the filter, or in which an edge or vertex survives that the
/// face stands in for. The bound is infinite for a face that no sub-cell needs.
///
/// Take a point that is nearer to the surface than the bounds of all faces that are left out. Its
/// closest feature survives in its sub-cell. So the face that has the feature, or stands in for it,
/// has a bound of at most the point's distance, and the face is in the list.
///
/// `chains` are the chains that the list rests on. The returned chains are those that the bounds
/// rest on.
pub fn rank(
    surface: &Surface,
    cell: &Cell,
    list: &[u32],
    chains: Chains,
    scratch: &mut Scratch,
) -> (Vec<Ranked>, Chains) {
    let mut needs = Needs { surface, found: Vec::new(), heaviest: chains };
    let mut pool = scratch.pool();
    pool.fill(surface, list, cell);
    needs.descend(cell, &pool.candidates(), LEVELS, chains, scratch);
    scratch.give_back(pool);
    let Needs { found: mut needs, heaviest, .. } = needs;
    needs.sort_by(|a: &(Requirement, f64), b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    needs.dedup_by_key(|need| need.0);
    let mut distances = vec![f64::INFINITY; list.len()];
    let (faces, parts): (Vec<_>, Vec<_>) = needs.into_iter().partition(|need| surface.is_face(need.0));
    for (distance, &face) in distances.iter_mut().zip(list) {
        let own = faces.iter().filter(|need| surface.holds(face, need.0));
        *distance = own.map(|need| need.1).fold(f64::INFINITY, f64::min);
    }
    stand_in(surface, list, parts, &mut distances);
    let ranked = |(&face, distance)| Ranked { face, order: distance, distance };
    (list.iter().zip(distances).map(ranked).collect(), heaviest)
}

/// Chooses one face that stands in for each edge or vertex: of the faces that have it, the face
/// that is needed nearest to the surface anyway. If all of them were taken, the faces around every
/// vertex of the cell would be needed at distance 0.
fn stand_in(surface: &Surface, list: &[u32], mut parts: Vec<(Requirement, f64)>, distances: &mut [f64]) {
    parts.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    for (part, distance) in parts {
        let holders = (0..list.len()).filter(|&at| surface.holds(list[at], part));
        if let Some(at) = holders.min_by(|&a, &b| distances[a].total_cmp(&distances[b])) {
            distances[at] = distances[at].min(distance);
        }
    }
}

/// The parts that sub-cells need, each with a lower bound of the distance at which they need it.
struct Needs<'a> {
    surface: &'a Surface,
    found: Vec<(Requirement, f64)>,
    /// The heaviest chains of rule C on the way down so far.
    heaviest: Chains,
}

impl Needs<'_> {
    fn descend(
        &mut self,
        cell: &Cell,
        candidates: &Candidates,
        levels: u32,
        chains: Chains,
        scratch: &mut Scratch,
    ) {
        let surface = self.surface;
        let filtered = filter(surface, cell, candidates, chains, scratch);
        let chains = filtered.chains;
        self.heaviest = self.heaviest.max(chains);
        if levels == 0 || filtered.radius < SMALL * filtered.distance || filtered.survivors.len() == 1 {
            let center = cell.centroid();
            for s in &filtered.survivors {
                let at = |row: usize| scratch.centroid[row * candidates.stride + s.index as usize];
                let gradient = glam::DVec3::new(at(GRADIENT), at(GRADIENT + 1), at(GRADIENT + 2));
                // The distance is convex, so its tangent lies below it. On the face itself there is
                // no tangent (NaN).
                let below =
                    cell.corners.iter().map(|c| gradient.dot(*c - center)).fold(f64::INFINITY, f64::min);
                let least = if s.meets { 0.0 } else { (at(0) + below - surface.margin).max(0.0) };
                self.found.push((s.requirement, least));
            }
            scratch.reuse(filtered);
            return;
        }
        let mut pool = scratch.pool();
        pool.narrow(surface, cell, candidates, &filtered.survivors);
        scratch.reuse(filtered);
        for side in 0..2 {
            let below = pool.of_child(candidates, cell.child_corners(side));
            self.descend(&cell.child(side), &below, levels - 1, chains, scratch);
        }
        scratch.give_back(pool);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::encode::surface::Touching;
    use crate::mesh::TriangleMesh;

    /// Small cells far from two faces between which they lie, and from a third one behind these.
    #[test]
    fn a_small_far_cell_needs_its_nearest_faces_from_its_distance_on_and_no_others() {
        let at = |x: f64, z: f64| [[x, 0.0, z], [x, 0.1, z], [0.5 * x, 0.0, z - 0.1]].map(DVec3::from);
        let faces = [at(-0.3, 0.0), at(0.3, 0.0), at(0.1, -1.0)];
        let ids = vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        let mesh = TriangleMesh::new(faces.as_flattened().to_vec(), ids).expect("valid ids");
        let surface = Surface::new(&mesh, 1.0, Touching::Kept);
        let size = 0.02;
        for height in [0.9, 1.2, 1.5] {
            // Both faces are equally far from the middle of the cell, up to its size.
            let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
            let corners = corners.map(|p| height * DVec3::Z + size * (p - DVec3::splat(0.25)));
            let cell = Cell { corners, depth: 0 };
            let (ranked, _) = rank(&surface, &cell, &[0, 1, 2], Chains::NONE, &mut Scratch::default());
            assert_eq!(ranked.iter().map(|r| r.face).collect::<Vec<_>>(), [0, 1, 2]);
            let mut least = [f64::INFINITY; 3];
            let steps = || (0..=20).map(|k| f64::from(k) / 20.0);
            for (u, v, w) in steps().flat_map(|u| steps().flat_map(move |v| steps().map(move |w| (u, v, w))))
            {
                if u + v + w > 1.0 {
                    continue;
                }
                let p = corners[0] + size * DVec3::new(u, v, w);
                let distances = [0, 1, 2].map(|f| surface.triangles[f].closest(p).distance);
                let nearest = (0..3).min_by(|&a, &b| distances[a].total_cmp(&distances[b])).unwrap_or(0);
                least[nearest] = least[nearest].min(distances[nearest]);
            }
            for (found, least) in ranked.iter().map(|r| r.distance).zip(least) {
                let is_tight = found == least || found > least - 2.0 * size;
                assert!(found <= least && is_tight, "height {height}: {found}, needed from {least} on");
            }
            assert!(least[0].is_finite() && least[1].is_finite() && ranked[2].distance.is_infinite());
        }
    }
}
