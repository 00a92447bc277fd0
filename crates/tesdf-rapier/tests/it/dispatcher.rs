//! Tests of the dispatcher and the shape through Rapier's traits.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::support::cube;
use tesdf::collide::{CollideOptions, Mode};
use tesdf::glam::DVec3;
use tesdf_rapier::rapier3d_f64::parry::query::{
    PersistentQueryDispatcher, PointQuery, QueryDispatcher, RayCast,
};
use tesdf_rapier::rapier3d_f64::prelude::*;
use tesdf_rapier::{TesdfDispatcher, TesdfShape, query_dispatcher};

/// Half of the cube's edge length, m.
const HALF: f64 = 0.01;

fn shape() -> TesdfShape {
    TesdfShape::new(Arc::new(cube(HALF)))
}

fn dispatcher() -> TesdfDispatcher {
    TesdfDispatcher::new(CollideOptions::with_mode(Mode::Node))
}

/// Impulse of each contact, by corner of the cube. The cube is the second shape.
fn impulses(manifolds: &[ContactManifold]) -> BTreeMap<[bool; 3], f64> {
    let of = |m: &ContactManifold| {
        assert_eq!(m.points.len(), 1);
        let point = &m.points[0];
        (point.local_p2.to_array().map(|x| x > 0.0), point.data.warmstart_impulse)
    };
    manifolds.iter().map(of).collect()
}

#[test]
fn impulses_stay_with_their_features() {
    let (dispatcher, cube, plane) = (dispatcher(), shape(), HalfSpace::new(Vector::Z));
    let (mut manifolds, mut workspace) = (Vec::new(), None);
    let mut update = |pose: Pose, manifolds: &mut Vec<ContactManifold>| {
        let done = dispatcher.contact_manifolds(&pose, &plane, &cube, 1e-4, manifolds, &mut workspace);
        assert!(done.is_ok());
    };
    let flat = Pose::from_parts(Vector::new(0.0, 0.0, HALF), Rotation::IDENTITY);
    // A rotation about the y axis: the corners of +x are low, and those of -x are 2 mm higher.
    let turn = Rotation::from_rotation_y(0.1);
    let low = (turn * DVec3::new(HALF, 0.0, -HALF)).z;
    let tilted = Pose::from_parts(Vector::new(0.0, 0.0, -low), turn);

    update(flat, &mut manifolds);
    assert_eq!(manifolds.len(), 4);
    assert!(impulses(&manifolds).values().all(|&impulse| impulse == 0.0), "nothing was solved yet");
    for (k, manifold) in manifolds.iter_mut().enumerate() {
        manifold.points[0].data.warmstart_impulse = 1.0 + k as f64;
    }
    let given = impulses(&manifolds);

    update(tilted, &mut manifolds);
    let kept = impulses(&manifolds);
    assert_eq!(kept.len(), 2);
    assert!(
        kept.iter().all(|(corner, impulse)| corner[0] && given[corner] == *impulse),
        "{given:?} {kept:?}"
    );

    update(flat, &mut manifolds);
    let back = impulses(&manifolds);
    assert_eq!(back.len(), 4);
    for (corner, impulse) in back {
        assert_eq!(impulse, if corner[0] { given[&corner] } else { 0.0 }, "{corner:?}");
    }

    update(Pose::from_translation(Vector::Z), &mut manifolds);
    assert!(manifolds.is_empty());
}

#[test]
fn contacts_of_a_pair_do_not_depend_on_its_order() {
    let dispatcher = TesdfDispatcher::new(CollideOptions::with_mode(Mode::exact()));
    let (cube, scaled) = (shape(), TesdfShape::scaled(Arc::new(cube(1.0)), 0.5 * HALF).expect("a scale"));
    let pose =
        Pose::from_parts(Vector::new(0.001, 0.002, 1.5 * HALF - 1e-5), Rotation::from_rotation_x(1e-3));
    let contacts = |pose: Pose, g1: &dyn Shape, g2: &dyn Shape| {
        let (mut manifolds, mut workspace) = (Vec::new(), None);
        let done = dispatcher.contact_manifolds(&pose, g1, g2, 1e-4, &mut manifolds, &mut workspace);
        assert!(done.is_ok());
        manifolds
    };
    let forward = contacts(pose, &cube, &scaled);
    let backward = contacts(pose.inverse(), &scaled, &cube);
    assert!(forward.len() > 4);
    assert_eq!(forward.len(), backward.len());
    for manifold in &forward {
        let point = &manifold.points[0];
        // Rapier's convention: the second point lies at `dist` along the normal of the first shape.
        let across = pose * point.local_p2 - point.local_p1;
        assert!((across.dot(manifold.local_n1) - point.dist).abs() < 1e-9, "{point:?}");
        assert!((pose.rotation * manifold.local_n2 + manifold.local_n1).length() < 1e-12);
        let twin = |m: &&ContactManifold| {
            (m.points[0].local_p1 - point.local_p2).length() < 1e-9
                && (m.points[0].local_p2 - point.local_p1).length() < 1e-9
                && (m.points[0].dist - point.dist).abs() < 1e-9
                && (m.local_n1 - manifold.local_n2).length() < 1e-9
        };
        assert!(backward.iter().any(|m| twin(&m)), "{point:?}");
    }
    let deepest = forward.iter().map(|m| m.points[0].dist).fold(f64::INFINITY, f64::min);
    let contact = dispatcher.contact(&pose, &cube, &scaled, 1e-4).expect("answered").expect("they touch");
    assert_eq!(contact.dist, deepest);
    assert!((contact.normal1 - DVec3::Z).length() < 2e-3);
    let far = Pose::from_translation(Vector::Z);
    for (pose, touch) in [(pose, true), (far, false)] {
        let found = dispatcher.intersection_test(&pose, &cube, &scaled).expect("answered");
        assert_eq!(found.intersecting, touch);
    }
}

#[test]
fn simple_shapes_touch_meshes_where_they_are() {
    let (dispatcher, cube) = (dispatcher(), shape());
    // Each shape lies 50 µm above the top of the cube.
    let gap = 5e-5;
    let capsule = Capsule::new(Vector::new(0.0, 0.002, 0.0), Vector::new(0.004, 0.002, 0.0), 0.003);
    let half_space = HalfSpace::new(Vector::X);
    let cylinder = Cylinder::new(0.002, 0.003);
    let upright = Rotation::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let cases: [(&dyn Shape, Pose); 6] = [
        (&Ball::new(0.004), Pose::from_translation(Vector::Z * (HALF + 0.004 + gap))),
        (&Cuboid::new(Vector::splat(0.002)), Pose::from_translation(Vector::Z * (HALF + 0.002 + gap))),
        (&capsule, Pose::from_translation(Vector::Z * (HALF + 0.003 + gap))),
        // A cylinder of Rapier lies along y.
        (&cylinder, Pose::from_translation(Vector::Z * (HALF + 0.003 + gap))),
        (&cylinder, Pose::from_parts(Vector::Z * (HALF + 0.002 + gap), upright)),
        // The outward normal points down to the cube.
        (
            &half_space,
            Pose::from_parts(
                Vector::Z * (HALF + gap),
                Rotation::from_rotation_y(std::f64::consts::FRAC_PI_2),
            ),
        ),
    ];
    for (k, (simple, pose)) in cases.into_iter().enumerate() {
        let contact = dispatcher.contact(&pose, &cube, simple, 1e-4).expect("answered").expect("they touch");
        assert!((contact.dist - gap).abs() < 1e-9, "case {k}: {contact:?}");
        assert!((contact.normal1 - DVec3::Z).length() < 1e-9, "case {k}: {contact:?}");
        assert!(dispatcher.contact(&pose, &cube, simple, 4e-5).expect("answered").is_none(), "case {k}");
    }
}

#[test]
fn other_pairs_are_left_to_parry() {
    let (ball, cube) = (Ball::new(1.0), shape());
    let pose = Pose::from_translation(Vector::X * 1.5);
    assert!(dispatcher().intersection_test(&pose, &ball, &ball).is_err());
    let both = query_dispatcher(CollideOptions::with_mode(Mode::Node));
    assert!(both.intersection_test(&pose, &ball, &ball).is_ok_and(|test| test.intersecting));
    assert!(both.distance(&pose, &ball, &cube).is_err(), "parry does not know it either");
}

#[test]
fn points_and_rays_meet_the_solid() {
    let shape = TesdfShape::scaled(Arc::new(cube(1.0)), HALF).expect("a scale");
    assert!(TesdfShape::scaled(shape.asset().clone(), -1.0).is_none());
    let inside = DVec3::new(0.0, 0.001, 0.8 * HALF);
    assert!(shape.contains_local_point(inside));
    assert!((shape.distance_to_local_point(inside, false) + 0.2 * HALF).abs() < 1e-12);
    assert_eq!(shape.project_local_point(inside, true).point, inside);
    let above = inside + DVec3::Z * HALF;
    assert!(!shape.contains_local_point(above));
    assert!((shape.project_local_point(above, true).point - inside.with_z(HALF)).length() < 1e-12);

    let down = Ray::new(above, -2.0 * Vector::Z);
    let hit = shape.cast_local_ray_and_get_normal(&down, 1.0, true).expect("a hit");
    assert!((hit.time_of_impact - 0.4 * HALF).abs() < 1e-12 && hit.normal == DVec3::Z, "{hit:?}");
    assert!(shape.cast_local_ray(&down, 0.3 * HALF, true).is_none());
    let out = Ray::new(inside, Vector::Z);
    assert_eq!(shape.cast_local_ray(&out, 1.0, true), Some(0.0));
    let hit = shape.cast_local_ray_and_get_normal(&out, 1.0, false).expect("a hit");
    assert!((hit.time_of_impact - 0.2 * HALF).abs() < 1e-12 && hit.normal == -DVec3::Z, "{hit:?}");

    let mass = Shape::mass_properties(&shape, 1000.0);
    assert!((mass.mass() / 8e-3 - 1.0).abs() < 1e-12);
    let inertia = mass.principal_inertia();
    assert!((inertia / (8e-3 * 4.0 * HALF * HALF / 6.0) - DVec3::ONE).length() < 1e-9, "{inertia}");
    assert!(shape.scale_dyn(Vector::new(1.0, 2.0, 1.0), 0).is_none());
    let half = shape.compute_local_aabb().half_extents();
    assert!((half - DVec3::splat(HALF)).length() < 1e-15);
}
