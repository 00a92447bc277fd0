//! The instances of a scene, in the layout of the device.
use tesdf::collide::internal::Ahead;
use tesdf::collide::{CollideOptions, Instance, InstanceId, Scene, ShapeId, instance_pairs};

use super::placed::{FieldFrame, Placed};
use crate::GpuError;
use crate::kernels::pairs::ahead;
use crate::kernels::pairs::instance_pairs::{INSTANCE_ROWS, INSTANCE_WORDS};

/// The instances whose contacts kernels find, sorted by world and then by id.
pub struct Instances {
    /// Ids of the instances.
    pub ids: Vec<InstanceId>,
    /// Poses of the instances' fields.
    pub placed: Vec<Placed>,
    /// For each instance, the index of its shape.
    pub shapes: Vec<usize>,
    /// [`INSTANCE_ROWS`] rows for each instance: all poses, then all motions.
    pub rows: Vec<[f32; 4]>,
    /// [`FIXED_ROWS`](crate::kernels::scene::pose_arrays::FIXED_ROWS) rows for each instance, where
    /// an array on the device has the poses; otherwise empty.
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
    /// Collects the instances of the uploaded shapes, to which `shape_ids`, sorted, and `frames`
    /// belong. With more than `max_tests` pairs of bounds to test, the pairs are found here.
    pub fn new(
        scene: &Scene,
        options: &CollideOptions,
        shape_ids: &[ShapeId],
        frames: &[FieldFrame],
        max_tests: u64,
    ) -> Result<Self, GpuError> {
        let number_of = |instance: &Instance| shape_ids.binary_search(&instance.shape).ok();
        let mut order: Vec<(u32, InstanceId)> = scene
            .instances()
            .filter(|(_, instance)| number_of(instance).is_some())
            .map(|(id, i)| (i.world, id))
            .collect();
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
            let Some(number) = number_of(instance) else { continue };
            let placed = Placed::new(frames[number], instance.placement());
            all.rows.extend(placed.rows());
            motions
                .extend(ahead::rows(&Ahead::new(instance, shape, options.speculative_time), placed.origin));
            let (groups, still) = (instance.groups, u32::from(scene.is_still(id)));
            all.words.extend([number as u32, end as u32, groups.memberships, groups.filter, still]);
            all.placed.push(placed);
            all.shapes.push(number);
        }
        all.rows.append(&mut motions);
        let ids = scene.instances().last().map_or(0, |(last, _)| last.0 as usize + 1);
        let mut places: Vec<Option<u32>> = vec![None; ids];
        all.ids.iter().zip(0..).for_each(|(id, k)| places[id.0 as usize] = Some(k));
        let of_pair = |a: InstanceId, b: InstanceId| Some([places[a.0 as usize]?, places[b.0 as usize]?]);
        let mut excluded: Vec<[u32; 2]> =
            scene.excluded().filter_map(|(a, b)| of_pair(a, b)).map(|[a, b]| [a.min(b), a.max(b)]).collect();
        excluded.sort_unstable();
        all.excluded = excluded.into_flattened();
        let tests: u64 =
            order.chunk_by(|(v, _), (w, _)| v == w).map(|world| (world.len() as u64).pow(2) / 2).sum();
        if tests > max_tests {
            let pairs = instance_pairs(scene, options.contact_distance, options.speculative_time)?;
            let found = pairs.iter().filter_map(|pair| of_pair(pair.first, pair.second));
            all.pairs = Some(found.flatten().collect());
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
