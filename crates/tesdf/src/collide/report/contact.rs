use std::ops::AddAssign;
use std::{slice, vec};

use glam::DVec3;
use serde::Serialize;

use crate::collide::report::hidden_overlap::HiddenOverlap;
use crate::collide::scene::ids::InstanceId;

/// A place where body *a* touches body *b*, in the world's unit and frame.
///
/// *a* is the body that has the face or node. *b* is the body whose signed distance field `φ_b` is
/// used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Contact {
    /// The witness point on `face_a`.
    pub point_a: DVec3,
    /// The point of b's surface that is closest to `point_a`.
    pub point_b: DVec3,
    /// A unit vector from b to a: ∇φ_b at `point_a`. In the modes [`Face`](crate::collide::Mode::Face) and
    /// [`Exact`](crate::collide::Mode::Exact) a direction that both bodies allow instead, where one is near:
    /// the normal of the face that meets an edge or a vertex, the common normal of edges that cross
    /// (`docs/math.md`, section 18).
    pub normal: DVec3,
    /// φ_b at `point_a`; negative where the bodies penetrate. With
    /// [`ContactsPer::Minimum`](crate::collide::ContactsPer::Minimum), the distance along the normal.
    pub distance: f64,
    /// The face of a, 0-based in the encoded mesh. For a node, the lowest face that has it.
    pub face_a: u32,
    /// The face of b that is closest to `point_a`.
    pub face_b: u32,
    /// The cell of b's domain, as the index of its word in `domain.nodes`; `None` where the face
    /// tree or a formula answered.
    pub tet_b: Option<u32>,
    /// The body that has the face or node.
    pub instance_a: InstanceId,
    /// The body whose field is used.
    pub instance_b: InstanceId,
    /// The touching features. It stays the same from step to step while the same features touch.
    /// [`touching_features`](Self::touching_features) also names the vertex or edge of a.
    pub feature: FeatureId,
    /// Whether it is proved that no point of the face is deeper by more than the tolerance.
    /// False when a search was cut short, and where no bound proves a result of the mode
    /// [`Face`](crate::collide::Mode::Face). A GPU does not compute that bound.
    pub converged: bool,
}

/// Identifies the features of two bodies that touch, independently of the cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct FeatureId {
    /// Face of a. In the mode [`Node`](crate::collide::Mode::Node), the vertex of a.
    pub a: u32,
    /// The closest feature of b.
    pub b: FeatureB,
}

/// The feature of a mesh that is closest to a point, or that touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FeatureB {
    /// A vertex, by its id in the encoded mesh.
    Vertex(u32),
    /// An edge, by its vertices, the lower id first.
    Edge(u32, u32),
    /// A face, by its id in the encoded mesh.
    Face(u32),
}

/// Statistics of a detection. `bytes` is the largest size of the intermediate products.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Statistics {
    /// Ordered pairs of instances whose bounds overlap.
    pub instance_pairs: usize,
    /// Faces or nodes of a that remain after the broad phase, over all pairs. With
    /// [`Spread`](crate::collide::Reduction::Spread), this and all other numbers count what was looked at.
    pub candidates: usize,
    /// Pairs of a face and a cell whose clipped polygon is not empty, or of a node and its cell.
    /// With one contact per face: faces.
    pub polygons: usize,
    /// Contacts within the contact distance.
    pub touching: usize,
    /// Contacts that the cosine filter dropped, or that are no local minima where those are wanted.
    pub filtered: usize,
    /// Contacts that the reduction dropped.
    pub reduced: usize,
    /// Contacts whose minimum is not proved to be within the tolerance.
    pub unconverged: usize,
    /// Bytes of all contacts and intermediate products.
    pub bytes: usize,
}

impl AddAssign for Statistics {
    fn add_assign(&mut self, other: Self) {
        let Self { instance_pairs, candidates, polygons, touching, filtered, reduced, unconverged, bytes } =
            other;
        self.instance_pairs += instance_pairs;
        self.candidates += candidates;
        self.polygons += polygons;
        self.touching += touching;
        self.filtered += filtered;
        self.reduced += reduced;
        self.unconverged += unconverged;
        self.bytes += bytes;
    }
}

/// The loss from reducing the contacts of a pair of instances.
///
/// Take any normal forces on all contacts of the pair, with total size `F`. Normal forces on the
/// kept contacts with the same total size can replace them. The sums of forces differ by at most
/// `wrench_error · F`, the torques around `center` by at most `wrench_error · length · F`. This
/// holds up to rounding of about 1e-12; a GPU adds its rounding to `wrench_error`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PairReduction {
    /// The instance with the lower id.
    pub instance_a: InstanceId,
    /// The instance with the higher id.
    pub instance_b: InstanceId,
    /// Number of contacts of the pair before the reduction, in both orders. With
    /// [`Spread`](crate::collide::Reduction::Spread), number of contacts that were found.
    pub contacts: usize,
    /// Number of kept contacts.
    pub kept: usize,
    /// The greatest distance of a contact's wrench from the convex hull of the wrenches of the kept
    /// contacts, without unit; 0 when all are kept. Where contacts may be
    /// unfound, an upper bound between 1.41 and 2.83, because nothing is known about their normals.
    pub wrench_error: f64,
    /// The centre of a box around the contact points `point_a`, in the world. The box is parallel
    /// to the world's axes, or to those of `instance_b` when a GPU detects or contacts are unfound.
    pub center: DVec3,
    /// The greatest distance of a contact point from `center`, in the world's unit. On a GPU it is
    /// at least the limit of its rounding. Where contacts are unfound, an upper bound.
    pub length: f64,
    /// No contact that was left out has a lower signed distance than this, in the world's unit.
    /// `None` where all are kept, and for [`PerPair`](crate::collide::Reduction::PerPair).
    pub left_out_above: Option<f64>,
}

/// The contacts of a scene, sorted by world, instances, face and cell. Iterates over the contacts
/// by value or by reference.
///
/// # Example
///
/// ```
/// use tesdf::glam::DVec3;
/// use tesdf::{CollideOptions, Instance, Pose, Scene, Shape, detect};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut scene = Scene::new();
/// let ball = scene.add_shape(Shape::Sphere { radius: 1.0 })?;
/// let floor = scene.add_shape(Shape::Plane)?;
/// scene.add(Instance::new(ball, Pose::at(DVec3::new(0.0, 0.0, 0.75))))?;
/// scene.add(Instance::new(floor, Pose::IDENTITY))?;
/// let contacts = detect(&scene, &CollideOptions::default())?;
/// assert!(contacts.hidden.is_empty());
/// for contact in contacts {
///     assert_eq!(contact.distance, -0.25);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    contacts: Vec<Contact>,
    /// Statistics of the detection.
    pub statistics: Statistics,
    /// The loss from the reduction, for each pair of instances; empty without reduction.
    pub reductions: Vec<PairReduction>,
    /// Pairs that overlap without a contact that shows it, which happens in the mode
    /// [`Node`](crate::collide::Mode::Node). Sorted by world and instances. Contacts will not keep these
    /// pairs apart.
    pub hidden: Vec<HiddenOverlap>,
}

impl Contacts {
    /// `contacts` must be sorted.
    pub fn new(
        contacts: Vec<Contact>,
        statistics: Statistics,
        reductions: Vec<PairReduction>,
        hidden: Vec<HiddenOverlap>,
    ) -> Self {
        Self { contacts, statistics, reductions, hidden }
    }

    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.contacts.len()
    }

    /// Whether there is no contact. Bodies may still overlap; see [`hidden`](Self::hidden).
    pub fn is_empty(&self) -> bool {
        self.contacts.is_empty()
    }

    /// The contacts, in order.
    pub fn iter(&self) -> slice::Iter<'_, Contact> {
        self.contacts.iter()
    }

    /// The contacts as a slice.
    pub fn as_slice(&self) -> &[Contact] {
        &self.contacts
    }

    /// The contacts without the rest of the result.
    pub fn into_vec(self) -> Vec<Contact> {
        self.contacts
    }
}

impl IntoIterator for Contacts {
    type Item = Contact;
    type IntoIter = vec::IntoIter<Contact>;

    fn into_iter(self) -> Self::IntoIter {
        self.contacts.into_iter()
    }
}

impl<'a> IntoIterator for &'a Contacts {
    type Item = &'a Contact;
    type IntoIter = slice::Iter<'a, Contact>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}
