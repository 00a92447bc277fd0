//! Random query points. The same seed gives the same points.
use fastrand::Rng;
use tesdf::TeSdf;
use tesdf::geometry::{Aabb, Triangle};
use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;

/// Half width of the layer near the surface, as a fraction of the diagonal.
pub const NEAR: f64 = 0.02;

/// Points that are uniform on the surface by area, then moved along the normal of their face by a
/// uniform distance up to [`NEAR`].
pub fn near_surface(mesh: &TriangleMesh, count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Rng::with_seed(seed);
    let diagonal = mesh.diagonal();
    let mut area = 0.0;
    let sums: Vec<f64> = (0..mesh.faces().len())
        .map(|f| {
            // The areas are relative to the diagonal, so none underflows.
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

/// Uniform points in a box.
pub fn in_box(bounds: Aabb, count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Rng::with_seed(seed);
    (0..count).map(|_| one_in_box(bounds, &mut random)).collect()
}

/// Uniform points in the domain of an asset: points of the box around its cells, without those
/// outside the domain.
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
