//! Contacts that were found elsewhere, as on a GPU, and contacts that both orders of a pair find.
use super::Cones;
use super::cone::{PARALLEL, SAME};
use crate::collide::mode::{ContactsPer, FaceOptions};
use crate::collide::report::contact::Contact;
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::parallel::*;
use crate::query::Precision;

/// Contacts of faces that were found elsewhere with the precision `f32`, with the normals of their
/// cones. `faces` are the indices of their faces in both shapes, and the contacts are in the order
/// of a detection with these options. Per local minimum, those that have no normal and twins are
/// left out.
///
/// # Errors
/// [`CollideError::NoInstance`] for an instance that the scene lacks.
pub fn in_cones(
    scene: &Scene,
    options: &FaceOptions,
    contacts: &[Contact],
    faces: &[[u32; 2]],
) -> Result<Vec<Contact>, CollideError> {
    let ids = |c: &Contact| (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b));
    let mut found = Vec::with_capacity(contacts.len());
    let mut faces = faces;
    for run in contacts.chunk_by(|x, y| ids(x) == ids(y)) {
        let mut of_pair = Vec::with_capacity(run.len());
        let mut near = 0.0;
        for order in run.chunk_by(|x, y| x.instance_a == y.instance_a) {
            let bodies = [scene.placed(order[0].instance_a)?, scene.placed(order[0].instance_b)?];
            let diagonal = bodies[1].0.diagonal().min(f64::MAX) * bodies[1].1.scale;
            let cones = Cones::new(bodies, options.tolerance.resolve(diagonal), Precision::F32);
            near = cones.near();
            let (of_order, others) = faces.split_at(order.len().min(faces.len()));
            faces = others;
            if cones.are_of_other_order(options.contacts_per) {
                continue;
            }
            let of_order = order
                .par_iter()
                .zip(of_order)
                .filter_map(|(c, faces)| cones.contact(*c, *faces, options.contacts_per));
            of_pair.extend(of_order.collect::<Vec<_>>());
        }
        match options.contacts_per {
            ContactsPer::Cell | ContactsPer::Face => found.append(&mut of_pair),
            ContactsPer::Minimum => {
                let kept = keep_different(&of_pair, near);
                found.extend(of_pair.into_iter().zip(kept).filter_map(|(c, keep)| keep.then_some(c)));
            }
        }
    }
    Ok(found)
}

/// Of contacts of one pair of instances that have the same place, normal and distance, in both
/// orders, keeps the first: twins would carry twice the load of others. `contacts` are all of the
/// pair, and `near` is [`Cones::near`].
pub fn keep_different(contacts: &[Contact], near: f64) -> Vec<bool> {
    let point = |k: usize| 0.5 * (contacts[k].point_a + contacts[k].point_b);
    let normal = |k: usize| {
        let Contact { instance_a, instance_b, normal, .. } = contacts[k];
        if instance_a < instance_b { normal } else { -normal }
    };
    let mut order: Vec<usize> = (0..contacts.len()).collect();
    order.sort_by(|&k, &l| point(k).x.total_cmp(&point(l).x).then(k.cmp(&l)));
    let mut twins: Vec<(usize, usize)> = Vec::new();
    for (i, &k) in order.iter().enumerate() {
        let distance = contacts[k].distance;
        // The two points of a contact are as far apart as its distance, in both orders along the
        // same normal.
        let reach = near + PARALLEL * distance.abs();
        for &l in &order[i + 1..] {
            if point(l).x - point(k).x > reach {
                break;
            }
            if point(k).distance(point(l)) <= reach
                && normal(k).distance(normal(l)) <= SAME
                && (distance - contacts[l].distance).abs() <= near
            {
                twins.push((k.min(l), k.max(l)));
            }
        }
    }
    twins.sort_unstable();
    let mut kept = vec![true; contacts.len()];
    for (k, l) in twins {
        kept[l] &= !kept[k];
    }
    kept
}
