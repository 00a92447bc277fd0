//! Instances whose contacts kernels do not find. The processor does.
use std::borrow::Cow;

use tesdf::collide::{
    CollideError, CollideOptions, Contacts, InstanceId, InstancePair, InstancePairs, Scene, Shape,
    Statistics, detect_pairs,
};

/// A scene by where contacts are found.
pub struct Divided<'a> {
    /// The scene without the instances of [`on_processor`](Self::on_processor).
    pub on_device: Cow<'a, Scene>,
    /// The instances that kernels do not detect, in the order of ids. The processor finds all their contacts.
    pub on_processor: Vec<InstanceId>,
}

impl<'a> Divided<'a> {
    /// Divides the instances of a scene by their shapes.
    pub fn new(scene: &'a Scene) -> Result<Self, CollideError> {
        let is_undetected = |shape: &Shape| why_undetected(shape).is_some();
        if !scene.shapes().any(|(_, shape)| is_undetected(shape)) {
            return Ok(Self { on_device: Cow::Borrowed(scene), on_processor: Vec::new() });
        }
        let mut on_processor = Vec::new();
        for (id, instance) in scene.instances() {
            if is_undetected(scene.shape(instance.shape)?) {
                on_processor.push(id);
            }
        }
        let mut on_device = scene.clone();
        on_device.remove(&on_processor)?;
        Ok(Self { on_device: Cow::Owned(on_device), on_processor })
    }

    /// The pairs of instances that the processor detects.
    pub fn pairs(&self, scene: &Scene, options: &CollideOptions) -> Result<Vec<InstancePair>, CollideError> {
        if self.on_processor.is_empty() {
            return Ok(Vec::new());
        }
        let mut pairs = InstancePairs::new();
        pairs.update(scene, options)?;
        let has = |id: &InstanceId| self.on_processor.binary_search(id).is_ok();
        Ok(pairs.pairs().iter().filter(|pair| has(&pair.first) || has(&pair.second)).copied().collect())
    }
}

/// Why kernels do not detect the contacts of a shape; `None` when they do.
pub fn why_undetected(shape: &Shape) -> Option<String> {
    match shape {
        Shape::Mesh(asset) => asset.undetected_on_devices(),
        _ => None,
    }
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
    let (one, other) = (found.statistics, others.statistics);
    let statistics = Statistics {
        instance_pairs: one.instance_pairs + other.instance_pairs,
        candidates: one.candidates + other.candidates,
        polygons: one.polygons + other.polygons,
        touching: one.touching + other.touching,
        filtered: one.filtered + other.filtered,
        reduced: one.reduced + other.reduced,
        unconverged: one.unconverged + other.unconverged,
        bytes: one.bytes + other.bytes,
    };
    // Both are sorted within each pair, which a stable sort keeps.
    let place = |a: InstanceId, b: InstanceId| {
        let world = scene.instance(a).map_or(0, |instance| instance.world);
        (world, a.min(b), a.max(b))
    };
    let mut reductions = [found.reductions.clone(), others.reductions.clone()].concat();
    reductions.sort_by_key(|r| (r.instance_a, r.instance_b));
    let mut hidden = [found.hidden.clone(), others.hidden.clone()].concat();
    hidden.sort_by_key(|h| place(h.instance_a, h.instance_b));
    let mut contacts = [found.into_vec(), others.into_vec()].concat();
    contacts.sort_by_key(|c| place(c.instance_a, c.instance_b));
    Ok(Contacts::new(contacts, statistics, reductions, hidden))
}
