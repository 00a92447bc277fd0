//! Finite points, rays and poses far out get a right answer or an error, never infinity or NaN.

use std::sync::{Arc, LazyLock};

use crate::support::meshes::{encoded, named};
use crate::support::random::Random;
use tesdf::TeSdf;
use tesdf::collide::{
    ClearanceOptions, CollideError, CollideOptions, Instance, Mode, Motion, Pose, Scene, Shape,
    TimeOfImpactOptions, Velocity, clearance, detect, time_of_impact,
};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf::query::{Answer, AnswerColumns, Extent, Precision};

static KEY: LazyLock<TeSdf> = LazyLock::new(|| encoded(&named("procedural/shaft_keyway.obj")));

/// The same mesh with another size and position.
fn scaled(asset: &TeSdf, scale: f64, shift: DVec3) -> TeSdf {
    let corners = (0..asset.face_count()).flat_map(|f| asset.face_corners(f).map(|p| p * scale + shift));
    let faces = (0..asset.face_count() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let mesh = TriangleMesh::new(corners.collect(), faces).unwrap();
    let welded = tesdf::mesh::repair(
        &mesh,
        &tesdf::mesh::RepairOptions { weld_tolerance: Some(1e-9 * mesh.diagonal()), ..Default::default() },
    );
    encoded(&SolidMesh::new(welded.unwrap().mesh).unwrap())
}

/// Directions along axes, in coordinate planes, and random.
fn directions() -> Vec<DVec3> {
    let mut random = Random(5);
    let mut all: Vec<DVec3> = (0..30).map(|_| random.direction()).collect();
    for axis in DVec3::AXES {
        all.extend([axis, -axis, (axis + DVec3::X).normalize(), (axis - DVec3::Y).normalize_or(axis)]);
    }
    all
}

fn length(v: DVec3) -> f64 {
    let largest = v.abs().max_element();
    (v / largest).length() * largest
}

#[test]
fn answers_are_right_at_any_distance() {
    for asset in [&*KEY, &scaled(&KEY, 1e30, DVec3::ZERO), &scaled(&KEY, 1.0, DVec3::splat(1e3))] {
        let corners: Vec<DVec3> = (0..asset.face_count()).flat_map(|f| asset.face_corners(f)).collect();
        let middle = asset.bounds().center();
        let diagonal = asset.bounds().extent().length();
        for r in [1e8, 1e9, 1e11, 1e15, 1e50, 1e100, 1e154, 1e200, 1e300, 1.7e308] {
            for u in directions() {
                let p = u * r;
                if length(p - middle) < 3e8 * diagonal {
                    continue;
                }
                // The nearest corner is found by projection: from so far out, nothing else matters.
                let away = ((p - middle) / r).normalize();
                let deepest = corners.iter().map(|&c| away.dot(c - middle)).fold(f64::NEG_INFINITY, f64::max);
                for precision in [Precision::F32, Precision::F64] {
                    for answer in [
                        asset.query_with(p, precision),
                        asset.query_by_tree_with(p, precision),
                        asset.query_batch_with(&[p, p], precision)[1],
                    ] {
                        let expected = length(p - answer.closest_point);
                        let Answer { signed_distance, gradient, closest_point, face } = answer;
                        assert!(
                            (signed_distance - expected).abs() <= 4.0 * f64::EPSILON * expected,
                            "{p}: {answer:?}"
                        );
                        assert!(gradient.distance(away) < 1e-7, "{p}: {answer:?}");
                        let depth = away.dot(closest_point - middle);
                        let tolerance = 3e-7 * diagonal + 4.0 * f64::EPSILON * middle.length();
                        assert!((depth - deepest).abs() <= tolerance, "{p}: {depth}, expected {deepest}");
                        assert!((face as usize) < asset.face_count());
                    }
                    assert_eq!(asset.query_in_domain_with(p, precision), None);
                }
                assert!(!asset.is_inside(p), "{p}");
            }
        }
    }
}

/// A distance too large for `f64` is answered with the largest `f64`. Points that are not finite
/// have no answer.
#[test]
fn the_largest_and_non_finite_coordinates() {
    for precision in [Precision::F32, Precision::F64] {
        let answer = KEY.query_with(DVec3::splat(-f64::MAX), precision);
        assert_eq!(answer.signed_distance, f64::MAX);
        assert!(answer.gradient.is_normalized() && answer.closest_point.is_finite());
        for p in [DVec3::splat(f64::NAN), DVec3::new(0.0, f64::INFINITY, 0.0)] {
            let none = KEY.query_with(p, precision);
            assert!(none.signed_distance.is_nan() && none.face == Answer::NO_FACE, "{none:?}");
        }
        let (mut d, mut f) = ([0.0; 2], [0; 2]);
        let (mut g, mut c) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
        let columns =
            AnswerColumns { signed_distance: &mut d, gradient: &mut g, closest_point: &mut c, face: &mut f };
        let points = [DVec3::new(1e200, 0.0, 0.0), DVec3::NAN];
        KEY.query_batch_into(&points, precision, Extent::Everywhere, columns).unwrap();
        assert_eq!((d[0], g[0][0], d[1].is_nan()), (1e200, 1.0, true));
    }
}

#[test]
fn rays_from_far_out_meet_the_face_that_rays_from_near_meet() {
    let asset = &*KEY;
    let bounds = asset.bounds();
    let mut random = Random(9);
    let mut hits = 0;
    for _ in 0..300 {
        let across = bounds.center() + 0.6 * random.in_cube() * bounds.extent();
        for axis in DVec3::AXES {
            let from = |distance: f64| across * (DVec3::ONE - axis) + distance * axis;
            let near = asset.ray_cast(from(0.2), -axis, f64::INFINITY);
            for distance in [1e3, 1e16, 1e30, 1e150, 1e200, 1e308] {
                for unit in [1.0, 1e-3, 1e-100, 1e100] {
                    let far = asset.ray_cast(from(distance), -axis * unit, f64::INFINITY);
                    // Above the largest number there is no such parameter of the ray.
                    let expected = near.filter(|_| distance / unit <= f64::MAX);
                    assert_eq!(far.map(|h| h.face), expected.map(|h| h.face), "{distance} {unit}");
                    assert_eq!(asset.ray_cast(from(distance), axis * unit, f64::INFINITY), None);
                    let (Some(far), Some(near)) = (far, near) else { continue };
                    hits += 1;
                    assert!(far.point.distance(near.point) < 1e-15 && far.normal == near.normal);
                    let t = (distance - near.point.dot(axis)) / unit;
                    assert!((far.t - t).abs() <= 4.0 * f64::EPSILON * t, "{} for {t}", far.t);
                    let short = asset.ray_cast(from(distance), -axis * unit, 0.999 * t);
                    assert_eq!(short, None, "{distance} {unit}");
                }
            }
        }
    }
    assert!(hits > 3000, "{hits}");
    assert_eq!(asset.ray_cast(DVec3::splat(1e200), DVec3::X, f64::INFINITY), None);
}

/// With a scale of 1e-30, a step of the direction is below the rounding of the origin.
#[test]
fn rays_through_meshes_of_any_size_miss_what_is_beside_them() {
    for scale in [1e30, 1.0, 1e-30] {
        let asset = scaled(&KEY, scale, DVec3::ZERO);
        let bounds = asset.bounds();
        for unit in [1.0, 1e-20, 1e20] {
            let outside = bounds.max + 0.1 * bounds.extent();
            assert_eq!(asset.ray_cast(outside, DVec3::X * unit, f64::INFINITY), None, "{scale} {unit}");
            assert_eq!(asset.ray_cast(outside, -DVec3::X * unit, f64::INFINITY), None, "{scale} {unit}");
            let hit =
                asset.ray_cast(bounds.center() - bounds.extent(), bounds.extent() * unit, f64::INFINITY);
            assert!(hit.is_some_and(|h| h.t * unit > 0.1 && h.t * unit < 1.0), "{scale} {unit}: {hit:?}");
        }
    }
}

#[test]
fn simple_shapes_answer_far_out() {
    let shapes = [
        Shape::Box { half_extents: DVec3::new(1.0, 2.0, 3.0) },
        Shape::Sphere { radius: 2.0 },
        Shape::Capsule { half_height: 1.0, radius: 0.5 },
    ];
    for shape in shapes {
        for r in [1e10, 1e120, 1e200, 1e308] {
            for u in directions() {
                let found = shape.signed_distance(u * r);
                assert!((found - r).abs() <= 1e-9 * r, "{shape:?} {u}: {found} for {r}");
                assert!(!shape.contains(u * r));
            }
            let hit = shape.ray_cast(DVec3::Z * r, -DVec3::Z, f64::INFINITY).unwrap();
            assert!((hit.t - r).abs() <= 1e-9 * r && hit.normal == DVec3::Z, "{shape:?} {hit:?}");
            assert_eq!(shape.ray_cast(DVec3::new(9.0, 0.0, r), -DVec3::Z, f64::INFINITY), None);
        }
    }
    let plane = Shape::Plane;
    assert_eq!(plane.signed_distance(DVec3::new(1e300, 0.0, -1e300)), -1e300);
    assert_eq!(plane.ray_cast(DVec3::Z * 1e308, -DVec3::Z * 1e-10, f64::INFINITY), None);
    assert!(Shape::Sphere { radius: 1e200 }.validate().is_err());
}

fn two(a: impl Into<Shape>, b: impl Into<Shape>, at: DVec3) -> Result<Scene, CollideError> {
    let mut scene = Scene::new();
    let (a, b) = (scene.add_shape(a)?, scene.add_shape(b)?);
    scene.add(Instance::new(a, Pose::IDENTITY))?;
    scene.add(Instance::new(b, Pose::at(at)))?;
    Ok(scene)
}

#[test]
fn poses_far_out_have_no_contacts_or_are_refused() {
    let key: Arc<TeSdf> = Arc::new(KEY.clone());
    for u in directions().into_iter().step_by(9) {
        for r in [1e3, 1e9, 1e11, 1e12, 1e20, 1e100, 1e154, 1e200, 1e308] {
            let scene = match two(key.clone(), key.clone(), u * r) {
                Ok(scene) => scene,
                Err(error) => {
                    assert!(r > 1e9, "{r}: {error}");
                    assert!(error.to_string().contains("too far out"), "{error}");
                    continue;
                }
            };
            for mode in [Mode::Node, Mode::face(), Mode::exact()] {
                assert!(detect(&scene, &CollideOptions::with_mode(mode)).unwrap().is_empty());
            }
            let ids: Vec<_> = scene.instances().map(|(id, _)| id).collect();
            let found = clearance(&scene, ids[0], ids[1], &ClearanceOptions::default()).unwrap();
            let about = found.distance / r;
            assert!((about - 1.0).abs() < 1e-3 && found.normal.distance(-u) < 1e-3, "{r} {u}: {found:?}");
            for speed in [1e3 * r, 1e200, f64::MAX] {
                let towards = Velocity { linear: -u * speed, ..Velocity::default() };
                let motion = Motion::Linear { velocity: towards };
                let options = TimeOfImpactOptions { end: 10.0, ..TimeOfImpactOptions::default() };
                match time_of_impact(&scene, ids[1], ids[0], motion, Motion::Rest, &options) {
                    // Far out, rounding of the places is more than the tolerance.
                    Ok(found) if found.impact().is_some() || r > 1e6 => {
                        let distance = found.clearance().expect("they meet").distance;
                        let time = found.free_until();
                        assert!(time.is_finite() && distance.is_finite(), "{found:?}");
                        assert!((time * speed / r - 1.0).abs() < 1e-3, "{r} {speed}: {found:?}");
                    }
                    Ok(found) => panic!("{r} {speed}: {found:?}"),
                    Err(e) => {
                        assert!(speed > 1e100 && e.to_string().contains("up to 1e50"), "{r} {speed}: {e}")
                    }
                }
            }
        }
    }
    let refused = two(key.clone(), Shape::Plane, DVec3::Z * 1e200).unwrap_err();
    assert!(refused.to_string().contains("too far out"), "{refused}");
    let below = two(key.clone(), Shape::Plane, DVec3::Z * -1e40).unwrap();
    assert!(detect(&below, &CollideOptions::default()).unwrap().is_empty());
    // All of the body is below a plane that far above.
    let above = two(key, Shape::Plane, DVec3::Z * 1e9).unwrap();
    let contacts = detect(&above, &CollideOptions::with_mode(Mode::Node)).unwrap();
    assert!(!contacts.is_empty() && contacts.iter().all(|c| (c.distance + 1e9).abs() < 1.0));
}

#[test]
fn scales_out_of_range_are_refused() {
    let mut scene = Scene::new();
    let ball = scene.add_shape(Shape::Sphere { radius: 1.0 }).unwrap();
    for scale in [1e51, 1e200, f64::MAX, 1e-51, 1e-300] {
        let instance = Instance { scale, ..Instance::new(ball, Pose::IDENTITY) };
        let refused = scene.add(instance).unwrap_err().to_string();
        assert!(refused.contains("1e-50 to 1e50"), "{scale}: {refused}");
    }
}
