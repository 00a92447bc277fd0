//! Merges vertices at the same position, or near each other.
use std::collections::HashMap;

use glam::{DVec3, I64Vec3};

use super::topology::{Topology, has_repeated_corner};
use crate::base::elementary;

/// The distinct positions of the used vertices, and the position of each vertex.
pub(super) struct Welded {
    /// Distinct positions, in the order of their first vertices; `-0.0` becomes `0.0`.
    pub positions: Vec<DVec3>,
    /// For each distinct position, the first vertex there.
    pub first: Vec<u32>,
    /// For each vertex the index of its position; `None` when it is not used.
    pub target: Vec<Option<u32>>,
}

/// Merges vertices whose coordinates are bitwise equal; `-0.0` equals `0.0`.
///
/// There is no tolerance: any fixed tolerance would be wrong for small parts, such as a part of a
/// few millimetres given in metres.
pub(super) fn weld_equal(positions: &[DVec3], used: &[bool]) -> Welded {
    let mut welded =
        Welded { positions: Vec::new(), first: Vec::new(), target: Vec::with_capacity(positions.len()) };
    let mut ids: HashMap<[u64; 3], u32> = HashMap::with_capacity(positions.len() / 4);
    for (i, (&p, &is_used)) in positions.iter().zip(used).enumerate() {
        welded.target.push(is_used.then(|| {
            // Adding +0.0 turns -0.0 into 0.0 and changes no other value.
            let p = p + DVec3::ZERO;
            *ids.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
                welded.positions.push(p);
                welded.first.push(i as u32);
                welded.positions.len() as u32 - 1
            })
        }));
    }
    welded
}

/// How far apart the same point may be in an STL file, in units in the last place of the largest
/// coordinate: one along each axis, which is at most √3 in space.
const ROUNDINGS: f32 = 2.0;

impl Welded {
    /// Closes the cracks that rounding to 32 bits has made: merges vertices that are at most
    /// [`ROUNDINGS`] apart, if the faces are not closed before and are closed then. Returns the
    /// number of merged vertices, and the distance.
    ///
    /// Unlike a fixed tolerance it is right for parts of any size, because it follows from the format.
    pub fn close_rounding(&mut self, faces: &mut [[u32; 3]]) -> Option<(usize, f64)> {
        let largest = largest_coordinate(&self.positions) as f32;
        let distance = f64::from(ROUNDINGS * (largest.next_up() - largest));
        if !distance.is_finite() || Topology::new(faces).is_closed() {
            return None;
        }
        let target = weld_within(&self.positions, distance);
        let merged: Vec<[u32; 3]> = faces.iter().map(|face| face.map(|v| target[v as usize])).collect();
        if !Topology::new(&merged).is_closed() || merged.iter().all(|&face| has_repeated_corner(face)) {
            return None;
        }
        // The vertex that replaces another one comes before it.
        let mut number: Vec<u32> = Vec::with_capacity(target.len());
        let (mut positions, mut first) = (Vec::new(), Vec::new());
        for (v, &to) in target.iter().enumerate() {
            number.push(if to == v as u32 { positions.len() as u32 } else { number[to as usize] });
            if to == v as u32 {
                positions.push(self.positions[v]);
                first.push(self.first[v]);
            }
        }
        let ids = faces.iter_mut().flatten().chain(self.target.iter_mut().flatten());
        ids.for_each(|v| *v = number[*v as usize]);
        (self.positions, self.first) = (positions, first);
        Some((number.len() - self.positions.len(), distance))
    }
}

/// Merges vertices within a tolerance. Returns for each vertex the one that replaces it.
///
/// Vertices are visited in ascending order. A vertex is merged into the nearest earlier vertex that
/// was kept and is within `tolerance`; otherwise it is kept. So no vertex moves by more than the
/// tolerance, and the result depends only on the order of the vertices.
pub(super) fn weld_within(positions: &[DVec3], tolerance: f64) -> Vec<u32> {
    let largest = largest_coordinate(positions);
    // Most points are near no side of their cell, so few cells are looked at. A cell may be larger,
    // so that cell indices fit into 64 bits.
    let cell = (2.0 * tolerance).max(largest * elementary::powi(2.0, -40));
    let key = |p: DVec3| (p / cell).floor().as_i64vec3();
    // Rounding does not move a point that is within the tolerance out of reach.
    let reach = DVec3::splat(tolerance * (1.0 + 1e-12) + largest * 4.0 * f64::EPSILON);
    let mut cells: HashMap<_, Vec<u32>> = HashMap::new();
    let mut target: Vec<u32> = (0..positions.len() as u32).collect();
    for (v, &p) in positions.iter().enumerate() {
        let (low, high) = (key(p - reach), key(p + reach));
        let around = (low.x..=high.x).flat_map(move |x| {
            (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| I64Vec3::new(x, y, z)))
        });
        let near = around
            .filter_map(|at| cells.get(&at))
            .flatten()
            .map(|&u| (positions[u as usize].distance(p), u))
            .filter(|&(d, _)| d <= tolerance)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match near {
            Some((_, u)) => target[v] = u,
            None => cells.entry(key(p)).or_default().push(v as u32),
        }
    }
    target
}

/// The largest magnitude of a coordinate.
fn largest_coordinate(positions: &[DVec3]) -> f64 {
    positions.iter().fold(0.0, |m, p| p.abs().max_element().max(m))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_merge_and_neighbouring_floats_do_not() {
        let p = DVec3::new(0.0, 0.1, 1e-30);
        let near = DVec3::new(0.0, 0.1f64.next_up(), 1e-30);
        let minus = DVec3::new(-0.0, 0.1, 1e-30);
        let welded = weld_equal(&[p, DVec3::NAN, near, minus, p], &[true, false, true, true, true]);
        assert_eq!(welded.target, [Some(0), None, Some(1), Some(0), Some(0)]);
        assert_eq!(welded.positions, [p, near]);
        assert_eq!(welded.first, [0, 2]);
    }

    /// A tetrahedron whose corner at `1.0` is also at `other`.
    fn cracked(other: f32) -> (Welded, Vec<[u32; 3]>) {
        let x = f64::from(other);
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(x, 0.0, 0.0)];
        (weld_equal(&positions, &[true; 5]), vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    }

    #[test]
    fn cracks_of_rounding_are_closed_and_wider_ones_are_not() {
        let ulp = 1f32.next_up() - 1.0;
        for (other, closes) in
            [(1.0 + ulp, true), (1.0 - ulp, true), (1.0 + 2.0 * ulp, true), (1.0 + 3.0 * ulp, false)]
        {
            let (mut welded, mut faces) = cracked(other);
            assert_eq!(welded.close_rounding(&mut faces.clone()), None, "closed without");
            faces[2][0] = 4;
            let found = welded.close_rounding(&mut faces);
            assert_eq!(found, closes.then_some((1, 2.0 * f64::from(ulp))), "{other}");
            assert_eq!((welded.positions.len(), welded.first.len()), if closes { (4, 4) } else { (5, 5) });
            assert_eq!(faces[2][0], if closes { 1 } else { 4 });
            assert_eq!(welded.target[4], Some(faces[2][0]));
        }
    }

    #[test]
    fn points_far_away_or_at_the_origin_alone_are_not_merged() {
        for at in [0.0, 1e300] {
            let mut welded = weld_equal(&[DVec3::splat(at), DVec3::splat(-at)], &[true; 2]);
            assert_eq!(welded.close_rounding(&mut [[0, 1, 0]]), None);
        }
    }
}
