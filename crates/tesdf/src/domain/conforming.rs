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

/// A tetrahedralisation that conforms to the surface of a solid: each face is a side of tetrahedra,
/// and no face passes through a tetrahedron.
///
/// It covers the whole inside, and may cover a part of the outside. It is valid by construction.
///
/// # What is checked
/// The checks are made in this order. The errors of [`new`](Self::new) begin with the name of the
/// check.
///
/// 1. **Range**: predicates are exact.
/// 2. **Surface vertices**: each is a corner, bit for bit.
/// 3. **Orientation**: no tetrahedron is flat. The test is exact. Tetrahedra in negative order are
///    turned over.
/// 4. **Sharing**: a triangle has one tetrahedron, or two with one on each side.
/// 5. **Faces**: each face of the surface is a triangle of tetrahedra.
/// 6. **Labels**: tetrahedra that are connected without passing a face have one winding number:
///    that of a point inside of them, which is exact. Behind a face it is one more than in front of
///    the face. Where one side of a triangle has no tetrahedron, it is 0 there.
/// 7. **Volume**: the tetrahedra inside have the volume that the surface encloses, to 1e-9.
/// 8. **Overlap**: the outer boundary consists of all triangles with one tetrahedron. It does not
///    meet itself, and goes around no place twice.
///
/// # Why that is enough
/// By 4, the triangles between tetrahedra cancel. So the boundaries of all tetrahedra together are
/// the outer boundary, and the number of tetrahedra around a point is the winding number of the
/// outer boundary there. By 8, this number is 0 or 1, so no two tetrahedra overlap.
///
/// By 6, each part of the boundary of the tetrahedra, weighted by winding number, is a face. So the
/// weighted tetrahedra around a point add up to the winding number of the surface, and every point
/// with a winding number of 1 or more is in a tetrahedron.
///
/// The volume alone would not show an overlap: whether tetrahedra overlap or not, the volume of all
/// of them is that of the outer boundary. The check of the volume guards the arithmetic.
#[derive(Clone, Debug, PartialEq)]
pub struct ConformingMesh {
    vertices: Vec<DVec3>,
    tetrahedra: Vec<[u32; 4]>,
    sides: Vec<Side>,
    classes: Classes,
}

impl ConformingMesh {
    /// Matches tetrahedra with a surface, and checks that they conform to it.
    ///
    /// Vertices are matched bit for bit (0 and -0 are equal). Vertices that no tetrahedron uses are
    /// dropped, and vertices at the same position become one vertex. Where the corners of a
    /// tetrahedron are in negative order, the last two are swapped.
    ///
    /// # Errors
    /// [`ConformingError`] names the check that failed, the place, and what to do next.
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

    /// Positions in the unit of the mesh: first the vertices of the solid, in their order and bit
    /// for bit, then the others in the order of the [`TetMesh`]. Where several vertices of the
    /// solid have the same position, tetrahedra use the first.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Corner ids, in the order of the [`TetMesh`] and positively oriented: `(b − a) × (c − a) · (d
    /// − a) > 0`.
    pub fn tetrahedra(&self) -> &[[u32; 4]] {
        &self.tetrahedra
    }

    /// The side of the surface that each tetrahedron is on.
    pub fn sides(&self) -> &[Side] {
        &self.sides
    }

    /// The numbers of vertices and tetrahedra of each class.
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

/// Turns tetrahedra in negative order over.
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
            // The corner lies behind, so the order is negative.
            1.. => welded.tetrahedra[t].swap(2, 3),
            _ => {}
        }
    }
    let Some(tetrahedron) = first else { return Ok(()) };
    let position = 0.25 * welded.corners(tetrahedron).iter().sum::<DVec3>();
    Err(ConformingError::Flat { flat, of: welded.tetrahedra.len(), tetrahedron, position })
}
