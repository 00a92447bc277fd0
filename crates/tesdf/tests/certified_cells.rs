//! Compares the certificate with dense brute force, on random meshes and random tetrahedra: at no
//! point of a cell is its list farther than the mesh.
mod support;

use proptest::prelude::*;
use support::cells::{Cells, lattice};
use support::random::Random;
use support::reference::{Reference, exceeds};
use support::shapes::{FAMILIES, Family, Shape};
use support::well_formed::WellFormed;
use tesdf::asset::about::Source;
use tesdf::domain::Cell;
use tesdf::encode::candidates::Pool;
use tesdf::encode::chains::Chains;
use tesdf::encode::filter::{Scratch, filter};
use tesdf::encode::surface::{Surface, Touching};
use tesdf::encode::tighten::tighten;
use tesdf::encode::{EncodeOptions, EncodeProgress, Length, Preset, encode};
use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;
use tesdf::query::{Isa, Precision};

fn options(preset: Preset, band: f64) -> EncodeOptions {
    EncodeOptions { band: Length::OfDiagonal(band), ..EncodeOptions::preset(preset) }
}

/// Encodes a member of a family, checks its cells, and checks distances.
fn check_member(family: Family, seed: u64, options: &EncodeOptions) -> Result<(), String> {
    let solid = family.member(seed);
    let asset =
        encode(&solid, &Source::default(), options, &EncodeProgress::default()).map_err(|e| e.to_string())?;
    let (reference, cells) = (Reference::new(solid.mesh()), Cells::of(&asset));
    let band = options.band.resolve(reference.local_diagonal());
    WellFormed { reference: &reference, cells: &cells, band, lattice: 3, most_cells: 1500 }.check()?;
    for (kind, p) in support::points::sample(solid.mesh(), &cells, 450) {
        let exact = reference.signed_distance(p);
        for precision in [Precision::F32, Precision::F64] {
            let found = asset.signed_distance(p, precision);
            let tolerance = match precision {
                Precision::F32 => reference.tolerance_f32(p),
                Precision::F64 => reference.tolerance_f64(p),
            };
            let wrong_sign = (found < 0.0) != (exact < 0.0) && exact.abs() > tolerance;
            if exceeds((found.abs() - exact.abs()).abs(), tolerance) || wrong_sign {
                let d = reference.diagonal;
                return Err(format!(
                    "{kind:?} {precision:?} {p:?}: {:e} is not {:e} diagonals",
                    found / d,
                    exact / d
                ));
            }
        }
    }
    Ok(())
}

#[test]
fn one_of_each_family_with_each_preset() {
    for family in FAMILIES {
        for (preset, band) in [(Preset::Default, 0.05), (Preset::Fast, 0.0), (Preset::Compact, 0.5)] {
            if let Err(e) = check_member(family, 1, &options(preset, band)) {
                panic!("{family:?} {preset:?}: {e}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn random_closed_meshes(
        family in prop::sample::select(FAMILIES.to_vec()),
        seed in any::<u64>(),
        band in prop::sample::select(vec![0.0, 0.05, 0.3]),
        byte_worth in -3.0..0.5f64,
        tighten_levels in 0u32..14,
    ) {
        let options = EncodeOptions {
            band: Length::OfDiagonal(band),
            byte_worth: 10f64.powf(byte_worth),
            tighten_levels,
            ..EncodeOptions::default()
        };
        if let Err(e) = check_member(family, seed, &options) {
            return Err(TestCaseError::fail(e));
        }
    }
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
    let n = 4 + random.index(12);
    let lattice = |random: &mut Random| (random.in_cube() * 3.0).round() / 8.0;
    let apart = 10f64.powf(random.between(-16.0, -7.0));
    let mut vertices: Vec<DVec3> = (0..n)
        .map(|_| match kind {
            Soup::General => 0.4 * random.in_cube(),
            Soup::Lattice => lattice(random),
            Soup::Sheets => {
                let p = lattice(random);
                DVec3::new(p.x, p.y, if random.index(2) == 0 { 0.1 } else { 0.1 + apart })
            }
            Soup::Needles => 0.4 * random.in_cube() * DVec3::new(1.0, 1e-7, 1e-7) + 0.01 * lattice(random),
            Soup::Around => 0.3 * random.direction(),
        })
        .collect();
    let corner = |random: &mut Random| random.index(n) as u32;
    let mut faces: Vec<[u32; 3]> =
        (0..2 * n).map(|_| [corner(random), corner(random), corner(random)]).collect();
    faces.retain(|[a, b, c]| a != b && b != c && c != a);
    if faces.is_empty() {
        faces.push([0, 1, 2]);
    }
    // Bodies in the local frame have a diagonal of 0.5 to 1.
    let extent = TriangleMesh::new(vertices.clone(), faces.clone()).expect("valid ids").diagonal();
    vertices.iter_mut().for_each(|v| *v *= 0.7 / extent.max(1e-3));
    TriangleMesh::new(vertices, faces).expect("valid ids")
}

fn tetrahedron(random: &mut Random) -> Cell {
    let size = 10f64.powf(random.between(-6.0, -0.3));
    let at = 0.4 * random.in_cube();
    let corner = |random: &mut Random| match random.index(2) {
        0 => at + size * random.in_cube(),
        _ => at + size * random.in_cube().round(),
    };
    loop {
        let corners = std::array::from_fn(|_| corner(random));
        let cell = Cell { corners, depth: random.index(3) as u32 };
        if cell.volume() > 1e-3 * size.powi(3) {
            return cell;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, ..ProptestConfig::default() })]

    #[test]
    fn random_tetrahedra(kind in prop::sample::select(SOUPS.to_vec()), seed in any::<u64>(), levels in 0u32..9) {
        let mut random = Random(seed);
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
        points.extend((0..64).map(|_| support::cells::combine(&cell.corners, &random.weights())));
        for p in points {
            let exact = least(&all, p);
            for (name, faces) in [("survivors", &survivors), ("cover", &cover), ("tightened", &tight)] {
                let excess = least(faces, p) - exact;
                prop_assert!(excess <= 5e-14, "{}: farther by {:e} at {}", name, excess, p);
            }
        }
    }
}

/// Shows that the checks can fail.
#[test]
fn missing_faces_are_noticed() {
    let solid = Shape::default().add_sphere(DVec3::ZERO, 1, || 1.0).solid();
    let asset = encode(&solid, &Source::default(), &options(Preset::Fast, 0.05), &EncodeProgress::default())
        .expect("valid options");
    let reference = Reference::new(solid.mesh());
    let mut cells = Cells::of(&asset);
    let band = 0.05 * reference.local_diagonal();
    let check = |cells: &Cells| {
        WellFormed { reference: &reference, cells, band, lattice: 6, most_cells: usize::MAX }.check()
    };
    check(&cells).expect("as encoded");
    let longest = (0..cells.leaves.len()).max_by_key(|&l| cells.leaves[l].faces.len()).expect("cells");
    let leaf = &mut cells.leaves[longest];
    assert!(leaf.faces.len() > 4);
    leaf.faces.truncate(2);
    leaf.positions.truncate(2);
    check(&cells).expect_err("faces were taken away");
}
