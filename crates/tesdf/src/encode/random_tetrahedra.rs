//! Checks the filter, the cover and the tightening against brute force, on random tetrahedra among
//! random triangles.
use glam::DVec3;
use proptest::prelude::*;

use super::candidates::Pool;
use super::filter::{MANY, PAD, Scratch, filter};
use super::surface::{Surface, Touching};
use super::tighten::tighten;
use crate::base::{Chains, Isa};
use crate::domain::Cell;
use crate::geometry::{Aabb, triangle_meets_tetrahedron};
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

/// Half of them have a corner on a face or next to it.
fn tetrahedron(surface: &Surface, random: &mut Random) -> Cell {
    let size = 10f64.powf(random.between(-6.0, -0.3));
    let at = 0.4 * in_cube(random);
    let corner = |random: &mut Random| match random.below(2) {
        0 => at + size * in_cube(random),
        _ => at + size * in_cube(random).round(),
    };
    loop {
        let mut corners: [DVec3; 4] = std::array::from_fn(|_| corner(random));
        if random.below(2) == 0 {
            let [a, b, c] = surface.triangles[random.below(surface.triangles.len())].corners;
            let beside = 10f64.powf(random.between(-16.0, -8.0)) * random.direction();
            let way =
                a.lerp(b, random.between(0.0, 0.5)).lerp(c, random.between(0.0, 0.5)) + beside - corners[0];
            corners.iter_mut().for_each(|p| *p += way);
        }
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
        let mesh = soup(kind, &mut random);
        let mut surface = Surface::new(&mesh, 1.0, Touching::Kept);
        let cell = tetrahedron(&surface, &mut random);
        let all: Vec<u32> = (0..surface.faces.len() as u32).collect();
        let pool = Pool::new(&surface, &all, &cell);
        let candidates = pool.candidates();
        let mut scratch = Scratch::default();
        let filtered = filter(&surface, &cell, &candidates, Chains::NONE, &mut scratch);
        surface.isa = Isa::Baseline;
        let scalar = filter(&surface, &cell, &candidates, Chains::NONE, &mut scratch);
        prop_assert_eq!(&filtered.survivors, &scalar.survivors);
        prop_assert_eq!(filtered.crossing, scalar.crossing);
        let survivors: Vec<u32> = filtered.survivors.iter().map(|s| candidates.faces[s.index as usize]).collect();
        // Of corners, the test of a triangle and a tetrahedron says less than twice their distance.
        let meets = |face: u32, pad| triangle_meets_tetrahedron(&surface.triangles[face as usize].corners, &cell.corners, pad);
        for &face in all.iter().filter(|&&face| meets(face, 0.5 * PAD)) {
            prop_assert!(filtered.crossing && survivors.contains(&face), "{face} meets the cell");
        }
        for (survivor, &face) in filtered.survivors.iter().zip(&survivors) {
            prop_assert!(!survivor.meets || filtered.crossing && meets(face, PAD), "{face} is away from the cell");
        }
        let apart = Surface::new(&mesh, 1.0, Touching::Ignored);
        let ignored = filter(&apart, &cell, &candidates, Chains::NONE, &mut scratch);
        prop_assert!(!ignored.crossing && ignored.survivors.iter().all(|s| !s.meets), "{:?}", ignored);
        let ignored: Vec<u32> = ignored.survivors.iter().map(|s| candidates.faces[s.index as usize]).collect();
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
            for (name, faces) in [("survivors", &survivors), ("touching ignored", &ignored), ("cover", &cover), ("tightened", &tight)] {
                let excess = least(faces, p) - exact;
                prop_assert!(excess <= 5e-14, "{}: farther by {:e} at {}", name, excess, p);
            }
        }
    }
}

#[test]
fn cells_of_many_candidates_keep_all_that_may_meet_them() {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| 0.1 * axis);
    let cell = Cell { corners: [DVec3::ZERO, x, y, z], depth: 0 };
    let center = cell.centroid();
    let outward = (x - center).normalize();
    let (u, v) = outward.any_orthonormal_pair();
    // Before the corner that is farthest from the middle, beyond it, and far away.
    for (at, meets) in
        [(x, true), (x + 0.5 * PAD * outward, true), (x + 1e-6 * outward, false), (0.5 * outward, false)]
    {
        let corners = [at + 0.01 * u, at + 0.01 * v, at - 0.01 * (u + v)];
        let mesh = TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]; MANY + 1]).expect("valid ids");
        for touching in [Touching::Kept, Touching::Ignored] {
            let surface = Surface::new(&mesh, 1.0, touching);
            let all: Vec<u32> = (0..surface.faces.len() as u32).collect();
            let pool = Pool::new(&surface, &all, &cell);
            let filtered = filter(&surface, &cell, &pool.candidates(), Chains::NONE, &mut Scratch::default());
            let kept = touching == Touching::Kept;
            assert_eq!(filtered.crossing, kept && meets, "{at} {touching:?}");
            assert_eq!(filtered.survivors.len(), all.len(), "{at} {touching:?}");
            assert!(filtered.survivors.iter().all(|survivor| survivor.meets == kept), "{at} {touching:?}");
        }
    }
}

#[test]
fn faces_behind_another_are_kept_where_they_meet_the_cell() {
    // The cell stands on the tip of a face, above that of another one. So of all corners, the first
    // tip is nearer.
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let cell = Cell {
        corners: [DVec3::ZERO, at(0.03, 0.0, 0.3), at(-0.02, 0.02, 0.3), at(-0.02, -0.02, 0.3)],
        depth: 0,
    };
    for (below, meets) in [(0.4 * PAD, true), (0.9 * PAD, true), (1.1 * PAD, false), (1e-6, false)] {
        let tip = |z: f64| [at(0.0, 0.0, -z), at(0.01, 0.0, -0.1), at(0.0, 0.01, -0.1)];
        for lifted in [0.0, 1e-6] {
            let vertices = [tip(0.0), tip(below)].concat();
            let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [3, 4, 5]]).expect("valid ids");
            let surface = Surface::new(&mesh, 1.0, Touching::Kept);
            let cell = Cell { corners: cell.corners.map(|p| p + lifted * DVec3::Z), ..cell };
            let pool = Pool::new(&surface, &[0, 1], &cell);
            let filtered = filter(&surface, &cell, &pool.candidates(), Chains::NONE, &mut Scratch::default());
            let kept: Vec<u32> = filtered.survivors.iter().map(|survivor| survivor.index).collect();
            let expected: &[u32] = if meets && lifted == 0.0 { &[0, 1] } else { &[0] };
            assert_eq!(kept, expected, "{below} {lifted}");
            assert_eq!(filtered.crossing, lifted == 0.0);
        }
    }
}

/// Tetrahedra of a conforming domain may be as flat as rounding allows.
#[test]
fn a_cell_without_thickness_keeps_the_face_that_it_lies_on() {
    let vertices = [[0.0, 0.0], [0.6, 0.0], [0.0, 0.6], [0.6, 0.6]].map(|[x, y]| DVec3::new(x, y, 0.0));
    // The first face twice, a face beside it, and one behind them.
    let behind = vertices.map(|p| p - 0.1 * DVec3::Z);
    let faces = vec![[0, 1, 2], [0, 1, 2], [1, 3, 2], [4, 5, 6]];
    let mesh = TriangleMesh::new([vertices, behind].concat(), faces).expect("valid ids");
    let flat = [[0.1, 0.1], [0.3, 0.1], [0.1, 0.3], [0.2, 0.2]].map(|[x, y]| DVec3::new(x, y, 0.0));
    for thickness in [0.0, 1e-17, 1e-16] {
        let mut corners = flat;
        corners[3].z = thickness;
        let cell = Cell { corners, depth: 0 };
        let mut surface = Surface::new(&mesh, 1.0, Touching::Ignored);
        for &isa in Isa::of_processor() {
            surface.isa = isa;
            let pool = Pool::new(&surface, &[0, 1, 2, 3], &cell);
            let filtered = filter(&surface, &cell, &pool.candidates(), Chains::NONE, &mut Scratch::default());
            let kept: Vec<u32> = filtered.survivors.iter().map(|survivor| survivor.index).collect();
            assert!(kept.contains(&0) || kept.contains(&1), "{thickness:e} {isa:?}: {kept:?}");
            assert!(!kept.contains(&3), "{thickness:e} {isa:?}: {kept:?}");
        }
    }
}
