//! The instances of a scene, in the layout of the device.
use tesdf::collide::internal::Ahead;
use tesdf::collide::{CollideOptions, InstanceId, InstancePair, Scene, ShapeId, instance_pairs};

use super::placed::{FieldFrame, Placed};
use crate::GpuError;
use crate::kernels::broad::ahead;
use crate::kernels::broad::pairs::{INSTANCE_ROWS, INSTANCE_WORDS};

/// All instances, sorted by world and then by id.
pub struct Instances {
    /// Ids of the instances.
    pub ids: Vec<InstanceId>,
    /// Poses of the instances' fields.
    pub placed: Vec<Placed>,
    /// For each instance, the index of its shape.
    pub shapes: Vec<usize>,
    /// [`INSTANCE_ROWS`] rows for each instance: all poses, then all motions.
    pub rows: Vec<[f32; 4]>,
    /// [`FIXED_ROWS`](crate::kernels::broad::place::FIXED_ROWS) rows for each instance, where an
    /// array on the device has the poses; otherwise empty.
    pub fixed: Vec<[f32; 4]>,
    /// [`INSTANCE_WORDS`] words for each instance.
    pub words: Vec<u32>,
    /// Excluded pairs, by index, sorted.
    pub excluded: Vec<u32>,
    /// All pairs that can touch, by index. Only for worlds so large that a tree on the processor
    /// is faster than testing all pairs on the device.
    pub pairs: Option<Vec<u32>>,
}

impl Instances {
    /// Collects the instances of a scene. `shape_ids` and `frames` belong to the uploaded shapes,
    /// sorted by id. With more than `max_tests` pairs of bounds to test, the pairs are found here.
    pub fn new(
        scene: &Scene,
        options: &CollideOptions,
        shape_ids: &[ShapeId],
        frames: &[FieldFrame],
        max_tests: u64,
    ) -> Result<Self, GpuError> {
        let mut order: Vec<(u32, InstanceId)> = scene.instances().map(|(id, i)| (i.world, id)).collect();
        order.sort_unstable();
        let mut all = Self {
            ids: order.iter().map(|&(_, id)| id).collect(),
            placed: Vec::with_capacity(order.len()),
            shapes: Vec::with_capacity(order.len()),
            rows: Vec::with_capacity(INSTANCE_ROWS as usize * order.len()),
            fixed: Vec::new(),
            words: Vec::with_capacity(INSTANCE_WORDS as usize * order.len()),
            excluded: Vec::new(),
            pairs: None,
        };
        let mut motions = Vec::new();
        let mut end = 0;
        for (k, &(world, id)) in order.iter().enumerate() {
            if k >= end {
                end = k + order[k..].partition_point(|&(w, _)| w == world);
            }
            let instance = scene.instance(id)?;
            let shape = scene.shape(instance.shape)?;
            let number = shape_ids.binary_search(&instance.shape).map_err(|_| GpuError::Instance {
                instance: id.0 as usize,
                reason: format!("shape {} is not on the device; upload the scene again", instance.shape.0),
            })?;
            let placed = Placed::new(frames[number], instance.placement());
            all.rows.extend(placed.rows());
            motions
                .extend(ahead::rows(&Ahead::new(instance, shape, options.speculative_time), placed.origin));
            let groups = instance.groups;
            all.words.extend([number as u32, end as u32, groups.memberships, groups.filter]);
            all.placed.push(placed);
            all.shapes.push(number);
        }
        all.rows.append(&mut motions);
        let mut place = vec![0u32; order.iter().map(|&(_, id)| id.0 as usize + 1).max().unwrap_or(0)];
        all.ids.iter().enumerate().for_each(|(k, id)| place[id.0 as usize] = k as u32);
        let mut excluded: Vec<[u32; 2]> = scene
            .excluded()
            .map(|(a, b)| [place[a.0 as usize], place[b.0 as usize]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        excluded.sort_unstable();
        all.excluded = excluded.into_flattened();
        let tests: u64 =
            order.chunk_by(|(v, _), (w, _)| v == w).map(|world| (world.len() as u64).pow(2) / 2).sum();
        if tests > max_tests {
            let pairs = instance_pairs(scene, options.contact_distance, options.speculative_time)?;
            let places = |p: &InstancePair| [p.first, p.second].map(|id| place[id.0 as usize]);
            all.pairs = Some(pairs.iter().flat_map(places).collect());
        }
        Ok(all)
    }

    /// For each instance, its place in the order of ids.
    pub fn ranks(&self) -> Vec<u32> {
        let mut by_id: Vec<usize> = (0..self.ids.len()).collect();
        by_id.sort_unstable_by_key(|&k| self.ids[k]);
        let mut ranks = vec![0; by_id.len()];
        by_id.into_iter().zip(0..).for_each(|(k, rank)| ranks[k] = rank);
        ranks
    }
}
