//! Seeded points that queries are asked at.
use fastrand::Rng;
use tesdf::TeSdf;
use tesdf::geometry::{Aabb, Triangle};
use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;

/// Half width of the layer near the surface, as a share of the diagonal.
pub const NEAR: f64 = 0.02;

/// Points of the surface, uniform by area, moved along the normal of their face by up to [`NEAR`], uniformly.
pub fn near_surface(mesh: &TriangleMesh, count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Rng::with_seed(seed);
    let diagonal = mesh.diagonal();
    let mut area = 0.0;
    let sums: Vec<f64> = (0..mesh.faces().len())
        .map(|f| {
            // Relative to the diagonal, so that no area underflows.
            let [a, b, c] = mesh.triangle(f).map(|p| p / diagonal);
            area += (b - a).cross(c - a).length();
            area
        })
        .collect();
    let point = |_| {
        let at = random.f64() * area;
        let face = sums.partition_point(|&s| s <= at).min(sums.len() - 1);
        let [a, b, c] = mesh.triangle(face);
        let (u, v) = (random.f64().sqrt(), random.f64());
        let on = a + u * ((1.0 - v) * (b - a) + v * (c - a));
        on + (2.0 * random.f64() - 1.0) * NEAR * diagonal * Triangle::new([a, b, c]).normal
    };
    (0..count).map(point).collect()
}

/// Uniform in a box.
pub fn in_box(bounds: Aabb, count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Rng::with_seed(seed);
    (0..count).map(|_| one_in_box(bounds, &mut random)).collect()
}

/// Uniform in the domain of an asset: those of its cube that are in the domain.
pub fn in_domain(asset: &TeSdf, count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Rng::with_seed(seed);
    let mut cube = Aabb::EMPTY;
    asset.visit_cells(|cell| cube = cube.union(Aabb::of(&cell.corners)));
    std::iter::repeat_with(|| one_in_box(cube, &mut random))
        .filter(|&p| asset.query_in_domain_f32(p).is_some())
        .take(count)
        .collect()
}

fn one_in_box(bounds: Aabb, random: &mut Rng) -> DVec3 {
    bounds.min + DVec3::new(random.f64(), random.f64(), random.f64()) * bounds.extent()
}
