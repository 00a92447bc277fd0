//! Queries whose points and answers stay on the device.

use crate::support::bodies::{body, rotation};
use crate::support::random::Random;
use tesdf::collide::{Placement, Pose, Shape};
use tesdf::glam::{DVec3, Vec3};
use tesdf_gpu::{Device, DeviceAnswers, DeviceArray, GpuError, GpuShapeId, GpuShapes};

/// Largest error of a distance, relative to the diagonal: the documented error of
/// `signed_distances`, and the rounding of a point of the world to `f32`.
const DISTANCE: f64 = 4e-6;

#[test]
fn arrays_get_the_answers_of_a_query() {
    let device = Device::choose(None).expect("a device");
    let (mesh, ball) = (Shape::Mesh(body("l_bracket").asset.clone()), Shape::Sphere { radius: 0.5 });
    let shapes = [mesh, ball];
    let on_device = GpuShapes::upload(&device, &shapes).expect("fits");
    let ids = on_device.ids();
    let mut random = Random(11);
    let instances: Vec<(GpuShapeId, Placement)> = (0..4)
        .map(|k| {
            let pose = Pose { translation: 0.5 * random.in_cube(), rotation: rotation(&mut random) };
            (ids[k % 2], Placement { pose, scale: random.between(0.5, 2.0) })
        })
        .collect();
    let mut points: Vec<Vec3> = (0..300).map(|_| (2.0 * random.in_cube()).as_vec3()).collect();
    points[7] = Vec3::new(0.0, f32::INFINITY, 0.0);
    points[8] = Vec3::splat(f32::NAN);
    let world: Vec<DVec3> = points.iter().map(|p| p.as_dvec3()).collect();
    let expected = on_device.signed_distances(&world, &instances).expect("answers");
    let flat: Vec<f32> = points.iter().flat_map(Vec3::to_array).collect();
    let uploaded = DeviceArray::upload(&device, &flat).expect("fits");
    let answers = DeviceAnswers::empty(&device, instances.len() * points.len()).expect("fits");
    on_device.signed_distances_into(&uploaded, &instances, &answers).expect("fits");
    let distances = answers.signed_distances.read(&device).expect("answers");
    let gradients = answers.gradients.read(&device).expect("answers");
    let closest = answers.closest_points.read(&device).expect("answers");
    let faces = answers.faces.read(&device).expect("answers");
    for (i, (_, at)) in instances.iter().enumerate() {
        let shape = &shapes[i % 2];
        let size = at.scale * shape.diagonal();
        for (k, answer) in expected[i].iter().enumerate() {
            let n = i * points.len() + k;
            if k == 7 || k == 8 {
                let numbers = [distances[n], gradients[3 * n], closest[3 * n + 2]];
                assert!(numbers.iter().all(|x| x.is_nan()) && faces[n] == u32::MAX);
                continue;
            }
            let off = (f64::from(distances[n]) - answer.signed_distance).abs();
            let gradient = Vec3::from_slice(&gradients[3 * n..]).as_dvec3();
            let on = Vec3::from_slice(&closest[3 * n..]).as_dvec3();
            let far = size.max(world[k].length());
            assert!(
                off <= DISTANCE * far,
                "instance {i}, point {k}: {} instead of {}",
                distances[n],
                answer.signed_distance
            );
            assert!((gradient.length() - 1.0).abs() < 1e-5, "{gradient}");
            let back = on + f64::from(distances[n]) * gradient;
            assert!(back.distance(world[k]) < 4.0 * DISTANCE * far, "instance {i}, point {k}: {back}");
            if let Shape::Mesh(asset) = shape {
                let corners = asset.face_corners(faces[n] as usize);
                let to_face = tesdf::geometry::Triangle::new(corners).closest(at.to_shape(on)).distance;
                assert!(
                    to_face * at.scale < 4.0 * DISTANCE * far,
                    "instance {i}, point {k}: face {}",
                    faces[n]
                );
            }
        }
    }
}

/// Each thread uses shapes, points and answers of another one.
#[test]
fn threads_share_shapes_and_arrays() {
    let device = Device::choose(None).expect("a device");
    let shapes = GpuShapes::upload(&device, &[Shape::Sphere { radius: 1.0 }]).expect("fits");
    let instances = [(shapes.ids()[0], Placement { pose: Pose::IDENTITY, scale: 1.0 })];
    let answers = DeviceAnswers::empty(&device, 2).expect("fits");
    for step in 1..5u8 {
        let at = f32::from(step);
        let made = || DeviceArray::upload(&device, &[at, 0.0, 0.0, 0.0, 0.0, at]).expect("fits");
        let points = std::thread::scope(|scope| scope.spawn(made).join().expect("an array"));
        let query = || shapes.signed_distances_into(&points, &instances, &answers).expect("fits");
        std::thread::scope(|scope| scope.spawn(query).join().expect("a query"));
        let read = || answers.signed_distances.read(&device).expect("answers");
        let found = std::thread::scope(|scope| scope.spawn(read).join().expect("answers"));
        assert_eq!(found, [at - 1.0; 2]);
        let of_host = || shapes.signed_distances(&[DVec3::new(0.0, 3.0, 0.0)], &instances).expect("answers");
        let found = std::thread::scope(|scope| scope.spawn(of_host).join().expect("answers"));
        assert_eq!(found[0][0].signed_distance, 2.0);
    }
}

#[test]
fn arrays_that_do_not_fit_are_errors() {
    let device = Device::choose(None).expect("a device");
    let shapes = GpuShapes::upload(&device, &[Shape::Plane]).expect("fits");
    let instances = [(shapes.ids()[0], Placement { pose: Pose::IDENTITY, scale: 1.0 })];
    let query = |points: &[f32], room: usize| {
        let points = DeviceArray::upload(&device, points).expect("fits");
        let answers = DeviceAnswers::empty(&device, room).expect("fits");
        shapes.signed_distances_into(&points, &instances, &answers).map(|()| answers)
    };
    let error = query(&[0.0; 4], 2).err().expect("not whole");
    assert_eq!(error.to_string(), "array \"points\" has 4 elements; expected a multiple of 3: x y z each");
    let error = query(&[0.0; 9], 2).err().expect("too short");
    assert_eq!(error.to_string(), "array \"signed distances\" has 2 elements; expected 3 at least");
    let answers = query(&[0.0, 0.0, 1.5], 1).expect("fits");
    assert_eq!(answers.signed_distances.read(&device).expect("answers"), [1.5]);
    query(&[], 0).expect("nothing to do");
}

/// Queries read and write memory of another library in place.
#[cfg(feature = "cuda")]
#[test]
fn pointers_are_for_cuda() {
    let device = Device::choose(None).expect("a device");
    let array = DeviceArray::upload(&device, &[7.0f32, 0.0, 0.0, 1.5]).expect("fits");
    let pointer = match array.pointer(&device) {
        Ok(pointer) => pointer,
        Err(error) => {
            assert!(matches!(error, GpuError::Unavailable { .. }));
            assert!(error.to_string().starts_with("a pointer of CUDA on "), "{error}");
            return;
        }
    };
    let shapes = GpuShapes::upload(&device, &[Shape::Plane]).expect("fits");
    let instances = [(shapes.ids()[0], Placement { pose: Pose::IDENTITY, scale: 1.0 })];
    let mut answers = DeviceAnswers::empty(&device, 1).expect("fits");
    // SAFETY: both wrap memory of `array`, which outlives them.
    let points = unsafe { DeviceArray::<f32>::from_raw_ptr(&device, pointer + 4, 3) }.expect("of CUDA");
    // SAFETY: as above.
    answers.signed_distances =
        unsafe { DeviceArray::<f32>::from_raw_ptr(&device, pointer, 1) }.expect("of CUDA");
    shapes.signed_distances_into(&points, &instances, &answers).expect("fits");
    assert_eq!(array.read(&device).expect("numbers"), [1.5, 0.0, 0.0, 1.5]);
    device.wait().expect("done");
}
