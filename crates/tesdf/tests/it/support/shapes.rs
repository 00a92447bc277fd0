use std::collections::HashMap;

use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh};

use super::random::Random;

/// A mesh to which closed surfaces are added one by one.
#[derive(Default)]
pub struct Shape {
    pub vertices: Vec<DVec3>,
    pub faces: Vec<[u32; 3]>,
}

/// Corners of the sides of a box, outward. Bit `k` of a corner selects the maximum of axis `k`.
const SIDES: [[u32; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

impl Shape {
    pub fn solid(self) -> SolidMesh {
        SolidMesh::new(self.mesh()).expect("a closed shape")
    }

    pub fn mesh(self) -> TriangleMesh {
        TriangleMesh::new(self.vertices, self.faces).expect("valid ids")
    }

    /// Adds a box whose sides have `n` × `n` squares.
    pub fn add_box(mut self, min: DVec3, max: DVec3, n: u32) -> Self {
        let mut ids = HashMap::new();
        for [a, b, c, d] in SIDES {
            let corner = |k: u32| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
            let mut at = |i: u32, j: u32| {
                let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let unit = corner(a) + u * (corner(b) - corner(a)) + v * (corner(d) - corner(a));
                debug_assert_eq!(corner(b) + corner(d), corner(a) + corner(c));
                let p = min + unit * (max - min);
                *ids.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
                    self.vertices.push(p);
                    self.vertices.len() as u32 - 1
                })
            };
            for i in 0..n {
                for j in 0..n {
                    let [p, q, r, s] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    self.faces.extend([[p, q, r], [p, r, s]]);
                }
            }
        }
        self
    }

    /// Adds a sphere of 20 · 4^`levels` faces. `radius` gives the distance of each vertex from the
    /// centre.
    pub fn add_sphere(mut self, center: DVec3, levels: u32, mut radius: impl FnMut() -> f64) -> Self {
        let g = (1.0 + 5f64.sqrt()) / 2.0;
        let mut points: Vec<DVec3> = [(0, 1), (1, 2), (2, 0)]
            .into_iter()
            .flat_map(|(a, b)| {
                [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)].map(|(x, y)| {
                    let mut p = DVec3::ZERO;
                    (p[a], p[b]) = (x, y);
                    p.normalize()
                })
            })
            .collect();
        let edge = points.iter().skip(1).map(|p| p.distance(points[0])).fold(f64::INFINITY, f64::min);
        let joined = |a: DVec3, b: DVec3| a.distance(b) < 1.1 * edge;
        let mut faces = Vec::new();
        for a in 0..12usize {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    let [p, q, r] = [a, b, c].map(|k| points[k]);
                    if joined(p, q) && joined(q, r) && joined(r, p) {
                        let outward = (q - p).cross(r - p).dot(p) > 0.0;
                        faces.push(if outward { [a, b, c] } else { [a, c, b] });
                    }
                }
            }
        }
        for _ in 0..levels {
            let mut middles = HashMap::new();
            let mut finer = Vec::with_capacity(4 * faces.len());
            for [a, b, c] in faces {
                let mut middle = |i: usize, j: usize| {
                    *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                        points.push((points[i] + points[j]).normalize());
                        points.len() - 1
                    })
                };
                let [d, e, f] = [middle(a, b), middle(b, c), middle(c, a)];
                finer.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
            }
            faces = finer;
        }
        let first = self.vertices.len() as u32;
        self.vertices.extend(points.iter().map(|p| center + radius() * p));
        self.faces.extend(faces.iter().map(|f| f.map(|v| first + v as u32)));
        self
    }
}

/// Families of shapes that are difficult for a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// A sphere with every vertex moved along its radius; it may be spiky.
    RoughSphere,
    /// Overlapping boxes: the surface intersects itself, and the winding number is 2 in the
    /// overlap.
    OverlappingBoxes,
    /// Cubes of a lattice that touch in faces, edges and corners, and keep their inner faces.
    TouchingCubes,
    /// Two boxes with a gap of 1e-7 of the diagonal, and a wall of the same thickness.
    ThinWalls,
    /// A box whose faces are a million times longer than wide.
    Slivers,
    /// A prism with many sides, all at the same distance from its axis.
    Prism,
    /// A ball in a concentric shell: every point midway between them has many faces at nearly the
    /// same distance.
    Shell,
}

pub const FAMILIES: [Family; 7] = [
    Family::RoughSphere,
    Family::OverlappingBoxes,
    Family::TouchingCubes,
    Family::ThinWalls,
    Family::Slivers,
    Family::Prism,
    Family::Shell,
];

impl Family {
    /// A member of the family. Its size and position also depend on the seed.
    pub fn member(self, seed: u64) -> SolidMesh {
        let mut random = Random(seed);
        let mut shape = self.shape(&mut random);
        let scale = 10f64.powf(random.between(-4.0, 3.0));
        let to = match random.index(3) {
            0 => DVec3::ZERO,
            1 => random.in_cube(),
            _ => 100.0 * random.in_cube(),
        };
        // Equal coordinates are rounded equally, so a closed surface stays closed.
        shape.vertices.iter_mut().for_each(|v| *v = scale * (*v + to));
        shape.solid()
    }

    fn shape(self, random: &mut Random) -> Shape {
        let shape = Shape::default();
        match self {
            Self::RoughSphere => {
                let (levels, rough) = (1 + random.index(2) as u32, random.between(0.0, 0.6));
                shape.add_sphere(DVec3::ZERO, levels, || 1.0 + random.between(-rough, rough))
            }
            Self::OverlappingBoxes => (0..2 + random.index(3)).fold(shape, |shape, _| {
                let (min, size) = (random.in_cube(), 0.2 + random.in_cube().abs());
                shape.add_box(min, min + size, 1 + random.index(2) as u32)
            }),
            Self::TouchingCubes => {
                let mut shape = shape;
                for k in 0..27u32 {
                    if k == 13 || random.index(3) == 0 {
                        let at = DVec3::new((k % 3) as f64, (k / 3 % 3) as f64, (k / 9) as f64);
                        shape = shape.add_box(at, at + 1.0, 1);
                    }
                }
                shape
            }
            Self::ThinWalls => {
                let gap = 10f64.powf(random.between(-9.0, -5.0));
                shape.add_box(DVec3::ZERO, DVec3::new(1.0, 1.0, 0.5), 2).add_box(
                    DVec3::new(0.0, 0.0, 0.5 + gap),
                    DVec3::new(1.0, 1.0, 0.5 + 2.0 * gap),
                    2,
                )
            }
            Self::Slivers => {
                let width = 10f64.powf(random.between(-8.0, -5.0));
                let tilt = random.in_cube() * 0.1;
                let mut shape = shape.add_box(DVec3::ZERO, DVec3::new(1.0, width, 0.7), 3);
                shape.vertices.iter_mut().for_each(|v| v.y += tilt.dot(*v));
                shape
            }
            Self::Prism => prism(12 + random.index(30) as u32),
            Self::Shell => {
                let rough = if random.index(2) == 0 { 0.0 } else { 1e-9 };
                let inner = random.between(0.1, 0.8);
                let mut shape = shape.add_sphere(DVec3::ZERO, 1, || inner);
                shape.faces.iter_mut().for_each(|f| f.swap(1, 2));
                let shape = shape.add_sphere(DVec3::ZERO, 1, || 1.0 + random.between(-rough, rough));
                shape.add_sphere(DVec3::ZERO, 1, || 0.5 * inner)
            }
        }
    }
}

fn prism(n: u32) -> Shape {
    let mut shape = Shape::default();
    for k in 0..n {
        let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
        shape.vertices.extend([DVec3::new(c, s, -0.5), DVec3::new(c, s, 0.5)]);
    }
    for k in 0..n {
        let [a, b, c, d] = [2 * k, 2 * ((k + 1) % n), 2 * ((k + 1) % n) + 1, 2 * k + 1];
        shape.faces.extend([[a, b, c], [a, c, d]]);
        if k > 0 && k + 1 < n {
            shape.faces.extend([[0, b, a], [1, d, c]]);
        }
    }
    shape
}
