//! Runs for the tests.
use tesdf::TeSdf;
use tesdf::collide::{Instance, Pose, Shape};
use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::{Mass, RunRecord, State, System};

/// A cube of edge 0.02 around the origin.
fn cube() -> TeSdf {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/cube.obj");
    TeSdf::encode_file(path).unwrap()
}

/// Ten states of five bodies, all shifted: `part` and `twin` share an asset; `part` has a scale, and
/// turns by 52 degrees a step. `still` and `floor` rest.
pub fn run(shift: DVec3) -> (RunRecord, System) {
    let mut system = System::new(DVec3::ZERO);
    let shapes = [
        Shape::Plane,
        Shape::from(cube()),
        Shape::Sphere { radius: 0.1 },
        Shape::Capsule { half_height: 0.2, radius: 0.1 },
    ];
    let shapes = shapes.map(|shape| system.add_shape(shape).unwrap());
    let bodies = [
        ("floor", 0, 1.0, DVec3::new(0.0, 0.0, -1.5)),
        ("part", 1, 1e-3, DVec3::new(0.0, 0.0, 1.0)),
        ("twin", 1, 1.0, DVec3::new(3.0, 0.0, 0.0)),
        ("still", 2, 1.0, DVec3::new(0.0, 3.0, 0.0)),
        ("rolling", 3, 1.0, DVec3::new(0.0, -2.0, 0.0)),
    ];
    for (name, shape, scale, at) in bodies {
        let instance = Instance { scale, ..Instance::new(shapes[shape], Pose::at(at + shift)) };
        system.add(name, instance, Mass::Fixed).unwrap();
    }
    let mut record = RunRecord::new(&system, serde_json::json!({}));
    for step in 1..10 {
        let time = 0.01 * f64::from(step);
        for (body, speed) in [(1, DVec3::new(1e-3, 0.0, -2e-3)), (2, DVec3::ZERO), (4, DVec3::X)] {
            let at = bodies[body].3 + shift + time * speed;
            let rotation = DQuat::from_rotation_z(if body == 1 { 90.0 * time } else { -time });
            system.set_state(body, State::at_rest(Pose { translation: at, rotation })).unwrap();
        }
        record.push(time, &system);
    }
    (record, system)
}

/// A ball at rest, in this number of states.
pub fn at_rest(states: usize) -> (RunRecord, System) {
    let mut system = System::new(DVec3::ZERO);
    let ball = system.add_shape(Shape::Sphere { radius: 1.0 }).unwrap();
    system.add("ball", Instance::new(ball, Pose::IDENTITY), Mass::Fixed).unwrap();
    let mut record = RunRecord::new(&system, serde_json::json!({}));
    (1..states).for_each(|step| record.push(step as f64, &system));
    (record, system)
}
