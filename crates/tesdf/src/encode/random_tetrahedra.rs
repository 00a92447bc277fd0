//! Checks the filter, the cover and the tightening against brute force, on random tetrahedra among
//! random triangles.
use glam::DVec3;
use proptest::prelude::*;

use super::candidates::Pool;
use super::filter::{Scratch, filter};
use super::surface::{Surface, Touching};
use super::tighten::tighten;
use crate::base::{Chains, Isa};
use crate::domain::Cell;
use crate::geometry::Aabb;
use crate::mesh::TriangleMesh;
use crate::sampling::Random;

/// A random point in the cube from -1 to 1.
fn in_cube(random: &mut Random) -> DVec3 {
    random.in_box(Aabb { min: DVec3::NEG_ONE, max: DVec3::ONE })
}

/// The points of a tetrahedron whose weights are multiples of `1 / n`.
fn lattice([a, b, c, d]: &[DVec3; 4], n: u32) -> Vec<DVec3> {
    let weight = |w: u32| f64::from(w) / f64::from(n);
    let point = |i: u32, j: u32, k: u32| {
        weight(i) * *a + weight(j) * *b + weight(k) * *c + weight(n - i - j - k) * *d
    };
    let rows = (0..=n).flat_map(|i| (0..=n - i).map(move |j| (i, j)));
    rows.flat_map(|(i, j)| (0..=n - i - j).map(move |k| point(i, j, k))).collect()
}

/// Random triangles around the cell. They share vertices like those of a surface, but need not be
/// closed.
#[derive(Clone, Copy, Debug)]
enum Soup {
    General,
    /// Corners on a coarse lattice: ties, coplanar and degenerate triangles.
    Lattice,
    /// Two sheets at a distance from a few rounding errors to 1e-7.
    Sheets,
    Needles,
    /// Tangent to a sphere around the cell, so all are about equally near.
    Around,
}

const SOUPS: [Soup; 5] = [Soup::General, Soup::Lattice, Soup::Sheets, Soup::Needles, Soup::Around];

fn soup(kind: Soup, random: &mut Random) -> TriangleMesh {
    let n = 4 + random.below(12);
    let lattice = |random: &mut Random| (in_cube(random) * 3.0).round() / 8.0;
    let apart = 10f64.powf(random.between(-16.0, -7.0));
    let mut vertices: Vec<DVec3> = (0..n)
        .map(|_| match kind {
            Soup::General => 0.4 * in_cube(random),
            Soup::Lattice => lattice(random),
            Soup::Sheets => {
                let p = lattice(random);
                DVec3::new(p.x, p.y, if random.below(2) == 0 { 0.1 } else { 0.1 + apart })
            }
            Soup::Needles => 0.4 * in_cube(random) * DVec3::new(1.0, 1e-7, 1e-7) + 0.01 * lattice(random),
            Soup::Around => 0.3 * random.direction(),
        })
        .collect();
    let corner = |random: &mut Random| random.below(n) as u32;
    let mut faces: Vec<[u32; 3]> =
        (0..2 * n).map(|_| [corner(random), corner(random), corner(random)]).collect();
    faces.retain(|[a, b, c]| a != b && b != c && c != a);
    if faces.is_empty() {
        faces.push([0, 1, 2]);
    }
    // Bodies in the local frame have a diagonal of 0.5 to 1.
    let extent = TriangleMesh::new(vertices.clone(), faces.clone()).expect("valid ids").diagonal();
    // Corners that all but coincide would be scaled out of the frame, where rounding exceeds the
    // margin.
    let scale = if extent > 1e-3 { 0.7 / extent } else { 1.0 };
    vertices.iter_mut().for_each(|v| *v *= scale);
    TriangleMesh::new(vertices, faces).expect("valid ids")
}

fn tetrahedron(random: &mut Random) -> Cell {
    let size = 10f64.powf(random.between(-6.0, -0.3));
    let at = 0.4 * in_cube(random);
    let corner = |random: &mut Random| match random.below(2) {
        0 => at + size * in_cube(random),
        _ => at + size * in_cube(random).round(),
    };
    loop {
        let corners = std::array::from_fn(|_| corner(random));
        let cell = Cell { corners, depth: random.below(3) as u32 };
        if cell.volume() > 1e-3 * size.powi(3) {
            return cell;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, ..ProptestConfig::default() })]

    #[test]
    fn lists_of_random_tetrahedra_keep_the_least_distance(kind in prop::sample::select(SOUPS.to_vec()), seed in any::<u64>(), levels in 0u32..9) {
        let mut random = Random::new(seed, 0);
        let mut surface = Surface::new(&soup(kind, &mut random), 1.0, Touching::Kept);
        let cell = tetrahedron(&mut random);
        let all: Vec<u32> = (0..surface.faces.len() as u32).collect();
        let pool = Pool::new(&surface, &all, &cell);
        let candidates = pool.candidates();
        let mut scratch = Scratch::default();
        let filtered = filter(&surface, &cell, &candidates, Chains::NONE, &mut scratch);
        surface.isa = Isa::Baseline;
        let scalar = filter(&surface, &cell, &candidates, Chains::NONE, &mut scratch);
        prop_assert_eq!(&filtered.survivors, &scalar.survivors);
        let survivors: Vec<u32> = filtered.survivors.iter().map(|s| candidates.faces[s.index as usize]).collect();
        let mut required: Vec<_> = filtered.survivors.iter().map(|s| s.requirement).collect();
        required.sort_unstable();
        let cover = surface.cover(&required);
        let (tight, chains) = tighten(&surface, &cell, &cover, levels, filtered.chains, &mut scratch);
        prop_assert!(filtered.chains <= chains && chains.used() <= Chains::BUDGET);
        prop_assert!(tight.windows(2).all(|w| w[0] < w[1]), "{:?}", tight);

        let least = |faces: &[u32], p: DVec3| {
            faces.iter().map(|&f| surface.triangles[f as usize].closest(p).distance).fold(f64::INFINITY, f64::min)
        };
        let mut points = lattice(&cell.corners, 6);
        points.extend((0..64).map(|_| random.in_simplex(&cell.corners)));
        for p in points {
            let exact = least(&all, p);
            for (name, faces) in [("survivors", &survivors), ("cover", &cover), ("tightened", &tight)] {
                let excess = least(faces, p) - exact;
                prop_assert!(excess <= 5e-14, "{}: farther by {:e} at {}", name, excess, p);
            }
        }
    }
}
