//! Frictionless bodies at rest stay at rest.
use std::f64::consts::{FRAC_PI_4, FRAC_PI_6, TAU};
use std::fmt::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use tesdf::collide::{CollideOptions, Instance, Pose, Shape, ShapeId, detect};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{MeshFormat, SolidMesh, read_bytes};
use tesdf_sim::criterion::{RestCriterion, RestReport, RestTracker, Tracker};
use tesdf_sim::newton::{Newton, NewtonOptions};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{Dynamics, Mass, MassProperties, Summary, System, simulate};

/// Maximum drift in 10 s, m.
const DRIFT: f64 = 1e-6;

/// Energy that rounding may add, J. It lifts a body of 1 kg by 0.1 nm.
const ROUNDING: f64 = 1e-9;

/// A prism about the z axis with a regular polygon of `n` corners, the first at an angle of `turn`.
fn prism(n: u32, radius: f64, turn: f64, half_height: f64, stretch: f64) -> Shape {
    let mut obj = String::new();
    for z in [-half_height, half_height] {
        for k in 0..n {
            let angle = turn + TAU * f64::from(k) / f64::from(n);
            writeln!(obj, "v {} {} {z}", radius * angle.cos() * stretch, radius * angle.sin()).unwrap();
        }
    }
    for k in 2..n {
        writeln!(obj, "f 1 {} {k}\nf {} {} {}", k + 1, n + 1, n + k, n + k + 1).unwrap();
    }
    for k in 1..=n {
        let l = k % n + 1;
        writeln!(obj, "f {k} {l} {}\nf {k} {} {}", n + l, n + l, n + k).unwrap();
    }
    let solid = SolidMesh::new(read_bytes(obj.as_bytes(), MeshFormat::Obj).unwrap().mesh).unwrap();
    Shape::Mesh(Arc::new(Encoder::new().preset(Preset::Fast).encode(&solid).unwrap()))
}

/// A box of 12 faces.
fn cuboid(half: DVec3) -> Shape {
    prism(4, half.y * 2f64.sqrt(), FRAC_PI_4, half.z, half.x / half.y)
}

/// A plane, and bodies on it.
struct Bodies(System);

impl Bodies {
    fn new() -> Self {
        let mut system = System::new(DVec3::new(0.0, 0.0, -9.81));
        let plane = system.add_shape(Shape::Plane).unwrap();
        system.add("floor", Instance::new(plane, Pose::IDENTITY), Mass::Fixed).unwrap();
        Self(system)
    }

    fn shape(&mut self, shape: Shape) -> ShapeId {
        self.0.add_shape(shape).unwrap()
    }

    /// Adds a body whose centre is at `center`, turned about the z axis.
    fn fixed(&mut self, shape: ShapeId, center: DVec3) {
        self.0.add("fixed", Instance::new(shape, Pose::at(center)), Mass::Fixed).unwrap();
    }

    fn free(&mut self, shape: ShapeId, center: DVec3, turn: f64) {
        let mass = MassProperties::of_shape(self.0.scene().shape(shape).unwrap(), 1.0, 1000.0).unwrap();
        let pose = Pose { translation: center, rotation: DQuat::from_rotation_z(turn) };
        let name = format!("body {}", self.0.bodies().len());
        self.0.add(&name, Instance::new(shape, pose), Mass::Free(mass)).unwrap();
    }

    /// Checks that the bodies rest for `seconds`, after having settled for `after` seconds, in steps
    /// of 5 ms.
    fn rest(self, after: f64, seconds: f64) {
        let report = self.report(after, seconds);
        assert!(report.failures.is_empty(), "{report:?}");
    }

    fn report(self, after: f64, seconds: f64) -> RestReport {
        let collide = CollideOptions { contact_distance: 5e-4, ..CollideOptions::for_simulation() };
        // A constant force moves a body by the square of the time.
        let max_drift = DRIFT * (seconds / 10.0).powi(2);
        let criterion = RestCriterion { after, max_drift, max_energy_gain: ROUNDING };
        let mut tracker = RestTracker::new(&criterion, &self.0).unwrap();
        let mut engine = Newton::new(self.0, detect, collide, NewtonOptions::default()).unwrap();
        for _ in 0..((after + seconds) / 5e-3).round() as usize {
            assert!(engine.step(5e-3).unwrap().converged);
            tracker.observe(engine.system(), 5e-3);
        }
        tracker.report(engine.system())
    }
}

/// Cubes of side 0.1 m on each other. Between two of them there is a gap, and each is shifted and
/// turned by a small multiple of `shift`.
fn stack(cubes: usize, gap: f64, shift: f64) -> Bodies {
    let mut bodies = Bodies::new();
    let cube = bodies.shape(cuboid(DVec3::splat(0.05)));
    for k in 0..cubes {
        let shift = shift * [0.0, 1.0, -0.7, 0.3, 1.3][k % 5];
        let height = gap + 0.05 + (0.1 + gap) * k as f64;
        bodies.free(cube, DVec3::new(shift, -0.6 * shift, height), shift);
    }
    bodies
}

#[test]
fn a_cube_rests_on_a_plane() {
    stack(1, 0.0, 0.0).rest(0.0, 10.0);
}

/// Ten seconds take a quarter of a minute and more; `tesdf simulate scenes/stack.toml` runs them.
#[test]
fn ten_cubes_rest_on_each_other() {
    stack(10, 0.0, 0.0).rest(0.0, 2.0);
}

#[test]
fn cubes_that_fall_on_each_other_come_to_rest() {
    stack(4, 1e-5, 0.0).rest(0.3, 2.0);
}

/// Edges that are flush up to rounding, to the limit below which a point is on the surface, to the
/// tolerance of the detection, and to more.
#[test]
fn cubes_whose_edges_are_almost_flush_rest() {
    for shift in [1e-13, 1e-10, 3e-8, 1e-6] {
        stack(3, 0.0, shift).rest(0.0, 1.0);
    }
    for shift in [1e-13, 1e-10, 1e-6] {
        stack(3, 1e-6, shift).rest(0.1, 1.0);
    }
}

/// A shift of a tenth of the skin: at an edge the normal is neither that of a face nor far from it.
/// Cubes that fall by 1 µm, at 4 mm/s, get less than a ten-thousandth of this as a velocity to the
/// side, which nothing stops.
#[test]
fn edges_that_are_flush_within_the_skin_push_little() {
    let report = stack(3, 1e-6, 3e-8).report(0.1, 1.0);
    assert!(report.drift < 4e-7 && report.energy_gain < ROUNDING, "{report:?}");
}

#[test]
fn turned_cubes_rest_on_each_other() {
    let mut bodies = Bodies::new();
    let cube = bodies.shape(cuboid(DVec3::splat(0.05)));
    for (k, shift) in [0.0, 0.013, -0.007].into_iter().enumerate() {
        let center = DVec3::new(shift, 0.5 * shift, 0.05 + 0.1 * k as f64);
        bodies.free(cube, center, FRAC_PI_6 * k as f64);
    }
    bodies.rest(0.0, 2.0);
}

#[test]
fn a_box_rests_on_a_larger_box() {
    let mut bodies = Bodies::new();
    let (base, cube) = (cuboid(DVec3::new(0.2, 0.15, 0.05)), cuboid(DVec3::splat(0.05)));
    let (base, cube) = (bodies.shape(base), bodies.shape(cube));
    bodies.fixed(base, DVec3::new(0.0, 0.0, 0.05));
    bodies.free(cube, DVec3::new(0.03, 0.02, 0.15), FRAC_PI_6);
    bodies.rest(0.0, 10.0);
}

#[test]
fn a_plate_rests_on_four_pegs() {
    let mut bodies = Bodies::new();
    let (peg, plate) = (prism(24, 0.01, 0.0, 0.05, 1.0), cuboid(DVec3::new(0.15, 0.1, 0.005)));
    let (peg, plate) = (bodies.shape(peg), bodies.shape(plate));
    for (x, y) in [(-0.1, -0.07), (-0.1, 0.07), (0.1, -0.07), (0.1, 0.07)] {
        bodies.free(peg, DVec3::new(x, y, 0.05), 0.0);
    }
    bodies.free(plate, DVec3::new(0.013, 0.007, 0.105), 0.1);
    bodies.rest(0.0, 1.0);
}

#[test]
fn a_cylinder_rests_on_its_end() {
    let mut bodies = Bodies::new();
    let cylinder = bodies.shape(prism(64, 0.03, 0.0, 0.05, 1.0));
    bodies.free(cylinder, DVec3::new(0.0, 0.0, 0.05), 0.0);
    bodies.rest(0.0, 10.0);
}

/// A scene of the repository for 0.1 s.
fn scene(name: &str, change: impl FnOnce(&mut LoadedScene)) -> Summary {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    let mut loaded = LoadedScene::read(&path).unwrap();
    loaded.scene.duration = 0.1;
    change(&mut loaded);
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    simulate(&loaded.scene, &mut engine, |_| ControlFlow::Continue(())).unwrap().1
}

#[test]
fn the_stack_meets_its_criterion_only_with_contacts() {
    let summary = scene("stack.toml", |_| {});
    assert_eq!(summary.passed, Some(true), "{summary:?}");
    let rest = summary.report::<RestReport>().unwrap();
    assert!(rest.drift < 1e-9, "{rest:?}");

    let summary = scene("stack.toml", |loaded| loaded.scene.detector.choose(DetectorMode::Off));
    assert_eq!(summary.passed, Some(false));
    let rest = summary.report::<RestReport>().unwrap();
    assert!(rest.drift > 0.04 && rest.failures[0].contains("drifts by"), "{rest:?}");

    // A run that ends before the bodies have settled shows nothing.
    let summary = scene("stack.toml", |loaded| {
        loaded.scene.criterion.edit(|c: &mut RestCriterion| c.after = 1.0).unwrap();
    });
    assert!(summary.report::<RestReport>().unwrap().failures[0].contains("no step after 1 s"));
}

/// Bricks in running bond, each on two others, for a second. `tesdf simulate
/// scenes/brick-wall.toml` runs ten.
#[test]
#[ignore = "a whole scene: .ci/release"]
fn the_wall_meets_its_criterion_only_with_contacts() {
    let summary = scene("brick-wall.toml", |loaded| loaded.scene.duration = 1.0);
    assert_eq!((summary.passed, summary.unconverged_steps), (Some(true), 0), "{summary:?}");
    let rest = summary.report::<RestReport>().unwrap();
    // A constant force moves a body by the square of the time.
    assert!(rest.drift < DRIFT * 0.01 && rest.energy_gain < ROUNDING, "{rest:?}");

    let summary = scene("brick-wall.toml", |loaded| loaded.scene.detector.choose(DetectorMode::Off));
    let rest = summary.report::<RestReport>().unwrap();
    assert!(rest.drift > 0.04 && rest.failures[0].contains("drifts by"), "{rest:?}");
}
