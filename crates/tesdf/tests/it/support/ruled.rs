//! Bodies under every rule of what is inside, and their contacts against brute force over all faces.
use std::sync::Arc;

use super::brute_inside::BruteInside;
use super::random::Random;
use tesdf::TeSdf;
use tesdf::base::{Inside, InsideRule};
use tesdf::collide::{
    ClearanceOptions, CollideOptions, ContactsPer, Instance, Mode, Pose, Scene, clearance, detect,
};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};

/// A body with its brute force.
pub struct Body {
    pub mesh: TriangleMesh,
    pub asset: Arc<TeSdf>,
    pub brute: BruteInside,
    pub half: f64,
}

impl Body {
    pub fn new(mesh: TriangleMesh, inside: Inside) -> Self {
        let solid = SolidMesh::with_inside(mesh.clone(), inside).expect("a solid");
        let asset = Arc::new(Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes"));
        let ids = (0..asset.face_count()).map(|at| asset.face_id(at));
        let brute = BruteInside::new(&mesh, inside.rule, ids);
        Self { mesh, asset, brute, half: inside.rule.half_thickness() }
    }

    pub fn sheet(mesh: TriangleMesh, thickness: f64) -> Self {
        Self::new(mesh, InsideRule::Sheet { thickness }.into())
    }

    /// The signed distance by brute force.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        let distance = self.brute.distance(p);
        if self.brute.is_inside(p) == Some(true) { -distance } else { distance - self.half }
    }

    /// The least and the greatest value that the signed distance may have: both signs at a jump.
    pub fn bounds_of_distance(&self, p: DVec3) -> [f64; 2] {
        let distance = self.brute.distance(p);
        match self.brute.is_inside(p) {
            Some(true) => [-distance; 2],
            Some(false) => [distance - self.half; 2],
            None => [-distance, distance],
        }
    }

    /// The outward normals that a face may have at a point of it: both where both its sides are alike.
    pub fn outward(&self, face: u32, p: DVec3) -> Vec<DVec3> {
        let [a, b, c] = self.mesh.triangle(face as usize);
        let normal = (b - a).cross(c - a).normalize();
        let size = self.mesh.diagonal();
        let is_inside = |q: DVec3| self.brute.is_inside(q);
        let around = [a, b, c].map(|corner| {
            let way = 0.5 * (corner + (a + b + c) / 3.0) - p;
            p + way * (1e-4 * size / way.length().max(1e-4 * size))
        });
        let mut normals = Vec::new();
        for side in [1.0, -1.0] {
            let step = 1e-7 * side * size * normal;
            if !around.iter().all(|q| is_inside(q + step) == Some(true) && is_inside(q - step) == Some(false))
            {
                normals.push(side * normal);
            }
        }
        normals
    }

    /// Random points of the faces that are the surface.
    pub fn on_faces(&self, n: usize) -> Vec<DVec3> {
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

pub fn inverse(pose: &Pose, p: DVec3) -> DVec3 {
    pose.rotation.inverse() * (p - pose.translation)
}

/// Compares the contacts of all modes with brute force: each contact has the distance of its point, and
/// none is missing that is deeper.
pub fn assert_contacts(a: &Body, b: &Body, poses: [Pose; 2]) {
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
    for mode in [Mode::exact(), Mode::face(), Mode::Node] {
        let options = CollideOptions { contact_distance: 0.5 * size, ..CollideOptions::with_mode(mode) };
        let found = detect(&scene, &options).expect("contacts");
        for contact in found.iter() {
            let [of, field, pose] = if contact.instance_a == ids[0] { [0, 1, 1] } else { [1, 0, 0] };
            let ([of, field], pose) = ([[a, b][of], [a, b][field]], &poses[pose]);
            let core = contact.point_a + of.half * contact.normal;
            // At a jump either value may be taken.
            let expected = field.bounds_of_distance(inverse(pose, core)).map(|d| d - of.half);
            let is_right = expected.iter().any(|d| (contact.distance - d).abs() <= tolerance);
            assert!(is_right, "{mode:?}: {expected:?} {contact:?}");
            let apart = contact.point_a - contact.point_b;
            assert!(
                (apart - contact.distance * contact.normal).length() <= 1e-4 * size,
                "{mode:?}: {contact:?}"
            );
        }
        let deepest = found.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
        if mode == Mode::exact() {
            let sampled = sampled[0].min(sampled[1]);
            assert!(deepest <= sampled + tolerance, "{deepest} {sampled}");
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
    let expected = field.bounds_of_distance(inverse(pose, point + of.half * normal)).map(|d| d - of.half);
    let is_right = expected.iter().any(|d| (found.distance - d).abs() <= tolerance);
    assert!(is_right && found.converged, "{expected:?} {found:?}");
}

pub fn random_pose(random: &mut Random, apart: f64) -> Pose {
    let axis = random.direction();
    Pose::new(apart * random.direction(), DQuat::from_axis_angle(axis, random.between(0.0, 3.0)))
        .expect("a pose")
}

/// Points of a face that are spread evenly over it, its corners among them.
pub fn lattice(corners: [DVec3; 3], n: u32) -> impl Iterator<Item = DVec3> {
    let at = move |i: u32, j: u32| {
        let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(n));
        corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0])
    };
    (0..=n).flat_map(move |i| (0..=n - i).map(move |j| at(i, j)))
}

/// What [`assert_faces`] has compared.
#[derive(Default)]
pub struct Compared {
    pub touching: usize,
    pub apart: usize,
    pub deep: usize,
}

/// Compares, face by face, the contacts of `of` in the field of `field` with brute force over `n` points
/// along each side of a face, cell by cell: the faces that touch are the same, and no sample is
/// lower than the contacts of its face. `share`: only one in this number of faces is compared.
pub fn assert_faces(
    [of, field]: [&Body; 2],
    [from, to]: [&Pose; 2],
    contact_distance: f64,
    (n, share): (u32, usize),
    compared: &mut Compared,
) {
    let mut scene = Scene::new();
    let shapes = [of, field].map(|body| scene.add_shape(body.asset.clone()).expect("a shape"));
    let a = scene.add(Instance::new(shapes[0], *from)).expect("an instance");
    scene.add(Instance::new(shapes[1], *to)).expect("an instance");
    let options = CollideOptions {
        contact_distance,
        ..CollideOptions::with_mode(Mode::exact().per(ContactsPer::Cell))
    };
    let found = detect(&scene, &options).expect("contacts");
    let size = of.mesh.diagonal().max(field.mesh.diagonal());
    let tolerance = 1e-5 * size;
    for at in (0..of.asset.face_count()).step_by(share) {
        let id = of.asset.face_id(at);
        let world = |p: DVec3| inverse(to, from.rotation * p + from.translation);
        let corners = of.asset.face_corners(at);
        let values = lattice(corners, n).map(|p| field.bounds_of_distance(world(p)));
        // At the jump of an open mesh either value may be taken.
        let (low, high) =
            values.fold((f64::INFINITY, f64::INFINITY), |(l, h), [low, high]| (low.min(l), high.min(h)));
        let of_face: Vec<f64> = found
            .iter()
            .filter(|c| c.instance_a == a && c.face_a == id)
            .map(|c| c.distance + of.half)
            .collect();
        let least = of_face.iter().copied().fold(f64::INFINITY, f64::min);
        let limit = contact_distance + of.half;
        if high <= limit - tolerance {
            assert!(least <= high + tolerance, "face {id}: {least} instead of {high} or less");
            compared.touching += 1;
            compared.deep += usize::from(high < -tolerance);
        } else if low > limit {
            compared.apart += 1;
        }
        // Between the samples, a distance is lower by their spacing at most, unless there is a jump.
        let [p, q, r] = corners;
        let spacing = p.distance(q).max(q.distance(r)).max(r.distance(p)) / f64::from(n);
        if !field.asset.about().certificate().jumps() {
            assert!(of_face.is_empty() || least >= low - spacing, "face {id}: {least} instead of {low}");
            assert!(of_face.is_empty() || low <= limit + spacing, "face {id}: {low} is beyond {limit}");
        }
    }
}

/// Compares the contacts of the mode node with brute force over all vertices. Returns the number of
/// vertices that touch.
pub fn assert_nodes([of, field]: [&Body; 2], [from, to]: [&Pose; 2], contact_distance: f64) -> usize {
    let mut scene = Scene::new();
    let shapes = [of, field].map(|body| scene.add_shape(body.asset.clone()).expect("a shape"));
    let a = scene.add(Instance::new(shapes[0], *from)).expect("an instance");
    scene.add(Instance::new(shapes[1], *to)).expect("an instance");
    let options = CollideOptions { contact_distance, ..CollideOptions::with_mode(Mode::Node) };
    let found = detect(&scene, &options).expect("contacts");
    let mut touching = 0;
    for (v, &p) in of.mesh.vertices().iter().enumerate() {
        let p = inverse(to, from.rotation * p + from.translation);
        let values = field.bounds_of_distance(p);
        if values.iter().any(|d| (d - contact_distance).abs() < 1e-9) {
            continue;
        }
        let contact = found.iter().find(|c| c.instance_a == a && c.feature.a == v as u32);
        let is_right = values.iter().any(|&d| match contact {
            Some(contact) => d <= contact_distance && (contact.distance - d).abs() < 1e-9,
            None => d > contact_distance,
        });
        assert!(is_right, "vertex {v}: {values:?} {contact:?}");
        touching += usize::from(contact.is_some());
    }
    touching
}
