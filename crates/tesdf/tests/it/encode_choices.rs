//! The choices of a user: their names, what options they become, and which of them exclude each
//! other.
use std::num::NonZeroU32;

use crate::support::shapes::Shape;
use tesdf::base::{InsideRule, SurfaceFaces};
use tesdf::encode::{
    ChoiceError, Deformation, DomainChoice, DomainError, EncodeChoices, EncodeOptions, EncoderChoice,
    InsideChoice, Method, Preset, Refinement, Sampling, Threshold,
};
use tesdf::glam::DVec3;
use tesdf::{Length, Progress};

fn file() -> DomainChoice {
    "part.msh".parse().expect("any text is a domain")
}

#[test]
fn texts_are_the_choices_that_they_name() {
    for (text, expected) in [
        ("bisection", DomainChoice::Bisection),
        ("gmsh", DomainChoice::Gmsh),
        ("gmsh/", DomainChoice::File("gmsh/".into())),
        ("Bisection", DomainChoice::File("Bisection".into())),
    ] {
        assert_eq!(text.parse(), Ok(expected));
    }
    assert_eq!("sampled".parse(), Ok(EncoderChoice::Sampled));
    assert_eq!("generalized".parse(), Ok(InsideChoice::Generalized));
    assert!(
        "proved".parse::<EncoderChoice>().is_err_and(|e| e.contains("certified") && e.contains("sampled"))
    );
    assert!("even".parse::<InsideChoice>().is_err_and(|e| e.contains("nonzero") && e.contains("sheet")));
}

#[test]
fn a_threshold_is_a_length_or_an_area_or_safe() {
    for (text, expected) in [
        ("0", Some(Threshold::Absolute(0.0))),
        (" 1e-3 ", Some(Threshold::Absolute(1e-3))),
        ("safe", Some(Threshold::CoveringRadius)),
        ("squared:1e-6", Some(Threshold::Squared(1e-6))),
        ("squared: 0", Some(Threshold::Squared(0.0))),
        ("-1", None),
        ("inf", None),
        ("NaN", None),
        ("squared:-1e-6", None),
        ("squared:", None),
        ("squared", None),
        ("cubed:1", None),
        ("Safe", None),
        ("", None),
    ] {
        match (text.parse::<Threshold>(), expected) {
            (Ok(found), Some(expected)) => assert_eq!(found, expected, "{text}"),
            (Err(e), None) => {
                assert!(e.to_string().starts_with(&format!("'{text}' is no threshold; expected")), "{e}");
            }
            (found, expected) => panic!("{text}: {found:?}, expected {expected:?}"),
        }
    }
}

#[test]
fn choices_become_the_options_of_the_preset_with_their_changes() {
    let default = EncodeOptions::default;
    let sampled =
        |resolution, threshold| Method::Sampled(Sampling { resolution, threshold, ..Sampling::PAPER });
    let zero = Threshold::Absolute(0.0);
    let none = EncodeChoices::default;
    let sheet = InsideRule::Sheet { thickness: 0.5 };
    let cases = [
        (none(), default()),
        (EncodeChoices { preset: Preset::Gpu, ..none() }, EncodeOptions::preset(Preset::Gpu)),
        // The bisection domain consists of bisections, whatever the preset says.
        (
            EncodeChoices { preset: Preset::Paper, ..none() },
            EncodeOptions { refinement: Refinement::ByCost, ..EncodeOptions::PAPER },
        ),
        (EncodeChoices { preset: Preset::Paper, domain: file(), ..none() }, EncodeOptions::PAPER),
        (EncodeChoices { encoder: Some(EncoderChoice::Certified), ..none() }, default()),
        (
            EncodeChoices { encoder: Some(EncoderChoice::Sampled), ..none() },
            EncodeOptions { method: sampled(32, zero), ..default() },
        ),
        (
            EncodeChoices {
                encoder: Some(EncoderChoice::Sampled),
                resolution: Some(7),
                threshold: Some(Threshold::Squared(1e-6)),
                ..none()
            },
            EncodeOptions { method: sampled(7, Threshold::Squared(1e-6)), ..default() },
        ),
        (
            EncodeChoices { domain: file(), refinement: Some(Refinement::None), ..none() },
            EncodeOptions { refinement: Refinement::None, ..default() },
        ),
        (
            EncodeChoices { band: Some(2.0), regions: vec![[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]], ..none() },
            EncodeOptions {
                band: Length::Absolute(2.0),
                regions: vec![[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]],
                ..default()
            },
        ),
        (
            EncodeChoices {
                domain: DomainChoice::Gmsh,
                band: Some(1.0),
                e_max: NonZeroU32::new(9),
                deformation: Deformation::Expected,
                unit: Some("mm".into()),
                ..none()
            },
            EncodeOptions {
                band: Length::Absolute(1.0),
                max_entries: Some(9),
                deformation: Deformation::Expected,
                unit: Some("mm".into()),
                ..default()
            },
        ),
        (
            EncodeChoices { inside: InsideChoice::Sheet, thickness: Some(0.5), ..none() },
            EncodeOptions { inside: sheet.into(), ..default() },
        ),
    ];
    for (choices, expected) in cases {
        assert_eq!(choices.options(), Ok(expected), "{choices:?}");
    }
    let rules = [
        (InsideChoice::Winding, InsideRule::Winding),
        (InsideChoice::Nonzero, InsideRule::Nonzero),
        (InsideChoice::Odd, InsideRule::Odd),
        (InsideChoice::Generalized, InsideRule::Generalized),
    ];
    for (inside, rule) in rules {
        for surface in [SurfaceFaces::All, SurfaceFaces::Boundary] {
            let found = EncodeChoices { inside, surface, ..none() }.inside().expect("no thickness is needed");
            assert_eq!((found.rule, found.surface), (rule, surface));
        }
    }
}

#[test]
fn choices_that_exclude_each_other_are_refused() {
    let none = EncodeChoices::default;
    let sheet = InsideChoice::Sheet;
    let cases = [
        (
            EncodeChoices { preset: Preset::Paper, encoder: Some(EncoderChoice::Certified), ..none() },
            ChoiceError::CertifiedPreset,
        ),
        (EncodeChoices { resolution: Some(8), ..none() }, ChoiceError::NotSampled),
        (EncodeChoices { threshold: Some(Threshold::CoveringRadius), ..none() }, ChoiceError::NotSampled),
        (EncodeChoices { domain: file(), band: Some(1.0), ..none() }, ChoiceError::BesidesFile),
        (EncodeChoices { domain: file(), regions: vec![[0.0; 6]], ..none() }, ChoiceError::BesidesFile),
        (EncodeChoices { refinement: Some(Refinement::None), ..none() }, ChoiceError::PlainBisection),
        (EncodeChoices { inside: sheet, ..none() }, ChoiceError::NoThickness),
        (EncodeChoices { thickness: Some(1.0), ..none() }, ChoiceError::NotASheet),
        (
            EncodeChoices { inside: sheet, thickness: Some(1.0), surface: SurfaceFaces::Boundary, ..none() },
            ChoiceError::BoundaryOfSheet,
        ),
    ];
    for (choices, expected) in cases {
        assert_eq!(choices.options(), Err(expected), "{choices:?}");
    }
}

#[test]
fn the_errors_of_a_domain_name_its_file() {
    let solid = Shape::default().add_box(DVec3::ZERO, DVec3::ONE, 1).solid();
    let folder = tempfile::tempdir().expect("a folder");
    let tetrahedra = |path: &std::path::Path| {
        let choices = EncodeChoices { domain: DomainChoice::File(path.into()), ..EncodeChoices::default() };
        choices.tetrahedra(&solid, &Progress::default())
    };
    let bisection = EncodeChoices::default().tetrahedra(&solid, &Progress::default());
    assert!(matches!(bisection, Ok(None)));
    let missing = folder.path().join("none.msh");
    let error = tetrahedra(&missing).expect_err("no file");
    assert!(matches!(error, DomainError::Read { .. }));
    assert_eq!(error.to_string().matches("none.msh").count(), 1, "{error}");
    let damaged = folder.path().join("damaged.msh");
    std::fs::write(&damaged, "$MeshFormat\n").expect("a writable folder");
    let error = tetrahedra(&damaged).expect_err("no mesh");
    assert_eq!(error.to_string().matches("damaged.msh").count(), 1, "{error}");
}
