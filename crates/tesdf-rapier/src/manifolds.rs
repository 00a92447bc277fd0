//! From contacts to Rapier's manifolds, with the impulses of the step before.
//!
//! Rapier solves at most four points of a manifold and gives all of them one normal. Contacts of curved bodies have as many normals
//! as points, so each gets a manifold of its own.
use glam::DVec3;
use rapier3d_f64::geometry::{ContactData, ContactManifold, TrackedContact};
use rapier3d_f64::math::Pose;
use rapier3d_f64::parry::query::details::{ContactManifoldsWorkspace, TypedWorkspaceData, WorkspaceData};
use rapier3d_f64::parry::shape::PackedFeatureId;
use tesdf::collide::{Contact, FeatureB, FeatureId, InstanceId};

/// The instance that stands for the first shape of a pair.
pub const FIRST: InstanceId = InstanceId(0);

/// What a contact is recognised by: whose face it is, and the features.
type Key = (InstanceId, FeatureId);

/// Keys of a pair's manifolds, in their order.
///
/// That it is there has a second use: Rapier trusts the numbers of a pair's manifolds from step to step unless the pair has a
/// workspace. Without it, a manifold that goes panics the solver ("stale ContactRef manifold ordinal").
#[derive(Clone, Debug, Default)]
struct Keys(Vec<Key>);

impl WorkspaceData for Keys {
    fn as_typed_workspace_data(&self) -> TypedWorkspaceData<'_> {
        TypedWorkspaceData::Custom
    }

    fn clone_dyn(&self) -> Box<dyn WorkspaceData> {
        Box::new(self.clone())
    }
}

/// What a contact left behind.
struct Previous {
    key: Key,
    point: DVec3,
    data: ContactData,
}

/// Replaces the manifolds of a pair by one per contact. A contact of the same features takes over the impulses; of several of the
/// same features (a face that touches in several cells) the nearest one does. `contacts` are in the first shape's frame.
pub fn replace(
    contacts: &[Contact],
    pos12: &Pose,
    manifolds: &mut Vec<ContactManifold>,
    workspace: &mut Option<ContactManifoldsWorkspace>,
) {
    let mut previous = previous(manifolds, workspace.as_ref());
    manifolds.resize_with(contacts.len(), ContactManifold::new);
    for (manifold, contact) in manifolds.iter_mut().zip(contacts) {
        let mut point = tracked(contact, pos12);
        if let Some(data) = take(&mut previous, key(contact), point.local_p1) {
            point.data = data;
        }
        let normal = if contact.instance_a == FIRST { -contact.normal } else { contact.normal };
        manifold.local_n1 = normal;
        manifold.local_n2 = -(pos12.rotation.inverse() * normal);
        manifold.points.clear();
        manifold.points.push(point);
    }
    *workspace = Some(Keys(contacts.iter().map(key).collect()).into());
}

fn key(contact: &Contact) -> Key {
    (contact.instance_a, contact.feature)
}

/// Sorted by key; those without impulses are left out.
fn previous(manifolds: &[ContactManifold], workspace: Option<&ContactManifoldsWorkspace>) -> Vec<Previous> {
    let Some(Keys(keys)) = workspace.and_then(|w| w.0.downcast_ref()) else { return Vec::new() };
    let mut previous: Vec<Previous> = keys
        .iter()
        .zip(manifolds)
        .filter_map(|(&key, manifold)| {
            let point = manifold.points.first()?;
            let at_rest = point.data.warmstart_impulse == 0.0 && point.data.impulse == 0.0;
            (!at_rest).then_some(Previous { key, point: point.local_p1, data: point.data })
        })
        .collect();
    // Stable: those of one key stay in the detector's order.
    previous.sort_by_key(|p| p.key);
    previous
}

/// The impulses of the nearest contact of the key, which no other contact gets.
fn take(previous: &mut Vec<Previous>, key: Key, point: DVec3) -> Option<ContactData> {
    let start = previous.partition_point(|p| p.key < key);
    let same = previous[start..].iter().take_while(|p| p.key == key).enumerate();
    let (offset, _) =
        same.min_by(|(_, p), (_, q)| p.point.distance(point).total_cmp(&q.point.distance(point)))?;
    Some(previous.remove(start + offset).data)
}

fn tracked(contact: &Contact, pos12: &Pose) -> TrackedContact<ContactData> {
    // For people only, as the keys recognise a contact; parry has 30 bits for a number, and one number for an edge.
    let number = |id: u32| id & (u32::MAX >> 2);
    let a = PackedFeatureId::face(number(contact.face_a));
    let b = match contact.feature.b {
        FeatureB::Vertex(vertex) => PackedFeatureId::vertex(number(vertex)),
        FeatureB::Edge(..) => PackedFeatureId::edge(number(contact.face_b)),
        FeatureB::Face(face) => PackedFeatureId::face(number(face)),
    };
    let flipped = contact.instance_a != FIRST;
    let (first, second) =
        if flipped { (contact.point_b, contact.point_a) } else { (contact.point_a, contact.point_b) };
    let (id1, id2) = if flipped { (b, a) } else { (a, b) };
    TrackedContact::new(first, pos12.inverse_transform_point(second), id1, id2, contact.distance)
}
