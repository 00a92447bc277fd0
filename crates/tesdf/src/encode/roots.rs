//! The tetrahedra that the bisection forest grows from.
use glam::DVec3;

use super::error::EncodeError;
use crate::base::{Side, four_digits};
use crate::domain::{Cell, ConformingMesh, DomainCube};
use crate::geometry::{Aabb, AabbTree, LocalFrame};

/// The domain of an asset: where its cells come from.
#[derive(Clone, Copy, Debug)]
pub enum Domain<'a> {
    /// Six tetrahedra of a cube around the solid and its band. They are bisected where that pays.
    Bisection,
    /// Tetrahedra that conform to the surface. They are bisected, or left whole
    /// ([`Refinement`](super::Refinement)).
    Conforming(&'a ConformingMesh),
}

impl Domain<'_> {
    /// The name of the domain in the certificate.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Bisection => "bisection",
            Self::Conforming(_) => "conforming",
        }
    }
}

/// Largest width of the domain, in diagonals of the mesh. Rounding grows with it, and so does the
/// certificate's delta.
pub(super) const MAX_SIZE: f64 = 8.0;

/// The roots of a domain, in the local frame.
#[derive(Debug)]
pub struct Roots {
    /// A cube around the domain. For the bisection domain it is the domain.
    pub cube: DomainCube,
    /// The roots.
    pub cells: Vec<Cell>,
    /// For a conforming domain: the corners of the roots, in the order of the corners of their
    /// cells.
    pub tetrahedra: Vec<[u32; 4]>,
    /// For a conforming domain: the side of the surface that each root is on.
    pub sides: Vec<Side>,
}

impl Roots {
    /// The roots of `domain`. `bounds` are the bounds of the mesh and its band. All lengths are in
    /// the local frame.
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
                found: format!("a domain {} times as wide as the mesh's diagonal", four_digits(size)),
                expected: "at most 8 times; points beyond the domain are answered exactly without",
            });
        }
        let cells = match domain {
            Domain::Bisection => (0..6).map(|root| cube.root(root)).collect(),
            Domain::Conforming(_) => corners.into_iter().map(|corners| Cell { corners, depth: 0 }).collect(),
        };
        Ok(Self { cube, cells, tetrahedra, sides })
    }

    /// The roots, ordered so that near roots follow each other.
    pub fn order(&self) -> Vec<u32> {
        let boxes: Vec<Aabb> = self.cells.iter().map(|cell| Aabb::of(&cell.corners)).collect();
        AabbTree::build(&boxes, 1).order().to_vec()
    }
}

/// Orders the corners so that the first bisection, of the edge 0–3, halves the longest edge. The
/// orientation is kept.
fn for_bisection(ids: &[u32; 4], corners: &[DVec3; 4]) -> [u32; 4] {
    // Even permutations that bring each edge to the positions 0 and 3.
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
