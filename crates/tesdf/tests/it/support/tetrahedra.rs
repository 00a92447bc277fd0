use std::collections::HashMap;

use tesdf::Side;
use tesdf::domain::{ConformingMesh, TetMesh};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};

use super::random::Random;

/// The six Kuhn tetrahedra of a cube, positively oriented. The bits of a corner are its
/// coordinates.
const KUHN: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 5, 1, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 6, 4, 7]];

/// A jittered grid of `n`³ unit cubes with six tetrahedra each. The tetrahedra of the cubes that
/// `inside` selects form the solid.
pub fn grid(n: usize, jitter: f64, inside: impl Fn(usize, usize, usize) -> bool) -> (SolidMesh, TetMesh) {
    let mut random = Random(n as u64);
    let side = n + 1;
    let id = |x: usize, y: usize, z: usize| x + side * (y + side * z);
    let mut points = Vec::new();
    for k in 0..side.pow(3) {
        let p = DVec3::new((k % side) as f64, (k / side % side) as f64, (k / side / side) as f64);
        points.push(p + jitter * random.in_cube());
    }
    let mut tetrahedra = Vec::new();
    let mut owners: HashMap<[usize; 3], ([usize; 3], i32)> = HashMap::new();
    for cube in 0..n.pow(3) {
        let (x, y, z) = (cube % n, cube / n % n, cube / n / n);
        let corner = |bits: usize| id(x + (bits & 1), y + (bits >> 1 & 1), z + (bits >> 2));
        for t in KUHN {
            let t = t.map(corner);
            tetrahedra.push(t.map(|v| v as u32));
            if inside(x, y, z) {
                for f in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
                    let face = f.map(|k| t[k]);
                    let mut key = face;
                    key.sort_unstable();
                    owners.entry(key).or_insert((face, 0)).1 += 1;
                }
            }
        }
    }
    let mut faces: Vec<[usize; 3]> = owners.into_values().filter(|o| o.1 == 1).map(|o| o.0).collect();
    faces.sort_unstable();
    let mut used = HashMap::new();
    let mut vertices = Vec::new();
    let faces = faces
        .into_iter()
        .map(|f| {
            f.map(|v| {
                *used.entry(v).or_insert_with(|| {
                    vertices.push(points[v]);
                    vertices.len() as u32 - 1
                })
            })
        })
        .collect();
    let mesh = TriangleMesh::new(vertices, faces).expect("valid ids");
    let solid = SolidMesh::new(mesh).expect("a closed surface");
    (solid, TetMesh::new(points, tetrahedra).expect("valid tetrahedra"))
}

/// A cube, surrounded by tetrahedra.
pub fn cube() -> (SolidMesh, ConformingMesh) {
    let (solid, tetrahedra) = grid(3, 0.1, |x, y, z| (x, y, z) == (1, 1, 1));
    let conforming = ConformingMesh::new(&solid, &tetrahedra).expect("conforming by construction");
    (solid, conforming)
}

/// A beam of 6 × 2 × 2 cubes, surrounded by tetrahedra.
pub fn beam() -> (SolidMesh, ConformingMesh) {
    let inside = |x, y, z| (1..7).contains(&x) && (3..5).contains(&y) && (3..5).contains(&z);
    let (solid, tetrahedra) = grid(8, 0.1, inside);
    let conforming = ConformingMesh::new(&solid, &tetrahedra).expect("conforming by construction");
    (solid, conforming)
}

/// The same beam without tetrahedra around it.
pub fn bare_beam() -> (SolidMesh, ConformingMesh) {
    let (solid, domain) = beam();
    let cells = domain.tetrahedra().iter().zip(domain.sides());
    let tetrahedra: Vec<[u32; 4]> =
        cells.filter(|(_, side)| **side == Side::Inside).map(|(t, _)| *t).collect();
    let bare = TetMesh::new(domain.vertices().to_vec(), tetrahedra).expect("tetrahedra");
    let bare = ConformingMesh::new(&solid, &bare).expect("the inside conforms, too");
    (solid, bare)
}

/// A mild bend of the beam about its end.
pub fn bend(p: DVec3) -> DVec3 {
    let turn = DQuat::from_rotation_z(0.08 * (p.x - 1.0));
    DVec3::new(1.0, 4.0, 4.0) + turn * (p - DVec3::new(1.0, 4.0, 4.0))
}

/// The argument of [`TeSdf::move_vertices`](tesdf::TeSdf::move_vertices) that moves all vertices.
pub fn moves(domain: &ConformingMesh, to: impl Fn(DVec3) -> DVec3) -> Vec<(u32, DVec3)> {
    (0..)
        .zip(domain.vertices())
        .map(|(id, &p)| (id, to(p)))
        .filter(|(id, q)| domain.vertices()[*id as usize] != *q)
        .collect()
}
