//! Moved vertices: distances, stale cells and contacts, compared with the moved mesh itself.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use crate::support::meshes;
use crate::support::random::Random;
use crate::support::shapes::Shape;
use crate::support::tetrahedra::{bare_beam, beam, bend, moves};
use tesdf::TeSdf;
use tesdf::collide::{CollideOptions, Contact, Instance, InstanceId, Mode, Pose, Scene, detect};
use tesdf::deform::DeformError;
use tesdf::domain::ConformingMesh;
use tesdf::encode::{Deformation, Domain, EncodeOptions, Encoder, Preset, Refinement};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf::verify::{VerifyOptions, VerifyReport, verify};

fn options() -> EncodeOptions {
    EncodeOptions { refinement: Refinement::None, ..EncodeOptions::preset(Preset::Fast) }
}

fn encoded(solid: &SolidMesh, domain: &ConformingMesh, options: &EncodeOptions) -> TeSdf {
    Encoder::new()
        .options(options.clone())
        .domain(Domain::Conforming(domain))
        .encode(solid)
        .expect("valid options")
}

fn verified(asset: &TeSdf) -> VerifyReport {
    verify(asset, &VerifyOptions { samples: 3000, seed: 3 }, |_| ControlFlow::Continue(()))
        .expect("a valid mesh")
}

fn moved(solid: &SolidMesh, to: impl Fn(DVec3) -> DVec3) -> SolidMesh {
    let mesh = solid.mesh();
    let vertices = mesh.vertices().iter().map(|&p| to(p)).collect();
    SolidMesh::new(TriangleMesh::new(vertices, mesh.faces().to_vec()).expect("as before"))
        .expect("a mild bend")
}

#[test]
fn lists_hold_again_after_re_encoding() {
    let (solid, domain) = beam();
    let around = EncodeOptions { deformation: Deformation::Expected, ..options() };
    let few = EncodeOptions { max_entries: Some(40), ..around.clone() };
    let by_cost = EncodeOptions { refinement: Refinement::ByCost, byte_worth: 0.02, ..options() };
    let mut errors = Vec::new();
    for options in [options(), around, few, by_cost] {
        let mut asset = encoded(&solid, &domain, &options);
        assert!(asset.stale_cells().expect("a mesh").is_empty());
        let moved = asset.move_vertices(&moves(&domain, bend)).expect("moderate");
        assert!(moved.inverted.is_empty());
        let before = verified(&asset);
        // Only signs are promised now, but wrong distances do not pass.
        let signs = before.precisions.iter().map(|p| p.sign_mistakes).sum::<usize>();
        assert!(signs == 0 && asset.about().certificate().delta().is_none(), "{before:#?}");
        let wrong = before.precisions[1].distance_mistakes;
        assert!(wrong == 0 || !before.passed, "{before:#?}");
        errors.push(before.precisions[1].largest_error_beyond.expect("no promise"));

        let stale = asset.stale_cells().expect("a mesh");
        let reencoded = asset.reencode_stale().expect("room for lists");
        assert_eq!(reencoded.stale, stale);
        assert!(!stale.is_empty() && stale.len() < reencoded.cells);
        assert!(asset.stale_cells().expect("a mesh").is_empty());
        let after = verified(&asset);
        assert!(after.passed && asset.about().certificate().delta().is_some(), "{after:#?}");
        if options.max_entries.is_none() {
            assert!(after.precisions.iter().all(|p| p.largest_error_beyond.is_none()));
        }

        let path = std::env::temp_dir().join(format!("tesdf-bent-{}-{}", std::process::id(), errors.len()));
        asset.save(&path).expect("a temporary file");
        let opened = TeSdf::open(&path).expect("what was saved opens");
        opened.verify_checksums().expect("whole");
        std::fs::remove_file(&path).expect("it was there");
        let mut random = Random(1);
        for _ in 0..2000 {
            let p = 4.0 + 4.0 * random.in_cube();
            assert_eq!(opened.query(p), asset.query(p));
        }
    }
    assert!(errors[0] > 1e-3, "the bend is too mild to be a test: {errors:?}");
}

#[test]
fn lists_for_deformation_have_fewer_errors_near_the_surface() {
    let (solid, domain) = beam();
    let twist = |p: DVec3| {
        let axis = DVec3::new(p.x, 4.0, 4.0);
        axis + DQuat::from_rotation_x(0.15 * (p.x - 1.0)) * (p - axis)
    };
    let wrong = |deformation| {
        let mut asset = encoded(&solid, &domain, &EncodeOptions { deformation, ..options() });
        asset.move_vertices(&moves(&domain, |p| twist(bend(p)))).expect("moderate");
        let mesh = moved(&solid, |p| twist(bend(p)));
        let mut random = Random(9);
        (0..4000)
            .filter(|k| {
                let [a, b, c] = mesh.mesh().triangle(k % mesh.mesh().faces().len());
                let [u, v, w, _] = random.weights();
                let on = (u * a + v * b + w * c) / (u + v + w);
                let p = on + random.between(-0.2, 0.2) * (b - a).cross(c - a).normalize();
                let found = asset.query(p).signed_distance.abs();
                found > asset.query_by_tree(p).signed_distance.abs() + 1e-9
            })
            .count()
    };
    let (plain, augmented) = (wrong(Deformation::None), wrong(Deformation::Expected));
    assert!(plain > 0 && augmented < plain, "{plain} points are wrong without them, {augmented} with");
}

#[test]
fn only_cells_near_moved_vertices_are_checked() {
    let (solid, domain) = beam();
    let mut asset = encoded(&solid, &domain, &options());
    let dent = |p: DVec3| if p.distance(DVec3::new(7.0, 5.0, 5.0)) < 0.5 { p - 0.1 } else { p };
    let count = moves(&domain, dent).len();
    let moved = asset.move_vertices(&moves(&domain, dent)).expect("moderate");
    assert!(count == 1 && moved.faces < 12 && moved.tetrahedra < 40 && moved.inverted.is_empty());
    let reencoded = asset.reencode_stale().expect("room for lists");
    assert!(reencoded.checked < reencoded.cells * 2 / 3, "{} of {}", reencoded.checked, reencoded.cells);
    assert!(reencoded.stale.len() * 8 < reencoded.cells, "{} of {}", reencoded.stale.len(), reencoded.cells);
    assert!(verified(&asset).passed);
    // Moving back in steps gives the same result as encoding the original.
    let back: Vec<_> =
        moves(&domain, dent).iter().map(|&(id, _)| (id, domain.vertices()[id as usize])).collect();
    asset.move_vertices(&back).expect("moderate");
    asset.reencode_stale().expect("room for lists");
    let rest = encoded(&solid, &domain, &options());
    let mut random = Random(2);
    for _ in 0..3000 {
        let p = 4.0 + 4.0 * random.in_cube();
        let (found, expected) = (asset.query(p), rest.query(p));
        assert!((found.signed_distance - expected.signed_distance).abs() < 1e-14, "{p}");
    }
}

#[test]
fn inverted_tetrahedra_are_reported() {
    let (solid, domain) = beam();
    let mut asset = encoded(&solid, &domain, &options());
    let vertex = (0..domain.vertices().len() as u32)
        .find(|&v| domain.vertices()[v as usize].distance(DVec3::new(4.0, 6.0, 4.0)) < 0.3)
        .expect("a vertex of the outer layer");
    let moved = asset.move_vertices(&[(vertex, DVec3::new(4.0, 7.9, 4.0))]).expect("within the domain");
    let inverted: Vec<u32> = (0..domain.tetrahedra().len() as u32)
        .filter(|&t| {
            let corners = domain.tetrahedra()[t as usize]
                .map(|v| if v == vertex { DVec3::new(4.0, 7.9, 4.0) } else { domain.vertices()[v as usize] });
            let [a, b, c, d] = corners;
            (b - a).cross(c - a).dot(d - a) <= 0.0
        })
        .collect();
    assert!(!inverted.is_empty());
    assert_eq!(moved.inverted, inverted);
}

#[test]
fn refused_moves_change_nothing() {
    let (solid, domain) = beam();
    let mut asset = encoded(&solid, &domain, &options());
    let count = domain.vertices().len();
    let bad = [(0, DVec3::splat(3.0)), (count as u32, DVec3::ZERO)];
    assert_eq!(asset.move_vertices(&bad), Err(DeformError::Vertex { vertex: count as u32, count }));
    for position in [DVec3::NAN, DVec3::splat(1e6)] {
        assert!(matches!(
            asset.move_vertices(&[(1, position)]),
            Err(DeformError::Position { vertex: 1, .. })
        ));
    }
    let p = DVec3::splat(4.2);
    let rest = encoded(&solid, &domain, &options());
    assert_eq!(asset.query(p), rest.query(p));
    let mut bisected = meshes::encoded(&solid);
    assert_eq!(bisected.move_vertices(&[]), Err(DeformError::NotConforming));
}

/// The least distance of each face with contacts, by instance.
fn lowest(scene: &Scene, options: &CollideOptions) -> BTreeMap<(u32, u32), f64> {
    let mut lowest = BTreeMap::new();
    for c in detect(scene, options).expect("a good scene") {
        let least: &mut f64 = lowest.entry((c.instance_a.0, c.face_a)).or_insert(f64::INFINITY);
        *least = least.min(c.distance);
    }
    lowest
}

fn assert_same(
    found: &BTreeMap<(u32, u32), f64>,
    expected: &BTreeMap<(u32, u32), f64>,
    limit: f64,
    band: f64,
) {
    assert!(expected.len() > 20, "{} faces touch", expected.len());
    for (face, distance) in expected.iter().filter(|(_, d)| **d < limit - band) {
        let other = found.get(face).copied().unwrap_or(f64::NAN);
        assert!((other - distance).abs() < band, "face {face:?}: {other}, expected {distance}");
    }
    for (face, distance) in found.iter().filter(|(_, d)| **d < limit - band) {
        assert!(expected.contains_key(face), "face {face:?} at {distance} is made up");
    }
}

#[test]
fn contacts_in_conforming_and_bisection_domains_agree() {
    for (solid, domain) in [beam(), bare_beam()] {
        let ball = Shape::default().add_sphere(DVec3::ZERO, 2, || 1.1).solid();
        let by_cost = EncodeOptions { refinement: Refinement::ByCost, byte_worth: 0.02, ..options() };
        let scene_of = |beam: TeSdf| {
            let mut scene = Scene::new();
            let beam = scene.add_shape(beam).expect("a shape");
            let ball = scene.add_shape(meshes::encoded(&ball)).expect("a shape");
            scene.add(Instance::new(beam, Pose::IDENTITY)).expect("a pose");
            scene.add(Instance::new(ball, Pose::at(DVec3::new(4.2, 5.6, 4.3)))).expect("a pose");
            (scene, beam)
        };
        for contact_distance in [0.0, 0.3] {
            for mode in [Mode::exact(), Mode::Node] {
                let options = CollideOptions { contact_distance, ..CollideOptions::with_mode(mode) };
                for encoding in [self::options(), by_cost.clone()] {
                    let conforming = lowest(&scene_of(encoded(&solid, &domain, &encoding)).0, &options);
                    let expected = lowest(&scene_of(meshes::encoded(&solid)).0, &options);
                    assert_same(&conforming, &expected, contact_distance, 1e-6);
                }
            }
        }
        // When the scene deforms its beam, the contacts are those of the deformed mesh.
        let (mut scene, beam) = scene_of(encoded(&solid, &domain, &self::options()));
        let mesh = scene.mesh_mut(beam).expect("a mesh");
        mesh.move_vertices(&moves(&domain, bend)).expect("moderate");
        mesh.reencode_stale().expect("room for lists");
        let bent = scene_of(meshes::encoded(&moved(&solid, bend))).0;
        let options = CollideOptions { contact_distance: 0.1, ..CollideOptions::default() };
        assert_same(&lowest(&scene, &options), &lowest(&bent, &options), 0.1, 1e-6);
    }
}

#[test]
fn no_contact_is_lost_with_truncated_lists() {
    // A ball inside a block: deep inside, truncated lists overestimate distances, so no bounding
    // ball may be ruled out by them.
    let block = Shape::default().add_box(DVec3::splat(-2.0), DVec3::splat(2.0), 6).solid();
    let ball = Shape::default().add_sphere(DVec3::ZERO, 2, || 1.0).solid();
    let encoded = |solid: &SolidMesh, max_entries| {
        let options = EncodeOptions { max_entries, ..EncodeOptions::preset(Preset::Fast) };
        Encoder::new().options(options).encode(solid).expect("encodes")
    };
    let above = DVec3::new(0.1, 0.2, 2.4);
    let corners = |InstanceId(id), face| match id {
        0 => block.mesh().triangle(face as usize),
        _ => ball.mesh().triangle(face as usize).map(|p| p + above),
    };
    let scene_of = |most| {
        let mut scene = Scene::new();
        let (block, ball) = (encoded(&block, most), encoded(&ball, most));
        assert_eq!(ball.about().certificate().truncated(), most.is_some());
        let (block, ball) =
            (scene.add_shape(block).expect("a shape"), scene.add_shape(ball).expect("a shape"));
        scene.add(Instance::new(block, Pose::IDENTITY)).expect("a pose");
        scene.add(Instance::new(ball, Pose::at(above))).expect("a pose");
        let options = CollideOptions { contact_distance: 0.02, ..CollideOptions::default() };
        detect(&scene, &options).expect("a good scene").into_vec()
    };
    let (cut, whole) = (scene_of(Some(12)), scene_of(None));
    for c in &whole {
        // The contact at a vertex is that of one of its faces. Which one, and whether a face is lowest
        // there, depends on lists.
        let is_at = |other: &Contact| corners(c.instance_a, c.face_a).contains(&other.point_a);
        let is_same =
            |other: &Contact| other.instance_a == c.instance_a && (other.face_a == c.face_a || is_at(other));
        assert!(cut.iter().any(is_same), "{c:?} is lost");
    }
}
