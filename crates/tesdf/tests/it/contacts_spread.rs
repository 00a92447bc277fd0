//! Contacts that are spread over the places that touch, against all contacts of a pair.

use std::collections::BTreeMap;

use crate::support::bodies::{Placed, RELATIONS, Relation, rotation, scene};
use crate::support::per_face::block;
use crate::support::random::Random;
use crate::support::shapes;
use tesdf::collide::{
    CollideOptions, Contact, Contacts, ContactsPer, Instance, InstanceId, Mode, Placement, Pose, Reduction,
    Scene, Shape, reduce_pairs, wrench_error,
};
use tesdf::encode::{EncodeOptions, Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};

fn detect(scene: &Scene, options: &CollideOptions) -> Contacts {
    tesdf::collide::detect(scene, options).expect("a good scene")
}

/// All modes, with and without the cosine filter, up to a distance.
fn options(contact_distance: f64) -> Vec<CollideOptions> {
    let mut all = Vec::new();
    for cos_theta in [None, Some(0.5)] {
        let base = CollideOptions { contact_distance, ..CollideOptions::default() };
        all.push(CollideOptions { mode: Mode::Node, ..base });
        for mode in [Mode::face(), Mode::exact()] {
            for contacts_per in [ContactsPer::Cell, ContactsPer::Face] {
                let mode = cos_theta.map_or(mode, |cos| mode.filtered(cos)).per(contacts_per);
                all.push(CollideOptions { mode, ..base });
            }
        }
    }
    all
}

/// The pairs of instances, each with the indices of its contacts.
fn pairs(contacts: &[Contact]) -> BTreeMap<(InstanceId, InstanceId), Vec<usize>> {
    let mut pairs: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (i, c) in contacts.iter().enumerate() {
        pairs.entry((c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b))).or_default().push(i);
    }
    pairs
}

/// Contacts that are spread are some of all contacts, and the report bounds the others. Returns the
/// numbers of all contacts, and of pairs with contacts that were left out.
fn compare(scene: &Scene, options: &CollideOptions) -> (usize, usize) {
    let all = detect(scene, options);
    let mut left_out_of = 0;
    // The last is more than there are.
    for count in [1, 7, 64, 1 << 30] {
        let reduction = Reduction::Spread(count);
        let found = detect(scene, &CollideOptions { reduction, ..*options });
        let what = || format!("{:?}, {count}", options.mode);
        let s = found.statistics;
        assert_eq!(s.touching - s.filtered - s.reduced, found.len(), "{s:?}");
        assert_eq!(found.reductions.len(), pairs(found.as_slice()).len());
        for report in &found.reductions {
            let pair = (report.instance_a, report.instance_b);
            let is_of_pair =
                |c: &&Contact| (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b)) == pair;
            let before: Vec<Contact> = all.iter().filter(is_of_pair).copied().collect();
            let kept: Vec<Contact> = found.iter().filter(is_of_pair).copied().collect();
            assert!(kept.len() <= count as usize && kept.len() == report.kept, "{}", what());
            // At a vertex, all contacts may have that of another face.
            let is_same = |c: &Contact, d: &Contact| {
                c.instance_a == d.instance_a
                    && c.point_a == d.point_a
                    && (c.distance - d.distance).abs() < 1e-9
            };
            for c in &kept {
                assert!(before.iter().any(|d| is_same(c, d)), "{}: {c:?}", what());
            }
            let left_out = before.iter().filter(|c| !kept.iter().any(|k| is_same(k, c)));
            let least = left_out.map(|c| c.distance).fold(f64::INFINITY, f64::min);
            let above = report.left_out_above.unwrap_or(f64::INFINITY);
            assert!(above <= least, "{}: {least} {report:?}", what());
            left_out_of += usize::from(least < f64::INFINITY);
            let error = wrench_error(&before, &kept, report.center, report.length);
            assert!(error <= report.wrench_error + 1e-7, "{}: {error} {report:?}", what());
            assert!(report.wrench_error <= 8f64.sqrt() + 1e-9, "{report:?}");
            let reach = report.length * (1.0 + 1e-9) + 1e-12;
            assert!(kept.iter().all(|c| c.point_a.distance(report.center) <= reach), "{report:?}");
        }
    }
    (all.len(), left_out_of)
}

#[test]
fn the_spread_contacts_of_two_meshes_are_some_of_all() {
    let mut random = Random(5);
    let names = [["l_bracket", "cube"], ["torus_quads", "tetra"], ["beam", "l_bracket"], ["cube", "cube"]];
    let (mut contacts, mut left_out_of) = (0, 0);
    for names in names {
        for relation in RELATIONS {
            if relation == Relation::Same && names[0] != names[1] {
                continue;
            }
            let bodies = relation.place(names, &mut random);
            let scene = scene(&bodies);
            for options in options(1e-3 * bodies[0].diagonal()) {
                let (all, cut) = compare(&scene, &options);
                (contacts, left_out_of) = (contacts + all, left_out_of + cut);
            }
        }
    }
    assert!(contacts > 10_000 && left_out_of > 200, "{contacts} contacts, {left_out_of} pairs that were cut");
}

#[test]
fn the_spread_contacts_of_a_nut_and_its_bolt_are_some_of_all() {
    let at = |translation| Placement { pose: Pose::at(translation), scale: 1.0 };
    for shift in [DVec3::ZERO, DVec3::new(3e-5, 1e-5, 8e-5)] {
        let bodies =
            [Placed::new("iso_m16_bolt_6k", at(DVec3::ZERO)), Placed::new("iso_m16_nut_c100", at(shift))];
        let scene = scene(&bodies);
        for mode in [Mode::Node, Mode::face(), Mode::exact()] {
            let of_mode = CollideOptions::with_mode(mode);
            let (all, _) = compare(&scene, &CollideOptions { contact_distance: 2e-4, ..of_mode });
            assert!(all > 1000, "{all}");
        }
    }
}

/// Simple shapes on each other, on a mesh and under it, at random and in a common pose.
#[test]
fn the_spread_contacts_of_simple_shapes_are_some_of_all() {
    let mut random = Random(9);
    let simple = [
        Shape::Plane,
        Shape::Box { half_extents: DVec3::new(0.5, 0.4, 0.3) },
        Shape::Sphere { radius: 0.5 },
        Shape::Capsule { half_height: 0.4, radius: 0.3 },
        Shape::Mesh(block(DVec3::splat(-0.5), DVec3::splat(0.5), 5).body.asset.clone()),
    ];
    let mut contacts = 0;
    for (i, a) in simple.iter().enumerate() {
        for b in &simple[i..] {
            for turn in 0..3 {
                let mut scene = Scene::new();
                let mut add = |shape: &Shape, pose| {
                    let shape = scene.add_shape(shape.clone()).expect("a shape");
                    scene.add(Instance::new(shape, pose)).expect("a pose");
                };
                add(a, Pose::IDENTITY);
                let random = match turn {
                    0 => Pose::IDENTITY,
                    1 => Pose::at(DVec3::new(0.0, 0.0, 0.5)),
                    _ => Pose { translation: 0.4 * random.in_cube(), rotation: rotation(&mut random) },
                };
                add(b, random);
                for options in options(0.05) {
                    contacts += compare(&scene, &options).0;
                }
            }
        }
    }
    assert!(contacts > 1000, "{contacts}");
}

/// Inside of a body, lists that lack faces report depths that are too great.
#[test]
fn truncated_lists_hide_no_contact() {
    let encoded = |shape: shapes::Shape| {
        let options = EncodeOptions { max_entries: Some(8), ..EncodeOptions::preset(Preset::Fast) };
        Encoder::new().options(options).encode(&shape.solid()).expect("encodes")
    };
    let mut scene = Scene::new();
    let cube = shapes::Shape::default().add_box(DVec3::splat(-2.0), DVec3::splat(2.0), 6);
    let ball = shapes::Shape::default().add_sphere(DVec3::ZERO, 2, || 1.0);
    for (shape, at) in [(cube, DVec3::ZERO), (ball, DVec3::new(0.1, 0.2, 2.4))] {
        let shape = scene.add_shape(encoded(shape)).expect("a shape");
        scene.add(Instance::new(shape, Pose::at(at))).expect("a pose");
    }
    for options in options(0.02) {
        assert!(compare(&scene, &options).0 > 20);
    }
}

/// Several pairs, in scales and worlds of their own, on different numbers of threads.
#[test]
fn many_pairs_have_the_same_contacts_on_any_number_of_threads() {
    let mut random = Random(3);
    let mut scene = Scene::new();
    let asset = crate::support::bodies::body("torus_quads").asset.clone();
    let size = crate::support::bodies::body("torus_quads").diagonal();
    let (torus, floor) =
        (scene.add_shape(asset).expect("a shape"), scene.add_shape(Shape::Plane).expect("a plane"));
    for world in 0..2 {
        for _ in 0..6 {
            let pose = Pose { translation: 0.5 * size * random.in_cube(), rotation: rotation(&mut random) };
            let scale = random.between(0.5, 1.5);
            scene.add(Instance { scale, world, ..Instance::new(torus, pose) }).expect("a pose");
        }
        let rotation = DQuat::from_rotation_x(0.3);
        let pose = Pose { translation: DVec3::ZERO, rotation };
        scene.add(Instance { world, ..Instance::new(floor, pose) }).expect("a pose");
    }
    for mode in [Mode::Node, Mode::exact()] {
        let options = CollideOptions { contact_distance: 1e-3 * size, ..CollideOptions::with_mode(mode) };
        compare(&scene, &options);
        let options = CollideOptions { reduction: Reduction::Spread(5), ..options };
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| detect(&scene, &options))
        };
        let expected = on(1);
        assert!(expected.reductions.len() > 10);
        assert_eq!(on(3), expected);
    }
}

#[test]
fn a_scene_without_contacts_has_no_reports() {
    let mut random = Random(2);
    let bodies = Relation::Apart.place(["l_bracket", "cube"], &mut random);
    let reduction = Reduction::Spread(4);
    let options = CollideOptions { reduction, ..CollideOptions::default() };
    for scene in [scene(&bodies), Scene::new()] {
        let found = detect(&scene, &options);
        assert!(found.is_empty() && found.reductions.is_empty());
    }
    assert_eq!(reduce_pairs(Vec::new(), reduction), (Vec::new(), Vec::new()));
    let none = CollideOptions { reduction: Reduction::Spread(0), ..options };
    assert!(tesdf::collide::detect(&Scene::new(), &none).is_err());
}

/// On a thread, where depths are nearly equal: the number of faces that are looked at follows the
/// number of contacts, and the contacts go around the thread.
#[test]
fn spread_contacts_take_searches_in_proportion_to_their_number() {
    let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
    let bodies = [Placed::new("iso_m16_bolt_6k", at), Placed::new("iso_m16_nut_c100", at)];
    let scene = scene(&bodies);
    for mode in [Mode::Node, Mode::face(), Mode::exact()] {
        let base = CollideOptions { contact_distance: 2e-4, ..CollideOptions::with_mode(mode) };
        let all = detect(&scene, &base);
        for count in [1, 8, 64, 256] {
            let found = detect(&scene, &CollideOptions { reduction: Reduction::Spread(count), ..base });
            let s = found.statistics;
            // Four leaves of eight faces in each region, and two regions at least.
            assert!(s.candidates <= 32 * count.max(2) as usize, "{mode:?}, {count}: {s:?}");
            // A dive may end without a contact.
            assert!(found.len() <= count as usize && 4 * found.len() >= count as usize, "{s:?}");
            if count >= 64 {
                let sides = |contacts: &Contacts| {
                    let side = |c: &Contact| (c.point_a.x > 0.0, c.point_a.y > 0.0, c.normal.z > 0.0);
                    contacts.iter().map(side).collect::<std::collections::BTreeSet<_>>()
                };
                assert_eq!(sides(&found), sides(&all), "{mode:?}, {count}");
            }
        }
    }
}
