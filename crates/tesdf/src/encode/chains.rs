//! How much rounding may cost rule C, counted link by link: see [`Chains`](crate::base::Chains).
use super::surface::{Part, Requirement, Surface, Touching};
use crate::domain::Cell;

/// Weight of a link over an edge, or over a vertex at which the face has an angle of at most 120°.
/// There, Δ is two roundings.
const PLAIN: u32 = 1;
/// Weight of a link over a vertex at which the face has a larger angle. There, Δ is ten roundings.
const OBTUSE: u32 = 25;

/// The weight of a link that drops `face` because the cell needs only one edge or vertex of it.
/// `None` where Δ has no bound.
pub(super) fn link_weight(
    surface: &Surface,
    cell: &Cell,
    requirement: Requirement,
    face: u32,
) -> Option<u32> {
    let Part::Vertex(vertex) = surface.part(requirement) else { return Some(PLAIN) };
    let corners = &surface.triangles[face as usize].corners;
    let k = surface.faces[face as usize].iter().position(|&v| v == vertex)?;
    let (u, v) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
    if u.dot(v) >= -0.5 * u.length() * v.length() {
        return Some(PLAIN);
    }
    // Cells of the bisection domain are all fat.
    (surface.touching == Touching::Kept || cell.is_fat()).then_some(OBTUSE)
}
#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::base::Chains;
    use crate::domain::DomainCube;
    use crate::encode::candidates::Pool;
    use crate::encode::filter::{Scratch, filter};
    use crate::geometry::Aabb;
    use crate::mesh::TriangleMesh;

    /// A pyramid over a square, seen from above its tip. From there, the closest point of all four
    /// sides is one vertex.
    fn pyramid() -> Surface {
        let base = [(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)];
        let mut vertices: Vec<DVec3> = base.into_iter().map(|(x, y)| DVec3::new(x, y, -0.3)).collect();
        vertices.push(DVec3::ZERO);
        let faces = (0..4).map(|k| [k, (k + 1) % 4, 4]).chain([[0, 2, 1], [0, 3, 2]]).collect();
        Surface::new(&TriangleMesh::new(vertices, faces).expect("valid ids"), 1.0, Touching::Kept)
    }

    #[test]
    fn rule_c_stops_where_the_budget_is_used_up() {
        let surface = pyramid();
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let corners = [at(0.0, 0.0, 0.2), at(0.02, 0.0, 0.2), at(0.0, 0.02, 0.2), at(0.0, 0.0, 0.22)];
        let cell = Cell { corners, depth: 0 };
        let all: Vec<u32> = (0..6).collect();
        let pool = Pool::new(&surface, &all, &cell);
        let found = |used: u32| {
            let filtered =
                filter(&surface, &cell, &pool.candidates(), Chains::of_weight(used), &mut Scratch::default());
            (filtered.survivors.len(), filtered.chains.used())
        };
        assert_eq!(found(0), (1, 1), "three of the four sides go, each for the fourth");
        assert_eq!(found(Chains::BUDGET - 1), (1, Chains::BUDGET), "all for the same face");
        assert_eq!(found(Chains::BUDGET), (4, Chains::BUDGET));
    }

    #[test]
    fn cells_of_the_bisection_domain_are_fat() {
        let cube = DomainCube::around(Aabb { min: DVec3::ZERO, max: DVec3::ONE });
        for path in 0..64u32 {
            let mut cell = cube.root(path as usize % 6);
            for level in 0..6 {
                assert!(cell.is_fat(), "{cell:?}");
                cell = cell.child((path >> level & 1) as usize);
            }
        }
        let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.3, 0.3, 0.05)];
        assert!(!Cell { corners: flat, depth: 0 }.is_fat());
    }
}
