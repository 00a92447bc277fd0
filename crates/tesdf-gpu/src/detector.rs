//! All contacts of a scene in one pass: as many launches for one pair of bodies as for thousands of worlds.
mod buffers;
mod options;
mod pass;
mod reduction;
mod stages;

use std::collections::BTreeMap;

use tesdf::Length;
use tesdf::collide::{
    CollideError, CollideOptions, Contacts, HiddenOverlap, Reduction, Scene, Shape, ShapeId, Statistics,
};

use buffers::{Members, Products, ROW, WORD};
pub use options::{
    Capacities, Counting, DetectorOptions, DeviceBytes, DeviceReport, Exchange, Lanes, Memory, Pruning,
};
use stages::Timing;

use crate::GpuError;
use crate::arrays::DeviceArray;
use crate::contacts::contacts;
use crate::device::Device;
use crate::images::Images;
use crate::instances::Instances;
use crate::kernels::pairs;
use crate::kernels::products::{self, DIRECTION_WORDS};
use crate::placed::{FieldFrame, Placed};

/// Finds contacts on a device; keeps shapes and buffers there from step to step.
pub struct Detector {
    device: Device,
    options: DetectorOptions,
    images: Images,
    shape_ids: Vec<ShapeId>,
    frames: Vec<FieldFrame>,
    /// Diagonals of the shapes' bounds.
    diagonals: Vec<f64>,
    products: Products,
    report: DeviceReport,
}

/// The finest tolerance of the exact mode, in the frame of a field: some times the rounding of distances in `f32`.
const FINEST: f64 = 1e-6;

impl Detector {
    /// Uploads the shapes of a scene; [`detect`](Self::detect) uploads again when there are others.
    ///
    /// # Errors
    /// [`GpuError::Shape`] for a shape that the device cannot hold, [`GpuError::TooLarge`].
    pub fn new(device: &Device, scene: &Scene, options: DetectorOptions) -> Result<Self, GpuError> {
        let products = Products::new(device, options.capacities)?;
        let mut detector = Self {
            device: device.clone(),
            options,
            images: Images::new(device, &[])?,
            shape_ids: Vec::new(),
            frames: Vec::new(),
            diagonals: Vec::new(),
            products,
            report: DeviceReport::default(),
        };
        detector.upload(scene)?;
        Ok(detector)
    }

    /// Uploads all shapes of a scene, also those that are there: after vertices have moved.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn upload(&mut self, scene: &Scene) -> Result<(), GpuError> {
        let ids = shape_ids(scene);
        let shapes: Vec<&Shape> = ids.iter().map(|&id| scene.shape(id)).collect::<Result<_, _>>()?;
        self.images = Images::new(&self.device, &shapes)?;
        self.frames = shapes.iter().map(|shape| FieldFrame::new(shape)).collect();
        self.diagonals = shapes.iter().map(|shape| shape.diagonal()).collect();
        self.shape_ids = ids;
        Ok(())
    }

    /// Moves all vertices of a shape with a conforming domain, on the device: see [`Images::move_vertices`]. Where the scene has it does not matter for what follows, but
    /// [`upload`](Self::upload) takes it from there.
    ///
    /// # Errors
    /// As [`Images::move_vertices`]; the shape's number is its place among those of the scene's instances, by id.
    pub fn move_vertices(&mut self, shape: ShapeId, positions: &DeviceArray<f32>) -> Result<(), GpuError> {
        let number = self.shape_ids.binary_search(&shape).map_err(|_| CollideError::NoShape(shape))?;
        self.images.move_vertices(&self.device, number, positions)
    }

    /// All contacts of a scene, as [`tesdf::collide::detect`] finds them, in the same order; computed in `f32`. The exact mode's
    /// tolerance is 1e-6 of the local frame at the finest. A reduction goes by the same rules, with bounds of distances in place of distances, so it may keep others.
    ///
    /// The same input gives the same bytes on the same device.
    ///
    /// # Errors
    /// What no detector takes; [`GpuError::Full`] with fixed memory; a device that refuses.
    pub fn detect(&mut self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, GpuError> {
        self.run(scene, options, Timing::Off)
    }

    /// The same, with the device time of each stage in the [`report`](Self::report); slower, as stages wait for each other.
    ///
    /// # Errors
    /// As [`detect`](Self::detect).
    pub fn detect_timed(&mut self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, GpuError> {
        self.run(scene, options, Timing::On)
    }

    /// What the last detection did.
    pub fn report(&self) -> &DeviceReport {
        &self.report
    }

    /// The device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Bytes that are held on the device.
    pub fn bytes(&self) -> DeviceBytes {
        DeviceBytes {
            shapes: self.images.bytes(),
            products: self.products.account(),
            per_instance: (pairs::INSTANCE_ROWS + pairs::BOUNDS_ROWS) * ROW + pairs::INSTANCE_WORDS * WORD,
        }
    }

    fn run(&mut self, scene: &Scene, options: &CollideOptions, timing: Timing) -> Result<Contacts, GpuError> {
        options.validate()?;
        if shape_ids(scene) != self.shape_ids {
            if self.images.have_moved() {
                return Err(GpuError::Unavailable {
                    what: "a scene with other shapes than those that have moved".into(),
                    instead: "upload the scene, and move its vertices again",
                });
            }
            self.upload(scene)?;
        }
        // The processor's tree knows nothing of what has moved here.
        let most_tests = if self.images.have_moved() { u64::MAX } else { self.options.most_pair_tests };
        let instances = Instances::new(scene, options, &self.shape_ids, &self.frames, most_tests)?;
        self.report = DeviceReport::default();
        loop {
            self.report.passes += 1;
            if options.reduction != Reduction::None && self.products.members.is_none() {
                self.products.members = Some(Members::new(&self.device, self.products.room)?);
            }
            let counts = self.pass(&instances, options, timing)?;
            if !self.grow(&counts)? {
                self.report.counts = counts;
                return self.contacts(scene, &instances, options);
            }
        }
    }

    /// Makes room for what a pass has wanted. Whether there was too little; later stages have then seen too little too.
    fn grow(&mut self, counts: &[u32; products::COUNTERS]) -> Result<bool, GpuError> {
        let mut room = self.products.room;
        let wanted = [
            ("directions", &mut room.directions, products::DIRECTIONS),
            ("blocks", &mut room.blocks, products::BLOCKS),
            ("meshlets", &mut room.meshlets, products::MESHLETS),
            ("polygons", &mut room.polygons, products::POLYGONS),
            ("contacts", &mut room.contacts, products::CONTACTS),
            ("kept contacts", &mut room.kept, products::KEPT),
        ];
        for (buffer, capacity, product) in wanted {
            let needed = counts[product as usize];
            if needed > *capacity {
                if self.options.memory == Memory::Fixed {
                    let device = self.device.info().name.clone();
                    return Err(GpuError::Full { device, buffer, capacity: *capacity, needed });
                }
                *capacity = needed.saturating_add(needed / 4);
            }
        }
        if room == self.products.room {
            return Ok(false);
        }
        self.products = Products::new(&self.device, room)?;
        Ok(true)
    }

    /// In the frame of each instance's field; not finer than what `f32` can tell.
    fn tolerances(&self, instances: &Instances, tolerance: Length) -> Vec<f32> {
        let in_field = |(at, &shape): (&Placed, &usize)| {
            let scale = at.unit / self.frames[shape].unit();
            let diagonal = self.diagonals[shape].min(f64::MAX) * scale;
            (tolerance.resolve(diagonal) / at.unit).max(FINEST) as f32
        };
        instances.placed.iter().zip(&instances.shapes).map(in_field).collect()
    }

    fn contacts(
        &mut self,
        scene: &Scene,
        instances: &Instances,
        options: &CollideOptions,
    ) -> Result<Contacts, GpuError> {
        let counts = self.report.counts;
        let count = |product: u32| counts[product as usize] as usize;
        let found = count(products::CONTACTS);
        let shapes: Vec<&Shape> =
            self.shape_ids.iter().map(|&id| scene.shape(id)).collect::<Result<_, _>>()?;
        let (words, rows) = match (options.reduction, &self.products.members) {
            (Reduction::PerPair(_), Some(members)) => {
                let kept = count(products::KEPT);
                (self.device.read(&members.kept_words, kept)?, self.device.read(&members.kept_rows, kept)?)
            }
            _ => {
                let products = &self.products;
                (
                    self.device.read(&products.contact_words, found)?,
                    self.device.read(&products.contact_rows, found)?,
                )
            }
        };
        self.report.read += size_of_val(words.as_slice()) + size_of_val(rows.as_slice());
        let contacts = contacts(&shapes, instances, options.mode, &words, &rows);
        let reductions = self.reductions(instances, options.reduction)?;
        let unconverged = match options.reduction {
            Reduction::None => contacts.iter().filter(|c| !c.converged).count(),
            Reduction::PerPair(_) => count(products::UNCONVERGED),
        };
        let products_bytes: usize = self.products.account().iter().map(|(_, bytes)| bytes).sum();
        let statistics = Statistics {
            instance_pairs: count(products::DIRECTIONS),
            candidates: count(products::CANDIDATES),
            polygons: count(products::POLYGONS),
            touching: found + count(products::FILTERED),
            filtered: count(products::FILTERED),
            reduced: found - contacts.len(),
            unconverged,
            bytes: products_bytes + size_of_val(contacts.as_slice()),
        };
        let hidden = HiddenOverlap::not_shown(self.overlaps(instances)?, &contacts);
        Ok(Contacts::new(contacts, statistics, reductions, hidden))
    }

    /// The pairs that overlap, as far as contacts need not show it.
    fn overlaps(&mut self, instances: &Instances) -> Result<Vec<HiddenOverlap>, GpuError> {
        if self.report.counts[products::HIDDEN as usize] == 0 {
            return Ok(Vec::new());
        }
        let count = self.report.counts[products::DIRECTIONS as usize] as usize;
        let depths: Vec<f32> = self.device.read(&self.products.depths, count)?;
        let directions: Vec<[u32; DIRECTION_WORDS]> = self.device.read(&self.products.directions, count)?;
        self.report.read += size_of_val(depths.as_slice()) + size_of_val(directions.as_slice());
        let mut deepest: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for (depth, [a, b, ..]) in depths.into_iter().zip(directions).filter(|(depth, _)| *depth > 0.0) {
            let (a, b) = (a as usize, b as usize);
            let of_pair = deepest.entry((a.min(b), a.max(b))).or_default();
            *of_pair = of_pair.max(f64::from(depth) * instances.placed[b].unit);
        }
        let overlap = |((a, b), depth)| HiddenOverlap {
            instance_a: instances.ids[a],
            instance_b: instances.ids[b],
            depth,
        };
        Ok(deepest.into_iter().map(overlap).collect())
    }
}

/// The shapes of all instances, sorted: few, of many instances.
fn shape_ids(scene: &Scene) -> Vec<ShapeId> {
    let mut ids = Vec::new();
    for (_, instance) in scene.instances() {
        if let Err(at) = ids.binary_search(&instance.shape) {
            ids.insert(at, instance.shape);
        }
    }
    ids
}
