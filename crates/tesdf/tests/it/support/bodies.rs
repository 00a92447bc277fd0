//! Encoded meshes of `data/`, made once per test program, and relative placements of two bodies.
use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex};

use tesdf::TeSdf;
use tesdf::collide::{Contact, Instance, InstanceId, Placement, Pose, Scene, Shape};
use tesdf::encode::{EncodeOptions, Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::SolidMesh;

use super::meshes;
use super::random::Random;

/// A mesh and its asset.
pub struct Body {
    pub solid: SolidMesh,
    pub asset: Arc<TeSdf>,
}

/// The mesh of a row of the manifest, by name. It is encoded with coarse cells, because these tests
/// do not measure queries.
pub fn body(name: &str) -> Arc<Body> {
    static BODIES: LazyLock<Mutex<HashMap<String, Arc<Body>>>> = LazyLock::new(Mutex::default);
    let known = || BODIES.lock().expect("no test panics while it looks");
    if let Some(body) = known().get(name) {
        return body.clone();
    }
    // Encode without the lock: encoding is parallel, and its thread may take up another task that
    // needs a body.
    let row = meshes::manifest().into_iter().find(|r| r.name == name).expect("a row of the manifest");
    let body = Arc::new(Body::new(row.solid().expect("a solid")));
    known().entry(name.into()).or_insert(body).clone()
}

impl Body {
    pub fn new(solid: SolidMesh) -> Self {
        let byte_worth = if solid.mesh().faces().len() > 1000 { 2.0 } else { 0.5 };
        let options = EncodeOptions { byte_worth, ..EncodeOptions::preset(Preset::Fast) };
        let asset = Encoder::new().options(options).encode(&solid).expect("encodes");
        Self { solid, asset: Arc::new(asset) }
    }

    pub fn diagonal(&self) -> f64 {
        self.solid.mesh().diagonal()
    }

    pub fn center(&self) -> DVec3 {
        self.solid.mesh().bounds().center()
    }

    /// Corners of a face in the world, by its id in the mesh.
    pub fn face(&self, face: u32, at: Placement) -> [DVec3; 3] {
        self.solid.mesh().triangle(face as usize).map(|p| at.to_world(p))
    }
}

/// A body with a placement.
#[derive(Clone)]
pub struct Placed {
    pub body: Arc<Body>,
    pub at: Placement,
}

impl Placed {
    pub fn new(name: &str, at: Placement) -> Self {
        Self { body: body(name), at }
    }

    /// Rotates the body by `rotation` about its centre, and moves the centre to `to`.
    pub fn around(name: &str, rotation: DQuat, scale: f64, to: DVec3) -> Self {
        let body = body(name);
        let translation = to - rotation * (scale * body.center());
        Self { body, at: Placement { pose: Pose { translation, rotation }, scale } }
    }

    /// Signed distance at a point of the world, from the tree over all faces.
    pub fn distance_by_tree(&self, p: DVec3) -> f64 {
        let precision = tesdf::query::Precision::F64;
        self.at.scale * self.body.asset.query_by_tree_with(self.at.to_shape(p), precision).signed_distance
    }

    pub fn diagonal(&self) -> f64 {
        self.at.scale * self.body.diagonal()
    }

    pub fn moved(&self, by: Pose) -> Self {
        Self { body: self.body.clone(), at: Placement { pose: by.after(self.at.pose), scale: self.at.scale } }
    }
}

/// The bodies as instances 0, 1, … of a scene.
pub fn scene(bodies: &[Placed]) -> Scene {
    let mut scene = Scene::new();
    for Placed { body, at } in bodies {
        let shape = scene.add_shape(Shape::Mesh(body.asset.clone())).expect("a mesh is a shape");
        scene.add(Instance { scale: at.scale, ..Instance::new(shape, at.pose) }).expect("a pose");
    }
    scene
}

/// The contacts of the ordered pair (`a`, `b`).
pub fn of_direction(contacts: &[Contact], a: u32, b: u32) -> impl Iterator<Item = &Contact> {
    contacts.iter().filter(move |c| (c.instance_a, c.instance_b) == (InstanceId(a), InstanceId(b)))
}

/// A uniformly random rotation.
pub fn rotation(random: &mut Random) -> DQuat {
    loop {
        let (v, w) = (random.in_cube(), random.between(-1.0, 1.0));
        let q = DQuat::from_xyzw(v.x, v.y, v.z, w);
        if (0.01..1.0).contains(&q.length_squared()) {
            return q.normalize();
        }
    }
}

/// Relative placement of two bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// A face of one body lies close to a face of the other, within 1e-3 of the diagonal on either
    /// side.
    Touching,
    /// A vertex of one body lies on a face of the other up to rounding.
    JustTouching,
    /// The centres are closer than a quarter of the diagonal.
    Deep,
    /// Exactly the same pose.
    Same,
    /// The bounds are apart.
    Apart,
    /// A hundred diagonals apart.
    Far,
    /// The second body is smaller, in the middle of the first.
    Inside,
    /// The bounds share a side, and both bodies are parallel to the axes, so faces are coplanar.
    SharedFaces,
}

pub const RELATIONS: [Relation; 8] = [
    Relation::Touching,
    Relation::JustTouching,
    Relation::Deep,
    Relation::Same,
    Relation::Apart,
    Relation::Far,
    Relation::Inside,
    Relation::SharedFaces,
];

impl Relation {
    /// Places two bodies in this relation. The first body has the pose of its file, except for a
    /// random motion of both bodies.
    pub fn place(self, names: [&str; 2], random: &mut Random) -> [Placed; 2] {
        let first = Placed::new(names[0], Placement { pose: Pose::IDENTITY, scale: 1.0 });
        let other = body(names[1]);
        let size = first.body.diagonal();
        let scale = size / other.diagonal();
        let turned = rotation(random);
        let second = match self {
            Self::Touching => {
                let by = random.between(-1e-3, 1e-3) * size;
                touching(&first, &other, names[1], random, by)
            }
            Self::JustTouching => touching(&first, &other, names[1], random, 0.0),
            Self::Deep => {
                let to = first.body.center() + 0.25 * random.unit() * size * random.direction();
                Placed::around(names[1], turned, scale * random.between(0.5, 1.5), to)
            }
            Self::Same => Placed { body: other, at: first.at },
            Self::Apart => {
                let to = first.body.center() + random.between(1.01, 1.5) * size * random.direction();
                Placed::around(names[1], turned, scale, to)
            }
            Self::Far => {
                let to = first.body.center() + 100.0 * size * random.direction();
                Placed::around(names[1], turned, scale, to)
            }
            Self::Inside => Placed::around(names[1], turned, 0.1 * scale, first.body.center()),
            Self::SharedFaces => {
                let (a, b) = (first.body.solid.mesh().bounds(), other.solid.mesh().bounds());
                let axis = random.index(3);
                let mut translation = a.center() - b.center();
                translation[axis] = a.max[axis] - b.min[axis];
                let at = Placement { pose: Pose::at(translation), scale: 1.0 };
                Placed { body: other, at }
            }
        };
        let both = Pose { translation: size * random.in_cube(), rotation: rotation(random) };
        match self {
            // After a rotation, the faces would be coplanar only up to rounding.
            Self::SharedFaces | Self::Same => [first, second],
            _ => [first.moved(both), second.moved(both)],
        }
    }
}

/// The second body with one of its vertices on a face of the first body, moved out by `by`.
fn touching(first: &Placed, other: &Body, name: &str, random: &mut Random, by: f64) -> Placed {
    let mesh = first.body.solid.mesh();
    let face = mesh.triangle(random.index(mesh.faces().len()));
    let weights: [f64; 3] = random.weights();
    let at = super::points::on(face, weights);
    let outward = (face[1] - face[0]).cross(face[2] - face[0]).normalize_or(DVec3::Z);
    let scale = first.body.diagonal() / other.diagonal();
    let vertices = other.solid.mesh().vertices();
    let vertex = vertices[random.index(vertices.len())];
    // The body is above the face, with the vertex pointing down.
    let look = (other.center() - vertex).normalize_or(DVec3::Z);
    let rotation = DQuat::from_rotation_arc(look, outward);
    let translation = at + by * outward - rotation * (scale * vertex);
    Placed { body: body(name), at: Placement { pose: Pose { translation, rotation }, scale } }
}
