//! Contacts of two prisms that lie flush on each other carry what the area that they share carries:
//! every normal is that of the area, and their support is the area's, in each direction.
use tesdf::collide::detect;

use crate::support::flush::{Allowed, Flush};

/// Of bodies of size 1.
const GAPS: [f64; 15] =
    [0.0, 1e-12, -1e-12, 1e-10, -1e-10, 1e-9, -1e-9, 1e-8, -1e-8, 1e-7, -1e-7, 1e-6, -1e-6, 1e-5, -1e-5];

#[test]
fn contacts_of_flush_prisms_support_the_area_that_they_share() {
    let pairs = Flush::pairs(450, &GAPS);
    assert!(pairs.len() > 400, "{} pairs that share an area", pairs.len());
    let (scene, options) = Flush::scene(&pairs);
    let contacts = detect(&scene, &options).expect("contacts");
    // Distances and places are found to 1e-7 of a diagonal, which is up to 1.5.
    let allowed = Allowed { sine: 1e-9, distance: 1.5e-7, place: 1e-6 };
    Flush::hold(&pairs, contacts.as_slice(), &allowed);
}
