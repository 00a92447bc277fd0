//! Conforming domains on the device: distances and contacts as the host finds them.
#[path = "../../tesdf/tests/support/mod.rs"]
mod support;

mod compare;

use compare::{Compared, device, each_mode, hold};
use support::random::Random;
use support::shapes;
use support::tetrahedra::{bare_beam, beam};
use tesdf::TeSdf;
use tesdf::asset::about::Source;
use tesdf::collide::{Instance, Placement, Pose, Scene, Shape};
use tesdf::domain::ConformingMesh;
use tesdf::encode::{Domain, EncodeOptions, EncodeProgress, Preset, Refinement, encode, encode_in};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::SolidMesh;
use tesdf::query::Precision;
use tesdf_gpu::{Images, query};

fn plain() -> EncodeOptions {
    EncodeOptions { refinement: Refinement::None, ..EncodeOptions::preset(Preset::Fast) }
}

fn encoded(solid: &SolidMesh, domain: &ConformingMesh, options: &EncodeOptions) -> TeSdf {
    encode_in(solid, Domain::Conforming(domain), &Source::default(), options, &EncodeProgress::default())
        .expect("valid options")
}

/// As the tetrahedra are, bisected, and with short lists.
fn encodings() -> [EncodeOptions; 3] {
    let by_cost = EncodeOptions { refinement: Refinement::ByCost, byte_worth: 0.02, ..plain() };
    let few = EncodeOptions { max_entries: Some(16), ..plain() };
    [plain(), by_cost, few]
}

#[test]
fn distances_are_those_of_the_host() {
    let device = device();
    let mut random = Random(3);
    for (solid, domain) in [beam(), bare_beam()] {
        for options in encodings() {
            let asset = encoded(&solid, &domain, &options);
            let shape = Shape::from(asset.clone());
            let images = Images::new(&device, &[&shape]).expect("fits");
            let (bounds, diagonal) = (shape.bounds(), shape.diagonal());
            // The device's points are off by half a unit in the last place; at borders lists of few faces jump.
            let truncated = asset.about().certificate.truncated;
            let points: Vec<DVec3> =
                (0..3000).map(|_| bounds.center() + 0.9 * bounds.extent() * random.in_cube()).collect();
            let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
            let answers = query(&device, &images, &[&shape], &[(0, at)], &points).expect("answers").remove(0);
            let mut others = 0;
            for (p, answer) in points.iter().zip(&answers) {
                let expected = asset.signed_distance(*p, Precision::F64);
                let off = (answer.signed_distance - expected).abs() / diagonal;
                assert!(truncated || off < 2e-6, "{p}: {} instead of {expected}", answer.signed_distance);
                others += usize::from(off >= 2e-6);
            }
            assert!(others <= points.len() / 500, "{others} of {} points", points.len());
        }
    }
}

/// Above the beam, a little in it, and half way to its middle; `turn` is how much the other body may be turned.
fn meeting(beam: &TeSdf, other: &TeSdf, turn: f64, random: &mut Random) -> Scene {
    let mut scene = Scene::new();
    for (world, deep) in [0.0, 0.3, 0.7].into_iter().enumerate() {
        let [beam, other] =
            [beam, other].map(|asset| scene.add_shape(asset.clone()).expect("a mesh is a shape"));
        let world = world as u32;
        let rotation = DQuat::from_axis_angle(random.direction(), turn);
        let at = Pose { translation: DVec3::new(4.2, 6.2 - deep, 4.3), rotation };
        scene.add(Instance { world, ..Instance::new(beam, Pose::IDENTITY) }).expect("a pose");
        scene.add(Instance { world, ..Instance::new(other, at) }).expect("a pose");
    }
    scene
}

#[test]
fn contacts_are_those_of_the_host() {
    let mut random = Random(8);
    let bisected = |solid: &SolidMesh| {
        let options = EncodeOptions::preset(Preset::Fast);
        encode(solid, &Source::default(), &options, &EncodeProgress::default()).expect("encodes")
    };
    // Of small faces, and of faces larger than the beam.
    let ball = bisected(&shapes::Shape::default().add_sphere(DVec3::ZERO, 2, || 1.1).solid());
    let block = bisected(
        &shapes::Shape::default().add_box(DVec3::new(-9.0, -1.0, -9.0), DVec3::new(9.0, 1.0, 9.0), 3).solid(),
    );
    let mut compared = Compared::default();
    for (solid, domain) in [beam(), bare_beam()] {
        for encoding in &encodings()[..2] {
            let beam = encoded(&solid, &domain, encoding);
            for (other, turn) in [(&ball, 2.0), (&block, 0.1)] {
                let scene = meeting(&beam, other, turn, &mut random);
                for options in each_mode(8.0) {
                    let one = hold(&scene, &options, 8.0);
                    println!("{:?}: {one:?}", options.mode);
                    compared.add(one);
                }
            }
        }
    }
    compared.is_good(1000);
}
