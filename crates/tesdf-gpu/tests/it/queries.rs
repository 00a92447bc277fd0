//! Compares signed distances of the device with those of the host.

use crate::support::bodies::{body, rotation};
use crate::support::random::Random;
use tesdf::collide::{Placement, Pose, Shape};
use tesdf::glam::{DVec3, Vec3};
use tesdf_gpu::{Device, DeviceAnswers, DeviceArray, GpuShapeId, GpuShapes};

/// Largest error of a distance, relative to the diagonal: twice the documented error of the host's
/// `f32` queries.
const DISTANCE: f64 = 2e-6;

#[test]
fn distances_are_those_of_the_host() {
    let device = Device::choose(None).expect("a device");
    println!("device: {}", device.info().name);
    let mut random = Random(7);
    let names = ["tetra", "cube", "l_bracket", "torus_quads", "beam", "iso_m16_bolt_6k", "spoon", "spot"];
    let shapes: Vec<Shape> = names.iter().map(|n| Shape::Mesh(body(n).asset.clone())).collect();
    let uploaded = GpuShapes::upload(&device, &shapes).expect("fits");
    for ((number, shape), id) in shapes.iter().enumerate().zip(uploaded.ids()) {
        let Shape::Mesh(asset) = shape else { unreachable!("all are meshes") };
        let (bounds, diagonal) = (asset.bounds(), shape.diagonal());
        // A scale that is not a power of two, and a pose far from the origin.
        let pose =
            Pose { translation: 100.0 * diagonal * random.direction(), rotation: rotation(&mut random) };
        let at = Placement { pose, scale: 1.7 };
        let mut points: Vec<DVec3> =
            (0..600).map(|_| bounds.center() + 0.8 * bounds.extent() * random.in_cube()).collect();
        // Points near the surface, on it and far away.
        for k in 0..300 {
            let corners = asset.face_corners(k * 7 % asset.face_count());
            let on = corners.iter().sum::<DVec3>() / 3.0;
            points.push(on + [0.0, 1e-5, 1e-3][k % 3] * diagonal * random.direction());
            points.push(bounds.center() + 30.0 * diagonal * random.direction());
        }
        let world: Vec<DVec3> = points.iter().map(|p| at.to_world(*p)).collect();
        let answers = uploaded.signed_distances(&world, &[(id, at)]).expect("answers").remove(0);
        let mut off: f64 = 0.0;
        for (p, answer) in points.iter().zip(&answers) {
            let expected = at.scale * asset.signed_distance(*p);
            // Far away, the error of `f32` is relative to the distance.
            let size = (at.scale * diagonal).max(expected.abs());
            let error = (answer.signed_distance - expected).abs() / size;
            assert!(
                error <= DISTANCE,
                "{}: {p}: {} instead of {expected}",
                names[number],
                answer.signed_distance
            );
            off = off.max(error);
            assert!((answer.gradient.length() - 1.0).abs() < 1e-5);
            // The gradient points away from the nearest surface. Among faces at equal distances,
            // the answer may name any.
            for on in [answer.closest_point, at.to_world(*p) - answer.signed_distance * answer.gradient] {
                let distance = at.scale * asset.signed_distance(at.to_shape(on));
                assert!(
                    distance.abs() < 3.0 * DISTANCE * size,
                    "{}: {p}: {distance} off the surface",
                    names[number]
                );
            }
        }
        println!("{}: off by {off:.1e} of the diagonal", names[number]);
    }
}

#[test]
fn points_times_instances() {
    let device = Device::choose(None).expect("a device");
    let mesh = Shape::Mesh(body("l_bracket").asset.clone());
    let ball = Shape::Sphere { radius: 0.5 };
    let block = Shape::Box { half_extents: DVec3::new(0.1, 0.2, 0.3) };
    let rod = Shape::Capsule { half_height: 1.0, radius: 0.25 };
    let shapes = [mesh, ball, block, rod, Shape::Plane];
    let uploaded = GpuShapes::upload(&device, &shapes).expect("fits");
    let ids = uploaded.ids();
    let mut random = Random(3);
    let instances: Vec<(GpuShapeId, Placement)> = (0..shapes.len())
        .chain(0..3)
        .map(|shape| {
            let pose = Pose { translation: 0.3 * random.in_cube(), rotation: rotation(&mut random) };
            (ids[shape], Placement { pose, scale: random.between(0.5, 2.0) })
        })
        .collect();
    let mut points: Vec<DVec3> = (0..100).map(|_| 2.0 * random.in_cube()).collect();
    points.push(DVec3::new(f64::NAN, 0.0, 0.0));
    let answers = uploaded.signed_distances(&points, &instances).expect("answers");
    // Leave out the point with NaN, because NaN is not equal to itself.
    let again = uploaded.signed_distances(&points[..100], &instances).expect("answers");
    let same = answers.iter().zip(&again).all(|(x, y)| x[..100] == y[..]);
    assert!(same, "two runs differ");
    assert_eq!(answers.len(), instances.len());
    for ((id, at), answers) in instances.iter().zip(&answers) {
        let shape = ids.iter().position(|other| other == id).expect("of these");
        for (p, answer) in points.iter().zip(answers) {
            if !p.is_finite() {
                assert!(answer.signed_distance.is_nan());
                continue;
            }
            let local = at.to_shape(*p);
            let expected = match &shapes[shape] {
                Shape::Mesh(asset) => asset.signed_distance(local),
                Shape::Plane => local.z,
                Shape::Sphere { radius } => local.length() - radius,
                Shape::Capsule { half_height, radius } => {
                    (local - DVec3::Z * local.z.clamp(-half_height, *half_height)).length() - radius
                }
                Shape::Cylinder { .. } => unreachable!("none was uploaded"),
                Shape::Box { half_extents } => {
                    let q = local.abs() - *half_extents;
                    q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
                }
            };
            assert!((answer.signed_distance - at.scale * expected).abs() < 1e-5, "shape {shape} at {p}");
            // A step along the gradient changes the distance by the length of the step.
            let ahead = answer.closest_point + answer.signed_distance * answer.gradient;
            assert!(ahead.distance(*p) < 1e-5, "shape {shape}: {ahead} instead of {p}");
        }
    }
}

/// Points as far out as there are numbers have the answers of the processor, and finite ones in
/// `f32`.
#[test]
fn points_far_out_are_answered() {
    let device = Device::choose(None).expect("a device");
    let mesh = body("l_bracket").asset.clone();
    let block = Shape::Box { half_extents: DVec3::new(0.1, 0.2, 0.3) };
    let shapes = [Shape::Mesh(mesh), block, Shape::Sphere { radius: 0.5 }, Shape::Plane];
    let uploaded = GpuShapes::upload(&device, &shapes).expect("fits");
    let at = Placement { pose: Pose::at(DVec3::new(3.0, -1.0, 2.0)), scale: 1e-3 };
    let instances: Vec<(GpuShapeId, Placement)> = uploaded.ids().into_iter().map(|id| (id, at)).collect();
    let ways = [DVec3::new(1.0, 0.0, 0.0), DVec3::new(-1.0, 0.5, 1.0), DVec3::new(0.3, -1.0, -0.7)];
    let largest = f64::from(f32::MAX);
    let sizes = [1e5, 1e10, 1e16, 1e20, 1e37, largest];
    let points: Vec<DVec3> = sizes.iter().flat_map(|size| ways.map(|way| *size * way)).collect();
    let expected = |shape: &Shape, p: DVec3| at.scale * crate::compare::exact(shape, at.to_shape(p));
    // Lengths beyond 1e150 have no squares.
    let farther: Vec<DVec3> = ways.iter().map(|way| 1e140 * *way).chain(points.clone()).collect();
    let answers = uploaded.signed_distances(&farther, &instances).expect("answers");
    for (shape, answers) in shapes.iter().zip(&answers) {
        for (p, answer) in farther.iter().zip(answers) {
            let (found, expected) = (answer.signed_distance, expected(shape, *p));
            // A plane cancels what is along it.
            assert!((found - expected).abs() < 2e-6 * p.length(), "{p}: {found} instead of {expected}");
            assert!((answer.gradient.length() - 1.0).abs() < 1e-5, "{p}: {answer:?}");
            assert!(answer.closest_point.is_finite() && answer.face < 1 << 16, "{p}: {answer:?}");
        }
    }
    let numbers: Vec<f32> = points.iter().flat_map(|p| p.as_vec3().to_array()).collect();
    let numbers = DeviceArray::upload(&device, &numbers).expect("fits");
    let count = points.len() * instances.len();
    let answers = DeviceAnswers::empty(&device, count).expect("fits");
    uploaded.signed_distances_into(&numbers, &instances, &answers).expect("answers");
    let distances = answers.signed_distances.read(&device).expect("numbers");
    let gradients = answers.gradients.read(&device).expect("numbers");
    assert!(answers.faces.read(&device).expect("numbers").iter().all(|&face| face < 1 << 16));
    for (k, (distance, gradient)) in distances.iter().zip(gradients.chunks(3)).enumerate() {
        let (shape, p) = (&shapes[k / points.len()], points[k % points.len()]);
        let expected = expected(shape, p).clamp(-largest, largest);
        let off = (f64::from(*distance) - expected).abs();
        assert!(off < 2e-6 * p.length(), "{p}: {distance} instead of {expected}");
        assert!((Vec3::from_slice(gradient).length() - 1.0).abs() < 1e-5, "{p}: {gradient:?}");
    }
}

#[test]
fn invalid_queries_are_errors() {
    let device = Device::choose(None).expect("a device");
    let shapes = GpuShapes::upload(&device, &[Shape::Plane]).expect("fits");
    let others = GpuShapes::upload(&device, &[(); 4].map(|()| Shape::Plane)).expect("fits");
    let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
    let error = shapes
        .signed_distances(&[DVec3::ZERO], &[(shapes.ids()[0], at), (others.ids()[3], at)])
        .expect_err("no shape 3");
    assert_eq!(error.to_string(), "instance 1: shape 3; expected one of 1");
    let error = Device::choose(Some("no such device")).expect_err("no such device");
    assert!(
        error.to_string().starts_with("no device is named \"no such device\"; this machine has 0: "),
        "{error}"
    );
}
