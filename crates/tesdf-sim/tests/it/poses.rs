//! Poses in scene files, in place of translations and rotations.
use tesdf_sim::scene_file::LoadedScene;

/// The key for these numbers, and what is to be the same.
const POSE: &str = "pose = [1, 2, 3, 0, 0, 0.6, 0.8]";
const APART: &str = "translation = [1, 2, 3]\nrotation = [0, 0, 0.6, 0.8]";
/// The same turn, by 2 atan(0.6 / 0.8).
const MATRIX: &str = "pose = [[0.28, -0.96, 0, 1], [0.96, 0.28, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]";

fn scene(body: &str) -> String {
    format!("time_step = 1e-3\nduration = 1\n[[bodies]]\nname = 'a'\nmass = 1\n{body}\n")
}

fn load(text: &str) -> Result<LoadedScene, String> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/robots/scene.toml");
    LoadedScene::parse(text.into(), folder).map_err(|e| e.to_string())
}

#[test]
fn a_pose_is_its_translation_and_rotation() {
    let ball = "shape = { sphere = { radius = 1 } }";
    let forms: [fn(&str) -> String; 4] = [
        |pose| scene(&format!("shape = {{ sphere = {{ radius = 1 }} }}\n{pose}")),
        |pose| {
            let parts = format!("parts = [{{ shape = {{ sphere = {{ radius = 1 }} }}, {pose} }}]");
            scene(&parts.replace('\n', ", "))
        },
        |pose| {
            let copies = format!("copies = {{ count = 3, {} }}", pose.replace('\n', ", "));
            scene(&format!("shape = {{ sphere = {{ radius = 1 }} }}\n{copies}"))
        },
        |pose| {
            let ball = scene("shape = { sphere = { radius = 1 } }");
            format!("{ball}[[robots]]\nfile = 'peg-arm.urdf'\n{pose}\n")
        },
    ];
    for form in forms {
        let apart = load(&form(APART)).unwrap().scene;
        let one = load(&form(POSE)).unwrap().scene;
        assert_eq!(one.bodies, apart.bodies);
        assert_eq!(one.joints, apart.joints);
        let refused = load(&form(&format!("{POSE}\nrotation = [0, 0, 0, 1]"))).expect_err("both are given");
        assert!(refused.contains("entry 0") && refused.contains("pose beside rotation"), "{refused}");
    }
    let body = |pose: &str| load(&scene(&format!("{ball}\n{pose}"))).unwrap().scene.bodies[0].clone();
    let (matrix, apart) = (body(MATRIX).into_inner(), body(APART).into_inner());
    assert_eq!(matrix.translation, apart.translation);
    for (found, expected) in matrix.rotation.into_iter().zip(apart.rotation) {
        assert!((found - expected).abs() < 1e-15, "{:?}", matrix.rotation);
    }
    // A scene as JSON, as runs and Python have it.
    let json = |pose: &str| {
        let body = format!("{ball}\n{pose}");
        let json: serde_json::Value = toml::from_str(&scene(&body)).unwrap();
        LoadedScene::of_json(json, "scene").map(|loaded| loaded.scene.bodies).map_err(|e| e.to_string())
    };
    assert_eq!(json(POSE), json(APART));
    assert!(json(&format!("{POSE}\ntranslation = [0, 0, 0]")).is_err());
}

#[test]
fn what_is_no_pose_is_refused() {
    for (pose, expected) in [
        ("[1, 2, 3, 0, 0, 1]", "6 numbers and 0 rows; expected 7 numbers"),
        ("[1, 2, 3, 0, 0, 0, 1, 0]", "8 numbers"),
        ("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]", "0 numbers and 3 rows"),
        ("[[1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]", "a row of 3 numbers; expected 4"),
        ("[[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]", "deforms or mirrors"),
        ("[1, 0, 0, 0, [0, 1, 0, 0]]", "4 numbers and 1 rows"),
        ("'x'", "line 6"),
    ] {
        let refused = load(&scene(&format!("pose = {pose}"))).expect_err(pose);
        assert!(refused.contains(expected) && refused.contains("line 6"), "{pose}: {refused}");
    }
    // As a quaternion that is given apart.
    let long = load(&scene("shape = { sphere = { radius = 1 } }\npose = [0, 0, 0, 0, 0, 0, 2]")).unwrap();
    assert!(long.system().unwrap_err().to_string().contains("of length 2"));
}
