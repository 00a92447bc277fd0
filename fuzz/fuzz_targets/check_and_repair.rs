//! Meshes of any faces through `check` and `repair`: what is repaired has no worse defects than before.
#![no_main]

mod support;

use libfuzzer_sys::arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use tesdf::mesh::{RepairOptions, Severity, SolidMesh, check, repair};

fuzz_target!(|data: &[u8]| {
    let mut bytes = Unstructured::new(data);
    let mesh = if bytes.arbitrary().unwrap_or(false) { support::soup(&mut bytes) } else { support::closed(&mut bytes) };
    let Ok(mesh) = mesh else { return };
    let before = check(&mesh);
    if let Ok(repaired) = repair(&mesh, &RepairOptions::default()) {
        let after = check(&repaired.mesh);
        let errors = |report: &tesdf::mesh::CheckReport| report.of_severity(Severity::Error).count();
        assert!(errors(&before) > 0 || errors(&after) == 0, "repair made {:?}", after.defects);
    }
    let _ = SolidMesh::new(mesh);
});
