//! The least clearance of many pairs against the clearance of each, and bounds from boxes.
use std::sync::Arc;

use crate::support::meshes::encoded;
use crate::support::random::Random;
use crate::support::shapes::Shape as Surface;
use tesdf::collide::{
    ClearanceOptions, CollideError, Instance, InstanceId, LeastClearanceOptions, Pose, Scene, Shape,
    clearance, clearance_bound, least_clearance,
};
use tesdf::glam::{DQuat, DVec3};

const TOLERANCE: f64 = 1e-7;

/// Bumpy balls, boxes, capsules, balls and a plane in random places, and all their pairs.
fn bodies(seed: u64, spread: f64) -> (Scene, Vec<[InstanceId; 2]>) {
    let mut random = Random(seed);
    let mut scene = Scene::new();
    let solid = Surface::default().add_sphere(DVec3::ZERO, 2, || random.between(0.7, 1.0)).solid();
    let bumpy = Arc::new(encoded(&solid));
    let shapes = [
        Shape::Mesh(bumpy),
        Shape::Box { half_extents: DVec3::new(0.3, 1.0, 0.2) },
        Shape::Capsule { half_height: 0.8, radius: 0.2 },
        Shape::Sphere { radius: 0.4 },
    ];
    let mut ids = Vec::new();
    for shape in shapes {
        let shape = scene.add_shape(shape).expect("a shape");
        for _ in 0..2 {
            let mut vector = |size: f64| DVec3::from_array([0; 3].map(|_| random.between(-size, size)));
            let (translation, turn) = (vector(spread), vector(3.0));
            let pose = Pose { translation, rotation: DQuat::from_scaled_axis(turn) };
            let scale = random.between(0.5, 1.5);
            ids.push(scene.add(Instance { scale, ..Instance::new(shape, pose) }).expect("an instance"));
        }
    }
    let plane = scene.add_shape(Shape::Plane).expect("a plane");
    ids.push(scene.add(Instance::new(plane, Pose::at(-spread * DVec3::Z))).expect("an instance"));
    let pairs = (0..ids.len()).flat_map(|a| (0..a).map(move |b| [a, b]));
    let pairs = pairs.map(|pair| pair.map(|k| ids[k])).collect();
    (scene, pairs)
}

#[test]
fn the_least_clearance_is_that_of_all_pairs() {
    let (mut apart, mut decided) = (0, [0; 2]);
    for seed in 0..12 {
        let (scene, pairs) = bodies(seed, [2.0, 3.0, 8.0][seed as usize % 3]);
        let each: Vec<f64> = pairs
            .iter()
            .map(|&[a, b]| clearance(&scene, a, b, &ClearanceOptions::default()).expect("one").distance)
            .collect();
        for (&[a, b], &distance) in pairs.iter().zip(&each) {
            for enough in [f64::INFINITY, 0.5 * distance.abs()] {
                let bound = clearance_bound(&scene, a, b, enough).expect("a bound");
                assert!(bound <= distance + 1e-12, "{bound} {distance}");
                apart += usize::from(enough.is_finite() && bound >= enough);
            }
        }
        let least = each.iter().copied().fold(f64::INFINITY, f64::min);
        let all =
            LeastClearanceOptions { below: f64::INFINITY, enough: f64::NEG_INFINITY, tolerance: TOLERANCE };
        let found = least_clearance(&scene, &pairs, &all).expect("a clearance");
        let (pair, nearest) = found.nearest.expect("a pair");
        assert!((nearest.distance - least).abs() < 1e-6 && found.lower_bound <= least, "{found:?} {least}");
        assert!((each[pair] - least).abs() < 1e-6 && found.converged, "{found:?}");
        for bound in [least - 0.01, least + 0.01, least + 1.0, -0.1, 0.1] {
            let options = LeastClearanceOptions { below: bound, enough: bound, tolerance: TOLERANCE };
            let found = least_clearance(&scene, &pairs, &options).expect("a verdict");
            assert_eq!(found.nearest.is_some(), least < bound, "{bound} {least}");
            assert!(found.lower_bound <= least + 1e-12, "{found:?} {least}");
            match found.nearest {
                Some((pair, nearest)) => {
                    assert!(nearest.distance <= bound && each[pair] <= nearest.distance + 1e-6)
                }
                None => assert!(found.converged && found.lower_bound >= bound - TOLERANCE),
            }
            decided[usize::from(found.nearest.is_some())] += 1;
        }
    }
    assert!(apart > 100 && decided.iter().all(|&count| count > 10), "{apart} {decided:?}");
}

#[test]
fn bounds_that_are_no_numbers_are_refused() {
    let (scene, pairs) = bodies(1, 4.0);
    let good = LeastClearanceOptions { below: 1.0, enough: 0.0, tolerance: TOLERANCE };
    for options in [
        LeastClearanceOptions { tolerance: 0.0, ..good },
        LeastClearanceOptions { below: f64::NAN, ..good },
        LeastClearanceOptions { enough: f64::NAN, ..good },
    ] {
        let refused = least_clearance(&scene, &pairs, &options);
        assert!(matches!(refused, Err(CollideError::Option { .. })), "{refused:?}");
    }
    let twice = [[pairs[0][0]; 2]];
    assert!(matches!(least_clearance(&scene, &twice, &good), Err(CollideError::NoClearance { .. })));
    let none = least_clearance(&scene, &[], &good).expect("nothing to look at");
    assert_eq!((none.nearest, none.converged), (None, true));
}
