//! Compares what a reduction keeps, and the loss that it reports, with distances computed one by
//! one.

use crate::support::random::Random;
use proptest::prelude::*;
use tesdf::collide::{
    Contact, FeatureB, FeatureId, InstanceId, PairReduction, Reduction, reduce_pairs, wrench_error,
};
use tesdf::glam::{DQuat, DVec3};

type Wrench = [f64; 6];
/// Gives a point and a normal.
type Place = dyn Fn(&mut Random) -> (DVec3, DVec3);

/// Rounding of sums of wrenches.
const ROUNDING: f64 = 1e-9;
/// Accepted error of the test's own solver.
const SOLVER: f64 = 1e-3;

fn contact(instances: [u32; 2], point: DVec3, normal: DVec3, distance: f64, face: u32) -> Contact {
    Contact {
        point_a: point,
        point_b: point - distance * normal,
        normal,
        distance,
        face_a: face,
        face_b: 0,
        tet_b: Some(0),
        instance_a: InstanceId(instances[0]),
        instance_b: InstanceId(instances[1]),
        feature: FeatureId { a: face, b: FeatureB::Face(0) },
        converged: true,
    }
}

/// Contacts between instances 2 and 5, with a random order of the pair.
fn patch(count: usize, seed: u64, mut place: impl FnMut(&mut Random) -> (DVec3, DVec3)) -> Vec<Contact> {
    let mut random = Random(seed);
    let mut contacts: Vec<Contact> = (0..count)
        .map(|face| {
            let (point, normal) = place(&mut random);
            let (instances, normal) =
                if random.bits() & 1 == 0 { ([2, 5], normal) } else { ([5, 2], -normal) };
            contact(instances, point, normal, -random.unit(), face as u32)
        })
        .collect();
    contacts.sort_by_key(|c| (c.instance_a, c.face_a));
    contacts
}

/// A point and a normal of a patch.
fn place(kind: u32, random: &mut Random) -> (DVec3, DVec3) {
    let p = random.in_cube();
    match kind {
        0 => (DVec3::new(p.x, 0.3 * p.y, 0.0), DVec3::Z),
        1 => {
            let (sin, cos) = (4.0 * p.x).sin_cos();
            (DVec3::new(cos, sin, p.y), DVec3::new(cos, sin, 0.4).normalize())
        }
        2 => {
            let axis = random.index(3);
            let mut at = p;
            at[axis] = -1.0;
            (at, DVec3::AXES[axis])
        }
        3 => (p, random.direction()),
        _ => ((2.0 * p).round(), (3.0 * random.in_cube()).round().try_normalize().unwrap_or(DVec3::X)),
    }
}

/// Typical patches: flat, around a shaft, in the corner of a box, random, and few places with many
/// contacts.
fn any_patch() -> impl Strategy<Value = Vec<Contact>> {
    patch_of(1..250)
}

/// Patches of so many contacts that only a few of them are candidates.
fn many_contacts() -> impl Strategy<Value = Vec<Contact>> {
    patch_of(2049..6000)
}

fn patch_of(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Contact>> {
    (count, 0..5u32, any::<u64>()).prop_map(|(count, kind, seed)| {
        let turn = DQuat::from_rotation_arc(DVec3::Z, Random(seed).direction());
        let origin = 10.0 * Random(!seed).in_cube();
        patch(count, seed, |random| {
            let (point, normal) = place(kind, random);
            (origin + turn * point, turn * normal)
        })
    })
}

fn reduce(contacts: &[Contact], n: u32) -> (Vec<Contact>, PairReduction) {
    let (kept, reports) = reduce_pairs(contacts.to_vec(), Reduction::PerPair(n));
    assert_eq!(reports.len(), 1);
    (kept, reports[0])
}

/// Wrench of a unit force on instance 2.
fn wrench(c: &Contact, report: &PairReduction) -> Wrench {
    let force = if c.instance_a == InstanceId(2) { c.normal } else { -c.normal };
    let torque = (c.point_a - report.center).cross(force) / report.length.max(f64::MIN_POSITIVE);
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

fn sum(wrenches: &[Wrench], forces: &[f64]) -> Wrench {
    std::array::from_fn(|k| wrenches.iter().zip(forces).map(|(w, f)| w[k] * f).sum())
}

fn minus(a: &Wrench, b: &Wrench) -> Wrench {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: &Wrench, b: &Wrench) -> f64 {
    (0..6).map(|k| a[k] * b[k]).sum()
}

/// Forces on the kept contacts that replace given forces of sum 1 on all contacts.
struct Replacement {
    forces: Vec<f64>,
    /// Norm of the remaining wrench: an upper bound of the least error.
    error: f64,
    /// A lower bound of the least error: how far the goal lies beyond the kept wrenches in some
    /// direction.
    least: f64,
}

/// Solves by pairwise Frank–Wolfe steps, which are slow where the hull is thin.
fn replacement(kept: &[Wrench], goal: &Wrench) -> Replacement {
    let mut forces = vec![0.0; kept.len()];
    forces[0] = 1.0;
    let mut least = 0.0f64;
    loop {
        let off = minus(&sum(kept, &forces), goal);
        let error = dot(&off, &off).sqrt();
        let slope = |j: &usize| dot(&kept[*j], &off);
        let to = (0..kept.len()).min_by(|a, b| slope(a).total_cmp(&slope(b))).unwrap();
        let from = (0..kept.len()).filter(|&j| forces[j] > 0.0);
        let from = from.max_by(|a, b| slope(a).total_cmp(&slope(b))).unwrap();
        least = least.max((slope(&to) - dot(goal, &off)) / error.max(f64::MIN_POSITIVE));
        if error - least < SOLVER {
            return Replacement { forces, error, least };
        }
        let way = minus(&kept[from], &kept[to]);
        let step = (dot(&off, &way) / dot(&way, &way)).min(forces[from]);
        forces[from] -= step;
        forces[to] += step;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn kept_contacts_replace_the_wrench_of_any_forces(contacts in any_patch(), n in 1..24u32, seed in any::<u64>()) {
        let (kept, report) = reduce(&contacts, n);
        prop_assert!(kept.len() <= n as usize && (kept.len(), contacts.len()) == (report.kept, report.contacts));
        let wrenches = |contacts: &[Contact]| contacts.iter().map(|c| wrench(c, &report)).collect::<Vec<_>>();
        let (all, kept) = (wrenches(&contacts), wrenches(&kept));
        let mut random = Random(seed);
        for sparse in [1, 2, 5, 100] {
            let forces: Vec<f64> =
                all.iter().map(|_| if random.index(sparse) == 0 { 5.0 * random.unit() } else { 0.0 }).collect();
            let total: f64 = forces.iter().sum();
            let goal = sum(&all, &forces).map(|x| x / total.max(f64::MIN_POSITIVE));
            if total > 0.0 {
                let replaced = replacement(&kept, &goal);
                prop_assert!(replaced.forces.iter().all(|&f| f >= 0.0));
                prop_assert!((replaced.forces.iter().sum::<f64>() - 1.0).abs() < ROUNDING);
                prop_assert!(replaced.error <= report.wrench_error + SOLVER);
                prop_assert!(replaced.least <= report.wrench_error + ROUNDING);
            }
        }
        // The loss is largest for a force on a single contact. The report states exactly this loss,
        // so it is not a loose bound.
        let single = all.iter().map(|w| replacement(&kept, w));
        let (least, most) = single.fold((0.0, 0.0), |(l, m), r| (r.least.max(l), r.error.max(m)));
        prop_assert!(least <= report.wrench_error + ROUNDING, "{least} {report:?}");
        prop_assert!(most >= 0.99 * report.wrench_error - ROUNDING, "{most} {report:?}");
        prop_assert!(most - least <= SOLVER + ROUNDING, "{most} {least}");
    }

    #[test]
    fn the_deepest_and_the_extremes_stay(contacts in prop_oneof![any_patch(), many_contacts()], n in 1..24u32) {
        let (kept, report) = reduce(&contacts, n);
        let deepest = |contacts: &[Contact]| contacts.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
        prop_assert_eq!(deepest(&kept), deepest(&contacts));
        let mut axes: Vec<DVec3> = Vec::new();
        while n >= 7 && axes.len() < 3 {
            let off = |c: &Contact| axes.iter().fold(c.point_a - report.center, |p, a| p - p.dot(*a) * a);
            // On ties the first one, as the reduction does: points of a ring are equally far out.
            let longer = |a: DVec3, b: DVec3| if b.length_squared() > a.length_squared() { b } else { a };
            let longest = contacts.iter().map(off).fold(DVec3::ZERO, longer);
            // The remainder of a flat patch is rounding and has no direction.
            if longest.length() <= 1e-3 * report.length {
                break;
            }
            let axis = longest.normalize();
            for axis in [axis, -axis] {
                let reach = |c: &[Contact]| c.iter().map(|c| c.point_a.dot(axis)).fold(f64::NEG_INFINITY, f64::max);
                prop_assert!(reach(&kept) >= reach(&contacts) - 1.001e-3 * report.length);
            }
            axes.push(axis);
        }
    }

    /// The reported loss equals the one computed on its own, from all contacts.
    #[test]
    fn reports_have_the_wrench_error(contacts in prop_oneof![any_patch(), many_contacts()], n in 1..70u32) {
        let (kept, report) = reduce(&contacts, n);
        let mut rest = contacts.iter();
        prop_assert!(kept.iter().all(|c| rest.any(|x| x == c)), "kept contacts are contacts, in order");
        let error = wrench_error(&contacts, &kept, report.center, report.length);
        prop_assert!((error - report.wrench_error).abs() <= 1e-6 * error + 1e-9, "{error} {report:?}");
        prop_assert_eq!(wrench_error(&[], &kept, report.center, report.length), 0.0);
        prop_assert_eq!(wrench_error(&contacts, &[], report.center, report.length), f64::INFINITY);
    }

    #[test]
    fn more_contacts_lose_less(contacts in any_patch()) {
        let mut last = f64::INFINITY;
        for n in 1..=contacts.len().min(40) as u32 {
            let error = reduce(&contacts, n).1.wrench_error;
            prop_assert!(error <= last * (1.0 + 1e-6) + 1e-12, "{n}: {last} {error}");
            last = error;
        }
        let (kept, report) = reduce(&contacts, contacts.len() as u32);
        prop_assert_eq!(&kept, &contacts);
        prop_assert_eq!(report.wrench_error, 0.0);
        prop_assert_eq!(reduce_pairs(contacts.clone(), Reduction::None), (contacts, Vec::new()));
    }

    /// The contacts of a pair are reduced in order, whatever else touches and for any number of
    /// threads.
    #[test]
    fn pairs_are_reduced_independently(
        patches in prop::collection::vec(prop_oneof![4 => any_patch(), 1 => many_contacts()], 1..6),
        n in 1..12u32,
    ) {
        let alone: Vec<_> = patches.iter().map(|contacts| reduce(contacts, n)).collect();
        // Pair k is (k, 100 - k): in the scene's order, the two orders of a pair are far apart.
        let renamed = |contacts: &[Contact], k: usize| -> Vec<Contact> {
            let rename = |id: InstanceId| InstanceId(if id.0 == 2 { k as u32 } else { 100 - k as u32 });
            contacts
                .iter()
                .map(|c| Contact { instance_a: rename(c.instance_a), instance_b: rename(c.instance_b), ..*c })
                .collect()
        };
        let scene = |contacts: Vec<Vec<Contact>>| {
            let mut all = contacts.concat();
            all.sort_by_key(|c| (c.instance_a, c.face_a));
            all
        };
        let all = scene(patches.iter().enumerate().map(|(k, p)| renamed(p, k)).collect());
        let expected = scene(alone.iter().enumerate().map(|(k, (kept, _))| renamed(kept, k)).collect());
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (kept, reports) = pool.install(|| reduce_pairs(all.clone(), Reduction::PerPair(n)));
            prop_assert_eq!(&kept, &expected);
            for (k, (report, (_, alone))) in reports.iter().zip(&alone).enumerate() {
                let (a, b) = (InstanceId(k as u32), InstanceId(100 - k as u32));
                prop_assert_eq!(*report, PairReduction { instance_a: a, instance_b: b, ..*alone });
            }
            prop_assert_eq!(reports.len(), alone.len());
        }
    }
}

/// 100 × 100 contacts on a plane, with the deepest at a corner or in the interior. Eight kept
/// contacts include the corners, and so the whole support polygon.
#[test]
fn a_flat_patch_keeps_its_corners() {
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0);
    for deepest in [0, 4711] {
        let at = |i: u32| turn * DVec3::new(f64::from(i % 100), 0.5 * f64::from(i / 100), 3.0);
        let contacts: Vec<Contact> = (0..10_000)
            .map(|i| contact([2, 5], at(i), turn * DVec3::Z, if i == deepest { -0.2 } else { -0.1 }, i))
            .collect();
        let (kept, report) = reduce(&contacts, 8);
        let faces: Vec<u32> = kept.iter().map(|c| c.face_a).collect();
        for face in [0, 99, deepest, 9900, 9999] {
            assert!(faces.contains(&face), "{faces:?}");
        }
        assert!(report.wrench_error < 1e-9, "{report:?}");
        assert!((report.length - 0.5 * DVec3::new(99.0, 49.5, 0.0).length()).abs() < 1e-9, "{report:?}");
    }
}

/// Equal contacts, from either body, are merged.
#[test]
fn equal_contacts_are_merged() {
    let (point, normal) = (DVec3::new(3.0, -2.0, 1.0), DVec3::Y);
    let both =
        |face| [contact([2, 5], point, normal, -0.1, face), contact([5, 2], point, -normal, -0.1, face)];
    let mut contacts: Vec<Contact> = (0..500).flat_map(both).collect();
    contacts.sort_by_key(|c| (c.instance_a, c.face_a));
    let (kept, report) = reduce(&contacts, 4);
    assert_eq!(kept, contacts[..1]);
    assert_eq!((report.wrench_error, report.length), (0.0, 0.0));
    assert_eq!(reduce(&contacts[..1], 1).1.wrench_error, 0.0);
    assert_eq!(reduce_pairs(Vec::new(), Reduction::PerPair(4)), (Vec::new(), Vec::new()));
}

/// A ring of contacts that push outwards, as around a shaft. The loss falls with the square of the
/// number of kept contacts.
#[test]
fn the_error_of_a_ring_falls_with_the_square_of_the_kept_contacts() {
    let contacts = patch(5000, 1, |random| {
        let (sin, cos) = (std::f64::consts::TAU * random.unit()).sin_cos();
        (DVec3::new(cos, sin, 0.0), DVec3::new(cos, sin, 0.0))
    });
    // The hull is that of a circle. A chord over 1/n of the circle is 1 − cos(π/n) from its arc.
    // Arcs are halved, so the longest are up to twice the shortest.
    for n in [8u32, 16, 32, 64] {
        let error = reduce(&contacts, n).1.wrench_error;
        let chord = |n: f64| 1.0 - (std::f64::consts::PI / n).cos();
        assert!((0.9 * chord(f64::from(n))..=chord(0.4 * f64::from(n))).contains(&error), "{n}: {error}");
    }
}

/// With one contact more than the limit, only the contacts that represent their bins are candidates.
/// The loss is nearly the same.
#[test]
fn bins_lose_little() {
    let mut worst = 0.0f64;
    for (kind, seed) in [(0, 1), (1, 2), (1, 3), (2, 4), (3, 5), (4, 6)] {
        let contacts = patch(2049, seed, |random| place(kind, random));
        for n in [12, 24, 64] {
            let by_bins = reduce(&contacts, n).1.wrench_error;
            let among_all = reduce(&contacts[..2048], n).1.wrench_error;
            println!("kind {kind}, {n} kept: {by_bins} by bins, {among_all} among all");
            worst = worst.max(by_bins / among_all.max(5e-3));
        }
    }
    assert!(worst < 1.5, "{worst}");
}

/// Contacts without extent in some directions, of any size and anywhere, and numbers of contacts
/// next to the limits.
#[test]
fn degenerate_sets_are_reduced() {
    let line = |random: &mut Random| (DVec3::X * random.unit(), DVec3::Z);
    let point = |random: &mut Random| (DVec3::ONE, random.direction());
    let places = |random: &mut Random| (random.in_cube().round(), DVec3::AXES[random.index(3)]);
    let huge = |random: &mut Random| (1e12 * random.in_cube() + 1e14, random.direction());
    let tiny = |random: &mut Random| (1e-12 * random.in_cube(), random.direction());
    let far = |random: &mut Random| (random.in_cube() + 1e9, DVec3::Y);
    let outlier = |random: &mut Random| {
        let size = if random.index(1000) == 0 { 1e6 } else { 1.0 };
        (size * random.in_cube(), DVec3::Z)
    };
    let kinds: [&Place; 7] = [&line, &point, &places, &huge, &tiny, &far, &outlier];
    for (kind, place) in kinds.into_iter().enumerate() {
        for count in [8, 9, 2048, 2049, 5000] {
            let contacts = patch(count, kind as u64, place);
            let (kept, report) = reduce(&contacts, 8);
            let error = wrench_error(&contacts, &kept, report.center, report.length);
            assert!((error - report.wrench_error).abs() <= 1e-6 * error + 1e-9, "{kind}: {error} {report:?}");
            assert_eq!((report.contacts, report.kept), (count, kept.len()));
            assert!(kept.len() <= 8 && (count > 8 || kept.len() == count), "{kind}: {report:?}");
            // A line has two ends.
            assert!(kind != 0 || error < 1e-9, "{report:?}");
        }
    }
}

/// More kept contacts than bins have survivors by default.
#[test]
fn many_contacts_can_be_kept() {
    let contacts = patch(30_000, 7, |random| (random.in_cube(), random.direction()));
    let mut last = f64::INFINITY;
    for n in [10, 100, 1000] {
        let (kept, report) = reduce(&contacts, n);
        assert_eq!(kept.len(), n as usize);
        assert!(report.wrench_error < last, "{n}: {report:?}");
        last = report.wrench_error;
    }
}
