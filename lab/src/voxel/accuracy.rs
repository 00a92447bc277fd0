//! The geometric error of a voxel grid near the surface: the question of the paper's Appendix G.
use rayon::prelude::*;
use serde::Serialize;
use tesdf::TeSdf;
use tesdf::glam::DVec3;

use super::VoxelGrid;

/// Errors of a grid at points near the surface, in the mesh's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VoxelAccuracy {
    /// Number of points.
    pub points: u64,
    /// The greatest difference between the grid's value and the exact distance.
    pub max_error: f64,
    /// The greatest difference at points of the surface: by so much the zero set is off.
    pub max_error_on_surface: f64,
    /// Root of the mean square of the differences.
    pub rms_error: f64,
}

/// Offsets of the points from the surface along the normal of a face, as fractions of the distance.
const OFFSETS: [f64; 7] = [0.0, -1.0, -0.5, -0.25, 0.25, 0.5, 1.0];

/// Random points for each face.
const RANDOM: usize = 8;

/// Compares a grid with the exact distances of its mesh.
///
/// The points are the vertices, the centre and the midpoints of the edges of each face, and random
/// points, at most `distance` away from the face along its normal. They are the same on every
/// machine, and the result is the same for any number of threads.
pub fn accuracy(grid: &VoxelGrid, asset: &TeSdf, distance: f64) -> VoxelAccuracy {
    let (vertices, faces) = (asset.arrays().vertices, asset.arrays().faces);
    let of_face = |(k, face): (usize, &[u32; 3])| {
        let corners = face.map(|v| DVec3::from_array(vertices[v as usize]));
        errors(grid, asset, corners, distance, k as u64)
    };
    let sums: Vec<Errors> = faces.par_iter().enumerate().map(of_face).collect();
    let all = sums.into_iter().fold(Errors::default(), Errors::join);
    VoxelAccuracy {
        points: all.points,
        max_error: all.max,
        max_error_on_surface: all.max_on_surface,
        rms_error: (all.squares / all.points.max(1) as f64).sqrt(),
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    points: u64,
    max: f64,
    max_on_surface: f64,
    squares: f64,
}

impl Errors {
    fn join(self, other: Self) -> Self {
        Self {
            points: self.points + other.points,
            max: self.max.max(other.max),
            max_on_surface: self.max_on_surface.max(other.max_on_surface),
            squares: self.squares + other.squares,
        }
    }
}

/// Errors around one face.
fn errors(grid: &VoxelGrid, asset: &TeSdf, [a, b, c]: [DVec3; 3], distance: f64, seed: u64) -> Errors {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let mut random = fastrand::Rng::with_seed(seed);
    let mut found = Errors::default();
    let mut compare = |point: DVec3, offset: f64| {
        let point = point + offset * distance * normal;
        let error = (grid.value(point).distance - asset.signed_distance(point)).abs();
        found.points += 1;
        found.max = found.max.max(error);
        found.squares += error * error;
        if offset == 0.0 {
            found.max_on_surface = found.max_on_surface.max(error);
        }
    };
    for point in [a, b, c, (a + b + c) / 3.0, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)] {
        OFFSETS.into_iter().for_each(|offset| compare(point, offset));
    }
    for _ in 0..RANDOM {
        // Reflected into the triangle, the point is uniform in it.
        let (u, v) = (random.f64(), random.f64());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        compare(a + u * (b - a) + v * (c - a), 2.0 * random.f64() - 1.0);
    }
    found
}
