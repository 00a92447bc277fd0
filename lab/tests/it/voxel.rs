//! Voxel grids: values and gradients against brute force, the order of the error, and the contacts
//! of the detector against direct evaluation.
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use tesdf::collide::{
    CollideError, CollideOptions, Contact, Contacts, Instance, Mode, Placement, Pose, Scene, Shape, detect,
};
use tesdf::encode::Preset;
use tesdf::glam::{DQuat, DVec3};
use tesdf::{Encoder, TeSdf};
use tesdf_lab::voxel::{VoxelDetector, VoxelError, VoxelGrid, VoxelOptions, accuracy};
use tesdf_sim::newton::Detect;

fn encoded(name: &str) -> TeSdf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/procedural").join(name);
    Encoder::new().preset(Preset::Fast).encode_file(path).unwrap()
}

fn grid(asset: &TeSdf, resolution: u32, narrow_band: f64) -> VoxelGrid {
    VoxelGrid::new(asset, VoxelOptions { resolution, narrow_band }, |_| {}).unwrap()
}

/// Random points in the bounds of an asset, grown by a tenth of their diagonal.
fn points(asset: &TeSdf, count: usize) -> Vec<DVec3> {
    let bounds = asset.bounds();
    let bounds = bounds.grown(0.1 * bounds.extent().length());
    let mut random = fastrand::Rng::with_seed(7);
    let mut share = || DVec3::new(random.f64(), random.f64(), random.f64());
    (0..count).map(|_| bounds.min + share() * bounds.extent()).collect()
}

/// Interpolates exact distances at the corners of the cube in which `p` lies. `corner` is a corner of
/// one of the cubes, whose edge is `edge`.
fn interpolated(asset: &TeSdf, p: DVec3, edge: f64, corner: DVec3) -> f64 {
    let cube = ((p - corner) / edge).floor();
    let t = (p - corner) / edge - cube;
    (0..8)
        .map(|k| {
            let offset = DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
            let weight = DVec3::select(offset.cmpeq(DVec3::ONE), t, 1.0 - t).element_product();
            weight * asset.signed_distance(corner + edge * (cube + offset))
        })
        .sum()
}

#[test]
fn values_are_those_of_a_dense_grid_near_the_surface() {
    let asset = encoded("l_bracket.obj");
    let (band, resolution) = (2e-3, 60);
    let grid = grid(&asset, resolution, band);
    let voxel = asset.bounds().extent().max_element() / f64::from(resolution);
    assert_eq!(grid.voxel(), voxel);
    let counts = (asset.bounds().extent() / voxel).ceil() + 9.0;
    assert_eq!(grid.samples().map(|n| n as f64), counts.to_array());
    assert_eq!(grid.dense_bytes() as f64, 4.0 * counts.element_product());
    let corner = asset.bounds().center() - 0.5 * voxel * (counts - 1.0);
    let (mut near, mut far) = (0, 0);
    for p in points(&asset, 40_000) {
        if (p - corner).min_element() < 0.0 || (p - corner - voxel * (counts - 1.0)).max_element() > 0.0 {
            continue;
        }
        let found = grid.value(p);
        let exact = asset.signed_distance(p);
        assert!((found.distance - exact).abs() <= found.slack, "{p}: {found:?}, exact {exact}");
        // Samples are rounded to 32 bits.
        let dense = interpolated(&asset, p, voxel, corner);
        if (found.distance - dense).abs() <= 1e-8 {
            near += usize::from(exact.abs() < band);
            continue;
        }
        assert!(exact.abs() > band, "{p}: {found:?}, dense grid {dense}, exact {exact}");
        let coarse = interpolated(&asset, p, 8.0 * voxel, corner);
        assert!((found.distance - coarse).abs() <= 1e-8, "{p}: {found:?}, coarse grid {coarse}");
        far += 1;
    }
    assert!(near > 3000 && far > 300, "{near} near, {far} far");
    assert!(grid.sparse_bytes() < grid.dense_bytes(), "{} bytes", grid.sparse_bytes());
}

#[test]
fn gradients_agree_with_finite_differences() {
    let asset = encoded("lobed_peg.obj");
    let grid = grid(&asset, 48, 1e-3);
    let step = 1e-9;
    let (mut inside, mut outside) = (0, 0);
    for p in points(&asset, 5000) {
        let found = grid.value(p);
        let difference = |axis: DVec3| {
            let [before, after] = [-step, step].map(|s| grid.value(p + s * axis));
            // A step across the border of a voxel has two gradients.
            let is_smooth = before.gradient.distance(after.gradient) < 1e-3;
            is_smooth.then(|| (after.distance - before.distance) / (2.0 * step))
        };
        let [Some(x), Some(y), Some(z)] = DVec3::AXES.map(difference) else { continue };
        assert!(found.gradient.distance(DVec3::new(x, y, z)) < 1e-4, "{p}: {found:?}, {x} {y} {z}");
        let beyond = (p - asset.bounds().center()).abs() - 0.5 * asset.bounds().extent();
        if beyond.max_element() > 5.0 * grid.voxel() { outside += 1 } else { inside += 1 }
    }
    assert!(inside > 2000 && outside > 100, "{inside} in the grid, {outside} outside");
}

#[test]
fn outside_the_grid_the_way_to_it_is_added() {
    let asset = encoded("cube.obj");
    let grid = grid(&asset, 16, 1e-3);
    // The cube has an edge of 20 mm, and the margin of the grid is four voxels.
    let border = 0.01 + 4.0 * grid.voxel();
    for (p, way) in [(DVec3::X, DVec3::X), (DVec3::new(0.0, -3.0, 0.0), DVec3::NEG_Y)] {
        let found = grid.value(p);
        assert!((found.distance - (p.length() - 0.01)).abs() < 1e-8, "{found:?}");
        assert!(found.gradient.distance(way) < 1e-6, "{found:?}");
    }
    // Over an edge it is more than the distance.
    let p = DVec3::new(border + 0.03, border + 0.04, 0.0);
    let found = grid.value(p).distance;
    let edge = f64::hypot(border - 0.01, border - 0.01);
    assert!((found - (0.05 + edge)).abs() < 1e-8 && found > asset.signed_distance(p), "{found}");
}

#[test]
fn the_error_is_of_second_order_where_the_distance_is_smooth() {
    let asset = encoded("cube.obj");
    // Around an edge of the cube, the distance is that to a line. At the distance r from it, its
    // second derivatives are at most 1 / r, so a voxel has an error of at most h² / 4r.
    let radius = 9e-4;
    let around_edge = |k: usize| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * (k as f64 + 0.5) / 2000.0).sin_cos();
        DVec3::new(0.01 + radius * cos, 0.01 + radius * sin, 4e-6 * (k as f64 - 1000.0))
    };
    let errors = [40, 80].map(|resolution| {
        let grid = grid(&asset, resolution, 2e-3);
        let h = grid.voxel();
        let error = |k| (grid.value(around_edge(k)).distance - asset.signed_distance(around_edge(k))).abs();
        let greatest = (0..2000).map(error).fold(0.0, f64::max);
        let least = radius - 2.0_f64.sqrt() * h;
        assert!(greatest <= h * h / (4.0 * least), "{greatest:e} at {h:e}");
        greatest
    });
    assert!((3.0..5.0).contains(&(errors[0] / errors[1])), "{errors:?}");
}

#[test]
fn the_error_is_of_first_order_at_edges() {
    let asset = encoded("lobed_peg.obj");
    let errors = [32, 64, 128].map(|resolution| {
        let grid = grid(&asset, resolution, 2e-3);
        let found = accuracy(&grid, &asset, 1e-3);
        assert_eq!(found.points, 3456 * (7 * 7 + 8));
        assert!(found.max_error >= found.max_error_on_surface && found.max_error >= found.rms_error);
        found.max_error_on_surface / grid.voxel()
    });
    assert!(errors.iter().all(|e| (0.05..0.5).contains(e)), "{errors:?} voxels");
}

#[test]
fn options_out_of_range_are_refused() {
    let asset = encoded("cube.obj");
    let made = |resolution, narrow_band| {
        VoxelGrid::new(&asset, VoxelOptions { resolution, narrow_band }, |_| {}).map(|_| ())
    };
    assert_eq!(made(0, 0.0), Err(VoxelError::Resolution { found: 0 }));
    assert_eq!(made(4097, 0.0), Err(VoxelError::Resolution { found: 4097 }));
    assert_eq!(made(8, -1.0), Err(VoxelError::NarrowBand { found: -1.0 }));
    assert!(made(8, f64::NAN).is_err());
}

/// A peg in its hole, leaning, with a plane below; and the grids of both.
fn peg_in_hole(resolution: u32) -> (Scene, VoxelDetector, BTreeMap<u32, Arc<VoxelGrid>>) {
    let mut scene = Scene::new();
    let mut grids = BTreeMap::new();
    let mut shapes = Vec::new();
    for name in ["lobed_hole_c100.obj", "lobed_peg.obj"] {
        let asset = Arc::new(encoded(name));
        let shape = scene.add_shape(Shape::Mesh(Arc::clone(&asset))).unwrap();
        grids.insert(shape, Arc::new(grid(&asset, resolution, 1e-3)));
        shapes.push(shape);
    }
    let plane = scene.add_shape(Shape::Plane).unwrap();
    let tilt = DQuat::from_rotation_y(0.004) * DQuat::from_rotation_z(0.01);
    scene.add(Instance::new(shapes[0], Pose { translation: DVec3::X, rotation: tilt })).unwrap();
    let peg = Pose { translation: DVec3::new(5e-5, 0.0, 0.01), rotation: DQuat::IDENTITY };
    let peg = Pose { translation: DVec3::X + tilt * peg.translation, rotation: tilt };
    scene.add(Instance::new(shapes[1], peg)).unwrap();
    let floor = Pose { translation: DVec3::new(0.0, 0.0, 1e-4), rotation: DQuat::IDENTITY };
    scene.add(Instance::new(plane, floor)).unwrap();
    let by_instance = shapes.iter().enumerate().map(|(k, s)| (k as u32, Arc::clone(&grids[s]))).collect();
    (scene, VoxelDetector::new(grids), by_instance)
}

const REACH: f64 = 2e-4;

fn found(scene: &Scene, detector: &VoxelDetector, mode: Mode) -> Contacts {
    let options = CollideOptions { contact_distance: REACH, ..CollideOptions::with_mode(mode) };
    detector.detect(scene, &options).unwrap()
}

fn mesh(scene: &Scene, id: u32) -> (&TeSdf, Placement) {
    let (_, instance) = scene.instances().nth(id as usize).unwrap();
    match scene.shape(instance.shape).unwrap() {
        Shape::Mesh(asset) => (asset, instance.placement()),
        _ => unreachable!("only the first two instances are asked for"),
    }
}

fn of_pair(contacts: &Contacts, a: u32, b: u32) -> Vec<Contact> {
    contacts.iter().filter(|c| (c.instance_a.0, c.instance_b.0) == (a, b)).copied().collect()
}

#[test]
fn nodes_have_the_contacts_of_direct_evaluation() {
    let (scene, detector, grids) = peg_in_hole(64);
    let contacts = found(&scene, &detector, Mode::Node);
    for (a, b) in [(0, 1), (1, 0)] {
        let ((asset, at_a), (_, at_b)) = (mesh(&scene, a), mesh(&scene, b));
        let found = of_pair(&contacts, a, b);
        let mut nodes: Vec<u32> = found.iter().map(|c| c.feature.a).collect();
        nodes.sort_unstable();
        let mut expected = Vec::new();
        for (v, p) in asset.arrays().vertices.iter().enumerate() {
            let world = at_a.to_world(DVec3::from_array(*p));
            let value = grids[&b].value(at_b.to_shape(world));
            if value.distance > REACH {
                continue;
            }
            expected.push(v as u32);
            let contact = found.iter().find(|c| c.feature.a == v as u32).unwrap();
            let normal = at_b.pose.rotation * value.gradient.normalize();
            assert!((contact.distance - value.distance).abs() < 1e-15, "{contact:?}");
            assert!(contact.normal.distance(normal) < 1e-12 && contact.point_a.distance(world) < 1e-12);
            let way = contact.point_a - contact.point_b;
            assert!(way.distance(contact.distance * contact.normal) < 1e-12, "{contact:?}");
        }
        assert_eq!(nodes, expected);
        assert!(expected.len() > 200, "{}", expected.len());
    }
    // Pairs with a simple shape are exact.
    let options = CollideOptions { contact_distance: REACH, ..CollideOptions::with_mode(Mode::Node) };
    let exact = detect(&scene, &options).unwrap();
    assert!(!of_pair(&exact, 0, 2).is_empty());
    for (a, b) in [(0, 2), (2, 0), (1, 2), (2, 1)] {
        assert_eq!(of_pair(&contacts, a, b), of_pair(&exact, a, b));
    }
}

#[test]
fn faces_are_as_low_as_their_corners_and_centres() {
    let (scene, detector, grids) = peg_in_hole(64);
    let contacts = found(&scene, &detector, Mode::face());
    for (a, b) in [(0, 1), (1, 0)] {
        let ((asset, at_a), (_, at_b)) = (mesh(&scene, a), mesh(&scene, b));
        let found = of_pair(&contacts, a, b);
        let arrays = asset.arrays();
        let points: Vec<DVec3> =
            arrays.vertices.iter().map(|p| at_b.to_shape(at_a.to_world(DVec3::from_array(*p)))).collect();
        let mut of_faces = BTreeMap::new();
        for contact in &found {
            let p = at_b.to_shape(contact.point_a);
            assert!((grids[&b].value(p).distance - contact.distance).abs() < 1e-12, "{contact:?}");
            assert!(of_faces.insert(contact.face_a, contact).is_none(), "a face has one contact");
        }
        let is_near = |p: DVec3, q: &Contact| at_b.to_shape(q.point_a).distance(p) < 1e-12;
        for (face, id) in arrays.faces.iter().zip(arrays.face_ids) {
            let [x, y, z] = face.map(|v| points[v as usize]);
            let least = [x, y, z, (x + y + z) / 3.0].map(|p| grids[&b].value(p).distance);
            let least = least.into_iter().fold(f64::INFINITY, f64::min);
            match of_faces.get(id) {
                Some(contact) => assert!(contact.distance <= least + 1e-15, "{contact:?}, {least}"),
                // Faces share the contact of a vertex.
                None => assert!(
                    least > REACH || [x, y, z].iter().any(|&p| found.iter().any(|c| is_near(p, c))),
                    "face {id} has no contact at {least}"
                ),
            }
        }
        assert!(found.len() > 500, "{}", found.len());
    }
}

#[test]
fn fine_grids_have_nearly_exact_contacts() {
    let options = CollideOptions { contact_distance: REACH, ..CollideOptions::with_mode(Mode::Node) };
    let errors = [64, 256].map(|resolution| {
        let (scene, detector, grids) = peg_in_hole(resolution);
        let exact = detect(&scene, &options).unwrap();
        let found = found(&scene, &detector, Mode::Node);
        let bound = [0, 1].map(|id| accuracy(&grids[&id], mesh(&scene, id).0, REACH).max_error);
        let mut greatest = 0.0_f64;
        for (a, b) in [(0, 1), (1, 0)] {
            let exact: BTreeMap<_, _> =
                of_pair(&exact, a, b).iter().map(|c| (c.feature.a, c.distance)).collect();
            for contact in of_pair(&found, a, b) {
                let error = exact.get(&contact.feature.a).map_or(0.0, |d| (d - contact.distance).abs());
                greatest = greatest.max(error);
            }
        }
        assert!(greatest <= bound[0].max(bound[1]), "{greatest:e}, {bound:?}");
        greatest
    });
    assert!(errors[1] < 0.5 * errors[0], "{errors:?}");
}

#[test]
fn contacts_do_not_depend_on_the_number_of_threads() {
    let (scene, detector, _) = peg_in_hole(64);
    for mode in [Mode::Node, Mode::face()] {
        let all = found(&scene, &detector, mode);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(pool.install(|| found(&scene, &detector, mode)), all);
        assert!(all.iter().is_sorted_by_key(|c| {
            let (a, b) = (c.instance_a, c.instance_b);
            (a.min(b), a.max(b), a)
        }));
    }
}

#[test]
fn modes_and_scenes_without_grids_are_refused() {
    let (scene, detector, _) = peg_in_hole(32);
    let error = detector.detect(&scene, &CollideOptions::default()).unwrap_err();
    assert!(error.to_string().contains("a grid has no exact minimum"), "{error}");
    let options = CollideOptions::with_mode(Mode::Node);
    let error = VoxelDetector::new(BTreeMap::new()).detect(&scene, &options).unwrap_err();
    assert!(matches!(error, CollideError::NoShape(_)), "{error}");
}
