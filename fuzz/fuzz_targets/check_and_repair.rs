//! Runs `check` and `repair` on arbitrary meshes. A repair must not add errors to a mesh without
//! errors. The only exception is a mesh that is thinner than the tolerance for T-junctions: nothing
//! of it may remain.
#![no_main]

mod support;

use libfuzzer_sys::arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use tesdf::mesh::{DefectKind, RepairOptions, Severity, SolidMesh, check, repair};

fuzz_target!(|data: &[u8]| {
    let mut bytes = Unstructured::new(data);
    let mesh = if bytes.arbitrary().unwrap_or(false) {
        support::soup(&mut bytes)
    } else {
        support::closed(&mut bytes)
    };
    let Ok(mesh) = mesh else { return };
    let before = check(&mesh);
    if let Ok(repaired) = repair(&mesh, &RepairOptions::default()) {
        let after = check(&repaired.mesh);
        let sound = before.of_severity(Severity::Error).next().is_none();
        let mut errors = after.of_severity(Severity::Error);
        assert!(
            !sound || errors.all(|defect| defect.kind == DefectKind::NoInside),
            "repair of {mesh:?} made {:?}",
            after.defects
        );
    }
    let _ = SolidMesh::new(mesh);
});
