use std::collections::BTreeMap;

use glam::DVec3;

use crate::base::elementary;
use crate::collide::report::contact::Contact;
use crate::collide::scene::ids::InstanceId;

/// Groups the contacts `members` of one pair. Each group begins with the deepest contact that is
/// left, and takes all contacts with a similar normal that are linked to it: up to `link` apart, or
/// on one face. Members of a group are in ascending order; groups are in the order of their deepest
/// contacts.
///
/// `lower` is the lower id of the pair.
pub fn groups(
    contacts: &[Contact],
    members: &[usize],
    lower: InstanceId,
    link: f64,
    angle: f64,
) -> Vec<Vec<usize>> {
    let least_cos = elementary::cos(angle);
    let mut grid: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    let mut on_face: BTreeMap<(InstanceId, u32), Vec<usize>> = BTreeMap::new();
    for &i in members {
        let c = &contacts[i];
        grid.entry(cell(c.point_a, link)).or_default().push(i);
        for key in keys(c) {
            on_face.entry(key).or_default().push(i);
        }
    }
    let mut order = members.to_vec();
    order.sort_unstable_by(|&i, &j| contacts[i].distance.total_cmp(&contacts[j].distance).then(i.cmp(&j)));
    let mut is_free: BTreeMap<usize, bool> = members.iter().map(|&i| (i, true)).collect();
    let mut groups = Vec::new();
    for &seed in &order {
        if is_free.insert(seed, false) != Some(true) {
            continue;
        }
        let normal = force(&contacts[seed], lower);
        let mut group = vec![seed];
        let mut seen = std::collections::BTreeSet::new();
        let mut next = 0;
        while let Some(&i) = group.get(next) {
            next += 1;
            let at = contacts[i].point_a;
            let mut offer = |near: &mut Vec<usize>, reach: f64, group: &mut Vec<usize>| {
                near.retain(|&j| {
                    let c = &contacts[j];
                    let is_linked = is_free[&j]
                        && c.point_a.distance(at) <= reach
                        && force(c, lower).dot(normal) >= least_cos;
                    if is_linked {
                        is_free.insert(j, false);
                        group.push(j);
                    }
                    is_free[&j]
                });
            };
            for key in keys(&contacts[i]) {
                // All contacts on a face are compared with the seed once.
                if seen.insert(key)
                    && let Some(near) = on_face.get_mut(&key)
                {
                    offer(near, f64::INFINITY, &mut group);
                }
            }
            let [x, y, z] = cell(at, link);
            for k in 0..27 {
                let neighbour = [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1];
                if let Some(near) = grid.get_mut(&neighbour) {
                    offer(near, link, &mut group);
                }
            }
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

/// The direction of the force on the instance with the lower id.
pub fn force(contact: &Contact, lower: InstanceId) -> DVec3 {
    if contact.instance_a == lower { contact.normal } else { -contact.normal }
}

fn keys(c: &Contact) -> [(InstanceId, u32); 2] {
    [(c.instance_a, c.face_a), (c.instance_b, c.face_b)]
}

/// The cell of a grid. Far out, where numbers end, all points are in the last cell.
fn cell(p: DVec3, link: f64) -> [i64; 3] {
    const LAST: f64 = 1e15;
    (p / link).to_array().map(|x| x.floor().clamp(-LAST, LAST) as i64)
}
