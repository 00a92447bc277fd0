use glam::DVec3;

mod error;
mod labels;
mod measure;
mod triangles;
mod weld;

use super::{Classes, TetMesh};
use crate::{base::Side, geometry::orientation, mesh::SolidMesh};
pub use error::{ConformingError, MissingFace};
use weld::Welded;
pub(super) use weld::first_at_position;

/// A tetrahedralisation that conforms to a solid's surface: each face is a side of tetrahedra, and none passes through one.
///
/// It covers the whole inside, and perhaps some of the outside. Valid by construction.
///
/// # What is checked
/// In this order; the errors of [`new`](Self::new) name the check first.
///
/// 1. **Range**: predicates are exact.
/// 2. **Surface vertices**: each is a corner, bit for bit.
/// 3. **Orientation**: no tetrahedron is flat. Exact. Those in negative order are turned over.
/// 4. **Sharing**: a triangle has one tetrahedron or two, and then one on each side.
/// 5. **Faces**: each face of the surface is a triangle of tetrahedra.
/// 6. **Labels**: what is connected without passing a face has one winding number, that of a point inside of it, exact.
///    Behind a face it is one more than in front; where one side of a triangle has no tetrahedron, it is 0 there.
/// 7. **Volume**: the tetrahedra inside have the volume that the surface encloses, to 1e-9.
/// 8. **Overlap**: the outer boundary, all triangles with one tetrahedron, does not meet itself and goes around no place
///    twice.
///
/// # Why that is enough
/// By 4 the triangles between tetrahedra cancel, so what is left of the boundaries of all tetrahedra is the outer
/// boundary, and the number of tetrahedra around a point is the winding number of the outer boundary there. By 8 that is 0
/// or 1: no two overlap. By 6 each part of the boundary of the tetrahedra, weighted by winding number, is a face: the
/// weighted tetrahedra around a point add up to the winding number of the surface, so every point with a winding number of
/// 1 or more is in a tetrahedron. Volume alone would not show an overlap: the volume of all tetrahedra is that of the outer
/// boundary whether they overlap or not. It guards the arithmetic instead.
#[derive(Clone, Debug, PartialEq)]
pub struct ConformingMesh {
    vertices: Vec<DVec3>,
    tetrahedra: Vec<[u32; 4]>,
    sides: Vec<Side>,
    classes: Classes,
}

impl ConformingMesh {
    /// Matches tetrahedra with a surface and checks that they conform to it.
    ///
    /// Vertices are matched bit for bit (0 and -0 are equal), those that no tetrahedron uses are dropped, and vertices at the
    /// same position become one. A tetrahedron whose corners are in negative order gets its last two swapped.
    ///
    /// # Errors
    /// [`ConformingError`] names the check that failed, where, and what to do next.
    pub fn new(solid: &SolidMesh, tets: &TetMesh) -> Result<Self, ConformingError> {
        let mut welded = weld::weld(solid, tets)?;
        orient(&mut welded)?;
        let mut triangles = triangles::triangles(&welded)?;
        triangles::place_faces(&mut triangles, solid, &welded)?;
        let windings = labels::windings(solid, &welded, &triangles)?;
        measure::volumes_agree(solid, &welded, &windings)?;
        measure::is_embedded(solid, &welded, &triangles)?;

        let side = |winding: &i32| if *winding >= 1 { Side::Inside } else { Side::Outside };
        let sides: Vec<Side> = windings.iter().map(side).collect();
        let mut on_surface = vec![false; welded.vertices.len()];
        let of_faces = triangles.iter().filter(|t| t.face.is_some()).flat_map(|t| t.corners);
        of_faces.for_each(|v| on_surface[v as usize] = true);
        let tetrahedra = welded.tetrahedra.iter().copied().zip(sides.iter().copied());
        let classes = Classes::count(welded.vertices.len(), tetrahedra, |v| on_surface[v as usize]);
        Ok(Self { vertices: welded.vertices, tetrahedra: welded.tetrahedra, sides, classes })
    }

    /// Positions in the mesh's unit: the solid's vertices, in their order and bit for bit, then the others in the order of
    /// the [`TetMesh`]. Of several vertices of the solid at the same position tetrahedra use the first.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Corner ids, in the order of the [`TetMesh`] and positively oriented: `(b − a) × (c − a) · (d − a) > 0`.
    pub fn tetrahedra(&self) -> &[[u32; 4]] {
        &self.tetrahedra
    }

    /// Where each tetrahedron lies.
    pub fn sides(&self) -> &[Side] {
        &self.sides
    }

    /// How many vertices and tetrahedra there are of each class.
    pub fn classes(&self) -> Classes {
        self.classes
    }

    /// Corner positions of a tetrahedron.
    ///
    /// # Panics
    /// When `tetrahedron` is not smaller than the number of tetrahedra.
    pub fn corners(&self, tetrahedron: usize) -> [DVec3; 4] {
        self.tetrahedra[tetrahedron].map(|v| self.vertices[v as usize])
    }
}

impl Welded {
    fn corners(&self, tetrahedron: usize) -> [DVec3; 4] {
        self.tetrahedra[tetrahedron].map(|v| self.vertices[v as usize])
    }
}

/// Turns tetrahedra over that are in negative order.
fn orient(welded: &mut Welded) -> Result<(), ConformingError> {
    let mut first = None;
    let mut flat = 0;
    for t in 0..welded.tetrahedra.len() {
        let [a, b, c, d] = welded.corners(t);
        match orientation(a, b, c, d) {
            0 => {
                flat += 1;
                first.get_or_insert(t);
            }
            // Behind: negative order.
            1.. => welded.tetrahedra[t].swap(2, 3),
            _ => {}
        }
    }
    let Some(tetrahedron) = first else { return Ok(()) };
    let position = 0.25 * welded.corners(tetrahedron).iter().sum::<DVec3>();
    Err(ConformingError::Flat { flat, of: welded.tetrahedra.len(), tetrahedron, position })
}
