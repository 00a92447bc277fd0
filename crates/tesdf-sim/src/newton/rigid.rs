//! Which contacts have a normal that rigid contacts may rely on.
use glam::DVec3;
use tesdf::collide::{Contact, FeatureB, InstanceId};

/// Unit vectors that differ by less are parallel.
const PARALLEL: f64 = 1e-6;

/// For each contact: whether its normal is that of a face.
///
/// Near an edge of *b* the normal turns from that of one face to that of the next within the
/// distance of the contact. A nut whose rigid contacts rely on such normals locks itself: its thread
/// climbs by 2.3°, and the normals of facets that share an edge differ by 3.75°. So a contact of an
/// edge or a vertex counts only if a contact of a face has the same normal, as on the border of flat
/// contact.
pub fn have_normal_of_face(contacts: &[Contact]) -> Vec<bool> {
    let is_face = |c: &&Contact| matches!(c.feature.b, FeatureB::Face(_));
    let mut faces: Vec<_> = contacts.iter().filter(is_face).map(normal_of_pair).collect();
    faces.sort_by(|(p, n), (q, m)| p.cmp(q).then(n.x.total_cmp(&m.x)));
    faces.dedup();
    let is_parallel = |contact: &Contact| {
        let (pair, normal) = normal_of_pair(contact);
        let low = normal.x - PARALLEL;
        let from = faces.partition_point(|(p, n)| (*p, n.x) < (pair, low));
        let near = faces[from..].iter().take_while(|(p, n)| *p == pair && n.x <= normal.x + PARALLEL);
        near.into_iter().any(|(_, n)| n.distance(normal) <= PARALLEL)
    };
    contacts.iter().map(|contact| is_face(&contact) || is_parallel(contact)).collect()
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
    fn an_edge_needs_a_face_of_its_pair_with_the_same_normal() {
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
        let tilted = DVec3::new(0.03, 0.0, 1.0).normalize();
        let (face, edge) = (FeatureB::Face(0), FeatureB::Edge(0, 1));
        let contacts = [
            contact([0, 1], face, DVec3::Z),
            contact([0, 1], edge, DVec3::Z),
            contact([0, 1], edge, tilted),
            contact([0, 2], edge, DVec3::Z),
            contact([1, 0], FeatureB::Vertex(3), DVec3::NEG_Z),
            contact([1, 0], edge, DVec3::Z),
        ];
        assert_eq!(have_normal_of_face(&contacts), [true, true, false, false, true, false]);
    }
}
