//! The contacts of faces, found elsewhere, that are local minima over the surface.
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use crate::collide::detect::descent::OnFace;
use crate::collide::detect::ordered_pair::OrderedPair;
use crate::collide::options::CollideOptions;
use crate::collide::report::contact::Contact;
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::parallel::*;

/// For each contact of a face: whether it is a local minimum over its surface, as contacts of
/// [`ContactsPer::Minimum`](crate::collide::ContactsPer::Minimum) are. `faces` are the indices of their
/// faces in the shapes. Of the contacts of one face, the deepest is taken for the face's lowest
/// point.
///
/// # Errors
/// [`CollideError::NoInstance`] for an instance that the scene lacks.
pub fn local_minima(
    scene: &Scene,
    options: &CollideOptions,
    contacts: &[Contact],
    faces: &[u32],
) -> Result<Vec<bool>, CollideError> {
    let mut pairs: BTreeMap<(InstanceId, InstanceId), OrderedPair> = BTreeMap::new();
    let mut lowest: BTreeMap<(InstanceId, InstanceId, u32), f64> = BTreeMap::new();
    for (contact, &face) in contacts.iter().zip(faces) {
        let (a, b) = (contact.instance_a, contact.instance_b);
        if let Entry::Vacant(entry) = pairs.entry((a, b)) {
            let distance = OrderedPair::contact_distance(scene, options, [a, b])?;
            entry.insert(OrderedPair::new(scene, options, a, b, distance)?);
        }
        let least = lowest.entry((a, b, face)).or_insert(contact.distance);
        *least = least.min(contact.distance);
    }
    let is_minimum = |(contact, &face): (&Contact, &u32)| {
        let (a, b) = (contact.instance_a, contact.instance_b);
        let pair = &pairs[&(a, b)];
        let point = pair.field.to_field(contact.point_a);
        let distance = pair.field.field.exact_value(point).distance;
        let gradient = pair.field.rotate_back(contact.normal);
        let is_lowest = contact.distance <= lowest[&(a, b, face)];
        !pair.descends(&OnFace { face, point, distance, gradient, is_lowest })
    };
    Ok(contacts.par_iter().zip(faces).map(is_minimum).collect())
}
