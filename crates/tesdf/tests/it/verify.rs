//! Brute force finds the faults of an asset, and a good asset passes.

use std::ops::ControlFlow;

use crate::support::meshes::encoded;
use crate::support::shapes::Shape;
use tesdf::TeSdf;
use tesdf::asset::layout::{self, Label, Node};
use tesdf::asset::{CellKind, SectionSpec};
use tesdf::glam::DVec3;
use tesdf::inspect::{InspectOptions, inspect};
use tesdf::verify::{ClassErrors, PointClass, VerifyError, VerifyOptions, VerifyReport, verify};

/// A ball with a box-shaped cavity, which has cells of every label.
fn hollow() -> TeSdf {
    let mut shape = Shape::default().add_sphere(DVec3::new(3.0, -2.0, 0.5), 3, || 1.0);
    let outer = shape.faces.len();
    shape = shape.add_box(DVec3::new(2.8, -2.3, 0.4), DVec3::new(3.2, -1.9, 0.7), 2);
    shape.faces[outer..].iter_mut().for_each(|f| f.swap(1, 2));
    encoded(&shape.solid())
}

fn verified(asset: &TeSdf, samples: usize) -> VerifyReport {
    verify(asset, &VerifyOptions { samples, seed: 1 }, |_| ControlFlow::Continue(())).expect("a valid mesh")
}

/// The asset after `change` of a section. Opening does not verify checksums.
fn changed(asset: &TeSdf, spec: SectionSpec, change: impl Fn(&mut [u8])) -> TeSdf {
    let mut bytes = asset.as_bytes().to_vec();
    let section = asset.container().sections().find(|s| s.spec == spec).expect("the section is there").bytes;
    let start = section.as_ptr().addr() - asset.as_bytes().as_ptr().addr();
    change(&mut bytes[start..start + section.len()]);
    TeSdf::from_bytes(&bytes).expect("still well formed")
}

fn change_words(bytes: &mut [u8], change: impl Fn(u32) -> u32) {
    for word in bytes.as_chunks_mut::<4>().0 {
        *word = change(u32::from_le_bytes(*word)).to_le_bytes();
    }
}

#[test]
fn a_good_asset_passes_the_same_way_on_any_number_of_threads() {
    let asset = hollow();
    let report = verified(&asset, 4000);
    assert!(report.passed, "{report:#?}");
    assert!(report.winding_brute_force > 100 && report.winding_disagreements == 0);
    for precision in &report.precisions {
        let is_right = |c: &ClassErrors| (c.class == PointClass::InCell && c.points == 0) || c.points >= 200;
        assert!(precision.classes.iter().all(is_right), "{precision:#?}");
        assert_eq!(precision.classes.len(), PointClass::ALL.len());
    }
    let [single, double] = &report.precisions;
    assert!(single.largest_error > double.largest_error && single.largest_error_of_diagonal < 1e-6);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    assert_eq!(pool.install(|| verified(&asset, 4000)), report);
    let progress = std::sync::Mutex::new(0.0_f64);
    verify(&asset, &VerifyOptions { samples: 100, seed: 2 }, |share| {
        let mut most = progress.lock().expect("no panic");
        *most = most.max(share);
        ControlFlow::Continue(())
    })
    .expect("a valid mesh");
    assert_eq!(*progress.lock().expect("no panic"), 1.0);
}

#[test]
fn a_comparison_can_be_cancelled() {
    let asset = hollow();
    let chunks = std::sync::atomic::AtomicUsize::new(0);
    let found = verify(&asset, &VerifyOptions { samples: 100_000, seed: 1 }, |_| {
        chunks.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        ControlFlow::Break(())
    });
    assert_eq!(found, Err(VerifyError::Cancelled));
    // At most one chunk per thread, of three thousand chunks.
    assert!(chunks.into_inner() <= rayon::current_num_threads());
}

#[test]
fn a_wrong_label_is_a_sign_mistake() {
    let asset = changed(&hollow(), layout::NODES, |bytes| {
        change_words(bytes, |word| match Node::decode(word, &[]) {
            Node::Listed(Label::Inside, offset) => Node::Listed(Label::Outside, offset).encode(),
            _ => word,
        });
    });
    let report = verified(&asset, 2000);
    assert!(!report.passed);
    for precision in &report.precisions {
        assert!(precision.sign_mistakes > 50, "{precision:#?}");
        let worst = precision.worst_sign.as_ref().expect("a place");
        assert!(worst.expected < 0.0 && worst.found + worst.expected < 1e-6, "{worst:?}");
    }
}

#[test]
fn a_face_that_is_missing_from_the_lists_is_found() {
    let asset = encoded(&Shape::default().add_box(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), 1).solid());
    // Every list uses slots of one palette with all 12 faces. Face index 4 is replaced by 5.
    let asset = changed(&asset, layout::PALETTES, |bytes| {
        for word in bytes.as_chunks_mut::<2>().0 {
            if u16::from_le_bytes(*word) == 4 {
                *word = 5_u16.to_le_bytes();
            }
        }
    });
    let report = verified(&asset, 2000);
    assert!(!report.passed);
    for precision in &report.precisions {
        assert!(precision.largest_error_of_promise > 1e3 && precision.worst.is_some(), "{precision:#?}");
        assert!(precision.gradient_mistakes > 0, "{precision:#?}");
    }
}

#[test]
fn a_wrong_sign_hint_is_found() {
    // Every feature says that the points closest to it are inside.
    let asset = changed(&hollow(), layout::SIGN_HINTS, |bytes| bytes.fill(0xff));
    for precision in verified(&asset, 2000).precisions {
        assert!(!precision.passed && precision.sign_mistakes > 50, "{precision:#?}");
    }
}

#[test]
fn a_mesh_without_an_inside_is_refused() {
    let asset = changed(&hollow(), layout::FACES, |bytes| {
        let [first, second, ..] = bytes.as_chunks_mut::<4>().0 else { panic!("no face") };
        std::mem::swap(first, second);
    });
    assert_eq!(
        verify(&asset, &VerifyOptions::default(), |_| ControlFlow::Continue(())),
        Err(VerifyError::NotClosed)
    );
    let asset = changed(&hollow(), layout::VERTICES, |bytes| bytes.fill(0));
    assert_eq!(
        verify(&asset, &VerifyOptions::default(), |_| ControlFlow::Continue(())),
        Err(VerifyError::Diagonal(0.0))
    );
}

#[test]
fn cells_fill_the_cube_and_lie_on_the_side_of_their_kind() {
    let asset = hollow();
    let (mut volume, mut inside, mut listed) = (0.0, 0, 0);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    asset.visit_cells(|cell| {
        let [a, b, c, d] = cell.corners;
        volume += (b - a).cross(c - a).dot(d - a).abs() / 6.0;
        for p in cell.corners {
            (low, high) = (low.min(p), high.max(p));
        }
        let centroid = 0.25 * (a + b + c + d);
        match cell.kind {
            CellKind::Inside | CellKind::FarInside => assert!(asset.is_inside(centroid)),
            CellKind::Crossing => {}
            _ => assert!(!asset.is_inside(centroid)),
        }
        assert_eq!(cell.kind.is_listed(), cell.list_length > 0);
        if cell.kind.is_listed() {
            assert_eq!(asset.reads(centroid).list_entries, cell.list_length);
        }
        inside += usize::from(cell.kind == CellKind::Inside);
        listed += usize::from(cell.kind.is_listed());
    });
    let cube = (high - low).element_product();
    assert!((volume / cube - 1.0).abs() < 1e-9, "{volume} {cube}");
    let statistics = &asset.about().statistics;
    assert_eq!(listed, statistics.listed_cells);
    assert!(inside > 0);
}

#[test]
fn reads_weighted_by_volume_equal_those_of_random_points() {
    let asset = hollow();
    let options = InspectOptions { samples: 2000, seed: 5 };
    let found = inspect(&asset, &options);
    assert_eq!(found, inspect(&asset, &options));
    // Random points by rejection, other than those of `inspect`.
    let mut random = crate::support::random::Random(9);
    let (mut reads, mut count) = (0, 0);
    let (low, high) = (DVec3::new(1.5, -3.5, -1.0), DVec3::new(4.5, -0.5, 2.0));
    for _ in 0..20_000 {
        let p = low + DVec3::new(random.unit(), random.unit(), random.unit()) * (high - low);
        if asset.query_in_domain_f32(p).is_some() {
            reads += asset.reads(p).total();
            count += 1;
        }
    }
    let mean = f64::from(u32::try_from(reads).expect("few")) / f64::from(count);
    assert!(
        (found.reads.volume_weighted / mean - 1.0).abs() < 0.05,
        "{} {mean}",
        found.reads.volume_weighted
    );
    assert!(found.reads.near_surface > 1.0 && found.reads.near_surface_fallback == 0.0, "{:?}", found.reads);
}
