//! One small test for each stage and mode, for a device whose compiler is slow: the checks of each
//! change run these on the software Vulkan driver, and those before a release run all tests on it.
use crate::compare::{Compared, device, each_mode, hold};
use crate::support::bodies::{Placed, Relation, body, scene};
use crate::support::random::Random;
use crate::support::tetrahedra::{bare_beam, bend, moves};
use crate::{conforming, encode, hidden, on_device, reduction};
use tesdf::collide::{CollideOptions, Mode, Placement, Pose, Scene, Shape};
use tesdf::encode::{Domain, Encoder, Refinement, Sampling};
use tesdf::glam::DVec3;
use tesdf_gpu::{DeviceArray, DeviceSampler, GpuShapes};

fn bracket_and_cube() -> (Scene, f64) {
    let bodies: [Placed; 2] = Relation::Deep.place(["l_bracket", "cube"], &mut Random(3));
    (scene(&bodies), bodies[0].diagonal().max(bodies[1].diagonal()))
}

#[test]
fn distances() {
    let shape = Shape::Mesh(body("l_bracket").asset.clone());
    let on_device = GpuShapes::upload(&device(), std::slice::from_ref(&shape)).expect("fits");
    let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
    let mut random = Random(5);
    let points: Vec<DVec3> =
        (0..300).map(|_| shape.bounds().center() + shape.bounds().extent() * random.in_cube()).collect();
    let answers =
        on_device.signed_distances(&points, &[(on_device.ids()[0], at)]).expect("answers").remove(0);
    for (p, answer) in points.iter().zip(answers) {
        let off = answer.signed_distance - crate::compare::exact(&shape, *p);
        assert!(off.abs() < 2e-6 * shape.diagonal(), "{p}: off by {off:e}");
    }
}

#[test]
fn contacts_in_each_mode() {
    let (scene, size) = bracket_and_cube();
    let mut compared = Compared::default();
    each_mode(size).iter().for_each(|options| compared.add(hold(&scene, options, size)));
    compared.is_good(100);
}

#[test]
fn reduced_contacts() {
    let (scene, size) = bracket_and_cube();
    let options = CollideOptions { contact_distance: 1e-2 * size, ..CollideOptions::with_mode(Mode::Node) };
    assert!(reduction::hold(&scene, &options, &[4]) > 0);
}

#[test]
fn hidden_overlaps() {
    let [device, host] = hidden::both(&hidden::two_cubes(0.5), Mode::Node);
    assert_eq!(device, host);
    assert!(!host.is_empty());
}

#[test]
fn contacts_that_stay_on_the_device() {
    let scene = on_device::worlds(1, &mut Random(5));
    let mut detector = on_device::detector(&scene);
    let options = CollideOptions { contact_distance: 0.01, ..CollideOptions::with_mode(Mode::Node) };
    let expected = detector.detect(&scene, &options).expect("detects");
    let found = detector.detect_on_device(&scene, None, &options).expect("detects");
    on_device::are_equal(&on_device::read(detector.device(), &found), expected.as_slice(), 2.0, 1e-6);
}

#[test]
fn moved_vertices() {
    let (solid, domain) = bare_beam();
    let mut bent = conforming::encoded(&solid, &domain, &conforming::plain());
    let shape = Shape::from(bent.clone());
    let mut on_device = GpuShapes::upload(&device(), std::slice::from_ref(&shape)).expect("fits");
    let id = on_device.ids()[0];
    let array = DeviceArray::upload(&device(), &conforming::positions(&domain, bend)).expect("fits");
    on_device.move_vertices(id, &array).expect("as many vertices");
    assert!(bent.move_vertices(&moves(&domain, conforming::rounded)).expect("moderate").inverted.is_empty());
    let mut random = Random(9);
    let points: Vec<DVec3> =
        (0..300).map(|_| bent.bounds().center() + 0.9 * bent.bounds().extent() * random.in_cube()).collect();
    let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
    let answers = on_device.signed_distances(&points, &[(id, at)]).expect("answers").remove(0);
    let off = |(p, found): (&DVec3, f64)| (bent.signed_distance(*p) - found).abs();
    let distances = answers.iter().map(|answer| answer.signed_distance);
    let others = points.iter().zip(distances).map(off).filter(|off| *off > 2e-6 * shape.diagonal()).count();
    // At the borders of cells, distances of moved lists are not continuous.
    assert!(others <= 1, "{others} of {} points", points.len());
}

#[test]
fn sampled_lists() {
    let (solid, conforming) = encode::block();
    let sampling = Sampling { resolution: 4, ..Sampling::PAPER };
    let options = encode::sampled(sampling, Refinement::None);
    let encoder = Encoder::new().options(options).domain(Domain::Conforming(&conforming));
    let sampler = DeviceSampler::new(device());
    let [found, expected] = [encoder.clone().sampler(&sampler), encoder]
        .map(|encoder| encode::lists(&encoder.encode(&solid).expect("encodes")));
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        assert!(expected.iter().all(|face| found.contains(face)), "{expected:?} are not all in {found:?}");
    }
}
