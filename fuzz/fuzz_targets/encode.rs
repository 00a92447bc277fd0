//! Encodes small meshes. A mesh that passes `SolidMesh::new` must give the same answers as brute
//! force over all faces, unless the encoder returns an error.
#![no_main]

mod support;

use std::ops::ControlFlow;

use libfuzzer_sys::arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use tesdf::encode::{EncodeError, EncodeOptions, Preset, Encoder};
use tesdf::mesh::SolidMesh;
use tesdf::verify::{VerifyOptions, verify};

fuzz_target!(|data: &[u8]| {
    let Ok(mesh) = support::closed(&mut Unstructured::new(data)) else { return };
    let Ok(solid) = SolidMesh::new(mesh) else { return };
    let options = EncodeOptions { byte_worth: 0.5, ..EncodeOptions::preset(Preset::Fast) };
    let asset = match Encoder::new().options(options).encode(&solid) {
        Ok(asset) => asset,
        Err(e @ EncodeError::SelfCheck { .. }) => panic!("{e}: {:?}", solid.mesh()),
        Err(_) => return,
    };
    let report = verify(&asset, &VerifyOptions { samples: 100, seed: 1 }, |_| ControlFlow::Continue(()));
    let report = report.expect("the mesh was encoded");
    assert!(report.passed, "{report:#?} {:?}", solid.mesh());
});
