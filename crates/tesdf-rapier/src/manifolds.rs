//! Converts contacts to Rapier's manifolds, with the impulses of the previous step.
//!
//! Rapier solves at most four points per manifold and gives all of them one normal. Contacts of
//! curved bodies have one normal per point, so each contact becomes a manifold of its own.
use glam::DVec3;
use rapier3d_f64::geometry::{ContactData, ContactManifold, TrackedContact};
use rapier3d_f64::math::Pose;
use rapier3d_f64::parry::query::details::{ContactManifoldsWorkspace, TypedWorkspaceData, WorkspaceData};
use rapier3d_f64::parry::shape::PackedFeatureId;
use tesdf::collide::{Contact, FeatureB, FeatureId, InstanceId};

/// The instance that represents the first shape of a pair.
pub const FIRST: InstanceId = InstanceId(0);

/// Identifies a contact between steps: the instance of the face, and the two features.
type Key = (InstanceId, FeatureId);

/// The keys of a pair's manifolds, in the order of the manifolds.
///
/// Storing them as the pair's workspace has a second effect. Without a workspace, Rapier expects
/// the manifolds of a pair to keep their numbers from step to step, and its solver panics when a
/// manifold disappears ("stale ContactRef manifold ordinal").
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

/// The solver data of a contact in the previous step.
struct Previous {
    key: Key,
    point: DVec3,
    data: ContactData,
}

/// Replaces the manifolds of a pair by one manifold per contact.
///
/// A contact takes over the impulses of a previous contact of the same features. When a face
/// touches in several cells, there are several such contacts, and the nearest one is taken.
/// `contacts` are in the frame of the first shape.
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

/// The previous contacts with impulses, sorted by key.
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
    // The sort is stable, so contacts of one key stay in the detector's order.
    previous.sort_by_key(|p| p.key);
    previous
}

/// Removes the nearest previous contact of the key, and returns its data.
fn take(previous: &mut Vec<Previous>, key: Key, point: DVec3) -> Option<ContactData> {
    let start = previous.partition_point(|p| p.key < key);
    let same = previous[start..].iter().take_while(|p| p.key == key).enumerate();
    let (offset, _) =
        same.min_by(|(_, p), (_, q)| p.point.distance(point).total_cmp(&q.point.distance(point)))?;
    Some(previous.remove(start + offset).data)
}

fn tracked(contact: &Contact, pos12: &Pose) -> TrackedContact<ContactData> {
    // These ids are for users only, because the keys identify contacts. Parry has 30 bits for an
    // id, and a single id for an edge.
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
