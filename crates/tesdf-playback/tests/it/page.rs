//! The page of a run: its numbers are read again as the page does.

use std::io::Read;
use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

use crate::support::run;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::read::ZlibDecoder;
use serde_json::Value;
use tesdf::collide::{CollideError, CollideOptions, ContactsPer, Mode, detect};
use tesdf::glam::{DVec3, Vec3};
use tesdf_playback::{Arrows, ContactOptions, FrameContacts, Frames, Playback, PlaybackError, page};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{RunRecord, System, simulate};

/// The description in a page, and its arrays, which are taken in their order.
struct Numbers {
    about: Value,
    bytes: Vec<u8>,
    at: usize,
}

impl Numbers {
    fn new(page: &str) -> Self {
        let part = |begin: &str| page.split(begin).nth(1).unwrap().split("</script>").next().unwrap();
        let about = serde_json::from_str(part(r#"id="run">"#)).unwrap();
        let deflated = BASE64_STANDARD.decode(part(r#"id="data">"#)).unwrap();
        let mut bytes = Vec::new();
        ZlibDecoder::new(&*deflated).read_to_end(&mut bytes).unwrap();
        Self { about, bytes, at: 0 }
    }

    fn words(&mut self, count: usize) -> Vec<u32> {
        let own = &self.bytes[self.at..self.at + 4 * count];
        self.at += 4 * count;
        let mut word = 0u32;
        let next = |k| {
            word = word.wrapping_add(u32::from_le_bytes([0, 1, 2, 3].map(|byte| own[byte * count + k])));
            word
        };
        (0..count).map(next).collect()
    }

    fn floats(&mut self, count: usize) -> Vec<f32> {
        self.words(count).into_iter().map(f32::from_bits).collect()
    }
}

const SCENE: &str = r#"
time_step = 2e-3
duration = 0.03

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "wall"
shape = { box = { half_extents = [0.01, 0.05, 0.05] } }
fixed = true
translation = [-0.05, 0, 0.05]

[[bodies]]
name = "box"
shape = { box = { half_extents = [0.02, 0.02, 0.02] } }
density = 1000
translation = [0, 0, 0.0202]

[detector]
contact_distance = 1e-3

[record]
contacts_every = 3
forces_every = 4
"#;

fn simulated() -> (RunRecord, System, LoadedScene) {
    let loaded = LoadedScene::parse(SCENE.into(), "scene.toml").unwrap();
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let (record, _) = simulate(&loaded.scene, &mut engine, |_| ControlFlow::Continue(())).unwrap();
    (record, loaded.system().unwrap(), loaded)
}

fn contacts(playback: &Playback<'_>, system: &System, detection: CollideOptions) -> Vec<FrameContacts> {
    let options = ContactOptions { detection: Some(detection), most: 1000 };
    playback.contacts(system, &options, &AtomicBool::new(false), |_| {}).unwrap().unwrap()
}

#[test]
fn the_page_has_the_meshes_and_the_poses_of_the_run() {
    for shift in [DVec3::ZERO, DVec3::new(5e6, -7e6, 1e6)] {
        let (record, system) = run(shift);
        let playback = Playback::new(&record, &system, Frames::Every(2.try_into().unwrap())).unwrap();
        let text = page(&playback, Arrows::default(), "run").unwrap();
        let mut read = Numbers::new(&text);
        let frames = playback.steps.len();
        assert_eq!(read.about["steps"], serde_json::json!([0, 2, 4, 6, 8, 9]));
        for (mesh, about) in playback.meshes.iter().zip(read.about["meshes"].as_array().unwrap().clone()) {
            let vertices = about["vertices"].as_u64().unwrap() as usize;
            assert_eq!(read.floats(3 * vertices), mesh.positions.as_flattened());
            read.words(vertices);
            assert_eq!(read.words(about["corners"].as_u64().unwrap() as usize), mesh.indices);
        }
        for (body, name) in record.bodies.iter().enumerate() {
            assert_eq!(read.about["bodies"][body]["name"], **name);
            let track = read.floats(7 * frames);
            for (k, &step) in playback.steps.iter().enumerate().filter(|_| name != "floor") {
                let pose = record.pose(step, body).unwrap();
                let at = |c: usize| f64::from(track[c * frames + k]);
                let found = DVec3::new(at(0), at(1), at(2)) + playback.centre;
                assert!(found.distance(pose.translation) < 4e-7, "{name} {step}: {found}");
                let turn = [3, 4, 5, 6].map(at);
                let same: f64 = turn.iter().zip(pose.rotation.to_array()).map(|(a, b)| a * b).sum();
                assert!((same.abs() - 1.0).abs() < 1e-6, "{name} {step}: {turn:?}");
            }
        }
        assert_eq!(read.at, read.bytes.len());
    }
}

#[test]
fn recorded_contacts_and_those_detected_again_agree() {
    let (record, system, loaded) = simulated();
    let playback = Playback::new(&record, &system, Frames::default()).unwrap();
    let detection = loaded.detection(&system).unwrap();
    assert_eq!((detection.mode, detection.contact_distance), (Mode::exact().per(ContactsPer::Minimum), 1e-3));
    let found = contacts(&playback, &system, detection);
    // The same states without contacts.
    let mut empty = RunRecord::new(&system, record.scene.clone());
    let mut moved = system.clone();
    for step in 1..record.times().len() {
        moved.set_states(record.states(step).unwrap()).unwrap();
        empty.push(record.times()[step], &moved);
    }
    let bare = Playback::new(&empty, &system, Frames::default()).unwrap();
    assert!(!playback.has_recorded_contacts() && !bare.has_recorded_contacts());
    let third = Frames::Every(3.try_into().unwrap());
    let has_recorded = |run| Playback::new(run, &system, third).unwrap().has_recorded_contacts();
    assert!(has_recorded(&record) && !has_recorded(&empty));
    let again = contacts(&bare, &system, detection);
    assert_eq!(found.len(), playback.steps.len());
    assert!(found.iter().all(|frame| frame.found >= 4), "the box lies on four corners");
    for (k, (a, b)) in found.iter().zip(&again).enumerate() {
        assert_eq!((a.found, a.kept.len()), (b.found, b.found), "frame {k}");
        for (a, b) in a.kept.iter().zip(&b.kept) {
            assert!((a.distance - b.distance).abs() < 1e-9, "frame {k}: {a:?} {b:?}");
        }
        let ascending = a.kept.windows(2).all(|pair| pair[0].distance <= pair[1].distance);
        assert!(ascending, "the deepest first");
        // On the floor, below the box, up or down: the wall, which is fixed as the floor, has none.
        for contact in &a.kept {
            let at = contact.point.as_dvec3() + playback.centre;
            assert!(at.z.abs() < 1e-3 && at.x.abs() < 0.021, "{at}");
            assert!(contact.normal.z.abs() > 0.999, "{}", contact.normal);
        }
    }
    // Both are what a detection finds at these poses.
    let mut moved = system.clone();
    let scene = moved.scene_at(&record.states(4).unwrap()).unwrap();
    let detected = detect(scene, &detection).unwrap();
    let deepest = detected.iter().filter(|c| c.point_a.z.abs() < 1e-3 && c.point_a.x > -0.03);
    let deepest = deepest.map(|c| c.distance).reduce(f64::min).unwrap();
    assert_eq!(again[4].kept[0].distance, deepest);
}

#[test]
fn the_page_has_the_deepest_contacts() {
    let (record, system, loaded) = simulated();
    let playback = Playback::new(&record, &system, Frames::default()).unwrap();
    let options = ContactOptions { detection: loaded.detection(&system), most: 3 };
    let mut seen = 0;
    let found = playback.contacts(&system, &options, &AtomicBool::new(false), |done| seen = done);
    let found = found.unwrap().unwrap();
    assert_eq!(seen, playback.steps.len());
    let forces = playback.forces(2).unwrap();
    let arrows = Arrows { contacts: Some(&found), forces: Some(&forces) };
    let mut read = Numbers::new(&page(&playback, arrows, "run").unwrap());
    let meshes = read.about["meshes"].as_array().unwrap().clone();
    for about in meshes {
        let [vertices, corners] = ["vertices", "corners"].map(|key| about[key].as_u64().unwrap() as usize);
        read.words(3 * vertices);
        read.words(vertices);
        read.words(corners);
    }
    let frames = playback.steps.len();
    (0..record.bodies.len()).for_each(|_| drop(read.words(7 * frames)));
    let starts = read.words(frames + 1);
    assert!(starts.windows(2).all(|pair| pair[1] - pair[0] == 3));
    let counts = read.words(frames);
    assert!(counts.iter().zip(&found).all(|(&count, frame)| count as usize == frame.found && count >= 4));
    let deepest = read.floats(frames);
    let points = read.floats(9 * frames);
    read.words(3 * frames);
    let distances = read.floats(3 * frames);
    for (k, frame) in found.iter().enumerate() {
        assert_eq!(deepest[k], frame.kept[0].distance as f32);
        for (i, contact) in frame.kept.iter().enumerate() {
            assert_eq!(Vec3::from_slice(&points[9 * k + 3 * i..]), contact.point);
            assert_eq!(distances[3 * k + i], contact.distance as f32);
        }
    }
    let starts = read.words(frames + 1);
    let counts = read.words(frames);
    let total = starts[frames] as usize;
    let [points, vectors] = [(); 2].map(|()| read.floats(3 * total));
    let mut weight = 0.0;
    for (k, frame) in forces.iter().enumerate() {
        assert_eq!(frame.step, Some(4 * (playback.steps[k] as u64 / 4)));
        assert_eq!(read.about["forces"]["steps"][k], frame.step.unwrap());
        assert_eq!((counts[k] as usize, starts[k + 1] - starts[k]), (frame.found, frame.kept.len() as u32));
        assert!(frame.kept.len() == frame.found.min(2));
        for (i, drawn) in frame.kept.iter().enumerate() {
            let at = 3 * (starts[k] as usize + i);
            assert_eq!(
                [Vec3::from_slice(&points[at..]), Vec3::from_slice(&vectors[at..])],
                [drawn.point, drawn.force]
            );
            assert!(drawn.force.z > 0.0, "the floor pushes the box up: {}", drawn.force);
            weight = drawn.force.length().max(weight);
        }
    }
    assert_eq!(read.about["forces"]["greatest"], weight);
    assert_eq!(read.at, read.bytes.len());
    let least = found.iter().map(|frame| frame.kept[0].distance).fold(0.0, f64::min);
    assert_eq!(read.about["contacts"]["most_deep"], -least);
}

#[test]
fn a_run_without_recorded_forces_has_none() {
    let (record, system) = run(DVec3::ZERO);
    assert_eq!(Playback::new(&record, &system, Frames::default()).unwrap().forces(9), None);
}

#[test]
fn a_scene_without_detection_has_no_contacts_and_a_search_can_be_stopped() {
    let (record, system, mut loaded) = simulated();
    let playback = Playback::new(&record, &system, Frames::default()).unwrap();
    let stop = AtomicBool::new(true);
    let options = ContactOptions { detection: loaded.detection(&system), most: 3 };
    let error = playback.contacts(&system, &options, &stop, |_| {}).unwrap_err();
    assert!(matches!(error, PlaybackError::Collide(CollideError::Stopped)), "{error}");
    loaded.scene.detector.choose(DetectorMode::Off);
    let options = ContactOptions { detection: loaded.detection(&system), most: 3 };
    assert_eq!(options.detection, None);
    assert_eq!(playback.contacts(&system, &options, &stop, |_| {}).unwrap(), None);
}
