//! Contacts, clearance and time of impact of sheets, of shells inside out and of boundaries of overlaps,
//! against brute force over all faces.
mod support;

use std::sync::Arc;

use support::brute_inside::BruteInside;
use support::parts::Turn::{Inward, Outward};
use support::parts::{Parts, bowl};
use support::random::Random;
use tesdf::TeSdf;
use tesdf::base::{Inside, InsideRule, SurfaceFaces};
use tesdf::collide::{
    ClearanceOptions, CollideError, CollideOptions, Instance, Mode, Motion, Pose, Reduction, Scene, Shape,
    TimeOfImpactOptions, Velocity, clearance, detect, time_of_impact,
};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};

/// A body with its brute force.
struct Body {
    mesh: TriangleMesh,
    asset: Arc<TeSdf>,
    brute: BruteInside,
    half: f64,
}

impl Body {
    fn new(mesh: TriangleMesh, inside: Inside) -> Self {
        let solid = SolidMesh::with_inside(mesh.clone(), inside).expect("a solid");
        let asset = Arc::new(Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes"));
        let ids = (0..asset.face_count()).map(|at| asset.face_id(at));
        let brute = BruteInside::new(&mesh, inside.rule, ids);
        Self { mesh, asset, brute, half: inside.rule.half_thickness() }
    }

    fn sheet(mesh: TriangleMesh, thickness: f64) -> Self {
        Self::new(mesh, InsideRule::Sheet { thickness }.into())
    }

    /// The signed distance by brute force.
    fn signed_distance(&self, p: DVec3) -> f64 {
        let distance = self.brute.distance(p);
        if self.brute.is_inside(p) == Some(true) { -distance } else { distance - self.half }
    }

    /// Random points of the faces that are the surface.
    fn on_faces(&self, n: usize) -> Vec<DVec3> {
        let mut random = Random(2);
        let faces = self.asset.face_count();
        let on = |i: usize| {
            let [u, v, w] = random.weights::<3>();
            let [a, b, c] = self.asset.face_corners(i % faces);
            u * a + v * b + w * c
        };
        (0..n).map(on).collect()
    }
}

fn inverse(pose: &Pose, p: DVec3) -> DVec3 {
    pose.rotation.inverse() * (p - pose.translation)
}

/// Compares the contacts of all modes with brute force: each contact has the distance of its point, and
/// none is missing that is deeper.
fn assert_contacts(a: &Body, b: &Body, poses: [Pose; 2]) {
    let mut scene = Scene::new();
    let shapes = [a, b].map(|body| scene.add_shape(body.asset.clone()).expect("a shape"));
    let ids = [0, 1].map(|k| scene.add(Instance::new(shapes[k], poses[k])).expect("an instance"));
    let size = a.mesh.diagonal().max(b.mesh.diagonal());
    let tolerance = 1e-5 * size;
    // The least distance over samples of both surfaces.
    let least = |of: &Body, field: &Body, from: &Pose, to: &Pose| {
        let world = |p: DVec3| from.rotation * p + from.translation;
        let distance = |p: DVec3| field.signed_distance(inverse(to, world(p))) - of.half;
        of.on_faces(1500).into_iter().map(distance).fold(f64::INFINITY, f64::min)
    };
    let sampled = [least(a, b, &poses[0], &poses[1]), least(b, a, &poses[1], &poses[0])];
    for mode in [Mode::Exact, Mode::Face, Mode::Node, Mode::Edge] {
        let options = CollideOptions {
            contact_distance: 0.5 * size,
            cos_theta: None,
            ..CollideOptions::with_mode(mode)
        };
        let found = detect(&scene, &options).expect("contacts");
        for contact in found.iter() {
            let [of, field, pose] = if contact.instance_a == ids[0] { [0, 1, 1] } else { [1, 0, 0] };
            let ([of, field], pose) = ([[a, b][of], [a, b][field]], &poses[pose]);
            let core = contact.point_a + of.half * contact.normal;
            let expected = field.signed_distance(inverse(pose, core)) - of.half;
            assert!((contact.distance - expected).abs() <= tolerance, "{mode:?}: {expected} {contact:?}");
            let apart = contact.point_a - contact.point_b;
            assert!(
                (apart - contact.distance * contact.normal).length() <= 1e-4 * size,
                "{mode:?}: {contact:?}"
            );
        }
        let deepest = found.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
        if mode == Mode::Exact {
            let sampled = sampled[0].min(sampled[1]);
            assert!(deepest <= sampled + tolerance, "{deepest} {sampled}");
            let kept = CollideOptions { reduction: Reduction::Deepest(3), ..options };
            let kept = detect(&scene, &kept).expect("contacts");
            let least = kept.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
            assert!((least - deepest).abs() <= tolerance, "{least} {deepest}");
        }
    }
    let found = clearance(&scene, ids[0], ids[1], &ClearanceOptions::default()).expect("a clearance");
    let sampled = sampled[0].min(sampled[1]);
    assert!(found.distance <= sampled + tolerance, "{} {sampled}", found.distance);
    let field = [b, a][usize::from(found.field == ids[0])];
    let (of, pose, point, normal) = match found.field == ids[1] {
        true => (a, &poses[1], found.point_a, found.normal),
        false => (b, &poses[0], found.point_b, -found.normal),
    };
    let expected = field.signed_distance(inverse(pose, point + of.half * normal)) - of.half;
    assert!((found.distance - expected).abs() <= tolerance, "{expected} {found:?}");
}

fn random_pose(random: &mut Random, apart: f64) -> Pose {
    let axis = random.direction();
    Pose::new(apart * random.direction(), DQuat::from_axis_angle(axis, random.between(0.0, 3.0)))
        .expect("a pose")
}

fn cup() -> TriangleMesh {
    Parts::default().open_cube(DVec3::splat(-0.5), 1.0, Outward).mesh()
}

fn box_of(edge: f64) -> Body {
    let mesh = Parts::default().cube(DVec3::splat(-0.5 * edge), edge, Outward).mesh();
    Body::new(mesh, Inside::default())
}

#[test]
fn sheets_touch_as_solids_of_their_thickness() {
    let bodies = [Body::sheet(cup(), 0.1), Body::sheet(bowl(5, 3).mesh(), 0.2), box_of(0.6)];
    let mut random = Random(4);
    for (i, j) in [(0, 2), (1, 2), (0, 1), (1, 1)] {
        for apart in [0.4, 0.9, 1.3] {
            let poses = [random_pose(&mut random, 0.1), random_pose(&mut random, apart)];
            assert_contacts(&bodies[i], &bodies[j], poses);
        }
    }
}

#[test]
fn shells_inside_out_and_boundaries_touch_as_solids() {
    let inward = Parts::default().cube(DVec3::splat(-0.5), 1.0, Inward).mesh();
    let shifted =
        Parts { vertices: bowl(6, 6).vertices.iter().map(|&v| v + 0.7 * DVec3::X).collect(), ..bowl(6, 6) };
    let spheres = bowl(6, 6).add(&shifted.vertices, &shifted.faces, Outward).mesh();
    let boundary = Inside { rule: InsideRule::Winding, surface: SurfaceFaces::Boundary };
    let bodies = [Body::new(inward, InsideRule::Nonzero.into()), Body::new(spheres, boundary), box_of(0.6)];
    let mut random = Random(6);
    for (i, j) in [(0, 2), (1, 2), (0, 1)] {
        for apart in [0.5, 1.0, 1.6] {
            let poses = [random_pose(&mut random, 0.1), random_pose(&mut random, apart)];
            assert_contacts(&bodies[i], &bodies[j], poses);
        }
    }
}

#[test]
fn a_sheet_and_a_box_have_the_clearance_and_impact_of_formulas() {
    let plate = Parts {
        vertices: vec![-DVec3::X - DVec3::Y, DVec3::X - DVec3::Y, DVec3::X + DVec3::Y, DVec3::Y - DVec3::X],
        faces: vec![[0, 1, 2], [0, 2, 3]],
    };
    let plate = Body::sheet(plate.mesh(), 0.2);
    for side in [1.0, -1.0] {
        for shape in [
            Shape::from(box_of(0.5).asset),
            Shape::Box { half_extents: DVec3::splat(0.25) },
            Shape::Sphere { radius: 0.25 },
        ] {
            let mut scene = Scene::new();
            let shapes = [
                scene.add_shape(plate.asset.clone()).expect("a sheet"),
                scene.add_shape(shape).expect("a box"),
            ];
            let a = scene
                .add(Instance { scale: 2.0, ..Instance::new(shapes[0], Pose::IDENTITY) })
                .expect("added");
            let b = scene.add(Instance::new(shapes[1], Pose::at(DVec3::new(0.1, 0.2, side)))).expect("added");
            let found = clearance(&scene, a, b, &ClearanceOptions::default()).expect("a clearance");
            assert!((found.distance - 0.55).abs() < 1e-6, "{found:?}");
            assert!(
                (found.point_a.z - 0.2 * side).abs() < 1e-6 && (found.point_b.z - 0.75 * side).abs() < 1e-6,
                "{found:?}"
            );
            let down = Velocity { linear: -2.0 * side * DVec3::Z, angular: DVec3::ZERO };
            let (still, down) =
                (Motion::Linear { velocity: Velocity::default() }, Motion::Linear { velocity: down });
            let options = TimeOfImpactOptions { end: 1.0, ..TimeOfImpactOptions::default() };
            let impact =
                time_of_impact(&scene, a, b, still, down, &options).expect("an answer").expect("an impact");
            assert!((impact.time - 0.275).abs() < 1e-4, "{impact:?}");
            let options = CollideOptions { contact_distance: 0.6, ..CollideOptions::default() };
            let contacts = detect(&scene, &options).expect("contacts");
            assert!(!contacts.is_empty());
            for contact in contacts.iter() {
                // The search for a contact ends within its tolerance, beside the nearest point of a sphere.
                assert!(contact.distance > 0.55 - 1e-5 && contact.distance < 0.6, "{contact:?}");
                let from_sheet = if contact.instance_a == a { -side } else { side };
                assert!(contact.normal.z * from_sheet > 0.99, "{contact:?}");
            }
        }
    }
}

#[test]
fn bodies_whose_contacts_are_not_known_are_refused() {
    let solid = SolidMesh::with_inside(cup(), InsideRule::Generalized.into()).expect("any mesh");
    let open = Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes");
    let overlap = Parts::default().cube(DVec3::ZERO, 2.0, Outward).cube(DVec3::ONE, 2.0, Outward).mesh();
    let solid = SolidMesh::with_inside(overlap, InsideRule::Odd.into()).expect("closed");
    let odd = Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes");
    for (asset, says) in [(open, "jumps"), (odd, "in front of them")] {
        let error = Scene::new().add_shape(asset).expect_err("refused");
        assert!(matches!(error, CollideError::Shape { .. }) && error.to_string().contains(says), "{error}");
    }
}
