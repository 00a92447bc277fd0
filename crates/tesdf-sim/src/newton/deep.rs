//! Which contacts of bodies that overlap deeply push them apart.
//!
//! Deep inside of a body the nearest face can be on any side. Where two bodies are deep in each
//! other, contacts on both sides of one then push it both ways, and nothing moves: 128 shafts in a
//! pile stay 11.6 mm deep. Of the penetrating contacts of such a pair only those act that push a
//! vertex or face against its own normal, into the body that it belongs to (Eq. (10) of the paper,
//! for vertices, too). So it is at shallow overlaps beside the rim of flush sides ([`has_rear`]).
//!
//! Two shafts that cross within a radius of each other are past the middle: their deepest contacts
//! push along the own normals. Such a pair gets one direction for all of its pushes: of the normals
//! of its contacts and their opposites, the one along which the bodies overlap least, measured by
//! their extents (the separating axis test). Contacts act that push along it. Where there is none,
//! as of two boxes that are nearly at one place, one is added at the mean of the places, as deep as
//! this overlap.
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use tesdf::TeSdf;
use tesdf::base::elementary;
use tesdf::collide::{Contact, InstanceId, Mode, Pose, Scene, Shape, ShapeId};

/// cos θ of the filter: the normal of the contact is at least this much against that of the vertex
/// or face, or along the direction of the pair.
const COS_THETA: f64 = 0.3;

/// A pair is past the middle when no contact pushes against the own normal, or one that pushes along
/// it is deeper than this fraction of the deepest of these.
const PAST_THE_MIDDLE: f64 = 0.5;

/// Maximum number of normals that are tried as directions of a pair. Each takes a look at all
/// vertices. The pile of 128 shafts has at most some 200 for a pair.
const TRIALS: usize = 256;

/// Cosine of two normals that count as one.
const SAME: f64 = 1.0 - 1e-9;

/// What a pair of bodies that overlap deeply is pushed along: the direction of its first instance, and
/// the overlap, m.
#[derive(Clone, Copy, Debug)]
struct Way {
    direction: DVec3,
    overlap: f64,
}

/// A contact that penetrates.
#[derive(Clone, Copy, Debug)]
struct Push {
    /// Of the pair's first instance.
    direction: DVec3,
    depth: f64,
    /// Between the normal and that of the vertex or face.
    cosine: f64,
}

/// The normals of the vertices or faces of the meshes and boxes of a scene, and their
/// vertices, in the frames of the shapes.
#[derive(Clone, Debug)]
pub struct Surfaces {
    of_shapes: BTreeMap<ShapeId, Surface>,
    mode: Mode,
}

#[derive(Clone, Debug)]
struct Surface {
    /// For each feature that has contacts.
    normals: Vec<DVec3>,
    vertices: Vec<DVec3>,
}

impl Surfaces {
    /// The surfaces of `scene`, with the normals of the features that have contacts in a mode.
    pub fn new(scene: &Scene, mode: Mode) -> Self {
        let of_shape = |(id, shape): (ShapeId, &Shape)| {
            let asset = match shape {
                Shape::Mesh(asset) => asset,
                Shape::Box { .. } => return Some((id, of_box(shape, mode))),
                _ => return None,
            };
            let normals = match mode {
                Mode::Node => normals_of_vertices(asset),
                Mode::Face { .. } | Mode::Exact(_) => normals_of_faces(asset),
            };
            Some((id, Surface { normals, vertices: vertices(asset) }))
        };
        Self { of_shapes: scene.shapes().filter_map(of_shape).collect(), mode }
    }

    /// The contacts that act. `is_deep` tells whether a contact is that of a deep pair. The
    /// instances of `scene` have the poses at which the contacts were found.
    pub fn acting<'a>(
        &self,
        scene: &Scene,
        contacts: &'a [Contact],
        is_deep: impl Fn(&Contact) -> bool,
    ) -> Cow<'a, [Contact]> {
        let mut pushes: BTreeMap<[InstanceId; 2], Vec<Push>> = BTreeMap::new();
        let mut deep: BTreeSet<[InstanceId; 2]> = BTreeSet::new();
        for contact in contacts.iter().filter(|c| c.distance < 0.0) {
            let cosine = self.cosine(scene, contact);
            let push = Push { direction: on_first(contact), depth: -contact.distance, cosine };
            pushes.entry(pair(contact)).or_default().push(push);
            if is_deep(contact) {
                deep.insert(pair(contact));
            }
        }
        let of_faces = self.mode != Mode::Node;
        pushes.retain(|pair, pushes| deep.contains(pair) || of_faces && has_rear(pushes));
        if pushes.is_empty() {
            return Cow::Borrowed(contacts);
        }
        let way = |(pair, pushes): (&[InstanceId; 2], &Vec<Push>)| {
            (*pair, if deep.contains(pair) { self.way(scene, *pair, pushes) } else { None })
        };
        let ways: BTreeMap<[InstanceId; 2], Option<Way>> = pushes.iter().map(way).collect();
        let acts = |contact: &&Contact| match ways.get(&pair(contact)) {
            Some(way) if contact.distance < 0.0 => match way {
                Some(way) => way.direction.dot(on_first(contact)) > COS_THETA,
                None => self.cosine(scene, contact) <= -COS_THETA,
            },
            _ => true,
        };
        let mut acting: Vec<Contact> = contacts.iter().filter(acts).copied().collect();
        for (of_pair, way) in ways {
            let Some(Way { direction, overlap }) = way else { continue };
            let is_of_pair = |c: &&Contact| pair(c) == of_pair && c.distance < 0.0;
            if acting.iter().any(|c| is_of_pair(&c)) {
                continue;
            }
            let places: Vec<DVec3> = contacts.iter().filter(is_of_pair).map(|c| c.point_a).collect();
            let first = contacts.iter().find(is_of_pair).copied();
            acting.extend(first.map(|first| {
                let place = places.iter().sum::<DVec3>() / places.len() as f64;
                let [instance_a, instance_b] = of_pair;
                let (point_a, point_b, normal, distance) = (place, place, direction, -overlap);
                Contact { point_a, point_b, normal, distance, instance_a, instance_b, ..first }
            }));
        }
        Cow::Owned(acting)
    }

    fn of(&self, scene: &Scene, instance: InstanceId) -> Option<(&Surface, Pose, f64)> {
        let instance = scene.instance(instance).ok()?;
        Some((self.of_shapes.get(&instance.shape)?, instance.pose, instance.scale))
    }

    /// The cosine between the normal of a contact and that of its vertex or face. Planes and
    /// rounded shapes are always opposed.
    fn cosine(&self, scene: &Scene, contact: &Contact) -> f64 {
        let own = || {
            let (surface, pose, _) = self.of(scene, contact.instance_a)?;
            Some(pose.rotation * *surface.normals.get(contact.feature.a as usize)?)
        };
        own().map_or(-1.0, |normal: DVec3| normal.dot(contact.normal))
    }

    /// How a pair that is past the middle is pushed. `pushes` are its penetrating contacts.
    fn way(&self, scene: &Scene, pair: [InstanceId; 2], pushes: &[Push]) -> Option<Way> {
        let (along, against) = deepest(pushes);
        if against > 0.0 && along <= PAST_THE_MIDDLE * against {
            return None;
        }
        let [first, second] = pair.map(|instance| self.of(scene, instance));
        let (first, second) = (first?, second?);
        // The contacts of a flat face follow each other, with one normal.
        let mut directions: Vec<DVec3> = pushes.iter().map(|push| push.direction).collect();
        directions.dedup_by(|one, other| one.dot(*other) > SAME);
        let step = directions.len().div_ceil(TRIALS);
        let tried = directions.iter().step_by(step).flat_map(|&direction| [direction, -direction]);
        let ways = tried.map(|direction| {
            let overlap = extent(first, -direction) + extent(second, direction);
            Way { direction, overlap }
        });
        ways.min_by(|x, y| x.overlap.total_cmp(&y.overlap))
    }
}

/// The greatest depths of the contacts that push along the own normal, and against it.
fn deepest(pushes: &[Push]) -> (f64, f64) {
    let of = |acts: fn(f64) -> bool| {
        let depths = pushes.iter().filter(|push| acts(push.cosine)).map(|push| push.depth);
        depths.fold(0.0, f64::max)
    };
    (of(|cosine| cosine > COS_THETA), of(|cosine| cosine <= -COS_THETA))
}

/// Whether contacts of a pair push a body at its rear: along the own normal, and much less deep
/// than those that push at its front. Beside the rim of two sides that lie flush in each other, the
/// side that the rim belongs to is nearer; two such pushes against each other at nearly one height
/// turned a box by 0.5° to find room for 0.2 µm.
fn has_rear(pushes: &[Push]) -> bool {
    let (along, against) = deepest(pushes);
    along > 0.0 && along <= PAST_THE_MIDDLE * against
}

/// The surface of a box, with the normals of its corners or of the parts of its sides.
fn of_box(shape: &Shape, mode: Mode) -> Surface {
    let vertices: Vec<DVec3> = shape.nodes().into_iter().map(|(corner, _)| corner).collect();
    let normals = match mode {
        Mode::Node => vertices.iter().map(|corner| corner.signum().normalize()).collect(),
        Mode::Face { .. } | Mode::Exact(_) => {
            let normal = |part: &Vec<DVec3>| (part[1] - part[0]).cross(part[2] - part[0]).normalize_or_zero();
            shape.parts().0.iter().map(normal).collect()
        }
    };
    Surface { normals, vertices }
}

/// How far a body extends from the origin along a direction.
fn extent((surface, pose, scale): (&Surface, Pose, f64), direction: DVec3) -> f64 {
    let local = scale * (pose.rotation.inverse() * direction);
    let farthest = surface.vertices.iter().map(|v| v.dot(local)).fold(f64::NEG_INFINITY, f64::max);
    farthest + pose.translation.dot(direction)
}

/// The instances of a contact, the lower one first.
pub fn pair(contact: &Contact) -> [InstanceId; 2] {
    let (a, b) = (contact.instance_a, contact.instance_b);
    [a.min(b), a.max(b)]
}

/// The direction in which a contact pushes the instance with the lower id.
fn on_first(contact: &Contact) -> DVec3 {
    if contact.instance_a < contact.instance_b { contact.normal } else { -contact.normal }
}

/// The vertices of the faces.
fn vertices(asset: &TeSdf) -> Vec<DVec3> {
    let mut vertices = Vec::new();
    for face in 0..asset.face_count() {
        for (vertex, corner) in asset.face_vertices(face).into_iter().zip(asset.face_corners(face)) {
            if vertices.len() <= vertex as usize {
                vertices.resize(vertex as usize + 1, corner);
            }
            vertices[vertex as usize] = corner;
        }
    }
    vertices
}

/// The unit normal of each face, by its id. Ids have gaps where faces of the mesh are no surface.
fn normals_of_faces(asset: &TeSdf) -> Vec<DVec3> {
    let ids = (0..asset.face_count()).map(|face| asset.face_id(face) as usize + 1);
    let mut normals = vec![DVec3::ZERO; ids.max().unwrap_or(0)];
    for face in 0..asset.face_count() {
        let [p, q, r] = asset.face_corners(face);
        normals[asset.face_id(face) as usize] = (q - p).cross(r - p).normalize_or_zero();
    }
    normals
}

/// The sum of the normals of the faces at each vertex, weighted by their angles there, as a unit
/// vector (Thürmer and Wüthrich 1998).
fn normals_of_vertices(asset: &TeSdf) -> Vec<DVec3> {
    let mut normals = Vec::new();
    for face in 0..asset.face_count() {
        let corners = asset.face_corners(face);
        for (k, vertex) in asset.face_vertices(face).into_iter().enumerate() {
            let vertex = vertex as usize;
            if normals.len() <= vertex {
                normals.resize(vertex + 1, DVec3::ZERO);
            }
            let [p, q, r] = [0, 1, 2].map(|j| corners[(k + j) % 3]);
            let normal = (q - p).cross(r - p);
            let angle = elementary::atan2(normal.length(), (q - p).dot(r - p));
            normals[vertex] += angle * normal.normalize_or_zero();
        }
    }
    normals.into_iter().map(DVec3::normalize_or_zero).collect()
}

#[cfg(test)]
mod tests {
    use tesdf::collide::{FeatureB, FeatureId, Instance, Pose};
    use tesdf::encode::{Encoder, Preset};
    use tesdf::mesh::{MeshFormat, SolidMesh, read_bytes};

    use super::*;

    /// Each corner of a cube has one or two triangles of a side, and the same normal.
    #[test]
    fn normals_of_a_cube_point_along_its_diagonals() {
        let mut obj = String::new();
        for k in 0..8 {
            let c = |bit: usize| if k >> bit & 1 == 1 { 1 } else { -1 };
            obj += &format!("v {} {} {}\n", c(0), c(1), c(2));
        }
        for [a, b, c, d] in
            [[1, 5, 7, 3], [2, 4, 8, 6], [1, 2, 6, 5], [3, 7, 8, 4], [1, 3, 4, 2], [5, 6, 8, 7]]
        {
            obj += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
        let solid = SolidMesh::new(read_bytes(obj.as_bytes(), MeshFormat::Obj).unwrap().mesh).unwrap();
        let asset = Encoder::new().preset(Preset::Fast).encode(&solid).unwrap();
        let normals = normals_of_vertices(&asset);
        assert_eq!(normals.len(), 8);
        for face in 0..asset.face_count() {
            for (vertex, corner) in asset.face_vertices(face).into_iter().zip(asset.face_corners(face)) {
                assert!(normals[vertex as usize].distance(corner.normalize()) < 1e-15);
            }
        }
    }

    fn contact(ids: [u32; 2], feature: u32, normal: DVec3, distance: f64) -> Contact {
        Contact {
            point_a: DVec3::ZERO,
            point_b: DVec3::ZERO,
            normal,
            distance,
            face_a: 0,
            face_b: 0,
            tet_b: None,
            instance_a: InstanceId(ids[0]),
            instance_b: InstanceId(ids[1]),
            feature: FeatureId { a: feature, b: FeatureB::Face(0) },
            converged: true,
        }
    }

    /// Vertex 0 looks up. The instances have the same mesh of two points, one above the other.
    #[test]
    fn pushes_along_the_own_normal_do_not_act() {
        let mut scene = Scene::new();
        let shape = scene.add_shape(Shape::Sphere { radius: 1.0 }).unwrap();
        for height in [0.0, 0.0, 0.5] {
            scene.add(Instance::new(shape, Pose::at(DVec3::Z * height))).unwrap();
        }
        let surface = Surface { normals: vec![DVec3::Z], vertices: vec![DVec3::NEG_Z, DVec3::Z] };
        let surfaces = Surfaces { of_shapes: BTreeMap::from([(shape, surface)]), mode: Mode::exact() };
        let (up, down, aside) = (DVec3::Z, DVec3::NEG_Z, DVec3::X);
        let found = [
            // Deep; the deepest contact pushes against the normal.
            contact([0, 1], 0, down, -0.5),
            contact([1, 0], 0, up, -0.1),
            contact([0, 1], 0, aside, -0.1),
            contact([0, 1], 0, up, 0.1),
            // Deep and past the middle: instance 2 is higher, so 0 is pushed down.
            contact([0, 2], 0, up, -0.3),
            contact([2, 0], 0, up, -0.2),
            contact([0, 2], 0, down, -0.1),
            // Not deep.
            contact([1, 2], 0, up, -0.01),
        ];
        let acting = surfaces.acting(&scene, &found, |c| c.distance < -0.05);
        assert_eq!(*acting, [found[0], found[3], found[5], found[6], found[7]]);
        // Across, the two bodies do not extend at all: that is the shortest way out.
        let found = [contact([0, 2], 0, up, -0.3), contact([2, 0], 0, aside, -0.2)];
        assert_eq!(*surfaces.acting(&scene, &found, |_| true), [found[1]]);
    }
}
