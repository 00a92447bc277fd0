//! Finds all contacts of a scene in one pass. A pass has the same number of launches for one pair
//! of bodies as for thousands of worlds.
mod bodies;
mod buffers;
mod contacts;
mod counts;
mod device_contacts;
mod narrow;
mod on_device;
mod on_processor;
mod options;
mod pairs;
mod pass;
mod pose_arrays;
mod reduce;
pub mod scene;
mod shared;
mod stages;

use std::collections::{BTreeMap, BTreeSet};

use tesdf::Length;
use tesdf::collide::internal::in_cones;
use tesdf::collide::{
    CollideError, CollideOptions, Contacts, ContactsPer, HiddenOverlap, InstancePair, Reduction, Scene,
    Shape, ShapeId, Statistics, detect_pairs, reduce_pairs,
};

use buffers::{ContactBuffers, PipelineBuffers, ROW, WORD};
use contacts::{Row, Words, contacts, keep_minima, one_per_vertex};
pub use counts::Counts;
pub use device_contacts::DeviceContacts;
use on_processor::{finds_all, is_detected, pairs_on_processor, with_pairs};
pub use options::{
    Capacities, Counting, DetectorOptions, DeviceBytes, DeviceReport, Exchange, Lanes, Memory, Pruning,
};
use pass::{Normals, Parts, parts};
pub use pose_arrays::PoseArrays;
use scene::instances::Instances;
use scene::placed::{FieldFrame, Placed};
use scene::{GpuShapeId, GpuShapes};
pub use shared::SharedDetector;
use stages::Timing;

use crate::GpuError;
use crate::device::{Buffer, Device, DeviceArray};
use crate::kernels::detect::ordered_pair::WORDS as PAIR_WORDS;
use crate::kernels::pairs::instance_pairs::{BOUNDS_ROWS, INSTANCE_ROWS, INSTANCE_WORDS};

/// Finds the contacts of a scene on a device. It keeps shapes and buffers on the device from one
/// detection to the next.
pub struct Detector {
    device: Device,
    options: DetectorOptions,
    shapes: GpuShapes,
    shape_ids: Vec<ShapeId>,
    frames: Vec<FieldFrame>,
    /// Diagonal of each shape's bounds.
    diagonals: Vec<f64>,
    buffers: PipelineBuffers,
    report: DeviceReport,
}

impl Detector {
    /// Creates a detector and uploads the shapes of a scene. When a later scene has other shapes,
    /// [`detect`](Self::detect) uploads these.
    ///
    /// # Errors
    /// [`GpuError::Shape`] for a shape that the kernels cannot read, [`GpuError::TooLarge`] for a
    /// buffer that is larger than the device can bind.
    pub fn new(device: &Device, scene: &Scene, options: DetectorOptions) -> Result<Self, GpuError> {
        let buffers = PipelineBuffers::new(device, options.capacities)?;
        let mut detector = Self {
            device: device.clone(),
            options,
            shapes: GpuShapes::upload(device, &[])?,
            shape_ids: Vec::new(),
            frames: Vec::new(),
            diagonals: Vec::new(),
            buffers,
            report: DeviceReport::default(),
        };
        detector.upload(scene)?;
        Ok(detector)
    }

    /// Uploads all shapes of a scene again. Use it after vertices of the scene's assets have moved.
    ///
    /// # Errors
    /// The errors of [`new`](Self::new).
    pub fn upload(&mut self, scene: &Scene) -> Result<(), GpuError> {
        self.upload_shapes(scene, shape_ids(scene))
    }

    fn upload_shapes(&mut self, scene: &Scene, ids: Vec<ShapeId>) -> Result<(), GpuError> {
        let shapes: Vec<Shape> = ids.iter().map(|&id| scene.shape(id).cloned()).collect::<Result<_, _>>()?;
        self.shapes = GpuShapes::upload(&self.device, &shapes)?;
        self.frames = shapes.iter().map(FieldFrame::new).collect();
        self.diagonals = shapes.iter().map(Shape::diagonal).collect();
        self.shape_ids = ids;
        Ok(())
    }

    /// Moves all vertices of a shape with a conforming domain on the device, as
    /// [`GpuShapes::move_vertices`] does. The positions replace those of the scene until the next
    /// [`upload`](Self::upload).
    ///
    /// # Errors
    /// The errors of [`GpuShapes::move_vertices`]. They number a shape by its index among the
    /// shapes of the scene's instances, sorted by id. [`GpuError::Collide`] when no instance has
    /// this shape.
    pub fn move_vertices(&mut self, shape: ShapeId, positions: &DeviceArray<f32>) -> Result<(), GpuError> {
        let number = self.shape_ids.binary_search(&shape).map_err(|_| CollideError::NoShape(shape))?;
        self.shapes.move_vertices(GpuShapeId(number as u32), positions)
    }

    /// Finds all contacts of a scene in the form and order of [`tesdf::collide::detect`], computed
    /// in `f32`. Points, normals and distances are in the world frame and the world's unit.
    ///
    /// - The tolerance of the exact mode is at least 1e-6 in the local frame.
    /// - The normals of contacts of faces are those that both bodies allow, as on the processor,
    ///   which finds them from the contacts that it reads. After
    ///   [`move_vertices`](Self::move_vertices) it does not know the shapes, and normals are
    ///   gradients of the signed distance.
    /// - Contacts of nodes are reduced on the device. This follows the rules of the processor, but
    ///   compares bounds of distances instead of distances. So it may keep other contacts.
    /// - Contacts of faces are reduced on the processor, because the loss depends on their normals.
    ///   This saves no time here. [`Reduction::Spread`] is [`Reduction::PerPair`] here.
    /// - Kernels do not detect open meshes under the rule
    ///   [`Generalized`](tesdf::base::InsideRule::Generalized), nor meshes with faces that look
    ///   inwards in places. The processor finds all contacts of their instances, in `f64`. With
    ///   contacts per face or per minimum in the mode [`Face`](tesdf::collide::Mode::Face) it finds
    ///   those of all instances, as [`tesdf::collide::detect`].
    ///   [`DeviceReport::pairs_on_processor`] counts these pairs.
    /// - The same input gives the same bytes on the same device.
    ///
    /// # Errors
    /// - [`GpuError::Collide`] for invalid options.
    /// - [`GpuError::Full`] when a buffer of fixed size is too small, [`GpuError::TooLarge`] when a
    ///   growing buffer exceeds the limit of the device.
    /// - [`GpuError::Shape`] when a shape cannot be uploaded, or a vertex was moved to an invalid
    ///   position.
    /// - [`GpuError::Unavailable`] when vertices have moved on the device and the scene now has
    ///   other shapes.
    /// - [`GpuError::Device`] when the device fails, or a driver stops the loops of a kernel early.
    ///   The next detection starts from small buffers and works, such as once there is enough
    ///   memory, unless the error says that all later calls fail.
    pub fn detect(&mut self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, GpuError> {
        self.run(scene, options, Timing::Off)
    }

    /// Finds the same contacts, and measures the device time of each stage for the
    /// [`report`](Self::report). This is slower than [`detect`](Self::detect), because the stages
    /// wait for each other.
    ///
    /// # Errors
    /// The errors of [`detect`](Self::detect).
    pub fn detect_timed(&mut self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, GpuError> {
        self.run(scene, options, Timing::On)
    }

    /// The report of the last detection.
    pub fn report(&self) -> &DeviceReport {
        &self.report
    }

    /// The device that this detector runs on.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Memory that the detector holds on the device, in bytes.
    pub fn bytes(&self) -> DeviceBytes {
        DeviceBytes {
            shapes: self.shapes.bytes(),
            pipeline: self.buffers.account(),
            per_instance: (INSTANCE_ROWS + BOUNDS_ROWS) as usize * ROW + INSTANCE_WORDS as usize * WORD,
        }
    }

    fn run(&mut self, scene: &Scene, options: &CollideOptions, timing: Timing) -> Result<Contacts, GpuError> {
        let options = &possible(options)?;
        let pairs = self.pairs_on_processor(scene, options)?;
        if finds_all(options) {
            self.report = DeviceReport { pairs_on_processor: pairs.len(), ..DeviceReport::default() };
            return Ok(detect_pairs(&pairs, scene, options)?);
        }
        let found = self.run_on_device(scene, options, timing)?;
        self.report.pairs_on_processor = pairs.len();
        Ok(with_pairs(found, &pairs, scene, options)?)
    }

    /// The pairs of instances that the processor detects.
    fn pairs_on_processor(
        &self,
        scene: &Scene,
        options: &CollideOptions,
    ) -> Result<Vec<InstancePair>, GpuError> {
        let pairs = pairs_on_processor(scene, options)?;
        let all = finds_all(options);
        if self.shapes.have_moved() && (all || !pairs.is_empty()) {
            let what = match all {
                true => "contacts per face or minimum in the mode `face`",
                false => "contacts of cylinders, open meshes and faces with the inside in front of them",
            };
            return Err(GpuError::Unavailable {
                what: format!("{what}, while vertices have moved on the device"),
                instead: "move the vertices of the scene, and upload it",
            });
        }
        Ok(pairs)
    }

    fn run_on_device(
        &mut self,
        scene: &Scene,
        options: &CollideOptions,
        timing: Timing,
    ) -> Result<Contacts, GpuError> {
        let reduction = options.reduction;
        if wants_minima(options) && self.shapes.have_moved() {
            return Err(GpuError::Unavailable {
                what: "contacts per minimum of shapes whose vertices have moved on the device".into(),
                instead: "ask for contacts per face",
            });
        }
        // Cones are known on the processor only.
        if reduction == Reduction::None || !self.has_cones(options) {
            return self.find(scene, options, timing);
        }
        let all = self.find(scene, &CollideOptions { reduction: Reduction::None, ..*options }, timing)?;
        let (mut statistics, hidden) = (all.statistics, all.hidden.clone());
        let (contacts, reductions) = reduce_pairs(all.into_vec(), options.reduction);
        statistics.reduced = statistics.touching - statistics.filtered - contacts.len();
        Ok(Contacts::new(contacts, statistics, reductions, hidden))
    }

    /// Finds all contacts, or those that a reduction on the device keeps.
    fn find(
        &mut self,
        scene: &Scene,
        options: &CollideOptions,
        timing: Timing,
    ) -> Result<Contacts, GpuError> {
        let (instances, _) = self.passes(scene, None, options, Normals::Gradients, timing)?;
        self.contacts(scene, &instances, options)
    }

    /// Makes passes until all buffers are large enough. Returns the instances, and their poses on
    /// the device.
    fn passes(
        &mut self,
        scene: &Scene,
        given: Option<&PoseArrays<'_>>,
        options: &CollideOptions,
        normals: Normals,
        timing: Timing,
    ) -> Result<(Instances, Buffer), GpuError> {
        let shape_ids = shape_ids(scene);
        if shape_ids != self.shape_ids {
            if self.shapes.have_moved() {
                return Err(GpuError::Unavailable {
                    what: "a scene with other shapes than those that have moved".into(),
                    instead: "upload the scene, and move its vertices again",
                });
            }
            self.upload_shapes(scene, shape_ids)?;
        }
        // The processor's tree knows neither vertices nor instances that have moved on the device.
        let on_processor = !self.shapes.have_moved() && given.is_none();
        let max_tests = if on_processor { self.options.max_pair_tests } else { u64::MAX };
        let mut instances = Instances::new(scene, options, &self.shape_ids, &self.frames, max_tests)?;
        if given.is_some() {
            instances.fixed = on_device::fixed_rows(scene, &instances)?;
        }
        self.report = DeviceReport::default();
        loop {
            self.report.passes += 1;
            if matches!(options.reduction, Reduction::PerPair(_)) {
                self.buffers.add_members(&self.device)?;
            }
            let pass = self.pass(&instances, given, options, normals, timing);
            let (counts, placed) = pass.inspect_err(|e| self.forget(e))?;
            if !self.grow(&counts).inspect_err(|e| self.forget(e))? {
                self.report.counts = counts;
                return Ok((instances, placed));
            }
        }
    }

    /// Enlarges the buffers that were too small in a pass. Returns whether there was one. After a
    /// buffer that was too small, later stages have found too few elements, too.
    fn grow(&mut self, counts: &Counts) -> Result<bool, GpuError> {
        let mut room = self.buffers.room;
        let wanted = [
            ("ordered pairs", &mut room.ordered_pairs, counts.ordered_pairs),
            ("blocks", &mut room.blocks, counts.blocks),
            ("meshlets", &mut room.meshlets, counts.meshlets),
            ("polygons", &mut room.polygons, counts.polygons),
            ("contacts", &mut room.contacts, counts.contacts),
            ("kept contacts", &mut room.kept, counts.kept),
        ];
        for (buffer, capacity, needed) in wanted {
            if needed > *capacity {
                if self.options.memory == Memory::Fixed {
                    let device = self.device.info().name.clone();
                    return Err(GpuError::Full { device, buffer, capacity: *capacity, needed });
                }
                *capacity = needed.saturating_add(needed / 4);
            }
        }
        if room == self.buffers.room {
            return Ok(false);
        }
        // The old ones are freed before the new ones are allocated.
        self.buffers = PipelineBuffers::new(&self.device, Capacities::NONE)?;
        self.buffers = PipelineBuffers::new(&self.device, room)?;
        Ok(true)
    }

    /// Forgets what an operation that failed has left without memory or contents: the device
    /// reports a buffer that it cannot allocate when the buffer is used. The next detection starts
    /// from small buffers again.
    fn forget(&mut self, error: &GpuError) {
        if matches!(error, GpuError::Device { .. } | GpuError::TooLarge { .. }) {
            if let Ok(buffers) = PipelineBuffers::new(&self.device, self.options.capacities) {
                self.buffers = buffers;
            }
            if !self.shapes.have_moved() {
                self.shape_ids.clear();
            }
        }
    }

    /// The tolerance for each instance, in the frame of its field.
    fn tolerances(&self, instances: &Instances, tolerance: Length) -> Vec<f32> {
        let in_field = |(at, &shape): (&Placed, &usize)| {
            let scale = at.unit / self.frames[shape].unit();
            let diagonal = self.diagonals[shape].min(f64::MAX) * scale;
            (tolerance.resolve(diagonal) / at.unit) as f32
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
        let shapes: Vec<&Shape> =
            self.shape_ids.iter().map(|&id| scene.shape(id)).collect::<Result<_, _>>()?;
        let (mut words, mut rows) = self.read_contacts(options)?;
        let mut filtered = counts.filtered as usize;
        if parts(options) == Parts::Faces && !matches!(options.reduction, Reduction::PerPair(_)) {
            if wants_minima(options) {
                filtered += keep_minima(scene, options, &shapes, instances, &mut words, &mut rows)?;
            }
            one_per_vertex(&shapes, instances, &mut words, &mut rows);
        }
        let (mut contacts, faces) = contacts(&shapes, instances, options.mode, &words, &rows);
        if self.has_cones(options)
            && let Some(options) = options.mode.faces()
        {
            let all = contacts.len();
            contacts = in_cones(scene, options, &contacts, &faces)?;
            filtered += all - contacts.len();
        }
        let reductions = self.reductions(instances, options.reduction)?;
        let (found, unconverged) = match options.reduction {
            Reduction::PerPair(_) => (counts.contacts as usize, counts.unconverged as usize),
            Reduction::None | Reduction::Spread(_) => {
                (contacts.len(), contacts.iter().filter(|c| !c.converged).count())
            }
        };
        let pipeline: usize = self.buffers.account().iter().map(|(_, bytes)| bytes).sum();
        let statistics = Statistics {
            instance_pairs: counts.ordered_pairs as usize,
            candidates: counts.candidates as usize,
            polygons: counts.polygons as usize,
            touching: found + filtered,
            filtered,
            reduced: found - contacts.len(),
            unconverged,
            bytes: pipeline + size_of_val(contacts.as_slice()),
        };
        let hidden = HiddenOverlap::not_shown(self.overlaps(instances)?, &contacts);
        Ok(Contacts::new(contacts, statistics, reductions, hidden))
    }

    /// Whether the processor knows the normal cones of contacts: those of faces that have not moved
    /// on the device.
    fn has_cones(&self, options: &CollideOptions) -> bool {
        parts(options) != Parts::Nodes && !self.shapes.have_moved()
    }

    /// The buffers with the contacts of the last pass, or with those that a reduction kept.
    fn kept(&self, options: &CollideOptions) -> ContactBuffers<'_> {
        self.buffers.kept(options.reduction, &self.report.counts)
    }

    /// Reads the contacts of the last pass, or those that a reduction kept.
    fn read_contacts(&mut self, options: &CollideOptions) -> Result<(Vec<Words>, Vec<Row>), GpuError> {
        let kept = self.kept(options);
        let words: Vec<Words> = self.device.read(kept.words, kept.count as usize)?;
        let rows: Vec<Row> = self.device.read(kept.rows, kept.count as usize)?;
        self.report.read += size_of_val(words.as_slice()) + size_of_val(rows.as_slice());
        Ok((words, rows))
    }

    /// The pairs of instances with an overlap that contacts need not show.
    fn overlaps(&mut self, instances: &Instances) -> Result<Vec<HiddenOverlap>, GpuError> {
        if self.report.counts.hidden == 0 {
            return Ok(Vec::new());
        }
        let count = self.report.counts.ordered_pairs as usize;
        let depths: Vec<f32> = self.device.read(&self.buffers.depths, count)?;
        let pairs: Vec<[u32; PAIR_WORDS as usize]> = self.device.read(&self.buffers.pair_words, count)?;
        self.report.read += size_of_val(depths.as_slice()) + size_of_val(pairs.as_slice());
        let mut deepest: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for (depth, [a, b, ..]) in depths.into_iter().zip(pairs).filter(|(depth, _)| *depth > 0.0) {
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

/// Validates options. Kernels spread contacts by a reduction.
fn possible(options: &CollideOptions) -> Result<CollideOptions, GpuError> {
    options.validate()?;
    let reduction = match options.reduction {
        Reduction::Spread(n) if !finds_all(options) => Reduction::PerPair(n),
        reduction => reduction,
    };
    Ok(CollideOptions { reduction, ..*options })
}

/// Whether contacts that are no local minima are dropped, which the processor does.
fn wants_minima(options: &CollideOptions) -> bool {
    options.mode.contacts_per() == Some(ContactsPer::Minimum)
}

/// The shapes of all instances whose contacts kernels find, sorted and without duplicates.
fn shape_ids(scene: &Scene) -> Vec<ShapeId> {
    let ids: BTreeSet<ShapeId> = scene.instances().map(|(_, instance)| instance.shape).collect();
    ids.into_iter().filter(|&id| scene.shape(id).is_ok_and(is_detected)).collect()
}
