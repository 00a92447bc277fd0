//! Contacts of two prisms that lie flush on each other, on the device.
use crate::compare::{ROUNDING, found};
use crate::support::flush::{Allowed, Flush};
use tesdf_gpu::DetectorOptions;

/// Of bodies of size 1: from the rounding of `f32` on.
const GAPS: [f64; 7] = [0.0, 1e-6, -1e-6, 1e-5, -1e-5, 5e-5, -5e-5];

#[test]
fn contacts_of_flush_prisms_support_the_area_that_they_share() {
    let pairs = Flush::pairs(210, &GAPS);
    assert!(pairs.len() > 180, "{} pairs that share an area", pairs.len());
    let (scene, options) = Flush::scene(&pairs);
    let (contacts, _) = found(&scene, &options, DetectorOptions::default());
    let allowed = Allowed { sine: 10.0 * ROUNDING, distance: 2.0 * ROUNDING, place: 10.0 * ROUNDING };
    Flush::hold(&pairs, contacts.as_slice(), &allowed);
}
