//! Compares the exact mode with dense samples of each face, and with a branch and bound that shares
//! no code with it.

use std::collections::BTreeMap;

use crate::support::bodies::{Body, Placed, Relation, of_direction, rotation, scene};
use crate::support::lowest::{certified, sampled};
use crate::support::random::Random;
use crate::support::shapes;
use rayon::prelude::*;
use tesdf::Length;
use tesdf::collide::{
    CollideOptions, Contacts, ContactsPer, Instance, Mode, Placement, Pose, Scene, Shape, detect,
};
use tesdf::geometry::Triangle;
use tesdf::glam::{DQuat, DVec3};

/// A sample of a face may be deeper than the reported contact by at most this fraction of the
/// diagonal.
const DEEPER: f64 = 1e-6;
/// The default tolerance of the exact mode, plus rounding.
const TOLERANCE: f64 = 1.001e-7;

/// Contacts of every face, also of those that share a vertex.
fn per_cell() -> CollideOptions {
    CollideOptions::with_mode(Mode::exact().per(ContactsPer::Cell))
}

/// The least distance of each face of an ordered pair.
fn least_by_face(found: &Contacts, a: u32, b: u32) -> BTreeMap<u32, f64> {
    let mut least = BTreeMap::new();
    for c in of_direction(found.as_slice(), a, b) {
        let known: &mut f64 = least.entry(c.face_a).or_insert(f64::INFINITY);
        *known = known.min(c.distance);
    }
    least
}

/// Compares the reported contacts with the faces (in the world). `diagonal` is that of the field's
/// body. Returns the number of faces that touch.
fn compare(
    least: &BTreeMap<u32, f64>,
    faces: &[(u32, [DVec3; 3])],
    contact_distance: f64,
    diagonal: f64,
    value: impl Fn(DVec3) -> f64 + Sync,
) -> usize {
    let touches = |&(face, triangle): &(u32, [DVec3; 3])| {
        let found = least.get(&face).copied();
        let middle = triangle.iter().sum::<DVec3>() / 3.0;
        let reach = triangle.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
        let beyond = value(middle) - reach > contact_distance;
        if beyond {
            assert_eq!(found, None, "face {face} is out of reach");
            return false;
        }
        let (lowest, at) = sampled(&triangle, 9, 1e-8, &value);
        match found {
            None => {
                assert!(
                    lowest > contact_distance - DEEPER * diagonal,
                    "face {face} is {lowest} deep at {at}, and not reported"
                );
            }
            Some(distance) => assert!(
                distance < lowest + DEEPER * diagonal,
                "face {face} is {lowest} deep at {at}, but {distance} is reported"
            ),
        }
        found.is_some()
    };
    faces.par_iter().filter(|f| touches(f)).count()
}

fn faces(body: &Placed, stride: usize) -> Vec<(u32, [DVec3; 3])> {
    let all = 0..body.body.solid.mesh().faces().len() as u32;
    all.step_by(stride).map(|f| (f, body.body.face(f, body.at))).collect()
}

/// Compares both orders in the mode `exact`. Returns the number of faces that touch.
fn hold(bodies: &[Placed; 2], stride: [usize; 2], contact_distance: f64) -> usize {
    let options = CollideOptions { contact_distance, ..per_cell() };
    let found = detect(&scene(bodies), &options).expect("a good scene");
    let mut touching = 0;
    for (a, b) in [(0, 1), (1, 0)] {
        let least = least_by_face(&found, a as u32, b as u32);
        let faces = faces(&bodies[a], stride[a]);
        let value = |p| bodies[b].distance_by_tree(p);
        touching += compare(&least, &faces, contact_distance, bodies[b].diagonal(), value);
    }
    let share = found.statistics.unconverged as f64 / found.len().max(1) as f64;
    assert!(share < 1e-2, "{} of {} not converged", found.statistics.unconverged, found.len());
    touching
}

/// A nut on a bolt, displaced by `aside`.
fn bolt_and_nut(random: &mut Random, aside: f64) -> [Placed; 2] {
    let bolt = Placed::around("iso_m16_bolt_6k", rotation(random), 1.0, DVec3::ZERO);
    let moved = Pose {
        translation: bolt.at.pose.translation + aside * random.direction(),
        rotation: bolt.at.pose.rotation,
    };
    [bolt, Placed::new("iso_m16_nut_c25", Placement { pose: moved, scale: 1.0 })]
}

#[test]
fn no_sample_of_bolt_and_nut_is_deeper() {
    let mut random = Random(1);
    let mut touching = 0;
    // In metres. The clearance is 25 µm.
    for (aside, contact_distance) in [(0.0, 1e-4), (3e-4, 2e-5)] {
        touching += hold(&bolt_and_nut(&mut random, aside), [97, 89], contact_distance);
    }
    assert!(touching > 30, "{touching} faces touch");
}

#[test]
fn no_sample_of_deep_overlaps_is_deeper() {
    let mut random = Random(2);
    let mut touching = 0;
    let names = [["l_bracket", "cube"], ["torus_quads", "tetra"], ["beam", "l_bracket"]];
    for (k, names) in names.into_iter().enumerate() {
        for relation in [Relation::Deep, Relation::Inside, Relation::Touching] {
            let bodies = relation.place(names, &mut random);
            let stride = [0, 1].map(|i| bodies[i].body.solid.mesh().faces().len().div_ceil(40));
            touching += hold(&bodies, stride, [0.0, 0.01][k % 2] * bodies[0].diagonal());
        }
    }
    assert!(touching > 30, "{touching} faces touch");
}

#[test]
fn distances_are_within_the_tolerance_of_certified_bounds() {
    let mut random = Random(3);
    let (mut certain, mut open) = (0, 0);
    for relation in [Relation::Deep, Relation::Deep, Relation::Inside] {
        for names in [["torus_quads", "l_bracket"], ["beam", "tetra"]] {
            let bodies = relation.place(names, &mut random);
            let found = detect(&scene(&bodies), &per_cell()).expect("a good scene");
            for (a, b) in [(0, 1), (1, 0)] {
                let (field, diagonal) = (&bodies[b], bodies[b].diagonal());
                let nearest = |p: DVec3| {
                    let answer = field.body.asset.query_by_tree(field.at.to_shape(p));
                    let triangle = Triangle::new(field.body.face(answer.face, field.at));
                    (field.at.scale * answer.signed_distance, triangle)
                };
                let least = least_by_face(&found, a as u32, b as u32);
                let every = least.len().div_ceil(25).max(1);
                for (&face, &distance) in least.iter().step_by(every) {
                    let triangle = bodies[a].body.face(face, bodies[a].at);
                    let [low, high] = certified(triangle, 1e-8 * diagonal, 20_000, nearest);
                    assert!(distance > low - 1e-9 * diagonal, "face {face}: {distance}, at least {low}");
                    assert!(distance < high + TOLERANCE * diagonal, "face {face}: {distance}, {high} found");
                    if high - low < 1.1e-8 * diagonal {
                        certain += 1;
                    } else {
                        open += 1;
                    }
                }
            }
        }
    }
    assert!(certain > 100 && open < certain / 10, "{certain} faces certified, {open} left open");
}

/// Compares the least distance of each face with that of its parts in the cells, which another
/// search finds. Returns the number of faces inside that were compared.
fn faces_have_the_depth_of_their_cells(bodies: &[Placed; 2]) -> usize {
    let found = |per| {
        let found = detect(&scene(bodies), &CollideOptions::with_mode(Mode::exact().per(per)));
        let found = found.expect("a good scene");
        assert_eq!(found.statistics.unconverged, 0, "{per:?}: of {}", found.len());
        found
    };
    let (of_cells, of_faces) = (found(ContactsPer::Cell), found(ContactsPer::Face));
    let mut compared = 0;
    for (a, b) in [(0, 1), (1, 0)] {
        let (surface, field) = (&bodies[a], &bodies[b]);
        let tolerance = 2.0 * TOLERANCE * field.diagonal();
        let [cells, faces] = [&of_cells, &of_faces].map(|found| least_by_face(found, a as u32, b as u32));
        for (face, least) in cells.into_iter().filter(|(_, least)| *least < -tolerance) {
            let corners = surface.body.face(face, surface.at);
            // A contact at a vertex may be reported for another of its faces.
            if corners.iter().any(|p| field.distance_by_tree(*p) <= least + tolerance) {
                continue;
            }
            let of_face = faces.get(&face).copied();
            assert!(
                of_face.is_some_and(|d| (d - least).abs() <= tolerance),
                "face {face} of {a}: {of_face:?}, in cells {least}"
            );
            compared += 1;
        }
    }
    compared
}

#[test]
fn the_depth_of_a_face_is_that_of_its_cells() {
    let mut random = Random(7);
    let mut compared = 0;
    // Threads that cut into each other: beyond the plane of a flank lies the next one.
    for k in 0..4 {
        let [bolt, nut] = bolt_and_nut(&mut random, 1e-4 * f64::from(k));
        let turn = DQuat::from_axis_angle(random.direction(), 5e-3 * f64::from(k));
        compared += faces_have_the_depth_of_their_cells(&[
            bolt,
            nut.moved(Pose::new(DVec3::ZERO, turn).expect("a pose")),
        ]);
    }
    assert!(compared > 500, "{compared} faces of threads");
    // Ties: each deepest point has several nearest faces, and of parallel sides whole lines are
    // equally deep.
    let place = |name: &str, turn: DQuat, shift: DVec3| {
        let at = Placed::around(name, turn, 1.0, DVec3::ZERO);
        let size = at.diagonal();
        at.moved(Pose::at(size * shift))
    };
    let mut tied = 0;
    for names in [["beam", "l_bracket"], ["cube", "torus_quads"], ["l_bracket", "cube"], ["menger_2", "beam"]]
    {
        for turn in [DQuat::IDENTITY, DQuat::from_rotation_x(std::f64::consts::FRAC_PI_4)] {
            for shift in [DVec3::ZERO, DVec3::new(0.0, 0.0, 0.1), DVec3::new(0.05, 1e-9, 0.0)] {
                let bodies = [place(names[0], DQuat::IDENTITY, DVec3::ZERO), place(names[1], turn, shift)];
                tied += faces_have_the_depth_of_their_cells(&bodies);
            }
        }
    }
    assert!(tied > 100, "{tied} faces with ties");
}

/// Signed distance of a box, by its formula.
fn box_distance(p: DVec3, half: DVec3) -> f64 {
    let q = p.abs() - half;
    q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
}

#[test]
fn boxes_against_meshes() {
    let mut random = Random(5);
    let mut touching = 0;
    for name in ["l_bracket", "menger_2"] {
        let mesh = Placed::around(name, rotation(&mut random), 1.0, DVec3::ZERO);
        let half = 0.2 * mesh.diagonal() * (DVec3::splat(0.6) + 0.4 * random.in_cube());
        let pose =
            Pose { translation: 0.3 * mesh.diagonal() * random.in_cube(), rotation: rotation(&mut random) };
        let mut scene = Scene::new();
        let shapes = [Shape::Mesh(mesh.body.asset.clone()), Shape::Box { half_extents: half }];
        for (shape, pose) in shapes.into_iter().zip([mesh.at.pose, pose]) {
            let id = scene.add_shape(shape).expect("a shape");
            scene.add(Instance::new(id, pose)).expect("a pose");
        }
        let contact_distance = 0.02 * mesh.diagonal();
        let options = CollideOptions { contact_distance, ..per_cell() };
        let found = detect(&scene, &options).expect("a good scene");
        let of_mesh = faces(&mesh, mesh.body.solid.mesh().faces().len().div_ceil(150));
        let of_box = shapes::Shape::default().add_box(-half, half, 1).mesh();
        // The box shape numbers its triangles in its own way, so all of them are compared together.
        let whole: Vec<(u32, [DVec3; 3])> =
            (0..12).map(|f| (0, of_box.triangle(f).map(|p| pose.to_world(p)))).collect();
        let diagonal = 2.0 * half.length();
        touching += compare(&least_by_face(&found, 0, 1), &of_mesh, contact_distance, diagonal, |p| {
            box_distance(pose.to_body(p), half)
        });
        let of_field = least_by_face(&found, 1, 0).into_values().fold(f64::INFINITY, f64::min);
        let (lowest, _) = whole
            .iter()
            .map(|(_, t)| sampled(t, 12, 1e-8, |p| mesh.distance_by_tree(p)))
            .min_by(|x, y| x.0.total_cmp(&y.0))
            .expect("twelve triangles");
        // Another test checks that the reported point is a point of the box.
        assert!(of_field < lowest + DEEPER * mesh.diagonal(), "{name}: {of_field} {lowest}");
    }
    assert!(touching > 30, "{touching} faces touch");
}

#[test]
fn coplanar_faces_of_different_triangulations_touch() {
    // The lower side of the box lies in the floor and extends over several of its triangles. All
    // distances are 0.
    let floor = Body::new(
        shapes::Shape::default().add_box(DVec3::new(-1.0, -1.0, -0.5), DVec3::new(1.0, 1.0, 0.0), 7).solid(),
    );
    let cube = Body::new(shapes::Shape::default().add_box(DVec3::splat(-0.3), DVec3::splat(0.3), 2).solid());
    let mut scene = Scene::new();
    let turned = tesdf::glam::DQuat::from_rotation_z(0.3);
    let poses = [Pose::IDENTITY, Pose { translation: DVec3::new(0.1, 0.05, 0.3), rotation: turned }];
    for (body, pose) in [&floor, &cube].into_iter().zip(poses) {
        let id = scene.add_shape(body.asset.clone()).expect("a mesh");
        scene.add(Instance::new(id, pose)).expect("a pose");
    }
    let options = CollideOptions { contact_distance: 1e-6, ..per_cell() };
    let found = detect(&scene, &options).expect("a good scene");
    let least = least_by_face(&found, 1, 0);
    let on_floor: Vec<u32> =
        (0..48).filter(|&f| cube.solid.mesh().triangle(f as usize).iter().all(|p| p.z == -0.3)).collect();
    assert_eq!(on_floor.len(), 8);
    for face in on_floor {
        assert!(least.get(&face).is_some_and(|d| d.abs() < 1e-9), "face {face}: {:?}", least.get(&face));
    }
    assert_eq!(found.statistics.unconverged, 0, "of {}", found.len());
}

#[test]
fn tolerances_bound_the_error() {
    let mut random = Random(6);
    let bodies = Relation::Deep.place(["beam", "l_bracket"], &mut random);
    let scene = scene(&bodies);
    let fine = detect(&scene, &per_cell()).expect("a good scene");
    for share in [1e-3, 1e-5] {
        for tolerance in [Length::OfDiagonal(share), Length::Absolute(share * bodies[0].diagonal())] {
            let coarse = CollideOptions::with_mode(per_cell().mode.within(tolerance));
            let coarse = detect(&scene, &coarse).expect("a good scene");
            for (a, b) in [(0, 1), (1, 0)] {
                let allowed = match tolerance {
                    Length::OfDiagonal(share) => share * bodies[b].diagonal(),
                    Length::Absolute(length) => length,
                };
                let (fine, coarse) =
                    (least_by_face(&fine, a as u32, b as u32), least_by_face(&coarse, a as u32, b as u32));
                for (face, least) in fine {
                    let found = coarse.get(&face).copied().unwrap_or(0.0);
                    assert!(
                        found < least + allowed * 1.001 + 2e-7 * bodies[b].diagonal(),
                        "{face}: {found} {least}"
                    );
                }
            }
        }
    }
}
