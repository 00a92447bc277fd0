//! Matches the vertices of the tetrahedra with those of the surface.
use std::collections::HashMap;

use glam::DVec3;

use super::{ConformingError, TetMesh};
use crate::mesh::{SolidMesh, coordinate_in_range};

/// Tetrahedra over the vertices of a surface and further vertices.
pub(super) struct Welded {
    /// The vertices of the surface, then the vertices that only tetrahedra use.
    pub vertices: Vec<DVec3>,
    pub tetrahedra: Vec<[u32; 4]>,
    /// For each vertex of the surface, the first vertex at its position.
    pub surface: Vec<u32>,
    /// For each vertex after those of the surface, its id in the [`TetMesh`].
    pub origin: Vec<u32>,
}

/// The bits of the position, with 0 in place of -0.
fn key(p: DVec3) -> [u64; 3] {
    (p + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// For each position the first position that is equal to it, bit for bit except for the sign of 0.
pub(in crate::domain) fn first_at_position(positions: &[DVec3]) -> Vec<u32> {
    let mut ids = HashMap::with_capacity(positions.len());
    (0u32..).zip(positions).map(|(id, &p)| *ids.entry(key(p)).or_insert(id)).collect()
}

pub(super) fn weld(solid: &SolidMesh, tets: &TetMesh) -> Result<Welded, ConformingError> {
    let mut vertices = solid.mesh().vertices().to_vec();
    let mut ids: HashMap<[u64; 3], u32> = HashMap::with_capacity(vertices.len() + tets.vertices().len());
    let surface = first_at_position(&vertices);
    (0u32..).zip(&surface).filter(|&(id, &first)| id == first).for_each(|(id, _)| {
        ids.insert(key(vertices[id as usize]), id);
    });

    let mut used = vec![false; tets.vertices().len()];
    tets.tetrahedra().iter().flatten().for_each(|&v| used[v as usize] = true);
    let mut origin = Vec::new();
    let mut welded = vec![u32::MAX; tets.vertices().len()];
    for (vertex, &p) in tets.vertices().iter().enumerate().filter(|(v, _)| used[*v]) {
        let axes = ['x', 'y', 'z'].into_iter().zip(p.to_array());
        if let Some((axis, value)) = axes.into_iter().find(|&(_, value)| !coordinate_in_range(value)) {
            return Err(ConformingError::OutOfRange { vertex, axis, value });
        }
        welded[vertex] = *ids.entry(key(p)).or_insert_with(|| {
            origin.push(vertex as u32);
            vertices.push(p);
            vertices.len() as u32 - 1
        });
    }
    let tetrahedra: Vec<_> =
        tets.tetrahedra().iter().map(|corners| corners.map(|v| welded[v as usize])).collect();
    let welded = Welded { vertices, tetrahedra, surface, origin };
    welded.has_all_of(solid)?;
    Ok(welded)
}

impl Welded {
    /// Whether each vertex that a face uses is a corner of a tetrahedron.
    fn has_all_of(&self, solid: &SolidMesh) -> Result<(), ConformingError> {
        let positions = solid.mesh().vertices();
        let mut on_face = vec![false; positions.len()];
        solid.mesh().faces().iter().flatten().for_each(|&v| on_face[v as usize] = true);
        let mut is_corner = vec![false; self.vertices.len()];
        self.tetrahedra.iter().flatten().for_each(|&v| is_corner[v as usize] = true);
        let mut first = None;
        let (mut missing, mut of) = (0, 0);
        for vertex in (0..positions.len()).filter(|&v| on_face[v]) {
            of += 1;
            if !is_corner[self.surface[vertex] as usize] {
                missing += 1;
                first.get_or_insert(vertex);
            }
        }
        let Some(vertex) = first else { return Ok(()) };
        let position = positions[vertex];
        let distance = (0..self.vertices.len())
            .filter(|&v| is_corner[v])
            .map(|v| self.vertices[v].distance(position))
            .fold(f64::INFINITY, f64::min);
        Err(ConformingError::VertexMissing { missing, of, vertex, position, distance })
    }
}
