//! Compares distances of arbitrary triangles and points with rational arithmetic.
#![no_main]

#[path = "../../crates/tesdf/src/testing/exact.rs"]
#[allow(dead_code, reason = "tests use the rest")]
mod exact;
mod support;

use glam::DVec3;
use libfuzzer_sys::arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use tesdf::geometry::Triangle;
use tesdf::geometry::internal::{polygon_to_triangle, signed_crossing};

fn points(bytes: &mut Unstructured) -> Result<[DVec3; 6]> {
    Ok([
        support::point(bytes)?,
        support::point(bytes)?,
        support::point(bytes)?,
        support::point(bytes)?,
        support::point(bytes)?,
        support::point(bytes)?,
    ])
}

/// Bound on the rounding error of a distance, for coordinates up to 2.
const ROUNDING: f64 = 1e-14;

fuzz_target!(|data: &[u8]| {
    let Ok([a, b, c, p, q, r]) = points(&mut Unstructured::new(data)) else { return };
    let triangle = Triangle::new([a, b, c]);
    let found = triangle.closest(p);
    let squared = exact::squared_distance(p, [a, b, c]);
    assert!(exact::is_root(found.distance, &squared, ROUNDING), "{found:?} {triangle:?} {p}");
    let to_face = exact::squared_distance(found.point, [a, b, c]);
    assert!(exact::is_root(0.0, &to_face, ROUNDING), "{found:?} {triangle:?} {p}");
    assert_ne!(triangle.regions(p).0, 0, "{triangle:?} {p:?}");

    let normal = Triangle::new([p, q, r]).normal;
    let (distance, at) = polygon_to_triangle(&[p, q, r], normal, &triangle, f64::INFINITY).expect("no limit");
    assert!((triangle.closest(at).distance - distance).abs() < 1e-12, "{distance} {at}");
    for corner in [p, q, r] {
        assert!(distance <= triangle.closest(corner).distance + 1e-12, "{distance} {corner}");
    }
    // A crossing has the opposite sign for the reversed triangle.
    let crossing = signed_crossing(p, q, [a, b, c]);
    assert!((-1..=1).contains(&crossing));
    assert_eq!(signed_crossing(p, q, [a, c, b]), -crossing);
});
