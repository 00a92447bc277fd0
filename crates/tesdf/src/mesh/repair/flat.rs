//! Triangulates holes that are flat, in their plane.
//!
//! Coplanar loops of which one is inside another, with the opposite direction, are one hole: the
//! outline, and islands in it.
use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::{Draft, holes::Hole};
use crate::{
    geometry::{Aabb, AabbTree},
    mesh::polygon::{Shape, orient, project, triangulate},
};

/// A loop is flat when its vertices are within this share of its extent of a plane, or within the
/// rounding of coordinates to 32 bits.
const FLATNESS: f64 = 1e-6;
/// Half a unit in the last place of a 32-bit float, with the rounding of the plane itself.
const ROUNDED: f64 = 1.2e-7;
/// Largest number of pairs of a vertex of the outline and a vertex of an island among which the
/// shortest bridge is looked for. Larger ones stay holes of their own.
const BRIDGES: usize = 1 << 20;
/// Number of bridges that are tried for an island, the shortest ones first.
const TRIED: usize = 64;

/// The plane of a flat loop.
#[derive(Clone, Debug)]
struct Plane {
    through: DVec3,
    normal: DVec3,
    /// Half of the length of the Newell normal, which is the area.
    area: f64,
    tolerance: f64,
    bounds: Aabb,
}

impl Plane {
    fn of(points: &[DVec3]) -> Option<Self> {
        let bounds = Aabb::of(points);
        let through = points.iter().sum::<DVec3>() / points.len() as f64;
        let around = |i: usize| points[(i + 1) % points.len()] - through;
        let newell: DVec3 = (0..points.len()).map(|i| (points[i] - through).cross(around(i))).sum();
        let normal = newell.try_normalize()?;
        let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
        let tolerance = (FLATNESS * bounds.extent().length()).max(ROUNDED * largest);
        let plane = Self { through, normal, area: 0.5 * newell.length(), tolerance, bounds };
        plane.holds(points).then_some(plane)
    }

    fn holds(&self, points: &[DVec3]) -> bool {
        points.iter().all(|&p| self.normal.dot(p - self.through).abs() <= self.tolerance)
    }
}

/// Flat holes, each as the indices of its loops, the outline first. Every flat loop is in one of
/// them.
pub(super) fn flat_holes(draft: &Draft, holes: &[Hole]) -> Vec<Vec<usize>> {
    let points = |hole: usize| positions(draft, &holes[hole].vertices);
    let planes: Vec<(usize, Plane)> =
        (0..holes.len()).filter_map(|h| Some((h, Plane::of(&points(h))?))).collect();
    let boxes: Vec<Aabb> = planes.iter().map(|(_, plane)| plane.bounds.grown(plane.tolerance)).collect();
    let tree = AabbTree::build(&boxes, 4);
    // Larger loops first, so that it is known of each one whether it is an island.
    let mut order: Vec<usize> = (0..planes.len()).collect();
    order.sort_by(|&i, &j| planes[j].1.area.total_cmp(&planes[i].1.area).then(i.cmp(&j)));
    let mut is_island = vec![false; planes.len()];
    let mut islands: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for &i in &order {
        let (hole, plane) = &planes[i];
        let inner = points(*hole);
        let mut outline: Option<usize> = None;
        tree.visit(
            |bounds| bounds.overlaps(plane.bounds),
            |leaf| {
                for j in leaf.iter().map(|&j| j as usize) {
                    let (outer, wide) = &planes[j];
                    let smaller = outline.is_none_or(|o| (wide.area, o) < (planes[o].1.area, j));
                    if wide.area > plane.area
                        && smaller
                        && !is_island[j]
                        && wide.normal.dot(plane.normal) < 0.0
                        && wide.holds(&inner)
                        && is_around(&points(*outer), &inner)
                    {
                        outline = Some(j);
                    }
                }
            },
        );
        match outline {
            Some(j) => {
                is_island[i] = true;
                islands.entry(j).or_default().push(i);
            }
            None => {
                islands.entry(i).or_default();
            }
        }
    }
    let loops = |(outline, within): (usize, Vec<usize>)| {
        [outline].into_iter().chain(within).map(|i| planes[i].0).collect()
    };
    islands.into_iter().map(loops).collect()
}

fn positions(draft: &Draft, vertices: &[u32]) -> Vec<DVec3> {
    vertices.iter().map(|&v| draft.vertices[v as usize]).collect()
}

/// Whether the outline goes around a loop in its plane. The loop may touch it at vertices.
fn is_around(outline: &[DVec3], points: &[DVec3]) -> bool {
    let off: Vec<DVec3> = points.iter().filter(|p| !outline.contains(p)).copied().collect();
    if off.is_empty() {
        return false;
    }
    let all = project_with(outline, &off);
    let (outline, points) = all.split_at(outline.len());
    let inside = |p: &DVec2| {
        let crosses = |i: usize| {
            let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
            (a.y > p.y) != (b.y > p.y) && (orient(a, b, *p) > 0.0) == (b.y > a.y)
        };
        (0..outline.len()).filter(|&i| crosses(i)).count() % 2 == 1
    };
    points.iter().all(inside)
}

/// Projects the outline, and other points in the same way.
fn project_with(outline: &[DVec3], others: &[DVec3]) -> Vec<DVec2> {
    // The others twice, there and back, have no part in the normal.
    let back = others.iter().rev();
    let all: Vec<DVec3> = outline.iter().chain(&outline[..1]).chain(others).chain(back).copied().collect();
    let mut flat = project(&all);
    flat.remove(outline.len());
    flat.truncate(outline.len() + others.len());
    flat
}

/// Triangles of the vertices of a flat hole. `None` when its loops cross themselves or each other,
/// or the islands cannot be joined to the outline.
pub(super) fn fill_flat(draft: &Draft, loops: &[&[u32]]) -> Option<Vec<[u32; 3]>> {
    let outline = joined(draft, loops)?;
    let mut triangles = Vec::with_capacity(outline.len());
    let shape = triangulate(&positions(draft, &outline), &mut triangles);
    let named = || triangles.iter().map(|t| t.map(|corner| outline[corner as usize])).collect();
    (shape != Shape::Irregular).then(named)
}

/// The outline with its islands as one loop: a bridge leads to each island and back.
fn joined(draft: &Draft, loops: &[&[u32]]) -> Option<Vec<u32>> {
    let (outline, islands) = loops.split_first()?;
    let mut outline = outline.to_vec();
    let mut islands: Vec<&[u32]> = islands.to_vec();
    while !islands.is_empty() {
        let flat = Flat::new(draft, &outline, &islands);
        if let Some((at, island, from)) = flat.touching(&outline, &islands) {
            let mut around = islands.remove(island).to_vec();
            around.rotate_left(from);
            outline.splice(at..at, around);
            continue;
        }
        let pairs = outline.len() * islands.iter().map(|island| island.len()).sum::<usize>();
        if pairs > BRIDGES {
            return None;
        }
        let (from, island, to) = flat.bridge()?;
        let island = islands.remove(island);
        let mut around = island.to_vec();
        around.rotate_left(to);
        // From the outline to the island, around it, and back.
        let (first, back) = (around[0], outline[from]);
        outline.splice(from + 1..from + 1, around.into_iter().chain([first, back]));
    }
    Some(outline)
}

/// An outline and islands in their plane.
struct Flat {
    outline: Vec<DVec2>,
    islands: Vec<Vec<DVec2>>,
}

impl Flat {
    fn new(draft: &Draft, outline: &[u32], islands: &[&[u32]]) -> Self {
        let others: Vec<DVec3> = islands.iter().flat_map(|island| positions(draft, island)).collect();
        let flat = project_with(&positions(draft, outline), &others);
        let (outline, mut rest) = flat.split_at(outline.len());
        let mut cut = |island: &&[u32]| {
            let (points, after) = rest.split_at(island.len());
            rest = after;
            points.to_vec()
        };
        Self { outline: outline.to_vec(), islands: islands.iter().map(&mut cut).collect() }
    }

    /// A vertex where an island touches the outline: its place in the outline, the island, and its
    /// place there. Where the outline passes the vertex several times, it is the place whose corner
    /// the island is in.
    fn touching(&self, outline: &[u32], islands: &[&[u32]]) -> Option<(usize, usize, usize)> {
        let n = outline.len();
        islands.iter().enumerate().find_map(|(k, island)| {
            let from = island.iter().position(|v| outline.contains(v))?;
            let next = self.islands[k][(from + 1) % island.len()];
            let at = (0..n).filter(|&at| outline[at] == island[from]).find(|&at| {
                let [before, here, after] = [at + n - 1, at, at + 1].map(|i| self.outline[i % n]);
                let left = [orient(before, here, next) > 0.0, orient(here, after, next) > 0.0];
                // A corner of less than half a turn is to the left of both sides, a larger one to
                // the left of either.
                if orient(before, here, after) > 0.0 { left == [true; 2] } else { left != [false; 2] }
            })?;
            Some((at, k, from))
        })
    }

    /// The shortest bridge that meets no loop on its way: a vertex of the outline, an island, and a
    /// vertex of it. A vertex where a bridge ends already is left out.
    fn bridge(&self) -> Option<(usize, usize, usize)> {
        let mut seen: BTreeMap<[u64; 2], usize> = BTreeMap::new();
        let key = |p: DVec2| p.to_array().map(f64::to_bits);
        self.outline.iter().for_each(|&p| *seen.entry(key(p)).or_default() += 1);
        let mut bridges: Vec<(f64, usize, usize, usize)> = Vec::new();
        for (i, p) in self.outline.iter().enumerate().filter(|(_, p)| seen[&key(**p)] == 1) {
            for (k, island) in self.islands.iter().enumerate() {
                bridges.extend(island.iter().enumerate().map(|(j, q)| (p.distance_squared(*q), i, k, j)));
            }
        }
        bridges.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2, a.3).cmp(&(b.1, b.2, b.3))));
        let free = |&&(_, i, k, j): &&(f64, usize, usize, usize)| {
            let ends = [self.outline[i], self.islands[k][j]];
            let loops = [&self.outline].into_iter().chain(&self.islands);
            loops.flat_map(|points| sides(points)).all(|side| !blocks(side, ends))
        };
        bridges.iter().take(TRIED).find(free).map(|&(_, i, k, j)| (i, k, j))
    }
}

fn sides(points: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> {
    (0..points.len()).map(|i| [points[i], points[(i + 1) % points.len()]])
}

/// Whether a side of a loop meets a bridge elsewhere than at a common end.
fn blocks([a, b]: [DVec2; 2], [p, q]: [DVec2; 2]) -> bool {
    let (of_a, of_b) = (orient(p, q, a), orient(p, q, b));
    if of_a == 0.0 && of_b == 0.0 {
        // On one line, they may have one point in common, which is an end of both.
        let axis = (q - p).abs().max_position();
        let low = a[axis].min(b[axis]).max(p[axis].min(q[axis]));
        let high = a[axis].max(b[axis]).min(p[axis].max(q[axis]));
        return low < high;
    }
    let common = [a, b].into_iter().any(|end| end == p || end == q);
    !common && of_a * of_b <= 0.0 && orient(a, b, p) * orient(a, b, q) <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(center: [f64; 2], half: f64, clockwise: bool) -> Vec<DVec3> {
        let mut corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| {
            DVec3::new(center[0] + half * x, center[1] + half * y, 0.5 * (center[0] + half * x))
        });
        if clockwise {
            corners.reverse();
        }
        corners.to_vec()
    }

    fn filled(loops: &[Vec<DVec3>]) -> (Vec<Vec<usize>>, Option<f64>) {
        let mut draft = Draft { vertices: Vec::new(), faces: Vec::new(), origin: Vec::new() };
        let mut holes = Vec::new();
        for points in loops {
            let first = draft.vertices.len() as u32;
            draft.vertices.extend(points);
            let vertices: Vec<u32> = (first..draft.vertices.len() as u32).collect();
            holes.push(Hole { across: vec![0; vertices.len()], vertices });
        }
        let groups = flat_holes(&draft, &holes);
        let area = |t: [u32; 3]| {
            let [a, b, c] = t.map(|v| draft.vertices[v as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        let loops_of = |group: &Vec<usize>| -> Vec<&[u32]> {
            group.iter().map(|&h| holes[h].vertices.as_slice()).collect()
        };
        let total = groups.iter().map(|group| {
            let triangles = fill_flat(&draft, &loops_of(group))?;
            Some(triangles.into_iter().map(area).sum::<f64>())
        });
        let total = total.sum();
        (groups, total)
    }

    /// The area of a flat figure in the slanted plane of the squares.
    fn slanted(area: f64) -> f64 {
        area * 1.25f64.sqrt()
    }

    #[test]
    fn islands_are_left_out() {
        let ring = [square([0.0, 0.0], 4.0, false), square([1.0, 1.0], 1.0, true)];
        let (groups, area) = filled(&ring);
        assert_eq!(groups, [[0, 1]]);
        assert!((area.unwrap() - slanted(60.0)).abs() < 1e-12);
        // Four islands, and in one of them a hole of its own.
        let mut many = vec![square([0.0, 0.0], 8.0, false)];
        many.extend([[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]].map(|at| square(at, 2.0, true)));
        many.push(square([4.0, 4.0], 1.0, false));
        let (groups, area) = filled(&many);
        assert_eq!(groups, [vec![0, 1, 2, 3, 4], vec![5]]);
        assert!((area.unwrap() - slanted(256.0 - 64.0 + 4.0)).abs() < 1e-11);
    }

    #[test]
    fn islands_that_touch_the_outline_are_joined_there() {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.5 * x);
        let vertices =
            vec![p(0.0, 0.0), p(4.0, 0.0), p(4.0, 4.0), p(0.0, 4.0), p(1.0, 2.0), p(2.0, 1.0), p(2.0, 3.0)];
        let draft = Draft { vertices, faces: Vec::new(), origin: Vec::new() };
        let hole = |vertices: Vec<u32>| Hole { across: vec![0; vertices.len()], vertices };
        let holes = [hole(vec![0, 1, 2, 3]), hole(vec![0, 4, 5]), hole(vec![5, 4, 6])];
        assert_eq!(flat_holes(&draft, &holes[..2]), [[0, 1]]);
        let triangles = fill_flat(&draft, &[&holes[0].vertices, &holes[1].vertices]).unwrap();
        assert_eq!(triangles.len(), 5);
        let double: f64 = triangles
            .iter()
            .map(|t| t.map(|v| draft.vertices[v as usize]))
            .map(|[a, b, c]| (b - a).cross(c - a).z)
            .sum();
        assert_eq!(double, 32.0 - 3.0);
    }

    #[test]
    fn loops_of_the_same_direction_or_side_by_side_are_holes_of_their_own() {
        let same = [square([0.0, 0.0], 4.0, false), square([0.0, 0.0], 1.0, false)];
        assert_eq!(filled(&same), (vec![vec![0], vec![1]], Some(slanted(64.0) + slanted(4.0))));
        let beside = [square([0.0, 0.0], 1.0, false), square([9.0, 0.0], 1.0, true)];
        assert_eq!(filled(&beside).0, [[0], [1]]);
    }

    #[test]
    fn a_loop_that_is_not_flat_or_crosses_itself_is_not_filled() {
        let mut bent = square([0.0, 0.0], 1.0, false);
        bent[0].z += 0.01;
        assert_eq!(filled(&[bent]).0, Vec::<Vec<usize>>::new());
        let mut bow = square([0.0, 0.0], 1.0, false);
        bow[0].x = -3.0;
        bow[0].z = -1.5;
        bow.swap(0, 1);
        assert_eq!(filled(&[bow]), (vec![vec![0]], None));
    }

    #[test]
    fn a_side_blocks_a_bridge_unless_they_meet_at_an_end() {
        let p = |x: f64, y: f64| DVec2::new(x, y);
        let bridge = [p(0.0, 0.0), p(2.0, 0.0)];
        for (side, expected) in [
            ([p(1.0, -1.0), p(1.0, 1.0)], true),
            ([p(1.0, 0.0), p(1.0, 1.0)], true),
            ([p(0.0, 0.0), p(1.0, 1.0)], false),
            ([p(3.0, 0.0), p(3.0, 1.0)], false),
            ([p(-1.0, 0.0), p(0.0, 0.0)], false),
            ([p(0.0, 0.0), p(-1.0, 0.0)], false),
            ([p(0.0, 0.0), p(1.0, 0.0)], true),
            ([p(1.0, 0.0), p(2.0, 0.0)], true),
            ([p(1.0, 0.0), p(3.0, 0.0)], true),
            ([p(2.0, 0.0), p(3.0, 0.0)], false),
        ] {
            assert_eq!(blocks(side, bridge), expected, "{side:?}");
        }
    }
}
