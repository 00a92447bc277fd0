//! Pairs of instances whose contacts kernels do not find. The processor does.
use tesdf::collide::{
    CollideError, CollideOptions, Contact, Contacts, HiddenOverlap, InstanceId, InstancePair, InstancePairs,
    Mode, Scene, Shape, detect_pairs,
};

use super::device_contacts::DeviceContacts;
use super::pass::{Parts, parts};
use crate::GpuError;
use crate::device::{Device, DeviceArray, Word};

/// Whether the processor finds all contacts: Frank–Wolfe over whole faces has no kernel.
pub fn finds_all(options: &CollideOptions) -> bool {
    matches!(options.mode, Mode::Face { .. }) && parts(options) == Parts::Faces
}

/// The pairs of instances that the processor detects: all, or those of the shapes that kernels do
/// not detect.
pub fn pairs_on_processor(
    scene: &Scene,
    options: &CollideOptions,
) -> Result<Vec<InstancePair>, CollideError> {
    let all = finds_all(options);
    if !all && !has_undetected(scene) {
        return Ok(Vec::new());
    }
    let mut pairs = InstancePairs::new();
    pairs.update(scene, options)?;
    let of_shape = |id| scene.instance(id).and_then(|instance| scene.shape(instance.shape));
    let has = |id| of_shape(id).is_ok_and(|shape| !is_detected(shape));
    let kept = pairs.pairs().iter().filter(|pair| all || has(pair.first) || has(pair.second));
    Ok(kept.copied().collect())
}

/// Whether a scene has shapes whose contacts kernels do not find.
pub fn has_undetected(scene: &Scene) -> bool {
    scene.shapes().any(|(_, shape)| !is_detected(shape))
}

/// Whether kernels find the contacts of a shape.
pub fn is_detected(shape: &Shape) -> bool {
    match shape {
        Shape::Mesh(asset) => asset.is_detected_on_devices(),
        Shape::Cylinder { .. } => false,
        _ => true,
    }
}

/// The place of the contacts of two instances in the order of all.
fn place(scene: &Scene, a: InstanceId, b: InstanceId) -> (u32, InstanceId, InstanceId) {
    let world = scene.instance(a).map_or(0, |instance| instance.world);
    (world, a.min(b), a.max(b))
}

/// Overlaps of both, in the order of all.
fn merged(scene: &Scene, one: &[HiddenOverlap], other: &[HiddenOverlap]) -> Vec<HiddenOverlap> {
    let mut hidden = [one, other].concat();
    hidden.sort_by_key(|h| place(scene, h.instance_a, h.instance_b));
    hidden
}

/// Adds the contacts of pairs that the processor detects to those of all other pairs, in the order
/// of all.
pub fn with_pairs(
    found: Contacts,
    pairs: &[InstancePair],
    scene: &Scene,
    options: &CollideOptions,
) -> Result<Contacts, CollideError> {
    if pairs.is_empty() {
        return Ok(found);
    }
    let others = detect_pairs(pairs, scene, options)?;
    let mut statistics = found.statistics;
    statistics += others.statistics;
    let mut reductions = [found.reductions.clone(), others.reductions.clone()].concat();
    reductions.sort_by_key(|r| (r.instance_a, r.instance_b));
    let hidden = merged(scene, &found.hidden, &others.hidden);
    // Both are sorted within each pair, which a stable sort keeps.
    let mut contacts = [found.into_vec(), others.into_vec()].concat();
    contacts.sort_by_key(|c| place(scene, c.instance_a, c.instance_b));
    Ok(Contacts::new(contacts, statistics, reductions, hidden))
}

/// The same for contacts that stay on a device.
pub fn with_pairs_on_device(
    found: DeviceContacts,
    pairs: &[InstancePair],
    scene: &Scene,
    options: &CollideOptions,
    device: &Device,
) -> Result<DeviceContacts, GpuError> {
    if pairs.is_empty() {
        return Ok(found);
    }
    let others = detect_pairs(pairs, scene, options)?;
    let ids = found.instances.read(device)?;
    let of_device = ids.chunks_exact(2).map(|pair| (InstanceId(pair[0]), InstanceId(pair[1])));
    let all = of_device.chain(others.iter().map(|c| (c.instance_a, c.instance_b)));
    let mut order: Vec<_> = all.map(|(a, b)| place(scene, a, b)).zip(0..).collect();
    // The second number keeps the order within each pair.
    order.sort_unstable();
    let order: Vec<usize> = order.into_iter().map(|(_, at)| at).collect();
    let both = Both { device, others: others.as_slice(), order: &order };
    let merged = DeviceContacts {
        count: order.len(),
        points_a: both.array(&found.points_a, |c| c.point_a.as_vec3().to_array())?,
        points_b: both.array(&found.points_b, |c| c.point_b.as_vec3().to_array())?,
        normals: both.array(&found.normals, |c| c.normal.as_vec3().to_array())?,
        distances: both.array(&found.distances, |c| [c.distance as f32])?,
        instances: both.array(&found.instances, |c| [c.instance_a.0, c.instance_b.0])?,
        hidden: merged(scene, &found.hidden, &others.hidden),
    };
    device.wait()?;
    Ok(merged)
}

/// Contacts of a device and of the processor.
struct Both<'a> {
    device: &'a Device,
    /// Those of the processor.
    others: &'a [Contact],
    /// For each place, the contact that comes there; those of the processor follow those of the
    /// device.
    order: &'a [usize],
}

impl Both<'_> {
    /// An array of all contacts, from that of the device and the rows of the others.
    fn array<T: Word, const N: usize>(
        &self,
        found: &DeviceArray<T>,
        row: impl Fn(&Contact) -> [T; N],
    ) -> Result<DeviceArray<T>, GpuError> {
        let mut rows = found.read(self.device)?;
        rows.extend(self.others.iter().flat_map(row));
        let ordered: Vec<T> =
            self.order.iter().flat_map(|&at| &rows[N * at..N * (at + 1)]).copied().collect();
        DeviceArray::upload(self.device, &ordered)
    }
}
