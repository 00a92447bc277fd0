//! The contacts of some faces or nodes of an ordered pair.
use crate::collide::bodies::field::Field;
use crate::collide::bodies::surface::Part;
use crate::collide::detect::closed_form;
use crate::collide::detect::ordered_pair::OrderedPair;
use crate::collide::narrow::Minimum;
use crate::collide::report::contact::Contact;
use crate::geometry::Aabb;
use crate::parallel::*;
use crate::query::Surroundings;

/// Sort key within one ordered pair of instances. Without a cell, several pieces outside the cube
/// may have the same face, so the point decides.
pub fn order(c: &Contact) -> (u32, u32, Option<u32>, [u64; 3]) {
    (c.face_a, c.feature.a, c.tet_b, c.point_a.to_array().map(f64::to_bits))
}

/// A contact at a vertex of its face.
pub struct AtVertex {
    /// The index of the contact.
    pub index: usize,
    /// The vertex, by its bits in the field's frame.
    pub vertex: [u64; 3],
    /// Cosine between the gradient and the face's normal.
    pub cosine: f64,
}

/// Of the contacts of several faces at one vertex, keeps the one whose gradient most opposes its
/// face; among equals, that of the lowest face.
pub fn one_per_vertex(mut contacts: Vec<Contact>, at_vertices: &[AtVertex]) -> Vec<Contact> {
    if at_vertices.is_empty() {
        return contacts;
    }
    let key = |&AtVertex { index, vertex, cosine }: &AtVertex| {
        let Contact { instance_a, instance_b, face_a, .. } = contacts[index];
        // Cosines that differ by rounding are equal.
        ((instance_a, instance_b, vertex), (cosine * 1e9).round() as i64, face_a, index)
    };
    let keep = kept_at_vertices(at_vertices.iter().map(key).collect(), contacts.len());
    retain(&mut contacts, keep);
    contacts
}

/// Keeps the contacts for which `keep` says so, in order.
pub fn retain(contacts: &mut Vec<Contact>, keep: impl IntoIterator<Item = bool>) {
    let mut keep = keep.into_iter();
    contacts.retain(|_| keep.next().unwrap_or(true));
}

/// For each of `count` contacts: whether it is kept. Of those with the same vertex, the one with
/// the least cosine is; among equals, that of the lowest face. `keys` are vertex, cosine, face and
/// index of the contacts at vertices.
pub fn kept_at_vertices<V: Ord + Send>(mut keys: Vec<(V, i64, u32, usize)>, count: usize) -> Vec<bool> {
    keys.par_sort_unstable();
    let mut keep = vec![true; count];
    for same in keys.chunk_by(|x, y| x.0 == y.0) {
        same[1..].iter().for_each(|&(.., index)| keep[index] = false);
    }
    keep
}

/// The contacts of some candidates of an ordered pair.
#[derive(Default)]
pub struct CandidateContacts {
    /// The contacts, in the order of the candidates.
    pub contacts: Vec<Contact>,
    /// Those at vertices that other faces may have, too.
    pub at_vertices: Vec<AtVertex>,
    /// Number of polygons that were searched.
    pub polygons: usize,
    /// Number of contacts that a filter dropped.
    pub filtered: usize,
}

/// Middle phase, narrow phase and filters.
pub fn contacts(pair: &OrderedPair, candidates: &[u32]) -> CandidateContacts {
    let mut found = CandidateContacts::default();
    found.extend(pair, candidates);
    found
}

impl CandidateContacts {
    /// Adds the contacts of more candidates.
    pub fn extend(&mut self, pair: &OrderedPair, candidates: &[u32]) {
        if pair.is_of_other_order() {
            return;
        }
        if matches!(pair.field.field, Field::Simple(_)) {
            return candidates.iter().for_each(|&k| self.add(pair, k, &pair.part(k), None));
        }
        let parts: Vec<(Part, u32, u32)> = candidates.iter().map(|&candidate| pair.part(candidate)).collect();
        let mut rest = parts.as_slice();
        let mut next = candidates.iter();
        while !rest.is_empty() {
            let of_faces = pair.search.is_of_faces();
            let (group, others) = rest.split_at(if of_faces { near_each_other(rest) } else { rest.len() });
            rest = others;
            let parts = || group.iter().map(|(part, ..)| part);
            let around = match of_faces {
                true => pair.search_of(parts()).surroundings(&pair.field, parts()),
                false => None,
            };
            for (part, &candidate) in group.iter().zip(&mut next) {
                self.add(pair, candidate, part, around.as_ref());
            }
        }
    }

    /// Adds the contacts of a candidate. `part` is its [`part`](OrderedPair::part), and `around` the
    /// mesh around it, where that is known.
    fn add(
        &mut self,
        pair: &OrderedPair,
        candidate: u32,
        (part, face, feature): &(Part, u32, u32),
        around: Option<&Surroundings>,
    ) {
        let Self { contacts, at_vertices, polygons, filtered } = self;
        let mut found = |minimum: Minimum| {
            let (minimum, cosine) = pair.faced(part, candidate, minimum);
            let Ok(contact) = pair.contact(part, candidate, &minimum, cosine, [*face, *feature]) else {
                *filtered += 1;
                return;
            };
            if let Some(vertex) = pair.vertex(part, &minimum) {
                at_vertices.push(AtVertex { index: contacts.len(), vertex, cosine });
            }
            contacts.push(contact);
        };
        let search = pair.search_of([part]);
        if let Field::Simple(simple) = pair.field.field
            && closed_form::minima(simple, &search, pair.mode(), part, &mut found)
        {
            *polygons += 1;
            return;
        }
        let mut polygon = |_: &_| *polygons += 1;
        search.minima(&pair.field, part, around, &mut polygon, &mut |_, m| found(m));
    }
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
