use std::collections::HashMap;

use tesdf::TeSdf;
use tesdf::glam::{DVec3, Vec3};

use crate::SmoothNormals;

/// A mesh whose middle is farther from its origin than this many radii is stored around its middle:
/// 32-bit floats would otherwise leave it fewer than 16 bits.
const FAR: f64 = 128.0;

/// A mesh for drawing. A vertex whose faces meet in a sharp edge is there once for each side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Where the positions have their origin, in the shape's frame and unit. It is 0 unless the
    /// mesh is far from the origin of its frame.
    pub middle: DVec3,
    /// Positions of the vertices relative to [`middle`](Self::middle), in the shape's unit.
    pub positions: Vec<[f32; 3]>,
    /// Outward unit normals of the vertices, in the shape's frame.
    pub normals: Vec<[f32; 3]>,
    /// Three vertices for each face, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
}

impl Mesh {
    /// The mesh of an asset. Faces without area are left out.
    pub fn of_asset(asset: &TeSdf) -> Self {
        let smooth = SmoothNormals::new(asset);
        let bounds = asset.bounds();
        let (middle, radius) = (bounds.center(), 0.5 * bounds.extent().length());
        let middle = if middle.length() > FAR * radius { middle } else { DVec3::ZERO };
        let mut builder = Builder { mesh: Self { middle, ..Self::default() }, known: HashMap::new() };
        let mut ids: Vec<(u32, usize)> =
            (0..asset.face_count()).map(|position| (asset.face_id(position), position)).collect();
        ids.sort_unstable();
        for (id, position) in ids {
            let Some((corners, normals)) = smooth.corners(id) else { continue };
            let vertices = asset.face_vertices(position);
            for k in 0..3 {
                builder.push(vertices[k], corners[k], normals[k]);
            }
        }
        builder.mesh
    }

    /// Appends a vertex and returns its number.
    pub(crate) fn vertex(&mut self, position: Vec3, normal: Vec3) -> u32 {
        let vertex = self.positions.len() as u32;
        self.positions.push(position.to_array());
        self.normals.push(normal.to_array());
        vertex
    }

    /// Appends the two faces of a quadrilateral, counter-clockwise seen from outside.
    pub(crate) fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.indices.extend([a, b, c, a, c, d]);
    }

    /// Least and greatest coordinates of the positions.
    pub fn extremes(&self) -> [Vec3; 2] {
        let positions = || self.positions.iter().copied().map(Vec3::from_array);
        [positions().fold(Vec3::INFINITY, Vec3::min), positions().fold(Vec3::NEG_INFINITY, Vec3::max)]
    }
}

/// Joins corners that have the same vertex and the same normal.
struct Builder {
    mesh: Mesh,
    known: HashMap<(u32, [u32; 3]), u32>,
}

impl Builder {
    fn push(&mut self, vertex: u32, position: DVec3, normal: Vec3) {
        let Self { mesh, known } = self;
        let place = known
            .entry((vertex, normal.to_array().map(f32::to_bits)))
            .or_insert_with(|| mesh.vertex((position - mesh.middle).as_vec3(), normal));
        mesh.indices.push(*place);
    }
}
