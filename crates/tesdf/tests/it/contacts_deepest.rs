//! Detections that do not find all contacts of a pair, against all contacts: the deepest, which are
//! all contacts, sorted and cut; and contacts that are spread over the places that touch.

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

/// More than there are.
const ALL: u32 = 1 << 30;
const COUNTS: [u32; 4] = [1, 7, 64, ALL];

/// All modes, with and without the cosine filter, up to a distance.
fn options(contact_distance: f64) -> Vec<CollideOptions> {
    let mut all = Vec::new();
    for cos_theta in [None, Some(0.5)] {
        let base = CollideOptions { contact_distance, cos_theta, ..CollideOptions::default() };
        all.push(CollideOptions { mode: Mode::Node, ..base });
        for mode in [Mode::Face, Mode::Exact] {
            for contacts_per in [ContactsPer::Cell, ContactsPer::Face] {
                all.push(CollideOptions { mode, contacts_per, ..base });
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

/// The contacts that must remain: those of each pair, sorted and cut.
fn cut(all: &[Contact], count: u32) -> Vec<Contact> {
    let mut kept: Vec<usize> = Vec::new();
    for mut of_pair in pairs(all).into_values() {
        of_pair.sort_by(|&i, &j| all[i].distance.total_cmp(&all[j].distance).then(i.cmp(&j)));
        kept.extend(of_pair.into_iter().take(count as usize));
    }
    kept.sort_unstable();
    kept.into_iter().map(|i| all[i]).collect()
}

/// Compares with all contacts; returns the numbers of all contacts, and of pairs with contacts that
/// were not found.
fn compare(scene: &Scene, options: &CollideOptions) -> (usize, usize) {
    let all = detect(scene, options);
    let mut unfound = 0;
    for count in COUNTS {
        let what = || format!("{:?} {:?}, {count}", options.mode, options.contacts_per);
        let reduction = Reduction::Deepest(count);
        let found = detect(scene, &CollideOptions { reduction, ..*options });
        let expected = cut(all.as_slice(), count);
        let distances = |contacts: &[Contact]| contacts.iter().map(|c| c.distance).collect::<Vec<_>>();
        assert_eq!(distances(found.as_slice()), distances(&expected), "{}", what());
        assert_eq!(found.as_slice(), expected, "{}", what());
        assert_eq!(found.hidden, all.hidden, "{}", what());
        let s = found.statistics;
        assert_eq!(s.touching - s.filtered - s.reduced, found.len(), "{s:?}");
        assert_eq!(s.unconverged, expected.iter().filter(|c| !c.converged).count());
        let (cut, reports) = reduce_pairs(all.as_slice().to_vec(), reduction);
        assert_eq!(cut, expected, "{}", what());
        assert_eq!((reports.len(), found.reductions.len()), (pairs(all.as_slice()).len(), reports.len()));
        for (report, of_all) in found.reductions.iter().zip(&reports) {
            let pair = (report.instance_a, report.instance_b);
            assert_eq!(pair, (of_all.instance_a, of_all.instance_b));
            let is_of_pair =
                |c: &&Contact| (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b)) == pair;
            let before: Vec<Contact> = all.iter().filter(is_of_pair).copied().collect();
            let kept: Vec<Contact> = expected.iter().filter(is_of_pair).copied().collect();
            assert_eq!((report.kept, of_all.kept), (kept.len(), kept.len()));
            assert!(report.contacts <= of_all.contacts && of_all.contacts == before.len());
            unfound += usize::from(report.contacts < before.len());
            for report in [report, of_all] {
                let error = wrench_error(&before, &kept, report.center, report.length);
                assert!(error <= report.wrench_error + 1e-7, "{}: {error} {report:?}", what());
                assert!(report.wrench_error <= 8f64.sqrt() + 1e-9, "{report:?}");
                let reach = report.length * (1.0 + 1e-9) + 1e-12;
                assert!(before.iter().all(|c| c.point_a.distance(report.center) <= reach), "{report:?}");
                let left_out = before.iter().filter(|c| !kept.contains(c));
                let least = left_out.map(|c| c.distance).fold(f64::INFINITY, f64::min);
                let above = report.left_out_above.unwrap_or(f64::INFINITY);
                assert!(above <= least, "{}: {least} {report:?}", what());
                assert_eq!(of_all.left_out_above.is_none(), kept.len() == before.len());
            }
            assert!((of_all.wrench_error == 0.0) || of_all.left_out_above.is_some());
        }
    }
    compare_spread(scene, options, &all);
    (all.len(), unfound)
}

/// Contacts that are spread are some of all contacts, and the report bounds the others.
fn compare_spread(scene: &Scene, options: &CollideOptions, all: &Contacts) {
    for count in [1, 7, 64] {
        let reduction = Reduction::Spread(count);
        let found = detect(scene, &CollideOptions { reduction, ..*options });
        let what = || format!("{:?} {:?}, {count}", options.mode, options.contacts_per);
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
            let error = wrench_error(&before, &kept, report.center, report.length);
            assert!(error <= report.wrench_error + 1e-7, "{}: {error} {report:?}", what());
        }
    }
}

#[test]
fn the_deepest_of_two_meshes_are_those_of_all() {
    let mut random = Random(5);
    let names = [["l_bracket", "cube"], ["torus_quads", "tetra"], ["beam", "l_bracket"], ["cube", "cube"]];
    let (mut contacts, mut unfound) = (0, 0);
    for names in names {
        for relation in RELATIONS {
            if relation == Relation::Same && names[0] != names[1] {
                continue;
            }
            let bodies = relation.place(names, &mut random);
            let scene = scene(&bodies);
            for options in options(1e-3 * bodies[0].diagonal()) {
                let (all, without) = compare(&scene, &options);
                (contacts, unfound) = (contacts + all, unfound + without);
            }
        }
    }
    assert!(contacts > 10_000 && unfound > 20, "{contacts} contacts, {unfound} pairs with contacts unfound");
}

#[test]
fn the_deepest_of_a_nut_and_its_bolt_are_those_of_all() {
    let at = |translation| Placement { pose: Pose::at(translation), scale: 1.0 };
    for shift in [DVec3::ZERO, DVec3::new(3e-5, 1e-5, 8e-5)] {
        let bodies =
            [Placed::new("iso_m16_bolt_6k", at(DVec3::ZERO)), Placed::new("iso_m16_nut_c100", at(shift))];
        let scene = scene(&bodies);
        for mode in [Mode::Node, Mode::Face, Mode::Exact] {
            let contacts_per = ContactsPer::Face;
            let of_mode = CollideOptions::with_mode(mode);
            let (all, _) =
                compare(&scene, &CollideOptions { contact_distance: 2e-4, contacts_per, ..of_mode });
            assert!(all > 1000, "{all}");
        }
    }
}

/// Simple shapes on each other, on a mesh and under it, at random and in a common pose.
#[test]
fn the_deepest_of_simple_shapes_are_those_of_all() {
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

/// Flush faces of equal squares: all contacts are equally deep, and order decides.
#[test]
fn equally_deep_contacts_are_kept_in_their_order() {
    let lower = block(DVec3::splat(-0.5), DVec3::splat(0.5), 12);
    for gap in [0.0, 0.01, -0.01] {
        let mut upper = lower.clone();
        upper.at.pose.translation.z = 1.0 + gap;
        let scene = scene(&[lower.clone(), upper]);
        for options in options(0.02) {
            let (all, unfound) = compare(&scene, &options);
            assert!(all > 200, "{all}");
            // Contacts within the bodies, or at sides, are not as deep.
            assert!(unfound <= 3, "{unfound}");
        }
    }
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
    for mode in [Mode::Node, Mode::Exact] {
        let contacts_per = ContactsPer::Face;
        let options =
            CollideOptions { contact_distance: 1e-3 * size, contacts_per, ..CollideOptions::with_mode(mode) };
        compare(&scene, &options);
        let options = CollideOptions { reduction: Reduction::Deepest(5), ..options };
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
    let reduction = Reduction::Deepest(4);
    let options = CollideOptions { reduction, ..CollideOptions::default() };
    for scene in [scene(&bodies), Scene::new()] {
        let found = detect(&scene, &options);
        assert!(found.is_empty() && found.reductions.is_empty());
    }
    assert_eq!(reduce_pairs(Vec::new(), reduction), (Vec::new(), Vec::new()));
    let none = CollideOptions { reduction: Reduction::Deepest(0), ..options };
    assert!(tesdf::collide::detect(&Scene::new(), &none).is_err());
    let none = CollideOptions { reduction: Reduction::Spread(0), ..options };
    assert!(tesdf::collide::detect(&Scene::new(), &none).is_err());
}

/// A ball that is deep in a finely meshed block: few of the faces that touch are looked at.
#[test]
fn few_contacts_of_a_deep_overlap_take_few_searches() {
    let ball = shapes::Shape::default().add_sphere(DVec3::ZERO, 5, || 1.0);
    let ball = Placed {
        body: std::sync::Arc::new(crate::support::bodies::Body::new(ball.solid())),
        at: Placement { pose: Pose::at(DVec3::new(0.1, 0.2, 2.2)), scale: 1.0 },
    };
    let scene = scene(&[block(DVec3::splat(-2.0), DVec3::splat(2.0), 24), ball]);
    for mode in [Mode::Node, Mode::Exact] {
        let options = CollideOptions { contacts_per: ContactsPer::Face, ..CollideOptions::with_mode(mode) };
        let all = detect(&scene, &options).statistics;
        let looks = [1, 8, 64].map(|count| {
            let reduction = Reduction::Deepest(count);
            detect(&scene, &CollideOptions { reduction, ..options }).statistics.polygons
        });
        assert!(looks.is_sorted() && 10 * looks[0] < all.polygons, "{mode:?}: {looks:?} of {all:?}");
        assert!(4 * looks[2] < all.polygons, "{mode:?}: {looks:?} of {all:?}");
    }
}

/// On a thread, where depths are nearly equal: the number of faces that are looked at follows the
/// number of contacts, and the contacts go around the thread.
#[test]
fn spread_contacts_take_searches_in_proportion_to_their_number() {
    let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
    let bodies = [Placed::new("iso_m16_bolt_6k", at), Placed::new("iso_m16_nut_c100", at)];
    let scene = scene(&bodies);
    for mode in [Mode::Node, Mode::Face, Mode::Exact] {
        let contacts_per = ContactsPer::Face;
        let base = CollideOptions { contact_distance: 2e-4, contacts_per, ..CollideOptions::with_mode(mode) };
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
