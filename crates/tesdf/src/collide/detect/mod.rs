//! Detection: the contacts of all pairs of a scene.
pub mod candidate_contacts;
pub mod candidates;
mod closed_form;
pub mod coarse;
pub mod descent;
pub mod hidden;
pub mod local_minima;
pub mod ordered_pair;
pub mod spread;
pub mod why;

use std::sync::atomic::{AtomicBool, Ordering};

use crate::parallel::*;

use crate::collide::bodies::surface::Candidates;
use crate::collide::cones::{Cones, keep_different};
use crate::collide::detect::candidate_contacts::{
    AtVertex, CandidateContacts, contacts, one_per_vertex, order, retain,
};
use crate::collide::detect::ordered_pair::OrderedPair;
use crate::collide::mode::ContactsPer;
use crate::collide::options::{CollideOptions, Reduction};
use crate::collide::pairs::InstancePair;
use crate::collide::pairs::kept::InstancePairs;
use crate::collide::report::contact::{Contact, Contacts, Statistics};
use crate::collide::report::reduce::{Reduced, reduced};
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;

/// Number of faces or nodes per task.
const TASK: usize = 64;

/// Two bodies with so few faces are detected on the calling thread.
const FEW: u32 = 32;

/// For detections that nobody stops.
static NEVER: AtomicBool = AtomicBool::new(false);

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
    Ok(of_pairs(&OrderedPair::all(scene, options)?, options, &NEVER))
}

/// As [`detect`], until another thread sets `stop`. What is being computed then is completed: some
/// faces, or with [`Reduction::Spread`] a pair of instances.
///
/// # Errors
/// As [`detect`], and [`CollideError::Stopped`].
pub fn detect_until(
    scene: &Scene,
    options: &CollideOptions,
    stop: &AtomicBool,
) -> Result<Contacts, CollideError> {
    let contacts = of_pairs(&OrderedPair::all(scene, options)?, options, stop);
    match stop.load(Ordering::Relaxed) {
        true => Err(CollideError::Stopped),
        false => Ok(contacts),
    }
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
    Ok(of_pairs(&OrderedPair::of(pairs, scene, options)?, options, &NEVER))
}

/// The candidates of ordered pairs, in tasks for threads.
pub fn tasks<'p, 's>(
    pairs: &'p [OrderedPair<'s>],
    candidates: &'p [Candidates],
) -> Vec<(&'p OrderedPair<'s>, &'p [u32])> {
    let of_pair = |(pair, candidates): (&'p OrderedPair<'s>, &'p Candidates)| {
        candidates.chunks(TASK).map(move |chunk| (pair, chunk))
    };
    pairs.iter().zip(candidates).flat_map(of_pair).collect()
}

/// The contacts without those that have a twin in their pair of instances. The two orders of a pair
/// are adjacent.
fn different(mut contacts: Vec<Contact>, pairs: &[OrderedPair]) -> Vec<Contact> {
    let ids = |a: InstanceId, b: InstanceId| (a.min(b), a.max(b));
    let of = |c: &Contact| ids(c.instance_a, c.instance_b);
    let mut pairs = pairs.iter();
    let mut runs = Vec::new();
    for run in contacts.chunk_by(|x, y| of(x) == of(y)) {
        // Contacts follow the order of the pairs.
        let near = pairs.find(|pair| ids(pair.a, pair.b) == of(&run[0]));
        runs.push((run, near.and_then(|pair| pair.cones.as_ref()).map(Cones::near)));
    }
    let kept = |(run, near): &(&[Contact], Option<f64>)| match near {
        Some(near) => keep_different(run, *near),
        None => vec![true; run.len()],
    };
    let kept: Vec<Vec<bool>> = runs.par_iter().map(kept).collect();
    retain(&mut contacts, kept.into_iter().flatten());
    contacts
}

/// The contacts of ordered pairs. Once `stop` is set, contacts are missing.
fn of_pairs(pairs: &[OrderedPair], options: &CollideOptions, stop: &AtomicBool) -> Contacts {
    // A box on a table takes less time than another thread takes to wake up.
    let is_small = pairs.len() <= 2 && pairs.iter().map(|pair| pair.surface.face_count()).sum::<u32>() <= FEW;
    if is_small {
        of_pairs_by(pairs, options, stop, is_small)
    } else {
        in_pool(|| of_pairs_by(pairs, options, stop, is_small))
    }
}

/// As [`of_pairs`], on the calling thread where they are few.
fn of_pairs_by(
    pairs: &[OrderedPair],
    options: &CollideOptions,
    stop: &AtomicBool,
    is_small: bool,
) -> Contacts {
    let stopped = || stop.load(Ordering::Relaxed);
    if let Reduction::Spread(n) = options.reduction {
        return spread::of_pairs(pairs, options, stop, n as usize);
    }
    let candidates_of = |pair: &OrderedPair| if stopped() { Candidates::new() } else { pair.candidates() };
    let candidates: Vec<Candidates> = match is_small {
        true => pairs.iter().map(candidates_of).collect(),
        false => pairs.par_iter().map(candidates_of).collect(),
    };
    let tasks = tasks(pairs, &candidates);
    let contacts_of = |(pair, chunk): &(&OrderedPair, &[u32])| {
        if stopped() { CandidateContacts::default() } else { contacts(pair, chunk) }
    };
    let found: Vec<CandidateContacts> = match is_small {
        true => {
            let mut all = CandidateContacts::default();
            let open = tasks.iter().take_while(|_| !stopped());
            open.for_each(|(pair, chunk)| all.extend(pair, chunk));
            vec![all]
        }
        false => tasks.par_iter().map(contacts_of).collect(),
    };
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
        .for_each(|run| run.sort_by_key(order));
    if options.mode.contacts_per() == Some(ContactsPer::Minimum) {
        let found = contacts.len();
        contacts = different(contacts, pairs);
        statistics.filtered += found - contacts.len();
        statistics.unconverged = contacts.iter().filter(|c| !c.converged).count();
    }
    let all = contacts.len();
    let Reduced { contacts, reports, bytes } = reduced(contacts, options.reduction);
    statistics.reduced = all - contacts.len();
    statistics.bytes += bytes;
    let hidden = hidden::among(pairs, options, &contacts, stop);
    Contacts::new(contacts, statistics, reports, hidden)
}
