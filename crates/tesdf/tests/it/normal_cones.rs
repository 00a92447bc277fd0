//! Normals of contacts are in the normal cones of the features that touch.
use std::sync::Arc;

use tesdf::collide::{
    CollideOptions, Contact, ContactsPer, Instance, InstanceId, Mode, Pose, Scene, Shape, detect,
};
use tesdf::glam::{DQuat, DVec3};

use crate::support::blocks::{self, Block, Kind, Known, ON_SIDE, SLOPE, touching};
use crate::support::bodies::rotation;
use crate::support::meshes::encoded;
use crate::support::random::Random;
use crate::support::shapes;

/// Bodies of size 1 are apart where their distance is greater.
const APART: f64 = 1e-5;

fn scene(blocks: &[Block; 2]) -> Scene {
    let mut scene = Scene::new();
    for block in blocks {
        let shape = scene.add_shape(block.shape()).expect("a good shape");
        scene.add(Instance::new(shape, block.pose)).expect("a good pose");
    }
    scene
}

fn contacts_per(blocks: &[Block; 2], mode: Mode, contacts_per: ContactsPer) -> Vec<Contact> {
    let options =
        CollideOptions { contact_distance: 2e-3, ..CollideOptions::with_mode(mode.per(contacts_per)) };
    detect(&scene(blocks), &options).expect("contacts").into_vec()
}

fn contacts(blocks: &[Block; 2], mode: Mode) -> Vec<Contact> {
    contacts_per(blocks, mode, ContactsPer::Minimum)
}

#[test]
fn normals_are_in_the_cones_of_both_bodies() {
    let mut random = Random(0x5eed_c0de);
    let (mut seen, mut worst) = (0, 0.0f64);
    for round in 0..400 {
        let gap = [0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3, -1e-12, -1e-9][round % 8];
        let blocks = touching(&mut random, gap);
        for mode in [Mode::exact(), Mode::face()] {
            // A result of Frank–Wolfe that is not proved may be anywhere.
            for c in contacts(&blocks, mode).into_iter().filter(|c| c.converged) {
                let [a, b] = if c.instance_a == InstanceId(0) { blocks } else { [blocks[1], blocks[0]] };
                let near = ON_SIDE + 2.0 * c.distance.abs();
                let [mut of_a, of_b] =
                    [a.out_of_cone(c.point_a, -c.normal, near), b.out_of_cone(c.point_b, c.normal, near)];
                if b.sides_at(c.point_b, near) == 1 {
                    // A face of b is a wall for all points of a.
                    of_a = 0.0;
                }
                let way = c.point_a - c.point_b;
                if c.distance > APART && way.distance(way.length() * c.normal) < 1e-3 * APART {
                    // Not the nearest places of two features: the way between the points.
                    continue;
                }
                let out = of_a.max(of_b);
                assert!((c.normal.length() - 1.0).abs() < 1e-12, "{c:?}");
                assert!(out <= 1.01 * SLOPE, "{out} out of a cone, gap {gap}, {mode:?}: {blocks:?} {c:?}");
                (seen, worst) = (seen + 1, worst.max(out));
            }
        }
    }
    assert!(seen > 1000, "{seen} contacts, at most {worst} out of a cone");
}

#[test]
fn normals_per_face_and_cell_are_in_the_cones_where_these_meet() {
    let detect =
        |scene: &Scene, options: &CollideOptions| detect(scene, options).expect("contacts").into_vec();
    blocks::normals_are_in_the_cones_where_these_meet(
        &detect,
        &[0.0, 1e-12, 1e-9, 1e-7, -1e-12, -1e-9],
        ON_SIDE,
    );
}

#[test]
fn edges_are_pushed_along_the_normal_of_the_floor_in_each_mode() {
    let detect =
        |scene: &Scene, options: &CollideOptions| detect(scene, options).expect("contacts").into_vec();
    // Of the diagonals: 1e-6 of the smaller one, and the tolerance of the larger one.
    let known = Known { near: 7.8e-7, tolerance: 7.8e-7, direction: 1e-9 };
    let each = [ContactsPer::Cell, ContactsPer::Face, ContactsPer::Minimum];
    let kinds = [Mode::exact(), Mode::face()].map(|mode| each.map(|per| (mode, per))).concat();
    blocks::edges_are_pushed_along_the_normal_of_the_floor(&detect, &kinds, known);
}

/// A contact of a face with an edge or a vertex has the normal of the face, whichever body has it,
/// and at any gap.
#[test]
fn a_box_on_its_edge_or_corner_is_pushed_along_the_normal_of_the_face() {
    let mut random = Random(7);
    for kind in [Kind::Mesh, Kind::Formula] {
        for gap in [-1e-9, 0.0, 1e-12, 1e-9, 1e-7, 3e-7, 1e-6, 1e-5, 1e-4] {
            for tilt in 0..6 {
                let half = DVec3::new(0.3, 0.25, 0.2);
                let turn = match tilt {
                    0..3 => DQuat::from_axis_angle(DVec3::AXES[tilt % 2], random.between(0.2, 1.3)),
                    _ => rotation(&mut random),
                };
                let height = (turn.inverse() * DVec3::Z).abs().dot(half);
                let floor = Block {
                    kind,
                    half: DVec3::new(1.0, 1.0, 0.5),
                    pose: Pose::at(DVec3::new(0.0, 0.0, -0.5)),
                };
                let pose = Pose { translation: DVec3::new(0.1, -0.05, height + gap), rotation: turn };
                let found = contacts(&[floor, Block { kind, half, pose }], Mode::exact());
                assert!(!found.is_empty(), "{kind:?}, gap {gap}, tilt {tilt}");
                for c in found {
                    let up = if c.instance_a == InstanceId(0) { -c.normal } else { c.normal };
                    assert!(up.distance(DVec3::Z) < 1e-9, "{kind:?}, gap {gap}, tilt {tilt}: {c:?}");
                    // Some are a corner's that is higher.
                    assert!(c.distance >= gap - 1e-7, "{kind:?}, gap {gap}, tilt {tilt}: {c:?}");
                }
            }
        }
    }
}

/// Each pair of features has one contact.
#[test]
fn no_two_contacts_are_at_one_place_with_one_normal() {
    let mut random = Random(11);
    for round in 0..60 {
        let blocks = touching(&mut random, [0.0, 1e-9, 1e-5][round % 3]);
        let found = contacts(&blocks, Mode::exact());
        for (k, c) in found.iter().enumerate() {
            for d in &found[k + 1..] {
                let sign = if c.instance_a == d.instance_a { 1.0 } else { -1.0 };
                let apart = (c.point_a + c.point_b).distance(d.point_a + d.point_b);
                let turned = c.normal.distance(sign * d.normal);
                assert!(apart > 1e-7 || turned > 1e-7, "{blocks:?} {c:?} {d:?}");
            }
        }
    }
}

/// Over the flat edges between tiles, a ball has one contact, as over a plane.
#[test]
fn a_ball_over_tiles_has_the_normal_of_their_plane() {
    let solid =
        shapes::Shape::default().add_box(DVec3::new(-1.0, -1.0, -0.2), DVec3::new(1.0, 1.0, 0.0), 10).solid();
    let tiles = Arc::new(encoded(&solid));
    let mut random = Random(3);
    for gap in [-1e-4, 0.0, 1e-6, 1e-3] {
        for _ in 0..20 {
            let mut scene = Scene::new();
            let floor = scene.add_shape(Shape::Mesh(tiles.clone())).expect("tiles");
            let ball = scene.add_shape(Shape::Sphere { radius: 0.05 }).expect("a ball");
            scene.add(Instance::new(floor, Pose::IDENTITY)).expect("a pose");
            let at = DVec3::new(random.between(-0.9, 0.9), random.between(-0.9, 0.9), 0.05 + gap);
            scene.add(Instance::new(ball, Pose::at(at))).expect("a pose");
            let options = CollideOptions {
                contact_distance: 0.01,
                ..CollideOptions::with_mode(Mode::exact().per(ContactsPer::Minimum))
            };
            let found = detect(&scene, &options).expect("contacts");
            assert!(!found.is_empty());
            for c in found {
                let up = if c.instance_a == InstanceId(0) { -c.normal } else { c.normal };
                assert!(up.distance(DVec3::Z) < 1e-9 && (c.distance - gap).abs() < 1e-7, "{at} {c:?}");
                assert!(c.point_a.with_z(at.z).distance(at) < 1e-9, "{at} {c:?}");
            }
        }
    }
}
