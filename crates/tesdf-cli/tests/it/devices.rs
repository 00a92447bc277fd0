//! `tesdf devices` and `--device`. These tests run on the software driver and fail
//! without a device.

use std::path::Path;

use crate::folder::Folder;
use serde_json::Value;
use tesdf_sim::RunRecord;

fn data(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/procedural").join(name).display().to_string()
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn devices_are_listed_and_chosen() {
    let folder = Folder::new();
    let devices = json(&folder.good(&["devices", "--json"]));
    let name = devices[0]["name"].as_str().expect("a device with a name");
    assert!(folder.good(&["devices"]).contains(name));
    let [a, b] = ["l_bracket.obj", "cube.obj"].map(|mesh| {
        let file = mesh.replace(".obj", ".tesdf");
        folder.good(&["encode", &data(mesh), "-o", &file, "--unit", "m", "--preset", "fast"]);
        file
    });
    let collide = |device: &str, mode: &str, per: &str| {
        let common = ["collide", &a, &b, "--mode", mode, "--contact-distance", "1e-3", "--json"];
        let per = if mode == "node" { vec![] } else { vec!["--contacts-per", per] };
        json(&folder.good(&[&common[..], &per, &["--device", device]].concat()))
    };
    // Each takes seconds to compile kernels.
    for (mode, per) in [("node", "vertex"), ("face", "cell"), ("exact", "face")] {
        let (host, device) = (collide("cpu", mode, per), collide("0", mode, per));
        let deepest = |contacts: &Value| {
            let all = contacts.as_array().expect("contacts").iter();
            all.map(|c| c["distance"].as_f64().expect("a distance")).fold(f64::INFINITY, f64::min)
        };
        assert!(deepest(&host) < 0.0 && (deepest(&host) - deepest(&device)).abs() < 1e-7, "{mode} per {per}");
    }
    let (code, _, err) = folder.tesdf(&["collide", &a, &b, "--device", "no such device"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("no device is named \"no such device\"") && err.contains(name), "{err}");
}

const DROP: &str = r#"
time_step = 2e-3
duration = 0.06

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "cube"
mesh = "CUBE"
density = 1000
translation = [0, 0, 0.0101]

[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.01 } }
density = 1000
translation = [0.001, 0, 0.031]

[detector]
mode = "face"
contacts_per = "face"
"#;

#[test]
fn a_run_on_a_device_agrees_with_the_processor() {
    let folder = Folder::new();
    folder.write("drop.toml", DROP.replace("CUBE", &data("cube.obj")));
    let run = |device: &str| {
        folder.good(&["simulate", "drop.toml", "-o", "run", "--device", device]);
        RunRecord::open(folder.path("run")).expect("a run")
    };
    let (host, device) = (run("cpu"), run("gpu"));
    let last = host.times().len() - 1;
    for body in [1, 2] {
        let [h, d] = [&host, &device].map(|r| r.pose(last, body).expect("a pose").translation);
        // The bodies have a size of 20 mm. No contact holds them sideways, and they stay in place.
        assert!(h.distance(d) < 1e-8, "body {body}: {d} instead of {h}");
    }
}
