use std::sync::Arc;

use glam::DVec3;

use crate::TeSdf;
use crate::asset::layout::{SignHints, TreeChild};
use crate::asset::{Conforming, FaceRecord, Incidence, Motion, SharedSection};
use crate::geometry::{Aabb, orientation};

/// Why vertices cannot be moved; nothing was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DeformError {
    /// The cells do not follow the surface.
    #[error(
        "the asset has the bisection domain, whose cells do not follow the surface; encode it in a conforming domain"
    )]
    NotConforming,
    /// A vertex that there is not.
    #[error("vertex {vertex} of {count}; the mesh's come first, then those of the domain")]
    Vertex {
        /// The number given.
        vertex: u32,
        /// How many there are.
        count: usize,
    },
    /// A position that is not finite, or farther out than `f32` can tell faces apart.
    #[error("vertex {vertex} would be at {position}; expected finite numbers within {limit} of {middle}")]
    Position {
        /// The vertex.
        vertex: u32,
        /// Where it was to go.
        position: DVec3,
        /// Middle of the domain.
        middle: DVec3,
        /// How far from there a coordinate may be, in the mesh's unit.
        limit: f64,
    },
}

/// What [`TeSdf::move_vertices`] has changed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Moved {
    /// Faces with a vertex that moved.
    pub faces: usize,
    /// Tetrahedra with a vertex that moved.
    pub tetrahedra: usize,
    /// Those of them that are now inside out or flat, ascending: points of them may be found in several cells or in none.
    pub inverted: Vec<u32>,
}

impl TeSdf {
    /// Moves vertices of a conforming domain to new positions, in the mesh's unit. Numbers are those of
    /// [`ConformingMesh::vertices`](crate::domain::ConformingMesh::vertices): the mesh's vertices, then the domain's own.
    ///
    /// Connectivity, lists and labels stay. Distances are then those to the listed faces where they are now; what the
    /// certificate says of them is void until [`reencode_stale`](Self::reencode_stale). Outside of the domain the face tree answers,
    /// refitted and exact. [`as_bytes`](Self::as_bytes) remains the file of the shape at rest, [`save`](Self::save) writes the
    /// shape as it is.
    ///
    /// # Errors
    /// [`DeformError`]; nothing has moved then.
    pub fn move_vertices(&mut self, moves: &[(u32, DVec3)]) -> Result<Moved, DeformError> {
        let Some(mut domain) = self.conforming.take() else { return Err(DeformError::NotConforming) };
        let moved = self.checked(moves, &domain).map(|()| self.apply(moves, &mut domain));
        self.conforming = Some(domain);
        moved
    }

    fn checked(&self, moves: &[(u32, DVec3)], domain: &Conforming) -> Result<(), DeformError> {
        let count = self.vertices.len() + domain.vertices().len();
        let reach = 2.0 * self.cube.side();
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
            // How a feature tells the sign depends on the faces around it: what told it at rest need not tell it now.
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
