//! Compares the certificate with dense brute force, on random meshes and random tetrahedra: at no
//! point of a cell is its list farther than the mesh.

use crate::support::cells::Cells;
use crate::support::reference::{Reference, exceeds};
use crate::support::rotation::cases;
use crate::support::shapes::{FAMILIES, Family, Shape};
use crate::support::well_formed::WellFormed;
use proptest::prelude::*;
use tesdf::Length;
use tesdf::encode::{EncodeOptions, Encoder, Groups, Preset};
use tesdf::glam::DVec3;
use tesdf::query::Precision;

fn options(preset: Preset, band: f64) -> EncodeOptions {
    EncodeOptions { band: Length::OfDiagonal(band), ..EncodeOptions::preset(preset) }
}

/// Encodes a member of a family, checks its cells, and checks distances.
fn check_member(family: Family, seed: u64, options: &EncodeOptions) -> Result<(), String> {
    let solid = family.member(seed);
    let asset = Encoder::new().options(options.clone()).encode(&solid).map_err(|e| e.to_string())?;
    let (reference, cells) = (Reference::new(solid.mesh()), Cells::of(&asset));
    let band = options.band.resolve(reference.local_diagonal());
    WellFormed { reference: &reference, cells: &cells, band, lattice: 3, max_cells: 1500 }.check()?;
    for (kind, p) in crate::support::points::sample(solid.mesh(), &cells, 450) {
        let exact = reference.signed_distance(p);
        for precision in [Precision::F32, Precision::F64] {
            let found = asset.query_with(p, precision).signed_distance;
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
fn cells_of_each_mesh_family_are_right_with_each_preset() {
    for family in FAMILIES {
        let presets =
            [(Preset::Default, 0.05), (Preset::Fast, 0.0), (Preset::Compact, 0.5), (Preset::Gpu, 0.05)];
        for (preset, band) in presets {
            if let Err(e) = check_member(family, 1, &options(preset, band)) {
                panic!("{family:?} {preset:?}: {e}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(96), ..ProptestConfig::default() })]

    #[test]
    fn random_closed_meshes(
        family in prop::sample::select(FAMILIES.to_vec()),
        seed in any::<u64>(),
        band in prop::sample::select(vec![0.0, 0.05, 0.3]),
        byte_worth in -3.0..0.5f64,
        tighten_levels in 0u32..14,
        group in prop::sample::select(vec![0, 0, 4, 32]),
    ) {
        let fit_within = Length::OfDiagonal(0.05);
        let options = EncodeOptions {
            band: Length::OfDiagonal(band),
            byte_worth: 10f64.powf(byte_worth),
            tighten_levels,
            groups: (group > 0).then_some(Groups { size: group, fit_within }),
            ..EncodeOptions::default()
        };
        if let Err(e) = check_member(family, seed, &options) {
            return Err(TestCaseError::fail(e));
        }
    }
}

/// Shows that the checks can fail.
#[test]
fn missing_faces_are_found() {
    let solid = Shape::default().add_sphere(DVec3::ZERO, 1, || 1.0).solid();
    let asset = Encoder::new().options(options(Preset::Fast, 0.05)).encode(&solid).expect("valid options");
    let reference = Reference::new(solid.mesh());
    let mut cells = Cells::of(&asset);
    let band = 0.05 * reference.local_diagonal();
    let check = |cells: &Cells| {
        WellFormed { reference: &reference, cells, band, lattice: 6, max_cells: usize::MAX }.check()
    };
    check(&cells).expect("as encoded");
    let longest = (0..cells.leaves.len()).max_by_key(|&l| cells.leaves[l].faces.len()).expect("cells");
    let leaf = &mut cells.leaves[longest];
    assert!(leaf.faces.len() > 4);
    leaf.faces.truncate(2);
    leaf.positions.truncate(2);
    check(&cells).expect_err("faces were taken away");
}
