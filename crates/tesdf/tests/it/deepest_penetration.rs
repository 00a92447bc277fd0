//! Compares the deepest penetration of many pairs with the clearance of each.
use std::sync::Arc;

use tesdf::collide::{
    ClearanceOptions, CollideError, Instance, InstanceId, PenetrationOptions, Pose, Scene, Shape, clearance,
    deepest_penetration,
};
use tesdf::glam::DVec3;
use tesdf::{Length, TeSdf};

use crate::clearance::{meshes, random_pose};
use crate::support::random::Random;

const TOLERANCE: f64 = 1e-6;

/// Bodies of all shapes around the origin, and their pairs. The larger `spread` is, the fewer of
/// them overlap.
fn crowd(meshes: &[Arc<TeSdf>], random: &mut Random, spread: f64) -> (Scene, Vec<[InstanceId; 2]>) {
    let mut scene = Scene::new();
    let meshes =
        meshes.iter().map(|asset| (1.0 / asset.bounds().extent().length(), Shape::from(Arc::clone(asset))));
    let mut shapes: Vec<(f64, Shape)> = meshes.collect();
    shapes.push((1.0, Shape::Box { half_extents: DVec3::new(0.2, 0.1, 0.3) }));
    shapes.push((1.0, Shape::Sphere { radius: 0.25 }));
    shapes.push((1.0, Shape::Capsule { half_height: 0.3, radius: 0.1 }));
    shapes.push((1.0, Shape::Plane));
    let bodies: Vec<InstanceId> = shapes
        .into_iter()
        .map(|(scale, shape)| {
            let is_plane = matches!(shape, Shape::Plane);
            let shape = scene.add_shape(shape).expect("a shape");
            let distance = spread * random.between(0.5, 1.0);
            let pose = match is_plane {
                true => Pose::at(DVec3::new(0.0, 0.0, -distance)),
                false => random_pose(random, distance),
            };
            scene.add(Instance { scale, ..Instance::new(shape, pose) }).expect("an instance")
        })
        .collect();
    let later = |k: usize| bodies[k + 1..].iter().map(move |&b| (k, b));
    let pairs = (0..bodies.len()).flat_map(later).map(|(k, b)| [bodies[k], b]).collect();
    (scene, pairs)
}

#[test]
fn the_deepest_pair_has_the_least_clearance() {
    let (meshes, mut random) = (meshes(), Random(41));
    let (mut overlapping, mut apart) = (0, 0);
    for round in 0..8 {
        let (scene, pairs) = crowd(&meshes, &mut random, [0.3, 0.7, 1.4, 2.5][round % 4]);
        let options = ClearanceOptions { tolerance: Length::Absolute(0.1 * TOLERANCE) };
        let depth =
            |&[a, b]: &[InstanceId; 2]| -clearance(&scene, a, b, &options).expect("a clearance").distance;
        let depths: Vec<f64> = pairs.iter().map(depth).collect();
        let expected = depths.iter().copied().fold(0.0, f64::max);
        overlapping += usize::from(expected > 0.0);
        apart += usize::from(expected == 0.0);
        for above in [0.0, 0.5 * expected, 0.999 * expected, expected, expected + 2.0 * TOLERANCE, 10.0] {
            let options = PenetrationOptions { above, tolerance: TOLERANCE };
            let found = deepest_penetration(&scene, &pairs, &options).expect("a search");
            assert!(found.converged, "{round}: {found:?}");
            assert!(found.upper_bound >= expected, "{round}, {above}: {found:?}, not {expected}");
            match found.deepest {
                Some((pair, clearance)) => {
                    let found = -clearance.distance;
                    assert!(found <= expected + 0.2 * TOLERANCE, "{round}, {above}: {found}, not {expected}");
                    assert!(found >= expected - TOLERANCE && found > above, "{round}, {above}: {found}");
                    assert!((depths[pair] - found).abs() <= TOLERANCE, "{round}, {above}: pair {pair}");
                }
                None => assert!(expected <= above + TOLERANCE, "{round}, {above}: nothing, not {expected}"),
            }
        }
    }
    assert!(overlapping > 3 && apart > 0, "{overlapping} and {apart}: the bodies test little");
}

/// More pairs than are searched together.
#[test]
fn a_depth_found_in_one_part_of_many_pairs_holds_in_the_others() {
    let mut scene = Scene::new();
    let cube = scene.add_shape(Shape::Box { half_extents: DVec3::splat(0.5) }).expect("a shape");
    let bodies: Vec<InstanceId> = (0..1500)
        .map(|k| {
            // The first two overlap deepest, and each second one overlaps the one before it.
            let gap = 0.9 + 1e-5 * f64::from(k);
            let at = DVec3::new(f64::from(k % 2) * gap, 0.0, 3.0 * f64::from(k / 2));
            scene.add(Instance::new(cube, Pose::at(at))).expect("an instance")
        })
        .collect();
    let mut pairs: Vec<[InstanceId; 2]> = bodies.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    let options = PenetrationOptions { above: 0.0, tolerance: 1e-9 };
    let depths = |pairs: &[[InstanceId; 2]]| {
        let found = deepest_penetration(&scene, pairs, &options).expect("a search");
        let (pair, clearance) = found.deepest.expect("a pair");
        (pair, (-1e6 * clearance.distance).round())
    };
    assert_eq!(depths(&pairs), (0, 99990.0));
    pairs.reverse();
    assert_eq!(depths(&pairs), (1498, 99990.0));
}

#[test]
fn the_deepest_penetration_is_the_same_on_any_number_of_threads() {
    let (scene, pairs) = crowd(&meshes(), &mut Random(5), 0.4);
    let options = PenetrationOptions { above: 0.0, tolerance: TOLERANCE };
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        format!("{:?}", pool.install(|| deepest_penetration(&scene, &pairs, &options)).expect("a search"))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn what_has_no_penetration_is_refused() {
    let (mut scene, pairs) = crowd(&[], &mut Random(7), 1.0);
    let with =
        |above, tolerance| deepest_penetration(&scene, &pairs, &PenetrationOptions { above, tolerance });
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = with(0.0, tolerance);
        assert!(matches!(refused, Err(CollideError::Option { option: "tolerance", .. })), "{refused:?}");
    }
    for above in [-1.0, f64::NAN, f64::INFINITY] {
        let refused = with(above, 1e-6);
        assert!(matches!(refused, Err(CollideError::Option { option: "above", .. })), "{refused:?}");
    }
    let options = PenetrationOptions { above: 0.5, tolerance: 1e-6 };
    let of = |scene: &Scene, pairs: &[[InstanceId; 2]]| deepest_penetration(scene, pairs, &options);
    let none = of(&scene, &[]).expect("a search");
    assert!(none.deepest.is_none() && none.converged && none.upper_bound == 0.5 + 1e-6, "{none:?}");
    let [a, b] = pairs[0];
    assert!(of(&scene, &[[a, a]]).expect_err("one body").to_string().contains("one and the same"));
    scene.remove(&[b]).expect("it was there");
    assert_eq!(of(&scene, &pairs).map(|_| ()), Err(CollideError::NoInstance(b)));
}
