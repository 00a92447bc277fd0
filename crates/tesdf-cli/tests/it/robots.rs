//! `tesdf encode` of robot descriptions: packages, scales, names, and meshes that cannot be read.

use crate::folder::Folder;
use serde_json::Value;
use tesdf::TeSdf;
use tesdf::glam::DVec3;

const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

fn manifest(folder: &Folder, name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.path(name)).unwrap()).unwrap()
}

fn at(folder: &Folder, asset: &str, p: [f64; 3]) -> f64 {
    TeSdf::open(folder.path(asset)).unwrap().signed_distance(DVec3::from_array(p))
}

/// A package with a robot in it, and one beside it.
fn robot(folder: &Folder, text: &str) {
    for name in ["arm/urdf", "arm/meshes", "parts/meshes"] {
        std::fs::create_dir_all(folder.path(name)).unwrap();
    }
    folder.write("arm/package.xml", "<package><name>arm_description</name></package>");
    folder.write("arm/meshes/link.obj", TETRAHEDRON);
    folder.write("parts/meshes/link.obj", TETRAHEDRON.replace("v 1", "v 2"));
    folder.write("arm/meshes/old.dae", "<COLLADA/>");
    folder.write("arm/urdf/robot.urdf", text);
}

const ROBOT: &str = r#"<?xml version="1.0"?>
<robot name="arm">
  <link name="base">
    <visual><geometry><mesh filename="package://arm_description/meshes/seen.stl"/></geometry></visual>
    <collision name="whole"><origin xyz="0 0 1"/>
      <geometry><mesh filename="package://arm_description/meshes/link.obj" scale="0.001 0.001 0.001"/></geometry></collision>
    <collision><geometry><box size="1 1 1"/></geometry></collision>
    <collision><geometry><mesh filename="../meshes/link.obj" scale="0.001 0.001 0.001"/></geometry></collision>
  </link>
  <link name="left"><collision><geometry><mesh filename="package://arm_description/meshes/link.obj" scale="1 -1 1"/></geometry></collision></link>
  <link name="hand"><collision><geometry><mesh filename="package://parts/meshes/link.obj"/></geometry></collision></link>
  <link name="old"><collision><geometry><mesh filename="package://arm_description/meshes/old.dae"/></geometry></collision></link>
  <link name="lost"><collision><geometry><mesh filename="package://nowhere/x.stl"/></geometry></collision></link>
  <joint name="j" type="something odd"/>
</robot>"#;

#[test]
fn a_urdf_file_gives_each_collision_mesh_once_for_each_scale() {
    let folder = Folder::new();
    robot(&folder, ROBOT);
    let (code, out, err) = folder.tesdf(&["encode", "arm/urdf/robot.urdf", "-o", "assets"]);
    // Two meshes cannot be read, and stop nothing.
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(err.contains("COLLADA") && err.contains("--package nowhere=PATH"), "{err}");
    let manifest = manifest(&folder, "assets/manifest.json");
    assert_eq!((&manifest["assets"], &manifest["failed"]), (&3.into(), &2.into()));
    let meshes = manifest["meshes"].as_array().unwrap();
    let assets: Vec<_> = meshes.iter().map(|mesh| mesh["asset"].as_str().unwrap_or("none")).collect();
    assert_eq!(assets, ["link.tesdf", "link-2.tesdf", "link-3.tesdf", "none", "none"]);
    let uses: Vec<_> = meshes.iter().map(|mesh| mesh["uses"].to_string()).collect();
    assert_eq!(uses[0], r#"[{"collision":"whole","link":"base"},{"collision":"2","link":"base"}]"#);
    assert_eq!(meshes[1]["scale"].to_string(), "[1.0,-1.0,1.0]");
    assert_eq!(uses[2], r#"[{"collision":"0","link":"hand"}]"#);

    let asset = TeSdf::open(folder.path("assets/link.tesdf")).unwrap();
    assert_eq!((asset.unit(), &*asset.about().source.name), (Some("m"), "link.obj#scale=0.001 0.001 0.001"));
    assert!((at(&folder, "assets/link.tesdf", [-0.5e-3, 0.1e-3, 0.1e-3]) - 0.5e-3).abs() < 1e-12);
    // Mirrored, and the inside is still inside: 0.1 from the sides x, y and z = 0.
    assert!((at(&folder, "assets/link-2.tesdf", [0.1, -0.1, 0.1]) + 0.1).abs() < 1e-12);
    assert!((at(&folder, "assets/link-3.tesdf", [1.5, 0.1, 0.1]) + 0.1).abs() < 0.1);
}

#[test]
fn packages_may_be_named() {
    let folder = Folder::new();
    robot(&folder, &ROBOT.replace("nowhere/x.stl", "elsewhere/link.obj").replace("old.dae", "link.obj"));
    let package = format!("elsewhere={}", folder.path("parts/meshes").display());
    folder.good(&["encode", "arm/urdf/robot.urdf", "-o", "assets", "--package", &package]);
    let mut command = folder.command(&["encode", "arm/urdf/robot.urdf", "-o", "again"]);
    std::fs::create_dir_all(folder.path("ros/elsewhere")).unwrap();
    folder.write("ros/elsewhere/link.obj", TETRAHEDRON);
    let done = command.env("ROS_PACKAGE_PATH", folder.path("ros")).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));

    let wrong = [
        (vec!["encode", "arm/urdf/robot.urdf", "-o", "a", "--package", "x"], "NAME=PATH"),
        (vec!["encode", "arm/urdf/robot.urdf", "-o", "a", "--split"], "--split is for one mesh file"),
        (vec!["encode", "arm/meshes/link.obj", "-o", "a", "--package", "x=y"], "--package is of URDF files"),
        (vec!["encode", "arm/urdf/robot.urdf.xacro", "-o", "a"], "xacro"),
    ];
    for (args, expected) in wrong {
        let (code, _, err) = folder.tesdf(&args);
        assert!(code == Some(2) && err.contains(expected), "{args:?}: {err}");
    }
    for (text, expected) in [
        (
            "<robot><link name='a'><collision><geometry><mesh/></geometry></collision></link></robot>",
            "line 1: <mesh> has no filename",
        ),
        (
            "<robot>\n<link><collision><geometry><mesh filename='a.stl' scale='0 1 1'/></geometry></collision></link></robot>",
            "line 2: the scale is '0 1 1'",
        ),
        ("<robot><link/></robot>", "names no collision mesh"),
        ("<robot", "the XML is broken"),
        ("<sdf/>", "expected <robot>"),
    ] {
        folder.write("wrong.urdf", text);
        let (code, _, err) = folder.tesdf(&["encode", "wrong.urdf", "-o", "a"]);
        assert!(code == Some(2) && err.contains(expected), "{err}");
    }
}

#[test]
fn an_mjcf_file_gives_the_meshes_of_geoms_that_can_touch() {
    let folder = Folder::new();
    std::fs::create_dir_all(folder.path("model/assets")).unwrap();
    folder.write("model/assets/part.obj", TETRAHEDRON);
    folder.write("model/assets/seen.obj", TETRAHEDRON);
    folder.write(
        "model/common.xml",
        r#"<mujocoinclude><asset><mesh file="part.obj" class="small"/>
            <mesh name="turned" file="part.obj" refpos="1 0 0" refquat="1 0 0 1" scale="2 2 2"/>
            <mesh name="seen" file="seen.obj"/><mesh name="odd" file="odd.msh"/></asset></mujocoinclude>"#,
    );
    folder.write(
        "model/robot.xml",
        r#"<mujoco model="m"><compiler meshdir="assets" angle="radian"/>
            <default><default class="visual"><geom type="mesh" contype="0" conaffinity="0"/></default>
              <default class="small"><mesh scale="0.1 0.1 0.1"/></default>
              <default class="collision"><geom type="mesh"/></default></default>
            <include file="common.xml"/>
            <worldbody><geom name="floor" type="plane" size="1 1 1"/>
              <body name="base"><geom class="visual" mesh="seen"/><geom name="hull" class="collision" mesh="part"/>
                <body><geom class="collision" mesh="part"/><geom type="mesh" mesh="turned"/><geom type="mesh" mesh="odd"/></body>
              </body></worldbody></mujoco>"#,
    );
    folder.write("model/loop.xml", "<mujoco><include file='loop.xml'/></mujoco>");
    let (code, _, err) = folder.tesdf(&["encode", "model/loop.xml", "-o", "assets"]);
    assert!(code == Some(2) && err.contains("line 1: model/loop.xml includes itself"), "{err}");
    let (code, _, err) = folder.tesdf(&["encode", "model/robot.xml", "-o", "assets"]);
    assert!(code == Some(1) && err.contains("odd.msh"), "{err}");
    let manifest = manifest(&folder, "assets/manifest.json");
    let meshes = manifest["meshes"].as_array().unwrap();
    assert_eq!(meshes.len(), 3, "{manifest}");
    assert_eq!(meshes[0]["uses"].to_string(), r#"[{"body":"base","geom":"hull"},{"body":"2","geom":"0"}]"#);
    assert_eq!((&meshes[0]["asset"], &meshes[1]["asset"]), (&"part.tesdf".into(), &"part-2.tesdf".into()));
    // Scaled by the class; MJCF states no unit.
    assert_eq!(TeSdf::open(folder.path("assets/part.tesdf")).unwrap().unit(), None);
    assert!((at(&folder, "assets/part.tesdf", [-0.1, 0.02, 0.02]) - 0.1).abs() < 1e-12);
    // refpos (1, 0, 0) is subtracted: the corner (1, 0, 0) comes to the origin. The inverse of a
    // quarter turn about z takes (-1, 0, 0), where the origin was, to (0, 1, 0); the scale to (0, 2, 0).
    assert!((at(&folder, "assets/part-2.tesdf", [-1.0, 2.0, -1.0]) - 2.0_f64.sqrt()).abs() < 1e-12);
    assert!((at(&folder, "assets/part-2.tesdf", [0.1, 3.0, 0.1]) - 1.0).abs() < 1e-12);
}
