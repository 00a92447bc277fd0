//! Exact winding numbers by rays along the first axis. The point is moved by infinitesimals, so
//! that no ray meets an edge.
use glam::DVec3;
use robust::{Coord, orient2d};

use super::apart::orientation;

/// The faces of a closed surface in a grid over the second and third axis, which finds the faces
/// that a ray along the first axis can meet.
pub struct Rays<'a> {
    triangles: &'a [[DVec3; 3]],
    /// Lowest second and third coordinate, and cells per unit length.
    origin: [f64; 2],
    scale: [f64; 2],
    side: usize,
    /// For each cell of the grid, the start of its faces in `faces`.
    starts: Vec<u32>,
    faces: Vec<u32>,
}

/// Largest number of grid cells along one axis; a large face is in many cells.
const MAX_CELLS: usize = 1 << 7;

impl<'a> Rays<'a> {
    /// Sorts the faces into the grid.
    pub fn new(triangles: &'a [[DVec3; 3]]) -> Self {
        let side = (triangles.len() as f64).sqrt().ceil().clamp(1.0, MAX_CELLS as f64) as usize;
        let corners = || triangles.iter().flatten();
        let least = corners().fold(DVec3::INFINITY, |low, &p| low.min(p));
        let most = corners().fold(DVec3::NEG_INFINITY, |high, &p| high.max(p));
        let scale = [1, 2].map(|k| {
            let extent = most[k] - least[k];
            if extent > 1e-100 { side as f64 / extent } else { 0.0 }
        });
        let mut rays = Self {
            triangles,
            origin: [least[1], least[2]],
            scale,
            side,
            starts: vec![0; side * side + 1],
            faces: Vec::new(),
        };
        let mut named = Vec::new();
        for (face, triangle) in (0u32..).zip(triangles) {
            rays.cells_of(triangle, |cell| named.push((cell as u32, face)));
        }
        named.sort_unstable();
        for &(cell, face) in &named {
            rays.starts[cell as usize + 1] += 1;
            rays.faces.push(face);
        }
        for cell in 0..side * side {
            rays.starts[cell + 1] += rays.starts[cell];
        }
        rays
    }

    /// Cell index along an axis. Rounding does no harm, because it never changes the order of two
    /// coordinates.
    fn column(&self, axis: usize, x: f64) -> usize {
        (((x - self.origin[axis]) * self.scale[axis]).max(0.0) as usize).min(self.side - 1)
    }

    fn cells_of(&self, triangle: &[DVec3; 3], mut visit: impl FnMut(usize)) {
        let [rows, columns] = [0, 1].map(|axis| {
            let x = triangle.map(|p| p[axis + 1]);
            let (low, high) = (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]));
            self.column(axis, low)..=self.column(axis, high)
        });
        for row in rows {
            columns.clone().for_each(|column| visit(row * self.side + column));
        }
    }

    /// Winding number at `p + (e, e², e³)` with an infinitesimal `e > 0`, for any `p`.
    pub fn at(&self, p: DVec3) -> i32 {
        let cell = self.column(0, p.y) * self.side + self.column(1, p.z);
        let near = &self.faces[self.starts[cell] as usize..self.starts[cell + 1] as usize];
        near.iter().map(|&face| crossing(&self.triangles[face as usize], p)).sum()
    }
}

/// The decrease of the winding number where the ray from `p + (e, e², e³)` along the first axis
/// passes through a face.
///
/// All decisions are signs of polynomials in `e`. Each sign is that of the first nonzero
/// coefficient.
fn crossing(&[a, b, c]: &[DVec3; 3], p: DVec3) -> i32 {
    let facing = turn(a, b, c);
    if facing == 0 || [turn_at(a, b, p), turn_at(b, c, p), turn_at(c, a, p)] != [facing; 3] {
        return 0;
    }
    // The first component of the normal has the sign of `facing`: a step forward leads in front of
    // a face that faces forward.
    let behind = match orientation(a, b, c, p) {
        0 => -facing,
        sign => sign,
    };
    if behind == facing { facing } else { 0 }
}

/// Exact sign of the turn from `a` over `b` to `c`, seen against the direction of the first axis.
fn turn(a: DVec3, b: DVec3, c: DVec3) -> i32 {
    let coord = |p: DVec3| Coord { x: p.y, y: p.z };
    let value = orient2d(coord(a), coord(b), coord(c));
    i32::from(value > 0.0) - i32::from(value < 0.0)
}

/// [`turn`] from `a` over `b` to `p + (e, e², e³)`.
fn turn_at(a: DVec3, b: DVec3, p: DVec3) -> i32 {
    let sign = |x: f64, y: f64| i32::from(x > y) - i32::from(x < y);
    match turn(a, b, p) {
        0 if a.z != b.z => sign(a.z, b.z),
        0 => sign(b.y, a.y),
        turn => turn,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{TriangleMesh, WindingNumber};

    /// Two overlapping boxes on a lattice. Rays run along edges, through corners and in the planes
    /// of faces.
    #[test]
    fn winding_numbers_by_rays_equal_those_of_the_tree() {
        let mut vertices = Vec::new();
        let mut faces = Vec::new();
        for (low, size) in [(0.0, 2.0), (1.0, 2.0)] {
            let first = vertices.len() as u32;
            vertices.extend((0..8).map(|k| {
                DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * size + low
            }));
            for [a, b, c, d] in
                [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
            {
                faces.extend([[a, b, c], [a, c, d]].map(|f: [u32; 3]| f.map(|v| first + v)));
            }
        }
        let mesh = TriangleMesh::new(vertices, faces).expect("valid ids");
        let triangles: Vec<_> = (0..mesh.faces().len()).map(|f| mesh.triangle(f)).collect();
        let (rays, other) = (Rays::new(&triangles), WindingNumber::new(&mesh));
        let mut found = [0; 3];
        for k in 0..9 * 9 * 9 {
            let p = DVec3::new(f64::from(k % 9), f64::from(k / 9 % 9), f64::from(k / 81)) * 0.5 - 0.5;
            assert_eq!(rays.at(p), other.at_perturbed(p), "{p}");
            found[rays.at(p) as usize] += 1;
        }
        assert!(found.iter().all(|&n| n > 5), "{found:?}");
    }
}
