//! One pass: the launches of all stages.
use cubecl::prelude::*;
use tesdf::collide::{CollideOptions, Mode, Reduction};

use super::buffers::{Products, ROW, WORD};
use super::stages::{Stages, Timing};
use super::{Counting, Detector, Exchange, Lanes, Pruning, reduction};
use crate::GpuError;
use crate::device::{Buffer, spread};
use crate::instances::Instances;
use crate::kernels::{broad, clip, exact, hidden, members, narrow, outside, pairs, products};

/// Threads of a group where each works alone.
const GROUP: u32 = 64;

impl Detector {
    /// Launches all stages, and reads the counters.
    pub(super) fn pass(
        &mut self,
        instances: &Instances,
        options: &CollideOptions,
        timing: Timing,
    ) -> Result<[u32; products::COUNTERS], GpuError> {
        let device = self.device.clone();
        let weights = match options.mode {
            Mode::Node => None,
            Mode::Face | Mode::Exact => Some(self.products.weights(&device)?),
        };
        let counters = device.upload("counters", &[0u32; products::COUNTERS])?;
        let mut pass = Pass {
            detector: self,
            options,
            sent: counters.bytes(),
            counters: counters.clone(),
            stages: Stages::new(&device, timing),
        };
        pass.pairs(instances)?;
        let per_meshlet = pass.meshlets()?;
        pass.hidden(per_meshlet.clone())?;
        match weights {
            None => pass.nodes(per_meshlet)?,
            Some(weights) => pass.faces(per_meshlet, instances, &weights)?,
        }
        pass.reduction()?;
        let Pass { sent, stages: Stages { launches, times, .. }, .. } = pass;
        self.report.sent += sent;
        self.report.launches = launches;
        self.report.stages = times;
        let counts: Vec<u32> = device.read(&counters, products::COUNTERS)?;
        self.report.read += counts.len() * WORD;
        if counts[products::BADLY_MOVED as usize] > 0 {
            return Err(self.images.badly_moved(&device)?);
        }
        if counts[products::BROKEN_OFF as usize] > 0 {
            return Err(GpuError::Device {
                device: device.info().name.clone(),
                doing: "detecting contacts",
                reason: format!(
                    "the driver broke off the loops of {} threads, as Mesa's llvmpipe does after 65,535 iterations: a face meets too many cells, or a \
                     pair has too many contacts to reduce. Detect on the processor or on a GPU",
                    counts[products::BROKEN_OFF as usize]
                ),
            });
        }
        Ok(std::array::from_fn(|i| counts[i]))
    }
}

/// What the launches of a pass share.
struct Pass<'a> {
    detector: &'a Detector,
    options: &'a CollideOptions,
    counters: Buffer,
    stages: Stages<'a>,
    /// Bytes sent to the device.
    sent: usize,
}

impl Pass<'_> {
    /// Bounds of the instances, and which of them meet.
    fn pairs(&mut self, instances: &Instances) -> Result<(), GpuError> {
        let Detector { device, images, products, .. } = self.detector;
        let Products { room, directions, maps, blocks, .. } = products;
        let counters = &self.counters;
        let rows = device.upload("instances", &instances.rows)?;
        let words = device.upload("words of instances", &instances.words)?;
        let excluded = device.upload("excluded pairs", &instances.excluded)?;
        self.sent += rows.bytes() + words.bytes() + excluded.bytes();
        let count = instances.ids.len() as u32;
        let bounds = device.empty("bounds of instances", instances.ids.len() * pairs::BOUNDS_ROWS * ROW)?;
        let contact_distance = self.options.contact_distance as f32;
        self.stages.run("instance bounds", || {
            pairs::instance_bounds::launch(
                device.client(),
                spread(count.div_ceil(GROUP)),
                CubeDim::new_1d(GROUP),
                images.argument(),
                rows.rows(),
                words.words(),
                counters.words(),
                bounds.rows(),
                count,
                contact_distance,
            );
        })?;
        let given = match &instances.pairs {
            Some(pairs) => Some((device.upload("pairs", pairs)?, pairs.len() as u32 / 2)),
            None => None,
        };
        self.sent += given.as_ref().map_or(0, |(pairs, _)| pairs.bytes());
        self.stages.run("instance pairs", || match &given {
            Some((pairs, count)) => pairs::given_pairs::launch(
                device.client(),
                spread(count.div_ceil(GROUP)),
                CubeDim::new_1d(GROUP),
                images.argument(),
                rows.rows(),
                words.words(),
                pairs.words(),
                counters.words(),
                directions.words(),
                maps.rows(),
                blocks.words(),
                *count,
                contact_distance,
                room.directions,
                room.blocks,
            ),
            None => pairs::instance_pairs::launch(
                device.client(),
                spread(count.div_ceil(GROUP)),
                CubeDim::new_1d(GROUP),
                images.argument(),
                rows.rows(),
                bounds.rows(),
                words.words(),
                excluded.words(),
                counters.words(),
                directions.words(),
                maps.rows(),
                blocks.words(),
                count,
                instances.excluded.len() as u32 / 2,
                contact_distance,
                room.directions,
                room.blocks,
            ),
        })
    }

    /// Which meshlets can touch; groups of launches over them.
    fn meshlets(&mut self) -> Result<CubeCount, GpuError> {
        let Detector { device, images, products, .. } = self.detector;
        let Products { room, directions, maps, blocks, meshlets, .. } = products;
        let per_block = self.groups_for(room.blocks, 1, products::BLOCKS)?;
        let (counters, prune) = (&self.counters, self.prune());
        self.stages.run("meshlets", || {
            broad::meshlets::launch(
                device.client(),
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
        self.groups_for(room.meshlets, 1, products::MESHLETS)
    }

    /// Overlaps that no contact need show.
    fn hidden(&mut self, per_meshlet: CubeCount) -> Result<(), GpuError> {
        let Detector { device, images, products, .. } = self.detector;
        let Products { room, directions, maps, meshlets, depths, .. } = products;
        let by_faces = u32::from(self.options.mode == Mode::Node);
        self.stages.run("no depths", || {
            members::clear::launch(
                device.client(),
                spread(room.directions.div_ceil(members::GROUP)),
                CubeDim::new_1d(members::GROUP),
                depths.words(),
                room.directions,
            );
        })?;
        self.stages.run("hidden overlaps", || {
            hidden::hidden::launch(
                device.client(),
                per_meshlet,
                CubeDim::new_1d(narrow::LANES),
                images.argument(),
                directions.words(),
                maps.rows(),
                meshlets.words(),
                self.counters.words(),
                depths.words(),
                room.meshlets,
                by_faces,
            );
        })
    }

    /// Nodes with their cells, and Node-TES.
    fn nodes(&mut self, per_meshlet: CubeCount) -> Result<(), GpuError> {
        let Detector { device, images, products, .. } = self.detector;
        let Products { room, directions, maps, meshlets, polygons, contact_words, contact_rows, .. } =
            products;
        let prune = self.prune();
        self.stages.run("nodes", || {
            clip::nodes::launch(
                device.client(),
                per_meshlet,
                CubeDim::new_1d(narrow::LANES),
                images.argument(),
                directions.words(),
                maps.rows(),
                meshlets.words(),
                self.counters.words(),
                polygons.words(),
                room.meshlets,
                room.polygons,
                prune,
            );
        })?;
        let per_node = self.groups_for(room.polygons, GROUP, products::POLYGONS)?;
        self.stages.run("node narrow phase", || {
            narrow::narrow_nodes::launch(
                device.client(),
                per_node,
                CubeDim::new_1d(GROUP),
                images.argument(),
                directions.words(),
                maps.rows(),
                polygons.words(),
                self.counters.words(),
                contact_words.words(),
                contact_rows.rows(),
                room.polygons,
                room.contacts,
            );
        })
    }

    /// Faces clipped by their cells, and Face-TES or the exact minimum.
    fn faces(
        &mut self,
        per_meshlet: CubeCount,
        instances: &Instances,
        weights: &Buffer,
    ) -> Result<(), GpuError> {
        let Detector { device, images, products, options: with, .. } = self.detector;
        let Products { room, directions, maps, meshlets, polygons, contact_words, contact_rows, .. } =
            products;
        let (counters, prune) = (&self.counters, self.prune());
        self.stages.run("polygons", || {
            clip::polygons::launch(
                device.client(),
                per_meshlet.clone(),
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
        if images.conforming() > 0 {
            self.stages.run("outside of domains", || {
                outside::outside_polygons::launch(
                    device.client(),
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
        }
        let by_iterations = self.options.mode == Mode::Face;
        let (per, lanes) = match with.lanes {
            Lanes::Single if by_iterations => (narrow::LANES, 1),
            _ => (1, narrow::LANES),
        };
        let per_polygon = self.groups_for(room.polygons, per, products::POLYGONS)?;
        let counters = &self.counters;
        // Above any cosine: nothing is filtered.
        let cos_theta = self.options.cos_theta.map_or(-2.0, |cos| cos as f32);
        match self.options.mode {
            Mode::Node | Mode::Face => {
                let planes = with.exchange == Exchange::Device && device.has_planes_of_32();
                self.stages.run("face narrow phase", || {
                    narrow::narrow_faces::launch(
                        device.client(),
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
                        self.options.iterations,
                        cos_theta,
                        room.polygons,
                        room.contacts,
                        lanes,
                        planes,
                        with.counting == Counting::Operations,
                    );
                })
            }
            Mode::Exact => {
                let tolerances = self.detector.tolerances(instances, self.options.tolerance);
                let tolerances = device.upload("tolerances", &tolerances)?;
                self.sent += tolerances.bytes();
                self.stages.run("exact narrow phase", || {
                    exact::narrow_exact::launch(
                        device.client(),
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
                })
            }
        }
    }

    /// Reduces the contacts of each pair, if that is asked for.
    fn reduction(&mut self) -> Result<(), GpuError> {
        let products = &self.detector.products;
        let (Reduction::PerPair(most), Some(members)) = (self.options.reduction, &products.members) else {
            return Ok(());
        };
        let client = self.detector.device.client();
        let (counters, groups) = (&self.counters, &products.groups);
        let groups_for = |stages: &mut Stages, most, per, product| {
            groups_for(stages, client, counters, groups, most, per, product)
        };
        reduction::launch(&mut self.stages, groups_for, client, products, members, counters, most)
    }

    /// Groups of the next launch: see [`products::groups_for`].
    fn groups_for(&mut self, most: u32, per: u32, product: u32) -> Result<CubeCount, GpuError> {
        let Detector { device, products, .. } = self.detector;
        groups_for(&mut self.stages, device.client(), &self.counters, &products.groups, most, per, product)
    }

    fn prune(&self) -> u32 {
        u32::from(self.detector.options.pruning == Pruning::LeastDistance)
    }
}

fn groups_for(
    stages: &mut Stages,
    client: &cubecl::client::Client,
    counters: &Buffer,
    groups: &Buffer,
    most: u32,
    per: u32,
    product: u32,
) -> Result<CubeCount, GpuError> {
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
    Ok(groups.count())
}
