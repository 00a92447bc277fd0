use std::sync::Arc;

use glam::DVec3;

use crate::TeSdf;
use crate::asset::layout::{SignHints, TreeChild};
use crate::asset::{Conforming, FaceRecord, Incidence, Motion, SharedSection};
use crate::geometry::{Aabb, orientation};

/// Largest distance of a moved vertex from the middle of the cube along each axis, in sides of the
/// cube. Farther out, `f32` cannot tell faces apart.
#[doc(hidden)]
pub const FARTHEST: f64 = 2.0;

/// Why vertices cannot be moved. Nothing has moved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DeformError {
    /// The asset has the bisection domain, whose cells do not follow the surface.
    #[error(
        "the asset has the bisection domain, whose cells do not follow the surface; encode it in a conforming domain"
    )]
    NotConforming,
    /// A vertex does not exist.
    #[error("vertex {vertex} of {count}; the mesh's come first, then those of the domain")]
    Vertex {
        /// The number of the vertex.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A position is not finite, or is so far out that `f32` cannot tell faces apart.
    #[error("vertex {vertex} would be at {position}; expected finite numbers within {limit} of {middle}")]
    Position {
        /// The vertex.
        vertex: u32,
        /// The position asked for.
        position: DVec3,
        /// Middle of the domain.
        middle: DVec3,
        /// Largest distance of a coordinate from there, in the unit of the mesh.
        limit: f64,
    },
}

/// The changes of [`TeSdf::move_vertices`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Moved {
    /// Faces with a vertex that moved.
    pub faces: usize,
    /// Tetrahedra with a vertex that moved.
    pub tetrahedra: usize,
    /// The moved tetrahedra that are now inside out or flat, ascending. Points of such a
    /// tetrahedron may be located in several cells or in none.
    pub inverted: Vec<u32>,
}

impl TeSdf {
    /// Moves vertices of a conforming domain to new positions, in the unit of the mesh. The numbers
    /// of vertices are those of
    /// [`ConformingMesh::vertices`](crate::domain::ConformingMesh::vertices): first the vertices of
    /// the mesh, then the others of the domain.
    ///
    /// Connectivity, lists and labels do not change. From then on, distances are those to the
    /// listed faces at their new positions. The certificate does not hold until
    /// [`reencode_stale`](Self::reencode_stale). Outside of the domain the face tree answers. It is
    /// refitted, so its answers are exact. [`as_bytes`](Self::as_bytes) still gives the file of the
    /// shape at rest, and [`save`](Self::save) writes the current shape.
    ///
    /// # Errors
    /// [`DeformError`]. Nothing has moved then.
    pub fn move_vertices(&mut self, moves: &[(u32, DVec3)]) -> Result<Moved, DeformError> {
        let Some(mut domain) = self.conforming.take() else { return Err(DeformError::NotConforming) };
        let moved = self.checked(moves, &domain).map(|()| self.apply(moves, &mut domain));
        self.conforming = Some(domain);
        moved
    }

    fn checked(&self, moves: &[(u32, DVec3)], domain: &Conforming) -> Result<(), DeformError> {
        let count = self.vertices.len() + domain.vertices().len();
        let reach = FARTHEST * self.cube.side();
        for &(vertex, position) in moves {
            if vertex as usize >= count {
                return Err(DeformError::Vertex { vertex, count });
            }
            let from_middle = self.frame.to_local(position) - self.cube.middle();
            if !(from_middle.is_finite() && from_middle.abs().max_element() <= reach) {
                let middle = self.frame.to_world(self.cube.middle());
                let limit = reach * self.frame.inverse_scale();
                return Err(DeformError::Position { vertex, position, middle, limit });
            }
        }
        Ok(())
    }

    fn apply(&mut self, moves: &[(u32, DVec3)], domain: &mut Conforming) -> Moved {
        let mesh_count = self.vertices.len() as u32;
        let mut motion = self.motion.take().unwrap_or_else(|| {
            // The sign that a feature tells depends on the faces around it, so a hint for the shape
            // at rest may be wrong now.
            self.sign_hints = SharedSection::of_rows(&vec![0; self.faces.len()]);
            self.records.iter_mut().for_each(|record| record.forget_hints());
            Motion {
                incidence: Arc::new(domain.incidence(self.placed(), &self.faces, &self.tree_children)),
                faces: vec![false; self.faces.len()],
                tetrahedra: vec![false; domain.tetrahedra().len()],
            }
        });
        let incidence = Arc::clone(&motion.incidence);
        let mut own = self.vertices.to_vec();
        let mut others = domain.vertices().to_vec();
        let (mut faces, mut tetrahedra) = (Vec::new(), Vec::new());
        for &(vertex, position) in moves {
            match vertex.checked_sub(mesh_count) {
                None => {
                    own[vertex as usize] = position.to_array();
                    faces.extend_from_slice(incidence.faces.of(vertex));
                }
                Some(other) => others[other as usize] = position.to_array(),
            }
            tetrahedra.extend_from_slice(incidence.tetrahedra.of(vertex));
        }
        for items in [&mut faces, &mut tetrahedra] {
            items.sort_unstable();
            items.dedup();
        }
        self.vertices = SharedSection::of_rows(&own);
        // The faces are refitted below.
        self.forget_normals();
        domain.set_vertices(&others);
        faces.iter().for_each(|&f| motion.faces[f as usize] = true);
        tetrahedra.iter().for_each(|&t| motion.tetrahedra[t as usize] = true);
        self.refit_faces(&faces, &incidence);
        domain.refit(self.placed(), &tetrahedra, &incidence);
        let inverted = |&t: &u32| {
            let [a, b, c, d] = domain.corners_in_unit(self.placed(), t as usize);
            orientation(a, b, c, d) >= 0
        };
        let moved = Moved {
            faces: faces.len(),
            tetrahedra: tetrahedra.len(),
            inverted: tetrahedra.iter().copied().filter(inverted).collect(),
        };
        self.motion = Some(motion);
        self.about_mut().certificate.delta = None;
        self.about_mut().certificate.delta_of_diagonal = None;
        self.shape_changed();
        moved
    }

    fn refit_faces(&mut self, faces: &[u32], incidence: &Incidence) {
        let middle = self.cube.middle();
        for &face in faces {
            let triangle = self.local_triangle(face as usize);
            self.records[face as usize] = FaceRecord::new(&triangle, middle, SignHints::default());
        }
        let mut boxes = self.tree_boxes.to_vec();
        incidence.face_tree.climb(faces.iter().copied(), |slot| {
            let (node, side) = (slot as usize / 2, slot as usize % 2);
            let fitted = match TreeChild::decode(self.tree_children[node][side]) {
                TreeChild::Node(below) => union(&boxes[below as usize]),
                TreeChild::Leaf(start, count) => {
                    let corners = (start..start + count).flat_map(|f| self.face_corners(f as usize));
                    let around =
                        corners.fold(Aabb::EMPTY, |b, p| b.union(Aabb::of(&[self.frame.to_local(p)])));
                    around.rounded_from(middle)
                }
            };
            let old: &mut [f32] = &mut boxes[node][6 * side..6 * side + 6];
            let changed = *old != fitted;
            old.copy_from_slice(&fitted);
            changed
        });
        self.tree_boxes = SharedSection::of_rows(&boxes);
    }
}

fn union(node: &[f32; 12]) -> [f32; 6] {
    std::array::from_fn(|k| if k < 3 { node[k].min(node[k + 6]) } else { node[k].max(node[k + 6]) })
}
