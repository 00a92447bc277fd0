//! Opens arbitrary bytes as a `.tesdf` file. A file that opens must answer every query, and its
//! cells can be visited.
#![no_main]

use glam::DVec3;
use libfuzzer_sys::fuzz_target;
use tesdf::TeSdf;
use tesdf::query::Precision;

fuzz_target!(|data: &[u8]| {
    let Ok(asset) = TeSdf::from_bytes(data) else { return };
    let _ = asset.verify_checksums();
    asset.visit_cells(|cell| {
        asset.list_of(cell.id);
    });
    let bounds = asset.bounds();
    for share in [0.0, 0.25, 0.5, 1.0, 7.0] {
        let p = bounds.min + DVec3::new(share, 0.5, 1.0 - share) * bounds.extent();
        for precision in [Precision::F32, Precision::F64] {
            asset.query_with(p, precision);
        }
        asset.is_inside(p);
        asset.ray_cast(p, DVec3::new(1.0, share, -0.5), f64::INFINITY);
    }
});
