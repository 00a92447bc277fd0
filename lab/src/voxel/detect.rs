//! Contacts with voxel grids in place of exact fields.
use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;
use tesdf::TeSdf;
use tesdf::collide::internal::kept_at_vertices;
use tesdf::collide::{
    CollideError, CollideOptions, Contact, Contacts, FeatureB, FeatureId, InstanceId, InstancePair, Mode,
    Placement, Reduction, Scene, Shape, ShapeId, Statistics, detect_pairs, instance_pairs,
};
use tesdf::glam::DVec3;
use tesdf_sim::newton::Detect;

use super::{VoxelGrid, VoxelValue};

/// Finds the contacts of encoded meshes with a voxel grid in place of each mesh's field.
///
/// All else is as in [`tesdf::detect`]: vertices, or faces by Frank–Wolfe over the whole face, in
/// both orders of a pair, up to the same distance. Pairs with a simple shape get their exact
/// contacts. Three things differ:
///
/// - The extremes of flat faces are not searched, only their lowest points.
/// - The mode [`Exact`](Mode::Exact) and reductions are refused.
/// - Hidden overlaps of pairs with grids are not searched, because that needs exact distances.
///
/// A grid knows no faces. So [`Contact::face_b`] and the feature of *b* are the block of the grid
/// in which the point lies, as if it was a face.
#[derive(Clone, Debug)]
pub struct VoxelDetector {
    grids: BTreeMap<ShapeId, Arc<VoxelGrid>>,
}

impl VoxelDetector {
    /// `grids` are those of the scene's meshes.
    pub fn new(grids: BTreeMap<ShapeId, Arc<VoxelGrid>>) -> Self {
        Self { grids }
    }
}

impl Detect for VoxelDetector {
    /// # Errors
    /// As [`tesdf::detect`]; [`CollideError::NoShape`] for a mesh without a grid; and
    /// [`CollideError::Option`] for a mode or reduction that grids do not have.
    fn detect(&self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, CollideError> {
        options.validate()?;
        let refuse = |option, found: String, expected| Err(CollideError::Option { option, found, expected });
        if matches!(options.mode, Mode::Exact(_)) {
            return refuse("mode", "exact".into(), "node or face: a grid has no exact minimum");
        }
        if options.reduction != Reduction::None {
            return refuse("reduction", format!("{:?}", options.reduction), "none, for voxel grids");
        }
        let pairs = instance_pairs(scene, options.contact_distance, options.speculative_time)?;
        let (mut ordered, mut others) = (Vec::new(), Vec::new());
        for pair in &pairs {
            let InstancePair { first, second, .. } = *pair;
            match (self.body(scene, first)?, self.body(scene, second)?) {
                (Some(a), Some(b)) => ordered.extend([
                    Ordered { a, b, reach: pair.contact_distance },
                    Ordered { a: b, b: a, reach: pair.contact_distance },
                ]),
                _ => others.push(*pair),
            }
        }
        let exact = detect_pairs(&others, scene, options)?;
        let (mut statistics, hidden) = (exact.statistics, exact.hidden.clone());
        statistics.instance_pairs += ordered.len();
        let mut contacts = exact.into_vec();
        for pair in &ordered {
            let found = pair.contacts(options);
            add(&mut statistics, &found);
            contacts.extend(found.contacts);
        }
        let order = |c: &Contact| {
            let (a, b) = (c.instance_a, c.instance_b);
            (a.min(b), a.max(b), a)
        };
        contacts.sort_by_key(order);
        statistics.bytes = size_of_val(contacts.as_slice());
        Ok(Contacts::new(contacts, statistics, Vec::new(), hidden))
    }

    /// The distances of a grid are not exact.
    fn holds_all(&self, _: &CollideOptions) -> bool {
        false
    }
}

fn add(statistics: &mut Statistics, found: &Found) {
    statistics.candidates += found.candidates;
    statistics.polygons += found.candidates;
    statistics.filtered += found.filtered;
    statistics.touching += found.contacts.len() + found.filtered;
    statistics.unconverged += found.contacts.iter().filter(|c| !c.converged).count();
}

impl VoxelDetector {
    /// A mesh with its grid; `None` for a simple shape.
    fn body<'a>(&'a self, scene: &'a Scene, id: InstanceId) -> Result<Option<Body<'a>>, CollideError> {
        let instance = scene.instance(id)?;
        let Shape::Mesh(asset) = scene.shape(instance.shape)? else { return Ok(None) };
        let grid = self.grids.get(&instance.shape).ok_or(CollideError::NoShape(instance.shape))?;
        Ok(Some(Body { id, asset, grid, placement: instance.placement() }))
    }
}

#[derive(Clone, Copy)]
struct Body<'a> {
    id: InstanceId,
    asset: &'a TeSdf,
    grid: &'a VoxelGrid,
    placement: Placement,
}

/// The surface of one body and the grid of another.
struct Ordered<'a> {
    a: Body<'a>,
    b: Body<'a>,
    /// Contacts are found up to this distance, in the world's unit.
    reach: f64,
}

#[derive(Default)]
struct Found {
    contacts: Vec<Contact>,
    candidates: usize,
    filtered: usize,
}

/// A contact of a face, with the data that decide which one of a vertex is kept.
struct OfFace {
    contact: Contact,
    vertex: Option<u32>,
    /// Cosine between the gradient and the face's normal.
    cosine: f64,
}

impl Ordered<'_> {
    fn contacts(&self, options: &CollideOptions) -> Found {
        let arrays = self.a.asset.arrays();
        // All points of a, in the frame of the grid.
        let to_grid =
            |p: &[f64; 3]| self.b.placement.to_shape(self.a.placement.to_world(DVec3::from_array(*p)));
        let points: Vec<DVec3> = arrays.vertices.par_iter().map(to_grid).collect();
        let reach = self.reach / self.b.placement.scale;
        if options.mode == Mode::Node {
            let node = |(v, p): (usize, &DVec3)| {
                let face = arrays.lowest_faces[v];
                let value = self.b.grid.value(*p);
                (face != u32::MAX && value.distance <= reach)
                    .then(|| self.contact(*p, value, face, v as u32, true))
            };
            let mut contacts: Vec<Contact> = points.par_iter().enumerate().filter_map(node).collect();
            contacts.sort_by_key(|c| (c.face_a, c.feature.a));
            return Found { contacts, candidates: points.len(), filtered: 0 };
        }
        let iterations = match options.mode {
            Mode::Face { iterations, .. } => iterations,
            Mode::Node | Mode::Exact(_) => Mode::ITERATIONS,
        };
        let face = |k: usize| {
            let corners = arrays.faces[k].map(|v| points[v as usize]);
            let (point, value) = lowest(self.b.grid, corners, iterations, reach)?;
            let id = arrays.face_ids[k];
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            let cosine = unit(value.gradient).dot(normal);
            let vertex = corners.iter().position(|c| *c == point).map(|c| arrays.faces[k][c]);
            Some(OfFace { contact: self.contact(point, value, id, id, false), vertex, cosine })
        };
        let found: Vec<OfFace> = (0..arrays.faces.len()).into_par_iter().filter_map(face).collect();
        let candidates = found.len();
        let (mut kept, mut filtered) = (Vec::new(), 0);
        for found in found {
            match options.mode.faces().and_then(|faces| faces.cos_theta) {
                Some(cos) if found.cosine > -cos => filtered += 1,
                _ => kept.push(found),
            }
        }
        let mut contacts = one_per_vertex(kept);
        contacts.sort_by_key(|c| c.face_a);
        Found { contacts, candidates, filtered }
    }

    /// `point` is in the frame of the grid.
    fn contact(&self, point: DVec3, value: VoxelValue, face: u32, feature: u32, converged: bool) -> Contact {
        let Placement { pose, scale } = self.b.placement;
        let normal = unit(value.gradient);
        Contact {
            point_a: self.b.placement.to_world(point),
            point_b: self.b.placement.to_world(point - value.distance * normal),
            normal: pose.rotation * normal,
            distance: scale * value.distance,
            face_a: face,
            face_b: value.block,
            tet_b: None,
            instance_a: self.a.id,
            instance_b: self.b.id,
            feature: FeatureId { a: feature, b: FeatureB::Face(value.block) },
            converged,
        }
    }
}

/// A gradient as a unit vector. It is 0 only where the samples around it are symmetric.
fn unit(gradient: DVec3) -> DVec3 {
    gradient.try_normalize().unwrap_or(DVec3::Z)
}

/// Of the contacts of several faces at one vertex, keeps the one whose gradient most opposes its
/// face, as [`tesdf::detect`] does.
fn one_per_vertex(found: Vec<OfFace>) -> Vec<Contact> {
    let key = |(index, f): (usize, &OfFace)| {
        Some((f.vertex?, (f.cosine * 1e9).round() as i64, f.contact.face_a, index))
    };
    let keys = found.iter().enumerate().filter_map(key).collect();
    let keep = kept_at_vertices(keys, found.len());
    found.into_iter().zip(keep).filter_map(|(f, keep)| keep.then_some(f.contact)).collect()
}

/// The lowest point of a face that Frank–Wolfe finds, as `frank_wolfe.rs` of the library does with
/// exact fields; `None` where the face is not within `reach`.
fn lowest(grid: &VoxelGrid, corners: [DVec3; 3], iterations: u32, reach: f64) -> Option<(DVec3, VoxelValue)> {
    let center = (corners[0] + corners[1] + corners[2]) / 3.0;
    let radius = corners.iter().map(|c| c.distance(center)).fold(0.0, f64::max);
    let first = grid.value(center);
    if first.distance > reach + radius + first.slack + grid.slack_within(reach) {
        return None;
    }
    let (mut at, mut value) = (center, first);
    for p in corners {
        let here = grid.value(p);
        if here.distance < value.distance {
            (at, value) = (p, here);
        }
    }
    let (mut best, mut least) = (at, value);
    for k in 0..iterations {
        let down = |p: &DVec3| value.gradient.dot(*p);
        let Some(target) = corners.into_iter().min_by(|p, q| down(p).total_cmp(&down(q))) else { break };
        if target == at {
            break;
        }
        at += 2.0 / (f64::from(k) + 2.0) * (target - at);
        value = grid.value(at);
        if value.distance < least.distance {
            (best, least) = (at, value);
        }
    }
    (least.distance <= reach).then_some((best, least))
}
