//! Overlaps that no contact shows: the device reports the overlaps that the host reports.

use std::sync::{Arc, LazyLock};

use crate::support::bodies::{Body, Placed, RELATIONS, rotation, scene};
use crate::support::random::Random;
use crate::support::shapes;
use tesdf::collide::{
    CollideOptions, HiddenOverlap, HiddenSearch, Instance, InstanceId, Mode, Placement, Pose, Scene, Shape,
    detect,
};
use tesdf::glam::DVec3;
use tesdf_gpu::{Detector, DetectorOptions};

const NODE: Mode = Mode::Node;

fn block(size: DVec3) -> Arc<Body> {
    Arc::new(Body::new(shapes::Shape::default().add_box(DVec3::ZERO, size, 1).solid()))
}

fn cube() -> Arc<Body> {
    static CUBE: LazyLock<Arc<Body>> = LazyLock::new(|| block(DVec3::ONE));
    CUBE.clone()
}

fn moved(body: &Arc<Body>, to: DVec3) -> Placed {
    Placed { body: body.clone(), at: Placement { pose: Pose::at(to), scale: 1.0 } }
}

fn options(mode: Mode) -> CollideOptions {
    CollideOptions { contact_distance: 1e-3, ..CollideOptions::with_mode(mode) }
}

/// A cube, and another one that is shifted by a share of its side along x.
pub fn two_cubes(shift: f64) -> Scene {
    scene(&[moved(&cube(), DVec3::ZERO), moved(&cube(), shift * DVec3::X)])
}

/// The overlaps of a scene that the device and the host report.
pub fn both(scene: &Scene, mode: Mode) -> [Vec<HiddenOverlap>; 2] {
    let options = options(mode);
    let mut detector =
        Detector::new(&crate::compare::device(), scene, DetectorOptions::default()).expect("fits");
    let found = detector.detect(scene, &options).expect("detects");
    [found.hidden, detect(scene, &options).expect("a good scene").hidden]
}

#[test]
fn shifted_cubes_overlap_at_every_shift() {
    let mut scene = Scene::new();
    let mesh = scene.add_shape(Shape::Mesh(cube().asset.clone())).expect("a mesh is a shape");
    let simple = scene.add_shape(Shape::Box { half_extents: DVec3::splat(0.5) }).expect("a box");
    let mut depths = Vec::new();
    for (shape, axis) in [mesh, simple].into_iter().flat_map(|s| DVec3::AXES.map(|axis| (s, axis))) {
        for k in 1..10 {
            let (world, shift) = (depths.len() as u32, f64::from(k) / 10.0);
            for translation in [DVec3::ZERO, shift * axis] {
                let instance = Instance::new(shape, Pose::at(translation));
                scene.add(Instance { world, ..instance }).expect("an instance");
            }
            depths.push(shift.min(1.0 - shift));
        }
    }
    let [device, host] = both(&scene, NODE);
    assert_eq!((device.len(), host.len()), (depths.len(), depths.len()), "{device:?}");
    for (k, (found, depth)) in device.iter().zip(depths).enumerate() {
        let ids = [0, 1].map(|i| InstanceId(2 * k as u32 + i));
        assert_eq!([found.instance_a, found.instance_b], ids);
        assert!((0.74 * depth..=0.5 + 1e-5).contains(&found.depth), "{found:?} instead of {depth}");
    }
}

#[test]
fn bodies_in_one_place_overlap_in_every_mode() {
    let scene = scene(&[moved(&cube(), DVec3::ZERO), moved(&cube(), DVec3::ZERO)]);
    for mode in [NODE, Mode::face(), Mode::exact()] {
        let [device, host] = both(&scene, mode);
        assert_eq!((device.len(), host.len()), (1, 1), "{mode:?}");
        assert!((device[0].depth - host[0].depth).abs() < 1e-5, "{device:?} instead of {host:?}");
        let mut detector =
            Detector::new(&crate::compare::device(), &scene, DetectorOptions::default()).expect("fits");
        let [searched, found] = [HiddenSearch::On, HiddenSearch::Off].map(|hidden| {
            detector.detect(&scene, &CollideOptions { hidden, ..options(mode) }).expect("detects")
        });
        assert_eq!((found.as_slice(), found.hidden.len()), (searched.as_slice(), 0), "{mode:?}");
    }
}

#[test]
fn bars_that_cross_and_bodies_that_touch() {
    let [long, tall] = [DVec3::new(5.0, 1.0, 1.0), DVec3::new(1.0, 5.0, 1.0)].map(block);
    let crossed = scene(&[moved(&long, DVec3::ZERO), moved(&tall, DVec3::new(2.0, -2.0, 0.0))]);
    let [device, host] = both(&crossed, NODE);
    assert_eq!((device.len(), host.len()), (1, 1));
    for to in [DVec3::X, DVec3::new(0.5, 1.0, 0.0), DVec3::new(1.0, 1.0, 0.5), DVec3::ONE, 1.5 * DVec3::Z] {
        let apart = scene(&[moved(&cube(), DVec3::ZERO), moved(&cube(), to)]);
        assert_eq!(both(&apart, NODE), [vec![], vec![]], "{to}");
    }
}

/// Both report the overlaps that are certain to be found. They may differ in overlaps so shallow,
/// or so near to the depth that contacts show, that finding them depends on the search.
#[test]
fn relations_of_meshes_are_told_as_by_the_host() {
    let names = ["cube", "tetra", "l_bracket", "beam", "torus_quads", "spoon"];
    let mut random = Random(13);
    let (mut told, mut differing) = (0, 0);
    for k in 0..64 {
        let relation = RELATIONS[k % RELATIONS.len()];
        let pair = [random.index(names.len()), random.index(names.len())].map(|i| names[i]);
        let mut placed = relation.place(pair, &mut random);
        if k % 2 == 0 {
            let mut bar = || block(DVec3::from_array([0, 1, 2].map(|_| random.between(0.2, 2.0))));
            placed = placed.map(|p| Placed { body: bar(), ..p });
            let turned = rotation(&mut random);
            let [first, second] = &mut placed;
            let to =
                first.at.to_world(first.body.center()) - turned * (second.at.scale * second.body.center());
            second.at.pose = Pose { translation: to, rotation: turned };
        }
        let scene = scene(&placed);
        let [device, host] = both(&scene, NODE);
        let radius = |id| {
            let instance = scene.instance(id).expect("it is there");
            let ball = scene.shape(instance.shape).expect("it is there").inner_ball();
            ball.map_or(0.0, |(_, radius)| radius * instance.scale)
        };
        let sure = HiddenOverlap::SURE * radius(InstanceId(0)).min(radius(InstanceId(1)));
        let depth = |of: &[HiddenOverlap]| of.first().map_or(0.0, |h| h.depth);
        told += host.len();
        if device.len() != host.len() {
            differing += 1;
            let most = depth(&device).max(depth(&host));
            let found = detect(&scene, &options(NODE)).expect("a good scene");
            let shown = found.iter().map(|c| -c.distance).fold(0.0, f64::max);
            assert!(
                most <= (1.5 * sure).max(2.7 * shown),
                "{pair:?} {relation:?}: {device:?}, the host {host:?}, shown {shown}"
            );
        }
    }
    println!("{told} told, {differing} otherwise");
    assert!(told >= 8 && differing <= 4, "{told} told, {differing} otherwise");
}
