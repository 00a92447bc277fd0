//! Finds the loops of edges that are missing for a closed surface.
use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::Draft;
use crate::mesh::Topology;

/// A loop around a hole. No vertex is in it twice.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Hole {
    /// Its vertices. A face that fills the hole runs along the loop, and the faces around the hole
    /// run against it.
    pub vertices: Vec<u32>,
    /// For each vertex, the face on the other side of the edge from it to the next vertex.
    pub across: Vec<u32>,
}

/// A directed edge that is missing.
#[derive(Clone, Copy)]
struct Missing {
    to: u32,
    across: u32,
}

/// The holes in the surface of the faces that `skip` does not mark.
///
/// Where more faces run along an edge from a to b than from b to a, the edge from b to a is
/// missing, that number of times less one for each face. The boundary of a set of faces has no
/// boundary itself, so as many missing edges end at a vertex as begin there, and they make closed
/// loops. A loop that comes to one of its vertices again is split there. Where several missing
/// edges begin at a vertex, the loop takes the first one around the vertex, seen from outside,
/// from the edge that it came along, through the gap. Deterministic: loops begin at the lowest
/// vertex that is left.
pub(super) fn holes(draft: &Draft, topology: &Topology, skip: &[bool]) -> Vec<Hole> {
    let mut next = missing(topology, skip);
    let starts: Vec<u32> = next.keys().copied().collect();
    let mut holes = Vec::new();
    for start in starts {
        while next.get(&start).is_some_and(|edges| !edges.is_empty()) {
            walk(draft, start, &mut next, &mut holes);
        }
    }
    holes
}

/// The missing edges that begin at each vertex, by their ends.
fn missing(topology: &Topology, skip: &[bool]) -> BTreeMap<u32, Vec<Missing>> {
    let mut next: BTreeMap<u32, Vec<Missing>> = BTreeMap::new();
    for edge in topology.edges() {
        let uses = || topology.uses(edge).iter().filter(|u| !skip[u.face as usize]);
        let forward = uses().filter(|u| u.forward).count();
        let backward = uses().count() - forward;
        let [a, b] = edge.vertices;
        let (from, to, against) = if forward > backward { (b, a, true) } else { (a, b, false) };
        for u in uses().filter(|u| u.forward == against).take(forward.abs_diff(backward)) {
            next.entry(from).or_default().push(Missing { to, across: u.face });
        }
    }
    next.values_mut().for_each(|edges| edges.sort_unstable_by_key(|e| (e.to, e.across)));
    next
}

/// Follows missing edges from `start` until none is left there.
fn walk(draft: &Draft, start: u32, next: &mut BTreeMap<u32, Vec<Missing>>, holes: &mut Vec<Hole>) {
    let mut path = vec![start];
    // For each vertex of the path but the first, the face across the edge that led there.
    let mut across: Vec<u32> = Vec::new();
    let mut place = HashMap::from([(start, 0usize)]);
    loop {
        let at = path[path.len() - 1];
        let Some(edges) = next.get_mut(&at).filter(|edges| !edges.is_empty()) else { return };
        let chosen = match (path.len().checked_sub(2), across.last()) {
            (Some(before), Some(&face)) if edges.len() > 1 => {
                first_around(draft, [path[before], at], face, edges)
            }
            _ => 0,
        };
        let edge = edges.remove(chosen);
        across.push(edge.across);
        let Some(&from) = place.get(&edge.to) else {
            place.insert(edge.to, path.len());
            path.push(edge.to);
            continue;
        };
        let hole = Hole { vertices: path[from..].to_vec(), across: across.split_off(from) };
        path.drain(from + 1..).for_each(|v| {
            place.remove(&v);
        });
        holes.push(hole);
    }
}

/// The index of the missing edge that comes first around the vertex `at`, clockwise seen from
/// outside, from the edge along which the loop came from `before`. Outside is where the faces
/// across these edges face on average: at the rim of a flat hole, some of them are walls.
fn first_around(draft: &Draft, [before, at]: [u32; 2], face: u32, edges: &[Missing]) -> usize {
    let position = |v: u32| draft.vertices[v as usize];
    let faces = edges.iter().map(|edge| edge.across).chain([face]);
    let normal: DVec3 = faces.map(|face| unit_normal(draft.triangle(face))).sum();
    let normal = normal.normalize_or_zero();
    let back = (position(before) - position(at)).reject_from_normalized(normal);
    let turn = |edge: &Missing| {
        let ahead = position(edge.to) - position(at);
        clockwise(back.dot(ahead), normal.dot(back.cross(ahead)))
    };
    (0..edges.len()).min_by(|&i, &j| turn(&edges[i]).total_cmp(&turn(&edges[j]))).unwrap_or(0)
}

/// A number from 0 to 4 that rises with the clockwise angle of a direction from the x axis. A
/// direction along the axis comes last.
fn clockwise(x: f64, y: f64) -> f64 {
    match around(x, -y) {
        0.0 => 4.0,
        angle => angle,
    }
}

/// A number from 0 to 4 that rises with the angle of a direction from the x axis. It needs no
/// trigonometry, whose last digit depends on the processor.
pub(super) fn around(x: f64, y: f64) -> f64 {
    let share = y / (x.abs() + y.abs()).max(f64::MIN_POSITIVE);
    match (x >= 0.0, y >= 0.0) {
        (true, true) => share,
        (false, _) => 2.0 - share,
        (true, false) => 4.0 + share,
    }
}

/// The unit normal of a triangle; zero when it has no area.
pub(super) fn unit_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draft(vertices: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Draft {
        let origin = (0..faces.len() as u32).collect();
        Draft { vertices, faces, origin }
    }

    fn loops(draft: &Draft) -> Vec<Vec<u32>> {
        let skip = vec![false; draft.faces.len()];
        let holes = holes(draft, &Topology::new(&draft.faces), &skip);
        for hole in &holes {
            for (k, &face) in hole.across.iter().enumerate() {
                let (a, b) = (hole.vertices[k], hole.vertices[(k + 1) % hole.vertices.len()]);
                let corners = draft.faces[face as usize];
                assert!((0..3).any(|i| [corners[i], corners[(i + 1) % 3]] == [b, a]), "{hole:?}");
            }
        }
        holes.into_iter().map(|hole| hole.vertices).collect()
    }

    #[test]
    fn angles_rise_all_around() {
        let turns = [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (-1.0, 1.0), (-1.0, 0.0), (-1.0, -1.0), (0.0, -1.0)];
        let angles: Vec<f64> = turns.iter().map(|&(x, y)| around(x, y)).collect();
        assert_eq!(angles, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]);
        assert_eq!((clockwise(1.0, 0.0), clockwise(0.0, -2.0), clockwise(0.0, 2.0)), (4.0, 1.0, 3.0));
    }

    #[test]
    fn a_missing_face_leaves_its_own_loop() {
        let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let open = draft(corners, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3]]);
        assert_eq!(loops(&open), [[0, 3, 2]]);
    }

    /// A grid of 4 x 4 squares in the plane, seen from above, without some of its squares.
    fn grid_without(squares: &[[u32; 2]]) -> Draft {
        let vertices = (0..25).map(|v| DVec3::new(f64::from(v % 5), f64::from(v / 5), 0.0)).collect();
        let mut faces = Vec::new();
        for j in 0..4 {
            for i in (0..4).filter(|&i| !squares.contains(&[i, j])) {
                let a = 5 * j + i;
                faces.extend([[a, a + 1, a + 6], [a, a + 6, a + 5]]);
            }
        }
        draft(vertices, faces)
    }

    #[test]
    fn holes_that_touch_at_vertices_are_loops_of_their_own() {
        // Two holes touch at vertex 12, and with the outline there are three loops.
        let mut found = loops(&grid_without(&[[1, 1], [2, 2]]));
        found.sort_by_key(Vec::len);
        assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [4, 4, 16]);
        assert_eq!(found[0], [6, 7, 12, 11]);
        assert_eq!(found[1], [12, 13, 18, 17]);
        // Four squares around a square that touches them at its corners only.
        let ring: Vec<[u32; 2]> = vec![[1, 0], [0, 1], [2, 1], [1, 2]];
        let found = loops(&grid_without(&ring));
        assert!(found.iter().all(|l| l.len() == 4 || l.len() > 8), "{found:?}");
    }
}
