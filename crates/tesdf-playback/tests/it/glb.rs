//! The GLB file of a run, read again with the crate `gltf`.

use crate::support::run;
use gltf::Gltf;
use gltf::animation::Property;
use gltf::animation::util::ReadOutputs;
use tesdf::collide::Pose;
use tesdf::glam::{DVec3, Quat, Vec3};
use tesdf_playback::{Frames, GlbOptions, Playback, glb};
use tesdf_sim::State;

/// The nodes of the bodies, by name, with what the file says of them at each of its times.
fn tracks(file: &Gltf, name: &str) -> (Vec<f32>, Vec<Vec3>, Vec<Quat>, f32) {
    let node = file.nodes().find(|node| node.name() == Some(name)).unwrap();
    let (translation, rotation, scale) = node.transform().decomposed();
    let (mut times, mut translations, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
    for channel in file.animations().flat_map(|animation| animation.channels()) {
        if channel.target().node().index() == node.index() {
            let reader = channel.reader(|_| file.blob.as_deref());
            times = reader.read_inputs().unwrap().collect();
            match reader.read_outputs().unwrap() {
                ReadOutputs::Translations(values) => {
                    assert_eq!(channel.target().property(), Property::Translation);
                    translations = values.map(Vec3::from_array).collect();
                }
                ReadOutputs::Rotations(values) => {
                    rotations = values.into_f32().map(Quat::from_array).collect();
                }
                _ => panic!("a channel of {:?}", channel.target().property()),
            }
        }
    }
    if translations.is_empty() {
        translations = vec![Vec3::from_array(translation); times.len().max(1)];
    }
    if rotations.is_empty() {
        rotations = vec![Quat::from_array(rotation); times.len().max(1)];
    }
    assert_eq!(scale[0], scale[1]);
    (times, translations, rotations, scale[0])
}

#[test]
fn a_reader_finds_the_poses_of_the_run() {
    // Once at the origin, and once so far away that 32-bit floats are 0.5 m apart.
    for shift in [DVec3::ZERO, DVec3::new(5e6, -7e6, 1e6)] {
        let (record, system) = run(shift);
        let playback = Playback::new(&record, &system, Frames::Every(2.try_into().unwrap())).unwrap();
        assert_eq!(playback.steps, [0, 2, 4, 6, 8, 9]);
        let bytes = glb(&playback, &GlbOptions { speed: 0.5 }).unwrap();
        let file = Gltf::from_slice(&bytes).unwrap();
        let root = file.nodes().find(|node| node.name() == Some("run")).unwrap();
        let (translation, rotation, _) = root.transform().decomposed();
        let upright = Quat::from_array(rotation).as_dquat();
        assert!((upright * DVec3::Z).distance(DVec3::Y) < 1e-6);
        // As a reader in 64 bits sees the decimals of the file.
        let centre = DVec3::from_array(translation.map(|x| x.to_string().parse().unwrap()));
        assert!(centre.distance(upright * playback.centre) < 1e-6 * centre.length());
        let names: Vec<_> = root.children().map(|node| node.name().unwrap().to_owned()).collect();
        assert_eq!(names, record.bodies);
        for (body, name) in names.iter().enumerate().filter(|(_, name)| *name != "floor") {
            let (times, translations, rotations, scale) = tracks(&file, name);
            if name == "still" {
                assert_eq!(times.len(), 0, "a body that rests has no channels");
            } else {
                let expected: Vec<f32> =
                    playback.steps.iter().map(|&k| (record.times()[k] * 2.0) as f32).collect();
                assert_eq!(times, expected, "half speed");
            }
            assert_eq!(scale, if name == "part" { 1e-3 } else { 1.0 });
            for (k, &step) in playback.steps.iter().enumerate().take(translations.len()) {
                let pose = record.pose(step, body).unwrap();
                // With y upwards, and without the rounding of the root's rotation.
                let DVec3 { x, y, z } = centre;
                let found = translations[k].as_dvec3() + DVec3::new(x, -z, y);
                assert!(found.distance(pose.translation) < 4e-7, "{name} {step}: {found}");
                let [found, expected] = [rotations[k].as_dquat(), pose.rotation];
                let apart = (found - expected).length().min((found + expected).length());
                assert!(apart < 1e-6, "{name} {step}: {apart}");
                if let Some(next) = rotations.get(k + 1) {
                    assert!(rotations[k].dot(*next) >= 0.0, "the shorter way");
                }
            }
        }
    }
}

#[test]
fn bodies_share_meshes_and_keep_their_shapes() {
    let (record, system) = run(DVec3::ZERO);
    let playback = Playback::new(&record, &system, Frames::default()).unwrap();
    let bytes = glb(&playback, &GlbOptions::default()).unwrap();
    let file = Gltf::from_slice(&bytes).unwrap();
    let primitive = |name: &str| {
        let node = file.nodes().find(|node| node.name() == Some(name)).unwrap();
        node.mesh().unwrap().primitives().next().unwrap()
    };
    let positions = |name: &str| primitive(name).get(&gltf::Semantic::Positions).unwrap();
    assert_eq!(positions("part").index(), positions("twin").index(), "one copy of the vertices");
    assert_ne!(positions("part").index(), positions("still").index());
    assert_ne!(primitive("part").material().index(), primitive("twin").material().index());

    // The corners of the faces are those of the asset, and each normal is that of its face: a cube
    // has no smooth edges.
    let part = primitive("part");
    let reader = part.reader(|_| file.blob.as_deref());
    let at: Vec<Vec3> = reader.read_positions().unwrap().map(Vec3::from_array).collect();
    let normals: Vec<Vec3> = reader.read_normals().unwrap().map(Vec3::from_array).collect();
    let faces: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
    assert_eq!((at.len(), faces.len()), (24, 36));
    let mut volume = 0.0;
    for face in faces.chunks(3) {
        let [a, b, c] = [0, 1, 2].map(|k| at[face[k] as usize]);
        volume += a.dot(b.cross(c)) / 6.0;
        let normal = (b - a).cross(c - a).normalize();
        assert!(face.iter().all(|&i| normals[i as usize].distance(normal) < 1e-6));
    }
    assert!((volume / 8e-6 - 1.0).abs() < 1e-5, "{volume}");
    let limits = positions("part");
    assert_eq!(limits.min().unwrap(), serde_json::json!(vec![-0.01f32; 3]));

    // The floor is below all bodies, and its squares have two colours.
    let node = file.nodes().find(|node| node.name() == Some("floor")).unwrap();
    assert_eq!(node.mesh().unwrap().primitives().count(), 2);
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let made = || {
        let (record, system) = run(DVec3::ONE);
        let playback = Playback::new(&record, &system, Frames::default()).unwrap();
        glb(&playback, &GlbOptions::default()).unwrap()
    };
    assert!(made() == made());
}

#[test]
fn a_run_at_rest_and_a_run_of_one_state_have_no_animation() {
    let (record, system) = crate::support::at_rest(1);
    for record in [&record, &crate::support::at_rest(4).0] {
        let playback = Playback::new(record, &system, Frames::default()).unwrap();
        let bytes = glb(&playback, &GlbOptions::default()).unwrap();
        assert_eq!(Gltf::from_slice(&bytes).unwrap().animations().count(), 0);
    }
}

#[test]
fn what_cannot_be_played_is_an_error() {
    let (record, system) = run(DVec3::ZERO);
    let message = |error: &dyn std::fmt::Display| error.to_string();
    let playback = Playback::new(&record, &system, Frames::default()).unwrap();
    for speed in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = glb(&playback, &GlbOptions { speed }).unwrap_err();
        assert!(message(&error).starts_with("speed is "), "{error}");
    }
    let (other, _) = crate::support::at_rest(2);
    let error = Playback::new(&other, &system, Frames::default()).unwrap_err();
    assert!(message(&error).contains("1 bodies, the scene 5"), "{error}");
    let (mut far, mut system) = run(DVec3::ZERO);
    let state = State::at_rest(Pose::at(DVec3::new(2e30, 0.0, 0.0)));
    system.set_state(1, state).unwrap();
    far.push(0.1, &system);
    let error = Playback::new(&far, &system, Frames::default()).unwrap_err();
    assert!(message(&error).contains("body part after 10 steps"), "{error}");
}
