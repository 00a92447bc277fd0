//! The tetrahedra that the forest grows from.
use glam::DVec3;

use super::error::EncodeError;
use crate::base::Side;
use crate::domain::{Cell, ConformingMesh, DomainCube};
use crate::geometry::{Aabb, AabbTree, LocalFrame};

/// The tetrahedra that an asset's cells come from.
#[derive(Clone, Copy, Debug)]
pub enum Domain<'a> {
    /// Six tetrahedra of a cube around the solid and its band, bisected where that pays.
    Bisection,
    /// Tetrahedra that conform to the surface, bisected or not ([`Refinement`](super::Refinement)).
    Conforming(&'a ConformingMesh),
}

impl Domain<'_> {
    /// How the certificate calls it.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Bisection => "bisection",
            Self::Conforming(_) => "conforming",
        }
    }
}

/// Widest domain, in diagonals of the mesh: rounding, and with it the certificate's delta, grows with it.
pub(super) const MAX_SIZE: f64 = 8.0;

/// The roots of a domain, in the local frame.
#[derive(Debug)]
pub struct Roots {
    /// Around the domain; the bisection domain is the cube.
    pub cube: DomainCube,
    /// The roots.
    pub cells: Vec<Cell>,
    /// Of a conforming domain: corners of the roots, in the order of their cells' corners.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Of a conforming domain: where each root lies.
    pub sides: Vec<Side>,
}

impl Roots {
    /// `bounds` are those of mesh and band, local frame like `regions` and `diagonal`.
    pub fn of(
        domain: &Domain,
        bounds: Aabb,
        regions: &[Aabb],
        frame: LocalFrame,
        diagonal: f64,
    ) -> Result<Self, EncodeError> {
        let (mut bounds, mut tetrahedra, mut sides) = (bounds, Vec::new(), Vec::new());
        let mut corners: Vec<[DVec3; 4]> = Vec::new();
        match domain {
            Domain::Bisection => bounds = regions.iter().fold(bounds, |b, &r| b.union(r)),
            Domain::Conforming(mesh) => {
                let local: Vec<DVec3> = mesh.vertices().iter().map(|&v| frame.to_local(v)).collect();
                let at = |t: &[u32; 4]| t.map(|v| local[v as usize]);
                tetrahedra = mesh.tetrahedra().iter().map(|t| for_bisection(t, &at(t))).collect();
                corners = tetrahedra.iter().map(at).collect();
                sides = mesh.sides().to_vec();
                bounds = Aabb::of(&local);
            }
        }
        let cube = DomainCube::around(bounds);
        let size = cube.side() / diagonal;
        if size > MAX_SIZE {
            return Err(EncodeError::Option {
                option: "band or region",
                found: format!("a domain {size:.1} times as wide as the mesh's diagonal"),
                expected: "at most 8 times; points beyond the domain are answered exactly without",
            });
        }
        let cells = match domain {
            Domain::Bisection => (0..6).map(|root| cube.root(root)).collect(),
            Domain::Conforming(_) => corners.into_iter().map(|corners| Cell { corners, depth: 0 }).collect(),
        };
        Ok(Self { cube, cells, tetrahedra, sides })
    }

    /// The roots in an order in which near ones follow each other.
    pub fn order(&self) -> Vec<u32> {
        let boxes: Vec<Aabb> = self.cells.iter().map(|cell| Aabb::of(&cell.corners)).collect();
        AabbTree::build(&boxes, 1).order().to_vec()
    }
}

/// The corners in an order whose first bisection, of edge 0–3, halves the longest edge; orientation is kept.
fn for_bisection(ids: &[u32; 4], corners: &[DVec3; 4]) -> [u32; 4] {
    // Even permutations that bring each edge to the ends.
    const ORDERS: [[usize; 4]; 6] =
        [[0, 2, 3, 1], [0, 3, 1, 2], [0, 1, 2, 3], [1, 0, 3, 2], [1, 2, 0, 3], [2, 0, 1, 3]];
    let length = |order: &[usize; 4]| corners[order[0]].distance_squared(corners[order[3]]);
    let longest =
        ORDERS.iter().fold(&ORDERS[0], |best, order| if length(order) > length(best) { order } else { best });
    longest.map(|k| ids[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn the_longest_edge_is_bisected_first_and_orientation_kept() {
        let volume = |c: [DVec3; 4]| (c[1] - c[0]).cross(c[2] - c[0]).dot(c[3] - c[0]);
        let base = [dvec3(0.0, 0.0, 0.0), dvec3(1.0, 0.1, 0.0), dvec3(0.2, 1.0, 0.0), dvec3(0.3, 0.2, 1.0)];
        for i in 0..4 {
            for j in 0..i {
                let mut corners = base;
                let away = (corners[i] - corners[j]) * 3.0;
                corners[i] += away;
                let order = for_bisection(&[0, 1, 2, 3], &corners);
                let ordered = order.map(|k| corners[k as usize]);
                let longest = (0..4)
                    .flat_map(|a| (0..a).map(move |b| (a, b)))
                    .map(|(a, b)| corners[a].distance(corners[b]))
                    .fold(0.0, f64::max);
                assert_eq!(ordered[0].distance(ordered[3]), longest);
                assert_eq!(volume(ordered) > 0.0, volume(corners) > 0.0);
            }
        }
    }
}
