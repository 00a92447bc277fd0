//! Guarantees of `encode` besides distances: the same bytes for any number of threads, a prompt end
//! after cancellation, and options that are checked and used.

use std::time::{Duration, Instant};

use crate::support::meshes::named;
use crate::support::rotation::of_the_day;
use crate::support::shapes::{FAMILIES, Shape};
use rayon::ThreadPoolBuilder;
use tesdf::base::InsideRule;
use tesdf::encode::{EncodeError, EncodeOptions, Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf::mesh::{RepairMode, SolidMesh};
use tesdf::{Length, Progress, Stage, TeSdf};

fn encode_on(threads: usize, solid: &SolidMesh, options: &EncodeOptions) -> TeSdf {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    pool.install(|| Encoder::new().options(options.clone()).encode(solid)).expect("valid options")
}

fn ball() -> SolidMesh {
    Shape::default().add_sphere(DVec3::ZERO, 2, || 1.0).solid()
}

#[test]
fn same_bytes_from_1_2_and_8_threads() {
    let meshes =
        ["procedural/menger_2.obj", "public/mpl_palm.stl", "procedural/iso_m16_nut_c100.obj"].map(named);
    let fast = EncodeOptions::preset(Preset::Fast);
    let compact = EncodeOptions::preset(Preset::Compact);
    let families = FAMILIES.map(|family| family.member(3));
    let small = families.iter().map(|solid| (solid, &compact));
    for (solid, options) in of_the_day(meshes.iter().map(|solid| (solid, &fast)).chain(small)) {
        let [one, two, eight, again] = [1, 2, 8, 8].map(|threads| encode_on(threads, solid, options));
        assert!(one.as_bytes() == two.as_bytes(), "1 and 2 threads differ");
        assert!(one.as_bytes() == eight.as_bytes(), "1 and 8 threads differ");
        assert!(eight.as_bytes() == again.as_bytes(), "two runs differ");
        one.verify_checksums().expect("just written");
    }
}

#[test]
fn a_cancelled_encode_stops_soon() {
    let solid = named("procedural/iso_m16_bolt_24k.obj");
    let options = EncodeOptions { byte_worth: 1e-3, ..EncodeOptions::default() };
    let progress = Progress::default();
    let (result, late) = std::thread::scope(|scope| {
        let encoder = scope.spawn(|| Encoder::new().options(options).progress(&progress).encode(&solid));
        std::thread::sleep(Duration::from_millis(1500));
        let (asked, cancelled) = (Instant::now(), !encoder.is_finished());
        progress.cancel();
        assert!(cancelled, "it was over before it could be cancelled");
        (encoder.join().expect("no panic"), asked.elapsed())
    });
    assert!(matches!(result, Err(EncodeError::Cancelled)), "{result:?}");
    // A cell takes microseconds. The bound allows for a machine under load.
    assert!(late < Duration::from_secs(2), "{late:?} after it was asked");

    let before = Progress::default();
    before.cancel();
    let result = Encoder::new().progress(&before).encode(&ball());
    assert!(matches!(result, Err(EncodeError::Cancelled)), "{result:?}");
}

/// Whatever an encoding is doing when it is cancelled, it gives no asset.
#[test]
fn an_encode_that_is_cancelled_in_any_stage_gives_nothing() {
    for stage in [Stage::Refine, Stage::Tighten] {
        let progress = Progress::telling(move |progress| {
            if progress.state().0 == stage {
                progress.cancel();
            }
        });
        let result = Encoder::new().preset(Preset::Fast).progress(&progress).encode(&ball());
        assert!(matches!(result, Err(EncodeError::Cancelled)), "{stage:?}: {:?}", result.map(|_| ()));
        assert_eq!(progress.state().0, stage, "it stops in the stage in which it is asked to");
    }
}

#[test]
fn progress_ends_in_the_last_stage() {
    let progress = Progress::default();
    assert_eq!(progress.state(), (Stage::Refine, 0.0));
    Encoder::new().progress(&progress).encode(&ball()).expect("valid options");
    assert_eq!(progress.state().0, Stage::Assemble);
    assert!(!progress.is_cancelled());
}

/// All orders of the numbers below `count`.
fn orders(count: usize) -> Vec<Vec<usize>> {
    (0..count).fold(vec![Vec::new()], |shorter, last| {
        let longer = |order: &Vec<usize>| {
            (0..=order.len()).map(|at| [&order[..at], &[last], &order[at..]].concat()).collect::<Vec<_>>()
        };
        shorter.iter().flat_map(longer).collect()
    })
}

#[test]
fn calls_of_an_encoder_give_the_same_in_every_order() {
    let boxes =
        Shape::default().add_box(DVec3::ZERO, DVec3::ONE, 1).add_box(0.5 * DVec3::ONE, 1.5 * DVec3::ONE, 1);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("boxes.ply");
    tesdf::mesh::write(&path, &boxes.mesh()).expect("written");
    type Call = fn(Encoder) -> Encoder;
    let preset: Call = |encoder| encoder.preset(Preset::Fast);
    let options: Call = |encoder| encoder.options(EncodeOptions::preset(Preset::Compact));
    for all_options in [preset, options] {
        let calls: [Call; 5] = [
            all_options,
            |encoder| encoder.inside(InsideRule::Odd),
            |encoder| encoder.band(Length::Absolute(0.25)),
            |encoder| encoder.unit("mm"),
            |encoder| encoder.repair(RepairMode::Auto),
        ];
        let encoded = |order: &[usize]| {
            let encoder = order.iter().fold(Encoder::new(), |encoder, &k| calls[k](encoder));
            encoder.encode_file(&path).expect("encodes")
        };
        let first = encoded(&[0, 1, 2, 3, 4]);
        assert_eq!(first.inside().rule, InsideRule::Odd);
        // Where both boxes are, the winding number is 2.
        assert!(first.signed_distance(0.75 * DVec3::ONE) > 0.0);
        assert_eq!((first.about().options.band, first.unit()), (Length::Absolute(0.25), Some("mm")));
        for order in orders(calls.len()) {
            assert!(encoded(&order).as_bytes() == first.as_bytes(), "{order:?}");
        }
    }
}

#[test]
fn invalid_options_are_refused_by_name() {
    let d = EncodeOptions::default;
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let cases: Vec<(&str, EncodeOptions)> = vec![
        ("band", EncodeOptions { band: Length::OfDiagonal(-0.01), ..d() }),
        ("band", EncodeOptions { band: Length::Absolute(-1e-300), ..d() }),
        ("band", EncodeOptions { band: Length::OfDiagonal(nan), ..d() }),
        ("band", EncodeOptions { band: Length::Absolute(inf), ..d() }),
        ("band", EncodeOptions { band: Length::OfDiagonal(101.0), ..d() }),
        ("byte_worth", EncodeOptions { byte_worth: 0.0, ..d() }),
        ("byte_worth", EncodeOptions { byte_worth: -1.0, ..d() }),
        ("byte_worth", EncodeOptions { byte_worth: nan, ..d() }),
        ("byte_worth", EncodeOptions { byte_worth: inf, ..d() }),
        ("tighten_levels", EncodeOptions { tighten_levels: 31, ..d() }),
        ("region", EncodeOptions { regions: vec![[0.0, 0.0, 0.0, 1.0, 1.0, -1.0]], ..d() }),
        ("region", EncodeOptions { regions: vec![[0.0, nan, 0.0, 1.0, 1.0, 1.0]], ..d() }),
        ("region", EncodeOptions { regions: vec![[0.0, 0.0, 0.0, inf, 1.0, 1.0]], ..d() }),
    ];
    for (name, options) in cases {
        match Encoder::new().options(options.clone()).encode(&ball()) {
            Err(EncodeError::Option { option, .. }) => assert_eq!(option, name, "{options:?}"),
            other => panic!("{options:?} gives {other:?}"),
        }
    }
}

#[test]
fn every_option_changes_the_result() {
    let solid = named("procedural/tetra.obj");
    let bytes = |options: &EncodeOptions| encode_on(1, &solid, options).as_bytes().to_vec();
    let cells = |options: &EncodeOptions| encode_on(1, &solid, options).about().statistics.clone();
    let base = EncodeOptions::default();
    let d = solid.mesh().diagonal();
    let wide = EncodeOptions { band: Length::Absolute(0.5 * d), ..base.clone() };
    assert!(cells(&wide).domain_volume > 2.0 * cells(&base).domain_volume);
    let far = solid.mesh().bounds().max + d;
    let region = [far.x, far.y, far.z, far.x + d, far.y + d, far.z + d];
    let region = EncodeOptions { regions: vec![region], ..base.clone() };
    assert!(cells(&region).domain_volume > cells(&base).domain_volume + 0.9 * d.powi(3));
    let solid_ball = ball();
    let entries = |options: &EncodeOptions| encode_on(1, &solid_ball, options).about().statistics.clone();
    let coarse = EncodeOptions { byte_worth: 1.0, ..base.clone() };
    assert!(entries(&coarse).listed_cells < entries(&base).listed_cells);
    let loose = EncodeOptions { tighten_levels: 0, ..base.clone() };
    assert!(entries(&loose).entries > entries(&base).entries);
    let named = EncodeOptions { unit: Some("mm".into()), ..base.clone() };
    assert_ne!(bytes(&named), bytes(&base));
    assert_eq!(encode_on(1, &solid, &named).about().options, named);
}

/// A region without extent and a region far away belong to the domain too.
#[test]
fn empty_and_distant_regions_belong_to_the_domain() {
    let solid = ball();
    for (at, size) in [(DVec3::new(1.7, 0.0, 0.3), 0.0), (DVec3::new(-20.0, 3.0, 8.0), 1.0)] {
        let (a, b) = (at, at + size);
        let options =
            EncodeOptions { regions: vec![[a.x, a.y, a.z, b.x, b.y, b.z]], ..EncodeOptions::default() };
        let asset = encode_on(2, &solid, &options);
        for p in [a, b, 0.5 * (a + b)] {
            let answer = asset.query_in_domain(p).unwrap_or_else(|| panic!("{p} is not in the domain"));
            let tree = encode_on(1, &solid, &EncodeOptions::default()).query(p);
            assert!((answer.signed_distance - tree.signed_distance).abs() < 1e-12 * p.length());
        }
    }
    let too_far =
        EncodeOptions { regions: vec![[-40.0, 3.0, 8.0, -39.0, 4.0, 9.0]], ..EncodeOptions::default() };
    let refused = Encoder::new().options(too_far).encode(&solid);
    assert!(matches!(refused, Err(EncodeError::Option { option: "band or region", .. })));
}
