use serde::Serialize;

use crate::base::Side;

/// Numbers of vertices and tetrahedra by class, as in Sec. III-A of the paper.
///
/// A tetrahedron at the boundary has a surface vertex. A vertex that is on no face is inner or
/// outer, like the tetrahedra around it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Classes {
    /// `V_S`: vertices of the surface, one for each position.
    pub surface_vertices: usize,
    /// `V_I`: vertices inside.
    pub inner_vertices: usize,
    /// `V_O`: vertices outside.
    pub outer_vertices: usize,
    /// `T_BI`: tetrahedra inside with a surface vertex.
    pub boundary_inner_tetrahedra: usize,
    /// `T_I`: tetrahedra inside without a surface vertex.
    pub inner_tetrahedra: usize,
    /// `T_BO`: tetrahedra outside with a surface vertex.
    pub boundary_outer_tetrahedra: usize,
    /// `T_O`: tetrahedra outside without a surface vertex.
    pub outer_tetrahedra: usize,
}

impl Classes {
    /// Counts tetrahedra, and the vertices that they use. `vertices` is the number of all vertices.
    pub(crate) fn count(
        vertices: usize,
        tetrahedra: impl IntoIterator<Item = ([u32; 4], Side)>,
        on_surface: impl Fn(u32) -> bool,
    ) -> Self {
        let mut classes = Self::default();
        let mut counted = vec![false; vertices];
        for (corners, side) in tetrahedra {
            let at_boundary = corners.iter().any(|&v| on_surface(v));
            let (others, tetrahedra) = match (side, at_boundary) {
                (Side::Inside, true) => (&mut classes.inner_vertices, &mut classes.boundary_inner_tetrahedra),
                (Side::Inside, false) => (&mut classes.inner_vertices, &mut classes.inner_tetrahedra),
                (Side::Outside, true) => {
                    (&mut classes.outer_vertices, &mut classes.boundary_outer_tetrahedra)
                }
                (Side::Outside, false) => (&mut classes.outer_vertices, &mut classes.outer_tetrahedra),
            };
            *tetrahedra += 1;
            for v in corners {
                if !std::mem::replace(&mut counted[v as usize], true) {
                    *(if on_surface(v) { &mut classes.surface_vertices } else { &mut *others }) += 1;
                }
            }
        }
        classes
    }
}
