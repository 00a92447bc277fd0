//! Meshes of simple bodies.
use std::f64::consts::{FRAC_PI_2, TAU};

use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;

/// A box of 12 faces with these two corners.
pub fn cuboid(low: DVec3, high: DVec3) -> TriangleMesh {
    let corner = |k: usize| {
        let side = |axis: usize| if k >> axis & 1 == 1 { high[axis] } else { low[axis] };
        DVec3::new(side(0), side(1), side(2))
    };
    let faces = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    TriangleMesh::new((0..8).map(corner).collect(), faces.to_vec()).unwrap()
}

/// Half of a hollow ball about the origin, open at the top, of `2 n` meridians and `n` circles.
pub fn bowl(radius: f64, wall: f64, n: u32) -> TriangleMesh {
    let meridians = 2 * n;
    let mut vertices = Vec::new();
    // From the lowest point outside over the rim to the lowest point inside.
    let rows: Vec<Vec<u32>> = (0..=n)
        .map(|k| (radius, k))
        .chain((0..=n).rev().map(|k| (radius - wall, k)))
        .map(|(radius, k)| {
            let (sine, cosine) = (FRAC_PI_2 * f64::from(k) / f64::from(n)).sin_cos();
            let first = vertices.len() as u32;
            if k == 0 {
                vertices.push(-radius * DVec3::Z);
                return vec![first; meridians as usize];
            }
            vertices.extend((0..meridians).map(|m| {
                let (y, x) = (TAU * f64::from(m) / f64::from(meridians)).sin_cos();
                radius * DVec3::new(sine * x, sine * y, -cosine)
            }));
            (first..first + meridians).collect()
        })
        .collect();
    let mut faces = Vec::new();
    for pair in rows.windows(2) {
        for k in 0..meridians as usize {
            let next = (k + 1) % meridians as usize;
            let [a, b, c, d] = [pair[0][k], pair[0][next], pair[1][next], pair[1][k]];
            // At the axis a quadrangle is a triangle.
            faces.extend([[a, b, c], [a, c, d]].into_iter().filter(|[a, b, c]| a != b && b != c && a != c));
        }
    }
    TriangleMesh::new(vertices, faces).unwrap()
}

/// A block whose top, at z = 0, has `n × n` squares of two faces.
pub fn tiles(n: u32, size: f64, thickness: f64) -> TriangleMesh {
    let along = |k: u32| size * (f64::from(k) / f64::from(n) - 0.5);
    let mut vertices = Vec::new();
    for z in [0.0, -thickness] {
        vertices.extend((0..=n).flat_map(|j| (0..=n).map(move |i| DVec3::new(along(i), along(j), z))));
    }
    let top = |[i, j]: [u32; 2]| j * (n + 1) + i;
    let below = |place: [u32; 2]| top(place) + (n + 1) * (n + 1);
    let mut faces = Vec::new();
    let mut square = |[a, b, c, d]: [u32; 4]| faces.extend([[a, b, c], [a, c, d]]);
    for j in 0..n {
        for i in 0..n {
            let corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
            square(corners.map(top));
            let [a, b, c, d] = corners.map(below);
            square([a, d, c, b]);
        }
    }
    for k in 0..n {
        let sides = [
            [[k, 0], [k + 1, 0]],
            [[n, k], [n, k + 1]],
            [[n - k, n], [n - k - 1, n]],
            [[0, n - k], [0, n - k - 1]],
        ];
        for [from, to] in sides {
            square([top(from), below(from), below(to), top(to)]);
        }
    }
    TriangleMesh::new(vertices, faces).unwrap()
}
