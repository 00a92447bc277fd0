use rayon::prelude::*;

use super::field::FieldBody;
use super::hidden;
use super::instance_pairs::instance_pairs;
use super::narrow::{Minimum, Search};
use super::surface::{Candidates, Part, SurfaceBody};
use super::{
    CollideError, CollideOptions, Contact, Contacts, FeatureId, InstanceId, Mode, Scene, Statistics,
    reduce_pairs,
};

/// Faces or nodes that one task takes.
const TASK: usize = 64;

/// All contacts of a scene up to the contact distance.
///
/// Both directions of each pair are evaluated: faces (or nodes) of the one against the field of the other, and the other way around.
/// Pairs that overlap although no contact shows it are in [`Contacts::hidden`].
/// Runs on the current rayon pool; the result is the same on any number of threads.
///
/// # Errors
/// An option that makes no sense, or an instance whose shape is gone.
pub fn detect(scene: &Scene, options: &CollideOptions) -> Result<Contacts, CollideError> {
    let directions = Direction::all(scene, options)?;
    let candidates: Vec<Candidates> = directions.par_iter().map(Direction::candidates).collect();
    let tasks: Vec<(&Direction, &[u32])> = directions
        .iter()
        .zip(&candidates)
        .flat_map(|(direction, candidates)| candidates.chunks(TASK).map(move |chunk| (direction, chunk)))
        .collect();
    let found: Vec<Found> = tasks.par_iter().map(|(direction, chunk)| direction.contacts(chunk)).collect();
    let mut statistics = Statistics {
        instance_pairs: directions.len(),
        candidates: candidates.iter().map(Vec::len).sum(),
        ..Statistics::default()
    };
    let mut contacts = Vec::with_capacity(found.iter().map(|f| f.contacts.len()).sum());
    for part in found {
        statistics.polygons += part.polygons;
        statistics.filtered += part.filtered;
        contacts.extend(part.contacts);
    }
    statistics.touching = contacts.len() + statistics.filtered;
    statistics.unconverged = contacts.iter().filter(|c| !c.converged).count();
    statistics.bytes = size_of_val(directions.as_slice())
        + statistics.candidates * size_of::<u32>()
        + size_of_val(tasks.as_slice())
        + size_of_val(contacts.as_slice());
    // Tasks follow the pairs, which are sorted; within a pair a face has one place.
    contacts
        .chunk_by_mut(|x, y| (x.instance_a, x.instance_b) == (y.instance_a, y.instance_b))
        .for_each(|run| run.sort_unstable_by_key(order));
    let all = contacts.len();
    let (contacts, reductions) = reduce_pairs(contacts, options.reduction);
    statistics.reduced = all - contacts.len();
    let hidden = hidden::among(&directions, options.mode, &contacts);
    Ok(Contacts { contacts, statistics, reductions, hidden })
}

/// Within one ordered pair of instances. A point in no cell may be one of several pieces outside of the cube.
fn order(c: &Contact) -> (u32, u32, Option<u32>, [u64; 3]) {
    (c.face_a, c.feature.a, c.tet_b, c.point_a.to_array().map(f64::to_bits))
}

/// One body's surface against another's field.
pub struct Direction<'a> {
    /// Whose faces or nodes.
    pub surface: SurfaceBody<'a>,
    /// Whose signed distances.
    pub field: FieldBody<'a>,
    /// How minima are found, and up to which value.
    pub search: Search,
    options: &'a CollideOptions,
    pub a: InstanceId,
    pub b: InstanceId,
}

#[derive(Default)]
struct Found {
    contacts: Vec<Contact>,
    polygons: usize,
    filtered: usize,
}

impl<'a> Direction<'a> {
    /// Both directions of all pairs of instances that can touch.
    pub fn all(scene: &'a Scene, options: &'a CollideOptions) -> Result<Vec<Self>, CollideError> {
        options.validate()?;
        instance_pairs(scene, options.contact_distance, options.speculative_time)?
            .iter()
            .flat_map(|pair| [(pair.first, pair.second, pair), (pair.second, pair.first, pair)])
            .map(|(a, b, pair)| Self::new(scene, options, a, b, pair.contact_distance))
            .collect()
    }

    /// `contact_distance` is that of the pair, in the world's unit.
    pub fn new(
        scene: &'a Scene,
        options: &'a CollideOptions,
        a: InstanceId,
        b: InstanceId,
        contact_distance: f64,
    ) -> Result<Self, CollideError> {
        let (of_a, of_b) = (scene.instance(a)?, scene.instance(b)?);
        let (shape_a, shape_b) = (scene.shape(of_a.shape)?, scene.shape(of_b.shape)?);
        let field = FieldBody::new(shape_b, of_b.placement());
        let surface = SurfaceBody::new(shape_a, of_a.placement(), &field);
        let diagonal = shape_b.diagonal().min(f64::MAX) * of_b.scale;
        let search = Search::new(options, contact_distance, &field, diagonal);
        Ok(Self { surface, field, search, options, a, b })
    }

    /// Broad phase.
    pub fn candidates(&self) -> Candidates {
        match self.options.mode {
            Mode::Node => self.surface.nodes(&self.field, self.search.reach),
            Mode::Face(_) => self.surface.faces(&self.field, self.search.reach),
        }
    }

    /// Middle and narrow phase, and the cosine filter.
    fn contacts(&self, candidates: &[u32]) -> Found {
        let mut found = Found::default();
        let Found { contacts, polygons, filtered } = &mut found;
        for &candidate in candidates {
            let (part, face_a, feature) = self.part(candidate);
            self.search.minima(&self.field, &part, &mut |_| *polygons += 1, &mut |_, minimum| {
                if self.is_filtered(&part, &minimum) {
                    *filtered += 1;
                } else {
                    contacts.push(self.contact(&part, &minimum, face_a, feature));
                }
            });
        }
        found
    }

    /// A candidate, the user's number of its face, and its own: of the node or the face.
    pub fn part(&self, candidate: u32) -> (Part, u32, u32) {
        match self.options.mode {
            Mode::Node => (self.surface.node(candidate), self.surface.face_of_node(candidate), candidate),
            Mode::Face(_) => {
                let face = self.surface.face_id(candidate);
                (self.surface.face(candidate, &self.field, self.search.reach), face, face)
            }
        }
    }

    /// Eq. (10). What is rounded has every normal.
    pub fn is_filtered(&self, part: &Part, minimum: &Minimum) -> bool {
        match (self.options.mode, self.options.cos_theta) {
            (Mode::Face(_), Some(cos)) if part.points().len() == 3 => {
                minimum.value.gradient.dot(part.normal) > -cos
            }
            _ => false,
        }
    }

    pub fn contact(&self, part: &Part, minimum: &Minimum, face_a: u32, feature: u32) -> Contact {
        let Minimum { point, value, cell, converged } = *minimum;
        let (face_b, feature_b) = self.field.names(&value);
        Contact {
            point_a: self.field.to_world(point - part.radius * value.gradient),
            point_b: self.field.to_world(value.closest_point),
            normal: self.field.turn(value.gradient),
            distance: (value.distance - part.radius) * self.field.unit(),
            face_a,
            face_b,
            tet_b: cell,
            instance_a: self.a,
            instance_b: self.b,
            feature: FeatureId { a: feature, b: feature_b },
            converged,
        }
    }
}
