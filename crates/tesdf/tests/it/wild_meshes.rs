//! Meshes as users have them: robots, furniture, machine parts, with holes, folds, overlaps and shells
//! that are inside out. Each is encoded as it is, or under every rule that its refusal names.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::support::brute_inside::BruteInside;
use crate::support::meshes::encoded;
use crate::support::random::Random;
use tesdf::base::{Inside, InsideRule};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh, read};
use tesdf::verify::{VerifyOptions, verify};

/// File, and the rules that its refusal names; none for a mesh that is encoded as it is.
const FILES: [(&str, &[&str]); 6] = [
    ("google-deepmind_paper_towel_holder_model_0.obj", &["generalized", "sheet"]),
    ("google-deepmind_stovetop_knob_front_right_0.obj", &["generalized", "sheet"]),
    ("google-deepmind_wormseye_mount.stl", &[]),
    ("isaac-sim_door_left_nob.obj", &["generalized", "sheet"]),
    ("o2ac_sr305.stl", &["generalized", "sheet"]),
    ("yunshengtian_linkbase_vhacd.obj", &[]),
];

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/wild").join(name)
}

/// Encodes under a rule, and compares with brute force.
fn assert_exact(name: &str, mesh: &TriangleMesh, rule: InsideRule) {
    let solid = SolidMesh::with_inside(mesh.clone(), Inside::new(rule)).expect("named by the refusal");
    let asset = encoded(&solid);
    let brute = BruteInside::of_all(mesh, rule);
    let (bounds, diagonal) = (mesh.bounds(), mesh.diagonal());
    let mut random = Random(11);
    for _ in 0..400 {
        let [x, y, z] = [0, 1, 2].map(|_| random.between(-0.2, 1.2));
        let p = bounds.min + DVec3::new(x, y, z) * bounds.extent();
        let error = brute.error(p, asset.signed_distance(p), 1e-12 * diagonal);
        assert!(error <= 1e-12 * diagonal, "{name}, {rule:?}, {p}: {error:e}");
    }
    let options = VerifyOptions { samples: 1000, seed: 1 };
    let report = verify(&asset, &options, |_| ControlFlow::Continue(())).expect("verifies");
    assert!(report.passed, "{name}, {rule:?}: {report:#?}");
}

#[test]
fn each_mesh_is_encoded_as_it_is_or_under_every_rule_that_its_refusal_names() {
    for (name, rules) in FILES {
        let mesh = read(file(name)).expect("reads").mesh;
        let named: Vec<InsideRule> = match SolidMesh::new(mesh.clone()) {
            Ok(_) => Vec::new(),
            Err(refusal) => refusal.rules().to_vec(),
        };
        assert_eq!(named.iter().map(|r| r.name()).collect::<Vec<_>>(), rules, "{name}");
        if named.is_empty() {
            assert_exact(name, &mesh, InsideRule::Winding);
        }
        for rule in named {
            let rule = match rule {
                InsideRule::Sheet { .. } => InsideRule::Sheet { thickness: 0.01 * mesh.diagonal() },
                rule => rule,
            };
            assert_exact(name, &mesh, rule);
        }
    }
}
