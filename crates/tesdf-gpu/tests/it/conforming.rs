//! Conforming domains: the device finds the distances and contacts that the host finds.

use crate::compare::{Compared, device, each_mode, found, hold, hold_against, per_cell};
use crate::support::random::Random;
use crate::support::shapes;
use crate::support::tetrahedra::{bare_beam, beam, bend, moves};
use tesdf::TeSdf;
use tesdf::collide::{CollideOptions, Instance, Mode, Placement, Pose, Reduction, Scene, Shape};
use tesdf::domain::ConformingMesh;
use tesdf::encode::{Domain, EncodeOptions, Encoder, Preset, Refinement};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::SolidMesh;
use tesdf_gpu::{Detector, DetectorOptions, DeviceArray, GpuError, GpuShapes};

pub fn plain() -> EncodeOptions {
    EncodeOptions { refinement: Refinement::None, ..EncodeOptions::preset(Preset::Fast) }
}

pub fn encoded(solid: &SolidMesh, domain: &ConformingMesh, options: &EncodeOptions) -> TeSdf {
    Encoder::new()
        .options(options.clone())
        .domain(Domain::Conforming(domain))
        .encode(solid)
        .expect("valid options")
}

/// Undivided tetrahedra, bisected tetrahedra, and truncated lists.
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
            let on_device = GpuShapes::upload(&device, std::slice::from_ref(&shape)).expect("fits");
            let (bounds, diagonal) = (shape.bounds(), shape.diagonal());
            // Points on the device have a rounding error. At the border of two cells, distances of
            // truncated lists are not continuous.
            let truncated = asset.about().certificate().truncated();
            let points: Vec<DVec3> =
                (0..3000).map(|_| bounds.center() + 0.9 * bounds.extent() * random.in_cube()).collect();
            let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
            let answers =
                on_device.signed_distances(&points, &[(on_device.ids()[0], at)]).expect("answers").remove(0);
            let mut others = 0;
            for (p, answer) in points.iter().zip(&answers) {
                let expected = asset.signed_distance(*p);
                let off = (answer.signed_distance - expected).abs() / diagonal;
                assert!(truncated || off < 2e-6, "{p}: {} instead of {expected}", answer.signed_distance);
                others += usize::from(off >= 2e-6);
            }
            assert!(others <= points.len() / 500, "{others} of {} points", points.len());
        }
    }
}

/// Three worlds: the other body is above the beam, a little inside it, and half way to its center.
/// `turn` limits the rotation of the other body.
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
        Encoder::new().options(options).encode(solid).expect("encodes")
    };
    // One body with small faces, and one with faces larger than the beam.
    let ball = bisected(&shapes::Shape::default().add_sphere(DVec3::ZERO, 2, || 1.1).solid());
    let block = bisected(
        &shapes::Shape::default().add_box(DVec3::new(-9.0, -1.0, -9.0), DVec3::new(9.0, 1.0, 9.0), 3).solid(),
    );
    let mut compared = Compared::default();
    for (first, (solid, domain)) in [beam(), bare_beam()].into_iter().enumerate() {
        let [plain, by_cost, _] = encodings();
        for (encoding, other, turn) in [(&plain, &ball, 2.0), (&by_cost, &ball, 2.0), (&plain, &block, 0.1)] {
            let beam = encoded(&solid, &domain, encoding);
            let scene = meeting(&beam, other, turn, &mut random);
            // Half of the modes with each domain: it takes long where a processor stands in for the
            // device.
            for options in each_mode(8.0).into_iter().skip(first).step_by(2) {
                let one = hold(&scene, &options, 8.0);
                println!("{:?}: {one:?}", options.mode);
                compared.add(one);
            }
        }
    }
    compared.is_good(500);
}

/// The numbers of launches that `docs/gpu/design.md` states: ten, one more for faces where a shape
/// has a conforming domain, and seven more for a reduction of nodes.
#[test]
fn a_pass_takes_the_documented_number_of_launches() {
    let (solid, domain) = beam();
    let beam = Shape::from(encoded(&solid, &domain, &plain()));
    let bodies = [(beam, 1), (Shape::Sphere { radius: 1.0 }, 0)];
    for (body, for_domain) in bodies {
        let mut scene = Scene::new();
        for shape in [body, Shape::Plane] {
            let shape = scene.add_shape(shape).expect("a shape");
            scene.add(Instance::new(shape, Pose::IDENTITY)).expect("an instance");
        }
        for mode in [Mode::Node, Mode::face(), Mode::exact()] {
            for (reduction, of_reduction) in [(Reduction::None, 0), (Reduction::PerPair(2), 7)] {
                let options = CollideOptions { reduction, ..per_cell(mode) };
                let (_, detector) = found(&scene, &options, DetectorOptions::default());
                let more = if mode == Mode::Node { of_reduction } else { for_domain };
                assert_eq!(detector.report().launches, 10 + more, "{options:?}");
            }
        }
    }
}

/// All vertices of a domain, as the device takes them.
pub fn positions(domain: &ConformingMesh, to: impl Fn(DVec3) -> DVec3) -> Vec<f32> {
    domain.vertices().iter().flat_map(|&p| to(p).as_vec3().to_array()).collect()
}

/// Rounds a position as the device does.
pub fn rounded(p: DVec3) -> DVec3 {
    bend(p).as_vec3().as_dvec3()
}

#[test]
fn moved_vertices_give_the_results_of_the_host() {
    let device = device();
    let mut random = Random(4);
    let ball = shapes::Shape::default().add_sphere(DVec3::ZERO, 2, || 1.1).solid();
    let ball = Encoder::new().preset(Preset::Fast).encode(&ball).expect("encodes");
    let mut compared = Compared::default();
    for ((solid, domain), encoding) in [beam(), bare_beam()].into_iter().zip(encodings()) {
        let rest = encoded(&solid, &domain, &encoding);
        let mut bent = rest.clone();
        assert!(bent.move_vertices(&moves(&domain, rounded)).expect("moderate").inverted.is_empty());
        let array = DeviceArray::upload(&device, &positions(&domain, bend)).expect("fits");
        // Compare distances.
        let shape = Shape::from(rest.clone());
        let shapes = [Shape::Plane, shape.clone()];
        let mut on_device = GpuShapes::upload(&device, &shapes).expect("fits");
        let id = on_device.ids()[1];
        on_device.move_vertices(id, &array).expect("as many vertices");
        let (bounds, diagonal) = (bent.bounds(), shape.diagonal());
        let points: Vec<DVec3> =
            (0..2000).map(|_| bounds.center() + 0.9 * bounds.extent() * random.in_cube()).collect();
        let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
        let answers = on_device.signed_distances(&points, &[(id, at)]).expect("answers");
        let off = |(p, found): (&DVec3, f64)| (bent.signed_distance(*p) - found).abs();
        let distances = answers[0].iter().map(|a| a.signed_distance);
        let others = points.iter().zip(distances).map(off).filter(|off| *off > 2e-6 * diagonal).count();
        // At the borders of cells, distances of moved lists are not continuous, and rounding
        // may find another cell.
        assert!(others <= 4, "{others} of {} points", points.len());
        // Compare contacts.
        let here = meeting(&rest, &ball, 2.0, &mut random);
        let mut there = here.clone();
        let mut detector = Detector::new(&device, &here, DetectorOptions::default()).expect("fits");
        let beams: Vec<_> = here.instances().step_by(2).map(|(_, instance)| instance.shape).collect();
        for &beam in &beams {
            detector.move_vertices(beam, &array).expect("as many vertices");
            there.mesh_mut(beam).expect("a mesh").move_vertices(&moves(&domain, rounded)).expect("moderate");
        }
        let modes = each_mode(8.0);
        let (per_cell, per_face) = modes.split_at(4);
        // A search over a whole face would jump at these borders.
        for options in per_cell {
            let found = detector.detect(&here, options).expect("detects");
            let one = hold_against(&there, options, 8.0, &found);
            println!("{:?}: {one:?}", options.mode);
            compared.add(one);
        }
        // Move the vertices back, and compare again.
        let array = DeviceArray::upload(&device, &positions(&domain, |p| p)).expect("fits");
        beams.iter().for_each(|&b| detector.move_vertices(b, &array).expect("as many vertices"));
        for options in per_cell[..1].iter().chain(per_face) {
            let found = detector.detect(&here, options).expect("detects");
            compared.add(hold_against(&here, options, 8.0, &found));
        }
    }
    compared.is_good(500);
}

#[test]
fn bad_moves_are_errors() {
    let device = device();
    let (solid, domain) = bare_beam();
    let mut scene = Scene::new();
    let beam = scene.add_shape(encoded(&solid, &domain, &plain())).expect("a shape");
    let block = scene.add_shape(Shape::Box { half_extents: DVec3::ONE }).expect("a shape");
    for shape in [beam, block] {
        scene.add(Instance::new(shape, Pose::IDENTITY)).expect("a pose");
    }
    let mut detector = Detector::new(&device, &scene, DetectorOptions::default()).expect("fits");
    let mut places = positions(&domain, |p| p);
    let moved = |detector: &mut Detector, shape, places: &[f32]| {
        detector.move_vertices(shape, &DeviceArray::upload(&device, places).expect("fits"))
    };
    let error = moved(&mut detector, beam, &places[3..]).expect_err("a vertex is missing");
    assert!(matches!(error, GpuError::Length { array: "positions", .. }), "{error}");
    let error = moved(&mut detector, block, &places).expect_err("no vertices");
    assert!(error.to_string().starts_with("shape 1: its cells do not follow the surface"), "{error}");
    for bad in [f32::NAN, f32::INFINITY, 1e9] {
        let good = std::mem::replace(&mut places[3 * 7 + 1], bad);
        moved(&mut detector, beam, &places).expect("nothing was read yet");
        let error = detector.detect(&scene, &Default::default()).expect_err("a vertex is nowhere");
        assert!(error.to_string().starts_with("shape 0: vertex 7 was moved to where none can be"), "{error}");
        places[3 * 7 + 1] = good;
    }
    moved(&mut detector, beam, &places).expect("as many vertices");
    detector.detect(&scene, &Default::default()).expect("all is well again");
    let third = scene.add_shape(Shape::Plane).expect("a shape");
    scene.add(Instance::new(third, Pose::IDENTITY)).expect("a pose");
    let error = detector.detect(&scene, &Default::default()).expect_err("the moved vertices would be lost");
    assert!(error.to_string().contains("upload the scene, and move its vertices again"), "{error}");
    detector.upload(&scene).expect("fits");
    detector.detect(&scene, &Default::default()).expect("all is well again");
}
