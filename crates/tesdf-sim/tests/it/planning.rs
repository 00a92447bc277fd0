//! Robots for planners: clearances against those of all pairs and against samples, derivatives against
//! differences, motions against dense samples, and what is refused.
use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tesdf::collide::{ClearanceOptions, Instance, Pose, Scene, Shape, clearance};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf::{Progress, TeSdf};
use tesdf_sim::planning::{
    MotionCheck, MotionOptions, MotionVerdict, PlanningError, Robot, RobotOptions, TOLERANCE,
};
use tesdf_sim::robot::{Geometry, Robot as Description, composed};
use tesdf_sim::scene_file::LoadedScene;

use crate::support::meshes::{bowl, cuboid};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/robots").join(name)
}

fn load(file: &Path) -> Result<Robot, PlanningError> {
    Robot::load(file, &RobotOptions::default(), &Progress::default())
}

fn asset(mesh: TriangleMesh) -> TeSdf {
    let solid = SolidMesh::new(mesh).expect("a solid");
    Encoder::new().preset(Preset::Fast).encode(&solid).expect("it encodes")
}

/// Where the bowl is: on its side, before the arm.
fn beside() -> Pose {
    Pose { translation: DVec3::new(0.5, 0.1, 0.35), rotation: DQuat::from_rotation_y(-1.2) }
}

/// The arm before a bowl, and above a floor.
fn arm() -> Robot {
    let mut robot = load(&data("six-axis-arm.urdf")).unwrap();
    let bowl = Shape::Mesh(Arc::new(asset(bowl(0.25, 0.04, 8))));
    robot.add_obstacle("bowl", bowl, beside(), 1.0).unwrap();
    robot.add_obstacle("floor", Shape::Plane, Pose::at(DVec3::new(0.0, 0.0, -0.01)), 1.0).unwrap();
    robot
}

/// A robot of this text of a URDF file.
fn of_text(links: &str) -> Result<Robot, PlanningError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.urdf");
    std::fs::write(&path, format!("<robot name='r'>{links}</robot>")).unwrap();
    load(&path)
}

fn link(name: &str, geometry: &str, origin: [f64; 3]) -> String {
    let [x, y, z] = origin;
    format!(
        "<link name='{name}'><collision><origin xyz='{x} {y} {z}'/><geometry>{geometry}</geometry></collision></link>"
    )
}

fn joint(name: &str, kind: &str, [parent, child]: [&str; 2], origin: [f64; 3], axis: [f64; 3]) -> String {
    let ([x, y, z], [u, v, w]) = (origin, axis);
    format!(
        "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>\
         <origin xyz='{x} {y} {z}'/><axis xyz='{u} {v} {w}'/><limit lower='-4' upper='4' effort='1'/></joint>"
    )
}

/// Configurations within the limits.
fn random(robot: &Robot, random: &mut fastrand::Rng, share: f64) -> Vec<f64> {
    let between = |[low, high]: &[f64; 2]| {
        let (low, high) = (low.max(-PI), high.min(PI));
        share * (low + (high - low) * random.f64())
    };
    robot.limits().iter().map(between).collect()
}

#[test]
fn links_are_where_a_scene_has_them() {
    let q = [0.7, 0.4, -0.9, 2.5, 0.6, 0.03];
    let names = ["pan", "lift", "elbow", "roll", "bend", "reach"];
    let rotation = DQuat::from_rotation_z(1.1);
    let pose = Pose { translation: DVec3::new(0.2, -0.1, 0.3), rotation };
    let options = RobotOptions { pose, ..RobotOptions::default() };
    let robot = Robot::load(&data("peg-arm.urdf"), &options, &Progress::default()).unwrap();
    assert_eq!(robot.joints(), names);
    let coordinates: Vec<_> = names.iter().zip(q).map(|(name, q)| format!("{name} = {q}")).collect();
    let [x, y, z, w] = rotation.to_array();
    let text = format!(
        "time_step = 1e-3\nduration = 1\nbodies = []\n[[robots]]\nfile = 'peg-arm.urdf'\nfixed = true\n\
         translation = [0.2, -0.1, 0.3]\nrotation = [{x}, {y}, {z}, {w}]\ncoordinates = {{ {} }}",
        coordinates.join(", ")
    );
    let system = LoadedScene::parse(text, data("scene.toml")).unwrap().system().unwrap();
    let poses = robot.poses(&q).unwrap();
    let mut compared = 0;
    for (body, state) in system.bodies().iter().zip(system.states()) {
        let link = robot.bodies().iter().position(|name| *name == body.name).unwrap();
        assert!((poses[link].translation - state.pose.translation).length() < 1e-12, "{}", body.name);
        assert!(poses[link].rotation.dot(state.pose.rotation).abs() > 1.0 - 1e-14, "{}", body.name);
        compared += 1;
    }
    assert!(compared > 7);
}

#[test]
fn joints_that_follow_others_are_no_numbers_of_a_configuration() {
    let (ball, own) = ("<sphere radius='0.01'/>", [0.0; 3]);
    let fingers = |mimic: &str| {
        let follow = joint("right", "prismatic", ["base", "right"], own, [0.0, 2.0, 0.0]);
        of_text(&format!(
            "<link name='base'/>{}{}{}{}",
            link("left", ball, own),
            link("right", ball, own),
            joint("left", "prismatic", ["base", "left"], [0.0, 0.1, 0.0], [0.0, 1.0, 0.0]),
            follow.replace("</joint>", &format!("<mimic {mimic}/></joint>"))
        ))
    };
    let robot = fingers("joint='left' multiplier='-2' offset='-0.3'").unwrap();
    assert_eq!((robot.joints(), robot.limits()), (vec!["left"], &[[-4.0, 4.0]][..]));
    let at = |q: f64| robot.poses(&[q]).unwrap().iter().map(|pose| pose.translation.y).collect::<Vec<_>>();
    for q in [0.0, 0.25, -1.0] {
        let found = at(q);
        assert!((found[1] - 0.1 - q).abs() < 1e-15 && (found[2] + 0.3 + 2.0 * q).abs() < 1e-15, "{found:?}");
        // Both fingers move, three times as fast together.
        let clearance = robot.clearance(&[q], TOLERANCE).unwrap();
        let gap: f64 = 0.4 + 3.0 * q;
        assert!((clearance.distance - (gap.abs() - 0.02)).abs() < 1e-12, "{clearance:?}");
        assert!((clearance.nearest.unwrap().gradient[0] - 3.0 * gap.signum()).abs() < 1e-9);
    }
    let through = robot.check_motion(&[0.5], &[-0.5], &MotionOptions::default()).unwrap();
    assert_eq!(through.verdict, MotionVerdict::Collision);
    let unknown = fingers("joint='middle'").expect_err("no such joint").to_string();
    assert!(unknown.contains("no joint middle") && unknown.contains("left, right"), "{unknown}");
    assert!(fingers("joint='right'").expect_err("a circle").to_string().contains("follows itself"));
}

/// The arm's shapes by link, in the world.
struct Posed {
    scene: Scene,
    links: Vec<(usize, tesdf::collide::InstanceId, Pose)>,
    obstacles: Vec<tesdf::collide::InstanceId>,
}

impl Posed {
    fn new() -> Self {
        let file = Description::read(&data("six-axis-arm.urdf"), &[]).unwrap();
        let mut scene = Scene::new();
        let mut links = Vec::new();
        for (k, link) in file.links.iter().enumerate() {
            for part in &link.collisions {
                let shape = match part.geometry {
                    Geometry::Box { half_extents } => Shape::Box { half_extents },
                    Geometry::Cylinder { half_height, radius } => Shape::Cylinder { half_height, radius },
                    ref other => panic!("{other:?}"),
                };
                let shape = scene.add_shape(shape).unwrap();
                let instance = scene.add(Instance::new(shape, part.pose)).unwrap();
                links.push((k, instance, part.pose));
            }
        }
        let bowl = scene.add_shape(asset(bowl(0.25, 0.04, 8))).unwrap();
        let floor = scene.add_shape(Shape::Plane).unwrap();
        let bowl = scene.add(Instance::new(bowl, beside())).unwrap();
        let floor = scene.add(Instance::new(floor, Pose::at(DVec3::new(0.0, 0.0, -0.01)))).unwrap();
        Self { scene, links, obstacles: vec![bowl, floor] }
    }

    /// The least clearance of all pairs, and its bodies.
    fn least(&mut self, poses: &[Pose]) -> (f64, [usize; 2]) {
        for &(link, instance, pose) in &self.links {
            self.scene.set_poses(&[(instance, composed(poses[link], pose))]).unwrap();
        }
        let mut bodies = self.links.iter().map(|&(link, id, _)| (link, id)).collect::<Vec<_>>();
        bodies.extend(self.obstacles.iter().enumerate().map(|(k, &id)| (poses.len() + k, id)));
        let mut least = (f64::INFINITY, [0; 2]);
        for &(a, one) in &bodies[..self.links.len()] {
            for &(b, other) in &bodies {
                // The links are in a row, so neighbours have numbers that follow each other. The base
                // does not move against obstacles.
                if b <= a || b < poses.len() && b == a + 1 || a == 0 && b >= poses.len() {
                    continue;
                }
                let found = clearance(&self.scene, one, other, &ClearanceOptions::default()).unwrap();
                if found.distance < least.0 {
                    least = (found.distance, [a, b]);
                }
            }
        }
        least
    }
}

#[test]
fn the_clearance_is_the_least_of_all_pairs() {
    let (robot, mut posed, mut rng) = (arm(), Posed::new(), fastrand::Rng::with_seed(3));
    let (mut overlaps, mut obstacles) = (0, 0);
    for _ in 0..60 {
        let q = random(&robot, &mut rng, 1.0);
        let found = robot.clearance(&q, TOLERANCE).unwrap();
        let (least, bodies) = posed.least(&robot.poses(&q).unwrap());
        assert!((found.distance - least).abs() <= 1.1 * TOLERANCE, "{q:?}: {found:?}, {least}");
        assert!(found.converged && found.lower_bound <= least, "{found:?}");
        let nearest = found.nearest.unwrap();
        assert_eq!(nearest.bodies, bodies);
        let between = nearest.points[0].distance(nearest.points[1]);
        assert!((between - found.distance.abs()).abs() < 1e-9, "{between} {}", found.distance);
        for bound in [-0.02, 0.0, 0.05] {
            let below = robot.is_clearance_below(&q, bound, TOLERANCE).unwrap();
            let is_near = (least - bound).abs() <= 2.0 * TOLERANCE;
            assert!(is_near || below == (least < bound), "{q:?} {bound}: {below}, {least}");
        }
        assert_eq!(robot.in_collision(&q, TOLERANCE).unwrap(), least < 0.0);
        overlaps += u32::from(least < 0.0);
        obstacles += u32::from(bodies[1] >= robot.link_count());
    }
    assert!((5..55).contains(&overlaps) && obstacles > 9, "{overlaps} {obstacles}");
}

#[test]
fn no_sample_of_a_link_is_nearer_than_the_clearance() {
    let mut robot = of_text(&format!(
        "<link name='base'/>{}{}",
        link("arm", "<box size='0.4 0.06 0.04'/>", [0.2, 0.0, 0.0]),
        joint("turn", "revolute", ["base", "arm"], [0.0; 3], [0.3, 0.1, 1.0])
    ))
    .unwrap();
    let bowl = Arc::new(asset(bowl(0.25, 0.04, 8)));
    let at = Pose { translation: DVec3::new(0.3, 0.35, 0.1), rotation: DQuat::from_rotation_x(1.0) };
    robot.add_obstacle("bowl", Shape::Mesh(Arc::clone(&bowl)), at, 1.0).unwrap();
    let side = |k: u32, n: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
    let mut samples = Vec::new();
    for (i, j, k) in (0..=80).flat_map(|i| (0..=12).flat_map(move |j| (0..=8).map(move |k| (i, j, k)))) {
        if [i % 80, j % 12, k % 8].contains(&0) {
            samples.push(DVec3::new(0.2 + 0.2 * side(i, 80), 0.03 * side(j, 12), 0.02 * side(k, 8)));
        }
    }
    let mut seen = [false; 2];
    for k in 0..30 {
        let q = [0.1 * f64::from(k)];
        let (pose, found) = (robot.poses(&q).unwrap()[1], robot.clearance(&q, TOLERANCE).unwrap().distance);
        let sampled = samples.iter().map(|&p| bowl.signed_distance(at.to_body(pose.to_world(p))));
        let sampled = sampled.fold(f64::INFINITY, f64::min);
        // Inside, the surface of the bowl can be deeper in the arm than the arm's in the bowl.
        assert!(found <= sampled + 1e-9, "{k}: {found} {sampled}");
        if sampled > 0.01 {
            assert!(sampled <= found + 0.005, "{k}: {found} {sampled}");
        }
        seen[usize::from(sampled > 0.01)] = true;
    }
    assert_eq!(seen, [true; 2]);
}

#[test]
fn the_gradient_is_that_of_differences_where_the_clearance_is_smooth() {
    let (robot, mut rng) = (arm(), fastrand::Rng::with_seed(11));
    let (mut smooth, mut kinks) = (0, 0);
    for _ in 0..40 {
        let q = random(&robot, &mut rng, 1.0);
        let here = robot.clearance(&q, 1e-9).unwrap();
        if here.distance < 0.0 {
            continue;
        }
        let gradient = here.nearest.unwrap().gradient;
        for i in 0..robot.dof() {
            match derivative(&robot, &q, i) {
                Some(d) => {
                    // On the round side of a cylinder, the direction is known up to the root of
                    // twice the tolerance over its radius: 2e-4 with 5 cm.
                    assert!((gradient[i] - d).abs() < 2e-4 * d.abs().max(0.1), "{q:?} {i}: {gradient:?} {d}");
                    smooth += 1;
                }
                None => kinks += 1,
            }
        }
    }
    assert!(smooth > 100 && kinks < smooth / 2, "{smooth} {kinks}");
}

/// The derivative of the clearance by a number of the configuration, of differences of the fourth
/// order; `None` at a kink, where steps of two sizes disagree.
fn derivative(robot: &Robot, q: &[f64], i: usize) -> Option<f64> {
    let at = |step: f64| {
        let mut q = q.to_vec();
        q[i] += step;
        robot.clearance(&q, 1e-12).unwrap().distance
    };
    let difference = |h: f64| (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
    let [coarse, fine] = [2e-3, 1e-3].map(difference);
    ((coarse - fine).abs() < 1e-8).then_some(fine)
}

#[test]
fn the_gradient_of_bodies_that_overlap_is_that_of_the_nearest_face() {
    let mut robot = of_text(&format!(
        "<link name='base'/>{}{}{}{}",
        link("mast", "<box size='0.1 0.1 0.2'/>", [0.0; 3]),
        link("arm", "<box size='1 0.06 0.04'/>", [0.5, 0.0, 0.0]),
        joint("lift", "prismatic", ["base", "mast"], [0.0; 3], [0.0, 0.3, 1.0]),
        joint("turn", "revolute", ["mast", "arm"], [0.0, 0.0, 0.5], [0.3, 1.0, 0.2])
    ))
    .unwrap();
    robot.add_obstacle("table", Shape::Plane, Pose::IDENTITY, 1.0).unwrap();
    robot.set_allowed("mast", "table", true).unwrap();
    let mut seen = [0; 2];
    for k in 0..40 {
        let q = [0.02 * f64::from(k % 5), 0.3 + 0.01 * f64::from(k)];
        let here = robot.clearance(&q, 1e-9).unwrap();
        let gradient = here.nearest.unwrap().gradient;
        for i in 0..2 {
            let d = derivative(&robot, &q, i).expect("a corner over a plane is smooth");
            assert!((gradient[i] - d).abs() < 1e-6, "{q:?} {i}: {gradient:?} {d}");
        }
        seen[usize::from(here.distance < 0.0)] += 1;
    }
    assert!(seen[0] > 5 && seen[1] > 5, "{seen:?}");
}

/// The verdict of a motion, and the least clearance of `n` samples of it.
fn sampled(robot: &Robot, from: &[f64], to: &[f64], n: u32, options: &MotionOptions) -> (MotionCheck, f64) {
    let found = robot.check_motion(from, to, options).unwrap();
    let between = |t: f64| from.iter().zip(to).map(|(a, b)| a + t * (b - a)).collect::<Vec<f64>>();
    let rows: Vec<_> = (0..=n).map(|k| between(f64::from(k) / f64::from(n))).collect();
    let least =
        robot.clearances(&rows, 1e-7).unwrap().iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
    match found.verdict {
        MotionVerdict::Free => {
            assert!(least > options.margin, "{from:?} {to:?} is not free: {least}");
            assert_eq!(found.at, None);
        }
        verdict => {
            let at = found.at.unwrap();
            let there = robot.clearance(&between(at.parameter), 1e-7).unwrap().distance;
            assert!(there <= at.distance + 1e-7, "{there} {at:?}");
            let most = if verdict == MotionVerdict::Collision { 1e-9 } else { 2.0 * options.tolerance };
            assert!(there <= options.margin + most, "{from:?} {to:?}: {found:?} {there}");
        }
    }
    (found, least)
}

#[test]
fn a_motion_is_never_free_where_a_dense_sample_collides() {
    let (robot, mut rng) = (arm(), fastrand::Rng::with_seed(5));
    let (mut verdicts, mut steps) = ([0; 3], 0);
    for k in 0..90 {
        let from = random(&robot, &mut rng, 0.9);
        if robot.in_collision(&from, TOLERANCE).unwrap() {
            continue;
        }
        let other = random(&robot, &mut rng, 0.9);
        // Long and short ones.
        let share = [0.03, 0.3, 1.0, 1.0][k % 4];
        let to: Vec<_> = from.iter().zip(&other).map(|(a, b)| a + share * (b - a)).collect();
        let margin = [0.0, 0.004][k % 2];
        let (found, _) =
            sampled(&robot, &from, &to, 60, &MotionOptions { margin, ..MotionOptions::default() });
        verdicts[found.verdict as usize] += 1;
        steps += found.steps;
    }
    assert!(verdicts[0] > 15 && verdicts[1] > 7 && verdicts[2] <= 2, "{verdicts:?} {steps}");
}

#[test]
fn motions_that_graze_are_told_from_those_that_touch() {
    // The tip of the arm passes a ball by `gap`, and so does a slide.
    let turn = of_text(&format!(
        "<link name='base'/>{}{}",
        link("arm", "<box size='1 0.02 0.02'/>", [0.5, 0.0, 0.0]),
        joint("turn", "continuous", ["base", "arm"], [0.0; 3], [0.0, 0.0, 1.0])
    ))
    .unwrap();
    let slide = of_text(&format!(
        "<link name='base'/>{}{}",
        link("block", "<box size='0.1 0.1 0.1'/>", [0.0; 3]),
        joint("slide", "prismatic", ["base", "block"], [0.0; 3], [0.0, 1.0, 0.0])
    ))
    .unwrap();
    // The far corners of the arm are on a circle.
    let tip = 1.0_f64.hypot(0.01);
    for (robot, reach, ends) in [(turn, tip, [0.0, 3.0]), (slide, 0.05, [-2.0, 1.5])] {
        for gap in [3e-2, 1e-3, 3e-4, 3e-5, 0.0, -3e-5, -1e-3, -0.1] {
            let mut robot = robot.clone();
            let at = match robot.joints()[0] {
                "turn" => DVec3::new(0.0, reach + 0.2 + gap, 0.0),
                _ => DVec3::new(reach + 0.2 + gap, 0.0, 0.0),
            };
            robot.add_obstacle("ball", Shape::Sphere { radius: 0.2 }, Pose::at(at), 1.0).unwrap();
            let (found, _) = sampled(&robot, &ends[..1], &ends[1..], 400, &MotionOptions::default());
            let expected: &[MotionVerdict] = match gap {
                // Undecided only below twice the tolerance.
                gap if gap >= 2e-4 => &[MotionVerdict::Free],
                gap if gap <= -3e-5 => &[MotionVerdict::Collision, MotionVerdict::Undecided],
                gap if gap > 0.0 => &[MotionVerdict::Free, MotionVerdict::Undecided],
                _ => &[MotionVerdict::Undecided, MotionVerdict::Collision],
            };
            assert!(expected.contains(&found.verdict), "{gap}: {found:?}");
            if gap <= -1e-3 {
                assert_eq!(found.verdict, MotionVerdict::Collision, "{gap}");
            }
            // A finer tolerance decides.
            let fine = MotionOptions { tolerance: 1e-6, ..MotionOptions::default() };
            let (found, _) = sampled(&robot, &ends[..1], &ends[1..], 400, &fine);
            match gap {
                gap if gap > 1e-5 => assert_eq!(found.verdict, MotionVerdict::Free, "{gap}"),
                gap if gap < -1e-5 => assert_eq!(found.verdict, MotionVerdict::Collision, "{gap}"),
                _ => assert_ne!(found.verdict, MotionVerdict::Free, "{gap}"),
            }
        }
    }
}

#[test]
fn a_motion_that_passes_a_thin_wall_collides() {
    let mut robot = of_text(&format!(
        "<link name='base'/>{}{}",
        link("ball", "<sphere radius='0.01'/>", [0.0; 3]),
        joint("slide", "prismatic", ["base", "ball"], [0.0; 3], [1.0, 0.0, 0.0])
    ))
    .unwrap();
    let wall = Shape::Box { half_extents: DVec3::new(1e-6, 1.0, 1.0) };
    robot.add_obstacle("wall", wall, Pose::at(DVec3::new(0.377, 0.0, 0.0)), 1.0).unwrap();
    let found = robot.check_motion(&[-4.0], &[4.0], &MotionOptions::default()).unwrap();
    assert_eq!(found.verdict, MotionVerdict::Collision);
    let at = found.at.unwrap();
    assert!((8.0 * at.parameter - 4.0 - 0.377).abs() < 0.011, "{at:?}");
    assert_eq!(at.bodies.map(|body| robot.bodies()[body].to_string()), ["ball", "wall"]);
    // With one step nothing is known.
    let one = MotionOptions { steps: 1, ..MotionOptions::default() };
    assert_eq!(robot.check_motion(&[-4.0], &[4.0], &one).unwrap().verdict, MotionVerdict::Undecided);
    assert_eq!(robot.check_motion(&[0.0], &[0.0], &one).unwrap().verdict, MotionVerdict::Free);
    // Both ends are looked at first.
    let end = robot.check_motion(&[0.377], &[4.0], &one).unwrap().at.unwrap();
    assert_eq!(end.parameter, 0.0);
}

#[test]
fn pairs_may_be_allowed_by_their_names() {
    let mut robot = arm();
    let names = |robot: &Robot| -> Vec<String> {
        let name = |body: usize| robot.bodies()[body];
        robot.checked_pairs().into_iter().map(|[a, b]| format!("{} {}", name(a), name(b))).collect()
    };
    let before = names(&robot);
    // All pairs of seven links in a row but the neighbours, and six links with two obstacles each.
    assert_eq!(before.len(), 15 + 12, "{before:?}");
    assert!(!before.contains(&"base shoulder".into()) && before.contains(&"base upper".into()));
    assert!(!before.contains(&"base floor".into()) && before.contains(&"tool bowl".into()));

    // The tool is in the bowl, and may be.
    let mut q = vec![0.0; 6];
    let mut rng = fastrand::Rng::with_seed(1);
    let tool_and_bowl = [6, 7];
    while robot.clearance(&q, TOLERANCE).unwrap().nearest.is_none_or(|n| n.bodies != tool_and_bowl)
        || !robot.in_collision(&q, TOLERANCE).unwrap()
    {
        q = random(&robot, &mut rng, 1.0);
    }
    robot.set_allowed("bowl", "tool", true).unwrap();
    assert!(!names(&robot).contains(&"tool bowl".into()));
    let allowed = robot.clearance(&q, TOLERANCE).unwrap();
    assert!(allowed.nearest.unwrap().bodies != tool_and_bowl);
    robot.set_allowed("tool", "bowl", false).unwrap();
    assert_eq!(names(&robot), before);
    assert!(robot.in_collision(&q, TOLERANCE).unwrap());
    robot.set_allowed("shoulder", "base", false).unwrap();
    assert_eq!(names(&robot).len(), before.len() + 1);

    // Obstacles come and go with what is allowed.
    robot.set_allowed("tool", "floor", true).unwrap();
    robot.remove_obstacle("bowl").unwrap();
    assert!(!names(&robot).contains(&"tool floor".into()) && names(&robot).contains(&"hand floor".into()));
    robot.move_obstacle("floor", Pose::at(DVec3::new(0.0, 0.0, 5.0))).unwrap();
    assert!(robot.in_collision(&[0.0; 6], TOLERANCE).unwrap());

    let told = |e: Result<(), PlanningError>| e.expect_err("it is refused").to_string();
    let unknown = told(robot.set_allowed("tool", "flor", true));
    assert!(
        unknown.contains("no body flor") && unknown.contains("shoulder, upper") && unknown.contains("floor")
    );
    assert!(told(robot.set_allowed("base", "floor", false)).contains("never move against each other"));
    assert!(told(robot.set_allowed("base", "base", false)).contains("never move against each other"));
    assert!(told(robot.remove_obstacle("bowl")).contains("no obstacle bowl; expected floor"));
    let twice = told(robot.add_obstacle("hand", Shape::Plane, Pose::IDENTITY, 1.0));
    assert!(twice.contains("there is a body of this name"), "{twice}");
    let ball = Shape::Sphere { radius: -1.0 };
    assert!(told(robot.add_obstacle("ball", ball, Pose::IDENTITY, 1.0)).starts_with("ball: "));
}

#[test]
fn batches_have_the_same_bytes_on_any_number_of_threads() {
    let (robot, mut rng) = (arm(), fastrand::Rng::with_seed(9));
    let rows: Vec<_> = (0..40).map(|_| random(&robot, &mut rng, 1.0)).collect();
    let motions: Vec<[&[f64]; 2]> = rows.windows(2).take(12).map(|pair| [&*pair[0], &*pair[1]]).collect();
    let options = MotionOptions { tolerance: 1e-3, ..MotionOptions::default() };
    let all = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let clearances = robot.clearances(&rows, TOLERANCE).unwrap();
            let below = robot.are_clearances_below(&rows, 0.01, TOLERANCE).unwrap();
            format!("{clearances:?} {below:?} {:?}", robot.check_motions(&motions, &options).unwrap())
        })
    };
    let one = all(1);
    assert_eq!(one, all(2));
    let single: Vec<_> = rows.iter().map(|q| robot.clearance(q, TOLERANCE).unwrap()).collect();
    assert_eq!(single, robot.clearances(&rows, TOLERANCE).unwrap());
}

#[test]
fn what_is_no_configuration_or_option_is_refused() {
    let robot = arm();
    let told = |e: Result<f64, PlanningError>| e.expect_err("it is refused").to_string();
    let clearance = |q: &[f64], tolerance| robot.clearance(q, tolerance).map(|found| found.distance);
    let short = told(clearance(&[0.0; 5], TOLERANCE));
    assert!(short.contains("has 5 numbers; expected 6") && short.contains("pan, lift, elbow"), "{short}");
    assert!(told(clearance(&[f64::NAN; 6], TOLERANCE)).contains("NaN"));
    assert!(told(clearance(&[0.0; 6], 0.0)).contains("tolerance"));
    let rows = [vec![0.0; 6], vec![0.0; 7]];
    assert!(told(robot.clearances(&rows, TOLERANCE).map(|_| 0.0)).starts_with("row 1: "));
    assert!(told(robot.is_clearance_below(&[0.0; 6], f64::NAN, TOLERANCE).map(|_| 0.0)).contains("bound"));
    let q: [f64; 6] = [0.0; 6];
    for options in [
        MotionOptions { tolerance: 0.0, ..MotionOptions::default() },
        MotionOptions { margin: f64::NAN, ..MotionOptions::default() },
    ] {
        assert!(told(robot.check_motion(&q, &q, &options).map(|_| 0.0)).contains("expected a finite length"));
    }
    let floating = joint("loose", "floating", ["base", "ball"], [0.0; 3], [1.0, 0.0, 0.0]);
    let ball = link("ball", "<sphere radius='0.1'/>", [0.0; 3]);
    let refused =
        of_text(&format!("<link name='base'/>{ball}{floating}")).expect_err("it is free").to_string();
    assert!(refused.contains("the joint loose is free"), "{refused}");
    let missing = link("ball", "<mesh filename='missing.stl'/>", [0.0; 3]);
    let refused = of_text(&missing).expect_err("no mesh").to_string();
    assert!(refused.contains("the link ball") && refused.contains("missing.stl"), "{refused}");
    // A robot without anything to look at is as far away as can be.
    let lone = of_text(&ball).unwrap();
    let found = lone.clearance(&[], TOLERANCE).unwrap();
    assert_eq!((found.distance, found.nearest), (f64::INFINITY, None));
    assert_eq!(lone.check_motion(&[], &[], &MotionOptions::default()).unwrap().verdict, MotionVerdict::Free);
}

/// Meshes of links have the scale of the file.
#[test]
fn a_link_that_is_a_mesh_is_as_near_as_the_same_box() {
    let folder = tempfile::tempdir().unwrap();
    let cube = cuboid(DVec3::NEG_ONE, DVec3::ONE);
    let vertices = cube.vertices().iter().map(|v| format!("v {} {} {}\n", v.x, v.y, v.z));
    let faces = cube.faces().iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    std::fs::write(folder.path().join("cube.obj"), vertices.chain(faces).collect::<String>()).unwrap();
    let robot = |geometry: &str| {
        let path = folder.path().join("robot.urdf");
        let arm = link("arm", geometry, [0.2, 0.0, 0.0]);
        let turn = joint("turn", "revolute", ["base", "arm"], [0.0; 3], [0.0, 0.0, 1.0]);
        std::fs::write(&path, format!("<robot name='r'><link name='base'/>{arm}{turn}</robot>")).unwrap();
        let mut robot = load(&path)?;
        robot.add_obstacle(
            "ball",
            Shape::Sphere { radius: 0.1 },
            Pose::at(DVec3::new(0.25, 0.25, 0.02)),
            1.0,
        )?;
        Ok::<_, PlanningError>(robot)
    };
    for (scale, size) in [("0.2 0.03 0.02", "0.4 0.06 0.04"), ("0.1", "0.2 0.2 0.2")] {
        let mesh = robot(&format!("<mesh filename='cube.obj' scale='{scale}'/>")).unwrap();
        let same = robot(&format!("<box size='{size}'/>")).unwrap();
        let mut seen = [0; 2];
        for k in 0..30 {
            let q = [0.1 * f64::from(k)];
            let [found, expected] =
                [&mesh, &same].map(|robot| robot.clearance(&q, TOLERANCE).unwrap().distance);
            let is_apart = expected > 0.0;
            assert!(!is_apart || (found - expected).abs() <= 2.0 * TOLERANCE, "{k}: {found} {expected}");
            assert_eq!(found > 0.0, is_apart, "{k}: {found} {expected}");
            seen[usize::from(is_apart)] += 1;
        }
        assert!(seen[0] > 3 && seen[1] > 3, "{seen:?}");
    }
    let told = robot("<mesh filename='cube.obj' scale='0.1 0 0.1'/>").expect_err("it is flat").to_string();
    assert!(told.contains("the scale is '0.1 0 0.1'; expected three numbers other than 0"), "{told}");
}

#[test]
fn what_a_planner_would_get_wrong_is_refused_unless_ignored() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.xml");
    let read = |more: &str, ignore: &[&str]| {
        let body = "<worldbody><body name='a'><geom type='sphere' size='0.1'/></body></worldbody>";
        std::fs::write(&path, format!("<mujoco>{body}{more}</mujoco>")).unwrap();
        let ignore = ignore.iter().map(|element| element.to_string()).collect();
        let options = RobotOptions { ignore, ..RobotOptions::default() };
        Robot::load(&path, &options, &Progress::default())
    };
    let equality = "<equality><weld body1='a'/></equality>";
    let told = read(equality, &[]).expect_err("a weld").to_string();
    assert!(told.contains("or ignore \"equality\""), "{told}");
    assert!(read(equality, &["equality"]).is_ok());
    // Motors move what they move, and no pair of bodies comes nearer because of them.
    assert!(read("<actuator><motor name='m'/></actuator>", &[]).is_ok());

    let links: String = (1..=1000)
        .map(|k| {
            let name = format!("l{k}");
            let fixed = joint(&format!("j{k}"), "fixed", ["l0", &name], [0.0; 3], [1.0, 0.0, 0.0]);
            format!("<link name='{name}'/>{fixed}")
        })
        .collect();
    let told = of_text(&format!("<link name='l0'/>{links}")).expect_err("too many").to_string();
    assert!(told.contains("it has 1001 links; expected at most 1000"), "{told}");
}
