//! Runs `check` and `repair` on arbitrary meshes. A repair must not add errors to a mesh without
//! errors. The only exception is a mesh that is thinner than the tolerance for T-junctions: nothing
//! of it may remain. Filled meshes are closed where no surface is one-sided, and what `repair_auto`
//! finds is a solid.
#![no_main]

mod support;

use libfuzzer_sys::arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use tesdf::mesh::{
    DefectKind, RepairOptions, Severity, ShellOrientation, SolidMesh, Topology, check, closing_tolerance,
    repair, repair_auto,
};

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
    for shells in [ShellOrientation::Separate, ShellOrientation::All] {
        let options =
            RepairOptions { shells, fill_holes: Some(bytes.arbitrary().unwrap_or(u32::MAX)), ..Default::default() };
        if let Ok(filled) = repair(&mesh, &options) {
            let closed = Topology::new(filled.mesh.faces()).is_closed();
            assert!(
                closed || !filled.report.holes_left.is_empty(),
                "{options:?} left a hole in {mesh:?} and named none"
            );
        }
    }
    let _ = closing_tolerance(&mesh);
    if let Ok(Some(found)) = repair_auto(&mesh) {
        assert!(SolidMesh::new(found.repaired.mesh).is_ok(), "{:?} of {mesh:?}", found.options);
    }
    let _ = SolidMesh::new(mesh);
});
