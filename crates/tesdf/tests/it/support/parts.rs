//! Meshes of parts: cubes, open or not, outward or inside out; bowls; a one-sided strip.
use std::collections::HashMap;

use tesdf::glam::{DMat3, DVec3};
use tesdf::mesh::TriangleMesh;

/// Faces from parts, which share no vertices.
#[derive(Clone, Default)]
pub struct Parts {
    pub vertices: Vec<DVec3>,
    pub faces: Vec<[u32; 3]>,
}

/// Whether the faces of a part look outward.
#[derive(Clone, Copy, PartialEq)]
pub enum Turn {
    Outward,
    Inward,
}

impl Parts {
    pub fn add(mut self, vertices: &[DVec3], faces: &[[u32; 3]], turn: Turn) -> Self {
        let first = self.vertices.len() as u32;
        self.vertices.extend(vertices);
        self.faces.extend(faces.iter().map(|f| {
            let [a, b, c] = f.map(|v| v + first);
            if turn == Turn::Outward { [a, b, c] } else { [a, c, b] }
        }));
        self
    }

    pub fn cube(self, low: DVec3, edge: f64, turn: Turn) -> Self {
        self.add(&corners(low, edge), &sides(&[0, 1, 2, 3, 4, 5]), turn)
    }

    /// A cube without the side at its greatest z.
    pub fn open_cube(self, low: DVec3, edge: f64, turn: Turn) -> Self {
        self.add(&corners(low, edge), &sides(&[0, 2, 3, 4, 5]), turn)
    }

    /// A square about the origin, across z.
    pub fn plate(self, edge: f64) -> Self {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let corners = corners.map(|[x, y]| 0.5 * edge * DVec3::new(x, y, 0.0));
        self.add(&corners, &[[0, 1, 2], [0, 2, 3]], Turn::Outward)
    }

    /// The mesh, with one vertex for each position, as reading makes it.
    pub fn mesh(self) -> TriangleMesh {
        let mut known: HashMap<[u64; 3], u32> = HashMap::new();
        let mut vertices = Vec::new();
        let mut weld = |v: &DVec3| {
            *known.entry(v.to_array().map(f64::to_bits)).or_insert_with(|| {
                vertices.push(*v);
                vertices.len() as u32 - 1
            })
        };
        let at: Vec<u32> = self.vertices.iter().map(&mut weld).collect();
        let faces = self.faces.iter().map(|f| f.map(|v| at[v as usize])).collect();
        TriangleMesh::new(vertices, faces).expect("valid ids")
    }

    /// The mesh turned about a general axis.
    pub fn turned(self) -> Self {
        let turn = DMat3::from_rotation_x(0.3) * DMat3::from_rotation_y(0.7) * DMat3::from_rotation_z(1.1);
        Self { vertices: self.vertices.into_iter().map(|v| turn * v).collect(), ..self }
    }
}

fn corners(low: DVec3, edge: f64) -> Vec<DVec3> {
    let corner = |k: u32| low + edge * DVec3::new((k & 1).into(), (k >> 1 & 1).into(), (k >> 2).into());
    (0..8).map(corner).collect()
}

/// Two faces for each side of a cube: low z, high z, low y, high y, low x, high x.
fn sides(which: &[usize]) -> Vec<[u32; 3]> {
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    which
        .iter()
        .flat_map(|&k| [[quads[k][0], quads[k][1], quads[k][2]], [quads[k][0], quads[k][2], quads[k][3]]])
        .collect()
}

/// A sphere of rings, from its south pole up to the ring `rings` of `n`. With the ring `n` it is closed.
pub fn bowl(n: u32, rings: u32) -> Parts {
    let (is_closed, rings) = (rings == n, rings.min(n - 1));
    let mut vertices = vec![DVec3::NEG_Z];
    for ring in 1..=rings {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(n);
        for k in 0..2 * n {
            let around = std::f64::consts::PI * f64::from(k) / f64::from(n);
            vertices.push(DVec3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), -polar.cos()));
        }
    }
    let at = |ring: u32, k: u32| 1 + (ring - 1) * 2 * n + k % (2 * n);
    let mut faces = Vec::new();
    for k in 0..2 * n {
        faces.push([0, at(1, k + 1), at(1, k)]);
        for ring in 1..rings {
            faces.push([at(ring, k), at(ring, k + 1), at(ring + 1, k)]);
            faces.push([at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)]);
        }
    }
    if is_closed {
        vertices.push(DVec3::Z);
        let pole = vertices.len() as u32 - 1;
        faces.extend((0..2 * n).map(|k| [at(rings, k), at(rings, k + 1), pole]));
    }
    Parts { vertices, faces }
}

/// A strip with one side, of `n` quads.
pub fn moebius(n: u32) -> Parts {
    let vertices = (0..n).flat_map(|i| {
        let around = 2.0 * std::f64::consts::PI * f64::from(i) / f64::from(n);
        let across = DVec3::new(around.cos(), around.sin(), 0.0) * (0.5 * around).cos()
            + DVec3::Z * (0.5 * around).sin();
        let middle = 2.0 * DVec3::new(around.cos(), around.sin(), 0.0);
        [middle - 0.5 * across, middle + 0.5 * across]
    });
    let faces = (0..n).flat_map(|i| {
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 < n { (a + 2, a + 3) } else { (1, 0) };
        [[a, b, c], [b, d, c]]
    });
    Parts { vertices: vertices.collect(), faces: faces.collect() }
}

/// Triangles that enclose nothing, in all or in part, repeated ones, and a needle.
pub fn soups() -> [TriangleMesh; 5] {
    let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) - 0.5;
    let corners: Vec<DVec3> = (0..6).map(corner).collect();
    let needle = vec![DVec3::ZERO, DVec3::X, DVec3::new(0.5, 1e-9, 0.0), DVec3::new(0.2, 0.6, 0.4)];
    let soups: [(&[DVec3], &[[u32; 3]]); 5] = [
        (&corners, &[[0, 1, 2]]),
        (&corners, &[[0, 1, 2], [3, 4, 5]]),
        (&corners, &[[0, 1, 2], [0, 1, 2], [2, 1, 3], [5, 0, 3]]),
        (&corners, &[[0, 1, 2], [0, 1, 3], [0, 1, 4]]),
        (&needle, &[[0, 1, 2], [0, 1, 3]]),
    ];
    soups.map(|(vertices, faces)| {
        let vertices = vertices.iter().map(|v| 0.8 * *v).collect();
        TriangleMesh::new(vertices, faces.to_vec()).expect("valid ids")
    })
}
