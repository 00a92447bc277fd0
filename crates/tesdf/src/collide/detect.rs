use crate::parallel::*;

use super::hidden;
use super::narrow::Minimum;
use super::ordered_pair::OrderedPair;
use super::reduce::{Reduced, reduced};
use super::surface::{Candidates, Part};
use super::{
    CollideError, CollideOptions, Contact, Contacts, InstancePair, InstancePairs, Scene, Statistics,
};
use crate::geometry::Aabb;

/// Number of faces or nodes per task.
const TASK: usize = 64;

/// All contacts of a scene up to the contact distance.
///
/// Both orders of each pair are evaluated: faces (or nodes) of the first body against the field of
/// the second body, and vice versa. [`Contacts::hidden`] lists pairs that overlap without a contact
/// that shows it. Runs on the current rayon pool. The result is the same for any number of threads.
///
/// # Errors
/// An option is invalid, or the shape of an instance is missing.
///
/// # Example
///
/// ```
/// use tesdf::glam::DVec3;
/// use tesdf::{CollideOptions, Instance, Mode, Pose, Scene, Shape, detect};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut scene = Scene::new();
/// let ball = scene.add_shape(Shape::Sphere { radius: 1.0 })?;
/// scene.add(Instance::new(ball, Pose::IDENTITY))?;
/// scene.add(Instance::new(ball, Pose::at(DVec3::new(0.0, 0.0, 1.5))))?;
/// let contacts = detect(&scene, &CollideOptions::default())?;
/// assert!(contacts.iter().all(|c| (c.distance + 0.5).abs() < 1e-6));
///
/// // Contacts up to 0.1 apart, at the nodes of the bodies.
/// let options = CollideOptions { contact_distance: 0.1, ..CollideOptions::with_mode(Mode::Node) };
/// assert!(detect(&scene, &options)?.len() >= 2);
/// # Ok(())
/// # }
/// ```
pub fn detect(scene: &Scene, options: &CollideOptions) -> Result<Contacts, CollideError> {
    Ok(of_pairs(&OrderedPair::all(scene, options)?, options))
}

/// The contacts that [`detect`] finds, for a scene whose instances move a little from step to step.
/// `pairs` are updated first.
///
/// # Errors
/// As [`detect`].
pub fn detect_with(
    pairs: &mut InstancePairs,
    scene: &Scene,
    options: &CollideOptions,
) -> Result<Contacts, CollideError> {
    options.validate()?;
    pairs.update(scene, options)?;
    detect_pairs(pairs.pairs(), scene, options)
}

/// The contacts that [`detect`] finds between these pairs of instances, in their order. The pairs
/// are all different. [`InstancePairs::update_moved`] finds them where the caller knows which
/// instances have moved.
///
/// # Errors
/// As [`detect`], and [`CollideError::NoInstance`].
pub fn detect_pairs(
    pairs: &[InstancePair],
    scene: &Scene,
    options: &CollideOptions,
) -> Result<Contacts, CollideError> {
    Ok(of_pairs(&OrderedPair::of(pairs, scene, options)?, options))
}

fn of_pairs(pairs: &[OrderedPair], options: &CollideOptions) -> Contacts {
    let candidates: Vec<Candidates> = pairs.par_iter().map(OrderedPair::candidates).collect();
    let tasks: Vec<(&OrderedPair, &[u32])> = pairs
        .iter()
        .zip(&candidates)
        .flat_map(|(pair, candidates)| candidates.chunks(TASK).map(move |chunk| (pair, chunk)))
        .collect();
    let found: Vec<Found> = tasks.par_iter().map(|(pair, chunk)| contacts(pair, chunk)).collect();
    let mut statistics = Statistics {
        instance_pairs: pairs.len(),
        candidates: candidates.iter().map(Vec::len).sum(),
        ..Statistics::default()
    };
    let mut contacts = Vec::with_capacity(found.iter().map(|f| f.contacts.len()).sum());
    let mut at_vertices = Vec::new();
    for part in found {
        statistics.polygons += part.polygons;
        statistics.filtered += part.filtered;
        let before = contacts.len();
        at_vertices.extend(part.at_vertices.into_iter().map(|v| AtVertex { index: before + v.index, ..v }));
        contacts.extend(part.contacts);
    }
    let mut contacts = one_per_vertex(contacts, &at_vertices);
    statistics.touching = contacts.len() + statistics.filtered;
    statistics.unconverged = contacts.iter().filter(|c| !c.converged).count();
    statistics.bytes = size_of_val(pairs)
        + statistics.candidates * size_of::<u32>()
        + size_of_val(tasks.as_slice())
        + size_of_val(contacts.as_slice());
    // Tasks follow the sorted order of the pairs. Within a pair, contacts are sorted by face.
    contacts
        .chunk_by_mut(|x, y| (x.instance_a, x.instance_b) == (y.instance_a, y.instance_b))
        .for_each(|run| run.sort_unstable_by_key(order));
    let all = contacts.len();
    let Reduced { contacts, reports, bytes } = reduced(contacts, options.reduction);
    statistics.reduced = all - contacts.len();
    statistics.bytes += bytes;
    let hidden = hidden::among(pairs, options.mode, &contacts);
    Contacts::new(contacts, statistics, reports, hidden)
}

/// Sort key within one ordered pair of instances. Without a cell, several pieces outside the cube
/// may have the same face, so the point decides.
fn order(c: &Contact) -> (u32, u32, Option<u32>, [u64; 3]) {
    (c.face_a, c.feature.a, c.tet_b, c.point_a.to_array().map(f64::to_bits))
}

/// A contact at a vertex of its face.
struct AtVertex {
    /// The index of the contact.
    index: usize,
    /// The vertex, by its bits in the field's frame.
    vertex: [u64; 3],
    /// Cosine between the gradient and the face's normal.
    cosine: f64,
}

/// Of the contacts of several faces at one vertex, keeps the one whose gradient most opposes its
/// face; among equals, that of the lowest face.
fn one_per_vertex(contacts: Vec<Contact>, at_vertices: &[AtVertex]) -> Vec<Contact> {
    if at_vertices.is_empty() {
        return contacts;
    }
    let key = |&AtVertex { index, vertex, cosine }: &AtVertex| {
        let Contact { instance_a, instance_b, face_a, .. } = contacts[index];
        // Cosines that differ by rounding are equal.
        ((instance_a, instance_b, vertex), (cosine * 1e9).round() as i64, face_a, index)
    };
    let keep = kept_at_vertices(at_vertices.iter().map(key).collect(), contacts.len());
    contacts.into_iter().zip(keep).filter_map(|(contact, keep)| keep.then_some(contact)).collect()
}

/// For each of `count` contacts: whether it is kept. Of those with the same vertex, the one with the
/// least cosine is; among equals, that of the lowest face. `keys` are vertex, cosine, face and index
/// of the contacts at vertices.
pub fn kept_at_vertices<V: Ord + Send>(mut keys: Vec<(V, i64, u32, usize)>, count: usize) -> Vec<bool> {
    keys.par_sort_unstable();
    let mut keep = vec![true; count];
    for same in keys.chunk_by(|x, y| x.0 == y.0) {
        same[1..].iter().for_each(|&(.., index)| keep[index] = false);
    }
    keep
}

#[derive(Default)]
struct Found {
    contacts: Vec<Contact>,
    at_vertices: Vec<AtVertex>,
    polygons: usize,
    filtered: usize,
}

/// Middle phase, narrow phase and cosine filter.
fn contacts(pair: &OrderedPair, candidates: &[u32]) -> Found {
    let mut found = Found::default();
    let Found { contacts, at_vertices, polygons, filtered } = &mut found;
    let parts: Vec<(Part, u32, u32)> = candidates.iter().map(|&candidate| pair.part(candidate)).collect();
    let mut rest = parts.as_slice();
    while !rest.is_empty() {
        let count = if pair.search.is_of_faces() { near_each_other(rest) } else { rest.len() };
        let (group, others) = rest.split_at(count);
        rest = others;
        let around = pair.search.surroundings(&pair.field, group.iter().map(|(part, ..)| part));
        for (part, face_a, feature) in group {
            let mut found = |minimum: Minimum| {
                if pair.is_filtered(part, &minimum) {
                    *filtered += 1;
                    return;
                }
                if let Some(vertex) = pair.vertex(part, &minimum) {
                    let cosine = minimum.value.gradient.dot(part.normal);
                    at_vertices.push(AtVertex { index: contacts.len(), vertex, cosine });
                }
                contacts.push(pair.contact(part, &minimum, *face_a, *feature));
            };
            let mut polygon = |_: &_| *polygons += 1;
            pair.search.minima(&pair.field, part, around.as_ref(), &mut polygon, &mut |_, m| found(m));
        }
    }
    found
}

/// Largest number of parts whose surroundings are searched together, and the largest size of their
/// bounds, relative to the largest part.
const GROUP: usize = 16;
const SPREAD: f64 = 4.0;

/// The number of parts, from the first on, that lie near each other; at least 1.
fn near_each_other(parts: &[(Part, u32, u32)]) -> usize {
    let (mut bounds, mut largest) = (Aabb::EMPTY, 0.0f64);
    parts
        .iter()
        .take(GROUP)
        .take_while(|(part, ..)| {
            let own = Aabb::of(part.points());
            bounds = bounds.union(own);
            largest = largest.max(own.extent().max_element());
            bounds.extent().max_element() <= SPREAD * largest
        })
        .count()
        .max(1)
}
