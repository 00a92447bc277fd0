//! Robots of scenes: the poses of their links, their masses, what they touch, and what is refused.
use std::path::{Path, PathBuf};

use tesdf::glam::{DAffine3, DMat3, DVec3};
use tesdf_sim::newton::Newton;
use tesdf_sim::scene_file::{LoadedScene, SceneError};
use tesdf_sim::{Dynamics, Mass, System};

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/robots")
}

fn load(robot: &str, rest: &str) -> Result<LoadedScene, SceneError> {
    let text = format!("time_step = 1e-3\nduration = 0.1\nbodies = []\n{rest}\n[[robots]]\n{robot}");
    LoadedScene::parse(text, data().join("scene.toml"))
}

/// The scene of a robot of this text.
fn load_text(urdf: &str, keys: &str) -> Result<LoadedScene, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.urdf"), urdf).unwrap();
    let text =
        format!("time_step = 1e-3\nduration = 0.1\nbodies = []\n[[robots]]\nfile = 'robot.urdf'\n{keys}");
    LoadedScene::parse(text, folder.path().join("scene.toml"))
}

fn refusal(urdf: &str, keys: &str) -> String {
    let loaded = load_text(urdf, keys).and_then(|loaded| loaded.system().map(|_| ()));
    loaded.expect_err("it was accepted").to_string()
}

fn body(system: &System, name: &str) -> usize {
    system.bodies().iter().position(|body| body.name == name).unwrap_or_else(|| panic!("no body {name}"))
}

/// `<origin>`, by products of matrices.
fn origin(xyz: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> DAffine3 {
    let turn = DMat3::from_rotation_z(yaw) * DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll);
    DAffine3::from_mat3_translation(turn, xyz.into())
}

/// Rodrigues' formula.
fn about(axis: DVec3, angle: f64) -> DAffine3 {
    let k = axis.normalize();
    let cross = DMat3::from_cols(k.cross(DVec3::X), k.cross(DVec3::Y), k.cross(DVec3::Z));
    DAffine3::from_mat3(DMat3::IDENTITY + cross * angle.sin() + cross * cross * (1.0 - angle.cos()))
}

const Q: [(&str, f64); 6] =
    [("pan", 0.7), ("lift", 0.4), ("elbow", -0.9), ("roll", 2.5), ("bend", 0.6), ("reach", 0.03)];

fn arm() -> String {
    let coordinates: Vec<_> = Q.iter().map(|(name, q)| format!("{name} = {q}")).collect();
    format!(
        "file = 'peg-arm.urdf'\nprefix = 'a/'\nfixed = true\ntranslation = [0.2, -0.1, 0.3]\n\
         rotation = [0, 0, 0.6, 0.8]\ncoordinates = {{ {} }}",
        coordinates.join(", ")
    )
}

#[test]
fn links_are_where_the_product_of_transforms_puts_them() {
    let system = load(&arm(), "").unwrap().system().unwrap();
    let quarter = 2.0 * 0.6_f64.atan2(0.8);
    let mut frame = DAffine3::from_translation(DVec3::new(0.2, -0.1, 0.3)) * about(DVec3::Z, quarter);
    let mut expected = vec![("base", frame)];
    let [pan, lift, elbow, roll, bend, reach] = Q.map(|(_, q)| q);
    for (name, origin, motion) in [
        ("shoulder", origin([0.0, 0.0, 0.1], [0.0; 3]), about(DVec3::Z, pan)),
        ("upper", origin([0.0, 0.09, 0.08], [0.0, 0.1, 0.0]), about(DVec3::Y, lift)),
        ("fore", origin([0.0, -0.07, 0.3], [0.05, 0.0, 0.02]), about(DVec3::Y, elbow)),
        ("wrist", origin([0.0, 0.0, 0.26], [0.0; 3]), about(DVec3::NEG_Z, roll)),
        ("hand", origin([0.0, 0.0, 0.06], [0.0; 3]), about(DVec3::new(0.6, 0.8, 0.0), bend)),
        ("tool", origin([0.0, 0.0, 0.05], [0.0; 3]), DAffine3::from_translation(DVec3::Z * reach)),
        ("peg", origin([0.0, 0.0, 0.06], [0.0, 0.0, 0.5]), DAffine3::IDENTITY),
    ] {
        frame = frame * origin * motion;
        expected.push((name, frame));
    }
    for (name, frame) in expected {
        let found = system.states()[body(&system, &format!("a/{name}"))].pose;
        let found = DAffine3::from_rotation_translation(found.rotation, found.translation);
        assert!(found.abs_diff_eq(frame, 1e-12), "{name}: {found}, expected {frame}");
    }
    // The flange is a part of the tool, and the base never moves.
    assert!(system.bodies().iter().all(|body| body.name != "a/flange"));
    assert_eq!(system.bodies()[body(&system, "a/base")].mass, Mass::Fixed);
    let names: Vec<_> = system.joints().iter().map(|joint| joint.name.as_str()).collect();
    let all = ["pan", "lift", "elbow", "roll", "bend", "reach", "to_peg", "to_camera"];
    assert!(all.iter().all(|name| names.contains(&format!("a/{name}").as_str())), "{names:?}");
    for (name, q) in Q {
        let joint = names.iter().position(|found| *found == format!("a/{name}")).unwrap();
        assert!((system.coordinates()[joint] - q).abs() < 1e-12, "{name}: {}", system.coordinates()[joint]);
        let (way, turn) =
            system.joints()[joint].error(System::poses_of(&system.joints()[joint], system.states()));
        assert!(way < 1e-12 && turn < 1e-12, "{name} is open by {way} m, {turn} rad");
    }
}

#[test]
fn masses_are_those_of_the_file_and_geometries_those_of_the_parts() {
    let system = load(&arm(), "").unwrap().system().unwrap();
    let mass = |name: &str| match system.bodies()[body(&system, name)].mass {
        Mass::Free(mass) => mass,
        other => panic!("{name} is {other:?}"),
    };
    let upper = mass("a/upper");
    assert_eq!((upper.mass, upper.center), (2.0, DVec3::new(0.0, 0.0, 0.14)));
    let turn = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(0.2);
    let inertia = turn * DMat3::from_diagonal(DVec3::new(0.02, 0.0195, 0.003)) * turn.transpose();
    assert!(upper.inertia.abs_diff_eq(inertia, 1e-15), "{}", upper.inertia);
    // The bar's top at 0.29 is within the knuckle, whose round is at 0.34; the knuckle's side is at
    // y = 0.03, that of the bar at 0.025.
    let scene = system.scene();
    let at = |name: &str, p: [f64; 3]| {
        let instance = scene.instance(system.bodies()[body(&system, name)].instance).unwrap();
        match scene.shape(instance.shape).unwrap() {
            tesdf::collide::Shape::Mesh(asset) => asset.signed_distance(p.into()),
            other => panic!("{name} is {other:?}"),
        }
    };
    assert!((at("a/upper", [0.0, 0.0, 0.35]) - 0.01).abs() < 0.04 * 1.3e-3);
    assert!((at("a/upper", [0.0, 0.035, 0.3]) - 0.005).abs() < 1e-12);
    assert!((at("a/upper", [0.0, 0.035, 0.1]) - 0.01).abs() < 1e-12);
    assert!(at("a/upper", [0.0, 0.0, 0.28]) < -0.015, "the place within both is inside");
    assert!((at("a/wrist", [0.0, 0.0, 0.06]) - 0.01).abs() < 0.03 * 2.5e-3);
    // The camera has a mass, and nothing that it could touch with.
    let camera = scene.instance(system.bodies()[body(&system, "a/camera")].instance).unwrap();
    assert_eq!((mass("a/camera").mass, camera.groups.filter), (0.05, 0));
}

#[test]
fn limits_beyond_a_turn_hold_and_motors_have_the_effort_of_the_file() {
    let motors =
        "motors = { roll = { drive = { velocity = 40 } }, pan = { drive = { position = 0 }, limit = 3 } }";
    let keys = "file = 'peg-arm.urdf'\nfixed = true\nself_contacts = false\n";
    let loaded = load(&format!("{keys}{motors}"), "gravity = [0, 0, 0]").unwrap();
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let joint = |name: &str| engine.system().joints().iter().position(|joint| joint.name == name).unwrap();
    let (roll, pan) = (joint("roll"), joint("pan"));
    let limits = [roll, pan].map(|joint| engine.system().joints()[joint].motor.unwrap().limit);
    assert_eq!(limits, [20.0, 3.0]);
    for _ in 0..300 {
        engine.step(1e-3).unwrap();
    }
    let found = engine.system().coordinates()[roll];
    assert!((found - 6.2).abs() < 1e-6, "the roll is at {found}; its limit is 6.2");
}

/// Two fingers, whose boxes overlap each other and that of the palm.
const FINGERS: &str = r#"<robot name="r">
  <link name="palm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  <joint name="j1" type="prismatic"><parent link="palm"/><child link="one"/><limit lower="-1" upper="1"/></joint>
  <link name="one"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  <joint name="j2" type="prismatic"><parent link="palm"/><child link="two"/><origin xyz="0 0.09 0"/><limit lower="-1" upper="1"/></joint>
  <link name="two"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
</robot>"#;

#[test]
fn neighbours_do_not_touch_and_others_do_unless_told() {
    let contacts = |keys: &str| {
        let loaded = load_text(FINGERS, keys).unwrap();
        let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
        engine.step(1e-3).unwrap();
        let bodies = |id| engine.system().body_of(id).unwrap();
        let pairs = engine.contacts().iter().map(|c| [bodies(c.instance_a), bodies(c.instance_b)]);
        let mut pairs: Vec<_> = pairs.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    };
    assert_eq!(contacts("fixed = true"), [[1, 2]]);
    assert_eq!(contacts(""), [[1, 2]]);
    assert_eq!(contacts("self_contacts = false"), [[0; 2]; 0]);
    // Fingers that start apart do not touch.
    assert_eq!(contacts("coordinates = { j1 = 0.3, j2 = -0.3 }"), [[0; 2]; 0]);
}

#[test]
fn a_frame_without_mass_is_a_part_of_what_is_fixed_to_it() {
    let urdf = r#"<robot name="r"><link name="foot"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
      <joint name="to_mid" type="fixed"><parent link="foot"/><child link="mid"/><origin xyz="0 0 0.1"/></joint><link name="mid"/>
      <joint name="to_body" type="fixed"><parent link="mid"/><child link="body"/><origin xyz="0 0 0.2"/></joint>
      <link name="body"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link></robot>"#;
    let system = load_text(urdf, "translation = [0, 0, 1]").unwrap().system().unwrap();
    assert_eq!((system.bodies().len(), system.joints().len()), (1, 0));
    assert_eq!(system.bodies()[0].name, "body");
    assert!(system.states()[0].pose.translation.abs_diff_eq(DVec3::new(0.0, 0.0, 1.3), 1e-15));
    let scene = system.scene();
    let shape = scene.instance(system.bodies()[0].instance).unwrap().shape;
    let tesdf::collide::Shape::Mesh(asset) = scene.shape(shape).unwrap() else { panic!("it has no mesh") };
    assert!((asset.signed_distance(DVec3::new(0.0, 0.0, -0.3)) + 0.02).abs() < 1e-4);
    // Fixed, it is the foot alone, as nothing else can touch.
    let system = load_text(urdf, "fixed = true").unwrap().system().unwrap();
    assert_eq!(system.bodies()[0].name, "foot");
}

#[test]
fn what_cannot_be_simulated_is_refused_with_its_place_and_a_cure() {
    for (from, to, keys, expected) in [
        ("prismatic", "planar", "", "line 4: the joint j1 is planar; expected two prismatic"),
        ("prismatic", "odd", "", "the type of the joint j1 is 'odd'; expected revolute"),
        ("<child link=\"one\"/>", "<child link=\"none\"/>", "", "line 4: there is no link none"),
        ("<child link=\"two\"/>", "<child link=\"one\"/>", "", "the link one is the child of two joints"),
        (
            "<parent link=\"palm\"/><child link=\"two\"/>",
            "<parent link=\"two\"/><child link=\"two\"/>",
            "",
            "line 8: the link two is in a circle",
        ),
        ("<mass value=\"1\"/>", "<mass value=\"0\"/>", "", "line 2: the link palm moves and has no mass"),
        ("izz=\"1\"", "izz=\"3\"", "", "line 2: moments of inertia"),
        (
            "<box size=\"0.1 0.1 0.1\"/>",
            "<box size=\"0.1 0.1\"/>",
            "",
            "line 3: size of <box> is '0.1 0.1'; expected 3 finite numbers",
        ),
        ("<box size=\"0.1 0.1 0.1\"/>", "<ellipsoid/>", "", "the geometry <ellipsoid> is not known"),
        ("<limit lower=\"-1\" upper=\"1\"/>", "", "", "the joint j1 is prismatic and has no <limit>"),
        (
            "",
            "",
            "coordinates = { j3 = 1 }",
            "coordinates: the robot has no joint j3 that turns or slides; expected one of j1, j2",
        ),
        ("", "", "motors = { j1 = { drive = { velocity = 1 } } }", "motors: that of j1 has no limit"),
        ("", "", "file2 = 'x'", "unknown field `file2`"),
        ("<link name=\"two\">", "<link name=\"one\">", "", "line 8: the link one is there twice"),
        ("<child link=\"one\"/>", "", "", "line 4: <joint> has no <child>; expected one"),
        ("</robot>", "<link name=\"lone\"/></robot>", "", "line 10: the links palm and lone have no parent"),
        ("<limit", "<axis xyz=\"0 0 0\"/><limit", "", "the axis of the joint j1 has no direction"),
        ("<mass value=\"1\"/>", "", "", "line 2: <inertial> has no <mass>; expected one"),
        (FINGERS, "<robot name='r'/>", "", "line 1: the robot has no link; expected at least one"),
        (FINGERS, "<mujoco/>", "", "line 1: found <mujoco>; expected <robot> of URDF"),
    ] {
        let told = refusal(&FINGERS.replacen(from, to, 1), keys);
        assert!(told.contains(expected), "{told}\nexpected {expected}");
    }
    let told = LoadedScene::read(data().join("peg-arm.urdf")).expect_err("it was read").to_string();
    assert!(told.contains("a robot description; give it a scene: [[robots]]"), "{told}");
}

/// Fingers that mimic: the second one of the first one, in a file where it comes before it, and a
/// wheel of the second one. All follow the coordinate of the first one at the start and in the run.
#[test]
fn mimic_joints_follow() {
    let wheel = r#"<joint name="wheel" type="continuous"><parent link="palm"/><child link="wheel"/><axis xyz="0 0 1"/><mimic joint="j1" multiplier="40" offset="0.5"/></joint>
      <link name="wheel"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link></robot>"#;
    let mimic = r#"<child link="one"/><mimic joint="j1" multiplier="-2" offset="0.01"/>"#;
    let urdf = FINGERS.replace("</robot>", wheel).replace("j1", "j0").replace("j2", "j1").replace("j0", "j2");
    let urdf = urdf.replace(r#"<child link="one"/>"#, mimic);
    let keys = "prefix = 'left/'
fixed = true
self_contacts = false
coordinates = { j1 = 0.1 }
                motors = { j1 = { drive = { velocity = -0.2 }, limit = inf } }";
    let loaded = load_text(&urdf, keys).unwrap();
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let check = |engine: &Newton, expected: f64, exact: f64| {
        let system = engine.system();
        let of = |name: &str| {
            let joint = system.joints().iter().position(|joint| joint.name == name).unwrap();
            system.coordinates()[joint]
        };
        let [one, two, wheel] = ["left/j1", "left/j2", "left/wheel"].map(of);
        assert!((one - expected).abs() < 1e-6, "{one}, not {expected}");
        assert!((two - (0.01 - 2.0 * one)).abs() < exact, "{two}");
        // More than a turn.
        assert!((wheel - (0.5 + 40.0 * two)).abs() < exact, "{wheel}");
    };
    check(&engine, 0.1, 1e-9);
    for _ in 0..100 {
        assert!(engine.step(1e-3).unwrap().converged);
    }
    check(&engine, 0.08, 1e-9);
    // Left out, they are joints on their own.
    let loaded = load_text(
        &urdf,
        "fixed = true
ignore = ['mimic']",
    )
    .unwrap();
    assert!(loaded.scene.couplings.is_empty());
    for (from, to, expected) in [
        (
            r#"joint="j1""#,
            r#"joint="j3""#,
            "line 4: there is no joint j3 that turns or slides; expected one of j2, j1",
        ),
        (r#"joint="j1""#, r#"joint="j2""#, "the joint j2 follows itself"),
        (r#"joint="j1""#, r#"joint="wheel""#, "follows itself; take one coupling out"),
        (r#"joint="j1" "#, "", "line 4: <mimic> has no joint; expected one"),
        (r#"multiplier="-2""#, r#"multiplier="0""#, "the joint j2 follows j1 with the ratio 0"),
        (r#"multiplier="-2""#, r#"multiplier="x""#, "multiplier of <mimic> is 'x'; expected a finite number"),
    ] {
        let told = refusal(&urdf.replacen(from, to, 1), "fixed = true");
        assert!(told.contains(expected), "{told}\nexpected {expected}");
    }
    let told = refusal(&urdf, "fixed = true\ncoordinates = { j2 = 0.3 }");
    assert!(
        told.contains("couplings: joint j2: its coordinate is 0.3")
            && told.contains("; expected 0.01: it follows j1"),
        "{told}"
    );
}

/// A free base with an arm: a class of defaults, an include, masses of geoms, and a mesh that is
/// moved and turned.
const MJCF: &str = r#"<mujoco model="m"><compiler angle="degree" meshdir="meshes"/>
  <default><default class="arm"><joint damping="0.5" armature="0.01" range="-90 45"/><geom friction="0.7 0 0" density="500"/></default></default>
  <include file="assets.xml"/>
  <worldbody><geom name="table" type="box" size="1 1 0.1" pos="0 0 -0.1"/>
    <body name="base" pos="0 0 1" euler="0 0 90"><freejoint name="root"/><inertial mass="2" pos="0 0 0.1" quat="1 0 0 1" diaginertia="0.01 0.02 0.025"/>
      <geom type="box" size="0.1 0.1 0.1"/>
      <body name="arm" pos="0.3 0 0" childclass="arm"><joint name="elbow" axis="0 1 0" pos="0 0 0.05"/>
        <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02"/><geom type="cylinder" size="0.03 0.05" pos="0.2 0 0" mass="0.4"/>
        <body pos="0.25 0 0"><joint type="slide" axis="1 0 0" range="-0.1 0.1"/><geom type="mesh" mesh="tip"/></body>
      </body>
    </body>
    <body name="ball" pos="0 2 0"><joint name="socket" type="ball"/><geom type="sphere" size="0.1" contype="2" conaffinity="2"/></body>
  </worldbody>
  <contact><exclude body1="base" body2="ball"/></contact>
</mujoco>"#;

fn mjcf(text: &str, keys: &str) -> Result<LoadedScene, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("meshes")).unwrap();
    let tip = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    std::fs::write(folder.path().join("meshes/tip.obj"), tip).unwrap();
    let assets = "<mujocoinclude><asset><mesh name='tip' file='tip.obj' scale='0.1 0.1 0.1' refpos='1 0 0' \
                  refquat='1 0 0 1'/></asset></mujocoinclude>";
    std::fs::write(folder.path().join("assets.xml"), assets).unwrap();
    std::fs::write(folder.path().join("robot.xml"), text).unwrap();
    let text =
        format!("time_step = 1e-3\nduration = 0.1\nbodies = []\n[[robots]]\nfile = 'robot.xml'\n{keys}");
    let loaded = LoadedScene::parse(text, folder.path().join("scene.toml"))?;
    // The meshes are there only now.
    loaded.system()?;
    Ok(loaded)
}

#[test]
fn an_mjcf_file_gives_bodies_joints_and_masses_of_geoms() {
    let loaded = mjcf(MJCF, "coordinates = { elbow = 0.5 }").unwrap();
    let section =
        |name: &str| loaded.scene.bodies.iter().map(|b| b.get_ref()).find(|b| b.name == name).unwrap();
    let names: Vec<_> = loaded.scene.bodies.iter().map(|b| b.get_ref().name.as_str()).collect();
    assert_eq!(names, ["world", "base", "arm", "body3", "ball"]);
    assert!(section("world").fixed && section("world").parts.len() == 1);
    let base = section("base");
    assert_eq!((base.mass, base.friction, base.fixed), (Some(2.0), 1.0, false));
    let [xx, yy, zz, ..] = base.inertia.unwrap();
    assert!((xx - 0.02).abs() < 1e-15 && (yy - 0.01).abs() < 1e-15 && (zz - 0.025).abs() < 1e-15);
    // A capsule of 500 kg/m³ and a cylinder of 0.4 kg.
    let arm = section("arm");
    let capsule = 500.0 * std::f64::consts::PI * (4e-4 * 0.2 + 4.0 / 3.0 * 8e-6);
    assert!((arm.mass.unwrap() - capsule - 0.4).abs() < 1e-12 && arm.friction == 0.7);
    let center = (capsule * 0.1 + 0.4 * 0.2) / (capsule + 0.4);
    assert!((arm.center_of_mass.unwrap()[0] - center).abs() < 1e-12);
    // The base is turned by 90° about z, so x of the arm is y of the world.
    let origin = DAffine3::from_translation(DVec3::Z)
        * about(DVec3::Z, 90.0_f64.to_radians())
        * DAffine3::from_translation(DVec3::new(0.3, 0.0, 0.05))
        * about(DVec3::Y, 0.5)
        * DAffine3::from_translation(DVec3::new(0.0, 0.0, -0.05));
    assert!(
        DVec3::from_array(arm.translation).abs_diff_eq(origin.translation, 1e-12),
        "{:?}",
        arm.translation
    );
    let joint = |name: &str| loaded.scene.joints.iter().find(|joint| joint.name == name).unwrap();
    let elbow = joint("elbow");
    assert_eq!((elbow.resistance.damping, elbow.resistance.armature, elbow.coordinate), (0.5, 0.01, 0.5));
    let [low, high] = elbow.limits.unwrap().map(f64::to_degrees);
    assert!((low + 90.0).abs() < 1e-12 && (high - 45.0).abs() < 1e-12);
    assert_eq!(joint("body3").limits, Some([-0.1, 0.1]));
    assert_eq!(joint("socket").parent, None);
    // The tip: less (1, 0, 0), turned back by 90° about z, a tenth: its corner at (1, 0, 0) is at
    // the origin, that at (0, 0, 0) at (0, 0.1, 0).
    let part = &section("body3").parts[0];
    let turn = tesdf::glam::DQuat::from_array(part.rotation);
    let at = |p: DVec3| turn * (DVec3::from_array(part.scale) * p) + DVec3::from_array(part.translation);
    assert!(
        at(DVec3::X).abs_diff_eq(DVec3::ZERO, 1e-15) && at(DVec3::ZERO).abs_diff_eq(DVec3::Y * 0.1, 1e-15)
    );
    // 1/6 of a unit cube, 1000 kg/m³ but for the class: 500.
    assert!((section("body3").mass.unwrap() - 500.0 * 1e-3 / 6.0).abs() < 1e-12);
    let excluded = |a: &str, b: &str| loaded.scene.exclude.iter().any(|pair| pair.bodies == [a, b]);
    // Neighbours; what <exclude> and the groups say; and the table meets the base.
    assert!(excluded("base", "arm") && excluded("base", "ball") && excluded("arm", "ball"));
    assert!(!excluded("world", "base") && !excluded("base", "body3"));
}

#[test]
fn what_mjcf_has_and_a_scene_has_not_is_refused() {
    for (from, to, expected) in [
        ("<contact>", "<actuator><motor joint='elbow'/></actuator><contact>", "ignore = [\"actuator\"]"),
        ("<contact>", "<equality><weld body1='base'/></equality><contact>", "ignore = [\"equality\"]"),
        ("<freejoint", "<replicate count='3'/><freejoint", "ignore = [\"replicate\"]"),
        ("<freejoint name=\"root\"/>", "<frame><freejoint/></frame>", "<freejoint> is within <frame>"),
        ("axis=\"0 1 0\"", "axis=\"0 1 0\" stiffness=\"3\"", "body arm: the joint elbow has a spring"),
        ("axis=\"0 1 0\"", "axis=\"0 1 0\" ref=\"3\"", "the joint elbow has ref"),
        ("axis=\"0 1 0\"", "axis=\"0 0 0\"", "the axis of the joint elbow"),
        (
            "<contact>",
            "<equality><joint joint1='elbow' joint2='body3' polycoef='0 1 2 0 0'/></equality><contact>",
            "the equality of the joint elbow has a polycoef that is not linear, which is not simulated",
        ),
        (
            "<contact>",
            "<equality><joint joint1='elbow'/></equality><contact>",
            "the equality of the joint elbow keeps it where it is, which is not simulated",
        ),
        (
            "<contact>",
            "<equality><joint joint1='elbow' joint2='root'/></equality><contact>",
            "the equality of the joint elbow: there is no joint root that turns or slides",
        ),
        (
            "<contact>",
            "<equality><joint joint1='elbow' joint2='body3'/><joint joint1='elbow' joint2='body3'/></equality><contact>",
            "the joint elbow follows both body3 and body3",
        ),
        (
            "<joint name=\"elbow\"",
            "<joint name='other'/><joint name=\"elbow\"",
            "body arm: it has 2 joints; expected one",
        ),
        ("type=\"box\" size=\"0.1", "type=\"ellipsoid\" size=\"0.1", "is of type ellipsoid"),
        ("type=\"box\" size=\"1 1 0.1\"", "type=\"plane\" size=\"1 1 0.1\"", "geom table is of type plane"),
        ("mesh=\"tip\"", "mesh=\"top\"", "the mesh 'top' is not in <asset>"),
        ("body2=\"ball\"", "body2=\"bull\"", "<exclude> names the body bull"),
    ] {
        let told = mjcf(&MJCF.replacen(from, to, 1), "").expect_err("it was accepted").to_string();
        assert!(told.contains(expected), "{told}\nexpected {expected}");
    }
    assert!(
        mjcf(
            &MJCF.replacen("<contact>", "<actuator><motor joint='elbow'/></actuator><contact>", 1),
            "ignore = ['actuator']"
        )
        .is_ok()
    );
    let equality = "<equality><joint joint1='elbow' joint2='body3' polycoef='0.1 -2 0 0 0'/>\
                    <joint joint1='body3' joint2='elbow' active='false'/></equality><contact>";
    let loaded = mjcf(&MJCF.replacen("<contact>", equality, 1), "").unwrap();
    let [coupling] = loaded.scene.couplings.as_slice() else { panic!("{:?}", loaded.scene.couplings) };
    assert_eq!((coupling.joint.as_str(), coupling.of.as_str()), ("elbow", "body3"));
    assert_eq!((coupling.ratio, coupling.offset), (-2.0, 0.1));
    let told = mjcf(MJCF, "fixed = true").expect_err("it was accepted").to_string();
    assert!(told.contains("MJCF says itself"), "{told}");
}
