//! The triangles that Gmsh wrote, of second order.
use std::collections::HashMap;

use glam::DVec3;

use super::CadError;
use crate::geometry::Aabb;
use crate::mesh::msh::{self, Msh, MshError, Wanted};

/// The surfaces of a CAD model as triangles.
pub(super) struct Surface {
    /// Corners of triangles, and the middles of their edges, which lie on the curved surface.
    pub positions: Vec<DVec3>,
    /// By their numbers.
    pub faces: Vec<Face>,
    /// By their numbers.
    pub volumes: Vec<Volume>,
}

/// One surface of the model.
pub(super) struct Face {
    pub tag: i32,
    /// Corners. Gmsh orients the triangles of a solid outward.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, the middles of its edges, beginning with the edge from corner 0 to 1.
    middles: Vec<[u32; 3]>,
}

/// One solid of the model.
pub(super) struct Volume {
    pub tag: i32,
    /// Its surfaces, as indices into those of the model.
    pub faces: Vec<usize>,
}

impl Surface {
    /// Reads a file in MSH 4.1.
    pub fn read(bytes: &[u8]) -> Result<Self, CadError> {
        let Msh { nodes, triangles, surfaces, volumes, .. } =
            msh::read(bytes, Wanted::Surfaces).map_err(|e| match e {
                MshError::Malformed { place, found, .. } => CadError::Output { place, found },
                MshError::Volume { place, element, kind } => {
                    CadError::Output { place, found: format!("element {element} is {kind}") }
                }
            })?;
        let face = |&tag: &i32| Face { tag, triangles: Vec::new(), middles: Vec::new() };
        let mut faces: Vec<Face> = surfaces.iter().map(face).collect();
        let by_tag: HashMap<i32, usize> = surfaces.iter().enumerate().map(|(i, &tag)| (tag, i)).collect();
        for (surface, [a, b, c, ab, bc, ca]) in triangles {
            let Some(&face) = by_tag.get(&surface) else { continue };
            faces[face].triangles.push([a, b, c]);
            faces[face].middles.push([ab, bc, ca]);
        }
        let volume = |(tag, around): (i32, Vec<i32>)| {
            let mut own = Vec::new();
            for face in around.iter().filter_map(|tag| by_tag.get(&tag.saturating_abs())) {
                // A face that bounds a solid from both sides is within it.
                match own.iter().position(|other| other == face) {
                    Some(at) => drop(own.remove(at)),
                    None => own.push(*face),
                }
            }
            Volume { tag, faces: own }
        };
        Ok(Self { positions: nodes, faces, volumes: volumes.into_iter().map(volume).collect() })
    }

    /// Largest distance between the middle of an edge on the curved surface and the straight edge.
    pub fn deviation(&self) -> f64 {
        let at = |v: u32| self.positions[v as usize];
        let mut largest = 0.0_f64;
        for face in &self.faces {
            for (t, m) in face.triangles.iter().zip(&face.middles) {
                for i in 0..3 {
                    let (a, b, middle) = (at(t[i]), at(t[(i + 1) % 3]), at(m[i]));
                    let edge = b - a;
                    let along = (edge.dot(middle - a) / edge.length_squared()).clamp(0.0, 1.0);
                    let along = if along.is_finite() { along } else { 0.0 };
                    largest = largest.max((a + along * edge).distance(middle));
                }
            }
        }
        largest
    }

    /// Length of the diagonal of the bounds.
    pub fn diagonal(&self) -> f64 {
        Aabb::of(&self.positions).extent().length()
    }
}
