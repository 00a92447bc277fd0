//! Contacts per face on the device: what holds on the processor holds here, within `f32`.

use crate::compare::{ROUNDING, device, found};
use crate::on_device::{are_equal, read, worlds};
use crate::support::bodies::{Placed, RELATIONS, Relation, scene};
use crate::support::per_face::{Detection, Kept};
use crate::support::random::Random;
use tesdf::collide::{
    CollideOptions, Contacts, ContactsPer, Mode, Placement, Pose, Reduction, Scene, detect,
};
use tesdf_gpu::{Counting, Detector, DetectorOptions, DeviceArray, PoseArrays};

fn on_device(scene: &Scene, options: &CollideOptions) -> Contacts {
    found(scene, options, DetectorOptions::default()).0
}

/// Twice the rounding, and the finest tolerance of the exact mode on a device.
const DEVICE: Detection = Detection {
    detect: &on_device,
    distance: 3.0 * ROUNDING,
    point: ROUNDING,
    level: 3.0 * ROUNDING * 0.1,
    cosine: 1e-3,
};

#[test]
fn each_face_keeps_its_least_distance() {
    let mut random = Random(11);
    let names = [["cube", "cube"], ["l_bracket", "cube"], ["torus_quads", "tetra"], ["beam", "l_bracket"]];
    let mut all = Kept::default();
    for names in names {
        for relation in RELATIONS {
            if relation == Relation::Same && names[0] != names[1] {
                continue;
            }
            let bodies = relation.place(names, &mut random);
            let kept = DEVICE.keeps_least_distances(&bodies, 1e-3 * bodies[0].diagonal());
            all.faces += kept.faces;
            all.unconverged += kept.unconverged;
        }
    }
    assert!(all.faces > 2000 && all.unconverged * 200 < all.faces, "{all:?}");
}

#[test]
fn each_face_of_bolt_and_nut_keeps_its_least_distance() {
    let identity = Placement { pose: Pose::IDENTITY, scale: 1.0 };
    let bodies = ["iso_m16_bolt_6k", "iso_m16_nut_c100"].map(|name| Placed::new(name, identity));
    let kept = DEVICE.keeps_least_distances(&bodies, 2e-4);
    assert!(kept.faces > 3000, "{kept:?}");
}

#[test]
fn minima_are_followed_by_no_lower_point() {
    let mut random = Random(23);
    let names = [["l_bracket", "cube"], ["torus_quads", "tetra"], ["beam", "l_bracket"]];
    let mut all = [0, 0];
    for names in names {
        for relation in RELATIONS.into_iter().filter(|&relation| relation != Relation::Same) {
            let bodies = relation.place(names, &mut random);
            let contact_distance = 1e-3 * bodies[0].diagonal();
            let counts =
                DEVICE.minima_are_followed_by_no_lower_point(&bodies, contact_distance, Mode::exact());
            all = [all[0] + counts[0], all[1] + counts[1]];
        }
    }
    assert!(all[0] > 250 && all[1] > 250, "{all:?}");
}

#[test]
fn a_border_ahead_of_a_peg_is_no_minimum() {
    DEVICE.border_ahead_of_a_peg_is_no_minimum();
}

#[test]
fn the_sides_of_a_bend_are_walls() {
    DEVICE.sides_of_a_bend_are_walls();
}

#[test]
fn a_box_stands_on_the_corners_of_the_patch() {
    for per in [ContactsPer::Face, ContactsPer::Minimum] {
        assert_eq!(DEVICE.box_stands_on_the_corners_of_the_patch(per), 0, "all searches converge");
    }
}

#[test]
fn a_box_stands_on_a_plane_and_on_four_pegs() {
    for per in [ContactsPer::Face, ContactsPer::Minimum] {
        DEVICE.box_stands_on_a_plane_and_on_four_pegs(per);
    }
}

#[test]
fn a_vertex_of_several_faces_has_one_contact() {
    DEVICE.vertex_of_several_faces_has_one_contact(&[Mode::exact()]);
}

/// Frank–Wolfe over whole faces has no kernel: the processor finds the same contacts as without a
/// device, also of poses on it, and they are left there.
#[test]
fn the_processor_steps_over_whole_faces() {
    let scene = worlds(2, &mut Random(31));
    let mut detector = Detector::new(&device(), &scene, DetectorOptions::default()).expect("fits");
    let device = detector.device().clone();
    let mut rounded = scene.clone();
    let mut poses: Vec<f32> = Vec::new();
    for (id, instance) in scene.instances() {
        let (translation, rotation) = (instance.pose.translation.as_vec3(), instance.pose.rotation.as_quat());
        poses.extend(translation.to_array().iter().chain(&rotation.to_array()));
        let pose = Pose { translation: translation.as_dvec3(), rotation: rotation.as_dquat().normalize() };
        rounded.set_poses(&[(id, pose)]).expect("a pose");
    }
    let poses = DeviceArray::upload(&device, &poses).expect("fits");
    let given = PoseArrays { poses: &poses, velocities: None };
    for contacts_per in [ContactsPer::Face, ContactsPer::Minimum] {
        for reduction in [Reduction::None, Reduction::PerPair(3), Reduction::Spread(3)] {
            let options = CollideOptions {
                contact_distance: 0.01,
                reduction,
                ..CollideOptions::with_mode(Mode::face().per(contacts_per))
            };
            let expected = detect(&scene, &options).expect("detects");
            let contacts = detector.detect(&scene, &options).expect("detects");
            assert!(!expected.is_empty() && contacts.as_slice() == expected.as_slice(), "{options:?}");
            let report = detector.report();
            assert!(report.launches == 0 && report.pairs_on_processor >= 4, "{report:?}");
            for (given, placed) in [(None, &scene), (Some(&given), &rounded)] {
                let expected = detect(placed, &options).expect("detects");
                let staying = detector.detect_on_device(&scene, given, &options).expect("detects");
                are_equal(&read(&device, &staying), expected.as_slice(), 2.0, 1e-5);
                assert_eq!(detector.report().launches, 0);
            }
        }
    }
}

/// A query of the mode `exact` looks at one point at least.
#[test]
fn work_is_counted_without_a_change_of_contacts() {
    let bodies = Relation::Deep.place(["torus_quads", "l_bracket"], &mut Random(5));
    let scene = scene(&bodies);
    for contacts_per in [ContactsPer::Cell, ContactsPer::Face] {
        let contact_distance = 1e-3 * bodies[0].diagonal();
        let options =
            CollideOptions { contact_distance, ..CollideOptions::with_mode(Mode::exact().per(contacts_per)) };
        let (plain, detector) = found(&scene, &options, DetectorOptions::default());
        let counts = detector.report().counts;
        assert_eq!((counts.evaluations, counts.distances), (0, 0));
        let counting = DetectorOptions { counting: Counting::Operations, ..DetectorOptions::default() };
        let (counted, detector) = found(&scene, &options, counting);
        let points =
            |contacts: &Contacts| contacts.iter().map(|c| (c.point_a, c.distance)).collect::<Vec<_>>();
        assert!(!plain.is_empty() && points(&plain) == points(&counted));
        let counts = detector.report().counts;
        assert!((counts.polygons..200 * counts.polygons).contains(&counts.evaluations), "{counts:?}");
        assert!((2 * counts.evaluations..100 * counts.evaluations).contains(&counts.distances), "{counts:?}");
    }
}
