//! The names of the vertices, edges and faces that touch.
use std::collections::BTreeMap;

use tesdf::collide::{
    CollideError, CollideOptions, Contact, FeatureB, Instance, InstanceId, Mode, Pose, Scene, Shape,
    TouchingFeatures, detect,
};
use tesdf::glam::{DQuat, DVec3};

use crate::support::blocks::{Block, Kind};
use crate::support::random::Random;

const HALF: DVec3 = DVec3::new(0.3, 0.25, 0.2);

/// Points are at the named features up to this.
const NEAR: f64 = 5e-6;

/// Positions of the vertices of a box by their names, in its frame.
fn vertices(shape: &Shape) -> BTreeMap<u32, DVec3> {
    match shape {
        Shape::Mesh(asset) => (0..asset.face_count())
            .flat_map(|face| asset.face_vertices(face).into_iter().zip(asset.face_corners(face)))
            .collect(),
        simple => (0..).zip(simple.nodes().iter().map(|&(point, _)| point)).collect(),
    }
}

/// The distance of a point of the world from a named vertex or edge; 0 of a face.
fn distance(block: &Block, vertices: &BTreeMap<u32, DVec3>, feature: FeatureB, point: DVec3) -> f64 {
    let p = block.pose.to_body(point);
    match feature {
        FeatureB::Vertex(vertex) => p.distance(vertices[&vertex]),
        FeatureB::Edge(low, high) => {
            assert!(low < high);
            let (start, side) = (vertices[&low], vertices[&high] - vertices[&low]);
            let along = ((p - start).dot(side) / side.length_squared()).clamp(0.0, 1.0);
            p.distance(start + along * side)
        }
        FeatureB::Face(_) => 0.0,
    }
}

/// The contacts of two boxes in a mode, each with the features of instance 0 and 1 that touch.
fn named(blocks: &[Block; 2], mode: Mode) -> Vec<(Contact, [FeatureB; 2])> {
    let shapes = blocks.map(|block| block.shape());
    let mut scene = Scene::new();
    for (shape, block) in shapes.iter().zip(blocks) {
        let id = scene.add_shape(shape.clone()).expect("a good shape");
        scene.add(Instance::new(id, block.pose)).expect("a good pose");
    }
    let vertices = shapes.each_ref().map(vertices);
    let options = CollideOptions { contact_distance: 1e-6, ..CollideOptions::with_mode(mode) };
    let found = detect(&scene, &options).expect("contacts");
    let of_contact = |c: Contact| {
        let TouchingFeatures { a, b } = c.touching_features(&scene).expect("of this scene");
        for (instance, feature, point) in [(c.instance_a, a, c.point_a), (c.instance_b, b, c.point_b)] {
            let k = instance.0 as usize;
            let off = distance(&blocks[k], &vertices[k], feature, point);
            assert!(off <= NEAR, "{off} from {feature:?}: {c:?}");
        }
        (c, if c.instance_a == InstanceId(0) { [a, b] } else { [b, a] })
    };
    found.into_iter().map(of_contact).collect()
}

fn kind(feature: FeatureB) -> usize {
    match feature {
        FeatureB::Vertex(_) => 0,
        FeatureB::Edge(..) => 1,
        FeatureB::Face(_) => 2,
    }
}

/// Checks that all contacts are of features of these kinds, and that both orders have the same ones
/// where both have a contact of a node or a crossing of edges.
fn touch(blocks: &[Block; 2], mode: Mode, kinds: [usize; 2]) {
    let found = named(blocks, mode);
    assert!(!found.is_empty(), "{mode:?}: {blocks:?}");
    let of = |first: u32| found.iter().filter(move |(c, _)| c.instance_a == InstanceId(first));
    for (c, features) in &found {
        assert_eq!(features.map(kind), kinds, "{mode:?}: {blocks:?} {c:?}");
    }
    let names = |first: u32| of(first).map(|(_, features)| *features).collect::<Vec<_>>();
    if mode == Mode::exact() {
        let [one, other] = [0, 1].map(names);
        assert!(!one.is_empty() && !other.is_empty(), "{blocks:?}");
        // Coplanar triangles of a face have names of their own.
        let of_features = |features: &[FeatureB; 2]| features.map(|f| (kind(f) < 2).then_some(f));
        assert!(one.iter().all(|x| other.iter().any(|y| of_features(x) == of_features(y))), "{found:?}");
    }
}

#[test]
fn features_have_the_same_names_in_both_orders() {
    let mut random = Random(4);
    let floor =
        |kind| Block { kind, half: DVec3::new(1.0, 0.9, 0.5), pose: Pose::at(DVec3::new(0.0, 0.0, -0.5)) };
    for kind in [Kind::Mesh, Kind::Formula] {
        for gap in [1e-7, 0.0, -1e-8] {
            for _ in 0..5 {
                // A corner over a side, away from the edge between its triangles.
                let turn = DQuat::from_rotation_y(random.between(0.3, 0.6))
                    * DQuat::from_rotation_x(random.between(0.3, 0.6));
                let height = (turn.inverse() * DVec3::Z).abs().dot(HALF);
                let lowest = turn * (HALF * -(turn.inverse() * DVec3::Z).signum());
                let at = DVec3::new(0.5, -0.1, height + gap) - lowest.with_z(0.0);
                let on_corner = Block { kind, half: HALF, pose: Pose { translation: at, rotation: turn } };
                for mode in [Mode::exact(), Mode::Node] {
                    touch(&[floor(kind), on_corner], mode, [2, 0]);
                    touch(&[on_corner, floor(kind)], mode, [0, 2]);
                }
                // Two edges that cross: those at +y +z and at −x −z.
                let (one, other) = (random.between(0.6, 0.9), random.between(0.6, 0.9));
                let below = Block { kind, half: HALF, pose: Pose::IDENTITY };
                let rotated = |rotation: DQuat| Pose { translation: DVec3::ZERO, rotation };
                let below = Block { pose: rotated(DQuat::from_rotation_x(one)), ..below };
                let above = Block { pose: rotated(DQuat::from_rotation_y(other)), ..below };
                let top = (below.pose.rotation.inverse() * DVec3::Z).abs().dot(HALF);
                let bottom = (above.pose.rotation.inverse() * DVec3::Z).abs().dot(HALF);
                // Over the middle of the edge below.
                let of = |block: &Block, up: f64| {
                    let z = block.pose.rotation.inverse() * (up * DVec3::Z);
                    let corner = HALF
                        * DVec3::from_array(
                            z.to_array().map(|x| if x.abs() < 1e-9 { 0.0 } else { x.signum() }),
                        );
                    block.pose.rotation * corner
                };
                let aside = (of(&below, 1.0) - of(&above, -1.0)).with_z(top + bottom + gap);
                let above = Block { pose: Pose { translation: aside, ..above.pose }, ..above };
                touch(&[below, above], Mode::exact(), [1, 1]);
                touch(&[above, below], Mode::exact(), [1, 1]);
            }
        }
    }
}

#[test]
fn contacts_of_another_scene_are_refused() {
    let blocks = [Kind::Mesh, Kind::Formula].map(|kind| Block { kind, half: HALF, pose: Pose::IDENTITY });
    let [below, above] = blocks;
    let above = Block { pose: Pose::at(2.0 * HALF.z * DVec3::Z), ..above };
    let (contact, _) = named(&[below, above], Mode::exact())[0];
    assert_eq!(
        contact.touching_features(&Scene::new()).expect_err("no instance"),
        CollideError::NoInstance(contact.instance_a)
    );
    let mut other = Scene::new();
    let shape = other.add_shape(blocks[0].shape()).expect("a good shape");
    for _ in 0..2 {
        other.add(Instance::new(shape, Pose::IDENTITY)).expect("a good pose");
    }
    let contact = Contact { face_a: 12, ..contact };
    let error = contact.touching_features(&other).expect_err("no such face");
    assert!(error.to_string().contains("12 (of 12)"), "{error}");
}
