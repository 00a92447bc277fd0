//! All contacts of a scene in one pass: as many launches for one pair of bodies as for thousands of worlds.
use std::time::Duration;

use cubecl::prelude::*;
use tesdf::collide::{
    CollideOptions, Contacts, FaceMethod, Mode, Scene, Shape, ShapeId, Statistics, reduce_pairs,
};

use crate::GpuError;
use crate::contacts::{Row, Words, contacts};
use crate::device::{Buffer, Device};
use crate::images::{ImageBytes, Images};
use crate::instances::Instances;
use crate::kernels::{broad, clip, exact, narrow, pairs, products};
use crate::placed::{FieldFrame, Placed};
use tesdf::encode::Length;

/// Most elements of the products that stages hand on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacities {
    /// Ordered pairs of instances.
    pub directions: u32,
    /// Runs of 32 meshlets of a direction.
    pub blocks: u32,
    /// Meshlets that can touch.
    pub meshlets: u32,
    /// Clipped faces, or nodes, with their cells.
    pub polygons: u32,
    /// Contacts.
    pub contacts: u32,
}

impl Default for Capacities {
    /// Some 10 MiB.
    fn default() -> Self {
        Self { directions: 1 << 10, blocks: 1 << 12, meshlets: 1 << 14, polygons: 1 << 16, contacts: 1 << 14 }
    }
}

/// What happens when a product does not fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Memory {
    /// Buffers grow and the pass is redone.
    #[default]
    Grow,
    /// The detection fails with [`GpuError::Full`].
    Fixed,
}

/// How a polygon is worked on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lanes {
    /// 32 threads, which share the faces of the cell's list.
    #[default]
    Group,
    /// A thread alone, for comparison (Fig. 4).
    Single,
}

/// How a group finds the least of its distances. The result is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Exchange {
    /// Between the threads of a plane where those are 32, else through shared memory.
    #[default]
    Device,
    /// Through shared memory.
    Shared,
}

/// What is left out before the narrow phase. Contacts are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pruning {
    /// What the least signed distances of meshlets, faces and cells rule out.
    #[default]
    LeastDistance,
    /// What lies out of the bounds or the domain of the field, for comparison.
    Bounds,
}

/// What is counted besides the products of the stages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Counting {
    /// Nothing.
    #[default]
    Products,
    /// Evaluations of the field and point–triangle distances of Face-TES; costs two atomic additions a polygon.
    Operations,
}

/// Options of a detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DetectorOptions {
    /// Room at the start.
    pub capacities: Capacities,
    /// What happens when it is not enough.
    pub memory: Memory,
    /// How a polygon is worked on.
    pub lanes: Lanes,
    /// How its threads exchange values.
    pub exchange: Exchange,
    /// What is left out before the narrow phase.
    pub pruning: Pruning,
    /// What is counted besides the products.
    pub counting: Counting,
    /// Up to so many pairs of instances within worlds the device looks at all of them; beyond, the processor finds those that meet, by a tree.
    pub most_pair_tests: u64,
}

impl Default for DetectorOptions {
    /// Growing buffers, groups of 32, pruning, 2^27 tests of bounds.
    fn default() -> Self {
        Self {
            capacities: Capacities::default(),
            memory: Memory::default(),
            lanes: Lanes::default(),
            exchange: Exchange::default(),
            pruning: Pruning::default(),
            counting: Counting::default(),
            most_pair_tests: 1 << 27,
        }
    }
}

/// What a detection did on the device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceReport {
    /// Launches of one pass, whatever the scene.
    pub launches: usize,
    /// Passes: more than one when buffers grew.
    pub passes: usize,
    /// Bytes that were sent to the device.
    pub sent: usize,
    /// Bytes that were read back.
    pub read: usize,
    /// What was counted: directions, blocks, meshlets, polygons, contacts, filtered, candidates, broken off, evaluations,
    /// point–triangle distances; the last two when they were asked for.
    pub counts: [u32; products::COUNTERS],
    /// Device time by stage, when it was asked for.
    pub stages: Vec<(&'static str, Duration)>,
}

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

/// Buffers between the stages.
struct Products {
    room: Capacities,
    directions: Buffer,
    maps: Buffer,
    blocks: Buffer,
    meshlets: Buffer,
    polygons: Buffer,
    weights: Buffer,
    contact_words: Buffer,
    contact_rows: Buffer,
    groups: Buffer,
}

/// Bytes on the device, by buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceBytes {
    /// Shapes.
    pub shapes: ImageBytes,
    /// Products of the stages.
    pub products: usize,
    /// State of an instance.
    pub per_instance: usize,
}

/// The finest tolerance of the exact mode, in the frame of a field: some times the rounding of distances in `f32`.
const FINEST: f64 = 1e-6;

const WORD: usize = 4;
const ROW: usize = 16;

impl Products {
    fn new(device: &Device, room: Capacities) -> Result<Self, GpuError> {
        let buffer = |name, count: u32, size: usize| device.empty(name, count as usize * size);
        Ok(Self {
            room,
            directions: buffer("directions", room.directions, products::DIRECTION_WORDS * WORD)?,
            maps: buffer("maps of directions", room.directions, products::DIRECTION_ROWS * ROW)?,
            blocks: buffer("blocks", room.blocks, products::PAIR_WORDS * WORD)?,
            meshlets: buffer("meshlets", room.meshlets, products::PAIR_WORDS * WORD)?,
            polygons: buffer("polygons", room.polygons, products::POLYGON_WORDS * WORD)?,
            weights: buffer("weights of polygons", room.polygons, products::POLYGON_ROWS * ROW)?,
            contact_words: buffer("contacts", room.contacts, products::CONTACT_WORDS * WORD)?,
            contact_rows: buffer("rows of contacts", room.contacts, products::CONTACT_ROWS * ROW)?,
            groups: device.empty("groups", 3 * WORD)?,
        })
    }

    fn bytes(&self) -> usize {
        let buffers = [
            &self.directions,
            &self.maps,
            &self.blocks,
            &self.meshlets,
            &self.polygons,
            &self.weights,
            &self.contact_words,
            &self.contact_rows,
            &self.groups,
        ];
        buffers.into_iter().map(Buffer::bytes).sum()
    }
}

/// Whether stages are timed.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Timing {
    Off,
    On,
}

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

    /// All contacts of a scene, as [`tesdf::collide::detect`] finds them, in the same order; computed in `f32`. The exact mode's
    /// tolerance is 1e-6 of the local frame at the finest.
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
            products: self.products.bytes(),
            per_instance: pairs::INSTANCE_ROWS * ROW + pairs::INSTANCE_WORDS * WORD,
        }
    }

    fn run(&mut self, scene: &Scene, options: &CollideOptions, timing: Timing) -> Result<Contacts, GpuError> {
        options.validate()?;
        if shape_ids(scene) != self.shape_ids {
            self.upload(scene)?;
        }
        let instances =
            Instances::new(scene, options, &self.shape_ids, &self.frames, self.options.most_pair_tests)?;
        self.report = DeviceReport::default();
        loop {
            self.report.passes += 1;
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

    /// Launches all stages, and reads the counters.
    fn pass(
        &mut self,
        instances: &Instances,
        options: &CollideOptions,
        timing: Timing,
    ) -> Result<[u32; products::COUNTERS], GpuError> {
        let device = self.device.clone();
        let client = device.client();
        let rows = device.upload("instances", &instances.rows)?;
        let words = device.upload("words of instances", &instances.words)?;
        let excluded = device.upload("excluded pairs", &instances.excluded)?;
        let counters = device.upload("counters", &[0u32; products::COUNTERS])?;
        self.report.sent += rows.bytes() + words.bytes() + excluded.bytes() + counters.bytes();
        let Products {
            room,
            directions,
            maps,
            blocks,
            meshlets,
            polygons,
            weights,
            contact_words,
            contact_rows,
            groups,
        } = &self.products;
        let images = &self.images;
        let prune = u32::from(self.options.pruning == Pruning::LeastDistance);
        let mut stages = Stages { device: &device, timing, launches: 0, times: Vec::new() };
        let count = instances.ids.len() as u32;
        let given = match &instances.pairs {
            Some(pairs) => Some((device.upload("pairs", pairs)?, pairs.len() as u32 / 2)),
            None => None,
        };
        stages.run("instance pairs", || match &given {
            Some((pairs, count)) => pairs::given_pairs::launch(
                client,
                spread(count.div_ceil(64)),
                CubeDim::new_1d(64),
                images.argument(),
                rows.rows(),
                words.words(),
                pairs.words(),
                counters.words(),
                directions.words(),
                maps.rows(),
                blocks.words(),
                *count,
                options.contact_distance as f32,
                room.directions,
                room.blocks,
            ),
            None => pairs::instance_pairs::launch(
                client,
                spread(count.div_ceil(64)),
                CubeDim::new_1d(64),
                images.argument(),
                rows.rows(),
                words.words(),
                excluded.words(),
                counters.words(),
                directions.words(),
                maps.rows(),
                blocks.words(),
                count,
                instances.excluded.len() as u32 / 2,
                options.contact_distance as f32,
                room.directions,
                room.blocks,
            ),
        })?;
        let groups_for = |stages: &mut Stages, most: u32, per: u32, product: u32| {
            stages.run("groups", || {
                products::groups_for::launch(
                    client,
                    CubeCount::Static(1, 1, 1),
                    CubeDim::new_1d(1),
                    counters.words(),
                    groups.words(),
                    most,
                    per,
                    product,
                );
            })?;
            Ok::<_, GpuError>(groups.count())
        };
        let per_block = groups_for(&mut stages, room.blocks, 1, products::BLOCKS)?;
        stages.run("meshlets", || {
            broad::meshlets::launch(
                client,
                per_block,
                CubeDim::new_1d(narrow::LANES),
                images.argument(),
                directions.words(),
                maps.rows(),
                blocks.words(),
                counters.words(),
                meshlets.words(),
                room.blocks,
                room.meshlets,
                prune,
            );
        })?;
        let per_meshlet = groups_for(&mut stages, room.meshlets, 1, products::MESHLETS)?;
        match options.mode {
            Mode::Node => {
                stages.run("nodes", || {
                    clip::nodes::launch(
                        client,
                        per_meshlet,
                        CubeDim::new_1d(narrow::LANES),
                        images.argument(),
                        directions.words(),
                        maps.rows(),
                        meshlets.words(),
                        counters.words(),
                        polygons.words(),
                        room.meshlets,
                        room.polygons,
                        prune,
                    );
                })?;
                let per_node = groups_for(&mut stages, room.polygons, 64, products::POLYGONS)?;
                stages.run("node narrow phase", || {
                    narrow::narrow_nodes::launch(
                        client,
                        per_node,
                        CubeDim::new_1d(64),
                        images.argument(),
                        directions.words(),
                        maps.rows(),
                        polygons.words(),
                        counters.words(),
                        contact_words.words(),
                        contact_rows.rows(),
                        room.polygons,
                        room.contacts,
                    );
                })?;
            }
            Mode::Face(method) => {
                stages.run("polygons", || {
                    clip::polygons::launch(
                        client,
                        per_meshlet,
                        CubeDim::new_1d(narrow::LANES),
                        images.argument(),
                        directions.words(),
                        maps.rows(),
                        meshlets.words(),
                        counters.words(),
                        polygons.words(),
                        weights.rows(),
                        room.meshlets,
                        room.polygons,
                        prune,
                    );
                })?;
                let (per, lanes) = match (self.options.lanes, method) {
                    (Lanes::Single, FaceMethod::FrankWolfe { .. }) => (narrow::LANES, 1),
                    _ => (1, narrow::LANES),
                };
                let per_polygon = groups_for(&mut stages, room.polygons, per, products::POLYGONS)?;
                // Above any cosine: nothing is filtered.
                let cos_theta = options.cos_theta.map_or(-2.0, |cos| cos as f32);
                match method {
                    FaceMethod::FrankWolfe { iterations } => {
                        let planes = self.options.exchange == Exchange::Device && device.has_planes_of_32();
                        stages.run("face narrow phase", || {
                            narrow::narrow_faces::launch(
                                client,
                                per_polygon,
                                CubeDim::new_1d(narrow::LANES),
                                images.argument(),
                                directions.words(),
                                maps.rows(),
                                polygons.words(),
                                weights.rows(),
                                counters.words(),
                                contact_words.words(),
                                contact_rows.rows(),
                                iterations,
                                cos_theta,
                                room.polygons,
                                room.contacts,
                                lanes,
                                planes,
                                self.options.counting == Counting::Operations,
                            );
                        })?;
                    }
                    FaceMethod::Exact { tolerance } => {
                        let tolerances =
                            device.upload("tolerances", &self.tolerances(instances, tolerance))?;
                        self.report.sent += tolerances.bytes();
                        stages.run("exact narrow phase", || {
                            exact::narrow_exact::launch(
                                client,
                                per_polygon,
                                CubeDim::new_1d(narrow::LANES),
                                images.argument(),
                                directions.words(),
                                maps.rows(),
                                polygons.words(),
                                weights.rows(),
                                counters.words(),
                                contact_words.words(),
                                contact_rows.rows(),
                                tolerances.words(),
                                cos_theta,
                                room.polygons,
                                room.contacts,
                            );
                        })?;
                    }
                }
            }
        }
        let Stages { launches, times, .. } = stages;
        self.report.launches = launches;
        self.report.stages = times;
        let counts: Vec<u32> = device.read(&counters, products::COUNTERS)?;
        if counts[products::BROKEN_OFF as usize] > 0 {
            return Err(GpuError::Device {
                device: device.info().name.clone(),
                doing: "detecting contacts",
                reason: format!(
                    "the driver broke off the loops of {} threads, as Mesa's llvmpipe does after 65,535 iterations: a face meets too many cells. \
                     Detect on the processor or on a GPU",
                    counts[products::BROKEN_OFF as usize]
                ),
            });
        }
        self.report.read += counts.len() * WORD;
        Ok(std::array::from_fn(|i| counts[i]))
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
        let found = counts[products::CONTACTS as usize] as usize;
        let words: Vec<Words> = self.device.read(&self.products.contact_words, found)?;
        let rows: Vec<Row> = self.device.read(&self.products.contact_rows, found)?;
        self.report.read += size_of_val(words.as_slice()) + size_of_val(rows.as_slice());
        let shapes: Vec<&Shape> =
            self.shape_ids.iter().map(|&id| scene.shape(id)).collect::<Result<_, _>>()?;
        let contacts = contacts(&shapes, instances, options.mode, &words, &rows);
        let count = |product: u32| counts[product as usize] as usize;
        let mut statistics = Statistics {
            instance_pairs: count(products::DIRECTIONS),
            candidates: count(products::CANDIDATES),
            polygons: count(products::POLYGONS),
            touching: found + count(products::FILTERED),
            filtered: count(products::FILTERED),
            unconverged: contacts.iter().filter(|c| !c.converged).count(),
            bytes: self.products.bytes() + size_of_val(contacts.as_slice()),
            ..Statistics::default()
        };
        let all = contacts.len();
        let (contacts, reductions) = reduce_pairs(contacts, options.reduction);
        statistics.reduced = all - contacts.len();
        Ok(Contacts { contacts, statistics, reductions })
    }
}

fn shape_ids(scene: &Scene) -> Vec<ShapeId> {
    let mut ids: Vec<ShapeId> = scene.instances().map(|(_, instance)| instance.shape).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// Groups of a launch, in two dimensions where they are more than one holds.
fn spread(groups: u32) -> CubeCount {
    let wide = groups.clamp(1, 32768);
    CubeCount::Static(wide, groups.div_ceil(wide).max(1), 1)
}

/// Counts launches, and times them.
struct Stages<'a> {
    device: &'a Device,
    timing: Timing,
    launches: usize,
    times: Vec<(&'static str, Duration)>,
}

impl Stages<'_> {
    fn run(&mut self, name: &'static str, launch: impl FnOnce()) -> Result<(), GpuError> {
        self.launches += 1;
        match self.timing {
            Timing::Off => launch(),
            Timing::On => self.times.push((name, self.device.time(launch)?)),
        }
        Ok(())
    }
}
