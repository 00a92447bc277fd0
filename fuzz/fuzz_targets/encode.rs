//! Encodes small meshes under every rule of what is inside. A mesh that passes
//! `SolidMesh::with_inside` must give the same answers as brute force over all faces, unless the
//! encoder returns an error.
#![no_main]

mod support;

use std::ops::ControlFlow;

use libfuzzer_sys::arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use tesdf::base::{Inside, InsideRule, SurfaceFaces};
use tesdf::encode::{EncodeError, EncodeOptions, Preset, Encoder};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf::verify::{VerifyOptions, verify};

fuzz_target!(|data: &[u8]| {
    let Ok(mesh) = support::closed(&mut Unstructured::new(data)) else { return };
    let mesh = match data.len() % 3 {
        // Without its first face, most meshes are open.
        0 => TriangleMesh::new(mesh.vertices().to_vec(), mesh.faces()[1..].to_vec()).unwrap_or(mesh),
        _ => mesh,
    };
    let rules = [
        InsideRule::Winding,
        InsideRule::Nonzero,
        InsideRule::Odd,
        InsideRule::Generalized,
        InsideRule::Sheet { thickness: 0.1 * mesh.diagonal() },
    ];
    let surface = [SurfaceFaces::All, SurfaceFaces::Boundary][data.len() / 5 % 2];
    let inside = Inside { rule: rules[data.len() % 5], surface };
    let Ok(solid) = SolidMesh::with_inside(mesh, inside) else { return };
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
