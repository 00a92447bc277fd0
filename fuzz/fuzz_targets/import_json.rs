//! Imports arbitrary bytes as a file of TES-Encoder. What is imported answers queries, is saved and
//! opened, and exported it is the same surface and tetrahedra again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tesdf::{Source, TeSdf};

fuzz_target!(|data: &[u8]| {
    let Ok(asset) = TeSdf::import_json_bytes(data, &Source::default()) else { return };
    assert!(asset.about().certificate().delta().is_none(), "nothing is proved of an imported file");
    let bounds = asset.bounds();
    for share in [0.0, 0.25, 0.5, 1.0] {
        asset.query(bounds.min + share * bounds.extent());
    }
    let exported = asset.to_json_bytes().expect("what was imported can be exported");
    let again = TeSdf::import_json_bytes(&exported, &Source::default()).expect("what was exported");
    assert_eq!(again.face_count(), asset.face_count());
});
