//! Meshes with faces that are points or segments, exactly or after rounding: every kernel answers
//! as if these faces were absent.

use crate::compare::{Compared, device, each_mode, hold};
use crate::support::random::Random;
use crate::support::reference::Reference;
use crate::support::shapes::{FAMILIES, Shape as Faces};
use crate::support::tetrahedra::{bare_beam, beam};
use tesdf::TeSdf;
use tesdf::collide::{Instance, Mode, Placement, Pose, Reduction, Scene, Shape};
use tesdf::domain::ConformingMesh;
use tesdf::encode::{Domain, EncodeOptions, Encoder, Preset, Refinement};
use tesdf::geometry::Triangle;
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf_gpu::{Detector, DetectorOptions, DeviceAnswers, DeviceArray, GpuShapes, WorldAnswer};

/// Largest error of a distance, relative to the diagonal.
const DISTANCE: f64 = 2e-6;

fn solid(vertices: Vec<DVec3>, faces: Vec<[u32; 3]>) -> SolidMesh {
    SolidMesh::new(TriangleMesh::new(vertices, faces).expect("valid ids")).expect("a solid")
}

pub fn encoded(solid: &SolidMesh) -> TeSdf {
    Encoder::new().preset(Preset::Fast).encode(solid).expect("encodes")
}

/// The cube from −1 to 1 with additional vertices and faces.
fn cube_and(vertices: &[DVec3], faces: &[[u32; 3]]) -> SolidMesh {
    let mut cube = Faces::default().add_box(-DVec3::ONE, DVec3::ONE, 1);
    cube.vertices.extend(vertices);
    cube.faces.extend(faces);
    solid(cube.vertices, cube.faces)
}

/// A cube whose corner 0 is three vertices with a face between them. Their distances are at most
/// `size`.
fn chamfered(size: f64) -> SolidMesh {
    let Faces { mut vertices, mut faces } = Faces::default().add_box(-DVec3::ONE, DVec3::ONE, 1);
    let corner = vertices[0];
    let other = vertices.len() as u32;
    vertices.push(corner + size * DVec3::X);
    // The first face at the corner takes the new vertex. Two faces without height fill the gaps
    // along its sides.
    let at = faces.iter().position(|f| f.contains(&0)).expect("a corner has faces");
    let k = faces[at].iter().position(|&v| v == 0).expect("it has the corner");
    let (next, last) = (faces[at][(k + 1) % 3], faces[at][(k + 2) % 3]);
    faces[at][k] = other;
    faces.extend([[0, next, other], [other, last, 0]]);
    solid(vertices, faces)
}

/// An icosphere with coordinates rounded to multiples of `step`, so that faces collapse to segments
/// and points.
fn on_a_grid(step: f64) -> SolidMesh {
    let sphere = Faces::default().add_sphere(DVec3::ZERO, 2, || 1.0);
    solid(sphere.vertices.iter().map(|v| (*v / step).round() * step).collect(), sphere.faces)
}

/// A member of a family with some edges shrunk to zero or nearly zero.
fn shrunk(seed: u64) -> SolidMesh {
    let mut random = Random(seed);
    let member = FAMILIES[random.index(FAMILIES.len())].member(seed);
    let mesh = member.mesh();
    let (mut vertices, mut faces) = (mesh.vertices().to_vec(), mesh.faces().to_vec());
    for _ in 0..1 + random.index(6) {
        let [a, b, c] = faces[random.index(faces.len())].map(|v| v as usize);
        let beside = random.power(-17.0, -7.0) * mesh.diagonal() * random.in_cube();
        vertices[a] = match random.index(3) {
            0 => vertices[b],
            1 => vertices[b] + beside,
            _ => 0.3 * vertices[b] + 0.7 * vertices[c] + beside,
        };
    }
    faces.push([random.index(vertices.len()) as u32; 3]);
    // Shrinking an edge can turn a part inside out. Then the member stays as it was.
    SolidMesh::new(TriangleMesh::new(vertices, faces).expect("valid ids")).unwrap_or(member)
}

pub fn solids() -> Vec<(String, SolidMesh)> {
    let far = DVec3::splat(-3.0);
    let mut all = vec![
        ("a face of one vertex".to_owned(), cube_and(&[], &[[1, 1, 1], [6, 6, 6]])),
        ("a facet of zeros".to_owned(), cube_and(&[far], &[[8, 8, 8]])),
        ("a face of two vertices".to_owned(), cube_and(&[], &[[1, 1, 3], [3, 1, 1]])),
    ];
    all.extend([1e-3, 1e-7, 2e-8, 1e-9, 1e-15].map(|s| (format!("a chamfer of {s}"), chamfered(s))));
    all.extend([0.4, 0.25].map(|s| (format!("on a grid of {s}"), on_a_grid(s))));
    all.extend((0..12).map(|seed| (format!("shrunk {seed}"), shrunk(seed))));
    all
}

fn check_answer(name: &str, p: DVec3, answer: &WorldAnswer, expected: f64, size: f64) {
    let off = (answer.signed_distance - expected).abs();
    assert!(off <= DISTANCE * size, "{name}: {p}: {} instead of {expected}", answer.signed_distance);
    assert!((answer.gradient.length() - 1.0).abs() < 1e-5, "{name}: {p}: gradient {}", answer.gradient);
    assert!(answer.closest_point.is_finite(), "{name}: {p}");
}

#[test]
fn distances_and_gradients() {
    let device = device();
    let mut random = Random(5);
    for (name, solid) in solids() {
        let (asset, reference) = (encoded(&solid), Reference::new(solid.mesh()));
        let shape = Shape::from(asset);
        let on_device = GpuShapes::upload(&device, std::slice::from_ref(&shape)).expect("fits");
        let id = on_device.ids()[0];
        let bounds = shape.bounds();
        let mut points: Vec<DVec3> =
            (0..500).map(|_| bounds.center() + 0.8 * bounds.extent() * random.in_cube()).collect();
        // Points on vertices and edges, also of faces without area, and points very near to them.
        for face in 0..solid.mesh().faces().len() {
            let [a, b, _] = solid.mesh().triangle(face);
            points.extend([a, a.midpoint(b), a + 1e-7 * shape.diagonal() * random.direction()]);
        }
        let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
        let answers = on_device.signed_distances(&points, &[(id, at)]).expect("answers").remove(0);
        for (p, answer) in points.iter().zip(&answers) {
            let expected = reference.signed_distance(*p);
            check_answer(&name, *p, answer, expected, shape.diagonal() + expected.abs());
        }
        // Check the kernel that computes in the world frame.
        let flat: Vec<f32> = points.iter().flat_map(|p| p.as_vec3().to_array()).collect();
        let uploaded = DeviceArray::upload(&device, &flat).expect("fits");
        let arrays = DeviceAnswers::empty(&device, points.len()).expect("fits");
        on_device.signed_distances_into(&uploaded, &[(id, at)], &arrays).expect("fits");
        let gradients = arrays.gradients.read(&device).expect("answers");
        for g in gradients.chunks(3) {
            let length = g.iter().map(|x| x * x).sum::<f32>().sqrt();
            assert!((length - 1.0).abs() < 1e-5, "{name}: {g:?}");
        }
    }
}

#[test]
fn contacts_are_those_of_the_host() {
    let mut random = Random(6);
    let (mut sure, mut frank_wolfe) = (Compared::default(), Compared::default());
    for (k, (name, solid)) in solids().into_iter().enumerate() {
        let (asset, diagonal) = (encoded(&solid), solid.mesh().diagonal());
        let mut scene = Scene::new();
        let shape = scene.add_shape(asset).expect("a mesh is a shape");
        // The same body is surface and field, so both are degenerate.
        let rotation = DQuat::from_axis_angle(random.direction(), random.between(0.0, 2.0));
        let translation = 0.4 * diagonal * random.in_cube();
        for pose in [Pose::IDENTITY, Pose { translation, rotation }] {
            scene.add(Instance::new(shape, pose)).expect("a pose");
        }
        // The exact mode is slow on the software driver.
        let modes = each_mode(diagonal);
        for options in &modes[..if k % 4 == 0 { modes.len() } else { 3 }] {
            let one = hold(&scene, options, diagonal);
            println!("{name}, {:?}: {one:?}", options.mode);
            match options.mode {
                Mode::Face { .. } => frank_wolfe.add(one),
                _ => sure.add(one),
            }
        }
        let reduced = tesdf::collide::CollideOptions { reduction: Reduction::PerPair(8), ..modes[0] };
        let mut detector = Detector::new(&device(), &scene, DetectorOptions::default()).expect("fits");
        let found = detector.detect(&scene, &reduced).expect("detects");
        assert!(found.iter().all(|c| (c.normal.length() - 1.0).abs() < 1e-5), "{name}");
        assert!(
            found.reductions.iter().all(|r| r.wrench_error.is_finite() && r.length.is_finite()),
            "{name}"
        );
    }
    sure.is_good(200);
    // Frank–Wolfe may step in another direction at ties, and these shapes have many ties.
    assert!(frank_wolfe.touching > 500 && frank_wolfe.others * 20 < frank_wolfe.touching, "{frank_wolfe:?}");
    assert!(frank_wolfe.differing * 50 < frank_wolfe.cells, "{frank_wolfe:?}");
}

/// Moves vertices on the device until faces and tetrahedra are points and segments.
#[test]
fn faces_that_collapse_on_the_device_count_as_their_edges() {
    let device = device();
    let mut random = Random(7);
    for (solid, domain) in [beam(), bare_beam()] {
        let options = EncodeOptions { refinement: Refinement::None, ..EncodeOptions::preset(Preset::Fast) };
        let domain_of = Domain::Conforming(&domain);
        let rest = Encoder::new().options(options).domain(domain_of).encode(&solid).expect("valid options");
        let shape = Shape::from(rest);
        let (bounds, diagonal) = (shape.bounds(), shape.diagonal());
        let middle = bounds.center();
        // Collapses one end to a point, and all to a plane, to a line, and to the width of a
        // needle.
        let collapses: [&dyn Fn(DVec3) -> DVec3; 4] = [
            &|p| if p.x > middle.x { bounds.max } else { p },
            &|p| p.with_z(middle.z),
            &|p| p.with_z(middle.z).with_x(middle.x),
            &|p| p.with_z(middle.z + 1e-8 * (p.z - middle.z)),
        ];
        for (k, collapse) in collapses.into_iter().enumerate() {
            let mut on_device = GpuShapes::upload(&device, std::slice::from_ref(&shape)).expect("fits");
            let id = on_device.ids()[0];
            let positions = positions(&domain, collapse);
            let array = DeviceArray::upload(&device, &positions).expect("fits");
            on_device.move_vertices(id, &array).expect("as many vertices");
            let corner = |v: &u32| {
                let at = 3 * *v as usize;
                DVec3::new(positions[at].into(), positions[at + 1].into(), positions[at + 2].into())
            };
            let faces: Vec<Triangle> = solid
                .mesh()
                .faces()
                .iter()
                .map(|f| Triangle::new([0, 1, 2].map(|k| corner(&f[k]))))
                .collect();
            // These points are outside of all tetrahedra. There the face tree answers, exactly.
            let out = |random: &mut Random| middle + random.between(0.8, 1.5) * diagonal * random.direction();
            let points: Vec<DVec3> = (0..300).map(|_| out(&mut random)).collect();
            let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
            let answers = on_device.signed_distances(&points, &[(id, at)]).expect("answers").remove(0);
            for (p, answer) in points.iter().zip(&answers) {
                let least = faces.iter().map(|t| t.closest(*p).distance).fold(f64::INFINITY, f64::min);
                check_answer(&format!("collapse {k}"), *p, answer, least, 2.0 * diagonal);
            }
            // Points on the collapsed faces.
            let points: Vec<DVec3> = faces.iter().map(|t| t.corners[0]).collect();
            let answers = on_device.signed_distances(&points, &[(id, at)]).expect("answers").remove(0);
            for (p, answer) in points.iter().zip(&answers) {
                assert!((answer.gradient.length() - 1.0).abs() < 1e-5, "collapse {k}: {p}: {answer:?}");
                assert!(answer.signed_distance.is_finite());
            }
        }
    }
}

/// All vertices of a domain, as the device takes them.
fn positions(domain: &ConformingMesh, to: impl Fn(DVec3) -> DVec3) -> Vec<f32> {
    domain.vertices().iter().flat_map(|&p| to(p).as_vec3().to_array()).collect()
}
