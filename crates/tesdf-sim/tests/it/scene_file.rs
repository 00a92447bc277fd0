//! Tests of scene files, their error messages, and run files.
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use tesdf::collide::Shape;
use tesdf::encode::{EncodeOptions, Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh, write};
use tesdf_sim::record::{RecordError, RunRecord};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene, MAX_BODIES, SceneError};
use tesdf_sim::{Dynamics, Mass, SimulateError, simulate};

use crate::support::meshes::cuboid;

const DROP: &str = r#"
time_step = 1e-3
duration = 0.05

[record]
contacts_every = 2

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "brick"
shape = { box = { half_extents = [0.01, 0.02, 0.03] } }
mass = 0.5
translation = [0, 0, 0.031]
"#;

fn load(text: &str) -> Result<LoadedScene, SceneError> {
    LoadedScene::parse(text.into(), Path::new("drop.toml"))
}

/// The error message of parsing a text or of building its system and engine.
fn refusal(text: &str) -> String {
    let error = load(text).and_then(|scene| {
        let system = scene.system()?;
        scene.newton(system).map(|_| ())
    });
    error.expect_err("it was accepted").to_string()
}

#[test]
fn a_scene_file_gives_its_system() {
    let loaded = load(DROP).unwrap();
    assert_eq!(loaded.scene.detector.name(), DetectorMode::Exact);
    assert_eq!(loaded.scene.gravity, [0.0, 0.0, -9.81]);
    let system = loaded.system().unwrap();
    assert_eq!(system.bodies()[0].mass, Mass::Fixed);
    let Mass::Free(mass) = system.bodies()[1].mass else { panic!("the brick is fixed") };
    assert!((mass.mass - 0.5).abs() < 1e-15);
    assert_eq!(system.states()[1].pose.translation, DVec3::new(0.0, 0.0, 0.031));
}

#[test]
fn copies_are_placed_by_the_one_before() {
    let chain = r#"
time_step = 1e-3
duration = 0.05

[[bodies]]
name = "link"
shape = { sphere = { radius = 0.01 } }
mass = 0.1
translation = [0, 0, 1]
rotation = [0, 0.707106781186548, 0, 0.707106781186548]
# Along its own x, which is -z of the world, and a quarter turn about it.
copies = { count = 5, translation = [0.5, 0, 0], rotation = [0.707106781186548, 0, 0, 0.707106781186548] }

[[joints]]
name = "first"
kind = "weld"
child = "link0"
"#;
    let loaded = load(chain).unwrap();
    let system = loaded.system().unwrap();
    let names: Vec<&str> = system.bodies().iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["link0", "link1", "link2", "link3", "link4"]);
    for (k, state) in system.states().iter().enumerate() {
        let below = DVec3::new(0.0, 0.0, 1.0 - 0.5 * k as f64);
        assert!(
            state.pose.translation.abs_diff_eq(below, 1e-14),
            "copy {k} is at {}",
            state.pose.translation
        );
        assert!((state.pose.rotation.length() - 1.0).abs() < 1e-15);
        let across = state.pose.rotation * DVec3::Y;
        let expected = [DVec3::Y, DVec3::X, DVec3::NEG_Y, DVec3::NEG_X, DVec3::Y][k];
        assert!(across.abs_diff_eq(expected, 1e-13), "copy {k} has y along {across}");
    }
    // A run keeps the scene with all its bodies.
    let json = serde_json::to_value(&loaded.scene).unwrap();
    assert_eq!(LoadedScene::of_json(json, "chain.toml").unwrap().scene.bodies.len(), 5);
    let too_many = refusal(&chain.replace("count = 5", "count = 65537"));
    assert!(too_many.contains("line 5, body link: copies.count is 65537; expected 1 to 65536"), "{too_many}");
    let none = refusal(&chain.replace("count = 5", "count = 0"));
    assert!(none.contains("copies.count is 0"), "{none}");
    let turned = refusal(&chain.replace("rotation = [0.707106781186548, 0, 0,", "rotation = [1, 0, 0,"));
    assert!(turned.contains("body link: copies: "), "{turned}");
}

#[test]
fn errors_name_the_line_and_the_body() {
    let change = |from: &str, to: &str| {
        assert!(DROP.contains(from));
        refusal(&DROP.replacen(from, to, 1))
    };
    let cases = [
        (change("duration", "durations"), vec!["line 3", "durations", "expected"]),
        (change("mass = 0.5", "mass = \"0.5\""), vec!["line 16", "mass", "expected"]),
        (change("mass = 0.5", ""), vec!["line 13", "brick", "neither density nor mass"]),
        (change("mass = 0.5", "mass = 0.5\ndensity = 1"), vec!["line 13", "brick", "keep one"]),
        (change("mass = 0.5", "mass = -1"), vec!["brick", "mass -1", "greater than 0"]),
        (change("fixed = true", "density = 1"), vec!["line 8", "floor", "plane has no finite mass"]),
        (change("\"brick\"", "\"floor\""), vec!["line 13", "used twice"]),
        (change("shape = \"plane\"\n", ""), vec!["line 8", "floor", "no geometry"]),
        (change("shape = \"plane\"", "mesh = \"none.obj\""), vec!["line 8", "none.obj"]),
        (change("shape = \"plane\"", "asset = \"none.tesdf\""), vec!["line 8", "none.tesdf"]),
        (change("shape = \"plane\"", "shape = \"plain\""), vec!["line 10", "plain"]),
        (change("0.02, 0.03", "-0.02, 0.03"), vec!["line 13", "brick", "numbers from 1e-50 to 1e50"]),
        (change("[0, 0, 0.031]", "[0, 0, nan]"), vec!["line 13", "brick", "finite"]),
        (change("mass = 0.5", "mass = 0.5\nrotation = [0, 0, 0, 2]"), vec!["brick", "length 1"]),
        (change("time_step = 1e-3", "time_step = 0"), vec!["time_step", "above 0"]),
        (change("[record]", "[solver]\nredetections = 9\n[record]"), vec!["solver", "redetections"]),
        (
            change("[record]", "[[exclude]]\nbodies = [\"brick\", \"floors\"]\n[record]"),
            vec!["exclude", "number 1", "no body floors", "floor, brick"],
        ),
        (
            change("[record]", "[[exclude]]\nbodies = [\"brick\", \"brick\"]\n[record]"),
            vec!["exclude", "both bodies are brick"],
        ),
        (change("mass = 0.5", "mass = 0.5\nangular_damping = -1"), vec!["brick", "angular_damping", "-1"]),
        (change("[record]", "[detector]\ntolerance = 0\n[record]"), vec!["detector", "tolerance"]),
        (change("[record]", "[detector]\nmode = \"vertex\"\n[record]"), vec!["line 6", "vertex"]),
        (change("[record]", "[detector]\ncontacts_per = \"body\"\n[record]"), vec!["line 6", "body"]),
        (
            change("[record]", "[detector]\nmode = \"node\"\ncontacts_per = \"cell\"\n[record]"),
            vec!["line 5", "contacts_per has no effect in the mode `node`, only in `face` and `exact`"],
        ),
        (
            change("[record]", "[detector]\niterations = 32\n[record]"),
            vec!["line 5", "iterations has no effect in the mode `exact`, only in `face`"],
        ),
        (
            change("[record]", "[detector]\nmode = \"off\"\ncos_theta = 0.5\n[record]"),
            vec!["line 5", "cos_theta has no effect in the mode `off`"],
        ),
        (
            refusal(
                &(DROP.to_string()
                    + "[criterion.screw]\nbody = \"nut\"\naxis = [0,0,1]\npitch = 1\nmin_turns = 1\nbacklash = 1"),
            ),
            vec!["no body nut", "floor, brick"],
        ),
        (
            refusal(&(DROP.to_string() + "[criterion.rest]\nmax_drift = -1\nmax_energy_gain = 0")),
            vec!["line 18", "criterion.rest", "max_drift is -1", "0 or greater"],
        ),
        (
            refusal(&(DROP.to_string() + "[criterion.rest]\nmax_drift = \"low\"\nmax_energy_gain = 0")),
            vec!["line 19", "max_drift = \"low\"", "expected f64"],
        ),
        (
            refusal(&(DROP.to_string() + "[criterion.rest]\nmax_drift = 1")),
            vec!["line 18", "missing field `max_energy_gain`"],
        ),
        (
            refusal(&(DROP.to_string() + "[criterion.stay]\nmax_drift = 1")),
            vec![
                "line 18",
                "criterion: there is no criterion stay; expected one of gear_ratio, insertion, lift",
            ],
        ),
        (refusal(&DROP.replacen("duration", "criterion = 3\nduration", 1)), vec!["line 3", "expected a map"]),
    ];
    for (k, (text, expected)) in cases.into_iter().enumerate() {
        assert!(text.starts_with("drop.toml"), "case {k}: {text}");
        for part in expected {
            assert!(text.contains(part), "case {k}: no {part:?} in {text}");
        }
    }
}

/// Mass properties that the scene gives, and those of the geometry where it does not.
#[test]
fn mass_properties_are_given_by_hand() {
    let mass = |keys: &str| {
        let text = DROP.replacen("mass = 0.5", &format!("mass = 0.5\n{keys}"), 1);
        let system = load(&text).unwrap().system().unwrap();
        let Mass::Free(mass) = system.bodies()[1].mass else { panic!("the brick is fixed") };
        mass
    };
    let of_geometry = mass("");
    let center = mass("center_of_mass = [0.001, 0, -0.002]");
    assert_eq!(center.center, DVec3::new(0.001, 0.0, -0.002));
    assert_eq!(center.inertia, of_geometry.inertia);
    let inertia = mass("inertia = [3e-4, 4e-4, 5e-4, 1e-5, 2e-5, 3e-5]").inertia;
    let rows = [[3e-4, 1e-5, 2e-5], [1e-5, 4e-4, 3e-5], [2e-5, 3e-5, 5e-4]];
    assert_eq!(inertia.to_cols_array_2d(), rows);
    for (keys, expected) in [
        ("inertia = [1e-4, 1e-4, 3e-4, 0, 0, 0]", "sum of the others"),
        ("inertia = [1e-4, -1e-4, 1e-4, 0, 0, 0]", "greater than 0"),
        ("inertia = [1e-4, nan, 1e-4, 0, 0, 0]", "finite"),
        ("center_of_mass = [0, inf, 0]", "finite"),
    ] {
        let text = refusal(&DROP.replacen("mass = 0.5", &format!("mass = 0.5\n{keys}"), 1));
        assert!(text.contains("brick") && text.contains(expected), "{text}");
    }
    let of_density = refusal(&DROP.replacen("mass = 0.5", "density = 1\ncenter_of_mass = [0, 0, 0]", 1));
    assert!(of_density.contains("a free body with a mass"), "{of_density}");
}

#[test]
fn excluded_bodies_pass_through_each_other() {
    let falls = |text: &str| {
        let loaded = load(text).unwrap();
        let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
        for _ in 0..100 {
            engine.step(1e-3).unwrap();
        }
        engine.system().states()[1].pose.translation.z
    };
    let stands = falls(DROP);
    assert!((stands - 0.03).abs() < 1e-5, "the brick is at {stands}");
    let fallen = falls(&format!("{DROP}\n[[exclude]]\nbodies = [\"brick\", \"floor\"]\n"));
    assert!(fallen < -0.015, "the brick is at {fallen}");
    // Groups: the floor is in 1, and the brick meets 2, or both.
    let in_groups = |filter: u32| {
        let floor = DROP.replacen("fixed = true", "fixed = true\nmemberships = 1", 1);
        falls(&floor.replacen("mass = 0.5", &format!("mass = 0.5\nfilter = {filter}"), 1))
    };
    assert_eq!(in_groups(2), fallen);
    assert_eq!(in_groups(3), stands);
}

#[test]
fn coarse_contacts_need_a_free_body() {
    // Two bricks across each other: they touch between their vertices.
    let brick = |name: &str, half_extents: &str, place: &str| {
        format!(
            "[[bodies]]\nname = \"{name}\"\nshape = {{ box = {{ half_extents = {half_extents} }} }}\n{place}\n"
        )
    };
    let below = brick("below", "[0.1, 0.01, 0.01]", "fixed = true");
    let scene = |above: &str| {
        let above = brick("above", "[0.01, 0.1, 0.01]", &format!("{above}\ntranslation = [0, 0, 0.02]"));
        let head = "time_step = 1e-3\nduration = 0.01\n[detector]\nmode = \"node\"\n";
        let loaded = load(&format!("{head}{below}{above}")).unwrap();
        let system = loaded.system().unwrap();
        loaded.coarse_contacts(&system).unwrap().len()
    };
    assert!(scene("mass = 1") > 0);
    assert_eq!(scene("fixed = true"), 0);
}

#[test]
fn a_run_round_trips_through_its_file() {
    let run = || {
        let loaded = load(DROP).unwrap();
        let system = loaded.system().unwrap();
        let mut engine = loaded.newton(system).unwrap();
        simulate(&loaded.scene, &mut engine, |_| ControlFlow::Continue(())).unwrap()
    };
    let (record, summary) = run();
    assert_eq!((summary.steps, summary.passed), (50, None));
    assert!(summary.mean_contacts > 1.0 && summary.kinetic_energy <= summary.released_energy);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.safetensors");
    record.save(&file).unwrap();
    let read = RunRecord::open(&file).unwrap();
    assert_eq!(read, record);
    assert_eq!(read.times().len(), 51);
    assert_eq!(read.pose(0, 1).unwrap().translation, DVec3::new(0.0, 0.0, 0.031));
    assert!(read.velocity(3, 1).unwrap()[0].z < 0.0);
    assert_eq!((read.pose(51, 0), read.pose(0, 2)), (None, None));
    let steps: Vec<u64> = read.contacts().map(|(step, _)| step).collect();
    assert_eq!(steps, (0..50).step_by(2).collect::<Vec<_>>());
    let last = read.contacts().last().unwrap().1;
    assert!(!last.is_empty() && last.iter().all(|c| c.normal[2].abs() > 0.999));
    assert_eq!(read.scene["bodies"][1]["name"], "brick");
    assert_eq!(run().0.to_bytes().unwrap(), record.to_bytes().unwrap(), "same scene, other bytes");
}

#[test]
fn files_that_are_no_runs_are_refused() {
    let bytes = RunRecord::new(&tesdf_sim::System::new(DVec3::ZERO), "scene".into()).to_bytes().unwrap();
    assert!(RunRecord::from_bytes(&bytes).is_ok());
    for end in 0..bytes.len() {
        assert!(RunRecord::from_bytes(&bytes[..end]).is_err(), "{end} of {} bytes", bytes.len());
    }
    let key = br#"\"version\":"#;
    let at = bytes.windows(key.len()).position(|w| w == key).unwrap() + key.len();
    let mut newer = bytes.clone();
    newer[at] = b'9';
    let refused = RunRecord::from_bytes(&newer);
    assert!(matches!(refused, Err(RecordError::Version { found: 9, .. })), "{refused:?}");
    assert!(matches!(RunRecord::open(Path::new("none")), Err(RecordError::Read { .. })));
}

#[test]
fn runs_whose_steps_of_contacts_do_not_ascend_are_refused() {
    let system = tesdf_sim::System::new(DVec3::ZERO);
    for (steps, is_run) in [(&[][..], true), (&[0, 3], true), (&[3, 3], false), (&[3, 0], false)] {
        let mut record = RunRecord::new(&system, "scene".into());
        steps.iter().for_each(|&step| record.push_contacts(step, &[], &system));
        let opened = RunRecord::from_bytes(&record.to_bytes().unwrap());
        assert_eq!(opened.is_ok(), is_run, "{steps:?}: {opened:?}");
    }
}

#[test]
fn a_run_can_be_stopped() {
    let loaded = load(DROP).unwrap();
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let stop = |m: &tesdf_sim::Moment<'_>| match m.step {
        3 => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    };
    let ended = simulate(&loaded.scene, &mut engine, stop);
    assert!(matches!(ended, Err(SimulateError::Interrupted { steps: 3 })));
}

#[test]
fn the_size_of_a_scene_is_bounded() {
    let change = |from: &str, to: &str| refusal(&DROP.replacen(from, to, 1));
    for (error, expected) in [
        (
            change("time_step = 1e-3", "time_step = 1e-318"),
            "drop.toml, line 3: duration: 0.05 s in steps of 1e-318 s; expected at most 100000000 steps",
        ),
        (
            change("duration = 0.05", "duration = 1e305"),
            "line 3: duration: 1e305 s in steps of 0.001 s; expected",
        ),
        (
            change("duration = 0.05", "duration = 9e4"),
            "line 3: duration: 90000000 steps of 2 bodies make a run of 18720000208 bytes; expected at most 17179869184",
        ),
        (
            change("[record]", "[solver]\nredetections = 1000000000\n[record]"),
            "line 6: solver.redetections: 1000000000; expected 0 to 8",
        ),
        (
            change("[record]", "[detector]\nmode = \"face\"\niterations = 1000000000\n[record]"),
            "line 7: detector.iterations: 1000000000; expected at most 65536",
        ),
    ] {
        assert!(error.contains(expected), "no {expected:?} in {error}");
    }
    let bodies: String = (0..=MAX_BODIES)
        .map(|k| format!("[[bodies]]\nname = \"{k}\"\nshape = \"plane\"\nfixed = true\n"))
        .collect();
    let error = refusal(&format!("time_step = 1\nduration = 1\n{bodies}"));
    assert!(error.contains("bodies: 65537; expected at most 65536"), "{error}");
    let error = refusal(&" ".repeat(66_000_000));
    assert!(error.contains("66000000 bytes; expected a scene of at most 65536000"), "{error}");
}

/// A scene whose bodies use one mesh, and assets of that mesh with different units.
fn cubes(bodies: &str) -> (tempfile::TempDir, LoadedScene) {
    let folder = tempfile::tempdir().unwrap();
    let mesh = cuboid(DVec3::ZERO, DVec3::ONE);
    let solid = SolidMesh::new(mesh.clone()).unwrap();
    write(folder.path().join("cube.ply"), &mesh).unwrap();
    for (name, unit) in [("mm", "mm"), ("inch", "inches"), ("furlong", "furlong")] {
        let options = EncodeOptions { unit: Some(unit.into()), ..EncodeOptions::preset(Preset::Fast) };
        let asset = Encoder::new().options(options).encode(&solid).unwrap();
        asset.save(folder.path().join(name).with_extension("tesdf")).unwrap();
    }
    let text = format!("time_step = 1e-3\nduration = 1\n{bodies}");
    let loaded = LoadedScene::parse(text, folder.path().join("cubes.toml")).unwrap();
    (folder, loaded)
}

#[test]
fn a_mesh_is_repaired_if_the_body_says_so() {
    let body = |repair: &str| {
        format!("[[bodies]]\nname = \"a\"\nmesh = \"open.ply\"\n{repair}\ndensity = 1\nfixed = false\n")
    };
    let open = |text: &str| {
        let (folder, loaded) = cubes(text);
        let whole = tesdf::mesh::read(folder.path().join("cube.ply")).unwrap().mesh;
        // The cube without its last side.
        let faces = whole.faces()[..10].to_vec();
        let open = TriangleMesh::new(whole.vertices().to_vec(), faces).unwrap();
        write(folder.path().join("open.ply"), &open).unwrap();
        loaded.system()
    };
    let system = open(&body("repair = \"auto\"")).unwrap();
    let Mass::Free(mass) = system.bodies()[0].mass else { panic!("the body is fixed") };
    assert!((mass.mass - 1.0).abs() < 1e-12, "the volume is that of the whole cube: {}", mass.mass);
    for (repair, expected) in [
        ("", "The repair `auto` makes it encodable"),
        ("repair = \"never\"", "The repair `auto` makes it encodable"),
        ("repair = \"always\"", "repair = 'always'; expected 'auto' or 'never'"),
    ] {
        let error = open(&body(repair)).expect_err("it has a hole").to_string();
        assert!(error.contains(expected), "{error}");
    }
    let asset = body("repair = \"auto\"").replace("mesh = \"open.ply\"", "asset = \"mm.tesdf\"");
    let error = open(&asset).expect_err("it is encoded").to_string();
    assert!(error.contains("the asset is encoded already"), "{error}");
    for shape in ["\"plane\"", "{ box = { half_extents = [1, 1, 1] } }", "{ sphere = { radius = 1.0 } }"] {
        let simple = body("repair = \"auto\"").replace("mesh = \"open.ply\"", &format!("shape = {shape}"));
        let error = open(&simple).expect_err("it has no mesh").to_string();
        assert!(error.contains("a simple shape has no mesh to repair; remove repair"), "{error}");
    }
    // An asset that takes the place of a mesh needs no repair.
    let (_folder, mut loaded) = cubes(&body("repair = \"auto\""));
    assert!(loaded.replace_geometry("a", "mm.tesdf"));
    loaded.system().unwrap();
}

#[test]
fn a_mesh_of_a_thousand_bodies_is_loaded_once() {
    let bodies: String = (0..1000)
        .map(|k| {
            let way = ["", "./", "../"][k % 3];
            let way = if k % 3 == 2 { format!("{way}FOLDER/") } else { way.to_string() };
            format!("[[bodies]]\nname = \"{k}\"\nmesh = \"{way}cube.ply\"\ndensity = 1\n")
        })
        .collect();
    let (folder, mut loaded) = cubes(&bodies);
    let name = folder.path().file_name().unwrap().to_str().unwrap().to_string();
    for body in &mut loaded.scene.bodies {
        let mesh = body.get_mut().mesh.as_mut().unwrap();
        *mesh = mesh.to_str().unwrap().replace("FOLDER", &name).into();
    }
    let system = loaded.system().unwrap();
    let shape = |body: &tesdf_sim::Body| system.scene().instance(body.instance).unwrap().shape;
    assert_eq!(system.bodies().len(), 1000);
    assert!(system.bodies().iter().all(|body| shape(body) == shape(&system.bodies()[0])));
}

#[test]
fn an_asset_may_be_in_no_file() {
    let scene = |geometry: &str| {
        let bodies =
            ["one", "two"].map(|name| format!("[[bodies]]\nname = \"{name}\"\n{geometry}\nmass = 1\n"));
        let text = format!("time_step = 1e-3\nduration = 1\n{}", bodies.concat());
        LoadedScene::parse(text, "scene.toml").unwrap()
    };
    let solid = SolidMesh::new(cuboid(DVec3::ZERO, DVec3::ONE)).unwrap();
    let asset = Arc::new(Encoder::new().preset(Preset::Fast).encode(&solid).unwrap());
    let mut loaded = scene("asset = \"in memory\"");
    assert!(loaded.system().unwrap_err().to_string().contains("in memory"));
    loaded.memory.insert("in memory".into(), Arc::clone(&asset));
    let system = loaded.system().unwrap();
    let shapes: Vec<_> = system.scene().shapes().collect();
    assert!(matches!(&shapes[..], [(_, Shape::Mesh(shared))] if Arc::ptr_eq(shared, &asset)));
    let Mass::Free(mass) = system.bodies()[1].mass else { panic!() };
    assert!((mass.center - DVec3::splat(0.5)).length() < 1e-12);
}

#[test]
fn units_that_differ_need_scales_that_make_them_one() {
    let system = |assets: [(&str, f64); 2]| {
        let body = |(asset, scale)| {
            format!(
                "[[bodies]]\nname = \"{asset}\"\nasset = \"{asset}.tesdf\"\nscale = {scale:?}\ndensity = 1\n"
            )
        };
        let (_folder, loaded) = cubes(&assets.map(body).concat());
        loaded.system().map(|_| ()).map_err(|e| e.to_string())
    };
    for good in
        [[("mm", 1e-3), ("inch", 0.0254)], [("mm", 1.0), ("inch", 25.4)], [("mm", 1.0), ("furlong", 3.0)]]
    {
        assert_eq!(system(good), Ok(()));
    }
    let error = system([("mm", 1e-3), ("inch", 1e-3)]).unwrap_err();
    assert!(error.contains("line 8, body inch: "), "{error}");
    assert!(
        error.contains("0.0254 m")
            && error.contains("body mm is 0.001 m")
            && error.contains("scale = 0.0254"),
        "{error}"
    );
}

#[test]
fn a_mesh_is_encoded_with_the_rule_of_its_body() {
    let folder = tempfile::tempdir().unwrap();
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    std::fs::write(folder.path().join("plate.obj"), square).unwrap();
    let scene = |body: &str| {
        let text = format!(
            "time_step = 1e-3\nduration = 0.05\n[[bodies]]\nname = \"plate\"\nfixed = true\n{body}\n"
        );
        LoadedScene::parse(text, folder.path().join("scene.toml")).unwrap().system()
    };
    let system = scene("mesh = \"plate.obj\"\ninside = \"sheet\"\nthickness = 0.2").unwrap();
    let shape = system.scene().shapes().next().unwrap().1;
    assert!((shape.signed_distance(DVec3::new(0.5, 0.5, 1.0)) - 0.9).abs() < 1e-12);
    // It encloses nothing.
    let system = scene("mesh = \"plate.obj\"\ninside = \"generalized\"").unwrap();
    let shape = system.scene().shapes().next().unwrap().1;
    assert!((shape.signed_distance(DVec3::new(0.5, 0.5, 1.0)) - 1.0).abs() < 1e-12);

    for (body, says) in [
        ("mesh = \"plate.obj\"", "The rule `sheet`"),
        ("mesh = \"plate.obj\"\ninside = \"sheet\"", "needs its thickness"),
        ("mesh = \"plate.obj\"\ninside = \"all\"", "expected winding, nonzero, odd, generalized or sheet"),
        ("shape = \"plane\"\ninside = \"odd\"", "an asset has its own"),
    ] {
        let error = scene(body).unwrap_err().to_string();
        assert!(error.contains(says), "{body}: {error}");
    }
}

#[test]
fn a_scene_of_json_needs_a_list_of_bodies() {
    let told = |bodies: serde_json::Value| {
        let scene = serde_json::json!({ "time_step": 1e-3, "duration": 1, "bodies": bodies });
        LoadedScene::of_json(scene, "scene.json").map(|_| ()).unwrap_err().to_string()
    };
    for (bodies, found) in [
        ("null", "null"),
        ("true", "true or false"),
        ("3", "a number"),
        ("\"a\"", "a string"),
        ("{}", "an object"),
    ] {
        let told = told(bodies.parse().unwrap());
        assert!(told.contains(&format!("bodies: {found}; expected a list of bodies")), "{told}");
    }
    let told = told(serde_json::json!([{ "name": "a" }, { "name": 3 }]));
    assert!(told.contains("bodies: entry 1: ") && told.contains("scene.json"), "{told}");
    let none = serde_json::json!({ "time_step": 1e-3, "duration": 1 });
    let told = LoadedScene::of_json(none, "scene.json").map(|_| ()).unwrap_err().to_string();
    assert!(told.contains("bodies: missing; expected a list of bodies"), "{told}");
}
