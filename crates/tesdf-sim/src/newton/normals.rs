//! Normals of contacts at edges.
use glam::DVec3;
use tesdf::collide::{Contact, FeatureB, InstanceId};

/// Normals that differ by a smaller angle, rad, are those of the same flat contact.
const PARALLEL: f64 = 1e-3;

/// The normal of each contact, where that of an edge or a vertex which is nearly the normal of a
/// face that the same two bodies touch is replaced by it.
///
/// Where the edges of two faces on each other are nearly flush, the nearest point of *b* is on its
/// edge, to the side by less than the distance. Such a contact would push the bodies sideways.
pub fn normals<'a>(contacts: impl Iterator<Item = &'a Contact> + Clone) -> Vec<DVec3> {
    let is_face = |c: &&Contact| matches!(c.feature.b, FeatureB::Face(_));
    let mut faces: Vec<_> = contacts.clone().filter(is_face).map(normal_of_pair).collect();
    faces.sort_unstable_by(|(p, n), (q, m)| p.cmp(q).then(n.x.total_cmp(&m.x)));
    faces.dedup();
    let of_contact = |contact: &Contact| {
        if is_face(&contact) {
            return contact.normal;
        }
        let (pair, normal) = normal_of_pair(contact);
        let from = faces.partition_point(|(p, n)| (*p, n.x) < (pair, normal.x - PARALLEL));
        let near = faces[from..].iter().take_while(|(p, n)| *p == pair && n.x <= normal.x + PARALLEL);
        let nearest = near.map(|(_, n)| (n.distance(normal), n)).min_by(|(d, _), (e, _)| d.total_cmp(e));
        let sign = if contact.instance_a < contact.instance_b { 1.0 } else { -1.0 };
        nearest.filter(|(d, _)| *d <= PARALLEL).map_or(contact.normal, |(_, n)| sign * *n)
    };
    contacts.map(of_contact).collect()
}

/// The instances of a contact, the lower one first, and the normal from the higher one to the lower
/// one.
fn normal_of_pair(contact: &Contact) -> ((InstanceId, InstanceId), DVec3) {
    let (a, b) = (contact.instance_a, contact.instance_b);
    if a < b { ((a, b), contact.normal) } else { ((b, a), -contact.normal) }
}

#[cfg(test)]
mod tests {
    use tesdf::collide::FeatureId;

    use super::*;

    #[test]
    fn an_edge_takes_the_normal_of_a_face_of_its_pair_that_is_nearly_its_own() {
        let contact = |ids: [u32; 2], b: FeatureB, normal: DVec3| Contact {
            point_a: DVec3::ZERO,
            point_b: DVec3::ZERO,
            normal,
            distance: 0.0,
            face_a: 0,
            face_b: 0,
            tet_b: None,
            instance_a: InstanceId(ids[0]),
            instance_b: InstanceId(ids[1]),
            feature: FeatureId { a: 0, b },
            converged: true,
        };
        let near = DVec3::new(5e-4, 0.0, 1.0).normalize();
        let tilted = DVec3::new(0.03, 0.0, 1.0).normalize();
        let (face, edge) = (FeatureB::Face(0), FeatureB::Edge(0, 1));
        let (up, down) = (DVec3::Z, DVec3::NEG_Z);
        let cases = [
            ([0, 1], face, up, up),
            ([0, 1], edge, near, up),
            ([0, 1], edge, tilted, tilted),
            ([0, 2], edge, near, near),
            ([1, 0], FeatureB::Vertex(3), -near, down),
            ([1, 0], edge, near, near),
        ];
        let contacts = cases.map(|(ids, b, normal, _)| contact(ids, b, normal));
        assert_eq!(normals(contacts.iter()), cases.map(|(.., expected)| expected));
    }
}
