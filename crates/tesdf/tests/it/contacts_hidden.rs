//! Overlaps without a contact are reported as hidden, and no other pair is.

use std::sync::{Arc, LazyLock};

use crate::support::bodies::{Body, Placed, RELATIONS, Relation, body, rotation, scene};
use crate::support::random::Random;
use crate::support::shapes;
use tesdf::Length;
use tesdf::collide::{
    ClearanceOptions, CollideOptions, Contacts, HiddenSearch, Instance, InstanceId, Mode, Placement, Pose,
    Reduction, Scene, Shape, clearance, detect, hidden_overlaps,
};
use tesdf::glam::{DQuat, DVec3};

const NODE: Mode = Mode::Node;
const MODES: [Mode; 3] = [NODE, Mode::face(), Mode::exact()];
const IDS: [InstanceId; 2] = [InstanceId(0), InstanceId(1)];

/// A mesh of the box from 0 to `size`.
fn block(size: DVec3) -> Arc<Body> {
    Arc::new(Body::new(shapes::Shape::default().add_box(DVec3::ZERO, size, 1).solid()))
}

fn cube() -> Arc<Body> {
    static CUBE: LazyLock<Arc<Body>> = LazyLock::new(|| block(DVec3::ONE));
    CUBE.clone()
}

fn at(x: f64, y: f64, z: f64) -> Placement {
    Placement { pose: Pose::at(DVec3::new(x, y, z)), scale: 1.0 }
}

fn bodies(a: Arc<Body>, b: Arc<Body>, to: Placement) -> Scene {
    scene(&[Placed { body: a, at: at(0.0, 0.0, 0.0) }, Placed { body: b, at: to }])
}

fn found(scene: &Scene, mode: Mode) -> Contacts {
    detect(scene, &CollideOptions { contact_distance: 1e-3, ..CollideOptions::with_mode(mode) })
        .expect("good")
}

/// Depth of the hidden overlap of the first two instances; `None` when no overlap is reported.
fn hidden(scene: &Scene, mode: Mode) -> Option<f64> {
    let hidden = found(scene, mode).hidden;
    assert!(hidden.len() <= 1 && hidden.iter().all(|h| [h.instance_a, h.instance_b] == IDS), "{hidden:?}");
    hidden.first().map(|h| h.depth)
}

fn deepest(found: &Contacts) -> f64 {
    found.iter().map(|c| -c.distance).fold(0.0, f64::max)
}

#[test]
fn without_the_search_contacts_are_the_same() {
    let scene = bodies(cube(), cube(), at(0.3, 0.0, 0.0));
    for mode in MODES {
        for reduction in [Reduction::None, Reduction::Spread(4)] {
            let on = CollideOptions { contact_distance: 1e-3, reduction, ..CollideOptions::with_mode(mode) };
            let off = CollideOptions { hidden: HiddenSearch::Off, ..on };
            let searched = detect(&scene, &on).expect("good");
            // Each corner of a cube is on the surface of the other or outside.
            let expected = usize::from(mode == NODE);
            assert_eq!(searched.hidden.len(), expected, "{mode:?}, {reduction:?}");
            let found = detect(&scene, &off).expect("good");
            assert_eq!((found.as_slice(), found.hidden.len()), (searched.as_slice(), 0), "{mode:?}");
            let later = hidden_overlaps(&scene, &off, found.as_slice()).expect("good");
            assert_eq!(later, searched.hidden, "{mode:?}, {reduction:?}");
        }
    }
}

#[test]
fn equal_cubes_that_pass_through_each_other_along_an_edge() {
    let simple = |step: DVec3| {
        let mut scene = Scene::new();
        let cube = scene.add_shape(Shape::Box { half_extents: DVec3::splat(0.5) }).expect("a box");
        for translation in [DVec3::ZERO, step] {
            scene.add(Instance::new(cube, Pose::at(translation))).expect("an instance");
        }
        scene
    };
    for k in 1..10 {
        let shift = f64::from(k) / 10.0;
        let depth = shift.min(1.0 - shift);
        for axis in DVec3::AXES {
            for sign in [-1.0, 1.0] {
                let step = sign * shift * axis;
                for scene in [bodies(cube(), cube(), at(step.x, step.y, step.z)), simple(step)] {
                    assert!(deepest(&found(&scene, NODE)) < 1e-9, "no node is inside, by {step}");
                    let told = hidden(&scene, NODE).unwrap_or_else(|| panic!("nothing hidden by {step}"));
                    // Alternatively, the reported depth is the radius of a ball inside both bodies,
                    // which may be greater.
                    assert!((0.74 * depth..=0.5).contains(&told), "{told} instead of {depth}");
                    assert!(deepest(&found(&scene, Mode::face())) > 0.9 * depth);
                    assert_eq!(hidden(&scene, Mode::face()).filter(|_| depth > 0.2), None, "faces show it");
                }
            }
        }
    }
}

#[test]
fn bodies_in_one_place_overlap_in_every_mode() {
    for mode in MODES {
        for body in [cube(), body("l_bracket"), body("torus_quads")] {
            let scene = bodies(body.clone(), body.clone(), at(0.0, 0.0, 0.0));
            let radius = thickness(&scene);
            let told = hidden(&scene, mode).expect("nothing hidden");
            assert!((told / radius - 1.0).abs() < 1e-4, "{told} of {radius}");
        }
    }
}

#[test]
fn bars_that_cross_like_a_plus_sign() {
    let along = |x: f64, y: f64| block(DVec3::new(x, y, 1.0));
    // Flush bars, or one bar thinner than the other: no node lies inside the other bar.
    for (height, thickness) in [(1.0, 1.0), (1.0, 0.5), (0.3, 1.0)] {
        let tall = block(DVec3::new(1.0, 5.0, height));
        let scene = bodies(along(5.0, thickness), tall, at(2.0, -2.0, 0.5 * (1.0 - height)));
        assert_eq!(deepest(&found(&scene, NODE)), 0.0, "no node is inside");
        let depth =
            -clearance(&scene, IDS[0], IDS[1], &ClearanceOptions::default()).expect("a pair").distance;
        let told = hidden(&scene, NODE).expect("nothing hidden");
        assert!((0.7 * depth..depth * (1.0 + 1e-6)).contains(&told), "{told} of {depth}");
    }
}

#[test]
fn a_capsule_across_a_bar() {
    let mut scene = Scene::new();
    let rod = scene.add_shape(Shape::Capsule { half_height: 5.0, radius: 0.2 }).expect("a capsule");
    let bar = scene.add_shape(Shape::Box { half_extents: DVec3::new(5.0, 0.5, 0.5) }).expect("a box");
    scene.add(Instance::new(rod, Pose::IDENTITY)).expect("an instance");
    scene.add(Instance::new(bar, Pose::IDENTITY)).expect("an instance");
    let told = hidden(&scene, NODE).expect("nothing hidden");
    assert!((0.5..=0.7).contains(&told), "{told}");
}

#[test]
fn bodies_that_touch_or_are_apart_have_no_hidden_overlap() {
    let turned = DQuat::from_axis_angle(DVec3::Z, 0.25 * std::f64::consts::PI);
    let on_edge = Placement {
        pose: Pose { translation: DVec3::new(1.0 + 0.5f64.sqrt(), 0.0, 0.0), rotation: turned },
        scale: 1.0,
    };
    let small = Placement { scale: 0.1, ..at(1.0, 0.3, 0.3) };
    for mode in MODES {
        for to in [
            // Contact in a face, half a face, an edge and a corner; then slightly apart, and
            // slightly overlapping.
            at(1.0, 0.0, 0.0),
            at(0.5, 1.0, 0.0),
            at(1.0, 1.0, 0.5),
            at(1.0, 1.0, 1.0),
            at(0.0, 0.0, 1.0 + 1e-9),
            at(0.0, 0.0, 1.0 - 1e-9),
            at(0.3, -0.2, 1.0 - 1e-3),
            at(1.5, 0.0, 0.0),
            on_edge,
            small,
        ] {
            assert_eq!(hidden(&bodies(cube(), cube(), to), mode), None, "{mode:?} {to:?}");
        }
        // A plate with a thickness of a thousandth, on another plate, rotated.
        let plate = block(DVec3::new(1.0, 1.0, 1e-3));
        let to = Placement {
            pose: Pose { translation: DVec3::new(0.5, 0.0, 1e-3), rotation: turned },
            scale: 1.0,
        };
        assert_eq!(hidden(&bodies(plate.clone(), plate, to), mode), None);
    }
}

#[test]
fn overlaps_with_a_penetrating_node_are_not_hidden() {
    // A corner in a face, an edge in a face, and a small cube inside a large cube.
    let corner = Placement {
        pose: Pose {
            translation: DVec3::new(0.5, 0.5, 0.8),
            rotation: DQuat::from_rotation_arc(DVec3::ONE.normalize(), DVec3::Z),
        },
        scale: 1.0,
    };
    for to in
        [corner, Placement { scale: 0.2, ..at(0.4, 0.4, 0.4) }, Placement { scale: 0.5, ..at(0.9, 0.2, 0.2) }]
    {
        let scene = bodies(cube(), cube(), to);
        assert!(deepest(&found(&scene, NODE)) > 0.05);
        assert_eq!(hidden(&scene, NODE), None, "{to:?}");
    }
}

fn thickness(scene: &Scene) -> f64 {
    let of = |id| {
        let instance = scene.instance(id).expect("it is there");
        Some(scene.shape(instance.shape).ok()?.inner_ball()?.1 * instance.scale)
    };
    IDS.into_iter().filter_map(of).fold(f64::INFINITY, f64::min)
}

/// Reported overlaps are real, and deep overlaps are reported.
fn as_exact(placed: &[Placed], same_place: bool) -> (usize, usize) {
    let scene = scene(placed);
    let found = found(&scene, NODE);
    let size = placed.iter().map(Placed::diagonal).fold(f64::INFINITY, f64::min);
    let options = ClearanceOptions { tolerance: Length::Absolute(1e-5 * size) };
    let depth = -clearance(&scene, IDS[0], IDS[1], &options).expect("a pair").distance;
    let (shown, thickness) = (deepest(&found), thickness(&scene));
    match found.hidden.first() {
        Some(h) => {
            assert!(h.depth > 2.0 * shown && h.depth > 0.05 * thickness, "{h:?}, shown {shown}");
            assert!(h.depth <= (depth + 1e-5 * size).max(thickness), "{h:?} of {depth}");
            // For equal bodies in the same pose, no surface is inside the other body.
            assert!(depth > 0.0 || same_place, "they do not overlap");
        }
        None => {
            let most = (0.67 * thickness + shown).max(2.7 * shown);
            assert!(depth <= most, "{depth}, shown {shown}, of {thickness}");
        }
    }
    (found.hidden.len(), usize::from(depth > 0.67 * thickness))
}

#[test]
fn hidden_overlaps_agree_with_the_exact_clearance() {
    let names = ["cube", "tetra", "l_bracket", "beam", "torus_quads", "iso_m16_bolt_6k", "spoon"];
    let mut random = Random(11);
    let (mut told, mut deep) = (0, 0);
    for k in 0..160 {
        let relation = RELATIONS[k % RELATIONS.len()];
        let pair = [random.index(names.len()), random.index(names.len())].map(|i| names[i]);
        let mut placed = relation.place(pair, &mut random);
        // In half of the cases the bodies are moved far into each other, because a relation may
        // only make them touch. In half of these, the bodies are boxes, whose nodes show the least.
        if k % 2 == 0 {
            if k % 4 == 0 {
                let mut bar = || block(DVec3::from_array([0, 1, 2].map(|_| random.between(0.2, 2.0))));
                placed = placed.map(|p| Placed { body: bar(), ..p });
            }
            let middle = placed[0].at.to_world(placed[0].body.center());
            let off = 0.3 * random.unit() * placed[0].diagonal() * random.direction();
            let at = Placed {
                at: Placement {
                    pose: Pose { rotation: rotation(&mut random), ..Pose::IDENTITY },
                    scale: placed[1].at.scale,
                },
                ..placed[1].clone()
            };
            let to = middle + off - at.at.to_world(at.body.center());
            placed[1] = at.moved(Pose::at(to));
        }
        let (hidden, is_deep) = as_exact(&placed, relation == Relation::Same && k % 2 == 1);
        (told, deep) = (told + hidden, deep + is_deep);
    }
    println!("{told} hidden, {deep} deep");
    assert!(told >= 10 && deep >= 40, "{told} hidden, {deep} deep");
}
