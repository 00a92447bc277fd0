//! Assets whose inside needs more than the winding number of their faces: kernels refuse them, and
//! detect the others as the processor does.
#[path = "../../tesdf/tests/support/mod.rs"]
mod support;

mod compare;

use compare::device;
use support::parts::Parts;
use support::parts::Turn::{Inward, Outward};
use tesdf::TeSdf;
use tesdf::base::{Inside, InsideRule, SurfaceFaces};
use tesdf::collide::{CollideOptions, Instance, Pose, Scene, detect};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf_gpu::{Detector, DetectorOptions, GpuError};

fn encode(mesh: TriangleMesh, inside: Inside) -> TeSdf {
    let solid = SolidMesh::with_inside(mesh, inside).expect("a solid");
    Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes")
}

fn scene(asset: TeSdf) -> Scene {
    let mut scene = Scene::new();
    let shape = scene.add_shape(asset).expect("a shape");
    for pose in [Pose::IDENTITY, Pose::at(DVec3::new(0.1, 0.2, 0.9))] {
        scene.add(Instance::new(shape, pose)).expect("an instance");
    }
    scene
}

#[test]
fn kernels_refuse_rules_that_they_do_not_evaluate() {
    let open = Parts::default().open_cube(DVec3::ZERO, 1.0, Outward).mesh();
    let overlap =
        Parts::default().cube(DVec3::ZERO, 1.0, Outward).cube(DVec3::splat(0.4), 1.0, Outward).mesh();
    let boundary = Inside { rule: InsideRule::Winding, surface: SurfaceFaces::Boundary };
    for asset in [encode(open, InsideRule::Sheet { thickness: 0.1 }.into()), encode(overlap, boundary)] {
        let rule = asset.inside().rule.name();
        let refused = Detector::new(&device(), &scene(asset), DetectorOptions::default());
        let error = refused.err().expect("refused");
        assert!(matches!(&error, GpuError::Shape { .. }) && error.to_string().contains(rule), "{error}");
    }
}

#[test]
fn a_shell_inside_out_touches_as_on_the_processor() {
    let inward = Parts::default().cube(DVec3::ZERO, 1.0, Inward).mesh();
    let scene = scene(encode(inward, InsideRule::Nonzero.into()));
    let mut detector = Detector::new(&device(), &scene, DetectorOptions::default()).expect("uploads");
    let options = CollideOptions::default();
    let deepest = |contacts: &tesdf::Contacts| contacts.iter().map(|c| c.distance).fold(0.0, f64::min);
    let found = detector.detect(&scene, &options).expect("contacts");
    let expected = detect(&scene, &options).expect("contacts");
    assert!(!found.is_empty() && deepest(&expected) < -0.05, "{expected:?}");
    assert!((deepest(&found) - deepest(&expected)).abs() < 1e-5, "{found:?} {expected:?}");
}
